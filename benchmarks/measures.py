"""How far two runs of the same logs are apart: pure functions on arrays, each with its noise.

"Paired" means that row i of both arrays is the same log released the same way (common random numbers).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from deadwood_algorithms.stats.statistics import Z_95, paired_interval

Array = NDArray[np.float64]


def reach_difference(ours: ArrayLike, theirs: ArrayLike) -> dict[str, float]:
    """Paired difference of two reach probabilities with its 95 % interval (Tango's, of McNemar's kind).

    ``se`` is the interval's half width in standard errors, for means over scenes.
    """
    ours, theirs = np.asarray(ours, bool), np.asarray(theirs, bool)
    gained, lost = int(np.sum(ours & ~theirs)), int(np.sum(~ours & theirs))
    low, high = paired_interval(lost, gained, len(ours))
    return {
        "delta": (gained - lost) / len(ours),
        "low": low,
        "high": high,
        "se": (high - low) / (2.0 * Z_95),
        "discordant": (gained + lost) / len(ours),
    }


def wasserstein(ours: Array, theirs: Array) -> float:
    """Wasserstein-1 distance of two samples of one size: how far mass must move on average [their unit]."""
    return float(np.mean(np.abs(np.sort(ours) - np.sort(theirs))))


def energy_distance(ours: Array, theirs: Array, *, rows: int = 500) -> float:
    """Energy distance of two samples of points, shape (n, 2), in their unit: 2 E|X-Y| - E|X-X'| - E|Y-Y'|."""

    def mean_distance(a: Array, b: Array) -> float:
        total = 0.0
        for k in range(0, len(a), rows):  # blocks of rows: n x n distances at once would not fit
            part = a[k : k + rows]
            total += float(np.sum(np.hypot(part[:, None, 0] - b[None, :, 0], part[:, None, 1] - b[None, :, 1])))
        return total / (len(a) * len(b))

    return 2.0 * mean_distance(ours, theirs) - mean_distance(ours, ours) - mean_distance(theirs, theirs)


def jaccard_distance(ours: ArrayLike, theirs: ArrayLike) -> float:
    """Weighted Jaccard distance of two hit rasters: 1 - sum(min) / sum(max) over the cells; 0 same, 1 disjoint."""
    ours, theirs = np.asarray(ours, float), np.asarray(theirs, float)
    larger = float(np.sum(np.maximum(ours, theirs)))
    return 1.0 - float(np.sum(np.minimum(ours, theirs))) / larger if larger > 0 else 0.0


def split_halves(number: int, splits: int, seed: int = 1) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Random splits of 0..number-1 into two halves of one size."""
    rng = np.random.default_rng(seed)
    half = number // 2
    orders = [rng.permutation(number) for _ in range(splits)]
    return [(order[:half], order[half : 2 * half]) for order in orders]


def noise_floor(
    distance: Callable[[NDArray[np.int64], NDArray[np.int64]], float], number: int, *, power: float, splits: int = 10
) -> float:
    """Expected distance between two runs of ``number`` different logs (or blocks of logs) with equal settings.

    Halves of one run are two smaller such runs; their mean distance is scaled to the full size by
    (half / number) ** power: 0.5 for distances that fall with the root of the number of logs, 1 for their squares.
    """
    halves = split_halves(number, splits)
    return float(np.mean([distance(a, b) for a, b in halves])) * (number // 2 / number) ** power


def bootstrap_difference(
    statistic: Callable[[Array], float], ours: Array, theirs: Array, *, resamples: int = 200, seed: int = 2
) -> dict[str, float]:
    """Difference of a statistic between two paired samples (rows are logs), with its 95 % bootstrap interval."""
    rng = np.random.default_rng(seed)
    n = len(ours)
    found = []
    for _ in range(resamples):
        rows = rng.integers(0, n, n)
        found.append(statistic(ours[rows]) - statistic(theirs[rows]))
    low, high = np.nanquantile(found, [0.025, 0.975])
    return {
        "value": statistic(ours),
        "difference": statistic(ours) - statistic(theirs),
        "low": float(low),
        "high": float(high),
    }


def fall_of_median(
    coarse: Array, fine: Array, halvings: int, *, resamples: int = 200, seed: int = 3
) -> dict[str, float]:
    """The factor by which each halving of a step reduces the median of a paired sample, with its 95 % bootstrap
    interval.

    se is that of the factor's logarithm.
    """
    rng = np.random.default_rng(seed)

    def fall(rows: NDArray[np.int64]) -> float:
        return math.log(np.median(coarse[rows]) / np.median(fine[rows])) / halvings

    every = np.arange(len(coarse))
    return _factor(fall(every), float(np.std([fall(rng.choice(every, len(every))) for _ in range(resamples)])))


def pooled_fall(records: list[dict[str, float]]) -> dict[str, float]:
    """Geometric mean of independent factors (one for each scene), with its 95 % interval."""
    mean = float(np.mean([math.log(r["factor"]) for r in records]))
    return _factor(mean, math.sqrt(sum(r["se"] ** 2 for r in records)) / len(records))


def _factor(logarithm: float, se: float) -> dict[str, float]:
    low, high = (math.exp(logarithm + z * se) for z in (-Z_95, Z_95))
    return {"factor": math.exp(logarithm), "low": low, "high": high, "se": se}


def pooled_difference(records: list[dict[str, float]]) -> dict[str, float]:
    """Mean of independent reach differences (one for each scene), with its 95 % interval."""
    mean = float(np.mean([r["delta"] for r in records]))
    deviation = math.sqrt(sum(r["se"] ** 2 for r in records)) / len(records)
    return {"delta": mean, "low": mean - Z_95 * deviation, "high": mean + Z_95 * deviation, "se": deviation}


def slope_through(changes: Array, differences: Array, deviations: Array) -> tuple[float, float]:
    """Slope and its standard error of differences that are zero where the change is zero, weighted by 1/deviation^2."""
    weights = 1.0 / np.asarray(deviations, float) ** 2
    changes = np.asarray(changes, float)
    total = float(np.sum(weights * changes**2))
    return float(np.sum(weights * changes * differences) / total), math.sqrt(1.0 / total)
