"""How near logs come to the edge of the known terrain, and how high they are above it: a DEM read block by block.

Beyond the DEM, and on its nodata, nothing is known: a log whose centre of mass goes there ends (``left_dem``), and one
that passes by hangs over the edge with what is out there. Either ends elsewhere than on a larger DEM, so reach and
spread are off by up to those logs. Blocks of the DEM are read where logs were, so a file of any size will do.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
from numpy.typing import NDArray
from rasterio.errors import RasterioError
from rasterio.windows import Window

from deadwood_algorithms.grid import Grid
from deadwood_algorithms.tool import Feedback

BLOCK = 512  # cells
BLOCKS_KEPT = 64
SAME_PLACE_CELLS = 0.05  # as `rasters` allows for headers that were rounded


class Edges:
    """A DEM of which only the blocks are read that are asked for; without a file, only the grid's border is known.

    grid : of the run, without values; path : the DEM, or None where no file with that grid was found
    """

    def __init__(self, grid: Grid, paths: list[Path], feedback: Feedback) -> None:
        self.grid, self.path = grid, None
        self._source: Any = None
        self._blocks: dict[tuple[int, int], NDArray[np.float32]] = {}
        self._near: dict[tuple[int, int, float], NDArray[np.bool_]] = {}
        for path in paths:
            try:
                source = rasterio.open(path)
            except RasterioError:
                continue
            if _same_grid(source, grid):
                self._source, self.path = source, path
                return
        feedback.note("the run's terrain model was not found, so only the border of its grid counts as an edge")

    def __enter__(self) -> Edges:
        return self

    def __exit__(self, *_: object) -> None:
        if self._source:
            self._source.close()

    @property
    def words(self) -> str:
        """What counts as an edge, for messages."""
        return "the edges or nodata of the terrain model" if self.path else "the border of the run's grid"

    def heights(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Bilinear height of the terrain [m]; NaN outside, and everywhere without a file."""
        u, v = (x - self.grid.x0) / self.grid.cell, (y - self.grid.y0) / self.grid.cell
        out = np.full(x.shape, np.nan)
        for block, rows in self._by_block(np.floor(v), np.floor(u)):
            j, i = block
            corner = Grid(self._heights(block), 1.0, i * BLOCK, j * BLOCK, self.grid.crs)
            out[rows] = corner.height(u[rows], v[rows])
        return out

    def near(self, x: NDArray[np.float64], y: NDArray[np.float64], distance: float) -> NDArray[np.bool_]:
        """Whether positions are within a distance [m] of a cell without height, from cell centre to cell centre."""
        i, j = (np.rint((at - low) / self.grid.cell) for at, low in ((x, self.grid.x0), (y, self.grid.y0)))
        ny, nx = self.grid.shape
        out = (i < 0) | (j < 0) | (i >= nx) | (j >= ny)
        inside = np.flatnonzero(~out)
        for block, rows in self._by_block(j[inside], i[inside]):
            mask = self._near_mask(block, distance / self.grid.cell)
            place = inside[rows]
            out[place] = mask[(j[place] % BLOCK).astype(int), (i[place] % BLOCK).astype(int)]
        return out

    def _by_block(
        self, j: NDArray[np.float64], i: NDArray[np.float64]
    ) -> Iterator[tuple[tuple[int, int], NDArray[np.intp]]]:
        """Rows of the positions in each block; cells that are off every block fall into one beyond the grid."""
        key = np.stack([j // BLOCK, i // BLOCK], axis=1).astype(np.int64)
        blocks, owner = np.unique(key, axis=0, return_inverse=True)
        order = np.argsort(owner.ravel(), kind="stable")
        ends = np.cumsum(np.bincount(owner.ravel(), minlength=len(blocks)))
        for k, end in enumerate(ends):
            yield (int(blocks[k, 0]), int(blocks[k, 1])), order[(ends[k - 1] if k else 0) : end]

    def _near_mask(self, block: tuple[int, int], reach: float) -> NDArray[np.bool_]:
        """Of the block's cells, those within ``reach`` cells of one without height."""
        key = (*block, reach)
        if key not in self._near:
            margin = int(np.floor(reach))
            row, column = block[0] * BLOCK - margin, block[1] * BLOCK - margin
            size = BLOCK + 2 * margin
            self._near[key] = near_mask(self._valid(row, column, size), margin, reach)
        return self._near[key]

    def _valid(self, row: int, column: int, size: int) -> NDArray[np.bool_]:
        """Which cells of a square window have a height; beyond the grid none has."""
        if self._source:
            return np.isfinite(self._window(row, column, size))
        (ny, nx), at = self.grid.shape, np.arange(size)
        return ((at + row >= 0) & (at + row < ny))[:, None] & ((at + column >= 0) & (at + column < nx))

    def _heights(self, block: tuple[int, int]) -> NDArray[np.float32]:
        """Heights of a block and of one row and column more, for the surface between it and the next."""
        if block not in self._blocks:
            if len(self._blocks) >= BLOCKS_KEPT:
                self._blocks.pop(next(iter(self._blocks)))
            self._blocks[block] = self._window(block[0] * BLOCK, block[1] * BLOCK, BLOCK + 1)
        return self._blocks[block]

    def _window(self, row: int, column: int, size: int) -> NDArray[np.float32]:
        """Heights of a square window, row 0 south, NaN where there is none."""
        out = np.full((size, size), np.nan, np.float32)
        ny, nx = self.grid.shape
        low_j, high_j, low_i, high_i = max(row, 0), min(row + size, ny), max(column, 0), min(column + size, nx)
        if self._source is None or low_j >= high_j or low_i >= high_i:
            return out
        south_up = self._source.transform.e > 0
        first = low_j if south_up else ny - high_j
        window = Window(low_i, first, high_i - low_i, high_j - low_j)  # type: ignore[call-arg]
        raw = self._source.read(1, window=window, masked=True)
        values = raw.data * np.float64(self._source.scales[0]) + self._source.offsets[0]
        values[np.ma.getmaskarray(raw) | ~np.isfinite(values)] = np.nan
        out[low_j - row : high_j - row, low_i - column : high_i - column] = values if south_up else values[::-1]
        return out


def near_mask(valid: NDArray[np.bool_], margin: int, reach: float) -> NDArray[np.bool_]:
    """Of the cells inside the margin, those within ``reach`` cells (no more than margin + 1) of an invalid one."""
    size = valid.shape[0] - 2 * margin
    if valid.all():
        return np.zeros((size, size), bool)
    at = np.arange(valid.shape[1])
    far = 4.0 * valid.shape[1]
    before = np.maximum.accumulate(np.where(valid, -far, at), axis=1)
    after = np.minimum.accumulate(np.where(valid, far, at)[:, ::-1], axis=1)[:, ::-1]
    along = np.minimum(at - before, after - at)[:, margin : margin + size]  # to the next invalid one of the row
    near = np.zeros((size, size), bool)
    for off in range(-margin, margin + 1):
        near |= along[margin + off : margin + off + size] ** 2 + off**2 <= reach**2
    return near


def _same_grid(source: Any, grid: Grid) -> bool:
    west, south, east, north = grid.bounds
    low, high = min(source.bounds.bottom, source.bounds.top), max(source.bounds.bottom, source.bounds.top)
    corners = zip((source.bounds.left, low, source.bounds.right, high), (west, south, east, north), strict=True)
    return source.shape == grid.shape and all(abs(a - b) <= SAME_PLACE_CELLS * grid.cell for a, b in corners)


def dem_paths(run: Path, manifest: dict[str, Any]) -> list[Path]:
    """Where the DEM of a run may lie: as its manifest names it, from here, or from beside the run's folder."""
    named = str(manifest.get("parameters", {}).get("dem") or "")
    return [Path(named), run.parent / named, run.parent / Path(named).name] if named else []


def edge_words(n_left: int, n_near: int, n: int, distance: float, edges: str, what: str) -> str:
    """The warning: how many logs left the DEM or came near its edges."""
    return (
        f"{n_left} of {n} logs left the terrain model and {n_near} more {what} within {distance:g} m of {edges}; "
        "on a larger one these may go farther and elsewhere: reach and spread may be off by as many"
    )
