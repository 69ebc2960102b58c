"""Time, memory and disk that a run will take, estimated from a pilot (which ``plan`` slides).

Time: that of one of the pilot's logs, times the number of logs, plus what a run takes besides sliding. Memory: the
peak of this process until the pilot's end, plus what each further log adds. Disk: the pilot's files, of which those
with one row for each log grow with the logs, and rasters with the logarithm of their number, because more logs pass
the same ground; the working folder exists beside the result until the end.
"""

from __future__ import annotations

import math
import os
import shutil
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from deadwood_algorithms.files.free_memory import GIB, SHARE, free_bytes
from deadwood_algorithms.params.counts import counted, significant
from deadwood_algorithms.params.tool import Feedback, UserError

# For results with one row per log [bytes]: memory while they are written, and size in the working folder
# per log and per cell that any log passed (two states of the rasters are kept).
LOG_MEMORY, KEPT_MEMORY, WORK_LOG, WORK_CELL = 2000, 400, 800, 2 * 40
VERTEX_MEMORY = 100  # per vertex of a trajectory, while read, thinned and written
# Bytes of a GeoPackage without rows, with its styles, and of a trajectory's row beside its vertices: measured on 400 to
# 40 000 logs.
EMPTY_LAYERS, TRAJECTORY_ROW = 220_000, 300
RASTER_DECADE = 0.9  # relative growth of a raster's file with ten times the logs; 0.5 to 0.9 measured
WRITE_S = 0.5e-3  # per log, to collect and write its rows
# Smallest size of a run, per log, and per log with trajectory, including the working folder: no run with less has been
# seen, so nothing is started if not even that is free.
LEAST_RUN_DISK, LEAST_LOG_DISK, LEAST_KEPT_DISK = 180_000, 1000, 3000
# What a run takes at most of the time, including the working folder, per log and per log with trajectory: on a path of
# 150 m, 1 to 200 logs took 0.5 to 0.97 of it. What is kept of a path grows with its length: where the way to the end of
# the terrain model is 1.4 km, and not the PATH_M of that slope, 40 logs took 0.8 of it.
RUN_DISK, LOG_DISK, KEPT_DISK, PATH_M = 400_000, 15_000, 18_000, 240.0


@dataclass(frozen=True)
class Pilot:
    """The cost of the pilot.

    Attributes
    ----------
    logs, kept : logs that were slid; those of them whose trajectory is stored
    cpu_s, slide_s, other_s : processor time and wall time of the sliding, wall time of everything else
    memory : peak memory of the process [bytes]
    files : size of each file by its name
    passed_cells : number of cells that any log passed
    vertices : number of vertices of all trajectories
    spread : standard deviation over mean of the time for which a log is slid
    again : what the run slides besides its logs, in logs
    """

    logs: int
    kept: int
    cpu_s: float
    slide_s: float
    other_s: float
    memory: int
    files: Mapping[str, int]
    passed_cells: int
    vertices: int
    spread: float
    again: float = 0.0


@dataclass(frozen=True)
class Forecast:
    """What the run will take; sizes in bytes, times in seconds. ``off`` is the half-width of the 95 % interval of the
    time, relative to it; ``again_s`` the part of ``cpu_s`` for logs that slide again."""

    logs: int
    kept: int
    pilot_logs: int
    cpu_s: float
    off: float
    memory: int
    disk: int
    disk_at_end: int
    wall_s: float
    threads: int
    workers: int
    workers_s: float
    again_s: float = 0.0


def forecast(pilot: Pilot, logs: int, kept: int, *, threads: int, workers: int) -> Forecast:
    """Forecast for these logs, of which ``kept`` keep their trajectory."""
    times, more = logs / pilot.logs, max(0, logs - pilot.logs)
    times_slid = (logs + pilot.again) / pilot.logs
    more_kept = max(0, kept - pilot.kept)
    a_trajectory = pilot.vertices / max(pilot.kept, 1)
    memory = pilot.memory + more * LOG_MEMORY + round(more_kept * (KEPT_MEMORY + VERTEX_MEMORY * a_trajectory))
    poses = pilot.files.get("poses.parquet", 0) * kept / max(pilot.kept, 1)
    lines = pilot.vertices * 24 + pilot.kept * TRAJECTORY_ROW  # x, y, z for each vertex
    rows = max(0, pilot.files.get("run.gpkg", 0) - EMPTY_LAYERS - lines) * times
    package = EMPTY_LAYERS + rows + lines * kept / max(pilot.kept, 1)
    decades = math.log10(max(times, 1.0))
    rasters = {name: size for name, size in pilot.files.items() if name.endswith(".tif")}
    if "danger.tif" in rasters:  # is empty where few logs passed, as usual in a pilot
        rasters["danger.tif"] = max(rasters["danger.tif"], rasters["speed_max.tif"])
    grown = sum(rasters.values()) * (1.0 + RASTER_DECADE * decades)
    others = sum(pilot.files.values()) - pilot.files.get("poses.parquet", 0) - pilot.files.get("run.gpkg", 0)
    at_end = poses + package + grown + others - sum(size for name, size in pilot.files.items() if name.endswith(".tif"))
    work = poses + logs * WORK_LOG + pilot.passed_cells * (1.0 + 0.5 * decades) * WORK_CELL
    beside = pilot.other_s + more * WRITE_S
    return Forecast(
        logs=logs,
        kept=kept,
        pilot_logs=pilot.logs,
        cpu_s=pilot.cpu_s * times_slid,
        off=1.96 * pilot.spread / math.sqrt(pilot.logs) if logs > pilot.logs else 0.0,
        memory=memory,
        disk=round(at_end + work),
        disk_at_end=round(at_end),
        wall_s=pilot.slide_s * times_slid + beside,
        threads=threads,
        workers=workers,
        workers_s=pilot.slide_s * times_slid / workers + beside,
        again_s=pilot.cpu_s * pilot.again / pilot.logs,
    )


