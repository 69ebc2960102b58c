"""A run, chunk by chunk: finished work is stored, so that an interrupted run continues where it was, bit for bit."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.manifest import engine_digest
from deadwood_algorithms.params.tool import Cancelled, Feedback, UserError
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import Releases, reached, starts_inside
from deadwood_algorithms.simulate.batch import Batch
from deadwood_algorithms.simulate.checkpoints import WorkFolder
from deadwood_algorithms.simulate.queue import Queue
from deadwood_algorithms.simulate.simulation import Simulation
from deadwood_algorithms.simulate.sliding import reporter, slide_batch
from deadwood_algorithms.simulate.totals import Totals
from deadwood_algorithms.simulate.warm_up import load_kernels
from deadwood_algorithms.simulate.windows import scene_again, wider_scene
from deadwood_engine import Logs, Rasters, Result

# Logs between two saved states: enough to keep 16 threads busy, few enough to lose or to hold in memory.
CHUNK = 512
# The first chunks are smaller, so that a run that is interrupted early keeps something, however slow its logs are.
FIRST_CHUNKS = (32, 64, 128, 256)  # logs after which they end
# The rasters are saved after a chunk so often that it takes this share of the time (half a second on
# 4000 x 4000 cells, much less on smaller ones), and at least this often: the most that an interruption loses, besides
# the current chunk.
CHECKPOINT_SHARE, CHECKPOINT_S = 0.05, 10.0

# From a chunk's result, the scene, the logs, which of them keep their poses, and the seconds that it took: the values
# stored by log, and the poses.
Keeper = Callable[[Result, SceneLayers, Logs, NDArray[np.bool_], float], tuple[Mapping[str, NDArray], pa.Table]]


@dataclass
class DrawnScene:
    """The scene, and the rasters that logs draw on it; both grow when logs come near a large DEM's window."""

    layers: SceneLayers
    rasters: Rasters

    @staticmethod
    def on(layers: SceneLayers, simulation: Simulation, work: WorkFolder, feedback: Feedback) -> DrawnScene:
        """The scene with the rasters of the finished chunks, on a window that contains them."""
        if work.part and layers.dem.whole and layers.dem.part.joined(work.part) != layers.dem.part:
            layers = scene_again(simulation, layers, layers.dem.part.joined(work.part), feedback)
        rasters = Rasters.allocate(layers.scene, layers.threads, layers.danger_bands())
        if work.finished:
            rasters.add(work.rasters(layers.dem))
        return DrawnScene(layers, rasters)

    def widen(self, sides: list[str], simulation: Simulation, work: WorkFolder, feedback: Feedback) -> None:
        """Restart from the last checkpoint, on a wider window."""
        self.rasters.workers.clear()  # before the wider ones are made
        wider = DrawnScene.on(wider_scene(simulation, self.layers, sides, feedback), simulation, work, feedback)
        self.layers, self.rasters = wider.layers, wider.rasters


