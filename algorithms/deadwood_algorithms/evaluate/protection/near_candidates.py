"""Logs that a candidate could affect: those whose axis came so near that the engine would have listed the candidate.

A candidate that does not exist yet has affected no log; the poses of the logs show which places they came near.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.protection import changed_scenes
from deadwood_algorithms.evaluate.protection.obstacles import Obstacle
from deadwood_algorithms.evaluate.protection.rerun import Rerun
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.simulate.sliding import reporter, slide_once, until_none_escapes
from deadwood_algorithms.simulate.steps import Steps
from deadwood_engine import Fidelity, Result, place_logs
from deadwood_engine.fidelity import longest_travel, trace_step
from deadwood_engine.limits import NEAR_MARGIN
from deadwood_engine.log_body import BASE_RADIUS


def farthest_listed(fidelity: Fidelity, cell: float) -> float:
    """Distance [m] from the axis of a log's stored pose at which an object can be listed as near, minus the radii of
    both.

    Between two stored poses the ends move by less than ``trace_step`` plus a step, and the pose ahead is another step
    away.
    """
    return NEAR_MARGIN + trace_step(fidelity, cell) + 3.0 * longest_travel(fidelity, cell) + 0.01


def logs_near(
    rerun: Rerun,
    layers: SceneLayers,
    both: SceneLayers,
    candidates: Sequence[Obstacle],
    widest: float,
    steps: Steps,
    feedback: Feedback,
) -> tuple[list[NDArray[np.int64]], SceneLayers]:
    """The logs that each candidate could affect: those whose axis came so near that it would have been listed.

    both : the scene with the candidates; widest : [m] largest radius of a candidate
    """
    cell, n, chunk = layers.dem.cell, len(rerun.releases), changed_scenes.CHUNK
    if rerun.rule_of_steps(both) != rerun.rule_of_steps(layers):
        return [np.arange(n) for _ in candidates], layers
    shapes = np.array([each.shape for each in candidates], object)
    margin = widest + farthest_listed(rerun.simulation.fidelity, cell)

    def slide_some(first: int) -> dict[str, NDArray[np.int64]]:
        nonlocal layers
        some = rerun.releases.take(np.arange(first, min(first + chunk, n)))

        def slide_on(on: SceneLayers) -> tuple[Result, list[str]]:
            report = reporter(feedback, n, "finding the logs that come near a candidate", before=first)
            keep = np.ones(len(some), bool)
            return slide_once(on, some.logs, rerun.simulation, report, keep_poses=keep)

        result, layers = until_none_escapes(layers, rerun.simulation, slide_on, feedback)
        poses = result.poses
        axes: Any = shapely.linestrings(np.stack([poses.base[:, :2], poses.tip[:, :2]], axis=1))
        body = place_logs(layers.scene, some.logs, layers.shape, layers.threads).body
        reach = margin + float(body[:, BASE_RADIUS].max(initial=0.0))
        which, pose = shapely.STRtree(axes).query(shapes, predicate="dwithin", distance=reach)
        pairs = np.unique(np.column_stack([which, first + poses.log_row[pose]]), axis=0)
        return {"candidate": pairs[:, 0], "log": pairs[:, 1]}

    found = [steps.take(min(chunk, n - first), lambda first=first: slide_some(first)) for first in range(0, n, chunk)]
    candidate, log = (np.concatenate([each[name] for each in found]) for name in ("candidate", "log"))
    return [log[candidate == k] for k in range(len(candidates))], layers
