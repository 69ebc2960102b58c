"""A synthetic twin of one of the paper's sites: its numbers with their sources, and its layers.

The sites' own data cannot be shipped. A twin has the numbers that the paper's text gives, and chosen ones where it
gives none; each stands once, in the table ``NUMBERS`` of `klosters` and of `rothenbrunnen`, with where it is from. The
tables are what the terrain is computed from, and what README.md beside this file shows.

Local frame of both: u to the east, v up the slope to the north [m]; the slope falls to the south.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import pyproj
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.rasters import write_raster
from deadwood_algorithms.files.vectors import write_vector
from deadwood_algorithms.prepare.synthetic_slope import stem_sizes, stems_apart, waves
from deadwood_algorithms.results.run_folder import write_json

CRS_NAME = "EPSG:2056"
CELL = 0.5  # [m], the paper's (section 4)
CHOSEN = "chosen"
# Roughness of both twins: (wavelength [m], standard deviation of height [m]), that of the sample slope.
ROUGHNESS = ((2.0, 0.08), (5.0, 0.22), (14.0, 0.60), (35.0, 1.00), (90.0, 1.20))
FLOOR_ROUGHNESS = ((3.0, 0.15), (12.0, 0.40))  # of the ground beyond the road, else logs roll to and fro for minutes
NOISE = 0.03  # [m] of the heights even on the road, as in any laser scan


@dataclass(frozen=True)
class Number:
    """One number of a twin: the section of the paper that it is taken from, or ``chosen`` and why so."""

    name: str
    value: Any
    unit: str
    source: str
    why: str


@dataclass(frozen=True)
class Twin:
    """A site as layers; ``facts`` is what no layer holds (``site.json``)."""

    name: str
    dem: Grid
    layers: Mapping[str, geopandas.GeoDataFrame]
    facts: Mapping[str, Any]


def numbers_by_name(numbers: Sequence[Number]) -> dict[str, Any]:
    return {each.name: each.value for each in numbers}


@dataclass(frozen=True)
class Frame:
    """Where a twin's local frame stands, and how large it is [m]."""

    east: float
    north: float
    width: float
    length: float

    @property
    def shape(self) -> tuple[int, int]:
        return int(self.length / CELL), int(self.width / CELL)

    def axes(self) -> tuple[NDArray, NDArray]:
        """u of the columns, shape (nx,), and v of the rows, shape (ny, 1) [m]."""
        rows, columns = self.shape
        u, v = (np.arange(0.5, many, dtype=np.float64) * CELL for many in (columns, rows))
        return u, v[:, None]

    def grid(self, heights: NDArray[np.float64], name: str) -> Grid:
        """The terrain model, rounded to a centimetre."""
        return Grid(
            values=np.round(heights, 2).astype(np.float32),
            cell=CELL,
            x0=self.east + 0.5 * CELL,
            y0=self.north + 0.5 * CELL,
            crs=pyproj.CRS.from_user_input(CRS_NAME),
            path=f"the {name} twin",
        )

    def line(self, *places: tuple[float, float]) -> shapely.LineString:
        return shapely.LineString([(self.east + u, self.north + v) for u, v in places])

    def across(self, v: float, start: float = 2.0, end: float | None = None) -> shapely.LineString:
        """A line along the slope's contour, over the whole width unless its ends are given."""
        return self.line((start, v), (self.width - 2.0 if end is None else end, v))

    def strip(self, low: float, high: float) -> shapely.Polygon:
        """All of the frame between two v."""
        return shapely.box(self.east, self.north + low, self.east + self.width, self.north + high)

    def point(self, u: float, v: float) -> shapely.Point:
        return shapely.Point(self.east + u, self.north + v)


def roughness(rng: np.random.Generator, frame: Frame, spectrum: Sequence[tuple[float, float]]) -> NDArray[np.float64]:
    """Relief of several wavelengths [m]."""
    relief = np.zeros(frame.shape)
    for wavelength, deviation in spectrum:
        relief += deviation * waves(rng, *frame.shape, wavelength, CELL)
    return relief


def layer(columns: Mapping[str, Any], shapes: Any) -> geopandas.GeoDataFrame:
    return geopandas.GeoDataFrame(dict(columns), geometry=shapes, crs=CRS_NAME)


def forest_layer(
    frame: Frame,
    seed: int,
    band: tuple[float, float],
    stems_per_ha: float,
    sizes: tuple[float, float, float],
    apart: float,
    free: Any,
) -> geopandas.GeoDataFrame:
    """Trees as if mapped, ``sizes`` being mean, standard deviation and least DBH [cm]."""
    rng = np.random.default_rng(seed)
    count = round(stems_per_ha * frame.width * (band[1] - band[0]) / 1e4)
    places = stems_apart(rng, count, (1.0, frame.width - 1.0, *band), apart, free)
    dbh, height = stem_sizes(rng, count, *sizes)
    shapes = shapely.points(np.round(places + np.array([frame.east, frame.north]), 2))
    return layer({"tree_id": np.arange(1, count + 1), "dbh_cm": dbh, "height_m": np.maximum(height, 1.3)}, shapes)


def write_site(twin: Twin, folder: Path) -> None:
    """Write a twin in the layout of ``--site-data``, into a folder that is made."""
    folder.mkdir(parents=True)
    write_raster(folder / "dem.tif", twin.dem.values, twin.dem, nodata=-9999.0, dtype="float32", units="m")
    for name, rows in twin.layers.items():
        write_vector(folder / f"{name}.gpkg", {name: rows})
    write_json(folder / "site.json", twin.facts)


def page_of(title: str, numbers: Sequence[Number]) -> str:
    """The numbers of a twin as a table of Markdown."""
    rows = [f"## {title}\n", "| number | value | unit | paper's section, or chosen | what, and why so |"]
    rows.append("|---|---|---|---|---|")
    for each in numbers:
        value = ", ".join(f"{part:g}" for part in np.ravel(each.value))
        rows.append(f"| `{each.name}` | {value} | {each.unit} | {each.source} | {each.why} |")
    return "\n".join(rows) + "\n"
