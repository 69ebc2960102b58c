"""SQLite's files beside a GeoPackage: never replayed into our files, and included when a layer is read.

Writers that are killed and programs that keep a file open are real processes.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
from shapely import Point

from deadwood_algorithms.files import outputs
from deadwood_algorithms.files.identity import content_of, described, of_input
from deadwood_algorithms.files.outputs import output_folder, output_path
from deadwood_algorithms.files.sqlite_files import beside, is_held, settled
from deadwood_algorithms.files.vectors import read_vector, write_vector
from deadwood_algorithms.params.tool import UserError

ROWS = 2000
CLIENT = """
import os, sqlite3, sys
path, mode, what = sys.argv[1:]
db = sqlite3.connect(path, isolation_level=None)
db.execute("pragma journal_mode=" + mode)
db.execute("pragma cache_size=2")  # so that changes reach the file before they are whole
for (name,) in db.execute("select name from sqlite_master where type='trigger'").fetchall():
    db.execute(f'drop trigger "{name}"')  # they need functions that GDAL brings
db.execute("begin")
if what == "reads":
    db.execute("select count(*) from trees").fetchone()
else:
    db.execute("update trees set dbh_cm = 1.0")
    if mode == "wal":
        db.execute("commit")
if what == "dies":
    os.kill(os.getpid(), 9)
print("ready", flush=True)
sys.stdin.readline()
"""


def trees(path: Path, dbh: float) -> Path:
    """A layer with more pages than a small cache can contain."""
    points = [Point(2.7e6 + i, 1.2e6) for i in range(ROWS)]
    write_vector(path, {"trees": gpd.GeoDataFrame({"dbh_cm": np.full(ROWS, dbh)}, geometry=points, crs=2056)})
    return path


def dbh_in(path: Path, feedback=None) -> set[float]:
    return set(read_vector(path, target_crs=None, what="trees", feedback=feedback).dbh_cm)


def left_by_a_killed_writer(path: Path, mode: str) -> Path:
    trees(path, 50.0)
    assert subprocess.run([sys.executable, "-c", CLIENT, str(path), mode, "dies"]).returncode == -9
    assert {each.name.removeprefix(path.name) for each in beside(path)} >= {"-wal" if mode == "wal" else "-journal"}
    return path


@contextmanager
def held(path: Path, mode: str, what: str) -> Iterator[None]:
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", CLIENT, str(path), mode, what], stdin=pipe, stdout=pipe) as client:
        assert client.stdout is not None
        assert client.stdout.readline().strip() == b"ready"
        try:
            yield
        finally:
            client.communicate(b"\n")


@pytest.mark.parametrize("mode", ["wal", "delete"])
def test_what_a_killed_writer_left_goes_with_the_file_that_is_replaced(tmp_path, mode):
    path = left_by_a_killed_writer(tmp_path / "q.gpkg", mode)
    with output_path(path, overwrite=True) as temporary:
        trees(temporary, 37.2)
    assert dbh_in(path) == {37.2}  # before: 1.0, or a file that is malformed
    assert sorted(each.name for each in tmp_path.iterdir()) == ["q.gpkg"]


def test_a_failed_run_leaves_it_as_it_was(tmp_path):
    path = left_by_a_killed_writer(tmp_path / "q.gpkg", "wal")
    before = {each.name: each.read_bytes() for each in tmp_path.iterdir()}
    with pytest.raises(ZeroDivisionError), output_path(path, overwrite=True):
        _ = 1 / 0
    assert {each.name: each.read_bytes() for each in tmp_path.iterdir()} == before


@pytest.mark.parametrize("at", range(1, 5))
def test_a_run_killed_at_any_rename_loses_nothing(tmp_path, at):
    """Whichever rename is the last, the next run finds the old file with its changes, or the new one without them."""
    path = left_by_a_killed_writer(tmp_path / "q.gpkg", "wal")
    new = trees(tmp_path / "new.gpkg", 37.2)
    code = f"""
