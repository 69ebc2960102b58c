"""Intervals compared with the paper's counts, coverage by simulation, and directions across north."""

import math

import numpy as np
import pytest
from scipy import stats

from deadwood_algorithms.stats.directions import azimuth, quantile_arc, smallest_arc, unrolled
from deadwood_algorithms.stats.statistics import (
    Z_95,
    bounds_if_lost,
    loss_matters,
    lost_words,
    mcnemar_p,
    paired_interval,
    percent_of,
    percent_with_interval,
    points_with_interval,
    reach_record,
    wilson_interval,
)


@pytest.mark.parametrize(
    ("hits", "low_percent", "high_percent"),
    [(1829, 8.753, 9.552), (178, 0.769, 1.030), (4658, 22.709, 23.881), (0, 0.0, 0.019)],
)
def test_wilson_interval_of_the_papers_counts(hits: int, low_percent: float, high_percent: float) -> None:
    low, high = wilson_interval(hits, 20000)
    assert 100 * low == pytest.approx(low_percent, abs=5e-4)
    assert 100 * high == pytest.approx(high_percent, abs=5e-4)


def test_wilson_interval_at_its_ends() -> None:
    assert wilson_interval(0, 10)[0] == 0.0
    assert wilson_interval(10, 10)[1] == 1.0
    assert wilson_interval(0, 0) == (0.0, 1.0)
    low, high = wilson_interval(3, 10)
    assert wilson_interval(7, 10) == pytest.approx((1 - high, 1 - low))


def coverage(share: float, n: int, runs: int) -> float:
    counts, often = np.unique(np.random.default_rng(7).binomial(n, share, runs), return_counts=True)
    intervals = [wilson_interval(int(k), n) for k in counts]
    return sum(m for m, (low, high) in zip(often, intervals, strict=True) if low <= share <= high) / runs


def test_wilson_interval_contains_the_true_value_in_95_percent_of_runs() -> None:
    # A count is discrete, so the coverage at one probability swings around 95 %; its mean over many does not.
    shares = np.random.default_rng(1).uniform(0.002, 0.998, 200)
    held = np.array([coverage(share, 800, 4000) for share in shares])
    assert held.mean() == pytest.approx(0.95, abs=0.005)
    assert held.min() > 0.90
    assert coverage(0.005, 800, 20000) == pytest.approx(0.95, abs=0.025)


def test_the_smallest_arc_goes_across_north() -> None:
    assert smallest_arc([350.0, 10.0]) == pytest.approx(20.0)
    assert smallest_arc([10.0, 350.0, 0.0]) == pytest.approx(20.0)
    assert smallest_arc([170.0, 190.0]) == pytest.approx(20.0)
    assert smallest_arc([0.0, 90.0, 180.0]) == pytest.approx(180.0)
    assert smallest_arc([0.0, 120.0, 240.0]) == pytest.approx(240.0)
    assert smallest_arc([42.0]) == 0.0
    assert smallest_arc([42.0, 42.0, 402.0]) == 0.0
    assert math.isnan(smallest_arc([]))


@pytest.mark.parametrize("turn", [0.0, 33.0, 141.5, 351.0])
def test_arcs_do_not_care_where_north_is(turn: float) -> None:
    angles = np.random.default_rng(3).normal(0.0, 20.0, 500)
    assert smallest_arc(angles + turn) == pytest.approx(np.ptp(angles), abs=1e-9)
    expected = np.quantile(angles, 0.95) - np.quantile(angles, 0.05)
    assert quantile_arc(angles + turn)["value"] == pytest.approx(expected, abs=1e-9)


def test_the_quantile_arc_ignores_a_stray_log() -> None:
    assert quantile_arc(np.r_[np.linspace(-10, 10, 999), 90.0])["value"] < 20.0
    assert smallest_arc(np.r_[np.linspace(-10, 10, 999), 90.0]) == pytest.approx(100.0)
    assert math.isnan(quantile_arc([])["value"])
    assert unrolled([5.0, 355.0, 1.0]).tolist() == pytest.approx([0.0, 6.0, 10.0])


def test_azimuths_are_clockwise_from_north() -> None:
    assert azimuth([0, 1, 0, -1], [1, 0, -1, 0]).tolist() == pytest.approx([0.0, 90.0, 180.0, 270.0])
    assert azimuth(-1e-18, 1.0) == 0.0


