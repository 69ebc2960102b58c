"""Release areas: connected cells from which enough logs start, as polygons with the shares of all their logs.

For `assess_mobilisation`.
"""

from __future__ import annotations

import geopandas
import numpy as np
import rasterio.features
import shapely.geometry
from numpy.typing import NDArray

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.prepare.mobilisation.cells import Shares, outcome_columns


def zones(
    chosen: NDArray[np.bool_],
    shares: Shares,
    slope: NDArray[np.float64],
    grid: Grid,
    least_m2: float,
    surface: tuple[float, float, float, float],
) -> geopandas.GeoDataFrame:
    """The polygons of chosen cells that touch along a side and are large enough, the largest first.

    surface : bounds within which there are heights; logs can be released no nearer to the edge of the terrain model
    """
    least = least_m2 * (1.0 - 1e-9)  # the sum of the cells may be rounded to just below
    north_up = chosen[::-1].astype(np.uint8)
    drawn = rasterio.features.shapes(north_up, mask=north_up > 0, connectivity=4, transform=grid.transform)
    outlines = (shapely.clip_by_rect(shapely.geometry.shape(outline), *surface) for outline, _ in drawn)
    shapes = [shape for shape in outlines if shape.area >= least]
    shapes.sort(key=lambda each: (-each.area, each.bounds))
    number = np.zeros(chosen.shape, np.int32)
    if shapes:
        numbered = zip(shapes, range(1, len(shapes) + 1), strict=True)
        rasterio.features.rasterize(numbered, out=number, transform=grid.transform)
    area = np.where(chosen, number[::-1].astype(np.int64) - 1, -1).ravel()
    logs, found = shares.of(area, len(shapes))
    inside = area >= 0
    cells = np.bincount(area[inside], minlength=len(shapes))
    columns = {
        "release_id": np.arange(1, len(shapes) + 1),
        "area_m2": np.array([each.area for each in shapes], float),
        "n_logs": logs,
        **dict(outcome_columns(found)),
        "slope_mean_deg": np.bincount(area[inside], np.nan_to_num(slope.ravel()[inside]), len(shapes))
        / np.maximum(cells, 1),
    }
    return geopandas.GeoDataFrame(columns, geometry=shapes, crs=grid.plan_crs)
