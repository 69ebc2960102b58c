"""What may be shown of n values, and the intervals of percentiles, from order statistics: no distribution of the values
is assumed, only that they are independent and identically distributed.

Of n independent values the number that lie below a percentile p is binomial (n, p), whatever the values are. So two of
the sorted values enclose the percentile with a probability given by the binomial distribution; with few values none
lies above a high percentile with that probability, and no upper bound can be given.

The rule of every figure, table, sentence and raster: a percentile whose interval lacks an end is not shown at all,
only how many values are missing (`missing`); nor is a ratio of counts or sums from fewer than `LEAST_OF_A_RATIO`, or a
histogram of fewer than `LEAST_OF_A_FIGURE`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

# Arrivals of either scenario below which a bootstrap of their ratio is too narrow: of sums of energies it held the
# truth in 84 % of trials with 3, 91 % with 10, 94 % with 25. Of fewer, a ratio "100 (-2000 to 100) %" says nothing.
LEAST_OF_A_RATIO = 10
LEAST_OF_A_FIGURE = 20  # values of a histogram, a rose, a curve: four in each of its five classes at least


def binomial_below(n: int, p: float) -> NDArray[np.float64]:
    """P(B <= k) for a binomial number of n trials, k = 0 ... n; 0 < p < 1."""
    logs = np.concatenate([[0.0], np.cumsum(np.log(np.arange(1, n + 1)))])  # logarithms of the factorials
    k = np.arange(n + 1)
    chance = np.exp(logs[n] - logs - logs[::-1] + k * math.log(p) + (n - k) * math.log1p(-p))
    return np.minimum(np.cumsum(chance), 1.0)


def percentile_ranks(n: int, p: float, confidence: float = 0.95) -> tuple[int, int]:
    """Ranks, from 1, of the sorted values between which a percentile lies with at least this probability.

    The error on each side is at most half of the remainder. Rank 0: no lower bound can be given; rank n + 1: no upper
    one.
    """
    if n < 1:
        return 0, n + 1
    side = 0.5 * (1.0 - confidence)
    below = binomial_below(n, p)
    # The percentile lies below the value of rank r if fewer than r values are below it: P(B <= r - 1).
    low = int(np.searchsorted(below, side, side="right"))
    # It lies above the value of rank r when r or more are: 1 - P(B <= r - 1), computed from the small end to keep its
    # digits.
    above = binomial_below(n, 1.0 - p)  # P(n - B <= j), so P(B >= r) = above[n - r]
    high = n + 1 - int(np.searchsorted(above, side, side="right"))
    return low, high


@cache
def values_needed(p: float, confidence: float = 0.95) -> int:
    """The smallest number of values of which one is a bound of the percentile towards its nearer end: the largest is
    an upper one if p^n <= half of the remainder. The smallest and the largest value (0 and 1) need one.
    """
    p = max(p, 1.0 - p)
    if p == 1.0:
        return 1
    n = max(1, math.ceil(math.log(0.5 * (1.0 - confidence)) / math.log(p)))
    while percentile_ranks(n, p, confidence)[1] > n:  # slightly too small because of rounding
        n += 1
    return n


def missing(n: int, p: float, confidence: float = 0.95) -> int:
    """How many more than n values are needed to show a percentile; 0 if none."""
    return max(0, values_needed(p, confidence) - n)


def quantiles(values: ArrayLike, levels: Sequence[float]) -> NDArray[np.float64]:
    """Quantiles of values; NaN for those that cannot be shown, or lie among infinite values: larger than is known."""
    known = np.asarray(values, np.float64)
    with np.errstate(invalid="ignore"):  # between two infinite ones
        found = [math.nan if missing(known.size, p) else float(np.quantile(known, p)) for p in levels]
    return np.array([each if math.isfinite(each) else math.nan for each in found])


def percentile_record(values: NDArray[np.float64], p: float, confidence: float = 0.95) -> dict[str, float]:
    """A percentile of values with its interval; NaN if it cannot be shown, or if one of these lies among infinite
    values: larger than is known.

    Returns
    -------
    record : dict
        ``n``, ``value`` (linear between order statistics), ``ci_low``, ``ci_high``, and ``n_more``: how many more
        values are needed to show it.
    """
    ordered = np.sort(np.asarray(values, np.float64))
    n = ordered.size
    more = missing(n, p, confidence)
    if more:
        return {"n": n, "value": math.nan, "ci_low": math.nan, "ci_high": math.nan, "n_more": more}
    low, high = percentile_ranks(n, p, confidence)
    if not math.isfinite(ordered[high - 1]):
        return {"n": n, "value": math.nan, "ci_low": math.nan, "ci_high": math.nan, "n_more": 0}
    ends = {"ci_low": float(ordered[low - 1]), "ci_high": float(ordered[high - 1])}
    return {"n": n, "value": float(np.quantile(ordered, p)), **ends, "n_more": 0}


def difference_interval(
    one: Mapping[str, float], other: Mapping[str, float], together: float = 0.0
) -> tuple[float, float]:
    """Interval of ``one`` minus ``other``, two records with ``value``, ``ci_low`` and ``ci_high``, from those of each
    (MOVER: Zou and Donner 2008, "Construction of confidence limits about effect measures: a general approach").

    together : correlation of the two estimates. Unlike a bootstrap of quantiles, which held the truth in 69 % of trials
    with 72 values of a rare tail, it is not too narrow with few values.
    """

    def reach(first: float, second: float) -> float:
        return math.sqrt(max(first * first + second * second - 2.0 * together * first * second, 0.0))

    value = one["value"] - other["value"]
    return (
        value - reach(one["value"] - one["ci_low"], other["ci_high"] - other["value"]),
        value + reach(one["ci_high"] - one["value"], other["value"] - other["ci_low"]),
    )


def paired_percentiles(
    now: NDArray[np.float64], before: NDArray[np.float64], p: float
) -> tuple[dict[str, float], float, float, float]:
    """A percentile of the values ``now``, its difference to that of the same logs ``before``, and the ends of the
    difference's interval; NaN if they cannot be shown.
    """
    one, other = percentile_record(now, p), percentile_record(before, p)
    # That no log changed leaves an interval, too: the few that would have may not be among these.
    both = agreement(now > one["value"], before > other["value"])
    return one, one["value"] - other["value"], *difference_interval(one, other, both)


def agreement(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    """Correlation of two properties of the same logs, for `difference_interval`; 0 if it is negative or unknown."""
    if one.all() or other.all() or not (one.any() and other.any()):
        return 0.0
    return max(0.0, float(np.corrcoef(one, other)[0, 1]))
