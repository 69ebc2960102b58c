"""Directions as azimuths, and how wide they spread: pure functions on arrays, no files.

Azimuths are degrees clockwise from grid north; north is often in their middle, so nothing here uses a plain
maximum minus minimum of them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray


def azimuth(dx: ArrayLike, dy: ArrayLike) -> NDArray[np.float64]:
    """Azimuth of plan vectors [deg], clockwise from grid north, 0 <= a < 360."""
    angle = np.degrees(np.arctan2(np.asarray(dx, float), np.asarray(dy, float))) % 360.0
    return np.where(angle >= 360.0, 0.0, angle)  # -1e-15 % 360 is 360


def arc_start(azimuths: ArrayLike) -> float:
    """Azimuth at which the smallest arc that contains all azimuths begins, clockwise [deg]; NaN without azimuths.

    It is the far end of the largest gap between neighbours around the circle.
    """
    ordered = np.sort(np.asarray(azimuths, float) % 360.0)
    if ordered.size == 0:
        return math.nan
    gaps = np.diff(ordered, append=ordered[0] + 360.0)
    return float(ordered[(int(np.argmax(gaps)) + 1) % ordered.size])


def unrolled(azimuths: ArrayLike) -> NDArray[np.float64]:
    """The azimuths as sorted angles from the start of their smallest arc [deg]; the first is 0."""
    angles = np.asarray(azimuths, float) % 360.0
    return np.sort((angles - arc_start(angles)) % 360.0)


def smallest_arc(azimuths: ArrayLike) -> float:
    """The smallest angle that contains all azimuths [deg]: 350 and 10 span 20, not 340; NaN without azimuths."""
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


def spread_of_release(
    centre: tuple[float, float], x: ArrayLike, y: ArrayLike, min_runout: ArrayLike
) -> tuple[dict[str, float], NDArray[np.float64], NDArray[np.bool_]]:
    """Lateral spread of the deposits of one release (paper, equation 11).

    Parameters
    ----------
    centre : (float, float)
        Point from which the deposits are seen: the centre of the release area [m].
    x, y : array, shape (n,)
        Deposits [m].
    min_runout : float or array, shape (n,)
        Deposits not farther from the centre than this are left out: the azimuth of a log that hardly moved is
        meaningless.

    Returns
    -------
    record : dict
        ``n``, ``n_left_out``, ``spread_deg`` and ``p05_p95_deg``, the angles are NaN if fewer than two deposits count:
        one log has a direction and no spread.
    azimuths : array, shape (n,)
        Azimuth of every deposit from the centre [deg].
    counted : array of bool, shape (n,)
    """
    dx, dy = np.asarray(x, float) - centre[0], np.asarray(y, float) - centre[1]
    azimuths = azimuth(dx, dy)
    counted = np.hypot(dx, dy) > np.asarray(min_runout, float)
    several = np.count_nonzero(counted) > 1
    record = {
        "n": int(counted.size),
        "n_left_out": int(np.count_nonzero(~counted)),
        "spread_deg": smallest_arc(azimuths[counted]) if several else math.nan,
        "p05_p95_deg": quantile_arc(azimuths[counted]) if several else math.nan,
    }
    return record, azimuths, counted
