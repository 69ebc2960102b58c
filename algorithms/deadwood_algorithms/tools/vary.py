"""Find the most influential inputs: friction, the sizes of logs and trees, the terrain model, and others.

The same logs slide again and again, each time with other values of the factors of --vary. Two results follow, for the
reach of every line and for the mean run-out:

- the tornado: every factor alone at both ends of its range, with the others unchanged. The swing between the ends has
  the interval of a paired difference over the logs (Tango's; for run-outs a bootstrap);
- the indices, with --design latin or sobol: all factors at once, over all of their ranges. The first-order index is the
  share of the variance that a factor accounts for alone, the total-effect index the share in which it has a part, alone
  or with others (Saltelli et al. 2010, Jansen 1999). The chance contribution of a small number of logs is subtracted;
  the intervals are by bootstrap over the design's rows and the logs. The design has (factors + 2) x --samples runs.

The folder holds `tornado.csv`, `tornado.png`, `indices.csv`, `runs.csv` (one row for each run) and `summary.json` with
a sentence that names the most influential input, or says that this many logs do not decide it.

    deadwood-tool sample-releases --areas 'sample_data/sample.gpkg|layername=release_area' --dem sample_data/dem.tif \\
        --count 100 --output releases.gpkg
    deadwood-tool vary --dem sample_data/dem.tif --releases releases.gpkg --trees sample_data/trees.csv \\
        --lines 'sample_data/sample.gpkg|layername=lines' --friction 0.25 \\
        --vary friction=0.2:0.3,rolling_friction,log_density_factor --design ends --output varied

You choose the ranges: a wide one makes its factor strong. The default ranges are suggestions (rolling friction 0.03 to
0.15, because no value has been measured for logs). Values in a range count as equally likely and factors as
independent. Inputs that are not varied have no part in the result. The error of the terrain model is a random surface,
the same for all logs: the tornado uses one of them, the design another in every row.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import Cancelled, Feedback, Outcome, Tool, UserError
from deadwood_algorithms.params.where import SlidingOptions
from deadwood_algorithms.scene.laws import refuse_idle_capacity
from deadwood_algorithms.scene.released_scene import SceneByName

if TYPE_CHECKING:
    from deadwood_algorithms.evaluate.sensitivity.answer import Answer, Measured
    from deadwood_algorithms.evaluate.sensitivity.design import Place
    from deadwood_algorithms.evaluate.sensitivity.factor_runs import SlidRuns
    from deadwood_algorithms.evaluate.sensitivity.factors import Factor
    from deadwood_algorithms.scene.layers import SceneLayers
    from deadwood_algorithms.scene.releases import Releases

RUNS, TORNADO, INDICES, PICTURE, FACTS, MANIFEST = (
    "runs.csv", "tornado.csv", "indices.csv", "tornado.png", "summary.json", "manifest.json",
)  # fmt: skip
FEW_LOGS = 100


@dataclass(frozen=True, kw_only=True)
class Ask(SlidingOptions, SceneByName):
    vary: str = tool.text(
        "Factors and their ranges",
        default="friction_factor,rolling_friction,log_dbh_factor,log_length_factor",
        path_like=True,
        help="NAME=LOW:HIGH with commas, or a JSON or CSV file of them. A name alone takes its default range: "
        "friction 0.2:0.3, friction_factor 0.8:1.2, rolling_friction 0.03:0.15, restitution 0:0.2, tree_friction "
        "0.2:0.6, tree_restitution 0:0.2, log_dbh_factor and log_length_factor 0.9:1.1, log_density_factor 0.7:1.3, "
        "tree_dbh_factor 0.9:1.1, dem_noise_m 0:0.1, fidelity draft:standard, orientation upright:random-lying (the "
        "logs' posture at the start; also random). Factors multiply what the layers say.",
    )
    design: str = tool.choice(
        "How to vary: the ends of each range alone, or also all together",
        "ends",
        "latin",
        "sobol",
        default="latin",
        help="latin: a Latin hypercube; sobol: Sobol's sequence, which needs SciPy. Both give the indices.",
    )
    samples: int = tool.integer(
        "Rows of the design",
        default=32,
        minimum=8,
        maximum=65536,
        help="The design has (factors + 2) times as many runs. For sobol a power of two.",
    )
    logs: int = tool.integer(
        "Logs to slide in each run",
        default=300,
        minimum=2,
        help="A random subset by seed and log_id; all if the layer has fewer.",
    )
    dem_noise_length_m: float = tool.number(
        "Distance over which errors of the terrain model are alike",
        unit="m",
        default=5.0,
        minimum=0.0,
        exclusive=True,
        help="At this distance their correlation is 0.37; at least one cell.",
    )
    fidelity: str = tool.choice(
        "Speed against accuracy",
        "draft",
        "standard",
        "fine",
        "reference",
        default="draft",
        help="Differences depend less on it than single results; the factor 'fidelity' shows how much.",
    )
    output: str = tool.output_folder("Folder of the variation", parts=(TORNADO, INDICES, RUNS, PICTURE, FACTS))
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.evaluate.sensitivity.factors import factors_of

    refuse_idle_capacity(ask.break_trees, ask.tree_capacity_kj)
    factors = factors_of(ask.vary)
    for each in factors:
        if each.offered:
            feedback.note(each.offer_words)
    places = places_of(ask, factors)
    return told_plan(ask, len(places), feedback) if ask.plan else variation(ask, feedback)


def told_plan(ask: Ask, variants: int, feedback: Feedback) -> Outcome:
    """What the run would take."""
    from deadwood_algorithms.files.vectors import read_table
    from deadwood_algorithms.results.forecast import planned_from_few

    def few(output: str, logs: int, feedback: Feedback) -> Outcome:
        return variation(replace(ask, output=output, logs=logs, plan=False, resume=False), feedback)

    logs = min(ask.logs, len(read_table(ask.releases, what="releases")))
    of_one = max(2, ask.plan_logs // variants)
    return planned_from_few(few, of_one, logs, ask.output, ask.where(""), ask.plan_workers, feedback)


def variation(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.ensemble.variants import open_ensemble
    from deadwood_algorithms.evaluate.sensitivity.factor_runs import WANTED, refuse_pointless, runs_of, variants_of
    from deadwood_algorithms.evaluate.sensitivity.factors import factors_of
    from deadwood_algorithms.evaluate.sensitivity.tables import lines_of
    from deadwood_algorithms.results.identity import result_folder
    from deadwood_algorithms.results.scenario import scenario_line, scenario_of
    from deadwood_algorithms.simulate.chunks import identity_of
    from deadwood_algorithms.simulate.steps import Steps
    from deadwood_engine import FIDELITIES

    factors = factors_of(ask.vary)
    places = places_of(ask, factors)
    where = ask.where(f"{TOOL.name}-{Path(ask.output).name}")
    with (
        result_folder(TOOL, ask, feedback) as folder,
        open_ensemble(ask.inputs(), FIDELITIES[ask.fidelity], where, ask.logs, ask.seed, feedback) as ensemble,
    ):
        layers, logs = ensemble.layers, ensemble.logs
        refuse_pointless(factors, ask.friction, layers, logs)
        if any(each.name == "dem_noise_m" for each in factors) and ask.dem_noise_length_m < layers.dem.cell:
            raise UserError(
                f"--dem-noise-length-m is {ask.dem_noise_length_m:g}, less than a cell of the terrain model; "
                f"give at least {layers.dem.cell:g}"
            )
        if len(logs) < FEW_LOGS:
            feedback.warn(f"{len(logs)} logs reveal strong factors only; release a few hundred")
        feedback.note(f"{len(places)} runs of {len(logs)} logs: {len(places) * len(logs)} logs are slid")
        known = {
            "--logs or --seed": [ask.logs, ask.seed],
            "--dem-noise-length-m": ask.dem_noise_length_m,
            "factors or design": [asdict(each) for each in places],
        }
        identity = identity_of(ensemble.simulation, layers, ensemble.released, **known)
        steps = Steps(ask.output, identity, resume=ask.resume, feedback=feedback)
        variants = variants_of(places, ensemble.simulation, ask.dem_noise_length_m, ask.seed)
        slid = runs_of(ensemble.slide(variants, WANTED, steps))
        measured, answers = evaluate(ask, factors, slid, layers, logs, feedback)
        facts = write(folder, ask, factors, places, slid, measured, answers, layers, len(ensemble.released))
        warn_of_runs(places, slid, layers.lines.ids, feedback)
        scenario = scenario_line(scenario_of(ask, ask.fidelity, layers, logs))  # of which the factors depart
    steps.remove()
    final = Path(ask.output)
    parts = {"runs": RUNS, "tornado": TORNADO, "picture": PICTURE, "summary": FACTS, "manifest": MANIFEST}
    parts |= {"indices": INDICES} if ask.design != "ends" else {}
    outputs = {"output": final} | {key: final / name for key, name in parts.items()}
    return Outcome(outputs, facts, (*lines_of(measured, answers, facts), scenario))


def places_of(ask: Ask, factors: list[Factor]) -> list[Place]:
    """The runs of the design."""
    from deadwood_algorithms.evaluate.sensitivity.design import cube, places_at_ends, rows_of_design

    places = places_at_ends(factors)
    if ask.design != "ends":
        places += rows_of_design(factors, *cube(ask.design, ask.samples, len(factors), ask.seed))
    return places


def warn_of_runs(places: list[Place], slid: SlidRuns, line_ids: list[Any], feedback: Feedback) -> None:
    """Say where reach depends on logs that left the terrain model: as things are, and in the run that lost most."""
    from deadwood_algorithms.results.lost import left_dem, reach_records, reach_told, warn_of_lost

    left = left_dem(slid.stop_reason)
    most = int(left.sum(axis=1).argmax())
    told = []
    for run in dict.fromkeys((0, most)):
        records = reach_records(line_ids, slid.reach[run], left[run])
        told += [f"in the run '{places[run].label}' {each}" for each in reach_told(records)]
    warn_of_lost(int(left[most].sum()), left.shape[1], told, feedback)


def evaluate(
    ask: Ask, factors: list[Factor], slid: SlidRuns, layers: SceneLayers, logs: Releases, feedback: Feedback
) -> tuple[list[Measured], list[Answer]]:
    """Bars, indices and sentences of every outcome."""
    from deadwood_algorithms.evaluate.sensitivity.answer import Measured, most_influential
    from deadwood_algorithms.evaluate.sensitivity.indices import indices_of, rows_drawn, weights_of
    from deadwood_algorithms.evaluate.sensitivity.tornado import bars_of

    weights = weights_of(logs.logs.log_id, ask.seed)
    ends, n = 1 + 2 * len(factors), ask.samples
    drawn = rows_drawn(n, ask.seed) if ask.design != "ends" else None
    lines = layers.lines.ids
    outcomes = [(f"reach_{line}", str(line), slid.reach[:, :, k].astype(float)) for k, line in enumerate(lines)]
    outcomes.append(("runout_mean_m", "", slid.runout))
    measured = []
    for turn, (name, line, values) in enumerate(outcomes):

        def look(turn: int = turn) -> None:
            feedback.progress(turn, len(outcomes), "evaluating")
            if feedback.cancelled():
                raise Cancelled

        look()
        bars = bars_of(factors, values[:ends], weights, share=bool(line))
        found = None
        if drawn is not None:
            a, b = values[ends : ends + n], values[ends + n : ends + 2 * n]
            mixed = values[ends + 2 * n :].reshape(len(factors), n, values.shape[1])
            found = indices_of(a, b, mixed, weights, drawn, look)
        measured.append(Measured(name, line, bars, found))
    feedback.progress(1, 1, "evaluating")
    return measured, [most_influential(each, len(logs)) for each in measured]


def write(
    folder: Path,
    ask: Ask,
    factors: list[Factor],
    places: list[Place],
    slid: SlidRuns,
    measured: list[Measured],
    answers: list[Answer],
    layers: SceneLayers,
    logs_in_layer: int,
) -> dict[str, Any]:
    """Write the folder; gives the facts of summary.json."""
    import pandas

    from deadwood_algorithms.evaluate.sensitivity.factor_runs import table_of
    from deadwood_algorithms.evaluate.sensitivity.tables import headline, index_rows, tornado_rows
    from deadwood_algorithms.evaluate.sensitivity.tornado_figure import draw
    from deadwood_algorithms.files.tables import write_csv
    from deadwood_algorithms.results.run_folder import write_json

    logs = slid.runout.shape[1]
    head = headline(measured, answers)
    facts: dict[str, Any] = {
        "sentence": answers[head].sentence,
        "answers": [asdict(each) for each in answers],
        "logs": logs,
        "logs_in_layer": logs_in_layer,
        "fidelity": ask.fidelity,
        "runs": len(places),
        "design": ask.design,
        "samples": ask.samples if ask.design != "ends" else 0,
        "factors": [{"factor": each.name, "low": each.low, "high": each.high} for each in factors],
        "tornado": tornado_rows(measured),
        "indices": index_rows(measured),
    }
    write_csv(folder / RUNS, pandas.DataFrame(table_of(places, slid, factors, layers.lines.ids)))
    write_csv(folder / TORNADO, pandas.DataFrame(facts["tornado"]))
    if facts["indices"]:
        write_csv(folder / INDICES, pandas.DataFrame(facts["indices"]))
    write_json(folder / FACTS, facts)
    note = (
        "High minus low end with its 95 % interval over the same logs, bold where that excludes 0. Values of a range "
        f"count as equally likely. As it is: {logs} of {logs_in_layer} logs, fidelity {ask.fidelity}, seed {ask.seed}."
    )
    if any(each.indices is not None and each.indices.crossed.any() for each in measured):
        note += " A first-order index above its total is chance: raise --samples."
    draw(folder / PICTURE, measured, answers, logs, len(places), note)
    return facts


TOOL = Tool(
    "vary",
    "Evaluate",
    "Find the most influential inputs: factors varied alone and together",
    Ask,
    run,
    then="deadwood-tool make-report RUN --results {output} --output report.html",
)
