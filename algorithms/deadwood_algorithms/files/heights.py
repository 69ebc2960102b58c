"""Checks of heights: which cells hold no valid height, and whether the ground has artificial steps.

Arrays only, for `dem_windows`; cells outside are NaN.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files import remedies
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, UserError

# Limits of ground on Earth. The shore of the Dead Sea is at -440 m, the deepest open pit at -300 m. Beyond FARTHEST_M
# are undeclared nodata values such as -9999, -32768 or 3.4e38.
LOWEST_M, HIGHEST_M, FARTHEST_M = -500.0, 9000.0, 9000.0
# A cell beside nodata that is this far below, or above, all its inland neighbours, and steeper than 89 degrees, is a
# mean of ground and a nodata value: on cells of 1 m one part in 150 of -9999 m is enough.
MIXED_DROP_M, MIXED_SLOPE = 50.0, 60.0
MIXED_CELLS = 12  # width of the zone that resampling mixes, at most: cells of 10 m brought to 1 m
MARGIN_CELLS = MIXED_CELLS + 2  # margin around a window with which its cells are judged as in the whole

# Cells of exactly one of these heights, so far below all the others, are an undeclared empty margin, not a chasm. Other
# usual values for nodata, such as -999 and -9999, are no heights on Earth.
COLLARS_M = (0.0, -1.0, -9.0, -99.0)
COLLAR_DROP_M = 100.0

# Heights in feet turn a slope of 30 degrees into one of 62. No hillside of any size has such a median slope.
STEEPEST_DEG = 58.0
FOOT_M = 0.3048
SMALLER_UNITS = {"decimetres": 0.1, "centimetres": 0.01, "millimetres": 0.001}

STEP_M = 0.2  # lower steps hold no log
# Shares of pairs of adjacent differences, along rows or columns: at least the first share is not level in both,
# and of these the second share is between level ground and a step. On surveyed ground hardly any pair is; with whole
# metres and repeated cells most are.
SLOPING_SHARE, STEPPED_SHARE = 0.05, 0.3
JUDGED_BY = 200  # pairs of cells; fewer do not decide
UNEVEN_SHARE = 0.2  # of multiples of a step that are not a plane
ROUNDED_TO_M = 0.002  # heights of some thousand metres in 32 bits
BLOCK_CELLS = 2**22  # judged at once
RISE_CELLS = 500  # side of an array's corner by which its unit is judged
HOLE_CELLS = 2**22  # size of an array, or of its blocks, in which holes are searched for
EVERYWHERE = slice(None), slice(None)


def without_ground(heights: NDArray[np.floating], cell: float) -> NDArray[np.bool_]:
    """Which cells have an impossible height: one that does not exist on Earth, or a mean of ground and nodata.

    A cell is judged by those within `MARGIN_CELLS`, so a window with that margin gives the same result as the whole.
    """
    with np.errstate(invalid="ignore"):
        bad = (heights < LOWEST_M) | (heights > HIGHEST_M)
    outside = ~np.isfinite(heights)
    if outside.all() or not (bad.any() or outside.any()):
        return bad
    mixed = bad & (np.abs(heights) <= FARTHEST_M)
    drop = max(MIXED_DROP_M, MIXED_SLOPE * cell)
    for _ in range(MIXED_CELLS):
        empty = outside | bad
        rim = _grown(empty) & ~empty
        rows, columns = np.nonzero(rim)
        if not rows.size:
            break
        low, high = _inland(heights, empty | rim, rows, columns)
        here = heights[rows, columns]
        fallen = (here < low - drop) | (here > high + drop)
        fallen &= np.isfinite(low) & np.isfinite(high)
        if not fallen.any():
            break
        bad[rows[fallen], columns[fallen]] = mixed[rows[fallen], columns[fallen]] = True
    return bad | (_grown(mixed) & ~outside)  # including the last ring, of which less than one part in 150 is nodata


def candidates_for_collar(heights: NDArray[np.floating]) -> list[float]:
    """The values of `COLLARS_M` that some cells hold."""
    low = np.fmin.reduce(heights, axis=None)
    return [empty for empty in COLLARS_M if low <= empty and (heights == empty).any()]


def lowest_inland(
    heights: NDArray[np.floating], cell: float, empty: float, inner: tuple[slice, slice] = EVERYWHERE
) -> float:
    """The lowest height without cells of ``empty`` and those mixed with them, by which to decide whether that is
    nodata."""
    outside = heights == empty
    with np.errstate(invalid="ignore"):
        fit = ~outside & (np.abs(heights) <= FARTHEST_M)
        if outside.any() and (heights[inner] <= empty + COLLAR_DROP_M)[fit[inner]].any():  # mixed, or low ground
            fit &= ~without_ground(np.where(outside, np.nan, heights), cell)
    return float(np.min(heights[inner], where=fit[inner], initial=np.inf))


def _grown(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The mask and the eight neighbours of each of its cells."""
    wide = mask.copy()
    wide[1:] |= mask[:-1]
    wide[:-1] |= mask[1:]
    out = wide.copy()
    out[:, 1:] |= wide[:, :-1]
    out[:, :-1] |= wide[:, 1:]
    return out


