"""The cost of each fidelity, and its error of calculation, as published.

Measured on five synthetic slopes by ``python -m benchmarks``, and on a population of random slopes by ``python -m
benchmarks.population``. Both write these tables, too; tests compare them with what they measured.
"""

from __future__ import annotations

from typing import NamedTuple

from deadwood_algorithms.simulate.promise import Between


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


class SlopesError(NamedTuple):
    """Reach minus that at fine over random slopes: the mean, and the standard deviation between slopes [points]."""

    mean: Points
    sd: Points


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
# The effect of a change on reach (with minus without it, the same logs) minus that at fine: the mean of random slopes
# (``benchmarks.what_if``)
DIFFERENCE_ERRORS: dict[str, Points] = {
    "draft": Points(-1.8, -3.5, -0.4),
    "standard": Points(-1.1, -2.4, 0.2),
}
# Over random slopes (``benchmarks.population``)
SLOPE_ERRORS: dict[str, SlopesError] = {
    "draft": SlopesError(mean=Points(1.6, 0.5, 2.7), sd=Points(2.8, 0.0, 3.9)),
    "standard": SlopesError(mean=Points(1.0, 0.1, 1.8), sd=Points(0.0, 0.0, 1.8)),
}
# Reach minus that of reference over random slopes, by kind (``scene.slope_kind``): mean, spread on nine slopes in ten,
# and on the tenth [points]; fitted to two thirds of the slopes
BETWEEN_SLOPES: dict[str, dict[str, Between]] = {
    "draft": {
        "open": Between(0.15, 3.93, 18.57),
        "open, rough ground": Between(0.24, 3.69, 17.61),
        "forest": Between(-0.24, 3.32, 16.2),
        "forest, rough ground": Between(0.15, 3.51, 16.87),
        "channels": Between(0.12, 3.41, 16.32),
        "channels, rough ground": Between(0.53, 3.85, 18.16),
        "structures": Between(-0.08, 3.32, 16.21),
        "structures, rough ground": Between(0.2, 4.37, 20.51),
    },
    "standard": {
        "open": Between(-0.16, 3.34, 16.05),
        "open, rough ground": Between(0.57, 3.07, 15.15),
        "forest": Between(0.42, 2.77, 14.23),
        "forest, rough ground": Between(0.4, 2.98, 14.85),
        "channels": Between(0.96, 2.87, 14.54),
        "channels, rough ground": Between(0.77, 2.78, 14.3),
        "structures": Between(0.28, 2.83, 14.44),
        "structures, rough ground": Between(0.44, 3.14, 15.4),
    },
    "fine": {
        "open": Between(-0.55, 2.37, 13.27),
        "open, rough ground": Between(-0.55, 2.37, 13.27),
        "forest": Between(-0.55, 2.37, 13.27),
        "forest, rough ground": Between(-0.55, 2.37, 13.27),
        "channels": Between(-0.55, 2.37, 13.27),
        "channels, rough ground": Between(-0.55, 2.37, 13.27),
        "structures": Between(-0.55, 2.37, 13.27),
        "structures, rough ground": Between(-0.55, 2.37, 13.27),
    },
}


def assumed_errors(up_to: str, kind: str) -> dict[str, Between]:
    """The error of calculation of the fidelities that may be chosen beside reference, as shares, on a kind of slope.

    ``up_to``: none, those from standard on, or draft as well.
    """
    names = {"none": (), "standard": ("standard", "fine"), "draft": ("draft", "standard", "fine")}[up_to]
    found = {name: BETWEEN_SLOPES[name][kind] for name in names if name in BETWEEN_SLOPES}
    return {name: Between(*(each / 100.0 for each in points)) for name, points in found.items()}
