"""Results appear complete or not at all, and errors that can be known before the work are reported before it."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import geopandas as gpd
import numpy as np
import pyproj
import pytest
from rasterio.errors import RasterioError
from shapely import Point

from deadwood_algorithms.files import outputs
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.outputs import output_folder, output_path
from deadwood_algorithms.files.rasters import write_raster
from deadwood_algorithms.files.vectors import write_vector
from deadwood_algorithms.params.tool import UserError


def listing(folder: Path) -> list[str]:
    return sorted(each.name for each in folder.iterdir())


def refuse_entering(context) -> str:
    """The error must come at entering: before the work."""
    with pytest.raises(UserError) as raised:
        context.__enter__()
    assert "\n" not in str(raised.value)
    return str(raised.value)


def test_a_file_gets_its_name_at_the_end_and_not_before(tmp_path):
    with output_path(tmp_path / "Bäume 1.gpkg") as temporary:
        assert temporary.name == "Bäume 1.gpkg"
        temporary.write_text("content")
        assert not (tmp_path / "Bäume 1.gpkg").exists()
    assert listing(tmp_path) == ["Bäume 1.gpkg"]
    assert (tmp_path / "Bäume 1.gpkg").read_text() == "content"


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, UserError])
def test_a_failure_leaves_nothing_and_the_old_result(tmp_path, error):
    (tmp_path / "a.tif").write_text("old")

    def fail(context, name=""):
        with context as temporary:
            (temporary / name if temporary.is_dir() else temporary).write_text("half")
            raise error

    with pytest.raises(error):
        fail(output_path(tmp_path / "a.tif", overwrite=True))
    assert listing(tmp_path) == ["a.tif"]
    assert (tmp_path / "a.tif").read_text() == "old"
    with pytest.raises(error):
        fail(output_folder(tmp_path / "new" / "run"), "x")
    assert listing(tmp_path) == ["a.tif"]


def test_an_existing_file_is_refused_unless_overwrite(tmp_path):
    (tmp_path / "a.tif").write_text("old")
    assert "--overwrite" in refuse_entering(output_path(tmp_path / "a.tif"))
    with output_path(tmp_path / "a.tif", overwrite=True) as temporary:
        temporary.write_text("new")
    assert (tmp_path / "a.tif").read_text() == "new"


def test_an_input_is_never_replaced(tmp_path):
    (tmp_path / "a.gpkg").write_text("trees")
    inputs = (None, f"{tmp_path}/./a.gpkg|layername=trees")
    assert "is also an input" in refuse_entering(output_path(tmp_path / "a.gpkg", overwrite=True, inputs=inputs))


def test_the_file_ending_is_checked_first(tmp_path):
    assert "trees.gpkg" in refuse_entering(output_path(tmp_path / "trees.shp", suffix=".gpkg"))


def test_parents_are_made_and_a_path_under_a_file_is_refused(tmp_path):
    with output_path(tmp_path / "new" / "deep" / "a.txt") as temporary:
        temporary.write_text("x")
    assert (tmp_path / "new" / "deep" / "a.txt").exists()
    (tmp_path / "file").write_text("x")
    for context in (output_path(tmp_path / "file" / "a.tif"), output_folder(tmp_path / "file" / "run")):
        assert "cannot be written to" in refuse_entering(context)
    assert listing(tmp_path) == ["file", "new"]


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a folder that even root cannot write to")
def test_an_unwritable_folder_is_refused_before_the_work():
    assert "/proc cannot be written to" in refuse_entering(output_path("/proc/a.tif"))
    assert "/proc cannot be written to" in refuse_entering(output_folder("/proc/run"))


def test_a_folder_gets_its_name_at_the_end(tmp_path):
    with output_folder(tmp_path / "run 1") as folder:
        (folder / "manifest.json").write_text("{}")
        (folder / "deep").mkdir()
        (folder / "deep" / "x").write_text("x")
        assert not (tmp_path / "run 1").exists()
    assert listing(tmp_path) == ["run 1"]
    assert listing(tmp_path / "run 1") == ["deep", "manifest.json"]
    assert (tmp_path / "run 1").stat().st_mode & 0o777 == 0o777 & ~outputs._umask()


def test_an_empty_folder_is_filled_in_place(tmp_path):
    (tmp_path / "run").mkdir()
    inode = (tmp_path / "run").stat().st_ino
    with output_folder(tmp_path / "run") as folder:
        (folder / "manifest.json").write_text("{}")
    assert listing(tmp_path / "run") == ["manifest.json"]
    assert (tmp_path / "run").stat().st_ino == inode  # it may be a mount point


def test_only_an_earlier_result_is_replaced(tmp_path):
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "thesis.txt").write_text("years of work")
    assert "--overwrite" in refuse_entering(output_folder(tmp_path / "home"))
    assert "not a result folder" in refuse_entering(output_folder(tmp_path / "home", overwrite=True))
    (tmp_path / "run").mkdir()
    for name in ("manifest.json", "old.tif"):
        (tmp_path / "run" / name).write_text("old")
    with output_folder(tmp_path / "run", overwrite=True) as folder:
        (folder / "manifest.json").write_text("new")
    assert listing(tmp_path / "run") == ["manifest.json"]
    assert listing(tmp_path) == ["home", "run"]


@pytest.mark.parametrize(
    "error",
    [
        OSError(errno.ENOSPC, "No space left on device"),
        OSError(errno.EDQUOT, "Disk quota exceeded"),
        RuntimeError("sqlite3_exec(COMMIT) failed: database or disk is full"),
    ],
)
def test_a_full_disk_is_one_line_whoever_reports_it(tmp_path, error):
    wrapped = RuntimeError("write failed")
    wrapped.__cause__ = error
    with pytest.raises(UserError, match="disk is full, nothing was written") as raised, output_path(tmp_path / "a.tif"):
        raise wrapped
    assert "\n" not in str(raised.value)
    assert listing(tmp_path) == []


def test_a_fault_of_ours_stays_one(tmp_path):
    with pytest.raises(ZeroDivisionError), output_path(tmp_path / "a.tif"):
        _ = 1 / 0


@pytest.mark.parametrize("output", [output_path, output_folder])
@pytest.mark.parametrize("name", ["result", "deep/er/result"])
def test_a_second_run_into_the_same_output_is_refused_and_harms_nothing(tmp_path, output, name):
    with output(tmp_path / name) as first:
        assert "another run is writing this output now" in refuse_entering(output(tmp_path / name))
        (first if output is output_path else first / "manifest.json").write_text("of the first")
    final = tmp_path / name if output is output_path else tmp_path / name / "manifest.json"
    assert final.read_text() == "of the first"
    assert "exists" in refuse_entering(output(tmp_path / name))  # the lock is gone, but the result is there
    assert not list(tmp_path.rglob("*.lock"))


def test_the_lock_of_a_killed_run_does_not_stay(tmp_path):
    code = (
        "import os, sys; from deadwood_algorithms.files.outputs import output_folder\n"
        f"with output_folder({str(tmp_path / 'run')!r}): os.kill(os.getpid(), 9)"
    )
    paths = str(Path(outputs.__file__).parents[2])
    assert subprocess.run([sys.executable, "-c", code], env={"PYTHONPATH": paths}).returncode == -9
    with output_folder(tmp_path / "run") as folder:
        (folder / "manifest.json").write_text("{}")
    assert (tmp_path / "run" / "manifest.json").is_file()


KILLED = """
import os, sys
from deadwood_algorithms.files import outputs
from deadwood_algorithms.files.outputs import output_folder, output_path
{before}
with {context} as made:
    (made / "manifest.json" if made.is_dir() else made).write_text("new")
    {inside}
