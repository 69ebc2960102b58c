"""From layers to the engine's arrays: a `Scene` from DEM, trees, barriers, lines and friction.

Here centimetres become metres, and what makes no sense together is refused in one line: lines off the DEM, friction
that does not cover it, trees in another country. What a scene lacks becomes an empty array, never None.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.dem_reach import WHOLE_CELLS, watched_sides
from deadwood_algorithms.friction import read_friction
from deadwood_algorithms.layers import (
    Grid,
    id_column,
    number_column,
    read_dem,
    read_vector,
    warn_implausible,
    where_of,
)
from deadwood_algorithms.schemas import (
    TREES,
)
from deadwood_algorithms.tool import Feedback, UserError
from deadwood_engine import Barriers, Lines, LyingLogs, Scene, Shape, Trees

if TYPE_CHECKING:
    import geopandas

    from deadwood_engine.result import Result

ROWS_NAMED = 5  # an error names so many rows, then counts the rest


@dataclass(frozen=True)
class Paths:
    """Lines as the engine takes them; several paths (parts, rings) may belong to one item of the layer."""

    vertices: NDArray[np.float64]
    starts: NDArray[np.int64]
    item: NDArray[np.int64]


@dataclass(frozen=True)
class Items:
    """The things of a layer that results are counted for: ids, geometries (one each), and the engine's rows."""

    ids: list[Any]
    geometry: NDArray[Any]
    item: NDArray[np.int64]  # of each row of the engine

    def any_row(self, by_row: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """From (n, rows) to (n, items): true where any row of the item is."""
        out = np.zeros((by_row.shape[0], len(self.ids)), bool)
        for row, item in enumerate(self.item):
            out[:, item] |= by_row[:, row]
        return out

    def first_time(self, by_row: NDArray[np.float64]) -> NDArray[np.float64]:
        """From (n, rows) to (n, items): the earliest time, NaN where there is none."""
        out = np.full((by_row.shape[0], len(self.ids)), np.nan)
        for row, item in enumerate(self.item):
            out[:, item] = np.fmin(out[:, item], by_row[:, row])
        return out


@dataclass(frozen=True)
class SceneLayers:
    """A prepared scene, and what its arrays are called in the layers."""

    dem: Grid
    scene: Scene
    friction: float | NDArray[np.float64]
    trees: Trees
    tree_ids: list[str]
    trees_left_out: int  # they stand off the DEM
    barriers: Items
    lines: Items
    lying_logs: LyingLogs
    lying: Items
    digest: str  # of every array that went into the scene
    watched: tuple[str, ...] = ()  # sides of the DEM's window that the engine's last lines watch, behind the layer's
    threads: int = 1  # as many as were asked for, or as there is memory for
    shape: Shape | None = None  # what slides in the logs' place

    def escaped(self, result: Result) -> list[str]:
        """The sides of the window that some log came too near to; they must be slid again in a wider one."""
        count = result.reach.shape[1] - len(self.watched)
        return [side for k, side in enumerate(self.watched) if result.reach[:, count + k].any()]

    def without_watch(self, result: Result) -> Result:
        """The result for the lines of the layer alone."""
        count = result.reach.shape[1] - len(self.watched)
        return replace(result, reach=result.reach[:, :count], reach_time=result.reach_time[:, :count])


def read_scene(
    dem: str,
    friction: str | float,
    trees: str | None,
    barriers: str | None,
    lines: str | None,
    *,
    crs: str | None,
    feedback: Feedback,
    lying_logs: str | None = None,
    lying_diameter_cm: float = 40.0,
    friction_column: str | None = None,
    friction_elsewhere: float | None = None,
    grid: Grid | None = None,
) -> SceneLayers:
    """Read and check every layer but the releases, and prepare the engine's scene.

    ``grid`` is the DEM, or a window of it, where that has been read already.
    """
    from deadwood_algorithms.lying_from_layer import read_lying_logs

    grid = grid or read_dem(dem, crs=crs, feedback=feedback)
    mu = read_friction(friction, grid, feedback, column=friction_column, elsewhere=friction_elsewhere)
    standing, tree_ids, left_out = read_trees(trees, grid, feedback)
    plates, barrier_items = read_barriers(barriers, grid, feedback)
    marks, line_items = read_lines(lines, grid, feedback)
    lying, lying_items = read_lying_logs(lying_logs, grid, lying_diameter_cm, feedback)
    # A lying log rests on all the terrain below it, so none that is cut by the window's side may be met.
    watched = watched_sides(grid, beyond_m=_longest(lying))
    frame = grid.frame
    scene = Scene.prepare(
        grid.values,
        grid.cell,
        frame.x0,
        frame.y0,
        friction=mu,
        trees=standing,
        barriers=plates,
        lines=_with_more(marks, list(watched.values())),
        lying_logs=lying,
        first=grid.first,
        reference=0.0 if frame.part.cells > WHOLE_CELLS else None,  # a large DEM's lowest height is never looked for
    )
    digest = digest_of(grid.values, [grid.cell, grid.x0, grid.y0], mu, standing, plates, marks, lying)
    return SceneLayers(
        grid,
        scene,
        mu,
        standing,
        tree_ids,
        left_out,
        barrier_items,
        line_items,
        lying,
        lying_items,
        digest,
        tuple(watched),
    )


def _longest(lying: LyingLogs) -> float:
    """How far [m] the farthest two vertices of a lying log's line are apart, at most."""
    lines = zip(lying.starts[:-1], lying.starts[1:], strict=True)
    return max((float(np.ptp(lying.vertices[a:b], axis=0).sum()) for a, b in lines), default=0.0)


def _with_more(lines: Lines, more: list[NDArray[np.float64]]) -> Lines:
    """The lines, and further ones behind them."""
    sizes = np.array([len(each) for each in more], np.int64)
    starts = np.concatenate([lines.starts, lines.starts[-1] + np.cumsum(sizes)])
    return Lines(np.vstack([lines.vertices.reshape(-1, 2), *more]), starts)


def read_trees(path: str | None, grid: Grid, feedback: Feedback) -> tuple[Trees, list[str], int]:
    """Standing trees on the DEM, their ids as text, and how many stand off it and are left out: no log meets them."""
    if path is None:
        return Trees.none(), [], 0
    frame = read_vector(path, geometry=("point",), target_crs=grid.crs, what="trees", feedback=feedback)
    for name in ("dbh_cm", "height_m"):
        if name not in frame:
            raise UserError(
                f"{where_of(frame)}: the trees have no field '{name}'; "
                "deadwood-tool import-trees makes a trees layer of any table"
            )
    dbh_cm = number_column(frame, "dbh_cm", minimum=0.0, exclusive=True)
    height = number_column(frame, "height_m", minimum=0.0, exclusive=True)
    for name, values in (("dbh_cm", dbh_cm), ("height_m", height)):
        warn_implausible(values, TREES.column(name), where_of(frame), feedback)
    x, y = plan_of(frame)
    # Of a large DEM only a window is known, and that may grow: a tree keeps its row whatever the window, and the engine
    # leaves out those without terrain.
    on = grid.contains(x, y) if grid.whole is None else shapely.contains_xy(shapely.box(*grid.frame.bounds), x, y)
    if not on.any():
        raise UserError(f"{path}: none of the {len(frame)} trees stands on the DEM{extents(x, y, grid)}")
    if not on.all():
        feedback.note(f"{path}: {np.count_nonzero(~on)} of {len(frame)} trees stand off the DEM and are left out")
    ids = ids_of(frame, "tree_id")[on]
    return Trees(x[on], y[on], dbh_cm[on] / 100.0, height[on]), [str(each) for each in ids], int(np.count_nonzero(~on))


def read_barriers(path: str | None, grid: Grid, feedback: Feedback) -> tuple[Barriers, Items]:
    """Barriers with their heights; rows of one barrier_id count as one barrier."""
    if path is None:
        return Barriers.none(), Items([], np.array([], object), np.array([], np.int64))
    frame = read_vector(path, geometry=("line",), target_crs=grid.crs, what="barriers", feedback=feedback)
    height = number_column(frame, "height_m", minimum=0.0, exclusive=True)
    paths = paths_of(frame, grid, "barrier")
    items = items_of(frame, ("barrier_id", "name"), paths)
    return Barriers(paths.vertices, paths.starts, height[paths.item]), items


def read_lines(path: str | None, grid: Grid, feedback: Feedback) -> tuple[Lines, Items]:
    """Lines, or the outlines of polygons, whose reach is counted; rows of one line_id count as one line."""
    if path is None:
        return Lines.none(), Items([], np.array([], object), np.array([], np.int64))
    frame = read_vector(path, geometry=("line", "polygon"), target_crs=grid.crs, what="lines", feedback=feedback)
    paths = paths_of(frame, grid, "line")
    return Lines(paths.vertices, paths.starts), items_of(frame, ("line_id", "name"), paths)


def paths_of(frame: geopandas.GeoDataFrame, grid: Grid, what: str) -> Paths:
    """Parts and rings of line and polygon rows as polylines; a row off the grid or without length is refused."""
    geometry = np.asarray(frame.geometry)
    missing = np.flatnonzero(~shapely.intersects(geometry, shapely.box(*grid.frame.bounds)))
    if missing.size:
        x, y = shapely.get_coordinates(geometry[missing[0]]).T
        raise UserError(
            f"{where_of(frame)}, {rows_named(missing)}: the {what} does not touch the DEM{extents(x, y, grid)}"
        )
    short = np.flatnonzero(shapely.length(geometry) <= 0.0)
    if short.size:
        raise UserError(f"{where_of(frame)}, {rows_named(short)}: the {what} has no length; delete the row")
    parts, item = shapely.get_parts(geometry, return_index=True)
    filled = shapely.get_type_id(parts) == 3
    rings, owner = shapely.get_rings(parts[filled], return_index=True)
    strings = np.concatenate([parts[~filled], rings])
    item = np.concatenate([item[~filled], item[filled][owner]])
    order = np.argsort(item, kind="stable")
    vertices, string = shapely.get_coordinates(strings[order], return_index=True)
    starts = np.concatenate([[0], np.cumsum(np.bincount(string, minlength=strings.size))]).astype(np.int64)
    return Paths(vertices, starts, item[order].astype(np.int64))


def items_of(frame: geopandas.GeoDataFrame, names: tuple[str, ...], paths: Paths) -> Items:
    """Rows that share an id become one item, in the order of their first row."""
    ids = ids_of(frame, *names).tolist()
    unique = list(dict.fromkeys(ids))
    of_row = np.array([unique.index(each) for each in ids], np.int64)
    geometry = np.asarray(frame.geometry)
    merged = [
        geometry[of_row == k][0] if (of_row == k).sum() == 1 else shapely.union_all(geometry[of_row == k])
        for k in range(len(unique))
    ]
    out = np.empty(len(unique), object)
    out[:] = merged
    return Items(unique, out, of_row[paths.item])


def ids_of(frame: geopandas.GeoDataFrame, *names: str) -> NDArray[Any]:
    """The ids from the first of these fields that the layer has; the row numbers where it has none."""
    name = next((name for name in names if name in frame), None)
    return id_column(frame, name) if name else np.arange(len(frame))


def plan_of(frame: geopandas.GeoDataFrame) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Coordinates of a layer of points [m]."""
    points = np.asarray(frame.geometry)
    return shapely.get_x(points), shapely.get_y(points)


def rows_named(rows: NDArray[Any]) -> str:
    """``row 7`` or ``rows 1, 2, 3, 4, 5 and 12 more``; the first row is row 1."""
    shown = ", ".join(str(int(row) + 1) for row in rows[:ROWS_NAMED])
    more = f" and {rows.size - ROWS_NAMED} more" if rows.size > ROWS_NAMED else ""
    return f"row{'s' if rows.size > 1 else ''} {shown}{more}"


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


def extents(x: NDArray[np.float64], y: NDArray[np.float64], grid: Grid) -> str:
    west, south, east, north = grid.frame.bounds
    return (
        f" ({x.min():.0f} to {x.max():.0f} east, {y.min():.0f} to {y.max():.0f} north; the DEM has {west:.0f} to "
        f"{east:.0f}, {south:.0f} to {north:.0f}); check the CRS of both"
    )
