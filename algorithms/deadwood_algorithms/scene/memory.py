"""How much memory sliding takes on so many cells, and how much is free: said before the work, not by a killed run."""

from __future__ import annotations

from deadwood_algorithms.files import mends
from deadwood_algorithms.files.free_memory import GIB, SHARE, free_bytes
from deadwood_algorithms.tool import Feedback, UserError

# Bytes a cell: heights as read, for the kernels, and their roughness (4 each); writing the rasters and the copies that
# numpy makes on the way (28, measured on 16 million cells); friction that differs by cell (8, and 8 while it is read).
SCENE_BYTES, WRITING_BYTES, FRICTION_BYTES = 12, 28, 16
RASTER_BYTES = 24  # a cell and thread
LOG_BYTES = 1500  # a released log: read, slid, written


def threads_that_fit(
    wanted: int, cells: int, *, friction_by_cell: bool, what: str, feedback: Feedback, cell: float = 1.0
) -> int:
    """The threads wanted, or as many as there is memory for; results are the same with any number.

    ``what`` is the DEM's path, ``cell`` the side of its cells [m], for the mend.

    Raises
    ------
    UserError
        where not even one fits: what is needed, what there is, and the mend
    """
    free = free_bytes()
    base = cells * (SCENE_BYTES + WRITING_BYTES + (FRICTION_BYTES if friction_by_cell else 0))
    if free is None or base + wanted * cells * RASTER_BYTES <= SHARE * free:
        return wanted
    fitting = int((SHARE * free - base) // (cells * RASTER_BYTES))
    if fitting < 1:
        raise UserError(
            f"{what}: {cells / 1e6:.0f} million cells need {(base + cells * RASTER_BYTES) / GIB:.1f} GB of memory, "
            f"{free / GIB:.1f} GB are free; slide the releases of each area apart, or take a coarser DEM "
            f"({mends.coarser(what, 2.0 * cell)})"
        )
    feedback.note(f"{fitting} threads are used instead of {wanted}, for which the memory does not suffice")
    return fitting


def refuse_too_many(count: int, things: str, what: str, *, each: int, mend: str) -> None:
    """Raise ``UserError`` where so many things, of so many bytes each, do not fit into the memory that is free."""
    free = free_bytes()
    if free is not None and count * each > SHARE * free:
        raise UserError(
            f"{what}: {count} {things} need {count * each / GIB:.1f} GB of memory, {free / GIB:.1f} GB are free; {mend}"
        )
