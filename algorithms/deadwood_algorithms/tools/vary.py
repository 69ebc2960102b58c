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
a sentence that names the most influential input, or states that there are too few logs to decide.

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

from dataclasses import asdict, dataclass
from pathlib import Path

from deadwood_algorithms.evaluate.sensitivity.file_names import FACTS, INDICES, PICTURE, RUNS, TORNADO
from deadwood_algorithms.params import tool
from deadwood_algorithms.params.commands import command_line, following
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError
from deadwood_algorithms.params.where import SlidingOptions
from deadwood_algorithms.scene.laws import refuse_idle_capacity
from deadwood_algorithms.scene.released_scene import SceneByName
from deadwood_algorithms.tools import slide_logs

MANIFEST = "manifest.json"
FEW_LOGS = 100


@dataclass(frozen=True, kw_only=True)
class Ask(SlidingOptions, SceneByName):
    vary: str = tool.text(
        "Factors and their ranges",
        default="friction_factor,rolling_friction,log_dbh_factor,log_length_factor",
        path_like=True,
        help="NAME=LOW:HIGH, separated by commas, or a JSON or CSV file of them. A name alone takes its default range: "
        "friction 0.2:0.3, friction_factor 0.8:1.2, rolling_friction 0.03:0.15, restitution 0:0.2, tree_friction "
        "0.2:0.6, tree_restitution 0:0.2, log_dbh_factor and log_length_factor 0.9:1.1, log_density_factor 0.7:1.3, "
        "tree_dbh_factor 0.9:1.1, dem_noise_m 0:0.1, fidelity draft:standard, orientation upright:random-lying (the "
        "logs' posture at the start; also random). Factors multiply the values of the layers.",
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
    output: str = tool.output_folder("Folder of the variation")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.evaluate.sensitivity.design import places_of_design
    from deadwood_algorithms.evaluate.sensitivity.factors import factors_of
    from deadwood_algorithms.results.plan import logs_of_layer, result_or_plan

    refuse_idle_capacity(ask.break_trees, ask.tree_capacity_kj)
    factors = factors_of(ask.vary)
    for each in factors:
        if each.offered:
            feedback.note(each.offer_words, code="preset")
    places = places_of_design(factors, ask.design, ask.samples, ask.seed)
    return result_or_plan(variation, ask, feedback, times=len(places), logs_there=lambda: logs_of_layer(ask.releases))


def variation(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.ensemble.variants import open_ensemble
    from deadwood_algorithms.evaluate.sensitivity.design import places_of_design
    from deadwood_algorithms.evaluate.sensitivity.factor_runs import (
        WANTED,
        refuse_pointless,
        runs_of,
        variants_of,
        warn_of_runs,
    )
    from deadwood_algorithms.evaluate.sensitivity.factors import factors_of
    from deadwood_algorithms.evaluate.sensitivity.measure import measure
    from deadwood_algorithms.evaluate.sensitivity.tables import lines_of
    from deadwood_algorithms.evaluate.sensitivity.variation_folder import write_variation
    from deadwood_algorithms.results.identity import result_folder
    from deadwood_algorithms.results.scenario import scenario_line, scenario_of
    from deadwood_algorithms.simulate.chunks import identity_of
    from deadwood_algorithms.simulate.steps import Steps
    from deadwood_engine import FIDELITIES

    factors = factors_of(ask.vary)
    places = places_of_design(factors, ask.design, ask.samples, ask.seed)
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
            feedback.warn(
                f"{counted(len(logs), 'log reveals', 'logs reveal')} strong factors only; release a few hundred",
                code="few-logs",
                logs=len(logs),
            )
        feedback.note(
            f"{counted(len(places), 'run')} of {counted(len(logs), 'log')}: {len(places) * len(logs)} to slide"
        )
        decided_by = {
            "--logs or --seed": [ask.logs, ask.seed],
            "--dem-noise-length-m": ask.dem_noise_length_m,
            "factors or design": [asdict(each) for each in places],
        }
        identity = identity_of(ensemble.simulation, layers, ensemble.released, **decided_by)
        steps = Steps(ask.output, identity, resume=ask.resume, feedback=feedback)
        variants = variants_of(places, ensemble.simulation, ask.dem_noise_length_m, ask.seed)
        slid = runs_of(ensemble.slide(variants, WANTED, steps))
        lines, samples = layers.lines.ids, 0 if ask.design == "ends" else ask.samples
        measured, answers = measure(factors, slid, samples, lines, logs.logs.log_id, ask.seed, feedback)
        about = {"fidelity": ask.fidelity, "design": ask.design, "samples": samples}
        about |= {"logs_in_layer": len(ensemble.released)}
        facts = write_variation(folder, about, factors, places, slid, measured, answers, lines, ask.seed)
        warn_of_runs(places, slid, layers.lines.ids, feedback)
        scenario = scenario_line(scenario_of(ask, ask.fidelity, layers, logs))  # to which the factors apply
    steps.remove()
    parts = {"runs": RUNS, "tornado": TORNADO, "picture": PICTURE, "summary": FACTS, "manifest": MANIFEST}
    parts |= {"indices": INDICES} if ask.design != "ends" else {}
    shown = (*lines_of(measured, answers, facts), scenario)
    return Outcome.of_folder(ask.output, parts, facts, shown, then_of(ask))


def then_of(ask: Ask) -> str:
    """The commands for a run of all logs as they are, and for a page that shows the variation beside it."""
    page = {"runs": "run", "results": ask.output, "output": "report.html"}
    run = following(slide_logs.TOOL, ask, fidelity=None, output="run")  # None: as exact as a single result needs
    return f"{run} && {command_line('make-report', page)}"


TOOL = Tool(
    "vary",
    "Evaluate",
    "Find the most influential inputs: factors varied alone and together",
    Ask,
    run,
)
