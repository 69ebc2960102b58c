"""The content of a run's 3-D view, packed for the page: coarse terrain, obstacles in true size, selected moving logs.

Coordinates are metres east, north and up of the scene's own origin, so that single precision is enough. Poses of the
moving logs are at equal time steps and quantised to 16 bits within their bounding box: 1 cm over 650 m.
"""

from __future__ import annotations

import base64
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pandas
import shapely
from numpy.typing import NDArray
from PIL import Image

from deadwood_algorithms.files.pictures import colours_of, hillshade, lines_of_shapes
from deadwood_algorithms.report.markup import picture_address
from deadwood_algorithms.report.plan import thinned_rows
from deadwood_algorithms.report.sources import ReportedRun, lying_radii, mean_of_blocks, paths_by_log
from deadwood_algorithms.schemas.looks import ENDS, LOOKS, SOLIDS, rgb
from deadwood_algorithms.schemas.obstacles import STUMP_BELOW_M
from deadwood_engine import STOP_REASONS

GROUND_VERTICES = 260  # along the longer side
MOST_TREES, MOST_DEPOSITS, MOST_BLOCKS = 20_000, 4_000, 2_000
SLICES = 6  # of a boulder
A_GROUP = 30  # logs in each group that is shown
MOST_POSES = 60_000  # 14 bytes each
STEP_S = 0.1  # between two poses, or more if there would be too many
LINE_STEP_M = 2.0

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Moving:
    """A selected log: its poses at equal time steps, shape (n, 3) [m], and why it was selected."""

    log_id: int
    groups: list[str]
    base: Array
    tip: Array
    speed: Array
    radii: tuple[float, float]


@dataclass(frozen=True)
class Space:
    """The scene in metres from ``origin``; solids as rows (base xyz, tip xyz, base radius, tip radius)."""

    origin: tuple[float, float, float]
    heights: Array  # row 0 south, NaN outside
    cell: float
    first: tuple[float, float]  # position of heights[0, 0], from the origin
    trees: Array
    lying: Array
    blocks: Array  # spheres as `SLICES` truncated cones each
    deposits: Array
    ends: NDArray[np.uint8]  # of the deposits: how the logs ended, among `STOP_REASONS`
    barriers: list[tuple[Array, float]]  # base points along the line (n, 3), and height
    lines: list[Array]
    moving: list[Moving]
    step_s: float


