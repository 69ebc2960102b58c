"""Plant a random forest: stems per hectare at uniformly random places, with the sizes of given trees or from normal
distributions.

The result is a trees layer for ``slide-logs`` over the DEM, or within stand polygons minus excluded polygons. From a
trees layer (``--like``) it takes the density over the same area, and draws the DBH and height of each tree together
from one of the layer's trees, each of which is used equally often: mean, standard deviation and basal area are kept,
however skewed they are. A DBH or height given as an option overrides that of the layer; both sizes are then drawn from
normal distributions with the means, standard deviations and correlation, as without a layer. The result is printed
beside the request or the layer's values.

Stands may differ: where the stand layer has columns named as the options (``stems_per_ha``, ``dbh_mean_cm``, ...; or
PlatRock's ``trees_density``, ``trees_dhp_mean``, ``trees_dhp_std``), each row is planted with its own values; where
rows overlap, the later one counts. A value of a row overrides an option, which overrides the layer's.

``--preset klosters`` and ``rothenbrunnen`` are the forests of the paper; explicit options override them. As there,
impossible trees (DBH below 1 cm, height below 1.3 m) are drawn again and counted in a note; this narrows the
distribution a little. Such trees of a trees layer are left out.

Without values for the height, the mean follows from the mean DBH by the law of ``import-trees``, with half the relative
variation of the DBH. Tree k of a stand has the same place at every density, unless ``--min-spacing-m`` moves it away
from an earlier tree. Clusters, gaps and species are not modelled.

    deadwood-tool generate-forest --dem sample_data/dem.tif --stand "sample_data/sample.gpkg|layername=forest" \\
        --preset klosters --min-spacing-m 2 --output klosters.gpkg
    deadwood-tool import-trees --trees sample_data/trees.csv --dem sample_data/dem.tif --output trees.gpkg
    deadwood-tool generate-forest --dem sample_data/dem.tif --stand "sample_data/sample.gpkg|layername=forest" \\
        --like trees.gpkg --output random_trees.gpkg
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from deadwood_algorithms.params import presets, tool
from deadwood_algorithms.params.counts import counted, significant
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError
from deadwood_algorithms.prepare.trees.allometry import MADE_HERE, POWER_LAWS, PowerLaw
from deadwood_algorithms.prepare.trees.dbh_filling import refuse_two_laws
from deadwood_algorithms.prepare.trees.forest_sizes import (
    LEAST_DBH_CM,
    LEAST_HEIGHT_M,
    basal_area,
    draw_sizes,
    kind_of_stand,
    read_source,
    size_lines,
    stand_lines,
    take_sizes,
)
from deadwood_algorithms.prepare.trees.planting import numbers_of_trees, plant
from deadwood_algorithms.prepare.trees.stands import COLUMNS, DENSEST_PER_HA, read_stands, union_of
from deadwood_algorithms.results.identity import writing
from deadwood_algorithms.scene.memory import refuse_too_many
from deadwood_algorithms.schemas import DBH_CM, TREE_M

TREE_BYTES = 400  # bytes per tree, drawn and written


@dataclass(frozen=True, kw_only=True)
class Ask:
    dem: str = tool.terrain("Terrain (DEM)")
    preset: str | None = tool.choice(
        "Density and DBH by name",
        *presets.FORESTS,
        default=None,
        help=presets.choices_help(presets.FORESTS) + " Instead of --like.",
    )
    stems_per_ha: float | None = tool.number(
        "Density", unit="1/ha", default=None, minimum=0.0, maximum=DENSEST_PER_HA, exclusive=True
    )
    dbh_mean_cm: float | None = tool.number(
        "Mean DBH", unit="cm", default=None, minimum=0.0, maximum=DBH_CM[1], exclusive=True
    )
    dbh_sd_cm: float | None = tool.number("Standard deviation of the DBH", unit="cm", default=None, minimum=0.0)
    height_mean_m: float | None = tool.number(
        "Mean height", unit="m", default=None, minimum=0.0, maximum=TREE_M[1], exclusive=True
    )
    height_sd_m: float | None = tool.number("Standard deviation of the height", unit="m", default=None, minimum=0.0)
    correlation: float | None = tool.number(
        "Correlation of DBH and height", default=None, minimum=-1.0, maximum=1.0, help="Without --like: 0.8."
    )
    like: str | None = tool.vector("Trees layer to take density and sizes from", "point", default=None)
    stand: str | None = tool.vector(
        "Stand polygons",
        "polygon",
        default=None,
        help="Without them: the whole DEM. Columns may give each its numbers.",
    )
    exclude: str | None = tool.vector("Polygons without trees", "polygon", default=None)
    min_spacing_m: float = tool.number("Smallest distance between two stems", unit="m", default=0.0, minimum=0.0)
    dbh_a: float = tool.number("a of DBH[cm] = a * H[m]^b", default=2.52, minimum=0.0, exclusive=True, advanced=True)
    dbh_b: float = tool.number("b of DBH[cm] = a * H[m]^b", default=0.84, minimum=0.0, exclusive=True, advanced=True)
    dbh_law: str | None = tool.choice(
        "Named law in place of a and b",
        *POWER_LAWS,
        default=None,
        advanced=True,
        help=f"For heights that are not given. {MADE_HERE} import-trees lists the laws.",
    )
    seed: int = tool.seed()
    crs: str | None = tool.crs()
    overwrite: bool = tool.overwrite()
    output: str = tool.output_vector("Trees layer (.gpkg)")


def run(ask: Ask, feedback: Feedback) -> Outcome:
    import geopandas

    from deadwood_algorithms.files.dem_blocks import open_ground
    from deadwood_algorithms.files.vectors import write_vector

    refuse_two_laws(ask.dbh_law, ask.dbh_a, ask.dbh_b)
    if ask.preset and ask.like:
        raise UserError("--preset and --like both define the forest; give one of them")
    taken = presets.Taken.of(presets.FORESTS[ask.preset], "--preset", vars(ask)) if ask.preset else None
    if taken:
        feedback.note(taken.said, code="preset")
    with writing(TOOL, ask, feedback) as outputs, ExitStack() as opened:
        temporary = outputs.file("output", ".gpkg")
        ground = opened.enter_context(open_ground(ask.dem, crs=ask.crs, feedback=feedback))
        exclude = union_of(ask.exclude, ground, ask.crs, feedback)
        stands = read_stands(ask.stand, ground, exclude, ask.crs, feedback)
        source = read_source(ask.like, [each.ground for each in stands], ask.crs, feedback) if ask.like else None
        usual = source.numbers if source else dict(taken.sets) if taken else {}
        given = {name: float(getattr(ask, name)) for name in COLUMNS if getattr(ask, name) is not None}
        law = POWER_LAWS[ask.dbh_law] if ask.dbh_law else PowerLaw(ask.dbh_a, ask.dbh_b)
        kinds = [kind_of_stand(given, usual, law, source, each) for each in stands]
        counts = [round(kind.stems_per_ha * each.ground.area / 1e4) for kind, each in zip(kinds, stands, strict=True)]
        area, count = sum(each.ground.area for each in stands), sum(counts)
        if not count:
            density = max(kind.stems_per_ha for kind in kinds)
            raise UserError(f"{density:g} stems/ha on {significant(area / 1e4, 4)} ha gives no tree; enlarge the stand")

        fix = "lower --stems-per-ha, or take a smaller --stand"
        refuse_too_many(count, "trees", ask.output, each=TREE_BYTES, fix=fix)
        x, y = plant([each.ground for each in stands], counts, ask.min_spacing_m, ask.seed, feedback)
        drawn = [
            take_sizes(kind.source, items, ask.seed) if kind.source else draw_sizes(kind.sizes, items, ask.seed)
            for kind, items in zip(kinds, np.split(numbers_of_trees(counts), np.cumsum(counts)[:-1]), strict=True)
        ]
        dbh, height = (np.concatenate([each[k] for each in drawn]) for k in (0, 1))
        columns = {"tree_id": np.arange(1, count + 1), "dbh_cm": dbh, "height_m": height}
        frame = geopandas.GeoDataFrame(columns, geometry=shapely.points(x, y), crs=ground.plan_crs)
        write_vector(temporary, {"trees": frame})
    density, redrawn = count / area * 1e4, sum(each[2] for each in drawn)
    if len(stands) == 1:
        density = kinds[0].stems_per_ha
    lines = [f"{counted(count, 'tree')} on {area / 1e4:.2f} ha ({significant(density, 4)} stems/ha)"]
    planted = basal_area(float(np.sum(dbh**2))) / area * 1e4
    if len(stands) == 1:
        lines += size_lines(kinds[0], dbh, height, planted)
    else:
        lines += stand_lines(stands, kinds, counts)
        asked = sum(kind.basal_area * each.ground.area for kind, each in zip(kinds, stands, strict=True)) / area
        lines.append(
            f"planted in all: DBH {dbh.mean():.1f} +- {dbh.std():.1f} cm, height {height.mean():.1f} +- "
            f"{height.std():.1f} m, basal area {significant(planted, 3)} m2/ha (asked {significant(asked, 3)})"
        )
    if redrawn:
        lines.append(
            f"{counted(redrawn, 'draw was', 'draws were')} not a tree (DBH < {LEAST_DBH_CM:g} cm or height < "
            f"{LEAST_HEIGHT_M:g} m), redrawn"
        )
    least = f"at least {ask.min_spacing_m:g} m apart" if ask.min_spacing_m else "at any distance"
    lines.append(f"assumed: places at random, {least}, seed {ask.seed}; no clusters, gaps or species")
    facts: dict[str, Any] = {"trees": count, "area_ha": area / 1e4, "stems_per_ha": density, "redrawn": redrawn}
    facts |= {"basal_area_m2_per_ha": planted}
    facts |= {"preset": taken.record} if taken else {}
    return Outcome({"output": Path(ask.output)}, facts, tuple(lines))


TOOL = Tool(
    "generate-forest",
    "Prepare",
    "Plant a random forest of given density and sizes",
    Ask,
    run,
    then="deadwood-tool explore --dem {dem} --trees {output}",
)
