"""Release areas from a raster of susceptibility: connected ground above a threshold, as polygons with their numbers.

For `assess_mobilisation`. The rasters may be larger than memory; what is held are the polygons.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import pyproj
import rasterio
import rasterio.features
import shapely
from numpy.typing import NDArray
from rasterio.windows import Window
from shapely.geometry import shape as _shape

from deadwood_algorithms.params.tool import Cancelled, Feedback

BLOCK = 1024  # cells a side


@dataclass
class Sums:
    """Of the cells of each polygon."""

    cells: NDArray[np.int64]
    susceptibility: NDArray[np.float64]
    most: NDArray[np.float64]
    slope: NDArray[np.float64]
    gully: NDArray[np.int64]


def zones(
    mask: Path,
    susceptibility: Path,
    factors: Path,
    crs: pyproj.CRS,
    least_m2: float,
    gully_m: float,
    feedback: Feedback,
) -> geopandas.GeoDataFrame:
    """The polygons of the mask's cells above 0 that touch along a side and are large enough, the largest first."""
    least = least_m2 * (1.0 - 1e-9)  # a sum of cells may round to just below
    with rasterio.open(mask) as source:
        feedback.progress(0, 1, "drawing release areas")
        drawn = rasterio.features.shapes(rasterio.band(source, 1), connectivity=4)
        shapes = [shape for shape in (_shape(each) for each, value in drawn if value) if shape.area >= least]
    shapes.sort(key=lambda each: (-each.area, each.bounds))
    sums = _sums(shapes, susceptibility, factors, gully_m, feedback)
    cells = np.maximum(sums.cells, 1)
    columns = {
        "release_id": np.arange(1, len(shapes) + 1),
        "area_m2": np.array([each.area for each in shapes], float),
        "susceptibility_mean": sums.susceptibility / cells,
        "susceptibility_max": sums.most,
        "slope_mean_deg": sums.slope / cells,
        "gully_share": sums.gully / cells,
    }
    return geopandas.GeoDataFrame(columns, geometry=shapes, crs=crs)


def _sums(shapes: list[Any], susceptibility: Path, factors: Path, gully_m: float, feedback: Feedback) -> Sums:
    count = len(shapes)
    sums = Sums(*(np.zeros(count, kind) for kind in (np.int64, float, float, float, np.int64)))
    tree = shapely.STRtree(shapes)
    with rasterio.open(susceptibility) as source, rasterio.open(factors) as beside:
        tops = range(0, source.height, BLOCK)
        for done, top in enumerate(tops):
            for left in range(0, source.width, BLOCK):
                if feedback.cancelled():
                    raise Cancelled
                window = Window(left, top, min(BLOCK, source.width - left), min(BLOCK, source.height - top))  # type: ignore[call-arg]
                here = np.sort(tree.query(shapely.box(*source.window_bounds(window))))
                if here.size:
                    _add(sums, here, [shapes[k] for k in here], source, beside, window, gully_m)
            feedback.progress(done + 1, len(tops), "measuring release areas")
    return sums


def _add(
    sums: Sums, here: NDArray, shapes: list[Any], source: Any, beside: Any, window: Window, gully_m: float
) -> None:
    """Add the cells of one window to the sums of the polygons in it; a cell is the polygon's over its centre."""
    owner = np.zeros((window.height, window.width), np.int32)
    numbered = zip(shapes, range(1, len(shapes) + 1), strict=True)
    rasterio.features.rasterize(numbered, out=owner, transform=source.window_transform(window))
    inside = owner > 0
    owner, size = owner[inside] - 1, len(shapes)
    value = source.read(1, window=window)[inside].astype(float)
    slope, hollow = (beside.read(band, window=window)[inside].astype(float) for band in (1, 3))
    sums.cells[here] += np.bincount(owner, minlength=size)
    sums.susceptibility[here] += np.bincount(owner, value, size)
    sums.slope[here] += np.bincount(owner, slope, size)
    sums.gully[here] += np.bincount(owner[hollow >= gully_m], minlength=size)
    most = np.zeros(size)
    np.maximum.at(most, owner, value)
    sums.most[here] = np.maximum(sums.most[here], most)
