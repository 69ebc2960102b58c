"""Slide many logs through a scene on all cores: the engine's front door.

Logs are independent. Each is computed by one call of ``slide_log``, which releases the GIL, on a plain thread; workers
take the next log as they become free. Every log's numbers depend on the log alone, maxima and counts do not depend on
order, so results are the same bits with any number of threads.
"""

from __future__ import annotations

import threading
import time as clock
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import step, trace
from .fidelity import Fidelity, station_spacing
from .limits import GRAVITY, LEAST_STATIONS
from .log_body import BASE_RADIUS, CENTRE, LENGTH, MASS, TIP_RADIUS, cone_bodies
from .rotation import quaternion_from_axis
from .scene import Scene
from .terrain import surface
from .trace import RasterArrays

Array = NDArray[np.float64]

UPRIGHT, LYING, TILTED = range(3)


class Interrupted(Exception):
    """The caller's report asked to stop; nothing of the interrupted logs is kept."""


@dataclass(frozen=True)
class Logs:
    """Released logs; arrays of shape (n,).

    log_id : int64; x, y : plan position of the centre of mass [m]; diameter, length [m]; density [kg/m3]
    orientation : int8, 0 upright (base down), 1 lying (axis in the terrain's tangent plane), 2 tilted
    tilt : [rad] from the vertical; azimuth : [rad] clockwise from north, where the tip points
    speed : [m/s] towards the azimuth in the tangent plane; drop : [m] clearance of the lowest point
    """

    log_id: NDArray[np.int64]
    x: Array
    y: Array
    diameter: Array
    length: Array
    density: Array
    orientation: NDArray[np.int8]
    tilt: Array
    azimuth: Array
    speed: Array
    drop: Array

    def __len__(self) -> int:
        return len(self.x)

    def take(self, rows: NDArray | slice) -> Logs:
        """The logs of these rows."""
        return Logs(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))

    @staticmethod
    def alike(x: Array, y: Array, *, diameter: float = 0.75, length: float = 30.0, **values: float) -> Logs:
        """Logs that differ in position only; further fields by name, else 300 kg/m3, upright, at rest on the ground."""
        x, y = np.atleast_1d(np.asarray(x, float)), np.atleast_1d(np.asarray(y, float))
        fields = {"density": 300.0, "orientation": UPRIGHT, "tilt": 0.0, "azimuth": 0.0, "speed": 0.0, "drop": 0.0}
        fields |= {"diameter": diameter, "length": length} | values
        full = {k: np.full(len(x), v, dtype=np.int8 if k == "orientation" else float) for k, v in fields.items()}
        return Logs(log_id=np.arange(len(x)), x=x, y=y, **full)


@dataclass(frozen=True)
class Start:
    """Placed logs, ready to slide.

    frame : int64 (n, 2), DEM node (column, row) of each log's own frame
    state : (n, 16), initial state in that frame (``rotation`` names the columns); body : (n, 7), ``log_body``
    """

    frame: NDArray[np.int64]
    state: Array
    body: Array


@dataclass(frozen=True)
class Poses:
    """Poses kept along the way, ordered by log row, then time; world coordinates [m].

    log_row : int64 (m,); time [s], speed [m/s], spin [rad/s], clearance [m] (m,); position, base, tip (m, 3)
    """

    log_row: NDArray[np.int64]
    time: Array
    position: Array
    base: Array
    tip: Array
    speed: Array
    spin: Array
    clearance: Array


