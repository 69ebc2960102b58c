"""The scene through which logs slide, as plain arrays. What is absent has zero rows and costs nothing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import barriers as barrier_file
from . import blocks as block_file
from . import lying_logs as lying_file
from . import terrain as terrain_file
from . import trees as tree_file
from .barriers import Barriers
from .blocks import Blocks
from .cloud import Cloud
from .cores import BARRIER, BLOCK, LYING, TREE, Cores, by_kind, joined, left_out
from .lines import Lines, Segments, segments_of
from .lying_logs import LyingLogs, Pieces, pieces_of
from .terrain import Terrain, surfaces_at
from .trees import Trees

Array = NDArray[np.float64]


class SceneArrays(NamedTuple):
    """What the kernels read."""

    terrain: Terrain
    cores: Cores  # all obstacles
    cloud: Cloud | None  # the shape that slides; None for logs: its kernels are then not even compiled
    lines: Segments
    fences: Segments  # the barriers' lines in plan, for the ledger

    @property
    def lying(self) -> Pieces:
        """The pieces of the lying logs, in position."""
        return pieces_of(self.cores)


@dataclass(frozen=True)
class Scene:
    """A prepared scene; ``arrays`` is for kernels, the rest describes it.

    trees_outside, barriers_outside, lying_outside, blocks_outside : int64, rows of obstacles outside the terrain, which
    are
        therefore not modelled
    """

    arrays: SceneArrays
    tree_count: int
    barrier_count: int
    line_count: int
    trees_outside: NDArray[np.int64]
    barriers_outside: NDArray[np.int64]
    lying_count: int
    lying_outside: NDArray[np.int64]
    blocks_outside: NDArray[np.int64]

    @staticmethod
    def prepare(
        heights: Array,
        cell: float,
        x0: float,
        y0: float,
        *,
        friction: float | Array,
        trees: Trees | None = None,
        barriers: Barriers | None = None,
        lines: Lines | None = None,
        lying_logs: LyingLogs | None = None,
        blocks: Blocks | None = None,
        first: tuple[int, int] = (0, 0),
        reference: float | None = None,
    ) -> Scene:
        """Check a scene and prepare its arrays.

        Parameters
        ----------
        heights : [m], shape (rows, columns), row 0 southernmost, NaN outside; heights at cell centres
        cell : [m]; x0, y0 : world position of the centre of cell (0, 0) of the whole DEM [m]
        first : column and row of heights[0, 0] in the whole DEM, if the heights are a window of it
        reference : [m] height that is zero in the kernels; the same for all windows of a DEM, otherwise bits differ
        friction : Coulomb's coefficient, one value or one per cell
        trees, barriers, lines, lying_logs, blocks : world coordinates [m]

        Raises
        ------
        ValueError
            for an invalid terrain, friction, tree, barrier or lying log
        """
        trees, barriers, lines = trees or Trees.none(), barriers or Barriers.none(), lines or Lines.none()
        terrain = terrain_file.prepare(heights, cell, x0, y0, friction, first, reference)
        _check_trees(trees)
        _check_sizes(height=barriers.height)
        lying_logs, blocks = lying_logs or LyingLogs.none(), blocks or Blocks.none()
        for name, each in (("barrier", barriers), ("line", lines), ("lying log", lying_logs)):
            _check_places(name, each.vertices)
        after_lying = len(trees.x) + len(lying_logs.diameter)
        standing, trees_outside = _standing(terrain, trees)
        edges, barriers_outside = barrier_file.prepare(terrain, barriers)
        lying, lying_outside = lying_file.prepare(terrain, lying_logs, len(trees.x))
        boulders, blocks_outside = block_file.prepare(terrain, blocks, after_lying)
        arrays = SceneArrays(
            terrain,
            _in_window(joined([standing, edges, lying, boulders], terrain.cell), terrain),
            None,
            segments_of(lines, terrain.x0, terrain.y0),
            segments_of(Lines(barriers.vertices, barriers.starts), x0, y0),
        )
        return Scene(
            arrays,
            len(trees.x),
            len(barriers.height),
            len(lines.starts) - 1,
            trees_outside,
            barriers_outside,
            len(lying_logs.diameter),
            lying_outside,
            blocks_outside,
        )

    def with_friction(self, friction: float) -> Scene:
        """The scene with one coefficient everywhere; everything else is shared."""
        terrain = self.arrays.terrain._replace(friction=np.array([[friction]], np.float64))
        return replace(self, arrays=self.arrays._replace(terrain=terrain))

    def with_lines(self, lines: Lines) -> Scene:
        """The scene with these lines instead of its own; everything else is shared."""
        terrain = self.arrays.terrain
        arrays = self.arrays._replace(lines=segments_of(lines, terrain.x0, terrain.y0))
        return replace(self, arrays=arrays, line_count=len(lines.starts) - 1)

    def with_trees(self, trees: Trees) -> Scene:
        """The scene with these trees instead of its own; the terrain is shared, and the result equals a newly prepared
        scene.

        Lying logs and boulders are numbered after the trees; removed obstacles (``without``) remain removed.
        """
        _check_trees(trees)
        standing, outside = _standing(self.arrays.terrain, trees)
        arrays = self._arrays_with(TREE, standing, len(trees.x) - self.tree_count)
        return replace(self, arrays=arrays, tree_count=len(trees.x), trees_outside=outside)

    def with_barriers(self, barriers: Barriers) -> Scene:
        """The scene with these barriers instead of its own; as ``with_trees``."""
        _check_sizes(height=barriers.height)
        _check_places("barrier", barriers.vertices)
        terrain = self.arrays.terrain
        edges, outside = barrier_file.prepare(terrain, barriers)
        fences = segments_of(Lines(barriers.vertices, barriers.starts), terrain.x0, terrain.y0)
        arrays = self._arrays_with(BARRIER, edges, 0)._replace(fences=fences)
        return replace(self, arrays=arrays, barrier_count=len(barriers.height), barriers_outside=outside)

    def with_lying_logs(self, lying_logs: LyingLogs) -> Scene:
        """The scene with these lying logs instead of its own; as ``with_trees``."""
        _check_places("lying log", lying_logs.vertices)
        lying, outside = lying_file.prepare(self.arrays.terrain, lying_logs, self.tree_count)
        number = len(lying_logs.diameter)
        arrays = self._arrays_with(LYING, lying, number - self.lying_count)
        return replace(self, arrays=arrays, lying_count=number, lying_outside=outside)

    def _arrays_with(self, kind: int, solid: Any, more: int) -> SceneArrays:
        """The arrays with other cores of one kind; more : number of additional objects, by which later ones are
        shifted.
        """
        terrain = self.arrays.terrain
        parts = by_kind(self.arrays.cores, terrain.cell, (terrain.column, terrain.row))
        order = (TREE, LYING, BLOCK)
        for each in order[order.index(kind) + 1 :] if kind in order else ():
            parts[each]["owner"] += more
        parts[kind] = solid
        return self.arrays._replace(cores=_in_window(joined(list(parts.values()), terrain.cell), terrain))

    def without(self, *, barriers: Array | tuple[()] = (), others: Array | tuple[()] = ()) -> Scene:
        """The scene without some obstacles, the others numbered as before; the terrain is shared.

        barriers : their rows; others : rows of trees, lying logs numbered after the trees, boulders after these
        """
        solid = self.arrays.cores.solid
        fences, owner = solid["kind"] == BARRIER, solid["owner"]
        gone = np.where(fences, np.isin(owner, barriers), np.isin(owner, others))
        return replace(self, arrays=self.arrays._replace(cores=left_out(self.arrays.cores, gone)))

    def terrain_height(self, x: Array, y: Array) -> Array:
        """Height [m] of the bilinear surface; NaN outside."""
        return self.terrain_surface(x, y)[:, 0]

    def terrain_surface(self, x: Array, y: Array) -> Array:
        """Height [m] and gradient (east, north) of the surface at world positions, shape (n, 3); NaN height outside."""
        terrain = self.arrays.terrain
        x, y = np.atleast_1d(x), np.atleast_1d(y)
        found = surfaces_at(terrain, np.column_stack([x, y]).astype(float) - (terrain.x0, terrain.y0))
        found[:, 0] += terrain.reference
        return found


def _check_sizes(**sizes: Array) -> None:
    for name, values in sizes.items():
        if not np.all(np.isfinite(values) & (np.asarray(values) > 0)):
            raise ValueError(f"a tree's or barrier's {name} must be positive and finite")


def _check_trees(trees: Trees) -> None:
    _check_sizes(diameter=trees.diameter, height=trees.height)
    if trees.capacity is not None and not np.all(np.asarray(trees.capacity, float) > 0.0):
        raise ValueError("what a tree takes before it breaks must be more than nothing; infinite: it does not break")


def _check_places(name: str, vertices: Array) -> None:
    if not np.isfinite(vertices).all():
        raise ValueError(f"a vertex of a {name} is no finite place")


def _in_window(items: Any, terrain: Terrain) -> Any:
    """Items positioned in nodes of the whole DEM, converted to nodes of the window to which the heights belong."""
    index, cell = items.index, terrain.cell
    index = index._replace(x0=index.x0 - terrain.column * cell, y0=index.y0 - terrain.row * cell)
    return items._replace(node=items.node - (terrain.column, terrain.row), index=index)


def _standing(terrain: Terrain, trees: Trees) -> tuple[Any, NDArray[np.int64]]:
    """The cores of the trees on the terrain, and the rows of the others."""
    plan = np.column_stack([trees.x, trees.y]).astype(float).reshape(-1, 2) - (terrain.x0, terrain.y0)
    foot = surfaces_at(terrain, plan)[:, 0]
    there = np.flatnonzero(np.isfinite(foot))
    radius, height = 0.5 * np.asarray(trees.diameter, float), np.asarray(trees.height, float)
    capacity = np.full(len(radius), np.inf) if trees.capacity is None else np.asarray(trees.capacity, float)
    solid = tree_file.prepare(plan[there], foot[there], radius[there], height[there], there, capacity[there])
    return solid, np.flatnonzero(~np.isfinite(foot))
