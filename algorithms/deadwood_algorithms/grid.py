"""A raster on square cells: values at the cell centres, row 0 in the south."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pyproj
    from rasterio.transform import Affine


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
        Where it was read from.
    """

    values: np.ndarray
    cell: float
    x0: float
    y0: float
    crs: pyproj.CRS
    path: str = ""

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
        """Of the north-up raster that the grid is written as."""
        from rasterio.transform import from_origin

        west, _, _, north = self.bounds
        return from_origin(west, north, self.cell, self.cell)

    @property
    def plan_crs(self) -> pyproj.CRS:
        """The CRS without its heights: that of the layers in the plan."""
        from deadwood_algorithms.crs import horizontal

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

    def contains(self, x: Any, y: Any) -> np.ndarray:
        """Whether the surface has a height at each position."""
        return np.isfinite(self.height(x, y))
