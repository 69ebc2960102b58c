"""The logs as shapes for maps: outlines in plan at equal time steps, for an animation, and solids in their final
position.

An outline is the convex hull, seen from above, of the log's two round ends. It is valid from `t` to `t_end` (UTC, from
2000-01-01 on), which ends 10 ms before the next begins: QGIS compares times in a GeoPackage as text, and would show
both if they touched. The last outline of each log is shown until the end of the animation.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import geopandas
import numpy as np
import pandas
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.params.tool import Cancelled, Feedback
from deadwood_algorithms.results.run_folder import Run

START = np.datetime64("2000-01-01T00:00:00", "ms")  # UTC
GAP_S = 0.010
STAYS_S = 5.0  # duration of the last outlines, after the last log has stopped
CORNERS = 8  # vertices of each round end
MOST = 300_000  # outlines; with more, the animation is too slow


@dataclass(frozen=True)
class Ends:
    """Positions of logs: ids, times [s], speeds [m/s], centres of base and tip [m], shape (n, 3), and their radii
    [m].
    """

    log_id: NDArray[np.int64]
    time: NDArray[np.float64]
    speed: NDArray[np.float64]
    base: NDArray[np.float64]
    tip: NDArray[np.float64]
    base_radius: NDArray[np.float64]
    tip_radius: NDArray[np.float64]


def outlines(run: Run, every_s: float, feedback: Feedback) -> tuple[geopandas.GeoDataFrame, float]:
    """The outlines of every log with stored poses, and the time between them, longer if there would be too many."""
    durations = run.deposits.set_index("log_id").loc[run.stored_log_ids, "duration_s"].to_numpy(np.float64)
    last = float(durations.max(initial=0.0))
    step = every_s
    while (durations / step + 2.0).sum() > MOST:
        step *= 2.0
    if step > every_s:
        feedback.warn(
            f"an outline every {every_s:g} s would be more than {MOST}; one is written every {step:g} s",
            code="fewer-outlines",
            step_s=step,
        )
    pieces = []
    done = 0
    for ends in _frames(run, step):
        if feedback.cancelled():
            raise Cancelled
        pieces.append(_outline_rows(ends, last + STAYS_S))
        done += np.unique(ends.log_id).size
        feedback.progress(done, durations.size, "drawing outlines")
    frame = pandas.concat(pieces, ignore_index=True)
    of_log = run.deposits.set_index("log_id")["release_id"]
    frame.insert(1, "release_id", of_log.loc[frame["log_id"]].to_numpy())
    return geopandas.GeoDataFrame(frame).set_crs(run.grid.plan_crs), step


def _frames(run: Run, step: float) -> Iterator[Ends]:
    """The logs at every multiple of the step, and at their end; between two stored poses they move uniformly."""
    base_radius, tip_radius = run.radii()
    for piece in run.poses(run.stored_log_ids):
        starts = np.flatnonzero(np.diff(piece["log_id"], prepend=piece["log_id"][0] - 1))
        rows: dict[str, list[NDArray]] = {name: [] for name in ("log_id", "row", "t", "speed", "base", "tip")}
        for start, stop in zip(starts, [*starts[1:], piece["log_id"].size], strict=True):
            known = piece["t_s"][start:stop]
            times = np.arange(0.0, known[-1], step)
            times = np.append(times[times < known[-1] - 2.0 * GAP_S], known[-1])
            part = slice(start, stop)
            rows["t"].append(times)
            rows["log_id"].append(np.full(times.size, piece["log_id"][start]))
            rows["row"].append(np.full(times.size, piece["log_row"][start]))
            rows["speed"].append(np.interp(times, known, piece["speed_ms"][part]))
            for name, ending in (("base", "b"), ("tip", "t")):
                along = [np.interp(times, known, piece[axis + ending][part]) for axis in "xyz"]
                rows[name].append(np.stack(along, axis=1))
        joined = {name: np.concatenate(values) for name, values in rows.items()}
        row = joined["row"]
        yield Ends(
            joined["log_id"],
            joined["t"],
            joined["speed"],
            joined["base"],
            joined["tip"],
            base_radius[row],
            tip_radius[row],
        )


def _outline_rows(ends: Ends, until_s: float) -> geopandas.GeoDataFrame:
    following = np.append(ends.time[1:], until_s)
    following[np.append(np.diff(ends.log_id) != 0, True)] = until_s + GAP_S  # each log's last outline remains
    columns = {
        "log_id": ends.log_id,
        "time_s": ends.time,
        "speed_ms": ends.speed,
        "t": _stamps(ends.time),
        "t_end": _stamps(following - GAP_S),
    }
    return geopandas.GeoDataFrame(columns, geometry=hulls(ends))


def _stamps(seconds: NDArray[np.float64]) -> pandas.DatetimeIndex:
    return pandas.DatetimeIndex(stamp(seconds)).tz_localize("UTC")


def stamp(seconds: Any) -> Any:
    """The time in the animation of a time [s] since the start, to the millisecond; a number or an array."""
    return START + np.round(np.asarray(seconds) * 1000.0).astype("timedelta64[ms]")


def hulls(ends: Ends) -> Any:
    """Polygons in plan around both round ends."""
    axis = _axes(ends)
    rims = [_rim(ends.base, ends.base_radius, axis), _rim(ends.tip, ends.tip_radius, axis)]
    points = np.concatenate(rims, axis=1)[:, :, :2]
    owner = np.repeat(np.arange(len(points)), points.shape[1])
    return shapely.convex_hull(shapely.multipoints(points.reshape(-1, 2), indices=owner))


def solids(ends: Ends) -> Any:
    """Truncated cones as multipolygons of their faces: the mantle's quadrangles and the two ends."""
    axis = _axes(ends)
    base, tip = _rim(ends.base, ends.base_radius, axis), _rim(ends.tip, ends.tip_radius, axis)
    n, corners = len(base), base.shape[1]
    after = np.roll(np.arange(corners), -1)
    sides = np.stack([base, base[:, after], tip[:, after], tip, base], axis=2).reshape(-1, 5, 3)
    caps = np.concatenate([base[:, ::-1], tip]).reshape(2 * n, corners, 3)
    caps = np.concatenate([caps, caps[:, :1]], axis=1)
    faces = np.concatenate([np.asarray(shapely.polygons(sides)), np.asarray(shapely.polygons(caps))])
    owner = np.concatenate([np.repeat(np.arange(n), corners), np.tile(np.arange(n), 2)])
    order = np.argsort(owner, kind="stable")
    return shapely.multipolygons(faces[order], indices=owner[order])


def _axes(ends: Ends) -> NDArray[np.float64]:
    """Unit vectors from base to tip, shape (n, 3)."""
    axis = ends.tip - ends.base
    return axis / np.linalg.norm(axis, axis=1, keepdims=True)


def _rim(centre: NDArray, radius: NDArray, axis: NDArray) -> NDArray[np.float64]:
    """Points around round ends perpendicular to the axis, shape (n, CORNERS, 3)."""
    level = np.hypot(axis[:, 0], axis[:, 1])
    flat = np.where(level > 1e-9, level, 1.0)
    across = np.stack([-axis[:, 1] / flat, axis[:, 0] / flat, np.zeros(len(axis))], axis=1)
    across[level <= 1e-9] = (1.0, 0.0, 0.0)
    up = np.cross(axis, across)
    turn = 2.0 * np.pi * np.arange(CORNERS) / CORNERS
    around = np.cos(turn)[None, :, None] * across[:, None, :] + np.sin(turn)[None, :, None] * up[:, None, :]
    return centre[:, None, :] + radius[:, None, None] * around
