"""A synthetic twin of one of the paper's sites: its numbers with their sources, and its layers.

The data of the sites cannot be distributed. A twin has the numbers given in the paper's text; where it gives none,
those of real steep ground, or chosen ones. Each is defined once, in the table ``NUMBERS`` of `klosters` or
`rothenbrunnen`, with its source. The terrain is computed from these tables, and README.md beside this file shows them.
Version 1 of the twins has other values of some of them (``VERSION_1``).

Local frame of both: u to the east, v up the slope to the north [m]; the slope falls to the south.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
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
from deadwood_algorithms.prepare.synthetic_slope import fint_height, stem_sizes, stems_apart, waves
from deadwood_algorithms.results.run_folder import write_json

CRS_NAME = "EPSG:2056"
CELL = 0.5  # [m], the paper's (section 4)
CHOSEN, GROUND = "chosen", "real ground"
VERSIONS = (1, 2)
# Of the ground beyond the road; without it logs roll to and fro for minutes.
FLOOR_ROUGHNESS = ((3.0, 0.15), (12.0, 0.40))
NOISE = 0.03  # [m] of the heights even on the road, as in any laser scan


@dataclass(frozen=True)
class Number:
    """One number of a twin, its source (a section of the paper, ``real ground`` or ``chosen``), and the reason.

    compared : the twin is not made of it but compared with it, so it cannot be changed
    """

    name: str
    value: Any
    unit: str
    source: str
    why: str
    compared: bool = False


# Relief and heights of trees of both twins.
RELIEF = (
    Number("wavelength_m", (2.5, 6.0, 14.0, 35.0, 90.0), "m", GROUND, "of random relief"),
    Number(
        "deviation_m",
        (0.07, 0.15, 0.25, 0.6, 3.5),
        "m",
        GROUND,
        "standard deviation of the heights of each wavelength; together inside the bands of Laret",
    ),
    Number(
        "stretch",
        1.3,
        "",
        GROUND,
        "of the long waves along the fall line; 1 to 2: at 10 to 20 m the relief across over that "
        "along is 0.9 to 1.8, at 1 m 1.0 to 1.2",
    ),
    Number("short_m", 20.0, "m", GROUND, "waves up to this length are the roughness: in patches, not stretched"),
    Number("patch_m", 60.0, "m", GROUND, "wavelength of the patches"),
    Number(
        "patch_log_sd",
        0.6,
        "",
        GROUND,
        "standard deviation of the roughness's logarithm: at 1 m 90 over 10 % is then 2.3, really 2.4 to 3.6",
    ),
    Number("patch_limits", (0.4, 2.0), "", GROUND, "least and most of the roughness over its median"),
    Number(
        "height_curve",
        (2.25, 0.158),
        "",
        GROUND,
        "of trees: H = 1.3 + (DBH / (a + b DBH))^2 with DBH in cm, Näslund's curve, through four classes",
    ),
)
VERSION_1: dict[str, Any] = {
    "wavelength_m": (2.0, 5.0, 14.0, 35.0, 90.0),
    "deviation_m": (0.08, 0.22, 0.60, 1.00, 1.20),
    "stretch": 1.0,
    "short_m": 100.0,
    "patch_log_sd": 0.0,
    "height_curve": None,
}


@dataclass(frozen=True)
class Twin:
    """A site as layers; ``facts`` are the values that no layer holds (``site.json``)."""

    name: str
    dem: Grid
    layers: Mapping[str, geopandas.GeoDataFrame]
    facts: Mapping[str, Any]


def numbers_by_name(numbers: Sequence[Number]) -> dict[str, Any]:
    return {each.name: each.value for each in numbers}


def changed(numbers: Sequence[Number], first: Mapping[str, Any], version: int, **changes: Any) -> dict[str, Any]:
    """The numbers of a version of a twin by name, with the given changes."""
    of = numbers_by_name(numbers) | (dict(first) if version == 1 else {})
    unknown = set(changes) - set(of)
    if unknown or version not in VERSIONS:
        raise ValueError(f"a twin of version {version} has no {', '.join(sorted(unknown))}")
    if fixed := {each.name for each in numbers if each.compared} & set(changes):
        raise ValueError(f"the twin is compared with {', '.join(sorted(fixed))}, and not made of it")
    return of | changes


@dataclass(frozen=True)
class Frame:
    """Position and size of a twin's local frame [m]."""

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
        """The part of the frame between two values of v."""
        return shapely.box(self.east, self.north + low, self.east + self.width, self.north + high)

    def point(self, u: float, v: float) -> shapely.Point:
        return shapely.Point(self.east + u, self.north + v)


