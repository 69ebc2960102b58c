"""Intervals of counts: pure functions on numbers, no files.

Wilson's interval is used for every reach probability because it stays inside [0, 1] and keeps its coverage near 0 and
1, where the usual p +- z*sqrt(p(1-p)/n) collapses to a width of zero.
"""

from __future__ import annotations

import math

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


def paired_interval(n_lost: int, n_gained: int, n_total: int, *, z: float = Z_95) -> tuple[float, float]:
    """Interval of the difference of two probabilities that were met by the same trials (Tango 1998).

    It holds exactly the differences that McNemar's test, extended to differences other than 0, does not reject. Unlike
    the textbook's d +- z*se it does not collapse when no trial changed: with 0 of n it is +-z^2/(n + z^2).

    Parameters
    ----------
    n_lost, n_gained : int
        Trials that met only the first, or only the second.
    n_total : int
        All trials; (-1, 1) when nothing was tried.

    Returns
    -------
    low, high : float
        Of the second probability minus the first.
    """
    if n_total <= 0:
        return -1.0, 1.0
    difference = n_gained - n_lost

    def distance(delta: float) -> float:
        """Standard errors from the observed difference down to ``delta``; falls as ``delta`` rises."""
        b = (2 * n_total - difference) * delta - n_gained - n_lost
        c = -n_lost * delta * (1.0 - delta)
        lost = (math.sqrt(max(b * b - 8.0 * n_total * c, 0.0)) - b) / (4.0 * n_total)  # likeliest share, given delta
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
    """Two-sided p-value of McNemar's exact test: could as many trials have changed one way by a fair coin?

    1 where no trial changed: nothing speaks against equality.
    """
    n = n_lost + n_gained
    term, total = 1, 0  # whole numbers: exact for any n
    for k in range(min(n_lost, n_gained) + 1):
        total += term
        term = term * (n - k) // (k + 1)
    return min(1.0, 2 * total / 2**n)


def reach_record(n_reach: int, n_total: int) -> dict[str, float]:
    """Reach probability with its 95 % Wilson interval, under the names that every output uses."""
    low, high = wilson_interval(n_reach, n_total)
    share = n_reach / n_total if n_total else math.nan
    return {"n_total": int(n_total), "n_reach": int(n_reach), "p": share, "ci_low": low, "ci_high": high}


def percent_with_interval(record: dict[str, float]) -> str:
    """``9.1 % (8.8 to 9.6 %)``; no hit at all is never printed as 0 %, but as what it excludes: ``< 0.02 %``."""
    low, high = 100 * record["ci_low"], 100 * record["ci_high"]
    if record["n_total"] == 0:
        return "no logs"
    if record["n_reach"] == 0:
        return f"< {high:.2g} %"
    return f"{100 * record['p']:.1f} % ({low:.1f} to {high:.1f} %)"
