"""The cost of each fidelity, and its error of calculation, as published.

Measured on five synthetic slopes by ``python -m benchmarks``, which writes these tables, too; a test compares them with
what it measured.
"""

from __future__ import annotations

from typing import NamedTuple


class Points(NamedTuple):
    """A difference of reach and its 95 % interval [points], to the published tenth."""

    value: float
    ci_low: float
    ci_high: float

    @property
    def farther_end(self) -> float:
        return max(abs(self.ci_low), abs(self.ci_high))


class ReachError(NamedTuple):
    """Reach minus that of the finest: the mean of the slopes, and the slope where it is largest."""

    mean: Points
    worst: Points


# From the cheapest to the finest, the cost of a log relative to standard: it determines which one `auto` tries first,
# but no promise
COSTS: dict[str, float] = {
    "draft": 0.65,
    "standard": 1.0,
    "fine": 4.8,
    "reference": 18.0,
}
REACH_ERRORS: dict[str, ReachError] = {
    "draft": ReachError(mean=Points(0.5, 0.2, 0.8), worst=Points(1.1, 0.2, 2.1)),
    "standard": ReachError(mean=Points(0.1, -0.3, 0.4), worst=Points(-0.8, -1.7, 0.0)),
    "fine": ReachError(mean=Points(0.2, -0.3, 0.7), worst=Points(1.2, 0.0, 2.4)),
}


def assumed_bounds(up_to: str) -> dict[str, float]:
    """Bounds on the error of calculation, as shares, that are taken over from those slopes.

    The farther end of the interval of the worst slope, that is, the largest error that its logs do not exclude. The
    mean over the slopes is known better, but does not hold for a single one. A bound shrinks with more measured logs.
    ``up_to``: bounds for no fidelity, for standard only, or for draft as well.
    """
    names = {"none": (), "standard": ("standard",), "draft": ("standard", "draft")}[up_to]
    return {name: REACH_ERRORS[name].worst.farther_end / 100.0 for name in names}