def test_paired_interval():
    """Known ends of Tango's interval, and McNemar's test at its border."""
    z = Z_95
    assert paired_interval(0, 0, 100) == pytest.approx((-z * z / (100 + z * z), z * z / (100 + z * z)))
    assert paired_interval(0, 0, 0) == (-1.0, 1.0)
    low, high = paired_interval(5, 20, 100)
    assert low < 0.15 < high
    assert paired_interval(20, 5, 100) == pytest.approx((-high, -low))
    for lost, gained in ((10, 24), (3, 12), (40, 61)):  # 0 is outside when (b - c)^2 / (b + c) > z^2, else inside
        for n in (200, 5000):
            low, high = paired_interval(lost, gained, n)
            assert (low > 0.0) == ((gained - lost) ** 2 / (gained + lost) > z * z)
    lost, gained, n = 360, 380, 20_000  # with many trials: the textbook's
    half = z * math.sqrt((lost + gained) / n - ((gained - lost) / n) ** 2) / math.sqrt(n)
    assert paired_interval(lost, gained, n) == pytest.approx((0.001 - half, 0.001 + half), abs=1e-5)


@pytest.mark.parametrize(("n", "gains", "loses"), [(50, 0.1, 0.1), (200, 0.2, 0.18), (1000, 0.01, 0.005)])
def test_the_paired_interval_holds_the_difference(n, gains, loses):
    drawn = np.random.default_rng(0).multinomial(n, [gains, loses, 1.0 - gains - loses], size=2000)
    known: dict[tuple[int, int], bool] = {}
    held = 0
    for gained, lost, _ in drawn.tolist():
        if (gained, lost) not in known:
            low, high = paired_interval(lost, gained, n)
            known[gained, lost] = low <= gains - loses <= high
        held += known[gained, lost]
    assert held / 2000 == pytest.approx(0.95, abs=0.015)


@pytest.mark.parametrize(
    ("n_reach", "n_total", "text"),
    [
        (3, 2000, "0.15 % (0.05 to 0.44 %)"),
        (427, 2000, "21.3 % (19.6 to 23.2 %)"),
        (30, 40, "75 % (60 to 86 %)"),
        (1829, 20_000, "9.14 % (8.75 to 9.55 %)"),
        (0, 2000, "< 0.19 %"),
        (2000, 2000, "> 99.81 %"),
        (0, 0, "no logs"),
    ],
)
def test_a_percentage_is_rounded_as_far_as_its_interval_allows(n_reach, n_total, text):
    assert percent_with_interval(reach_record(n_reach, n_total)) == text


def test_shares_and_differences_are_rounded_alike():
    assert [percent_of(*each) for each in ((3, 2000), (1523, 2000), (0, 7), (7, 7))] == [
        "0.15 %",
        "76.1 %",
        "0 %",
        "100 %",
    ]
    assert points_with_interval(-0.45, -0.616, -0.247) == "-45 (-62 to -25)"
    assert points_with_interval(0.0001, -0.0012, 0.0014) == "+0.01 (-0.12 to +0.14)"
    assert points_with_interval(-1e-9, -0.0012, 0.0012) == "0.00 (-0.12 to +0.12)"
    assert points_with_interval(math.nan, math.nan, math.nan) == "-"


def test_bounds_of_a_probability_where_logs_left_before_they_reached():
    """20 of 60 reach a line, 20 of the others were lost before it: at least a third, at most two."""
    found = bounds_if_lost(20, 60, 20)
    assert (found["p_low_if_lost"], found["p_high_if_lost"]) == pytest.approx((1 / 3, 2 / 3))
    assert found["ci_low_if_lost"] == wilson_interval(20, 60)[0]
    assert found["ci_high_if_lost"] == wilson_interval(40, 60)[1]
    assert loss_matters(reach_record(20, 60) | found)
    assert not loss_matters(reach_record(20, 60) | bounds_if_lost(20, 60, 2))  # less than chance
    low, high = (100.0 * each for each in (wilson_interval(20, 60)[0], wilson_interval(40, 60)[1]))
    # before: "up to 67 %" beside an interval of chance, without explaining how the two relate
    told = "; 20 others left the terrain model before it: 67 % if all of them reach it; chance and these together: "
    assert lost_words(found) == f"{told}{low:.0f} to {high:.0f} %"
    assert lost_words(bounds_if_lost(20, 60, 0)) == ""


@pytest.mark.parametrize(("lost", "gained"), [(0, 0), (0, 6), (3, 11), (40, 22), (500, 431)])
def test_mcnemars_probability_is_scipys_exact_test(lost, gained):
    expected = stats.binomtest(lost, lost + gained, 0.5).pvalue if lost + gained else 1.0
    assert mcnemar_p(lost, gained) == pytest.approx(expected, rel=1e-9)
