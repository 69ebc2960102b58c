"""Rasters in and out, behind `layers`: opened, judged by their headers, read onto a grid, written (DEM: `dem_windows`).

What is outside (nodata, NaN, off the grid) is NaN, never a height.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import rasterio
from pyproj.exceptions import ProjError
from rasterio.crs import CRS as RasterioCRS
from rasterio.enums import ColorInterp
from rasterio.errors import RasterioError
from rasterio.transform import Affine
from rasterio.windows import Window

from deadwood_algorithms import styles
from deadwood_algorithms.ascii_grid import refuse_broken_ascii, why_not_ascii
from deadwood_algorithms.crs import accuracy_words, crs_name, horizontal, parse_crs, same_crs
from deadwood_algorithms.grid import Grid
from deadwood_algorithms.inputs import refuse_missing
from deadwood_algorithms.tool import Feedback, UserError

# Skew, unequal cell sides or rounded headers may shift the far corner of the grid by this part of a cell: less
# than any survey's positional accuracy, and less than a bilinear surface can tell.
SHIFT_ALLOWED_CELLS = 0.05
# No ground on Earth is that high or deep on land: an undeclared nodata value such as -9999, -32768 or 3.4e38.
HEIGHT_LIMIT_M = 9000.0
# Cells of exactly 0 m this far below all the others are an undeclared empty collar, not a chasm.
COLLAR_DROP_M = 100.0
# Projections of the whole world, true to scale at the equator alone, and how much of that is let pass.
WORLD_METHODS = ("Popular Visualisation", "Mercator (", "Equidistant Cylindrical", "Pseudo Plate")
STRETCH_ALLOWED = 0.01
STRIP_BYTES = 32 * 2**20
TILE_CELLS = 256
PACKED = (".zip", ".gz", ".7z", ".rar", ".tar", ".tgz", ".bz2", ".xz")
# Formats whose data are the bare numbers: GDAL does not always raise when some are missing at the end.
FLAT_FORMATS = ("ENVI", "EHdr", "SAGA", "RST", "BT")


def read_raster_on(path: str | Path, grid: Grid, what: str, feedback: Feedback) -> np.ndarray:
    """See `layers.read_raster_on`.

    The source cell that holds each cell's centre is calculated for each alone, so a window gives what the whole gives;
    GDAL's warper approximates along rows and does not.
    """
    with open_raster(path, what) as source:
        _refuse_cut_off(source, path)
        if source.transform == Affine.identity():
            raise UserError(f"{path}: the {what} raster has no georeference; mend: gdal_translate -a_ullr W N E S ...")
        if source.crs is None:
            feedback.note(f"{path}: the {what} raster has no CRS, it is taken to be in the DEM's")
        own = pyproj.CRS.from_wkt(source.crs.to_wkt()) if source.crs else grid.crs
        same = same_crs(own, grid.crs)
        frame = grid.frame
        if not (same and source.shape == frame.shape and source.transform.almost_equals(frame.transform)):
            how = "" if same else f", {accuracy_words(own, grid.crs, source.bounds)}"
            feedback.note(f"{path}: the {what} raster is brought onto the DEM's cells (nearest value{how})")
        return read_part_on(source, grid, feedback, what)


def read_part_on(source: Any, grid: Grid, feedback: Feedback | None = None, what: str = "") -> np.ndarray:
    """Band 1 of an open raster on the cells of ``grid`` (row 0 south), of which only the part around it is read.

    The nearest value, NaN where the raster has none; one without a CRS is in that of the grid.
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
    """Values of the source cells that hold the centres of these rows of the grid; NaN beyond the source."""
    frame, (column, row) = grid.frame, grid.first
    x = frame.x0 + (column + np.arange(grid.shape[1])) * frame.cell
    y = frame.y0 + (row + np.arange(strip.start, strip.stop)) * frame.cell
    inverse = ~source.transform
    if (
        moved is None and inverse.b == inverse.d == 0.0
    ):  # columns depend on x alone and rows on y: no need for each cell
        i, j = inverse.a * x + inverse.c, inverse.e * y + inverse.f
        columns, rows = np.flatnonzero((i >= 0) & (i < source.width)), np.flatnonzero((j >= 0) & (j < source.height))
        places, i, j = np.ix_(rows, columns), i[None, columns], j[rows, None]
    else:
        x, y = np.broadcast_arrays(x[None, :], y[:, None])
        x, y = moved.transform(x, y) if moved else (x, y)
        i, j = inverse.a * x + inverse.b * y + inverse.c, inverse.d * x + inverse.e * y + inverse.f
        # inf, where PROJ knows no way, is outside
        places = np.nonzero((i >= 0) & (i < source.width) & (j >= 0) & (j < source.height))
        i, j = i[places], j[places]
    values = np.full((strip.stop - strip.start, grid.shape[1]), np.nan, np.float32)
    if i.size and j.size:
        i, j = i.astype(np.int64), j.astype(np.int64)
        left, top = int(i.min()), int(j.min())
        window = Window(left, top, int(i.max()) - left + 1, int(j.max()) - top + 1)  # type: ignore[call-arg]
        values[places] = read_values(source, window, np.float32)[j - top, i - left]
    return values


