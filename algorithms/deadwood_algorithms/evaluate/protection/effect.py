"""What an obstacle is worth: the logs that reach a line with it and without, each slid again where it could differ.

The engine notes which obstacles mattered to a log, and from when (``deadwood_engine.influence``). Without one of them
all other logs go the same way, bit for bit; and a log that had reached every line before the obstacle mattered reaches
them without it. So for each obstacle the few logs that are left are slid again, in the scene without it, from a stage
kept shortly before they came near it (``deadwood_engine.stages``), and until they have reached every line. A candidate
that is not there yet has mattered to nobody: it may matter to logs whose axis came so near that it would have been
listed, which their poses tell.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Self

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.protection.obstacles import Obstacle
from deadwood_algorithms.params.tool import Cancelled, Feedback, UserError
from deadwood_algorithms.params.where import Where
from deadwood_algorithms.results.lost import left_dem
from deadwood_algorithms.results.replay import fidelity_of, logs_of, question_of
from deadwood_algorithms.results.run_folder import Run
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import Releases, reached, starts_inside
from deadwood_algorithms.simulate.batch import Batch
from deadwood_algorithms.simulate.joined import rows_of_result
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.simulate.piece import scene_without
from deadwood_algorithms.simulate.simulation import Simulation, open_simulation
from deadwood_algorithms.simulate.sliding import reporter, slide_batch, slide_once, until_none_escapes
from deadwood_algorithms.simulate.steps import Steps
from deadwood_algorithms.simulate.windows import read_released_scene, wider_scene
from deadwood_algorithms.stats.statistics import paired_interval
from deadwood_engine import STOP_REASONS, Fidelity, Result, Stages, Start, fidelity_in, place_logs
from deadwood_engine.fidelity import longest_travel, trace_step
from deadwood_engine.limits import NEAR_MARGIN
from deadwood_engine.log_body import BASE_RADIUS
from deadwood_engine.stages import number_of as owner_numbers

AT_ONCE = 64  # logs of one obstacle that a thread slides in one go: a stand's many are shared among threads
CHUNK = 4096  # logs whose poses are held at once
HOLDERS = {STOP_REASONS.index(name): name for name in ("tree", "barrier", "lying_log")}


@dataclass(frozen=True)
class Question:
    """What is slid, and how."""

    simulation: Simulation
    releases: Releases

    def longest_step(self, cell: float) -> float:
        """The most way [m] of a log in a step."""
        return longest_travel(self.simulation.fidelity, cell)

    def rule_of_steps(self, layers: SceneLayers) -> tuple[Fidelity, bool]:
        """What decides in a scene how long every step is, wherever the log is: whether anything rebounds there, and,
        where a step may be longer than what is left of the list's margin, whether there is any obstacle at all.

        In two scenes of one rule a log that comes near nothing that only one of them holds goes the same way, bit for
        bit; in two of different rules no log need do so.
        """
        laws = self.simulation.laws
        stems, fences = laws["tree_restitution"], laws["barrier_restitution"]
        row = fidelity_in(layers.scene, self.simulation.fidelity, laws["restitution"], stems, fences)
        return row, self.longest_step(layers.dem.cell) > 0.5 * NEAR_MARGIN and is_bare(layers)


@contextmanager
def asked_again(
    source: Run, lines: str | None, logs: int | None, seed: int, where: Where, feedback: Feedback
) -> Iterator[tuple[Question, SceneLayers, NDArray[np.int64]]]:
    """What a run asked, of other lines if they are given, with an even draw of so many of its logs if not with all.

    Also gives the scene as it was read, and the logs' rows in the run's deposits.
    """
    scene = question_of(source, **({"lines": lines} if lines else {}))
    if not scene.lines:
        raise UserError(f"{source.path}: the run watched no lines; --lines names some")
    with open_simulation(scene.inputs(), fidelity_of(source), where, feedback) as simulation:
        layers, releases = read_released_scene(simulation, feedback)
        rows = np.sort(hash_order(source.deposits["log_id"].to_numpy(np.int64), seed)[:logs])
        yield Question(simulation, logs_of(source, releases, rows)), layers, rows


@dataclass(frozen=True)
class Known:
    """The run as it was, log by log.

    reach : (n, lines); done : [s] (n,) when the log had reached every line, infinite where it has not
    owner, log, since : of each obstacle and log to which it mattered, sorted by owner; since [s] from when
    energy : [mJ, whole, so that no order of adding matters] taken, by owner; held : logs, by owner
    layers, stages : the scene in which it slid, and stages of the logs' ways there
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
    def of(layers: SceneLayers, releases: Releases, result: Result, stages: Stages) -> Known:
        touched = reached(layers.lines, {"reach": result.reach}, releases)
        times = layers.lines.first_time(result.reach_time)
        times[starts_inside(layers.lines, releases)] = -np.inf
        told = result.influences
        owner = owner_numbers(told.by_barrier, told.item)
        order = np.argsort(owner, kind="stable")
        energy, held = taken_by(result), held_by(layers, result)
        done = np.where(touched, times, np.inf).max(axis=1)
        owner, log, since = owner[order], told.log_row[order], told.time[order]
        return Known(touched, done, owner, log, since, energy, held, result, layers, stages)

    def logs_to_slide(self, obstacle: Obstacle) -> NDArray[np.int64]:
        """The logs that could reach other lines without the obstacle."""
        first, last = (np.searchsorted(self.owner, obstacle.owners, side=side) for side in ("left", "right"))
        rows = np.concatenate([np.arange(a, b) for a, b in zip(first, last, strict=True)])
        log, since = self.log[rows], self.since[rows]
        return np.unique(log[self.done[log] >= since])


