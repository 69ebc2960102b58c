"""The share of an outcome's variance that a factor accounts for, with intervals over the design's rows and over the
logs.

First-order indices by Saltelli et al. (2010, "Variance based sensitivity analysis of model output", table 2 b), total
indices by Jansen (1999), for the outcome over all logs that might be released: the contribution of the run's finite
number of logs to a squared difference or product (their variance over the logs divided by their number) is subtracted.
Otherwise every factor, even one without effect, would have an index, because on a rough slope the least change sends a
log elsewhere.

The share that a factor accounts for alone cannot exceed its total share. If the two estimates, which are made of
different terms, nevertheless do, that is chance: both become their mean, weighted by precision (`in_order`), in each
resample too.

Intervals are bootstrapped over both, the rows of the design and the logs: the deviations of the resampled index from
its value if these logs were the whole population. They are clipped to 0..1, the range of an index; an estimate may lie
outside.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.stats.draws import ROW_DRAW, uniforms
from deadwood_algorithms.stats.resampling import RESAMPLES, resamples

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Indices:
    """Indices of one outcome; arrays by factor, intervals of shape (2, factors), draws of (resamples, factors).

    variance : of the outcome over the ranges, and its interval; if that reaches 0 there is no variance to attribute,
    and
        the indices are NaN
    crossed : factors whose first-order index was estimated above their total index, as printed, before both
        became their mean
    """

    mean: float
    variance: float
    variance_ci_low: float
    variance_ci_high: float
    first: Array
    first_interval: Array
    total: Array
    total_interval: Array
    total_draws: Array
    crossed: NDArray[np.bool_]

    def total_words(self, factor: int) -> str:
        """``0.83 (0.60 to 1.00)``: an estimate outside 0..1, which is due to chance, is printed as the nearer end."""
        low, high = self.total_interval[:, factor]
        return f"{min(max(self.total[factor], 0.0), 1.0):.2f} ({low:.2f} to {high:.2f})"


def weights_of(log_id: NDArray[np.int64], seed: int, count: int = RESAMPLES) -> Array:
    """How often each log counts in each resample, shape (logs, resamples); with fewer than two logs always once."""
    if log_id.size < 2:
        return np.ones((log_id.size, count))
    drawn = np.stack(list(resamples(log_id, seed, count)), axis=1).astype(float)
    drawn[:, drawn.sum(axis=0) < 2.0] = 1.0  # with only a few logs, none may be drawn
    return drawn


def rows_drawn(rows: int, seed: int, count: int = RESAMPLES) -> NDArray[np.int64]:
    """How often each row of the design counts in each resample, shape (rows, resamples)."""
    drawn = np.zeros((rows, count), np.int64)
    for turn in range(count):
        picked = (uniforms(seed, np.arange(rows), ROW_DRAW, turn)[0] * rows).astype(np.int64)
        drawn[:, turn] = np.bincount(picked, minlength=rows)
    return drawn


def indices_of(
    a: Array, b: Array, mixed: Array, weights: Array, drawn: NDArray[np.int64], report: Callable[[], None] | None = None
) -> Indices:
    """Indices from the outcome of each log in each run.

    Parameters
    ----------
    a, b : shape (rows, logs)
    mixed : shape (factors, rows, logs), A with one factor of B
    weights : shape (logs, resamples), of `weights_of`; drawn : shape (rows, resamples), of `rows_drawn`
    """
    plain, once = np.ones((a.shape[1], 1)), np.ones((len(a), 1), np.int64)
    centre = 0.5 * (a.mean(axis=0) + b.mean(axis=0))  # by log; any value would do, because the differences have mean 0

    def all_of(by_log: Array, by_row: NDArray[np.int64], *, correct: bool) -> tuple[Array, Array, Array]:
        """Variance, numerators of first-order and total indices, shape (resamples,) and (factors, resamples)."""
        variance = _variance(a, b, by_log, by_row, correct)
        pairs = [_numerators(a, b - centre, each, by_log, by_row, correct) for each in mixed]
        return variance, np.array([each[0] for each in pairs]), np.array([each[1] for each in pairs])

    found, firsts, totals = (each[..., 0] for each in all_of(plain, once, correct=True))
    if report:
        report()
    world, world_firsts, world_totals = (each[..., 0] for each in all_of(plain, once, correct=False))
    tried, tried_firsts, tried_totals = all_of(weights, drawn, correct=True)
    if report:
        report()
    low, high = found + np.quantile(tried - world, [0.025, 0.975])
    mean = float(0.5 * (a.mean() + b.mean()))
    factors = len(mixed)
    if not low > 0.0:
        empty, pair = np.full(factors, np.nan), np.full((2, factors), np.nan)
        none = np.full((weights.shape[1], factors), np.nan)
        apart = np.zeros(factors, bool)
        return Indices(mean, float(found), float(low), float(high), empty, pair, empty, pair, none, apart)
    tried = np.where(tried > 0.0, tried, np.nan)  # a resample without variance contains no information
    first, total = firsts / found, totals / found
    first_draws = first[:, None] + tried_firsts / tried - (world_firsts / world)[:, None]
    total_draws = total[:, None] + tried_totals / tried - (world_totals / world)[:, None]
    exact = [np.nanvar(each, axis=1) for each in (first_draws, total_draws)]
    crossed = np.clip(first, 0.0, 1.0).round(2) > np.clip(total, 0.0, 1.0).round(2)
    first, total = in_order(first, total, *exact)
    first_draws, total_draws = in_order(first_draws, total_draws, *(each[:, None] for each in exact))
    ends = [0.025, 0.975]
    return Indices(
        mean,
        float(found),
        float(low),
        float(high),
        first,
        np.clip(np.nanquantile(first_draws, ends, axis=1), 0.0, 1.0),
        total,
        np.clip(np.nanquantile(total_draws, ends, axis=1), 0.0, 1.0),
        total_draws.T,
        crossed,
    )


def in_order(first: Array, total: Array, first_variance: Array, total_variance: Array) -> tuple[Array, Array]:
    """First-order and total indices, if the first exceeds the total, both are their inverse-variance weighted mean."""
    both = first_variance + total_variance
    weight = np.divide(total_variance, both, out=np.full(both.shape, 0.5), where=both > 0.0)
    mean = total + weight * (first - total)
    crossed = first > total
    return np.where(crossed, mean, first), np.where(crossed, mean, total)


def _variance(a: Array, b: Array, by_log: Array, by_row: NDArray[np.int64], correct: bool) -> Array:
    """Variance of the outcome over the rows, shape (resamples,).

    All pairs of runs are compared; what the logs add to them is computed on the pairs of a row of A and one of B.
    """
    logs, count = by_log.sum(axis=0), 2.0 * by_row.sum(axis=0)
    of_a, of_b = a @ by_log / logs, b @ by_log / logs
    mean = (by_row * (of_a + of_b)).sum(axis=0) / count
    squares = (by_row * ((of_a - mean) ** 2 + (of_b - mean) ** 2)).sum(axis=0)
    variance = squares / (count - 1.0)
    if correct:
        variance = variance - 0.5 * (by_row * _noise(a - b, by_log)).sum(axis=0) / (0.5 * count)
    return variance


def _numerators(
    a: Array, b: Array, mixed: Array, by_log: Array, by_row: NDArray[np.int64], correct: bool
) -> tuple[Array, Array]:
    """Numerators of a factor's first-order and total index, each of shape (resamples,)."""
    logs, rows = by_log.sum(axis=0), by_row.sum(axis=0)
    changed = mixed - a
    of_b, change = b @ by_log / logs, changed @ by_log / logs
    product, square = of_b * change, change**2
    if correct and len(by_log) > 1:
        together = (b * changed) @ by_log / logs - product
        product = product - together / (logs - 1.0)
        square = square - _noise(changed, by_log)
    return (by_row * product).sum(axis=0) / rows, 0.5 * (by_row * square).sum(axis=0) / rows


def _noise(values: Array, by_log: Array) -> Array:
    """Variance of each row's mean over its logs, shape (rows, resamples); 0 for a single log."""
    logs = by_log.sum(axis=0)
    if len(by_log) < 2:
        return np.zeros((len(values), by_log.shape[1]))
    spread = np.maximum(values**2 @ by_log / logs - (values @ by_log / logs) ** 2, 0.0)
    return spread / (logs - 1.0)
