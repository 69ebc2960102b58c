"""The results of each log: the kernels' columns as named arrays in world coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import trace
from .influence import Influences, influences_of
from .ledger import Hits, hits_of
from .log_body import CENTRE, LENGTH, MASS
from .logs import Start
from .rest import HELD_BY_BLOCK, HELD_BY_LYING_LOG
from .scene import Scene

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Poses:
    """Poses stored along the trajectories, ordered by log row, then time; world coordinates [m].

    log_row : int64 (m,); time [s], speed [m/s], spin [rad/s], clearance [m], height [m] of the centre of mass above
        the terrain (m,); position, base, tip (m, 3)
    """

    log_row: NDArray[np.int64]
    time: Array
    position: Array
    base: Array
    tip: Array
    speed: Array
    spin: Array
    clearance: Array
    height: Array


@dataclass(frozen=True)
class Result:
    """Results of each log; row i belongs to row i of the logs. World coordinates, SI units.

    stop_reason : int8, index into STOP_REASONS; stop_item : row of the tree, barrier, lying log or boulder that holds
        the log, else -1
    energy_error : [-] energy gained from contacts or missing in the balance, over the energy spent
    penetration_max : [m] deepest contact, overlap_max : with a tree or barrier alone
    jump_max : [m] largest clearance between log and terrain
    height_max : [m] greatest height of the centre of mass above the terrain below it, at the nodes of the steps
    residual_max : [m/s] of the contact solver's last sweep
    speed_max, speed_mean, and the velocities of last_state : [m/s] at the middle of a step
    tree_hits, barrier_hits : number of different trees and barriers that acted on the log
    grip : [rad] from the edge of the friction cone of the one stem that holds the log (``rest.holder``), else NaN
    reach, reach_time : (n, lines), whether and when [s] the log's outline first touched a line
    barrier_reached, barrier_crossed : (n, barriers), outline touched, centre of mass crossed its line in plan
    hits : the ledger of trees and barriers, one row per hit
    influences : the obstacles that mattered to each log, one row per log and obstacle; empty unless requested
    last_state : (n, 16) and frame (n, 2), final state for a replay
    """

    stop_reason: NDArray[np.int8]
    stop_item: NDArray[np.int64]
    duration: Array
    path: Array
    release_position: Array
    end_position: Array
    base_end: Array
    tip_end: Array
    speed_max: Array
    speed_mean: Array
    energy_max: Array
    jump_max: Array
    height_max: Array
    tree_hits: NDArray[np.int64]
    barrier_hits: NDArray[np.int64]
    energy_error: Array
    penetration_max: Array
    overlap_max: Array
    residual_max: Array
    unconverged: NDArray[np.int64]
    steps: NDArray[np.int64]
    grip: Array
    started_in_contact: NDArray[np.bool_]
    reach: NDArray[np.bool_]
    reach_time: Array
    barrier_reached: NDArray[np.bool_]
    barrier_crossed: NDArray[np.bool_]
    last_state: Array
    frame: NDArray[np.int64]
    poses: Poses
    hits: Hits
    influences: Influences
    cost: dict[str, float]


def result_of(
    scene: Scene,
    start: Start,
    state: Array,
    summary: Any,  # one record per log, ``way.SUMMARY``
    poses: dict[int, Array],
    hits: dict[int, Array],
    notes: dict[int, Any],
    touched: NDArray[np.bool_],
    touch_time: Array,
    fences: NDArray[np.bool_],
    crossed: NDArray[np.bool_],
    cpu: float,
) -> Result:
    terrain = scene.arrays.terrain
    origin = np.empty((len(state), 3))
    origin[:, 0] = terrain.x0 + (start.frame[:, 0] + terrain.column) * terrain.cell
    origin[:, 1] = terrain.y0 + (start.frame[:, 1] + terrain.row) * terrain.cell
    origin[:, 2] = terrain.reference
    body = start.body
    centre = state[:, 0:3] + origin
    axis = state[:, 13:16]
    duration = summary["duration"]
    reason, owner = summary["reason"].astype(np.int8), summary["item_row"].copy()
    # in the kernels lying logs are numbered after the trees, boulders after these
    owner[reason == HELD_BY_LYING_LOG] -= scene.tree_count
    owner[reason == HELD_BY_BLOCK] -= scene.tree_count + scene.lying_count
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(duration > 0, summary["path"] / duration, 0.0)
    rows = sorted(poses)
    table = np.vstack([np.zeros((0, trace.POSE_WIDTH)), *(poses[row] for row in rows)])
    log_row = np.repeat(np.array(rows, np.int64), [len(poses[row]) for row in rows])
    shift = origin[log_row]
    columns = trace.POSE_X, trace.POSE_BASE, trace.POSE_TIP
    position, base, tip = (table[:, at : at + 3] + shift for at in columns)
    return Result(
        stop_reason=reason,
        stop_item=owner,
        duration=duration,
        path=summary["path"],
        release_position=start.state[:, 0:3] + origin,
        end_position=centre,
        base_end=centre - body[:, CENTRE, None] * axis,
        tip_end=centre + (body[:, LENGTH] - body[:, CENTRE])[:, None] * axis,
        speed_max=summary["speed_max"],
        speed_mean=mean,
        energy_max=summary["energy_max"] * body[:, MASS],
        jump_max=summary["jump_max"],
        height_max=summary["height_max"],
        tree_hits=summary["tree_hits"],
        barrier_hits=summary["barrier_hits"],
        energy_error=summary["energy_error"],
        penetration_max=np.maximum(summary["penetration"], summary["overlap"]),
        overlap_max=summary["overlap"],
        residual_max=summary["residual"],
        unconverged=summary["unconverged"],
        steps=summary["steps"],
        grip=summary["grip"],
        started_in_contact=summary["started_in_contact"],
        reach=touched,
        reach_time=np.where(np.isfinite(touch_time), touch_time, np.nan),
        barrier_reached=fences,
        barrier_crossed=crossed,
        last_state=state,
        frame=start.frame,
        poses=Poses(log_row, table[:, 0], position, base, tip, *(table[:, k].copy() for k in (10, 11, 12, 13))),
        hits=hits_of(hits, origin, body[:, MASS]),
        influences=influences_of(notes, scene.arrays.cores.solid),
        cost={
            "steps": float(summary["steps"].sum()),
            "airborne_steps": float(summary["airborne"].sum()),
            "contacts": float(summary["contacts"].sum()),
            "sweeps": float(summary["sweeps"].sum()),
            "cpu_s": cpu,
        },
    )
