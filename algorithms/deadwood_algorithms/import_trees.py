"""Make the trees layer from a table or layer of single trees.

Reads what tree detection and inventories write (GeoPackage, shapefile, CSV and other text tables in any common
encoding, with decimal commas, with or without header), finds the columns by their usual names or takes the ones named,
and gives positions, DBH, height, and species and crown diameter where known. The height may be the Z of the points.

Where the DBH is missing it follows from the height by DBH[cm] = a * H[m]^b, where the height is missing from the DBH by
the same law; a tree with neither is dropped. What was filled or dropped is counted and said, and ``dbh_source`` tells
``measured`` from ``modelled``. An id used twice (tiles number their trees anew) makes the tool renumber all trees and
keep the old ids as ``source_id``. It merges no duplicates, and asks for no species-specific law.

Source of a = 2.52, b = 0.84: FINT-CH. A single law misjudges stems by up to a factor of two; set your region's.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from deadwood_algorithms import schemas, tool, tree_columns
from deadwood_algorithms.layers import (
    output_path,
    read_dem,
    read_vector,
    warn_implausible,
    where_of,
    write_vector,
)
from deadwood_algorithms.tool import Feedback, Outcome, Tool, UserError

if TYPE_CHECKING:
    import geopandas


@dataclass(frozen=True, kw_only=True)
class Ask:
    trees: str = tool.table("Table or layer of single trees", geometry=("point", "polygon"))
    dem: str | None = tool.raster(
        "Terrain (DEM)", default=None, help="Gives the CRS of the output; trees off the DEM are dropped."
    )
    x_field: str | None = tool.text("Field of the easting", default=None)
    y_field: str | None = tool.text("Field of the northing", default=None)
    id_field: str | None = tool.text("Field of the tree's id", default=None)
    dbh_field: str | None = tool.text("Field of the DBH", default=None)
    dbh_unit: str | None = tool.choice(
        "Unit of the DBH", *tree_columns.DBH_UNITS, default=None, help="Without it: as the field's name says, else cm."
    )
    height_field: str | None = tool.text("Field of the height", default=None)
    height_unit: str = tool.choice("Unit of the height", *tree_columns.HEIGHT_UNITS, default="m")
    species_field: str | None = tool.text("Field of the species", default=None)
    crown_field: str | None = tool.text("Field of the crown diameter in m", default=None)
    missing_value: float | None = tool.number(
        "Number that stands for a missing value", default=None, help="For example -1 (FINT-CH) or 0."
    )
    dbh_a: float = tool.number("a of DBH[cm] = a * H[m]^b", default=2.52, minimum=0.0, exclusive=True)
    dbh_b: float = tool.number("b of DBH[cm] = a * H[m]^b", default=0.84, minimum=0.0, exclusive=True)
    crs: str | None = tool.crs()
    overwrite: bool = tool.overwrite()
    output: str = tool.output_vector("Trees layer (.gpkg)")


def run(ask: Ask, feedback: Feedback) -> Outcome:
    import geopandas

    if bool(ask.x_field) != bool(ask.y_field):
        raise UserError("--x-field and --y-field belong together; name both")
    with output_path(ask.output, ask.overwrite, suffix=".gpkg", inputs=(ask.trees, ask.dem)) as temporary:
        grid = read_dem(ask.dem, crs=ask.crs, feedback=feedback) if ask.dem else None
        source = read_vector(
            ask.trees,
            geometry=("point", "polygon"),
            target_crs=grid.crs if grid else None,
            crs=ask.crs,
            what="single trees",
            feedback=feedback,
            x_field=ask.x_field,
            y_field=ask.y_field,
        )
        if not grid:
            refuse_not_metric(source)
        where = where_of(source)
        shape = np.asarray(source.geometry.array)
        crowns = int((shapely.get_type_id(shape) != 0).sum())
        if crowns:
            feedback.note(f"{where}: {crowns} crown polygons; the tree stands at each one's centroid")

        dbh = tree_columns.dbh_column(source, ask.dbh_field, ask.dbh_unit, ask.missing_value)
        height = tree_columns.height_column(source, ask.height_field, ask.height_unit, ask.missing_value, feedback)
        refuse_nothing_known(source, dbh, height)
        warn_implausible(dbh, schemas.TREES.column("dbh_cm"), where, feedback, mend="--dbh-unit names the unit")
        warn_implausible(height, schemas.TREES.column("height_m"), where, feedback, mend="--height-unit names the unit")
        dbh, height, from_height, from_dbh = fill(dbh, height, ask.dbh_a, ask.dbh_b)
        said = [f"{len(source)} trees read from {where}"]
        law = f"DBH[cm] = {ask.dbh_a:g} * H[m]^{ask.dbh_b:g}"
        if from_height.any():
            said.append(f"{from_height.sum()} DBH missing, computed from the height: {law}")
        if from_dbh.any():
            said.append(f"{from_dbh.sum()} heights missing, computed from the DBH: {law}")

        kept = np.isfinite(dbh)
        if not kept.all():
            said.append(f"{(~kept).sum()} trees dropped, they have neither DBH nor height")
        place = shapely.centroid(shape)
        if grid:
            on = grid.contains(shapely.get_x(place), shapely.get_y(place))
            if (kept & ~on).any():
                said.append(f"{(kept & ~on).sum()} trees dropped, they stand off the DEM")
            kept &= on
        if not kept.any():
            raise UserError(f"{where}: no tree is left; {'; '.join(said[1:])}")

        columns = tree_columns.id_columns(source, kept, ask.id_field, feedback)
        columns |= {"dbh_cm": dbh[kept], "height_m": height[kept]}
        columns |= tree_columns.further_columns(source, kept, ask.species_field, ask.crown_field)
        columns["dbh_source"] = np.where(from_height, "modelled", "measured")[kept]
        points = shapely.force_2d(place[kept])
        write_vector(temporary, {"trees": geopandas.GeoDataFrame(columns, geometry=points, crs=source.crs)})
    said.append(f"{kept.sum()} trees written, median DBH {np.median(dbh[kept]):.1f} cm")
    facts = {"trees": int(kept.sum()), "dropped": int((~kept).sum())}
    facts |= {"dbh_from_height": int(from_height.sum()), "height_from_dbh": int(from_dbh.sum())}
    return Outcome({"output": Path(ask.output)}, facts, tuple(said))


def fill(
    dbh: np.ndarray, height: np.ndarray, a: float, b: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """DBH [cm] and height [m] where only the other is known, by DBH = a H^b; and which were filled."""
    from_height = np.isnan(dbh) & np.isfinite(height)
    from_dbh = np.isnan(height) & np.isfinite(dbh)
    return (
        np.where(from_height, a * height**b, dbh),
        np.where(from_dbh, (dbh / a) ** (1 / b), height),
        from_height,
        from_dbh,
    )


def refuse_nothing_known(source: geopandas.GeoDataFrame, dbh: np.ndarray, height: np.ndarray) -> None:
    if np.isnan(dbh).all() and np.isnan(height).all():
        fields = ", ".join(str(each) for each in source.columns if each != "geometry") or "none"
        raise UserError(
            f"{where_of(source)}: neither a DBH nor a height is found; name its field: --dbh-field, --height-field "
            f"(the fields are {fields})"
        )


def refuse_not_metric(source: geopandas.GeoDataFrame) -> None:
    """Without a DEM the layer keeps its own CRS, which a run could then not use unless it is in metres."""
    own = source.crs
    if own is None or not own.is_projected or abs(own.axis_info[0].unit_conversion_factor - 1) > 1e-9:
        raise UserError(
            f"{where_of(source)}: its CRS {own.name if own else 'is unknown and'} is not projected in metres; "
            "give --dem, whose CRS the trees then get"
        )


TOOL = Tool("import-trees", "Prepare", "Make the trees layer from any table of single trees", Ask, run)
