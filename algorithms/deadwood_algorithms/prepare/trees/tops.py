"""Tree tops of a canopy height model by a variable window (Popescu and Wynne 2004), on arrays: for `find_trees`.

A cell is a top if no cell is higher within a circle around it whose diameter follows from its own height. Of equal tops
in one another's circles the first counts (lowest row, then lowest column), so a plateau is one tree. Equal cells that
have a higher one in their own circle are not tops and take nothing away: a rule that let any earlier equal cell win
lost 14 of 167 trees of a canopy model whose points cover several cells each.

Where heights are rounded to decimetres or more, most equal cells are a flat step of a slope, and a step wider than the
circle is no tree. There any earlier equal cell wins, as if chance had decided what rounding hides: on smooth crowns in
steps of 0.1 m this finds as many trees as on the exact heights, and the other rule 7 % more; in whole metres it finds
three times as many.

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
ROUNDED_M, ROUNDED_TO_M = 0.1, 0.002  # heights in multiples of this are rounded; in 32 bits they are a little off
SAMPLE_CELLS = 2**18  # by which that is decided
INCLUSIVE = 1e-9  # a cell on the circle is within it, whatever the last digits of cell size and diameter


@dataclass(frozen=True)
class Window:
    """Diameter [m] of the circle around a cell of height h [m]: a + b h + c h^2."""

    a: float
    b: float = 0.0
    c: float = 0.0

    def diameter(self, height: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.a + self.b * height + self.c * height**2

    def reach(self, height: NDArray[np.float64], cell: float) -> NDArray[np.float64]:
        """Square of the circle's radius in cells; the eight neighbours are always within."""
        return np.maximum((self.diameter(height) / (2.0 * cell)) ** 2 * (1.0 + INCLUSIVE), NEIGHBOURS)

    def __str__(self) -> str:
        grows = f" + {self.b:g} h" if self.b else ""
        return f"{self.a:g} m{grows}" + (f" + {self.c:g} h² / m" if self.c else "")


WINDOWS = {"mixed": Window(2.51503, c=0.00901), "deciduous": Window(3.09632, c=0.00895)}


