"""Intervals of percentiles: compared with SciPy's binomial law and published numbers; their coverage by brute force."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from deadwood_algorithms.stats.order_statistics import (
    binomial_below,
    percentile_ranks,
    percentile_record,
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
