"""Weights of the cells of a DEM, from a raster, and the draw of places in proportion to them.

For `sample_releases`. For a small DEM all weights are kept; for a large one those inside an area are read or, without
areas, strips of the whole in turn, so that a country takes no more memory than a slope.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.grid import Grid, Part
from deadwood_algorithms.params.tool import Cancelled, Feedback, Quiet, UserError

if TYPE_CHECKING:
    from deadwood_algorithms.files.dem_blocks import DemBlocks

STRIP_CELLS = 8_000_000  # cells of a large DEM processed at once: 32 MB of heights, 128 MB of weights and their sums
STRIP_ROWS = 256  # if strips end at the tiles of a file, each tile is read only once
Bounds = tuple[float, float, float, float]


@dataclass(frozen=True)
class Piece:
    """Some cells of a rectangle; ``grid`` has the heights, with a margin of at least one cell.

    total : cumulative sums of the weights, including those of earlier pieces, row by row
    column, row : position of the first cell in the whole DEM; columns : width of the rectangle
    count : number of cells with a weight
    """

    total: NDArray[np.float64]
    grid: Grid
    column: int
    row: int
    columns: int
    count: int


@dataclass(frozen=True)
class Cells:
    """Cells to draw from, in pieces that are read when needed; ``ends``: cumulative weight at the end of each piece."""

    piece: Callable[[int], Piece]
    ends: NDArray[np.float64]
    count: int  # number of cells with a weight

    def places(
        self, pick: NDArray[np.float64], u: NDArray[np.float64], v: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
        """East and north [m] for numbers from 0 to 1: a cell by its weight, a place in it; and whether there is a
        height.
        """
        x, y, inside = np.empty(pick.size), np.empty(pick.size), np.zeros(pick.size, bool)
        sought = pick * self.ends[-1]
        owner = np.minimum(np.searchsorted(self.ends, sought, side="right"), self.ends.size - 1)
        for k in np.unique(owner):
            these = np.flatnonzero(owner == k)
            piece = self.piece(int(k))
            cell = np.minimum(np.searchsorted(piece.total, sought[these], side="right"), piece.total.size - 1)
            grid = piece.grid
            x[these] = grid.frame.x0 + (piece.column + cell % piece.columns + u[these] - 0.5) * grid.cell
            y[these] = grid.frame.y0 + (piece.row + cell // piece.columns + v[these] - 0.5) * grid.cell
            inside[these] = grid.contains(x[these], y[these])
        return x, y, inside


@dataclass(frozen=True)
class Weights:
    """A raster of weights >= 0 on the cells of a DEM; ``everywhere`` are its cells, if logs are drawn without areas."""

    path: str
    ground: Grid | DemBlocks
    feedback: Feedback
    kept: NDArray[np.float64] | None = None  # weights of all cells of a small DEM
    everywhere: Cells | None = None

    def cells(self, bounds: Bounds) -> Cells:
        """The cells that overlap an extent [m]; ``ends`` is empty if there are no weights."""
        ground = self.ground
        (ny, nx), (west, south, east, north) = ground.shape, bounds
        i0, i1 = cells_between(west, east, ground.x0, ground.cell, nx)
        j0, j1 = cells_between(south, north, ground.y0, ground.cell, ny)
        if i1 <= i0 or j1 <= j0:
            return Cells(lambda _: self._piece(0, 0, 0, 0, 0.0), np.zeros(0), 0)
        rows = max(STRIP_CELLS // (i1 - i0) // STRIP_ROWS, 1) * STRIP_ROWS if self.kept is None else j1 - j0
        starts = list(range(j0, j1, rows))
        ends, count = np.zeros(len(starts)), 0
        read = {}  # the piece read last

        def piece(k: int) -> Piece:
            if k not in read:
                read.clear()
                before = float(ends[k - 1]) if k else 0.0
                read[k] = self._piece(i0, i1, starts[k], min(starts[k] + rows, j1), before)
            return read[k]

        for k in range(len(starts)):
            if self.feedback.cancelled():
                raise Cancelled
            ends[k] = piece(k).total[-1]
            count += piece(k).count
            if len(starts) > 1:
                self.feedback.progress(k + 1, len(starts), "reading the weights")
        return Cells(piece, ends if count else np.zeros(0), count)

    def _piece(self, i0: int, i1: int, j0: int, j1: int, before: float) -> Piece:
        if self.kept is not None:
            assert isinstance(self.ground, Grid)
            return _piece_of(self.kept[j0:j1, i0:i1], self.ground, i0, j0, before)
        grid = self.ground.read(Part(i0 - 1, j0 - 1, i1 - i0 + 2, j1 - j0 + 2).cut_to(self.ground.shape))
        column, row = grid.first
        values = _weights_on(self.path, grid, Quiet())
        return _piece_of(values[j0 - row : j1 - row, i0 - column : i1 - column], grid, i0, j0, before)


def read_weights(path: str, ground: Grid | DemBlocks, feedback: Feedback, *, everywhere: bool) -> Weights:
    """A raster of weights on a DEM; of a large DEM it is read when an area, or ``everywhere``, asks for it."""
    from deadwood_algorithms.files.rasters import extent_in

    if isinstance(ground, Grid):
        weights, bounds = Weights(path, ground, feedback, _weights_on(path, ground, feedback)), ground.bounds
    else:
        weights, bounds = Weights(path, ground, feedback), extent_in(path, ground.crs)
        _weights_on(path, ground.read(Part(0, 0, 2, 2)), feedback)  # reports once how it is resampled to the cells
    if everywhere:
        weights = replace(weights, everywhere=weights.cells(bounds))
    cells, kept = weights.everywhere, weights.kept
    if (cells is not None and not cells.count) or (kept is not None and not kept.any()):
        raise UserError(f"{path}: no cell on the DEM has a weight above 0; check the raster and its CRS")
    return weights


def cells_between(low: float, high: float, origin: float, cell: float, count: int) -> tuple[int, int]:
    """First and one past the last of the cells that overlap a span [m]; ``origin`` is the centre of cell 0."""
    first = int(np.floor((low - origin) / cell + 0.5))
    last = int(np.floor((high - origin) / cell + 0.5)) + 1
    return min(max(first, 0), count), min(max(last, 0), count)


def _piece_of(values: NDArray[np.float64], grid: Grid, column: int, row: int, before: float) -> Piece:
    """The sums are the same to the last bit for any division into pieces; ``before`` : sum of the earlier pieces."""
    flat = values.ravel().copy()
    flat[:1] += before
    return Piece(np.cumsum(flat, out=flat), grid, column, row, values.shape[1], int(np.count_nonzero(values)))


def _weights_on(path: str, grid: Grid, feedback: Feedback) -> NDArray[np.float64]:
    from deadwood_algorithms.files.rasters import read_raster_on

    values = np.asarray(read_raster_on(path, grid, what="weights", feedback=feedback), np.float64)
    if np.nanmin(values, initial=np.inf) < 0:
        raise UserError(f"{path}: a weight is {np.nanmin(values):g}, but must not be negative; correct the raster")
    if np.isposinf(values).any():
        raise UserError(f"{path}: a weight is infinite; correct the raster")
    return np.where(np.isfinite(values) & np.isfinite(grid.values), values, 0.0)
