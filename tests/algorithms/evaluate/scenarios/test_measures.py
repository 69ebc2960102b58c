"""Measures of two scenarios on arrays: lost logs by trying all their outcomes, intervals by independent sums."""

from __future__ import annotations

import itertools
import math
from types import SimpleNamespace
from typing import Any, cast

import geopandas as gpd
import numpy as np
import pytest
import shapely
from scipy import stats

from deadwood_algorithms.evaluate.scenarios.measures import (
    ScenarioRow,
    Share,
    around,
    compared_rows,
    groups_by_release,
    index_rows,
    number_rows,
    share_row,
    speed_row,
    spread_differences,
    tail_row,
)
from deadwood_algorithms.evaluate.scenarios.paired_runs import Compared, Scenario
from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.stats.statistics import mcnemar_p, paired_interval, wilson_interval


def scenario(
    name: str, reach: np.ndarray, reasons: list[str], places: np.ndarray | None = None, **columns: Any
) -> Scenario:
    n = len(reasons)
    places = np.column_stack([np.zeros(n), -np.arange(1.0, n + 1)]) if places is None else places
    numbers = ("speed_mean_ms", "speed_max_ms", "energy_max_kj", "jump_max_m", "runout_m")
    facts = {each: np.arange(n, dtype=float) for each in numbers}
    facts |= {"stop_reason": reasons, "release_id": 1, "release_x": 0.0, "release_y": 0.0, "length_m": 4.0} | columns
    deposits = gpd.GeoDataFrame(facts, geometry=shapely.points(places))
    run = cast("Any", SimpleNamespace(deposits=deposits))
    energy = np.where(reach, 10.0, np.nan)
    return Scenario(name, run, np.arange(n), reach, energy, np.zeros(n, bool))


def paired(before: np.ndarray, now: np.ndarray) -> tuple[float, float, float]:
    lost, gained = int((before & ~now).sum()), int((now & ~before).sum())
    return (gained - lost) / now.size, *paired_interval(lost, gained, now.size)


def own_interval(row: ScenarioRow) -> tuple[float, float]:
    return row.ci_low, row.ci_high


def difference_interval(row: ScenarioRow) -> tuple[float, float]:
    return row.diff_ci_low, row.diff_ci_high


def outcomes(share: Share) -> list[np.ndarray]:
    """All possible outcomes of the logs, for each way in which the lost ones may have continued."""
    found = []
    for more in itertools.product((False, True), repeat=int(share.lost.sum())):
        did = share.did.copy()
        did[np.flatnonzero(share.lost)] = more
        found.append(did)
    return found


@pytest.mark.parametrize("seed", range(8))
def test_the_bounds_for_lost_logs_are_those_of_trying_every_outcome(seed):
    rng = np.random.default_rng(seed)
    n = 14
    before, now = (Share.of(rng.random(n) < 0.4, rng.random(n) < 0.3) for _ in range(2))
    row = share_row("b", "reach", "road", now, before)
    values = [did.sum() / n for did in outcomes(now)]
    assert (row.value, row.value_low_if_lost) == (now.did.sum() / n, min(values))
    assert row.value_high_if_lost == max(values)
    assert own_interval(row) == wilson_interval(int(now.did.sum()), n)
    assert (row.difference, *difference_interval(row)) == paired(before.did, now.did)
    tried = [paired(was, did) for was in outcomes(before) for did in outcomes(now)]
    assert row.difference_low_if_lost == min(each[0] for each in tried)
    assert row.difference_high_if_lost == max(each[0] for each in tried)
    # Of the outcomes with the least difference, one changes the fewest logs: the reported one changes no log
    # unnecessarily.
    assert row.diff_ci_low_if_lost == paired(before.most, now.did)[1]
    assert row.diff_ci_high_if_lost == paired(before.did, now.most)[2]
    lost, gained = int((before.did & ~now.did).sum()), int((now.did & ~before.did).sum())
    assert (row.n_only_reference, row.n_only_scenario, row.p_mcnemar) == (lost, gained, mcnemar_p(lost, gained))
    gone = [k for k in range(n) if (before.lost[k] or now.lost[k])]
    assert row.n_lost == len(gone)


def test_a_log_that_did_it_before_it_left_is_not_lost():
    did, left = np.array([True, True, False, False]), np.array([True, False, True, False])
    share = Share.of(did, left)
    assert share.lost.tolist() == [False, False, True, False]
    assert share.most.tolist() == [True, True, True, False]


def test_a_share_alone_reports_nothing_of_a_difference():
    row = share_row("a", "reach", "road", Share.of(np.array([True, False, False]), np.array([False, True, False])))
    assert (row.n_lost, row.value_low_if_lost, row.value_high_if_lost) == (1, 1 / 3, 2 / 3)
    assert np.isnan([row.difference, *difference_interval(row), row.difference_low_if_lost, row.p_mcnemar]).all()