def together(parts: Sequence[Forecast]) -> Forecast:
    """Several runs in sequence: times and disk are added, memory and the working folder are the largest ones."""
    cpu_s = sum(each.cpu_s for each in parts)
    at_end = sum(each.disk_at_end for each in parts)
    return Forecast(
        logs=sum(each.logs for each in parts),
        kept=sum(each.kept for each in parts),
        pilot_logs=sum(each.pilot_logs for each in parts),
        cpu_s=cpu_s,
        off=math.sqrt(sum((each.off * each.cpu_s) ** 2 for each in parts)) / max(cpu_s, 1e-9),
        memory=max(each.memory for each in parts),
        disk=at_end + max(each.disk - each.disk_at_end for each in parts),
        disk_at_end=at_end,
        wall_s=sum(each.wall_s for each in parts),
        threads=max(each.threads for each in parts),
        workers=parts[0].workers,
        workers_s=sum(each.workers_s for each in parts),
        again_s=sum(each.again_s for each in parts),
    )


def refuse_too_large(found: Forecast, output: str) -> None:
    """Raise ``UserError`` if there is not enough memory or disk for the run."""
    free = free_bytes()
    if free is not None and found.memory > SHARE * (free + held_now()):
        raise UserError(
            f"{output}: {counted(found.logs, 'log')} would take {_size(found.memory)} of memory, "
            f"{_size(free + held_now())} are available; slide them in parts (run-sites), keep fewer --trajectories, or "
            "let --until-ci draw as many as it needs"
        )
    room = free_disk(output)
    if found.disk > room:
        raise UserError(
            f"{output}: {counted(found.logs, 'log')} would take {_size(found.disk)} of disk, {_size(room)} are free "
            "there; keep fewer --trajectories, or name an output on another disk"
        )


def usual_disk(logs: int, kept: int, reach_m: float = PATH_M) -> int:
    """Bytes that a run takes without a pilot to measure them, the working folder included.

    reach_m : how far [m] in plan a log may come
    """
    longer = max(0.0, reach_m / PATH_M - 1.0)
    return RUN_DISK + logs * LOG_DISK + round(kept * (KEPT_DISK + longer * (LOG_DISK + KEPT_DISK)))


def judge_disk(output: str, logs: int, kept: int, reach_m: float, feedback: Feedback) -> None:
    """Before the work: raise ``UserError`` if not even the smallest output of these logs fits on the disk, and warn if
    the usual one does not.
    """
    least, usual = LEAST_RUN_DISK + logs * LEAST_LOG_DISK + kept * LEAST_KEPT_DISK, usual_disk(logs, kept, reach_m)
    room, fix = free_disk(output), "keep fewer --trajectories, or name an output on another disk"
    words = (
        f"{output}: {counted(logs, 'log')}, of which {kept} keep their trajectory, take about {_size(usual)} of disk"
    )
    words += f", {_size(room)} are free there"
    if least > room:
        raise UserError(f"{words}, which is too little for the shortest paths; {fix}")
    if usual > room:
        feedback.warn(f"{words}; --plan measures it. {fix.capitalize()}", code="disk-small", usual=usual, free=room)


def free_disk(output: str) -> int:
    """Free bytes at the place of an output."""
    place = Path(output).absolute()
    while not place.exists():
        place = place.parent
    return shutil.disk_usage(place).free


def most_held() -> int:
    """Peak memory of this process [bytes]."""
    try:
        import resource
    except ImportError:  # Windows: estimated by what the libraries take
        return 500_000_000
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else most * 1024


def held_now() -> int:
    """Memory that this process holds now [bytes], which is not free but already its own."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, IndexError):
        return 0


def facts_of_forecast(found: Forecast, output: str) -> dict[str, Any]:
    """The forecast for programs."""
    free = {"memory_free": free_bytes(), "disk_free": free_disk(output)}
    return {**vars(found), "core_hours": found.cpu_s / 3600.0, **free}


def words_of_forecast(found: Forecast, output: str) -> tuple[str, ...]:
    """The forecast for a reader."""
    free = free_bytes()
    off = f" (±{100 * found.off:.0f} %)" if found.off else ""
    again = f", of which at most {significant(found.again_s, 2)} s for --own-slope" if found.again_s else ""
    rows = {
        "logs": f"{found.logs}, of which {found.kept} keep their trajectory",
        "core-hours": f"{significant(found.cpu_s / 3600.0, 3)}{off}{again}",
        "memory": _size(found.memory) + (f"; {_size(free)} are free" if free is not None else ""),
        "disk": f"{_size(found.disk)}, of which {_size(found.disk_at_end)} stay; {_size(free_disk(output))} are free",
        "this machine": f"{_span(found.wall_s)}, {counted(found.threads, 'thread')}",
        f"{counted(found.workers, 'worker')}": f"{_span(found.workers_s)}, each as fast as this machine",
    }
    lines = [f"{name + ':':<14} {what}" for name, what in rows.items()]
    return (*lines, f"from a pilot of {counted(found.pilot_logs, 'log')}, drawn at random; nothing was written")


def _size(count: float) -> str:
    value, unit = (count / GIB, "GB") if count >= 0.1 * GIB else (count / 2**20, "MB")
    return f"{value:.0f} {unit}" if value >= 10.0 else f"{value:.2g} {unit}"


def _span(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    if seconds < 5400.0:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.1f} h" if seconds < 48 * 3600.0 else f"{seconds / 86400.0:.1f} days"
