"""What kind of slope a scene is, as far as the error of the calculation depends on it.

``benchmarks/population.py`` measures that error on random slopes and sorts them by this function; a run with
``--fidelity auto`` looks its own slope up in the same way. Only what a scene shows before a log slides is used.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.scene.cell_noise import DOUBTED, noise_of
from deadwood_engine import Logs, Scene
from deadwood_engine.cores import TREE

AROUND = (
    100.0  # [m] the ground this far around the releases counts: what lies elsewhere on a large terrain model does not
)
BASE = 10.0  # [m] half the length over which the fall line is measured
STEEP = 0.27  # tan 15 degrees: logs slide on what is steeper
SIDE, SIDE_CELLS = 2.5, 1.5  # [m], [cells] from the bed of a channel to its sides, the larger of the two
RISE = 0.15  # a bed: the ground rises to both sides by so much of that distance
ALONG = (-4.0, 0.0, 4.0)  # [m] and does so up and down the fall line, too, which hollows of natural relief do not
BEDS = 0.0005  # share of the steep ground that is beds, from which a slope counts as one with channels
STEMS = 25.0  # per hectare, from which it counts as forest
ROUGH = DOUBTED  # noise over cell, from which the ground counts as rough
MOST = 200_000  # cells looked at


class SlopeKind(NamedTuple):
    """
    name : the first of channels, structures (barriers, boulders, lying logs), forest, open that applies
    noise_over_cell : standard deviation of the heights from cell to cell, over the cell
    beds : share of the steep ground that is the bed of a channel
    """

    name: str
    noise_over_cell: float
    beds: float

    @property
    def words(self) -> str:
        """The name, and whether the ground is rough: the key of ``simulate.fidelity_trade``."""
        return f"{self.name}, rough ground" if self.noise_over_cell >= ROUGH else self.name


NAMES = ("open", "forest", "channels", "structures")
KINDS = tuple(f"{name}{rough}" for name in NAMES for rough in ("", ", rough ground"))


def kind_of(scene: Scene, logs: Logs) -> SlopeKind:
    """The kind of the slope on which these logs are released."""
    terrain = scene.arrays.terrain
    heights, cell = terrain.heights, terrain.cell
    row, column = _ground(heights, cell, _cells_of(scene, logs))

    def at(east: float | NDArray[np.float64], north: float | NDArray[np.float64]) -> NDArray[np.float64]:
        rows, columns = (np.rint(np.asarray(each) / cell).astype(int) for each in (north, east))
        return heights[_within(row + rows, heights.shape[0]), _within(column + columns, heights.shape[1])].astype(float)

    x = (at(BASE, 0) - at(-BASE, 0)) / (2 * BASE)
    y = (at(0, BASE) - at(0, -BASE)) / (2 * BASE)
    steep = np.hypot(x, y) > STEEP
    if not steep.any():  # also if there is no ground
        return SlopeKind(_name(scene, 0.0), 0.0, 0.0)
    row, column, x, y = row[steep], column[steep], x[steep], y[steep]
    fall, side, bed = np.hypot(x, y), max(SIDE, SIDE_CELLS * cell), np.ones(len(row), bool)
    east, north = x / fall, y / fall  # up the fall line
    for along in ALONG:
        left = at(along * east - side * north, along * north + side * east)
        right = at(along * east + side * north, along * north - side * east)
        bed &= np.minimum(left, right) - at(along * east, along * north) > RISE * side
    beds, z = float(bed.mean()), at(0, 0)
    # Second differences both ways: zero on a plane, an edge or a channel along an axis, 36 times the variance of noise
    c = cell
    cross = at(c, 0) + at(-c, 0) + at(0, c) + at(0, -c)
    corners = at(c, c) + at(c, -c) + at(-c, c) + at(-c, -c)
    return SlopeKind(_name(scene, beds), noise_of(4 * z - 2 * cross + corners) / cell, beds)


def _name(scene: Scene, beds: float) -> str:
    """By what is rarest on a slope: whoever has several is sorted by the first."""
    terrain = scene.arrays.terrain
    hectares = np.isfinite(terrain.heights).sum() * terrain.cell**2 / 1e4
    if beds > BEDS:
        return "channels"
    if np.any(scene.arrays.cores.solid["kind"] != TREE):
        return "structures"
    return "forest" if scene.tree_count > STEMS * hectares else "open"


def _cells_of(scene: Scene, logs: Logs) -> NDArray[np.int64]:
    """Rows and columns of the releases, one for each of the places that are close together."""
    t = scene.arrays.terrain
    cells = np.column_stack([(logs.y - t.y0) / t.cell - t.row, (logs.x - t.x0) / t.cell - t.column])
    together = max(1.0, 0.2 * AROUND / t.cell)
    return (np.unique(np.rint(cells / together), axis=0) * together).astype(int)


def _ground(heights: NDArray, cell: float, places: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows and columns of the cells around places, thinned out evenly if there are too many."""
    near, far = np.zeros(heights.shape, bool), round(AROUND / cell)
    for row, column in places:
        near[max(0, row - far) : max(0, row + far), max(0, column - far) : max(0, column + far)] = True
    cells = np.flatnonzero(near & np.isfinite(heights))
    row, column = np.unravel_index(cells[:: 1 + cells.size // MOST], heights.shape)
    return row, column


def _within(index: NDArray[np.int64], size: int) -> NDArray[np.int64]:
    return np.clip(index, 0, size - 1)