import os, shutil, sys
from pathlib import Path
from deadwood_algorithms.files.outputs import output_path
real, done = os.replace, []
def replace(*paths):
    real(*paths)
    done.append(paths)
    if len(done) == {at}: os.kill(os.getpid(), 9)
os.replace = replace
with output_path({str(path)!r}, True) as temporary:
    shutil.copy({str(new)!r}, temporary)
"""
    paths = str(Path(outputs.__file__).parents[2])
    assert subprocess.run([sys.executable, "-c", code], env={"PYTHONPATH": paths}).returncode == -9
    new.unlink()
    with pytest.raises(ZeroDivisionError), output_path(path, overwrite=True):
        _ = 1 / 0  # the next run tidies up before its work
    assert dbh_in(path) == ({1.0} if at < 4 else {37.2})
    assert not [each.name for each in tmp_path.iterdir() if each.name.startswith(".")]


def test_what_lies_where_a_file_was_is_not_read_into_a_new_one(tmp_path):
    path = left_by_a_killed_writer(tmp_path / "q.gpkg", "wal")
    path.unlink()
    with pytest.raises(UserError, match=r"q\.gpkg-wal: this was left beside an earlier q\.gpkg"):
        output_path(path).__enter__()
    with output_path(path, overwrite=True) as temporary:
        trees(temporary, 37.2)
    assert dbh_in(path) == {37.2}
    assert not beside(path)


@pytest.mark.skipif(os.name == "nt", reason="Windows refuses whatever is open")
@pytest.mark.parametrize(("mode", "what"), [("wal", "reads"), ("wal", "writes"), ("delete", "reads"), ("delete", "x")])
def test_a_file_that_another_program_holds_is_not_replaced(tmp_path, mode, what):
    path = trees(tmp_path / "q.gpkg", 50.0)
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "manifest.json").write_text("{}")
    trees(tmp_path / "run" / "run.gpkg", 50.0)
    with held(path, mode, what), held(tmp_path / "run" / "run.gpkg", mode, what):
        assert is_held(path)
        with pytest.raises(UserError, match=r"another program holds q\.gpkg open"):
            output_path(path, overwrite=True).__enter__()
        with pytest.raises(UserError, match=r"another program holds run\.gpkg open"):
            output_folder(tmp_path / "run", overwrite=True).__enter__()
    assert not is_held(path)
    with output_path(path, overwrite=True) as temporary:
        trees(temporary, 37.2)
    assert dbh_in(path) == {37.2}


@pytest.mark.skipif(os.name == "nt", reason="Windows refuses whatever is open")
def test_a_file_that_was_opened_during_the_run_is_not_replaced(tmp_path):
    path = trees(tmp_path / "q.gpkg", 50.0)
    run = output_path(path, overwrite=True)
    trees(run.__enter__(), 37.2)
    with held(path, "wal", "writes"), pytest.raises(UserError, match="another program holds"):
        run.__exit__(None, None, None)
    assert dbh_in(path) == {1.0}


@pytest.mark.parametrize(("mode", "dbh"), [("wal", 1.0), ("delete", 50.0)])
def test_a_layer_is_read_as_its_writer_left_it_and_stays_untouched(tmp_path, mode, dbh, said):
    """A complete change counts, an incomplete one does not; a ``-journal`` could not be read at all."""
    path = left_by_a_killed_writer(tmp_path / "q.gpkg", mode)
    before = {each.name: each.read_bytes() for each in tmp_path.iterdir()}
    assert dbh_in(path, said) == {dbh}
    assert any(beside(path)[0].name in words for words in said.notes)
    assert described(str(path))["rows"] == ROWS
    assert len(of_input(str(path))["files"]) == 2
    assert {each.name: each.read_bytes() for each in tmp_path.iterdir()} == before
    with settled(path) as copy:
        assert content_of(copy) == content_of(path)


@pytest.mark.skipif(os.name == "nt", reason="locks are others there")
def test_a_layer_that_another_program_changes_is_read_with_what_is_whole(tmp_path):
    path = trees(tmp_path / "q.gpkg", 50.0)
    with held(path, "wal", "writes"):
        assert dbh_in(path) == {1.0}
        assert content_of(path)
