"""The objects of a layer for which results are counted: ids, geometries, rows, and how messages name them."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.files.accounts import NO_TERRAIN, OFF_DEM, count_of
from deadwood_algorithms.files.columns import id_column, row_numbers, where_of
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.intake.doubts import say
from deadwood_algorithms.intake.places import off_the_ground
from deadwood_algorithms.params.counts import none_of, rows_named
from deadwood_algorithms.params.tool import Feedback, UserError

if TYPE_CHECKING:
    import geopandas
    import pandas

    from deadwood_algorithms.files.dem_blocks import DemBlocks


PIECE_M = 5.0  # of a line whose Z is compared with the ground


@dataclass(frozen=True)
class Paths:
    """Lines in the engine's form; several paths (parts, rings) may belong to one item of the layer."""

    vertices: NDArray[np.float64]
    starts: NDArray[np.int64]
    item: NDArray[np.int64]  # the row of the layer


@dataclass(frozen=True)
class Items:
    """The objects of a layer for which results are counted: ids, geometries (one each), and the engine's rows."""

    ids: list[Any]
    geometry: NDArray[Any]
    item: NDArray[np.int64]  # the item of each row of the engine
    row: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))  # the row of the layer, likewise
    row_count: int = 0  # number of rows of the layer

    def any_row(self, by_row: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """From (n, rows) to (n, items): true where any row of the item is."""
        out = np.zeros((by_row.shape[0], len(self.ids)), bool)
        for row, item in enumerate(self.item):
            out[:, item] |= by_row[:, row]
        return out

    def then(self, more: Items) -> Items:
        """These objects, followed by others."""
        geometry = np.concatenate([self.geometry, more.geometry])
        return Items([*self.ids, *more.ids], geometry, np.concatenate([self.item, more.item + len(self.ids)]))

    def first_time(self, by_row: NDArray[np.float64]) -> NDArray[np.float64]:
        """From (n, rows) to (n, items): the earliest time, NaN if there is none."""
        out = np.full((by_row.shape[0], len(self.ids)), np.nan)
        for row, item in enumerate(self.item):
            out[:, item] = np.fmin(out[:, item], by_row[:, row])
        return out


def paths_of(frame: geopandas.GeoDataFrame, grid: Grid, what: str, feedback: Feedback) -> Paths:
    """Parts and rings of the line and polygon rows that touch the DEM, as polylines; one without length is rejected.

    Rows off the DEM are left out, with a warning; if all are off it, the CRS is wrong or the layer belongs elsewhere.
    """
    geometry = np.asarray(frame.geometry)
    touches = shapely.intersects(geometry, shapely.box(*grid.frame.bounds))
    if not touches.any():
        x, y = shapely.get_coordinates(geometry).T
        raise UserError(f"{where_of(frame)}: {none_of(touches.size, what)} touches the DEM{extent_words(x, y, grid)}")
    say_left_out(frame, ~touches, f"{what}s", feedback.warn)
    short = np.flatnonzero(touches & (shapely.length(geometry) <= 0.0))
    if short.size:
        raise UserError(f"{where_of(frame)}, {rows_named(short)}: the {what} has no length; delete the row")
    rows = np.flatnonzero(touches)
    parts, item = shapely.get_parts(geometry[rows], return_index=True)
    filled = shapely.get_type_id(parts) == 3
    rings, owner = shapely.get_rings(parts[filled], return_index=True)
    strings = np.concatenate([parts[~filled], rings])
    item = np.concatenate([item[~filled], item[filled][owner]])
    order = np.argsort(item, kind="stable")
    vertices, string = shapely.get_coordinates(strings[order], return_index=True)
    starts = np.concatenate([[0], np.cumsum(np.bincount(string, minlength=strings.size))]).astype(np.int64)
    return Paths(vertices, starts, rows[item[order]].astype(np.int64))


def warn_off_the_ground(frame: geopandas.GeoDataFrame, names: tuple[str, ...], grid: Grid, feedback: Feedback) -> None:
    """Warn of lines that by their own Z are not on the ground."""
    lines = np.asarray(frame.geometry)
    if not shapely.has_z(lines).any():
        return
    pieces = shapely.segmentize(lines, max(PIECE_M, grid.cell))
    xyz, row = shapely.get_coordinates(pieces, include_z=True, return_index=True)
    joined = row[1:] == row[:-1]
    middle, item = (0.5 * (xyz[1:] + xyz[:-1]))[joined], row[1:][joined]
    length = np.hypot(*np.diff(xyz[:, :2], axis=0).T)[joined]
    known = ~np.isin(item, np.flatnonzero(np.bincount(row, np.abs(np.nan_to_num(xyz[:, 2]))) == 0.0))  # 0: a missing Z
    above = np.where(known, middle[:, 2] - grid.height(middle[:, 0], middle[:, 1]), np.nan)
    ids = [str(each) for each in ids_of(frame, *names)]
    say(off_the_ground(ids, item, above, length), where_of(frame), feedback)


def items_of(frame: geopandas.GeoDataFrame, names: tuple[str, ...], paths: Paths, feedback: Feedback) -> Items:
    """Rows with paths that share an id become one item, in the order of their first row, with a note.

    The first of ``names`` is the actual id; if another field is used instead, equal values may be different objects.
    """
    rows = np.unique(paths.item)
    ids = ids_of(frame, *names)[rows].tolist()
    place = {each: k for k, each in enumerate(dict.fromkeys(ids))}
    unique, of_row = list(place), np.array([place[each] for each in ids], np.int64)
    named = named_by(frame, names) or ""
    twins = shared_words(frame, named, ids, rows)
    if twins and named == names[0]:
        feedback.note(f"{twins} and count as one", code="same-id")
    elif twins:
        feedback.warn(
            f"{twins} and count as one; to count them separately, give each its own {names[0]}", code="same-id"
        )
    geometry = np.asarray(frame.geometry)[rows]
    merged = [
        geometry[alike[0]] if alike.size == 1 else shapely.union_all(geometry[alike])
        for alike in np.split(np.argsort(of_row, kind="stable"), np.cumsum(np.bincount(of_row))[:-1])
    ]
    out = np.empty(len(unique), object)
    out[:] = merged
    return Items(unique, out, of_row[np.searchsorted(rows, paths.item)], paths.item, len(frame))


def count_of_items(items: Items) -> dict[str, Any]:
    """What became of the rows of a layer of lines: those that have a path are used, the others lie off the DEM."""
    used = np.unique(items.row).size
    return count_of(items.row_count, used, {OFF_DEM: items.row_count - used})


def shared_words(
    frame: geopandas.GeoDataFrame, field: str, ids: list[Any], rows: NDArray[np.intp] | None = None
) -> str:
    """Which rows share an id, in words; empty if each has its own. ``rows`` are the rows of the ids, if not all."""
    count = Counter(ids)
    twins = next((each for each in ids if count[each] > 1), None)
    if twins is None:
        return ""
    alike = np.array([k for k, each in enumerate(ids) if each == twins])
    called = rows_named(alike if rows is None else rows[alike])
    more = sum(times for times in count.values() if times > 1) - count[twins]
    text = f"{where_of(frame)}, field '{field}': {called} are called '{twins}'"
    return text + (f", {more} more share other names" if more else "")


def ids_of(frame: geopandas.GeoDataFrame, *names: str) -> NDArray[Any]:
    """The ids from the first of these fields that the layer has; the row numbers, from 1, if it has none.

    A row without a ``name`` (a road without a name on the map) is called by its number: row 7.
    """
    name = named_by(frame, names)
    if name and name.lower() == "name":
        blank = np.asarray(frame[name].isna() | (frame[name].astype(str).str.strip() == ""))
        if blank.any():
            called = frame[name].astype(object).where(~blank, [f"row {row}" for row in row_numbers(frame)])
            return called.to_numpy()
    return id_column(frame, name) if name else row_numbers(frame)


def named_by(frame: pandas.DataFrame, names: tuple[str, ...]) -> str | None:
    """The first of these fields that a layer has; Name and NAME are the field name."""
    there = {str(each).lower(): str(each) for each in reversed(frame.columns)}
    return next((name if name in frame else there[name] for name in names if name in there), None)


def plan_of(frame: geopandas.GeoDataFrame) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Coordinates of a layer of points [m]."""
    points = np.asarray(frame.geometry)
    return shapely.get_x(points), shapely.get_y(points)


def points_on(grid: Grid, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which points lie on the DEM.

    Of a large DEM only a window is known, which may grow: an object keeps its row whatever the window, and the engine
    leaves out those without terrain.
    """
    return grid.contains(x, y) if grid.whole is None else shapely.contains_xy(shapely.box(*grid.frame.bounds), x, y)


def why_left_out(grid: Grid | DemBlocks, x: NDArray[np.float64], y: NDArray[np.float64]) -> Counter[str]:
    """How many of the points that are not on the DEM are beyond it, and how many are where it has no height."""
    within = int(np.sum(shapely.contains_xy(shapely.box(*grid.frame.bounds), x, y)))
    return Counter({OFF_DEM: x.size - within, NO_TERRAIN: within})


def say_left_out(frame: geopandas.GeoDataFrame, off: NDArray[np.bool_], what: str, say: Callable[[str], None]) -> None:
    """Name the rows of a layer that have no part in the run because they lie off the DEM.

    say : a warning for structures and roads; a note for trees and boulders, whose layers cover whole regions
    """
    rows = np.flatnonzero(off)
    if rows.size:
        verb = "lies off the DEM and is" if rows.size == 1 else "lie off the DEM and are"
        say(f"{where_of(frame)}, {rows_named(rows)}: {rows.size} of {off.size} {what} {verb} left out")


def digest_of(*parts: Any) -> str:
    """Fingerprint of numbers, arrays, and tuples or dataclasses of them."""
    digest = hashlib.blake2b(digest_size=16)
    for part in parts:
        if isinstance(part, tuple) or is_dataclass(part):
            members = part if isinstance(part, tuple) else tuple(getattr(part, each.name) for each in fields(part))
            digest.update(digest_of(*members).encode())
            continue
        array = np.ascontiguousarray(part)
        array = array.astype("U") if array.dtype.kind == "O" else array
        digest.update(f"{array.dtype.str}{array.shape}".encode())
        digest.update(array.view(np.uint8).data if array.size else b"")
    return digest.hexdigest()


def extent_words(x: NDArray[np.float64], y: NDArray[np.float64], ground: Grid | DemBlocks) -> str:
    """Where the objects that are not on the DEM are, where the DEM is, and the usual mistake if it explains this."""
    from deadwood_algorithms.files.crs import misplacement

    west, south, east, north = ground.frame.bounds
    fix = misplacement(x, y, (west, south, east, north), ground.crs) or "check the CRS of both"
    return (
        f" ({x.min():.0f} to {x.max():.0f} east, {y.min():.0f} to {y.max():.0f} north; the DEM has {west:.0f} to "
        f"{east:.0f}, {south:.0f} to {north:.0f}); {fix}"
    )
