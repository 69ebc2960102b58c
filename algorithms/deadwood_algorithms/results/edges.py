"""How close logs come to the edge of the known terrain, and how high they are above it: a DEM read block by block.

Beyond the DEM, and on its nodata, nothing is known: a log whose centre of mass gets there ends (``left_dem``), and one
that passes nearby has a part beyond the edge. Both would end elsewhere on a larger DEM, so reach and
spread are uncertain by up to those logs. Blocks of the DEM are read where logs were, so a file of any size can be used.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
from numpy.typing import NDArray
from rasterio.errors import RasterioError

from deadwood_algorithms.files.crs import crs_name, same_crs
from deadwood_algorithms.files.dem_header import open_dem
from deadwood_algorithms.files.dem_windows import DemWindows
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.squares import by_block
from deadwood_algorithms.files.tiles import open_as_one
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.results.identity import refuse_damaged
from deadwood_algorithms.results.run_folder import GEOPACKAGE, input_paths, read_manifest, run_folder_of

BLOCK = 512  # cells
BLOCKS_KEPT = 64
SAME_PLACE_CELLS = 0.05  # tolerance for rounded headers, as in `rasters`


class Edges:
    """A DEM of which only the requested blocks are read; without a file, only the border of the grid is known.

    grid : the run's, without values; path : the DEM, or None if no file with that grid was found
    """

    def __init__(self, grid: Grid, paths: list[Path], feedback: Feedback) -> None:
        self.grid, self.path = grid, None
        self._dem: DemWindows | None = None
        self._blocks: dict[tuple[int, int], Grid] = {}
        self._near: dict[tuple[int, int, float], NDArray[np.bool_]] = {}
        for path in paths:
            try:
                source = open_as_one(path)
            except (RasterioError, UserError):
                continue
            if _same_grid(source, grid):
                place = source.shape, grid.cell, grid.x0, grid.y0
                self._dem = DemWindows(source, str(path), grid.crs, *place, flipped=source.transform.e < 0)
                self.path = path
                return
            source.close()
        feedback.note(
            "the run's terrain model was not found, so only the border of its grid counts as an edge", code="dem-gone"
        )

    def __enter__(self) -> Edges:
        return self

    def __exit__(self, *_: object) -> None:
        if self._dem:
            self._dem.source.close()

    @property
    def words(self) -> str:
        """What counts as an edge, for messages."""
        return "the edges or nodata of the terrain model" if self.path else "the border of the run's grid"

    def heights(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Bilinear height of the terrain [m]; NaN outside, and everywhere without a file."""
        u, v = (x - self.grid.x0) / self.grid.cell, (y - self.grid.y0) / self.grid.cell
        out = np.full(x.shape, np.nan)
        if self._dem:
            for block, rows in by_block(np.floor(v), np.floor(u), BLOCK):
                out[rows] = self._heights(self._dem, block).height(x[rows], y[rows])
        return out

    def near(self, x: NDArray[np.float64], y: NDArray[np.float64], distance: float) -> NDArray[np.bool_]:
        """Whether positions are within a distance [m] of a cell without height, from cell centre to cell centre."""
        i, j = (np.rint((at - low) / self.grid.cell) for at, low in ((x, self.grid.x0), (y, self.grid.y0)))
        ny, nx = self.grid.shape
        out = (i < 0) | (j < 0) | (i >= nx) | (j >= ny)
        inside = np.flatnonzero(~out)
        for block, rows in by_block(j[inside], i[inside], BLOCK):
            mask = self._near_mask(block, distance / self.grid.cell)
            place = inside[rows]
            out[place] = mask[(j[place] % BLOCK).astype(int), (i[place] % BLOCK).astype(int)]
        return out

    def _near_mask(self, block: tuple[int, int], reach: float) -> NDArray[np.bool_]:
        """The cells of the block within ``reach`` cells of one without height."""
        key = (*block, reach)
        if key not in self._near:
            margin = int(np.floor(reach))
            row, column = block[0] * BLOCK - margin, block[1] * BLOCK - margin
            size = BLOCK + 2 * margin
            self._near[key] = near_mask(self._valid(row, column, size), margin, reach)
        return self._near[key]

    def _valid(self, row: int, column: int, size: int) -> NDArray[np.bool_]:
        """Which cells of a square window have a height; beyond the grid none has."""
        if self._dem:
            return np.isfinite(self._dem.grid(slice(row, row + size), slice(column, column + size)).values)
        (ny, nx), at = self.grid.shape, np.arange(size)
        return ((at + row >= 0) & (at + row < ny))[:, None] & ((at + column >= 0) & (at + column < nx))

    def _heights(self, dem: DemWindows, block: tuple[int, int]) -> Grid:
        """Heights of a block plus one row and column, for the surface between it and the next blocks."""
        if block not in self._blocks:
            if len(self._blocks) >= BLOCKS_KEPT:
                self._blocks.pop(next(iter(self._blocks)))
            low = block[0] * BLOCK, block[1] * BLOCK
            self._blocks[block] = dem.grid(*(slice(at, at + BLOCK + 1) for at in low))
        return self._blocks[block]


