"""The demo from scratch, with few logs; the picture's relief; the committed sample compared with its script."""

from __future__ import annotations

import json
import runpy
import shlex
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
from scipy.spatial import ConvexHull

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.pictures import hillshade
from deadwood_algorithms.prepare.demo_slope import slope as sample_slope
from deadwood_algorithms.tools import demo

SAMPLE = Path(__file__).parents[3] / "sample_data"
LOGS = 180  # in each forest at least 72 go far enough to show a spread


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo") / "out"
    outcome = demo.TOOL(output=str(folder), logs=LOGS, fidelity="draft")
    return folder, outcome


def test_the_three_forests_differ_as_the_paper_found(made):
    folder, outcome = made
    told = json.loads((folder / "demo.json").read_text(encoding="utf-8"))["forests"]
    p = {name: each["reach"][0] for name, each in told.items()}
    assert list(p) == ["mapped", "random", "none"]
    assert p["none"]["ci_low"] > 0.7
    assert p["mapped"]["ci_high"] < p["none"]["ci_low"]
    assert p["random"]["ci_low"] <= p["mapped"]["ci_high"]
    assert told["none"]["speed"]["max_ms"] == pytest.approx(30.0, abs=8.0)
    assert told["none"]["speed"]["mean_to_road_ms"] == pytest.approx(14.0, abs=4.0)
    spread = {name: each["spread"][0]["p05_p95_deg"] for name, each in told.items()}
    assert spread["none"] < min(spread["mapped"], spread["random"])
    for name in p:
        assert any(line.startswith(name) for line in outcome.lines)
    assert "deadwood-tool reproduce-paper" in "\n".join(outcome.lines)
    assert "logs per forest, upright, friction 0.25, " in outcome.lines[-1]


def test_the_same_logs_go_through_each_forest(made):
    folder, _ = made
    released = [gpd.read_file(folder / f"run_{name}" / "run.gpkg", layer="deposits") for name in demo.FORESTS]
    for frame in released:
        assert len(frame) == LOGS
        assert frame[["log_id", "release_x", "release_y"]].equals(released[0][["log_id", "release_x", "release_y"]])
    mapped, random = (gpd.read_file(folder / f"trees_{name}.gpkg") for name in ("mapped", "random"))
    assert abs(len(mapped) - len(random)) < 0.01 * len(mapped)
    area = gpd.read_file(folder / "forest.gpkg").area.sum() / 1e4
    assert len(mapped) / area == pytest.approx(300.0, rel=0.01)
    assert mapped["dbh_cm"].mean() == pytest.approx(60.23, abs=1.5)
    assert mapped["dbh_cm"].std() == pytest.approx(18.64, abs=1.5)


def test_manifests_name_the_place_where_the_folder_stands(made):
    folder, _ = made
    for manifest in folder.glob("**/manifest.json"):
        assert ".partial-" not in manifest.read_text(encoding="utf-8")
    told = json.loads((folder / "run_mapped" / "manifest.json").read_text(encoding="utf-8"))
    assert told["parameters"]["dem"] == str(folder / "dem.tif")
    assert Path(told["parameters"]["releases"]).is_file()
    assert [each.name for each in folder.parent.iterdir()] == [folder.name]


def test_the_picture_shows_something(made):
    from matplotlib.image import imread

    folder, _ = made
    picture = imread(folder / "demo.png")
    height, width = picture.shape[:2]
    assert width > 1500
    assert height > 500
    for k in range(3):
        panel = picture[height // 4 : 3 * height // 4, width * k // 3 + 40 : width * (k + 1) // 3 - 160, :3]
        coloured = (panel.max(axis=2) - panel.min(axis=2)) > 0.15  # the relief alone is grey
        assert 0.01 < coloured.mean() < 0.9


def test_relief_is_lit_from_the_west_and_never_out_of_range():
    east = np.linspace(-1.0, 1.0, 41)
    ridge = np.broadcast_to(20.0 - 20.0 * np.abs(east), (30, 41))
    shade = hillshade(ridge, 1.0)
    assert shade.min() >= 0.0
    assert shade.max() <= 1.0
    assert shade[:, 5].mean() > shade[:, 35].mean() + 0.5


def test_the_mapped_forest_leaves_the_gully_free_and_the_random_one_does_not(made):
    folder, _ = made
    nearest = {}
    for name in ("mapped", "random"):
        trees = gpd.read_file(folder / f"trees_{name}.gpkg").geometry
        u, v = trees.x - sample_slope.EAST, trees.y - sample_slope.NORTH
        nearest[name] = np.abs(u - sample_slope.gully_u(v)).min()
    assert nearest["mapped"] >= sample_slope.GULLY_FREE - 0.02
    assert nearest["random"] < 1.0


def test_the_slope_is_what_it_says():
    grid = sample_slope.terrain()
    assert grid.shape == (1000, 600)
    v = np.arange(1000) * 0.5 + 0.25
    middle = grid.values.mean(axis=1)
    steep = (v > 260.0) & (v < 490.0)  # above the cliff's step
    assert np.degrees(np.arctan(np.polyfit(v[steep], middle[steep], 1)[0])) == pytest.approx(35.0, abs=2.0)
    road = (v > 78.0) & (v < 82.0)
    assert np.abs(grid.values[road] - 1050.0).max() < 0.5
    assert np.array_equal(grid.values, sample_slope.terrain().values)


def test_the_committed_sample_is_what_its_script_makes(tmp_path):
    grid = read_dem(SAMPLE / "dem.tif")
    assert np.abs(grid.values - sample_slope.terrain().values).max() < 0.006  # rounded to centimetres there
    assert grid.crs.to_epsg() == 2056
    script = runpy.run_path(str(SAMPLE / "make_sample.py"), init_globals={"__name__": "sample"})
    script["write_terrain"](tmp_path / "dem.tif", sample_slope.terrain())
    with rasterio.open(tmp_path / "dem.tif") as again, rasterio.open(SAMPLE / "dem.tif") as committed:
        difference = again.read(1).astype(int) - committed.read(1).astype(int)
        assert np.abs(difference).max() <= 1
    trees = np.genfromtxt(SAMPLE / "trees.csv", delimiter=",", names=True)
    forest = sample_slope.forest()
    for name in ("x", "y", "dbh_cm", "height_m"):
        assert np.allclose(trees[name], forest[name], atol=0.006)
    layers = {"release_area", "lines", "barriers", "forest", "dams", "flights", "deadwood"}
    assert set(gpd.list_layers(SAMPLE / "sample.gpkg")["name"]) == layers | {"layer_styles"}
    for name in ("rock_cubic_1m3", "rock_platy_1m3"):
        assert ConvexHull(np.loadtxt(SAMPLE / f"{name}.pts")).volume == pytest.approx(1.0)
    assert sum(each.stat().st_size for each in SAMPLE.iterdir() if each.is_file()) < 1_000_000


def test_it_ends_with_a_report_of_the_three_forests(made):
    folder, outcome = made
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert outcome.outputs["report"] == folder / "report.html"
    for forest in demo.FORESTS:
        assert f'"name":"{forest}"' in page
    assert str(folder / "run_mapped") in page
    assert ".partial-" not in page
    assert len(page.encode()) < 6_000_000


def test_it_ends_by_naming_explore_on_its_own_layers(made):
    """The command that it prints last, with existing layers."""
    folder, _ = made
    program, name, *given = shlex.split(demo.TOOL.then.format(output=folder))
    assert (program, name) == ("deadwood-tool", "explore")
    assert given[::2] == ["--dem", "--trees", "--lines"]
    assert all(Path(each).is_file() for each in given[1::2])
