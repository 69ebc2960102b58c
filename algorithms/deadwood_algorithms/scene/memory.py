"""How much memory sliding takes on so many cells, and how much is free: said before the work, not by a killed run."""

from __future__ import annotations

import os
from pathlib import Path

from deadwood_algorithms.tool import Feedback, UserError

# Bytes a cell: heights as read, for the kernels, and their roughness (4 each); writing the rasters and the copies that
# numpy makes on the way (28, measured on 16 million cells); friction that differs by cell (8, and 8 while it is read).
SCENE_BYTES, WRITING_BYTES, FRICTION_BYTES = 12, 28, 16
RASTER_BYTES = 24  # a cell and thread
SHARE = 0.9  # of the free memory may be asked for
GIB = 2.0**30
MOST_THREADS, MOST_A_CORE = 64, 4  # or, on a large machine, so many for each core; more gain nothing


def threads_that_fit(wanted: int, cells: int, *, friction_by_cell: bool, what: str, feedback: Feedback) -> int:
    """The threads wanted, or as many as help and as there is memory for; results are the same with any number.

    Raises
    ------
    UserError
        where not even one fits: what is needed, what there is, and the mend
    """
    cores = os.cpu_count() or 1
    most = max(MOST_THREADS, MOST_A_CORE * cores)
    if wanted > most:
        feedback.note(f"--threads {wanted}: {most} threads are used, for more gain nothing on {cores} cores")
        wanted = most
    free = free_bytes()
    base = cells * (SCENE_BYTES + WRITING_BYTES + (FRICTION_BYTES if friction_by_cell else 0))
    if free is None or base + wanted * cells * RASTER_BYTES <= SHARE * free:
        return wanted
    fitting = int((SHARE * free - base) // (cells * RASTER_BYTES))
    if fitting < 1:
        raise UserError(
            f"{what}: {cells / 1e6:.0f} million cells need {(base + cells * RASTER_BYTES) / GIB:.1f} GB of memory, "
            f"{free / GIB:.1f} GB are free; slide the releases of each area apart, or take a coarser DEM "
            "(gdalwarp -tr 2 2 -r average)"
        )
    feedback.note(f"{fitting} threads are used instead of {wanted}, for which the memory does not suffice")
    return fitting


def free_bytes() -> int | None:
    """Memory that this process may still take; None where the system does not tell."""
    known = [each for each in (_available(), _of_container()) if each is not None]
    return min(known) if known else None


def _available() -> int | None:
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
    except (OSError, ValueError):
        pass
    try:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def _of_container() -> int | None:
    """What a Linux container's own limit leaves; files that are merely cached can be dropped and do not count."""
    folder = Path("/sys/fs/cgroup")
    try:
        limit, used = (folder / "memory.max").read_text().strip(), int((folder / "memory.current").read_text())
        facts = dict(line.split() for line in (folder / "memory.stat").read_text().splitlines())
        return None if limit == "max" else max(0, int(limit) - used + int(facts.get("inactive_file", 0)))
    except (OSError, ValueError):
        return None
