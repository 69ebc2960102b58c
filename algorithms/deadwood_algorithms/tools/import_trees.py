"""Make the trees layer from a table or layer of single trees, and a releases layer of the dead trees in it.

It reads the output of tree detection and inventories: GeoPackage, shapefile, CSV and other text tables in any common
encoding, with decimal commas, with or without header. ``--source`` names the program that wrote the table; ``auto``
recognises it by its columns or its name, and otherwise finds columns by their usual names. The ``--...-field`` and
``--...-unit`` options name any column and its unit, and take precedence. In a file without header the columns are
``column_1``, ``column_2`` and so on. Crown polygons give trees at their centroids (or at the named columns) and crown
diameters from their area.

A missing DBH is computed from the height by DBH[cm] = a * H[m]^b, a missing height from the DBH by the same law; a tree
with neither is dropped. The law is that of ``--dbh-a`` and ``--dbh-b``, a named one (``--dbh-law``), that of the
zone polygon in which the tree stands, or one fitted to measured trees (``--dbh-sample``; the logarithms are fitted,
with the correction exp(s^2 / 2)). A single law misjudges stems by up to a factor of two: use a law of your region.
``dbh_source`` distinguishes ``measured`` from ``modelled``. What was filled in, dropped or merged is counted in notes.

Dead standing trees and snags are kept out of the trees, because they are future logs: ``--snags`` writes them
as a releases layer (upright, where they stand, with their DBH and height). Lying or removed trees are dropped. If an id
occurs twice (tiles often number their trees independently), all trees are renumbered and the old ids are kept as
``source_id``. ``--merge-within-m`` merges trees found twice at the seams of tiles. The tool does not judge whether a
tree is real.

    deadwood-tool import-trees --trees sample_data/trees.csv --dem sample_data/dem.tif --output trees.gpkg
    deadwood-tool import-trees --trees sample_data/trees.csv --dem sample_data/dem.tif --dbh-law chablais-spruce \\
        --replace-dbh --merge-within-m 2.5 --output modelled_trees.gpkg

With an inventory: ``--status-field Zustand --dead-values "tot,Dürrständer" --snags snags.gpkg``; with the output of
FINT: ``--trees Ind_trees.csv --source fint``.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from deadwood_algorithms.files.accounts import account, count_of
from deadwood_algorithms.files.columns import where_of
from deadwood_algorithms.params import tool
from deadwood_algorithms.params.commands import quoted
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError
from deadwood_algorithms.prepare.trees import allometry
from deadwood_algorithms.prepare.trees import columns as tree_columns
from deadwood_algorithms.prepare.trees import sources as tree_sources
from deadwood_algorithms.prepare.trees import status as tree_status
from deadwood_algorithms.prepare.trees.kept import releases_columns, trees_kept, warn_of_doubts, write_trees
from deadwood_algorithms.prepare.trees.sizes_of_table import LawOptions, TableOptions, sizes
from deadwood_algorithms.prepare.trees.table import read_source
from deadwood_algorithms.results.identity import writing

__doc__ = f"""{__doc__}
Sources:

{tree_sources.sources_described()}

Laws of DBH[cm] from the height H[m] (the module ``allometry`` names their sources):

