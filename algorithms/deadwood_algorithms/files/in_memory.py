"""Data that a Python caller passes instead of a path (a GeoDataFrame, a table, an array with its transform), as a file.

The file is named by its content, so that the same data are the same input wherever they come from: a result's
``run_id`` contains no temporary path and no time, and an existing file is never written again.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from deadwood_algorithms.files.identity import content_of, sha256_of
from deadwood_algorithms.params.tool import UserError

if TYPE_CHECKING:
    import geopandas
    import numpy
    import pandas
    from matplotlib.axes import Axes

FIXED_DAY = "2000-01-01T00:00:00.000Z"  # as in all our GeoPackages, so that the same content gives the same bytes
DIGITS = 16  # of the digest in a file's name


@dataclass(frozen=True, eq=False)
class Raster:
    """Values on a grid, with their georeference.

    Parameters
    ----------
    array : array, shape (rows, columns) or (bands, rows, columns)
    transform : affine.Affine or six numbers
        From column and row to x and y, as in rasterio.
    crs : anything that pyproj reads
        Such as ``"EPSG:2056"``, a number, a pyproj or rasterio CRS.
    nodata : float, optional
        The value of cells that are outside; NaN is always outside.
    names, meanings : tuple of str
        Name and meaning of each band, if known.
    """

    array: numpy.ndarray
    transform: Any
    crs: Any
    nodata: float | None = None
    names: tuple[str, ...] = ()
    meanings: tuple[str, ...] = ()

    @property
    def band(self) -> numpy.ndarray:
        """The first band, shape (rows, columns)."""
        return self.array if self.array.ndim == 2 else self.array[0]

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """West, east, south, north: the order of ``imshow``'s extent."""
        rows, columns = self.band.shape
        a, _, west, _, e, north = tuple(self.transform)[:6]
        return west, west + a * columns, north + e * rows, north

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the first band as a map; cells without a value, and counts of 0, stay empty."""
        from deadwood_algorithms.files.quick_map import draw_raster, map_axes

        ax = map_axes() if ax is None else ax
        draw_raster(ax, self)
        return ax


def read_raster(path: Path) -> Raster:
    """Read a raster file as an array with its georeference; scaled integers become the numbers that they represent."""
    import numpy as np
    import rasterio

    with rasterio.open(path) as source:
        array, nodata = source.read(1) if source.count == 1 else source.read(), source.nodata
        scales, offsets = (np.reshape(each, (-1, 1, 1)) for each in (source.scales, source.offsets))
        if (scales != 1.0).any() or (offsets != 0.0).any():
            outside = np.zeros(array.shape, bool) if nodata is None else array == nodata
            values = np.where(outside, np.nan, array.reshape(source.count, *source.shape) * scales + offsets)
            array, nodata = values.reshape(array.shape), None
        names = tuple(each or "" for each in source.descriptions)
        meanings = tuple(source.tags(k).get("long_name", "") for k in source.indexes)
        return Raster(array, source.transform, source.crs, nodata, names, meanings)


def has_layer(path: Path, layer: str) -> bool:
    import pyogrio

    return layer in {str(name) for name, _ in pyogrio.list_layers(path)}


def read_layer(path: Path, layer: str) -> geopandas.GeoDataFrame:
    import geopandas

    return geopandas.read_file(path, layer=layer)


def read_table(path: Path) -> pandas.DataFrame:
    """Read a table of the toolbox, CSV or Parquet."""
    import pandas

    return pandas.read_parquet(path) if path.suffix == ".parquet" else pandas.read_csv(path)


def is_in_memory(value: Any) -> bool:
    """Whether a value is data that must become a file, rather than a path or a number."""
    return isinstance(value, Raster) or _is_frame(value) or _is_data_array(value)


def crs_text(value: Any) -> str:
    """A CRS as the text that a flag would have; a number is an EPSG code."""
    if isinstance(value, str):
        return value
    import pyproj
    from pyproj.exceptions import CRSError

    try:
        return pyproj.CRS.from_user_input(value).to_string()
    except CRSError as error:
        raise UserError(f"--crs is '{value}', which is not a known CRS; name it like EPSG:2056") from error


def as_file(value: Any, name: str, folder: Path) -> Path:
    """The file in ``folder`` with the data given for the parameter ``name``, or a copy of a file that will not last;
    written unless it exists.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if isinstance(value, os.PathLike):
        file = Path(value)
        digest = content_of if file.suffix == ".gpkg" else sha256_of
        return _kept(folder, name, file.suffix, digest, lambda path: shutil.copyfile(file, path))
    if _is_data_array(value):
        value = _of_data_array(value, name)
    if isinstance(value, Raster):
        return _kept(folder, name, ".tif", sha256_of, lambda path: _write_raster(path, value, name))
    if hasattr(value, "geometry") and hasattr(value, "crs"):
        return _kept(folder, name, ".gpkg", content_of, lambda path: _write_layer(path, value, name))
    return _kept(folder, name, ".csv", sha256_of, lambda path: value.to_csv(path, index=_has_name(value)))