@pytest.mark.parametrize(
    ("changes", "matters"),
    [
        ({}, False),
        ({"value_high_if_lost": 0.61}, True),
        ({"value_high_if_lost": 0.6}, False),
        ({"difference_low_if_lost": -0.31}, True),
        ({"difference_low_if_lost": -0.3}, False),
        ({"difference_high_if_lost": 0.11}, True),
        ({"difference_high_if_lost": 0.1}, False),
    ],
)
def test_lost_logs_matter_where_they_lead_out_of_any_of_the_intervals(changes, matters):
    bounds = {"value_high_if_lost": 0.5, "difference_low_if_lost": -0.1, "difference_high_if_lost": -0.1}
    row = ScenarioRow("a", "reach", "road", "1", 20, 0.5, 0.4, 0.6, -0.1, -0.3, 0.1, **bounds | changes)
    assert row.loss_matters is matters


def test_the_interval_of_a_mean_is_the_normal_one_of_its_standard_error():
    values = np.array([1.0, 2.0, 4.0, 9.0])
    low, high = around(float(values.mean()), values)
    expected = stats.norm.interval(0.95, loc=values.mean(), scale=stats.sem(values))
    assert (low, high) == pytest.approx(expected, rel=1e-7)  # 1.959964 has seven digits
    assert np.isnan(around(3.0, np.array([3.0]))).all()


def test_the_tail_is_drawn_over_the_same_logs_in_both():
    """Each log gains 3 kJ, and so does the tail; its ends move together, which narrows the difference's interval."""
    before = np.random.default_rng(3).lognormal(3.0, 1.0, 200)
    row = tail_row("b", "energy_max", "kJ", before + 3.0, before)
    assert row.value == np.quantile(before, 0.95) + 3.0
    low, high = own_interval(row)
    apart = abs((row.value - low) - (high - row.value))
    assert (row.difference, *difference_interval(row)) == pytest.approx((3.0, 3.0 - apart, 3.0 + apart))
    assert low < row.value < high
    # The same interval as in the report's other tables: of the run-out, "1035 (1014 to 1050)" stood beside "1035 (1011
    # to 1042)". The chance that fewer than r of 200 values lie below the quantile is binomial.
    ordered = np.sort(before) + 3.0
    first, last = (int(np.flatnonzero(ordered == end)[0]) + 1 for end in (low, high))
    assert stats.binom.cdf(first - 1, 200, 0.95) <= 0.025 < stats.binom.cdf(first, 200, 0.95)
    assert stats.binom.sf(last - 1, 200, 0.95) <= 0.025 < stats.binom.sf(last - 2, 200, 0.95)
    alone = tail_row("a", "energy_max", "kJ", before, None)
    assert own_interval(alone) == pytest.approx((low - 3.0, high - 3.0))
    assert math.isnan(alone.difference)


def test_few_logs_give_no_upper_bound_of_the_tail_and_so_no_interval():
    values = np.arange(71.0)
    assert np.isnan(own_interval(tail_row("a", "runout", "m", values, None))).all()
    assert np.isfinite(own_interval(tail_row("a", "runout", "m", np.arange(72.0), None))).all()


def test_the_mean_speed_is_over_the_logs_that_had_ended_in_both():
    never = np.zeros((4, 0), bool)
    other = scenario("a", never, ["rest", "time_limit", "rest", "rest"], speed_mean_ms=[4.0, 1.0, 6.0, 8.0])
    each = scenario("b", never, ["rest", "rest", "time_limit", "rest"], speed_mean_ms=[7.0, 2.0, 1.0, 9.0])
    now, before = each.column("speed_mean_ms"), other.column("speed_mean_ms")
    row = speed_row(each, other, now, before)
    assert (row.n, row.value, row.difference) == (2, 8.0, 2.0)
    assert own_interval(row) == around(8.0, np.array([7.0, 9.0]))
    assert difference_interval(row) == around(2.0, np.array([3.0, 1.0]))
    alone = speed_row(each, None, now, None)
    assert (alone.n, alone.value) == (3, 6.0)
    moving = scenario("c", never, ["time_limit"] * 4)
    assert speed_row(moving, other, now, before).n == 0


def test_means_largest_and_moves_are_those_of_the_logs():
    never = np.zeros((3, 0), bool)
    ends = np.array([[0.0, 0.0], [3.0, 4.0], [0.0, 12.0]])
    other = scenario("a", never, ["rest"] * 3, np.zeros((3, 2)), runout_m=[1.0, 5.0, 9.0])
    each = scenario("b", never, ["rest"] * 3, ends, runout_m=[2.0, 4.0, 15.0])
    rows = {(row.quantity, row.item): row for row in number_rows(each, other)}
    mean = rows["runout", "mean"]
    assert (mean.value, mean.difference) == (7.0, 2.0)
    assert own_interval(mean) == around(7.0, np.array([2.0, 4.0, 15.0]))
    assert difference_interval(mean) == around(2.0, np.array([1.0, -1.0, 6.0]))
    assert (rows["runout", "largest"].value, rows["runout", "largest"].difference) == (15.0, 6.0)
    assert math.isnan(rows["deposit_moved", "median"].value)  # a median needs six logs
    alone = {row.quantity for row in number_rows(each, None)}
    assert "deposit_moved" not in alone


