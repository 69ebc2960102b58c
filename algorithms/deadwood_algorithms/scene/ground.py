"""What of a terrain model makes a run wrong that looks right: heights in feet, cells too coarse to hold a log."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files import remedies
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Feedback

# Relief that is smaller than a log holds it, and cells larger than this know none: of 20 logs on one steep hillside all
# left it with cells of 5 m, and all came to rest with cells of 0.5 m.
COARSEST_M = 2.0
# Heights in feet make of a slope of 30 degrees one of 62. No hillside of any size is that steep in its middle.
STEEPEST_DEG = 58.0
ROWS_LOOKED_AT = 500
FOOT_M = 0.3048


def warn_of_ground(grid: Grid, x: NDArray[np.float64], y: NDArray[np.float64], feedback: Feedback) -> None:
    """Warn of coarse cells, and of slopes that no ground has, over the DEM or where the logs start [m]."""
    if grid.cell > COARSEST_M:
        feedback.warn(
            f"{grid.path}: cells of {grid.cell:g} m know nothing of the relief that holds logs, so that too many "
            f"slide, and too far; take a terrain model with cells of 0.5 to {COARSEST_M:g} m"
        )
    slope, there = median_slope_deg(grid), slope_at_deg(grid, x, y)
    steeper = max(slope, there)
    if steeper > STEEPEST_DEG:
        true = np.degrees(np.arctan(np.tan(np.radians(steeper)) * FOOT_M))
        where = "over its cells" if slope > STEEPEST_DEG else "where the logs start"
        feedback.warn(
            f"{grid.path}: the median slope {where} is {steeper:.0f} degrees, as hardly any ground has; are its "
            f"heights in feet (then it is {true:.0f} degrees), or in another unit than metres? Mend: "
            f"{remedies.times(grid.path, FOOT_M)}"
        )


def median_slope_deg(grid: Grid) -> float:
    """Of so many rows as tell it; 0 where no two cells have heights."""
    step = max(1, grid.shape[0] // ROWS_LOOKED_AT)
    rows = np.arange(0, grid.shape[0] - 1, step)
    low, high = grid.values[rows], grid.values[rows + 1]
    rise = np.hypot(np.diff(low, axis=1), (high - low)[:, :-1]) / grid.cell
    rise = rise[np.isfinite(rise)]
    return float(np.degrees(np.arctan(np.median(rise)))) if rise.size else 0.0


def slope_at_deg(grid: Grid, x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """The median over places, each across two cells; 0 where none has heights around it."""
    h = grid.cell
    east = grid.height(x + h, y) - grid.height(x - h, y)
    north = grid.height(x, y + h) - grid.height(x, y - h)
    rise = np.hypot(east, north) / (2.0 * h)
    rise = rise[np.isfinite(rise)]
    return float(np.degrees(np.arctan(np.median(rise)))) if rise.size else 0.0