def write_raster(
    path: str | Path,
    values: np.ndarray,
    grid: Grid,
    *,
    nodata: float | None,
    dtype: str,
    units: str,
    description: str,
) -> None:
    """See `layers.write_raster`."""
    write_bands(path, {description: values}, grid, nodata=nodata, dtype=dtype, units=[units])


def write_bands(
    path: str | Path,
    bands: Mapping[str, np.ndarray],
    grid: Grid,
    *,
    nodata: float | None,
    dtype: str,
    units: Sequence[str],
) -> None:
    """See `layers.write_bands`. Of a window the whole grid is written, and only the window stored.

    The reading back is what finds a full disk: GDAL writes the last tiles at closing, and closing raises nothing.
    """
    for values in bands.values():
        if values.shape != grid.shape:
            raise ValueError(f"an array of {values.shape} for a grid of {grid.shape}")
    frame, part = grid.frame, grid.part
    profile = geotiff_profile(frame.shape, frame.crs, frame.transform, dtype, nodata, len(bands))
    if len(bands) > 1:
        profile["interleave"] = "band"
    if grid.whole is not None:
        profile["sparse_ok"] = True  # tiles beyond the window are not stored, and read as nodata or 0
    top = frame.shape[0] - part.row - part.rows
    place = Window(part.column, top, part.columns, part.rows)  # type: ignore[call-arg]
    with rasterio.open(path, "w", **profile) as target:
        for number, (description, values) in enumerate(bands.items(), start=1):
            target.write(_north_up(values, dtype), number, window=place)
            if units[number - 1]:
                target.set_band_unit(number, units[number - 1])
            if description:
                target.set_band_description(number, description)
    with rasterio.open(path) as written:
        for number, values in enumerate(bands.values(), start=1):
            north_up = _north_up(values, dtype)
            for start in range(0, part.rows, TILE_CELLS):
                rows = slice(start, min(part.rows, start + TILE_CELLS))
                strip = Window(part.column, top + start, part.columns, rows.stop - start)  # type: ignore[call-arg]
                if not np.array_equal(written.read(number, window=strip), north_up[rows], equal_nan=dtype[0] == "f"):
                    raise OSError(f"{path}: what was written does not read back")
    description, values = next(iter(bands.items()))
    styles.store_beside(Path(path), styles.of_raster(Path(path).stem, values, units[0], description))


def _north_up(values: np.ndarray, dtype: str) -> np.ndarray:
    return np.ascontiguousarray(values[::-1], dtype=dtype)


def geotiff_profile(
    shape: tuple[int, int], crs: pyproj.CRS, transform: Affine, dtype: str, nodata: float | None, count: int = 1
) -> dict[str, Any]:
    """How every GeoTIFF of the toolbox is written: tiled and packed, for ``rasterio.open``."""
    profile: dict[str, Any] = {
        "driver": "GTiff",
        "height": shape[0],
        "width": shape[1],
        "count": count,
        "dtype": dtype,
        "crs": RasterioCRS.from_wkt(crs.to_wkt()),
        "transform": transform,
        "tiled": True,
        "blockxsize": TILE_CELLS,
        "blockysize": TILE_CELLS,
        "compress": "deflate",
        "predictor": 3 if dtype.startswith("float") else 2,
        "bigtiff": "if_safer",
    }
    return profile if nodata is None else {**profile, "nodata": nodata}


