"""The scene that logs slide through, as plain arrays. What a scene lacks has zero rows and costs nothing."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import barriers as barrier_file
from . import lying_logs as lying_file
from . import terrain as terrain_file
from . import trees as tree_file
from .barriers import Barriers, Plates
from .cloud import Cloud
from .lines import Lines, Segments, segments_of
from .lying_logs import LyingLogs, Pieces
from .terrain import Terrain, surfaces
from .trees import Trees, Uprights

Array = NDArray[np.float64]


class SceneArrays(NamedTuple):
    """What the kernels read."""

    terrain: Terrain
    uprights: Uprights
    plates: Plates
    lying: Pieces
    joints: np.ndarray  # bool, of each upright: a barrier's post within a straight stretch, flush with its plates
    cloud: Cloud | None  # the shape that slides; None where logs do: its kernels are then not even compiled
    lines: Segments
    fences: Segments  # the barriers' lines in plan, for the ledger


@dataclass(frozen=True)
class Scene:
    """A prepared scene; ``arrays`` is for kernels, the rest says what it holds.

    trees_outside, barriers_outside, lying_outside : int64, rows of what is on no terrain and is therefore not modelled
    """

    arrays: SceneArrays
    tree_count: int
    barrier_count: int
    line_count: int
    trees_outside: NDArray[np.int64]
    barriers_outside: NDArray[np.int64]
    lying_count: int
    lying_outside: NDArray[np.int64]

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
        first: tuple[int, int] = (0, 0),
        reference: float | None = None,
    ) -> Scene:
        """Check and lay out a scene.

        Parameters
        ----------
        heights : [m], shape (rows, columns), row 0 southernmost, NaN outside; heights at cell centres
        cell : [m]; x0, y0 : world position of the centre of cell (0, 0) of the whole DEM [m]
        first : column and row of the whole DEM where heights[0, 0] stands, when the heights are a window of it
        reference : [m] height that is zero in the kernels; the same for all windows of a DEM, or bits differ
        friction : Coulomb's coefficient, one value or one a cell
        trees, barriers, lines, lying_logs : world coordinates [m]

        Raises
        ------
        ValueError
            for a terrain, friction, tree, barrier or lying log that cannot be one
        """
        trees, barriers, lines = trees or Trees.none(), barriers or Barriers.none(), lines or Lines.none()
        terrain = terrain_file.prepare(heights, cell, x0, y0, friction, first, reference)
        for name, values in (("diameter", trees.diameter), ("height", trees.height), ("height", barriers.height)):
            if not np.all(np.isfinite(values) & (np.asarray(values) > 0)):
                raise ValueError(f"a tree's or barrier's {name} must be positive and finite")
        for name, vertices in (("barrier", barriers), ("line", lines), ("lying log", lying_logs or LyingLogs.none())):
            if not np.isfinite(vertices.vertices).all():
                raise ValueError(f"a vertex of a {name} is no finite place")
        plates, posts, barriers_outside = _plates_and_posts(terrain, barriers)
        uprights, trees_outside = _uprights(terrain, trees, posts)
        joints = np.concatenate([np.zeros(len(uprights.owner) - len(posts), np.bool_), posts[:, 5] > 0.0])
        lying_logs = lying_logs or LyingLogs.none()
        lying, lying_outside = lying_file.prepare(terrain, lying_logs, len(trees.x))
        fence = Lines(barriers.vertices, barriers.starts)
        uprights, plates, lying = (_in_window(items, terrain) for items in (uprights, plates, lying))
        arrays = SceneArrays(
            terrain,
            uprights,
            plates,
            lying,
            joints,
            None,
            segments_of(lines, terrain.x0, terrain.y0),
            segments_of(fence, x0, y0),
        )
        return Scene(
            arrays, len(trees.x), len(barriers.height), len(lines.starts) - 1, trees_outside, barriers_outside,
            len(lying_logs.diameter), lying_outside,
        )  # fmt: skip

    def terrain_height(self, x: Array, y: Array) -> Array:
        """Height [m] of the bilinear surface; NaN outside."""
        return self.terrain_surface(x, y)[:, 0]

    def terrain_surface(self, x: Array, y: Array) -> Array:
        """Height [m] and gradient (east, north) of the surface at world positions, shape (n, 3); NaN height outside."""
        terrain = self.arrays.terrain
        x, y = np.atleast_1d(x), np.atleast_1d(y)
        found = _surfaces(terrain, np.asarray(x, float) - terrain.x0, np.asarray(y, float) - terrain.y0)
        found[:, 0] += terrain.reference
        return found


def _in_window(items: Any, terrain: Terrain) -> Any:
    """Items laid out in the nodes of the whole DEM, in those of the window that the heights are."""
    index, cell = items.index, terrain.cell
    index = index._replace(x0=index.x0 - terrain.column * cell, y0=index.y0 - terrain.row * cell)
    return items._replace(node=items.node - (terrain.column, terrain.row), index=index)


def _surfaces(terrain: Terrain, x: Array, y: Array) -> Array:
    found = np.empty((len(x), 3))
    surfaces(terrain, np.ascontiguousarray(x, float), np.ascontiguousarray(y, float), found)
    return found


def _uprights(terrain: Terrain, trees: Trees, posts: Array) -> tuple[Uprights, NDArray[np.int64]]:
    """Trees on the terrain, then the barriers' posts (plan x, y, foot, top, barrier)."""
    plan = np.column_stack([trees.x, trees.y]).astype(float).reshape(-1, 2) - (terrain.x0, terrain.y0)
    foot = _surfaces(terrain, plan[:, 0], plan[:, 1])[:, 0]
    standing = np.isfinite(foot)
    radius, height = 0.5 * np.asarray(trees.diameter, float), np.asarray(trees.height, float)
    zero = np.zeros(len(posts))
    uprights = tree_file.prepare(
        np.vstack([plan[standing], posts[:, :2]]),
        np.concatenate([foot[standing], posts[:, 2]]),
        np.concatenate([(foot + height)[standing], posts[:, 3]]),
        np.concatenate([radius[standing], zero]),
        np.concatenate([(-0.5 * radius / height)[standing], zero]),  # the paper: the top is half the DBH
        np.concatenate([np.flatnonzero(standing), -1 - posts[:, 4]]).astype(np.int64),
        terrain.cell,
    )
    return uprights, np.flatnonzero(~standing)


