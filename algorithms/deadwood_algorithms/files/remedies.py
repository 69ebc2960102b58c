"""Commands that fix a raster, for messages: with ``rio``, which is part of rasterio and therefore always available."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np

from deadwood_algorithms.files.input_files import tiles_of
from deadwood_algorithms.params.commands import quoted

NODATA = -9999
DEM = "DEM"


def rio() -> str:
    """How ``rio`` is called here: by its name if it is on the PATH, otherwise by its path beside this Python."""
    beside = shutil.which("rio", path=str(Path(sys.executable).parent))
    return "rio" if beside is None or shutil.which("rio") else quoted(beside)


def warp(source: Any, path: str | Path, size: str, code: str | None = None, *, crs: str = "") -> str:
    """Command to reproject into a CRS (by its code; None: its own) with square north-up cells of this size.

    ``crs`` names the CRS of a file that holds none: it is then written into a copy first.
    """
    first, steps = _plain(path)
    if source.crs is None and not source.gcps[0]:
        with_crs = _copy(path, "with_crs")
        steps = f"{steps}{rio()} convert {first} {with_crs} && {rio()} edit-info {with_crs} --crs {quoted(crs)} && "
        first, code = with_crs, code or crs
    target = f" --dst-crs {code or own_code(source)} --res {size} --resampling bilinear"
    if not source.gcps[0] and (source.transform.a < 0 or source.transform.e > 0):  # rio finds no extent for these
        xs, ys = zip(*(source.transform @ corner for corner in _corners(source)), strict=True)
        target += f" --bounds {min(xs):.12g} {min(ys):.12g} {max(xs):.12g} {max(ys):.12g}"
    kind = np.dtype(source.dtypes[0])
    bare = source.nodata is None and not _is_packed(path)
    if bare and (kind.kind == "f" or (kind.kind == "i" and kind.itemsize > 1)):
        target += f" --src-nodata {NODATA} --dst-nodata {NODATA}"  # otherwise the surroundings would be 0 m
    return f"{steps}{rio()} warp {first} {_copy(path)}{target}"


def coarser(path: str | Path, cell: float) -> str:
    """Command to average to cells of this size [m]."""
    first, steps = _plain(path)
    return f"{steps}{rio()} warp {first} {_copy(path, 'coarser')} --res {cell:g} --resampling average"


def times(path: str | Path, factor: float, code: str | None = None) -> str:
    """Command to multiply the heights and, if a code is given, to set another CRS."""
    command = _calculated(path, _copy(path), factor)
    return command if code is None else f"{command} && {rio()} edit-info {_copy(path)} --crs {code}"


def unscaled(path: str | Path) -> str:
    """Command to store the heights as floats instead of numbers with a scale and an offset."""
    return _calculated(path, _copy(path))


def band(path: str | Path, number: int | str) -> str:
    """Command to write out one band of several."""
    return _calculated(path, _copy(path), number=number)


def one_of(path: str | Path, inside: str) -> str:
    """Command to extract one of several rasters in a file, as metres."""
    return _calculated(inside, _copy(path))


def declared(path: str | Path, nodata: float) -> str:
    """Command to declare a value as nodata."""
    return _edited(path, f"--nodata {nodata:g}")


def with_crs(path: str | Path, code: str) -> str:
    return _edited(path, f"--crs {code}")


def placed(path: str | Path) -> str:
    """Command to set a georeference, whose numbers the user must know."""
    return _edited(path, f"--transform {quoted('[CELL, 0, WEST, 0, -CELL, NORTH]')}")


def polygons(path: str | Path) -> str:
    """Command to make polygons of the cells that are neither empty nor 0."""
    mask, made = _copy(path, "cells"), quoted(f"{Path(path).stem}_polygons.geojson")
    cells = f"{rio()} calc --dtype uint8 --profile nodata=0 {quoted('(!= (read 1 1) 0)')} {quoted(path)} {mask}"
    return f"{cells} && {rio()} shapes {mask} --collection --output {made}"


def of_colours(path: str | Path) -> str:
    """Command to decode the heights of Terrain-RGB."""
    code = "(- (* 0.1 (+ (* 65536.0 (read 1 1)) (* 256.0 (read 1 2)) (* 1.0 (read 1 3)))) 10000.0)"
    return f"{rio()} calc --dtype float32 --profile nodata={NODATA} {quoted(code)} {quoted(path)} {_copy(path)}"


def converted(path: str | Path) -> str:
    """Command to write a raster as GeoTIFF."""
    return f"{rio()} convert {quoted(path)} {_copy(path)}"


def own_code(source: Any) -> str:
    """The CRS of a raster, or of its ground control points, as ``rio`` takes it."""
    crs = source.crs or source.gcps[1]
    authority = crs.to_authority() if crs else None
    return ":".join(authority) if authority else quoted(crs.to_wkt() if crs else "EPSG:...")


def _copy(path: str | Path, ending: str = "fixed") -> str:
    return quoted(f"{Path(path).stem}_{ending}.tif")


def _edited(path: str | Path, edit: str) -> str:
    """Command to change the header of a copy; of a packed raster the copy is plain."""
    if _is_packed(path):
        return f"{_calculated(path, _copy(path))} && {rio()} edit-info {_copy(path)} {edit}"
    return f"{rio()} convert {quoted(path)} {_copy(path)} && {rio()} edit-info {_copy(path)} {edit}"


def _plain(path: str | Path) -> tuple[str, str]:
    """The raster with which a command goes on, and the steps that make it: of a packed raster a plain copy."""
    if not _is_packed(path):
        return quoted(path), ""
    return _copy(path, "plain"), f"{_calculated(path, _copy(path, 'plain'))} && "


def _is_packed(path: str | Path) -> bool:
    """Whether ``rio convert`` and ``rio warp`` would lose something: a scale, a mask that is no nodata, other bands."""
    import rasterio  # only needed here
    from rasterio.enums import MaskFlags

    from deadwood_algorithms.files.bands import source_of

    with rasterio.open(source_of(tiles_of(path)[0], DEM)) as source:
        masked = MaskFlags.per_dataset in source.mask_flag_enums[0] or MaskFlags.alpha in source.mask_flag_enums[0]
        other = source.count > 1 or source.driver == "VRT" or source.name != tiles_of(path)[0]
        return other or (source.scales[0], source.offsets[0]) != (1, 0) or masked


def _calculated(path: str | Path, copy: str, factor: float = 1.0, number: int | str | None = None) -> str:
    """Command to write heights, times a factor, as floats with a declared nodata value.

    ``rio calc`` reads the stored numbers: it applies the mask, but neither scale nor offset.
    """
    import rasterio  # only needed here

    from deadwood_algorithms.files.bands import alpha_of, band_of, inside

    place = tiles_of(path)[0]
    with rasterio.open(place) as whole:
        place = (inside(whole, DEM) or place) if whole.count == 0 else place
    with rasterio.open(place) as source:
        at = band_of(source, DEM) if number is None else number
        k = at - 1 if isinstance(at, int) else 0
        scale, offset, alpha = source.scales[k] * factor, source.offsets[k] * factor, alpha_of(source)
    read = f"(read 1 {at})"
    read = read if scale == 1.0 else f"(* {scale:.12g} {read})"
    read = read if offset == 0.0 else f"(+ {offset:.12g} {read})"
    if alpha:
        read = f"(where (!= (read 1 {alpha}) 0) {read} {NODATA})"
    return f"{rio()} calc --dtype float32 --profile nodata={NODATA} {quoted(read)} {quoted(place)} {copy}"


def _corners(source: Any) -> list[tuple[int, int]]:
    return [(0, 0), (source.width, 0), (0, source.height), (source.width, source.height)]