def open_raster(path: str | Path, what: str) -> Any:
    """Open a raster for reading, or say in one line why not."""
    refuse_missing(path, what)
    try:
        source = rasterio.open(path)
    except RasterioError as error:
        packed = "it is packed; unpack it first" if Path(path).suffix.lower() in PACKED else None
        reason = why_not_ascii(path) or packed or _first_line(error)
        raise UserError(f"{path}: the {what} is no raster that can be read ({reason})") from error
    if source.count == 0:
        names = [name.split(":")[-1] for name in source.subdatasets]
        source.close()
        inside = f"several rasters ({', '.join(names)}); write one of them out: gdal_translate" if names else "no band"
        raise UserError(f"{path}: the {what} file holds {inside}")
    return source


def is_raster(path: str | Path) -> bool:
    """See `layers.is_raster`."""
    if "|" in str(path) or not Path(path).is_file():
        return False
    try:
        with rasterio.open(path) as source:
            return source.count > 0
    except RasterioError:
        return False


@contextmanager
def open_dem(path: str | Path, crs: str | None, feedback: Feedback) -> Iterator[tuple[Any, pyproj.CRS, Affine]]:
    """A DEM opened and judged by its header, with its CRS and its transform; refused as `layers.read_dem` says."""
    with open_raster(path, "DEM") as source:
        _refuse_images(source, path, feedback)
        _refuse_cut_off(source, path)
        dem_crs = _crs_of_dem(source, path, crs, feedback)
        transform = _square_transform(source, path)
        if source.count > 1:
            feedback.note(f"{path}: band 1 of {source.count} is read as the heights")
        _refuse_foot_heights(source.units[0], 0.3048, path)
        yield source, dem_crs, transform


def _crs_of_dem(source: Any, path: str | Path, given: str | None, feedback: Feedback) -> pyproj.CRS:
    if source.crs is None:
        if given is None:
            raise UserError(f"{path}: the DEM has no CRS; name it, for example --crs EPSG:2056")
        crs = parse_crs(given)
        feedback.note(f"{path}: the DEM has no CRS, {crs_name(crs)} is taken from --crs")
    else:
        crs = pyproj.CRS.from_wkt(source.crs.to_wkt())
        if given is not None and not same_crs(crs, parse_crs(given)):
            feedback.warn(f"{path}: --crs {given} is not used for the DEM, whose file names {crs_name(crs)}")
    _refuse_crs(crs, source, path)
    return crs


def _refuse_crs(crs: pyproj.CRS, source: Any, path: str | Path) -> None:
    flat = horizontal(crs)
    if flat.is_projected:
        _refuse_stretched(flat, source, path)
        factor = flat.axis_info[0].unit_conversion_factor if flat.axis_info else 1.0
        if abs(factor - 1) > 1e-9:
            size = f"{abs(source.transform.a) * factor:.3g}"
            unit = flat.axis_info[0].unit_name
            raise UserError(
                f"{path}: the DEM's CRS {crs_name(crs)} counts in {unit}, but must count in metres; "
                f"mend: {_gdalwarp(path, _metric_code(source, crs), size)}"
                + (" (if its heights are in feet too, multiply them by 0.3048)" if "foot" in unit else "")
            )
    elif flat.is_geographic:
        size = f"{abs(source.transform.e) * 111_320:.2g}"
        raise UserError(
            f"{path}: the DEM's CRS {crs_name(crs)} is geographic (degrees), but must be projected in metres; "
            f"mend: {_gdalwarp(path, _metric_code(source, crs), size)}"
        )
    else:
        raise UserError(
            f"{path}: the DEM's CRS '{crs.name}' is not a projected one; "
            f"mend: gdal_translate -a_srs EPSG:2056 {_quoted(path)} {_mended(path)}, with the code of its true CRS"
        )
    for part in crs.sub_crs_list if crs.is_compound else []:
        if part.is_vertical and part.axis_info:
            _refuse_foot_heights(part.axis_info[0].unit_name, part.axis_info[0].unit_conversion_factor, path)


