"""Intervals of counts: pure functions on numbers, no files.

Wilson's interval is used for every reach probability because it stays inside [0, 1] and keeps its coverage near 0 and
1, where the usual p +- z*sqrt(p(1-p)/n) collapses to a width of zero.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from deadwood_algorithms.params.counts import counted

Z_95 = 1.959964  # two-sided 95 % point of the normal distribution
# Explains the brackets of `share_if_lost_words` and of differences
IN_BRACKETS = "[]: range of possible values, with intervals, because logs left the terrain model before"


def wilson_interval(n_hit: int, n_total: int, *, z: float = Z_95) -> tuple[float, float]:
    """Interval of a probability from ``n_hit`` successes in ``n_total`` trials; (0, 1) without trials."""
    low, high = wilson_bounds(n_hit, n_total, z)
    return float(low), float(high)


def wilson_bounds(n_hit: ArrayLike, n_total: int, z: float = Z_95) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """``wilson_interval`` of many counts at once."""
    hit = np.asarray(n_hit, np.float64)
    if n_total <= 0:
        return np.zeros(hit.shape), np.ones(hit.shape)
    share, weight = hit / n_total, z * z / n_total
    centre = (share + weight / 2.0) / (1.0 + weight)
    half = z * np.sqrt(share * (1.0 - share) / n_total + weight / (4.0 * n_total)) / (1.0 + weight)
    # At 0 and n hits one end is 0 or 1 exactly; rounding must not leave 1e-19 there.
    return np.where(hit == 0.0, 0.0, centre - half), np.where(hit == n_total, 1.0, centre + half)


def paired_interval(n_lost: int, n_gained: int, n_total: int, *, z: float = Z_95) -> tuple[float, float]:
    """Interval of the difference of two probabilities from the same trials (Tango 1998).

    It holds exactly the differences that McNemar's test, extended to differences other than 0, does not reject. Unlike
    the textbook's d +- z*se it does not collapse when no trial changed: with 0 of n it is +-z^2/(n + z^2).

    Parameters
    ----------
    n_lost, n_gained : int
        Trials with only the first, or only the second, outcome.
    n_total : int
        Number of all trials; the interval is (-1, 1) without trials.

    Returns
    -------
    low, high : float
        Bounds of the second probability minus the first.
    """
    if n_total <= 0:
        return -1.0, 1.0
    difference = n_gained - n_lost

    def distance(delta: float) -> float:
        """Standard errors from the observed difference down to ``delta``; decreases with ``delta``."""
        b = (2 * n_total - difference) * delta - n_gained - n_lost
        c = -n_lost * delta * (1.0 - delta)
        lost = (math.sqrt(max(b * b - 8.0 * n_total * c, 0.0)) - b) / (4.0 * n_total)  # most likely share, given delta
        spread = math.sqrt(max(n_total * (2.0 * lost + delta * (1.0 - delta)), 0.0))
        off = difference - n_total * delta
        return off / spread if spread > 0.0 else math.copysign(math.inf, off) if off else 0.0

    def where(level: float, low: float, high: float) -> float:
        for _ in range(60):
            middle = (low + high) / 2.0
            low, high = (middle, high) if distance(middle) > level else (low, middle)
        return (low + high) / 2.0

    share = difference / n_total
    return where(z, -1.0, share), where(-z, share, 1.0)


def mcnemar_p(n_lost: int, n_gained: int) -> float:
    """Two-sided p-value of McNemar's exact test: could so many trials have changed one way by chance?

    1 if no trial changed: there is no evidence against equality.
    """
    n = n_lost + n_gained
    term, total = 1, 0  # whole numbers: exact for any n
    for k in range(min(n_lost, n_gained) + 1):
        total += term
        term = term * (n - k) // (k + 1)
    return min(1.0, 2 * total / 2**n)


def reach_record(n_reach: int, n_total: int) -> dict[str, float]:
    """Reach probability with its 95 % Wilson interval, with the names that every output uses."""
    low, high = wilson_interval(n_reach, n_total)
    share = n_reach / n_total if n_total else math.nan
    return {"n_total": int(n_total), "n_reach": int(n_reach), "p": share, "ci_low": low, "ci_high": high}


def bounds_if_lost(n_reach: int, n_total: int, n_lost: int) -> dict[str, float]:
    """Bounds of a reach probability for logs that left the terrain model before: none or all of them may reach the
    line.

    Parameters
    ----------
    n_lost : int
        Logs that left the terrain model without having reached the line; ``n_reach`` does not include them.

    Returns
    -------
    record : dict
        ``n_lost``; ``p_low_if_lost`` (none of them reaches) and ``p_high_if_lost`` (all do); ``ci_low_if_lost`` and
        ``ci_high_if_lost``, the outer ends of the intervals of these two.
    """
    none, everyone = reach_record(n_reach, n_total), reach_record(n_reach + n_lost, n_total)
    return {
        "n_lost": int(n_lost),
        "p_low_if_lost": none["p"],
        "p_high_if_lost": everyone["p"],
        "ci_low_if_lost": none["ci_low"],
        "ci_high_if_lost": everyone["ci_high"],
    }


def loss_matters(record: Mapping[str, Any]) -> bool:
    """Whether the logs that left the terrain model could move a probability out of the interval printed beside it."""
    return record["p_high_if_lost"] > record["ci_high"]


def decimals_of(low: float, high: float) -> int:
    """Decimals of a number that its interval allows: enough for its half-width to have two digits, and at least 0.

    12 +- 1.8 has one, 0.15 +- 0.19 two, 75 +- 13 none.
    """
    half = (high - low) / 2.0
    if not (math.isfinite(half) and half > 0.0):
        return 0
    return min(max(0, 1 - math.floor(math.log10(half))), 6)


def percent(share: float, low: float, high: float, *, sign: bool = False) -> str:
    """A share in percent without its unit, rounded as far as its interval (a share as well) allows; ``-`` for NaN."""
    if not math.isfinite(share):
        return "-"
    return to_decimals(100 * share, decimals_of(100 * low, 100 * high), sign=sign)


def to_decimals(value: float, decimals: int, *, sign: bool = False) -> str:
    """``+1.20``, ``0.00``: with the given decimals; a value that rounds to zero has no sign."""
    text = f"{value:{'+' if sign else ''}.{decimals}f}"
    return text.lstrip("-+") if float(text) == 0.0 else text


def alike(values: Sequence[float], digits: int = 3) -> list[str]:
    """Numbers of one kind with as many decimals each: as the first one needs, less zeros that all end in."""
    first = abs(values[0])
    places = max(0, digits - 1 - math.floor(math.log10(first))) if first >= 1e-6 else digits
    while places and all(f"{each:.{places}f}".endswith("0") for each in values):
        places -= 1
    return [to_decimals(each, places) for each in values]


def percent_of(n_hit: int, n_total: int) -> str:
    """``0.15 %``: a count of logs as a share, rounded as far as its Wilson interval allows; 0 and all are exact."""
    if n_total and n_hit in (0, n_total):
        return "100 %" if n_hit else "0 %"
    record = reach_record(n_hit, n_total)
    return f"{percent(record['p'], record['ci_low'], record['ci_high'])} %" if n_total else "-"


def percents_of(counts: Sequence[int], n_total: int) -> list[str]:
    """``65.0 %``, ``2.5 %``: counts of logs as shares with as many decimals each, as `percent_of` for the widest of
    their intervals; more where one would be rounded to zero, or all of them would not add up to 100 %.
    """
    found = [reach_record(each, n_total) for each in counts if 0 < each < n_total]
    if not found:
        return [percent_of(each, n_total) for each in counts]
    places = min(decimals_of(100.0 * each["ci_low"], 100.0 * each["ci_high"]) for each in found)
    while any(float(to_decimals(100.0 * each["p"], places)) == 0.0 for each in found):
        places += 1
    rounded = sum(round(100.0 * each / n_total, places) for each in counts)
    if sum(counts) == n_total and abs(rounded - 100.0) > 0.1 * 10.0**-places:
        places += 1
    return [
        f"{to_decimals(100.0 * each / n_total, places)} %" if 0 < each < n_total else percent_of(each, n_total)
        for each in counts
    ]


def percent_with_interval(record: dict[str, float]) -> str:
    """``0.15 % (0.05 to 0.44 %)``, of a `reach_record`, rounded as far as the interval allows.

    Zero hits are never printed as 0 %, but as the excluded range: ``< 0.19 %``; all hits as ``> 99.81 %``.
    """
    low, high = record["ci_low"], record["ci_high"]
    if record["n_total"] == 0:
        return "no logs"
    if record["n_reach"] == 0:
        return f"< {percent(high, 0.0, 2.0 * high)} %"  # two digits of the remaining share
    if record["n_reach"] == record["n_total"]:
        return f"> {percent(low, 0.0, 2.0 * (high - low))} %"
    p, low, high = (percent(each, low, high) for each in (record["p"], low, high))
    return f"{p} % ({low} to {high} %)"


def share_if_lost_words(n_reach: int, n_total: int, n_lost: int) -> str:
    """``30 % (18 to 45 %)``, with ``[18 to 67 %]`` where logs were lost that could change it."""
    record = reach_record(n_reach, n_total) | bounds_if_lost(n_reach, n_total, n_lost)
    text, low, high = percent_with_interval(record), record["ci_low"], record["ci_high"]
    if not loss_matters(record):
        return text
    return f"{text} [{percent(low, low, high)} to {percent(record['ci_high_if_lost'], low, high)} %]"


def points_with_interval(difference: float, low: float, high: float) -> str:
    """``-2.1 (-3.5 to -0.7)``: a difference of shares in percentage points, rounded as far as its interval allows."""
    points, bottom, top = (percent(each, low, high, sign=True) for each in (difference, low, high))
    return f"{points} ({bottom} to {top})" if math.isfinite(low) else points


def points_if_lost_words(
    difference: float, interval: tuple[float, float], possible: tuple[float, float], with_intervals: tuple[float, float]
) -> str:
    """As ``points_with_interval``; with ``[-70 to -10]`` behind it if lost logs could bring it out of its interval.

    possible : least and largest difference, whatever the lost logs did; with_intervals : the outer ends of theirs
    """
    text = points_with_interval(difference, *interval)
    if not (possible[0] < interval[0] or possible[1] > interval[1]):
        return text
    return f"{text} [{' to '.join(percent(each, *interval, sign=True) for each in with_intervals)}]"


def lost_words(record: Mapping[str, Any], joint: str = "; ") -> str:
    """``; 12 others left the terrain model before it: 51 % if all of them reach it; ...``, with ``joint`` before each.

    Empty if none was lost. The interval beside the share covers chance only, the share if all reach it the lost logs
    only; so the interval of both together is added. ``joint`` separates the clauses.
    """
    if not record.get("n_lost"):
        return ""
    low, high = record["ci_low_if_lost"], record["ci_high_if_lost"]
    up_to, low, high = (percent(each, low, high) for each in (record["p_high_if_lost"], low, high))
    return (
        f"{joint}{counted(record['n_lost'], 'other')} left the terrain model before it: {up_to} % if all of them "
        f"reach it{joint}chance and these together: {low} to {high} %"
    )
