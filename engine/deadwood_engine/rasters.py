"""Rasters that runs add to: one set a worker, so that no two write one cell, put together at the end."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .scene import Scene
from .trace import RasterArrays


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
        hits, deposits = first.hits.copy(), first.deposits.copy()
        maxima = [first.speed.copy(), first.energy.copy(), first.jump.copy()]
        for other in others:
            hits += other.hits
            deposits += other.deposits
            for total, part in zip(maxima, (other.speed, other.energy, other.jump), strict=True):
                np.maximum(total, part, out=total)
        for total in maxima:
            total[hits == 0] = np.nan
        return {
            "hit_count": hits,
            "deposit_count": deposits,
            "speed_max": maxima[0],
            "energy_max": maxima[1],
            "jump_max": maxima[2],
        }

    def add(self, totals: dict[str, NDArray]) -> None:
        """Add totals of an earlier run (a resumed one)."""
        first = self.workers[0]
        first.hits[...] += totals["hit_count"]
        first.deposits[...] += totals["deposit_count"]
        for mine, name in ((first.speed, "speed_max"), (first.energy, "energy_max"), (first.jump, "jump_max")):
            np.fmax(mine, totals[name], out=mine)


def raster_arrays(shape: tuple[int, int]) -> RasterArrays:
    return RasterArrays(
        np.zeros(shape, np.uint32),
        np.zeros(shape, np.uint32),
        np.zeros(shape, np.uint32),
        np.zeros(shape, np.float32),
        np.zeros(shape, np.float32),
        np.zeros(shape, np.float32),
    )
