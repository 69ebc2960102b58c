"""Rasters to which runs add: one set per worker, so that no two write to one cell, combined at the end."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from .outline import LISTED
from .scene import Scene
from .trace import ENERGY, HEIGHT, HITS, JUMP, SPEED, RasterArrays

_MAXIMA = (SPEED, "speed_max"), (ENERGY, "energy_max"), (JUMP, "jump_max"), (HEIGHT, "height_max")
NO_BANDS = np.zeros(0, np.int64)


class Rasters:
    """Rasters to which runs add, one set per worker; ``totals`` combines them."""

    def __init__(self, workers: list[RasterArrays]) -> None:
        self.workers = workers

    @staticmethod
    def allocate(scene: Scene, workers: int, bands: NDArray[np.int64] = NO_BANDS, *, maxima: bool = True) -> Rasters:
        """Empty rasters on the scene's grid: 28 bytes per cell and worker, 12 without the maxima.

        ``bands`` gives the band of ``danger``, from 1, to which each line of the scene belongs, 0 for none; lines of
        one object share a band. Without it there is no danger; otherwise 4 bytes per cell, worker and band are added,
        and 8 more.
        """
        shape = scene.arrays.terrain.heights.shape
        return Rasters([raster_arrays(shape, bands, maxima=maxima) for _ in range(max(1, workers))])

    def totals(self, names: Collection[str] | None = None) -> dict[str, NDArray]:
        """All of them, or those of these names: hit_count, deposit_count (uint32); speed_max [m/s], energy_max [J],
        jump_max, height_max [m] (float32, NaN = no log; not of rasters without maxima).

        With lines also danger (uint32, bands x rows x columns): how many of the logs that hit the cell touched any
        line then or later (band 0), and each line (the other bands).
        """
        workers, shape = self.workers, self.workers[0].deposits.shape

        def asked(name: str, table: NDArray) -> bool:
            return len(table) > 0 and (names is None or name in names)

        hits = _together(np.add, [each.hits[:, :, HITS] for each in workers])
        found = {"hit_count": hits} if asked("hit_count", hits) else {}
        if asked("deposit_count", hits):
            found["deposit_count"] = _together(np.add, [each.deposits for each in workers])
        for k, name in _MAXIMA:
            if asked(name, workers[0].maxima):
                found[name] = _together(np.maximum, [each.maxima[:, :, k] for each in workers])
                found[name][hits == 0] = np.nan
        if asked("danger", workers[0].danger):
            found["danger"] = _together(np.add, [each.danger for each in workers]).reshape(-1, *shape)
        return found

    def add(self, totals: dict[str, NDArray]) -> None:
        """Add totals of an earlier run (a resumed one)."""
        first = self.workers[0]
        first.hits[:, :, HITS] += totals["hit_count"]
        first.deposits[...] += totals["deposit_count"]
        for k, name in _MAXIMA:
            np.fmax(first.maxima[:, :, k], totals[name], out=first.maxima[:, :, k])
        if "danger" in totals:
            first.danger[...] += totals["danger"].reshape(first.danger.shape)


def _together(join: np.ufunc, tables: list[NDArray]) -> NDArray:
    total = tables[0].copy()
    for each in tables[1:]:
        join(total, each, out=total)
    return total


def raster_arrays(shape: tuple[int, int], bands: NDArray[np.int64] = NO_BANDS, *, maxima: bool = True) -> RasterArrays:
    count = int(bands.max(initial=0))
    cells = shape[0] * shape[1] if count else 0
    order = np.full(count + 1, -1)
    order[LISTED] = 0
    return RasterArrays(
        np.zeros((*shape, 2), np.uint32),
        np.zeros((*(shape if maxima else (0, 0)), 4), np.float32),
        np.zeros(shape, np.uint32),
        np.asarray(bands if count else NO_BANDS, np.int64),
        np.zeros(cells, np.uint32),  # memory pages that no list reaches are never allocated
        order,
        np.zeros((count + 1 if count else 0, cells), np.uint32),
    )
