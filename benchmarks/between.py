"""Statistics of differences that were measured on many slopes, each with its own sampling noise.

A slope's difference of reach d is known from paired logs with the sampling variance v. Over slopes the differences
scatter by more than v: the rest is the spread between slopes, which is what a user's slope is drawn from.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.simulate.promise import TAIL, Between
from deadwood_algorithms.stats.statistics import Z_95

Array = NDArray[np.float64]
Row = dict[str, Any]
LARGE = 5.0  # [points] a difference that a user would notice
RESAMPLES, STEPS = 200, 300
GRID = np.r_[-59.5:-20:4, -19.5:20:1, 23.5:60:4]  # [points] no node at a whole number, where a bound may be
MEANS, SPREADS, RATIOS = np.arange(-12.0, 12.1, 0.5), np.geomspace(0.3, 20.0, 30), (1.0, 2.0, 3.0, 4.0, 6.0)
SHARED = 10.0  # slopes: the weight of those of all kinds in the record of one
MEAN_SD = 2.0  # [points] prior of a mean: with few slopes it stays near 0


def paired(ours: NDArray[np.bool_], theirs: NDArray[np.bool_]) -> tuple[float, float]:
    """Difference of two shares of the same logs [points], and its sampling variance."""
    n = min(len(ours), len(theirs))
    gained, lost = int((ours[:n] & ~theirs[:n]).sum()), int((~ours[:n] & theirs[:n]).sum())
    share = (gained - lost) / n
    return 100.0 * share, 1e4 * ((gained + lost + 0.5) / n - share**2) / n  # not 0 if no log differs


def spread(d: Array, v: Array) -> float:
    """Standard deviation between slopes, sampling noise taken off."""
    return float(np.sqrt(max(0.0, d.var(ddof=1) - v.mean()))) if len(d) > 1 else 0.0


def share_beyond(d: Array, v: Array, counts: Array | None = None, most: float = LARGE) -> Array:
    """Share of slopes whose own difference is beyond ``most``: the distribution that explains d and v best.

    counts : shape (m, n), how often each slope counts; a share for each row
    """
    counts = np.ones((1, len(d))) if counts is None else counts
    likely = np.exp(-0.5 * (d[:, None] - GRID) ** 2 / v[:, None]) / np.sqrt(v)[:, None] + 1e-300
    weights = np.full((len(counts), len(GRID)), 1.0 / len(GRID))
    for _ in range(STEPS):  # expectation and maximisation
        weights = weights * ((counts / (weights @ likely.T)) @ likely) / len(d)
    return weights[:, np.abs(GRID) > most].sum(axis=1)


def summary(d: Array, v: Array, seed: int = 1) -> Row:
    """Mean, spread between slopes and share beyond LARGE, each with its 95 % interval over slopes."""
    rows = np.random.default_rng(seed).integers(0, len(d), (RESAMPLES, len(d)))
    counts = np.array([np.bincount(each, minlength=len(d)) for each in rows], float)
    found = {
        "mean": (d.mean(), d[rows].mean(axis=1)),
        "sd": (spread(d, v), [spread(d[each], v[each]) for each in rows]),
        "beyond": (share_beyond(d, v)[0], share_beyond(d, v, counts)),
    }
    ends = {name: np.quantile(drawn, [0.025, 0.975]) for name, (_, drawn) in found.items()}
    return {"slopes": len(d)} | {name: (float(value), *map(float, ends[name])) for name, (value, _) in found.items()}


def mean_interval(d: Array) -> tuple[float, float, float]:
    """Mean over slopes and its 95 % interval."""
    half = Z_95 * d.std(ddof=1) / np.sqrt(len(d)) if len(d) > 1 else np.inf
    return float(d.mean()), float(d.mean() - half), float(d.mean() + half)


def _log_likelihood(d: Array, v: Array, ratio: float) -> Array:
    """Of every mean and spread, shape (means, spreads, slopes)."""

    def normal(deviation: Array) -> Array:
        variance = deviation[None, :, None] ** 2 + v
        return np.exp(-0.5 * (d - MEANS[:, None, None]) ** 2 / variance) / np.sqrt(variance)

    return np.log((1.0 - TAIL) * normal(SPREADS) + TAIL * normal(ratio * SPREADS) + 1e-300)


def fitted(
    d: Array, v: Array, kinds: NDArray[np.str_], wanted: tuple[str, ...], like: tuple[Array, Array] | None = None
) -> Mapping[str, Between]:
    """The distribution of the difference over slopes of each kind [points], by likelihood.

    All kinds share the ratio of the tail's spread to the usual one, and every kind also listens to those of the
    others as if SHARED of them were its own. Mean and variances are averages over all that the slopes leave possible,
    by likelihood, so that few slopes give a wider distribution than many. The tail, which few slopes show, is
    widened as Student's 95 % point is against the normal one.

    like : another difference with its noise, which is spread alike around a mean of its own, as if on SHARED slopes
    """

    def of_ratio(ratio: float) -> tuple[float, dict[str, Between]]:
        each = _log_likelihood(d, v, ratio)
        prior = -0.5 * (MEANS[:, None] / MEAN_SD) ** 2 + 0.0 * SPREADS
        if like:
            alike = _log_likelihood(*like, ratio).sum(axis=2)
            alike = np.log(np.exp(alike - alike.max()).mean(axis=0) + 1e-300)  # whatever its mean is
            prior = prior + alike * min(1.0, SHARED / max(1, len(like[0])))
        total, found = 0.0, dict[str, Between]()
        for kind in wanted:
            mine = kinds == kind
            others = each[:, :, ~mine].sum(axis=2) * min(1.0, SHARED / max(1, (~mine).sum()))
            objective = prior + others + each[:, :, mine].sum(axis=2)
            weights = np.exp(objective - objective.max())
            weights /= weights.sum()
            mean = float((weights.sum(axis=1) * MEANS).sum())
            variance = (weights.sum(axis=0) * SPREADS**2).sum()
            unsure = (weights.sum(axis=1) * (MEANS - mean) ** 2).sum()
            usual, tail = np.sqrt(variance + unsure), np.sqrt(ratio**2 * variance + unsure)
            found[kind] = Between(mean, float(usual), float(tail))
            total += float((weights * each[:, :, mine].sum(axis=2)).sum())
        return total, found

    totals, found = zip(*map(of_ratio, RATIOS), strict=True)
    likely = np.exp(np.array(totals) - max(totals))
    likely /= likely.sum()

    def over_ratios(kind: str) -> Between:
        mean, usual, tail = np.array([each[kind] for each in found]).T
        center = float(likely @ mean)
        unsure = (mean - center) ** 2
        wider = 1.0 + 1.2 / max(1.0, TAIL * len(d))
        return Between(
            center, float(np.sqrt(likely @ (usual**2 + unsure))), float(wider * np.sqrt(likely @ (tail**2 + unsure)))
        )

    return {kind: over_ratios(kind) for kind in wanted}


def added(first: Between, second: Between) -> Between:
    """The distribution of the sum of two independent differences, as normal as each."""
    return Between(
        first.mean + second.mean, float(np.hypot(first.usual, second.usual)), float(np.hypot(first.tail, second.tail))
    )
