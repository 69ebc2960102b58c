"""BARI, MIRI and ORPI: by hand, by their laws, their coverage by brute force, and through files."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from hand_run import Track, write_run
from slope_case import Case, layer

from deadwood_algorithms.evaluate.scenarios.indices import (
    barrier_index,
    energy_indices,
    intensity_index,
    overall_index,
    reach_index,
)
from deadwood_algorithms.stats.statistics import wilson_interval
from deadwood_algorithms.tools import compare_scenarios, reach_lines

ROAD = shapely.LineString([(0.5, 50.0), (59.5, 50.0)])


def test_the_formulas_by_hand():
    before = np.array([100.0, 200.0, 300.0, 400.0, math.nan])
    now = np.array([50.0, math.nan, 150.0, math.nan, math.nan])
    assert barrier_index(np.isfinite(before), np.isfinite(now)) == pytest.approx(0.5)
    assert intensity_index(before, now) == pytest.approx(1.0 - 145.0 / 385.0)  # linear between order statistics
    assert overall_index(before, now) == pytest.approx(1.0 - 200.0 / 1000.0)


def test_the_overall_index_is_made_of_how_often_and_how_hard():
    rng = np.random.default_rng(1)
    before, now = (np.where(rng.random(300) < p, rng.lognormal(4.0, 1.0, 300), math.nan) for p in (0.7, 0.3))
    bari = barrier_index(np.isfinite(before), np.isfinite(now))
    means = [np.nanmean(each) for each in (before, now)]
    assert 1.0 - overall_index(before, now) == pytest.approx((1.0 - bari) * means[1] / means[0])


def test_a_log_that_counts_twice_is_two_logs():
    before, now = np.array([10.0, 40.0, math.nan, 90.0]), np.array([5.0, math.nan, 30.0, 80.0])
    times = np.array([2, 0, 3, 1])
    rows = np.repeat(np.arange(4), times)
    for index in (intensity_index, overall_index):
        assert index(before, now, times) == pytest.approx(index(before[rows], now[rows]))
    reached = np.isfinite(before), np.isfinite(now)
    assert barrier_index(*reached, times) == pytest.approx(barrier_index(reached[0][rows], reached[1][rows]))


def test_nothing_to_protect_from_is_no_number():
    none, some = np.full(5, math.nan), np.array([1.0, 2.0, math.nan, 3.0, 4.0])
    assert math.isnan(barrier_index(np.zeros(5, bool), np.ones(5, bool)))
    assert math.isnan(overall_index(none, some))
    assert math.isnan(intensity_index(none, some))
    assert math.isnan(intensity_index(some, none))
    assert overall_index(some, none) == 1.0


def test_where_no_log_is_left_the_interval_says_how_many_may_be():
    before = np.arange(100) < 40
    value, low, high = reach_index(before, np.zeros(100, bool), np.arange(100), 0)
    assert (value, high) == (1.0, 1.0)
    assert low == pytest.approx(1.0 - wilson_interval(0, 100)[1] / wilson_interval(40, 100)[0])
    found = energy_indices(np.where(before, 5.0, math.nan), np.full(100, math.nan), np.arange(100), 0)
    assert np.isnan([*found["orpi"], *found["miri"]]).all()


def test_where_no_log_changed_the_interval_has_a_width():
    before = np.arange(100) < 40
    value, low, high = reach_index(before, before, np.arange(100), 0)
    assert value == 0.0
    assert -0.2 < low < 0.0 < high < 0.2


def test_of_one_arrival_no_ratio_is_given():
    """1 of 300 in the baseline, none in the scenario: "100 % (-2000 to 100)" says nothing."""
    never = np.zeros(300, bool)
    assert np.isnan(reach_index(np.arange(300) < 9, never, np.arange(300), 0)).all()
    value, low, high = reach_index(np.arange(300) < 10, never, np.arange(300), 0)
    assert (value, high) == (1.0, 1.0)
    assert 0.0 < low < 1.0


def test_the_interval_depends_on_the_logs_not_on_their_order():
    rng = np.random.default_rng(4)
    before, now = (np.where(rng.random(300) < p, rng.lognormal(4.0, 1.0, 300), math.nan) for p in (0.7, 0.4))
    ids, turned = np.arange(300) * 7, rng.permutation(300)
    one = energy_indices(before, now, ids, 3)
    other = energy_indices(before[turned], now[turned], ids[turned], 3)
    assert {name: pytest.approx(each) for name, each in one.items()} == other
    assert energy_indices(before, now, ids, 4) != one


def test_of_few_arrivals_no_interval_is_given():
    energy = np.arange(1.0, 201.0)
    for arrivals, told in ((71, {"orpi"}), (72, {"miri", "orpi"}), (9, set()), (10, {"orpi"})):
        now = np.where(np.arange(200) < arrivals, 0.5 * energy, math.nan)
        for pair in ((energy, now), (now, energy)):
            found = energy_indices(*pair, np.arange(200), 0)
            assert {name for name, (_, low, _) in found.items() if math.isfinite(low)} == told
            assert {name for name, (value, *_) in found.items() if math.isfinite(value)} == told


@pytest.mark.statistics
def test_the_interval_of_the_largest_intensity_covers_as_often_as_it_says():
    """120 forests that let 100 of 150 logs through, at half their energy."""
    rng = np.random.default_rng(2)
    inside = 0
    for turn in range(120):
        before = rng.lognormal(4.0, 0.7, 150)
        now = np.where(rng.random(150) < 2.0 / 3.0, 0.5 * rng.lognormal(4.0, 0.7, 150), math.nan)
        _, low, high = energy_indices(before, now, np.arange(150), turn)["miri"]
        inside += low <= 0.5 <= high
    assert inside / 120 >= 0.95 - 3.0 * math.sqrt(0.95 * 0.05 / 120)


@pytest.mark.statistics
@pytest.mark.parametrize("index", ["bari", "orpi"])
def test_intervals_cover_as_often_as_they_say(index):
    """300 forests of 250 logs each: a log that reaches without the forest does so with it at p = 0.4, at half its
    energy; of what does not reach, 5 % do."""
    rng = np.random.default_rng(9)
    inside = 0
    for turn in range(300):
        energy = rng.lognormal(4.0, 0.7, 250)
        first = rng.random(250) < 0.6
        then = np.where(first, rng.random(250) < 0.4, rng.random(250) < 0.05)
        if index == "bari":
            _, low, high = reach_index(first, then, np.arange(250), turn)
            true = 1.0 - (0.6 * 0.4 + 0.4 * 0.05) / 0.6
        else:
            before, now = np.where(first, energy, math.nan), np.where(then, 0.5 * energy, math.nan)
            _, low, high = energy_indices(before, now, np.arange(250), turn)["orpi"]
            true = 1.0 - 0.5 * (0.6 * 0.4 + 0.4 * 0.05) / 0.6
        inside += low <= true <= high
    assert 0.91 <= inside / 300 <= 0.985


def compared(runs: list[Path], output: Path, feedback: Any = None, **values: Any) -> tuple[Any, Any]:
    outcome = compare_scenarios.TOOL(
        feedback=feedback, runs=",".join(map(str, runs)), output=str(output), overwrite=True, **values
    )
    table = pd.read_csv(output / "comparison.csv", dtype={"item": str}, encoding="utf-8-sig")
    return table.set_index(["scenario", "quantity", "item"]).sort_index(), outcome


def test_through_files_the_energies_are_those_at_the_line(tmp_path):
    """Logs of 1 to 40 m/s; without all reach the road, with only the first 10 do, at half their speed."""
    without = [Track((20.0, 70.0), (20.0, 30.0), speed=1.0 + k) for k in range(40)]
    with_trees = [Track((20.0, 70.0), (20.0, 30.0 if k < 10 else 60.0), speed=0.5 * (1.0 + k)) for k in range(40)]
    runs = [
        write_run(tmp_path / name, tracks, lines={"road": (ROAD, list(range(count)))}, digest="same")
        for name, tracks, count in (("none", without, 40), ("forest", with_trees, 10))
    ]
    table, outcome = compared(runs, tmp_path / "out")
    speed = 1.0 + np.arange(40)
    assert table.loc[("forest", "bari", "road"), "value"] == pytest.approx(0.75)
    assert np.isnan(table.loc[("forest", "miri", "road"), "value"])
    needed = {name: table.loc[("forest", name, "road"), "n_more"] for name in ("bari", "miri", "orpi")}
    assert needed == {"bari": 0, "miri": 72 - 10, "orpi": 0}
    total = ((0.5 * speed[:10]) ** 2).sum() / (speed**2).sum()
    assert table.loc[("forest", "orpi", "road"), "value"] == pytest.approx(1.0 - total, rel=1e-6)
    assert np.isnan(table.loc[("forest", "miri", "road"), "ci_low"])
    for name in ("bari", "orpi"):
        row = table.loc[("forest", name, "road")]
        assert row["ci_low"] < row["value"] < row["ci_high"] <= 1.0
        assert ("none", name, "road") not in table.index
    assert [each for each in outcome.lines if "BARI 75 %" in each and "62 more" in each and "ORPI 99" in each]
    wide = pd.read_csv(tmp_path / "out" / "table.csv", encoding="utf-8-sig").set_index(["quantity", "of"])
    assert wide.loc[("bari", "road"), "unit"] == "%"
    assert wide.loc[("bari", "road"), "value"] == 75.0


def test_logs_that_left_give_bounds(tmp_path):
    """Of 40 logs 20 reach without; with, 5 reach and 10 leave the terrain before."""
    way = {"start": (20.0, 70.0), "end": (20.0, 30.0)}
    runs = []
    for name, hits, gone in (("none", 20, 0), ("forest", 5, 10)):
        tracks = [Track(**way, stop_reason="left_dem" if 25 <= k < 25 + gone else "rest") for k in range(40)]
        runs.append(write_run(tmp_path / name, tracks, lines={"road": (ROAD, list(range(hits)))}, digest="same"))
    row = compared(runs, tmp_path / "out")[0].loc[("forest", "bari", "road")]
    assert (row["value"], row["n_lost"]) == (0.75, 10)
    assert (row["value_low_if_lost"], row["value_high_if_lost"]) == (1.0 - 15 / 20, 0.75)


def test_on_runs_of_the_engine_they_are_what_reach_lines_says(tmp_path, said):
    case = Case(tmp_path / "case")
    runs = [
        case.run(output=str(tmp_path / name), lines=case.lines, trees=trees)
        for name, trees in (("none", None), ("forest", case.trees))
    ]
    table, _ = compared(runs, tmp_path / "out")
    sums = []
    for run in runs:
        reach_lines.TOOL(run=str(run), lines=case.lines, output=str(tmp_path / "r.gpkg"), overwrite=True)
        arrivals: Any = gpd.read_file(tmp_path / "r.gpkg", layer="arrivals")
        mine = arrivals[arrivals["line_id"] == "road"]
        sums.append((len(mine), (mine["energy_kj"] + mine["rotation_kj"]).sum()))
    assert table.loc[("forest", "bari", "road"), "value"] == pytest.approx(1.0 - sums[1][0] / sums[0][0])
    assert table.loc[("forest", "orpi", "road"), "value"] == pytest.approx(1.0 - sums[1][1] / sums[0][1])
    again, _ = compared(runs, tmp_path / "again", lines=case.lines)
    for name in ("bari", "miri", "orpi"):
        one, other = (each.loc[("forest", name, "road")] for each in (table, again))
        assert np.array_equal(
            *(each[["value", "ci_low", "ci_high"]].astype(float) for each in (one, other)), equal_nan=True
        )

    poor = case.run(output=str(tmp_path / "poor"), lines=case.lines, trees=case.trees, trajectories="none")
    less, _ = compared([runs[0], poor], tmp_path / "less", feedback=said)
    assert less.loc[("poor", "bari", "road"), "value"] == table.loc[("forest", "bari", "road"), "value"]
    assert ("poor", "orpi", "road") not in less.index
    assert any("no energy at lines (MIRI, ORPI) is compared" in each for each in said.notes)
    assert layer(poor, "reach") is not None
