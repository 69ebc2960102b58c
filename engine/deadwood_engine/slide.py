"""Slide many logs through a scene on all cores: the entry point of the engine.

Logs are independent. One call of ``slide_logs`` computes several of them on a plain thread and releases the GIL;
workers take the next ones as they become free. The numbers of a log depend on the log alone, and maxima and counts do
not depend on the order, so results are bitwise identical with any number of threads.
"""

from __future__ import annotations

import threading
import time as clock
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import trace, trajectory
from .cloud import Shape
from .cores import BARRIER, LYING, TREE
from .fidelity import Fidelity, longest_travel, station_spacing, trace_step, where_things_rebound
from .influence import NOTE, NOTED
from .ledger import HIT_WIDTH
from .limits import GRAVITY, LEAST_STATIONS, MOST_STAGES, STAGE_STEPS
from .log_body import BODY_WIDTH, LENGTH
from .logs import Logs, Start, place_logs, stations_for
from .model import Model, Settings
from .rasters import Rasters, raster_arrays
from .result import Result, result_of
from .rotation import STATE_WIDTH
from .scene import Scene
from .scratch import Scratch
from .stages import StageKeeper, Stages, StageTable
from .way import SUMMARY

Array = NDArray[np.float64]


LOGS_A_CALL = 16  # logs per call at most; passing a scene costs as much as ten steps, and other workers wait for it
POSES_AT_ONCE = 16384  # room for the poses of all logs of a call; only pages that are written to take memory


class Interrupted(Exception):
    """The caller's report requested a stop; nothing of the interrupted logs is kept."""


