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
# Reach minus that of reference over random slopes, by kind (``scene.slope_kind``): mean, spread on nine slopes in ten,
# and on the tenth [points]; fitted to two thirds of the slopes
BETWEEN_SLOPES: dict[str, dict[str, Between]] = {
    "draft": {
        "open": Between(0.63, 5.36, 28.7),
        "open, rough ground": Between(0.5, 5.2, 27.66),
        "forest": Between(0.46, 4.83, 25.31),
        "forest, rough ground": Between(0.5, 4.92, 25.89),
        "channels": Between(0.36, 4.89, 25.64),
        "channels, rough ground": Between(0.82, 5.25, 28.07),
        "structures": Between(0.47, 4.62, 23.91),
        "structures, rough ground": Between(0.5, 5.2, 27.66),
    },
    "standard": {
        "open": Between(-0.47, 2.36, 12.26),
        "open, rough ground": Between(-0.32, 2.43, 12.6),
        "forest": Between(-0.43, 2.2, 11.33),
        "forest, rough ground": Between(-0.25, 2.31, 11.93),
        "channels": Between(-0.33, 2.11, 10.88),
        "channels, rough ground": Between(-0.35, 2.25, 11.66),
        "structures": Between(-0.3, 2.09, 10.75),
        "structures, rough ground": Between(-0.32, 2.43, 12.6),
    },
}


def assumed_errors(up_to: str, kind: str) -> dict[str, Between]:
    """The error of calculation of the fidelities that may be chosen beside reference, as shares, on a kind of slope.

    ``up_to``: none, those from standard on, or draft as well.
    """
    names = {"none": (), "standard": ("standard", "fine"), "draft": ("draft", "standard", "fine")}[up_to]
    found = {name: BETWEEN_SLOPES[name][kind] for name in names if name in BETWEEN_SLOPES}
    return {name: Between(*(each / 100.0 for each in points)) for name, points in found.items()}