def _straight(points: Array) -> NDArray[np.bool_]:
    """Which points of a line lie within a straight stretch of it."""
    way = np.diff(points, axis=0)
    way /= np.linalg.norm(way, axis=1)[:, None]
    turn = way[:-1, 0] * way[1:, 1] - way[:-1, 1] * way[1:, 0]
    onward = (way[:-1] * way[1:]).sum(axis=1) > 0.0
    return np.concatenate([[False], (np.abs(turn) < 1e-6) & onward, [False]])


def _plates_and_posts(terrain: Terrain, barriers: Barriers) -> tuple[Plates, Array, NDArray[np.int64]]:
    """Cut barriers into pieces of a few cells; those with a part off the terrain lose that part."""
    piece = max(2.0, 4.0 * terrain.cell)
    starts, ends, posts, outside = [], [], [], []
    plan = np.asarray(barriers.vertices, float).reshape(-1, 2) - (terrain.x0, terrain.y0)
    for row, height in enumerate(barriers.height):
        corners = plan[barriers.starts[row] : barriers.starts[row + 1]]
        cuts = [corners[:1]]
        for a, b in pairwise(corners):
            number = max(1, int(np.ceil(np.hypot(*(b - a)) / piece)))
            if np.hypot(*(b - a)) > 0:
                cuts.append(a + (b - a) * (np.arange(1, number + 1) / number)[:, None])
        points = np.vstack(cuts)
        ground = _surfaces(terrain, points[:, 0], points[:, 1])[:, 0]
        valid = np.isfinite(ground)
        both = valid[:-1] & valid[1:]
        if not both.any():
            outside.append(row)
            continue
        top = ground + height
        joint = _straight(points) & np.append(False, both) & np.append(both, False)
        rise = np.diff(top) / np.linalg.norm(np.diff(points, axis=0), axis=1)
        rise_before = np.where(joint[:-1], np.append(np.nan, rise[:-1]), np.nan)
        starts.append(np.column_stack([points[:-1], top[:-1], rise_before, np.full(len(points) - 1, row)])[both])
        ends.append(np.column_stack([points[1:], top[1:]])[both])
        posts.append(np.column_stack([points, ground, top, np.full(len(points), row), joint])[valid])
    first = np.vstack([np.zeros((0, 5)), *starts])
    last = np.vstack([np.zeros((0, 3)), *ends])
    plates = barrier_file.prepare(
        first[:, :2], last[:, :2], first[:, 2], last[:, 2], first[:, 3], first[:, 4].astype(np.int64), terrain.cell
    )
    return plates, np.vstack([np.zeros((0, 6)), *posts]), np.array(outside, np.int64)