def logs_to_slide(question: Question, layers: SceneLayers, known: Known, obstacle: Obstacle) -> NDArray[np.int64]:
    """Rows of the logs that could reach other lines without an obstacle: all, if it is the last of what rules steps."""
    if question.rule_of_steps(without(layers, obstacle.owners)) != question.rule_of_steps(layers):
        return np.arange(len(question.releases))
    return known.logs_to_slide(obstacle)


def is_bare(layers: SceneLayers) -> bool:
    return not len(layers.scene.arrays.cores.solid)


def taken_by(result: Result) -> dict[int, int]:
    """Energy [mJ, whole] that each obstacle took from the logs that hit it, by its number."""
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


@dataclass(frozen=True)
class Effect:
    """One obstacle and line: logs that reach it in the run, and without the obstacle, or with the candidate.

    lost, gained : logs that reach it only in the run, and only in the changed scene
    unseen, unseen_now : of the logs that were slid again, those that left the terrain model without reaching it, in the
        run and in the changed scene; all others go the same way in both, whatever they do beyond
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
        """The least and the largest such share, whatever the logs that left the terrain model did beyond."""
        gain = self.gained - self.lost
        return (gain - self.unseen) / self.n_total, (gain + self.unseen_now) / self.n_total


def slide_known(question: Question, layers: SceneLayers, feedback: Feedback) -> tuple[Known, SceneLayers]:
    """The run once more, with notes of what mattered; and the scene on a window that holds it."""
    n, stages = len(question.releases), Stages()

    def slide_all(on: SceneLayers) -> tuple[Result, list[str]]:
        return slide_once(
            on,
            question.releases.logs,
            question.simulation,
            reporter(feedback, n, "sliding the run again"),
            influences=True,
            stages=stages,
        )

    result, layers = until_none_escapes(layers, question.simulation, slide_all, feedback)
    feedback.progress(n, n, "sliding the run again")
    return Known.of(layers, question.releases, result, stages), layers


@dataclass(frozen=True)
class Task:
    """Some logs of one obstacle, by their rows."""

    number: int
    obstacle: Obstacle
    rows: NDArray[np.int64]


@dataclass(frozen=True)
class Change:
    """What came of a task: by line, logs that reach it only in the run, and only in the changed scene; and those that
    left the terrain model without reaching it, in the run and in the changed scene."""

    lost: NDArray[np.int64]
    gained: NDArray[np.int64]
    unseen: NDArray[np.int64]
    unseen_now: NDArray[np.int64]
    held: int
    energy: int


CHANGED = ("lost", "gained", "unseen", "unseen_now", "held", "energy")


def tasks_of(obstacles: Sequence[Obstacle], rows: Iterable[NDArray[np.int64]]) -> list[Task]:
    return [
        Task(number, each, some[first : first + AT_ONCE])
        for number, (each, some) in enumerate(zip(obstacles, rows, strict=True))
        for first in range(0, some.size, AT_ONCE)
    ]


def without(layers: SceneLayers, missing: NDArray[np.int64]) -> SceneLayers:
    """The scene without these obstacles, slid by one thread."""
    return replace(layers, scene=scene_without(layers.scene, missing), threads=1)


def groups_of(tasks: Sequence[Task]) -> list[range]:
    """The tasks, by their places, in groups of about ``CHUNK`` logs."""
    ends = np.cumsum([0, *(task.rows.size for task in tasks)])[1:]
    cuts = [0, *(np.flatnonzero(np.diff(ends // CHUNK)) + 1).tolist(), len(tasks)]
    return [range(first, last) for first, last in pairwise(cuts) if last > first]


class Again:
    """Slides logs again in changed scenes, many at once on all threads, until all tasks are done."""

    def __init__(self, question: Question, layers: SceneLayers, known: Known, others: NDArray[np.int64] | None) -> None:
        """others : of candidates, the numbers of all of them: of a task's obstacle only itself stays."""
        self.question, self.known, self.others = question, known, others
        self.stop = threading.Event()
        self.on(layers)

    def on(self, layers: SceneLayers) -> None:
        self.layers = layers
        self.start = place_logs(layers.scene, self.question.releases.logs, layers.shape, layers.threads)

    def missing(self, task: Task) -> NDArray[np.int64]:
        own = task.obstacle.owners
        return own if self.others is None else np.setdiff1d(self.others, own)

    def placed(self, rows: NDArray[np.int64]) -> Start:
        return Start(self.start.frame[rows], self.start.state[rows], self.start.body[rows])

    def slide(self, task: Task) -> tuple[Change, list[str]]:
        scene = without(self.layers, self.missing(task))
        result, sides = slide_once(
            scene, self.placed(task.rows), self.question.simulation, lambda done: self.stop.is_set(),
            inside=self.aside(task.rows), **self.stages_of(scene, task), **self.shorter(),
        )  # fmt: skip
        return self.change_of(task, result), sides

    def change_of(self, task: Task, result: Result) -> Change:
        own = task.obstacle.owners
        releases = self.question.releases.take(task.rows)
        now = reached(self.layers.lines, {"reach": result.reach}, releases)
        before, left = self.known.reach[task.rows], left_dem(self.known.result.stop_reason)[task.rows]
        left_now = left_dem(result.stop_reason)
        energy, held = taken_by(result), held_by(self.layers, result)
        return Change(
            (before & ~now).sum(axis=0), (now & ~before).sum(axis=0), (left[:, None] & ~before).sum(axis=0),
            (left_now[:, None] & ~now).sum(axis=0), sum(held.get(each, 0) for each in own.tolist()),
            sum(energy.get(each, 0) for each in own.tolist()),
        )  # fmt: skip

    def shorter(self) -> dict[str, Any]:
        """How little of a log's way tells what it reaches; of candidates it is asked what they hold and take, too."""
        return {"until_reached": True} if self.others is None else {}

    def aside(self, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
        """The lines that these logs need not reach: where they start, and those along the window's sides."""
        lines = self.layers.lines
        inside = starts_inside(lines, self.question.releases.take(rows))[:, lines.item]
        return np.pad(inside, ((0, 0), (0, len(self.layers.watched))), constant_values=True)

    def stages_of(self, scene: SceneLayers, task: Task) -> dict[str, Any]:
        """From where logs can continue: where the same rule holds for steps, for stages are of one window and rule."""
        if self.others is not None or self.layers is not self.known.layers:
            return {}
        if is_bare(scene) or self.question.rule_of_steps(scene) != self.question.rule_of_steps(self.layers):
            return {}
        stages = self.known.stages
        return {"stages": stages, "going_on": stages.before(task.rows, task.obstacle.owners)}

    def all(self, tasks: Sequence[Task], steps: Steps, feedback: Feedback, what: str) -> Iterator[tuple[Task, Any]]:
        """Each task with its change, in their order; each group's changes are kept as soon as all are there."""
        groups = groups_of(tasks)
        slides = _OnWorkers if self.question.simulation.where.scheduler else _OnThreads
        with slides(self, tasks, groups, feedback, what) as sliding:
            for number, group in enumerate(groups):
                logs = sum(tasks[k].rows.size for k in group)
                found = steps.take(logs, lambda number=number: self.packed(sliding.changes_of(number)))
                some = [tasks[k] for k in group]
                yield from zip(some, self.unpacked(found, some), strict=True)
        total = sum(task.rows.size for task in tasks)
        feedback.progress(total, total, what)

    def packed(self, changes: Sequence[Change]) -> dict[str, NDArray[Any]]:
        """What is kept of a group; the first axis is the task."""
        return {name: np.array([getattr(each, name) for each in changes]) for name in CHANGED}

    def unpacked(self, found: Mapping[str, NDArray[Any]], tasks: Sequence[Task]) -> list[Change]:
        return [
            Change(lost, gained, unseen, unseen_now, int(held), int(energy))
            for lost, gained, unseen, unseen_now, held, energy in zip(*(found[name] for name in CHANGED), strict=True)
        ]

    def widen(self, sides: Iterable[str], feedback: Feedback) -> None:
        self.on(self.widened(sorted(set(sides)), feedback))

    def widened(self, sides: list[str], feedback: Feedback) -> SceneLayers:
        return wider_scene(self.question.simulation, self.layers, sides, feedback)


class _Groups:
    """Tasks at work, group after group."""

    def __init__(
        self, again: Again, tasks: Sequence[Task], groups: Sequence[range], feedback: Feedback, what: str
    ) -> None:
        self.again, self.tasks, self.groups, self.feedback, self.what = again, tasks, groups, feedback, what
        self.total = sum(task.rows.size for task in tasks)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def changes_of(self, number: int) -> list[Change]:
        """The changes of a group; where logs come near the window's sides, again on a wider one."""
        raise NotImplementedError


class _OnWorkers(_Groups):
    """On the workers of a scheduler: so many logs at a time that few results lie here, the next begun meanwhile."""

    def batch(self, number: int) -> Batch:
        part = [self.tasks[k] for k in self.groups[number]]
        rows = np.concatenate([task.rows for task in part])
        missing = [(task.rows.size, self.again.missing(task)) for task in part]
        first = sum(self.tasks[k].rows.size for k in range(self.groups[number].start))
        return Batch(
            self.again.placed(rows), inside=self.again.aside(rows), first=first, goal=self.total, missing=missing
        )

    def changes_of(self, number: int) -> list[Change]:
        again = self.again
        while True:
            batch = self.batch(number)
            report = reporter(self.feedback, self.total, self.what, before=batch.first)
            result, sides = slide_batch(
                again.layers, batch, again.question.simulation, report,
                later=(self.batch(k) for k in range(number + 1, len(self.groups))), **again.shorter(),
            )  # fmt: skip
            if not sides:
                break
            again.widen(sides, self.feedback)
        found, first = [], 0
        for task in (self.tasks[k] for k in self.groups[number]):
            last = first + task.rows.size
            found.append(again.change_of(task, rows_of_result(result, first, last)))
            first = last
        return found


class _OnThreads(_Groups):
    """On threads of this process, many tasks at once; those of the groups that follow begin meanwhile."""

    def __enter__(self) -> Self:
        self.pool = ThreadPoolExecutor(self.again.layers.threads)
        self.running: dict[Future[tuple[Change, list[str]]], int] = {}
        self.found: dict[int, Change] = {}
        self.next = 0
        return self

    def __exit__(self, *_: object) -> None:
        if self.running:
            self.again.stop.set()
        self.pool.shutdown(cancel_futures=True)

    def changes_of(self, number: int) -> list[Change]:
        group, near, sides = self.groups[number], [], set()
        self.next = max(self.next, group.start)
        try:
            while not all(k in self.found for k in group):
                if sides and not self.running:
                    self.again.widen(sides, self.feedback)
                    for k in near:
                        self.running[self.pool.submit(self.again.slide, self.tasks[k])] = k
                    near, sides = [], set()
                while not sides and self.next < len(self.tasks) and len(self.running) < 4 * self.again.layers.threads:
                    self.running[self.pool.submit(self.again.slide, self.tasks[self.next])] = self.next
                    self.next += 1
                if self.feedback.cancelled():
                    raise Cancelled
                ready, _ = wait(self.running, timeout=0.2, return_when=FIRST_COMPLETED)
                for future in ready:
                    k = self.running.pop(future)
                    change, too_near = future.result()
                    if too_near:
                        near.append(k)
                        sides |= set(too_near)
                    else:
                        self.found[k] = change
                done = self.tasks[: group.start]
                at_work = sum(self.tasks[k].rows.size for k in self.found)
                self.feedback.progress(sum(task.rows.size for task in done) + at_work, self.total, self.what)
        except KeyboardInterrupt as error:
            raise Cancelled from error
        return [self.found.pop(k) for k in group]


class AgainWith(Again):
    """The same for candidates: the scene holds all of them, wherever its window ends."""

    def __init__(self, question: Question, layers: SceneLayers, known: Known, candidates) -> None:
        self.candidates, self.plain = candidates, layers
        both, found = candidates(layers)
        self.found = found
        owners = np.concatenate([each.owners for each in found]) if found else np.zeros(0, np.int64)
        super().__init__(question, both, known, owners)

    def widened(self, sides: list[str], feedback: Feedback) -> SceneLayers:
        self.plain = wider_scene(self.question.simulation, self.plain, sides, feedback)
        return self.candidates(self.plain)[0]


def effects_of(
    question: Question,
    layers: SceneLayers,
    known: Known,
    obstacles: Sequence[Obstacle],
    changes: Iterable[tuple[Task, Change]],
    *,
    planted: bool = False,
) -> list[Effect]:
    """One row for each obstacle and line, in their order; of candidates what they hold and take are those of the "
    "changes."""
    lost, gained, unseen, unseen_now = np.zeros((4, len(obstacles), len(layers.lines.ids)), np.int64)
    held = np.array([sum(known.held.get(each, 0) for each in one.owners.tolist()) for one in obstacles], np.int64)
    energy = np.array([sum(known.energy.get(each, 0) for each in one.owners.tolist()) for one in obstacles], np.int64)
    if planted:
        held[:], energy[:] = 0, 0
    for task, change in changes:
        lost[task.number] += change.lost
        gained[task.number] += change.gained
        unseen[task.number] += change.unseen
        unseen_now[task.number] += change.unseen_now
        if planted:
            held[task.number] += change.held
            energy[task.number] += change.energy
    total, now = len(question.releases), known.reach.sum(axis=0)
    return [
        Effect(one, str(line_id), total, int(now[line]), int(lost[k, line]), int(gained[k, line]),
              int(unseen[k, line]), int(unseen_now[k, line]), int(held[k]), float(energy[k]) / 1e6)
        for k, one in enumerate(obstacles)
        for line, line_id in enumerate(layers.lines.ids)
    ]  # fmt: skip


def ranks(gains: Sequence[float], effects: Sequence[Effect]) -> NDArray[np.int64]:
    """Place of each row among those of its kind and line, 1 the largest gain; of equal ones that which holds, then
    takes, more."""
    out = np.zeros(len(effects), np.int64)
    groups: dict[tuple[str, str], list[int]] = {}
    for k, each in enumerate(effects):
        groups.setdefault((each.obstacle.kind, each.line_id), []).append(k)
    for rows in groups.values():
        rows.sort(key=lambda k: (-gains[k], -effects[k].stopped, -effects[k].energy_taken_kj, k))
        out[rows] = np.arange(1, len(rows) + 1)
    return out


def farthest_listed(fidelity: Fidelity, cell: float) -> float:
    """How far [m] from the axis of a log's kept pose a thing can be listed as near, less the radii of both.

    Between two kept poses the ends move by less than ``trace_step`` and a step, and the pose ahead is another step
    away.
    """
    return NEAR_MARGIN + trace_step(fidelity, cell) + 3.0 * longest_travel(fidelity, cell) + 0.01


def logs_near(
    question: Question,
    layers: SceneLayers,
    both: SceneLayers,
    candidates: Sequence[Obstacle],
    widest: float,
    steps: Steps,
    feedback: Feedback,
) -> tuple[list[NDArray[np.int64]], SceneLayers]:
    """The logs that each candidate could matter to: whose axis came so near that it would have been listed.

    both : the scene with the candidates; widest : [m] largest radius of a candidate
    """
    cell, n = layers.dem.cell, len(question.releases)
    if question.rule_of_steps(both) != question.rule_of_steps(layers):
        return [np.arange(n) for _ in candidates], layers
    shapes = np.array([each.shape for each in candidates], object)
    margin = widest + farthest_listed(question.simulation.fidelity, cell)

    def slide_some(first: int) -> dict[str, NDArray[np.int64]]:
        nonlocal layers
        some = question.releases.take(np.arange(first, min(first + CHUNK, n)))

        def slide_on(on: SceneLayers) -> tuple[Result, list[str]]:
            report = reporter(feedback, n, "finding who comes near a candidate", before=first)
            keep = np.ones(len(some), bool)
            return slide_once(on, some.logs, question.simulation, report, keep_poses=keep)

        result, layers = until_none_escapes(layers, question.simulation, slide_on, feedback)
        poses = result.poses
        axes: Any = shapely.linestrings(np.stack([poses.base[:, :2], poses.tip[:, :2]], axis=1))
        body = place_logs(layers.scene, some.logs, layers.shape, layers.threads).body
        reach = margin + float(body[:, BASE_RADIUS].max(initial=0.0))
        which, pose = shapely.STRtree(axes).query(shapes, predicate="dwithin", distance=reach)
        pairs = np.unique(np.column_stack([which, first + poses.log_row[pose]]), axis=0)
        return {"candidate": pairs[:, 0], "log": pairs[:, 1]}

    firsts = range(0, n, CHUNK)
    found = [steps.take(min(CHUNK, n - first), lambda first=first: slide_some(first)) for first in firsts]
    candidate, log = (np.concatenate([each[name] for each in found]) for name in ("candidate", "log"))
    return [log[candidate == k] for k in range(len(candidates))], layers
