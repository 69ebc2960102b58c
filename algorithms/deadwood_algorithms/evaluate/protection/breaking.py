"""Trees that break: each log is slid again without the trees that it would have broken, one after the other.

A log whose hit exceeds the capacity of the tree is slid again without that tree, from a checkpoint stored shortly
before the tree mattered (`changed_scenes`), then without the next tree that it would break, until it breaks none or has
reached every line. The tree then absorbs nothing, whereas a real one absorbs its capacity. This result and that with
rigid trees, which absorb everything, are the bounds for trees that break.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import geopandas
import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.protection.baseline import Baseline
from deadwood_algorithms.evaluate.protection.changed_scenes import AT_ONCE, ChangedScenes, Task
from deadwood_algorithms.evaluate.protection.obstacles import TREE, Obstacle
from deadwood_algorithms.evaluate.protection.rerun import Rerun
from deadwood_algorithms.evaluate.protection.scenes_at_once import changes_in_order
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.results.capacity import Capacity
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import reached, starts_inside
from deadwood_algorithms.simulate.steps import Steps
from deadwood_algorithms.stats.endings import left_dem
from deadwood_algorithms.stats.statistics import (
    IN_BRACKETS,
    paired_interval,
    points_if_lost_words,
    share_if_lost_words,
)
from deadwood_engine import Result

UNBROKEN = -1
OF_WAY = ("reach", "tree", "left")


@dataclass(frozen=True)
class Way:
    """Outcomes of logs in a changed scene.

    reach : (n, lines); tree : the next that each would break, or UNBROKEN; left : whether it left the terrain model
    """

    reach: NDArray[np.bool_]
    tree: NDArray[np.int64]
    left: NDArray[np.bool_]


@dataclass(frozen=True)
class Broken:
    """The run with trees that break.

    reach : (n, lines); trees : for each log those that it broke, in order; left : (n,), as in `Way`
    """

    reach: NDArray[np.bool_]
    trees: list[list[int]]
    left: NDArray[np.bool_]


def first_broken(
    result: Result, layers: SceneLayers, capacity: Capacity, done: NDArray[np.float64]
) -> NDArray[np.int64]:
    """The first standing tree that each log would break before it is ``done`` [s]; UNBROKEN where it breaks none."""
    hits = result.hits
    standing = ~hits.by_barrier & (hits.item < len(layers.tree_ids))
    row, tree, time = hits.log_row[standing], hits.item[standing], hits.time[standing]
    above = hits.energy_taken[standing] > capacity.of_trees(100.0 * layers.trees.diameter)[tree]
    above &= time <= done[row]
    order = np.flatnonzero(above)[np.argsort(time[above], kind="stable")][::-1]
    found = np.full(done.size, UNBROKEN)
    found[row[order]] = tree[order]  # the earliest one is written last and remains
    return found


class AgainBroken(ChangedScenes):
    """Slides logs again without the trees that they broke so far."""

    def __init__(self, rerun: Rerun, layers: SceneLayers, baseline: Baseline, capacity: Capacity) -> None:
        super().__init__(rerun, layers, baseline, None)
        self.capacity = capacity

    def change_of(self, task: Task, result: Result) -> Any:
        releases = self.rerun.releases.take(task.rows)
        now = reached(self.layers.lines, {"reach": result.reach}, releases)
        times = self.layers.lines.first_time(result.reach_time)
        times[starts_inside(self.layers.lines, releases)] = -np.inf
        done = np.where(now, times, np.inf).max(axis=1)
        return Way(now, first_broken(result, self.layers, self.capacity, done), left_dem(result.stop_reason))

    def packed(self, changes: Sequence[Any]) -> dict[str, NDArray[Any]]:
        return {name: np.concatenate([getattr(each, name) for each in changes]) for name in OF_WAY}

    def unpacked(self, found: Mapping[str, NDArray[Any]], tasks: Sequence[Task]) -> list[Any]:
        ends = np.cumsum([task.rows.size for task in tasks])[:-1]
        return [Way(*each) for each in zip(*(np.split(found[name], ends) for name in OF_WAY), strict=True)]


def break_trees(
    rerun: Rerun, layers: SceneLayers, baseline: Baseline, capacity: Capacity, steps: Steps, feedback: Feedback
) -> Broken:
    """Slide every log again without the trees that it breaks, until it breaks no more."""
    reach, left = baseline.reach.copy(), left_dem(baseline.result.stop_reason)
    trees: list[list[int]] = [[] for _ in range(len(rerun.releases))]
    again = AgainBroken(rerun, baseline.layers, baseline, capacity)
    following = first_broken(baseline.result, baseline.layers, capacity, baseline.done)
    number = 0
    while (following != UNBROKEN).any():
        number += 1
        rows = np.flatnonzero(following != UNBROKEN)
        for row in rows.tolist():
            trees[row].append(int(following[row]))
        tasks = tasks_without([(row, trees[row]) for row in rows.tolist()])
        following = np.full(following.size, UNBROKEN)
        what = f"sliding {counted(rows.size, 'log')} without tree number {number} that each breaks"
        for task, way in changes_in_order(again, tasks, steps, feedback, what):
            reach[task.rows], following[task.rows], left[task.rows] = way.reach, way.tree, way.left
    return Broken(reach, trees, left)


def tasks_without(logs: Sequence[tuple[int, Sequence[int]]]) -> list[Task]:
    """Logs that lack the same trees, together; ``logs`` are rows with the trees that they broke."""
    groups: dict[tuple[int, ...], list[int]] = {}
    for row, gone in logs:
        groups.setdefault(tuple(sorted(gone)), []).append(row)
    tasks = []
    for gone, rows in groups.items():
        lacking = Obstacle(TREE, "", 0.0, 0.0, np.array(gone, np.int64), None)
        tasks += [
            Task(0, lacking, np.array(rows[first : first + AT_ONCE], np.int64))
            for first in range(0, len(rows), AT_ONCE)
        ]
    return tasks


def frames_of(
    broken: Broken, baseline: Baseline, layers: SceneLayers, capacity: Capacity
) -> dict[str, geopandas.GeoDataFrame]:
    """One row for each line: reach with rigid trees and with trees that break; and one for each tree that any log
    breaks.
    """
    total = len(broken.trees)
    again = np.array([bool(each) for each in broken.trees])  # all others go the same way in both, whatever comes beyond
    left = left_dem(baseline.result.stop_reason)
    rows = []
    for line, line_id in enumerate(layers.lines.ids):
        before, now = baseline.reach[:, line], broken.reach[:, line]
        lost, gained = int((before & ~now).sum()), int((now & ~before).sum())
        low, high = paired_interval(lost, gained, total)
        gain = {"gain_logs": gained - lost, "gain_p": (gained - lost) / total, "ci_low": low, "ci_high": high}
        counts = {"n_total": total, "n_reach": int(before.sum()), "n_reach_breaking": int(now.sum())}
        unseen, unseen_now = left & ~before, broken.left & ~now
        counts |= {"n_lost": int(unseen.sum()), "n_lost_breaking": int(unseen_now.sum())}
        unseen, unseen_now = unseen & again, unseen_now & again
        least = lost + int((unseen & ~now).sum()), gained - int((unseen & now).sum())  # the unseen reach it in the run
        most = lost - int((unseen_now & before).sum()), gained + int((unseen_now & ~before).sum())
        for end, (away, more), side in (("low", least, 0), ("high", most, 1)):
            gain[f"gain_p_{end}_if_lost"] = (more - away) / total
            gain[f"ci_{end}_if_lost"] = paired_interval(away, more, total)[side]
        rows.append({"line_id": line_id} | counts | gain)
    crs = layers.dem.plan_crs
    frames = {"reach_breaking": geopandas.GeoDataFrame(rows, geometry=list(layers.lines.geometry), crs=crs)}
    numbers, counts = np.unique([tree for each in broken.trees for tree in each], return_counts=True)
    if numbers.size:
        tree = numbers.astype(np.int64)
        dbh = 100.0 * layers.trees.diameter[tree]
        columns = {
            "tree_id": np.array(layers.tree_ids, object)[tree],
            "dbh_cm": dbh,
            "height_m": layers.trees.height[tree],
            "capacity_kj": capacity.of_trees(dbh) / 1000.0,
            "n_broken": counts,
        }
        points = shapely.points(layers.trees.x[tree], layers.trees.y[tree])
        frames["broken"] = geopandas.GeoDataFrame(columns, geometry=points, crs=crs)
    return frames


def lines_of(frames: Mapping[str, Any], broken: Broken, capacity: Capacity) -> tuple[str, ...]:
    """How many trees break, and of each line the two ends; in brackets with the logs that left before it."""
    logs = sum(bool(each) for each in broken.trees)
    trees = len(frames["broken"]) if "broken" in frames else 0
    shown = [
        f"{logs} of {len(broken.trees)} logs would break a tree, {counted(trees, 'tree')} in all, if one of 40 cm DBH "
        f"absorbs {capacity.tree_capacity_kj:g} kJ and others (DBH / 40 cm)^{capacity.tree_capacity_power:g} times that"
    ]
    for row in frames["reach_breaking"].to_dict("records"):
        rigid, breaking = (
            share_if_lost_words(row[f"n_reach{of}"], row["n_total"], row[f"n_lost{of}"]) for of in ("", "_breaking")
        )
        points = points_if_lost_words(
            row["gain_p"],
            (row["ci_low"], row["ci_high"]),
            (row["gain_p_low_if_lost"], row["gain_p_high_if_lost"]),
            (row["ci_low_if_lost"], row["ci_high_if_lost"]),
        )
        shown.append(
            f"{row['line_id']}: {rigid} with unbreakable trees, {breaking} if those that would break absorb no energy; "
            f"{points} points"
        )
    if any("[" in each for each in shown[1:]):
        shown.append(IN_BRACKETS)
    return tuple(shown)
