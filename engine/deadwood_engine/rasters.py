"""Rasters that runs add to: one set a worker, so that no two write one cell, put together at the end."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .scene import Scene
from .trace import ENERGY, HITS, JUMP, SPEED, RasterArrays


class Rasters:
    """Rasters that runs add to, one set a worker; ``totals`` puts them together."""

    def __init__(self, workers: list[RasterArrays]) -> None:
        self.workers = workers

    @staticmethod
    def allocate(scene: Scene, workers: int) -> Rasters:
        """Empty rasters of the scene's grid: 24 bytes a cell and worker."""
        shape = scene.arrays.terrain.heights.shape
        return Rasters([raster_arrays(shape) for _ in range(max(1, workers))])

    def totals(self) -> dict[str, NDArray]:
        """hit_count, deposit_count (uint32); speed_max [m/s], energy_max [J], jump_max [m] (float32, NaN = no log)."""
        first, *others = self.workers
        hits, deposits = first.hits[:, :, HITS].copy(), first.deposits.copy()
        maxima = [first.maxima[:, :, k].copy() for k in (SPEED, ENERGY, JUMP)]
        for other in others:
            hits += other.hits[:, :, HITS]
            deposits += other.deposits
            for k, total in enumerate(maxima):
                np.maximum(total, other.maxima[:, :, k], out=total)
        for total in maxima:
            total[hits == 0] = np.nan
        return {
            "hit_count": hits,
            "deposit_count": deposits,
            "speed_max": maxima[SPEED],
            "energy_max": maxima[ENERGY],
            "jump_max": maxima[JUMP],
        }

    def add(self, totals: dict[str, NDArray]) -> None:
        """Add totals of an earlier run (a resumed one)."""
        first = self.workers[0]
        first.hits[:, :, HITS] += totals["hit_count"]
        first.deposits[...] += totals["deposit_count"]
        for k, name in ((SPEED, "speed_max"), (ENERGY, "energy_max"), (JUMP, "jump_max")):
            np.fmax(first.maxima[:, :, k], totals[name], out=first.maxima[:, :, k])


def raster_arrays(shape: tuple[int, int]) -> RasterArrays:
    return RasterArrays(np.zeros((*shape, 2), np.uint32), np.zeros((*shape, 3), np.float32), np.zeros(shape, np.uint32))
