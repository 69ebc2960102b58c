"""Exact intervals of percentiles, from order statistics: no distribution of the values is assumed, only that they are
independent and identically distributed.

Of n independent values the number that lie below a percentile p is binomial (n, p), whatever the values are. So two of
the sorted values enclose the percentile with a probability given by the binomial distribution; with few values none
lies above a high percentile with that probability, and no upper bound can be given.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray


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


def values_needed(p: float, confidence: float = 0.95) -> int:
    """The smallest number of values whose largest is an upper bound of the percentile: p^n <= half of the remainder."""
    n = max(1, math.ceil(math.log(0.5 * (1.0 - confidence)) / math.log(p)))
    while percentile_ranks(n, p, confidence)[1] > n:  # slightly too small because of rounding
        n += 1
    return n


def percentile_record(values: NDArray[np.float64], p: float, confidence: float = 0.95) -> dict[str, float]:
    """A percentile of values with its interval; NaN if it, or an end, cannot be given.

    Returns
    -------
    record : dict
        ``n``, ``value`` (linear between order statistics), ``ci_low``, ``ci_high``, and ``n_more``: how many more
        values are needed until an upper bound can be given, 0 if it can.
    """
    ordered = np.sort(np.asarray(values, np.float64))
    n = ordered.size
    low, high = percentile_ranks(n, p, confidence)
    return {
        "n": n,
        "value": float(np.quantile(ordered, p)) if n else math.nan,
        "ci_low": float(ordered[low - 1]) if low else math.nan,
        "ci_high": float(ordered[high - 1]) if high <= n else math.nan,
        "n_more": max(0, values_needed(p, confidence) - n) if high > n else 0,
    }
