"""Checks of a DEM's header: what would give wrong heights or slopes is rejected, with the command that fixes it.

For `dem_windows`, which reads the heights.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import rasterio
from pyproj.exceptions import ProjError
from rasterio.enums import ColorInterp
from rasterio.transform import Affine

from deadwood_algorithms.files import remedies
from deadwood_algorithms.files.bands import band_of, inside, name_of_band
from deadwood_algorithms.files.crs import (
    LOCAL_CRS,
    crs_name,
    far_off,
    horizontal,
    is_local,
    parse_crs,
    same_crs,
    swiss_code,
)
from deadwood_algorithms.files.input_files import tiles_of
from deadwood_algorithms.files.rasters import is_raster, open_raster, refuse_cut_off
from deadwood_algorithms.files.tiles import Mosaic, Tile
from deadwood_algorithms.intake import names
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Quiet, UserError

# Skew, unequal cell sides or rounded headers may shift the far corner of the grid by this part of a cell: less
# than the positional accuracy of any survey, and less than a bilinear surface can resolve.
SHIFT_ALLOWED_CELLS = 0.05
# Words of the name of a file or a band; the remedies name what they write "fixed".
NAMED_IN_FEET, NOT_IN_FEET = {"ft", "feet", "foot", "usft"}, {"metres", "meters", "fixed"}
FEET = ("ft", "ftus", "us-ft", "us_ft", "ftintl")  # names of the unit in a band
# Projections of the whole world, true to scale at the equator only, and the tolerated deviation of scale.
WORLD_METHODS = ("Popular Visualisation", "Mercator (", "Equidistant Cylindrical", "Pseudo Plate")
STRETCH_ALLOWED = 0.01


LEAST_CELL_M, MOST_CELL_M = 0.000999, 10_000.0  # a finer or coarser cell is an error


@contextmanager
def open_dem(
    path: str | Path, crs: str | None, feedback: Feedback, what: str = "DEM"
) -> Iterator[tuple[Any, pyproj.CRS, Affine]]:
    """Open a DEM and check its header; returns its CRS and transform, too. Rejects what `dem_windows.read_dem` rejects.

    Each of several tiles (`tiles`) is checked; the notes and warnings of the first one stand for all.
    """
    files = tiles_of(path)
    if len(files) == 1:
        with _open_one(files[0], crs, feedback, what) as one:
            yield one
        return
    tiles, dem_crs = [], None
    for each in files:
        with _open_one(each, crs, Quiet() if tiles else feedback, what) as (source, own_crs, transform):
            tiles.append(Tile.of(each, source, transform))
            dem_crs = dem_crs or own_crs
    assert dem_crs is not None
    with Mosaic(path, tiles, feedback) as mosaic:
        feedback.note(
            f"{path}: {len(tiles)} tiles are read as one DEM of {mosaic.width} x {mosaic.height} cells",
            code="tiles-joined",
            tiles=len(tiles),
        )
        yield mosaic, dem_crs, mosaic.transform


@contextmanager
def _open_one(path: str, crs: str | None, feedback: Feedback, what: str) -> Iterator[tuple[Any, pyproj.CRS, Affine]]:
    """Open and check one file of a DEM."""
    with open_raster(path, what) as source:
        _refuse_images(source, path, feedback)
        _say_band(path, what, feedback)
        refuse_cut_off(source, path)
        dem_crs = _crs_of_dem(source, path, crs, feedback)
        transform = _square_transform(source, path, crs)
        _refuse_foot_heights(source.units[0], 0.3048, path)
        words = names.words_of(f"{name_of_band(source, 1)} {Path(path).stem}")
        if words & NAMED_IN_FEET and not words & NOT_IN_FEET:
            feedback.warn(
                f"{path}: by its name its heights may be in feet; then fix: {remedies.times(path, 0.3048)}",
                code="named-in-feet",
            )
        yield source, dem_crs, transform


def _say_band(path: str, what: str, feedback: Feedback) -> None:
    """Say which of several bands or rasters is read; reject a band that is named as something else than heights."""
    with rasterio.open(path) as whole:
        if whole.count == 0:
            read = (inside(whole, what) or "").rpartition(":")[2]
            feedback.note(f"{path}: of the rasters in it, {read} is read", code="band-chosen")
            return
        band = band_of(whole, what)
        named = [name_of_band(whole, k) for k in whole.indexes]
        if names.is_derived(named[band - 1], what):
            several = f"; {remedies.band(path, 'NUMBER')} writes out another of its {whole.count} bands"
            raise UserError(
                f"{path}: band {band} is named '{named[band - 1]}', which is no height of the {what}; give the raster "
                f"of the heights{several if whole.count > 1 else ''}"
            )
        if whole.count > 1:
            said = f" ('{named[band - 1]}')" if named[band - 1] else ""
            feedback.note(
                f"{path}: band {band}{said} of {whole.count} is read as the heights; {remedies.band(path, 'NUMBER')} "
                "writes out another",
                code="band-chosen",
                band=band,
                bands=whole.count,
            )


def is_dem(path: str | Path) -> bool:
    """Whether a path opens as a raster, or as the tiles of one."""
    try:
        return all(is_raster(each) for each in tiles_of(path))
    except UserError:
        return False


def _crs_of_dem(source: Any, path: str | Path, given: str | None, feedback: Feedback) -> pyproj.CRS:
    if source.crs is None:
        if given is None:
            raise UserError(f"{path}: the DEM has no CRS; name it, for example --crs {_code_by_numbers(source)}")
        crs = parse_crs(given)
        feedback.note(f"{path}: the DEM has no CRS, {crs_name(crs)} is taken from --crs", code="crs-assumed")
        if is_local(crs):
            return crs
    else:
        crs = pyproj.CRS.from_wkt(source.crs.to_wkt())
        if is_local(crs) and given is not None and is_local(parse_crs(given)):
            return LOCAL_CRS
        if given is not None and not same_crs(crs, parse_crs(given)):
            feedback.warn(
                f"{path}: --crs {given} is not used for the DEM, whose file names {crs_name(crs)}", code="crs-not-used"
            )
    _refuse_crs(crs, source, path, given)
    _warn_of_place(horizontal(crs), source, path, feedback)
    return crs


def _refuse_crs(crs: pyproj.CRS, source: Any, path: str | Path, given: str | None) -> None:
    flat = horizontal(crs)
    if flat.is_projected:
        _refuse_stretched(flat, source, path, given)
        factor = flat.axis_info[0].unit_conversion_factor if flat.axis_info else 1.0
        if abs(factor - 1) > 1e-9:
            size = f"{abs(source.transform.a) * factor:.3g}"
            unit = flat.axis_info[0].unit_name
            raise UserError(
                f"{path}: the DEM's CRS {crs_name(crs)} counts in {unit}, but must count in metres; "
                f"fix: {remedies.warp(source, path, size, _metric_code(source, crs), crs=given or '')}"
                + (" (if its heights are in feet too, multiply them by 0.3048)" if "foot" in unit else "")
            )
    elif flat.is_geographic:
        size = f"{abs(source.transform.e) * 111_320:.2g}"
        raise UserError(
            f"{path}: the DEM's CRS {crs_name(crs)} is geographic (degrees), but must be projected in metres; "
            f"fix: {remedies.warp(source, path, size, _metric_code(source, crs), crs=given or '')}"
        )
    else:
        raise UserError(
            f"{path}: the DEM's CRS '{crs.name}' is not a projected one; "
            f"fix: {remedies.with_crs(path, 'EPSG:2056')}, with the code of its true CRS"
            + ("; or --crs local, which takes its coordinates as metres on a local grid" if is_local(crs) else "")
        )
    for part in crs.sub_crs_list if crs.is_compound else []:
        if part.is_vertical and part.axis_info:
            _refuse_foot_heights(
                part.axis_info[0].unit_name, part.axis_info[0].unit_conversion_factor, path, crs_name(flat)
            )


def _warn_of_place(crs: pyproj.CRS, source: Any, path: str | Path, feedback: Feedback) -> None:
    """Warn if the DEM is far from the area of use of its CRS, which was then named by mistake, or for lack of
    another, as for a local survey. Its cells are correct in any case, but layers in other CRS are misplaced."""
    x, y = _middle(source)
    far = far_off(crs, x, y)
    if far is None:
        return
    if far.exchanged:
        fix = "its x and y are exchanged (in Swiss and Austrian surveys Y is the easting): exchange them in its header"
    elif far.likely:
        fix = f"its coordinates look like those of {far.likely}"
    else:
        fix = "name the one that its supplier states"
    feedback.warn(
        f"{path}: the DEM's middle, {x:.0f}, {y:.0f}, is far outside the area of use of {crs_name(crs)}, so this is "
        f"not its CRS, and layers in other CRSs will not match it; {fix}",
        code="crs-doubtful",
    )


def _middle(source: Any) -> tuple[float, float]:
    return (source.bounds.left + source.bounds.right) / 2, (source.bounds.bottom + source.bounds.top) / 2


def _code_by_numbers(source: Any) -> str:
    """The CRS to which these numbers probably belong: a Swiss one, new or old; otherwise an example."""
    return swiss_code(*_middle(source)) or "EPSG:25832, with the code that its supplier states"


def _refuse_stretched(crs: pyproj.CRS, source: Any, path: str | Path, given: str | None) -> None:
    """Reject projections of the whole world, whose metres are not metres on the ground: at 47 degrees north one of Web
    Mercator is 0.68 m.
    """
    method = crs.coordinate_operation.method_name if crs.coordinate_operation else ""
    if not method.startswith(WORLD_METHODS):
        return
    x, y = (source.bounds.left + source.bounds.right) / 2, (source.bounds.bottom + source.bounds.top) / 2
    _, latitude = pyproj.Transformer.from_crs(crs, crs.geodetic_crs, always_xy=True).transform(x, y)
    shrink = math.cos(math.radians(latitude))
    size = f"{abs(source.transform.a) * shrink:.3g}"
    if abs(1.0 - shrink) > STRETCH_ALLOWED:
        raise UserError(
            f"{path}: the DEM's CRS {crs_name(crs)} is for maps of the whole world: at the DEM its metres are "
            f"{shrink:.2f} m, so that every slope comes out wrong; "
            f"fix: {remedies.warp(source, path, size, _metric_code(source, crs), crs=given or '')}"
        )


def _refuse_foot_heights(unit: str | None, factor: float, path: str | Path, code: str | None = None) -> None:
    """Reject heights in feet; ``code`` is that of the horizontal CRS, if the CRS gives the unit of the heights."""
    if unit and ("foot" in unit.lower() or "feet" in unit.lower() or unit.strip().lower() in FEET):
        raise UserError(
            f"{path}: the DEM's heights are in {unit}, but must be in metres; fix: {remedies.times(path, factor, code)}"
        )


def _refuse_images(source: Any, path: str | Path, feedback: Feedback) -> None:
    kind = source.dtypes[0]
    if np.dtype(kind).kind == "c":
        raise UserError(f"{path}: the DEM's values are complex numbers ({kind}), which are not heights")
    palette = ColorInterp.palette in source.colorinterp
    if kind == "uint8" and (palette or source.count >= 3):
        bands = "the colours of a palette" if palette else f"{source.count} bands of uint8"
        raise UserError(f"{path}: {bands} make a picture, not a DEM{_of_colours(source, path)}")
    if kind == "uint8":
        feedback.warn(
            f"{path}: the heights are whole numbers from 0 to 255; is it a hillshade instead of the DEM?",
            code="hillshade",
        )
    if source.transform == Affine.identity():
        if source.gcps[0]:
            raise UserError(
                f"{path}: the DEM is placed by {counted(len(source.gcps[0]), 'ground control point')} only; "
                f"fix: {remedies.warp(source, path, '1')}, with the wanted cell size in place of 1"
            )
        raise UserError(f"{path}: the DEM has no georeference; fix, with its own numbers: {remedies.placed(path)}")


def _of_colours(source: Any, path: str | Path) -> str:
    """The way out for heights that are stored as colours: of Terrain-RGB, red is 0 to 2 for all heights on Earth."""
    if source.count < 3 or int(source.read(1, out_shape=(min(512, source.height), min(512, source.width))).max()) > 2:
        return ""
    return f"; if its colours are heights (Terrain-RGB): {remedies.of_colours(path)}"


def _square_transform(source: Any, path: str | Path, given: str | None) -> Affine:
    """The transform, north-up or south-up and square to within `SHIFT_ALLOWED_CELLS` over the whole grid."""
    t, (ny, nx) = source.transform, source.shape
    size = math.sqrt(abs(t.a * t.e - t.b * t.d))
    if not (math.isfinite(size) and size > 0):
        raise UserError(f"{path}: the DEM's cells are {t.a:g} x {t.e:g} m large; correct the cell size in its header")
    if not LEAST_CELL_M <= size <= MOST_CELL_M:
        raise UserError(
            f"{path}: the DEM's cells are {size:.3g} m large, but must be between {LEAST_CELL_M:g} and {MOST_CELL_M:g} "
            "m; correct the cell size in its header, or its CRS"
        )
    if t.a <= 0 or max(abs(t.b) * ny, abs(t.d) * nx) > SHIFT_ALLOWED_CELLS * size:
        turned = "mirrored" if t.a <= 0 and t.b == 0 == t.d else "rotated"
        fix = remedies.warp(source, path, f"{size:.6g}", crs=given or "")
        raise UserError(f"{path}: the DEM's grid is {turned}, but must be north-up; fix: {fix}")
    if abs(t.a - abs(t.e)) * max(nx, ny) > SHIFT_ALLOWED_CELLS * t.a:
        raise UserError(
            f"{path}: the DEM's cells are {t.a:.9g} m x {abs(t.e):.9g} m, but must be square; "
            f"fix: {remedies.warp(source, path, f'{min(t.a, abs(t.e)):.6g}', crs=given or '')}"
        )
    return t


def _metric_code(source: Any, crs: pyproj.CRS) -> str:
    """A projected CRS in metres for the raster's location: the Swiss one, or the UTM zone."""
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
