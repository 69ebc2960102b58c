"""The logs of a run, ready to slide: the scene, the laws, what is stored, and where unfinished work is kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import Releases
from deadwood_algorithms.simulate.checkpoints import WorkFolder
from deadwood_algorithms.simulate.chunks import ChunkedRun, DrawnScene, Keeper, identity_of, queue_of
from deadwood_algorithms.simulate.queue import Queue
from deadwood_algorithms.simulate.simulation import Simulation
from deadwood_engine import Fidelity


@dataclass(frozen=True)
class LogRun:
    """The logs of a run and how they are slid.

    keep : bool (n,), by row of the releases, logs whose poses are stored; keeper : selects what is stored of a chunk
    output : the place of the result, beside which unfinished work is kept; resume : whether to continue it
    identity : what determines the results besides scene, logs and laws
    """

    simulation: Simulation
    layers: SceneLayers
    releases: Releases
    keep: NDArray[np.bool_]
    keeper: Keeper
    output: str
    seed: int
    resume: bool
    identity: Mapping[str, Any]
    feedback: Feedback

    def at(self, fidelity: Fidelity) -> LogRun:
        return replace(self, simulation=replace(self.simulation, fidelity=fidelity))

    def work_folder(self, output: str, **more: Any) -> WorkFolder:
        """Where unfinished work of this run lies; ``more`` : further values that determine its results."""
        known = identity_of(self.simulation, self.layers, self.releases, **self.identity) | more
        return WorkFolder(output, known, resume=self.resume, feedback=self.feedback)

    def chunked(self, queue: Queue, work: WorkFolder) -> ChunkedRun:
        """The run in the order of a queue."""
        slope = DrawnScene.on(self.layers, self.simulation, work, self.feedback)
        return ChunkedRun(self.simulation, self.releases, self.keep, self.keeper, slope, queue, work, self.feedback)


def slide_logs(run: LogRun, until_ci: float | None) -> ChunkedRun:
    """Slide all logs, or in a random order until the intervals of all lines' reach have at most this half-width."""
    queue = queue_of(run.releases, target=until_ci, line_ids=run.layers.lines.ids, seed=run.seed)
    done = run.chunked(queue, run.work_folder(run.output, **{"--until-ci": until_ci}))
    done.slide()
    return done