"""
DIE = "os.kill(os.getpid(), 9)"


def killed(context: str, *, before: str = "", inside: str = "") -> None:
    """Die by SIGKILL within an output."""
    code = KILLED.format(context=context, before=before, inside=inside)
    paths = str(Path(outputs.__file__).parents[2])
    assert subprocess.run([sys.executable, "-c", code], env={"PYTHONPATH": paths}).returncode == -9


def test_what_a_killed_run_left_is_cleared_away_by_the_next(tmp_path):
    killed(f"output_folder({str(tmp_path / 'run')!r})", inside=DIE)
    killed(f"output_path({str(tmp_path / 'a.tif')!r})", inside=DIE)
    assert len([name for name in listing(tmp_path) if ".partial-" in name]) == 2
    with output_folder(tmp_path / "run") as folder:
        (folder / "manifest.json").write_text("{}")
    with output_path(tmp_path / "a.tif") as temporary:
        temporary.write_text("x")
    assert listing(tmp_path) == ["a.tif", "run"]


def test_what_another_run_is_making_is_not_cleared_away(tmp_path):
    with output_folder(tmp_path / "run") as other:
        refuse_entering(output_folder(tmp_path / "run"))
        assert other.is_dir()
        (other / "manifest.json").write_text("{}")


DIE_AT_SECOND = f"""
real, done = os.replace, []
def replace(*paths):
    if done and done[-1]: {DIE}
    done.append("-old" in str(paths[1]) or "-whole" in str(paths[0]))
    real(*paths)
