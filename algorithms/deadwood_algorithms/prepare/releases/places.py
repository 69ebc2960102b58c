"""Places inside release areas: uniform by area, or in proportion to the weights of a raster.

For `sample_releases`. Each log draws from its own stream until it is inside, independently of all other logs.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.prepare.releases.weights import Weights
from deadwood_algorithms.stats import draws

# Smallest share of the bounding box; below it drawing would take forever, and no release area is so narrow.
SLIMMEST_AREA = 1e-4
# Turns of drawing a place by weights. An area with a thousandth of the weight of its extent needs some 10 000 of them.
TURNS = 100_000


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
    """Places [m] in a circle or polygon (None: anywhere on the DEM) with a density proportional to the weights, shape
    (n, 2).

    A cell is drawn by its weight, then a place in it uniformly, and both again if the place is outside: the density is
    exactly in proportion to the weights, also in cells cut by the outline.
    """
    cells = weights.everywhere if area is None else weights.cells(bounds_of(area, radius, where))
    if cells is None or not cells.count:
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
        x, y, inside = cells.places(pick, u, v)
        if area is not None and area.geom_type == "Point":
            inside &= np.hypot(x - area.x, y - area.y) <= radius
        elif area is not None:
            inside &= shapely.contains_xy(area, x, y)
        place[left[inside]] = np.column_stack((x, y))[inside]
        left, turn = left[~inside], turn + 1
    return place


def bounds_of(area: Any, radius: float, where: str) -> tuple[float, float, float, float]:
    """West, south, east and north end of a point's circle or a polygon [m]; a polygon as narrow as a thread is
    rejected.
    """
    west, south, east, north = area.bounds
    if area.geom_type == "Point":
        return west - radius, south - radius, east + radius, north + radius
    if area.area <= SLIMMEST_AREA * (east - west) * (north - south):
        raise UserError(f"{where}: the polygon is too narrow ({area.area:.3g} m2 in its extent); draw it wider")
    return west, south, east, north


def area_m2(area: Any, radius: float, weights: Weights | None) -> float:
    """Of a circle or polygon; without an area, of the cells that have a weight."""
    if area is None:
        assert weights is not None
        assert weights.everywhere is not None
        return float(weights.everywhere.count) * weights.ground.cell**2
    return float(np.pi * radius**2 if area.geom_type == "Point" else area.area)
