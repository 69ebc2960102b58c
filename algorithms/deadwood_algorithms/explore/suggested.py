"""Where the page releases its first logs: on steep ground above a line, found on a coarse terrain as water flows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

SKETCH = 120  # cells along the longer side, at most: coarse enough that rough ground has no pits
STEEP_DEG = 28.0, 50.0  # where logs start to slide, and soil still lies
RADIUS_M = 10.0
AROUND = [(row, column) for row in (-1, 0, 1) for column in (-1, 0, 1) if (row, column) != (0, 0)]


def suggested_place(
    cell: float, heights: NDArray[np.floating], lines: Sequence[Mapping[str, Any]]
) -> list[float] | None:
    """Centre [m from the south-west corner] and radius [m] of a release; None where no ground is steep.

    heights : [m], row 0 in the north; NaN outside. Of the steep cells from which water runs to a line (of all steep
    cells, if from none or there is none), the one whose way is of median length.
    """
    rows, columns = heights.shape
    edge = 1 + int(RADIUS_M / cell)
    if min(rows, columns) <= 2 * edge:
        return None
    z = np.pad(np.where(np.isfinite(heights), heights, np.inf), 1, constant_values=np.inf)
    north, east = np.gradient(np.asarray(heights, float), cell)
    angle = np.degrees(np.arctan(np.hypot(north, east)))
    inner = np.zeros(heights.shape, bool)
    inner[edge:-edge, edge:-edge] = True
    start = np.argwhere(inner & (angle >= STEEP_DEG[0]) & (angle <= STEEP_DEG[1]))
    if not len(start):
        return None
    crossed = cells_of(lines, cell, heights.shape)
    at, length, meets = start.copy(), np.zeros(len(start)), np.zeros(len(start), bool)
    going = np.ones(len(start), bool)
    for _ in range(2 * (rows + columns)):
        row, column = at[going].T
        drop = np.stack([(z[row + 1, column + 1] - z[row + 1 + r, column + 1 + c]) / np.hypot(r, c) for r, c in AROUND])
        best = drop.argmax(axis=0)
        lower = drop.max(axis=0) > 0.0
        step = np.array(AROUND)[best] * lower[:, None]
        at[going] += step
        length[going] += np.hypot(*step.T)
        meets[going] |= crossed[tuple(at[going].T)]
        going[going] = lower & ~crossed[tuple(at[going].T)]
        if not going.any():
            break
    chosen = np.flatnonzero(meets) if meets.any() else np.arange(len(start))
    row, column = start[chosen[np.argsort(length[chosen], kind="stable")[len(chosen) // 2]]]
    return [(column + 0.5) * cell, (rows - row - 0.5) * cell, RADIUS_M]


def cells_of(lines: Sequence[Mapping[str, Any]], cell: float, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """The cells that lines come within one cell of, so that no way passes between two of them."""
    found = np.zeros(shape, bool)
    parts = [shapely.LineString(part) for each in lines for part in each["parts"] if len(part) > 1]
    if parts:
        row, column = np.indices(shape)
        centres = shapely.points((column + 0.5) * cell, (shape[0] - row - 0.5) * cell)
        found = np.asarray(shapely.dwithin(shapely.union_all(parts), centres, cell))
    return found
