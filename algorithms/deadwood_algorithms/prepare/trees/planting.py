"""Places for the trees of a random forest: on the DEM, inside polygons, at a distance from each other.

For `generate_forest`. Places are drawn uniformly by area; the draws of a tree depend on the seed and its own number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from deadwood_algorithms.params.tool import Cancelled, Feedback, UserError
from deadwood_algorithms.prepare.trees.patches import Patches
from deadwood_algorithms.stats import draws

# Random sequential packing of discs saturates at a cover of 0.547; near it planting takes forever.
DENSEST_COVER = 0.5
TURNS = 2000  # attempts to draw a place before it is reported as impossible


@dataclass(frozen=True)
class Ground:
    """Where trees may stand: the DEM, within the polygons if there are any; ``area`` [m2]."""

    patches: Patches
    polygons: Any  # shapely Polygon or MultiPolygon, None: everywhere on the DEM
    bounds: tuple[float, float, float, float]
    area: float

    def holds(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        on = self.patches.hold(x, y)
        return on if self.polygons is None else on & shapely.contains_xy(self.polygons, x, y)


def ground_of(patches: Patches, stand: Any, exclude: Any) -> Ground:
    """Where trees may stand; the area is that of the patches between four heights, inside the polygons if there are
    any.
    """
    dem = patches.dem
    ny, nx = dem.shape
    west, south = dem.x0, dem.y0
    box = shapely.box(west, south, west + (nx - 1) * dem.cell, south + (ny - 1) * dem.cell)
    if stand is None and exclude is None:
        return Ground(patches, None, box.bounds, patches.count * dem.cell**2)
    shape = shapely.intersection(box, stand) if stand is not None else box
    shape = shapely.difference(shape, exclude) if exclude is not None else shape
    if not shape.area > 0:
        raise UserError("--stand and --exclude leave no place on the DEM for a tree; check the polygons and their CRS")
    shapely.prepare(shape)
    area = shape.area * (1.0 if patches.whole else _share_on(patches, shape))
    if not area > 0:
        raise UserError("--stand lies entirely on nodata of the DEM; choose another DEM or stand")
    return Ground(patches, shape, shape.bounds, area)


def _share_on(patches: Patches, shape: Any) -> float:
    """The share of the patches with their centre in a polygon that exist; 1 if there is no such patch."""
    dem = patches.dem
    (left, low), (right, high) = (
        [max(int((each - first) / dem.cell), 0) for each, first in zip(corner, (dem.x0, dem.y0), strict=True)]
        for corner in (shape.bounds[:2], shape.bounds[2:])
    )
    column = np.arange(left, min(right + 1, dem.shape[1] - 1))
    total = on = 0
    for row in range(low, min(high + 1, dem.shape[0] - 1)):
        x, y = dem.x0 + (column + 0.5) * dem.cell, dem.y0 + (row + 0.5) * dem.cell
        inside = column[shapely.contains_xy(shape, x, y)]
        total, on = total + inside.size, on + int(patches.has(np.full(inside.shape, row), inside).sum())
    return on / total if total else 1.0


def plant(
    grounds: Sequence[Ground], counts: Sequence[int], spacing: float, seed: int, feedback: Feedback
) -> tuple[np.ndarray, np.ndarray]:
    """Places of the trees [m], by ground: each draws until it stands on its ground and far enough from earlier
    trees.
    """
    for ground, count in zip(grounds, counts, strict=True):
        if spacing and count * np.pi * (spacing / 2) ** 2 > DENSEST_COVER * ground.area:
            most = DENSEST_COVER * 1e4 / (np.pi * (spacing / 2) ** 2)
            raise UserError(
                f"--min-spacing-m {spacing:g} leaves no room for {count / ground.area * 1e4:.0f} stems/ha, "
                f"only for {most:.0f} at most; lower one of the two"
            )
    total = sum(counts)
    of_ground = np.repeat(np.arange(len(grounds)), counts)
    tree = numbers_of_trees(counts)
    place = np.empty((total, 2))
    turn = np.zeros(total, np.int64)  # number of the draw that each tree has reached
    left = np.arange(total)
    while left.size:
        for number in np.unique(of_ground[left]):
            these = left[of_ground[left] == number]
            place[these], turn[these] = next_place(grounds[number], tree[these], turn[these], seed)
        left = too_near(place, spacing)
        feedback.progress(total - left.size, total, "planting trees")
        if feedback.cancelled():
            raise Cancelled
        if left.size and turn[left].max() > TURNS:
            raise UserError(f"--min-spacing-m {spacing:g} leaves no room for tree {left[0] + 1} of {total}; lower it")
    return place[:, 0], place[:, 1]


def numbers_of_trees(counts: Sequence[int]) -> np.ndarray:
    """The number of each tree for the random draws: its number in its ground, from 1, with the ground's in the upper
    bits.

    So a tree keeps its place and sizes when another ground gets more trees.
    """
    return np.concatenate([(number << 32) + np.arange(1, count + 1) for number, count in enumerate(counts)])


def next_place(ground: Ground, tree: np.ndarray, turn: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """The first place of each tree (`numbers_of_trees`) that is on the ground, among its draws from ``turn`` on; and
    the next turn.
    """
    west, south, east, north = ground.bounds
    place, turn = np.empty((tree.size, 2)), turn.copy()
    left = np.arange(tree.size)
    while left.size:
        u, v = draws.uniforms(seed, tree[left], draws.TREE_PLACE, turn[left])
        x, y = west + u * (east - west), south + v * (north - south)
        place[left] = np.column_stack((x, y))
        turn[left] += 1
        left = left[~ground.holds(x, y)]
    return place, turn


def too_near(place: np.ndarray, spacing: float) -> np.ndarray:
    """Rows of the trees that stand within ``spacing`` [m] of an earlier tree.

    That tree may itself have to move; but a tree depends only on earlier ones, so the first k are independent of the
    rest.
    """
    if not spacing:
        return np.empty(0, np.int64)
    points = np.asarray(shapely.points(place))
    one, other = shapely.STRtree(points).query(points, predicate="dwithin", distance=spacing)
    return np.unique(one[other < one])
