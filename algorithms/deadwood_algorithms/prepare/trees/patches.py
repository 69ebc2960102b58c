"""Where a DEM has a surface: the patches between four heights, one bit each, for a DEM of any size.

For `planting`, which queries many places in random order, so that keeping or rereading blocks of heights is no option.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from deadwood_algorithms.files import squares
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Cancelled, Feedback

if TYPE_CHECKING:
    from deadwood_algorithms.files.dem_blocks import DemBlocks


@dataclass(frozen=True)
class Patches:
    """The patches of the examined part of a DEM; elsewhere there are none.

    blocks : by row and column among the squares of ``squares.SIDE`` patches; packed along the rows, or True if all
        exist. A missing square has none.
    """

    dem: Grid | DemBlocks
    blocks: dict[tuple[int, int], np.ndarray | bool] = field(default_factory=dict)
    count: int = 0

    @property
    def whole(self) -> bool:
        """Whether no examined square lacks a patch, so that patches need not be counted."""
        return all(each is True for each in self.blocks.values())

    def has(self, row: np.ndarray, column: np.ndarray) -> np.ndarray:
        """Which of these patches exist."""
        there, side = np.zeros(row.shape, bool), squares.SIDE
        for key, these in squares.by_block(row, column, side):
            block = self.blocks.get(key, False)
            if isinstance(block, np.ndarray):
                i, j = (column[these] % side).astype(np.int64), (row[these] % side).astype(np.int64)
                there[these] = (block[j, i >> 3] >> (7 - (i & 7))) & 1
            else:
                there[these] = block
        return there

    def hold(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Which places [m] lie on a patch, that is, where `Grid.contains` finds a height."""
        ny, nx = self.dem.shape
        u, v = (x - self.dem.x0) / self.dem.cell, (y - self.dem.y0) / self.dem.cell
        inside = (u >= 0) & (u <= nx - 1) & (v >= 0) & (v <= ny - 1)
        column, row = np.clip(np.floor(u), 0, nx - 2), np.clip(np.floor(v), 0, ny - 2)
        return inside & self.has(row, column)


def patches_over(dem: Grid | DemBlocks, bounds: Any, feedback: Feedback) -> Patches:
    """Examine once, square by square, the part of the DEM that an extent [m] touches."""
    west, south, east, north = (float(each) for each in bounds)
    ny, nx = dem.shape[0] - 1, dem.shape[1] - 1  # patches
    side = squares.SIDE
    (left, right), (low, high) = (
        (max(int((a - first) / dem.cell) // side, 0), min(int((b - first) / dem.cell) // side + 1, -(-count // side)))
        for a, b, first, count in ((west, east, dem.x0, nx), (south, north, dem.y0, ny))
    )
    touched = [(row, column) for row in range(low, high) for column in range(left, right)]
    blocks: dict[tuple[int, int], np.ndarray | bool] = {}
    found = 0
    for done, (row, column) in enumerate(touched):
        if feedback.cancelled():
            raise Cancelled
        known = np.isfinite(dem.read(squares.surface_of(row, column, dem.shape)).values)
        patch = known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:]
        found += int(patch.sum())
        if patch.all():
            blocks[row, column] = True
        elif patch.any():
            blocks[row, column] = np.packbits(patch, axis=1)
        else:
            blocks[row, column] = False
        feedback.progress(done + 1, len(touched), "reading the DEM")
    return Patches(dem, blocks, found)
