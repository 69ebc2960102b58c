"""Many scenes at once: on threads of this process, or on the workers of a scheduler, in one order of results."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Any, Self

import numpy as np

from deadwood_algorithms.evaluate.protection.changed_scenes import Change, ChangedScenes, Task, groups_of
from deadwood_algorithms.params.tool import Cancelled, Feedback
from deadwood_algorithms.simulate.batch import Batch
from deadwood_algorithms.simulate.joined import rows_of_result
from deadwood_algorithms.simulate.sliding import reporter, slide_batch
from deadwood_algorithms.simulate.steps import Steps


def changes_in_order(
    scenes: ChangedScenes, tasks: Sequence[Task], steps: Steps, feedback: Feedback, what: str
) -> Iterator[tuple[Task, Any]]:
    """Each task with its change, in order; the changes of a group are stored as soon as all of them exist."""
    groups = groups_of(tasks)
    slides = _OnWorkers if scenes.rerun.simulation.where.scheduler else _OnThreads
    with slides(scenes, tasks, groups, feedback, what) as sliding:
        for number, group in enumerate(groups):
            logs = sum(tasks[k].rows.size for k in group)
            found = steps.take(logs, lambda number=number: scenes.packed(sliding.changes_of(number)))
            some = [tasks[k] for k in group]
            yield from zip(some, scenes.unpacked(found, some), strict=True)
    total = sum(task.rows.size for task in tasks)
    feedback.progress(total, total, what)


class _Groups:
    """Processes tasks, group after group."""

    def __init__(
        self, scenes: ChangedScenes, tasks: Sequence[Task], groups: Sequence[range], feedback: Feedback, what: str
    ) -> None:
        self.scenes, self.tasks, self.groups, self.feedback, self.what = scenes, tasks, groups, feedback, what
        self.total = sum(task.rows.size for task in tasks)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def changes_of(self, number: int) -> list[Change]:
        """The changes of a group; if logs come near the window's sides, they slide again on a wider one."""
        raise NotImplementedError


class _OnWorkers(_Groups):
    """On the workers of a scheduler: only some logs at a time, so that few results are held here; the next start
    meanwhile.
    """

    def batch(self, number: int) -> Batch:
        part = [self.tasks[k] for k in self.groups[number]]
        rows = np.concatenate([task.rows for task in part])
        missing = [(task.rows.size, self.scenes.missing(task)) for task in part]
        first = sum(self.tasks[k].rows.size for k in range(self.groups[number].start))
        return Batch(
            self.scenes.placed(rows), inside=self.scenes.aside(rows), first=first, goal=self.total, missing=missing
        )

    def changes_of(self, number: int) -> list[Change]:
        scenes = self.scenes
        while True:
            batch = self.batch(number)
            report = reporter(self.feedback, self.total, self.what, before=batch.first)
            result, sides = slide_batch(
                scenes.layers,
                batch,
                scenes.rerun.simulation,
                report,
                later=(self.batch(k) for k in range(number + 1, len(self.groups))),
                **scenes.shorter(),
            )
            if not sides:
                break
            scenes.widen(sides, self.feedback)
        found, first = [], 0
        for task in (self.tasks[k] for k in self.groups[number]):
            last = first + task.rows.size
            found.append(scenes.change_of(task, rows_of_result(result, first, last)))
            first = last
        return found


class _OnThreads(_Groups):
    """On threads of this process, many tasks at once; those of the next groups start meanwhile."""

    def __enter__(self) -> Self:
        self.pool = ThreadPoolExecutor(self.scenes.layers.threads)
        self.running: dict[Future[tuple[Change, list[str]]], int] = {}
        self.found: dict[int, Change] = {}
        self.next = 0
        return self

    def __exit__(self, *_: object) -> None:
        if self.running:
            self.scenes.stop.set()
        self.pool.shutdown(cancel_futures=True)

    def changes_of(self, number: int) -> list[Change]:
        group, near, sides = self.groups[number], [], set()
        self.next = max(self.next, group.start)
        try:
            while not all(k in self.found for k in group):
                if sides and not self.running:
                    self.scenes.widen(sides, self.feedback)
                    for k in near:
                        self.running[self.pool.submit(self.scenes.slide, self.tasks[k])] = k
                    near, sides = [], set()
                while not sides and self.next < len(self.tasks) and len(self.running) < 4 * self.scenes.layers.threads:
                    self.running[self.pool.submit(self.scenes.slide, self.tasks[self.next])] = self.next
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
