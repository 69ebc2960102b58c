"""Reach from stored trajectories: against the run's own, against shapely, and at the edges of what reaching means."""

from __future__ import annotations

import sys
from pathlib import Path

import geopandas as gpd
import numpy as np
import pyarrow.parquet as parquet
import pytest
import shapely

from deadwood_algorithms import reach_lines
from deadwood_algorithms.reach_lines import mass_of_cone
from deadwood_algorithms.statistics import wilson_interval
from deadwood_algorithms.tool import UserError

sys.path.insert(0, str(Path(__file__).parent))  # importlib mode leaves siblings to us

from slope_case import EAST, NORTH, Case, layer, write_layer


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
    assert np.allclose(arrivals.set_index(["log_id", "line_id"])["t_s"].sort_index(), by, atol=1e-9)
    record = ours.loc["road"]
    assert (record["ci_low"], record["ci_high"]) == pytest.approx(wilson_interval(int(record["n_reach"]), 24))


def test_an_arrival_says_when_where_and_how_fast(case, full, tmp_path):
    _, arrivals = reach(full, case.lines, tmp_path / "reach.gpkg")
    poses = parquet.read_table(full / "poses.parquet").to_pandas()
    deposits = layer(full, "deposits").set_index("log_id")
    for row in arrivals.itertuples():
        track = poses[(poses["log_id"] == row.log_id) & (poses["t_s"] <= row.t_s + 1e-9)]
        last = track.iloc[-1]
        assert [row.geometry.x, row.geometry.y, row.geometry.z] == pytest.approx(last[["x", "y", "z"]].tolist())
        assert row.speed_ms == pytest.approx(last["speed_ms"])
        steps = np.linalg.norm(np.diff(track[["x", "y", "z"]].to_numpy(), axis=0), axis=1)
        assert row.path_m == pytest.approx(steps.sum())
        assert row.energy_kj == pytest.approx(0.5 * 219.91 * row.speed_ms**2 / 1000.0, rel=1e-3)
        assert row.stop_reason == deposits.loc[row.log_id, "stop_reason"]
        assert row.release_id == deposits.loc[row.log_id, "release_id"]
        assert abs(row.geometry.y - (NORTH + 25.0)) < 11.0 or row.line_id == "house"


def test_the_mass_is_that_of_a_truncated_cone():
    """pi L / 12 (D^2 + D d + d^2), d = D / 2: by a fine sum over discs."""
    s = (np.arange(100_000) + 0.5) / 100_000
    discs = np.pi * (0.2 * (1.0 - 0.5 * s)) ** 2 * 10.0 / 100_000
    assert mass_of_cone(np.array(40.0), np.array(10.0), np.array(300.0)) == pytest.approx(300.0 * discs.sum(), rel=1e-8)


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
    shapes = [shapely.LineString([(1, 25), (59, 25)]), shapely.LineString([(1, -25), (59, -25)])]
    with pytest.raises(UserError, match="row 2: the line does not touch the DEM") as error:
        reach(full, write_layer(tmp_path / "lines.gpkg", shapes), tmp_path / "reach.gpkg")
    assert "\n" not in str(error.value)
    assert not (tmp_path / "reach.gpkg").exists()


def test_without_trajectories_there_is_nothing_to_say(case, tmp_path):
    run = case.run(output=str(tmp_path / "run"), trajectories="none")
    with pytest.raises(UserError, match="--trajectories all"):
        reach(run, case.lines, tmp_path / "reach.gpkg")
