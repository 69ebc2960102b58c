"""Places inside release areas: uniform by area, or in proportion to the weights of a raster.

For `sample_releases`. Each log draws from its own stream until it is inside: no other log has a say in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.stats import draws

# Of the bounding box; below it the drawing would take for ever, and no release area is such a thread.
SLIMMEST_AREA = 1e-4
# Of drawing a place by weights. An area that holds a thousandth of the weight of its extent needs some 10 000 of them.
TURNS = 100_000


@dataclass(frozen=True)
class Weights:
    """Weights of the DEM's cells, 0 where there is none or no height; ``path`` is the raster's."""

    values: np.ndarray
    grid: Grid
    path: str


def read_weights(path: str, grid: Grid, feedback: Feedback) -> Weights:
    """A raster of weights >= 0 on the cells of the DEM."""
    from deadwood_algorithms.files.rasters import read_raster_on

    values = np.asarray(read_raster_on(path, grid, what="weights", feedback=feedback), np.float64)
    if np.nanmin(values, initial=np.inf) < 0:
        raise UserError(f"{path}: a weight is {np.nanmin(values):g}, but must not be negative; correct the raster")
    if np.isposinf(values).any():
        raise UserError(f"{path}: a weight is infinite; correct the raster")
    values = np.where(np.isfinite(values) & np.isfinite(grid.values), values, 0.0)
    if not values.any():
        raise UserError(f"{path}: no cell on the DEM has a weight above 0; check the raster and its CRS")
    return Weights(values, grid, path)


def positions(area: Any, radius: float, seed: int, log_id: np.ndarray, where: str) -> np.ndarray:
    """Places drawn uniformly in a point's circle or a polygon, for these logs [m], shape (n, 2)."""
    west, south, east, north = bounds_of(area, radius, where)
    circle = area.geom_type == "Point"
    shapely.prepare(area)
    place = np.empty((log_id.size, 2))
    left, turn = np.arange(log_id.size), 0
    while left.size:
        u, v = draws.uniforms(seed, log_id[left], draws.LOG_PLACE, turn)
        x, y = west + u * (east - west), south + v * (north - south)
        if circle:
            inside = ((2 * u - 1) ** 2 + (2 * v - 1) ** 2 <= 1) | (radius == 0)
        else:
            inside = shapely.contains_xy(area, x, y)
        place[left[inside]] = np.column_stack((x, y))[inside]
        left, turn = left[~inside], turn + 1
    return place


def weighted_positions(
    area: Any, radius: float, weights: Weights, seed: int, log_id: np.ndarray, where: str
) -> np.ndarray:
    """Places in a circle or polygon (None: anywhere on the DEM) as dense as the weights say [m], shape (n, 2).

    A cell is drawn by its weight, a place in it uniformly, and both again where that is outside: what is left is
    exactly in proportion to the weights, also in cells that the outline cuts.
    """
    grid = weights.grid
    bounds = grid.bounds if area is None else bounds_of(area, radius, where)
    i0, i1 = cells_between(bounds[0], bounds[2], grid.x0, grid.cell, grid.shape[1])
    j0, j1 = cells_between(bounds[1], bounds[3], grid.y0, grid.cell, grid.shape[0])
    window = weights.values[j0:j1, i0:i1]
    columns = window.shape[1]
    total = np.cumsum(window, axis=None) if window.size else np.zeros(1)
    if not total[-1] > 0:
        raise UserError(f"{where}: no cell of {weights.path} in this area has a weight above 0; delete or move it")
    place = np.empty((log_id.size, 2))
    left, turn = np.arange(log_id.size), 0
    if area is not None:
        shapely.prepare(area)
    while left.size:
        if turn == TURNS:
            raise UserError(
                f"{where}: the cells of {weights.path} with a weight above 0 hardly touch this area; draw it wider"
            )
        pick, _ = draws.uniforms(seed, log_id[left], draws.LOG_CELL, turn)
        u, v = draws.uniforms(seed, log_id[left], draws.LOG_PLACE, turn)
        cell = np.minimum(np.searchsorted(total, pick * total[-1], side="right"), total.size - 1)
        x = grid.frame.x0 + (grid.first[0] + i0 + cell % columns + u - 0.5) * grid.cell
        y = grid.frame.y0 + (grid.first[1] + j0 + cell // columns + v - 0.5) * grid.cell
        inside = grid.contains(x, y)
        if area is not None and area.geom_type == "Point":
            inside &= np.hypot(x - area.x, y - area.y) <= radius
        elif area is not None:
            inside &= shapely.contains_xy(area, x, y)
        place[left[inside]] = np.column_stack((x, y))[inside]
        left, turn = left[~inside], turn + 1
    return place


def bounds_of(area: Any, radius: float, where: str) -> tuple[float, float, float, float]:
    """West, south, east and north end of a point's circle or a polygon [m]; a polygon like a thread is refused."""
    west, south, east, north = area.bounds
    if area.geom_type == "Point":
        return west - radius, south - radius, east + radius, north + radius
    if area.area <= SLIMMEST_AREA * (east - west) * (north - south):
        raise UserError(f"{where}: the polygon is too slim ({area.area:.3g} m2 in its extent); draw it wider")
    return west, south, east, north


def cells_between(low: float, high: float, origin: float, cell: float, count: int) -> tuple[int, int]:
    """First and one past the last of the cells that reach into a span [m]; ``origin`` is the centre of the first."""
    first = int(np.floor((low - origin) / cell + 0.5))
    last = int(np.floor((high - origin) / cell + 0.5)) + 1
    return min(max(first, 0), count), min(max(last, 0), count)


def area_m2(area: Any, radius: float, weights: Weights | None) -> float:
    """Of a circle or polygon; without an area, of the cells that have a weight."""
    if area is None:
        assert weights is not None
        return float(np.count_nonzero(weights.values)) * weights.grid.cell**2
    return float(np.pi * radius**2 if area.geom_type == "Point" else area.area)
