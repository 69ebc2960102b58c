"""Map the places from which a road is reached: the share of logs that reach it, by the place of release.

The folder holds

- `origins.tif`: four bands for any line and for each line, of the logs released in a cell: the share that reaches the
  line, both ends of its 95 % Wilson interval, the number that reach it; the last band is the number released. Where
  fewer than --least logs were released the cell is transparent. The cell size is such that nine of ten logs lie in
  cells with a share, or that of --cell-m;
- `origins.gpkg`, layer `sources`: for each line the ground from which at least a given share of the logs reach it
  (--source-shares), with their share and its interval; layer `affected`: for each release area the ground that at least
  a given share of its logs pass (--affected-shares), from stored trajectories (not needed with one release area);
- `origins.png`: a map of the shares and of both ends of their intervals; `origins.json`: all in numbers.

Releases over all ground on which logs start, with a density that follows the share that does:

    deadwood-tool assess-mobilisation --dem sample_data/dem.tif --cell-m 20 --logs-per-cell 2 \\
        --output mobilisation.tif --release-areas zones.gpkg
    deadwood-tool sample-releases --areas zones.gpkg --weights mobilisation.tif --dem sample_data/dem.tif \\
        --logs-per-ha 500 --output releases.gpkg
    deadwood-tool slide-logs --dem sample_data/dem.tif --releases releases.gpkg --friction 0.25 --trajectories all \\
        --lines 'sample_data/sample.gpkg|layername=lines' --output run
    deadwood-tool map-origins --run run --output origins

The shares are of all logs released, whether they start to slide or not. A place where no log was released is empty:
nothing is known about it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool
from deadwood_algorithms.stats.endings import left_dem

RASTER, LAYERS, PICTURE = "origins.tif", "origins.gpkg", "origins.png"
FACTS, MANIFEST = "origins.json", "manifest.json"


@dataclass(frozen=True, kw_only=True)
class Ask:
    run: str = tool.folder("Folder of a run", help="Written by slide-logs.")
    lines: str | None = tool.other_lines("Their reach is computed from stored trajectories.")
    cell_m: float | None = tool.number(
        "Cell size of the raster",
        unit="m",
        default=None,
        minimum=0.0,
        exclusive=True,
        help="Default: the smallest of 1, 2, 3, 5, 10, ... m with which nine of ten logs lie in cells with a share.",
    )
    least: int = tool.integer(
        "Minimum number of logs released in a cell for which it has a share", default=10, minimum=1
    )
    source_shares: tuple[float, ...] = tool.class_bounds(
        "Minimum shares of the polygons of sources", 1.0, 10.0, 50.0, unit="%", maximum=100.0, help="Of the logs."
    )
    affected_shares: tuple[float, ...] = tool.class_bounds(
        "Minimum shares of the polygons of affected ground",
        1.0,
        10.0,
        unit="%",
        maximum=100.0,
        help="Of a release area's logs.",
    )
    output: str = tool.output_folder(
        "Folder of the maps",
    )
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.evaluate.hazard import cells, origins
    from deadwood_algorithms.evaluate.hazard.origins_by_line import line_shapes, lines_of, reached_rows
    from deadwood_algorithms.evaluate.hazard.origins_figure import draw
    from deadwood_algorithms.files.rasters import write_bands
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.results.identity import result_folder
    from deadwood_algorithms.results.lost import many, reach_phrases, reach_records, warn_of_lost
    from deadwood_algorithms.results.run_folder import read_run, write_json
    from deadwood_algorithms.results.scenario import lines_of_run
    from deadwood_algorithms.schemas.files import ORIGIN_REACH

    source_shares, affected_shares = (
        [each / 100.0 for each in percent] for percent in (ask.source_shares, ask.affected_shares)
    )
    with result_folder(TOOL, ask, feedback) as folder:
        source = read_run(ask.run, feedback=feedback)
        rows, reached = reached_rows(ask.lines, source, feedback)
        reached = {origins.ANY: np.any(list(reached.values()), axis=0)} | reached
        x, y = (source.deposits[f"release_{axis}"].to_numpy()[rows] for axis in "xy")
        cell = ask.cell_m or origins.cell_for(x, y, ask.least)
        found = origins.origins_of(source, rows, reached, cell, ask.least)
        if found.share_with_enough < origins.ENOUGH:
            feedback.warn(
                f"of {rows.size} logs {rows.size - found.released[found.enough].sum()} were released in cells of "
                f"{cell:g} m with fewer than {ask.least}, whose share is not shown; use a larger --cell-m, a smaller "
                "--least, or release more",
                code="few-logs",
            )
        bands, units = found.bands()
        options = {"units": units, "style": ORIGIN_REACH.look, "raster": ORIGIN_REACH.name}
        write_bands(folder / RASTER, bands, found.grid, nodata=np.nan, dtype="float32", **options)
        layers = {"sources": origins.sources_frame(found, source_shares)}
        affected = origins.affected_frame(source, cells.passed_window(source), affected_shares, feedback)
        if affected is not None:
            layers["affected"] = affected
        write_vector(folder / LAYERS, layers)
        draw(folder / PICTURE, source, found, line_shapes(ask.lines, source))
        left = left_dem(source.deposits)[rows]
        reach = reach_records(reached, np.column_stack(list(reached.values())), left)
        phrases = reach_phrases(reach[1:])
        if many(int(left.sum()), rows.size):
            phrases.append("the shares of the map count only logs that arrived in the simulation")
        warn_of_lost(int(left.sum()), rows.size, phrases, feedback, where=ask.run)
        records = {name: frame.drop(columns="geometry").to_dict("records") for name, frame in layers.items()}
        facts: dict[str, Any] = {
            "cell_m": cell,
            "least": ask.least,
            "logs": int(rows.size),
            "told": found.share_with_enough,
            "n_left_dem": int(left.sum()),
            "reach": reach,
            "sources": records["sources"],
            "affected": records.get("affected"),
        }
        write_json(folder / FACTS, facts)
    parts = {"raster": RASTER, "layers": LAYERS, "picture": PICTURE, "facts": FACTS, "manifest": MANIFEST}
    return Outcome.of_folder(ask.output, parts, facts, (*lines_of(facts), *lines_of_run(source)))


TOOL = Tool(
    "map-origins",
    "Evaluate",
    "Map the places from which roads are reached, and the ground passed",
    Ask,
    run,
    then="deadwood-tool make-report {run} --results {output} --output report.html",
)
