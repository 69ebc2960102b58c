"""Estimate how long dead trees stand, when they fall, and when they are critical: smooth and still strong.

For each of the next years, the share of the dead trees that stand, are broken (the upper part lies beside the snag),
lie whole, or have disappeared, and the share that is critical: without bark and branches, so that a log slides far, and
still strong enough not to break (the paper, 6.1). The folder holds

- `states.csv`: for each year and state the mean share, and the range that contains it in 95 % of the draws;
- `aged.gpkg`: for each tree and year of `--report-years` how probable each state is;
- `processes.csv`: every number used: its range, species, source, and how well it was observed;
- `shares.png`: the shares over the years.

Every number is drawn from its range anew, `--draws` times, with the storms and the fate of every tree; none is a value
to rely on alone. `--ranges` replaces ranges by those of your site. How often storms (or wet snow) break snags on a site
is published nowhere: `--storm-return-years` is your input, one number or the ends of a range.

    deadwood-tool import-trees --trees sample_data/trees.csv --dem sample_data/dem.tif --output trees.gpkg
    deadwood-tool age --dead-trees trees.gpkg --years-dead 1 --storm-return-years 10,30 --output aged

Numbers are mostly of spruce. Other woods decay by their own rates; how fast their snags fall is not known, so the
range for spruce is used. Trees are independent of each other except for storms; regrowth is not modelled.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from deadwood_algorithms.evaluate.lifetime.options import REPORT_YEARS, AgingOptions, process_rows, reported_years
from deadwood_algorithms.params import tool
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool

STATES, TREES, PROCESSES, PICTURE = "states.csv", "aged.gpkg", "processes.csv", "shares.png"


@dataclass(frozen=True, kw_only=True)
class Ask(AgingOptions):
    years: int = tool.integer("Years to look ahead", default=30, minimum=1, maximum=200)
    report_years: tuple[float, ...] = tool.numbers(
        "Years in the layer of the trees", *REPORT_YEARS, minimum=0.0, ascending=True
    )
    seed: int = tool.seed()
    crs: str | None = tool.crs()
    output: str = tool.output_folder("Folder of the states")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    import numpy as np
    import pandas

    from deadwood_algorithms.evaluate.lifetime import life, shares_figure
    from deadwood_algorithms.evaluate.lifetime.dead_trees import read_dead_trees
    from deadwood_algorithms.files.tables import write_csv
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.params.snag_dynamics import spans_of
    from deadwood_algorithms.results.identity import result_folder

    spans = spans_of(ask.ranges, {"storm_return_years": ask.storm_return_years})
    reported = reported_years(ask.report_years, ask.years)
    with result_folder(TOOL, ask, feedback) as folder:
        trees = read_dead_trees(ask.dead_trees, ask.years_dead, None, ask.crs, feedback)
        kinds, of_tree = life.kinds_of(trees.years_dead, trees.standing, trees.speed)
        numbers = life.drawn(spans, ask.draws, ask.seed)
        storms = life.storm_years(numbers, ask.years, ask.seed)
        ages = life.aged(numbers, kinds, of_tree, trees.item, storms, ask.seed)
        rows = state_rows(ages)
        write_csv(folder / STATES, pandas.DataFrame(rows))
        write_csv(folder / PROCESSES, pandas.DataFrame(process_rows(spans)))
        columns: dict[str, Any] = {
            "tree_id": np.repeat(trees.ids, len(reported)),
            "year": np.tile(reported, len(trees)),
            **{f"p_{each}": ages.of_trees[:, reported, k].ravel() for k, each in enumerate(life.STATES)},
            "p_critical": ages.critical_of_trees[:, reported].ravel(),
        }
        points = np.repeat(np.asarray(trees.frame.geometry), len(reported))
        write_vector(folder / TREES, {"aged": type(trees.frame)(columns, geometry=points, crs=trees.frame.crs)})
        title = f"{counted(len(trees), 'dead tree')} over {ask.years} years: mean of {ask.draws} draws"
        note = "every number is drawn from its range (processes.csv)"
        shares_figure.draw(folder / PICTURE, ages, title, note)
    worst = int(ages.critical.sum(axis=2).mean(axis=0).argmax())
    facts = {"trees": len(trees), "draws": ask.draws, "most_critical_year": worst, "states": rows}
    by = {(each["year"], each["state"]): each for each in rows}
    shown = [words(by[year, "standing"], by[year, "critical"]) for year in reported]
    shown.append(f"assumed: {len(spans)} numbers, each drawn from its range, with its source in {PROCESSES}")
    return Outcome.of_folder(
        ask.output, {"states": STATES, "trees": TREES, "processes": PROCESSES, "picture": PICTURE}, facts, tuple(shown)
    )


def state_rows(ages: Any) -> list[dict[str, Any]]:
    """One record for each year and state; ``critical`` counts trees of all states but gone."""
    from deadwood_algorithms.evaluate.lifetime.decision import mean_record
    from deadwood_algorithms.evaluate.lifetime.life import STATES as NAMES

    series = {name: ages.shares[..., k] for k, name in enumerate(NAMES)}
    series |= {"critical": ages.critical.sum(axis=2), "critical_standing": ages.critical[..., 0]}
    return [
        {"year": year, "state": name, **mean_record(values[:, year], "share")}
        for year in range(ages.shares.shape[1])
        for name, values in series.items()
    ]


def words(standing: dict[str, Any], critical: dict[str, Any]) -> str:
    def shown(row: dict[str, Any]) -> str:
        return f"{100 * row['share']:.0f} % ({100 * row['ci_low']:.0f} to {100 * row['ci_high']:.0f} %)"

    return f"year {standing['year']}: {shown(standing)} stand, {shown(critical)} are critical"


TOOL = Tool(
    "age",
    "Evaluate",
    "Estimate how long dead trees stand, when they fall, and when they are critical",
    Ask,
    run,
    then="deadwood-tool check {output}",
)