def roughness(
    rng: np.random.Generator, frame: Frame, spectrum: Sequence[tuple[float, float]], stretch: float = 1.0
) -> NDArray[np.float64]:
    """Relief of several wavelengths [m]."""
    relief = np.zeros(frame.shape)
    for wavelength, deviation in spectrum:
        relief += deviation * waves(rng, *frame.shape, wavelength, CELL, stretch)
    return relief


def relief(
    rng: np.random.Generator, frame: Frame, k: Mapping[str, Any]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Relief of the short waves, rougher in patches, and of the long ones [m]."""
    spectrum = list(zip(k["wavelength_m"], k["deviation_m"], strict=True))
    short = roughness(rng, frame, [wave for wave in spectrum if wave[0] <= k["short_m"]])
    long = roughness(rng, frame, [wave for wave in spectrum if wave[0] > k["short_m"]], k["stretch"])
    if k["patch_log_sd"] > 0.0:
        patches = np.exp(k["patch_log_sd"] * waves(rng, *frame.shape, k["patch_m"], CELL))
        short *= np.clip(patches, *k["patch_limits"])
    return short, long


def height_curve(k: Mapping[str, Any]) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    """Height of a tree [m] as a function of its DBH [cm]."""
    if k["height_curve"] is None:
        return fint_height
    a, b = k["height_curve"]
    return lambda dbh: 1.3 + (dbh / (a + b * dbh)) ** 2


def layer(columns: Mapping[str, Any], shapes: Any) -> geopandas.GeoDataFrame:
    return geopandas.GeoDataFrame(dict(columns), geometry=shapes, crs=CRS_NAME)


def forest_layer(
    frame: Frame, k: Mapping[str, Any], free: Callable[[float, float], bool] = lambda u, v: False
) -> geopandas.GeoDataFrame:
    """Trees as if mapped; none where ``free`` is true."""
    rng = np.random.default_rng(k["seed"] + 1)
    low, high = k["forest_v_m"]
    count = round(k["stems_per_ha"] * frame.width * (high - low) / 1e4)
    places = stems_apart(rng, count, (1.0, frame.width - 1.0, low, high), k["tree_distance_m"], free)
    sizes = k["dbh_mean_cm"], k["dbh_sd_cm"], k["dbh_least_cm"]
    dbh, height = stem_sizes(rng, count, *sizes, height_curve(k))
    shapes = shapely.points(np.round(places + np.array([frame.east, frame.north]), 2))
    return layer({"tree_id": np.arange(1, count + 1), "dbh_cm": dbh, "height_m": np.maximum(height, 1.3)}, shapes)


def write_site(twin: Twin, folder: Path) -> None:
    """Write a twin in the layout of ``--site-data``, into a new folder."""
    folder.mkdir(parents=True)
    write_raster(folder / "dem.tif", twin.dem.values, twin.dem, nodata=-9999.0, dtype="float32", units="m")
    for name, rows in twin.layers.items():
        write_vector(folder / f"{name}.gpkg", {name: rows})
    write_json(folder / "site.json", twin.facts)


def page_of(title: str, numbers: Sequence[Number], first: Mapping[str, Any]) -> str:
    """The numbers of a twin as a table of Markdown, with those of version 1."""
    rows = [f"## {title}\n", "| number | value | version 1 | unit | from | what, and why so |"]
    rows.append("|---|---|---|---|---|---|")
    for each in numbers:
        before = shown(first[each.name]) if each.name in first else "the same"
        rows.append(f"| `{each.name}` | {shown(each.value)} | {before} | {each.unit} | {each.source} | {each.why} |")
    return "\n".join(rows) + "\n"


def shown(value: Any) -> str:
    return "H^1.25" if value is None else ", ".join(f"{part:g}" for part in np.ravel(value)) or "none"
