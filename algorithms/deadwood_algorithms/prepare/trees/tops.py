"""Tree tops of a canopy height model by a variable window (Popescu and Wynne 2004), on arrays: for `find_trees`.

A cell is a top if it is the highest within a circle around it whose diameter follows from its own height. Of equal
cells the first counts (lowest row, then lowest column), so connected equal cells have one top at most.

The published windows are regressions of the crown's diameter [m] on the height [m]: Popescu and Wynne 2004,
Photogrammetric Engineering and Remote Sensing 70:589; the one of deciduous trees, and the one of deciduous trees and
pines together. The latter's numbers were read as the default of FUSION's CanopyMaxima; those of deciduous trees are
from memory, not checked in the paper.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

BLOCK_CELLS = 2**21  # cells searched at once: 16 MiB of float64, in some five arrays
NEIGHBOURS = 2.0  # the squared distance in cells of the farthest of a cell's eight neighbours
INCLUSIVE = 1e-9  # a cell on the circle is within it, whatever the last digits of cell size and diameter


@dataclass(frozen=True)
class Window:
    """Diameter [m] of the circle around a cell of height h [m]: a + c h^2."""

    a: float
    c: float = 0.0

    def diameter(self, height: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.a + self.c * height**2

    def reach(self, height: NDArray[np.float64], cell: float) -> NDArray[np.float64]:
        """Square of the circle's radius in cells; the eight neighbours are always within."""
        return np.maximum((self.diameter(height) / (2.0 * cell)) ** 2 * (1.0 + INCLUSIVE), NEIGHBOURS)

    def __str__(self) -> str:
        return f"{self.a:g} m + {self.c:g} h² / m" if self.c else f"{self.a:g} m"


WINDOWS = {"mixed": Window(2.51503, 0.00901), "deciduous": Window(3.09632, 0.00895)}


@dataclass(frozen=True)
class Tops:
    """Row, column and height [m] of each top, by row and column; how many cells have a height, and how many others
    were too high for a tree.
    """

    row: NDArray[np.int32]
    column: NDArray[np.int32]
    height: NDArray[np.float64]
    cells: int
    too_high: int


def find_tops(
    read: Callable[[slice], NDArray[np.float64]],
    shape: tuple[int, int],
    cell: float,
    window: Window,
    least: float,
    highest: float,
    *,
    block_rows: int | None = None,
    after_block: Callable[[int], None] | None = None,
) -> Tops:
    """The tops of at least ``least`` [m] of a canopy model that ``read`` returns by rows, NaN where unknown.

    Cells above ``highest`` [m] are not canopy and count as unknown. A block of rows is searched with a margin
    of the largest radius in it, so the result does not depend on the blocks.
    """
    ny, nx = shape
    block = block_rows or max(1, BLOCK_CELLS // nx)
    found, cells, too_high = [], 0, 0
    for start in range(0, ny, block):
        stop = min(ny, start + block)
        heights = read(slice(start, stop))
        with np.errstate(invalid="ignore"):
            wrong = heights > highest
            heights[wrong] = np.nan
            tallest = float(np.max(heights, where=heights >= least, initial=-np.inf))
        cells += int(np.isfinite(heights).sum())
        too_high += int(wrong.sum())
        if tallest >= least:
            margin = int(np.sqrt(window.reach(np.array([tallest]), cell)[0])) + 1
            bottom, top = max(0, start - margin), min(ny, stop + margin)
            parts = [_canopy(read, slice(bottom, start), highest), heights, _canopy(read, slice(stop, top), highest)]
            row, column, height = _tops_of(np.concatenate(parts), start - bottom, stop - bottom, cell, window, least)
            found.append(((row + bottom).astype(np.int32), column.astype(np.int32), height))
        if after_block:
            after_block(stop)
    if not found:
        return Tops(np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros(0), cells, too_high)
    row, column, height = (np.concatenate([each[k] for each in found]) for k in range(3))
    return Tops(row, column, height, cells, too_high)


def _canopy(read: Callable[[slice], NDArray[np.float64]], rows: slice, highest: float) -> NDArray[np.float64]:
    heights = read(rows)
    with np.errstate(invalid="ignore"):
        heights[heights > highest] = np.nan
    return heights


def _tops_of(
    heights: NDArray[np.float64], first: int, stop: int, cell: float, window: Window, least: float
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """The tops among the rows from ``first`` up to ``stop``: those of the eight neighbours, then of their circles."""
    ny, nx = heights.shape
    here, padded = heights[first:stop], np.pad(heights, 1, constant_values=np.nan)
    with np.errstate(invalid="ignore"):
        highest = here >= least
        for down, right in _offsets(NEIGHBOURS):
            there = padded[1 + first + down : 1 + stop + down, 1 + right : 1 + right + nx]
            highest &= ~_beats(there, here, down, right)
    row, column = np.nonzero(highest)
    row += first
    reach = window.reach(heights[row, column], cell)
    for down, right in _offsets(float(reach.max(initial=0.0))):
        if float(reach.max(initial=0.0)) < down**2 + right**2:
            break
        j, i = row + down, column + right
        inside = (reach >= down**2 + right**2) & (j >= 0) & (j < ny) & (i >= 0) & (i < nx)
        there = np.full(row.size, np.nan)
        there[inside] = heights[j[inside], i[inside]]
        kept = ~_beats(there, heights[row, column], down, right)
        if not kept.all():
            row, column, reach = row[kept], column[kept], reach[kept]
    return row, column, heights[row, column]


def _beats(there: NDArray[np.float64], here: NDArray[np.float64], down: int, right: int) -> NDArray[np.bool_]:
    """Whether cells at an offset of rows and columns are higher, or equal and earlier; never for NaN."""
    return there >= here if (down, right) < (0, 0) else there > here


def _offsets(reach: float) -> Iterator[tuple[int, int]]:
    """Rows and columns to all cells within a circle, the nearest first; ``reach`` is its squared radius in cells."""
    far = int(np.sqrt(reach))
    down, right = (each.ravel() for each in np.mgrid[-far : far + 1, -far : far + 1])
    square = down**2 + right**2
    within = np.flatnonzero((square > 0) & (square <= reach))
    for k in within[np.argsort(square[within], kind="stable")]:
        yield int(down[k]), int(right[k])