def _is_frame(value: Any) -> bool:
    return hasattr(value, "to_csv") and hasattr(value, "columns")  # pandas, and libraries based on it


def _is_data_array(value: Any) -> bool:
    return hasattr(value, "dims") and hasattr(value, "values") and not _is_frame(value)


def _kept(
    folder: Path, name: str, ending: str, digest_of: Callable[[Path], str | None], write: Callable[[Path], Any]
) -> Path:
    made = folder / f".{name}-{os.getpid()}{ending}"
    try:
        write(made)
        place = folder / f"{name}-{str(digest_of(made))[:DIGITS]}{ending}"
        if not place.exists():
            os.replace(made, place)
        return place
    finally:
        made.unlink(missing_ok=True)


def _write_layer(path: Path, frame: geopandas.GeoDataFrame, name: str) -> None:
    import pyogrio

    if frame.crs is None:
        raise UserError(f"{name}: the GeoDataFrame has no CRS; name it, for example {name}.set_crs('EPSG:2056')")
    with_index: Any = frame.reset_index() if _has_name(frame) else frame
    pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": FIXED_DAY})
    try:
        pyogrio.write_dataframe(
            with_index,
            path,
            layer=name,
            driver="GPKG",
            dataset_options={"VERSION": "1.2"},
            layer_options={"GEOMETRY_NAME": "geom", "FID": "row_fid"},
        )
    except (ValueError, TypeError, RuntimeError, NotImplementedError) as error:
        raise UserError(f"{name}: this GeoDataFrame cannot be written as a layer ({_first_line(error)})") from error
    finally:
        pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": None})


def _has_name(frame: pandas.DataFrame) -> bool:
    """Whether the index is a column too, as in geopandas: whether it has a name."""
    return any(each is not None for each in frame.index.names)


def _write_raster(path: Path, raster: Raster, name: str) -> None:
    import numpy
    import pyproj
    import rasterio
    from pyproj.exceptions import CRSError
    from rasterio.errors import RasterioError
    from rasterio.transform import Affine

    from deadwood_algorithms.files.geotiff import geotiff_profile

    if raster.crs is None:
        raise UserError(f"{name}: the array has no CRS; give one: Raster(array, transform, crs='EPSG:2056')")
    try:
        crs = pyproj.CRS.from_user_input(raster.crs)
    except CRSError as error:
        raise UserError(f"{name}: '{raster.crs}' is not a known CRS; name it like EPSG:2056") from error
    array = numpy.asarray(raster.array)
    array = array.astype(numpy.uint8) if array.dtype == bool else array
    if array.ndim not in (2, 3) or array.dtype.kind not in "uif" or 0 in array.shape:
        raise UserError(
            f"{name}: an array of shape {array.shape} and type {array.dtype} is not a raster; give numbers in rows and "
            "columns"
        )
    bands = array[numpy.newaxis] if array.ndim == 2 else array
    try:
        transform = Affine(*tuple(raster.transform)[:6])
    except TypeError as error:
        raise UserError(f"{name}: the transform '{raster.transform}' is not six numbers (a, b, c, d, e, f)") from error
    if transform.e > 0.0:  # rows from the south, as in many grids: store the same cells with the northernmost row first
        bands = bands[:, ::-1]
        a, b, c, d, e, f = tuple(transform)[:6]
        transform = Affine(a, -b, c + b * bands.shape[1], d, -e, f + e * bands.shape[1])
    profile = geotiff_profile(bands.shape[1:], crs, transform, str(array.dtype), raster.nodata, bands.shape[0])
    try:
        with rasterio.open(path, "w", **profile) as target:
            target.write(bands)
    except (RasterioError, ValueError, TypeError) as error:
        raise UserError(f"{name}: this array cannot be written as a raster ({_first_line(error)})") from error


def _of_data_array(value: Any, name: str) -> Raster:
    """A raster from an xarray, whose georeference rioxarray holds."""
    place = getattr(value, "rio", None)
    if place is None:
        raise UserError(
            f"{name}: a DataArray gives its transform and CRS through rioxarray: import rioxarray, or give "
            "Raster(array, transform, crs)"
        )
    return Raster(value.values, place.transform(), place.crs, place.nodata)


def _first_line(error: Exception) -> str:
    return (str(error) or type(error).__name__).splitlines()[0].rstrip(".")