def near_mask(valid: NDArray[np.bool_], margin: int, reach: float) -> NDArray[np.bool_]:
    """The cells inside the margin that are within ``reach`` cells (at most margin + 1) of an invalid one."""
    size = valid.shape[0] - 2 * margin
    if valid.all():
        return np.zeros((size, size), bool)
    at = np.arange(valid.shape[1])
    far = 4.0 * valid.shape[1]
    before = np.maximum.accumulate(np.where(valid, -far, at), axis=1)
    after = np.minimum.accumulate(np.where(valid, far, at)[:, ::-1], axis=1)[:, ::-1]
    along = np.minimum(at - before, after - at)[:, margin : margin + size]  # to the next invalid cell in the row
    near = np.zeros((size, size), bool)
    for off in range(-margin, margin + 1):
        near |= along[margin + off : margin + off + size] ** 2 + off**2 <= reach**2
    return near


def _same_grid(source: Any, grid: Grid) -> bool:
    west, south, east, north = grid.bounds
    low, high = min(source.bounds.bottom, source.bounds.top), max(source.bounds.bottom, source.bounds.top)
    corners = zip((source.bounds.left, low, source.bounds.right, high), (west, south, east, north), strict=True)
    return source.shape == grid.shape and all(abs(a - b) <= SAME_PLACE_CELLS * grid.cell for a, b in corners)


@contextmanager
def edges_of_deposits(deposits: str, dem: str | None, crs: pyproj.CRS, feedback: Feedback) -> Iterator[Edges | None]:
    """The edges that logs of these deposits may have met: those of ``dem``, or of the run to which the layer belongs;
    otherwise None.
    """
    if dem:
        with open_dem(dem, None, feedback) as (source, dem_crs, transform):
            if not same_crs(dem_crs, crs):
                raise UserError(f"{dem}: the DEM is in {crs_name(dem_crs)}, but the deposits are in {crs_name(crs)}")
            cell, (ny, _), edge = transform.a, source.shape, transform.f
            y0 = edge + cell / 2 if transform.e > 0 else edge - (ny - 0.5) * cell
            nothing = np.broadcast_to(np.float32(np.nan), source.shape)
            grid, paths = Grid(nothing, cell, transform.c + cell / 2, y0, dem_crs), [Path(dem)]
    elif folder := run_folder_of(deposits):
        manifest, grid = read_manifest(folder)
        refuse_damaged(folder, manifest, GEOPACKAGE)
        paths = input_paths(folder, manifest, "dem")
    else:
        yield None
        return
    with Edges(grid, paths, feedback) as edges:
        yield edges


def edge_words(n_left: int, n_near: int, n: int, distance: float, edges: str, what: str, *, known: bool = True) -> str:
    """The warning: how many logs left the DEM, whose further movement nobody knows, or came near its edges.

    known : which logs left is known, so that those near the edges stayed
    """
    said = []
    if n_left:
        said.append(
            f"{n_left} of {n} logs left the terrain model, and their further movement is not known: reach and spread "
            "count only up to where they left"
        )
    if n_near:
        who = f"{n_near} more" if n_left else f"{n_near} of {n} logs"
        doubt = "check that the heights there are sound" if known else "these may have left it"
        said.append(f"{who} {what} within {distance:g} m of {edges}: {doubt}")
    return "; ".join(said)
