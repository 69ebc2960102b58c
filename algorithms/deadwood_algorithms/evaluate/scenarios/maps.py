"""Where scenarios differ: rasters of the difference of hit probability, and the logs that changed, as layers.

Rasters are read and written in windows on the grid that holds those of all runs, so their size does not matter.
"""

from __future__ import annotations

import math
from pathlib import Path

import geopandas
import numpy as np
import pandas
import rasterio
import shapely
from numpy.typing import NDArray
from rasterio.errors import RasterioError
from rasterio.transform import Affine
from rasterio.windows import Window

from deadwood_algorithms.evaluate.scenarios.paired_runs import Compared, Scenario
from deadwood_algorithms.files import styles
from deadwood_algorithms.files.dem_windows import WindowWriter
from deadwood_algorithms.files.geotiff import TILE_CELLS, geotiff_profile
from deadwood_algorithms.files.rasters import describe_band, open_raster
from deadwood_algorithms.params.tool import Cancelled, Feedback, UserError
from deadwood_algorithms.schemas.files import DIFFERENCE

HITS = "hit_count.tif"
ROWS_AT_ONCE = 2 * TILE_CELLS
SAME_PLACE_CELLS = 0.01


def difference_map(one: Scenario, other: Scenario, path: Path, feedback: Feedback) -> None:
    """Write how much more likely a log is to pass each cell in ``other`` than in ``one``; NaN where none passes in
    either.

    Band 1 is the difference of the shares of logs; band 2 the same in standard errors, as if the two runs were
    independent, which they are not: a difference beyond +-2 is hardly due to chance.
    """
    logs = [len(each.run.deposits) for each in (one, other)]
    with open_raster(one.run.part(HITS), "hits") as a, open_raster(other.run.part(HITS), "hits") as b:
        transform, shape = frame_of_both(a, b)
        crs = one.run.grid.crs
        profile = geotiff_profile(shape, crs, transform, "float32", math.nan, 2) | {"SPARSE_OK": True}
        with WindowWriter(path, feedback, **profile) as writer:
            for start in range(0, shape[0], ROWS_AT_ONCE):
                if feedback.cancelled():
                    raise Cancelled
                window = Window(0, start, shape[1], min(ROWS_AT_ONCE, shape[0] - start))  # type: ignore[call-arg]
                p, q = (counts_on(each, transform, window) / n for each, n in zip((a, b), logs, strict=True))
                bands = difference_of(p, q, logs[0], logs[1])
                if np.isfinite(bands[0]).any():
                    writer.write(bands, window)
                feedback.progress(start + window.height, shape[0], f"mapping {other.name} against {one.name}")
            about = f"Share of the logs that pass, {other.name} minus {one.name}"
            describe_band(writer.target, 1, "difference", meaning=about)
            describe_band(writer.target, 2, "standard_errors", meaning=f"{about}, in standard errors of unpaired runs")
            writer.target.set_band_unit(1, "1")
    styles.store_beside(path, styles.of_raster(DIFFERENCE.look))


def difference_of(p: NDArray, q: NDArray, n: int, m: int) -> NDArray[np.float32]:
    """Share q of m logs minus share p of n, and that in standard errors; shape (2, ny, nx)."""
    error = np.sqrt(p * (1.0 - p) / n + q * (1.0 - q) / m)
    bands = np.stack([q - p, (q - p) / np.where(error > 0.0, error, np.nan)])
    bands[0][(p == 0.0) & (q == 0.0)] = np.nan
    bands[np.isnan(bands)] = np.nan  # one NaN, as read back from a tile that was not written
    return bands.astype(np.float32)


def frame_of_both(a: rasterio.DatasetReader, b: rasterio.DatasetReader) -> tuple[Affine, tuple[int, int]]:
    """The smallest north-up grid that holds both; ``UserError`` when their cells do not lie on one another."""
    cell = a.transform.a
    shift = [(b.transform.c - a.transform.c) / cell, (b.transform.f - a.transform.f) / cell]
    if not math.isclose(cell, b.transform.a, rel_tol=1e-9):
        raise UserError(f"{b.name}: its cells of {b.transform.a:g} m are not those of {a.name} ({cell:g} m)")
    if max(abs(each - round(each)) for each in shift) > SAME_PLACE_CELLS:
        raise UserError(f"{b.name}: its cells are not aligned with those of {a.name}")
    west, north = (round(each) for each in shift)
    left, top = min(0, west), max(0, north)
    right, bottom = max(a.width, west + b.width), min(-a.height, north - b.height)
    return a.transform * Affine.translation(left, -top), (top - bottom, right - left)


def counts_on(source: rasterio.DatasetReader, transform: Affine, window: Window) -> NDArray[np.float64]:
    """Hit counts of a window of another, aligned grid; 0 beyond the raster."""
    column = round((source.transform.c - transform.c) / transform.a)
    row = round((transform.f - source.transform.f) / transform.a)
    out = np.zeros((window.height, window.width))
    low_j, high_j = max(window.row_off, row), min(window.row_off + window.height, row + source.height)
    low_i, high_i = max(window.col_off, column), min(window.col_off + window.width, column + source.width)
    if low_j < high_j and low_i < high_i:
        part = Window(low_i - column, low_j - row, high_i - low_i, high_j - low_j)  # type: ignore[call-arg]
        try:
            counts = source.read(1, window=part)
        except RasterioError as error:
            raise UserError(f"{source.name}: the raster is damaged; run slide-logs again") from error
        out[low_j - window.row_off : high_j - window.row_off, low_i - window.col_off : high_i - window.col_off] = counts
    return out


def moved_frame(compared: Compared) -> geopandas.GeoDataFrame:
    """One line for each log and scenario, from its deposit in the reference to its deposit in the scenario."""
    one = compared.reference
    frames = []
    for each in compared.others:
        ends = np.stack([one.places, each.places], axis=1)
        columns = {
            "scenario": each.name,
            "log_id": compared.log_id,
            "release_id": one.column("release_id"),
            "moved_m": np.hypot(*(ends[:, 1] - ends[:, 0]).T),
            "runout_change_m": each.column("runout_m") - one.column("runout_m"),
            "stop_reason_reference": one.column("stop_reason"),
            "stop_reason": each.column("stop_reason"),
        }
        frames.append(geopandas.GeoDataFrame(columns, geometry=shapely.linestrings(ends), crs=one.run.deposits.crs))
    return geopandas.GeoDataFrame(pandas.concat(frames, ignore_index=True), crs=one.run.deposits.crs)


def changed_frame(compared: Compared) -> geopandas.GeoDataFrame:
    """The logs that reach a line in one of two scenarios only, drawn where they were released."""
    one = compared.reference
    columns: dict[str, list] = {name: [] for name in ("scenario", "line_id", "log_id", "release_id", "reached_in")}
    rows: list[int] = []
    for each in compared.others:
        for k, line_id in enumerate(compared.line_ids):
            for word, chosen in (
                ("reference only", one.reach & ~each.reach),
                ("scenario only", each.reach & ~one.reach),
            ):
                logs = np.flatnonzero(chosen[:, k])
                rows += logs.tolist()
                facts = (each.name, line_id, None, None, word)
                for name, value in zip(columns, facts, strict=True):
                    columns[name] += [value] * logs.size
    columns["log_id"] = compared.log_id[rows].tolist()
    columns["release_id"] = one.column("release_id")[rows].tolist()
    points = shapely.points(one.column("release_x")[rows], one.column("release_y")[rows])
    return geopandas.GeoDataFrame(columns, geometry=points, crs=one.run.deposits.crs)
