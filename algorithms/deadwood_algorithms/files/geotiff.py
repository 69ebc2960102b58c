"""What every GeoTIFF of the toolbox has: tiles, packing, statistics, and for large ones overviews in the COG layout.

A colour table is for bands of classes in 8 bits (`rasters.write_classes`); the colours of counts and quantities stand
in the style beside the file (`styles`).
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import rasterio
from numpy.typing import NDArray
from rasterio.crs import CRS as RasterioCRS
from rasterio.shutil import copy
from rasterio.transform import Affine

STDERR = 2  # the file descriptor to which C libraries write
TILE_CELLS = 256
# Up to 2 x 2 tiles, a raster is displayed as quickly without overviews. A cloud-optimised file is made by copying,
# which costs as much as writing; beyond the second limit (a DEM of 46 000 x 46 000 cells) that is left to the user.
# For a window of a DEM even empty tiles are scanned (4.3 CPU seconds for 30 000 x 30 000 cells): each of many runs on
# a DEM writes such rasters, so the limit is lower for them (11 500 x 11 500), but not for a raster written once for a
# whole region.
COG_FROM_CELLS, COG_UP_TO_CELLS, SPARSE_UP_TO_CELLS = 4 * TILE_CELLS**2, 2**31, 2**27
# Compression costs more than copying: a file that is copied immediately is compressed only then, up to 256 MB per band
# on the disk.
UNPACKED_UP_TO_CELLS = 2**26
COPYING_BYTES = 128 * 2**20  # GDAL's cache while copying; otherwise it takes a share of the machine's memory


def geotiff_profile(
    shape: tuple[int, int], crs: pyproj.CRS, transform: Affine, dtype: str, nodata: float | None, count: int = 1
) -> dict[str, Any]:
    """Profile of every GeoTIFF of the toolbox for ``rasterio.open``: tiled and compressed."""
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


@contextmanager
def libtiff_silent() -> Iterator[None]:
    """While GeoTIFFs are written: libtiff reports a full disk on stderr itself, bypassing the handlers of GDAL and
    rasterio.

    The failure arrives as an exception, or when reading back, and is reported in one line of the toolbox.
    """
    try:
        kept, nowhere = os.dup(STDERR), os.open(os.devnull, os.O_WRONLY)
    except OSError:  # a program without stderr, or without a free descriptor
        yield
        return
    try:
        os.dup2(nowhere, STDERR)
        yield
    finally:
        os.dup2(kept, STDERR)
        os.close(kept)
        os.close(nowhere)


@dataclass
class Statistics:
    """Minimum, maximum, mean and standard deviation of a band, accumulated window by window (Chan's update)."""

    nodata: float | None = None
    count: int = 0
    cells: int = 0
    least: float = math.inf
    largest: float = -math.inf
    mean: float = 0.0
    squares: float = 0.0  # sum of the squared deviations from the mean

    def take(self, values: NDArray[Any]) -> None:
        known = values[np.isfinite(values)] if values.dtype.kind == "f" else values.ravel()
        if self.nodata is not None and math.isfinite(self.nodata):
            known = known[known != self.nodata]
        self.cells += values.size
        if not known.size:
            return
        mean, n = float(known.mean(dtype=np.float64)), known.size
        squares = float(known.var(dtype=np.float64)) * n
        total, apart = self.count + n, mean - self.mean
        self.squares += squares + apart * apart * self.count * n / total
        self.mean += apart * n / total
        self.count = total
        self.least, self.largest = min(self.least, float(known.min())), max(self.largest, float(known.max()))

    def tags(self) -> dict[str, str]:
        """Tags as GDAL writes them, so that a map need not read the raster to stretch its colours; empty without
        values.
        """
        if not self.count:
            return {}
        found = {"MINIMUM": self.least, "MAXIMUM": self.largest, "MEAN": self.mean}
        found |= {"STDDEV": math.sqrt(self.squares / self.count), "VALID_PERCENT": 100.0 * self.count / self.cells}
        return {f"STATISTICS_{name}": f"{value:.8g}" for name, value in found.items()}


def is_laid_out(cells: int, *, sparse: bool, of_region: bool = False) -> bool:
    """Whether `lay_out` converts a raster of this size."""
    return COG_FROM_CELLS < cells <= (SPARSE_UP_TO_CELLS if sparse and not of_region else COG_UP_TO_CELLS)


def lay_out(path: Path, cells: int, *, sparse: bool, of_region: bool = False) -> None:
    """Convert a large GeoTIFF into a cloud-optimised one with overviews; small ones are left unchanged.

    An overview contains values of the raster (nearest), so that a count remains a count. ``sparse`` is a raster with
    missing tiles, ``of_region`` one that is written once for many runs, and may take longer.
    """
    if not is_laid_out(cells, sparse=sparse, of_region=of_region):
        return
    beside = path.with_name(f".{path.name}.cog")
    try:
        with rasterio.Env(GDAL_CACHEMAX=COPYING_BYTES):
            copy(
                path,
                beside,
                driver="COG",
                compress="DEFLATE",
                predictor="YES",
                blocksize=TILE_CELLS,
                overview_resampling="NEAREST",
                overviews="IGNORE_EXISTING",
                bigtiff="IF_SAFER",
                sparse_ok="YES",
            )
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)