{allometry.laws_described()}
"""


@dataclass(frozen=True, kw_only=True)
class Ask(LawOptions, TableOptions):
    merge_within_m: float = tool.number(
        "Trees nearer than this are merged",
        unit="m",
        default=0.0,
        minimum=0.0,
        help="The tallest stays; 0 merges none.",
    )
    tile_field: str | None = tool.field_of(
        "trees",
        "Field of the tile",
        default=None,
        advanced=True,
        help="Only trees of different tiles are then merged. QGIS's Merge Vector Layers calls it layer.",
    )
    crs: str | None = tool.crs()
    overwrite: bool = tool.overwrite()
    snags: str | None = tool.output_vector("Releases layer of the dead standing trees (.gpkg)", default=None)
    output: str = tool.output_vector("Trees layer (.gpkg)")


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.files.dem_blocks import open_ground

    refuse_contradictions(ask)
    with writing(TOOL, ask, feedback) as outputs, ExitStack() as opened:
        temporary, snags = outputs.file("output", ".gpkg"), outputs.optional_file("snags", ".gpkg")
        dem = open_ground(ask.dem, crs=ask.crs, feedback=feedback) if ask.dem else None
        ground = opened.enter_context(dem) if dem else None
        xy = (ask.x_field, ask.y_field) if ask.x_field and ask.y_field else None
        source = read_source(ask.trees, ask.source, xy, ground, crs=ask.crs, feedback=feedback)
        where, said = where_of(source.frame), source.said
        status = tree_status.status_of(
            source.frame, source.layout, ask.status_field, ask.dead_values, ask.gone_values, feedback
        )
        crown = tree_columns.crown_column(
            source.frame, source.layout, ask.crown_field, ask.crown_measure, source.outlines
        )
        options = tool.taken(ask, TableOptions), tool.taken(ask, LawOptions)
        filled = sizes(source, *options, ask.tile_field, status == tree_status.LIVE, crown, ask.crs, feedback)
        said += filled.said

        kept, why = trees_kept(
            source,
            filled,
            status,
            ground,
            min_height_m=ask.min_height_m,
            merge_within_m=ask.merge_within_m,
            tile_field=ask.tile_field,
        )
        said += why
        warn_of_doubts(source, filled, kept, why, feedback)
        dead = kept & (status == tree_status.DEAD)
        trees = kept if ask.keep_dead else kept & ~dead
        written = trees | dead if snags else trees
        account("trees", count_of(source.read, written.sum(), {**source.left_out, "dead": (kept & ~written).sum()}))
        if not trees.any():
            raise UserError(f"{where}: no tree is left; {'; '.join(said[1:])}")
        if snags and not dead.any():
            raise UserError(f"{where}: no dead tree is found for --snags; --status-field and --dead-values name them")

        columns = tree_columns.id_columns(source.frame, source.layout, kept, ask.id_field, feedback)
        columns |= {"dbh_cm": filled.dbh[kept], "height_m": filled.height[kept]}
        species = tree_columns.species_column(source.frame, source.layout, ask.species_field)
        columns |= {} if species is None else {"species": species[kept]}
        columns |= {} if crown is None else {"crown_diameter_m": crown[kept]}
        modelled = filled.from_height | (source.layout.dbh_modelled & (ask.dbh_field is None))
        columns["dbh_source"] = np.where(modelled, "modelled", "measured")[kept]
        points = shapely.force_2d(source.places[kept])
        write_trees(temporary, "trees", columns, points, trees[kept], source)
        if snags:
            write_trees(snags, "releases", releases_columns(columns, dead[kept]), points, dead[kept], source)
    if dead.any():
        said.append(
            f"{counted(dead.sum(), 'dead standing tree')} "
            + (f"written to {ask.snags}" if ask.snags else "kept apart; --snags writes them as a releases layer")
            + (", and kept among the trees" if ask.keep_dead else "")
        )
    said.append(f"{counted(trees.sum(), 'tree')} written, median DBH {np.median(filled.dbh[trees]):.1f} cm")
    facts = {"trees": int(trees.sum()), "dead": int(dead.sum()), "dropped": int((~kept).sum())}
    facts |= {"dbh_from_height": int(filled.from_height.sum()), "height_from_dbh": int(filled.from_dbh.sum())}
    made = {"output": Path(ask.output)} | ({"snags": Path(ask.snags)} if ask.snags else {})
    return Outcome(made, facts, tuple(said), then="" if ask.dem else f"deadwood-tool inspect {quoted(ask.output)}")


def refuse_contradictions(ask: Ask) -> None:
    if bool(ask.x_field) != bool(ask.y_field):
        raise UserError("--x-field and --y-field belong together; name both")
    if ask.tile_field and not ask.merge_within_m:
        raise UserError("--tile-field is for --merge-within-m; give the distance too")
    if ask.snags and Path(ask.snags).absolute() == Path(ask.output).absolute():
        raise UserError(f"{ask.output}: --snags and --output are one file; name two")


TOOL = Tool(
    "import-trees",
    "Prepare",
    "Make the trees layer from any table of single trees",
    Ask,
    run,
    then="deadwood-tool explore --dem {dem} --trees {output}",
)