@dataclass
class ChunkedRun:
    """Logs in the order of a queue, slid until all are done or its rule has enough.

    keep : bool (n,), by row of the releases, logs whose poses are stored; keeper : selects what is stored of a chunk
    """

    simulation: Simulation
    releases: Releases
    keep: NDArray[np.bool_]
    keeper: Keeper
    slope: DrawnScene
    queue: Queue
    work: WorkFolder
    feedback: Feedback
    remove: Callable[[], None] = field(init=False)  # removes what is stored, once the results are written

    def __post_init__(self) -> None:
        self.remove = self.work.remove

    def slide(self) -> None:
        """Slide the logs that are not yet done, one chunk after the other.

        A log near the side of the DEM's window may have drawn other cells on the rasters than on the whole DEM, so
        all logs since the last checkpoint are slid again on a wider one.
        """
        queue, work, feedback = self.queue, self.work, self.feedback
        load_kernels(self.slope.layers.shape, feedback)
        total = queue.rows.size
        saved, saving_s = time.perf_counter(), 0.05  # estimated duration until it has been measured
        for chunk, part in enumerate(queue.parts):
            fresh = chunk >= work.finished
            if fresh or chunk in work.lost:
                self._until_it_fits(chunk, work.finished if fresh else chunk)
            queue.slid = part.stop
            last = part.stop == total
            if queue.rule:
                rows = queue.rows[part]
                touched = reached(self.slope.layers.lines, work.chunk(chunk), self.releases.take(rows))
                last = queue.rule.enough(rows.size, touched.sum(axis=0)) or last
            since = time.perf_counter() - saved
            due = last or since > min(CHECKPOINT_S, saving_s / CHECKPOINT_SHARE) or feedback.cancelled()
            if fresh and due:
                work.checkpoint(chunk + 1, Totals(self.slope.rasters), self.slope.layers.dem)
                saving_s, saved = time.perf_counter() - saved - since, time.perf_counter()
            if last:
                break
        feedback.progress(queue.slid, queue.slid, "sliding logs")

    def _until_it_fits(self, chunk: int, first: int) -> None:
        """Slide a chunk; where the window is too small, all chunks from the first on again."""
        try:
            todo = [chunk]
            while todo:
                sides = self._slide_chunk(todo[0])
                if sides:
                    self.slope.widen(sides, self.simulation, self.work, self.feedback)
                todo = list(range(first, chunk + 1)) if sides else todo[1:]
        except (Cancelled, KeyboardInterrupt, UserError) as error:
            kept = self.queue.parts[self.work.finished].start
            self.feedback.note(
                f"{kept} of {self.queue.rows.size} logs are kept in {self.work.path}; --resume continues from there"
            )
            if isinstance(error, UserError):  # the workers are lost
                raise
            raise Cancelled from error

    def _slide_chunk(self, chunk: int) -> list[str]:
        """Slide the logs of one chunk and keep the results; or return the sides of the window that were too close.

        The rasters of the last checkpoint hold all chunks before it, so one of those that was lost is not drawn again.
        Workers start on the following chunks while a slow log delays this one.
        """
        queue, slope = self.queue, self.slope
        batch = self._batch(chunk)
        fresh = chunk >= self.work.finished
        following = range(chunk + 1, len(queue.parts)) if fresh else ()
        later = (self._batch(number) for number in following if queue.parts[number].start < queue.goal)
        report = reporter(self.feedback, queue.goal, "sliding logs", before=batch.first)
        began = time.perf_counter()
        rasters = slope.rasters if fresh else None
        result, sides = slide_batch(slope.layers, batch, self.simulation, report, rasters=rasters, later=later)
        wall_s = time.perf_counter() - began
        if not sides:
            rows = queue.rows[queue.parts[chunk]]
            kept = self.keeper(result, slope.layers, self.releases.logs.take(rows), self.keep[rows], wall_s)
            self.work.save(chunk, *kept)
        return sides

    def _batch(self, chunk: int) -> Batch:
        part = self.queue.parts[chunk]
        rows = self.queue.rows[part]
        layers = self.slope.layers
        inside = layers.by_scene_line(starts_inside(layers.lines, self.releases.take(rows)))
        keep = self.keep[rows] | bool(layers.barriers.ids)  # of all logs it is then known how they come to a barrier
        return Batch(self.releases.logs.take(rows), keep, inside, part.start, self.queue.goal)


def queue_of(releases: Releases, *, target: float | None, line_ids: list[Any], seed: int) -> Queue:
    """All logs in the order of their rows, or, with a target of the intervals, in random order."""
    return Queue.of(releases.logs.log_id, CHUNK, FIRST_CHUNKS, target=target, line_ids=line_ids, seed=seed)


def identity_of(simulation: Simulation, layers: SceneLayers, releases: Releases, **more: Any) -> dict[str, Any]:
    """Everything that determines the results, bit for bit: unfinished work continues only if all of it agrees."""
    return {
        "version": tool.VERSION,
        "engine": engine_digest(),
        "DEM, friction, trees, barriers, lying logs, blocks or lines": layers.digest,
        "releases": releases.digest,
        "fidelity": [float(number) for number in simulation.fidelity],
        "options": [*simulation.laws.values(), simulation.inputs.shape],
        "chunks": [CHUNK, list(FIRST_CHUNKS)],
        **more,
    }
