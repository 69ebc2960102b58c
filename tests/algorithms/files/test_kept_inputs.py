"""Inputs that will not last are saved in the run: through pipes, and in a folder that vanishes."""

from __future__ import annotations

import json
import os
import shutil
import threading
from pathlib import Path

import geopandas
import numpy as np
import pytest
import rasterio
import shapely
from slope_case import Case, points, write_layer

from deadwood_algorithms.files.identity import content_of
from deadwood_algorithms.files.kept_inputs import VARIABLE, lasting_no_longer_than_this, save_input
from deadwood_toolbox import cli

posix = pytest.mark.skipif(os.name != "posix", reason="pipes of Unix")


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


def slide(output: Path, **given: str) -> dict:
    words = [word for name, value in given.items() for word in (f"--{name}", value)]
    assert cli.run(["slide-logs", *words, "--fidelity=draft", "--friction=0.3", f"--output={output}", "--quiet"]) == 0
    return json.loads((output / "manifest.json").read_text())


def paths(manifest: dict) -> dict[str, str]:
    return {each["parameter"]: each["path"] for each in manifest["inputs"]}


def assert_followed_up(run: Path, capsys) -> None:
    capsys.readouterr()
    assert cli.run(["value-trees", f"--run={run}", f"--output={run}_values.gpkg", "--quiet"]) == 0
    assert cli.run(["check", str(run)]) == 0
    said = capsys.readouterr().out
    assert "releases: same" in said
    assert "dem: same" in said


@posix
def test_what_comes_through_pipes_is_in_the_run(case, tmp_path, capsys):
    """The same run as from the files, to the bit, and others can be made from it."""
    lines = tmp_path / "lines.geojson"
    geopandas.read_file(case.lines).to_file(lines)
    given = {"dem": case.dem, "releases": case.releases, "trees": case.trees, "lines": str(lines)}
    whole = slide(tmp_path / "whole", **given)
    pipes, threads = {}, []
    for name, path in given.items():
        reading, writing = os.pipe()
        threads.append(threading.Thread(target=_write, args=(path, writing)))
        pipes[name] = f"/dev/fd/{reading}"
    for each in threads:
        each.start()
    piped = slide(tmp_path / "piped", **pipes)
    run = tmp_path / "piped"
    assert paths(piped) == {
        "dem": f"{run}/inputs_dem.tif",
        "releases": f"{run}/inputs.gpkg|layername=releases",
        "trees": f"{run}/inputs.gpkg|layername=trees",
        "lines": f"{run}/inputs_lines.geojson",
    }
    assert {name: piped["parameters"][name] for name in paths(piped)} == paths(piped)
    assert piped["run_id"] == whole["run_id"]
    deposits = [geopandas.read_file(tmp_path / each / "run.gpkg", layer="deposits") for each in ("whole", "piped")]
    assert deposits[0].equals(deposits[1])
    assert_followed_up(run, capsys)


def _write(path: str, pipe: int) -> None:
    with open(path, "rb") as source, open(pipe, "wb") as target:
        shutil.copyfileobj(source, target)


@posix
def test_a_pipe_that_holds_no_layer_is_named_as_typed(case, tmp_path, capsys):
    reading, writing = os.pipe()
    os.write(writing, b"x,y\n1,2\n")
    os.close(writing)
    words = ["slide-logs", "--dem", case.dem, "--releases", f"/dev/fd/{reading}", "--friction=0.3"]
    assert cli.run([*words, f"--output={tmp_path / 'run'}"]) == 2
    assert f"/dev/fd/{reading}" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_what_a_program_extracts_into_its_folder_is_in_the_run(case, tmp_path, capsys, monkeypatch):
    """Layers of one name, a terrain that is a view of views of a file that stays, and a run whose folder is moved."""
    gone, run = tmp_path / "gone", tmp_path / "run"
    gone.mkdir()
    recipe = _recipe(case.dem, gone)
    releases = shutil.copy(case.releases, gone / "releases.gpkg")
    write_layer(gone / "other.gpkg", [shapely.LineString([(-5.0, 12.0), (90.0, 11.0)])], line_id=["road"])
    lines = gone / "lines.gpkg"
    geopandas.read_file(gone / "other.gpkg").to_file(lines, layer="releases", driver="GPKG")
    monkeypatch.setenv(VARIABLE, str(gone))
    made = slide(run, dem=str(recipe), releases=str(releases), lines=str(lines), trees=case.trees)
    shutil.rmtree(gone)
    monkeypatch.delenv(VARIABLE)
    assert paths(made) == {
        "dem": f"{run}/inputs_dem.vrt",
        "releases": f"{run}/inputs.gpkg|layername=releases",
        "lines": f"{run}/inputs_lines.gpkg|layername=releases",
        "trees": case.trees,
    }
    with rasterio.open(run / "inputs_dem.vrt") as view, rasterio.open(case.dem) as whole:
        assert (view.read(1) == np.where(whole.read(1) > 1010.0, whole.read(1), -7.0)).all()
    assert_followed_up(run, capsys)
    run.rename(tmp_path / "moved")
    assert_followed_up(tmp_path / "moved", capsys)


def _recipe(dem: str, folder: Path) -> Path:
    """A view in which low cells hold no data, of another view of the file."""
    with rasterio.open(dem) as source, rasterio.open(folder / "low.tif", "w", **source.profile) as low:
        low.write(np.where(source.read(1) > 1010.0, source.read(1), -7.0), 1)
        size = f'rasterXSize="{source.width}" rasterYSize="{source.height}"'
        place = ", ".join(map(str, source.transform.to_gdal()))
        wkt = source.crs.to_wkt().replace('"', "&quot;")
    for name, other in (("inner.vrt", "low.tif"), ("outer.vrt", "inner.vrt")):
        source_of = f'<SimpleSource><SourceFilename relativeToVRT="1">{other}</SourceFilename></SimpleSource>'
        band = f'<VRTRasterBand dataType="Float32" band="1"><NoDataValue>-7</NoDataValue>{source_of}</VRTRasterBand>'
        text = f"<VRTDataset {size}><SRS>{wkt}</SRS><GeoTransform>{place}</GeoTransform>{band}</VRTDataset>"
        (folder / name).write_text(text)
    return folder / "outer.vrt"


def test_layers_are_saved_as_they_are(tmp_path):
    """Into one file, from files whose registers of reference systems differ; what is read again is the same."""
    here = tmp_path / "here"
    here.mkdir()
    one = write_layer(tmp_path / "one.gpkg", points((3, 8), (4, 9)), name=["ö", None], size=[1.5, float("nan")])
    two = write_layer(tmp_path / "two.gpkg", [shapely.Point(1, 2, 7)], to="EPSG:4979", n=[2**40])
    with lasting_no_longer_than_this(tmp_path):
        saved = [save_input(path, "x", here) for path in (one, two)]
    assert saved == [f"{here}/inputs.gpkg|layername=one", f"{here}/inputs.gpkg|layername=two"]
    for path, layer in ((one, "one"), (two, "two")):
        assert content_of(here / "inputs.gpkg", layer) == content_of(Path(path), layer)
        before, after = geopandas.read_file(path), geopandas.read_file(here / "inputs.gpkg", layer=layer)
        assert before.equals(after)
        assert before.crs == after.crs
