"""The part of a large terrain model on which the logs of a release are first slid; where it is too small, it grows.

A whole 4000 x 4000 cells would do as well, to the bit, but drawing 300 logs on so many cells and sending what they hit
takes longer than sliding them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.grid import Grid, Part

WHOLE_CELLS = 1_000_000  # a terrain model of so many cells at most needs no window
STEP_M = 8.0  # of the walk down the slope
MOST_DOWN_M = 500.0  # that it goes
BESIDE_M = 130.0  # the window goes beyond the walk and the release: logs spread
LEVEL = 0.1  # [-] fall of a step below which the walk ends: most logs have stopped by then
DIRECTIONS = tuple((math.sin(a), math.cos(a)) for a in np.linspace(0.0, 2.0 * math.pi, 16, endpoint=False))


def first_part(grid: Grid, area: Any, radius_m: float) -> Part:
    """The window around a release and the steepest way down from its middle; the whole of a small terrain model."""
    if grid.part.cells <= WHOLE_CELLS:
        return grid.part
    west, south, east, north = area.bounds
    ways = np.array([(west - radius_m, south - radius_m), (east + radius_m, north + radius_m), *way_down(grid, area)])
    low, high = ways.min(axis=0) - BESIDE_M, ways.max(axis=0) + BESIDE_M
    column, row = (math.floor((low[k] - (grid.x0, grid.y0)[k]) / grid.cell) for k in (0, 1))
    columns, rows = (math.ceil((high[k] - low[k]) / grid.cell) for k in (0, 1))
    return Part(column, row, columns, rows).cut_to(grid.shape)


def way_down(grid: Grid, area: Any) -> list[tuple[float, float]]:
    """Places [m] along the steepest way down, in steps that look over small bumps."""
    x, y = area.centroid.x, area.centroid.y
    step = max(STEP_M, 4.0 * grid.cell)
    found = []
    for _ in range(round(MOST_DOWN_M / step)):
        around: NDArray[np.float64] = np.array([(x + step * east, y + step * north) for east, north in DIRECTIONS])
        heights = grid.height(*around.T)
        if not np.isfinite(heights).any():
            break
        lowest = int(np.nanargmin(heights))
        here = float(grid.height(x, y))
        if not here - heights[lowest] > LEVEL * step:
            break
        x, y = around[lowest].tolist()
        found.append((x, y))
    return found


def holds(part: Part, other: Part) -> bool:
    return part.joined(other) == part
