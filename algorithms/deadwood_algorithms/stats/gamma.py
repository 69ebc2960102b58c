"""The 95 % interval of a weighted sum of rare counts, from quantiles of gamma distributions (Fay and Feuer 1997)."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from deadwood_algorithms.stats.statistics import Z_95

Array = NDArray[np.float64]

SIDE = 0.025  # probability beyond either end
SHAPE_LARGE = 1000.0  # from here on only the approximation is used, which is then accurate to 1e-5
NODES = 400  # of the table below it; interpolated, the quantile is accurate to 6e-4, from shape 2 on to 1e-4


def gamma_bounds(total: ArrayLike, variance: ArrayLike, weight: float) -> tuple[Array, Array]:
    """Ends of the 95 % interval of the expectation of a sum of counts, each times its weight.

    The lower end is a quantile of the gamma distribution with the mean and the variance of the sum; the upper one that
    of the distribution with one count of the largest weight more. For equal weights it is the exact
    interval of a Poisson count (Garwood 1936).

    Parameters
    ----------
    total, variance : array_like
        The sum, and its variance: the sum of each count times its squared weight.
    weight : float
        The largest weight.
    """
    total, variance = np.broadcast_arrays(np.asarray(total, np.float64), np.asarray(variance, np.float64))
    low = _quantile(total, variance, upper=False)
    return low, _quantile(total + weight, variance + weight**2, upper=True)


def _quantile(mean: Array, variance: Array, *, upper: bool) -> Array:
    """Quantile of the gamma distribution of this mean and variance; the mean itself if the variance is zero."""
    shape = np.divide(mean**2, variance, out=np.full(mean.shape, np.inf), where=variance > 0.0)
    return mean * np.where(np.isfinite(shape), relative_quantile(np.maximum(shape, 1.0), upper=upper), 1.0)


def relative_quantile(shape: Array, *, upper: bool) -> Array:
    """Quantile of the gamma distribution of shape 1 or more, as a multiple of its mean."""
    log_shapes, ratios = _table(upper)
    cube = _wilson_hilferty(shape, upper)
    return np.where(shape < SHAPE_LARGE, cube * np.interp(np.log(shape), log_shapes, ratios), cube)


def _wilson_hilferty(shape: ArrayLike, upper: bool) -> Array:
    """Wilson and Hilferty's approximation (1931): the cube root of a gamma variable is nearly normal."""
    ninth = 1.0 / (9.0 * np.asarray(shape, np.float64))
    return (1.0 - ninth + (Z_95 if upper else -Z_95) * np.sqrt(ninth)) ** 3


@cache
def _table(upper: bool) -> tuple[Array, Array]:
    """The true quantile over the approximation, by the logarithm of the shape: smooth, and 1 for large ones."""
    log_shapes = np.linspace(0.0, math.log(SHAPE_LARGE), NODES)
    ratios = [_exact(math.exp(each), upper) / float(_wilson_hilferty(math.exp(each), upper)) for each in log_shapes]
    return log_shapes, np.array(ratios)


def _exact(shape: float, upper: bool) -> float:
    """The relative quantile by bisection, up to a bound that is certainly above it."""
    low, high = 0.0, 2.5 * float(_wilson_hilferty(shape, upper))
    level = 1.0 - SIDE if upper else SIDE
    for _ in range(50):
        middle = (low + high) / 2.0
        low, high = (middle, high) if probability_below(shape, middle * shape) < level else (low, middle)
    return (low + high) / 2.0


def probability_below(shape: float, x: float) -> float:
    """Regularised lower incomplete gamma function, by its series: all terms are positive, so there is no
    cancellation.
    """
    if x <= 0.0:
        return 0.0
    term = math.exp(shape * math.log(x) - x - math.lgamma(shape + 1.0))
    total, k = term, shape
    while term > 1e-17 * total:
        k += 1.0
        term *= x / k
        total += term
    return min(total, 1.0)
