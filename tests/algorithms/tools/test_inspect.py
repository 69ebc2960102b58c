"""inspect: what files are taken for, the exit status, and what the printed commands do."""

from __future__ import annotations

import json
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.tools import inspect
from deadwood_toolbox import cli

E, N = 2_700_000.0, 1_200_000.0
DRAW = np.random.default_rng(1)
X, Y = E + DRAW.uniform(10, 150, 40), N + DRAW.uniform(70, 200, 40)
DBH = DRAW.uniform(15, 60, 40).round(1)
HEIGHT = (2.0 * DBH**0.7).round(1)


def raster(path: Path, values: np.ndarray, crs: str | None = "EPSG:2056") -> str:
    ny, nx = values.shape
    profile = {"driver": "GTiff", "width": nx, "height": ny, "count": 1, "dtype": "float32", "crs": crs}
    with rasterio.open(path, "w", transform=from_origin(E, N + ny, 1.0, 1.0), **profile) as made:
        made.write(values.astype("float32"), 1)
    return str(path)


def layer(path: Path, shapes: list, **columns: object) -> str:
    gpd.GeoDataFrame(columns, geometry=shapes, crs=2056).to_file(path)
    return str(path)


def table(path: Path, **columns: object) -> str:
    pd.DataFrame({"X": X, "Y": Y} | columns).to_csv(path, index=False)
    return str(path)


GROUND = 800.0 + np.tan(np.radians(35.0)) * np.arange(240.0)[::-1, None] + np.zeros(160)
LINE, BOX = shapely.LineString([(E, N), (E + 90, N)]), shapely.box(E, N, E + 90, N + 9)
POINTS = [shapely.Point(*each) for each in zip(X, Y, strict=True)]
FILES = {
    "dem": lambda f: raster(f / "a.tif", GROUND),
    "chm": lambda f: raster(f / "a.tif", np.maximum(0.0, 20.0 - np.abs(GROUND % 60 - 30.0) * 1.5)),
    "friction": lambda f: raster(f / "a.tif", np.where(GROUND > 850.0, 0.3, 0.45)),
    "trees": lambda f: table(f / "a.csv", BHD=DBH, Baumhoehe=HEIGHT),
    "releases": lambda f: layer(f / "a.gpkg", POINTS, dbh_cm=DBH, length_m=HEIGHT, log_id=range(40)),
    "lines": lambda f: layer(f / "a.gpkg", [LINE], Name=["road"]),
    "barriers": lambda f: layer(f / "a.gpkg", [LINE], Nutzhoehe=[4.0]),
    "areas": lambda f: layer(f / "a.gpkg", [BOX], Name=["west"]),
}


@pytest.mark.parametrize("role", FILES)
def test_a_sound_file_is_taken_for_what_it_is(tmp_path, role):
    outcome = inspect.TOOL(path=FILES[role](tmp_path))
    assert (outcome.facts["role"], outcome.facts["doubts"], outcome.status) == (role, [], 0)
    assert outcome.facts["commands"]


def test_the_columns_of_trees_and_what_becomes_of_them(tmp_path):
    facts = inspect.TOOL(path=table(tmp_path / "a.csv", Radius=DBH / 200.0, HT=HEIGHT, Sorte=["a"] * 40)).facts
    wanted = {"X": "easting", "Y": "northing", "Radius": "radius", "HT": "height", "Sorte": "not used"}
    assert facts["columns"] == wanted
    assert f"median DBH {np.median(DBH):.2f} cm" in facts["counted"]
    assert [each["code"] for each in facts["doubts"]] == ["radius"]


def test_the_exit_status_says_whether_it_can_be_used(tmp_path, capsys):
    assert cli.run(["inspect", FILES["dem"](tmp_path), "--quiet"]) == 0
    assert cli.run(["inspect", raster(tmp_path / "b.tif", GROUND, None), "--quiet"]) == 3
    for role in ("trees", "dem"):
        assert cli.run(["inspect", FILES["lines"](tmp_path), "--as", role, "--quiet"]) == 2
    assert cli.run(["inspect", str(tmp_path / "missing.tif"), "--quiet"]) == 2


def test_an_unusable_file_names_what_it_was_taken_for(tmp_path):
    with pytest.raises(UserError):
        inspect.TOOL(path=FILES["dem"](tmp_path), as_="lines")


def test_a_page_of_a_service_is_doubted_in_every_role(tmp_path):
    shapes = {"lines": LINE, "areas": BOX, "trees": POINTS[0]}
    for role, shape in shapes.items():
        geometry = json.loads(shapely.to_geojson(shape))
        feature = {"type": "Feature", "properties": {"dbh_cm": 30.0, "height_m": 20.0}, "geometry": geometry}
        crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::2056"}}
        whole = {"type": "FeatureCollection", "crs": crs, "features": [feature], "numberMatched": 7}
        (tmp_path / "a.geojson").write_text(json.dumps(whole))
        found = inspect.TOOL(path=str(tmp_path / "a.geojson"), as_=role).facts["doubts"]
        assert [each["numbers"] for each in found if each["code"] == "one-page"] == [{"rows": 1, "total": 7}]


def test_the_next_command_repeats_the_crs(tmp_path, capsys):
    dem = raster(tmp_path / "b.tif", GROUND, None)
    trees = table(tmp_path / "a.csv", dbh_cm=DBH, height_m=HEIGHT)
    words = ["import-trees", "--trees", trees, "--dem", dem, "--crs", "EPSG:2056"]
    assert cli.run([*words, "--output", str(tmp_path / "out.gpkg")]) == 0
    following = next(line for line in capsys.readouterr().err.splitlines() if "next: " in line)
    assert following.endswith("--crs EPSG:2056")
