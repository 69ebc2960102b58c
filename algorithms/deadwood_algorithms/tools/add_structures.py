"""Build embankments and ditches into a terrain model, and compute their volumes of earth.

The result is the DEM with the structures, on the same grid, with the same CRS and number type, nodata unchanged, ready
for ``slide-logs``. Each line is the axis of one structure; ``kind`` is its kind. The crest (of a ditch: the bottom)
is flat over ``crest_width_m`` and lies ``height_m`` above (below) the ground under the line, or at ``elevation_m``
where that is given. From its edges the sides fall (rise) at ``slope_deg`` until they first meet the ground. The columns
``slope_left_deg`` and ``slope_right_deg``, seen along the line, override it. At the ends of the line the sides are
rounded. Columns of the lines override the options of the same names; an empty cell takes the option. A height follows
every bump of the ground; for a crest of even grade give an elevation, or the Z of the line's vertices with
``--elevation-from-z``.

Structures are built in the order of their rows, with heights relative to the original ground: overlapping volume is
counted once, with the first structure, and a ditch after an embankment cuts into it. Volumes are those between the old
and the new heights of the cells. Ground higher than a crest is not changed. A DEM of any size is processed in strips.

Model walls and nets thinner than the cells as barriers of ``slide-logs``. The paper's Klosters case (section 5.1) has
both: two embankments and six barriers. The sample with two dams, which then are ground like any other:

    deadwood-tool add-structures --dem sample_data/dem.tif --structures 'sample_data/sample.gpkg|layername=dams' \\
        --output dem_with_dams.tif --earthworks earthworks.gpkg

The stability of the structures, drainage and the thrust of a log are not checked.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from deadwood_algorithms import schemas
from deadwood_algorithms.files.accounts import account, count_of
from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool
from deadwood_algorithms.results.identity import writing

if TYPE_CHECKING:
    import geopandas

    from deadwood_algorithms.prepare.structures.from_layer import Plan

LINES_SHOWN = 20


@dataclass(frozen=True, kw_only=True)
class Ask:
    dem: str = tool.terrain("Terrain (DEM)")
    structures: str = tool.vector("Crest lines of embankments, bottom lines of ditches", "line")
    kind: str = tool.choice(
        "Kind of structure, where the layer has none", *schemas.STRUCTURE_KINDS, default="embankment"
    )
    height_m: float | None = tool.number(
        "Height of the crest above the ground, or depth of a ditch, where the layer has none",
        unit="m",
        default=None,
        minimum=0.0,
        exclusive=True,
    )
    elevation_m: float | None = tool.number(
        "Elevation of the crest or bottom, where the layer has none",
        unit="m",
        default=None,
        minimum=-500.0,
        maximum=9000.0,
        help="Overrides the height.",
    )
    elevation_from_z: bool = tool.flag("Take the elevation from the Z of the lines' vertices")
    crest_width_m: float = tool.number(
        "Width of the crest or bottom, where the layer has none", unit="m", default=2.0, minimum=0.0
    )
    slope_deg: float = tool.number(
        "Slope of both sides, where the layer has none",
        unit="°",
        default=45.0,
        minimum=0.0,
        maximum=90.0,
        exclusive=True,
    )
    slope_left_deg: float | None = tool.number(
        "Slope of the left side, where the layer has none",
        unit="°",
        default=None,
        minimum=0.0,
        maximum=90.0,
        exclusive=True,
    )
    slope_right_deg: float | None = tool.number(
        "Slope of the right side, where the layer has none",
        unit="°",
        default=None,
        minimum=0.0,
        maximum=90.0,
        exclusive=True,
    )
    max_reach_m: float = tool.number(
        "Distance from the crest within which a side must meet the ground",
        unit="m",
        default=100.0,
        minimum=0.0,
        exclusive=True,
        advanced=True,
    )
    crs: str | None = tool.crs()
    overwrite: bool = tool.overwrite()
    output: str = tool.output_raster("DEM with the structures (.tif)")
    earthworks: str | None = tool.output_vector("Lines with their earthworks (.gpkg)", default=None)


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.files.dem_windows import open_windows
    from deadwood_algorithms.files.vectors import read_vector, write_vector
    from deadwood_algorithms.prepare.structures.from_layer import StructureDefaults, plans_of
    from deadwood_algorithms.prepare.structures.into_dem import write_with_structures

    with ExitStack() as stack:
        made = stack.enter_context(writing(TOOL, ask, feedback))
        path, table = made.file("output", ".tif"), made.optional_file("earthworks", ".gpkg")
        dem = stack.enter_context(open_windows(ask.dem, crs=ask.crs, feedback=feedback))
        frame = read_vector(
            ask.structures,
            geometry=("line",),
            target_crs=dem.crs,
            crs=ask.crs,
            what="structures",
            feedback=feedback,
        )
        plans = plans_of(frame, tool.taken(ask, StructureDefaults), dem, feedback)
        account("structures", count_of(len(frame), len(plans), {}))
        write_with_structures(path, dem, plans, feedback)
        report = report_of(plans, frame)
        if table:
            write_vector(table, {"earthworks": report})
    outputs = {"output": Path(ask.output)} | ({"earthworks": Path(ask.earthworks)} if ask.earthworks else {})
    records = report.drop(columns="geometry").to_dict("records")
    fill, cut = (sum(each[name] for each in records) for name in ("fill_m3", "cut_m3"))
    lines = [
        f"{each['structure_id']}: {each['kind']}, {each['length_m']:.1f} m long, "
        f"fill {each['fill_m3']:.1f} m³, cut {each['cut_m3']:.1f} m³"
        for each in records[:LINES_SHOWN]
    ]
    more = [f"and {len(records) - LINES_SHOWN} more"] if len(records) > LINES_SHOWN else []
    total = f"{len(records)} structures: fill {fill:.1f} m³, cut {cut:.1f} m³"
    return Outcome(outputs, {"fill_m3": fill, "cut_m3": cut, "structures": records}, (*lines, *more, total))


def report_of(plans: list[Plan], frame: geopandas.GeoDataFrame) -> geopandas.GeoDataFrame:
    """A row per structure: its kind, its height above the ground under its line, and its volumes of earth."""
    import geopandas

    columns = {
        "structure_id": [plan.structure_id for plan in plans],
        "kind": [plan.kind for plan in plans],
        "length_m": frame.geometry.length.to_numpy(),
        "height_min_m": [float(np.nanmin(plan.above)) for plan in plans],
        "height_max_m": [float(np.nanmax(plan.above)) for plan in plans],
        "fill_m3": [plan.work.fill_m3 for plan in plans],
        "cut_m3": [plan.work.cut_m3 for plan in plans],
        "area_m2": [plan.work.area_m2 for plan in plans],
    }
    return geopandas.GeoDataFrame(columns, geometry=np.asarray(frame.geometry), crs=frame.crs)


TOOL = Tool(
    "add-structures",
    "Prepare",
    "Build embankments and ditches into a DEM, with their volumes",
    Ask,
    run,
    then="deadwood-tool slide-logs --dem {output} --releases RELEASES --friction 0.25 --output run",
)
