"""The rasters of a run as GeoTIFFs: counts and maxima of the cells, shares of the logs, and the danger to the lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.rasters import Band, ByRows, rows_of, write_bands
from deadwood_algorithms.results.danger import ANY, bands_by_rows, bands_of_lines, units_of
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.schemas.files import DANGER, DANGER_COUNT, RUN_RASTERS
from deadwood_algorithms.simulate.totals import Totals
from deadwood_engine import Rasters

# Name, type, unit and style of the rasters of every run.
MAPS = tuple((each.name, each.bands[0].number, each.bands[0].unit, each.look) for each in RUN_RASTERS)
SECOND = {"jump_max": "height_max"}  # second band of the rasters with two bands; its unit is that of the first


def write_run_rasters(
    folder: Path, rasters: Rasters, layers: SceneLayers, n_logs: int, danger_least: int, *, danger_counts: bool = False
) -> dict[str, str]:
    """Write the six GeoTIFFs, with lines a seventh; where no log passed, counts are 0, the others NaN.

    With ``danger_counts`` and lines, the counts behind the seventh are an eighth.
    """
    totals = Totals(rasters)

    def band(name: str, number: int | None = None) -> ByRows:
        def of(rows: slice) -> NDArray:
            values = totals.rows(rows, (name,))[name]
            if name == "energy_max":
                return values / np.float32(1000.0)
            return values if number is None else values[number]

        return ByRows(totals.shape, of)

    written = write_maps(folder, {name: band(name) for name in totals.names}, layers.dem, n_logs)
    if "danger" in totals.names:
        danger = [band("danger", number) for number in range(len(totals.untouched["danger"]))]
        hits, ids = band("hit_count"), layers.lines.ids
        written["danger"] = write_danger(folder, hits, danger, layers.dem, ids, danger_least)
        if danger_counts:
            written["danger_count"] = write_danger_counts(folder, danger, layers.dem, ids)
    rasters.workers.clear()  # their rasters have been written, and take most of the memory of a run on a large DEM
    return written


def write_maps(folder: Path, total: Mapping[str, Band], grid: Grid, n_logs: int) -> dict[str, str]:
    """The six GeoTIFFs of the cells' counts and maxima, energies in kJ; cells without height are NaN
    in the shares."""
    hits = total["hit_count"]

    def shares(rows: slice) -> NDArray[np.float32]:
        return shares_of(rows_of(hits, rows), n_logs, np.isnan(grid.values[rows]))

    values = {**total, "reach_probability": ByRows(grid.shape, shares)}
    for name, kind, units, style in MAPS:
        bands = {each: values[each] for each in bands_of(name)}
        write_bands(
            folder / f"{name}.tif",
            bands,
            grid,
            nodata=nodata_of(name, kind, windowed=grid.whole is not None),
            dtype=kind,
            units=[units] * len(bands),
            style=style,
            raster=name,
        )
    return {row[0]: f"{row[0]}.tif" for row in MAPS}


def bands_of(name: str) -> list[str]:
    """The bands of a map, by their names among the totals."""
    return [name, *([SECOND[name]] if name in SECOND else [])]


def shares_of(hits: NDArray[np.uint32], n_logs: int, outside: NDArray[np.bool_]) -> NDArray[np.float32]:
    """The share of the logs that passed each cell; NaN where there is no ground."""
    share = np.empty(hits.shape, np.float32)
    for row, counts in zip(share, hits, strict=True):  # in double precision, a row at a time
        row[:] = counts / np.float32(n_logs)
    share[outside] = np.nan
    return share


def nodata_of(name: str, kind: str, *, windowed: bool) -> float | None:
    """Nothing is stored outside the window of a large DEM. No log went there, so a share must read as 0 there, as it
    does inside where no log passed; the other quantities have no value in both cases."""
    return np.nan if kind == "float32" and not (windowed and name == "reach_probability") else None


def write_danger(
    folder: Path,
    hits: Band,
    danger: Sequence[Band] | NDArray[np.uint32],
    grid: Grid,
    line_ids: Sequence[Any],
    danger_least: int,
) -> str:
    bands = bands_by_rows(hits, danger, line_ids, danger_least)
    place = folder / "danger.tif"
    units = units_of(list(bands))
    write_bands(place, bands, grid, nodata=np.nan, dtype="float32", units=units, style=DANGER.look, raster=DANGER.name)
    return place.name


def write_danger_counts(folder: Path, danger: Sequence[Band], grid: Grid, line_ids: Sequence[Any]) -> str:
    """Write the counts for any line, then for each line, which can be added over several runs."""
    bands = dict(zip((ANY, *bands_of_lines(line_ids)), danger, strict=True))
    place = folder / "danger_count.tif"
    options = {"units": ["logs"] * len(bands), "style": DANGER_COUNT.look, "raster": DANGER_COUNT.name}
    write_bands(place, bands, grid, dtype="uint32", **options)
    return place.name
