"""Friction as one value, a raster, or polygons with a column: Coulomb's coefficient for every cell of the DEM.

A cell takes the value at its centre: that of the raster's cell or of the polygon that contains it. Where polygons
overlap, the later row counts. Cells without a value are rejected, unless a value for them is given.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.files.accounts import account_on_dem
from deadwood_algorithms.files.columns import field_names, number_column, where_of
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.rasters import is_raster, read_raster_on
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.intake.doubts import say_all
from deadwood_algorithms.intake.values import FRICTION, IMPLAUSIBLE
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.scene.items import say_left_out

if TYPE_CHECKING:
    from deadwood_algorithms.files.dem_windows import DemWindows

COLUMNS = ("friction", "mu")  # searched for in this order, in any letter case

Array = NDArray[np.float64]


def read_friction(
    friction: str | float, grid: Grid, feedback: Feedback, *, column: str | None = None, elsewhere: float | None = None
) -> float | Array:
    """A number, or one for each cell of the grid (row 0 south); finite and not negative."""
    value = number_of(friction)
    if value is not None:
        given = "--friction-column" if column else "--friction-elsewhere" if elsewhere is not None else None
        if given:
            raise UserError(f"{given} belongs to friction as a layer, but --friction is the number {value:g}")
        warn_of_large(value, "--friction", feedback)
        return value
    path = str(friction)
    if is_raster(path):
        if column:
            raise UserError(f"--friction-column belongs to polygons, but {path} is a raster, whose band 1 is read")
        mu, where = as_written(read_raster_on(path, grid, what="friction", feedback=feedback)), path
    else:
        shapes, values, where = _polygons(path, grid.frame, column, "--friction-column names another", feedback)
        mu = _burnt(shapes, values, grid)
        double = int((_burnt(shapes, np.ones(len(shapes)), grid, added=True) > 1).sum())
        if double:
            feedback.note(
                f"{where}: polygons overlap on {counted(double, 'cell')}; the later one counts",
                code="polygons-overlap",
                cells=int(double),
            )
    ground = np.isfinite(grid.values)
    filled = np.isnan(mu) & ground
    mu = _checked(mu, grid, where, elsewhere, "give the value there with --friction-elsewhere")
    if filled.any():
        share = filled.sum() / ground.sum()
        feedback.note(
            f"{where}: {share:.1%} of the DEM's cells have no friction and get {elsewhere:g}",
            code="friction-filled",
            share=float(share),
        )
    warn_of_large(float(np.median(mu[ground])) if ground.any() else 0.0, where, feedback)
    say_all(FRICTION, mu[ground], where, feedback)
    return mu


def as_written(values: NDArray[np.float32]) -> Array:
    """Single precision as the shortest decimal that it represents: a cell of 0.3 is 0.3, not 0.30000001192."""
    out = values.astype(np.float64, order="C")
    wrong = np.isfinite(out) & (out != 0.0)
    for digits in (6, 7, 8, 9):  # 9 digits distinguish any two
        given = out[wrong]
        scale = 10.0 ** (digits - 1 - np.floor(np.log10(np.abs(given))))
        short = np.rint(given * scale) / scale
        same = short.astype(np.float32) == given.astype(np.float32)
        at = np.flatnonzero(wrong)[same]
        out.ravel()[at] = short[same]
        wrong.ravel()[at] = False
    return out


def ends_of(span: str) -> tuple[float, float] | None:
    """The ends of a range that is written LOW-HIGH; None if it is not."""
    found = re.fullmatch(r"\s*(\d*\.?\d+)\s*-\s*(\d*\.?\d+)\s*", span)
    return (float(found[1]), float(found[2])) if found else None


def number_of(friction: str | float) -> float | None:
    """The coefficient if it is the same everywhere, or None if it comes from a layer."""
    try:
        return float(friction)
    except ValueError:
        pass
    text = str(friction).strip()
    if re.fullmatch(r"[+-]?\d*,\d+", text) and not Path(text).exists():
        raise UserError(f"--friction is '{text}'; write the number with a point, {text.replace(',', '.')}")
    number = r"[+-]?\d*\.?\d+"
    if re.fullmatch(rf"{number}(\s*[,;:]\s*{number})+", text) and not Path(text).exists():
        first, *_, last = re.findall(number, text)
        raise UserError(
            f"--friction is '{text}', several numbers; give one, a raster or polygons; to try a range, use the tool "
            f"vary with --vary friction={first}:{last}"
        )
    unit = re.fullmatch(r"([+-]?\d+[.,]?\d*)\s*(%|°|deg)", text)
    if unit and not Path(text).exists():
        given = float(unit[1].replace(",", "."))
        mu = given / 100.0 if unit[2] == "%" else math.tan(math.radians(given))
        raise UserError(f"--friction is '{text}'; give the coefficient, the tangent of the angle: {mu:.3g}")
    return None


def warn_of_large(middle: float, where: str, feedback: Feedback) -> None:
    """Warn of a coefficient, or the median of many, that no wood on soil has."""
    if middle > IMPLAUSIBLE:
        what = "friction coefficient" if where.startswith("--") else "median friction coefficient"
        tangent = math.tan(math.radians(middle))
        feedback.warn(
            f"{where}: the {what} is {middle:g}; is it in percent or degrees? Then {middle / 100.0:.3g} or "
            f"{tangent:.3g} is meant: it is the tangent of the angle of friction, such as 0.4",
            code="friction-large",
            median=float(middle),
        )


def _polygons(
    path: str, dem: Grid | DemWindows, column: str | None, fix: str, feedback: Feedback
) -> tuple[NDArray, Array, str]:
    """The polygons on the DEM, their values, and how messages name the layer; ``fix`` of a field not found."""
    frame = read_vector(path, geometry=("polygon",), target_crs=dem.crs, what="friction", feedback=feedback)
    names = {str(name).strip().lower(): str(name) for name in frame.columns if name != "geometry"}
    name = next((names[each.lower()] for each in ([column] if column else COLUMNS) if each.lower() in names), None)
    if name is None:
        asked = f"'{column}' (--friction-column)" if column else f"'friction' or 'mu'; {fix}"
        raise UserError(f"{where_of(frame)}: the friction polygons need a field {asked}; it has {field_names(frame)}")
    shapes, values = np.asarray(frame.geometry.array), number_column(frame, name, minimum=0.0)
    there = shapely.intersects(shapes, shapely.box(*dem.bounds))
    if not there.any():
        raise UserError(f"{where_of(frame)}: none of the friction polygons lies on the DEM; check the CRS of both")
    say_left_out(frame, ~there, "friction polygons", feedback.note)
    account_on_dem("friction", there)
    return shapes[there], values[there], where_of(frame)


def _burnt(shapes: NDArray, values: Array, grid: Grid, *, added: bool = False) -> Array:
    """The value of the polygon over each cell's centre, or the sum of all polygons there; NaN, or 0, where there is
    none.

    Calculated in cells from the corner of the whole DEM, shifted by integers, so that a window gives the same as the
    whole.
    """
    from rasterio.enums import MergeAlg
    from rasterio.features import rasterize

    burnt = np.full(grid.shape, 0.0 if added else np.nan)
    corner, first = np.array(grid.frame.bounds[:2]), np.array(grid.first)
    in_cells = shapely.transform(shapes, lambda xy: (xy - corner) / grid.cell - first)
    if len(in_cells):
        rasterize(zip(in_cells, values, strict=True), out=burnt, merge_alg=MergeAlg.add if added else MergeAlg.replace)
    return burnt


def _checked(
    mu: Array, grid: Grid, where: str, elsewhere: float | None = None, fix: str = "clip the DEM to it"
) -> Array:
    """Friction on every cell of the ground; gaps take the value for elsewhere."""
    ground = np.isfinite(grid.values)
    gaps = np.isnan(mu) & ground
    if gaps.any() and elsewhere is None:
        row, column = (int(index[0]) for index in np.nonzero(gaps))
        raise UserError(
            f"{where}: the friction does not cover the DEM, "
            f"{counted(gaps.sum(), 'of its cells has', 'of its cells have')} none "
            f"(one at {grid.x0 + column * grid.cell:.1f}, {grid.y0 + row * grid.cell:.1f}); "
            f"extend it, or {fix}"
        )
    mu[gaps] = elsewhere
    mu[~ground] = 0.0  # cells off the DEM are outside, whatever their value
    least = float(mu.min(initial=np.inf))
    if least < 0.0:
        raise UserError(f"{where}: the friction coefficient is {least:g} somewhere, but must not be negative")
    return mu