@dataclass(frozen=True)
class Result:
    """What became of each log; row i belongs to row i of the logs. World coordinates, SI units.

    stop_reason : int8, index into STOP_REASONS; stop_item : row of the tree or barrier that holds the log, else -1
    energy_error : [-] energy gained from contacts and lost by the books, over the energy spent
    penetration_max : [m] deepest contact, overlap_max : with a tree or barrier alone
    residual_max : [m/s] of the contact solver's last sweep
    speed_max, speed_mean, and the velocities of last_state : [m/s] at the middle of a step
    tree_hits, barrier_hits : number of different trees and barriers that pushed the log
    reach, reach_time : (n, lines), whether and when [s] the log's outline first touched a line
    barrier_reached, barrier_crossed : (n, barriers), outline touched, centre of mass crossed its line in plan
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
    tree_hits: NDArray[np.int64]
    barrier_hits: NDArray[np.int64]
    energy_error: Array
    penetration_max: Array
    overlap_max: Array
    residual_max: Array
    unconverged: NDArray[np.int64]
    steps: NDArray[np.int64]
    started_in_contact: NDArray[np.bool_]
    reach: NDArray[np.bool_]
    reach_time: Array
    barrier_reached: NDArray[np.bool_]
    barrier_crossed: NDArray[np.bool_]
    last_state: Array
    frame: NDArray[np.int64]
    poses: Poses
    cost: dict[str, float]


class Rasters:
    """Rasters that runs add to, one set a worker; ``totals`` puts them together."""

    def __init__(self, workers: list[RasterArrays]) -> None:
        self.workers = workers

    @staticmethod
    def allocate(scene: Scene, workers: int) -> Rasters:
        """Empty rasters of the scene's grid: 24 bytes a cell and worker."""
        shape = scene.arrays.terrain.heights.shape
        return Rasters([_raster_arrays(shape) for _ in range(max(1, workers))])

    def totals(self) -> dict[str, NDArray]:
        """hit_count, deposit_count (uint32); speed_max [m/s], energy_max [J], jump_max [m] (float32, NaN = no log)."""
        first, *others = self.workers
        hits, deposits = first.hits.copy(), first.deposits.copy()
        maxima = [first.speed.copy(), first.energy.copy(), first.jump.copy()]
        for other in others:
            hits += other.hits
            deposits += other.deposits
            for total, part in zip(maxima, (other.speed, other.energy, other.jump), strict=True):
                np.maximum(total, part, out=total)
        for total in maxima:
            total[hits == 0] = np.nan
        return {
            "hit_count": hits,
            "deposit_count": deposits,
            "speed_max": maxima[0],
            "energy_max": maxima[1],
            "jump_max": maxima[2],
        }

    def add(self, totals: dict[str, NDArray]) -> None:
        """Add totals of an earlier run (a resumed one)."""
        first = self.workers[0]
        first.hits[...] += totals["hit_count"]
        first.deposits[...] += totals["deposit_count"]
        for mine, name in ((first.speed, "speed_max"), (first.energy, "energy_max"), (first.jump, "jump_max")):
            np.fmax(mine, totals[name], out=mine)


def _raster_arrays(shape: tuple[int, int]) -> RasterArrays:
    return RasterArrays(
        np.zeros(shape, np.uint32),
        np.zeros(shape, np.uint32),
        np.zeros(shape, np.uint32),
        np.zeros(shape, np.float32),
        np.zeros(shape, np.float32),
        np.zeros(shape, np.float32),
    )


def place_logs(scene: Scene, logs: Logs) -> Start:
    """Put logs on the terrain: oriented, and lifted or lowered until the lowest gap is ``drop``.

    Raises
    ------
    ValueError
        when a log's centre of mass is not on the terrain, or a dimension is not positive
    """
    terrain = scene.arrays.terrain
    body = cone_bodies(logs.diameter, logs.length, logs.density)
    ground = scene.terrain_surface(logs.x, logs.y)
    if not np.isfinite(ground[:, 0]).all():
        raise ValueError(f"log in row {int(np.flatnonzero(~np.isfinite(ground[:, 0]))[0])} is not on the terrain")
    east, north = np.sin(logs.azimuth), np.cos(logs.azimuth)
    downhill = np.column_stack([east, north, ground[:, 1] * east + ground[:, 2] * north])
    downhill /= np.linalg.norm(downhill, axis=1, keepdims=True)
    sine = np.sin(logs.tilt)
    axis = np.column_stack([sine * east, sine * north, np.cos(logs.tilt)])
    axis[logs.orientation == UPRIGHT] = (0.0, 0.0, 1.0)
    lying = logs.orientation == LYING
    axis[lying] = downhill[lying]
    plan = np.column_stack([logs.x - terrain.x0, logs.y - terrain.y0])
    frame = np.floor(plan * terrain.inverse_cell).astype(np.int64)
    state = np.zeros((len(logs), 16))
    state[:, 0:2] = plan - frame * terrain.cell
    state[:, 3:7] = quaternion_from_axis(axis)
    state[:, 7:10] = logs.speed[:, None] * downhill
    state[:, 13:16] = axis
    _lift(terrain, frame, state, body, logs.drop)
    return Start(frame, state, body)


@step.kernel
def _lift(terrain, frame, state, body, drop):
    """Set each log's height so that the least vertical gap of its surface points is ``drop``."""
    for n in range(state.shape[0]):
        dx, dy, dz = state[n, 13], state[n, 14], state[n, 15]
        length, centre = body[n, LENGTH], body[n, CENTRE]
        rings = max(LEAST_STATIONS, int(np.ceil(2.0 * length / terrain.cell)) + 1)
        plan = np.sqrt(dx * dx + dy * dy)
        lx, ly = (-dy / plan, dx / plan) if plan > 1e-12 else (1.0, 0.0)
        # second diameter of the rings: d x lateral
        mx, my, mz = -dz * ly, dz * lx, dx * ly - dy * lx
        least = np.inf
        for k in range(rings):
            along = length * k / (rings - 1)
            a = body[n, BASE_RADIUS] + (body[n, TIP_RADIUS] - body[n, BASE_RADIUS]) * along / length
            s = along - centre
            for m in range(32):
                c, e = a * np.cos(np.pi * m / 16), a * np.sin(np.pi * m / 16)
                height, _, _ = surface(
                    terrain, frame[n, 0], frame[n, 1], state[n, 0] + s * dx + c * lx + e * mx,
                    state[n, 1] + s * dy + c * ly + e * my,
                )  # fmt: skip
                gap = s * dz + e * mz - height
                if gap < least:
                    least = gap
        state[n, 2] = drop[n] - least


