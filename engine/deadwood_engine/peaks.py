"""The largest value of each log over each cell that it swept: the basis of quantiles of speed or energy.

The cells of a log are those of ``outline.sweep_hits``: the hull of two successive outlines overlaps them. The value of
a log there is the larger one of both poses of those hulls. One value is stored per log and cell, in places given by the
hit counts, so the memory is known before the first log: 4 bytes per hit and channel.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .compiled import kernel
from .outline import Drawing, check_per_pose, hull_rows, pose_before, stored_poses, swept_hull

Array = NDArray[np.float64]


@kernel
def _sweep_peaks(poses, values, cell, places, peaks, work):
    """Returns whether there was a place for every value; there is none for a log more than was counted.

    values : (channels, poses); places : (start, filled, stamp), where each cell has its peaks, how many are there, and
        the last log in it, row + 1
    """
    start, filled, stamp = places
    base, tip, (rows, columns) = poses.base, poses.tip, stamp.shape
    grid, part = (0.0, 0.0, cell), (0, 0, columns, rows)
    bottom, top = -0.5 * cell, (rows - 0.5) * cell
    for k in range(len(poses.log_row)):
        log, previous = poses.log_row[k], pose_before(poses, k)
        wide = max(poses.base_radius[log], poses.tip_radius[log])
        low = min(min(base[k, 1], tip[k, 1]), min(base[previous, 1], tip[previous, 1])) - wide
        high = max(max(base[k, 1], tip[k, 1]), max(base[previous, 1], tip[previous, 1])) + wide
        if high < bottom or low > top:
            continue
        first, last = hull_rows(work.hull, swept_hull(poses, k, work), grid, part, work.left, work.right)
        for j in range(first, last + 1):
            for i in range(work.left[j], work.right[j] + 1):
                place = j * columns + i
                if stamp[j, i] != log + 1:
                    if filled[j, i] >= start[place + 1] - start[place]:
                        return False
                    stamp[j, i] = log + 1
                    filled[j, i] += 1
                at = start[place] + filled[j, i] - 1
                for channel in range(values.shape[0]):
                    value = max(values[channel, previous], values[channel, k])
                    peaks[channel, at] = max(peaks[channel, at], np.float32(value))
    return True


class CellPeaks:
    """The largest values of every log in every cell of a raster (or of some rows of one).

    start : int64, shape (cells + 1,): cell c = row * columns + column has peaks[:, start[c]:start[c + 1]]
    peaks : float32, shape (channels, hits), 0 until a log is added; within a cell in the order in which logs were added
    """

    def __init__(self, counts: NDArray[np.uint32], channels: int) -> None:
        """``counts``: the hits of the logs that will be added, by ``sweep_hits`` on the same cells."""
        self.start = np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])
        self.peaks = np.zeros((channels, int(self.start[-1])), np.float32)
        self._filled, self._stamp = np.zeros(counts.shape, np.uint32), np.zeros(counts.shape, np.int64)
        self._work = Drawing.allocate(counts.shape[0], 0)

    def add(
        self,
        log_row: NDArray[np.int64],
        base: Array,
        tip: Array,
        base_radius: Array,
        tip_radius: Array,
        values: Array,
        *,
        x0: float,
        y0: float,
        cell: float,
    ) -> None:
        """Add logs, each completely and once; parameters are those of ``sweep_hits``, and ``values``, shape (channels,
        m):
        the values at each pose, not negative. (x0, y0) is the centre of the first cell here.
        """
        poses = stored_poses(log_row, base, tip, base_radius, tip_radius, x0, y0)
        check_per_pose(poses.log_row, *np.atleast_2d(values))
        places = self.start, self._filled, self._stamp
        values = np.ascontiguousarray(values, np.float64)
        complete = _sweep_peaks(poses, values, cell, places, self.peaks, self._work)
        if not complete:
            raise ValueError("more logs in a cell than were counted: the counts are not of these logs and cells")
