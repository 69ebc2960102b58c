"""Layers in and out: the one name under which tools open and write files.

Importing it is cheap: the GIS libraries are loaded by the first call that needs them, so that ``--help`` does not wait
for them. The work is done in files of their own: `rasters`, `vectors`, `tables` (text), `columns`, `outputs` and `crs`.

Everything here keeps the toolbox's conventions: heights at cell centres, what is outside is NaN and never a height, one
CRS a run, results whole or not at all, and one line to the user (`UserError`) that names file, layer, field and row.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from deadwood_algorithms.columns import id_column, number_column, warn_implausible, where_of
from deadwood_algorithms.grid import Grid
from deadwood_algorithms.outputs import output_folder, output_path
from deadwood_algorithms.tool import Feedback, Quiet

if TYPE_CHECKING:
    import geopandas
    import pandas
    import pyproj

__all__ = [
    "Grid",
    "id_column",
    "is_raster",
    "number_column",
    "output_folder",
    "output_path",
    "read_dem",
    "read_raster_on",
    "read_table",
    "read_vector",
    "warn_implausible",
    "where_of",
    "write_bands",
    "write_raster",
    "write_vector",
]


def read_dem(path: str | Path, *, crs: str | None = None, feedback: Feedback | None = None) -> Grid:
    """Read band 1 of a DEM as float32 heights, or refuse it with the command that mends it.

    ``crs`` names the CRS of a file that holds none. A south-up file is read right, a rotated or non-square one refused.
    """
    from deadwood_algorithms import dem_windows

    return dem_windows.read_dem(path, crs, feedback or Quiet())


def is_raster(path: str | Path) -> bool:
    """Whether the path opens as a raster with a band; a vector file, a text table, or nothing at all is none."""
    from deadwood_algorithms import rasters

    return rasters.is_raster(path)


def read_raster_on(path: str | Path, grid: Grid, *, what: str, feedback: Feedback | None = None) -> np.ndarray:
    """Band 1 of a raster on the cells of ``grid`` (row 0 south): the nearest value, NaN where the raster has none."""
    from deadwood_algorithms import rasters

    return rasters.read_raster_on(path, grid, what, feedback or Quiet())


def write_raster(
    path: str | Path,
    values: np.ndarray,
    grid: Grid,
    *,
    nodata: float | None = None,
    dtype: str,
    units: str = "",
    description: str = "",
) -> None:
    """Write a GeoTIFF (tiled, deflate) from an array whose row 0 is the southernmost, and read it back.

    Its style for QGIS stands beside it, in ``NAME.qml`` (`styles`).
    """
    from deadwood_algorithms import rasters

    rasters.write_raster(path, values, grid, nodata=nodata, dtype=dtype, units=units, description=description)


def write_bands(
    path: str | Path,
    bands: Mapping[str, np.ndarray],
    grid: Grid,
    *,
    nodata: float | None = None,
    dtype: str,
    units: Sequence[str],
) -> None:
    """Write a GeoTIFF of several bands by their descriptions, as `write_raster` does one; ``units`` by band."""
    from deadwood_algorithms import rasters

    rasters.write_bands(path, bands, grid, nodata=nodata, dtype=dtype, units=units)


def read_vector(
    path: str | Path,
    *,
    geometry: Sequence[str] = ("point",),
    target_crs: pyproj.CRS | None,
    crs: str | None = None,
    what: str = "releases",
    feedback: Feedback | None = None,
    x_field: str | None = None,
    y_field: str | None = None,
    rows: pandas.DataFrame | None = None,
) -> geopandas.GeoDataFrame:
    """Read a layer of points, lines or polygons in ``target_crs``; rows 0..n-1, each with a valid geometry.

    Parameters
    ----------
    path : path
        Any vector format, or a text table with x and y columns; ``file.gpkg|layername=trees`` names one of several
        layers, and a file with several is refused without it.
    geometry : sequence of str
        Which of ``point``, ``line`` and ``polygon`` are welcome. Points come as Point, lines as LineString or, of
        several parts, MultiLineString, polygons as Polygon or MultiPolygon.
    target_crs : pyproj.CRS or None
        Mostly ``grid.crs``. None keeps the layer's own CRS, which it must then have, or ``crs`` must name.
    crs : str, optional
        CRS of a layer that names none; without it such a layer is taken to be in ``target_crs``.
    what : str
        What the layer is to the tool: a name of `schemas.LAYERS`, or any word for messages. Columns cut short by the
        shapefile format, or in another letter case, get the name of that schema back.
    x_field, y_field : str, optional
        Columns with the coordinates, which then count instead of a geometry.
    rows : DataFrame, optional
        What `read_table` gave for the path, or a part of it (its index still tells the row), which is not read again.
    """
    from deadwood_algorithms import vectors

    return vectors.read_vector(
        path, tuple(geometry), target_crs, crs, what, feedback or Quiet(), (x_field, y_field) if x_field else None, rows
    )


def read_table(path: str | Path, *, what: str) -> pandas.DataFrame:
    """Read the rows of a text table or vector layer as they are: a GeoDataFrame where the file holds geometries."""
    from deadwood_algorithms import vectors

    return vectors.read_table(path, what)


def write_vector(path: str | Path, layers: Mapping[str, geopandas.GeoDataFrame]) -> None:
    """Write a GeoPackage 1.2 with these layers and their styles; same input, same bytes (time stamps: a fixed day)."""
    from deadwood_algorithms import vectors

    vectors.write_vector(path, layers)
