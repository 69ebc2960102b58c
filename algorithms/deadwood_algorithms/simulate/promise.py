"""How far a share may be from that of the finest fidelity: sampling error and error of calculation, separately and
together.

A run of n logs at fidelity f gives a share p. It differs from what `reference` would give for infinitely many such logs
by s + d: s is the sampling error, with standard error sigma, which shrinks with n; d is that of the calculation, the
same for all n. A bound of d is known, |d| <= b. Then s + d is worst for d = +-b, and the 95 % point of |normal(b,
sigma)| is the error of both *together*: more than either, less than their sum (a bias-aware interval, Armstrong and
Kolesar 2018). With b = 0 it is the usual 1.96 sigma, with b >> sigma it is b + 1.645 sigma, because then only one side
can fail.

Each line is a separate statement, as everywhere in the toolbox.
"""

from __future__ import annotations

import math

from deadwood_algorithms.stats.statistics import Z_95, wilson_interval

# Of a promise at 95 %: the number of logs is determined by the logs themselves, which reduces the coverage a little,
# and a share of few logs is not quite normal.
RISK = 0.04


def _within(bias: float, most: float) -> float:
    """Probability that a normal number of mean ``bias`` and standard deviation 1 is within ``most`` of 0."""
    return 0.5 * (math.erf((most - bias) / math.sqrt(2.0)) + math.erf((most + bias) / math.sqrt(2.0)))


def together_of(bound: float, sigma: float, risk: float = RISK) -> float:
    """Combined error of sampling (standard error ``sigma``) and a calculation whose error is at most ``bound``."""
    if sigma <= 0.0:
        return bound
    low, high = 0.0, bound / sigma + 10.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _within(bound / sigma, middle) < 1.0 - risk else (low, middle)
    return sigma * high


def sigma_for(error: float, bound: float, risk: float = RISK) -> float:
    """The standard error with which both together reach ``error``; 0 if the bound alone is no smaller."""
    if bound >= error:
        return 0.0
    low, high = 0.0, error
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _within(bound / middle, error / middle) >= 1.0 - risk else (low, middle)
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
