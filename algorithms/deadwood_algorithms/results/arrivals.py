"""Arrivals at lines and polygons, from stored trajectories, and where their logs came from, for `reach-lines`.

An arrival is the moment at which any part of the log's outline in plan first touches the line or the polygon's outline:
between the first pose at which it does and the one before, the log moves uniformly. A log that starts inside a polygon
arrives with its first pose.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import geopandas
import numpy as np
import pandas
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.params.tool import Cancelled, Feedback
from deadwood_algorithms.results.edges import Edges
from deadwood_algorithms.results.lost import share_if_lost
from deadwood_algorithms.results.motion import bodies_of, energies_kj, path_so_far, travel
from deadwood_algorithms.results.run_folder import Run, ends_of
from deadwood_algorithms.scene.items import Items
from deadwood_algorithms.stats.directions import azimuth
from deadwood_algorithms.stats.endings import left_dem
from deadwood_algorithms.stats.order_statistics import missing, quantiles
from deadwood_engine import Lines, segments_of, sweep_touches

Array = NDArray[np.float64]
HALVINGS = 6  # of the way between two poses, 1.5 m on cells of 0.5 m: 2 cm
STATIONS = 41  # places along a log at which its height above a line is evaluated
POSE_FACTS = ("t_s", "path_m", *"xyz", "speed_ms", "clearance_m", "xb", "yb", "zb", "xt", "yt", "zt")


@dataclass(frozen=True)
class Arrived:
    """One row for each log and line that it reached, by line, then log (``line``, ``log``: rows of items, logs).

    near_edge : bool, by log of the deposits: its stored path came near an edge of the terrain
    """

    table: pandas.DataFrame
    near_edge: NDArray[np.bool_]

    def reached(self, n_logs: int, n_lines: int) -> NDArray[np.bool_]:
        out = np.zeros((n_logs, n_lines), bool)
        out[self.table["log"], self.table["line"]] = True
        return out


def find_arrivals(
    source: Run, lines: Lines, items: Items, edges: Edges | None, edge_m: float, feedback: Feedback
) -> Arrived:
    """Follow the stored trajectories, piece by piece; without ``edges``, no log counts as near an edge."""
    bodies = bodies_of(source)
    near_edge = np.zeros(len(source.deposits), bool)
    pieces: list[dict[str, NDArray]] = []
    done = 0
    for piece in source.poses(source.stored_log_ids):
        if feedback.cancelled():
            raise Cancelled
        if edges:
            near_edge[piece["log_row"][edges.near(piece["x"], piece["y"], edge_m)]] = True
        first = first_touches(piece, lines, items, source.radii(), (source.grid.x0, source.grid.y0))
        log, line = np.nonzero(first >= 0)
        pose = first[log, line]
        piece["path_m"] = path_so_far(piece)
        piece["energy_kj"], piece["rotation_kj"] = energies_kj(piece, bodies)
        before, share = touch_between(piece, pose, items.geometry[line], *(each[log] for each in source.radii()))
        towards = travel(piece, pose)
        pieces.append(
            {"log": log, "line": line, "dx": towards[:, 0], "dy": towards[:, 1]}
            | {name: between(piece[name], before, pose, share) for name in (*POSE_FACTS, "energy_kj", "rotation_kj")}
        )
        done += np.unique(piece["log_id"]).size
        feedback.progress(done, source.stored_log_ids.size, "following trajectories")
    table = pandas.DataFrame({name: np.concatenate([each[name] for each in pieces]) for name in pieces[0]})
    return Arrived(table.sort_values(["line", "log"], kind="stable", ignore_index=True), near_edge)


def first_touches(
    piece: Mapping[str, NDArray], lines: Lines, items: Items, radii: tuple[Array, Array], origin: tuple[float, float]
) -> NDArray[np.int64]:
    """Row in ``piece`` of the first pose of each log that touches each item, -1 for none; shape (n_logs, n_items).

    radii : of base and tip of each log [m]; origin : [m] of the coordinates in which it is computed
    """
    base, tip = ends_of(piece)
    _, pose = sweep_touches(piece["log_row"], base, tip, *radii, segments_of(lines, *origin))
    none = np.iinfo(np.int64).max
    first = np.full((len(radii[0]), len(items.ids)), none)
    for row, item in enumerate(items.item):
        first[:, item] = np.minimum(first[:, item], np.where(pose[:, row] < 0, none, pose[:, row]))
    starts = np.flatnonzero(np.diff(piece["log_row"], prepend=-1))
    for column, shape in enumerate(items.geometry):
        if shapely.get_dimensions(shape) == 2:
            inside = starts[shapely.contains_xy(shape, piece["x"][starts], piece["y"][starts])]
            first[piece["log_row"][inside], column] = inside
    return np.where(first == none, -1, first)


def touch_between(
    piece: Mapping[str, NDArray], pose: NDArray[np.int64], shapes: NDArray[Any], base_radius: Array, tip_radius: Array
) -> tuple[NDArray[np.int64], Array]:
    """The pose before each of these, at which a log touches its shape, and the share of the way at which it begins to.

    Of a log's first pose, which has none before, the share is 1.
    """
    before = np.maximum(pose - 1, 0)
    before = np.where(piece["log_row"][before] == piece["log_row"][pose], before, pose)
    outlines = np.array([_outline(shape) for shape in shapes], object)
    low, high = np.zeros(pose.size), np.ones(pose.size)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        ends = np.stack([between(piece[name], before, pose, middle) for name in ("xb", "yb", "xt", "yt")], axis=1)
        axes = shapely.linestrings(ends.reshape(-1, 2, 2))
        near = shapely.get_coordinates(shapely.shortest_line(axes, outlines)).reshape(-1, 2, 2)
        length = np.maximum(np.hypot(*(ends[:, 2:] - ends[:, :2]).T), 1e-9)
        along = np.minimum(np.hypot(*(near[:, 0] - ends[:, :2]).T) / length, 1.0)
        touches = np.hypot(*(near[:, 1] - near[:, 0]).T) <= base_radius + along * (tip_radius - base_radius)
        low, high = np.where(touches, low, middle), np.where(touches, middle, high)
    return before, np.where(before == pose, 1.0, high)


def between(values: NDArray, before: NDArray[np.int64], after: NDArray[np.int64], share: Array) -> Array:
    """Values of poses at a share of the way from one to another; beyond 1 the motion goes on uniformly."""
    first = values[before].astype(np.float64)
    return first + share * (values[after] - first)


def heights_over(
    table: Mapping[str, Any] | pandas.DataFrame,
    shape: Any,
    radii: tuple[Array, Array],
    ground: Callable[[Array, Array], Array],
) -> Array:
    """Height above the terrain of the top of each log where it touches a line [m], which a barrier there would need.

    The log is evaluated at `STATIONS` places along its axis: those whose plan outline touches the line, or the
    nearest one, count with their upper edge.
    """
    share = np.linspace(0.0, 1.0, STATIONS)
    row = np.asarray(table["log"])
    base, tip = (np.stack([np.asarray(table[f"{axis}{end}"], np.float64) for axis in "xyz"], axis=1) for end in "bt")
    places = base[:, None, :] + share[None, :, None] * (tip - base)[:, None, :]
    thick = radii[0][row][:, None] + share[None, :] * (radii[1] - radii[0])[row][:, None]
    axis = (tip - base) / np.linalg.norm(tip - base, axis=1)[:, None]
    line = shape.boundary if shapely.get_dimensions(shape) == 2 else shape
    apart = shapely.distance(shapely.points(places[..., 0], places[..., 1]), line) - thick
    touching = apart <= np.maximum(apart.min(axis=1), 0.0)[:, None]
    x, y = places[..., 0].ravel(), places[..., 1].ravel()
    below = ground(x, y).reshape(apart.shape)
    top = places[..., 2] + thick * np.sqrt(np.maximum(1.0 - axis[:, 2:3] ** 2, 0.0)) - below
    return np.where(touching & np.isfinite(top), top, -np.inf).max(axis=1, initial=-np.inf)


def arrivals_frame(source: Run, arrived: Arrived, items: Items, edges: Edges) -> geopandas.GeoDataFrame:
    """The arrivals as a layer: a point at the log's centre of mass at that time, and how it arrived."""
    table = arrived.table
    of_log = source.deposits.iloc[table["log"].to_numpy()]
    x, y, z = (table[name].to_numpy() for name in "xyz")
    touched = touch_places(table, items)
    angle = travel_angles(table, items, touched)
    columns = {
        "log_id": of_log["log_id"].to_numpy(),
        "release_id": of_log["release_id"].to_numpy(),
        "line_id": np.array(items.ids)[table["line"].to_numpy()],
        "t_s": table["t_s"].to_numpy(),
        "path_m": table["path_m"].to_numpy(),
        "speed_ms": table["speed_ms"].to_numpy(np.float64),
        "energy_kj": table["energy_kj"].to_numpy(),
        "rotation_kj": table["rotation_kj"].to_numpy(),
        "clearance_m": table["clearance_m"].to_numpy(np.float64),
        "height_m": z - edges.heights(x, y),
        "azimuth_deg": angle["azimuth_deg"],
        "impact_deg": angle["impact_deg"],
        "axis_deg": angle["axis_deg"],
        "touch_x": touched[:, 0],
        "touch_y": touched[:, 1],
        "release_x": of_log["release_x"].to_numpy(),
        "release_y": of_log["release_y"].to_numpy(),
        "stop_reason": of_log["stop_reason"].to_numpy(),
    }
    points = shapely.points(np.column_stack([x, y, z]))
    return geopandas.GeoDataFrame(columns, geometry=points, crs=source.deposits.crs)


