"""Release areas from a raster of susceptibility: connected ground above a threshold, as polygons with their statistics.

For `assess_mobilisation`. The rasters may be larger than memory: each block is polygonised and measured separately,
and areas on both sides of a border between blocks are joined at the end. Only polygons that are large enough are kept,
and those that touch a border.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import pyproj
import rasterio
import rasterio.features
import shapely
import shapely.affinity
from numpy.typing import NDArray
from rasterio.windows import Window
from shapely.geometry import shape as _shape

from deadwood_algorithms.params.tool import Cancelled, Feedback

BLOCK = 1024  # cells on a side


@dataclass
class Pieces:
    """Polygons of single blocks, in cells from the raster's upper left corner, and sums over their cells."""

    shapes: list[Any] = field(default_factory=list)
    sums: list[NDArray[np.float64]] = field(default_factory=list)  # sums of cells, susceptibility, slope, gully cells
    most: list[float] = field(default_factory=list)  # the largest susceptibility
    touching: list[NDArray[np.intp]] = field(default_factory=list)  # pairs of pieces, shape (n, 2)


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
    least = least_m2 * (1.0 - 1e-9)  # the sum of the cells may be rounded to just below
    with rasterio.open(mask) as chosen, rasterio.open(susceptibility) as source, rasterio.open(factors) as beside:
        place, cell_m2 = chosen.transform, abs(chosen.transform.a * chosen.transform.e)
        pieces = _pieces(chosen, source, beside, gully_m, least / cell_m2, feedback)
    areas = []
    for group in _groups(len(pieces.shapes), pieces.touching):
        sums = np.sum([pieces.sums[k] for k in group], axis=0)
        if sums[0] * cell_m2 >= least:
            drawn = pieces.shapes[group[0]]
            if len(group) > 1:  # without the corners that come from the blocks
                drawn = shapely.simplify(shapely.union_all([pieces.shapes[k] for k in group]), 0.0)
            a, b, d, e = place.a, place.b, place.d, place.e
            moved = shapely.affinity.affine_transform(drawn, (a, b, d, e, place.c, place.f))
            areas.append((moved, sums, max(pieces.most[k] for k in group)))
    areas.sort(key=lambda each: (-each[0].area, each[0].bounds))
    shapes = [each[0] for each in areas]
    cells, value, slope, gully = np.array([each[1] for each in areas]).reshape(-1, 4).T
    columns = {
        "release_id": np.arange(1, len(shapes) + 1),
        "area_m2": np.array([each.area for each in shapes], float),
        "susceptibility_mean": value / cells,
        "susceptibility_max": np.array([each[2] for each in areas], float),
        "slope_mean_deg": slope / cells,
        "gully_share": gully / cells,
    }
    return geopandas.GeoDataFrame(columns, geometry=shapes, crs=crs)


def _pieces(
    chosen: Any, source: Any, beside: Any, gully_m: float, least_cells: float, feedback: Feedback
) -> Pieces:  # fmt: skip
    """All blocks in turn, from the north; of finished ones only the numbers along the borders are kept."""
    pieces = Pieces()
    tops, lefts = range(0, chosen.height, BLOCK), range(0, chosen.width, BLOCK)
    above = np.full(chosen.width, -1)  # the piece of each cell in the row above
    for done, top in enumerate(tops):
        beside_it = np.full(min(BLOCK, chosen.height - top), -1)
        for left in lefts:
            if feedback.cancelled():
                raise Cancelled
            window = Window(left, top, min(BLOCK, chosen.width - left), min(BLOCK, chosen.height - top))  # type: ignore[call-arg]
            owner = _draw(pieces, chosen.read(1, window=window), source, beside, window, gully_m, least_cells)
            here = slice(left, left + owner.shape[1])
            for one, other in ((above[here], owner[0]), (beside_it, owner[:, 0])):
                both = (one >= 0) & (other >= 0)
                pieces.touching.append(np.unique(np.stack([one[both], other[both]], axis=1), axis=0))
            above[here], beside_it = owner[-1], owner[:, -1]
        feedback.progress(done + 1, len(tops), "drawing release areas")
    return pieces


def _draw(
    pieces: Pieces, chosen: NDArray[np.uint8], source: Any, beside: Any, window: Window, gully_m: float, least: float
) -> NDArray[np.intp]:
    """Add the pieces of one block; returns the number of the piece of each cell, -1 where none is kept."""
    owner = np.full(chosen.shape, -1)
    if not chosen.any():
        return owner
    # The corners of a block's cells are integers, which joining keeps exact.
    place = rasterio.Affine.translation(window.col_off, window.row_off)
    drawn = rasterio.features.shapes(chosen, mask=chosen > 0, connectivity=4, transform=place)
    west, north, east, south = (
        window.col_off, window.row_off, window.col_off + window.width, window.row_off + window.height
    )  # fmt: skip
    shapes = []
    for each in (_shape(outline) for outline, _ in drawn):
        left, top, right, bottom = each.bounds
        if each.area >= least or left == west or right == east or top == north or bottom == south:
            shapes.append(each)
    if not shapes:
        return owner
    number = np.zeros(chosen.shape, np.int32)
    rasterio.features.rasterize(zip(shapes, range(1, len(shapes) + 1), strict=True), out=number, transform=place)
    inside = (number > 0) & (chosen > 0)
    at, size = number[inside] - 1, len(shapes)
    value = source.read(1, window=window)[inside].astype(float)
    slope, hollow = (beside.read(band, window=window)[inside].astype(float) for band in (1, 3))
    most = np.zeros(size)
    np.maximum.at(most, at, value)
    weights = (None, value, slope, (hollow >= gully_m).astype(float))
    owner[inside] = at + len(pieces.shapes)
    pieces.sums.extend(np.stack([np.bincount(at, each, size).astype(float) for each in weights], axis=1))
    pieces.most.extend(most.tolist())
    pieces.shapes.extend(shapes)
    return owner


def _groups(count: int, touching: list[NDArray[np.intp]]) -> list[list[int]]:
    """Pieces that touch, directly or through others; each group lists them in ascending order."""
    first = list(range(count))

    def root(k: int) -> int:
        while first[k] != k:
            first[k] = k = first[first[k]]
        return k

    for pairs in touching:
        for one, other in pairs.tolist():
            low, high = sorted((root(one), root(other)))
            first[high] = low
    groups: dict[int, list[int]] = {}
    for k in range(count):
        groups.setdefault(root(k), []).append(k)
    return list(groups.values())
