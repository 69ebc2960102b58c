"""How much of a terrain model changes from one cell to the next: what the long steps of ``draft`` pass over.

On random slopes with noise of 0.32 of a cell (8 cm on cells of 25 cm) the reach of lines was +12.2 +- 4.2 points at
`draft` and +3.0 +- 1.6 at `standard`, with less than 0.15 of a cell right. That was before steps shortened on such
ground; since then most of the error is gone, but it is still where `draft` is farthest off.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.messages import Feedback

SQUARE, MOST = 64, 250  # [cells] side of the squares in which heights are compared; how many of them, at most
DOUBTED = 0.15  # of a cell
MEDIAN = 0.6745  # median absolute value of a normal number of standard deviation 1


def cell_noise(dem: Grid, x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Standard deviation [m] of the heights' noise around these places; NaN where no heights are known.

    The second difference along columns of the second difference along rows (nine heights) is 0 on planes, and on
    ridges, steps and curvature along rows or columns; of independent errors it has six times the standard deviation
    (Immerkaer 1996). Its median ignores the cells of boulders, walls and edges.
    """
    squares = np.unique(
        np.floor(np.column_stack([y - dem.y0, x - dem.x0]) / dem.cell / SQUARE).astype(np.int64), axis=0
    )
    found: list[NDArray[np.float64]] = []
    for row, column in SQUARE * squares[:: -(-len(squares) // MOST)]:
        heights = dem.values[max(0, row) : max(0, row + SQUARE), max(0, column) : max(0, column + SQUARE)]
        if min(heights.shape) > 2:
            found.append(np.diff(np.diff(heights.astype(np.float64), 2, axis=0), 2, axis=1).ravel())
    return noise_of(np.concatenate(found)) if found else np.nan


def noise_of(differences: NDArray[np.float64]) -> float:
    """Standard deviation [m] of the noise of heights, from such double differences of them; NaN if none is known."""
    known = np.abs(differences[np.isfinite(differences)])
    return float(np.median(known)) / (6.0 * MEDIAN) if known.size else np.nan


def doubt_draft(dem: Grid, x: NDArray[np.float64], y: NDArray[np.float64], feedback: Feedback) -> None:
    """Warn, before a run at ``draft``, if the noise at these places is more than a small part of a cell."""
    noise_m = cell_noise(dem, x, y)
    share = noise_m / dem.cell
    if share > DOUBTED:
        feedback.warn(
            f"heights near the releases are rough from cell to cell: {100.0 * noise_m:.0f} cm (standard deviation) on "
            f"cells of {dem.cell:g} m, or {share:.2f} of a cell. Logs at draft go too far on ground with more than "
            f"{DOUBTED:g}; use --fidelity standard",
            code="dem-noise",
            noise_m=noise_m,
            cell_m=dem.cell,
            noise_per_cell=share,
        )