def test_what_ended_a_log_is_unknown_of_those_that_left_but_for_the_time_limit():
    """A log that left may have been held beyond; whether it would have moved until the time limit is not asked."""
    reasons = ["rest", "tree", "left_dem", "left_dem", "time_limit", "barrier"]
    reach = np.array([[True], [False], [True], [False], [False], [False]])
    one = scenario("a", reach, reasons)
    compared = Compared([one], ["road"], [None], np.arange(6))
    rows = {(row.quantity, row.item): row for row in compared_rows(compared, None, 0, Quiet())}
    assert rows["reach", "road"].n_lost == 1  # the other that left had reached it
    assert rows["ended", "tree"].value_high_if_lost == pytest.approx(3 / 6)
    assert rows["ended", "left_dem"].n_lost == rows["ended", "time_limit"].n_lost == 0
    assert [rows["ended", name].value for name in ("tree", "barrier", "left_dem", "time_limit")] == pytest.approx(
        [1 / 6, 1 / 6, 2 / 6, 1 / 6]
    )


@pytest.mark.parametrize("seed", range(4))
def test_the_index_for_lost_logs_is_bounded_by_every_outcome(seed):
    rng = np.random.default_rng(seed)
    n = 22  # ten of them arrive in any case: BARI needs as many
    reasons = [np.where(rng.random(n) < 0.3, "left_dem", "rest").tolist() for _ in range(2)]
    reach = [np.append(rng.random(n - 10) < p, np.ones(10, bool))[:, None] for p in (0.6, 0.3)]
    other, each = (scenario(name, *facts) for name, *facts in zip("ab", reach, reasons, strict=True))
    row = next(index_rows(each, other, 0, "road", np.arange(n), 0))
    before, now = (Share.of(run.reach[:, 0], run.left_dem) for run in (other, each))
    tried = [1.0 - did.sum() / was.sum() for was in outcomes(before) for did in outcomes(now)]
    # The least protection: none of the lost reaches without it, and all do with it; the most: vice versa.
    assert row.value_low_if_lost == pytest.approx(min(tried))
    assert row.value_high_if_lost == pytest.approx(max(tried))
    assert row.value == pytest.approx(1.0 - now.did.sum() / before.did.sum())
    assert row.n_lost == (before.lost | now.lost).sum()


def fan(n: int, wide_deg: float) -> np.ndarray:
    turn = np.radians(np.linspace(-0.5, 0.5, n) * wide_deg)
    return 50.0 * np.column_stack([np.sin(turn), np.cos(turn)])


@pytest.mark.parametrize("n", [71, 72])
def test_the_spread_of_a_release_and_from_how_many_logs_its_range_is_reported(n):
    never = np.zeros((n, 0), bool)
    reasons = ["rest"] * (n - 2)
    other = scenario("a", never, [*reasons, "left_dem", "rest"], fan(n, 20.0))
    each = scenario("b", never, [*reasons, "rest", "left_dem"], fan(n, 50.0))
    releases = groups_by_release(Compared([other, each], [], [], np.arange(n)), None)
    rows = {row.quantity: row for row in spread_differences(each, other, releases)}
    assert (rows["spread"].value, rows["spread"].difference) == pytest.approx((50.0, 30.0))
    assert rows["spread"].n_lost == 2
    row = rows["spread_p05_p95"]
    assert row.n_more == 72 - n
    if n < 72:
        assert np.isnan([row.value, row.ci_low, row.difference, row.diff_ci_high]).all()
        return
    assert (row.value, row.difference, row.n_lost) == pytest.approx((45.0, 27.0, 2))
    (low, high), ends = own_interval(row), difference_interval(row)
    assert low < row.value < high
    # The same logs lie outside in both: the ends of the ranges, 20 and 50 wide, move together.
    below, above = 1.0 - low / row.value, high / row.value - 1.0
    assert ends == pytest.approx((27.0 - abs(45.0 * below - 18.0 * above), 27.0 + abs(45.0 * above - 18.0 * below)))


def test_deposits_too_near_do_not_count_for_the_spread():
    """Without a bound one log length (4 m) counts; with one, that. One deposit alone has no angle."""
    places = np.array([[0.0, 3.9], [3.0, 3.0], [-30.0, 30.0]])
    one = scenario("a", np.zeros((3, 0), bool), ["rest"] * 3, places)
    compared = Compared([one], [], [], np.arange(3))
    for bound, expected in ((None, 90.0), (10.0, np.nan), (1.0, 90.0)):
        groups = groups_by_release(compared, bound)
        row = next(spread_differences(one, None, groups))
        assert row.value == pytest.approx(expected, abs=1e-9, nan_ok=True)
