"""inspect: what files are taken for, the exit status, and what the printed commands do."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin

from deadwood_algorithms.files.dem_blocks import open_ground
from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.scene.layers import read_trees
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
LINE, BOX = shapely.LineString([(E, N), (E + 90, N)]), shapely.box(E + 5, N + 5, E + 90, N + 14)
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


# --- printed commands, pasted in the folder in which they were printed ---


def typed(monkeypatch, capsys, *words: str) -> str:
    """Run a command as it is typed in the current folder; returns the last command that it prints."""
    assert cli.run([*words]) in (0, 3), words
    told = "".join(capsys.readouterr())
    return [line for line in told.splitlines() if line.startswith(("next: ", "use: "))][-1].partition(": ")[2]


def pasted(command: str, **others: str) -> None:
    """Run a printed command; words in capitals are replaced by the user's inputs, and explore is only checked."""
    program, name, *words = (others.get(word, word) for word in shlex.split(command))
    assert program == "deadwood-tool"
    if name != "explore":
        assert cli.run([name, *words, "--progress", "none"]) in (0, 3), command
        return
    given = dict(zip(words[::2], words[1::2], strict=True))
    assert set(given) <= {"--dem", "--trees", "--crs"}
    with open_ground(given["--dem"], crs=given.get("--crs"), feedback=Quiet()) as ground:
        if "--trees" in given:
            assert len(read_trees(given["--trees"], ground, feedback=Quiet()).ids) == 40


@pytest.fixture
def here(tmp_path, monkeypatch) -> Path:
    """A folder with a terrain model without CRS, whose name has to be quoted, areas and trees."""
    raster(tmp_path / "bare dem.tif", GROUND, None)
    layer(tmp_path / "area.gpkg", [shapely.box(E + 60, N + 190, E + 100, N + 220)])
    table(tmp_path / "trees.csv", dbh_cm=DBH, height_m=HEIGHT)
    monkeypatch.chdir(tmp_path)
    return tmp_path


BARE = ("--dem", "bare dem.tif", "--crs", "EPSG:2056")


def test_the_commands_that_follow_run_as_pasted(here, monkeypatch, capsys):
    run = typed(
        monkeypatch, capsys, "sample-releases", "--areas", "area.gpkg", *BARE, "--count", "2", "--output", "r.gpkg"
    )
    pasted(run)
    assert (here / "run" / "summary.json").is_file()
    look = typed(monkeypatch, capsys, "import-trees", "--trees", "trees.csv", *BARE, "--output", "t.gpkg")
    assert look == "deadwood-tool explore --dem 'bare dem.tif' --trees t.gpkg --crs EPSG:2056"
    pasted(look)
    lone = typed(
        monkeypatch, capsys, "import-trees", "--trees", "trees.csv", "--crs", "EPSG:2056", "--output", "u.gpkg"
    )
    pasted(lone)


@pytest.mark.parametrize("role", FILES)
def test_the_commands_of_inspect_run_as_pasted(here, monkeypatch, capsys, role):
    (here / "in here").mkdir()
    path = str(Path(FILES[role](here / "in here")).relative_to(here))
    command = typed(monkeypatch, capsys, "inspect", path)
    assert shlex.quote(path) in command
    if "RELEASES" in command or role == "releases":
        layer(here / "one.gpkg", POINTS[:1], log_id=[1])
    pasted(command, DEM=raster(here / "dem.tif", GROUND), RELEASES="one.gpkg")


def test_inspect_of_a_terrain_model_without_crs_names_it_in_the_command(here, monkeypatch, capsys):
    command = typed(monkeypatch, capsys, "inspect", "bare dem.tif")
    assert command.endswith("--crs EPSG:2056")
    pasted(command)


@pytest.mark.parametrize("columns", [{"H": HEIGHT}, {"VOL": DBH / 40.0, "hauteur": HEIGHT}, {"BHD": DBH}])
def test_a_table_without_crs_whose_sizes_follow_from_a_law(tmp_path, columns):
    """The law's region cannot be looked up on a local grid: this was an internal error."""
    facts = inspect.TOOL(path=table(tmp_path / "a.csv", **columns), as_="trees").facts
    assert facts["counted"].startswith("40 trees")


def test_a_table_in_degrees(tmp_path):
    """Without a terrain model; it was refused because the terrain model's coordinates are local."""
    lon, lat = pyproj.Transformer.from_crs(2056, 4326, always_xy=True).transform(X, Y)
    pd.DataFrame({"lon": lon, "lat": lat, "BHD": DBH, "Hoehe": HEIGHT}).to_csv(tmp_path / "a.csv", index=False)
    facts = inspect.TOOL(path=str(tmp_path / "a.csv")).facts
    assert (facts["role"], facts["doubts"]) == ("trees", [])
    assert facts["columns"]["lon"] == "easting"


def test_roads_among_houses_are_lines(tmp_path):
    """An export of a map has both; the mixture was taken for release areas, and then refused."""
    facts = inspect.TOOL(path=layer(tmp_path / "a.geojson", [LINE, BOX], Name=["road", "house"])).facts
    assert (facts["role"], facts["counted"]) == ("lines", "2 rows")
