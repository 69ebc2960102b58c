"""The rasters of several runs on one terrain model as those of one run over all their logs.

Counts are added, maxima are the largest, shares are recomputed over all logs; danger is added from `danger_count.tif`.
If one run over all the logs is possible, it gives the same values.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
from numpy.typing import NDArray
from rasterio.windows import Window

from deadwood_algorithms.files import styles
from deadwood_algorithms.files.dem_blocks import WHOLE_CELLS
from deadwood_algorithms.files.dem_windows import WindowWriter
from deadwood_algorithms.files.geotiff import TILE_CELLS, geotiff_profile
from deadwood_algorithms.files.grid import Grid, Part
from deadwood_algorithms.files.rasters import describe_band
from deadwood_algorithms.params.tool import Cancelled, Feedback, UserError
from deadwood_algorithms.results.danger import ANY, COUNT, danger_bands, units_of
from deadwood_algorithms.results.maps import (
    MAPS,
    bands_of,
    nodata_of,
    shares_of,
    write_danger,
    write_maps,
)
from deadwood_algorithms.results.run_folder import read_manifest
from deadwood_algorithms.schemas.files import DANGER

COUNTS = ("hit_count", "deposit_count")
# File and band of each quantity
MAXIMA = {
    each: (name, number)
    for name, *_ in MAPS
    if name.endswith("_max")
    for number, each in enumerate(bands_of(name), start=1)
}
DANGER_COUNT = "danger_count.tif"


@dataclass(frozen=True)
class MergedRun:
    """One run to be merged: its folder, how many logs it slid, its grid without values, the name of that grid, and the
    digest of its releases."""

    folder: Path
    logs: int
    grid: Grid
    terrain: str
    releases: str


def pieces_by_grid(runs: Sequence[tuple[Path, int]]) -> list[list[MergedRun]]:
    """The runs, each with its number of logs, by the terrain model's cells that they are on."""
    found: dict[tuple[Any, ...], list[MergedRun]] = {}
    for folder, logs in runs:
        manifest, grid = read_manifest(folder)
        key = (grid.shape, grid.cell, grid.x0, grid.y0, grid.crs.to_wkt())
        terrain = Path(str(manifest["parameters"]["dem"])).stem
        found.setdefault(key, []).append(MergedRun(folder, logs, grid, terrain, manifest["digests"]["releases"]))
    return list(found.values())


def scenarios_in(pieces: Sequence[MergedRun]) -> list[str]:
    """Names of runs that slid exactly the logs of another one: scenarios, which must not be added."""
    first: dict[str, str] = {}
    return [
        each.folder.name for each in pieces if first.setdefault(each.releases, each.folder.name) != each.folder.name
    ]


def merge(folder: Path, pieces: Sequence[MergedRun], danger_least: int, feedback: Feedback) -> dict[str, str]:
    """Write the merged rasters into a new folder."""
    frame = pieces[0].grid
    parts = [stored_part(each) for each in pieces]
    lines, logs = lines_of_all(pieces), sum(each.logs for each in pieces)
    whole = parts[0]
    for other in parts[1:]:
        whole = whole.joined(other)
    folder.mkdir(parents=True)
    if whole.cells > WHOLE_CELLS:
        return _merge_by_windows(folder, pieces, parts, lines, danger_least, feedback)
    total, outside = merged_values(pieces, parts, whole, lines)
    feedback.progress(1, 2, "merging the rasters")
    values = np.where(outside, np.float32(np.nan), np.float32(0.0))
    in_full = whole == frame.part
    grid = Grid(values, frame.cell, frame.x0, frame.y0, frame.crs) if in_full else frame.window(whole, values)
    written = write_maps(folder, total, grid, logs)
    if lines:
        written["danger"] = write_danger(folder, total["hit_count"], total["danger"], grid, lines, danger_least)
    feedback.progress(2, 2, "merging the rasters")
    return written


def merged_values(
    pieces: Sequence[MergedRun], parts: Sequence[Part], window: Part, lines: Sequence[str]
) -> tuple[dict[str, NDArray], NDArray[np.bool_]]:
    """Values of all runs on a window (row 0 south), energies in kJ, and the cells without ground."""
    shape = window.rows, window.columns
    total: dict[str, NDArray] = {name: np.zeros(shape, np.uint32) for name in COUNTS}
    total |= {name: np.full(shape, np.nan, np.float32) for name in MAXIMA}
    if lines:
        total["danger"] = np.zeros((len(lines) + 1, *shape), np.uint32)
    outside = np.zeros(shape, bool)
    for piece, stored in zip(pieces, parts, strict=True):
        own = shared_part(stored, window)
        if own is None:
            continue
        rows = slice(own.row - window.row, own.row - window.row + own.rows)
        columns = slice(own.column - window.column, own.column - window.column + own.columns)
        for name in COUNTS:
            total[name][rows, columns] += band_of(piece, f"{name}.tif", own)
        for name, (file, number) in MAXIMA.items():
            here = total[name][rows, columns]
            np.fmax(here, band_of(piece, f"{file}.tif", own, number), out=here)
        outside[rows, columns] |= np.isnan(band_of(piece, "reach_probability.tif", own))
        for number in range(len(lines) + 1 if lines else 0):
            total["danger"][number, rows, columns] += band_of(piece, DANGER_COUNT, own, number + 1)
    return total, outside


def shared_part(one: Part, other: Part) -> Part | None:
    """The intersection of two windows; None if it is empty."""
    column, row = max(one.column, other.column), max(one.row, other.row)
    columns = min(one.column + one.columns, other.column + other.columns) - column
    rows = min(one.row + one.rows, other.row + other.rows) - row
    return Part(column, row, columns, rows) if columns > 0 and rows > 0 else None


