"""Directions as azimuths, and how wide they spread: pure functions on arrays, no files.

Azimuths are degrees clockwise from grid north; north is often in their middle, so nothing here uses a plain
maximum minus minimum of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.stats.order_statistics import agreement, difference_interval, percentile_record

# Record, azimuths and which deposits count: what `spread_of_release` returns
SeenSpread = tuple[dict[str, float], NDArray[np.float64], NDArray[np.bool_]]


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


def quantile_arc(azimuths: ArrayLike, low: float = 0.05, high: float = 0.95) -> dict[str, float]:
    """Angle between two quantiles of the azimuths, counted along their smallest arc [deg], as a record with its
    interval; NaN if the quantiles cannot be shown.

    Unlike the smallest arc, which a single stray log decides, it does not grow with the number of logs.
    """
    ends = [percentile_record(unrolled(azimuths), level) for level in (high, low)]
    below, above = difference_interval(ends[0], ends[1])
    more = max(each["n_more"] for each in ends)
    known = {"ci_low": float(np.clip(below, 0.0, 360.0)), "ci_high": float(np.clip(above, 0.0, 360.0)), "n_more": more}
    return {"value": ends[0]["value"] - ends[1]["value"], **known}


def spread_of_release(centre: tuple[float, float], x: ArrayLike, y: ArrayLike, min_runout: ArrayLike) -> SeenSpread:
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
        ``n``, ``n_left_out``, ``spread_deg`` (NaN if fewer than two deposits count: one log has a direction and no
        spread), ``p05_p95_deg`` with ``p05_p95_ci_low_deg`` and ``p05_p95_ci_high_deg`` (NaN with ``p05_p95_n_more``
        deposits too few to show it).
    azimuths : array, shape (n,)
        Azimuth of every deposit from the centre [deg].
    counts : array of bool, shape (n,)
    """
    dx, dy = np.asarray(x, float) - centre[0], np.asarray(y, float) - centre[1]
    azimuths = azimuth(dx, dy)
    counts = np.hypot(dx, dy) > np.asarray(min_runout, float)
    middle = quantile_arc(azimuths[counts])
    record = {
        "n": int(counts.size),
        "n_left_out": int(np.count_nonzero(~counts)),
        "spread_deg": smallest_arc(azimuths[counts]) if np.count_nonzero(counts) > 1 else math.nan,
        "p05_p95_deg": middle["value"],
        "p05_p95_ci_low_deg": middle["ci_low"],
        "p05_p95_ci_high_deg": middle["ci_high"],
        "p05_p95_n_more": middle["n_more"],
    }
    return record, azimuths, counts


def spread_change(now: SeenSpread, before: SeenSpread) -> tuple[float, float, float]:
    """Difference of the ranges from 5 to 95 % of two `spread_of_release` of the same logs, and its interval."""
    names = {"value": "p05_p95_deg", "ci_low": "p05_p95_ci_low_deg", "ci_high": "p05_p95_ci_high_deg"}
    one, other = ({name: each[0][column] for name, column in names.items()} for each in (now, before))
    both = agreement(*(_outside(azimuths, counts) for _, azimuths, counts in (now, before)))
    return one["value"] - other["value"], *difference_interval(one, other, both)


def _outside(azimuths: NDArray[np.float64], counts: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which of the deposits that count lie outside the range from 5 to 95 %."""
    if not counts.any():
        return counts
    angles = (azimuths - arc_start(azimuths[counts])) % 360.0
    low, high = np.quantile(angles[counts], [0.05, 0.95])
    return counts & ((angles < low) | (angles > high))


def middle_words(row: Mapping[str, Any]) -> str:
    """``5 to 95 %: 31.2° (27.0 to 35.5°)`` of a record of `spread_of_release`, or how many deposits it needs."""
    if row["p05_p95_n_more"]:
        return f"5 to 95 %: needs {counted(int(row['p05_p95_n_more']), 'more deposit')}"
    value, low, high = (row[f"p05_p95_{name}"] for name in ("deg", "ci_low_deg", "ci_high_deg"))
    return f"5 to 95 %: {value:.1f}° ({low:.1f} to {high:.1f}°)"
