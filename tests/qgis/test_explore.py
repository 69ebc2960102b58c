"""The panel Explore in QGIS's window: a real mouse, an engine that is killed, layers and a panel that are removed."""

from __future__ import annotations

import time
from pathlib import Path
from types import ModuleType
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import rasterio

HERE = Path(__file__).parent
SAMPLE = HERE.parents[1] / "sample_data"
LOGS = 150


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("explored")


@pytest.fixture(scope="module")
def seen(qgis, window: ModuleType, work: Path) -> dict[str, Any]:
    told = window.explored(qgis.environment, SAMPLE, work)
    assert "error" not in told, told["error"]
    return told


def test_a_click_gives_a_picture_and_a_reach(seen):
    assert seen["children_at_work"] >= 1
    told = seen["click"]
    [line] = told["reach"]
    assert line["n_total"] == LOGS
    assert line["ci_low"] <= line["p"] <= line["ci_high"]
    assert f"({line['n_reach']} of {LOGS} logs)" in told["answer"]
    assert "Fidelity draft: over random slopes shares are off by" in told["answer"]
    assert f"{LOGS} logs, fidelity draft" in told["state"]
    assert told["sum"] > LOGS
    assert "held by a tree" in told["legend"]


@pytest.mark.parametrize("crs", ["EPSG:2056", "EPSG:4326", "EPSG:3035"])
def test_cells_are_drawn_where_they_lie_in_a_project_of_any_crs(seen, crs):
    """The CRS of the terrain model, degrees, and one with a different north in a map rotated by 25 degrees.

    Checked are the middles of cells of at least three pixels: a quarter of a cell, to which they are exact, and half
    a pixel of rounding do not reach from a cell's middle to its side.
    """
    cells = seen[crs]
    assert cells["pixels_a_cell"] > 3.0
    assert cells["looked"] > 1000
    assert cells["hit"] > 100
    assert cells["wrong"] == 0


def test_the_latest_click_wins(seen):
    assert seen["latest"]["id"] == seen["latest"]["asked"] == seen["latest"]["messages"]


def test_felling_the_selected_trees_is_compared_on_the_same_logs(seen):
    told = seen["felled"]
    assert len(told["selected"]) > 5
    assert seen["felled_text"] == f"What if these {len(told['selected'])} trees are felled?"
    assert np.allclose(told["selected"], told["found"], atol=0.001)
    [line] = told["lines"]
    assert line["after"] - line["before"] == line["gained"] - line["lost"]
    assert line["difference"] == pytest.approx((line["gained"] - line["lost"]) / LOGS)
    assert line["ci_low"] <= line["difference"] <= line["ci_high"]
    assert "Paired: the same 150 logs" in told["text"]
    assert told["after"] == [True, True]


def counts(path: Path) -> tuple[np.ndarray, Any]:
    with rasterio.open(path) as source:
        assert source.crs.to_epsg() == 2056
        return source.read(1).astype(int), source.transform


def test_what_is_kept_and_the_run_that_is_saved_are_what_was_shown(seen, work):
    """The run is made by `Slide logs`, with its dialog as filled in by the panel, without the felled trees."""
    assert seen["kept"] == {
        "name": f"Hits of {LOGS} logs, draft, {len(seen['felled']['found'])} trees felled",
        "valid": True,
        "look": "singlebandpseudocolor",
    }
    assert seen["run"] == {"title": "Slide logs", "worked": True}
    kept, where = counts(work / "kept.tif")
    run, whole = counts(work / "run" / "hit_count.tif")
    column, row = (round(each) for each in ~whole @ (where.c, where.f))
    part = run[row : row + kept.shape[0], column : column + kept.shape[1]]
    assert np.array_equal(part, kept)
    assert run[run > 0].sum() == kept.sum()
    before, _ = counts(work / "kept_before.tif")
    assert before.sum() != kept.sum()
    reach = gpd.read_file(work / "run" / "run.gpkg", layer="reach")
    assert reach["n_reach"].tolist() == [each["after"] for each in seen["felled"]["lines"]]
    left = gpd.read_file(work / "run_layers.gpkg", layer="trees")
    assert len(left) == len(gpd.read_file(work / "trees.gpkg")) - len(seen["felled"]["found"])


def test_an_engine_that_dies_is_started_again_and_the_request_repeated(seen):
    assert seen["killed_at"] < 3000
    told = seen["restarted"]
    assert "started again" in told["said"]
    assert told["others"]
    assert told["felled"] == len(seen["felled"]["found"])
    assert told["lines"] == seen["felled"]["lines"]


def test_a_layer_that_is_removed_leaves_the_scene(seen):
    told = seen["layer_gone"]
    assert "because it was removed: Trees" in told["said"]
    assert not told["chosen"]
    [line] = told["reach"]
    [forest] = seen["click"]["reach"]
    assert line["n_reach"] > forest["n_reach"]
    assert seen["terrain_gone"] == {"said": "The terrain model was removed.", "shown": False}


def test_the_engine_ends_with_the_panel_the_project_the_plugin_and_qgis(seen):
    assert seen["closed"] == {"shown": False, "tool": False}
    assert seen["project_closed"] == {"shown": False, "base": False}
    assert seen["unloaded"] == 0
    left = seen["left_behind"]
    assert left
    until = time.monotonic() + 15.0
    while any(Path(f"/proc/{pid}").exists() for pid in left):
        assert time.monotonic() < until, "the engine lives on without QGIS"
        time.sleep(0.1)


def test_a_place_off_the_terrain_model_is_refused_in_words(seen):
    assert "terrain model" in seen["off_the_terrain"]
