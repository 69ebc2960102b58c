"""A saved run equals that of `slide-logs` with the layers saved beside it, and what the page has shown."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
from explore_case import COLUMNS, ROWS, Asked, opened, whole_picture, write_case
from slope_case import assert_same_bytes, layer, raster, summary

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.tools import slide_logs
from deadwood_toolbox import cli

EVERYTHING: dict[str, Any] = {
    "fell": [3, 50, 51, 199],
    "plant": [{"x": 85.0, "y": 145.0, "dbh_cm": 45.3, "height_m": 20.1}],
    "barriers": [{"points": [[80.0, 100.0], [100.0, 104.0], [120.0, 103.0]], "height_m": 2.0}],
    "lying_logs": [{"points": [[60.0, 90.0], [70.0, 99.0]], "diameter_cm": 33.3}],
}


def assert_is_what_was_shown(asked: Asked, run: Path) -> None:
    """The last frame of an answer, and the run's folder."""
    told = asked.frames[-1]
    assert told.facts["final"]
    assert np.array_equal(raster(run / "hit_count.tif"), whole_picture(told))
    for shown, kept in zip(told.facts["reach"], summary(run)["reach"], strict=True):
        assert {name: kept[name] for name in shown} == {**shown, "line_id": kept["line_id"]}
        assert str(kept["line_id"]) == shown["line_id"]
    deposits = layer(run, "deposits")
    west, south = asked.session.layers.dem.bounds[:2]
    assert np.array_equal((deposits.geometry.x - west).astype("f4"), told.arrays["deposits_x"])
    assert np.array_equal((deposits.geometry.y - south).astype("f4"), told.arrays["deposits_y"])
    reasons = deposits["stop_reason"].value_counts().to_dict()
    assert reasons == {name: n for name, n in told.facts["stopped"].items() if n}


@pytest.mark.parametrize(
    "changes", [{}, {"fell": [0, 100, 101, 102]}, EVERYTHING], ids=["plain", "felled", "everything"]
)
@pytest.mark.parametrize("fidelity", ["draft", "standard"])
def test_what_is_kept_is_what_was_shown_and_what_slide_logs_gives(
    tmp_path: Path, changes: dict[str, Any], fidelity: str, monkeypatch: pytest.MonkeyPatch
):
    layers = write_case(tmp_path)
    with opened(layers, output=str(tmp_path / "kept")) as asked:
        more = {"friction": 0.31, "rolling_friction": 0.05, "restitution": 0.1} if fidelity == "draft" else {}
        asked.release(n=120, fidelity=fidelity, seed=5, **more)
        if changes:
            asked.edit(**changes)
        told = asked.keep("valley 1")
        run = tmp_path / "kept" / "valley 1"
        assert_is_what_was_shown(asked, run)
    assert told.facts["files"] == ["valley 1", "valley 1_layers.gpkg"]

    beside = tmp_path / "kept" / "valley 1_layers.gpkg"
    written = set(gpd.list_layers(beside)["name"]) - {"layer_styles"}
    named = {"fell": "trees", "plant": "trees"}
    assert written == {"releases", *(named.get(each, each) for each in changes)}
    changed = {name: f"{beside}|layername={name}" for name in written}
    by_hand = {**layers, **changed, "friction": 0.25, "time_limit_s": 60.0, "fidelity": fidelity, "seed": 5, **more}
    slide_logs.TOOL(output=str(tmp_path / "by hand"), **by_hand)
    assert_same_bytes(run, tmp_path / "by hand")

    command = shlex.split(told.facts["command"])
    monkeypatch.chdir(tmp_path / "kept")
    assert cli.run(command[1:]) == 0
    assert_same_bytes(run, tmp_path / "kept" / "valley 1 again")
    first, second = (json.loads((each / "manifest.json").read_text())["run_id"] for each in (run, tmp_path / "by hand"))
    assert first == second


def test_the_layers_beside_a_run_hold_what_the_own_ones_do(tmp_path: Path):
    layers = write_case(tmp_path)
    with opened(layers, output=str(tmp_path / "kept")) as asked:
        asked.release(n=30)
        asked.edit(**EVERYTHING)
        asked.keep("a")
    beside = tmp_path / "kept" / "a_layers.gpkg"
    before, after = gpd.read_file(layers["trees"]), gpd.read_file(beside, layer="trees")
    assert list(after.columns) == list(before.columns)
    stays = before.drop(EVERYTHING["fell"])
    assert after[:-1].drop(columns="geometry").equals(stays.drop(columns="geometry").reset_index(drop=True))
    assert after["tree_id"].iloc[-1] == before["tree_id"].max() + 1
    assert after["species"].isna().tolist() == [False] * len(stays) + [True]
    barriers = gpd.read_file(beside, layer="barriers")
    assert barriers["barrier_id"].tolist() == ["7", "drawn 1"]
    assert barriers["height_m"].tolist() == [1.5, 2.0]
    lying = gpd.read_file(beside, layer="lying_logs")
    assert lying["lying_id"].tolist() == ["a", "drawn 1"]
    assert lying["tip_diameter_cm"].tolist() == [22.5, 16.65]


