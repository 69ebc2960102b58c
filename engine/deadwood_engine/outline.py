"""The log in plan: its outline, the area that it sweeps, and what that area touches (paper, section 4).

The outline is the hull of the two end faces seen from above (ellipses, eight points each). Between two poses the
log sweeps the hull of both outlines: exact for straight motion, to which poses one cell apart are close. A cell is hit
if it overlaps the swept hull; a log counts once per cell.

Cells: cell (j, i) of a raster extends half a cell around its centre (x0 + i cell, y0 + j cell).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .compiled import kernel
from .grid_index import floor_within
from .lines import Segments, touch_segments

Array = NDArray[np.float64]


OUTLINE_POINTS = 16
INNER_HIDDEN = 3.0  # base radii between the ends in plan: then the line of both sides passes outside the inner points
_DIAGONAL = math.sqrt(0.5)


@kernel
def outline(points, at, ends, radii, u, cosine):
    """Write the points of the outline from row ``at``; returns how many, at most 16.

    ends, radii : of base and tip, (x, y) [m] and [m]; u : direction of the axis in plan; cosine : of its tilt from the
        vertical
    An end face seen from above is an ellipse with the half axes a across and a |cosine| along u. If the ends are far
    apart, the inner three of the eight points of each lie inside the hull and are omitted.
    """
    (bx, by), (tx, ty) = ends
    (base, tip), (ux, uy) = radii, u
    apart = (tx - bx) * ux + (ty - by) * uy > INNER_HIDDEN * base
    row = at
    for turn in range(2):
        end = turn if ux >= 0.0 else 1 - turn  # from west to east, which leaves less sorting to the hull
        x, y, a, outward = (bx, by, base, -1.0) if end == 0 else (tx, ty, tip, 1.0)
        b = a * abs(cosine)
        for k in range(5 if apart else 8):
            # across and along: the two sides, the outer three, the inner three
            c = 1.0 if k == 0 else -1.0 if k == 1 else 0.0 if k % 3 == 2 else _DIAGONAL if k % 3 == 0 else -_DIAGONAL
            s = 0.0 if k < 2 else 1.0 if k % 3 == 2 else _DIAGONAL
            s = s * outward if k < 5 else -s * outward
            points[row, 0] = x - a * c * uy + b * s * ux
            points[row, 1] = y + a * c * ux + b * s * uy
            row += 1
    return row - at


@kernel
def convex_hull(points, count, hull):
    """Convex hull of the points (sorted in place), counterclockwise, by Andrew's monotone chain; returns its size.

    0 if a coordinate is not finite, or so large that products overflow: comparisons with NaN are false, so points would
    be neither sorted nor removed, and both chains together would be longer than the table (whose last row is not part
    of the hull; a true hull leaves two more rows empty).
    """
    amiss = 0.0
    for k in range(count):
        x, y = points[k, 0], points[k, 1]
        amiss += (x - x) + (y - y)  # 0, or NaN
        m = k
        while m > 0 and (points[m - 1, 0] > x or (points[m - 1, 0] == x and points[m - 1, 1] > y)):
            points[m, 0], points[m, 1] = points[m - 1, 0], points[m - 1, 1]
            m -= 1
        points[m, 0], points[m, 1] = x, y
    if amiss != 0.0:
        return 0
    size = 0
    for direction in range(2):
        floor = size
        px = py = qx = qy = 0.0  # the hull's last point, and the previous one
        for step in range(count):
            k = step if direction == 0 else count - 1 - step
            x, y = points[k, 0], points[k, 1]
            while size >= floor + 2 and (px - qx) * (y - qy) - (py - qy) * (x - qx) <= 0.0:
                size -= 1
                px, py = qx, qy
                if size >= floor + 2:
                    qx, qy = hull[size - 2, 0], hull[size - 2, 1]
            if size + 1 >= hull.shape[0]:
                return 0
            hull[size, 0], hull[size, 1] = x, y
            size += 1
            qx, qy, px, py = px, py, x, y
        size -= 1
    return size


@kernel
def hull_rows(hull, size, grid, part, left, right):
    """Columns that a convex hull overlaps in each raster row: left[j] to right[j]; returns first and last row.

    hull : counterclockwise; columns 2 and 3 are a buffer for its vertices in cells
    grid : (x0, y0, cell) [m]
    part : first column and row, number of columns and rows, of the raster within the whole to which (x0, y0) belongs.
        The results are relative to that part, but computed in the whole, so that every part gives the same bits.
    Rows and columns outside the part are cut off; an empty range has first > last, an empty row left > right. An empty
    hull (size 0) is in no row.
    """
    x0, y0, cell = grid
    column, row, columns, rows = part
    low, high = math.inf, -math.inf
    for k in range(size):
        hull[k, 2], hull[k, 3] = (hull[k, 0] - x0) / cell + 0.5, (hull[k, 1] - y0) / cell + 0.5
        low, high = min(low, hull[k, 3]), max(high, hull[k, 3])
    if not low <= high:
        return 0, -1
    first, last = floor_within(low, row, row + rows), floor_within(high, row - 1, row + rows - 1)
    for j in range(first - row, last - row + 1):
        left[j], right[j] = columns, -1
    ax, ay = hull[size - 1, 2], hull[size - 1, 3]
    for k in range(size):
        bx, by = hull[k, 2], hull[k, 3]
        # counterclockwise, rising edges are the right side of the hull, falling ones its left side
        low, high = min(ay, by), max(ay, by)
        slope = (bx - ax) / (by - ay) if by != ay else 0.0
        lower, upper = max(first, int(math.floor(low))), min(last, int(math.floor(high)))
        # of the piece within a row, the end that is farther out: never beyond the ends of the edge
        if by >= ay:
            most, end = max(ax, bx), 1.0 if slope >= 0.0 else 0.0
            side = right[lower - row : max(lower, upper + 1) - row]
            for m in range(side.shape[0]):
                x = min(ax + slope * (lower + m + end - ay), most)
                side[m] = max(side[m], min(columns - 1, int(math.floor(x)) - column))
        if by <= ay:
            least, end = min(ax, bx), 0.0 if slope >= 0.0 else 1.0
            side = left[lower - row : max(lower, upper + 1) - row]
            for m in range(side.shape[0]):
                x = max(ax + slope * (lower + m + end - ay), least)
                side[m] = min(side[m], max(0, int(math.floor(x)) - column))
        ax, ay = bx, by
    return first - row, last - row


class StoredPoses(NamedTuple):
    """Stored poses of logs, one after the other, each in order of time; from the corner of a raster.

    log_row : int64 (m,), row of the log in the radii; base, tip : [m] (m, 3); base_radius, tip_radius : [m] (n,)
    """

    log_row: NDArray[np.int64]
    base: Array
    tip: Array
    base_radius: Array
    tip_radius: Array


class Drawing(NamedTuple):
    """Scratch memory of the sweeps; the last row of ``hull`` is a path."""

    points: Array
    hull: Array
    left: NDArray[np.int64]  # columns of each row
    right: NDArray[np.int64]
    crossed: NDArray[np.bool_]  # lines

    @staticmethod
    def allocate(rows: int, lines: int) -> Drawing:
        count = 2 * OUTLINE_POINTS
        spans = (np.zeros(rows + 1, np.int64), np.zeros(rows + 1, np.int64))
        return Drawing(np.zeros((count, 2)), np.zeros((count + 3, 4)), *spans, np.zeros(lines, np.bool_))


@kernel
def pose_before(poses, k):
    """Row of the previous pose of the same log; ``k`` for its first."""
    return k - 1 if k > 0 and poses.log_row[k - 1] == poses.log_row[k] else k


@kernel
def swept_hull(poses, k, work):
    """Hull of the outlines of a pose and the previous one of the same log, into work.hull; returns its size."""
    log, previous, count = poses.log_row[k], pose_before(poses, k), 0
    for turn in range(2):
        row = previous if turn == 0 else k
        base, tip = poses.base[row], poses.tip[row]
        dx, dy, dz = tip[0] - base[0], tip[1] - base[1], tip[2] - base[2]
        plan = math.sqrt(dx * dx + dy * dy)
        length = math.sqrt(plan * plan + dz * dz)
        u = (dx / plan, dy / plan) if plan > 0.0 else (1.0, 0.0)
        ends, radii = ((base[0], base[1]), (tip[0], tip[1])), (poses.base_radius[log], poses.tip_radius[log])
        count += outline(work.points, count, ends, radii, u, dz / length)
    return convex_hull(work.points, count, work.hull)


LISTED = 0  # position in ``order`` of the number of listed cells


@kernel
def count_danger(passed, order, danger):
    """At a log's end: count it in the cells that it hit before, or with the same outline as, it touched a line.

    Arrays as in ``trace.RasterArrays``; the list is emptied for the next log.
    """
    latest = 0
    for band in range(1, order.shape[0]):
        for k in range(order[band]):
            danger[band, passed[k]] += np.uint32(1)
        latest = max(latest, order[band])
        order[band] = -1
    for k in range(latest):
        danger[0, passed[k]] += np.uint32(1)
    order[LISTED] = 0


@kernel
def _sweep_hits(poses, cell, count, stamp, work):
    """As ``sweep_hits``; stamp : int64, the last log in each cell, row + 1."""
    rows, columns = count.shape
    grid, part = (0.0, 0.0, cell), (0, 0, columns, rows)
    for k in range(len(poses.log_row)):
        log = poses.log_row[k]
        first, last = hull_rows(work.hull, swept_hull(poses, k, work), grid, part, work.left, work.right)
        for j in range(first, last + 1):
            for i in range(work.left[j], work.right[j] + 1):
                if stamp[j, i] != log + 1:
                    stamp[j, i] = log + 1
                    count[j, i] += 1


@kernel
def _sweep_danger(poses, cell, touch, hits, danger_lists, work):
    """As ``sweep_danger``; hits : (count, stamp) as in ``_sweep_hits``; danger_lists : (passed, order, danger) as in
    ``trace.RasterArrays``.
    """
    (count, stamp), (passed, order, danger) = hits, danger_lists
    rows, columns = count.shape
    grid, part = (0.0, 0.0, cell), (0, 0, columns, rows)
    for k in range(len(poses.log_row)):
        log = poses.log_row[k]
        if pose_before(poses, k) == k:
            count_danger(passed, order, danger)  # of the previous log
        first, last = hull_rows(work.hull, swept_hull(poses, k, work), grid, part, work.left, work.right)
        for j in range(first, last + 1):
            for i in range(work.left[j], work.right[j] + 1):
                if stamp[j, i] != log + 1:
                    stamp[j, i] = log + 1
                    count[j, i] += np.uint32(1)
                    passed[order[LISTED]] = np.uint32(j * columns + i)
                    order[LISTED] += 1
        for line in range(touch.shape[1]):
            if touch[log, line] == k:
                order[line + 1] = order[LISTED]
    count_danger(passed, order, danger)


def stored_poses(
    log_row: NDArray[np.int64], base: Array, tip: Array, base_radius: Array, tip_radius: Array, x0: float, y0: float
) -> StoredPoses:
    """Stored poses as the kernels need them, from (x0, y0) [m]: far from the origin products of coordinates lose
    digits. Verified so that no index is out of range.

    Raises
    ------
    ValueError
        if a row is not one of the radii's, or the ends are not as many as the rows
    """
    rows, number, origin = np.asarray(log_row, np.int64), min(len(base_radius), len(tip_radius)), (x0, y0, 0.0)
    if len(rows) and not (int(rows.min()) >= 0 and int(rows.max()) < number):
        raise ValueError(f"log_row runs from {rows.min()} to {rows.max()}, but there are {number} logs")
    check_per_pose(rows, base, tip)
    base, tip = (np.ascontiguousarray(each - np.array(origin)) for each in (base, tip))
    return StoredPoses(rows, base, tip, base_radius, tip_radius)


def check_per_pose(rows: NDArray[np.int64], *per_pose: Array) -> None:
    """Raises ValueError if one of ``per_pose`` is not as long as the rows."""
    if any(len(each) != len(rows) for each in per_pose):
        raise ValueError(f"there are {len(rows)} rows of logs, but {[len(each) for each in per_pose]} values for them")


def sweep_hits(
    log_row: NDArray[np.int64],
    base: NDArray[np.float64],
    tip: NDArray[np.float64],
    base_radius: NDArray[np.float64],
    tip_radius: NDArray[np.float64],
    *,
    x0: float,
    y0: float,
    cell: float,
    shape: tuple[int, int],
) -> NDArray[np.uint32]:
    """Count the logs whose swept outline overlaps each raster cell, each log once per cell (paper, section 4).

    Parameters
    ----------
    log_row : shape (m,), ascending; row of the log in the radii
    base, tip : [m], shape (m, 3); ends of the log at each pose, in order of time
    base_radius, tip_radius : [m], shape (n,)
    x0, y0, cell, shape : centre of cell (0, 0) [m], cell size [m], rows and columns of the raster

    Returns
    -------
    uint32, the given shape, row 0 southernmost
    """
    poses = stored_poses(log_row, base, tip, base_radius, tip_radius, x0, y0)
    count, stamp = np.zeros(shape, np.uint32), np.zeros(shape, np.int64)
    _sweep_hits(poses, cell, count, stamp, Drawing.allocate(shape[0], 0))
    return count


def sweep_danger(
    log_row: NDArray[np.int64],
    base: NDArray[np.float64],
    tip: NDArray[np.float64],
    base_radius: NDArray[np.float64],
    tip_radius: NDArray[np.float64],
    touch: NDArray[np.int64],
    *,
    x0: float,
    y0: float,
    cell: float,
    shape: tuple[int, int],
) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Count the logs whose swept outline overlaps each raster cell, and those that touched a line then or later.

    Parameters are those of ``sweep_hits`` and ``touch``: int64, shape (n, lines), the first pose (row of ``log_row``)
    at which each log touches each line, -1 for none.

    Returns
    -------
    count : uint32, the given shape; danger : uint32, shape (lines + 1, rows, columns), first for any line, then for
    each
    """
    poses = stored_poses(log_row, base, tip, base_radius, tip_radius, x0, y0)
    count, stamp = np.zeros(shape, np.uint32), np.zeros(shape, np.int64)
    passed, order = np.zeros(count.size, np.uint32), np.full(touch.shape[1] + 1, -1)
    order[LISTED] = 0
    danger = np.zeros((touch.shape[1] + 1, count.size), np.uint32)
    touch, work = np.ascontiguousarray(touch, np.int64), Drawing.allocate(shape[0], 0)
    _sweep_danger(poses, cell, touch, (count, stamp), (passed, order, danger), work)
    return count, danger.reshape(-1, *shape)