def _merge_by_windows(
    folder: Path,
    pieces: Sequence[MergedRun],
    parts: Sequence[Part],
    lines: Sequence[str],
    danger_least: int,
    feedback: Feedback,
) -> dict[str, str]:
    """The same for runs too far apart to be held at once: tile by tile, only tiles that any run has stored."""
    frame, logs = pieces[0].grid, sum(each.logs for each in pieces)
    named = {name: bands_of(name) for name, *_ in MAPS}
    rows = {name: (kind, [units] * len(named[name]), named[name], style) for name, kind, units, style in MAPS}
    if lines:
        names = [ANY, COUNT, *lines]
        rows["danger"] = ("float32", units_of(names), names, DANGER.look)
    largest = dict.fromkeys(rows, 0.0)
    windows = touched_tiles(parts, frame.shape)
    with ExitStack() as stack:
        writers = {}
        for name, (kind, units, names, _) in rows.items():
            nodata = nodata_of(name, kind, windowed=True)
            profile = geotiff_profile(frame.shape, frame.crs, frame.transform, kind, nodata, len(units))
            profile |= {"SPARSE_OK": True, "interleave": "band"}
            writer = stack.enter_context(WindowWriter(folder / f"{name}.tif", feedback, **profile))
            for number, (unit, each) in enumerate(zip(units, names, strict=True), start=1):
                writer.target.set_band_unit(number, unit)
                describe_band(writer.target, number, each, raster=name)
            writers[name] = writer
        for done, window in enumerate(windows):
            if feedback.cancelled():
                raise Cancelled
            total, outside = merged_values(pieces, parts, window, lines)
            values = {**total, "reach_probability": shares_of(total["hit_count"], logs, outside)}
            bands = {name: np.stack([values[each] for each in named[name]]) for name in named}
            if lines:
                found = danger_bands(total["hit_count"], total["danger"], lines, danger_least)
                bands["danger"] = np.stack(list(found.values()))
            top = frame.shape[0] - window.row - window.rows
            place = Window(window.column, top, window.columns, window.rows)  # type: ignore[call-arg]
            for name, stacked in bands.items():
                writers[name].write(np.ascontiguousarray(stacked[:, ::-1]), place)
                if np.isfinite(stacked).any():
                    largest[name] = max(largest[name], float(np.nanmax(stacked)))
            feedback.progress(done + 1, len(windows), "merging the rasters")
    for name, (_, _, _, style) in rows.items():
        styles.store_beside(folder / f"{name}.tif", styles.of_raster(style, np.array([largest[name]])))
    return {name: f"{name}.tif" for name in rows}


def touched_tiles(parts: Sequence[Part], shape: tuple[int, int]) -> list[Part]:
    """The tiles that contain any of these windows, in the order of the file, which counts from its top left corner."""
    ny, nx = shape
    tiles = set()
    for part in parts:
        top = ny - part.row - part.rows
        for row in range(top // TILE_CELLS, (top + part.rows - 1) // TILE_CELLS + 1):
            for column in range(part.column // TILE_CELLS, (part.column + part.columns - 1) // TILE_CELLS + 1):
                tiles.add((row, column))
    found = []
    for row, column in sorted(tiles):
        bottom = min(ny, (row + 1) * TILE_CELLS)
        east = min(nx, (column + 1) * TILE_CELLS)
        found.append(Part(column * TILE_CELLS, ny - bottom, east - column * TILE_CELLS, bottom - row * TILE_CELLS))
    return found


def lines_of_all(pieces: Sequence[MergedRun]) -> list[str]:
    """The lines whose danger every run has counted; none if they are not the same in all runs."""
    found = [danger_lines_of(each.folder) for each in pieces]
    return found[0] if all(each == found[0] for each in found) else []


def danger_lines_of(folder: Path) -> list[str]:
    place = folder / DANGER_COUNT
    if not place.is_file():
        return []
    with rasterio.open(place) as source:
        names = [str(each) for each in source.descriptions]
    if names[0] != ANY:
        raise UserError(f"{place}: not written by this version")
    return names[1:]


def stored_part(piece: MergedRun) -> Part:
    """The part of the grid that a run's rasters store: of a large terrain model, the window that its logs needed."""
    whole = piece.grid.part
    if whole.cells <= WHOLE_CELLS:
        return whole
    with rasterio.open(piece.folder / "reach_probability.tif") as source:
        high, wide = source.block_shapes[0]
        ny, nx = source.shape
        stored = [
            (row, column)
            for row in range(-(-ny // high))
            for column in range(-(-nx // wide))
            if source.get_tag_item(f"BLOCK_OFFSET_{column}_{row}", "TIFF", bidx=1)
        ]
    if not stored:
        return Part(0, 0, wide, high).cut_to(piece.grid.shape)
    (top, left), (bottom, right) = np.min(stored, axis=0), np.max(stored, axis=0) + 1
    first = ny - int(bottom) * high  # rows count from the south
    return Part(int(left) * wide, first, int(right - left) * wide, int(bottom - top) * high).cut_to((ny, nx))


def band_of(piece: MergedRun, name: str, part: Part, number: int = 1) -> NDArray[Any]:
    """A part of a run's raster, row 0 south."""
    top = piece.grid.shape[0] - part.row - part.rows
    with rasterio.open(piece.folder / name) as source:
        window = Window(part.column, top, part.columns, part.rows)  # type: ignore[call-arg]
        return source.read(number, window=window)[::-1]
