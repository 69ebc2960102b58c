"""Compare runs of the same logs: with the forest and without, as mapped and random, with barriers or a dam.

Every scenario is compared with the baseline log by log: each log is its own control, so a few hundred logs show what
would take thousands in independent runs. The folder holds

- `table.csv`: for a spreadsheet, one row for each quantity and scenario: reach, stop reasons, lateral spread, speed,
  run-out, each with its 95 % interval and its difference to the baseline, rounded as these justify;
- `comparison.csv`: the same in full precision; for shares also the number of logs that changed either way, the p-value
  of McNemar's exact test, and the bounds where logs left the terrain model before (`..._if_lost`);
- `difference_NAME.tif`: how much more probable the passage of each cell is, and that difference in standard errors;
- `changes.gpkg`: the logs that reach a line in one of two scenarios only (`changed`, at their releases), and how each
  deposit moved (`moved`);
- `comparison.png`: reach, run-outs and the maps side by side;
- `comparison.json`: all of it, and the parameters in which the runs differ.

For each line it gives the indices of a protection forest used in practice (after Dupire et al. 2016), against the
baseline, with a bootstrap interval that draws the same logs in both: `bari` = 1 - N / N0, for the logs that reach it;
`miri` = 1 - E95 / E95_0, for the 95 % quantile of their energies there; `orpi` = 1 - S / S0, for the sum of these. 1 is
full protection, 0 none. Energies need stored trajectories (`slide-logs --trajectories all`).

    deadwood-tool sample-releases --areas 'sample_data/sample.gpkg|layername=release_area' --dem sample_data/dem.tif \\
        --count 200 --output releases.gpkg
    deadwood-tool slide-logs --dem sample_data/dem.tif --releases releases.gpkg --trees sample_data/trees.csv \\
        --lines 'sample_data/sample.gpkg|layername=lines' --friction 0.25 --trajectories all \\
        --output with_forest
    deadwood-tool slide-logs --dem sample_data/dem.tif --releases releases.gpkg \\
        --lines 'sample_data/sample.gpkg|layername=lines' --friction 0.25 --trajectories all \\
        --output without
    deadwood-tool compare-scenarios --runs without,with_forest --output forest_effect

Runs of other releases are refused. The intervals are over the logs: one random forest is one draw of many, and only
further runs show how much another would differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError

if TYPE_CHECKING:
    from deadwood_algorithms.evaluate.scenarios.measures import ScenarioRow
    from deadwood_algorithms.evaluate.scenarios.paired_runs import Compared

TABLE, ROWS, FACTS, CHANGES = "table.csv", "comparison.csv", "comparison.json", "changes.gpkg"
PICTURE = "comparison.png"


@dataclass(frozen=True, kw_only=True)
class Ask:
    runs: str = tool.folders(
        "Folders of the runs",
        help="Each a folder of slide-logs, of the same releases, separated by commas: "
        "run_none,run_forest,run_barriers.",
    )
    names: str | None = tool.text(
        "Names of the scenarios, separated by commas", default=None, help="Default: the names of the folders."
    )
    baseline: str | None = tool.baseline()
    lines: str | None = tool.vector(
        "Roads, railways, houses in place of those of the runs",
        "line",
        "polygon",
        default=None,
        help="Their reach is computed from stored trajectories, of the logs that have one in every run.",
    )
    min_runout_m: float | None = tool.min_runout()
    seed: int = tool.seed()
    output: str = tool.output_folder("Folder of the comparison")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    import pandas

    from deadwood_algorithms.evaluate.scenarios.difference_figure import draw
    from deadwood_algorithms.evaluate.scenarios.maps import changed_frame, difference_map, moved_frame
    from deadwood_algorithms.evaluate.scenarios.measures import compared_rows
    from deadwood_algorithms.evaluate.scenarios.paired_runs import differing, read_compared
    from deadwood_algorithms.evaluate.scenarios.tables import long_table, table_lines
    from deadwood_algorithms.files.tables import write_csv
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.results.identity import result_folder
    from deadwood_algorithms.results.run_folder import MANIFEST, write_json
    from deadwood_algorithms.results.scenario import lines_of_run

    final = Path(ask.output)
    with result_folder(TOOL, ask, feedback) as folder:
        compared = read_compared(ask.runs, ask.names, ask.lines, feedback, baseline=ask.baseline)
        rows = compared_rows(compared, ask.min_runout_m, ask.seed, feedback)
        names = [each.name for each in compared.scenarios]
        differences = differing(compared)

        parts = {"table": TABLE, "rows": ROWS, "facts": FACTS, "changes": CHANGES, "picture": PICTURE}
        parts |= {"manifest": MANIFEST}
        maps: dict[str, Path] = {}
        outputs = {"output": final} | {key: final / name for key, name in parts.items()}
        for other in compared.others:
            path = folder / f"difference_{other.name}.tif"
            try:
                difference_map(compared.reference, other, path, feedback)
            except UserError as error:  # grids that do not match; everything else can be compared
                path.unlink(missing_ok=True)
                feedback.warn(f"no map of {other.name}: {error}", code="no-map")
            else:
                maps[other.name] = path
                outputs[path.stem] = final / path.name
        warn_of_lost(rows, compared, feedback)
        draw(folder / PICTURE, rows, compared, maps)
        write_csv(folder / ROWS, pandas.DataFrame([asdict(row) for row in rows]))
        write_csv(folder / TABLE, pandas.DataFrame(long_table(rows)).astype({"logs_lost": "Int64"}))
        layers = {"moved": moved_frame(compared)}
        changed = changed_frame(compared)
        write_vector(folder / CHANGES, layers | ({"changed": changed} if len(changed) else {}))
        facts = {"reference": names[0], "logs": compared.log_id.size, "parameters_that_differ": differences}
        write_json(folder / FACTS, {**facts, "rows": [asdict(row) for row in rows]})
    shown = table_lines(rows, names, differences, compared.log_id.size, TABLE)
    scenarios = [line for each in compared.scenarios for line in lines_of_run(each.run, each.name)]
    return Outcome(outputs, facts, (*shown, *scenarios))


def warn_of_lost(rows: Sequence[ScenarioRow], compared: Compared, feedback: Feedback) -> None:
    """Say which of the numbers depend on logs that left the terrain model, if any do."""
    from deadwood_algorithms.results.lost import many

    phrases = [f"reach of {row.item} in {row.scenario}" for row in rows if row.quantity == "reach" and row.loss_matters]
    if any(many(int(each.left_dem.sum()), compared.log_id.size) for each in compared.scenarios):
        phrases.append("spread, mean run-outs and deposits, which count only up to where the logs left")
    if not phrases:
        return
    counts = ", ".join(f"{int(each.left_dem.sum())} in {each.name}" for each in compared.scenarios)
    feedback.warn(
        f"of {compared.log_id.size} logs some left the terrain model ({counts}), and their further movement is not "
        f"known; these depend on them: {'; '.join(phrases)}; run slide-logs on a larger terrain model",
        code="left-dem",
        logs=compared.log_id.size,
    )


TOOL = Tool(
    "compare-scenarios",
    "Evaluate",
    "Compare runs of the same logs: paired differences, maps, table",
    Ask,
    run,
    then="deadwood-tool make-report --runs {runs} --output report.html",
)
