"""A uniform grid over boxes in plan: which items may be near a place. Built once, read by all kernels."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .compiled import kernel


class GridIndex(NamedTuple):
    """Items by grid cell, in compressed rows: cell c holds items[start[c]:start[c + 1]]; without items, one cell."""

    start: np.ndarray
    items: np.ndarray
    x0: float
    y0: float
    cell: float
    columns: int
    rows: int


def index_boxes(low: np.ndarray, high: np.ndarray, cell: float = 8.0) -> GridIndex:
    """Index boxes by every grid cell that they touch.

    Parameters
    ----------
    low, high : [m], shape (n, 2); corners of the boxes
    cell : [m] of the grid; enlarged if the items are so scattered that the grid would be mostly empty
    """
    n = len(low)
    if n == 0:
        return GridIndex(np.zeros(2, np.int64), np.zeros(0, np.int64), 0.0, 0.0, 1.0, 1, 1)
    x0, y0 = low.min(axis=0)
    width, height = high.max(axis=0) - (x0, y0)
    while (width / cell + 1) * (height / cell + 1) > 4_000_000 + 16 * n:
        cell *= 2.0
    columns, rows = int(width / cell) + 1, int(height / cell) + 1
    first = ((low - (x0, y0)) / cell).astype(np.int64)
    last = ((high - (x0, y0)) / cell).astype(np.int64)
    span = last - first + 1
    count = span[:, 0] * span[:, 1]
    item = np.repeat(np.arange(n), count)
    offset = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    column = first[item, 0] + offset % span[item, 0]
    row = first[item, 1] + offset // span[item, 0]
    place = row * columns + column
    order = np.argsort(place, kind="stable")
    start = np.searchsorted(place[order], np.arange(rows * columns + 1))
    return GridIndex(start.astype(np.int64), item[order], float(x0), float(y0), float(cell), columns, rows)


@kernel
def floor_within(x, low, high):
    """floor(x), but at least ``low`` and at most ``high``; NaN gives ``low``. A number beyond the range of integers may
    give any of them.
    """
    if not x >= low:
        return low
    if x >= high:
        return high
    return int(math.floor(x))


@kernel
def grid_window(index, x_low, y_low, x_high, y_high):
    """Grid cells that a box in plan touches: first and last column, first and last row (empty if last < first)."""
    i0 = floor_within((x_low - index.x0) / index.cell, 0, index.columns)
    j0 = floor_within((y_low - index.y0) / index.cell, 0, index.rows)
    i1 = floor_within((x_high - index.x0) / index.cell, -1, index.columns - 1)
    j1 = floor_within((y_high - index.y0) / index.cell, -1, index.rows - 1)
    return i0, i1, j0, j1


@kernel
def insert_sorted(listed, count, item):
    """Insert an item into an ascending list once; returns the new count. A list so has the order of the table."""
    at = count
    while at > 0 and listed[at - 1] > item:
        at -= 1
    if at > 0 and listed[at - 1] == item:
        return count
    for m in range(count, at, -1):
        listed[m] = listed[m - 1]
    listed[at] = item
    return count + 1


@kernel
def list_near(index, listed, x_low, y_low, x_high, y_high):
    """List the items whose grid cells touch a box in plan, ascending, each once; returns the count."""
    i0, i1, j0, j1 = grid_window(index, x_low, y_low, x_high, y_high)
    count = 0
    for j in range(j0, j1 + 1):
        for i in range(i0, i1 + 1):
            place = j * index.columns + i
            for m in range(index.start[place], index.start[place + 1]):
                count = insert_sorted(listed, count, index.items[m])
    return count
