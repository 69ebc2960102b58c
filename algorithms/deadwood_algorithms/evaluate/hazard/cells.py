"""A run's rasters of where logs passed, and the hits from each release area: the basis of the classes of each cell."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.hazard.rates import ReleaseArea
from deadwood_algorithms.files.grid import Grid, Part
from deadwood_algorithms.files.rasters import open_raster, read_part_on
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.results.hit_counts import count_of
from deadwood_algorithms.results.run_folder import Run

ROWS_AT_ONCE = 512
HITS, ENERGY = "hit_count.tif", "energy_max.tif"


def passed_window(source: Run) -> Grid:
    """The part of the run's grid in which any log passed."""
    grid, found = source.grid, None
    path = run_raster(source, HITS)
    with open_raster(path, "hits") as raster:
        if raster.shape != grid.shape:
            raise UserError(f"{path}: its {raster.shape[1]} x {raster.shape[0]} cells are not those of the run")
        for start in range(0, grid.shape[0], ROWS_AT_ONCE):
            part = Part(0, start, grid.shape[1], min(ROWS_AT_ONCE, grid.shape[0] - start))
            row, column = np.nonzero(read_part_on(raster, grid.window(part)) > 0.0)
            if row.size:
                least = int(column.min()), int(row.min())
                inside = Part(least[0], start + least[1], int(np.ptp(column)) + 1, int(np.ptp(row)) + 1)
                found = found.joined(inside) if found else inside
    if found is None:
        raise UserError(f"{source.path}: no log of the run passed any cell, so there is nothing to map")
    return grid.window(found)


def run_raster(source: Run, name: str) -> Path:
    path = source.path / name
    if not path.is_file():
        raise UserError(f"{source.path}: this run's folder has no {name}; run slide-logs again")
    return source.part(name)


def values_on(path: str | Path, grid: Grid, what: str) -> NDArray[np.float32]:
    """Band 1 of a raster on the cells of a window, NaN where it has none."""
    with open_raster(path, what) as raster:
        return read_part_on(raster, grid)


def hits_of_areas(
    source: Run, areas: Sequence[ReleaseArea], grid: Grid, feedback: Feedback
) -> Iterator[NDArray[np.uint32]]:
    """How many of each area's logs passed each cell, from stored trajectories."""
    ids = source.deposits["log_id"].to_numpy(np.int64)
    stored = np.isin(ids, source.stored_log_ids)
    of_area = source.deposits["release_id"].to_numpy()
    for area in areas:
        wanted = ids[stored & (of_area == area.release_id)]
        if not wanted.size:
            raise UserError(
                f"{source.path}: release area '{area.release_id}' has no stored trajectory, so its hits cannot be "
                f"separated from those of areas with another frequency; run slide-logs with --trajectories all"
            )
        yield count_of(source, wanted, grid, feedback)
