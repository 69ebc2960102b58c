"""Places for the trees of a random forest: on the DEM, inside polygons, clear of each other.

For `generate_forest`. Places are drawn uniformly by area; what a tree draws comes from the seed and its own number.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from deadwood_algorithms import draws
from deadwood_algorithms.layers import Grid
from deadwood_algorithms.tool import Cancelled, Feedback, UserError

# Random sequential packing of discs ends at a cover of 0.547; near it the planting takes for ever.
DENSEST_COVER = 0.5
TURNS = 2000  # of drawing a place, before it is called impossible


@dataclass(frozen=True)
class Ground:
    """Where trees may stand: the DEM, within the polygons if there are any; ``area`` [m2]."""

    grid: Grid
    polygons: Any  # shapely Polygon or MultiPolygon, None: everywhere on the DEM
    bounds: tuple[float, float, float, float]
    area: float

    def holds(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        on = self.grid.contains(x, y)
        return on if self.polygons is None else on & shapely.contains_xy(self.polygons, x, y)


def ground_of(grid: Grid, stand: Any, exclude: Any) -> Ground:
    """Where trees may stand; its area counts the patches between four heights, and of polygons what lies on such."""
    ny, nx = grid.shape
    west, south = grid.x0, grid.y0
    box = shapely.box(west, south, west + (nx - 1) * grid.cell, south + (ny - 1) * grid.cell)
    z = np.isfinite(grid.values)
    patch = z[:-1, :-1] & z[1:, :-1] & z[:-1, 1:] & z[1:, 1:]
    if stand is None and exclude is None:
        return Ground(grid, None, box.bounds, float(patch.sum()) * grid.cell**2)
    shape = shapely.intersection(box, stand) if stand is not None else box
    shape = shapely.difference(shape, exclude) if exclude is not None else shape
    if not shape.area > 0:
        raise UserError("--stand and --exclude leave no place on the DEM for a tree; check the polygons and their CRS")
    shapely.prepare(shape)
    columns = west + (np.arange(nx - 1) + 0.5) * grid.cell
    total = on = 0
    for row in range(ny - 1):  # by rows, so that a large DEM needs no second one in memory
        inside = shapely.contains_xy(shape, columns, south + (row + 0.5) * grid.cell)
        total, on = total + int(inside.sum()), on + int((inside & patch[row]).sum())
    area = shape.area * (on / total if total else 1.0)
    if not area > 0:
        raise UserError("--stand lies wholly on nodata of the DEM; take another DEM or stand")
    return Ground(grid, shape, shape.bounds, area)


def plant(ground: Ground, count: int, spacing: float, seed: int, feedback: Feedback) -> tuple[np.ndarray, np.ndarray]:
    """Places of the trees [m]: each draws until it stands on the ground, and clear of those before it."""
    if spacing and count * np.pi * (spacing / 2) ** 2 > DENSEST_COVER * ground.area:
        most = DENSEST_COVER * 1e4 / (np.pi * (spacing / 2) ** 2)
        raise UserError(
            f"--min-spacing-m {spacing:g} leaves no room for {count / ground.area * 1e4:.0f} stems/ha, "
            f"at most for {most:.0f}; lower one of them"
        )
    place = np.empty((count, 2))
    turn = np.zeros(count, np.int64)  # of the draw that each tree has come to
    left = np.arange(count)
    while left.size:
        place[left], turn[left] = next_place(ground, left, turn[left], seed)
        left = too_near(place, spacing)
        feedback.progress(count - left.size, count, "planting trees")
        if feedback.cancelled():
            raise Cancelled
        if left.size and turn[left].max() > TURNS:
            raise UserError(f"--min-spacing-m {spacing:g} leaves no room for tree {left[0] + 1} of {count}; lower it")
    return place[:, 0], place[:, 1]


def next_place(ground: Ground, tree: np.ndarray, turn: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """For each tree the first place on the ground among its draws from ``turn`` on, and the turn after it."""
    west, south, east, north = ground.bounds
    place, turn = np.empty((tree.size, 2)), turn.copy()
    left = np.arange(tree.size)
    while left.size:
        u, v = draws.uniforms(seed, tree[left] + 1, draws.TREE_PLACE, turn[left])
        x, y = west + u * (east - west), south + v * (north - south)
        place[left] = np.column_stack((x, y))
        turn[left] += 1
        left = left[~ground.holds(x, y)]
    return place, turn


def too_near(place: np.ndarray, spacing: float) -> np.ndarray:
    """Rows of the trees that stand within ``spacing`` [m] of a tree before them.

    That tree may itself have to move; but a tree looks only at those before it, so the first k never learn of the rest.
    """
    if not spacing:
        return np.empty(0, np.int64)
    points = np.asarray(shapely.points(place))
    one, other = shapely.STRtree(points).query(points, predicate="dwithin", distance=spacing)
    return np.unique(one[other < one])
