"""The relief and the lines of a run, for its pictures."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from rasterio.enums import Resampling

from deadwood_algorithms.files.dem_header import is_dem
from deadwood_algorithms.files.tiles import open_to_draw
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.results.run_folder import Run, input_paths

CELLS_DRAWN = 700  # along the longer side of the map
Extent = tuple[float, float, float, float]  # west, east, south, north [m]


def read_relief(run: Run, frame: Extent) -> tuple[np.ndarray, float, Extent] | None:
    """Heights of the run's DEM (row 0 south) in the frame, at reduced resolution; None if the DEM no longer exists."""
    place = next((each for each in input_paths(run.path, run.manifest, "dem") if is_dem(each)), None)
    if place is None:
        return None
    with open_to_draw(place) as source:
        if source.transform.e > 0.0:  # a south-up file: the map is drawn without relief
            return None
        whole = source.bounds
        west, east = max(frame[0], whole.left), min(frame[1], whole.right)
        south, north = max(frame[2], whole.bottom), min(frame[3], whole.top)
        if west >= east or south >= north:
            return None
        window = source.window(west, south, east, north).round_offsets().round_lengths()
        step = max(1.0, max(window.height, window.width) / CELLS_DRAWN)
        shape = max(2, round(window.height / step)), max(2, round(window.width / step))
        heights = source.read(1, window=window, out_shape=shape, masked=True, resampling=Resampling.average)
        bounds = source.window_bounds(window)
    values = np.asarray(heights.astype(np.float64).filled(np.nan))[::-1]
    if not np.isfinite(values).any():
        return None
    extent = (bounds[0], bounds[2], bounds[1], bounds[3])
    return values, (extent[1] - extent[0]) / shape[1], extent


def tree_places(run: Run) -> np.ndarray:
    """Plan positions of the run's trees [m], shape (n, 2); none if there is no layer any more."""
    for place in map(str, input_paths(run.path, run.manifest, "trees")):
        if os.path.exists(place.split("|")[0]):
            trees = read_vector(place, geometry=("point",), target_crs=run.grid.crs, what="trees", feedback=Quiet())
            return shapely.get_coordinates(trees.geometry)
    return np.zeros((0, 2))


def coordinates_of(lines: Sequence[Any]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Plan coordinates of lines, and of the outlines of polygons."""
    shapes = np.asarray(lines, object)
    filled = shapely.get_dimensions(shapes) == 2
    strings = shapely.get_parts(np.where(filled, shapely.boundary(shapes), shapes))
    return [tuple(shapely.get_coordinates(each).T) for each in strings]
