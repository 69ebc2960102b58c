"""Stands of a random forest: polygons on the DEM, each with the numbers that its columns give.

For `generate_forest`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import shapely

from deadwood_algorithms.files.accounts import account, account_on_dem, count_of
from deadwood_algorithms.files.columns import number_column, where_of
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.units import factor, named, scaled
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.prepare.trees.patches import patches_over
from deadwood_algorithms.prepare.trees.planting import Ground, ground_of
from deadwood_algorithms.scene.items import say_left_out
from deadwood_algorithms.schemas import DBH_CM, TREE_M

if TYPE_CHECKING:
    import geopandas

    from deadwood_algorithms.files.dem_blocks import DemBlocks

DENSEST_PER_HA = 1e6  # 100 seedlings per m2; not a forest, but a wrong unit
# Column -> its minimum and maximum, and whether the minimum itself is allowed; and the names in PlatRock's zones.
COLUMNS: dict[str, tuple[float, float | None, bool]] = {
    "stems_per_ha": (0.0, DENSEST_PER_HA, True),
    "dbh_mean_cm": (0.0, DBH_CM[1], False),
    "dbh_sd_cm": (0.0, None, True),
    "height_mean_m": (0.0, TREE_M[1], False),
    "height_sd_m": (0.0, None, True),
    "correlation": (-1.0, 1.0, True),
}
OTHER_NAMES = {"trees_density": "stems_per_ha", "trees_dhp_mean": "dbh_mean_cm", "trees_dhp_std": "dbh_sd_cm"}
OTHER_NAMES |= {"trees_dens": "stems_per_ha", "trees_dhp_": "dbh_mean_cm", "stems_per_": "stems_per_ha"}
OTHER_NAMES |= {"dbh_mean_c": "dbh_mean_cm", "height_mea": "height_mean_m", "height_sd_": "height_sd_m"}


@dataclass(frozen=True)
class Stand:
    """Where trees of one kind may stand, and the values from the stand's own columns (empty: none)."""

    ground: Ground
    numbers: dict[str, float]
    name: str = ""


def with_usual_names(frame: geopandas.GeoDataFrame) -> geopandas.GeoDataFrame:
    """The numeric columns under the toolbox's names and units, whatever letter case or format they have.

    Two columns for one number are rejected, because it is ambiguous which of them counts.
    """
    taken: dict[str, Any] = {}
    columns = {}
    for name in frame.columns:
        ours, times = _ours(str(name))
        if ours in taken:
            raise UserError(
                f"{where_of(frame)}: the fields '{taken[ours]}' and '{name}' both hold {ours}; delete one of them"
            )
        if ours is not None:
            taken[ours] = name
            columns[name] = (ours, times)
    for name, (_, times) in columns.items():
        field: Any = frame[name]
        frame = cast("geopandas.GeoDataFrame", frame.assign(**{str(name): scaled(field, times)}))
    return cast("geopandas.GeoDataFrame", frame.rename(columns={name: ours for name, (ours, _) in columns.items()}))


def _ours(name: str) -> tuple[str | None, float]:
    """The toolbox's column to which a field corresponds, and the factor of its values."""
    short = name.strip().lower()
    if short in COLUMNS or short in OTHER_NAMES:
        return OTHER_NAMES.get(short, short), 1.0
    parsed = named(name)
    for ours in COLUMNS:
        stem, _, unit = ours.rpartition("_")
        times = factor(parsed.unit, unit) if parsed.unit and parsed.plain in (stem, ours) else None
        if times is not None:
            return ours, times
    return None, 1.0


def union_of(path: str | None, ground: Grid | DemBlocks, crs: str | None, feedback: Feedback) -> Any:
    """All polygons of a layer as one, or None."""
    from deadwood_algorithms.files.vectors import read_vector

    if path is None:
        return None
    frame = read_vector(
        path, geometry=("polygon",), target_crs=ground.crs, crs=crs, what="stand polygons", feedback=feedback
    )
    shapes = np.asarray(frame.geometry.array)
    there = shapely.intersects(shapes, shapely.box(*ground.bounds))
    say_left_out(frame, ~there, "polygons without trees", feedback.note)
    account_on_dem("exclude", there)
    return shapely.force_2d(shapely.union_all(shapes))


def read_stands(
    path: str | None, dem: Grid | DemBlocks, exclude: Any, crs: str | None, feedback: Feedback
) -> list[Stand]:
    """The stands that overlap the DEM: one of all polygons, or one per row if columns give separate values.

    If such rows overlap, the later one counts, as for friction polygons.
    """
    from deadwood_algorithms.files.vectors import read_vector

    if path is None:
        return [Stand(ground_of(patches_over(dem, dem.bounds, feedback), None, exclude), {})]
    frame = read_vector(
        path, geometry=("polygon",), target_crs=dem.crs, crs=crs, what="stand polygons", feedback=feedback
    )
    shapes = shapely.force_2d(np.asarray(frame.geometry.array))
    patches = patches_over(dem, shapely.total_bounds(shapes), feedback)
    frame = with_usual_names(frame)
    columns = [name for name in COLUMNS if name in frame]
    if not columns:
        there = shapely.intersects(shapes, shapely.box(*dem.bounds))
        say_left_out(frame, ~there, "stands", feedback.note)
        account_on_dem("stand", there)
        return [Stand(ground_of(patches, shapely.union_all(shapes), exclude), {})]
    feedback.note(
        f"{where_of(frame)}: each of the {len(frame)} stands has its own {', '.join(columns)}",
        code="sizes-by-stand",
        stands=len(frame),
    )
    numbers = {}
    for name in columns:
        least, largest, itself = COLUMNS[name]
        numbers[name] = number_column(frame, name, minimum=least, maximum=largest, exclusive=not itself)
    stands, off = [], 0
    later: Any = shapely.Polygon()
    for row in range(len(frame) - 1, -1, -1):
        shape = shapely.difference(shapes[row], later)
        later = shapely.union(later, shapes[row])
        try:
            ground = ground_of(patches, shape, exclude)
        except UserError:
            off += 1
            continue
        stands.append(Stand(ground, {name: float(each[row]) for name, each in numbers.items()}, f"row {row + 1}"))
    if not stands:
        raise UserError(
            f"{where_of(frame)}: no stand has a place for a tree on the DEM; check the polygons and their CRS"
        )
    account("stand", count_of(len(frame), len(stands), {"no_place": off}))
    if off:
        feedback.note(
            f"{where_of(frame)}: {counted(off, 'stand has', 'stands have')} no place on the DEM, or under later "
            "ones: left out",
            code="rows-left-out",
            rows=off,
        )
    return stands[::-1]