def _refuse_stretched(crs: pyproj.CRS, source: Any, path: str | Path) -> None:
    """A map of the world in one piece counts in metres that are none: at 47 degrees north Web Mercator's are 0.68 m."""
    method = crs.coordinate_operation.method_name if crs.coordinate_operation else ""
    if not method.startswith(WORLD_METHODS):
        return
    x, y = (source.bounds.left + source.bounds.right) / 2, (source.bounds.bottom + source.bounds.top) / 2
    _, latitude = pyproj.Transformer.from_crs(crs, crs.geodetic_crs, always_xy=True).transform(x, y)
    shrink = math.cos(math.radians(latitude))
    if abs(1.0 - shrink) > STRETCH_ALLOWED:
        raise UserError(
            f"{path}: the DEM's CRS {crs_name(crs)} is a map of the whole world: where the DEM lies, its metres are "
            f"{shrink:.2f} m, so that every slope comes out wrong; "
            f"mend: {_gdalwarp(path, _metric_code(source, crs), f'{abs(source.transform.a) * shrink:.3g}')}"
        )


def _refuse_foot_heights(unit: str | None, factor: float, path: str | Path) -> None:
    if unit and unit.strip().lower() in ("ft", "foot", "feet", "ftus", "us-ft", "us survey foot", "foot_us"):
        raise UserError(
            f"{path}: the DEM's heights are in {unit}, but must be in metres; "
            f"mend: gdal_calc.py -A {_quoted(path)} --calc='A*{factor:.12g}' --outfile={_mended(path)} and then "
            f"gdal_edit.py -unsetstats -a_srs EPSG:... {_mended(path)}, with the code of its horizontal CRS"
        )


def _refuse_images(source: Any, path: str | Path, feedback: Feedback) -> None:
    kind = source.dtypes[0]
    if np.dtype(kind).kind == "c":
        raise UserError(f"{path}: the DEM's values are complex numbers ({kind}), which are no heights")
    palette = ColorInterp.palette in source.colorinterp
    if kind == "uint8" and (palette or source.count >= 3):
        bands = "the colours of a palette" if palette else f"{source.count} bands of uint8"
        raise UserError(f"{path}: {bands} make a picture, not a DEM")
    if kind == "uint8":
        feedback.warn(f"{path}: the heights are whole numbers from 0 to 255; is it a hillshade instead of the DEM?")
    if source.transform == Affine.identity():
        if source.gcps[0]:
            raise UserError(
                f"{path}: the DEM is placed by {len(source.gcps[0])} ground control points only; "
                f"mend: {_gdalwarp(path, None, 'CELL')}, with the wanted cell size"
            )
        raise UserError(
            f"{path}: the DEM has no georeference; mend: gdal_translate -a_ullr WEST NORTH EAST SOUTH "
            f"{_quoted(path)} {_mended(path)}"
        )


def _refuse_cut_off(source: Any, path: str | Path) -> None:
    """Where GDAL reads what is missing at the end of a file as 0 without a word (the other formats raise)."""
    if source.driver == "AAIGrid":
        refuse_broken_ascii(path, source.width, source.height)
    needed = source.width * source.height * source.count * np.dtype(source.dtypes[0]).itemsize
    if source.driver in FLAT_FORMATS and Path(path).stat().st_size < needed:
        raise UserError(f"{path}: the file is shorter than its header promises; it is cut off, get it again")


