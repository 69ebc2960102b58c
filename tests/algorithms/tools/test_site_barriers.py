"""site-barriers against whole runs with the barriers that it puts up, log by log."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from slope_case import Case, arrivals, assert_same_file, layer, points, summary, write_layer

from deadwood_algorithms.evaluate.protection.siting import flux_of
from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.results.passages import passages_of_lines
from deadwood_algorithms.results.run_folder import read_run
from deadwood_algorithms.stats.order_statistics import percentile_record
from deadwood_algorithms.stats.statistics import paired_interval, wilson_interval
from deadwood_algorithms.tools import site_barriers

LOGS = 60


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    made = Case(tmp_path_factory.mktemp("case"))
    rng = np.random.default_rng(7)
    spots = [(12.0 + 36.0 * a, 65.0 + 15.0 * b) for a, b in rng.random((LOGS, 2))]
    made.releases = write_layer(made.folder / "many.gpkg", points(*spots), log_id=np.arange(LOGS) * 2 + 1)
    return made


@pytest.fixture(scope="module")
def bare(case) -> Path:
    return case.run(output=str(case.folder / "bare"), lines=case.lines, trajectories="none")


@pytest.fixture(scope="module")
def lines(case) -> str:
    shapes = [
        shapely.LineString([(8.0, 45.0), (24.0, 44.0)]),
        shapely.LineString([(24.0, 44.0), (44.0, 45.0)]),
        shapely.LineString([(20.0, 50.0), (28.0, 50.0)]),
    ]
    return write_layer(case.folder / "could.gpkg", shapes, barrier_id=["west", "east", "short"])


def site(run: Path, out: Path, **more: Any) -> tuple[pd.DataFrame, gpd.GeoDataFrame, dict[str, Any]]:
    site_barriers.TOOL(run=str(run), output=str(out), overwrite=True, **more)
    table, frame = pd.read_csv(out / "pareto.csv"), gpd.read_file(out / "barriers.gpkg", layer="barriers")
    return table, frame, json.loads((out / "summary.json").read_text("utf-8"))


def any_line(run: Path) -> set[int]:
    return {log for log, _ in arrivals(run)}


def check(row: Any, before: Path, after: Path, barrier_id: str) -> None:
    """A row of the table against a whole run with the barrier: remaining reach, gain, what it holds, its hits."""
    was, now = any_line(before), any_line(after)
    assert row.n_reach == len(now)
    assert (row.ci_low, row.ci_high) == pytest.approx(wilson_interval(len(now), LOGS))
    assert row.gain_logs == len(was - now) - len(now - was)
    assert (row.gain_ci_low, row.gain_ci_high) == pytest.approx(paired_interval(len(now - was), len(was - now), LOGS))
    (record,) = (each for each in summary(after)["barriers"] if each["barrier_id"] == barrier_id)
    for name in ("n_stopped", "n_overjumped", "n_passed_beside"):
        assert getattr(row, name) == record[name], name
    hits: Any = layer(after, "barrier_hits")
    largest = hits[hits["barrier_id"].astype(str) == barrier_id].groupby("log_id")[["energy_kj", "height_hit_m"]].max()
    assert row.n_hit == len(largest)
    for column, name, unit in (("energy_kj", "energy", "kj"), ("height_hit_m", "height", "m")):
        told = percentile_record(largest[column].to_numpy(), 0.95)
        assert getattr(row, f"{name}_hit_p95_{unit}") == pytest.approx(told["value"], nan_ok=True)
        assert getattr(row, f"{name}_hit_ci_low_{unit}") == pytest.approx(told["ci_low"], nan_ok=True)


@pytest.mark.parametrize("trees", [True, False])
def test_what_is_left_is_what_whole_runs_leave(case, bare, lines, tmp_path, trees):
    """Each candidate alone, and the sets that are chosen; also where barriers are the first obstacles."""
    more = {"lines": case.lines, "trajectories": "none"} | ({"trees": case.trees} if trees else {})
    run = case.run(output=str(tmp_path / "run"), **more) if trees else bare
    table, frame, facts = site(run, tmp_path / "out", candidates=lines, height_m="1,3", count=2)
    alone = table[table["step"] == 0]
    assert len(alone) == 6
    if trees:
        assert (alone["n_near"] < LOGS).all(), "every log is slid again: what is left out is not tested"
    differing = 0
    for row in alone.itertuples():
        name, height = row.barrier_id.split()[:2]
        one = gpd.read_file(lines)
        one = one[one["barrier_id"] == name].assign(height_m=float(height), barrier_id=row.barrier_id)
        one.to_file(tmp_path / "one.gpkg", driver="GPKG")
        then = case.run(output=str(tmp_path / "then"), overwrite=True, barriers=str(tmp_path / "one.gpkg"), **more)
        check(row, run, then, row.barrier_id)
        differing += arrivals(then) != arrivals(run)
    assert differing > 3
    chosen = table[table["step"] > 0]
    assert len(chosen) == 2, "too little is gained for two barriers to be chosen"
    last: Any = list(chosen.itertuples())[-1]
    then = case.run(
        output=str(tmp_path / "then"), overwrite=True, barriers=str(tmp_path / "out" / "barriers.gpkg"), **more
    )
    assert last.n_reach == len(any_line(then))
    for record in summary(then)["barriers"]:
        mine = frame[frame["barrier_id"] == record["barrier_id"]].iloc[0]
        for name in ("n_stopped", "n_overjumped", "n_passed_beside"):
            assert mine[name] == record[name]
    by_line = {each["line_id"]: each["n_reach"] for each in facts["reach_by_line_after"]}
    assert by_line == {each["line_id"]: each["n_reach"] for each in summary(then)["reach"]}


def test_what_a_place_needs_is_the_same_for_every_height_and_that_of_a_line_there(case, tmp_path):
    """Before, the heights were those of hits, cut off at the height that was tried."""
    more = {"friction": "0.1", "trajectories": "all"}
    place = shapely.LineString([(8.0, 45.0), (44.0, 46.0)])
    along = write_layer(tmp_path / "place.gpkg", [place], line_id=["place"])
    rng = np.random.default_rng(8)  # enough logs for the percentiles, above the middle of the place
    spots = [(14.0 + 24.0 * a, 65.0 + 15.0 * b) for a, b in rng.random((160, 2))]
    many = write_layer(tmp_path / "many.gpkg", points(*spots))
    run = case.run(output=str(tmp_path / "run"), lines=case.lines, releases=many, **more)
    could = write_layer(tmp_path / "could.gpkg", [place], barrier_id=["place"])
    table, frame, _ = site(run, tmp_path / "out", candidates=could, height_m="0.1,1,4", count=1)
    alone = table[table["step"] == 0].set_index("height_m")
    needed = [each for each in table if "_needed_" in each]
    assert (alone[needed].drop_duplicates().shape[0], len(needed)) == (1, 6)
    assert alone.loc[0.1, "height_hit_p95_m"] < 0.3 < alone.loc[0.1, "height_needed_p95_m"]
    (came,) = (each for each in passages_of_lines(read_run(str(run), feedback=Quiet()), along, Quiet()))
    assert alone["n_come"].eq(came.log_id.size).all()
    for quantity, column in (("energy", "energy_needed_{}_kj"), ("height_needed", "height_needed_{}_m")):
        told = percentile_record(came.values[quantity], 0.95)
        for end, value in (("p95", told["value"]), ("ci_low", told["ci_low"]), ("ci_high", told["ci_high"])):
            assert alone[column.format(end)].iloc[0] == pytest.approx(value, abs=0.02, nan_ok=True)
    chosen = frame[frame["step"] == 1].iloc[0]
    assert chosen["height_needed_p95_m"] == alone["height_needed_p95_m"].iloc[0]


@pytest.mark.parametrize("fidelity", ["draft", "standard"])
def test_long_logs_that_lie_askew_go_as_in_whole_runs(case, tmp_path, fidelity):
    """30 m long: the bounding box of such a log reaches plates far from the log, which then shortened its steps."""
    more = {"lines": case.lines, "trees": case.trees, "length_m": 30.0, "fidelity": fidelity, "trajectories": "none"}
    run = case.run(output=str(tmp_path / "run"), **more)
    shapes = [shapely.LineString([(a, b), (a + 5.0, b)]) for a, b in ((8.0, 48.0), (14.0, 60.0), (40.0, 52.0))]
    could = write_layer(tmp_path / "could.gpkg", shapes, barrier_id=["a", "b", "c"], height_m=[3.0] * 3)
    table, _, _ = site(run, tmp_path / "out", candidates=could)
    alone = table[table["step"] == 0]
    assert (alone["n_near"] < LOGS).all(), "every log is slid again: what is left out is not tested"
    for row in alone.itertuples():
        frame = gpd.read_file(could)
        name = row.barrier_id.split()[0]
        frame[frame["barrier_id"] == name].assign(barrier_id=row.barrier_id).to_file(tmp_path / "one.gpkg")
        then = case.run(output=str(tmp_path / "then"), overwrite=True, barriers=str(tmp_path / "one.gpkg"), **more)
        check(row, run, then, row.barrier_id)


def test_the_first_barrier_from_which_logs_rebound_shortens_every_step(case, lines, tmp_path):
    """And so changes the paths of logs that come nowhere near it; before, these were not slid again."""
    more = {"lines": case.lines, "trees": case.trees, "trajectories": "none", "barrier_restitution": 0.3}
    run = case.run(output=str(tmp_path / "run"), **more)
    table, _, _ = site(run, tmp_path / "out", candidates=lines, height_m="3")
    assert table["n_near"].eq(LOGS)[table["step"] == 0].all()
    row: Any = next(table[table["step"] == 0].itertuples())
    one = gpd.read_file(lines)
    one = one[one["barrier_id"] == row.barrier_id.split()[0]].assign(height_m=3.0, barrier_id=row.barrier_id)
    one.to_file(tmp_path / "one.gpkg", driver="GPKG")
    then = case.run(output=str(tmp_path / "then"), barriers=str(tmp_path / "one.gpkg"), **more)
    check(row, run, then, row.barrier_id)


def test_the_best_alone_is_the_first_chosen(bare, lines, tmp_path):
    table, frame, facts = site(bare, tmp_path / "out", candidates=lines, height_m="1,3")
    alone, first = table[table["step"] == 0], table[table["step"] == 1].iloc[0]
    assert first["n_reach"] == alone["n_reach"].min()
    assert frame["barrier_id"].tolist() == [first["barrier_id"]]
    assert facts["reach"]["n_reach"] - first["n_reach"] == first["gain_logs"]
    assert (alone["n_flux"] <= alone["n_near"]).all()


def test_the_runs_own_barriers_stay_and_threads_change_nothing(case, lines, tmp_path):
    """The layer contains them as well, so that a run with it gives the whole result."""
    own = write_layer(
        tmp_path / "own.gpkg", [shapely.LineString([(30.0, 55.0), (40.0, 55.0)])], barrier_id=["old"], height_m=[2.0]
    )
    more = {"lines": case.lines, "trajectories": "none"}
    run = case.run(output=str(tmp_path / "run"), barriers=own, **more)
    found = [site(run, tmp_path / f"{k}", candidates=lines, height_m="3", threads=k) for k in (1, 2)]
    table, frame, _ = found[0]
    assert_same_file(tmp_path / "1" / "barriers.gpkg", tmp_path / "2" / "barriers.gpkg")
    assert table.equals(found[1][0])
    assert (frame["barrier_id"].iloc[0], frame["height_m"].iloc[0], frame["step"].iloc[0]) == ("old", 2.0, 0)
    assert len(frame) == 2
    then = case.run(output=str(tmp_path / "then"), barriers=str(tmp_path / "1" / "barriers.gpkg"), **more)
    check(table[table["step"] == 1].iloc[0], run, then, frame["barrier_id"].iloc[1])


def test_contours_give_candidates_where_most_logs_pass(case, bare, tmp_path):
    """The slope begins at 30 m and rises by 0.7 a metre: 7 m above the road are 10 m up from its foot."""
    table, frame, _ = site(bare, tmp_path / "out", above_m="7", length_m="10,20", height_m="3", places=2)
    alone = table[table["step"] == 0]
    assert sorted(alone["length_m"].round(3)) == [10.0, 10.0, 20.0, 20.0]
    assert (alone["above_m"] == 7.0).all()
    chosen = shapely.get_coordinates(frame.geometry.to_numpy())
    assert chosen[:, 1] - 1_196_000.0 == pytest.approx(30.0 + 7.0 / np.tan(np.radians(35.0)), abs=0.2)
    assert frame["length_m"].tolist() == pytest.approx([20.0])
    assert float(np.hypot(*np.diff(chosen, axis=0)[0])) == pytest.approx(20.0)  # and straight
    assert len(chosen) == 2
    assert alone["angle_deg"].max() < 1.0  # because the contours are straight
    for length, rows in alone.groupby(alone["length_m"].round()):
        ordered: Any = rows
        first, second = ordered.sort_values("barrier_id")["n_flux"]
        assert first >= second, length
    assert frame["n_flux"].iloc[0] == alone.loc[alone["length_m"] > 15.0, "n_flux"].max()


def test_flux_is_of_logs_that_reach_a_line_then_or_later():
    touched = np.array([[1.0, np.inf, 5.0]] * 4)
    lines = np.array([[3.0, np.inf], [np.inf, np.inf], [-np.inf, np.inf], [1.0, 6.0]])
    expected = [[True, False, False], [False] * 3, [False] * 3, [True, False, True]]
    assert flux_of(touched, lines).tolist() == expected


def refused(match: str, run: Path, out: Path, **more: Any) -> None:
    with pytest.raises(UserError, match=match):
        site_barriers.TOOL(run=str(run), output=str(out), **more)
    assert not out.exists()


def test_what_cannot_be_asked_is_refused(case, bare, lines, tmp_path):
    out = tmp_path / "out"
    silent = case.run(output=str(tmp_path / "silent"), trajectories="none")
    refused("the run has no roads, railways or houses; name them with --lines LAYER", silent, out, candidates=lines)
    refused("--height-m is 0 m, but must be greater than 0 m", bare, out, candidates=lines, height_m="0")
    refused("--length-m is 'long'", bare, out, length_m="long")
    refused("does not exist", tmp_path / "none", out, candidates=lines)
    refused("does not exist", bare, out, candidates=str(tmp_path / "none.gpkg"))
    off = write_layer(tmp_path / "off.gpkg", [shapely.LineString([(900.0, 0.0), (950.0, 0.0)])], barrier_id=["a"])
    refused("no candidate touches the DEM", bare, out, candidates=off)
    piece = shapely.LineString([(10.0, 45.0), (20.0, 45.0)])
    twins = write_layer(tmp_path / "twins.gpkg", [piece, piece], barrier_id=["a", "a"])
    refused("rows 1, 2 are called 'a'; give each candidate its own id", bare, out, candidates=twins)
    low = write_layer(tmp_path / "low.gpkg", [piece], barrier_id=["a"], height_m=[-1.0])
    refused("field 'height_m', row 1", bare, out, candidates=low)
    far = "no log that reaches a line passes a straight piece of 20,40 m along a contour 400 m above it"
    refused(far, bare, out, above_m="400")
    still = case.run(output=str(tmp_path / "still"), lines=case.lines, friction="5.0", trajectories="none")
    refused("no log of the run reaches a line; there is nothing to keep away", still, out, candidates=lines)
    owned = case.run(output=str(tmp_path / "owned"), lines=case.lines, barriers=case.barriers, trajectories="none")
    refused("a barrier of the run is called 'east' already", owned, out, candidates=lines, height_m="2")


def test_a_run_whose_inputs_changed_is_reported(tmp_path, lines):
    made = Case(tmp_path / "case")
    run = made.run(lines=made.lines, trees=made.trees, trajectories="none")
    write_layer(
        Path(made.trees), points((30.0, 60.0), (25.0, 55.0)), tree_id=[1, 2], dbh_cm=[90.0] * 2, height_m=[9.0] * 2
    )
    refused("end elsewhere than in the run: an input has changed since", run, tmp_path / "out", candidates=lines)
