"""The rasters of a run, summed a few rows at a time: the whole of a large window would take 24 more bytes per cell,
and 4 for each line whose danger is counted, although most cells were never touched."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from deadwood_engine import Rasters
from deadwood_engine.rasters import raster_arrays
from deadwood_engine.trace import HITS

STRIP_CELLS = 2**20  # cells summed at once
WHOLE_CELLS = 2**22  # up to this number of cells all are summed at once, which is faster: 150 MB


class Totals:
    """The sum over all workers by rows, as in `Rasters.totals`."""

    def __init__(self, rasters: Rasters) -> None:
        self.workers = rasters.workers
        self.shape: tuple[int, int] = self.workers[0].deposits.shape
        self.whole = rasters.totals() if self.shape[0] * self.shape[1] <= WHOLE_CELLS else None

    @cached_property
    def untouched(self) -> dict[str, NDArray]:
        """The value of a cell that no log has touched, by the name of the raster."""
        return Rasters([raster_arrays((1, 1), self.workers[0].band)]).totals()

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.untouched)

    def rows(self, rows: slice, names: Collection[str] | None = None) -> dict[str, NDArray]:
        """These rows of all rasters, or of the named ones; for danger, bands come first."""
        asked = [name for name in self.names if names is None or name in names]
        if self.whole is not None:
            return {name: self.whole[name][..., rows, :] for name in asked}
        parts = [each.hits[rows] for each in self.workers], [each.deposits[rows] for each in self.workers]
        columns = self.shape[1]
        if not any(hits[:, :, HITS].any() for hits in parts[0]) and not any(each.any() for each in parts[1]):
            shape = (parts[1][0].shape[0], columns)
            empty = {name: self.untouched[name] for name in asked}
            return {name: np.broadcast_to(each, (*each.shape[:-2], *shape)) for name, each in empty.items()}
        cells = slice(rows.start * columns, rows.stop * columns)
        return Rasters(
            [
                each._replace(
                    hits=each.hits[rows],
                    maxima=each.maxima[rows],
                    deposits=each.deposits[rows],
                    danger=each.danger[:, cells],
                )
                for each in self.workers
            ]
        ).totals(asked)

    def strips(self) -> Iterator[tuple[int, dict[str, NDArray]]]:
        """All rows in turn, each strip with its first row."""
        step = max(1, STRIP_CELLS // max(1, self.shape[1]))
        for first in range(0, self.shape[0], step):
            yield first, self.rows(slice(first, min(self.shape[0], first + step)))
