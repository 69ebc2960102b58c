"""Boulders through files: they hold what slides onto them, are counted and named, and bad layers are refused."""

from __future__ import annotations

import json
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
from slope_case import Case, assert_same_run, layer, points, summary, write_layer

from deadwood_algorithms import schemas
from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.scene.blocks import Boulders, read_blocks
from deadwood_algorithms.scene.layers import read_scene
from deadwood_algorithms.tools import compare_scenarios

LYING = {"orientation": "lying", "azimuth_deg": 90.0}
ROW = [(12.0 + 4.0 * k, 50.0) for k in range(10)]  # nearer to each other than the logs of 10 m are long


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def grid(case) -> Grid:
    return read_dem(case.dem, feedback=Quiet())


def scene_layers(folder: Path) -> dict[str, str]:
    """A row of boulders across the slope, with a tree and a lying log beside it that no log meets."""
    import shapely

    return {
        "blocks": write_layer(
            folder / "blocks.gpkg", points(*ROW), block_id=[f"b{k}" for k in range(10)], diameter_m=[2.0] * 10,
            height_m=[1.6] * 10,
        ),
        "trees": write_layer(folder / "tree.gpkg", points((2.0, 95.0)), tree_id=[7], dbh_cm=[30.0], height_m=[10.0]),
        "lying_logs": write_layer(
            folder / "lying.gpkg", [shapely.LineString([(2.0, 90.0), (5.0, 90.0)])], lying_id=["old"]
        ),
    }  # fmt: skip


@pytest.fixture(scope="module")
def held(case) -> Path:
    return case.run(output=str(case.folder / "held"), threads=1, **scene_layers(case.folder), **LYING)


@pytest.fixture(scope="module")
def free(case) -> Path:
    return case.run(output=str(case.folder / "free"), **LYING)


def test_they_hold_logs_and_report_it(held):
    deposits, hits, told = layer(held, "deposits"), layer(held, "block_hits"), summary(held)
    stopped = deposits["stop_reason"] == "block"
    assert stopped.sum() > 12
    assert set(deposits.loc[stopped, "stop_id"]) <= {f"block:b{k}" for k in range(10)}
    by_id = deposits.loc[stopped, "stop_id"].str.removeprefix("block:").value_counts()
    assert dict(zip(hits["block_id"], hits["n_stops"], strict=True)) == {
        name: by_id.get(name, 0) for name in hits["block_id"]
    }
    assert hits["n_stops"].sum() == stopped.sum()
    assert np.allclose(hits["diameter_m"], 2.0)
    assert np.allclose(hits["height_m"], 1.6)
    assert [each.name for each in schemas.LAYERS["block_hits"].columns] == [c for c in hits.columns if c != "geometry"]
    assert (
        told["modelled"]["blocks"]
        == "10 rigid spheres, with the ground's friction and restitution; 0 off the DEM left out"
    )
    assert told["blocks"]["n_total"] == 10
    assert told["blocks"]["n_stops"] == stopped.sum() == told["logs"]["by_stop_reason"]["block"]
    # each log's count agrees with the layer of hits; obstacles numbered before the boulders were not met
    assert hits["n_logs"].sum() == deposits["tree_hits"].sum() > 0
    assert told["trees"]["n_hits"] == told["lying_logs"]["n_hits"] == 0
    assert not {"tree_hits", "lying_hits"} & set(gpd.list_layers(held / "run.gpkg")["name"])


def test_without_them_they_continue(held, free):
    """Without the row, every log that it holds would have passed it by far."""
    with_blocks, without = layer(held, "deposits"), layer(free, "deposits")
    stopped = (with_blocks["stop_reason"] == "block").to_numpy()
    assert (without["runout_m"] - with_blocks["runout_m"])[stopped].min() > 5.0
    assert summary(free)["modelled"]["blocks"].startswith("not modelled")
    assert summary(free)["blocks"] is None


def test_threads_do_not_change_a_bit(case, held, tmp_path):
    again = case.run(output=str(tmp_path / "again"), threads=4, **scene_layers(tmp_path), **LYING)
    assert_same_run(held, again)
    assert layer(held, "block_hits").equals(layer(again, "block_hits"))


