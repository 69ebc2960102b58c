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


def rio() -> str:
    """How ``rio`` is called here: by its name if it is on the PATH, otherwise by its path beside this Python."""
    beside = shutil.which("rio", path=str(Path(sys.executable).parent))
    return "rio" if beside is None or shutil.which("rio") else quoted(beside)


def warp(source: Any, path: str | Path, size: str, code: str | None = None, *, crs: str = "") -> str:
    """Command to reproject into a CRS (by its code; None: its own) with square north-up cells of this size.

    ``crs`` names the CRS of a file that holds none: it is then written into a copy first.
    """
    first, steps = quoted(path), ""
    if source.crs is None and not source.gcps[0]:
        first = _copy(path, "with_crs")
        steps = f"{rio()} convert {quoted(path)} {first} && {rio()} edit-info {first} --crs {quoted(crs)} && "
        code = code or crs
    target = f" --dst-crs {code or own_code(source)} --res {size} --resampling bilinear"
    if not source.gcps[0] and (source.transform.a < 0 or source.transform.e > 0):  # rio finds no extent for these
        xs, ys = zip(*(source.transform @ corner for corner in _corners(source)), strict=True)
        target += f" --bounds {min(xs):.12g} {min(ys):.12g} {max(xs):.12g} {max(ys):.12g}"
    kind = np.dtype(source.dtypes[0])
    if source.nodata is None and (kind.kind == "f" or (kind.kind == "i" and kind.itemsize > 1)):
        target += f" --src-nodata {NODATA} --dst-nodata {NODATA}"  # otherwise the surroundings would be 0 m
    return f"{steps}{rio()} warp {first} {_copy(path)}{target}"


def coarser(path: str | Path, cell: float) -> str:
    """Command to average to cells of this size [m]."""
    return f"{rio()} warp {quoted(path)} {_copy(path, 'coarser')} --res {cell:g} --resampling average"


def times(path: str | Path, factor: float, code: str | None = None) -> str:
    """Command to multiply the heights and, if a code is given, to set another CRS."""
    formula = quoted(f"(* {factor:.12g} (read 1))")
    command = f"{rio()} calc{_masked(path)}{_as_floats(path)} {formula} {quoted(path)} {_copy(path)}"
    return command if code is None else f"{command} && {rio()} edit-info {_copy(path)} --crs {code}"


def unscaled(path: str | Path, scale: float, offset: float) -> str:
    """Command to store the heights as floats instead of numbers with a scale and an offset."""
    formula = quoted(f"(+ {offset:.12g} (* {scale:.12g} (read 1)))")
    return f"{rio()} calc{_masked(path)} --dtype float32 {formula} {quoted(path)} {_copy(path)}"


def with_crs(path: str | Path, code: str) -> str:
    return f"{rio()} convert {quoted(path)} {_copy(path)} && {rio()} edit-info {_copy(path)} --crs {code}"


def placed(path: str | Path) -> str:
    """Command to set a georeference, whose numbers the user must know."""
    matrix = quoted("[CELL, 0, WEST, 0, -CELL, NORTH]")
    return f"{rio()} convert {quoted(path)} {_copy(path)} && {rio()} edit-info {_copy(path)} --transform {matrix}"


def one_of(path: str | Path, inside: str) -> str:
    """Command to extract one of several rasters in a file."""
    return f"{rio()} convert {quoted(inside)} {_copy(path)}"


def own_code(source: Any) -> str:
    """The CRS of a raster, or of its ground control points, as ``rio`` takes it."""
    crs = source.crs or source.gcps[1]
    authority = crs.to_authority() if crs else None
    return ":".join(authority) if authority else quoted(crs.to_wkt() if crs else "EPSG:...")


def _copy(path: str | Path, ending: str = "fixed") -> str:
    return quoted(f"{Path(path).stem}_{ending}.tif")


def _masked(path: str | Path) -> str:
    """``rio calc`` keeps nodata, and fails if a raster has none; one of several tiles always has."""
    import rasterio  # only needed here

    files = tiles_of(path)
    if len(files) > 1:
        return ""
    with rasterio.open(files[0]) as source:
        return " --not-masked" if source.nodata is None else ""


def _as_floats(path: str | Path) -> str:
    """``rio calc`` keeps the type of a raster, and truncates decimals of an integer one."""
    import rasterio

    with rasterio.open(tiles_of(path)[0]) as source:
        return "" if np.dtype(source.dtypes[0]).kind == "f" else " --dtype float32"


def _corners(source: Any) -> list[tuple[int, int]]:
    return [(0, 0), (source.width, 0), (0, source.height), (source.width, source.height)]
