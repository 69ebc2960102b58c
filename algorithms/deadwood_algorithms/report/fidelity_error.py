"""The error of calculation of each fidelity, as the README tells it: reach minus that of the finest, in points.

Measured on five synthetic slopes by ``python -m benchmarks``; a test compares this table with the README's, so that
neither can be renewed without the other.
"""

from __future__ import annotations

# fidelity: (mean of the slopes with its interval, the worst slope with its interval)
REACH_POINTS: dict[str, tuple[str, str]] = {
    "draft": ("-0.6 (-1.2 to -0.0)", "-2.7 (-4.4 to -1.0)"),
    "standard": ("-0.3 (-0.8 to +0.2)", "-0.5 (-2.3 to +1.2)"),
    "fine": ("+0.6 (-0.8 to +2.0)", "+3.5 (-0.1 to +7.2)"),
}
