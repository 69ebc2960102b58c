"""Boulders: rigid spheres that lie on the terrain or protrude from it. The shortest file of a kind of obstacle."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .cores import BLOCK, lay_out
from .terrain import Terrain, surfaces_at

Array = NDArray[np.float64]


class Blocks(NamedTuple):
    """Boulders as given by the user; arrays of shape (n,) in metres, height of the top above the terrain."""

    x: Array
    y: Array
    diameter: Array
    height: Array

    @staticmethod
    def none() -> Blocks:
        empty = np.zeros(0)
        return Blocks(empty, empty, empty, empty)


def prepare(terrain: Terrain, blocks: Blocks, first: int) -> tuple[Any, NDArray[np.int64]]:
    """Cores of the boulders, numbered from ``first``, and the rows of boulders outside the terrain.

    Raises
    ------
    ValueError
        if a diameter or height is not positive and finite
    """
    for name, values in (("diameter", blocks.diameter), ("height", blocks.height)):
        if not np.all(np.isfinite(values) & (np.asarray(values) > 0)):
            raise ValueError(f"a block's {name} must be positive and finite")
    plan = np.column_stack([blocks.x, blocks.y]).astype(float).reshape(-1, 2) - (terrain.x0, terrain.y0)
    ground = surfaces_at(terrain, plan)[:, 0]
    there = np.isfinite(ground)
    radius = 0.5 * np.asarray(blocks.diameter, float)
    centre = np.column_stack([plan, ground + blocks.height - radius])[there]
    item = first + np.flatnonzero(there)
    return lay_out(BLOCK, item, centre, centre, radius[there], np.zeros(len(item))), np.flatnonzero(~there)
