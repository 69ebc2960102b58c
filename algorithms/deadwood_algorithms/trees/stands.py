"""Stands of a random forest: polygons on the DEM, each with the numbers that its columns give.

For `generate_forest`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import shapely

from deadwood_algorithms.files.columns import number_column, where_of
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.tool import Feedback, UserError
from deadwood_algorithms.trees.planting import Ground, ground_of

if TYPE_CHECKING:
    import geopandas

# Column -> its least and largest value, and whether the least itself is allowed; and the names of PlatRock's zones.
COLUMNS: dict[str, tuple[float, float | None, bool]] = {
    "stems_per_ha": (0.0, None, True),
    "dbh_mean_cm": (0.0, None, False),
    "dbh_sd_cm": (0.0, None, True),
    "height_mean_m": (0.0, None, False),
    "height_sd_m": (0.0, None, True),
    "correlation": (-1.0, 1.0, True),
}
OTHER_NAMES = {"trees_density": "stems_per_ha", "trees_dhp_mean": "dbh_mean_cm", "trees_dhp_std": "dbh_sd_cm"}
OTHER_NAMES |= {"trees_dens": "stems_per_ha", "trees_dhp_": "dbh_mean_cm", "stems_per_": "stems_per_ha"}
OTHER_NAMES |= {"dbh_mean_c": "dbh_mean_cm", "height_mea": "height_mean_m", "height_sd_": "height_sd_m"}


@dataclass(frozen=True)
class Stand:
    """Where trees of one kind may stand, and what the stand's own columns say of them (empty: nothing)."""

    ground: Ground
    numbers: dict[str, float]
    name: str = ""


def with_usual_names(frame: geopandas.GeoDataFrame) -> geopandas.GeoDataFrame:
    """The columns of numbers under our names, whatever the letter case, the shapefile or PlatRock made of them."""
    renamed: dict[Any, str] = {}
    for name in frame.columns:
        short = str(name).lower()
        ours = short if short in COLUMNS else OTHER_NAMES.get(short)
        if ours and ours not in frame and ours not in renamed.values():
            renamed[name] = ours
    return cast("geopandas.GeoDataFrame", frame.rename(columns=renamed))


def union_of(path: str | None, grid: Grid, crs: str | None, feedback: Feedback) -> Any:
    """All polygons of a layer as one, or None."""
    from deadwood_algorithms.files.vectors import read_vector

    if path is None:
        return None
    frame = read_vector(
        path, geometry=("polygon",), target_crs=grid.crs, crs=crs, what="stand polygons", feedback=feedback
    )
    return shapely.force_2d(shapely.union_all(np.asarray(frame.geometry.array)))


def read_stands(path: str | None, grid: Grid, exclude: Any, crs: str | None, feedback: Feedback) -> list[Stand]:
    """The stands that reach onto the DEM: one of all polygons, or one a row where columns tell the rows apart.

    Where such rows overlap, the later one counts, as in the friction polygons.
    """
    from deadwood_algorithms.files.vectors import read_vector

    if path is None:
        return [Stand(ground_of(grid, None, exclude), {})]
    frame = read_vector(
        path, geometry=("polygon",), target_crs=grid.crs, crs=crs, what="stand polygons", feedback=feedback
    )
    shapes = shapely.force_2d(np.asarray(frame.geometry.array))
    frame = frame.rename(
        columns={name: OTHER_NAMES.get(str(name).lower(), str(name).lower()) for name in frame.columns}
    )
    told = [name for name in COLUMNS if name in frame]
    if not told:
        return [Stand(ground_of(grid, shapely.union_all(shapes), exclude), {})]
    feedback.note(f"{where_of(frame)}: each of the {len(frame)} stands has its own {', '.join(told)}")
    numbers = {}
    for name in told:
        least, largest, itself = COLUMNS[name]
        numbers[name] = number_column(frame, name, minimum=least, maximum=largest, exclusive=not itself)
    stands, off = [], 0
    later: Any = shapely.Polygon()
    for row in range(len(frame) - 1, -1, -1):
        shape = shapely.difference(shapes[row], later)
        later = shapely.union(later, shapes[row])
        try:
            ground = ground_of(grid, shape, exclude)
        except UserError:
            off += 1
            continue
        stands.append(Stand(ground, {name: float(each[row]) for name, each in numbers.items()}, f"row {row + 1}"))
    if not stands:
        raise UserError(
            f"{where_of(frame)}: no stand has a place for a tree on the DEM; check the polygons and their CRS"
        )
    if off:
        feedback.note(
            f"{where_of(frame)}: {off} stands have no place on the DEM, or under later ones, and are left out"
        )
    return stands[::-1]
