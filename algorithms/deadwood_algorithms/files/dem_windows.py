"""A DEM opened once and read whole or, if it is too large, in windows, each a small `Grid`.

The checks, and the cells that count as outside, are the same either way.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import rasterio
from numpy.typing import NDArray
from rasterio.transform import Affine, from_origin
from rasterio.windows import Window

from deadwood_algorithms.files import remedies
from deadwood_algorithms.files.bands import name_of_band
from deadwood_algorithms.files.crs import horizontal
from deadwood_algorithms.files.dem_header import open_dem
from deadwood_algorithms.files.embedded import tags_now
from deadwood_algorithms.files.geotiff import TILE_CELLS, Statistics, is_laid_out, lay_out, libtiff_silent
from deadwood_algorithms.files.grid import Grid, Part
from deadwood_algorithms.files.heights import (
    COLLAR_DROP_M,
    COLLARS_M,
    MARGIN_CELLS,
    Found,
    candidates_for_collar,
    lowest_inland,
    warn_of_heights,
    without_ground,
)
from deadwood_algorithms.files.rasters import read_values
from deadwood_algorithms.intake import terrain
from deadwood_algorithms.intake.doubts import say, say_all
from deadwood_algorithms.params.tool import Cancelled, Feedback, Quiet, UserError

SAMPLES, SAMPLE_CELLS = 3, 128  # of a large DEM, so many squares in each direction, with this side, are examined
BLOCK_CELLS = 2**22  # read at once: 32 MiB of float64
POINT_REACH_CELLS = 512  # positions within such a distance share one window


@dataclass(frozen=True)
class DemWindows:
    """A DEM open for reading in windows; rows count from the south, as in a `Grid`.

    Attributes
    ----------
    source : rasterio dataset
        As it is in the file; ``flipped`` where its first row is the northernmost.
    shape : (ny, nx)
    cell, x0, y0 : float
        As of a `Grid` [m].
    collars : tuple of float
        Heights of which cells are an undeclared empty margin (`COLLARS_M`).
    """

    source: Any
    path: str
    crs: pyproj.CRS
    shape: tuple[int, int]
    cell: float
    x0: float
    y0: float
    flipped: bool
    collars: tuple[float, ...] = ()

    @property
    def plan_crs(self) -> pyproj.CRS:
        """The horizontal part of the CRS, that of layers in plan."""
        return horizontal(self.crs)

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east and north edge of the cells [m]."""
        west, south = self.x0 - self.cell / 2, self.y0 - self.cell / 2
        return west, south, west + self.shape[1] * self.cell, south + self.shape[0] * self.cell

    @property
    def transform(self) -> Affine:
        """Transform of a north-up raster on these cells."""
        west, _, _, north = self.bounds
        return from_origin(west, north, self.cell, self.cell)

    def grid(self, rows: slice, columns: slice) -> Grid:
        """Heights of a window as float64 [m], NaN outside; the window may extend beyond the raster."""
        wide = [slice(each.start - MARGIN_CELLS, each.stop + MARGIN_CELLS) for each in (rows, columns)]
        values = np.full([max(0, each.stop - each.start) for each in wide], np.nan)
        bottom, top = max(wide[0].start, 0), min(wide[0].stop, self.shape[0])
        left, right = max(wide[1].start, 0), min(wide[1].stop, self.shape[1])
        if bottom < top and left < right:
            window = self.file_window(slice(bottom, top), slice(left, right))
            heights = read_values(self.source, window, np.float64)
            for empty in self.collars:
                heights[heights == empty] = np.nan
            within = (
                slice(bottom - wide[0].start, top - wide[0].start),
                slice(left - wide[1].start, right - wide[1].start),
            )
            values[within] = heights[::-1] if self.flipped else heights
            values[without_ground(values, self.cell)] = np.nan
        inner = (
            slice(MARGIN_CELLS, values.shape[0] - MARGIN_CELLS),
            slice(MARGIN_CELLS, values.shape[1] - MARGIN_CELLS),
        )
        values = np.ascontiguousarray(values[inner])
        x0, y0 = self.x0 + columns.start * self.cell, self.y0 + rows.start * self.cell
        return Grid(values, self.cell, x0, y0, self.crs, self.path)

    def around(self, west: float, south: float, east: float, north: float) -> Grid:
        """The window in which the surface is known over an extent [m], with a cell of margin."""
        columns = slice(int((west - self.x0) // self.cell) - 1, int((east - self.x0) // self.cell) + 3)
        rows = slice(int((south - self.y0) // self.cell) - 1, int((north - self.y0) // self.cell) + 3)
        return self.grid(rows, columns)

    def height(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Bilinear height [m] at positions, most efficient if they are in order along a line; NaN outside."""
        heights = np.full(x.shape, np.nan)
        start, reach = 0, POINT_REACH_CELLS * self.cell
        while start < x.size:
            far = np.maximum(np.abs(x[start:] - x[start]), np.abs(y[start:] - y[start])) > reach
            stop = start + int(np.argmax(far)) if far.any() else x.size
            part = slice(start, stop)
            window = self.around(x[part].min(), y[part].min(), x[part].max(), y[part].max())
            heights[part] = window.height(x[part], y[part])
            start = stop
        return heights

    def strips(self) -> list[slice]:
        """Rows of the whole raster in turn, from the south, at most `BLOCK_CELLS` cells at once.

        They begin and end at the tiles of the file, or of one written like it.
        """
        ny, nx = self.shape
        step = max(1, BLOCK_CELLS // nx // TILE_CELLS) * TILE_CELLS
        edges = [*range(0, ny, step), ny]  # in the file
        strips = [slice(start, stop) for start, stop in pairwise(edges)]
        return [slice(ny - each.stop, ny - each.start) for each in strips[::-1]] if self.flipped else strips

    def file_window(self, rows: slice, columns: slice) -> Window:
        """Position of a window in the file."""
        first = self.shape[0] - rows.stop if self.flipped else rows.start
        height, width = rows.stop - rows.start, columns.stop - columns.start
        return Window(columns.start, first, width, height)  # type: ignore[call-arg]


@contextmanager
def open_windows(
    path: str | Path, *, crs: str | None, feedback: Feedback, look_through: bool = True, what: str = "DEM"
) -> Iterator[DemWindows]:
    """Open a DEM for reading in windows, or reject it with the command that fixes it.

    Without ``look_through`` it is not searched for an undeclared margin: for tools that need a few places only;
    `read_part` then detects it itself. Heights of
    another role (crowns and roofs) may have any steps.
    """
    with open_dem(path, crs, feedback, what) as (source, dem_crs, transform):
        ny, nx = source.shape
        if ny < 2 or nx < 2:
            raise UserError(f"{path}: the DEM has {nx} x {ny} cells; it needs at least 2 x 2")
        cell, flipped = transform.a, transform.e < 0
        x0, y0 = transform.c + cell / 2, transform.f + (0.5 - ny if flipped else 0.5) * cell
        dem = DemWindows(source, str(path), dem_crs, (ny, nx), cell, x0, y0, flipped)
        if what == "DEM" and source.dtypes[0] != "uint8":  # uint8 was already reported
            samples, named = _samples(dem), f"{name_of_band(source, 1)} {Path(dem.path).stem}"
            seen = terrain.Terrain(samples, dem.cell, named, partial(remedies.declared, dem.path))
            if doubt := terrain.NO_HEIGHTS.find(seen):
                say(doubt, dem.path, feedback)
            else:
                warn_of_heights(samples, dem.path, dem.cell, feedback)
                say_all(terrain.CHECKS, seen, dem.path, feedback)
        yield replace(dem, collars=_collars_of(dem, feedback)) if look_through else dem


def read_dem(path: str | Path, *, crs: str | None = None, feedback: Feedback | None = None) -> Grid:
    """Read band 1 of a DEM as float32 heights, or reject it with the command that fixes it.

    ``crs`` names the CRS of a file that holds none. A south-up file is read correctly, a rotated or non-square one is
    rejected.
    """
    feedback = feedback or Quiet()
    with open_windows(path, crs=crs, feedback=feedback, look_through=False) as dem:
        return read_whole(dem, feedback)


def read_whole(dem: DemWindows, feedback: Feedback) -> Grid:
    """All heights as float32 [m]."""
    whole = Part(0, 0, dem.shape[1], dem.shape[0])
    values, found = _heights(dem, whole, feedback), Found()
    found.empty_far(values)
    for empty in candidates_for_collar(values):
        if lowest_inland(values, dem.cell, empty) > empty + COLLAR_DROP_M:
            found.empty_collar(values, empty)
    found.empty_mixed(values, dem.cell)
    found.say(dem.path, feedback)
    if not np.isfinite(values).any():
        found.refuse_nothing(dem.path, dem.cell)
    return Grid(values, dem.cell, dem.x0, dem.y0, dem.crs, dem.path)


def read_part(dem: DemWindows, part: Part, feedback: Feedback) -> Grid:
    """Read a window with the same heights and the same cells outside as `read_whole`."""
    margin = MARGIN_CELLS
    wide = Part(part.column - margin, part.row - margin, part.columns + 2 * margin, part.rows + 2 * margin)
    wide = wide.cut_to(dem.shape)
    values, found = _heights(dem, wide, feedback), Found()
    inner = replace(part, column=part.column - wide.column, row=part.row - wide.row).slices
    found.empty_far(values, inner)
    for empty in candidates_for_collar(values):
        if _means_nothing(dem, values, empty, inner):
            found.empty_collar(values, empty, inner)
    found.empty_mixed(values, dem.cell, inner)
    found.say(dem.path, feedback)
    whole = Grid.empty(dem.shape, dem.cell, dem.x0, dem.y0, dem.crs, dem.path)
    return whole.window(part, np.ascontiguousarray(values[inner]))


def _heights(dem: DemWindows, part: Part, feedback: Feedback) -> NDArray[np.float32]:
    """The heights of a window as stored in the file, read in strips of the file's blocks."""
    values = np.empty((part.rows, part.columns), np.float32)
    block = max(1, dem.source.block_shapes[0][0])
    rows = max(1, BLOCK_CELLS // part.columns // block) * block
    for start in range(0, part.rows, rows):
        stop = min(part.rows, start + rows)
        window = Part(part.column, part.row + start, part.columns, stop - start)
        strip = read_values(dem.source, dem.file_window(*window.slices), np.float32)
        values[start:stop] = strip[::-1] if dem.flipped else strip
        feedback.progress(stop, part.rows, "reading the DEM")
    return values


def _means_nothing(dem: DemWindows, values: NDArray[np.float32], empty: float, inner: tuple[slice, slice]) -> bool:
    """Whether a height is that of an empty margin of the whole DEM; usually the window shows that it is not."""
    if lowest_inland(values, dem.cell, empty, inner) <= empty + COLLAR_DROP_M:
        return False
    strips = _wide_strips(dem)
    return all(lowest_inland(strip, dem.cell, empty, within) > empty + COLLAR_DROP_M for strip, within in strips)


def _wide_strips(dem: DemWindows) -> Iterator[tuple[NDArray[np.float32], tuple[slice, slice]]]:
    """The whole DEM strip by strip, each with the margin needed to check its cells, and its position within that."""
    for rows in dem.strips():
        wide = Part(0, rows.start - MARGIN_CELLS, dem.shape[1], rows.stop - rows.start + 2 * MARGIN_CELLS)
        wide = wide.cut_to(dem.shape)
        # one stage of progress: two alternating ones would restart each time and show nothing
        yield _heights(dem, wide, Quiet()), (slice(rows.start - wide.row, rows.stop - wide.row), slice(None))


def _collars_of(dem: DemWindows, feedback: Feedback) -> tuple[float, ...]:
    """Scan the whole DEM once for invalid heights, and return those of which all cells are invalid."""
    lowest, cells = dict.fromkeys(COLLARS_M, np.inf), dict.fromkeys(COLLARS_M, 0)
    heights, found = 0, Found()
    strips = len(dem.strips())
    for done, (values, inner) in enumerate(_wide_strips(dem)):
        if feedback.cancelled():
            raise Cancelled
        found.empty_far(values, inner)
        heights += int(np.isfinite(values[inner]).sum())
        there = candidates_for_collar(values)
        plain = lowest_inland(values, dem.cell, np.inf, inner)
        for empty in COLLARS_M:
            least = lowest_inland(values, dem.cell, empty, inner) if empty in there else plain
            lowest[empty] = min(lowest[empty], least)
            cells[empty] += int((values[inner] == empty).sum()) if empty in there else 0
        found.empty_mixed(values, dem.cell, inner)
        feedback.progress(done + 1, strips, "scanning the DEM")
    if not heights:
        found.refuse_nothing(dem.path, dem.cell)
    collars = tuple(each for each in COLLARS_M if cells[each] and each + COLLAR_DROP_M < lowest[each] < np.inf)
    found.collars = {empty: cells[empty] for empty in collars}
    found.say(dem.path, feedback)
    return collars


def _samples(dem: DemWindows) -> list[NDArray[Any]]:
    """The heights of a small DEM, or of squares spread over a large one."""
    starts = []
    for n in dem.shape:
        many = n > SAMPLES * SAMPLE_CELLS
        starts.append([round(k * (n - SAMPLE_CELLS) / (SAMPLES - 1)) for k in range(SAMPLES)] if many else [0])
    sizes = [SAMPLE_CELLS if len(at) > 1 else n for at, n in zip(starts, dem.shape, strict=True)]
    return [
        dem.grid(slice(row, row + sizes[0]), slice(column, column + sizes[1])).values
        for row in starts[0]
        for column in starts[1]
    ]


class WindowWriter:
    """A GeoTIFF written window by window and then read back, to detect a full disk (see `write_raster`)."""

    def __init__(
        self,
        path: Path,
        feedback: Feedback,
        *,
        with_statistics: bool = True,
        final: bool = True,
        of_region: bool = False,
        **profile: Any,
    ) -> None:
        """``final`` is false for a raster that the tool reads again and deletes: without statistics and overviews.

        ``of_region`` is a raster of many runs, whose overviews may take longer (`geotiff.lay_out`).
        """
        self.path, self.feedback, self.final, self.of_region = path, feedback, final, of_region
        self.cells, self.sparse = profile["height"] * profile["width"], bool(profile.get("SPARSE_OK"))
        self.target = rasterio.open(path, "w", **profile)
        if final:
            self.target.update_tags(**tags_now())
        self.written: list[tuple[Window, int]] = []
        count = self.target.count if with_statistics and final else 0
        self.statistics = [Statistics(self.target.nodata) for _ in range(count)]

    def write(self, values: NDArray[Any], window: Window) -> None:
        """``values`` as they are in the file, shape (bands, rows, columns), of the file's type."""
        with libtiff_silent():
            self.target.write(values, window=window)
        self.written.append((window, zlib.crc32(np.ascontiguousarray(values).data)))
        for of_band, band in zip(self.statistics, values, strict=False):
            of_band.take(band)

    def leave_out(self, cells: int) -> None:
        """Count empty cells, which are not written: in a sparse file their tiles read as nodata, or as 0."""
        for of_band in self.statistics:
            of_band.cells += cells

    def __enter__(self) -> WindowWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        with libtiff_silent():
            if kind is None:
                for number, of_band in enumerate(self.statistics, start=1):
                    self.target.update_tags(number, **of_band.tags())
            self.target.close()
            if kind is None and self.final:
                if is_laid_out(self.cells, sparse=self.sparse, of_region=self.of_region):
                    self.feedback.progress(0, 1, "building overviews")
                lay_out(self.path, self.cells, sparse=self.sparse, of_region=self.of_region)
        if kind is None:
            self._read_back()

    def _read_back(self) -> None:
        with rasterio.open(self.path) as made:
            for done, (window, checksum) in enumerate(self.written, start=1):
                if self.feedback.cancelled():
                    raise Cancelled
                if zlib.crc32(np.ascontiguousarray(made.read(window=window)).data) != checksum:
                    raise OSError(f"{self.path}: the written file cannot be read back")
                self.feedback.progress(done, len(self.written), "reading the file back")
