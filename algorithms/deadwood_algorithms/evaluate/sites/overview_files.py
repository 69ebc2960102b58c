"""The results of a region's sites, side by side: table, layer, map and facts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas

from deadwood_algorithms.evaluate.sites import sites_figure
from deadwood_algorithms.evaluate.sites.overview import SiteFound, reach_of_all, sites_layer, words_of_sites
from deadwood_algorithms.files.accounts import account, count_of
from deadwood_algorithms.files.tables import write_csv
from deadwood_algorithms.files.vectors import write_vector
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.results.scenario import scenario_line
from deadwood_algorithms.stats.statistics import lost_words, percent_with_interval

TABLE, LAYER, PICTURE = "overview.csv", "overview.gpkg", "overview.png"
SCENARIOS = 3  # shown in the last lines


def summary_of_sites(found: Sequence[SiteFound]) -> dict[str, Any]:
    failed = [each for each in found if each.failed]
    account("sites", count_of(len(found), sum(not each.failed for each in found), {"failed": len(failed)}))
    return {
        "sites": {"asked": len(found), "done": len(found) - len(failed), "failed": len(failed)},
        "logs": {"released": sum(each.logs for each in found)},
        "reach": reach_of_all(found),
        "failures": [{"site": each.name, "message": each.rows[0].message} for each in failed],
    }


def refuse_failed(found: Sequence[SiteFound], output: str) -> None:
    """Raise the error that ends a run with failed sites, once the others are written."""
    failed = [each for each in found if each.failed]
    if failed:
        names = ", ".join(each.name for each in failed[:5]) + (" ..." if len(failed) > 5 else "")
        raise UserError(
            f"{len(failed)} of {len(found)} sites failed ({names}); the others are in {output}, whose {TABLE} "
            "gives the reason; fix the causes and run again with --resume: only unfinished sites are slid"
        )


def write_overview(folder: Path, found: Sequence[SiteFound], merged: Sequence[Path]) -> None:
    write_csv(folder / TABLE, pandas.DataFrame([vars(row) for each in found for row in each.rows]))
    layer = sites_layer(found)
    if layer is not None:
        write_vector(folder / LAYER, {"sites": layer})
        sites_figure.draw(folder / PICTURE, layer, [each for each in found if not each.failed], merged)


def lines_of_outcome(found: Sequence[SiteFound], facts: dict[str, Any]) -> tuple[str, ...]:
    lines = [
        f"all sites, {each['line_id']}: {percent_with_interval(each)}{lost_words(each)}"
        for each in facts["reach"]
        if each["sites"] > 1
    ]
    scenarios = [scenario_line(each.scenario, each.name) for each in found if each.scenario]
    more = len(scenarios) - SCENARIOS
    others = (
        [f"{counted(more, 'more site has its', 'more sites have their')} scenario in summary.json"] if more > 0 else []
    )
    return (*words_of_sites(found), *lines, *scenarios[:SCENARIOS], *others)