@pytest.mark.parametrize("name", [None, "", "../up", "/tmp/x", "a/b", ".hidden", "x" * 99, "dot.", 5, "a\\b", "a\nb"])
def test_a_name_that_is_no_name_is_refused(tmp_path: Path, name: Any):
    with opened(write_case(tmp_path), output=str(tmp_path / "kept")) as asked:
        asked.release(n=6)
        with pytest.raises(UserError, match="give the run a name"):
            asked.keep(name)
    assert not (tmp_path / "kept").exists()


def test_what_is_there_is_not_replaced_and_what_fails_leaves_nothing(tmp_path: Path):
    with opened(write_case(tmp_path), output=str(tmp_path / "kept")) as asked:
        asked.release(n=6)
        asked.keep("a")
        with pytest.raises(UserError, match="'a' already"):
            asked.keep("a")

        def fails(_: Any) -> None:
            raise UserError("the disk is full")

        with pytest.raises(UserError, match="full"):
            asked.keep("b", fails)
        # an engine that was killed while it saved: its name can be used again
        kept = tmp_path / "kept"
        (kept / "c_layers.gpkg").write_bytes(b"half")
        (kept / ".c.part").mkdir()
        (kept / ".c.part" / "rasters_1.npz").write_bytes(b"some")
        (kept / ".c.partial-x1").mkdir()
        asked.keep("c")
    assert sorted(each.name for each in kept.iterdir()) == ["a", "a_layers.gpkg", "c", "c_layers.gpkg"]


def test_the_run_can_be_left_to_whoever_asks(tmp_path: Path):
    """As the panel in QGIS does, which opens the dialog of slide-logs on the layers."""

    def slides(_: Any) -> None:
        raise AssertionError("a run was slid")

    with opened(write_case(tmp_path), output=str(tmp_path / "kept")) as asked:
        asked.release(n=6)
        asked.edit(fell=[3])
        told = asked.keep("a", slides, run_too=False)
    assert told.facts["files"] == ["a_layers.gpkg"]
    assert told.facts["layers"] == ["releases", "trees"]
    assert [each.name for each in (tmp_path / "kept").iterdir()] == ["a_layers.gpkg"]
    assert len(gpd.read_file(tmp_path / "kept" / "a_layers.gpkg", layer="releases")) == 6


def test_without_any_layer_it_works_as_well(tmp_path: Path):
    layers = {"dem": write_case(tmp_path)["dem"]}
    with opened(layers, output=str(tmp_path / "kept")) as asked:
        told = asked.release(n=40)
        assert told.facts["reach"] == []
        asked.edit(plant=EVERYTHING["plant"], barriers=EVERYTHING["barriers"], lying_logs=EVERYTHING["lying_logs"])
        asked.keep("a")
        assert np.array_equal(raster(tmp_path / "kept" / "a" / "hit_count.tif"), whole_picture(asked.frames[-1]))


def test_what_is_kept_of_a_large_terrain_is_slid_on_windows_and_is_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """`slide-logs` reads only the part of a large terrain model that logs reach; a window that is too small grows."""
    from deadwood_algorithms.scene import layers as read
    from deadwood_algorithms.scene import reach
    from deadwood_algorithms.simulate import windows

    for module in (read, windows):
        monkeypatch.setattr(module, "WHOLE_CELLS", 1000)
    monkeypatch.setattr(reach, "BLOCK_CELLS", 16)
    parts: list[Any] = []
    part_of = windows.part_of
    monkeypatch.setattr(windows, "part_of", lambda *given: parts.append(part_of(*given)) or parts[-1])
    with opened(write_case(tmp_path), output=str(tmp_path / "kept")) as asked:
        asked.release(n=60, shape={"circle": [90.0, 120.0, 5.0]})
        asked.edit(**EVERYTHING)
        asked.keep("large")
        assert_is_what_was_shown(asked, tmp_path / "kept" / "large")
    assert parts[0].cells < ROWS * COLUMNS
