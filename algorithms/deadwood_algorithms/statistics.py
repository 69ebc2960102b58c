"""Intervals of counts and spreads of directions: pure functions on arrays, no files.

Wilson's interval is used for every reach probability because it stays inside [0, 1] and keeps its coverage near 0 and
1, where the usual p +- z*sqrt(p(1-p)/n) collapses to a width of zero. Directions are azimuths in degrees; north is in
their middle as often as not, so nothing here takes a plain maximum minus minimum of them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Z_95 = 1.959964  # two-sided 95 % point of the normal distribution


def wilson_interval(n_hit: int, n_total: int, *, z: float = Z_95) -> tuple[float, float]:
    """Interval of a probability that was met ``n_hit`` times in ``n_total`` trials; (0, 1) when nothing was tried."""
    if n_total <= 0:
        return 0.0, 1.0
    share = n_hit / n_total
    weight = z * z / n_total
    centre = (share + weight / 2.0) / (1.0 + weight)
    half = z * math.sqrt(share * (1.0 - share) / n_total + weight / (4.0 * n_total)) / (1.0 + weight)
    # At 0 and n hits one end is 0 or 1 exactly; rounding must not leave 1e-19 there.
    low = 0.0 if n_hit == 0 else centre - half
    high = 1.0 if n_hit == n_total else centre + half
    return low, high


def azimuth(dx: ArrayLike, dy: ArrayLike) -> NDArray[np.float64]:
    """Azimuth of plan vectors [deg], clockwise from grid north, 0 <= a < 360."""
    angle = np.degrees(np.arctan2(np.asarray(dx, float), np.asarray(dy, float))) % 360.0
    return np.where(angle >= 360.0, 0.0, angle)  # -1e-15 % 360 is 360


def unrolled(azimuths: ArrayLike) -> NDArray[np.float64]:
    """The azimuths as sorted angles from the start of the smallest arc that holds them all [deg], the first 0.

    The arc's start is the far end of the largest gap between neighbours around the circle.
    """
    ordered = np.sort(np.asarray(azimuths, float) % 360.0)
    if ordered.size == 0:
        return ordered
    gaps = np.diff(ordered, append=ordered[0] + 360.0)
    start = (int(np.argmax(gaps)) + 1) % ordered.size
    turned = np.roll(ordered, -start)
    return np.sort((turned - turned[0]) % 360.0)


def smallest_arc(azimuths: ArrayLike) -> float:
    """The smallest angle that holds every azimuth [deg]: 350 and 10 span 20, not 340; NaN without azimuths."""
    angles = unrolled(azimuths)
    return float(angles[-1]) if angles.size else math.nan


def quantile_arc(azimuths: ArrayLike, low: float = 0.05, high: float = 0.95) -> float:
    """Angle between two quantiles of the azimuths, counted along their smallest arc [deg]; NaN without azimuths.

    Unlike the smallest arc, which a single stray log decides, it does not grow with the number of logs.
    """
    angles = unrolled(azimuths)
    if angles.size == 0:
        return math.nan
    ends = np.quantile(angles, [low, high])
    return float(ends[1] - ends[0])