def stations_for(length: Array, spacing: float) -> NDArray[np.int64]:
    """Number of contact rings of logs of these lengths."""
    return np.maximum(LEAST_STATIONS, np.ceil(length / spacing - 1e-9).astype(np.int64) + 1)


def slide(
    scene: Scene,
    logs: Logs | Start,
    fidelity: Fidelity,
    *,
    restitution: float = 0.0,
    time_limit: float = 300.0,
    rest_speed: float = 0.1,
    threads: int = 1,
    keep_poses: NDArray[np.bool_] | None = None,
    rasters: Rasters | None = None,
    report: Callable[[int], bool] | None = None,
    gravity: float = GRAVITY,
) -> Result:
    """Slide logs until each rests, is held, leaves the terrain, or runs out of time.

    Parameters
    ----------
    scene, logs, fidelity : what slides where, and how exactly
    restitution : [-] Newton's coefficient for all contacts
    time_limit : [s]; rest_speed : [m/s] below which a log is looked at for rest
    threads : workers; keep_poses : bool (n,), whose poses to keep; rasters : added to
    report : called about five times a second with the number of logs done; True stops the run

    Raises
    ------
    Interrupted
        when ``report`` asked to stop
    """
    start = logs if isinstance(logs, Start) else place_logs(scene, logs)
    number = len(start.state)
    arrays = scene.arrays
    cell = arrays.terrain.cell
    settings = step.Settings(
        float(fidelity.time_step), float(fidelity.travel_cells * cell), float(fidelity.tolerance), int(fidelity.sweeps),
        float(fidelity.trace_cells * cell), float(restitution), float(time_limit), float(rest_speed), float(gravity),
    )  # fmt: skip
    stations = stations_for(start.body[:, LENGTH], station_spacing(fidelity, cell))
    keep = np.zeros(number, np.bool_) if keep_poses is None else np.asarray(keep_poses, np.bool_)
    state = start.state.copy()
    summary = np.zeros((number, step.SUMMARY_WIDTH))
    lines, barriers = scene.line_count, scene.barrier_count
    touched, fences, crossed = (np.zeros((number, n), np.bool_) for n in (lines, barriers, barriers))
    touch_time = np.full((number, lines), np.inf)
    poses: dict[int, Array] = {}
    stop = np.zeros(1, np.uint8)
    workers = max(1, min(threads, number, len(rasters.workers) if rasters else threads))
    queue = iter(range(number))
    lock = threading.Lock()
    done = [0] * workers
    cpu = [0.0] * workers
    failures: list[BaseException] = []

    def work(worker: int) -> None:
        began = clock.thread_time()
        shape = arrays.terrain.heights.shape
        raster = rasters.workers[worker] if rasters else _raster_arrays((0, 0))
        scratch = step.Scratch.allocate(
            int(stations.max(initial=LEAST_STATIONS)), len(arrays.uprights.owner), len(arrays.plates.owner), shape[0]
        )
        room = np.zeros((4096, trace.POSE_WIDTH))
        none = np.zeros((0, trace.POSE_WIDTH))
        while not stop[0]:
            with lock:
                row = next(queue, -1)
            if row < 0:
                break
            marks = trace.Marks(touched[row], fences[row], crossed[row], touch_time[row])
            while True:
                state[row] = start.state[row]
                wanted = step.slide_log(
                    arrays, start.frame[row], state[row], start.body[row], stations[row], settings, scratch, raster,
                    row_stamp[row], marks, room if keep[row] else none, keep[row], summary[row], stop,
                )  # fmt: skip
                if not keep[row] or wanted <= len(room):
                    break
                # Sliding again with more room is the same to the bit, and the stamp keeps hits from counting twice.
                room = np.zeros((2 * wanted, trace.POSE_WIDTH))
            if (rasters and summary[row, step.REASON] < step.LEFT_DEM) or summary[row, step.REASON] == step.TIME_LIMIT:
                trace.draw_deposit(
                    arrays, start.frame[row], state[row], start.body[row], scratch.memory,
                    (scratch.points, scratch.hull, scratch.left, scratch.right), raster,
                )  # fmt: skip
            if keep[row] and not stop[0]:
                poses[row] = room[:wanted].copy()
            done[worker] += 1
        cpu[worker] = clock.thread_time() - began

    def guarded(worker: int) -> None:
        try:
            work(worker)
        except BaseException as failure:  # reported by the caller's thread
            failures.append(failure)
            stop[0] = 1

    row_stamp = _stamps(number)
    pool = [threading.Thread(target=guarded, args=(k,), daemon=True) for k in range(workers)]
    try:
        for thread in pool:
            thread.start()
        while any(thread.is_alive() for thread in pool):
            pool[-1].join(0.2) if pool[-1].is_alive() else clock.sleep(0.02)
            if report is not None and report(sum(done)):
                stop[0] = 1
    except BaseException:
        stop[0] = 1
        raise
    finally:
        for thread in pool:
            thread.join()
    if failures:
        raise failures[0]
    if stop[0]:
        raise Interrupted
    return _result(scene, start, state, summary, poses, touched, touch_time, fences, crossed, sum(cpu))


