"""Measure how widely the deposits of each release spread: their azimuths, and the smallest angle around them.

The angle is seen from the centre of the release area (paper, equation 11), and is counted across north: 350 and 10
degrees span 20. Deposits nearer than the minimum run-out are left out: the azimuth of a log that hardly moved is
meaningless. The smallest angle grows with the number of logs, because single outliers decide it: `spread_half_deg`, its
mean over random halves of the logs, shows by how much, and it has no interval. To compare runs of different size, use
the range from the 5 % to the 95 % quantile, which has a 95 % interval by order statistics, from
72 deposits on.

    deadwood-tool sample-releases --areas 'sample_data/sample.gpkg|layername=release_area' --dem sample_data/dem.tif \\
        --count 200 --output releases.gpkg
    deadwood-tool slide-logs --dem sample_data/dem.tif --releases releases.gpkg --trees sample_data/trees.csv \\
        --friction 0.25 --output run
    deadwood-tool lateral-spread --deposits run --output spread.gpkg

Logs that left the terrain model would have moved on: the tool warns of them, and of logs that ended near its edge,
where heights are least certain. For a layer of deposits that belongs to no run it needs --dem.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deadwood_algorithms.files.accounts import account, count_of
from deadwood_algorithms.params import tool
from deadwood_algorithms.params.commands import command_line
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError

NEEDED = ("release_x", "release_y")


@dataclass(frozen=True, kw_only=True)
class Ask:
    deposits: str = tool.vector("Deposits, or the folder of their run", "point", help="Written by slide-logs.")
    min_runout_m: float | None = tool.min_runout(
        "Minimum run-out of deposits that count", help="Default: one log length, from the field length_m."
    )
    dem: str | None = tool.terrain(
        "Terrain model, for the distance to its edges", default=None, help="Default: the run's, if it still exists."
    )
    edge_m: float = tool.number(
        "Distance from the terrain model's edges within which deposits cause a warning",
        unit="m",
        default=20.0,
        minimum=0.0,
        help="Edges are its border and its nodata; more than half a log's length is recommended.",
    )
    seed: int = tool.seed()
    crs: str | None = tool.crs()
    output: str = tool.output_vector("Spread of each release, and the azimuth of each deposit")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.evaluate.spread.sectors import (
        Deposits,
        at_edges,
        layer_of,
        scenario_of_deposits,
        spreads,
        words_of,
    )
    from deadwood_algorithms.files.columns import id_column, number_column, where_of
    from deadwood_algorithms.files.vectors import read_vector, write_vector
    from deadwood_algorithms.results.identity import writing
    from deadwood_algorithms.results.run_folder import run_folder_of

    with writing(TOOL, ask, feedback) as outputs:
        path = outputs.file("output", ".gpkg")
        source = layer_of(ask.deposits)
        deposits = read_vector(
            source, geometry=("point",), target_crs=None, crs=ask.crs, what="deposits", feedback=feedback
        )
        release_x, release_y = (number_column(deposits, name) for name in NEEDED)
        if ask.min_runout_m is None and "length_m" not in deposits:
            raise UserError(f"{where_of(deposits)}: the deposits have no field 'length_m'; give --min-runout-m")
        if ask.min_runout_m is None:
            nearest = number_column(deposits, "length_m", minimum=0.0)
        else:
            nearest = np.full(len(deposits), ask.min_runout_m)
        release_id = id_column(deposits, "release_id") if "release_id" in deposits else np.ones(len(deposits), np.int64)
        log_id = number_column(deposits, "log_id") if "log_id" in deposits else np.arange(1, len(deposits) + 1)
        left, near = at_edges(ask.deposits, deposits, ask.dem, ask.edge_m, feedback)

        at = Deposits(log_id.astype(np.int64), release_id, release_x, release_y, nearest, left, near)
        records, azimuths = spreads(deposits, at, ask.seed)
        n, near_by = (int(records[name].to_numpy().sum()) for name in ("n", "n_left_out"))
        account("deposits", count_of(len(deposits), n - near_by, {"near_release": near_by}))
        write_vector(path, {"spread": records, "azimuths": azimuths})
    facts = [{name: row[name] for name in row if name != "geometry"} for row in records.to_dict("records")]
    shown = (*(words_of(row) for row in facts), *scenario_of_deposits(ask.deposits))
    run = run_folder_of(ask.deposits)
    then = command_line("make-report", {"runs": run, "output": "report.html"}) if run else ""
    return Outcome({"output": Path(ask.output)}, {"spread": facts}, shown, then=then)


TOOL = Tool(
    "lateral-spread",
    "Evaluate",
    "Measure azimuths and lateral spread of the deposits of each release",
    Ask,
    run,
)
