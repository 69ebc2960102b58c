"""The class rasters of a hazard map, the area of each class, and the return period of each cell."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.hazard.cells import hits_of_areas
from deadwood_algorithms.evaluate.hazard.frequencies import stored_areas
from deadwood_algorithms.evaluate.hazard.legend import ranges_of
from deadwood_algorithms.evaluate.hazard.rates import ReleaseArea, pooled, rate_with_interval, return_period
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.rasters import write_bands, write_classes
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.results.run_folder import Run
from deadwood_algorithms.schemas.files import RETURN


class ClassMaps:
    """Class rasters in a folder, and the area of each class."""

    def __init__(self, folder: Path, grid: Grid) -> None:
        self.folder, self.grid = folder, grid
        self.classes: list[dict[str, Any]] = []

    def write(
        self,
        name: str,
        values: NDArray[np.uint8],
        rows: Sequence[tuple[int, str, str]],
        about: str,
        scale: tuple[Sequence[float], str] | None = None,
        *,
        logs: tuple[int, Sequence[int | None]],
    ) -> None:
        """``scale``: the bounds of the classes and their unit; None for the matrix, whose classes are pairs.

        logs : of the run, and how many the area of each class needs; with fewer none is stated, because it would be too
            large (None: no number supports it)
        """
        write_classes(self.folder / f"{name}.tif", values, self.grid, rows, meaning=about)
        count = np.bincount(values.ravel(), minlength=256)
        ends = ranges_of(scale[0]) if scale else [None] * len(rows)
        for (value, _, label), end, needed in zip(rows, ends, logs[1], strict=True):
            between = {"low": end[0], "high": end[1], "unit": scale[1]} if scale and end else {}
            area = float(count[value] * self.grid.cell**2) if needed is not None and logs[0] >= needed else None
            ground = {"cells": int(count[value]), "area_m2": area, "n_needed": needed}
            self.classes.append({"map": name, "class": value, "meaning": label} | between | ground)


def years_of(
    source: Run, areas: Sequence[ReleaseArea], logs: int, grid: Grid, hits: NDArray[np.float32], feedback: Feedback
) -> tuple[list[NDArray[np.float64]], float]:
    """Return period of each cell with its interval [years], and the shortest that is possible where no log passed."""
    rates = pooled(areas, logs)
    if rates:
        counts: Any = [hits]
    else:
        rates = stored_areas(source, list(areas))
        counts = hits_of_areas(source, rates, grid, feedback)
        feedback.note(
            "release areas of different frequency: the hits of each are counted from its stored trajectories",
            code="hits-from-trajectories",
        )
    rate, low, high = rate_with_interval(counts, rates, logs)
    most = float(rate_with_interval([np.array(0)] * len(rates), rates, logs)[2])
    return [return_period(each) for each in (rate, high, low)], 1.0 / most


def write_years(path: Path, years: Sequence[NDArray[np.float64]], grid: Grid) -> None:
    passed = np.isfinite(years[0])
    bands = {band.name: np.where(passed, each, np.nan) for band, each in zip(RETURN.bands, years, strict=True)}
    options = {"units": [band.unit for band in RETURN.bands], "style": RETURN.look, "raster": RETURN.name}
    write_bands(path, bands, grid, nodata=np.nan, dtype="float32", **options)