def touch_places(table: pandas.DataFrame, items: Items) -> NDArray[np.float64]:
    """Where on the line or outline each arrival is: the place nearest to the log's axis then, shape (k, 2) [m]."""
    outlines = np.array([_outline(shape) for shape in items.geometry], object)[table["line"].to_numpy()]
    axes = shapely.linestrings(table[["xb", "yb", "xt", "yt"]].to_numpy().reshape(-1, 2, 2))
    ends = shapely.get_coordinates(shapely.shortest_line(outlines, axes))
    return ends[::2]


def travel_angles(
    table: pandas.DataFrame, items: Items, touched: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    """Direction of travel, and the plan angles between it and the line there, and between it and the log's axis; NaN
    at rest.
    """
    way = table[["dx", "dy"]].to_numpy()
    moving = np.hypot(*way.T) > 0.0
    along = np.array(
        [_direction_at(items.geometry[k], place) for k, place in zip(table["line"], touched, strict=True)], float
    ).reshape(-1, 2)
    axis = table[["xt", "yt"]].to_numpy() - table[["xb", "yb"]].to_numpy()
    facts = {
        "azimuth_deg": azimuth(way[:, 0], way[:, 1]),
        "impact_deg": angle_between(way, along),
        "axis_deg": angle_between(way, axis),
    }
    return {name: np.where(moving, values, np.nan) for name, values in facts.items()}


def angle_between(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angle between directions in plan, regardless of their sense: 0 parallel, 90 perpendicular [deg]."""
    cross = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    return np.degrees(np.arctan2(cross, np.abs((a * b).sum(axis=1))))


def _outline(shape: Any) -> Any:
    return shape.boundary if shapely.get_dimensions(shape) == 2 else shape


def _direction_at(shape: Any, place: NDArray[np.float64]) -> NDArray[np.float64]:
    """Direction of the line or outline's segment that is nearest to a place on it."""
    parts = shapely.get_parts(_outline(shape))
    part = parts[int(np.argmin(shapely.distance(parts, shapely.Point(place))))]
    ends = shapely.get_coordinates(part)
    a, b = ends[:-1], ends[1:]
    step = b - a
    size = np.maximum((step**2).sum(axis=1), 1e-300)
    t = np.clip(((place - a) * step).sum(axis=1) / size, 0.0, 1.0)
    return step[int(np.argmin(((a + t[:, None] * step - place) ** 2).sum(axis=1)))]


def arrival_counts_frame(source: Run, arrivals: geopandas.GeoDataFrame, items: Items) -> geopandas.GeoDataFrame:
    """One row for each line: its reach probability, and with which speeds, energies and heights logs arrive there."""
    rows = []
    stored = source.deposits[source.deposits["log_id"].isin(source.stored_log_ids.tolist())]
    for line_id in items.ids:
        mine = arrivals[arrivals["line_id"] == line_id]
        record = {"line_id": line_id, **_share(mine, stored)}
        rows.append(record | _strength(mine) | {"clearance_max_m": _largest(mine["clearance_m"])})
    return geopandas.GeoDataFrame(pandas.DataFrame(rows), geometry=items.geometry, crs=source.deposits.crs)


def attribution_frame(source: Run, arrivals: geopandas.GeoDataFrame, items: Items) -> geopandas.GeoDataFrame:
    """One row for each release and line: which release hits which object, drawn from the release to where its logs
    touch.
    """
    stored = source.deposits[source.deposits["log_id"].isin(source.stored_log_ids.tolist())]
    of_pair = dict(list(arrivals.groupby(["release_id", "line_id"])))
    per_line = arrivals["line_id"].value_counts()
    rows, shapes = [], []
    for release_id, released in stored.groupby("release_id", sort=False):
        centre = released["release_x"].mean(), released["release_y"].mean()
        for k, line_id in enumerate(items.ids):
            mine = of_pair.get((release_id, line_id), arrivals[:0])
            share = len(mine) / per_line[line_id] if line_id in per_line else np.nan
            record = {"release_id": release_id, "line_id": line_id, **_share(mine, released)}
            rows.append(record | {"share_of_arrivals": share} | _strength(mine))
            somewhere = items.geometry[k].representative_point().coords[0]
            there = tuple(mine[["touch_x", "touch_y"]].mean()) if len(mine) else somewhere
            shapes.append(shapely.LineString([centre, there]))
    return geopandas.GeoDataFrame(pandas.DataFrame(rows), geometry=shapes, crs=source.deposits.crs)


def origins_frame(arrivals: geopandas.GeoDataFrame) -> geopandas.GeoDataFrame:
    """The arrivals again, each drawn where its log was released: where do the logs that reach the object come from?"""
    names = ["log_id", "release_id", "line_id", "t_s", "speed_ms", "energy_kj"]
    points = shapely.points(arrivals["release_x"], arrivals["release_y"])
    return geopandas.GeoDataFrame(arrivals[names], geometry=points, crs=arrivals.crs)


def _share(mine: Any, logs: Any) -> dict[str, float]:
    """Reach probability of these logs from their arrivals, and its bounds for logs that left the terrain model
    before.
    """
    return share_if_lost(logs["log_id"].isin(mine["log_id"]).to_numpy(), left_dem(logs))


def _strength(mine: Any) -> dict[str, float]:
    """Median and 95 % quantile of the speed and energy of arrivals; NaN for those that cannot be shown, and how many
    more arrivals it takes for all.
    """
    out: dict[str, float] = {}
    for name, unit in (("speed", "ms"), ("energy", "kj")):
        found = quantiles(mine[f"{name}_{unit}"], [0.5, 0.95])
        out |= {f"{name}_{word}_{unit}": float(each) for word, each in zip(("median", "p95"), found, strict=True)}
    return out | {"n_more": missing(len(mine), 0.95)}


def _largest(values: Any) -> float:
    return float(values.max()) if len(values) else np.nan
