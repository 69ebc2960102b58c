"""Standing trees: rigid vertical truncated cones with a rounded top, which a log cannot pass (paper, section 3.4).

A tree is rigid and fixed: it blocks, turns and wedges a log for as long as they touch. Its top, half the DBH wide, is
a hemisphere that reaches the tree's height. A tree no higher than ``limits.STUMP`` is cut or broken: a cylinder of
its DBH with a flat top whose rim is rounded, one convex body for any part of a log that may come down on it. (With a
top that is flat for the log's face, round for its side and absent for its rim, one rim in three sank by 5 to 48 cm. A
hemisphere at the top left 0.6 to 0.9 of the DBH at the ground.)
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .cores import TREE, lay_out
from .limits import CORE_BELOW, STUMP, STUMP_RIM

Array = NDArray[np.float64]


class Trees(NamedTuple):
    """Standing trees as given by the user; arrays of shape (n,) in metres.

    capacity : [J] that each absorbs in a hit before it breaks (``breaking``), infinite: it does not; None: none breaks
    """

    x: Array
    y: Array
    diameter: Array
    height: Array
    capacity: Array | None = None

    @staticmethod
    def none() -> Trees:
        empty = np.zeros(0)
        return Trees(empty, empty, empty, empty)

    def then(self, more: Trees) -> Trees:
        """These trees, followed by further ones; those without capacities do not break."""
        x, y, diameter, height = (np.concatenate(pair) for pair in zip(self[:4], more[:4], strict=True))
        if self.capacity is None and more.capacity is None:
            return Trees(x, y, diameter, height)
        known = [np.full(len(each.x), np.inf) if each.capacity is None else each.capacity for each in (self, more)]
        return Trees(x, y, diameter, height, np.concatenate(known))


def prepare(
    plan: Array, foot: Array, radius: Array, height: Array, item: NDArray[np.int64], capacity: Array | float = np.inf
) -> Any:
    """The cores of trees; plan [m] shape (n, 2) from the centre of the DEM's cell (0, 0), foot [m] above reference.

    A stem continues below the ground, because on a steep slope the ground beside it is lower.
    """
    stump = height <= STUMP
    rim = np.minimum(STUMP_RIM * radius, 0.5 * height)
    tip = np.where(stump, rim, 0.5 * radius)  # the paper: the top is half the DBH
    below = np.maximum(CORE_BELOW, radius)
    wide = np.where(stump, radius, np.minimum(radius * (1.0 + 0.5 * below / height), below))
    long = below + height - tip
    start = np.column_stack([plan, foot - below])
    slope = np.where(stump, 0.0, (tip - wide) / long)
    end = start + long[:, None] * (0.0, 0.0, 1.0)
    return lay_out(TREE, item, start, end, wide, slope, disc=np.where(stump, radius - rim, 0.0), capacity=capacity)
