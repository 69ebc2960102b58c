"""Measure on your own scene the cost and the error of each fidelity, and find the cheapest that is accurate enough.

The same logs slide at every fidelity. The results are compared with those of the finest: the reach of every line, the
spread and the distance of the deposits, the hit raster, top speeds and jumps, beside the CPU time of a log and the
calculation's own measures (penetration, energy, unconverged steps). Differences have intervals over the logs, to
separate errors from chance. The posture of the logs at the start is compared, too, at the cheapest fidelity: all of
them upright, and all of them lying in random directions, because it can matter as much as friction.

The recommendation is the cheapest fidelity whose error is shown to be below the sampling noise of a run of your number
of logs: |difference of reach| + half-width of its paired interval <= half-width of the 95 % interval of such a run, for
every line. Without lines, the deposit distance and the hit raster are compared with the distance between two halves of
the logs. If too few logs were compared to show this, the tool says so and estimates how many are needed: among trees up
to twice the number of the run.

Errors beyond the finest fidelity compared, and errors of the inputs, are not included: friction and terrain model
matter more.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

from deadwood_algorithms.evaluate.fidelity.records import FidelityRow
from deadwood_algorithms.evaluate.fidelity.rule import Recommendation, recommend
from deadwood_algorithms.params import tool
from deadwood_algorithms.params.commands import following
from deadwood_algorithms.params.counts import counted, significant
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError
from deadwood_algorithms.params.where import SlidingOptions
from deadwood_algorithms.scene.laws import refuse_idle_capacity
from deadwood_algorithms.scene.released_scene import SceneByName
from deadwood_algorithms.tools import slide_logs

NAMES = ("draft", "standard", "fine", "reference")  # from the cheapest to the finest
TABLE, FACTS, PICTURE, MANIFEST = "comparison.csv", "comparison.json", "comparison.png", "manifest.json"


@dataclass(frozen=True, kw_only=True)
class Ask(SlidingOptions, SceneByName):
    fidelities: str = tool.text(
        "Fidelities to compare",
        default=",".join(NAMES),
        help="At least two, separated by commas; the others are compared with the finest.",
    )
    logs: int = tool.integer(
        "Logs to compare",
        default=2000,
        minimum=1,
        help="A random subset by seed and log_id; all if the layer has fewer.",
    )
    planned_logs: int | None = tool.integer(
        "Logs of the planned run", default=None, minimum=1, help="Default: all of the layer."
    )
    output: str = tool.output_folder("Folder of the comparison")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.results.plan import logs_of_layer, result_or_plan

    refuse_idle_capacity(ask.break_trees, ask.tree_capacity_kj)
    names = fidelities_wanted(ask.fidelities)
    return result_or_plan(compare, ask, feedback, times=len(names), logs_there=lambda: logs_of_layer(ask.releases))


def compare(ask: Ask, feedback: Feedback) -> Outcome:
    import pandas

    from deadwood_algorithms.ensemble.variants import open_ensemble
    from deadwood_algorithms.evaluate.fidelity.fidelity_runs import WANTED, groups_of, run_of, variants_of
    from deadwood_algorithms.evaluate.fidelity.measures import rows_of
    from deadwood_algorithms.evaluate.fidelity.postures import (
        other_postures,
        posture_lines,
        posture_rows,
        posture_variants,
    )
    from deadwood_algorithms.evaluate.fidelity.trade_figure import draw
    from deadwood_algorithms.files.tables import write_csv
    from deadwood_algorithms.results.identity import writing
    from deadwood_algorithms.results.run_folder import write_json
    from deadwood_algorithms.results.scenario import scenario_line, scenario_of
    from deadwood_algorithms.simulate.chunks import identity_of
    from deadwood_algorithms.simulate.steps import Steps
    from deadwood_engine import FIDELITIES

    names = fidelities_wanted(ask.fidelities)
    where = ask.where(f"{TOOL.name}-{Path(ask.output).name}")
    with (
        writing(TOOL, ask, feedback) as outputs,
        open_ensemble(ask.inputs(), FIDELITIES[names[-1]], where, ask.logs, ask.seed, feedback) as ensemble,
    ):
        folder = outputs.folder()
        layers, releases, logs = ensemble.layers, ensemble.released, ensemble.logs
        planned = ask.planned_logs or len(releases)

        decided_by = {"--fidelities": names, "--logs or --seed": [ask.logs, ask.seed]}
        identity = identity_of(ensemble.simulation, layers, releases, **decided_by)
        steps = Steps(ask.output, identity, resume=ask.resume, feedback=feedback)
        postures = [] if layers.shape is not None else other_postures(logs.logs)
        variants = variants_of(names, ensemble.simulation)
        variants += posture_variants(postures, names[0], ensemble.simulation, ask.seed)
        found = ensemble.slide(variants, WANTED, steps, borders=(len(logs) // 2,), hits=True)
        slid = [run_of(name, parts) for name, parts in zip(names, found[: len(names)], strict=True)]
        others = [run_of(name, parts) for name, parts in zip(postures, found[len(names) :], strict=True)]
        feedback.progress(0, 1, "comparing")
        groups = groups_of(logs, ask.min_runout_m)
        rows = [row for one in slid for row in rows_of(one, slid[-1], layers.lines.ids, groups, planned, ask.seed)]
        of_posture = [row for one in others for row in posture_rows(one.name, one, slid[0], layers.lines.ids)]
        advice = recommend(rows, names, len(logs), len(releases), planned)
        feedback.progress(1, 1, "comparing")

        write_csv(folder / TABLE, pandas.DataFrame([asdict(row) for row in rows]))
        counts = {"compared": len(logs), "in_layer": len(releases), "planned": planned}
        facts = {"finest": names[-1], "logs": counts, "recommendation": asdict(advice), "settings": settings_of(names)}
        facts["postures"] = [asdict(row) for row in of_posture]
        write_json(folder / FACTS, {**facts, "rows": [asdict(row) for row in rows]})
        draw(rows, names, advice, counts, folder / PICTURE)
        outputs.facts["digests"] = {"scene": layers.digest, "releases": releases.digest}
        scenario = scenario_line(scenario_of(ask, " / ".join(names), layers, logs))
    steps.remove()
    parts = {"table": TABLE, "facts": FACTS, "picture": PICTURE, "manifest": MANIFEST}
    *compared, advised = lines_of(rows, names, advice, len(logs))
    shown = (*compared, *posture_lines(of_posture), advised, scenario)
    then = following(slide_logs.TOOL, ask, fidelity=advice.fidelity, output="run")
    return Outcome.of_folder(ask.output, parts, facts, shown, then)


def fidelities_wanted(text: str) -> list[str]:
    """The named fidelities, from the cheapest to the finest."""
    wanted = [name.strip().lower() for name in str(text).split(",") if name.strip()]
    unknown = [name for name in wanted if name not in NAMES]
    if unknown:
        raise UserError(f"--fidelities: '{unknown[0]}' is none of {', '.join(NAMES)}")
    chosen = [name for name in NAMES if name in wanted]
    if len(chosen) < 2:
        raise UserError(
            f"--fidelities is '{text}', but must name at least two of {', '.join(NAMES)}, separated by commas"
        )
    return chosen


def settings_of(names: list[str]) -> dict[str, dict[str, float]]:
    from deadwood_engine import FIDELITIES

    return {name: {key: float(value) for key, value in FIDELITIES[name]._asdict().items()} for name in names}


def lines_of(rows: list[FidelityRow], names: list[str], advice: Recommendation, n_logs: int) -> tuple[str, ...]:
    """A table with a line a fidelity, and the recommendation in one sentence."""
    from deadwood_algorithms.stats.statistics import points_with_interval

    head = ["fidelity", "CPU", "reach of lines, points", "run-outs", "hit raster", "top speed", "deepest"]
    table = [head]
    for name in names:
        of = {(row.quantity, row.item): row for row in rows if row.fidelity == name}
        reach = [row for key, row in of.items() if key[0] == "reach"]
        worst = max(reach, key=lambda row: abs(row.difference), default=None)
        judge = name == names[-1]
        points = "-" if worst is None else points_with_interval(worst.difference, worst.ci_low, worst.ci_high)
        apart, map_apart, top = (of[key, ""] for key in ("deposit_distance", "hit_raster_distance", "speed_max_mean"))
        table.append(
            [
                name,
                f"{significant(of['cpu_per_log', ''].value, 3)} ms per log",
                points if worst is None else "judge" if judge else f"{points}, {worst.item}",
                "judge" if judge else f"{significant(apart.difference, 2)} m apart",
                "judge" if judge else f"{significant(map_apart.difference, 2)} apart",
                f"{top.value:.1f} m/s",
                f"{significant(100 * of['penetration_max', ''].value, 2)} cm",
            ]
        )
    widths = [max(len(row[k]) for row in table) for k in range(len(head))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in table]
    if advice.silent_lines:
        lines.append(f"reached by all logs or by none, so not assessed: line {', '.join(advice.silent_lines)}")
    return (f"{counted(n_logs, 'log')}, each fidelity against {names[-1]}:", *lines, advice.sentence)


TOOL = Tool(
    "compare-fidelity",
    "Evaluate",
    "Measure CPU time and error of each fidelity on your scene",
    Ask,
    run,
)
