"""The squares of cells in which a large raster is read or written."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.grid import Part

SIDE = 2048  # cells; 16 MB of heights


def by_block(
    row: NDArray[np.float64], column: NDArray[np.float64], side: int
) -> Iterator[tuple[tuple[int, int], NDArray[np.intp]]]:
    """The squares that contain any of these cells, each by its row and column among the squares, with the cells in it.

    row, column : of cells, shape (n,); cells beyond the raster belong to squares beyond it
    """
    key = np.stack([row // side, column // side], axis=1).astype(np.int64)
    blocks, owner = np.unique(key, axis=0, return_inverse=True)
    order = np.argsort(owner.ravel(), kind="stable")
    ends = np.cumsum(np.bincount(owner.ravel(), minlength=len(blocks)))
    for k, end in enumerate(ends):
        yield (int(blocks[k, 0]), int(blocks[k, 1])), order[(ends[k - 1] if k else 0) : end]


def surface_of(row: int, column: int, shape: tuple[int, int]) -> Part:
    """Cells of a raster of this shape that define the surface over one square: its own and the first of the next
    squares.
    """
    return Part(column * SIDE, row * SIDE, SIDE + 1, SIDE + 1).cut_to(shape)
