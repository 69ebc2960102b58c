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
        "open": Between(0.5, 3.75, 15.0),
        "open, rough ground": Between(0.59, 3.5, 13.79),
        "forest": Between(0.11, 3.11, 11.93),
        "forest, rough ground": Between(0.5, 3.3, 12.83),
        "channels": Between(0.47, 3.21, 12.1),
        "channels, rough ground": Between(0.88, 3.66, 14.48),
        "structures": Between(0.27, 3.1, 11.96),
        "structures, rough ground": Between(0.54, 4.21, 17.34),
    },
    "standard": {
        "open": Between(0.19, 3.13, 11.73),
        "open, rough ground": Between(0.92, 2.84, 10.47),
        "forest": Between(0.77, 2.51, 9.08),
        "forest, rough ground": Between(0.75, 2.74, 10.03),
        "channels": Between(1.31, 2.62, 9.56),
        "channels, rough ground": Between(1.12, 2.52, 9.19),
        "structures": Between(0.63, 2.58, 9.41),
        "structures, rough ground": Between(0.79, 2.92, 10.83),
    },
    "fine": {
        "open": Between(-0.2, 2.06, 7.48),
        "open, rough ground": Between(-0.2, 2.06, 7.48),
        "forest": Between(-0.2, 2.06, 7.48),
        "forest, rough ground": Between(-0.2, 2.06, 7.48),
        "channels": Between(-0.2, 2.06, 7.48),
        "channels, rough ground": Between(-0.2, 2.06, 7.48),
        "structures": Between(-0.2, 2.06, 7.48),
        "structures, rough ground": Between(-0.2, 2.06, 7.48),
    },
}


def assumed_errors(up_to: str, kind: str) -> dict[str, Between]:
    """The error of calculation of the fidelities that may be chosen beside reference, as shares, on a kind of slope.

    ``up_to``: none, those from standard on, or draft as well.
    """
    names = {"none": (), "standard": ("standard", "fine"), "draft": ("draft", "standard", "fine")}[up_to]
    found = {name: BETWEEN_SLOPES[name][kind] for name in names if name in BETWEEN_SLOPES}
    return {name: Between(*(each / 100.0 for each in points)) for name, points in found.items()}
