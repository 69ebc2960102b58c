"""The outcomes of the logs of one request: batch by batch, in the original scene and in the changed one.

The effect of a change is found by sliding again the logs that it can affect. For removed objects the engine records
which logs they affected (``deadwood_engine.influence``); for added ones the poses of the logs show which came near.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.protection.baseline import held_by
from deadwood_algorithms.evaluate.protection.near_candidates import farthest_listed
from deadwood_algorithms.evaluate.protection.rerun import Rerun
from deadwood_algorithms.explore.questions import MOST_POSED, Changes, Question
from deadwood_algorithms.files.grid import Part
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.lying_logs import with_more
from deadwood_algorithms.scene.releases import Releases, reached
from deadwood_algorithms.simulate.piece import scene_without
from deadwood_algorithms.simulate.simulation import Simulation
from deadwood_algorithms.simulate.sinking import Sinking
from deadwood_algorithms.simulate.sliding import slide_once
from deadwood_engine import FIDELITIES, Barriers, LyingLogs, Poses, Rasters, Result, Start, Trees
from deadwood_engine.fidelity import longest_travel, trace_step
from deadwood_engine.log_body import BASE_RADIUS, LENGTH
from deadwood_engine.trace import HITS

Stale = Callable[[], bool]

AGAIN = 10  # logs that slide at another friction at once: a new request waits for them
FIRST = (30, 70, 200, 300)  # logs of the first batches; later ones have the size of the last


@dataclass(frozen=True)
class Hits:
    """How often logs hit the cells of a box; row 0 is the southernmost, ``first`` its column and row in the whole."""

    first: tuple[int, int]
    count: NDArray[np.uint32]

    @staticmethod
    def taken(rasters: Rasters, part: Part) -> Hits:
        """Take out what was drawn, restricted to this part of the rasters, which are then empty again: they are as
        large as the terrain model, but the system never allocates pages of them that nothing is drawn on or read
        from."""
        grid = np.zeros((part.rows, part.columns), np.uint32)
        for each in rasters.workers:
            drawn = each.hits[(*part.slices, HITS)]
            grid += drawn
            drawn[...] = 0
        return Hits((part.column, part.row), grid).trimmed()

    @staticmethod
    def summed(parts: Sequence[Hits], less: Sequence[Hits] = ()) -> Hits:
        """The sum of these, minus those of ``less``, which are among them."""
        boxes = [each.part for each in parts if each.count.size]
        if not boxes:
            return NOWHERE
        box = reduce(Part.joined, boxes)
        grid = np.zeros((box.rows, box.columns), np.uint32)
        for add, some in ((np.add, parts), (np.subtract, less)):
            for each in some:
                own = each.part
                at = grid[Part(own.column - box.column, own.row - box.row, own.columns, own.rows).slices]
                if own.cells:
                    add(at, each.count, out=at)
        summed = Hits((box.column, box.row), grid)
        return summed.trimmed() if less else summed

    @property
    def part(self) -> Part:
        return Part(*self.first, self.count.shape[1], self.count.shape[0])

    def trimmed(self) -> Hits:
        """Without empty rows and columns around it."""
        rows, columns = np.flatnonzero(self.count.any(axis=1)), np.flatnonzero(self.count.any(axis=0))
        if not rows.size:
            return NOWHERE
        inner = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
        return Hits((self.first[0] + int(columns[0]), self.first[1] + int(rows[0])), self.count[inner].copy())


NOWHERE = Hits((0, 0), np.zeros((0, 0), np.uint32))


@dataclass(frozen=True)
class Ways:
    """Where logs went: the plan position of both ends at every stored pose, (n, 2) each, and the log of each pose."""

    log: NDArray[np.int64]
    base: NDArray[np.float64]
    tip: NDArray[np.float64]

    @cached_property
    def tree(self) -> shapely.STRtree:
        axes: Any = shapely.linestrings(np.stack([self.base, self.tip], axis=1))
        return shapely.STRtree(axes)

    def near(self, shapes: NDArray[Any], distance: float) -> NDArray[np.int64]:
        """The logs whose axis came so near [m] to any of the shapes."""
        _, pose = self.tree.query(shapes, predicate="dwithin", distance=distance)
        return np.unique(self.log[pose])


@dataclass
class Batch:
    """Some of the logs, by row, and their outcomes in one scene."""

    rows: slice
    reach: NDArray[np.bool_]
    reason: NDArray[np.int8]
    end: NDArray[np.float64]
    held: Counter[int]  # trees that hold logs at the end, by row
    hits: Hits

    @property
    def number(self) -> int:
        return self.rows.stop - self.rows.start


@dataclass
class Base(Batch):
    """Outcomes in the original scene, with what determines which logs a change can affect."""

    log: NDArray[np.int64]  # which an obstacle affected, and the obstacle's row
    item: NDArray[np.int64]
    by_barrier: NDArray[np.bool_]
    ways: Ways
    poses: Poses


@dataclass
class Changed(Batch):
    """Outcomes in the changed scene; ``concerned`` logs were slid again; for the others nothing changes."""

    concerned: int


@dataclass
class Answer:
    """A request and the part of it that is answered.

    layers : the original scene; edited : the changed one
    base, changed : the batches that have slid in either scene; hits, hits_changed : of all of these
    at : whether each of the first logs reached each line at `draft`, by scene (whether changed), friction and posture
    postures : the same logs at their start, by posture; that of the request among them
    spare : empty rasters that were used before, whose memory is reused
    """

    question: Question
    changes: Changes
    simulation: Simulation
    layers: SceneLayers
    edited: SceneLayers
    releases: Releases
    start: Start
    base: list[Base] = field(default_factory=list)
    changed: list[Changed] = field(default_factory=list)
    hits: Hits = NOWHERE
    hits_changed: Hits = NOWHERE
    at: dict[tuple[bool, float, str], NDArray[np.bool_]] = field(default_factory=dict)
    postures: dict[str, Start] = field(default_factory=dict)
    spare: list[Rasters] = field(default_factory=list)

    @property
    def parts(self) -> list[slice]:
        return parts_of(len(self.releases))

    def with_changes(self, changes: Changes) -> None:
        self.changes, self.changed, self.hits_changed = changes, [], NOWHERE
        self.at = {key: reach for key, reach in self.at.items() if not key[0]}
        self.edited = changed_scene(self.layers, changes)

    def slide_at(self, friction: float, posture: str, edited: bool, logs: int, stop: Stale) -> None:
        """Slide the first logs at `draft` with another friction or posture, in the scene as it was read or as changed;
        what has slid already is kept. In pieces, because the engine looks only five times a second whether to stop."""
        layers = self.edited if edited else self.layers
        layers = replace(layers, friction=friction, scene=layers.scene.with_friction(friction))
        simulation = replace(self.simulation, fidelity=FIDELITIES["draft"], sinking=Sinking())
        key, all_logs = (edited, friction, posture), self.postures[posture]
        found = self.at.get(key, np.zeros((0, len(layers.lines.ids)), bool))
        while len(found) < logs:
            part = slice(len(found), min(logs, len(found) + AGAIN))
            start = Start(all_logs.frame[part], all_logs.state[part], all_logs.body[part])
            result, _ = slide_once(layers, start, simulation, lambda _: stop())
            found = np.concatenate([found, self._what_became(layers, result, part)[0]])
            self.at[key] = found

    def slide_base(self, part: slice, stop: Stale) -> None:
        """Slide a batch in the scene as it was read."""
        result, hits = self._slide(self.layers, part, stop, influences=True)
        influences, poses = result.influences, result.poses
        self.base.append(
            Base(
                part,
                *self._what_became(self.layers, result, part),
                hits,
                influences.log_row,
                influences.item,
                influences.by_barrier,
                Ways(poses.log_row, poses.base[:, :2].copy(), poses.tip[:, :2].copy()),
                some_poses(poses, MOST_POSED - part.start),
            )
        )
        self.hits = Hits.summed([self.hits, hits])

    def slide_changed(self, part: slice, stop: Stale) -> None:
        """Slide the next batch in the changed scene."""
        base = self.base[len(self.changed)]
        batch = self._changed(base, part, stop)
        self.changed.append(batch)
        self.hits_changed = Hits.summed([self.hits_changed, batch.hits])

    def _changed(self, base: Base, part: slice, stop: Stale) -> Changed:
        """Slide the affected logs of a batch in the changed scene and replace their outcomes; if they are many,
        slide the whole batch."""
        rows = self.concerned(base)
        if 2 * rows.size > base.number:
            result, hits = self._slide(self.edited, part, stop)
            return Changed(part, *self._what_became(self.edited, result, part), hits, rows.size)
        if not rows.size:
            return Changed(part, base.reach, base.reason, base.end, base.held, base.hits, 0)
        some = rows + part.start
        (now, more), (before, gone) = (self._slide(layers, some, stop) for layers in (self.edited, self.layers))
        reach, reason, end = base.reach.copy(), base.reason.copy(), base.end.copy()
        reach[rows], reason[rows], end[rows], held_now = self._what_became(self.edited, now, some)
        held = Counter(base.held)
        held.update(held_now)
        held.subtract(trees_that_hold(self.layers, before))
        return Changed(part, reach, reason, end, held, Hits.summed([base.hits, more], less=[gone]), rows.size)

    def poses_after(self, logs: int) -> Poses:
        """The poses of the first logs in the changed scene; these few are always slid again."""
        return self._slide(self.edited, slice(0, logs), lambda: False)[0].poses

    def concerned(self, base: Base) -> NDArray[np.int64]:
        """The logs of a batch that the changes can affect: all, if the changes alter the rule of steps."""
        rule = Rerun(self.simulation, self.releases).rule_of_steps
        if rule(self.edited) != rule(self.layers):
            return np.arange(base.number)
        trees = ~base.by_barrier & np.isin(base.item, self.changes.fell)
        found = [base.log[trees]]
        if self.changes.adds:
            cores = self.edited.scene.arrays.cores.solid
            widest = float(np.maximum(cores["wide"], cores["wide"] + cores["long"] * cores["slope"]).max(initial=0.0))
            logs = float(self.start.body[base.rows, BASE_RADIUS].max(initial=0.0))
            far = farthest_listed(self.simulation.fidelity, self.layers.dem.cell)
            found.append(base.ways.near(shapes_of(self.changes), far + widest + logs))
        return np.unique(np.concatenate(found))

    def _slide(
        self, layers: SceneLayers, which: slice | NDArray[np.int64], stop: Stale, *, influences: bool = False
    ) -> tuple[Result, Hits]:
        start = Start(self.start.frame[which], self.start.state[which], self.start.body[which])
        rasters = self.spare.pop() if self.spare else Rasters.allocate(layers.scene, layers.threads, maxima=False)
        result, _ = slide_once(
            layers,
            start,
            self.simulation,
            lambda _: stop(),
            rasters=rasters,
            influences=influences,
            keep_poses=np.ones(len(start.state), bool),
        )
        hits = Hits.taken(rasters, self._where(result.poses, start))
        self.spare.append(rasters)
        return result, hits

    def _where(self, poses: Poses, start: Start) -> Part:
        """A part of the terrain model that contains everything that was drawn: each outline covers two stored poses
        and the movement between them. It is wider than necessary, by the movement of a few steps.
        """
        dem, fidelity = self.layers.dem, self.simulation.fidelity
        ends = np.concatenate([poses.base[:, :2], poses.tip[:, :2]])
        wide = float(start.body[:, LENGTH if self.layers.shape else BASE_RADIUS].max())
        margin = wide + trace_step(fidelity, dem.cell) + 3.0 * longest_travel(fidelity, dem.cell) + 2.0 * dem.cell
        first = np.floor((ends.min(axis=0) - margin - (dem.x0, dem.y0)) / dem.cell).astype(int)
        last = np.ceil((ends.max(axis=0) + margin - (dem.x0, dem.y0)) / dem.cell).astype(int)
        return Part(int(first[0]), int(first[1]), *(last - first + 1).tolist()).cut_to(dem.shape)

    def _what_became(
        self, layers: SceneLayers, result: Result, which: slice | NDArray[np.int64]
    ) -> tuple[NDArray[np.bool_], NDArray[np.int8], NDArray[np.float64], Counter[int]]:
        reach = reached(layers.lines, {"reach": result.reach}, self.releases.take(which))
        return reach, result.stop_reason, result.end_position[:, :2], trees_that_hold(layers, result)


def trees_that_hold(layers: SceneLayers, result: Result) -> Counter[int]:
    """How many logs each tree holds at the end. Other obstacles are numbered after the trees, of which one scene may
    have more than another."""
    held = held_by(layers, result)
    return Counter({tree: n for tree, n in held.items() if 0 <= tree < layers.scene.tree_count})


def parts_of(number: int) -> list[slice]:
    """How many logs are in each batch, of all of them."""
    found, first = [], 0
    while first < number:
        last = min(number, first + FIRST[min(len(found), len(FIRST) - 1)])
        found.append(slice(first, last))
        first = last
    return found


def some_poses(poses: Poses, logs: int) -> Poses:
    """The poses of the first logs alone."""
    count = int(np.searchsorted(poses.log_row, max(0, logs)))
    return Poses(*(getattr(poses, name)[:count].copy() for name in Poses.__dataclass_fields__))


def shapes_of(changes: Changes) -> NDArray[Any]:
    """The plan shapes of added objects."""
    trees = [shapely.Point(place) for place in changes.plant[:, :2]]
    return np.array(
        [*trees, *(shapely.LineString(each.points) for each in (*changes.barriers, *changes.lying_logs))], object
    )


def changed_scene(layers: SceneLayers, changes: Changes) -> SceneLayers:
    """The scene with added objects, after its own objects of that kind, and without felled ones."""
    scene = layers.scene
    try:
        if len(changes.plant):
            x, y, dbh_cm, height = changes.plant.T
            scene = scene.with_trees(layers.with_capacity(layers.trees.then(Trees(x, y, dbh_cm / 100.0, height))))
        if changes.barriers:
            vertices, starts, sizes = joined_lines(
                layers.engine_barriers.vertices, layers.engine_barriers.starts, changes.barriers
            )
            scene = scene.with_barriers(
                Barriers(vertices, starts, np.concatenate([layers.engine_barriers.height, sizes]))
            )
        if changes.lying_logs:
            none = LyingLogs.none()
            vertices, starts, cm = joined_lines(none.vertices, none.starts, changes.lying_logs)
            drawn = LyingLogs(vertices, starts, cm / 100.0, 0.5 * cm / 100.0)
            scene = scene.with_lying_logs(with_more(layers.lying_logs, drawn))
    except ValueError as error:
        raise UserError(str(error)) from error
    return replace(layers, scene=scene_without(scene, changes.fell) if len(changes.fell) else scene)


def joined_lines(vertices: Any, starts: Any, more: tuple[Any, ...]) -> tuple[Any, Any, Any]:
    """Lines as the engine takes them, with further ones appended, and the sizes of these."""
    ends = starts[-1] + np.cumsum([len(each.points) for each in more])
    together = np.concatenate([np.reshape(vertices, (-1, 2)), *(each.points for each in more)])
    return together, np.concatenate([starts, ends]).astype(np.int64), np.array([each.size for each in more])
