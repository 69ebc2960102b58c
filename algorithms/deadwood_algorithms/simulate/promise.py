"""How far a share may be from that of the finest fidelity: sampling error and error of calculation, separately and
together.

A run of n logs at fidelity f gives a share p. It differs from what `reference` would give for infinitely many such logs
by s + d: s is the sampling error, with standard error sigma, which shrinks with n; d is that of the calculation, the
same for all n. On a single slope d is unknown. Known is how it is distributed over slopes of the kind (``Between``).
The error of both *together* is what |s + d| does not exceed on 95 of 100 such slopes: more than either alone would be,
less than their sum. A bound on d is the special case without spread, in which s + d is worst for d = the bound.

Each line is a separate statement, as everywhere in the toolbox.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from deadwood_algorithms.stats.statistics import Z_95, wilson_interval

# Of a promise at 95 %: the number of logs is determined by the logs themselves, which reduces the coverage a little,
# and a share of few logs is not quite normal.
RISK = 0.04
TAIL = 0.1  # share of the slopes on which the error of calculation has the larger spread


class Between(NamedTuple):
    """The error of calculation over slopes of a kind, as shares: normal with this mean.

    usual : standard deviation on nine slopes in ten; tail : on the tenth
    """

    mean: float = 0.0
    usual: float = 0.0
    tail: float = 0.0

    def covered(self, sigma: float, most: float) -> float:
        """Probability that calculation and sampling of this standard error are together within ``most``."""
        usual, tail = (_within(self.mean, math.hypot(each, sigma), most) for each in (self.usual, self.tail))
        return (1.0 - TAIL) * usual + TAIL * tail


def _within(mean: float, deviation: float, most: float) -> float:
    """Probability that a normal number is within ``most`` of 0."""
    if deviation <= 0.0:
        return float(abs(mean) <= most)
    root = math.sqrt(2.0) * deviation
    return 0.5 * (math.erf((most - mean) / root) + math.erf((most + mean) / root))


def together_of(between: Between, sigma: float, risk: float = RISK) -> float:
    """Combined error of sampling (standard error ``sigma``) and calculation."""
    low, high = 0.0, abs(between.mean) + 10.0 * math.hypot(max(between.usual, between.tail), sigma)
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if between.covered(sigma, middle) < 1.0 - risk else (low, middle)
    return high


def sigma_for(error: float, between: Between, risk: float = RISK) -> float:
    """The standard error with which both together reach ``error``; 0 if the calculation alone does not keep it."""
    if abs(between.mean) >= error or between.covered(0.0, error) <= 1.0 - risk:
        return 0.0
    low, high = 0.0, error
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if between.covered(middle, error) >= 1.0 - risk else (low, middle)
    return low


def sampling_of(n_hit: float, n_total: int, *, z: float = Z_95) -> float:
    """How far the share may be off by chance: the farther end of its interval, which is asymmetric near 0 and 1."""
    if n_total <= 0:
        return 1.0
    low, high = wilson_interval(n_hit, n_total, z=z)  # type: ignore[arg-type]
    return max(n_hit / n_total - low, high - n_hit / n_total)


def sigma_of(share: float, n_total: int) -> float:
    """Standard error of a share of n logs, as in its interval."""
    return sampling_of(share * n_total, n_total) / Z_95


def logs_for(sigma: float, share: float, cap: int = 2**40) -> int | None:
    """Logs that bring the standard error of such a share down to ``sigma``; None if more than ``cap``."""
    if sigma <= 0.0 or sigma_of(share, cap) > sigma:
        return None
    low, high = 0, cap
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if sigma_of(share, middle) > sigma else (low, middle)
    return high
