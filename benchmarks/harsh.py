"""Small studies of demanding contacts: rebound at a rigid barrier, and ground of white noise.

Penetration is measured here by sampling a log's surface in every stored pose, independently of the
engine's contacts, which cannot report what they miss.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.stats.statistics import wilson_interval
from deadwood_engine import FIDELITIES, Barriers, Lines, Logs, Result, Scene, Trees, slide

from . import scenes, study

Array = NDArray[np.float64]

NOISE = 0.1  # [m] standard deviation of white noise, one draw for each cell
ALONG, AROUND = 0.5, 16  # [m] between the rings of points that are sampled on a log, and the points of each
DIAMETER, LENGTH = 0.75, 30.0  # [m] of the logs before the barrier
REBOUNDS = (0.0, 0.2, 0.5)  # [-] restitutions of everything
STEEP, STEEP_FRICTION = 45.0, 0.6  # [degrees], [-]
SIDE, BARRIER_Y, BARRIER_HEIGHT, ROAD_Y, RELEASE_Y = 80.0, 25.0, 3.0, 12.0, (50.0, 56.0)  # [m]
BARRIER_X, RELEASE_X = (10.0, 70.0), (28.0, 52.0)  # [m]
HARSH = 35.0  # [degrees]
LOGS = study.BLOCK


def noisy_slope(degrees: float, width: float, length: float, cell: float = scenes.CELL) -> Array:
    """Heights [m] of a slope that falls to the south, with white noise."""
    shape = (round(length / cell), round(width / cell))
    y = (np.arange(shape[0], dtype=float)[:, None] + 0.5) * cell
    return np.tan(np.radians(degrees)) * y + NOISE * np.random.default_rng(scenes.SEED).standard_normal(shape)


def height_at(heights: Array, cell: float, x: Array, y: Array) -> Array:
    """The bilinear surface through the cells' centres; NaN beyond the outermost of them."""
    column, row = x / cell - 0.5, y / cell - 0.5
    inside = (column >= 0) & (row >= 0) & (column <= heights.shape[1] - 1) & (row <= heights.shape[0] - 1)
    left = np.clip(np.floor(np.where(inside, column, 0.0)).astype(int), 0, heights.shape[1] - 2)
    low = np.clip(np.floor(np.where(inside, row, 0.0)).astype(int), 0, heights.shape[0] - 2)
    u, v = column - left, row - low
    lower = (1 - u) * heights[low, left] + u * heights[low, left + 1]
    upper = (1 - u) * heights[low + 1, left] + u * heights[low + 1, left + 1]
    return np.where(inside, (1 - v) * lower + v * upper, np.nan)


def surface_points(base: Array, tip: Array, radius: Array, length: float) -> Array:
    """Points on the mantles of cones that taper to half their thickness, shape (poses, points, 3)."""
    axis = (tip - base) / np.linalg.norm(tip - base, axis=1)[:, None]
    aside = np.cross(axis, np.where(np.abs(axis[:, 2:]) < 0.9, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)))
    aside /= np.linalg.norm(aside, axis=1)[:, None]
    third = np.cross(axis, aside)
    share = np.linspace(0.0, 1.0, round(length / ALONG) + 1)
    turn = 2.0 * np.pi * np.arange(AROUND) / AROUND
    rim = np.cos(turn)[:, None] * aside[:, None, :] + np.sin(turn)[:, None] * third[:, None, :]
    thick = radius[:, None] * (1.0 - 0.5 * share)
    centres = base[:, None, :] + share[:, None] * (tip - base)[:, None, :]
    return (centres[:, :, None, :] + thick[:, :, None, None] * rim[:, None]).reshape(len(base), -1, 3)


def depth_in_ground(heights: Array, cell: float, degrees: float, result: Result, logs: Logs, rows: int = 200) -> Array:
    """Deepest point of each log below the ground in all its poses [m], across the mean slope; 0 where none is below."""
    poses, deepest = result.poses, np.zeros(len(logs))
    for k in range(0, len(poses.log_row), rows):
        log = poses.log_row[k : k + rows]
        points = surface_points(
            poses.base[k : k + rows], poses.tip[k : k + rows], 0.5 * logs.diameter[log], float(logs.length[log].max())
        )
        below = height_at(heights, cell, points[..., 0], points[..., 1]) - points[..., 2]
        np.maximum.at(deepest, log, np.nanmax(np.where(np.isfinite(below), below, 0.0), axis=1))
    return deepest * np.cos(np.radians(degrees))


