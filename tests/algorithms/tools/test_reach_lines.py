"""Reach from stored trajectories: compared with the run's own, with shapely, and in borderline cases."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pyarrow.parquet as parquet
import pytest
import rasterio
import shapely
from hand_run import Track, write_run
from slope_case import EAST, NORTH, Case, layer, write_dem, write_layer

from deadwood_algorithms import schemas
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.stats.statistics import wilson_interval
from deadwood_algorithms.tools import reach_lines


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def full(case) -> Path:
    return case.run(output=str(case.folder / "full"), **case.everything())


def reach(run: Path, lines: str, path: Path) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame]:
    reach_lines.TOOL(run=str(run), lines=lines, output=str(path), overwrite=True)
    return gpd.read_file(path, layer="reach").set_index("line_id"), gpd.read_file(path, layer="arrivals")


def test_it_agrees_with_the_run(case, full, tmp_path):
    ours, arrivals = reach(full, case.lines, tmp_path / "reach.gpkg")
    theirs = layer(full, "reach").set_index("line_id")
    for name in ("n_total", "n_reach", "p", "ci_low", "ci_high"):
        assert ours[name].to_dict() == theirs[name].to_dict()
    assert 0 < ours.loc["road", "n_reach"] < 24
    by = layer(full, "reached_by").set_index(["log_id", "line_id"])["t_s"].sort_index()
    assert arrivals.set_index(["log_id", "line_id"]).index.sort_values().equals(by.index)
    poses = parquet.read_table(full / "poses.parquet").to_pandas()
    for row in arrivals.itertuples():  # the run gives the first pose that touches; the moment lies before it
        times = poses.loc[poses["log_id"] == row.log_id, "t_s"].to_numpy()
        first = np.flatnonzero(np.isclose(times, by[row.log_id, row.line_id], rtol=0.0, atol=1e-9))[0]
        assert times[max(0, first - 1)] <= row.t_s <= times[first] + 1e-9
    record = ours.loc["road"]
    assert (record["ci_low"], record["ci_high"]) == pytest.approx(wilson_interval(int(record["n_reach"]), 24))


def test_an_arrival_says_when_where_and_how_fast(case, full, tmp_path):
    _, arrivals = reach(full, case.lines, tmp_path / "reach.gpkg")
    poses = parquet.read_table(full / "poses.parquet").to_pandas()
    deposits = layer(full, "deposits").set_index("log_id")
    for row in arrivals.itertuples():
        track = poses[poses["log_id"] == row.log_id]
        steps = np.linalg.norm(np.diff(track[["x", "y", "z"]].to_numpy(), axis=0), axis=1)
        track = track.assign(path_m=np.concatenate([[0.0], np.cumsum(steps)]))
        x, y, z, speed, path = (
            np.interp(row.t_s, track["t_s"], track[name]) for name in ("x", "y", "z", "speed_ms", "path_m")
        )
        assert [row.geometry.x, row.geometry.y, row.geometry.z] == pytest.approx([x, y, z], rel=0.0, abs=1e-3)
        assert (row.speed_ms, row.path_m) == pytest.approx((speed, path), rel=1e-4)
        assert row.energy_kj == pytest.approx(0.5 * 219.91 * row.speed_ms**2 / 1000.0, rel=1e-3)
        assert row.stop_reason == deposits.loc[row.log_id, "stop_reason"]
        assert row.release_id == deposits.loc[row.log_id, "release_id"]
        assert abs(row.geometry.y - (NORTH + 25.0)) < 11.0 or row.line_id == "house"


def test_a_line_is_reached_when_an_outline_touches_it(full, tmp_path):
    """Short lines beside the tracks: touched, when shapely finds them within the swept outlines."""
    table = parquet.read_table(full / "poses.parquet").to_pandas()
    rng = np.random.default_rng(11)
    starts = np.column_stack([60.0 * rng.random(40), 15.0 + 70.0 * rng.random(40)])
    shapes = [shapely.LineString([start, start + rng.normal(0.0, 1.5, 2)]) for start in starts]
    lines = write_layer(tmp_path / "lines.gpkg", shapes, line_id=np.arange(40))
    ours, _ = reach(full, lines, tmp_path / "reach.gpkg")
    thin, thick = np.zeros(40, int), np.zeros(40, int)
    moved = shapely.transform(np.array(shapes), lambda xy: np.add(xy, (EAST, NORTH)))
    for _, rows in table.groupby("log_id"):
        axes = shapely.linestrings(rows[["xb", "yb", "xt", "yt"]].to_numpy().reshape(-1, 2, 2))
        swept = shapely.convex_hull(shapely.union(axes[:-1], axes[1:]))
        area = shapely.union_all(shapely.union_all(swept))
        thin += shapely.intersects(moved, area.buffer(0.05))  # the thinner end has a radius of 0.1 m
        thick += shapely.intersects(moved, area.buffer(0.25))  # the thicker one of 0.2 m
    assert (ours["n_reach"].to_numpy() >= thin).all()
    assert (ours["n_reach"].to_numpy() <= thick).all()
    assert 0 < thin.sum() < thick.sum() < thin.sum() + 40


def test_a_polygon_is_reached_from_inside_and_by_touching(full, tmp_path):
    shapes = [shapely.box(15.0, 65.0, 45.0, 85.0), shapely.box(1.0, 1.0, 59.0, 29.0), shapely.box(1.0, 90.0, 5.0, 98.0)]
    polygons = write_layer(tmp_path / "areas.gpkg", shapes, name=["start", "valley", "corner"])
    ours, arrivals = reach(full, polygons, tmp_path / "reach.gpkg")
    assert ours.loc["start", "n_reach"] == 24
    assert (arrivals.loc[arrivals["line_id"] == "start", "t_s"] == 0.0).all()
    road, _ = reach(
        full,
        write_layer(tmp_path / "edge.gpkg", [shapely.LineString([(1.0, 29.0), (59.0, 29.0)])], line_id=["edge"]),
        tmp_path / "edge_reach.gpkg",
    )
    assert ours.loc["valley", "n_reach"] == road.loc["edge", "n_reach"] > 0
    assert ours.loc["corner", "n_reach"] == 0
    assert ours.loc["corner", "ci_high"] > 0.1


def test_rows_of_one_line_count_once(full, tmp_path):
    parts = [shapely.LineString([(1, 25), (30, 25)]), shapely.LineString([(30, 25), (59, 25)])]
    ours, _ = reach(full, write_layer(tmp_path / "two.gpkg", parts, line_id=["road", "road"]), tmp_path / "two_r.gpkg")
    whole = [shapely.LineString([(1, 25), (59, 25)])]
    theirs, _ = reach(full, write_layer(tmp_path / "one.gpkg", whole, line_id=["road"]), tmp_path / "one_r.gpkg")
    assert ours["n_reach"].to_dict() == theirs["n_reach"].to_dict()
    multi = [shapely.MultiLineString(parts)]
    joined, _ = reach(full, write_layer(tmp_path / "multi.gpkg", multi, line_id=["road"]), tmp_path / "multi_r.gpkg")
    assert joined["n_reach"].to_dict() == theirs["n_reach"].to_dict()


def test_lines_in_another_crs(case, full, tmp_path):
    gpd.read_file(case.lines).to_crs("EPSG:4326").to_file(tmp_path / "lines.gpkg")
    ours, _ = reach(full, str(tmp_path / "lines.gpkg"), tmp_path / "reach.gpkg")
    assert ours["n_reach"].to_dict() == layer(full, "reach").set_index("line_id")["n_reach"].to_dict()


def test_no_arrival_at_all_is_an_answer(full, tmp_path):
    far = write_layer(tmp_path / "far.gpkg", [shapely.LineString([(0.5, 99.0), (0.6, 99.5)])], line_id=["far"])
    ours, arrivals = reach(full, far, tmp_path / "reach.gpkg")
    assert ours.loc["far", "n_reach"] == 0
    assert len(arrivals) == 0


def test_lines_that_miss_the_terrain_are_refused(full, tmp_path):
    shapes = [shapely.LineString([(1, -25), (59, -25)]), shapely.LineString([(1, -35), (59, -35)])]
    with pytest.raises(UserError, match="none of the 2 lines touches the DEM") as error:
        reach(full, write_layer(tmp_path / "lines.gpkg", shapes), tmp_path / "reach.gpkg")
    assert "\n" not in str(error.value)
    assert not (tmp_path / "reach.gpkg").exists()


def test_without_trajectories_there_is_nothing_to_say(case, tmp_path):
    run = case.run(output=str(tmp_path / "run"), trajectories="none")
    with pytest.raises(UserError, match="--trajectories all"):
        reach(run, case.lines, tmp_path / "reach.gpkg")


ROAD = shapely.LineString([(1, 25), (59, 25)])
HOUSE = shapely.box(10.0, 5.0, 20.0, 15.0)


@pytest.fixture
def by_hand(tmp_path) -> Path:
    """Six logs of 4 m on flat ground: four of release 1 go south, two of release 2 west; a road and a house."""
    dem = write_dem(tmp_path / "flat.tif", flat=True)
    tracks = [
        Track((30.0, 60.0), (30.0, 20.0)),
        Track((31.5, 60.0), (31.5, 20.0), speed=20.0, clearance=1.5, broadside_deg=90.0),
        Track((30.5, 61.0), (30.5, 40.0)),
        Track((40.0, 8.0), (12.0, 8.0), release_id=2, broadside_deg=30.0, spin=2.0),
        Track((40.0, 40.0), (12.0, 12.0), release_id=2, broadside_deg=20.0),
        Track((33.0, 60.0), (33.0, 45.0)),
    ]
    return write_run(tmp_path / "run", tracks, dem=dem)


def both(tmp_path: Path) -> str:
    return write_layer(tmp_path / "both.gpkg", [ROAD, HOUSE], line_id=["road", "house"])


def test_arrivals_by_hand(by_hand, tmp_path):
    """A log of 4 m along its path touches a road when its middle is 2.1 m before it, a broadside one 0.2 m."""
    ours, arrivals = reach(by_hand, both(tmp_path), tmp_path / "reach.gpkg")
    assert ours["n_reach"].to_dict() == {"road": 3, "house": 2}
    row = arrivals.set_index(["line_id", "log_id"]).loc
    straight, broad, turned, slanting = row["road", 0], row["road", 1], row["house", 3], row["house", 4]
    assert straight.geometry.y - NORTH == pytest.approx(27.1, abs=0.02)  # with the radius of the tip, which leads
    assert broad.geometry.y - NORTH == pytest.approx(25.2, abs=0.5)
    assert straight["t_s"] == pytest.approx((60.0 - (straight.geometry.y - NORTH)) / 10.0)
    for each, angles in ((straight, (180, 90, 0)), (broad, (180, 90, 90)), (turned, (270, 90, 30))):
        assert each[["azimuth_deg", "impact_deg", "axis_deg"]].tolist() == pytest.approx(angles, abs=1e-6)
    assert slanting[["azimuth_deg", "impact_deg", "axis_deg"]].tolist() == pytest.approx([225.0, 45.0, 20.0])
    assert [straight["touch_x"] - EAST, straight["touch_y"] - NORTH] == pytest.approx([30.0, 25.0])
    assert [broad["clearance_m"], broad["speed_ms"]] == [1.5, 20.0]
    assert arrivals["height_m"].to_numpy() == pytest.approx(0.5, abs=1e-4)  # float32 heights near 1000 m
    # A truncated cone of 40 cm, 4 m, 300 kg/m3 has 87.96 kg; spin about an axis that does not turn is axial
    assert broad["energy_kj"] == pytest.approx(0.5 * 87.965 * 400.0 / 1000.0, rel=1e-4)
    assert straight["rotation_kj"] == 0.0
    axial = 0.3 * (1 + 1 / 2 + 1 / 4 + 1 / 8 + 1 / 16) / (1 + 1 / 2 + 1 / 4) * 0.2**2
    assert turned["rotation_kj"] == pytest.approx(0.5 * 87.965 * axial * 4.0 / 1000.0, rel=1e-4)
    few = ["speed_median_ms", "speed_p95_ms", "energy_median_kj", "energy_p95_kj"]
    assert ours.loc["road", few].isna().all()
    assert ours.loc["road", "n_more"] == 72 - 3
    assert ours.loc["road", "clearance_max_m"] == 1.5


def test_what_most_arrivals_stay_below(tmp_path):
    """Of 75 arrivals at different speeds, and so energies: the quantiles of numpy, and none missing."""
    speeds = np.round(5.0 + 20.0 * np.random.default_rng(3).random(75) ** 2, 1)
    tracks = [Track((30.0, 60.0), (30.0, 20.0), speed=float(each)) for each in speeds]
    run = write_run(tmp_path / "run", tracks, dem=write_dem(tmp_path / "flat.tif", flat=True))
    ours, arrivals = reach(run, both(tmp_path), tmp_path / "reach.gpkg")
    assert np.sort(arrivals["speed_ms"]) == pytest.approx(np.sort(speeds), rel=1e-6)
    for column, values in (("speed_{}_ms", speeds), ("energy_{}_kj", arrivals["energy_kj"])):
        found = [ours.loc["road", column.format(each)] for each in ("median", "p95")]
        assert found == pytest.approx(np.quantile(values, [0.5, 0.95]).tolist(), rel=1e-6)
    assert ours.loc["road", "n_more"] == 0


def test_attribution_both_ways(by_hand, tmp_path):
    reach_lines.TOOL(run=str(by_hand), lines=both(tmp_path), output=str(tmp_path / "r.gpkg"))
    table = gpd.read_file(tmp_path / "r.gpkg", layer="attribution").set_index(["release_id", "line_id"])
    assert table["n_reach"].to_dict() == {(1, "road"): 2, (1, "house"): 0, (2, "road"): 1, (2, "house"): 2}
    assert table["n_total"].to_dict() == {(1, "road"): 4, (1, "house"): 4, (2, "road"): 2, (2, "house"): 2}
    assert table.loc[(1, "road"), "share_of_arrivals"] == pytest.approx(2 / 3)
    low, high = wilson_interval(2, 4)
    assert table.loc[(1, "road"), ["ci_low", "ci_high"]].tolist() == pytest.approx([low, high])
    start, end = np.array(table.loc[(2, "house")].geometry.coords) - (EAST, NORTH)
    assert start == pytest.approx([40.0, 24.0])
    assert end == pytest.approx([20.0, 14.0], abs=6.0)
    from_where = gpd.read_file(tmp_path / "r.gpkg", layer="origins")
    assert sorted(zip(from_where["line_id"], from_where["log_id"], strict=True)) == [
        ("house", 3), ("house", 4), ("road", 0), ("road", 1), ("road", 4),
    ]  # fmt: skip
    assert {(p.x - EAST, p.y - NORTH) for p in from_where[from_where["line_id"] == "house"].geometry} == {
        (40, 8),
        (40, 40),
    }


def test_logs_near_the_edges_are_warned_of(tmp_path, said):
    """Nodata north of v = 90; a track along v = 85 is 5 to 6 m from it (cell centres), one along u = 8 is 8 m from
    the border."""
    dem = write_dem(tmp_path / "flat.tif", flat=True)
    with rasterio.open(dem, "r+") as made:
        values = made.read(1)
        values[:10] = -9999.0
        made.write(values, 1)
    tracks = [
        Track((30.0, 60.0), (30.0, 20.0)),
        Track((20.0, 84.5), (40.0, 84.5)),
        Track((8.4, 60.0), (8.4, 40.0)),
        Track((30.0, 60.0), (30.0, 89.0), stop_reason="left_dem"),
    ]
    run = write_run(tmp_path / "run", tracks, dem=dem)
    for edge_m, near in ((5.9, 0), (6.1, 1), (9.1, 2)):
        said.warnings.clear()
        values = {"run": str(run), "lines": both(tmp_path), "output": str(tmp_path / "r.gpkg"), "overwrite": True}
        outcome = reach_lines.TOOL(feedback=said, edge_m=edge_m, **values)
        assert outcome.facts["edges"] == {"n_left_dem": 1, "n_near_edge": near, "edge_m": edge_m}
        assert "1 of 4 logs left the terrain model, and their further movement is not known" in said.warnings[0]
        assert (f"; {near} more passed within {edge_m:g} m" in said.warnings[0]) == (near > 0)


@pytest.mark.parametrize("name", ["reach", "arrivals", "attribution", "origins"])
def test_the_layers_are_those_of_the_schema(by_hand, tmp_path, name):
    reach(by_hand, both(tmp_path), tmp_path / "r.gpkg")
    written = gpd.read_file(tmp_path / "r.gpkg", layer=name)
    assert [column for column in written.columns if column != "geometry"] == [
        column.name for column in schemas.LAYERS[name].columns
    ]
    for column in schemas.LAYERS[name].columns:
        values = written[column.name].dropna().tolist()
        assert [schemas.value_fault(column, each) for each in values] == [None] * len(values)
