"""Lying logs as the engine has them: rigid truncated cones along a line on the ground, which do not move.

A line of several vertices is cut into its straight pieces. Each piece lies as a stiff log would: it touches the terrain
at two places, one on either side of its middle, and may bridge a hollow between them (``rest_line``).
``lying_contacts`` has what touches.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .compiled import kernel
from .grid_index import GridIndex, index_boxes, list_near
from .terrain import Terrain, surfaces

Array = NDArray[np.float64]


class LyingLogs(NamedTuple):
    """Lying logs as the user gives them.

    vertices : [m], shape (k, 2); starts : int64, shape (n + 1,): log i is vertices[starts[i]:starts[i + 1]]
    diameter, tip_diameter : [m], shape (n,), at the first and at the last vertex
    """

    vertices: Array
    starts: NDArray[np.int64]
    diameter: Array
    tip_diameter: Array

    @staticmethod
    def none() -> LyingLogs:
        return LyingLogs(np.zeros((0, 2)), np.zeros(1, np.int64), np.zeros(0), np.zeros(0))


class Pieces(NamedTuple):
    """Straight pieces of lying logs as the kernels read them, shape (n, ...).

    node, offset : start of the axis, as for ``Uprights``
    solid : (n, 7) height of the start [m above reference], direction (3) [-], length [m], radius at the start [m],
        change of the radius along the axis [-]
    owner : int64, number of trees + row of the lying log: a lying log is a tree that fell
    """

    node: np.ndarray
    offset: np.ndarray
    solid: np.ndarray
    owner: np.ndarray
    index: GridIndex  # pyright: ignore[reportIncompatibleMethodOverride]  (nobody looks a value up in a table)


# Columns of the near table, in the log's frame
START_X, START_Y, START_Z, ALONG_X, ALONG_Y, ALONG_Z, LONG, WIDE, SLOPE = range(9)
NEAR_WIDTH = 9


def prepare(terrain: Terrain, lying: LyingLogs, trees: int) -> tuple[Pieces, NDArray[np.int64]]:
    """Lay lying logs on the terrain; returns their pieces, and the rows of those that lie off it altogether.

    Raises
    ------
    ValueError
        when a diameter is not positive and finite
    """
    for values in (lying.diameter, lying.tip_diameter):
        if not np.all(np.isfinite(values) & (np.asarray(values) > 0)):
            raise ValueError("a lying log's diameter must be positive and finite")
    plan = np.asarray(lying.vertices, float).reshape(-1, 2) - (terrain.x0, terrain.y0)
    found, owner, outside = [], [], []
    for row in range(len(lying.diameter)):
        corners = plan[lying.starts[row] : lying.starts[row + 1]]
        way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
        radii = 0.5 * (lying.diameter[row] + (lying.tip_diameter[row] - lying.diameter[row]) * way / way[-1])
        laid = [
            _laid(terrain, start, end, *radius)
            for (start, end), radius in zip(pairwise(corners), pairwise(radii), strict=True)
            if np.hypot(*(end - start)) > 0.0
        ]
        laid = [piece for piece in laid if piece is not None]
        found += laid
        owner += [trees + row] * len(laid)
        if not laid:
            outside.append(row)
    table = np.array(found).reshape(-1, 9)
    start = table[:, :2]
    end = start + table[:, LONG, None] * table[:, ALONG_X : ALONG_Y + 1]
    wide = np.maximum(table[:, WIDE], table[:, WIDE] + table[:, LONG] * table[:, SLOPE])[:, None]
    node = np.floor(start / terrain.cell).astype(np.int64)
    return Pieces(
        node,
        start - node * terrain.cell,
        np.ascontiguousarray(table[:, 2:]),
        np.array(owner, np.int64),
        index_boxes(np.minimum(start, end) - wide, np.maximum(start, end) + wide),
    ), np.array(outside, np.int64)


def _laid(terrain: Terrain, start: Array, end: Array, first: float, last: float) -> list[float] | None:
    """A straight piece at rest on the terrain, as a row of the near table; None where there is no terrain."""
    span = float(np.hypot(*(end - start)))
    share = np.linspace(0.0, 1.0, max(3, 2 * int(np.ceil(span / terrain.cell)) + 1))
    places = start + share[:, None] * (end - start)
    ground = np.empty((len(share), 3))
    surfaces(terrain, np.ascontiguousarray(places[:, 0]), np.ascontiguousarray(places[:, 1]), ground)
    there = np.isfinite(ground[:, 0])
    if not there.any():
        return None
    # the axis over a plane: a radius off it, square to it
    lift = (first + (last - first) * share) * np.sqrt(1.0 + ground[:, 1] ** 2 + ground[:, 2] ** 2)
    low, high = rest_line(share[there], (ground[:, 0] + lift)[there])
    along = np.array([*(end - start), high - low])
    length = float(np.linalg.norm(along))
    return [*start, low, *(along / length), length, first, (last - first) / length]


def rest_line(share: Array, height: Array) -> tuple[float, float]:
    """Heights at 0 and 1 of a stiff straight line that rests on the points, its middle between two supports.

    It is the edge of the points' upper convex hull over the middle; where all points lie on one side of the middle
    (a log that juts out), the hull's last edge there, or the level through a single point.
    """
    upper: list[int] = []
    for k in range(len(share)):
        while len(upper) >= 2:
            i, j = upper[-2], upper[-1]
            turn = (share[j] - share[i]) * (height[k] - height[i]) - (height[j] - height[i]) * (share[k] - share[i])
            if turn < 0.0:
                break
            upper.pop()
        upper.append(k)
    if len(upper) == 1:
        return float(height[upper[0]]), float(height[upper[0]])
    edge = next((k for k in range(1, len(upper)) if share[upper[k]] >= 0.5), len(upper) - 1)
    i, j = upper[edge - 1], upper[edge]
    rise = (height[j] - height[i]) / (share[j] - share[i])
    low = height[i] - rise * share[i]
    return float(low), float(low + rise)


@kernel
def near(pieces, frame, cell, listed, table, bx, by, tx, ty, reach):
    """List the pieces within reach [m] of the log's plan box, in the log's frame; returns the count."""
    if pieces.owner.shape[0] == 0:
        return 0
    ox, oy = frame[0] * cell, frame[1] * cell
    count = list_near(
        pieces.index, listed,
        ox + min(bx, tx) - reach, oy + min(by, ty) - reach, ox + max(bx, tx) + reach, oy + max(by, ty) + reach,
    )  # fmt: skip
    for m in range(count):
        item = listed[m]
        table[m, START_X] = (pieces.node[item, 0] - frame[0]) * cell + pieces.offset[item, 0]
        table[m, START_Y] = (pieces.node[item, 1] - frame[1]) * cell + pieces.offset[item, 1]
        for column in range(7):
            table[m, START_Z + column] = pieces.solid[item, column]
    return count
