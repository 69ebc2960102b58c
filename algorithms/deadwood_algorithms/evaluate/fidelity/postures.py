"""What the posture of the logs at the start decides: the same logs at the cheapest fidelity, upright and lying.

Posture is an input that is often assumed rather than mapped, and it can move reach as much as friction does. So its
effect stands beside the error of each fidelity, which is the smaller of the two on most slopes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from deadwood_algorithms.ensemble.variants import Variant
from deadwood_algorithms.evaluate.fidelity.measures import half_width, paired_reach
from deadwood_algorithms.evaluate.fidelity.records import FidelityRun
from deadwood_algorithms.prepare.releases.logs import RANDOM_LYING, in_posture
from deadwood_algorithms.schemas import ORIENTATIONS
from deadwood_algorithms.simulate.simulation import Simulation
from deadwood_algorithms.stats.statistics import points_with_interval
from deadwood_engine import FIDELITIES, Logs

# The value of --orientation, and the posture that it gives the engine's logs
POSTURES = {"upright": "upright", RANDOM_LYING: "lying"}


@dataclass(frozen=True)
class PostureRow:
    """One quantity with all logs in one posture, and with the logs as they were released, at the same fidelity.

    difference : the former minus the latter, with its 95 % interval over the same logs
    """

    orientation: str
    fidelity: str
    quantity: str
    item: str
    unit: str
    value: float
    as_released: float
    difference: float
    ci_low: float
    ci_high: float


def other_postures(logs: Logs) -> list[str]:
    """The postures in which not all logs are already."""
    return [name for name, posture in POSTURES.items() if not (logs.orientation == ORIENTATIONS.index(posture)).all()]


def posture_variants(names: Sequence[str], fidelity: str, simulation: Simulation, seed: int) -> list[Variant]:
    own = replace(simulation, fidelity=FIDELITIES[fidelity])
    return [Variant(f"sliding {name} at {fidelity}", own, logs=partial(in_posture, name, seed=seed)) for name in names]


def posture_rows(name: str, one: FidelityRun, released: FidelityRun, line_ids: Sequence[Any]) -> Iterator[PostureRow]:
    """The reach of every line, and the mean run-out."""
    for column, line_id in enumerate(line_ids):
        p, as_released, low, high = paired_reach(one.reach[:, column], released.reach[:, column])
        yield PostureRow(name, released.name, "reach", str(line_id), "1", p, as_released, p - as_released, low, high)
    half = half_width(one.runout - released.runout)
    ours, theirs = float(np.mean(one.runout)), float(np.mean(released.runout))
    ends = ours - theirs - half, ours - theirs + half
    yield PostureRow(name, released.name, "runout_mean", "", "m", ours, theirs, ours - theirs, *ends)


def posture_lines(rows: Sequence[PostureRow]) -> list[str]:
    """A sentence for each posture: about the line with the largest change, or the run-out if there is no line."""
    lines = []
    for name in dict.fromkeys(row.orientation for row in rows):
        of = [row for row in rows if row.orientation == name]
        reach = [row for row in of if row.quantity == "reach"]
        row = max(reach, key=lambda each: abs(each.difference)) if reach else of[-1]
        if reach:
            moved = f"reach of line {row.item} {points_with_interval(row.difference, row.ci_low, row.ci_high)} points"
        else:
            moved = f"mean run-out {row.difference:+.3g} m ({row.ci_low:+.3g} to {row.ci_high:+.3g})"
        lines.append(f"all logs {name} instead of as released: {moved}, at {row.fidelity}")
    return lines
