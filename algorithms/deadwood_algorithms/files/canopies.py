"""Canopy and surface models, read by rows: for `find_trees`."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np

from deadwood_algorithms.files.crs import crs_name, same_crs
from deadwood_algorithms.files.dem_windows import DemWindows, open_windows
from deadwood_algorithms.files.rasters import read_values
from deadwood_algorithms.params.tool import Feedback, UserError

SAME_PLACE_CELLS = 0.05  # grids that differ by more than this part of a cell, in any corner, are different


def opened_rows(
    path: str, crs: str | None, feedback: Feedback, what: str = "canopy"
) -> AbstractContextManager[DemWindows]:
    """A raster open for `rows_of`; its header is checked like that of a DEM, its heights are not: crowns have
    steps that no ground has."""
    return open_windows(path, crs=crs, feedback=feedback, look_through=False, what=what)


def rows_of(raster: DemWindows, rows: slice) -> np.ndarray:
    """Rows of a raster, counted from the south, as float64 [m]; NaN where it has no value."""
    if rows.start >= rows.stop:
        return np.zeros((0, raster.shape[1]))
    values = read_values(raster.source, raster.file_window(rows, slice(0, raster.shape[1])), np.float64)
    return values[::-1].copy() if raster.flipped else values


def refuse_other_cells(surface: DemWindows, ground: DemWindows) -> None:
    if not same_crs(surface.plan_crs, ground.plan_crs):
        raise UserError(
            f"{surface.path} is in {crs_name(surface.plan_crs)} and {ground.path} in {crs_name(ground.plan_crs)}; "
            "surface and terrain must be on the same cells"
        )
    off = np.abs(np.subtract(surface.bounds, ground.bounds)).max()
    if surface.shape != ground.shape or off > SAME_PLACE_CELLS * ground.cell:
        one, two = (
            f"{each.path} ({each.shape[1]} x {each.shape[0]} of {each.cell:g} m from {each.bounds[0]:.2f}, "
            f"{each.bounds[1]:.2f})"
            for each in (surface, ground)
        )
        raise UserError(f"{one} and {two} differ; surface and terrain must be on the same cells")
