"""Sizes of trees from a table: their columns, the law of the DBH, and the result of both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms import schemas
from deadwood_algorithms.files.columns import warn_implausible, where_of
from deadwood_algorithms.params import tool
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.prepare.trees import allometry
from deadwood_algorithms.prepare.trees import columns as tree_columns
from deadwood_algorithms.prepare.trees import sources as tree_sources
from deadwood_algorithms.prepare.trees.dbh_filling import (
    DEFAULT,
    Filled,
    chosen_law,
    fill_sizes,
    fitted_law,
    warn_of_another_region,
    zoned,
)
from deadwood_algorithms.prepare.trees.table import (
    Source,
    account_sample,
    measured_trees,
    refuse_nothing_known,
    warn_of_idle_fields,
)


@dataclass(frozen=True, kw_only=True)
class TableOptions:
    """The columns of a table of trees."""

    trees: str = tool.table("Table or layer of single trees", geometry=("point", "polygon"))
    source: str = tool.choice(
        "Program that wrote the table", *tree_sources.SOURCES, default="auto", help="table: usual names only."
    )
    dem: str | None = tool.terrain(
        "Terrain (DEM)", default=None, help="Gives the CRS of the output; trees off the DEM are dropped."
    )
    x_field: str | None = tool.field_of("trees", "Field of the easting", default=None)
    y_field: str | None = tool.field_of("trees", "Field of the northing", default=None)
    id_field: str | None = tool.field_of("trees", "Field of the tree's id", default=None)
    dbh_field: str | None = tool.field_of("trees", "Field of the DBH", default=None)
    dbh_unit: str | None = tool.choice(
        "Unit of the DBH",
        *tree_columns.DBH_UNITS,
        default=None,
        help="Without it: the unit in the field's name, else cm.",
    )
    height_field: str | None = tool.field_of("trees", "Field of the height", default=None)
    height_unit: str | None = tool.choice(
        "Unit of the height",
        *tree_columns.HEIGHT_UNITS,
        default=None,
        help="Without it: the unit in the field's name, else m.",
    )
    species_field: str | None = tool.field_of("trees", "Field of the species", default=None)
    crown_field: str | None = tool.field_of("trees", "Field of the crown diameter in m", default=None)
    crown_measure: str | None = tool.choice(
        "What the crown field holds, in m or m²",
        *tree_columns.CROWN_MEASURES,
        default=None,
        help="Without it: from the source or the field's usual name, else the diameter.",
    )
    missing_value: tuple[float, ...] | None = tool.ask(
        "numbers", "Numbers that mark a missing value", default=None, help="Several with commas; FINT-CH writes -1."
    )
    read_as: str | None = tool.text(
        "Words in the columns of DBH and height, and their numbers",
        default=None,
        help="For open classes and words: >60=65; Starkholz=55. Nothing after the = marks a missing value.",
    )
    status_field: str | None = tool.field_of(
        "trees", "Field that distinguishes dead trees from living ones", default=None
    )
    dead_values: str | None = tool.text(
        "Its values for dead standing trees",
        default=None,
        help="Separated by commas, or by semicolons where a value holds a comma. Without it: the usual words.",
    )
    gone_values: str | None = tool.text(
        "Its values for removed or fallen trees", default=None, help="As the dead values; these trees are dropped."
    )
    keep_dead: bool = tool.flag("Keep dead standing trees among the trees too")
    min_height_m: float = tool.number(
        "Minimum height of a tree",
        unit="m",
        default=1.3,
        minimum=0.0,
        help="Lower ones are dropped and counted; below breast height there is no DBH.",
    )


@dataclass(frozen=True, kw_only=True)
class LawOptions:
    """The law by which a DBH follows from the height."""

    dbh_a: float = tool.number("a of DBH[cm] = a * H[m]^b", default=2.52, minimum=0.0, exclusive=True)
    dbh_b: float = tool.number("b of DBH[cm] = a * H[m]^b", default=0.84, minimum=0.0, exclusive=True)
    dbh_law: str | None = tool.choice(
        "Named law in place of a and b",
        *allometry.NAMED_LAWS,
        default=None,
        help=f"{allometry.MADE_HERE} The description lists them. With a law that needs the crown, a and b are used for "
        "trees whose crown is unknown.",
    )
    dbh_zones: str | None = tool.vector(
        "Zones with different laws", "polygon", default=None, help="Fields dbh_a and dbh_b, or dbh_law."
    )
    dbh_sample: str | None = tool.table(
        "Measured trees to fit the law to",
        default=None,
        help="Those with a DBH and a height; the table itself can be used.",
    )
    replace_dbh: bool = tool.flag("Compute the DBH from the height also where the table has one")


def sizes(
    source: Source,
    table: TableOptions,
    law_options: LawOptions,
    tile_field: str | None,
    living: NDArray[np.bool_],
    crown: NDArray[np.float64] | None,
    crs: str | None,
    feedback: Feedback,
) -> Filled:
    """DBH and height of each tree, read, checked, and filled by the law that was chosen.

    living : shape (n,), the trees to which a law may be fitted
    crown : diameter [m], shape (n,), NaN where unknown; None if there is no such field
    """
    frame, layout = source.frame, source.layout
    where = where_of(frame)
    missing = layout.missing_value if table.missing_value is None else table.missing_value
    words = tree_columns.words_of(table.read_as)
    dbh = tree_columns.dbh_column(frame, layout, table.dbh_field, table.dbh_unit, missing, feedback, words)
    height = tree_columns.height_column(frame, layout, table.height_field, table.height_unit, missing, feedback, words)
    refuse_nothing_known(frame, dbh, height)
    named_fields = (
        table.id_field,
        table.dbh_field,
        table.height_field,
        table.crown_field,
        table.status_field,
        tile_field,
    )
    for what, values, other in (("DBH", dbh, "height"), ("height", height, "DBH")):
        if np.isnan(values).all():
            warn_of_idle_fields(frame, layout, what, other, named_fields, feedback)
    warn_implausible(
        dbh,
        schemas.TREES.column("dbh_cm"),
        where,
        feedback,
        fix="--dbh-unit names the unit, also that of a girth or of a radius",
    )
    warn_implausible(height, schemas.TREES.column("height_m"), where, feedback, fix="--height-unit names the unit")

    sample = None
    if law_options.dbh_sample == table.trees:
        account_sample(dbh, height, living, where, feedback)
        sample = fitted_law(table.trees, dbh[living], height[living], feedback)
    elif law_options.dbh_sample:
        sample = fitted_law(law_options.dbh_sample, *measured_trees(law_options.dbh_sample, feedback), feedback)
    law = chosen_law(law_options.dbh_law, law_options.dbh_a, law_options.dbh_b, sample)
    named = allometry.with_name(law)
    if law_options.dbh_zones:
        law, named = zoned(law, law_options.dbh_zones, source.places, frame.crs, crs, feedback)
    if law_options.replace_dbh:
        replaced = np.isfinite(dbh) & np.isfinite(height)
        source.said.append(f"{replaced.sum()} DBH of the table set aside (--replace-dbh)")
        dbh = np.where(replaced, np.nan, dbh)
    filled = fill_sizes(dbh, height, law, crown, otherwise=allometry.PowerLaw(law_options.dbh_a, law_options.dbh_b))
    if (filled.from_height | filled.from_dbh).any():
        warn_of_another_region(law, source.places, frame.crs, feedback)
    if filled.from_height.any():
        source.said.append(f"{filled.from_height.sum()} DBH missing, computed from the height: {named}")
    if filled.from_dbh.any():
        source.said.append(f"{counted(filled.from_dbh.sum(), 'height')} missing, computed from the DBH: {named}")
    named_a_law = law_options.dbh_law or law_options.dbh_zones or law_options.dbh_sample or law != DEFAULT
    if named_a_law and not (filled.from_height | filled.from_dbh).any():
        feedback.warn(
            f"{where}: every tree has a DBH and a height, so the law is not used; --replace-dbh uses it",
            code="law-not-used",
        )
    if filled.from_height.any():
        fix = "check the law (--dbh-law, --dbh-a, --dbh-b)"
        modelled = np.where(filled.from_height, filled.dbh, np.nan)
        warn_implausible(modelled, schemas.TREES.column("dbh_cm"), f"{where}, computed DBH", feedback, fix=fix)
    return filled
