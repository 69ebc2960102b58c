"""Rasters in and out: opened, read onto a grid, written. For DEMs see `dem_windows`.

What is outside (nodata, NaN, off the grid) is NaN, never a height.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import rasterio
from rasterio.errors import RasterioError
from rasterio.transform import Affine
from rasterio.windows import Window

from deadwood_algorithms.files import remedies, styles
from deadwood_algorithms.files.ascii_grid import refuse_broken_ascii, why_not_ascii
from deadwood_algorithms.files.bands import first_of_role, source_of
from deadwood_algorithms.files.crs import accuracy_words, horizontal, is_ballpark, refuse_local, same_crs
from deadwood_algorithms.files.embedded import tags_now
from deadwood_algorithms.files.geotiff import (
    TILE_CELLS,
    UNPACKED_UP_TO_CELLS,
    Statistics,
    geotiff_profile,
    is_laid_out,
    lay_out,
    libtiff_silent,
)
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.inputs import refuse_missing
from deadwood_algorithms.params.tool import Feedback, Quiet, UserError
from deadwood_algorithms.schemas.written import band_named

STRIP_BYTES = 32 * 2**20
PACKED = (".zip", ".gz", ".7z", ".rar", ".tar", ".tgz", ".bz2", ".xz")
# Formats of plain numbers: GDAL does not always raise an error if some are missing at the end.
FLAT_FORMATS = ("ENVI", "EHdr", "SAGA", "RST", "BT")


def read_raster_on(path: str | Path, grid: Grid, *, what: str, feedback: Feedback | None = None) -> np.ndarray:
    """Band 1 of a raster on the cells of ``grid`` (row 0 south): the nearest value, NaN where the raster has none.

    The source cell that contains a cell's centre is calculated for each cell separately, so a window gives the same
    result as the whole; GDAL's warper approximates along rows and does not.
    """
    feedback = feedback or Quiet()
    with open_raster(path, what) as source:
        refuse_cut_off(source, path)
        if source.transform == Affine.identity():
            raise UserError(
                f"{path}: the {what} raster has no georeference; fix, with its own numbers: {remedies.placed(path)}"
            )
        if source.crs is None:
            feedback.note(f"{path}: the {what} raster has no CRS, it is taken to be in the DEM's", code="crs-assumed")
        own = pyproj.CRS.from_wkt(source.crs.to_wkt()) if source.crs else grid.crs
        same = same_crs(own, grid.crs)
        refuse_local(own, grid.crs, f"{path}: the {what} raster")
        frame = grid.frame
        if not (same and source.shape == frame.shape and source.transform.almost_equals(frame.transform)):
            how = "" if same else f", {accuracy_words(own, grid.crs, source.bounds)}"
            say = feedback.warn if is_ballpark(how) else feedback.note
            say(
                f"{path}: the {what} raster is resampled to the DEM's cells (nearest value{how})",
                code="raster-resampled",
            )
        return read_part_on(source, grid, feedback, what)


def extent_in(path: str | Path, crs: pyproj.CRS) -> tuple[float, float, float, float]:
    """West, south, east and north end [m] of a raster in a CRS; without a CRS they are returned unchanged."""
    with open_raster(path, "weights") as source:
        own = pyproj.CRS.from_wkt(source.crs.to_wkt()) if source.crs else crs
        left, bottom, right, top = source.bounds
        box = left, min(bottom, top), right, max(bottom, top)
        if same_crs(own, crs):
            return box
        moved = pyproj.Transformer.from_crs(horizontal(own), horizontal(crs), always_xy=True)
        return moved.transform_bounds(*box)


def read_part_on(source: Any, grid: Grid, feedback: Feedback | None = None, what: str = "") -> np.ndarray:
    """Band 1 of an open raster on the cells of ``grid`` (row 0 south), reading only the part around it.

    The nearest value, NaN where the raster has none; one without a CRS is taken to be in that of the grid.
    """
    own = pyproj.CRS.from_wkt(source.crs.to_wkt()) if source.crs else grid.crs
    same = same_crs(own, grid.crs)
    moved = None if same else pyproj.Transformer.from_crs(grid.plan_crs, horizontal(own), always_xy=True)
    values = np.full(grid.shape, np.nan, np.float32)
    rows = max(1, STRIP_BYTES // (64 * grid.shape[1]))
    for start in range(0, grid.shape[0], rows):
        strip = slice(start, min(grid.shape[0], start + rows))
        values[strip] = _nearest(source, grid, strip, moved)
        if feedback:
            feedback.progress(strip.stop, grid.shape[0], f"reading the {what} raster")
    return values


def _nearest(source: Any, grid: Grid, strip: slice, moved: Any) -> np.ndarray:
    """Values of the source cells that contain the centres of these rows of the grid; NaN beyond the source."""
    frame, (column, row) = grid.frame, grid.first
    x = frame.x0 + (column + np.arange(grid.shape[1])) * frame.cell
    y = frame.y0 + (row + np.arange(strip.start, strip.stop)) * frame.cell
    inverse = ~source.transform
    # Usually columns depend on x only and rows on y only, so they need not be computed for each cell.
    if moved is None and inverse.b == inverse.d == 0.0:
        i, j = inverse.a * x + inverse.c, inverse.e * y + inverse.f
        columns, rows = np.flatnonzero((i >= 0) & (i < source.width)), np.flatnonzero((j >= 0) & (j < source.height))
        places, i, j = np.ix_(rows, columns), i[None, columns], j[rows, None]
    else:
        x, y = np.broadcast_arrays(x[None, :], y[:, None])
        x, y = moved.transform(x, y) if moved else (x, y)
        i, j = inverse.a * x + inverse.b * y + inverse.c, inverse.d * x + inverse.e * y + inverse.f
        # inf, where PROJ has no transformation, is outside
        places = np.nonzero((i >= 0) & (i < source.width) & (j >= 0) & (j < source.height))
        i, j = i[places], j[places]
    values = np.full((strip.stop - strip.start, grid.shape[1]), np.nan, np.float32)
    if i.size and j.size:
        i, j = i.astype(np.int64), j.astype(np.int64)
        left, top = int(i.min()), int(j.min())
        window = Window(left, top, int(i.max()) - left + 1, int(j.max()) - top + 1)  # type: ignore[call-arg]
        values[places] = read_values(source, window, np.float32)[j - top, i - left]
    return values


@dataclass(frozen=True)
class ByRows:
    """A band that is computed while its rows are written, and needs no memory.

    of : returns the values of rows, counted from the south
    """

    shape: tuple[int, int]
    of: Callable[[slice], np.ndarray]


Band = np.ndarray | ByRows


def rows_of(band: Band, rows: slice) -> np.ndarray:
    """Rows of a band, counted from the south."""
    return band.of(rows) if isinstance(band, ByRows) else band[rows]


def write_raster(
    path: str | Path,
    values: np.ndarray,
    grid: Grid,
    *,
    nodata: float | None = None,
    dtype: str,
    units: str = "",
    description: str = "",
    style: str = "",
    raster: str = "",
) -> None:
    """Write a GeoTIFF (tiled, deflate) from an array whose row 0 is the southernmost, and read it back.

    Its style for QGIS is written beside it, to ``NAME.qml``; ``style`` is a name of `styles.RASTERS`.
    """
    bands = {description: values}
    write_bands(path, bands, grid, nodata=nodata, dtype=dtype, units=[units], style=style, raster=raster)


def write_classes(
    path: str | Path, values: np.ndarray, grid: Grid, rows: Sequence[tuple[int, str, str]], *, meaning: str
) -> None:
    """Write a GeoTIFF of classes, bytes of which 0 is nodata, with its colour table, and its style for QGIS beside it.

    ``rows`` are value, colour (``#rrggbb``) and what the class is.
    """
    colours = {value: colour for value, colour, _ in rows}
    bands = {Path(path).stem: values}
    write_bands(path, bands, grid, nodata=0, dtype="uint8", units=[""], colours=colours, meaning=meaning)
    styles.store_beside(Path(path), styles.of_classes(rows))


def write_bands(
    path: str | Path,
    bands: Mapping[str, Band],
    grid: Grid,
    *,
    nodata: float | None = None,
    dtype: str,
    units: Sequence[str],
    style: str = "",
    colours: Mapping[int, str] | None = None,
    raster: str = "",
    meaning: str = "",
) -> None:
    """Write a GeoTIFF of several named bands, as `write_raster` writes one; ``units`` by band.

    ``raster`` is its name in `schemas.files`, which has the meaning of each band; ``meaning`` is added to that of a
    single band. Bands are not copied: strips of rows are written, measured and read back.

    For a window the whole grid is written, but only the window stored; the statistics are those of the window.

    Reading back detects a full disk: GDAL writes the last tiles when closing, which raises nothing.
    """
    for values in bands.values():
        if values.shape != grid.shape:
            raise ValueError(f"an array of {values.shape} for a grid of {grid.shape}")
    frame, part = grid.frame, grid.part
    profile = geotiff_profile(frame.shape, frame.crs, frame.transform, dtype, nodata, len(bands))
    if len(bands) > 1:
        profile["interleave"] = "band"
    cells, sparse = frame.shape[0] * frame.shape[1], grid.whole is not None
    if cells <= UNPACKED_UP_TO_CELLS and is_laid_out(cells, sparse=sparse):
        profile = {name: value for name, value in profile.items() if name not in ("compress", "predictor")}
    profile["sparse_ok"] = True  # tiles that hold nothing are not stored, and read as nodata or 0
    top = frame.shape[0] - part.row - part.rows
    # rows from the north, so that each strip fills whole tiles of the file
    borders = [0, *range(TILE_CELLS - top % TILE_CELLS, part.rows, TILE_CELLS), part.rows]
    strips = [slice(*ends) for ends in pairwise(borders)]

    def place(rows: slice) -> Window:
        return Window(part.column, top + rows.start, part.columns, rows.stop - rows.start)  # type: ignore[call-arg]

    largest = -math.inf
    with libtiff_silent(), rasterio.open(path, "w", **profile) as target:
        target.update_tags(**tags_now())
        for number, (description, values) in enumerate(bands.items(), start=1):
            of_band = Statistics(nodata)
            for rows in strips:
                if not _is_empty(strip := _north_up(values, dtype, rows), nodata):
                    target.write(strip, number, window=place(rows))
                of_band.take(strip)
            target.update_tags(number, **of_band.tags())
            largest = of_band.largest if number == 1 else largest
            if units[number - 1]:
                target.set_band_unit(number, units[number - 1])
            if description:
                describe_band(target, number, description, raster=raster, meaning=meaning)
        if colours:
            table = {value: (*bytes.fromhex(colour[1:]), 255) for value, colour in colours.items()}
            target.write_colormap(1, {0: (0, 0, 0, 0)} | table)
    with libtiff_silent():
        lay_out(Path(path), cells, sparse=sparse)
    with rasterio.open(path) as written:
        for number, values in enumerate(bands.values(), start=1):
            for rows in strips:
                there = written.read(number, window=place(rows))
                if not np.array_equal(there, _north_up(values, dtype, rows), equal_nan=dtype[0] == "f"):
                    raise OSError(f"{path}: the written file cannot be read back")
    if style:
        styles.store_beside(Path(path), styles.of_raster(style, np.array([largest])))


def describe_band(target: Any, number: int, name: str, *, raster: str = "", meaning: str = "") -> None:
    """Name a band of a file that is being written, and write its meaning to its metadata (``long_name``): the given
    text, else that of the schema.
    """
    target.set_band_description(number, name)
    band = band_named(raster, name)
    if meaning := meaning or (band.meaning if band is not None else ""):
        target.update_tags(number, long_name=meaning)


def _north_up(values: Band, dtype: str, rows: slice) -> np.ndarray:
    """These rows of a raster, counted from the north."""
    from_south = slice(values.shape[0] - rows.stop, values.shape[0] - rows.start)
    return np.ascontiguousarray(rows_of(values, from_south)[::-1], dtype=dtype)


def _is_empty(values: np.ndarray, nodata: float | None) -> bool:
    """Whether all values equal those that are read where nothing is stored."""
    if nodata is not None and np.isnan(nodata):
        return bool(np.isnan(values).all())
    return not np.any(values != (nodata or 0))


def open_raster(path: str | Path, what: str) -> Any:
    """Open a raster for reading; raises ``UserError`` with the reason if that is impossible."""
    refuse_missing(path, what)
    try:
        source = rasterio.open(source_of(path, what))
    except RasterioError as error:
        packed = "it is packed; unpack it first" if Path(path).suffix.lower() in PACKED else None
        reason = why_not_ascii(path) or packed or first_line(error)
        raise UserError(f"{path}: the {what} is not a raster that can be read ({reason})") from error
    if source.count == 0:
        whole = first_of_role(source, what)
        names = ", ".join(name.split(":")[-1] for name in source.subdatasets)
        source.close()
        inside = (
            f"several rasters ({names}); write one of them out: {remedies.one_of(path, whole)}" if whole else "no band"
        )
        raise UserError(f"{path}: the {what} file holds {inside}")
    return source


def is_raster(path: str | Path) -> bool:
    """Whether the path opens as a raster with a band; not a vector file, a text table, or a missing file."""
    if "|" in str(path) or not Path(path).is_file():
        return False
    refuse_missing(path, "raster")
    try:
        with rasterio.open(path) as source:
            return source.count > 0 or bool(source.subdatasets)
    except RasterioError:
        return False


def refuse_cut_off(source: Any, path: str | Path) -> None:
    """Reject truncated files if GDAL silently reads the missing end as 0 (the other formats raise)."""
    if source.driver == "AAIGrid":
        refuse_broken_ascii(path, source.width, source.height)
    needed = source.width * source.height * source.count * np.dtype(source.dtypes[0]).itemsize
    if source.driver in FLAT_FORMATS and Path(path).stat().st_size < needed:
        raise UserError(f"{path}: the file is shorter than its header promises; it is truncated; get a new copy")


def read_values(source: Any, window: Window, dtype: Any) -> np.ndarray:
    """A window of band 1, scale and offset applied, NaN where masked or not finite; rows as in the file."""
    try:
        raw = source.read(1, window=window, masked=True)
    except RasterioError as error:
        reason, start = first_line(error.__cause__ or error), window.row_off
        rows = f"rows {start + 1} to {start + window.height}"
        raise UserError(f"{source.name}: the raster is damaged, {rows} ({reason})") from error
    scale, offset = source.scales[0], source.offsets[0]
    values = raw.data if scale == 1 and offset == 0 else raw.data * np.float64(scale) + offset
    with np.errstate(over="ignore", invalid="ignore"):
        values = values.astype(dtype)
    values[np.ma.getmaskarray(raw) | ~np.isfinite(values)] = np.nan
    return values


def first_line(error: BaseException) -> str:
    return str(error).splitlines()[0].rstrip(".") if str(error) else type(error).__name__