def cut_by_barrier(heights: Array, cell: float, result: Result) -> NDArray[np.bool_]:
    """Logs whose axis passes through the barrier, below its top and between its ends, in any of their poses.

    Without that, a log may penetrate by up to half its thickness.
    """
    poses = result.poses
    above, below = poses.base[:, 1] - BARRIER_Y, poses.tip[:, 1] - BARRIER_Y
    across = above * below < 0.0
    share = np.divide(above, above - below, out=np.zeros_like(above), where=across)
    point = poses.base + share[:, None] * (poses.tip - poses.base)
    across &= (point[:, 0] > BARRIER_X[0]) & (point[:, 0] < BARRIER_X[1])
    top = height_at(heights, cell, point[:, 0], np.full(len(point), BARRIER_Y)) + BARRIER_HEIGHT
    found = np.zeros(len(result.steps), np.bool_)
    found[poses.log_row[across & (point[:, 2] < top)]] = True
    return found


def _row(name: str, result: Result, sampled: Array) -> dict[str, Any]:
    """The figures reported for every run."""
    depth = result.penetration_max
    return {
        "fidelity": name,
        "logs": len(depth),
        "cpu_ms_per_log": 1e3 * result.cost["cpu_s"] / len(depth),
        "penetration_m": {
            "median": float(np.median(depth)), "p99": float(np.quantile(depth, 0.99)), "max": float(depth.max()),
        },
        "sampled_m": {"median": float(np.median(sampled)), "max": float(sampled.max())},
        "overlap_m": float(result.overlap_max.max()),
        "failed": int(np.sum(result.stop_reason == study.FAILED)),
        "energy_error": float(result.energy_error.max()),
    }  # fmt: skip


def rebounds(*, threads: int, logs: int = LOGS, fidelities: tuple[str, ...] = tuple(FIDELITIES)) -> dict[str, Any]:
    """Lying logs that slide against a rigid barrier, at several restitutions: how many pass it, and how deep they
    penetrate.

    Without a rebound no log jumps as high as the barrier, and there is no way around it.
    """
    heights, cell = noisy_slope(STEEP, SIDE, SIDE), scenes.CELL
    barrier = Barriers(np.array([(x, BARRIER_Y) for x in BARRIER_X]), np.array([0, 2]), np.array([BARRIER_HEIGHT]))
    road = [(scenes.LINE_MARGIN, ROAD_Y), (SIDE - scenes.LINE_MARGIN, ROAD_Y)]
    trees = Trees(*np.empty((4, 0)))
    scene = Scene.prepare(
        heights, cell, 0.5 * cell, 0.5 * cell, friction=STEEP_FRICTION, trees=trees, barriers=barrier,
        lines=Lines(np.array(road), np.array([0, 2])),
    )  # fmt: skip
    rng = np.random.default_rng(scenes.SEED)
    released = Logs.alike(
        rng.uniform(*RELEASE_X, logs), rng.uniform(*RELEASE_Y, logs), diameter=DIAMETER, length=LENGTH,
        orientation=scenes.LYING, azimuth=np.pi,
    )  # fmt: skip
    slide(scene, released.take(slice(2)), FIDELITIES["draft"], time_limit=0.1)  # compiled before it is timed
    rows = []
    for restitution in REBOUNDS:
        for name in fidelities:
            result = slide(
                scene, released, FIDELITIES[name], restitution=restitution, time_limit=study.TIME_LIMIT,
                threads=threads, keep_poses=np.ones(logs, np.bool_),
            )  # fmt: skip
            sampled = depth_in_ground(heights, cell, STEEP, result, released)
            past, through = int(result.reach[:, 0].sum()), cut_by_barrier(heights, cell, result)
            low, high = wilson_interval(past, logs)
            rows.append(
                {"e": restitution, **_row(name, result, sampled), "through": int(through.sum())}
                | {"past": {"p": past / logs, "low": low, "high": high}}
            )
    facts = {"degrees": STEEP, "friction": STEEP_FRICTION, "height_m": BARRIER_HEIGHT, "noise_m": NOISE}
    return {**facts, "radius_m": 0.5 * DIAMETER, "rows": rows}


def ground_of_noise(
    *, threads: int, logs: int = LOGS, fidelities: tuple[str, ...] = tuple(FIDELITIES)
) -> dict[str, Any]:
    """The study's logs on a slope of white noise, without a rebound: how deep they get, by fidelity."""
    heights, cell = noisy_slope(HARSH, scenes.WIDTH, scenes.LENGTH), scenes.CELL
    friction = scenes.CASES["rough"].friction
    scene = Scene.prepare(heights, cell, 0.5 * cell, 0.5 * cell, friction=friction, trees=Trees(*np.empty((4, 0))))
    released = scenes.logs_of_block(0, logs)
    rows = []
    for name in fidelities:
        result = slide(
            scene, released, FIDELITIES[name], time_limit=study.TIME_LIMIT, threads=threads,
            keep_poses=np.ones(logs, np.bool_),
        )  # fmt: skip
        rows.append(_row(name, result, depth_in_ground(heights, cell, HARSH, result, released)))
    return {"degrees": HARSH, "friction": friction, "noise_m": NOISE, "cell_m": cell, "rows": rows}
