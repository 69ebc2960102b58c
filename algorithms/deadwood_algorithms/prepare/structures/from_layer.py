"""The structures of a layer, ready to be built: every row with its kind, heights, widths and slopes.

For `add_structures`. A missing value of a row is taken from the option of the same name.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import geopandas
import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms import schemas
from deadwood_algorithms.files.columns import filled_column, where_of
from deadwood_algorithms.files.dem_windows import DemWindows
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.prepare.structures.earthworks import Structure, Work, stretches
from deadwood_algorithms.scene.items import ids_of

Array = NDArray[np.float64]
STEEPEST_DEG = 89.99  # represents a vertical side, whose gradient is not finite


@dataclass(frozen=True, kw_only=True)
class StructureDefaults:
    """Values for rows without the corresponding columns, by column name, and values for all rows."""

    kind: str
    height_m: float | None
    elevation_m: float | None
    crest_width_m: float
    slope_deg: float
    slope_left_deg: float | None
    slope_right_deg: float | None
    elevation_from_z: bool
    max_reach_m: float


@dataclass
class Plan:
    """A row of the layer as it will be built, its name in messages, and its volumes."""

    structure_id: Any
    kind: str
    at: str
    structure: Structure
    above: Array  # [m] of the crest over the ground along the line, for a ditch its depth
    work: Work = field(default_factory=Work)


def plans_of(
    frame: geopandas.GeoDataFrame, defaults: StructureDefaults, dem: DemWindows, feedback: Feedback
) -> list[Plan]:
    """The structure of every row; incomplete ones, and those completely off the DEM, are rejected."""
    ids = ids_of(frame, "structure_id", "name")
    kinds = _kinds(frame, defaults)
    heights, elevations, widths = (
        _filled(frame, defaults, each) for each in ("height_m", "elevation_m", "crest_width_m")
    )
    left, right = (_falls(frame, defaults, side) for side in ("left", "right"))
    _warn_of_narrow(widths, dem.cell, where_of(frame), feedback)
    plans = []
    for row, line in enumerate(frame.geometry):
        at = f"{where_of(frame)}, row {row + 1}"
        sign = 1.0 if kinds[row] == "embankment" else -1.0
        crest = _crest(line, sign * heights[row], elevations[row], defaults.elevation_from_z, at)
        parts = [stretches(part, sign, dem.height, crest, dem.cell / 2.0) for part in shapely.get_parts(line)]
        paths = [part for part in parts if part]
        if not paths:
            raise UserError(f"{at}: the line has no length; delete the row")
        half = widths[row] / 2.0
        structure = Structure(sign, half, left[row], right[row], half + defaults.max_reach_m, paths)
        above = np.concatenate([stretch.above for path in paths for stretch in path])
        _say_of_crest(above, kinds[row], at, feedback)
        plans.append(Plan(ids[row], kinds[row], at, structure, above))
    return plans


def _crest(line: Any, rise: float, elevation: float, from_z: bool, at: str) -> Callable[[Array, Array], Array]:
    """Elevation of the crest from that of the ground under it and the line's own Z."""
    if from_z:
        if not np.isfinite(shapely.get_coordinates(line, include_z=True)).all():
            raise UserError(f"{at}: the line has no Z, from which --elevation-from-z takes the crest")
        return lambda ground, z: z
    if np.isfinite(elevation):
        return lambda ground, z: np.full(ground.shape, elevation)
    if np.isnan(rise):
        raise UserError(f"{at}: neither height_m nor elevation_m is given; fill one, or give --height-m")
    return lambda ground, z: ground + rise


def _say_of_crest(above: Array, kind: str, at: str, feedback: Feedback) -> None:
    known = above[np.isfinite(above)]
    if not known.size:
        raise UserError(f"{at}: the line lies off the DEM or on its nodata; check the CRS of both")
    if known.size < above.size:
        feedback.warn(
            f"{at}: {100.0 * (1.0 - known.size / above.size):.0f} % of the line lies off the DEM, or on its nodata",
            code="off-dem",
        )
    within = float((known <= 0.0).mean())
    if within:
        wrong = "crest is not above the ground" if kind == "embankment" else "bottom is not below the ground"
        feedback.warn(
            f"{at}: along {100.0 * within:.0f} % of the line the {wrong}, which is not changed there",
            code="structure-within-ground",
            share=within,
        )


def _warn_of_narrow(widths: Array, cell: float, where: str, feedback: Feedback) -> None:
    diagonal = cell * np.sqrt(2.0)
    if (widths < diagonal).any():
        feedback.warn(
            f"{where}: the crest of {int((widths < diagonal).sum())} structures is narrower than the diagonal of a "
            f"cell ({diagonal:.2g} m) and comes out notched; widen it, or make it a barrier of slide-logs",
            code="narrow-crest",
        )


def _kinds(frame: geopandas.GeoDataFrame, defaults: StructureDefaults) -> list[str]:
    if "kind" not in frame:
        return [defaults.kind] * len(frame)
    empty = frame["kind"].isna()
    kinds = [
        defaults.kind if gap else str(word).strip().lower() for word, gap in zip(frame["kind"], empty, strict=True)
    ]
    for row, kind in enumerate(kinds):
        fault = schemas.value_fault(schemas.STRUCTURES.column("kind"), kind)
        if fault:
            raise UserError(f"{where_of(frame)}, field 'kind', row {row + 1}: {fault}")
    return kinds


def _filled(frame: geopandas.GeoDataFrame, defaults: StructureDefaults, *names: str) -> Array:
    """The first of these columns that is filled, else the first of these options that is given, else NaN."""
    values = np.full(len(frame), np.nan)
    for name in names:
        known = schemas.STRUCTURES.column(name)
        column = filled_column(
            frame, name, None, minimum=known.minimum, exclusive=known.exclusive, maximum=known.maximum
        )
        values = np.where(np.isnan(values), column, values)
    options = [getattr(defaults, name) for name in names if getattr(defaults, name) is not None]
    return np.where(np.isnan(values), options[0] if options else np.nan, values)


def _falls(frame: geopandas.GeoDataFrame, defaults: StructureDefaults, side: str) -> Array:
    """Height over distance of the sides on the left or right."""
    return np.tan(np.radians(np.minimum(_filled(frame, defaults, f"slope_{side}_deg", "slope_deg"), STEEPEST_DEG)))
