"""Memory needed for sliding, by the number of cells, compared with the free memory before the work starts."""

from __future__ import annotations

import os

from deadwood_algorithms.files import remedies
from deadwood_algorithms.files.free_memory import GIB, SHARE, free_bytes
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, UserError

# Bytes per cell: heights as read, for the kernels, and their roughness (4 each); writing the rasters, strip by strip
# (12, measured on 6 million cells, including GDAL's cache); friction that differs by cell (8, and 8 while it is read).
SCENE_BYTES, WRITING_BYTES, FRICTION_BYTES = 12, 12, 16
RASTER_BYTES = 28  # per cell and thread
# Danger, with lines: the list of a log's cells (once), the count of any line (once) and that of each line, per cell and
# thread. An upper bound: pages that no log reaches are never allocated.
DANGER_BYTES = 4
WORKER_BYTES = 300_000_000  # of libraries and kernels in a process of --scheduler local (measured: 250 MB)
LOG_BYTES = 800  # per released log, mostly its row as read: 370 with four columns (docs/memory.md), 620 with thirteen
MOST_THREADS, MOST_A_CORE = 64, 4  # or, on a large machine, this number per core; more have no benefit


def threads_that_fit(
    wanted: int,
    cells: int,
    *,
    friction_by_cell: bool,
    what: str,
    feedback: Feedback,
    cell: float = 1.0,
    danger_lines: int = 0,
) -> int:
    """The requested threads, or as many as are useful and fit in memory; results are the same with any number.

    ``what`` is the DEM's path, ``cell`` the side of its cells [m], for the fix; ``danger_lines`` are the lines whose
    danger is counted.

    Raises
    ------
    UserError
        if not even one fits: what is needed, what is available, and how to fix it
    """
    cores = os.cpu_count() or 1
    most = max(MOST_THREADS, MOST_A_CORE * cores)
    if wanted > most:
        feedback.note(
            f"--threads {wanted}: {counted(most, 'thread is', 'threads are')} used, because more have no benefit on "
            f"{counted(cores, 'core')}"
        )
        wanted = most
    free = free_bytes()
    base = cells * (SCENE_BYTES + WRITING_BYTES + (FRICTION_BYTES if friction_by_cell else 0))
    each = cells * RASTER_BYTES
    if danger_lines:
        each += cells * DANGER_BYTES * (danger_lines + 2)
    if free is None or base + wanted * each <= SHARE * free:
        return wanted
    fitting = int((SHARE * free - base) // each)
    if fitting < 1:
        fewer = f"watch fewer than {danger_lines} lines, " if danger_lines > 1 else ""
        raise UserError(
            f"{what}: {cells / 1e6:.0f} million cells need {(base + each) / GIB:.1f} GB of memory, "
            f"{free / GIB:.1f} GB are free; slide the releases of each area apart "
            f"(deadwood-tool run-sites --by FIELD), {fewer}or use a part of the DEM, or a coarser one "
            f"({remedies.coarser(what, 2.0 * cell)})"
        )
    feedback.note(
        f"{counted(fitting, 'thread is', 'threads are')} used instead of {wanted}, because the memory does not "
        "suffice for more"
    )
    return fitting


def refuse_too_many_workers(
    number: int, cells: int, *, friction_by_cell: bool, what: str, danger_lines: int = 0
) -> None:
    """Raise ``UserError`` if the processes, each with its own scene and rasters, do not fit into memory.

    ``what`` is the DEM's path; ``danger_lines`` are the lines whose danger is counted.
    """
    free = free_bytes()
    scene = SCENE_BYTES + (FRICTION_BYTES if friction_by_cell else 0)
    danger = DANGER_BYTES * (danger_lines + 2) if danger_lines else 0
    here = cells * (scene + WRITING_BYTES + RASTER_BYTES + danger)
    each = WORKER_BYTES + cells * (scene + RASTER_BYTES + danger)
    if free is None or here + number * each <= SHARE * free:
        return
    fitting = max(0, int((SHARE * free - here) // each))
    fix = f"--workers {fitting} fit" if fitting else "leave out --scheduler: threads share memory that processes cannot"
    raise UserError(
        f"--scheduler local: {counted(number, 'worker')} on the {cells / 1e6:.3g} million cells of {what} need "
        f"{(here + number * each) / GIB:.1f} GB of memory, {free / GIB:.1f} GB are free; {fix}"
    )


def refuse_too_many(count: int, things: str, what: str, *, each: int, fix: str) -> None:
    """Raise ``UserError`` if a number of items of a given size [bytes] does not fit into the free memory."""
    free = free_bytes()
    if free is not None and count * each > SHARE * free:
        raise UserError(
            f"{what}: {count} {things} need {count * each / GIB:.1f} GB of memory, {free / GIB:.1f} GB are free; {fix}"
        )
