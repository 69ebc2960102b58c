"""A raster on square cells: values at the cell centres, row 0 in the south. Or a window of such a raster, with a
reference to the whole.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pyproj
    from rasterio.transform import Affine


@dataclass(frozen=True)
class Part:
    """A window of a grid: its first column and row, and how many of each."""

    column: int
    row: int
    columns: int
    rows: int

    @property
    def cells(self) -> int:
        return self.columns * self.rows

    @property
    def slices(self) -> tuple[slice, slice]:
        """Slices of rows and columns."""
        return slice(self.row, self.row + self.rows), slice(self.column, self.column + self.columns)

    def joined(self, other: Part) -> Part:
        """The smallest window that holds both."""
        column, row = min(self.column, other.column), min(self.row, other.row)
        east = max(self.column + self.columns, other.column + other.columns)
        north = max(self.row + self.rows, other.row + other.rows)
        return Part(column, row, east - column, north - row)

    def cut_to(self, shape: tuple[int, int]) -> Part:
        """The part of it that lies in a grid of this shape."""
        column, row = max(0, self.column), max(0, self.row)
        east, north = min(shape[1], self.column + self.columns), min(shape[0], self.row + self.rows)
        return Part(column, row, max(0, east - column), max(0, north - row))


@dataclass(frozen=True, eq=False)
class Grid:
    """A raster on square cells.

    Attributes
    ----------
    values : array, shape (ny, nx)
        Row 0 is the southernmost; NaN is outside.
    cell : float
        Side of a cell [m].
    x0, y0 : float
        World coordinates [m] of the centre of ``values[0, 0]``.
    crs : pyproj.CRS
        Projected, in metres; it may be compound.
    path : str
        Path from which it was read.
    whole : Grid, optional
        The whole grid of which this is a window, without its values; None if this is the whole.
    first : (column, row)
        Position of ``values[0, 0]`` in the whole.
    """

    values: np.ndarray
    cell: float
    x0: float
    y0: float
    crs: pyproj.CRS
    path: str = ""
    whole: Grid | None = None
    first: tuple[int, int] = (0, 0)

    @staticmethod
    def empty(shape: tuple[int, int], cell: float, x0: float, y0: float, crs: pyproj.CRS, path: str = "") -> Grid:
        """A grid with a location but without values (NaN, which take no memory)."""
        return Grid(np.broadcast_to(np.float32(np.nan), shape), cell, x0, y0, crs, path)

    def window(self, part: Part, values: np.ndarray | None = None) -> Grid:
        """A window of this grid, with the given values or its own."""
        values = self.values[part.slices] if values is None else values
        x0, y0 = self.x0 + part.column * self.cell, self.y0 + part.row * self.cell
        whole = Grid.empty(self.shape, self.cell, self.x0, self.y0, self.crs, self.path)
        return replace(self, values=values, x0=x0, y0=y0, whole=whole, first=(part.column, part.row))

    @property
    def frame(self) -> Grid:
        """The whole of which this is a window, or this grid itself."""
        return self.whole or self

    @property
    def part(self) -> Part:
        """Its position in the whole."""
        return Part(*self.first, self.shape[1], self.shape[0])

    @property
    def shape(self) -> tuple[int, int]:
        return self.values.shape[0], self.values.shape[1]

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east and north edge of the cells [m]."""
        ny, nx = self.shape
        west, south = self.x0 - self.cell / 2, self.y0 - self.cell / 2
        return west, south, west + nx * self.cell, south + ny * self.cell

    @property
    def transform(self) -> Affine:
        """Transform of the north-up raster that is written from the grid."""
        from rasterio.transform import from_origin

        west, _, _, north = self.bounds
        return from_origin(west, north, self.cell, self.cell)

    @property
    def plan_crs(self) -> pyproj.CRS:
        """The horizontal part of the CRS, that of layers in plan."""
        from deadwood_algorithms.files.crs import horizontal

        return horizontal(self.crs)

    def height(self, x: Any, y: Any) -> np.ndarray:
        """Bilinear height [m] between the four cell centres around each position, NaN where one of them is outside."""
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        ny, nx = self.shape
        u, v = (x - self.x0) / self.cell, (y - self.y0) / self.cell
        inside = (u >= 0) & (u <= nx - 1) & (v >= 0) & (v <= ny - 1)
        i = np.clip(np.nan_to_num(np.floor(u)), 0, nx - 2).astype(np.int64)
        j = np.clip(np.nan_to_num(np.floor(v)), 0, ny - 2).astype(np.int64)
        s, t = u - i, v - j
        south = (1 - s) * self.values[j, i] + s * self.values[j, i + 1]
        north = (1 - s) * self.values[j + 1, i] + s * self.values[j + 1, i + 1]
        return np.where(inside, (1 - t) * south + t * north, np.nan)

    def read(self, part: Part) -> Grid:
        """A window of it (for a large DEM `dem_blocks` reads one)."""
        return self.window(part)

    def contains(self, x: Any, y: Any) -> np.ndarray:
        """Whether the surface has a height at each position."""
        return np.isfinite(self.height(x, y))
