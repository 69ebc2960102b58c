"""Intervals of percentiles: compared with SciPy's binomial law and published numbers; their coverage by brute force."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from deadwood_algorithms.stats.directions import quantile_arc
from deadwood_algorithms.stats.order_statistics import (
    binomial_below,
    difference_interval,
    missing,
    paired_percentiles,
    percentile_ranks,
    percentile_record,
    quantiles,
    values_needed,
)


@pytest.mark.parametrize("n", [1, 7, 100, 5000])
@pytest.mark.parametrize("p", [0.01, 0.5, 0.9, 0.99])
def test_the_binomial_law_is_scipys(n, p):
    assert np.allclose(binomial_below(n, p), stats.binom.cdf(np.arange(n + 1), n, p), rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("n", [1, 2, 6, 50, 73, 400, 3000])
@pytest.mark.parametrize("p", [0.1, 0.5, 0.9, 0.95, 0.99])
@pytest.mark.parametrize("confidence", [0.81, 0.95])
def test_ranks_are_the_tightest_that_keep_either_side(n, p, confidence):
    low, high = percentile_ranks(n, p, confidence)
    side = 0.5 * (1.0 - confidence)
    ranks = np.arange(1, n + 1)
    sure_low = ranks[stats.binom.cdf(ranks - 1, n, p) <= side]
    sure_high = ranks[stats.binom.sf(ranks - 1, n, p) <= side]
    assert low == (sure_low.max() if sure_low.size else 0)
    assert high == (sure_high.min() if sure_high.size else n + 1)


def test_the_median_of_ten_lies_between_the_second_and_the_ninth():
    """As in any table of the sign test."""
    assert percentile_ranks(10, 0.5) == (2, 9)


@pytest.mark.parametrize(("p", "needed"), [(0.5, 6), (0.9, 36), (0.95, 72), (0.99, 368)])
def test_number_of_values_that_it_takes(p, needed):
    assert values_needed(p) == needed
    assert percentile_ranks(needed, p)[1] == needed
    assert percentile_ranks(needed - 1, p)[1] == needed  # one beyond the last: none


@pytest.mark.parametrize(("n", "p"), [(9, 0.5), (211, 0.9), (400, 0.95), (75, 0.05)])
def test_the_ends_of_a_percentile_are_the_values_that_scipys_binomial_law_names(n, p):
    """The values of the largest rank below which, and of the smallest from which on, 2.5 % of the probability lie."""
    values = np.random.default_rng(n).gamma(2.0, 3.0, n)
    record, ordered = percentile_record(values, p), np.sort(values)
    low = max(rank for rank in range(1, n + 1) if stats.binom.cdf(rank - 1, n, p) <= 0.025)
    high = min(rank for rank in range(1, n + 1) if stats.binom.sf(rank - 1, n, p) <= 0.025)
    assert [record["ci_low"], record["ci_high"]] == [ordered[low - 1], ordered[high - 1]]
    assert record["value"] == pytest.approx(np.quantile(values, p))


def test_without_values_only_how_many_it_takes():
    record = percentile_record(np.zeros(0), 0.95)
    assert record["n"] == 0
    assert record["n_more"] == 72
    assert np.isnan([record["value"], record["ci_low"], record["ci_high"]]).all()


@pytest.mark.parametrize(("n", "p"), [(30, 0.5), (100, 0.9), (400, 0.99)])
def test_the_interval_covers_as_often_as_it_says(n, p):
    """4000 samples of a skewed law: the true percentile is inside at least as often as promised, but for chance."""
    rng = np.random.default_rng(8)
    samples = np.sort(rng.lognormal(0.0, 1.0, (4000, n)), axis=1)
    low, high = percentile_ranks(n, p)
    true = float(np.exp(stats.norm.ppf(p)))
    inside = (samples[:, low - 1] <= true) & (true <= samples[:, high - 1])
    assert inside.mean() >= 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / 4000)
    assert inside.mean() <= 0.99


def test_nothing_like_a_quantile_from_fewer_values_than_needed():
    values = np.random.default_rng(3).lognormal(size=71)
    assert np.isnan(percentile_record(values, 0.95)["value"])
    assert percentile_record(values, 0.95)["n_more"] == percentile_record(-values, 0.05)["n_more"] == 1
    assert quantiles(values, [0.05, 0.5, 0.95]) == pytest.approx([np.nan, np.median(values), np.nan], nan_ok=True)
    assert [missing(n, 0.5) for n in (0, 5, 6, 9)] == [6, 1, 0, 0]


TRIALS = 150
LEAST_COVER = 0.90  # 150 trials: 3 standard errors of a coverage of 0.95 are 0.053
MANY = 1500
LEAST_COVER_OF_MANY = 0.933  # as above


def held(interval: tuple[float, float], truth: float) -> bool:
    """Nothing printed is nothing wrong."""
    low, high = interval
    return bool(np.isnan(low) or low <= truth <= high)


@pytest.mark.parametrize(
    ("trials", "least"),
    [(TRIALS, LEAST_COVER), pytest.param(MANY, LEAST_COVER_OF_MANY, marks=pytest.mark.statistics)],
)
@pytest.mark.parametrize("n", [20, 30, 50, 72, 100])
def test_the_spread_of_few_logs_has_an_interval_that_covers_or_none(n, trials, least):
    """Azimuths across north; the bootstrap before held 0.68, 0.82, 0.91 of 20, 30, 50 normal ones."""
    rng = np.random.default_rng(n)
    for draw, truth in ((rng.standard_normal, 3.28971), (rng.random, 0.9)):
        found = [quantile_arc(20.0 * draw(n) + 358.0) for _ in range(trials)]
        assert np.mean([held((each["ci_low"], each["ci_high"]), 20.0 * truth) for each in found]) >= least
        assert all(np.isnan(each["value"]) == (n < 72) == bool(each["n_more"]) for each in found)


@pytest.mark.parametrize(
    ("trials", "least"),
    [(TRIALS, LEAST_COVER), pytest.param(MANY, LEAST_COVER_OF_MANY, marks=pytest.mark.statistics)],
)
@pytest.mark.parametrize("n", [20, 30, 50, 72, 100])
@pytest.mark.parametrize("tail", [0.03, 0.08])
def test_the_paired_difference_of_a_quantile_with_a_rare_tail_covers_or_is_not_printed(n, tail, trials, least):
    """A few logs have eight times the energy, half of these lose it: the bootstrap before held 0.35 to 0.75 of 30."""
    rng = np.random.default_rng(n)

    def pair(size: int) -> tuple[np.ndarray, np.ndarray]:
        base, rare, kept = rng.lognormal(0.0, 0.5, size), rng.random(size) < tail, rng.random(size) < 0.5
        return base * np.where(rare & kept, 8.0, 1.0), base * np.where(rare, 8.0, 1.0)

    truth = np.subtract(*(np.quantile(each, 0.95) for each in pair(1_000_000)))
    found = [paired_percentiles(*pair(n), 0.95)[1:] for _ in range(trials)]
    assert np.mean([held(ends, truth) for _, *ends in found]) >= least
    assert all(np.isnan(value) == (n < 72) for value, *_ in found)


def test_a_difference_of_independent_estimates_is_their_intervals_in_quadrature():
    one = {"value": 10.0, "ci_low": 7.0, "ci_high": 14.0}
    other = {"value": 4.0, "ci_low": 1.0, "ci_high": 8.0}
    assert difference_interval(one, other) == pytest.approx((6.0 - 5.0, 6.0 + 5.0))
    assert difference_interval(one, one, 1.0) == pytest.approx((-1.0, 1.0))
