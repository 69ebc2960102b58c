"""A run of slide-logs, slid again: its scene and logs, and what two scenes must share for a log to move in the same
way.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.params.where import Where
from deadwood_algorithms.results.replay import fidelity_of, logs_of, question_of
from deadwood_algorithms.results.run_folder import GEOPACKAGE, Run, layers_in
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import Releases
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.simulate.piece import scene_without
from deadwood_algorithms.simulate.simulation import Simulation, open_simulation
from deadwood_algorithms.simulate.windows import read_released_scene
from deadwood_engine import Fidelity, fidelity_in
from deadwood_engine.fidelity import longest_travel
from deadwood_engine.limits import NEAR_MARGIN


@dataclass(frozen=True)
class Rerun:
    """The scene and logs of the run, and how they are slid."""

    simulation: Simulation
    releases: Releases

    def longest_step(self, cell: float) -> float:
        """The longest path [m] of a log in one step."""
        return longest_travel(self.simulation.fidelity, cell)

    def rule_of_steps(self, layers: SceneLayers) -> tuple[Fidelity, bool]:
        """What determines the length of every step in a scene, wherever the log is: whether anything rebounds, and, if
        a step may be longer than the remaining margin of the list, whether there is any obstacle at all.

        In two scenes with the same rule, a log that comes near no object that only one of them contains moves in the
        same way, bit for bit; with different rules it may not.
        """
        laws = self.simulation.laws
        trees, barriers = laws["tree_restitution"], laws["barrier_restitution"]
        row = fidelity_in(layers.scene, self.simulation.fidelity, laws["restitution"], trees, barriers)
        return row, self.longest_step(layers.dem.cell) > 0.5 * NEAR_MARGIN and is_bare(layers)


@contextmanager
def open_rerun(
    source: Run, lines: str | None, logs: int | None, seed: int, where: Where, feedback: Feedback
) -> Iterator[tuple[Rerun, SceneLayers, NDArray[np.int64]]]:
    """Open a run as it was asked for (with other lines if they are given), with a random subset of its logs or with
    all. The run's own lines are those stored with it, as for all tools that read a run.

    Also returns the scene as it was read, and the logs' rows in the run's deposits.
    """
    own = f"{source.path / GEOPACKAGE}|layername=reach" if "reach" in layers_in(source.path) else None
    scene = question_of(source, lines=lines or own)
    if not scene.lines:
        raise UserError(f"{source.path}: the run has no roads, railways or houses; name them with --lines LAYER")
    with open_simulation(scene.inputs(), fidelity_of(source), where, feedback) as simulation:
        layers, releases = read_released_scene(simulation, feedback)
        rows = np.sort(hash_order(source.deposits["log_id"].to_numpy(np.int64), seed)[:logs])
        yield Rerun(simulation, logs_of(source, releases, rows)), layers, rows


def is_bare(layers: SceneLayers) -> bool:
    return not len(layers.scene.arrays.cores.solid)


def without(layers: SceneLayers, missing: NDArray[np.int64]) -> SceneLayers:
    """The scene without these obstacles, slid by one thread."""
    return replace(layers, scene=scene_without(layers.scene, missing), threads=1)
