"""Inputs as users really provide them: every error ends in one line that states where it is and how to fix it.

Each line comes from the tool itself, and names the file (or the option), and layer, field and row if there are
any. Nothing may be left under the output's name. Errors in the readers themselves are in test_layers_*.py.
"""

from __future__ import annotations

import errno
import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
from rasterio.transform import Affine, from_origin
from shapely import LineString, Point, box

from deadwood_algorithms.files import vectors
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.tools import generate_forest, import_trees, sample_releases

EAST, NORTH = 2_783_000.0, 1_190_000.0
TOOLS = {
    "areas": (sample_releases.TOOL, {"count": 5}),
    "trees": (import_trees.TOOL, {}),
    "like": (generate_forest.TOOL, {}),
}
LAYERS = pytest.mark.parametrize("layer", list(TOOLS))
Bad = Callable[..., str]


@pytest.fixture
def bad(tmp_path, slope, said) -> Bad:
    """Runs the tool that reads ``layer``, which must refuse it, and returns its line."""

    def run(layer: str, path: object, **values) -> str:
        tool, needed = TOOLS[layer]
        output = tmp_path / "output.gpkg"
        values = {"dem": slope(), layer: str(path), "output": str(output)} | needed | values
        before = output.read_bytes() if output.is_file() else None
        with pytest.raises(UserError) as raised:
            tool(tool.ask_from(values), said)
        line = str(raised.value)
        assert "\n" not in line
        assert len(line.replace(str(tmp_path), "").replace(str(Path(sys.executable).parent), "")) < 500
        assert (output.read_bytes() if output.is_file() else None) == before
        assert not [each.name for each in tmp_path.iterdir() if "partial" in each.name]
        return line

    return run


def points(tmp_path, n=3, name="points.gpkg", **columns) -> str:
    columns = {"dbh_cm": [40.0] * n, "height_m": [20.0] * n} | columns
    shapes = [Point(EAST + 50 + i, NORTH + 50) for i in range(n)]
    gpd.GeoDataFrame(columns, geometry=shapes, crs=2056).to_file(tmp_path / name)
    return str(tmp_path / name)


def dem(tmp_path, name, crs: object = "EPSG:2056", transform=None) -> str:
    transform = transform or from_origin(EAST, NORTH + 160, 2, 2)
    profile = {"driver": "GTiff", "dtype": "float32", "count": 1, "height": 80, "width": 100}
    with rasterio.open(tmp_path / name, "w", crs=crs, transform=transform, **profile) as made:
        made.write(np.full((80, 100), 1000, "float32"), 1)
    return str(tmp_path / name)


# --- the layer


@LAYERS
def test_a_missing_layer(tmp_path, bad, layer):
    line = bad(layer, tmp_path / "none.gpkg")
    assert line.startswith(f"{tmp_path / 'none.gpkg'}: ")
    assert "does not exist" in line


@LAYERS
@pytest.mark.parametrize(
    ("name", "content"), [("a.gpkg", b"nothing of the kind"), ("a.gpkg", b""), ("a.shp", b"x" * 200)]
)
def test_a_file_that_is_no_layer(tmp_path, bad, layer, name, content):
    (tmp_path / name).write_bytes(content)
    assert bad(layer, tmp_path / name).startswith(f"{tmp_path / name}: ")


@LAYERS
def test_a_raster_in_the_place_of_a_layer(tmp_path, bad, layer):
    assert "dem2.tif: a raster, but the " in bad(layer, dem(tmp_path, "dem2.tif"))


@LAYERS
def test_an_empty_layer(tmp_path, bad, layer):
    gpd.GeoDataFrame({"dbh_cm": [1.0]}, geometry=[Point(0, 0)], crs=2056).iloc[:0].to_file(tmp_path / "empty.gpkg")
    assert "empty.gpkg, layer 'empty': the" in (line := bad(layer, tmp_path / "empty.gpkg"))
    assert "is empty" in line


@LAYERS
def test_several_layers(tmp_path, bad, layer):
    path = points(tmp_path)
    gpd.read_file(path).to_file(path, layer="more")
    line = bad(layer, path)
    assert "points, more" in line
    assert "|layername=points'" in line


@LAYERS
def test_the_wrong_geometry(tmp_path, bad, layer):
    line_layer = gpd.GeoDataFrame(geometry=[LineString([(EAST, NORTH), (EAST + 1, NORTH)])], crs=2056)
    line_layer.to_file(tmp_path / "road.gpkg")
    assert "road.gpkg, layer 'road', row 1: a LineString, but the" in bad(layer, tmp_path / "road.gpkg")