@dataclass(frozen=True)
class Tops:
    """Row, column and height [m] of each top, by row and column; how many cells have a height, how many others were too
    high for a tree, and whether the heights are rounded.
    """

    row: NDArray[np.int32]
    column: NDArray[np.int32]
    height: NDArray[np.float64]
    cells: int
    too_high: int
    rounded: bool


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

    Cells above ``highest`` [m] are not canopy and count as unknown. A block of rows is searched with a margin of twice
    the largest radius in it, that of its tops and that of their equals, so the result does not depend on the blocks.
    """
    ny, nx = shape
    block = block_rows or max(1, BLOCK_CELLS // nx)
    found, cells, too_high, rounded = [], 0, 0, _are_rounded(read, shape)
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
            bottom, top = max(0, start - 2 * margin), min(ny, stop + 2 * margin)
            parts = [_canopy(read, slice(bottom, start), highest), heights, _canopy(read, slice(stop, top), highest)]
            around, first, last = np.concatenate(parts), start - bottom, stop - bottom
            rows = slice(max(0, first - margin), last + margin)
            row, column = _highest_of(around, rows, cell, window, (least, tallest), equals_win=rounded)
            row, column, height = _first_of_equals(around, row, column, cell, window)
            inside = (row >= first) & (row < last)
            row, column, height = row[inside], column[inside], height[inside]
            found.append(((row + bottom).astype(np.int32), column.astype(np.int32), height))
        if after_block:
            after_block(stop)
    if not found:
        return Tops(np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros(0), cells, too_high, rounded)
    row, column, height = (np.concatenate([each[k] for each in found]) for k in range(3))
    return Tops(row, column, height, cells, too_high, rounded)


def _canopy(read: Callable[[slice], NDArray[np.float64]], rows: slice, highest: float) -> NDArray[np.float64]:
    heights = read(rows)
    with np.errstate(invalid="ignore"):
        heights[heights > highest] = np.nan
    return heights


def _are_rounded(read: Callable[[slice], NDArray[np.float64]], shape: tuple[int, int]) -> bool:
    """Whether all heights in a sample are multiples of a decimetre."""
    return all(
        (np.abs(heights - ROUNDED_M * np.rint(heights / ROUNDED_M)) <= ROUNDED_TO_M).all()
        for heights in samples_of(read, shape)
    )


def samples_of(read: Callable[[slice], NDArray[np.float64]], shape: tuple[int, int]) -> Iterator[NDArray[np.float64]]:
    """The known heights of five strips over the whole."""
    ny, nx = shape
    rows = max(1, SAMPLE_CELLS // (5 * nx))
    for start in np.linspace(0, max(0, ny - rows), 5).astype(int).tolist():
        heights = read(slice(start, min(ny, start + rows)))
        yield heights[np.isfinite(heights)]


def _highest_of(
    heights: NDArray[np.float64],
    rows: slice,
    cell: float,
    window: Window,
    bounds: tuple[float, float],
    *,
    equals_win: bool,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Row and column of the cells with none higher in their circles, among some rows and of heights within ``bounds``:
    those of the eight neighbours are sought first, then those of the circles. If ``equals_win``, none that is equal and
    comes first either.
    """
    ny, nx = heights.shape
    here, padded = heights[rows], np.pad(heights, 1, constant_values=np.nan)

    def beats(there: NDArray[np.float64], here: NDArray[np.float64], offset: tuple[int, int]) -> NDArray[np.bool_]:
        return there >= here if equals_win and offset < (0, 0) else there > here

    with np.errstate(invalid="ignore"):
        highest = (here >= bounds[0]) & (here <= bounds[1])
        for down, right in _offsets(NEIGHBOURS):
            there = padded[1 + rows.start + down :, 1 + right : 1 + right + nx][: len(here)]
            highest &= ~beats(there, here, (down, right))
    row, column = np.nonzero(highest)
    row += rows.start
    reach = window.reach(heights[row, column], cell)
    for down, right in _offsets(float(reach.max(initial=0.0))):
        if float(reach.max(initial=0.0)) < down**2 + right**2:
            break
        j, i = row + down, column + right
        inside = (reach >= down**2 + right**2) & (j >= 0) & (j < ny) & (i >= 0) & (i < nx)
        beaten = np.zeros(row.size, bool)
        beaten[inside] = beats(heights[j[inside], i[inside]], heights[row[inside], column[inside]], (down, right))
        if beaten.any():
            row, column, reach = row[~beaten], column[~beaten], reach[~beaten]
    return row, column


def _first_of_equals(
    heights: NDArray[np.float64],
    row: NDArray[np.int64],
    column: NDArray[np.int64],
    cell: float,
    window: Window,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """The tops without an equal one in their circle that comes first, and their heights."""
    is_top = np.zeros(heights.shape, bool)
    is_top[row, column] = True
    here = heights[row, column]
    reach, first = window.reach(here, cell), np.ones(row.size, bool)
    for down, right in _offsets(float(reach.max(initial=0.0))):
        if (down, right) > (0, 0):
            continue
        j, i = row + down, column + right
        inside = np.flatnonzero((reach >= down**2 + right**2) & (j >= 0) & (i >= 0) & (i < heights.shape[1]))
        there = j[inside], i[inside]
        first[inside[is_top[there] & (heights[there] == here[inside])]] = False
    return row[first], column[first], here[first]


def _offsets(reach: float) -> Iterator[tuple[int, int]]:
    """Rows and columns to all cells within a circle, the nearest first; ``reach`` is its squared radius in cells."""
    far = int(np.sqrt(reach))
    down, right = (each.ravel() for each in np.mgrid[-far : far + 1, -far : far + 1])
    square = down**2 + right**2
    within = np.flatnonzero((square > 0) & (square <= reach))
    for k in within[np.argsort(square[within], kind="stable")]:
        yield int(down[k]), int(right[k])
