"""Draw the start positions of logs inside release areas, and the properties of each log.

The result is the releases layer of ``slide-logs``. Positions are uniform by area, inside a circle around each point (10
m in the paper) or inside a polygon or multipolygon without its holes. With a raster of ``--weights``, such as the
shares of ``assess-mobilisation``, their density follows its first band, inside the areas, or without areas wherever it
is above 0. Every area gets ``--count``
logs, or ``--logs-per-ha`` times its area (without areas: times the area of the cells above 0).

`--preset` sets the properties of the logs by name, with the source (`deadwood-tool list --presets` lists all). Explicit
options override it. A preset of a species has the density of its critical stage of decay, and a relation of DBH and
length that gives one from the other.

The logs of an area are equal unless their sizes are drawn: from normal distributions with ``--dbh-sd-cm``,
``--length-sd-m`` and ``--density-sd-kg-m3`` around the means (impossible sizes are drawn again, and counted in a note),
or from the rows of a table of mapped deadwood (``--deadwood``, as ``import-trees --snags`` writes it). Columns of the
areas override the options of the same names; columns of the mapped deadwood override both. The axis is upright, lying,
tilted, ``random`` (any direction in space) or ``random-lying`` (on the ground, any azimuth).

Log k has the same id, position and size however many logs are drawn, because its draws depend on the seed and its id
alone. Ids start at 1 and alternate between the areas (area 1, 2, ..., 1, 2, ...), so a larger ``--count`` only adds
logs.

The tool does not assess where wood could start to slide (``assess-mobilisation`` does). Source: the paper, section 3.3
(small perturbations of the position are the statistical variable).

    deadwood-tool sample-releases --areas "sample_data/sample.gpkg|layername=release_area" --dem sample_data/dem.tif \\
        --count 200 --output releases.gpkg
    deadwood-tool sample-releases --areas "sample_data/sample.gpkg|layername=release_area" --dem sample_data/dem.tif \\
        --logs-per-ha 5000 --dbh-cm 60 --dbh-sd-cm 19 --length-m 25 --length-sd-m 5 --orientation random-lying \\
        --output windthrow.gpkg
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import shapely

from deadwood_algorithms.files.accounts import account, count_of
from deadwood_algorithms.files.columns import where_of
from deadwood_algorithms.params import presets, tool
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError
from deadwood_algorithms.prepare.releases.areas import MOST_LOGS, read_release_areas
from deadwood_algorithms.prepare.releases.logs import (
    NUMBERS,
    ORIENTATIONS,
    SPREADS,
    columns_of_rows,
    draw_logs,
    mapped_deadwood,
)
from deadwood_algorithms.prepare.releases.lying import lying_wood, warn_of_posture
from deadwood_algorithms.prepare.releases.sizes import lines_of_sample, sizes_of
from deadwood_algorithms.prepare.trees.allometry import NAMED_LAWS
from deadwood_algorithms.prepare.trees.status import GONE_PATTERN
from deadwood_algorithms.results.identity import writing
from deadwood_algorithms.scene.memory import refuse_too_many
from deadwood_algorithms.schemas import DBH_CM, DENSITY_KG_M3, DROP_M, SPEED_MS, TREE_M

BYTES = 650  # bytes per log, measured on a million: drawn and written
DEFAULT_PRESET = "klosters"
OF_PRESET = "Default: that of the preset."
OPTIONS = (*NUMBERS, *SPREADS, "orientation")  # that columns of the areas override


@dataclass(frozen=True, kw_only=True)
class Ask:
    areas: str | None = tool.vector(
        "Release points or polygons", "point", "polygon", default=None, help="May be left out with --weights."
    )
    dem: str = tool.terrain("Terrain (DEM); its CRS is that of the output")
    weights: str | None = tool.raster(
        "Raster: relative density of starts", default=None, help="Any values of at least 0."
    )
    count: int = tool.integer("Logs per area", default=2000, minimum=1, maximum=MOST_LOGS)
    logs_per_ha: float | None = tool.number(
        "Logs per hectare of each area, in place of the count", unit="1/ha", default=None, minimum=0.0, exclusive=True
    )
    radius_m: float = tool.number("Radius of the circle around a point", unit="m", default=10.0, minimum=0.0)
    release_id_field: str | None = tool.field_of(
        "areas",
        "Field with the names of the areas",
        default=None,
        help="Without it: release_id, else the row number from 1.",
    )
    preset: str = tool.choice(
        "Properties of the logs, by name",
        *presets.LOGS,
        default=DEFAULT_PRESET,
        help=presets.choices_help(presets.LOGS),
    )
    dbh_cm: float | None = tool.number(
        "DBH", unit="cm", default=None, minimum=0.0, maximum=DBH_CM[1], exclusive=True, help=OF_PRESET
    )
    dbh_sd_cm: float = tool.number("Standard deviation of the DBH", unit="cm", default=0.0, minimum=0.0)
    length_m: float | None = tool.number(
        "Length", unit="m", default=None, minimum=0.0, maximum=TREE_M[1], exclusive=True, help=OF_PRESET
    )
    length_sd_m: float = tool.number("Standard deviation of the length", unit="m", default=0.0, minimum=0.0)
    correlation: float = tool.number("Correlation of DBH and length", default=0.8, minimum=-1.0, maximum=1.0)
    density_kg_m3: float | None = tool.number(
        "Density", unit="kg/m³", default=None, minimum=0.0, maximum=DENSITY_KG_M3, exclusive=True, help=OF_PRESET
    )
    density_sd_kg_m3: float = tool.number("Standard deviation of the density", unit="kg/m³", default=0.0, minimum=0.0)
    deadwood: str | None = tool.table(
        "Mapped deadwood to draw the logs from",
        default=None,
        help="Fields dbh_cm and length_m, and any other of a log.",
    )
    orientation: str = tool.choice("Orientation at the start", *ORIENTATIONS, default="upright")
    tilt_deg: float = tool.number("Tilt from the vertical", unit="°", default=0.0, minimum=0.0, maximum=180.0)
    azimuth_deg: float = tool.number(
        "Azimuth of tip and speed, from north", unit="°", default=0.0, minimum=0.0, maximum=360.0
    )
    speed_ms: float = tool.number("Initial speed", unit="m/s", default=0.0, minimum=0.0, maximum=SPEED_MS)
    drop_m: float = tool.number(
        "Clearance above the terrain at the start", unit="m", default=0.0, minimum=0.0, maximum=DROP_M
    )
    seed: int = tool.seed()
    crs: str | None = tool.crs()
    overwrite: bool = tool.overwrite()
    output: str = tool.output_vector("Releases layer (.gpkg)")


def run(ask: Ask, feedback: Feedback) -> Outcome:
    import geopandas

    from deadwood_algorithms.files.dem_blocks import open_ground
    from deadwood_algorithms.files.vectors import read_table, say_of_rows, write_vector

    refuse_contradictions(ask)
    with writing(TOOL, ask, feedback) as outputs, ExitStack() as opened:
        temporary = outputs.file("output", ".gpkg")
        ground = opened.enter_context(open_ground(ask.dem, crs=ask.crs, feedback=feedback))
        areas = read_release_areas(ask.areas, ask.weights, ask.radius_m, ask.crs, ground, feedback)
        names = areas.release_ids(ask.release_id_field, feedback)
        taken = presets.Taken.of(presets.LOGS[ask.preset], "--preset", vars(ask))
        if taken.sets or ask.preset != DEFAULT_PRESET:  # for the default preset, only if it set something
            feedback.note(taken.said, code="preset")
        given = {"dbh_cm": ask.dbh_cm, "length_m": ask.length_m}
        law = NAMED_LAWS[taken.preset.law] if taken.preset.law else None
        sizes = sizes_of(given, taken, areas.frame, feedback, law=law, mapped=ask.deadwood is not None)
        of_area = columns_of_rows(areas.frame, {name: getattr(ask, name) for name in OPTIONS} | sizes, feedback)
        mapped = read_table(ask.deadwood, what="mapped deadwood") if ask.deadwood else None
        if mapped is not None:
            say_of_rows(mapped, feedback)
        deadwood = None if mapped is None else mapped_deadwood(mapped, feedback)
        for path, rows in ((ask.areas, areas.frame), (ask.deadwood, mapped)):
            if path and rows is not None and ask.orientation == "upright":
                warn_of_posture(lying_wood(path, rows, GONE_PATTERN), feedback)
        counts = areas.logs_by_area(ask.count, ask.logs_per_ha)
        account("areas", count_of(len(areas.frame), (counts > 0).sum(), {"no_log": (counts == 0).sum()}))
        if not counts.all():
            none = counted(int((counts == 0).sum()), "release area is", "release areas are")
            feedback.note(
                f"{where_of(areas.frame)}: {none} too small for a log at --logs-per-ha {ask.logs_per_ha:g}",
                code="areas-too-small",
                areas=int((counts == 0).sum()),
            )
        areas.say_unequal(counts, feedback)
        fix = "lower --count or --logs-per-ha, or sample the areas in parts"
        refuse_too_many(int(counts.sum()), "logs", ask.output, each=BYTES, fix=fix)

        log_id, places = areas.place_logs(counts, ask.seed, ground, feedback)
        area = log_id % areas.size
        drawn = draw_logs(of_area, area, log_id, ask.seed, ask.correlation, deadwood)
        columns = {"log_id": log_id + 1, "release_id": names[area]} | drawn.columns
        frame = geopandas.GeoDataFrame(columns, geometry=shapely.points(places), crs=ground.plan_crs)
        write_vector(temporary, {"releases": frame})
    facts = {"logs": log_id.size, "areas": areas.size, "redrawn": drawn.redrawn, "preset": taken.record}
    return Outcome(
        {"output": Path(ask.output)},
        facts,
        lines_of_sample(counts, drawn, None if ask.areas else ask.weights, ask.logs_per_ha),
    )


def refuse_contradictions(ask: Ask) -> None:
    if not ask.areas and not ask.weights:
        raise UserError("--areas is missing (Release points or polygons); without areas give a raster of --weights")
    if ask.release_id_field and not ask.areas:
        raise UserError("--release-id-field names a field of --areas, which is missing; give both or none")
    given = next((name for name in SPREADS[:2] if getattr(ask, name)), None)
    if ask.deadwood and given:
        raise UserError(f"--deadwood and --{given.replace('_', '-')} both draw the sizes; give one of them")


TOOL = Tool(
    "sample-releases",
    "Prepare",
    "Draw start positions of logs in points, polygons or by a raster",
    Ask,
    run,
    then="deadwood-tool slide-logs --dem {dem} --releases {output} --friction 0.25 --output run",
)