def slide(
    scene: Scene,
    logs: Logs | Start,
    fidelity: Fidelity,
    *,
    restitution: float = 0.0,
    rolling_friction: float = 0.1,
    tree_friction: float | None = None,
    tree_restitution: float | None = None,
    barrier_friction: float | None = None,
    barrier_restitution: float | None = None,
    time_limit: float = 300.0,
    rest_speed: float = 0.1,
    threads: int = 1,
    keep_poses: NDArray[np.bool_] | None = None,
    rasters: Rasters | None = None,
    report: Callable[[int], bool] | None = None,
    gravity: float = GRAVITY,
    shape: Shape | None = None,
    inside: NDArray[np.bool_] | None = None,
    influences: bool = False,
    stages: Stages | None = None,
    going_on: NDArray[np.int64] | None = None,
    until_reached: bool = False,
    friction_max: float | None = None,
    friction_kappa: float = 0.0,
    friction_beta: float = 0.0,
    soil_strength: float | None = None,
    scar_drag: float = 0.0,
) -> Result:
    """Slide logs until each rests, is held, leaves the terrain, or reaches the time limit.

    Parameters
    ----------
    scene, logs, fidelity : what slides where, and how accurately
    restitution : [-] Newton's coefficient of the ground
    rolling_friction : [-] moment that resists rolling, relative to the ground's impulse times the log's radius
    (``rolling``)
    tree_friction, tree_restitution : [-] of stems and lying logs; None: those of the ground there
    barrier_friction, barrier_restitution : [-] of barriers, likewise
    time_limit : [s]; rest_speed : [m/s] below which a log is tested for rest
    threads : workers; keep_poses : bool (n,), logs whose poses are stored; rasters : added to
    shape : the body that slides instead of logs; logs given as a Start must have been placed with it
    inside : bool (n, lines), for danger: lines that contain a log's start and are reached by its first outline
    influences : record which obstacles mattered to each log (``influence``); affects nothing else
    stages : with influences, filled with checkpoints of the logs (``stages``); affects nothing else. If trees
        can break, none are stored: logs are continued from their release
    going_on : int64 (n,), rows of the stages from which the logs are continued, -1: from their start, in this scene or
        in one ``Scene.without`` what was entered later; hits, their numbers, poses and rasters cover what follows
    until_reached : a log that has reached every line, except those that it is ``inside``, ends there, with -1 as the
        stop reason
    friction_max, friction_kappa, friction_beta : [-, 1/m, 1/s] of a shape: the friction of the ground grows with slip,
    from
        the scene's to friction_max (``slip``); None: it does not
    soil_strength, scar_drag : [MN/m2, -] of a shape: it penetrates the ground, which slows it down (``scarring``);
    None: it
        does not
    report : called about five times a second with the number of logs done; returning True stops the run

    Raises
    ------
    Interrupted
        if ``report`` requested a stop
    """
    if report is not None and report(0):  # a short run may be finished before the first report
        raise Interrupted
    start = logs if isinstance(logs, Start) else place_logs(scene, logs, shape, threads)
    number = len(start.state)
    _check_tables(scene, start, rasters, keep_poses)
    arrays = scene.arrays._replace(cloud=shape.cloud) if shape else scene.arrays
    cell = arrays.terrain.cell
    stems = float(restitution if tree_restitution is None else tree_restitution)
    fences = float(restitution if barrier_restitution is None else barrier_restitution)
    fidelity = fidelity_in(scene, fidelity, restitution, stems, fences)
    breaks = bool(np.isfinite(arrays.cores.solid["capacity"]).any())
    settings = Settings(
        time_step=float(fidelity.time_step),
        travel=float(longest_travel(fidelity, cell)),
        roll_angle=float(fidelity.roll_angle),
        tolerance=float(fidelity.tolerance),
        sweeps=int(fidelity.sweeps),
        trace_step=float(trace_step(fidelity, cell)),
        restitution=float(restitution),
        time_limit=float(time_limit),
        rest_speed=float(rest_speed),
        gravity=float(gravity),
        obstacle_travel=float(fidelity.obstacle_travel),
        ring_points=int(fidelity.ring_points),
        backward=bool(fidelity.backward),
        rolling_friction=float(rolling_friction),
        tree_friction=-1.0 if tree_friction is None else float(tree_friction),
        tree_restitution=stems,
        barrier_friction=-1.0 if barrier_friction is None else float(barrier_friction),
        barrier_restitution=fences,
        stage_steps=0 if stages is None or going_on is not None or breaks else STAGE_STEPS,
        until_reached=bool(until_reached),
        breaks=breaks,
        smooth_kinks=float(fidelity.smooth_kinks),
        **_slip_law(shape, friction_max, friction_kappa, friction_beta),
        **_scar_law(shape, soil_strength, scar_drag),
    )
    stations = stations_for(start.body[:, LENGTH], station_spacing(fidelity, cell))
    keep = np.zeros(number, np.bool_) if keep_poses is None else np.asarray(keep_poses, np.bool_)
    state = start.state.copy()
    summary = np.zeros(number, SUMMARY).view(np.recarray)
    lines, barriers = scene.line_count, scene.barrier_count
    touched, fences, crossed = (np.zeros((number, n), np.bool_) for n in (lines, barriers, barriers))
    touch_time = np.full((number, lines), np.inf)
    poses: dict[int, Array] = {}
    hits: dict[int, Array] = {}
    notes: dict[int, Any] = {}
    stop = np.zeros(1, np.uint8)
    workers = max(1, min(threads, number, len(rasters.workers) if rasters else threads))
    chunk = max(1, min(LOGS_A_CALL, number // (4 * workers)))
    queue = iter(range(0, number, chunk))
    within = np.zeros((number, lines), np.bool_) if inside is None else np.ascontiguousarray(inside, np.bool_)
    if within.shape != (number, lines):
        raise ValueError(f"inside must say so for each of {number} logs and {lines} lines")
    marks = trace.Marks(touched, fences, crossed, touch_time, within)
    keeper = StageKeeper()
    begins = np.full(number, -1) if going_on is None else np.ascontiguousarray(going_on, np.int64)
    table = StageTable.allocate(0, lines, barriers) if stages is None or going_on is None else stages.table
    if settings.stage_steps and not influences:
        raise ValueError("stages are kept by what is noted: ask for influences, too")
    if begins.shape != (number,) or (begins >= len(table.state)).any():
        raise ValueError(f"going_on must name a stage for each of {number} logs")
    if (begins >= 0).any() and (table.lines.shape[1], table.fences.shape[1]) != (lines, barriers):
        raise ValueError("the stages are not of this scene's lines and barriers")
    model, stamps = Model(*arrays, settings), _stamps(number)
    batch = trajectory.Batch(start.frame, start.state, start.body, stations, stamps, keep, begins)
    lock = threading.Lock()
    done = [0] * workers
    cpu = [0.0] * workers
    failures: list[BaseException] = []

    def work(worker: int) -> None:
        began = clock.thread_time()
        rows = arrays.terrain.heights.shape[0]
        raster = rasters.workers[worker] if rasters else raster_arrays((0, 0))
        scratch = Scratch.allocate(
            int(stations.max(initial=LEAST_STATIONS)),
            len(arrays.cores.solid),
            rows,
            arrays.cloud,
            influences,
        )
        stored = StageTable.allocate(MOST_STAGES, lines, barriers) if settings.stage_steps else table
        room, hit_room = np.zeros((POSES_AT_ONCE, trace.POSE_WIDTH)), np.zeros((64 * chunk, HIT_WIDTH))
        note_room = np.zeros(64 * chunk if influences else 0, NOTE).view(np.recarray)
        while not stop[0]:
            with lock:
                row = next(queue, number)
            last = min(row + chunk, number)
            if row == last:
                break
            while row < last and not stop[0]:
                results = trajectory.Results(raster, marks, room, hit_room, note_room, state, summary)
                reached, wanted = trajectory.slide_logs(model, batch, scratch, results, stored, (row, last), stop)
                if reached == row:
                    # Sliding again with more room gives the same bits, and the stamp prevents hits from counting twice.
                    if keep[row] and wanted > len(room):
                        room = np.zeros((2 * wanted, trace.POSE_WIDTH))
                    told = scratch.summary[0]
                    if told.hits > len(hit_room):
                        hit_room = np.zeros((2 * len(hit_room), HIT_WIDTH))
                    if told.influences > len(note_room):
                        note_room = np.zeros(2 * len(note_room), NOTE).view(np.recarray)
                elif settings.stage_steps:
                    keeper.add(row, stored, scratch.notes.rows, int(scratch.notes.book[NOTED]))
                first = noted = posed = 0
                for each in range(row, reached):
                    struck = summary[each].hits
                    if struck:
                        hits[each] = hit_room[first : first + struck].copy()
                    first += struck
                    mattered = summary[each].influences
                    if mattered:
                        notes[each] = note_room[noted : noted + mattered].copy()
                    noted += mattered
                    if keep[each]:
                        poses[each] = room[posed : posed + summary[each].poses].copy()
                        posed += len(poses[each])
                done[worker] += reached - row
                row = reached
        cpu[worker] = clock.thread_time() - began

    def guarded(worker: int) -> None:
        try:
            work(worker)
        except BaseException as failure:  # raised again in the caller's thread
            failures.append(failure)
            stop[0] = 1

    pool = [threading.Thread(target=guarded, args=(k,), daemon=True) for k in range(workers)]
    try:
        for thread in pool:
            thread.start()
        while alive := [thread for thread in pool if thread.is_alive()]:
            alive[-1].join(0.2)
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
    if stages is not None and settings.stage_steps:
        keeper.fill(stages, arrays.cores.solid)
    return result_of(scene, start, state, summary, poses, hits, notes, touched, touch_time, fences, crossed, sum(cpu))


def fidelity_in(
    scene: Scene,
    fidelity: Fidelity,
    restitution: float,
    tree_restitution: float | None,
    barrier_restitution: float | None,
) -> Fidelity:
    """The row with which logs slide in a scene: the one for restitution, if anything in the scene rebounds."""
    stems = restitution if tree_restitution is None else tree_restitution
    fences = restitution if barrier_restitution is None else barrier_restitution
    # of the obstacles present (``Scene.without``)
    kinds = scene.arrays.cores.solid["kind"][scene.arrays.cores.index.items]
    wood, plates = bool(np.isin(kinds, (TREE, LYING)).any()), bool((kinds == BARRIER).any())
    return where_things_rebound(fidelity, restitution, stems * wood, fences * plates)


def _slip_law(shape: Shape | None, most: float | None, kappa: float, beta: float) -> dict[str, float]:
    """The dependence of friction on slip, as fields of ``Settings``; none for logs."""
    if most is None:
        return {}
    if shape is None:
        raise ValueError("friction that grows with slip is of bodies of points; give a shape")
    if not (np.isfinite([most, kappa, beta]).all() and most >= 0.0 and kappa > 0.0 and beta >= 0.0):
        raise ValueError(
            "friction_kappa must be more than nothing, friction_max and friction_beta at least nothing, "
            f"not {kappa}, {most} and {beta}"
        )
    return {"friction_max": float(most), "friction_kappa": float(kappa), "friction_beta": float(beta)}


def _scar_law(shape: Shape | None, strength: float | None, drag: float) -> dict[str, float]:
    """The strength of the ground, as fields of ``Settings``; for logs it is hard."""
    if strength is None:
        return {}
    if shape is None:
        raise ValueError("only bodies of points scar the ground; give a shape")
    if not (np.isfinite([strength, drag]).all() and strength > 0.0 and drag >= 0.0):
        raise ValueError(
            f"soil_strength must be more than nothing, and scar_drag at least nothing, not {strength} and {drag}"
        )
    return {"strength": 1000.0 * float(strength), "scar_drag": float(drag)}


def _check_tables(scene: Scene, start: Start, rasters: Rasters | None, keep_poses: NDArray[np.bool_] | None) -> None:
    """Kernels do not check the lengths of tables: they must belong to one scene and have one row per log."""
    number, grid = len(start.state), scene.arrays.terrain.heights.shape
    if start.state.shape != (number, STATE_WIDTH) or start.body.shape != (number, BODY_WIDTH):
        raise ValueError(f"states and bodies must have {STATE_WIDTH} and {BODY_WIDTH} columns, one row a log")
    if start.frame.shape != (number, 2):
        raise ValueError("every log needs its frame, a DEM node")
    if keep_poses is not None and np.shape(keep_poses) != (number,):
        raise ValueError(f"keep_poses must say so for each of the {number} logs")
    if rasters and any(worker.deposits.shape not in (grid, (0, 0)) for worker in rasters.workers):
        raise ValueError("the rasters are not of this scene's grid")
    if rasters and any(len(worker.band) not in (0, scene.line_count) for worker in rasters.workers):
        raise ValueError("the rasters are not of this scene's lines")


_stamped = 0
_stamp_lock = threading.Lock()


def _stamps(number: int) -> NDArray[np.int64]:
    """Stamps for the rasters that no log of this process had before (rasters outlive a call)."""
    global _stamped
    with _stamp_lock:
        first = _stamped
        _stamped += number
    return np.arange(first, first + number)
