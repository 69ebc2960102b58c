"""Lying logs as obstacles: rigid truncated cones along a line on the ground, which do not move.

A line of several vertices is cut into its straight pieces. Each piece lies as a rigid log would: it touches the terrain
at two places, one on either side of its middle, and may bridge a hollow between them (``rest_line``).
Its ends are round, so that a bent line has no gap at its bends and no corner on which a rim could catch.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .cores import CORE, LYING, Cores, lay_out
from .limits import JOINED
from .terrain import Terrain, surfaces_at

Array = NDArray[np.float64]


class LyingLogs(NamedTuple):
    """Lying logs as given by the user.

    vertices : [m], shape (k, 2); starts : int64, shape (n + 1,): log i is vertices[starts[i]:starts[i + 1]]
    diameter, tip_diameter : [m], shape (n,), at the first and at the last vertex
    capacity : [J] that a straight piece of each absorbs in a hit before it breaks, as of ``trees``; None: none breaks
    """

    vertices: Array
    starts: NDArray[np.int64]
    diameter: Array
    tip_diameter: Array
    capacity: Array | None = None

    @staticmethod
    def none() -> LyingLogs:
        return LyingLogs(np.zeros((0, 2)), np.zeros(1, np.int64), np.zeros(0), np.zeros(0))


class Pieces(NamedTuple):
    """Straight pieces of lying logs, for callers that need their positions, shape (n, ...).

    node, offset : start of the axis, DEM column and row, and [m] from there
    solid : (n, 7) height of the start [m above reference], direction (3) [-], length [m], radius at the start [m],
        change of the radius along the axis [-]
    owner : int64, number of trees + row of the lying log: a lying log counts as a fallen tree
    """

    node: np.ndarray
    offset: np.ndarray
    solid: np.ndarray
    owner: np.ndarray


def pieces_of(cores: Cores) -> Pieces:
    """The lying logs among all obstacles."""
    mine = cores.solid["kind"] == LYING
    solid = cores.solid[mine]
    offset, shape = (
        np.column_stack([solid[name] for name in names.split()]) for names in ("x y", "z ux uy uz long wide slope")
    )
    return Pieces(cores.node[mine], offset, shape, solid["owner"])


def prepare(terrain: Terrain, lying: LyingLogs, first: int) -> tuple[Any, NDArray[np.int64]]:
    """Place lying logs on the terrain; returns the cores of their pieces, numbered from ``first``, and the rows of
    those that are outside it altogether. The ends of a line are round.

    Raises
    ------
    ValueError
        if a diameter is not positive and finite
    """
    for values in (lying.diameter, lying.tip_diameter):
        if not np.all(np.isfinite(values) & (np.asarray(values) > 0)):
            raise ValueError("a lying log's diameter must be positive and finite")
    if lying.capacity is not None and not np.all(np.asarray(lying.capacity, float) > 0.0):
        raise ValueError("the energy at which a lying log breaks must be positive; infinite: it never does")
    plan = np.asarray(lying.vertices, float).reshape(-1, 2) - (terrain.x0, terrain.y0)
    parts, outside = [np.zeros(0, CORE)], []
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
        if not laid:
            outside.append(row)
            continue
        table = np.array(laid)
        start, end, wide = table[:, :3], table[:, 3:6], table[:, 6]
        way = (end - start) / np.linalg.norm(end - start, axis=1)[:, None]
        # each piece lies independently: where two do not meet, both have a round end
        meets = np.append(np.linalg.norm(start[1:] - end[:-1], axis=1) < JOINED, False)
        before = np.where(np.roll(meets, 1)[:, None], -np.roll(way, 1, axis=0), 0.0)
        parts.append(
            lay_out(
                LYING,
                np.full(len(table), first + row),
                start,
                end,
                wide,
                table[:, 7],
                before_x=before[:, 0],
                before_y=before[:, 1],
                before_z=before[:, 2],
                after=meets,
                capacity=np.inf if lying.capacity is None else lying.capacity[row],
            )
        )
    return np.concatenate(parts), np.array(outside, np.int64)


def _laid(terrain: Terrain, start: Array, end: Array, first: float, last: float) -> list[float] | None:
    """A straight piece at rest on the terrain: start, end, radius, its change; None outside the terrain."""
    span = float(np.hypot(*(end - start)))
    share = np.linspace(0.0, 1.0, max(3, 2 * int(np.ceil(span / terrain.cell)) + 1))
    places = start + share[:, None] * (end - start)
    ground = surfaces_at(terrain, places)
    there = np.isfinite(ground[:, 0])
    if not there.any():
        return None
    # the axis above a plane: one radius away from it, along its normal
    lift = (first + (last - first) * share) * np.sqrt(1.0 + ground[:, 1] ** 2 + ground[:, 2] ** 2)
    low, high = rest_line(share[there], (ground[:, 0] + lift)[there])
    length = float(np.hypot(span, high - low))
    return [*start, low, *end, high, first, (last - first) / length]


def rest_line(share: Array, height: Array) -> tuple[float, float]:
    """Heights at 0 and 1 of a rigid straight line that rests on the points, its middle between two supports.

    It is the edge of the points' upper convex hull over the middle; if all points lie on one side of the middle
    (an overhanging log), the hull's last edge there, or the horizontal through a single point.
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