def _inland(
    heights: NDArray[np.floating], apart: NDArray[np.bool_], rows: NDArray[np.intp], columns: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest neighbour of each cell that is not ``apart``; infinite if there is none."""
    low, high = np.full(rows.size, np.inf), np.full(rows.size, -np.inf)
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            j, i = rows + down, columns + right
            inside = (j >= 0) & (i >= 0) & (j < heights.shape[0]) & (i < heights.shape[1])
            j, i = np.where(inside, j, 0), np.where(inside, i, 0)
            inside &= ~apart[j, i]
            low = np.where(inside, np.minimum(low, heights[j, i]), low)
            high = np.where(inside, np.maximum(high, heights[j, i]), high)
    return low, high


@dataclass(frozen=True)
class Steps:
    """Steps of a terrain model that no ground has.

    height_m : height of a typical step
    rounded_m : unit of which the heights are multiples; 0 if that is not the cause
    repeated : how many cells in a row, and in a column, share one height; 1 if that is not the cause
    """

    height_m: float
    rounded_m: float
    repeated: int


def steps_of(samples: list[NDArray[np.floating]]) -> Steps | None:
    """The steps in samples of a terrain model, or None if there are none."""
    pairs, sloping, stepped, uneven = np.zeros((4, 2), int)  # along rows, and along columns
    all_rises, gaps = [np.empty(0)], [np.empty(0, int)]
    for heights in samples:
        for axis, along in enumerate((heights, heights.T)):
            rise = np.diff(along.astype(np.float64), axis=1)
            one, two = rise[:, :-1], rise[:, 1:]
            both = np.isfinite(one) & np.isfinite(two)
            pairs[axis] += int(both.sum())
            sloping[axis] += int((both & ((one != 0.0) | (two != 0.0))).sum())
            stepped[axis] += int((both & ((one == 0.0) & _is_step(two) | _is_step(one) & (two == 0.0))).sum())
            uneven[axis] += int((both & (np.abs(one - two) >= STEP_M)).sum())
            all_rises.append(np.abs(rise[np.isfinite(rise) & (rise != 0.0)]))
            gaps.append(np.diff(np.flatnonzero((np.abs(rise) > 0.0).any(axis=0))))
    judged = (pairs >= JUDGED_BY) & (sloping > SLOPING_SHARE * pairs)
    if not judged.any():
        return None
    rises = np.concatenate(all_rises)
    rounded = _unit_of(rises) if uneven.sum() > UNEVEN_SHARE * sloping.sum() else 0.0
    if not rounded and not (judged & (stepped >= STEPPED_SHARE * sloping)).any():
        return None
    between = np.concatenate(gaps)
    least = int(between.min()) if between.size else 1
    repeated = least if not (between % least).any() else 1
    return Steps(float(np.median(rises[_is_step(rises)])), rounded if repeated == 1 else 0.0, repeated)


def _unit_of(rises: NDArray[np.float64]) -> float:
    """The unit of which height differences [m], none of them 0, are multiples, if that makes steps; otherwise 0."""
    unit = float(np.min(rises, initial=np.inf))
    if not STEP_M <= unit < np.inf:
        return 0.0
    unit = float(np.median(rises / np.rint(rises / unit)))
    return unit if np.abs(rises - unit * np.rint(rises / unit)).max() <= ROUNDED_TO_M else 0.0


def _is_step(rise: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.abs(rise) >= STEP_M


class Found:
    """Cells that were turned into NaN because they contain no valid height, and the report about them.

    ``inner`` is the part of the array that is reported; the rest is outside the window.
    """

    def __init__(self) -> None:
        self.far, self.mixed = 0, 0
        self.collars: dict[float, int] = {}  # cells by the height of the empty margin
        self.shown, self.lowest, self.highest = 0.0, np.inf, -np.inf
        self.numbers = np.inf, -np.inf  # lowest and highest number in the file, whatever they mean
        self.rise = np.nan  # typical difference from cell to cell, of numbers that are not heights

    def empty_far(self, values: NDArray[Any], inner: tuple[slice, slice] = EVERYWHERE) -> None:
        """Remove undeclared nodata values that are not heights on Earth."""
        low, high = _extremes(values)
        self.numbers = float(np.fmin(low, self.numbers[0])), float(np.fmax(high, self.numbers[1]))
        if max(-low, high) > FARTHEST_M:
            bad = np.abs(values) > FARTHEST_M
            self.far += int(bad[inner].sum())
            self.shown = float(values[bad][0])
            if low > FARTHEST_M:  # all of them: in another unit, perhaps
                rises = slopes_of(values[:RISE_CELLS, :RISE_CELLS], 1.0)
                self.rise = float(np.median(rises)) if rises.size else np.nan
            values[bad] = np.nan

    def empty_collar(self, values: NDArray[Any], empty: float, inner: tuple[slice, slice] = EVERYWHERE) -> None:
        """Remove cells of one height, which the caller knows to be an empty margin."""
        outside = values == empty
        self.collars[empty] = self.collars.get(empty, 0) + int(outside[inner].sum())
        values[outside] = np.nan

    def empty_mixed(self, values: NDArray[Any], cell: float, inner: tuple[slice, slice] = EVERYWHERE) -> None:
        """Remove cells that are a mean of ground and nodata, strip by strip."""
        step, bad = max(1, BLOCK_CELLS // values.shape[1]), []
        for start in range(0, values.shape[0], step):
            first, stop = max(0, start - MARGIN_CELLS), min(values.shape[0], start + step)
            strip = values[first : stop + MARGIN_CELLS]
            # nothing is known outside the array; that of a window has a margin of MARGIN_CELLS
            mask = without_ground(np.pad(strip, 1, constant_values=np.nan), cell)[1:-1, 1:-1]
            rows, columns = np.nonzero(mask[start - first : stop - first])
            bad.append((rows + start, columns))
        rows, columns = (np.concatenate(each) for each in zip(*bad, strict=True))
        mask = np.zeros(values.shape, bool) if rows.size else None
        if mask is not None:
            mask[rows, columns] = True
            self.count_mixed(values[inner][mask[inner]])
            values[mask] = np.nan

    def count_mixed(self, heights: NDArray[Any]) -> None:
        self.mixed += heights.size
        self.lowest = float(np.min(heights, initial=self.lowest))
        self.highest = float(np.max(heights, initial=self.highest))

    def refuse_nothing(self, path: str, cell: float) -> None:
        """Reject a DEM without any height: every cell is nodata, or its numbers are not heights in metres."""
        low, high = self.numbers
        if not low <= high:
            raise UserError(
                f"{path}: the DEM holds no height at all, every cell is nodata; check the band and its nodata value"
            )
        said = f"{path}: the DEM's numbers, {low:g} to {high:g}, are not heights in metres"
        for unit, factor in SMALLER_UNITS.items():
            slope_deg = np.degrees(np.arctan(self.rise * factor / cell))
            if low > 0.0 and high * factor <= HIGHEST_M and not slope_deg > STEEPEST_DEG:
                span = f"{low * factor:.0f} to {high * factor:.0f} m"
                raise UserError(f"{said}; in {unit} they would be {span}, fix: {remedies.times(path, factor)}")
        raise UserError(f"{said}; check the band, its sign and its unit")

    def say(self, path: str, feedback: Feedback) -> None:
        if self.far:
            feedback.warn(
                f"{path}: {counted(self.far, 'cell holds', 'cells hold')} {self.shown:g} m, which is not a height on "
                "Earth; taken as outside",
                code="undeclared-nodata",
                cells=self.far,
            )
        for empty, cells in self.collars.items():
            if cells:
                feedback.warn(
                    f"{path}: {counted(cells, 'cell holds', 'cells hold')} exactly {empty:g} m, all others more than "
                    f"{empty + COLLAR_DROP_M:g} m: taken as outside (an undeclared nodata value)",
                    code="undeclared-nodata",
                    cells=cells,
                )
        if self.mixed:
            feedback.warn(
                f"{path}: {counted(self.mixed, 'cell beside nodata holds', 'cells beside nodata hold')} impossible "
                f"heights ({self.lowest:.0f} to {self.highest:.0f} m), as if a DEM had been warped with its nodata "
                "value as a height: taken as outside, with their neighbours",
                code="undeclared-nodata",
                cells=self.mixed,
            )


@dataclass(frozen=True)
class Holes:
    """Inner parts without heights: how many, their cells in total, those of the largest, and one cell of it."""

    number: int
    cells: int
    largest: int
    row: int
    column: int


def holes_in(values: NDArray[np.floating]) -> Holes | None:
    """The parts without heights that do not touch the border of the array; of a large one in blocks of its cells."""
    from rasterio.features import shapes  # only needed here
    from shapely.geometry import shape

    outside = ~np.isfinite(values)
    if not outside.any():
        return None
    side = max(1, math.ceil(math.sqrt(values.size / HOLE_CELLS)))
    if side > 1:
        rows, columns = (range(0, n, side) for n in values.shape)
        outside = np.logical_or.reduceat(np.logical_or.reduceat(outside, rows, axis=0), columns, axis=1)
    areas, places = [], []
    for each, _ in shapes(outside.astype(np.uint8), mask=outside, connectivity=8):
        ring = np.asarray(each["coordinates"][0])
        if ring.min() > 0 and ring[:, 0].max() < outside.shape[1] and ring[:, 1].max() < outside.shape[0]:
            areas.append(round(shape(each).area) * side**2)
            within = shape(each).representative_point()
            places.append((int(within.y) * side, int(within.x) * side))
    if not areas:
        return None
    largest = int(np.argmax(areas))
    return Holes(len(areas), sum(areas), areas[largest], *places[largest])


def _extremes(values: np.ndarray) -> tuple[float, float]:
    """Lowest and highest value, ignoring NaN (returned if there is nothing else)."""
    return float(np.fmin.reduce(values, axis=None)), float(np.fmax.reduce(values, axis=None))


def warn_of_heights(samples: list[NDArray[Any]], path: str, cell: float, feedback: Feedback) -> None:
    """Warn of slopes and of steps that no ground has, by samples of a terrain model."""
    steps = steps_of(samples)
    if steps is not None:
        why = f"its heights repeat from cell to cell and rise in steps of {steps.height_m:.2g} m"
        if steps.rounded_m:
            why = f"its heights are rounded to {steps.rounded_m:.3g} m"
        if steps.repeated > 1:
            k, size = steps.repeated, steps.repeated * cell
            why = f"it repeats cells of {size:g} m as {k} x {k} of its own, in steps of {steps.height_m:.2g} m"
        feedback.warn(
            f"{path}: {why}. Such steps, which real ground does not have, slow and hold logs, so that too few go "
            "far; use heights with decimals, resampled by a bilinear or cubic method",
            code="stepped-heights",
            step_m=steps.height_m,
        )
    slopes = np.concatenate([slopes_of(each, cell) for each in samples] or [np.empty(0)])
    steep = float(np.degrees(np.arctan(np.median(slopes)))) if slopes.size >= JUDGED_BY else 0.0
    if steep > STEEPEST_DEG:
        feedback.warn(steep_words(path, steep, "over its cells"), code="steep", slope_deg=steep)


def steep_words(path: str, slope_deg: float, where: str) -> str:
    """The warning about a slope that heights in feet, or in decimetres, would explain."""
    factor, unit = (FOOT_M, "feet") if _slope_with(slope_deg, FOOT_M) <= STEEPEST_DEG else (0.1, "decimetres")
    return (
        f"{path}: the median slope {where} is {slope_deg:.0f} degrees, steeper than almost any ground; are its heights "
        f"in {unit} (then it is {_slope_with(slope_deg, factor):.0f} degrees), or in another unit than metres? "
        f"Fix: {remedies.times(path, factor)}"
    )


def _slope_with(slope_deg: float, factor: float) -> float:
    return float(np.degrees(np.arctan(np.tan(np.radians(slope_deg)) * factor)))


def slopes_of(heights: NDArray[Any], cell: float) -> NDArray[np.float64]:
    """The slopes [m/m] between neighbouring cells that have heights."""
    rise = np.hypot(np.diff(heights[:-1], axis=1), np.diff(heights, axis=0)[:, :-1]) / cell
    return rise[np.isfinite(rise)]