@LAYERS
def test_a_feature_without_geometry(tmp_path, bad, layer):
    frame = gpd.read_file(points(tmp_path))
    frame.loc[1, "geometry"] = None
    frame.to_file(tmp_path / "gap.gpkg")
    assert "layer 'gap', row 2: the geometry is empty; delete the row or draw it" in bad(layer, tmp_path / "gap.gpkg")


@LAYERS
def test_a_table_without_coordinates(tmp_path, bad, layer):
    (tmp_path / "table.csv").write_text("dbh_cm,height_m\n40,20\n")
    assert "has no columns x and y" in bad(layer, tmp_path / "table.csv")


@LAYERS
def test_a_layer_somewhere_else(tmp_path, bad, layer):
    frame = gpd.read_file(points(tmp_path))
    frame.set_crs("EPSG:32632", allow_override=True).to_file(tmp_path / "far.gpkg")
    line = bad(layer, tmp_path / "far.gpkg")
    assert "far.gpkg" in line
    assert "DEM" in line


# --- its columns


@LAYERS
def test_a_number_that_cannot_be(tmp_path, bad, layer):
    line = bad(layer, points(tmp_path, dbh_cm=[40.0, -3.0, 40.0]))
    words = "-3 is not a number greater than 0; correct it or delete the row"
    assert f"points.gpkg, layer 'points', field 'dbh_cm', row 2: {words}" in line


@pytest.mark.parametrize("layer", ["areas", "like"])  # in a table of trees 0 is a gap
def test_nothing_is_no_size(tmp_path, bad, layer):
    line = bad(layer, points(tmp_path, dbh_cm=[40.0, 0.0, 40.0]))
    assert "field 'dbh_cm', row 2: 0 is not a number greater than 0; correct it or delete the row" in line


@LAYERS
def test_text_in_a_number_column(tmp_path, bad, layer):
    line = bad(layer, points(tmp_path, dbh_cm=["40", "40", "thick"]))
    unlike = "neither a size nor a class with two ends" if layer == "trees" else "not a number"
    assert f"field 'dbh_cm', row 3: 'thick' is {unlike}" in line


@pytest.mark.parametrize("layer", ["areas", "like"])  # import-trees is meant to fill gaps
def test_a_gap_in_a_number_column(tmp_path, bad, layer):
    line = bad(layer, points(tmp_path, dbh_cm=[40.0, None, 40.0]))
    assert "field 'dbh_cm', row 2: the value is empty; fill in a number greater than 0" in line


def test_nothing_but_gaps(tmp_path, bad):
    line = bad("trees", points(tmp_path, dbh_cm=[np.nan] * 3, height_m=[np.nan] * 3))
    assert "neither a DBH nor a height is found; name its field: --dbh-field, --height-field" in line


def test_fields_that_are_not_there(tmp_path, bad):
    for option in ("id", "dbh", "height", "species", "crown"):
        line = bad("trees", points(tmp_path), **{f"{option}_field": "nonsense"})
        assert f"no field 'nonsense' (--{option}-field); it has dbh_cm, height_m" in line
    assert "no columns a and b" in bad("trees", points(tmp_path), x_field="a", y_field="b")
    assert "--x-field and --y-field belong together" in bad("trees", points(tmp_path), x_field="a")


def test_a_trees_layer_without_its_columns_cannot_be_fitted(tmp_path, bad):
    gpd.GeoDataFrame({"bhd": [1.0, 2.0]}, geometry=[Point(EAST + 50, NORTH + 50)] * 2, crs=2056).to_file(
        tmp_path / "raw.gpkg"
    )
    assert "layer 'raw': the field 'dbh_cm' is missing; it has the fields bhd" in bad("like", tmp_path / "raw.gpkg")


@LAYERS
def test_dbh_in_metres_is_a_warning(tmp_path, slope, said, layer):
    tool, needed = TOOLS[layer]
    values = {"dem": slope(), "output": str(tmp_path / "output.gpkg"), layer: points(tmp_path, dbh_cm=[0.4, 0.5, 0.6])}
    if layer == "like":  # no tree is so thin: none is left as a sample
        with pytest.raises(UserError, match=r"3 have a DBH below 1 cm .*are DBH in cm and heights in m\?"):
            tool(tool.ask_from(values | needed | {"dbh_mean_cm": 40.0}), said)
        return
    tool(tool.ask_from(values | needed), said)
    assert "points.gpkg, layer 'points': the median dbh_cm is 0.5 cm, which is too small" in said.warnings[0]


# --- the DEM


@LAYERS
def test_a_missing_dem_and_an_invalid_one(tmp_path, bad, layer):
    path = points(tmp_path)
    assert "none.tif: the DEM file does not exist" in bad(layer, path, dem=str(tmp_path / "none.tif"))
    assert "points.gpkg: the DEM is not a raster" in bad(layer, path, dem=path)