def space_of(source: ReportedRun, pages_share: int = 1) -> Space | None:
    """The scene of a run; None without terrain. ``pages_share``: number of runs that share the page."""
    ground = source.ground
    if ground is None:
        return None
    step = max(1, -(-max(ground.shape) // GROUND_VERTICES))
    ny, nx = (each // step * step for each in ground.shape)
    heights = mean_of_blocks(ground.values[:ny, :nx], step)
    west, south, east, north = ground.bounds
    low = float(np.floor(np.nanmin(heights)))
    origin = (float(np.floor((west + east) / 2.0)), float(np.floor((south + north) / 2.0)), low)
    shift = (step - 1) / 2.0 * ground.cell
    moving, step_s = moving_logs(source, origin, MOST_POSES // pages_share)
    frame = source.layer("deposited_logs")
    radius, tip = source.run.radii()
    deposits, reasons = np.zeros((0, 8)), np.zeros(0, np.uint8)
    if frame is not None and len(frame) == radius.size:
        rows = thinned_rows(len(frame), MOST_DEPOSITS)
        ends = shapely.get_coordinates(np.asarray(frame.geometry)[rows], include_z=True).reshape(-1, 6)
        deposits = np.column_stack([ends - np.tile(origin, 2), radius[rows], tip[rows]])
        there = np.isfinite(deposits).all(axis=1)
        reasons = np.array(
            [STOP_REASONS.index(each) for each in source.run.deposits["stop_reason"].iloc[rows]], np.uint8
        )
        deposits, reasons = deposits[there], reasons[there]
    return Space(
        origin,
        heights - low,
        ground.cell * step,
        (ground.x0 + shift - origin[0], ground.y0 + shift - origin[1]),
        _trees(source, origin),
        _lying(source, origin),
        _blocks(source, origin),
        deposits,
        reasons,
        _barriers(source, origin),
        [_on_ground(source, string, origin) for string in _strings(source.lines)],
        moving,
        step_s,
    )


def stumps_of(trees: Array) -> NDArray[np.bool_]:
    """Which of the trees are stumps: cylinders, whereas a tree tapers."""
    return trees[:, 6] == trees[:, 7]


def _trees(source: ReportedRun, origin: tuple[float, float, float]) -> Array:
    standing = [source.scene[name] for name in ("trees", "stumps") if name in source.scene]
    if not standing:
        return np.zeros((0, 8))
    frame = pandas.concat(standing)
    x, y = shapely.get_coordinates(np.asarray(frame.geometry)).T
    z = source.ground.height(x, y) if source.ground is not None else np.full(x.shape, np.nan)
    rows = np.flatnonzero(np.isfinite(z))
    rows = rows[thinned_rows(rows.size, MOST_TREES)]
    foot = np.column_stack([x, y, z])[rows] - origin
    radius = frame["dbh_cm"].to_numpy(np.float64)[rows] / 200.0
    height = frame["height_m"].to_numpy(np.float64)[rows]
    top = foot + [0.0, 0.0, 1.0] * height[:, None]
    return np.column_stack([foot, top, radius, np.where(height < STUMP_BELOW_M, 1.0, 0.5) * radius])


def _lying(source: ReportedRun, origin: tuple[float, float, float]) -> Array:
    """Lying logs as straight pieces on the ground, with their local thickness."""
    if "lying_logs" not in source.scene:
        return np.zeros((0, 8))
    rows = []
    for shape, (thick, thin) in zip(np.asarray(source.scene["lying_logs"].geometry), lying_radii(source), strict=True):
        for part in shapely.get_parts(shape):
            points = _on_ground(source, shapely.get_coordinates(part), origin, spacing=np.inf, above=0.0)
            if len(points) < 2:
                continue
            far = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
            radius = thick + (thin - thick) * far / max(far[-1], 1e-9)
            centre = points + np.column_stack([np.zeros((len(points), 2)), radius])
            rows += [np.concatenate([centre[k], centre[k + 1], radius[k : k + 2]]) for k in range(len(points) - 1)]
    return np.array(rows).reshape(-1, 8)


def _blocks(source: ReportedRun, origin: tuple[float, float, float]) -> Array:
    """Boulders as truncated cones on top of each other, with the sphere's radius where they meet."""
    if "blocks" not in source.scene or source.ground is None:
        return np.zeros((0, 8))
    frame = source.scene["blocks"]
    x, y = shapely.get_coordinates(np.asarray(frame.geometry)).T
    radius = 0.5 * frame["diameter_m"] if "diameter_m" in frame else frame["radius_m"]
    radius = radius.to_numpy(np.float64)
    top = frame["height_m"].to_numpy(np.float64) if "height_m" in frame else np.full(x.size, np.nan)
    z = source.ground.height(x, y) + np.where(np.isnan(top), 2.0 * radius, top) - radius
    rows = np.flatnonzero(np.isfinite(z))
    rows = rows[thinned_rows(rows.size, MOST_BLOCKS)]
    centre, radius = np.column_stack([x, y, z])[rows] - origin, radius[rows]
    slices = []
    for low, high in pairwise(np.linspace(-0.5 * np.pi, 0.5 * np.pi, SLICES + 1)):
        ends = [centre + np.outer(radius, (0.0, 0.0, np.sin(each))) for each in (low, high)]
        slices.append(np.column_stack([*ends, radius * np.cos(low), radius * np.cos(high)]))
    return np.concatenate(slices)


def _barriers(source: ReportedRun, origin: tuple[float, float, float]) -> list[tuple[Array, float]]:
    if "barriers" not in source.scene:
        return []
    frame = source.scene["barriers"]
    found = []
    for shape, height in zip(np.asarray(frame.geometry), frame["height_m"].to_numpy(np.float64), strict=True):
        found += [
            (_on_ground(source, shapely.get_coordinates(part), origin, above=0.0), float(height))
            for part in shapely.get_parts(shape)
        ]
    return [each for each in found if len(each[0]) > 1]


def _strings(frame: Any) -> list[Array]:
    return [] if frame is None else lines_of_shapes(frame.geometry)


def _on_ground(
    source: ReportedRun,
    points: Array,
    origin: tuple[float, float, float],
    spacing: float = LINE_STEP_M,
    above: float = 0.3,
) -> Array:
    """A line on the terrain, with points at a spacing [m], from the origin; without parts off the terrain."""
    assert source.ground is not None
    line = shapely.LineString(points[:, :2])
    if np.isfinite(spacing):
        line = shapely.segmentize(line, max(spacing, line.length / 2000.0))
    x, y = shapely.get_coordinates(line).T
    z = source.ground.height(x, y) + above
    return (np.column_stack([x, y, z]) - origin)[np.isfinite(z)]


def chosen_groups(source: ReportedRun) -> dict[str, list[int]]:
    """The logs that move in the view: among those with a trajectory the fastest, the farthest, some that reach a line,
    and a random sample."""
    stored = source.deposits.loc[source.deposits["log_id"].isin(source.run.stored_log_ids.tolist())]
    ids = stored["log_id"].to_numpy(np.int64)
    groups = {}
    for group, column in (("fast", "speed_max_ms"), ("far", "runout_m")):
        order = np.lexsort((ids, -np.nan_to_num(stored[column].to_numpy(np.float64))))
        groups[group] = ids[order[:A_GROUP]].tolist()
    reached = np.unique(source.reached_by["log_id"].to_numpy(np.int64))
    reached = reached[np.isin(reached, ids)]
    groups["reach"] = reached[thinned_rows(reached.size, A_GROUP)].tolist()
    groups["random"] = ids[thinned_rows(ids.size, A_GROUP, seed=1)].tolist()
    return {name: each for name, each in groups.items() if each}


def moving_logs(source: ReportedRun, origin: tuple[float, float, float], most_poses: int) -> tuple[list[Moving], float]:
    """The selected logs at equal time steps, and the length of the step [s]."""
    groups = chosen_groups(source)
    wanted = sorted({log for each in groups.values() for log in each})
    if not wanted:
        return [], STEP_S
    paths = paths_by_log(source.run, np.array(wanted, np.int64))
    duration = sum(float(path["t_s"][-1] - path["t_s"][0]) for path in paths.values())
    step = max(STEP_S, duration / most_poses)
    radius, tip = source.run.radii()
    moving = []
    for log_id, path in paths.items():
        own = path["t_s"] - path["t_s"][0]
        times = np.append(np.arange(0.0, own[-1], step), own[-1])

        def at(name: str, own: Array = own, times: Array = times, path: dict = path) -> Array:
            return np.interp(times, own, path[name].astype(np.float64))

        ends = [np.column_stack([at(f"{axis}{end}") for axis in "xyz"]) - origin for end in "bt"]
        row = int(path["log_row"][0])
        mine = [name for name, each in groups.items() if log_id in each]
        moving.append(Moving(log_id, mine, ends[0], ends[1], at("speed_ms"), (float(radius[row]), float(tip[row]))))
    return moving, step


def packed(space: Space, source: ReportedRun) -> dict[str, Any]:
    """The scene as JSON with arrays in base64, for the page's script."""
    known = np.isfinite(space.heights)
    top = float(np.nanmax(space.heights)) or 1.0
    quantised = np.where(known, 1.0 + np.nan_to_num(space.heights) / top * 65534.0, 0.0)
    ends = [np.hstack([each.base, each.tip]) for each in space.moving]
    everything = np.concatenate([each.reshape(-1, 3) for each in ends]) if ends else np.zeros((1, 3))
    low = everything.min(axis=0)
    scale = np.maximum(np.ptp(everything, axis=0), 1e-3) / 65535.0
    poses = [np.rint((each.reshape(-1, 3) - low) / scale).reshape(-1, 6) for each in ends]
    return {
        "ground": {
            "nx": space.heights.shape[1],
            "ny": space.heights.shape[0],
            "cell": space.cell,
            "first": space.first,
            "top": top,
            "z": _base64(quantised, "<u2"),
        },
        "colours": SOLIDS,
        "drapes": {name: picture_address(each) for name, each in drapes(source).items()},
        "trees": _base64(space.trees, "<f4"),
        "lying": _base64(space.lying, "<f4"),
        "blocks": _base64(space.blocks, "<f4"),
        "deposits": _base64(space.deposits, "<f4"),
        "ends": _base64(space.ends, "u1"),
        "end_colours": [rgb(ENDS[each][1]) for each in STOP_REASONS],
        "barriers": [{"feet": _base64(feet, "<f4"), "height": height} for feet, height in space.barriers],
        "lines": [_base64(each, "<f4") for each in space.lines if len(each) > 1],
        "step": space.step_s,
        "low": low.tolist(),
        "scale": scale.tolist(),
        "poses": _base64(np.concatenate(poses) if poses else np.zeros((0, 6)), "<u2"),
        "speed": _base64(
            np.concatenate([100.0 * each.speed for each in space.moving]) if poses else np.zeros(0), "<u2"
        ),
        "logs": [
            {"id": each.log_id, "n": len(each.base), "r": each.radii, "groups": each.groups} for each in space.moving
        ],
    }


def drapes(source: ReportedRun) -> dict[str, Image.Image]:
    """Pictures to drape over the terrain, on the ground's cells: the relief, and the relief with hits."""
    assert source.ground is not None
    shade = hillshade(source.ground.values, source.ground.cell, source.relief_span)
    grey = np.nan_to_num(0.3 + 0.7 * shade, nan=0.8)
    relief = np.repeat(grey[:, :, None], 3, axis=2)
    found = {"relief": _picture(relief * [0.98, 0.97, 0.92])}
    if "hits" in source.rasters:
        values, extent = source.rasters["hits"]
        share = _on_cells(values, extent, source)
        ramp, scale = colours_of(LOOKS["shares"])
        colour = ramp(scale(share))[:, :, :3]
        hit = (share > 0.0)[:, :, None]
        found["hits"] = _picture(np.where(hit, 0.72 * colour * (0.55 + 0.45 * relief) + 0.28 * relief, relief))
    return found


def _on_cells(values: Array, extent: tuple[float, float, float, float], source: ReportedRun) -> Array:
    """A raster at the centres of the ground's cells."""
    ground = source.ground
    assert ground is not None
    ny, nx = ground.shape
    x, y = ground.x0 + ground.cell * np.arange(nx), ground.y0 + ground.cell * np.arange(ny)
    i = np.floor((x - extent[0]) / (extent[2] - extent[0]) * values.shape[1]).astype(int)
    j = np.floor((y - extent[1]) / (extent[3] - extent[1]) * values.shape[0]).astype(int)
    inside = ((j >= 0) & (j < values.shape[0]))[:, None] & ((i >= 0) & (i < values.shape[1]))
    found = values[np.clip(j, 0, values.shape[0] - 1)[:, None], np.clip(i, 0, values.shape[1] - 1)]
    return np.where(inside, np.nan_to_num(found), 0.0)


def _picture(colours: Array) -> Image.Image:
    """A picture with north at the top."""
    return Image.fromarray(np.uint8(np.clip(colours[::-1], 0.0, 1.0) * 255.0))


def _base64(values: NDArray[Any], kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(np.asarray(values), dtype=kind).tobytes()).decode("ascii")