def _square_transform(source: Any, path: str | Path) -> Affine:
    """The transform, north-up or south-up and square to within `SHIFT_ALLOWED_CELLS` over the whole grid."""
    t, (ny, nx) = source.transform, source.shape
    size = math.sqrt(abs(t.a * t.e - t.b * t.d))
    if not (math.isfinite(size) and size > 0):
        raise UserError(f"{path}: the DEM's cells are {t.a:g} x {t.e:g} m large; correct the cell size in its header")
    if t.a <= 0 or max(abs(t.b) * ny, abs(t.d) * nx) > SHIFT_ALLOWED_CELLS * size:
        turned = "mirrored" if t.a <= 0 and t.b == 0 == t.d else "rotated"
        raise UserError(
            f"{path}: the DEM's grid is {turned}, but must be north-up; mend: {_gdalwarp(path, None, f'{size:.6g}')}"
        )
    if abs(t.a - abs(t.e)) * max(nx, ny) > SHIFT_ALLOWED_CELLS * t.a:
        raise UserError(
            f"{path}: the DEM's cells are {t.a:.9g} m x {abs(t.e):.9g} m, but must be square; "
            f"mend: {_gdalwarp(path, None, f'{min(t.a, abs(t.e)):.6g}')}"
        )
    return t


def read_values(source: Any, window: Window, dtype: Any) -> np.ndarray:
    """A window of band 1, scale and offset applied, NaN for what is masked or not finite; rows as in the file."""
    try:
        raw = source.read(1, window=window, masked=True)
    except RasterioError as error:
        reason, start = _first_line(error.__cause__ or error), window.row_off
        rows = f"rows {start + 1} to {start + window.height}"
        raise UserError(f"{source.name}: the raster is damaged, {rows} ({reason})") from error
    scale, offset = source.scales[0], source.offsets[0]
    values = raw.data if scale == 1 and offset == 0 else raw.data * np.float64(scale) + offset
    with np.errstate(over="ignore", invalid="ignore"):
        values = values.astype(dtype)
    values[np.ma.getmaskarray(raw) | ~np.isfinite(values)] = np.nan
    return values


def empty_impossible_heights(values: np.ndarray, path: str | Path, feedback: Feedback) -> None:
    """Turn what must be an undeclared nodata value into NaN, in place and without a copy, and say so."""
    low, high = _extremes(values)
    if max(-low, high) > HEIGHT_LIMIT_M:
        bad = np.abs(values) > HEIGHT_LIMIT_M
        shown = float(values[bad][0])
        values[bad] = np.nan
        feedback.warn(
            f"{path}: {int(bad.sum())} cells hold {shown:g} m, which is no height on Earth; they are taken as outside"
        )
        low, high = _extremes(values)
    if low == 0:
        zero = values == 0
        lowest = float(np.fmin.reduce(values, axis=None, where=~zero, initial=np.inf))
        if COLLAR_DROP_M < lowest < np.inf:
            values[zero] = np.nan
            feedback.warn(
                f"{path}: {int(zero.sum())} cells hold exactly 0 m, all others more than {COLLAR_DROP_M:g} m; "
                "they are taken as outside (an undeclared nodata value)"
            )


def _extremes(values: np.ndarray) -> tuple[float, float]:
    """Lowest and highest value, NaN passed over (and given where there is nothing else)."""
    return float(np.fmin.reduce(values, axis=None)), float(np.fmax.reduce(values, axis=None))


def _metric_code(source: Any, crs: pyproj.CRS) -> str:
    """A projected CRS in metres for where the raster lies: the Swiss one, or the UTM zone."""
    try:
        own = pyproj.CRS.from_wkt(source.crs.to_wkt()) if source.crs else crs
        west, south, east, north = pyproj.Transformer.from_crs(own, 4326, always_xy=True).transform_bounds(
            *source.bounds
        )
    except ProjError:
        return "EPSG:2056"
    x, y = (west + east) / 2, (south + north) / 2
    if 5.9 < x < 10.5 and 45.8 < y < 47.9:
        return "EPSG:2056"
    zone = min(60, max(1, int((x + 180) // 6) + 1))
    return f"EPSG:{(32600 if y >= 0 else 32700) + zone}"


def _gdalwarp(path: str | Path, code: str | None, size: str) -> str:
    target = f"-t_srs {code} " if code else ""
    return f"gdalwarp {target}-tr {size} {size} -r bilinear {_quoted(path)} {_mended(path)}"


def _quoted(path: str | Path) -> str:
    return shlex.quote(str(path))


def _mended(path: str | Path) -> str:
    return shlex.quote(f"{Path(path).stem}_mended.tif")


def _first_line(error: BaseException) -> str:
    return str(error).splitlines()[0].rstrip(".") if str(error) else type(error).__name__
