"""Square cells over a DEM, each with the places at which logs are released and, later, with what its logs did.

For `assess_mobilisation`. A cell spans whole cells of the DEM. The place of a log depends on the seed and its id, and
the id on the cell's position in the whole DEM, so that no window, thread or limit of the logs changes it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.files.dem_blocks import WHOLE_CELLS, DemBlocks
from deadwood_algorithms.files.dem_windows import DemWindows
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Cancelled, Feedback, Quiet
from deadwood_algorithms.stats.draws import LOG_PLACE, uniforms
from deadwood_algorithms.stats.statistics import wilson_bounds

Array = NDArray[np.float64]
Places = tuple[NDArray[np.int64], Array, Array]  # ids of logs, from 0, and where they are released
BLOCK = 100  # side, in cells, of the parts of a large DEM whose logs slide together


@dataclass(frozen=True)
class Cells:
    """side : of a cell [DEM cells]; rows count from the south, as in a `Grid`."""

    dem: DemWindows
    side: int

    @property
    def shape(self) -> tuple[int, int]:
        return -(-self.dem.shape[0] // self.side), -(-self.dem.shape[1] // self.side)

    @property
    def grid(self) -> Grid:
        """The cells without values."""
        west, south, _, _ = self.dem.bounds
        cell = self.side * self.dem.cell
        return Grid.empty(self.shape, cell, west + cell / 2, south + cell / 2, self.dem.crs, self.dem.path)

    @property
    def blocks(self) -> list[tuple[slice, slice]]:
        """Rows and columns of the cells whose logs slide together: all cells of a DEM that is read whole."""
        small = self.dem.shape[0] * self.dem.shape[1] <= WHOLE_CELLS
        return self._squares(max(self.shape) if small else BLOCK)

    def _squares(self, side: int) -> list[tuple[slice, slice]]:
        ny, nx = self.shape
        return [
            (slice(row, min(row + side, ny)), slice(column, min(column + side, nx)))
            for row in range(0, ny, side)
            for column in range(0, nx, side)
        ]

    @property
    def surface(self) -> tuple[float, float, float, float]:
        """Bounds of the ground on which heights are known: up to the middle of the outermost cells of the DEM."""
        west, south, east, north = self.dem.bounds
        half = 0.5 * self.dem.cell
        return west + half, south + half, east - half, north - half

    def of_places(self, x: Array, y: Array) -> NDArray[np.int64]:
        """The number of the cell of each place, row by row from the south-west; -1 off the DEM."""
        west, south, east, north = self.dem.bounds
        cell, (_, nx) = self.side * self.dem.cell, self.shape
        column, row = (np.floor((at - low) / cell).astype(np.int64) for at, low in ((x, west), (y, south)))
        on = (x >= west) & (x < east) & (y >= south) & (y < north)
        return np.where(on, row * nx + column, -1)

    def places(self, block: tuple[slice, slice], per_cell: int, seed: int, within: Any, ground: DemBlocks) -> Places:
        """The logs of a block; ``within``: a shape that limits them, or None."""
        (rows, columns), (_, nx) = block, self.shape
        number = (np.arange(rows.start, rows.stop)[:, None] * nx + np.arange(columns.start, columns.stop)).ravel()
        log_id = (number[:, None] * per_cell + np.arange(per_cell)).ravel()
        u, v = uniforms(seed, log_id, LOG_PLACE)
        west, south, _, _ = self.dem.bounds
        row, column = np.divmod(log_id // per_cell, nx)
        x, y = (low + (at + share) * self.grid.cell for low, at, share in ((west, column, u), (south, row, v)))
        on = np.ones(log_id.size, bool) if within is None else shapely.contains_xy(within, x, y)
        on[on] = ground.contains(x[on], y[on])
        return log_id[on], x[on], y[on]

    def all_places(self, per_cell: int, seed: int, within: Any, feedback: Feedback) -> list[Places]:
        """The same for every block."""
        if within is not None:
            shapely.prepare(within)
        ground, found = DemBlocks(self.dem, Quiet()), []
        for done, block in enumerate(self.blocks):
            if feedback.cancelled():
                raise Cancelled
            found.append(self.places(block, per_cell, seed, within, ground))
            feedback.progress(done + 1, len(self.blocks), "placing logs")
        return found

    def slopes(self) -> Array:
        """Slope of each cell [degrees]: of the mean gradient of the DEM's cells in it; NaN where none is known."""
        found = np.full(self.shape, np.nan)
        for rows, columns in self._squares(BLOCK):
            inner = [slice(each.start * self.side, each.stop * self.side) for each in (rows, columns)]
            heights = self.dem.grid(*(slice(each.start - 1, each.stop + 1) for each in inner)).values
            gradients = np.gradient(heights, self.dem.cell)
            size = rows.stop - rows.start, self.side, columns.stop - columns.start, self.side
            parts = np.stack([each[1:-1, 1:-1].reshape(size) for each in gradients])
            known = np.isfinite(parts)
            mean = np.where(known, parts, 0.0).sum(axis=(2, 4)) / np.maximum(known.sum(axis=(2, 4)), 1)
            seen = known.any(axis=(0, 2, 4))
            found[rows, columns] = np.where(seen, np.degrees(np.arctan(np.hypot(*mean))), np.nan)
        return found


@dataclass
class Shares:
    """What the logs of each cell did, by cell number: how many logs there were, and in how many slides they did it.

    frictions : number of coefficients with which each log slid; did : by name of the outcome
    """

    frictions: int
    logs: NDArray[np.int64]
    did: dict[str, NDArray[np.int64]]

    def add(self, cell: NDArray[np.int64], did: Mapping[str, NDArray[np.bool_]]) -> None:
        """Add logs, one element each in ``cell``, rows of ``did`` by friction."""
        self.logs += np.bincount(cell, minlength=self.logs.size)
        for name, times in did.items():
            self.did[name] += np.bincount(cell, times.sum(axis=0), self.logs.size).astype(np.int64)

    def of(self, group: NDArray[np.int64], groups: int) -> tuple[NDArray[np.int64], dict[str, tuple[Array, ...]]]:
        """Logs of each group of cells, and for each outcome the share with its interval; group < 0: in none.

        A log counts once, with its mean over the frictions. The variance of such a mean is at most that of one trial,
        so Wilson's interval for the number of logs is wide enough.
        """
        inside = group >= 0
        total = np.bincount(group[inside], self.logs[inside], groups).astype(np.int64)
        found = {}
        for name, times in self.did.items():
            hit = np.bincount(group[inside], times[inside], groups) / self.frictions
            low, high = np.full(groups, np.nan), np.full(groups, np.nan)
            for n in np.unique(total[total > 0]):
                low[total == n], high[total == n] = wilson_bounds(hit[total == n], int(n))
            with np.errstate(invalid="ignore"):
                found[name] = hit / np.where(total > 0, total, np.nan), low, high
        return total, found


def outcome_columns(found: Mapping[str, tuple[Array, ...]]) -> Iterator[tuple[str, Array]]:
    """The columns of a table: each share, followed by the ends of its interval."""
    for name, (share, low, high) in found.items():
        yield from ((name, share), (f"{name}_ci_low", low), (f"{name}_ci_high", high))