os.replace = replace
"""


def test_a_kill_between_the_two_renames_loses_no_result(tmp_path):
    with output_folder(tmp_path / "run") as folder:
        (folder / "manifest.json").write_text("old")
    killed(f"output_folder({str(tmp_path / 'run')!r}, True)", before=DIE_AT_SECOND)
    assert not (tmp_path / "run").exists()
    assert "--overwrite" in refuse_entering(output_folder(tmp_path / "run"))  # it is restored, and kept
    assert (tmp_path / "run" / "manifest.json").read_text() == "old"
    assert listing(tmp_path) == ["run"]


def test_an_interrupt_between_the_two_renames_loses_no_result(tmp_path, monkeypatch):
    with output_folder(tmp_path / "run") as folder:
        (folder / "manifest.json").write_text("old")
    real = os.replace

    def replace(source, target):
        real(source, target)
        if str(target).endswith("-old"):
            raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", replace)
    with pytest.raises(KeyboardInterrupt), output_folder(tmp_path / "run", overwrite=True) as folder:
        (folder / "manifest.json").write_text("new")
    assert (tmp_path / "run" / "manifest.json").read_text() == "old"
    assert listing(tmp_path) == ["run"]


def test_a_kill_while_an_empty_folder_is_filled_leaves_the_result_whole(tmp_path):
    (tmp_path / "run").mkdir()
    more = "[(made / name).write_text('new') for name in 'ab']"
    killed(f"output_folder({str(tmp_path / 'run')!r})", before=DIE_AT_SECOND, inside=more)
    assert not (tmp_path / "run" / "manifest.json").exists()
    refuse_entering(output_folder(tmp_path / "run"))  # completes the interrupted renaming
    assert listing(tmp_path / "run") == ["a", "b", "manifest.json"]


def test_what_appears_at_the_final_place_during_a_run_is_not_replaced(tmp_path):
    run = output_folder(tmp_path / "run")
    (run.__enter__() / "manifest.json").write_text("{}")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "precious").write_text("x")
    with pytest.raises(UserError, match="exists"):
        run.__exit__(None, None, None)
    assert (tmp_path / "run" / "precious").read_text() == "x"


@pytest.fixture
def small_disk(tmp_path):
    """A real disk of 200 kB; only root may mount one."""
    place = tmp_path / "small"
    place.mkdir()
    mounted = os.name == "posix" and os.geteuid() == 0
    mounted = (
        mounted
        and subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=200k", "tmpfs", str(place)], capture_output=True
        ).returncode
        == 0
    )
    if not mounted:
        pytest.skip("no file system can be mounted here")
    yield place
    subprocess.run(["umount", str(place)], check=True)


NOISE = np.random.default_rng(1).random((400, 400)).astype(np.float32)
GRID = Grid(NOISE, 1.0, 2_783_000.0, 1_190_000.0, pyproj.CRS(2056))


def test_a_really_full_disk_when_a_raster_is_written(small_disk):
    with pytest.raises(UserError, match="disk is full"), output_path(small_disk / "a.tif") as temporary:
        write_raster(temporary, NOISE, GRID, dtype="float32")
    assert listing(small_disk) == []


def test_a_really_full_disk_when_a_layer_is_written(small_disk):
    frame = gpd.GeoDataFrame({"a": range(20_000)}, geometry=[Point(i, i) for i in range(20_000)], crs=2056)
    with pytest.raises(UserError, match="disk is full"), output_path(small_disk / "a.gpkg") as temporary:
        write_vector(temporary, {"points": frame})
    assert listing(small_disk) == []


def test_a_disk_that_is_full_from_the_start(small_disk):
    with pytest.raises(OSError), (small_disk / "filler").open("wb") as filler:
        filler.write(b"x" * 300_000)
    assert "disk is full" in refuse_entering(output_path(small_disk / "a.tif"))
    assert "disk is full" in refuse_entering(output_folder(small_disk / "run"))
    assert listing(small_disk) == ["filler"]


def test_a_truncated_raster_is_noticed_even_if_nobody_raises(tmp_path, monkeypatch):
    """What GDAL does when the disk fills up while it closes the file: nothing."""
    import rasterio

    real = rasterio.open

    def opened(path, mode="r", **profile):
        if mode == "r":
            raw = Path(path).read_bytes()
            Path(path).write_bytes(raw[: len(raw) // 2])
        return real(path, mode, **profile)

    monkeypatch.setattr(rasterio, "open", opened)
    with pytest.raises((OSError, RasterioError)), output_path(tmp_path / "a.tif") as temporary:
        write_raster(temporary, NOISE, GRID, dtype="float32")
    assert listing(tmp_path) == []