@LAYERS
@pytest.mark.parametrize(
    ("crs", "transform", "words"),
    [
        ("EPSG:4326", from_origin(9.8, 46.9, 2e-5, 2e-5), "--dst-crs EPSG:2056"),
        ("EPSG:2229", None, "counts in US survey foot, but must count in metres; fix: "),
        (None, None, "--crs EPSG:2056"),
        ("EPSG:2056", Affine(2, 0, EAST, 0, -3, NORTH + 240), "must be square; fix: "),
        ("EPSG:2056", Affine(1.9, 0.6, EAST, 0.6, -1.9, NORTH), "rotated, but must be north-up; fix: "),
    ],
)
def test_a_dem_that_cannot_be_used_comes_with_its_fix(tmp_path, bad, layer, crs, transform, words):
    line = bad(layer, points(tmp_path), dem=dem(tmp_path, "bad dem.tif", crs, transform))
    assert line.startswith(f"{tmp_path / 'bad dem.tif'}: the DEM")
    assert words in line
    assert crs is None or re.search(r"\brio warp ", line)


def test_degrees_without_a_dem(tmp_path, slope, said):
    frame = gpd.read_file(points(tmp_path)).to_crs(4326)
    frame.to_file(tmp_path / "wgs.gpkg")
    ask = {"trees": str(tmp_path / "wgs.gpkg"), "output": str(tmp_path / "output.gpkg")}
    with pytest.raises(UserError, match="CRS WGS 84 is not projected in metres; give --dem"):
        import_trees.TOOL(import_trees.TOOL.ask_from(ask), said)


# --- the output


@LAYERS
def test_an_existing_output_is_kept(tmp_path, bad, layer):
    (tmp_path / "output.gpkg").write_bytes(b"precious")
    line = bad(layer, points(tmp_path))
    assert line == f"{tmp_path / 'output.gpkg'}: the output exists; --overwrite replaces it"


@LAYERS
def test_an_output_that_is_also_the_input(tmp_path, bad, layer):
    path = points(tmp_path)
    before = Path(path).read_bytes()
    assert "is also an input" in bad(layer, path, output=path, overwrite=True)
    assert Path(path).read_bytes() == before


@LAYERS
@pytest.mark.parametrize("place", ["a_file/output.gpkg", "/proc/output.gpkg"])
def test_a_folder_that_cannot_be_written_to_is_found_before_the_work(tmp_path, bad, layer, place):
    if place.startswith("/proc") and not Path("/proc/self").exists():
        pytest.skip("no such folder here")
    (tmp_path / "a_file").write_text("x")
    output = str(tmp_path / place)  # an absolute place is unchanged
    line = bad(layer, "never_read.gpkg", output=output, dem="never_read.tif")
    assert line.startswith(f"{output}: the folder ")
    assert "cannot be written to" in line


@LAYERS
def test_another_format_of_output(bad, layer, tmp_path):
    line = bad(layer, "never_read.gpkg", dem="never_read.tif", output=str(tmp_path / "output.shp"))
    assert "must be a .gpkg file; name it" in line


@LAYERS
def test_a_full_disk(tmp_path, bad, layer, monkeypatch):
    def fails(path, layers):
        Path(path).write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(vectors, "write_vector", fails)
    extra = {"stems_per_ha": 100.0} if layer == "like" else {}
    assert "the disk is full, nothing was written; free some space in" in bad(layer, points(tmp_path), **extra)


# --- through the command line


def test_the_command_says_it_in_one_line_on_stderr_and_exits_with_2(tmp_path, slope):
    path = points(tmp_path, dbh_cm=[40.0, -3.0, 40.0])
    config = tmp_path / "config.json"
    config.write_text(json.dumps({"trees": path, "dem": slope(), "output": str(tmp_path / "output.gpkg")}))
    command = [sys.executable, "-m", "deadwood_toolbox", "import-trees", "--config", str(config)]
    root = Path(__file__).parents[3]
    paths = f"{root}:{root / 'engine'}:{root / 'algorithms'}"
    ran = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env={"PYTHONPATH": paths})
    assert ran.returncode == 2
    assert ran.stdout == ""
    lines = ran.stderr.strip().splitlines()
    assert len(lines) == 1
    assert "points.gpkg, layer 'points', field 'dbh_cm', row 2: -3 is not a number greater than 0" in lines[0]


def test_a_polygon_too_slim_to_draw_in(tmp_path, bad):
    sliver = box(0, 0, 1000, 1e-3)
    turned = gpd.GeoSeries([sliver], crs=2056).rotate(45).translate(EAST - 450, NORTH + 80)
    turned.to_frame("geometry").to_file(tmp_path / "sliver.gpkg")
    assert "layer 'sliver', row 1: the polygon is too narrow" in bad("areas", tmp_path / "sliver.gpkg")