_stamped = 0
_stamp_lock = threading.Lock()


def _stamps(number: int) -> NDArray[np.int64]:
    """Numbers for the rasters' stamps that no log of this process had before (rasters outlive a call)."""
    global _stamped
    with _stamp_lock:
        first = _stamped
        _stamped += number
    return np.arange(first, first + number)


def _result(
    scene: Scene,
    start: Start,
    state: Array,
    summary: Array,
    poses: dict[int, Array],
    touched: NDArray[np.bool_],
    touch_time: Array,
    fences: NDArray[np.bool_],
    crossed: NDArray[np.bool_],
    cpu: float,
) -> Result:
    terrain = scene.arrays.terrain
    origin = np.empty((len(state), 3))
    origin[:, 0] = terrain.x0 + start.frame[:, 0] * terrain.cell
    origin[:, 1] = terrain.y0 + start.frame[:, 1] * terrain.cell
    origin[:, 2] = terrain.reference
    body = start.body
    centre = state[:, 0:3] + origin
    axis = state[:, 13:16]
    duration = summary[:, step.DURATION]
    owner = summary[:, step.ITEM].astype(np.int64)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(duration > 0, summary[:, step.PATH] / duration, 0.0)
    rows = sorted(poses)
    table = np.vstack([np.zeros((0, trace.POSE_WIDTH)), *(poses[row] for row in rows)])
    log_row = np.repeat(np.array(rows, np.int64), [len(poses[row]) for row in rows])
    shift = origin[log_row]
    columns = trace.POSE_X, trace.POSE_BASE, trace.POSE_TIP
    position, base, tip = (table[:, at : at + 3] + shift for at in columns)
    return Result(
        stop_reason=summary[:, step.REASON].astype(np.int8),
        stop_item=owner,
        duration=duration,
        path=summary[:, step.PATH],
        release_position=start.state[:, 0:3] + origin,
        end_position=centre,
        base_end=centre - body[:, CENTRE, None] * axis,
        tip_end=centre + (body[:, LENGTH] - body[:, CENTRE])[:, None] * axis,
        speed_max=summary[:, step.SPEED_MAX],
        speed_mean=mean,
        energy_max=summary[:, step.ENERGY_MAX] * body[:, MASS],
        jump_max=summary[:, step.JUMP_MAX],
        tree_hits=summary[:, step.TREE_HITS].astype(np.int64),
        barrier_hits=summary[:, step.BARRIER_HITS].astype(np.int64),
        energy_error=summary[:, step.ENERGY_ERROR],
        penetration_max=np.maximum(summary[:, step.PENETRATION], summary[:, step.OVERLAP]),
        overlap_max=summary[:, step.OVERLAP],
        residual_max=summary[:, step.RESIDUAL],
        unconverged=summary[:, step.UNCONVERGED].astype(np.int64),
        steps=summary[:, step.STEPS].astype(np.int64),
        started_in_contact=summary[:, step.STARTED_IN_CONTACT] > 0,
        reach=touched,
        reach_time=np.where(np.isfinite(touch_time), touch_time, np.nan),
        barrier_reached=fences,
        barrier_crossed=crossed,
        last_state=state,
        frame=start.frame,
        poses=Poses(log_row, table[:, 0], position, base, tip, *(table[:, k].copy() for k in (10, 11, 12))),
        cost={
            "steps": float(summary[:, step.STEPS].sum()),
            "airborne_steps": float(summary[:, step.AIRBORNE].sum()),
            "contacts": float(summary[:, step.CONTACTS].sum()),
            "sweeps": float(summary[:, step.SWEEPS].sum()),
            "cpu_s": cpu,
        },
    )
