"""Bad input to slide-logs: each case ends in one line that names the file or flag and the fix, and leaves nothing."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
import shapely
from rasterio.transform import Affine, from_origin
from slope_case import EAST, NORTH, Case, points, write_dem, write_layer

from deadwood_algorithms.files.outputs import output_folder
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.results import run_folder
from deadwood_toolbox import cli


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


def releases(folder: Path, *places: tuple[float, float], **columns) -> dict[str, str]:
    shapes = points(*(places or ((30.0, 80.0), (31.0, 80.0))))
    return {"releases": write_layer(folder / "bad.gpkg", shapes, **columns)}


def trees(folder: Path, **columns) -> dict[str, str]:
    shapes = points((10.0, 50.0), (20.0, 50.0))
    facts = {"dbh_cm": [40.0, 40.0], "height_m": [20.0, 20.0]} | columns
    return {"trees": write_layer(folder / "bad.gpkg", shapes, **{k: v for k, v in facts.items() if v is not None})}


def lines(folder: Path, *shapes: shapely.Geometry) -> dict[str, str]:
    return {"lines": write_layer(folder / "bad.gpkg", list(shapes))}


def barriers(folder: Path, shape: shapely.Geometry, **columns) -> dict[str, str]:
    return {"barriers": write_layer(folder / "bad.gpkg", [shape], **columns)}


def text(folder: Path, content: str = "this is no data") -> str:
    (folder / "bad.gpkg").write_text(content)
    return str(folder / "bad.gpkg")


def empty(folder: Path, kind: str) -> dict[str, str]:
    frame = gpd.GeoDataFrame({"dbh_cm": []}, geometry=[], crs="EPSG:2056")
    frame.to_file(folder / "bad.gpkg", geometry_type="Point")
    return {kind: str(folder / "bad.gpkg")}


def friction(folder: Path, value: float = 0.3, **profile) -> dict[str, str]:
    facts = {"driver": "GTiff", "dtype": "float32", "count": 1, "height": 100, "width": 60, "crs": "EPSG:2056"}
    facts |= {"transform": from_origin(EAST, NORTH + 100, 1.0, 1.0)} | profile
    with rasterio.open(folder / "bad.tif", "w", **facts) as made:
        made.write(np.full((facts["height"], facts["width"]), value, "float32"), 1)
    return {"friction": str(folder / "bad.tif")}


def friction_polygons(folder: Path, **columns) -> dict[str, str]:
    west, east = shapely.box(-1, -1, 30, 101), shapely.box(30, -1, 61, 101)
    return {"friction": write_layer(folder / "bad.gpkg", [west, east], **columns)}


LINE = shapely.LineString([(1.0, 25.0), (59.0, 25.0)])
SQUARE = from_origin(EAST, NORTH + 100, 1.0, 1.0)
OFF = shapely.LineString([(1.0, -25.0), (59.0, -25.0)])

# name: (what to change, given a folder; words of the message)
MATRIX = {
    "no DEM": (lambda f: {"dem": str(f / "none.tif")}, ["none.tif", "does not exist"]),
    "no releases": (lambda f: {"releases": str(f / "none.gpkg")}, ["none.gpkg", "does not exist"]),
    "no trees": (lambda f: {"trees": str(f / "none.gpkg")}, ["none.gpkg", "does not exist"]),
    "no barriers": (lambda f: {"barriers": str(f / "none.gpkg")}, ["none.gpkg", "does not exist"]),
    "no lines": (lambda f: {"lines": str(f / "none.gpkg")}, ["none.gpkg", "does not exist"]),
    "no friction": (lambda f: {"friction": str(f / "none.tif")}, ["none.tif", "does not exist"]),
    "DEM is text": (lambda f: {"dem": text(f)}, ["bad.gpkg", "not a raster"]),
    "releases are text": (lambda f: {"releases": text(f)}, ["bad.gpkg", "not a vector layer"]),
    "geographic CRS": (
        lambda f: {"dem": write_dem(f / "d.tif", crs="EPSG:4326", transform=from_origin(9.8, 46.9, 1e-5, 1e-5))},
        ["d.tif", "geographic", "rio warp"],
    ),
    "foot CRS": (lambda f: {"dem": write_dem(f / "d.tif", crs="EPSG:2263")}, ["d.tif", "must count in metres"]),
    "no CRS": (lambda f: {"dem": write_dem(f / "d.tif", crs=None)}, ["d.tif", "--crs EPSG:2056"]),
    "not square": (
        lambda f: {"dem": write_dem(f / "d.tif", transform=Affine(1.0, 0.0, EAST, 0.0, -2.0, NORTH + 100))},
        ["d.tif", "must be square", "rio warp"],
    ),
    "rotated": (
        lambda f: {"dem": write_dem(f / "d.tif", transform=SQUARE * Affine.rotation(20.0))},
        ["d.tif", "rotated", "rio warp"],
    ),
    "no release on the DEM": (lambda f: releases(f, (-500.0, 50.0)), ["no release lies on the DEM", "CRS"]),
    "releases partly off": (
        lambda f: releases(f, (30.0, 80.0), (90.0, 80.0), (30.0, 120.0)),
        ["bad.gpkg", "rows 2, 3", "2 of 3 releases"],
    ),
    "negative": (lambda f: releases(f, dbh_cm=[40.0, -3.0]), ["'dbh_cm'", "row 2", "-3", "greater than 0"]),
    "zero": (lambda f: releases(f, length_m=[0.0, 10.0]), ["'length_m'", "row 1", "greater than 0"]),
    "too thick": (
        lambda f: releases(f, dbh_cm=[40.0, 1e5]),
        ["bad.gpkg", "'dbh_cm'", "row 2", "100000 is not a number greater than 0 and at most 1500"],
    ),
    "too long": (lambda f: releases(f, length_m=[1e9, 10.0]), ["'length_m'", "row 1", "at most 150"]),
    "azimuth of many turns": (lambda f: releases(f, azimuth_deg=[1.0, 1e308]), ["'azimuth_deg'", "row 2", "3600"]),
    "tonnes": (
        lambda f: releases(f, density_kg_m3=[300.0, 0.3]),
        ["'density_kg_m3'", "row 2", "0.3 kg/m³ is smaller than any possible", "check the unit"],
    ),
    "too thick by option": (
        lambda f: {"dbh_cm": 1e5, "releases": write_layer(f / "bare.gpkg", points((30, 80)))},
        ["--dbh-cm", "--dbh-cm is 100000 cm, but must be at most 1500 cm"],
    ),
    "NaN": (lambda f: releases(f, density_kg_m3=[300.0, np.nan]), ["'density_kg_m3'", "row 2", "empty"]),
    "text": (lambda f: releases(f, dbh_cm=["40", "thick"]), ["'dbh_cm'", "row 2", "'thick'"]),
    "negative speed": (lambda f: releases(f, speed_ms=[0.0, -1.0]), ["'speed_ms'", "row 2"]),
    "tilt beyond": (lambda f: releases(f, tilt_deg=[0.0, 181.0]), ["'tilt_deg'", "row 2", "180"]),
    "unknown orientation": (
        lambda f: releases(f, orientation=["upright", "askew"]),
        ["'orientation'", "row 2", "'askew'", "upright, lying, tilted"],
    ),
    "log_id twice": (lambda f: releases(f, log_id=[4, 4]), ["'log_id'", "4 occurs in rows 1, 2"]),
    "log_id negative": (lambda f: releases(f, log_id=[4, -4]), ["'log_id'", "row 2"]),
    "log_id not whole": (lambda f: releases(f, log_id=[4.0, 4.5]), ["'log_id'", "row 2", "whole"]),
    "log_id text": (lambda f: releases(f, log_id=["a", "b"]), ["'log_id'", "row 1", "'a'"]),
    "empty releases": (lambda f: empty(f, "releases"), ["bad.gpkg", "empty"]),
    "empty trees": (lambda f: empty(f, "trees"), ["bad.gpkg", "empty"]),
    "releases are lines": (
        lambda f: {"releases": write_layer(f / "bad.gpkg", [LINE])},
        ["bad.gpkg", "row 1", "must be points"],
    ),
    "lines are points": (lambda f: {"lines": write_layer(f / "bad.gpkg", points((1, 1)))}, ["bad.gpkg", "row 1"]),
    "barriers are polygons": (
        lambda f: barriers(f, shapely.box(1, 40, 20, 50), height_m=[2.0]),
        ["bad.gpkg", "row 1", "must be lines"],
    ),
    "lines miss the DEM": (lambda f: lines(f, OFF, OFF), ["none of the 2 lines touches the DEM", "check the CRS"]),
    "barriers miss the DEM": (lambda f: barriers(f, OFF, height_m=[2.0]), ["no barrier touches the DEM"]),
    "barrier without height": (lambda f: barriers(f, LINE), ["'height_m'", "missing"]),
    "barrier of no height": (lambda f: barriers(f, LINE, height_m=[0.0]), ["'height_m'", "row 1"]),
    "trees off the DEM": (
        lambda f: {"trees": write_layer(f / "bad.gpkg", points((-500, 1)), dbh_cm=[40.0], height_m=[20.0])},
        ["no tree stands on the DEM"],
    ),
    "trees without DBH": (lambda f: trees(f, dbh_cm=None), ["'dbh_cm'", "import-trees"]),
    "trees without height": (lambda f: trees(f, height_m=None), ["'height_m'", "import-trees"]),
    "tree of NaN height": (lambda f: trees(f, height_m=[20.0, np.nan]), ["'height_m'", "row 2"]),
    "tree of DBH 0": (lambda f: trees(f, dbh_cm=[0.0, 40.0]), ["'dbh_cm'", "row 1"]),
    "friction raster too small": (
        lambda f: friction(f, height=50, transform=from_origin(EAST, NORTH + 100, 1.0, 1.0)),
        ["bad.tif", "does not cover the DEM", "3000 of its cells"],
    ),
    "friction raster elsewhere": (
        lambda f: friction(f, transform=from_origin(EAST + 1e4, NORTH, 1.0, 1.0)),
        ["bad.tif", "does not cover the DEM"],
    ),
    "friction raster negative": (lambda f: friction(f, -0.1), ["bad.tif", "negative"]),
    "friction polygons without the field": (
        lambda f: friction_polygons(f, rough=[1, 2]),
        ["'friction' or 'mu'", "rough"],
    ),
    "friction polygons negative": (lambda f: friction_polygons(f, mu=[0.3, -0.3]), ["'mu'", "row 2"]),
    "friction negative": (lambda f: {"friction": "-0.1"}, ["--friction", "at least 0"]),
    "friction NaN": (lambda f: {"friction": "nan"}, ["--friction", "finite"]),
    "restitution above 1": (lambda f: {"restitution": 1.5}, ["--restitution", "at most 1"]),
    "time step 0": (lambda f: {"time_step_s": 0.0}, ["--time-step-s", "at least 1e-05 s"]),
    "trajectories": (lambda f: {"trajectories": "-3"}, ["--trajectories", "all, none or a whole number"]),
    "several layers": (lambda f: {"releases": two_layers(f)}, ["bad.gpkg", "several layers", "|layername="]),
}


def two_layers(folder: Path) -> str:
    frame = gpd.GeoDataFrame(geometry=[shapely.Point(EAST + 30, NORTH + 80)], crs="EPSG:2056")
    for name in ("one", "two"):
        frame.to_file(folder / "bad.gpkg", layer=name)
    return str(folder / "bad.gpkg")


@pytest.mark.parametrize("name", MATRIX)
def test_bad_input_ends_in_one_line_and_leaves_nothing(case, tmp_path, name):
    change, words = MATRIX[name]
    (tmp_path / "in").mkdir()
    (tmp_path / "out").mkdir()
    values = case.everything() | change(tmp_path / "in")
    with pytest.raises(UserError) as error:
        case.run(output=str(tmp_path / "out" / "run"), **values)
    message = str(error.value)
    assert "\n" not in message
    assert len(message) < 500
    for word in words:
        assert word in message, message
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.parametrize("name", ["no DEM", "negative", "lines miss the DEM", "log_id twice", "restitution above 1"])
def test_the_command_ends_with_status_2_and_one_line(case, tmp_path, name, capsys):
    change, words = MATRIX[name]
    values = case.values(output=str(tmp_path / "run")) | change(tmp_path)
    flags = [part for key, value in values.items() for part in (f"--{key.replace('_', '-')}", str(value))]
    assert cli.run(["slide-logs", *flags]) == 2
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1, said
    assert words[0] in said
    assert "Traceback" not in said


def test_a_dbh_in_metres_is_warned_of(case, tmp_path, said):
    case.run(said, output=str(tmp_path / "run"), dbh_cm=0.4, time_limit_s=2.0, trajectories="none")
    case.run(said, output=str(tmp_path / "more"), time_limit_s=2.0, **releases(tmp_path, dbh_cm=[0.4, 0.5]))
    warnings = [each for each in said.warnings if "dbh_cm" in each]
    assert warnings
    assert "multiply by 100" in warnings[-1]


def test_an_unwritable_folder_is_found_before_the_work(case, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("x")
    with pytest.raises(UserError) as error:
        case.run(output=str(tmp_path / "file" / "run"))
    assert "cannot be written to" in str(error.value)
    assert "\n" not in str(error.value)


def test_two_runs_at_once_into_one_folder(case, tmp_path):
    """The second is refused, whatever it was asked, and the work that the first has done stays."""
    with output_folder(tmp_path / "run") as folder:
        (tmp_path / ".run.part").mkdir()
        (tmp_path / ".run.part" / "identity.json").write_text("of the first")
        for changes in ({}, {"resume": True}, {"overwrite": True}):
            with pytest.raises(UserError, match="another run is writing this output now"):
                case.run(output=str(tmp_path / "run"), **changes)
        (folder / "manifest.json").write_text("{}")
    assert (tmp_path / ".run.part" / "identity.json").read_text() == "of the first"
    assert (tmp_path / "run" / "manifest.json").read_text() == "{}"


def test_a_full_disk_is_the_users_to_fix(case, tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(run_folder.parquet, "write_table", full)
    with pytest.raises(UserError, match="the disk is full") as error:
        case.run(output=str(tmp_path / "run"))
    assert "\n" not in str(error.value)
    assert not (tmp_path / "run").exists()


def test_an_output_that_is_no_run_is_never_replaced(case, tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "thesis.tex").write_text("precious")
    with pytest.raises(UserError):
        case.run(output=str(tmp_path / "run"), overwrite=True)
    assert (tmp_path / "run" / "thesis.tex").read_text() == "precious"
