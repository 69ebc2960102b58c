"""A DEM for tools that need heights at some places: read whole if it is small, otherwise only in the blocks needed.

Both give the same results: the same heights, the same cells outside.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyproj

from deadwood_algorithms.files import squares
from deadwood_algorithms.files.dem_windows import DemWindows, open_windows, read_part, read_whole
from deadwood_algorithms.files.grid import Grid, Part
from deadwood_algorithms.params.tool import Cancelled, Feedback, Quiet

WHOLE_CELLS = 25_000_000  # a DEM of at most this many cells is read whole: 100 MB of heights, read in a second
KEPT = 16  # blocks kept in memory, the most recently used ones


@dataclass
class DemBlocks:
    """A large DEM that stays open, with the interface of the whole `Grid`; only the blocks that are needed are read."""

    dem: DemWindows
    feedback: Feedback
    _blocks: dict[tuple[int, int], Grid] = field(default_factory=dict)

    @property
    def crs(self) -> pyproj.CRS:
        return self.dem.crs

    @property
    def plan_crs(self) -> pyproj.CRS:
        return self.dem.plan_crs

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        return self.dem.bounds

    @property
    def shape(self) -> tuple[int, int]:
        return self.dem.shape

    @property
    def cell(self) -> float:
        return self.dem.cell

    @property
    def x0(self) -> float:
        return self.dem.x0

    @property
    def y0(self) -> float:
        return self.dem.y0

    @property
    def frame(self) -> DemBlocks:
        return self

    def read(self, part: Part) -> Grid:
        """A window of it."""
        return read_part(self.dem, part, Quiet())

    def height(self, x: Any, y: Any) -> np.ndarray:
        """As `Grid.height`, block by block."""
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        found = np.full(x.size, np.nan)
        column, row = (np.floor((at.ravel() - low) / self.dem.cell) for at, low in ((x, self.dem.x0), (y, self.dem.y0)))
        ny, nx = self.dem.shape
        inside = np.flatnonzero((column >= 0) & (row >= 0) & (column < nx) & (row < ny))
        blocks = list(squares.by_block(row[inside], column[inside], squares.SIDE))
        for done, (key, rows) in enumerate(blocks):
            if self.feedback.cancelled():
                raise Cancelled
            at = inside[rows]
            found[at] = self._block(*key).height(x.ravel()[at], y.ravel()[at])
            self.feedback.progress(done + 1, len(blocks), "reading the DEM")
        return found.reshape(x.shape)

    def contains(self, x: Any, y: Any) -> np.ndarray:
        """Whether the surface has a height at each position."""
        return np.isfinite(self.height(x, y))

    def _block(self, row: int, column: int) -> Grid:
        key = row, column
        block = self._blocks.pop(key, None)
        if block is None:
            block = self.read(squares.surface_of(row, column, self.dem.shape))
        self._blocks[key] = block  # as the most recently used
        if len(self._blocks) > KEPT:
            self._blocks.pop(next(iter(self._blocks)))
        return block


@contextmanager
def open_ground(path: str | Path, *, crs: str | None, feedback: Feedback) -> Iterator[Grid | DemBlocks]:
    """The DEM, read whole if it has at most ``WHOLE_CELLS`` cells; refused as `dem_windows.read_dem` does."""
    with open_windows(path, crs=crs, feedback=feedback, look_through=False) as dem:
        small = dem.shape[0] * dem.shape[1] <= WHOLE_CELLS
        yield read_whole(dem, feedback) if small else DemBlocks(dem, feedback)
