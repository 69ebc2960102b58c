"""Defects of a terrain model that make a plausible run wrong: heights in feet, cells too coarse to hold a log."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.heights import STEEPEST_DEG, holes_in, slopes_of, steep_words
from deadwood_algorithms.params.counts import significant
from deadwood_algorithms.params.tool import Feedback

# Relief smaller than a log holds it, and cells larger than this have no such relief: of 20 logs on a steep hillside all
# left it with cells of 5 m, and all came to rest with cells of 0.5 m.
COARSEST_M = 2.0
ROWS_LOOKED_AT = 500


def warn_of_ground(grid: Grid, x: NDArray[np.float64], y: NDArray[np.float64], feedback: Feedback) -> None:
    """Warn of coarse cells, of holes, and of impossible slopes, at the places where logs start [m]."""
    warn_of_cells(grid, feedback)
    there = slope_at_deg(grid, x, y)
    if there > STEEPEST_DEG and median_slope_deg(grid) <= STEEPEST_DEG:  # else reported when the DEM was opened
        feedback.warn(steep_words(grid.path, there, "where the logs start"), code="steep", slope_deg=there)


def warn_of_cells(grid: Grid, feedback: Feedback) -> None:
    """Warn of coarse cells and of holes."""
    if grid.cell > COARSEST_M:
        feedback.warn(
            f"{grid.path}: cells of {grid.cell:g} m do not resolve the relief that holds logs, so too many slide, "
            f"and too far; use a terrain model with cells of 0.5 to {COARSEST_M:g} m",
            code="coarse-cells",
            cell_m=grid.cell,
            largest_m=COARSEST_M,
        )
    holes = holes_in(grid.values)
    if holes:
        several = f"{holes.number} parts" if holes.number > 1 else "a part"
        largest = f", the largest {significant(holes.largest * grid.cell**2, 4)} m²" if holes.number > 1 else ""
        place = grid.x0 + holes.column * grid.cell, grid.y0 + holes.row * grid.cell
        feedback.warn(
            f"{grid.path}: {several} without heights inside the DEM "
            f"({significant(holes.cells * grid.cell**2, 4)} m²{largest}, "
            f"near {place[0]:.0f}, {place[1]:.0f}): logs that get there end as if they had left it (left_dem); fill "
            "them from another terrain model, or by interpolation (in QGIS: Fill NoData)",
            code="holes",
            holes=holes.number,
            area_m2=holes.cells * grid.cell**2,
        )


def median_slope_deg(grid: Grid) -> float:
    """Median slope from a sufficient number of rows; 0 if no two adjacent cells have heights."""
    step = max(1, grid.shape[0] // ROWS_LOOKED_AT)
    rows = np.arange(0, grid.shape[0] - 1, step)
    slopes = np.concatenate([slopes_of(grid.values[row : row + 2], grid.cell) for row in rows])
    return float(np.degrees(np.arctan(np.median(slopes)))) if slopes.size else 0.0


def slope_at_deg(grid: Grid, x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Median slope at places, each across two cells; 0 if none has heights around it."""
    h = grid.cell
    east = grid.height(x + h, y) - grid.height(x - h, y)
    north = grid.height(x, y + h) - grid.height(x, y - h)
    rise = np.hypot(east, north) / (2.0 * h)
    rise = rise[np.isfinite(rise)]
    return float(np.degrees(np.arctan(np.median(rise)))) if rise.size else 0.0
