"""Slope, roughness and gullies of a terrain at the scale of a log: a quadratic surface fitted around every cell.

For `assess_mobilisation`. In a square window of n x n cells around each cell the heights are fitted, by least squares,
with a + b x + c y + d x^2 + e x y + f y^2 (Evans' surface). Then, at the cell:

slope      |(b, c)|, which is also the slope of the fitted plane
roughness  root mean square of the heights about the quadratic surface: what neither slope nor gully explains [m]
hollow     second derivative across the slope (along the contour), upward curvature positive, as the depth of the
           cell beneath the chord between the window's sides: half the curvature times the square of half the window [m]

In an incomplete window (nodata, the raster's edge) all of them are NaN.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SQUARE = 256  # cells on a side, fitted at once: arrays of 0.5 MB stay in a core's cache and take 0.6 of the time


@dataclass(frozen=True)
class Relief:
    """Tangent of the slope, roughness [m] and hollow [m] of each cell."""

    slope: Array
    roughness: Array
    hollow: Array


def radius_of(window_m: float, cell: float) -> int:
    """Cells on each side of the middle one; at least 1, because a surface with six terms needs nine heights."""
    return max(1, round((window_m / cell - 1.0) / 2.0))


def relief(heights: Array, cell: float, radius: int) -> Relief:
    """The relief of the inner cells of a window of heights [m], which has ``radius`` more cells on each side."""
    found = Relief(*(np.empty([n - 2 * radius for n in heights.shape]) for _ in range(3)))
    for row in range(0, found.slope.shape[0], SQUARE):
        for column in range(0, found.slope.shape[1], SQUARE):
            around = heights[row : row + SQUARE + 2 * radius, column : column + SQUARE + 2 * radius]
            place = slice(row, row + SQUARE), slice(column, column + SQUARE)
            found.slope[place], found.roughness[place], found.hollow[place] = _fitted(around, cell, radius)
    return found


def _fitted(heights: Array, cell: float, radius: int) -> tuple[Array, Array, Array]:
    middle = np.nanmean(heights) if np.isfinite(heights).any() else 0.0
    z = heights - middle  # small numbers keep their digits in the sums of squares
    n = 2 * radius + 1
    steps = np.arange(-radius, radius + 1.0)
    s2, s4 = float((steps**2).sum()), float((steps**4).sum())

    columns = _moments(z, radius, axis=1)
    (m1, my, myy), (mx, mxy), (mxx,) = (
        _moments(each, radius, axis=0, most=2 - k) for k, each in enumerate(columns)
    )  # sums of z times 1, y, y^2; x, x y; x^2, in cells
    (along,) = _moments(z**2, radius, axis=1, most=0)
    (squares,) = _moments(along, radius, axis=0, most=0)

    b, c = mx / (n * s2), my / (n * s2)
    e = mxy / s2**2
    # 1, x^2 and y^2 are not orthogonal; x^2 and y^2 minus their mean are, to all others and to each other.
    mean = s2 / n
    spread = n * (s4 - s2 * mean)
    d, f = (mxx - mean * m1) / spread, (myy - mean * m1) / spread
    left = squares - m1**2 / n**2 - (b**2 + c**2) * (n * s2) - e**2 * s2**2 - (d**2 + f**2) * spread
    roughness = np.sqrt(np.maximum(left, 0.0)) / n

    steep = b**2 + c**2
    with np.errstate(invalid="ignore", divide="ignore"):
        # Along the contour (-c, b): (2 d c^2 - 2 e b c + 2 f b^2) / (b^2 + c^2); on level ground there is no contour.
        across = np.where(steep > 0.0, (2.0 * d * c**2 - 2.0 * e * b * c + 2.0 * f * b**2) / steep, 0.0)
    across[np.isnan(left)] = np.nan
    return np.sqrt(steep) / cell, roughness, 0.5 * across * (n / 2.0) ** 2


def _moments(z: Array, radius: int, axis: int, most: int = 2) -> tuple[Array, ...]:
    """Sums over a moving window along an axis, of z times 1, k and k^2, where k counts cells from its middle.

    ``most`` is the highest power of k.
    """
    size = z.shape[axis] - 2 * radius

    def part(k: int) -> Array:
        return z[k + radius : k + radius + size] if axis == 0 else z[:, k + radius : k + radius + size]

    plain = part(0).copy()
    sums = plain, *(np.zeros_like(plain) for _ in range(most))
    work = np.empty_like(plain)
    for k in range(1, radius + 1):
        np.add(part(k), part(-k), out=work)
        plain += work
        if most > 1:
            sums[2][:] += np.multiply(work, float(k * k), out=work)
        if most > 0:
            np.subtract(part(k), part(-k), out=work)
            sums[1][:] += np.multiply(work, float(k), out=work)
    return sums
