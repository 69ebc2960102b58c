"""What is doubted about a terrain model: crowns on it, numbers that are no heights, an undeclared value for nothing.

Arrays only: samples of the heights [m], NaN outside, as `files/dem_windows` takes them from a large model. The steps
and the steepness of heights are judged there too (`files/heights`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.intake.doubts import Check, Doubt
from deadwood_algorithms.intake.names import OF_SLOPE, words_of
from deadwood_algorithms.params.counts import counted

# A top stands more than CROWN_M above every cell of a ring of RING_M: 0.000 to 0.010 per ha on terrain models, cliffs
# of 8 m included, and 27 to 47 on surface models of a forest. COARSEST_M: beyond it a crown is less than a cell.
CROWN_M, RING_M, COARSEST_M = 3.0, 4.0, 4.0
TOPS_PER_HA, FEWEST_TOPS = 0.5, 3
# Broad crowns and roofs have no such top, but walls on both sides, along rows and along columns: above the mean slope
# the surface rises by more than CROWN_M (or WALL times the distance) within WALL_M, and falls so again within BROAD_M.
# None of the cells of terrain models lie so between walls; 1 % do with four houses on 4 ha, 15
# to 60 % under crowns of 7 to 10 m.
WALL, WALL_M, BROAD_M, BROAD_SHARE = 2.0, 1.0, 12.0, 0.002

# Heights rise over LAG cells nearly LAG times as much as over one: 0.66 to 1.0 of that on terrain models. Slopes,
# aspects and grey values wander within their range: 0.15 to 0.29 on the same ground. On smooth ground they differ
# farther apart, over SMOOTH_LAG cells but at most SMOOTH_M: 0.12 to 0.62 against 0.72 and more.
LAG, WANDERING, WANDERING_NAMED = 16, 0.45, 0.9
SMOOTH_LAG, SMOOTH_M, WANDERING_SMOOTH = 64, 100.0, 0.63
LEAST_SPREAD, MOST_DEGREES, LEAST_DEGREES = 15.0, 360.0, -180.0
MOST_SLOPE_DEG, LEAST_SLOPE_CELLS = 90.0, 100
# Tangents, radians, cosines, curvatures: small numbers, which as heights are ground without relief.
MOST_SMALL, LEVEL = 2.0 * np.pi, 0.02

# Distances from something fall towards it by one per metre wherever they are, to one of eight neighbours by 0.92 to 1;
# so do costs of ways over even ground. Of a piece of real ground at most 57 % of the cells are as steep as one another.
EVEN, EVEN_SHARE = 0.09, 0.9
SIDES, SIDE_SHARE = 3, 0.05  # a plane falls to one side only, and a valley between two planes to two

# An undeclared margin of one value on low ground is lower than its rim by more than the shore of a sea.
EMPTY_M = (0.0, -1.0, -9.0, -99.0)
RIM_M, RIM_TIMES, EMPTY_CELLS, EMPTY_SHARE = 3.0, 3.0, 20, 0.002
LOW_M = 100.0  # above it `files/heights` takes such a margin as outside


@dataclass(frozen=True)
class Terrain:
    """Samples of a terrain model: heights [m], their cell [m], the file's name, and the command that declares nodata.

    named : what the file and its band are called
    """

    samples: Sequence[NDArray[np.floating]]
    cell: float
    named: str = ""
    declared: Callable[[float], str] = lambda value: f"declare {value:g} as its nodata"


def crowns(terrain: Terrain) -> Doubt | None:
    """A surface model: many tops that no ground has, or broad crowns and roofs between walls."""
    if terrain.cell > COARSEST_M:
        return None
    found = [tops_of(each, terrain.cell) for each in terrain.samples]
    tops, hectares = (sum(each) for each in zip(*found, strict=True))
    rate, share = tops / max(hectares, 1e-9), _share_between_walls(terrain)
    if tops >= max(FEWEST_TOPS, TOPS_PER_HA * hectares):
        seen = (
            f"{rate:.3g} tops per hectare stand more than {CROWN_M:g} m above everything {RING_M:g} m around them, as "
            "tree crowns do, and no ground"
        )
    elif share >= BROAD_SHARE:
        seen = f"{100.0 * share:.2g} % of it stands between walls that fall to all sides, as broad crowns and roofs do"
    else:
        return None
    return Doubt(
        "surface-model",
        f"{seen}; is it a surface model (DSM, DOM, MNS)? Logs would slide over the crowns: use the terrain model (DTM, "
        "DGM, MNT)",
        {"tops": tops, "tops_per_ha": rate, "share_between_walls": share},
    )


def _share_between_walls(terrain: Terrain) -> float:
    """Share of the cells that lie, along their row and along their column, between a rise and a fall like walls."""
    apart, reach = max(1, round(WALL_M / terrain.cell)), max(2, round(BROAD_M / terrain.cell))
    wall = max(CROWN_M, WALL * apart * terrain.cell)
    between = known = 0
    for heights in map(_levelled, terrain.samples):
        both = _between(heights, apart, reach, wall) & _between(heights.T, apart, reach, wall).T
        between, known = between + int(both.sum()), known + int(np.isfinite(heights).sum())
    return between / known if known else 0.0


def _levelled(heights: NDArray[np.floating]) -> NDArray[np.float64]:
    """The heights without the slope that they have in the middle, on which a wall uphill rises, too."""
    out = heights.astype(np.float64)
    for axis, at in enumerate(np.indices(heights.shape, sparse=True)):
        rise = np.diff(heights, axis=axis)
        known = rise[np.isfinite(rise)]
        out -= at * (float(np.median(known)) if known.size else 0.0)
    return out


def _between(heights: NDArray[np.float64], apart: int, reach: int, wall: float) -> NDArray[np.bool_]:
    """Cells of which a wall rises within ``reach`` cells before them along their row, and one falls behind them."""
    rise = np.zeros(heights.shape)
    if heights.shape[1] > apart:
        rise[:, apart:] = heights[:, apart:] - heights[:, :-apart]
    count = [np.cumsum(np.pad(side, ((0, 0), (1, reach + apart))), axis=1) for side in (rise > wall, rise < -wall)]
    at = np.arange(heights.shape[1])
    up = count[0][:, at + 1] - count[0][:, np.maximum(at + 1 - reach, 0)]
    down = count[1][:, at + apart + reach] - count[1][:, at + apart]
    return (up > 0) & (down > 0)


def tops_of(heights: NDArray[np.floating], cell: float) -> tuple[int, float]:
    """How many cells are tops, the highest of their eight neighbours, and on how many hectares they were sought."""
    reach = int(np.ceil(RING_M / cell + 0.5))
    ny, nx = heights.shape[0] - 2 * reach, heights.shape[1] - 2 * reach
    if ny < 1 or nx < 1:
        return 0, 0.0

    def shifted(down: int, right: int) -> NDArray[np.floating]:
        return heights[reach + down : reach + down + ny, reach + right : reach + right + nx]

    span = range(-reach, reach + 1)
    ring = [(j, i) for j in span for i in span if abs(np.hypot(j, i) * cell - RING_M) <= 0.5 * cell]
    around, known = np.full((ny, nx), -np.inf), np.isfinite(shifted(0, 0))
    for offset in ring:
        there = shifted(*offset)
        around = np.fmax(around, there)
        known &= np.isfinite(there)
    here = shifted(0, 0)
    top = known & (here - np.where(known, around, 0.0) > CROWN_M)
    if top.any():
        near = [(j, i) for j in (-1, 0, 1) for i in (-1, 0, 1) if j or i]
        for offset in near:
            top &= (here > shifted(*offset)) if offset < (0, 0) else (here >= shifted(*offset))
    return int(top.sum()), float(known.sum()) * cell**2 / 1e4


def no_heights(terrain: Terrain) -> Doubt | None:
    """Slopes, aspects, grey values, curvatures in place of heights: within their range, and wandering."""
    if (doubt := _distances(terrain)) is not None:
        return doubt
    known = np.concatenate([each[np.isfinite(each)] for each in terrain.samples] or [np.empty(0)])
    if known.size < LEAST_SLOPE_CELLS or known.min() < LEAST_DEGREES or known.max() > MOST_DEGREES:
        return None
    (low, high), small = np.quantile(known, [0.05, 0.95]), np.abs(known).max() <= MOST_SMALL
    side = max(float(np.hypot(*each.shape)) for each in terrain.samples) * terrain.cell
    if not (0.0 < high - low < LEVEL * side if small else high - low > LEAST_SPREAD):
        return None
    near = min(LAG, round(SMOOTH_M / terrain.cell))  # hills wander, too, farther apart
    wander = wandering(terrain.samples, near) if near > 1 else 1.0
    limit = WANDERING_NAMED if words_of(terrain.named) & OF_SLOPE else WANDERING
    shortest = min(min(each.shape) for each in terrain.samples) // 3
    far = max(near, min(SMOOTH_LAG, shortest, round(SMOOTH_M / terrain.cell)))
    if wander >= limit and wandering(terrain.samples, far) >= WANDERING_SMOOTH:
        return None
    what = "aspects or grey values" if known.max() > MOST_SLOPE_DEG or known.min() < 0.0 else "slopes in degrees"
    what = "slopes in radians or as tangents, or another measure of the relief" if small else what
    return Doubt(
        "not-heights",
        f"its numbers, {known.min():.3g} to {known.max():.3g}, look like {what}, not like heights: give the terrain "
        "model itself",
        {"lowest": float(known.min()), "highest": float(known.max()), "wandering": wander},
    )


def _distances(terrain: Terrain) -> Doubt | None:
    """Distances or costs of ways: everywhere as steep as anywhere else, and falling to several sides."""
    falls, sides = [], []
    for heights in terrain.samples:
        if min(heights.shape) > 2:
            steepest = np.stack([_fall(heights, j, i) for j in (-1, 0, 1) for i in (-1, 0, 1) if j or i])
            known = np.isfinite(steepest).all(axis=0) & (steepest.max(axis=0) > 0.0)
            falls.append(steepest.max(axis=0)[known] / terrain.cell)
            sides.append(steepest.argmax(axis=0)[known])
    fall, side = (np.concatenate(each or [np.empty(0)]) for each in (falls, sides))
    if fall.size < LEAST_SLOPE_CELLS:
        return None
    middle = float(np.median(fall))
    share = float((np.abs(fall - middle) <= EVEN * middle).mean())
    if share < EVEN_SHARE or (np.bincount(side.astype(int)) > SIDE_SHARE * side.size).sum() < SIDES:
        return None
    return Doubt(
        "not-heights",
        f"{100.0 * share:.0f} % of it falls by {middle:.2g} per metre, to all sides, as distances or costs of ways do, "
        "and no ground: give the terrain model itself",
        {"fall": middle, "share": share},
    )


def _fall(heights: NDArray[np.floating], down: int, right: int) -> NDArray[np.float64]:
    """By how much inner cells stand above one of their neighbours, for each cell of distance."""
    ny, nx = heights.shape
    there = heights[1 + down : ny - 1 + down, 1 + right : nx - 1 + right].astype(np.float64)
    return (heights[1:-1, 1:-1] - there) / np.hypot(down, right)


def wandering(samples: Sequence[NDArray[np.floating]], lag: int) -> float:
    """Mean difference over ``lag`` cells as a share of ``lag`` mean differences over one; 1 for a plane."""
    rises = [_mean_rise(samples, apart) for apart in (1, lag)]
    return rises[1] / rises[0] / lag if rises[0] > 0.0 and np.isfinite(rises[1]) else 1.0


def _mean_rise(samples: Sequence[NDArray[np.floating]], apart: int) -> float:
    """Mean difference [m] between cells so far apart along rows and columns; NaN if there are none."""
    total, cells = 0.0, 0
    for heights in samples:
        for along in (heights, heights.T):
            rise = np.abs(along[:, apart:].astype(np.float64) - along[:, :-apart])
            total, cells = total + float(np.nansum(rise)), cells + int(np.isfinite(rise).sum())
    return total / cells if cells else np.nan


def undeclared(terrain: Terrain) -> Doubt | None:
    """Cells of one usual value for nothing, beside ground that rises from them like a wall."""
    for empty in EMPTY_M:
        cells, all_cells, rim, rises, lowest = 0, 0, [np.empty(0)], [np.empty(0)], np.inf
        for heights in terrain.samples:
            hole, known = heights == empty, np.isfinite(heights)
            cells, all_cells = cells + int(hole.sum()), all_cells + int(known.sum())
            lowest = min(lowest, float(np.min(heights, where=known & ~hole, initial=np.inf)))
            for one, other, a, b in _pairs(heights, hole):
                rim += [(b - empty)[one & ~other & np.isfinite(b)], (a - empty)[other & ~one & np.isfinite(a)]]
                rises.append(np.abs(a - b)[~one & ~other & np.isfinite(a) & np.isfinite(b)])
        edge, usual = np.concatenate(rim), np.concatenate(rises)
        if cells < max(EMPTY_CELLS, EMPTY_SHARE * all_cells) or edge.size < 5 or lowest > empty + LOW_M:
            continue
        step = float(np.median(edge))
        if step > max(RIM_M, RIM_TIMES * (float(np.median(usual)) if usual.size else 0.0)):
            return Doubt(
                "undeclared-nodata",
                f"{counted(cells, 'cell holds', 'cells hold')} exactly {empty:g} m, and the ground "
                f"beside them stands {step:.3g} m above them: is this an undeclared nodata value? "
                "Logs would come to rest there. Fix: " + terrain.declared(empty),
                {"value_m": empty, "cells": cells, "rim_m": step},
            )
    return None


def _pairs(
    heights: NDArray[np.floating], hole: NDArray[np.bool_]
) -> Iterator[tuple[NDArray, NDArray, NDArray, NDArray]]:
    """Neighbours along rows and columns: whether each is in the hole, and their heights."""
    for values, empty in ((heights, hole), (heights.T, hole.T)):
        yield empty[:, :-1], empty[:, 1:], values[:, :-1], values[:, 1:]


OTHERS = "slopes, aspects, grey values, curvatures or distances in place of heights"
NO_HEIGHTS = Check("not-heights", OTHERS, no_heights)
# Of what are heights.
CHECKS = (
    Check("surface-model", "a surface model: tree crowns or roofs stand on it", crowns),
    Check("undeclared-nodata", "an undeclared value for nodata on low ground", undeclared),
)
