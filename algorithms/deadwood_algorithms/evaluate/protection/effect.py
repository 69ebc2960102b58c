"""The effect of an obstacle on reach: logs that reach a line with it and without, counted, with intervals and ranks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.protection.baseline import Baseline
from deadwood_algorithms.evaluate.protection.changed_scenes import Change, Task
from deadwood_algorithms.evaluate.protection.obstacles import Obstacle
from deadwood_algorithms.evaluate.protection.rerun import Rerun
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.stats.statistics import paired_interval


@dataclass(frozen=True)
class Effect:
    """One obstacle and line: logs that reach it in the run, and without the obstacle, or with the candidate.

    lost, gained : logs that reach it only in the run, and only in the changed scene
    unseen, unseen_now : of the logs that were slid again, those that left the terrain model without reaching it, in the
        run and in the changed scene; all other logs move in the same way in both, also beyond the terrain model
    """

    obstacle: Obstacle
    line_id: str
    n_total: int
    n_reach: int
    lost: int
    gained: int
    unseen: int
    unseen_now: int
    stopped: int
    energy_taken_kj: float

    @property
    def n_changed(self) -> int:
        return self.n_reach - self.lost + self.gained

    def gain(self) -> tuple[float, float, float]:
        """Share of the logs that reaches the line only because the obstacle is gone, and its 95 % interval."""
        low, high = paired_interval(self.lost, self.gained, self.n_total)
        return (self.gained - self.lost) / self.n_total, low, high

    def gain_if_lost(self) -> tuple[float, float]:
        """The smallest and the largest such share, whatever the logs that left the terrain model did afterwards."""
        gain = self.gained - self.lost
        return (gain - self.unseen) / self.n_total, (gain + self.unseen_now) / self.n_total


def effects_of(
    rerun: Rerun,
    layers: SceneLayers,
    baseline: Baseline,
    obstacles: Sequence[Obstacle],
    changes: Iterable[tuple[Task, Change]],
    *,
    planted: bool = False,
) -> list[Effect]:
    """One row for each obstacle and line, in their order; for candidates the logs held and the energy absorbed are
    those of the changes.
    """
    lost, gained, unseen, unseen_now = np.zeros((4, len(obstacles), len(layers.lines.ids)), np.int64)
    held, energy = np.zeros((2, len(obstacles)), np.int64)
    for k, one in enumerate(() if planted else obstacles):
        held[k] = sum(baseline.held.get(each, 0) for each in one.owners.tolist())
        energy[k] = sum(baseline.energy.get(each, 0) for each in one.owners.tolist())
    for task, change in changes:
        lost[task.number] += change.lost
        gained[task.number] += change.gained
        unseen[task.number] += change.unseen
        unseen_now[task.number] += change.unseen_now
        if planted:
            held[task.number] += change.held
            energy[task.number] += change.energy
    total, now = len(rerun.releases), baseline.reach.sum(axis=0)
    return [
        Effect(
            one,
            str(line_id),
            total,
            int(now[line]),
            int(lost[k, line]),
            int(gained[k, line]),
            int(unseen[k, line]),
            int(unseen_now[k, line]),
            int(held[k]),
            float(energy[k]) / 1e6,
        )
        for k, one in enumerate(obstacles)
        for line, line_id in enumerate(layers.lines.ids)
    ]


def ranks(gains: Sequence[float], effects: Sequence[Effect]) -> NDArray[np.int64]:
    """Place of each row among those of its kind and line, 1 the largest gain; among equal ones the one that holds,
    then the one that absorbs, more."""
    out = np.zeros(len(effects), np.int64)
    groups: dict[tuple[str, str], list[int]] = {}
    for k, each in enumerate(effects):
        groups.setdefault((each.obstacle.kind, each.line_id), []).append(k)
    for rows in groups.values():
        rows.sort(key=lambda k: (-gains[k], -effects[k].stopped, -effects[k].energy_taken_kj, k))
        out[rows] = np.arange(1, len(rows) + 1)
    return out
