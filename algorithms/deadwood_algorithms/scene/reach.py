"""The part of a large DEM that logs can reach: estimated generously from an energy line, and verified by the run
itself.

From each release an energy line descends outwards with a slope of `slope`; where the ground rises above it, no log is
expected. The estimate proceeds over blocks of the DEM from the releases outwards, so it reads only a little more than
its result, however large the file. It need not be correct: a watched line runs inside every side of the window that is
not a side of the DEM itself, and a log that touches it is slid again in a wider window. The line is so far
from the window's side that nothing beyond the side can have affected, even by a bit, a log that did not touch the line:
its outline is drawn at least every four cells of travel, a step moves it by less, roughness is known from three cells
around, and obstacles are searched for within 2 m of it.
"""

from __future__ import annotations

import heapq
import math

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.dem_windows import DemWindows
from deadwood_algorithms.files.grid import Grid, Part
from deadwood_algorithms.files.heights import HIGHEST_M
from deadwood_algorithms.params.tool import UserError

BLOCK_CELLS = 256  # side of the blocks over which the estimate proceeds
# Distance from a side of the window to its watched line: cells for steps and outlines, metres for obstacles (the
# engine's margin of 2 m, once more for the motion in between, and the thickest of trees).
WATCH_CELLS, WATCH_M = 16, 8.0
WIDER = 0.5  # a window grows by this share of its width at a side that was touched
SIDES = ("west", "south", "east", "north")


def first_part(
    dem: DemWindows, x: NDArray[np.float64], y: NDArray[np.float64], *, lift_m: float, slope: float, margin_m: float
) -> Part:
    """The window in which logs released at these places are expected to stay.

    Parameters
    ----------
    x, y : release points [m]; those off the DEM are ignored
    lift_m : largest height above the release that a log's energy permits (its height, v^2 / 2g)
    slope : of the energy line [-]
    margin_m : added around the estimate, for the logs' length
    """
    head = _heads(dem, x, y, lift_m)
    if not head:
        raise UserError(f"{dem.path}: no release lies on the DEM; check the CRS of both")
    step = BLOCK_CELLS * dem.cell
    best = dict(head)
    queue = [(-energy, block) for block, energy in head.items()]
    heapq.heapify(queue)
    reached: list[tuple[int, int]] = []
    rows, columns = (math.ceil(size / BLOCK_CELLS) for size in dem.shape)
    while queue:
        energy, block = heapq.heappop(queue)
        if -energy < best[block] or not _lowest_of(dem, block) < -energy:
            continue
        reached.append(block)
        for dj, di in ((dj, di) for dj in (-1, 0, 1) for di in (-1, 0, 1) if dj or di):
            beside = block[0] + dj, block[1] + di
            # a release may be at its block's edge, so the first step costs nothing
            left = -energy - (0.0 if block in head else slope * step * math.hypot(dj, di))
            if 0 <= beside[0] < rows and 0 <= beside[1] < columns and left > best.get(beside, -math.inf):
                best[beside] = left
                heapq.heappush(queue, (-left, beside))
    reached += list(head)
    margin = math.ceil((margin_m + WATCH_M) / dem.cell) + WATCH_CELLS
    low, high = np.min(reached, axis=0) * BLOCK_CELLS, (np.max(reached, axis=0) + 1) * BLOCK_CELLS
    size = high - low + 2 * margin
    return Part(int(low[1]) - margin, int(low[0]) - margin, int(size[1]), int(size[0])).cut_to(dem.shape)


def _heads(
    dem: DemWindows, x: NDArray[np.float64], y: NDArray[np.float64], lift_m: float
) -> dict[tuple[int, int], float]:
    """Energy height [m] of the highest release in each block that contains one."""
    i, j = np.rint((x - dem.x0) / dem.cell).astype(np.int64), np.rint((y - dem.y0) / dem.cell).astype(np.int64)
    on = (i >= 0) & (j >= 0) & (i < dem.shape[1]) & (j < dem.shape[0])
    blocks = np.column_stack([j, i])[on] // BLOCK_CELLS
    heads = {}
    for block in np.unique(blocks, axis=0):
        here = np.flatnonzero((blocks == block).all(axis=1))
        values = _block(dem, (int(block[0]), int(block[1])))
        heights = values[j[on][here] - block[0] * BLOCK_CELLS, i[on][here] - block[1] * BLOCK_CELLS]
        if np.isfinite(heights).any():
            heads[int(block[0]), int(block[1])] = float(np.nanmax(heights)) + lift_m
    return heads


def _block(dem: DemWindows, block: tuple[int, int]) -> NDArray[np.float64]:
    rows, columns = (slice(at * BLOCK_CELLS, (at + 1) * BLOCK_CELLS) for at in block)
    return dem.grid(rows, columns).values


def _lowest_of(dem: DemWindows, block: tuple[int, int]) -> float:
    """The lowest ground of a block [m]; infinite if all of it is outside."""
    values = _block(dem, block)
    return float(np.min(values, where=np.isfinite(values), initial=HIGHEST_M * 2.0))


def wider(part: Part, sides: list[str], shape: tuple[int, int]) -> Part:
    """The window grown at the sides that were touched."""
    more = dict.fromkeys(SIDES, 0) | {
        side: math.ceil(WIDER * (part.columns if side in ("west", "east") else part.rows)) for side in sides
    }
    return Part(
        part.column - more["west"],
        part.row - more["south"],
        part.columns + more["west"] + more["east"],
        part.rows + more["south"] + more["north"],
    ).cut_to(shape)


def watched_sides(grid: Grid, beyond_m: float = 0.0) -> dict[str, NDArray[np.float64]]:
    """The lines to be watched, two vertices [m] each, by the side of the window along which they run.

    ``beyond_m``: length of the longest object that counts as a whole; one that is cut by the side must not be touched.
    """
    if grid.whole is None:
        return {}
    part, (rows, columns) = grid.part, grid.frame.shape
    west, south, east, north = grid.bounds
    inward = WATCH_CELLS * grid.cell + WATCH_M + beyond_m
    open_sides = {
        "west": part.column > 0,
        "south": part.row > 0,
        "east": part.column + part.columns < columns,
        "north": part.row + part.rows < rows,
    }
    lines = {
        "west": [(west + inward, south), (west + inward, north)],
        "south": [(west, south + inward), (east, south + inward)],
        "east": [(east - inward, south), (east - inward, north)],
        "north": [(west, north - inward), (east, north - inward)],
    }
    return {side: np.array(lines[side]) for side in SIDES if open_sides[side]}
