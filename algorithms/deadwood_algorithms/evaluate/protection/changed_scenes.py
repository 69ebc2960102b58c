"""The logs of a run, slid again in scenes without an obstacle or with an additional one.

They start from a stage stored shortly before they came near the obstacle (``deadwood_engine.stages``), if that is
allowed, and slide until they have reached every line.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.protection.baseline import Baseline, held_by, taken_by
from deadwood_algorithms.evaluate.protection.obstacles import Obstacle
from deadwood_algorithms.evaluate.protection.rerun import Rerun, is_bare, without
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import reached, starts_inside
from deadwood_algorithms.simulate.sliding import slide_once
from deadwood_algorithms.simulate.windows import wider_scene
from deadwood_algorithms.stats.endings import left_dem
from deadwood_engine import Result, Start, place_logs

AT_ONCE = 64  # logs of one obstacle that a thread slides at once: the many logs of a stand are shared among threads
CHUNK = 4096  # logs whose poses are held at once


@dataclass(frozen=True)
class Task:
    """Some logs of one obstacle, by their rows."""

    number: int
    obstacle: Obstacle
    rows: NDArray[np.int64]


@dataclass(frozen=True)
class Change:
    """The result of a task: for each line the logs that reach it only in the run or only in the changed scene, and
    those that left the terrain model without reaching it, in the run and in the changed scene."""

    lost: NDArray[np.int64]
    gained: NDArray[np.int64]
    unseen: NDArray[np.int64]
    unseen_now: NDArray[np.int64]
    held: int
    energy: int


CHANGED = tuple(each.name for each in fields(Change))


def tasks_of(obstacles: Sequence[Obstacle], rows: Iterable[NDArray[np.int64]]) -> list[Task]:
    return [
        Task(number, each, some[first : first + AT_ONCE])
        for number, (each, some) in enumerate(zip(obstacles, rows, strict=True))
        for first in range(0, some.size, AT_ONCE)
    ]


def groups_of(tasks: Sequence[Task]) -> list[range]:
    """The tasks, by their places, in groups of about ``CHUNK`` logs."""
    ends = np.cumsum([0, *(task.rows.size for task in tasks)])[1:]
    cuts = [0, *(np.flatnonzero(np.diff(ends // CHUNK)) + 1).tolist(), len(tasks)]
    return [range(first, last) for first, last in pairwise(cuts) if last > first]


class ChangedScenes:
    """Slides logs again in changed scenes, many at once on all threads, until all tasks are done."""

    def __init__(self, rerun: Rerun, layers: SceneLayers, baseline: Baseline, others: NDArray[np.int64] | None) -> None:
        """others : the numbers of all candidates, of which only the task's own stays in the scene."""
        self.rerun, self.baseline, self.others = rerun, baseline, others
        self.stop = threading.Event()
        self.on(layers)

    def on(self, layers: SceneLayers) -> None:
        self.layers = layers
        self.start = place_logs(layers.scene, self.rerun.releases.logs, layers.shape, layers.threads)

    def missing(self, task: Task) -> NDArray[np.int64]:
        own = task.obstacle.owners
        return own if self.others is None else np.setdiff1d(self.others, own)

    def placed(self, rows: NDArray[np.int64]) -> Start:
        return Start(self.start.frame[rows], self.start.state[rows], self.start.body[rows])

    def slide(self, task: Task) -> tuple[Change, list[str]]:
        scene = without(self.layers, self.missing(task))
        result, sides = slide_once(
            scene,
            self.placed(task.rows),
            self.rerun.simulation,
            lambda done: self.stop.is_set(),
            inside=self.aside(task.rows),
            **self.stages_of(scene, task),
            **self.shorter(),
        )
        return self.change_of(task, result), sides

    def change_of(self, task: Task, result: Result) -> Change:
        own = task.obstacle.owners
        releases = self.rerun.releases.take(task.rows)
        now = reached(self.layers.lines, {"reach": result.reach}, releases)
        before, left = self.baseline.reach[task.rows], left_dem(self.baseline.result.stop_reason)[task.rows]
        left_now = left_dem(result.stop_reason)
        energy, held = taken_by(result), held_by(self.layers, result)
        return Change(
            (before & ~now).sum(axis=0),
            (now & ~before).sum(axis=0),
            (left[:, None] & ~before).sum(axis=0),
            (left_now[:, None] & ~now).sum(axis=0),
            sum(held.get(each, 0) for each in own.tolist()),
            sum(energy.get(each, 0) for each in own.tolist()),
        )

    def shorter(self) -> dict[str, Any]:
        """The shortest part of a trajectory that determines which lines the log reaches; candidates also need what they
        hold and absorb.
        """
        return {"until_reached": True} if self.others is None else {}

    def aside(self, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
        """The lines that these logs need not reach: where they start, and those along the window's sides."""
        inside = starts_inside(self.layers.lines, self.rerun.releases.take(rows))
        return self.layers.by_scene_line(inside, sides=True)

    def stages_of(self, scene: SceneLayers, task: Task) -> dict[str, Any]:
        """The stages from which logs can continue, if the same rule of steps applies: stages belong to one window and
        one rule.
        """
        if self.others is not None or self.layers is not self.baseline.layers:
            return {}
        if is_bare(scene) or self.rerun.rule_of_steps(scene) != self.rerun.rule_of_steps(self.layers):
            return {}
        stages = self.baseline.stages
        return {"stages": stages, "going_on": stages.before(task.rows, task.obstacle.owners)}

    def packed(self, changes: Sequence[Change]) -> dict[str, NDArray[Any]]:
        """The stored results of a group; the first axis is the task."""
        return {name: np.array([getattr(each, name) for each in changes]) for name in CHANGED}

    def unpacked(self, found: Mapping[str, NDArray[Any]], tasks: Sequence[Task]) -> list[Change]:
        return [
            Change(lost, gained, unseen, unseen_now, int(held), int(energy))
            for lost, gained, unseen, unseen_now, held, energy in zip(*(found[name] for name in CHANGED), strict=True)
        ]

    def widen(self, sides: Iterable[str], feedback: Feedback) -> None:
        self.on(self.widened(sorted(set(sides)), feedback))

    def widened(self, sides: list[str], feedback: Feedback) -> SceneLayers:
        return wider_scene(self.rerun.simulation, self.layers, sides, feedback)


class WithCandidates(ChangedScenes):
    """The same for candidates: the scene contains all of them, wherever its window ends."""

    def __init__(self, rerun: Rerun, layers: SceneLayers, baseline: Baseline, candidates) -> None:
        self.candidates, self.plain = candidates, layers
        both, found = candidates(layers)
        self.found = found
        owners = np.concatenate([each.owners for each in found]) if found else np.zeros(0, np.int64)
        super().__init__(rerun, both, baseline, owners)

    def widened(self, sides: list[str], feedback: Feedback) -> SceneLayers:
        self.plain = wider_scene(self.rerun.simulation, self.plain, sides, feedback)
        return self.candidates(self.plain)[0]
