"""Standing trees as the engine has them: rigid vertical truncated cones (paper, section 3.4), and barrier posts.

The end posts and corners of barriers are trees of zero radius, so a log meets a plate's vertical edge as it meets a
thin stem. ``tree_contacts`` has what touches.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .compiled import kernel
from .grid_index import GridIndex, index_boxes, list_near

Array = NDArray[np.float64]


class Trees(NamedTuple):
    """Standing trees as the user gives them; arrays of shape (n,) in metres."""

    x: Array
    y: Array
    diameter: Array
    height: Array

    @staticmethod
    def none() -> Trees:
        empty = np.zeros(0)
        return Trees(empty, empty, empty, empty)


class Uprights(NamedTuple):
    """Trees and barrier posts as the kernels read them, shape (n, ...).

    node : int64 (n, 2), DEM column and row of the cell below; offset : [m] (n, 2) from that node
    solid : (n, 4) foot height, top height [m above reference], radius at the foot [m], SLOPE of the radius [-]
    owner : int64, row of the tree, or -1 - row of the barrier
    """

    node: np.ndarray
    offset: np.ndarray
    solid: np.ndarray
    owner: np.ndarray
    index: GridIndex  # pyright: ignore[reportIncompatibleMethodOverride]  (nobody looks a value up in a table)


# Columns of the near table, in the log's frame
NEAR_X, NEAR_Y, FOOT, TOP, RADIUS, SLOPE, ALONG, ROOM = range(8)
NEAR_WIDTH = 8


def prepare(
    plan: Array, foot: Array, top: Array, radius: Array, slope: Array, owner: np.ndarray, cell: float
) -> Uprights:
    """Lay out vertical cones; plan [m] shape (n, 2) from the centre of the DEM's cell (0, 0)."""
    node = np.floor(plan / cell).astype(np.int64)
    box = np.maximum(radius, 0.0)[:, None]
    return Uprights(
        node,
        plan - node * cell,
        np.ascontiguousarray(np.column_stack([foot, top, radius, slope])),
        np.asarray(owner, dtype=np.int64),
        index_boxes(plan - box, plan + box),
    )


@kernel
def near(uprights, frame, cell, listed, table, bx, by, tx, ty, reach):
    """List the uprights within reach [m] of the log's plan axis (base to tip), in its frame; returns the count."""
    if uprights.owner.shape[0] == 0:
        return 0
    ox, oy = frame[0] * cell, frame[1] * cell
    found = list_near(
        uprights.index, listed,
        ox + min(bx, tx) - reach, oy + min(by, ty) - reach, ox + max(bx, tx) + reach, oy + max(by, ty) + reach,
    )  # fmt: skip
    ex, ey = tx - bx, ty - by
    square = ex * ex + ey * ey
    count = 0
    for m in range(found):
        item = listed[m]
        x = (uprights.node[item, 0] - frame[0]) * cell + uprights.offset[item, 0]
        y = (uprights.node[item, 1] - frame[1]) * cell + uprights.offset[item, 1]
        share = 0.0
        if square > 0.0:
            share = min(1.0, max(0.0, ((x - bx) * ex + (y - by) * ey) / square))
        gx, gy = bx + share * ex - x, by + share * ey - y
        if math.sqrt(gx * gx + gy * gy) - uprights.solid[item, 2] <= reach:
            listed[count] = item
            table[count, NEAR_X], table[count, NEAR_Y] = x, y
            for column in range(4):
                table[count, FOOT + column] = uprights.solid[item, column]
            count += 1
    return count