def test_blocks_that_no_log_meets_change_no_bit_and_none_no_digest(case, free, tmp_path):
    far = write_layer(tmp_path / "far.gpkg", points((2.0, 98.0)), diameter_m=[1.0])
    beside = case.run(output=str(tmp_path / "beside"), blocks=far, **LYING)
    for name in ("deposits", "trajectories"):
        assert layer(beside, name).equals(layer(free, name))
    digests = [json.loads((each / "manifest.json").read_text())["digests"]["scene"] for each in (free, beside)]
    assert digests[0] != digests[1]
    grid = read_dem(case.dem, feedback=Quiet())
    from deadwood_algorithms.scene.items import digest_of
    from deadwood_engine import Barriers, Lines, LyingLogs, Trees

    absent = Trees.none()[:4], Barriers.none(), Lines.none(), LyingLogs.none()[:4]
    bare = digest_of(grid.values, [grid.cell, grid.x0, grid.y0], 0.25, *absent)  # as before blocks were introduced
    scene = read_scene(case.dem, "0.25", None, None, None, crs=None, feedback=Quiet())
    assert scene.digest == bare == digests[0]


def test_scenarios_tell_what_boulders_hold(held, free, tmp_path):
    output = tmp_path / "compared"
    outcome = compare_scenarios.TOOL(runs=f"{free},{held}", output=str(output))
    assert any("by boulders" in each for each in outcome.lines)
    table = (output / "table.csv").read_text(encoding="utf-8")
    assert "block" in table


def test_sizes_come_from_diameter_or_radius_and_lie_on_the_ground_unless_said(tmp_path, grid):
    def read(file: str, **columns) -> Boulders:
        return read_blocks(write_layer(tmp_path / f"{file}.gpkg", points((20, 60), (30, 60)), **columns), grid, Quiet())

    own = read("own", diameter_m=[1.0, 2.0], radius_m=[9.0, 9.0], height_m=[0.4, np.nan])
    assert own.solid.diameter.tolist() == [1.0, 2.0]
    assert own.solid.height.tolist() == [0.4, 2.0]
    assert own.ids == ["1", "2"]
    half = read("half", radius_m=[0.5, 1.5], name=["x", "y"])
    assert half.solid.diameter.tolist() == half.solid.height.tolist() == [1.0, 3.0]
    assert half.ids == ["x", "y"]
    assert read_blocks(None, grid, Quiet()).ids == []


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"diameter_m": [0.0]}, "field 'diameter_m', row 1: 0 is not a number greater than 0"),
        ({"diameter_m": ["big"]}, "field 'diameter_m', row 1: 'big' is not a number"),
        ({"diameter_m": [-1.0]}, "field 'diameter_m', row 1"),
        ({"diameter_m": [1000.0]}, "field 'diameter_m', row 1"),
        ({"radius_m": [np.nan]}, "field 'radius_m', row 1"),
        ({"diameter_m": [1.0], "height_m": [0.0]}, "field 'height_m', row 1"),
        ({"diameter_m": [1.0], "height_m": [1.5]}, "field 'height_m', row 1: the top is higher above the terrain"),
        ({"size": [1.0]}, "neither a field 'diameter_m' nor 'radius_m'"),
    ],
)
def test_a_bad_size_is_named(tmp_path, grid, columns, message):
    path = write_layer(tmp_path / "bad.gpkg", points((20, 60)), **columns)
    with pytest.raises(UserError, match=message) as error:
        read_blocks(path, grid, Quiet())
    assert "\n" not in str(error.value)
    assert "bad.gpkg" in str(error.value)


def test_off_the_dem_or_no_point_is_refused(tmp_path, grid, said):
    import shapely

    off = write_layer(tmp_path / "off.gpkg", points((500, 500)), diameter_m=[1.0])
    with pytest.raises(UserError, match="no block lies on the DEM"):
        read_blocks(off, grid, Quiet())
    both = write_layer(tmp_path / "both.gpkg", points((500, 500), (20, 60)), diameter_m=[1.0, 2.0], block_id=[3, 4])
    there = read_blocks(both, grid, said)
    assert (there.ids, there.left_out["off_dem"], there.solid.diameter.tolist()) == (["4"], 1, [2.0])
    assert any("row 1: 1 of 2 blocks lies off the DEM and is left out" in each for each in said.notes)
    lines = write_layer(tmp_path / "lines.gpkg", [shapely.LineString([(10, 60), (20, 60)])], diameter_m=[1.0])
    with pytest.raises(UserError, match="row 1: a LineString, but the blocks must be points"):
        read_blocks(lines, grid, Quiet())


def test_twins_and_units_are_warned_of(tmp_path, grid, said):
    twins = write_layer(tmp_path / "t.gpkg", points((20, 60), (30, 60)), block_id=["a", "a"], diameter_m=[90.0, 1.0])
    read_blocks(twins, grid, said)
    assert any("are called 'a'" in each for each in said.warnings)
    assert any("diameter_m" in each for each in said.warnings)
