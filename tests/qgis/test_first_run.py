"""A first run in QGIS's window: the toolbox, a dialog, and results that arrive styled, named and grouped."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from PIL import Image

from deadwood_toolbox.shelf import TOOLS

HERE = Path(__file__).parent
PAGE = HERE.parents[1] / "deadwood_toolbox" / "qgis_plugin"


@pytest.fixture(scope="module")
def seen(qgis, window: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    work, shots = tmp_path_factory.mktemp("work"), tmp_path_factory.mktemp("shots")
    told = window.first_run(qgis.environment, HERE.parents[1] / "sample_data", work, shots, full=False)
    assert "error" not in told, told["error"]
    return told | {"shots": shots}


def named(rows: list[dict[str, Any]], name: str) -> dict[str, Any]:
    return next(each for each in rows if each.get("name", each.get("group")) == name)


def test_the_toolbox_shows_every_tool_in_its_group(seen):
    expected = {"1 · Start here": ["Begin: the demo slope", "Slope to report", "Check installation"]}
    order = list(dict.fromkeys(tool.group for tool in TOOLS))
    for number, group in enumerate(order, 2):
        expected[f"{number} · {group}"] = [tool.label for tool in TOOLS if tool.in_qgis and tool.group == group]
    assert seen["toolbox"] == {group: sorted(labels) for group, labels in expected.items()}
    assert list(seen["toolbox"]) == sorted(expected)


def test_the_dialog_asks_for_what_is_needed_and_no_more(seen):
    """One of friction, layer and name is needed, so that the first is not marked as optional."""
    assert "Friction coefficient" in seen["labels"]
    assert "Barriers [optional]" in seen["labels"]


def test_runs_are_a_list_of_folders(seen):
    assert [Path(each).name for each in seen["runs"]] == ["one", "other"]
    assert seen["runs_value"] == ",".join(seen["runs"])


def test_the_plugin_offers_to_set_itself_up_and_its_model(seen):
    assert seen["setup"] == ["Install", "Remove", "Close"]
    assert seen["steps"] == ["report", "sample", "slide"]


def test_the_results_of_a_run_arrive_styled_and_in_a_group_of_their_own(seen):
    assert seen["dialog"] == "Slide logs"
    assert seen["worked"]
    group = seen["tree"][0]
    assert group["group"] == "Slide logs: first_run"
    layers = group["layers"]
    assert all(each["valid"] for each in layers)
    assert [each["name"] for each in layers if each["shown"]] == ["Reach", "Deposits", "Hit count"]
    looks = {each["name"]: (each["look"], each.get("field")) for each in layers}
    assert looks["Deposits"] == ("categorizedSymbol", "stop_reason")
    assert looks["Trajectories"] == ("graduatedSymbol", "speed_max_ms")
    assert looks["Hit count"][0] == "singlebandpseudocolor"
    kinds = ["raster" if "field" not in each else "vector" for each in layers]
    assert kinds == sorted(kinds, reverse=True)  # no raster above a layer
    assert named(seen["tree"], "Trees")["field"] == "dbh_cm"


def test_the_project_of_the_run_opens_with_everything_in_place(seen):
    groups = [each["group"] for each in seen["project"] if "group" in each]
    assert groups == ["Results", "Animation", "Scene", "Rasters"]
    every = [each for group in seen["project"] if "group" in group for each in group["layers"]]
    assert all(each["valid"] for each in every)
    assert named(seen["project"], "Terrain") == {"name": "Terrain", "shown": True, "valid": True, "look": "hillshade"}
    assert named(every, "Logs in motion")["temporal"]
    assert {each["name"] for each in every if each.get("solid")} == {
        "Logs at rest",
        "Barriers",
        "Trees",
        "Trajectories",
    }
    assert not [each for each in seen["complaints"] if "version" in each]  # of a project of another version of QGIS
    assert seen["frames"] > 20
    assert seen["views"] <= 1  # from 3.24 on the 3-D view waits in the menu
    assert not any(seen["covered"])  # it is beside the map


@pytest.mark.parametrize("name", ["toolbox", "dialog", "log", "results", "animation"])
def test_the_pictures_show_something(seen, name):
    with Image.open(seen["shots"] / f"{name}.png") as picture:
        assert min(picture.size) >= 600
        colours = picture.convert("RGB").quantize(16).getcolors()
    assert colours is not None
    assert max(count for count, _ in colours) < 0.9 * picture.width * picture.height


def test_the_pages_pictures_are_there_and_small():
    page = (PAGE / "README.md").read_text(encoding="utf-8")
    pictures = sorted((PAGE / "pictures").glob("*.png"))
    assert pictures
    for each in pictures:
        assert f"(pictures/{each.name})" in page
        assert each.stat().st_size < 150_000