@kernel
def _sweep_touches(poses, segments, touched, pose_row, work):
    """As ``sweep_touches``."""
    path = work.hull[2 * OUTLINE_POINTS + 2]
    for k in range(len(poses.log_row)):
        log, size = poses.log_row[k], swept_hull(poses, k, work)
        touch_segments(segments, work.hull, size, path, (0.0, 0.0), touched[log], work.crossed)
        for line in range(touched.shape[1]):
            if touched[log, line] and pose_row[log, line] < 0:
                pose_row[log, line] = k


def sweep_touches(
    log_row: NDArray[np.int64],
    base: NDArray[np.float64],
    tip: NDArray[np.float64],
    base_radius: NDArray[np.float64],
    tip_radius: NDArray[np.float64],
    segments: Segments,
) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Which lines each log's swept outline touches, and the first pose at which it does.

    Parameters are those of ``sweep_hits`` and the segments of the lines (``segments_of``).

    Returns
    -------
    touched : bool, shape (n, lines); pose_row : int64, shape (n, lines), -1 where not touched
    """
    touched = np.zeros((len(base_radius), segments.lines), np.bool_)
    pose_row = np.full(touched.shape, -1, np.int64)
    poses = stored_poses(log_row, base, tip, base_radius, tip_radius, segments.x0, segments.y0)
    _sweep_touches(poses, segments, touched, pose_row, Drawing.allocate(0, segments.lines))
    return touched, pose_row
