"""How many of a run's logs pass over each cell, from stored trajectories."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Cancelled, Feedback
from deadwood_algorithms.results.run_folder import Run, ends_of
from deadwood_engine import sweep_hits


def count_of(source: Run, wanted: NDArray[np.int64], grid: Grid, feedback: Feedback) -> NDArray[np.uint32]:
    """How many of the wanted logs hit each cell."""
    counts = np.zeros(grid.shape, np.uint32)
    place = {"x0": grid.x0, "y0": grid.y0, "cell": grid.cell, "shape": grid.shape}
    done = 0
    for piece in source.poses(wanted):
        if feedback.cancelled():
            raise Cancelled
        base, tip = ends_of(piece)
        counts += sweep_hits(piece["log_row"], base, tip, *source.radii(), **place)
        done += np.unique(piece["log_id"]).size
        feedback.progress(done, wanted.size, "counting hits")
    return counts
