"""What each fidelity costs, and its error of calculation, as the README tells them.

Measured on five synthetic slopes by ``python -m benchmarks``, which writes these tables, too; a test compares them with
what it measured.
"""

from __future__ import annotations

# From the cheapest to the finest, what a log costs of one at standard: which one `auto` tries first hangs on it, no
# promise does
COSTS: dict[str, float] = {
    "draft": 0.32,
    "standard": 1.0,
    "fine": 2.5,
    "reference": 8.9,
}
# Reach minus that of the finest, in points: (mean of the slopes with its interval, the worst slope with its interval)
REACH_POINTS: dict[str, tuple[str, str]] = {
    "draft": ("-0.4 (-0.8 to +0.1)", "-3.6 (-4.7 to -2.5)"),
    "standard": ("-0.1 (-0.5 to +0.4)", "-0.7 (-1.8 to +0.4)"),
    "fine": ("-0.6 (-1.6 to +0.4)", "-1.7 (-4.3 to +1.0)"),
}


def assumed_bounds(up_to: str) -> dict[str, float]:
    """Bounds on the error of calculation, as shares, that are taken over from those slopes.

    The farther end of the interval of the slope that is worst: what the logs that slid there do not exclude. The mean
    of the slopes is known better, but says nothing of one. So a bound shrinks as more logs are measured. ``up_to``:
    bounds of no fidelity, of standard alone, or of draft as well.
    """
    names = {"none": (), "standard": ("standard",), "draft": ("standard", "draft")}[up_to]
    return {name: _farther_end(REACH_POINTS[name][1]) / 100.0 for name in names}


def _farther_end(text: str) -> float:
    low, high = text.split("(")[1].rstrip(")").split(" to ")
    return max(abs(float(low)), abs(float(high)))
