"""The run as it was, log by log: which obstacle affected which log, from when on, and what each held and absorbed.

The engine records which obstacles affected a log, and from when on (``deadwood_engine.influence``). Without one of them
all other logs move in the same way, bit for bit; a log that reached every line before the obstacle affected it reaches
them without it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.protection.obstacles import Obstacle
from deadwood_algorithms.evaluate.protection.rerun import Rerun, without
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import Releases, reached, starts_inside
from deadwood_algorithms.simulate.sliding import reporter, slide_once, until_none_escapes
from deadwood_engine import STOP_REASONS, Result, Stages
from deadwood_engine.stages import number_of as owner_numbers

HOLDERS = {STOP_REASONS.index(name): name for name in ("tree", "barrier", "lying_log")}


@dataclass(frozen=True)
class Baseline:
    """The run as it was, log by log.

    reach : (n, lines); done : [s] (n,), when the log had reached every line, infinite if it never did
    owner, log, since : each obstacle and a log that it affected, sorted by owner; since [s] : from when on
    energy : absorbed by each owner [mJ, whole numbers, so that the order of adding has no effect]; held : logs, by
    owner
    layers, stages : the scene in which it slid, and stages of the logs' paths in it
    """

    reach: NDArray[np.bool_]
    done: NDArray[np.float64]
    owner: NDArray[np.int64]
    log: NDArray[np.int64]
    since: NDArray[np.float64]
    energy: dict[int, int]
    held: dict[int, int]
    result: Result
    layers: SceneLayers
    stages: Stages

    @staticmethod
    def of(layers: SceneLayers, releases: Releases, result: Result, stages: Stages) -> Baseline:
        touched = reached(layers.lines, {"reach": result.reach}, releases)
        times = layers.lines.first_time(result.reach_time)
        times[starts_inside(layers.lines, releases)] = -np.inf
        influences = result.influences
        owner = owner_numbers(influences.by_barrier, influences.item)
        order = np.argsort(owner, kind="stable")
        energy, held = taken_by(result), held_by(layers, result)
        done = np.where(touched, times, np.inf).max(axis=1)
        owner, log, since = owner[order], influences.log_row[order], influences.time[order]
        return Baseline(touched, done, owner, log, since, energy, held, result, layers, stages)

    def logs_to_slide(self, obstacle: Obstacle) -> NDArray[np.int64]:
        """The logs that could reach other lines without the obstacle."""
        first, last = (np.searchsorted(self.owner, obstacle.owners, side=side) for side in ("left", "right"))
        nobody = np.zeros(0, np.int64)  # a stand without trees
        rows = np.concatenate([nobody, *(np.arange(a, b) for a, b in zip(first, last, strict=True))])
        log, since = self.log[rows], self.since[rows]
        return np.unique(log[self.done[log] >= since])


def slide_baseline(rerun: Rerun, layers: SceneLayers, feedback: Feedback) -> tuple[Baseline, SceneLayers]:
    """Slide the run again and record what affected each log; also returns the scene on a window that contains it."""
    n, stages = len(rerun.releases), Stages()

    def slide_all(on: SceneLayers) -> tuple[Result, list[str]]:
        return slide_once(
            on,
            rerun.releases.logs,
            rerun.simulation,
            reporter(feedback, n, "sliding the run again"),
            influences=True,
            stages=stages,
        )

    result, layers = until_none_escapes(layers, rerun.simulation, slide_all, feedback)
    feedback.progress(n, n, "sliding the run again")
    return Baseline.of(layers, rerun.releases, result, stages), layers


def logs_to_slide(rerun: Rerun, layers: SceneLayers, baseline: Baseline, obstacle: Obstacle) -> NDArray[np.int64]:
    """Rows of the logs that could reach other lines without an obstacle: all, if it is the last one on which the rule
    of steps depends.
    """
    if rerun.rule_of_steps(without(layers, obstacle.owners)) != rerun.rule_of_steps(layers):
        return np.arange(len(rerun.releases))
    return baseline.logs_to_slide(obstacle)


def taken_by(result: Result) -> dict[int, int]:
    """Energy [mJ, whole numbers] that each obstacle absorbed from the logs that hit it, by its number."""
    numbers, place = np.unique(owner_numbers(result.hits.by_barrier, result.hits.item), return_inverse=True)
    sums = np.zeros(numbers.size, np.int64)
    np.add.at(sums, place, np.rint(1e3 * result.hits.energy_taken).astype(np.int64))
    return dict(zip(numbers.tolist(), sums.tolist(), strict=True))


def held_by(layers: SceneLayers, result: Result) -> dict[int, int]:
    """How many logs each obstacle holds at the end, by its number."""
    counts: dict[int, int] = {}
    for reason, item in zip(result.stop_reason.tolist(), result.stop_item.tolist(), strict=True):
        if reason in HOLDERS and item >= 0:
            number = {"tree": item, "barrier": -1 - item, "lying_log": layers.scene.tree_count + item}[HOLDERS[reason]]
            counts[number] = counts.get(number, 0) + 1
    return counts
