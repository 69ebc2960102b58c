"""Standing trees: rigid vertical truncated cones with a round top, which a log cannot pass (paper, section 3.4).

A tree is hard and stays: it blocks, turns and wedges a log for as long as they touch. Its top, half the DBH wide, is
half a sphere that reaches the tree's height: one shape for all of a log that may come down on a stump or snag. (Flat
for the log's face, round for its side and nothing for its rim, one rim in three sank by 5 to 48 cm.)
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .cores import TREE, lay_out
from .limits import CORE_BELOW

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


def prepare(plan: Array, foot: Array, radius: Array, height: Array, item: NDArray[np.int64]) -> Any:
    """The cores of trees; plan [m] shape (n, 2) from the centre of the DEM's cell (0, 0), foot [m] above reference.

    A stem goes on below the ground, for on a steep slope that is lower beside it; a stump's by its height, or it
    would grow too wide there, and one that is wider than high by as much as its widest sphere needs.
    """
    tip = 0.5 * radius  # the paper: the top is half the DBH
    below = np.maximum(np.minimum(CORE_BELOW, height), radius)
    wide = np.minimum(radius * (1.0 + 0.5 * below / height), below)
    long = below + height - tip
    start = np.column_stack([plan, foot - below])
    return lay_out(TREE, item, start, start + long[:, None] * (0.0, 0.0, 1.0), wide, (tip - wide) / long)
