"""The friction coefficient of every cell of a DEM: from one number, a raster, or polygons with a field."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import geopandas
import numpy as np
import pyproj
import rasterio
import rasterio.features
import shapely
from numpy.typing import NDArray
from rasterio.errors import RasterioError

from deadwood_algorithms.columns import number_column
from deadwood_algorithms.grid import Grid
from deadwood_algorithms.rasters import open_raster, read_part_on, read_raster_on
from deadwood_algorithms.tool import Feedback, UserError
from deadwood_algorithms.vectors import read_vector

FRICTION_COLUMNS = ("friction", "mu")

Array = NDArray[np.float64]


def read_friction(friction: str | float, grid: Grid, feedback: Feedback) -> float | Array:
    """A number, or a raster or polygons that hold a friction coefficient for every cell of the DEM."""
    number = _number(friction)
    if number is not None:
        return number
    path = str(friction)
    if _is_raster(path):
        mu = np.asarray(read_raster_on(path, grid, "friction", feedback), np.float64)
    else:
        mu = _burnt(*_polygons(path, grid.crs, feedback), grid)
    return _checked(mu, grid, path)


@contextmanager
def open_friction(
    friction: str | float, crs: pyproj.CRS, feedback: Feedback
) -> Iterator[Callable[[Grid], float | Array]]:
    """The same for windows of a DEM that is too large to hold: gives a function from a window to its friction."""
    number, path = _number(friction), str(friction)
    if number is not None:
        yield lambda _: number
    elif _is_raster(path):
        with open_raster(path, "friction") as source:
            if source.crs is None:
                feedback.note(f"{path}: the friction raster has no CRS, it is taken to be in the DEM's")
            yield lambda grid: _checked(np.asarray(read_part_on(source, grid), np.float64), grid, path)
    else:
        frame, values = _polygons(path, crs, feedback)
        tree = shapely.STRtree(np.asarray(frame.geometry))

        def on(grid: Grid) -> Array:
            rows = np.sort(tree.query(shapely.box(*grid.bounds)))
            return _checked(_burnt(frame.iloc[rows], values[rows], grid), grid, path)

        yield on


def _number(friction: str | float) -> float | None:
    try:
        return float(friction)
    except ValueError:
        return None


def _is_raster(path: str) -> bool:
    """Whether the path opens as a raster with a band; a vector file, or none at all, is left to `read_vector`."""
    if "|" in path:
        return False
    try:
        with rasterio.open(path) as source:
            return source.count > 0
    except RasterioError:
        return False


def _polygons(path: str, crs: pyproj.CRS, feedback: Feedback) -> tuple[geopandas.GeoDataFrame, Array]:
    frame = read_vector(path, ("polygon",), crs, None, "friction", feedback, None)
    names = [name for name in FRICTION_COLUMNS if name in frame]
    if not names:
        columns = ", ".join(str(name) for name in frame.columns if name != frame.geometry.name) or "none"
        raise UserError(f"{path}: the friction polygons need a field 'friction' or 'mu'; the fields are {columns}")
    return frame, number_column(frame, names[0], minimum=0.0)


def _burnt(frame: geopandas.GeoDataFrame, values: Array, grid: Grid) -> Array:
    """The value of the polygon over each cell's centre; where polygons overlap, the later row counts."""
    burnt = np.full(grid.shape, np.nan)
    if len(frame):
        rasterio.features.rasterize(zip(frame.geometry, values, strict=True), out=burnt, transform=grid.transform)
    return np.ascontiguousarray(burnt[::-1])


def _checked(mu: Array, grid: Grid, path: str) -> Array:
    outside = np.isnan(mu) & np.isfinite(grid.values)
    if outside.any():
        row, column = (int(index[0]) for index in np.nonzero(outside))
        raise UserError(
            f"{path}: the friction does not cover the DEM, {outside.sum()} of its cells have none "
            f"(one at {grid.x0 + column * grid.cell:.1f}, {grid.y0 + row * grid.cell:.1f}); "
            "extend it, or clip the DEM to it"
        )
    least = float(np.nanmin(mu, initial=np.inf))
    if least < 0.0:
        raise UserError(f"{path}: the friction coefficient is {least:g} somewhere, but must not be negative")
    return np.where(np.isnan(mu), 0.0, mu)  # cells off the DEM are outside whatever they hold
