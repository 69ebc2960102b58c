"""Lines in plan (roads, house walls, feet of barriers), and what touches or crosses them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .compiled import kernel
from .grid_index import GridIndex, grid_window, index_boxes

Array = NDArray[np.float64]


class Lines(NamedTuple):
    """Lines as given by the user; a closed one repeats its first vertex.

    vertices : [m], shape (k, 2); starts : int64, shape (n + 1,): line i is vertices[starts[i]:starts[i + 1]]
    """

    vertices: Array
    starts: NDArray[np.int64]

    @staticmethod
    def none() -> Lines:
        return Lines(np.zeros((0, 2)), np.zeros(1, np.int64))

    def then(self, *more: Lines) -> Lines:
        """These lines, followed by further ones."""
        everything = (self, *more)
        sizes = np.concatenate([np.diff(each.starts) for each in everything])
        starts = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
        return Lines(np.vstack([np.reshape(each.vertices, (-1, 2)) for each in everything]), starts)


class Segments(NamedTuple):
    """The straight pieces of lines as the kernels read them.

    ends : [m], shape (m, 4), x, y of both ends from (x0, y0); owner : int64, shape (m,), row of the line
    """

    ends: Array
    owner: NDArray[np.int64]
    index: GridIndex  # pyright: ignore[reportIncompatibleMethodOverride]  (nobody looks a value up in a table)
    lines: int
    x0: float
    y0: float


def segments_of(lines: Lines, x0: float = 0.0, y0: float = 0.0) -> Segments:
    """Cut lines into indexed segments, in coordinates relative to (x0, y0) [m]."""
    starts = np.asarray(lines.starts, np.int64)
    number = len(starts) - 1
    owner = np.repeat(np.arange(number), np.maximum(np.diff(starts) - 1, 0))
    first = np.concatenate([np.arange(starts[i], starts[i + 1] - 1) for i in range(number)] or [np.zeros(0, int)])
    plan = np.asarray(lines.vertices, float).reshape(-1, 2) - (x0, y0)
    ends = np.ascontiguousarray(np.hstack([plan[first.astype(int)], plan[first.astype(int) + 1]]))
    low, high = np.minimum(ends[:, :2], ends[:, 2:]), np.maximum(ends[:, :2], ends[:, 2:])
    return Segments(ends, owner.astype(np.int64), index_boxes(low, high), number, float(x0), float(y0))


@kernel
def hull_meets_segment(hull, size, a, b):
    """Whether a convex hull (counterclockwise) and a segment a -> b have a point in common, by clipping the segment."""
    (ax, ay), (bx, by) = a, b
    enter, leave = 0.0, 1.0
    ex, ey = bx - ax, by - ay
    for k in range(size):
        m = k + 1 if k + 1 < size else 0
        sx, sy = hull[m, 0] - hull[k, 0], hull[m, 1] - hull[k, 1]
        inside = sx * (ay - hull[k, 1]) - sy * (ax - hull[k, 0])
        change = sx * ey - sy * ex
        if change == 0.0:
            if inside < 0.0:
                return False
        elif change > 0.0:
            enter = max(enter, -inside / change)
        else:
            leave = min(leave, -inside / change)
        if enter > leave:
            return False
    return True


@kernel
def segments_cross(a, b, c, d):
    """Whether the path a -> b crosses the segment c -> d from one side to the other."""
    (ax, ay), (bx, by), (cx, cy), (dx, dy) = a, b, c, d
    ex, ey = dx - cx, dy - cy
    p = ex * (ay - cy) - ey * (ax - cx)
    q = ex * (by - cy) - ey * (bx - cx)
    if (p >= 0.0) == (q >= 0.0):
        return False
    fx, fy = bx - ax, by - ay
    r = fx * (cy - ay) - fy * (cx - ax)
    s = fx * (dy - ay) - fy * (dx - ax)
    return (r >= 0.0) != (s >= 0.0)


@kernel
def touch_segments(segments, hull, size, path, shift, touched, crossed):
    """Mark the owners of segments that a swept hull touches, and those that the path of the centre crosses.

    segments : a ``Segments``; path : x, y of the centre [m] before and after; shift : (x, y) [m] by which hull and path
        are moved into the segments' frame
    An empty hull (size 0) touches nothing.
    """
    if size == 0:
        return
    index, ends, owner = segments.index, segments.ends, segments.owner
    shift_x, shift_y = shift
    before, after = (path[0], path[1]), (path[2], path[3])
    low_x, low_y, high_x, high_y = math.inf, math.inf, -math.inf, -math.inf
    for k in range(size):
        low_x, high_x = min(low_x, hull[k, 0]), max(high_x, hull[k, 0])
        low_y, high_y = min(low_y, hull[k, 1]), max(high_y, hull[k, 1])
    i0, i1, j0, j1 = grid_window(index, low_x + shift_x, low_y + shift_y, high_x + shift_x, high_y + shift_y)
    for j in range(j0, j1 + 1):
        for i in range(i0, i1 + 1):
            place = j * index.columns + i
            for m in range(index.start[place], index.start[place + 1]):
                item = index.items[m]
                a = (ends[item, 0] - shift_x, ends[item, 1] - shift_y)
                b = (ends[item, 2] - shift_x, ends[item, 3] - shift_y)
                if not touched[owner[item]] and hull_meets_segment(hull, size, a, b):
                    touched[owner[item]] = True
                if not crossed[owner[item]] and segments_cross(before, after, a, b):
                    crossed[owner[item]] = True
