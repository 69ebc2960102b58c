"""Slide the released logs down the terrain, among standing trees and barriers.

Each log is a rigid truncated cone (or, with --shape, any convex body) in hard frictional contact with terrain, trees,
barriers, lying logs and boulders (engine/README.md has the physics, after section 3 of the paper). The run's folder
holds the deposits, the trajectories, the share of logs that reach each line, every hit of a barrier, impulse and energy
taken by each tree that was hit, and rasters of how often, how fast and how high logs pass. With --lines, danger.tif is
the share of passing logs that later reach a line: one band for any line, and one for each. Every released log is
accounted for.

    deadwood-tool slide-logs --dem dem.tif --releases releases.gpkg --trees trees.gpkg --blocks boulders.gpkg \\
        --lines road.gpkg --friction 0.25 --output run

Logs do not break or meet each other; barriers and boulders do not give way, trees only with --break-trees. --resume
continues an interrupted run and gives the same results, bit for bit, as a run that was never interrupted. With
--until-ci a run takes the logs in a random order and ends when the intervals are narrow enough; logs that were not run
are counted separately.

With --fidelity auto you state how large the error of a line's reach may be, and the tool chooses the fidelity and the
number of logs: --error 0.02 means 2 points, at 95 % confidence, compared with `reference` for all logs of the kind. The
first logs show how many are needed on this slope. The error of the calculation is taken from the benchmarks: at most
that of `standard` on their worst slope (--assume). summary.json and the report state both errors, separately and
together. With --budget 60s instead of --error the result is the most accurate within that time.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError
from deadwood_algorithms.params.where import SlidingOptions
from deadwood_algorithms.scene.released_scene import ReleasedScene, SceneByName

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from deadwood_algorithms.results.forecast import Pilot
    from deadwood_algorithms.scene.layers import SceneLayers
    from deadwood_algorithms.scene.releases import Releases
    from deadwood_algorithms.simulate.chunks import ChunkedRun, Keeper
    from deadwood_algorithms.simulate.simulation import Simulation
    from deadwood_engine import Fidelity

AUTO = "auto"  # the fidelity that is chosen by --error or --budget

# What other programs chain on; a run without lines, for example, has no layer reach.
PARTS = (
    *(f"run.gpkg|layername={name}" for name in ("deposits", "deposited_logs", "trajectories", "reach")),
    *(f"{name}.tif" for name in ("hit_count", "reach_probability", "deposit_count")),
    *(f"{name}.tif" for name in ("speed_max", "energy_max", "jump_max", "danger")),
    "poses.parquet",
    "summary.json",
    "project.qgz",
    "report.html",
)


@dataclass(frozen=True, kw_only=True)
class Ask(SlidingOptions, SceneByName):
    fidelity: str = tool.choice(
        "Speed against accuracy",
        "draft",
        "standard",
        "fine",
        "reference",
        AUTO,
        default="standard",
        help="auto: the cheapest that keeps --error, or the best within --budget.",
    )
    error: float | None = tool.number(
        "Permitted error of the reach of a line (--fidelity auto)",
        default=None,
        minimum=0.0,
        maximum=0.5,
        exclusive=True,
        help="0.02 means ±2 points from what reference would give, at 95 %, by sampling and by calculation together. "
        "Needs --lines.",
    )
    budget: str | None = tool.text(
        "Time for the run, instead of --error (--fidelity auto)",
        default=None,
        help="60s, 5min or 1h: the most accurate fidelity and number of logs for that time on this machine, within "
        "about a tenth. --report and --qgis-project take additional time.",
    )
    assume: str = tool.choice(
        "Errors of calculation taken from the benchmark's slopes (--fidelity auto)",
        "none",
        "standard",
        "draft",
        default="standard",
        advanced=True,
        help="none: nothing, so that reference is used. standard: the error of standard is at most that on the worst "
        "of them. draft: draft as well.",
    )
    time_step_s: float | None = tool.number(
        "Longest time step, instead of the fidelity's",
        unit="s",
        default=None,
        minimum=1e-5,
        maximum=1.0,
        advanced=True,
    )
    station_spacing_m: float | None = tool.number(
        "Spacing of the contact stations, instead of the fidelity's",
        unit="m",
        default=None,
        minimum=1e-3,
        maximum=100.0,
        advanced=True,
    )
    trajectories: str = tool.text(
        "Logs whose trajectory is kept: all, none, or how many", default="1000", help="Chosen by seed and log_id alone."
    )
    until_ci: float | None = tool.number(
        "End when every line's reach interval is this narrow (half-width)",
        default=None,
        minimum=1e-4,
        maximum=0.5,
        help="0.005 means ±0.5 points. Logs run in a random order, at most all. Checks after 1000, 2000, 4000, ... "
        "logs use intervals widened for the repetition; the reported 95 % intervals are narrower. Needs --lines.",
    )
    danger_least: int = tool.integer(
        "Least number of passing logs for which a cell has a value",
        default=10,
        minimum=1,
        advanced=True,
        help="In danger.tif, which --lines brings, cells with fewer are transparent.",
    )
    danger_counts: bool = tool.flag(
        "Also keep the counts of danger.tif",
        advanced=True,
        help="danger_count.tif, from which those of several runs add up; run-sites asks for it.",
    )
    log_capacity_kj: float | None = tool.number(
        "Energy that a log of 40 cm DBH can lose in a hit before it breaks, to count the hits above",
        unit="kJ",
        default=None,
        minimum=0.0,
        exclusive=True,
        advanced=True,
    )
    log_capacity_power: float = tool.number(
        "Exponent of DBH / 40 cm with which that grows", default=2.0, minimum=0.0, maximum=6.0, advanced=True
    )
    qgis_project: bool = tool.flag(
        "Add a QGIS project to the run",
        help="With styled and grouped layers, animated logs and a 3-D view: project.qgz, and scene.gpkg beside it.",
    )
    outline_every_s: float = tool.number(
        "Time between two outlines of the animated logs",
        unit="s",
        default=0.25,
        minimum=0.02,
        advanced=True,
        help="Of the QGIS project, for the logs that keep their trajectory.",
    )
    geoparquet: bool = tool.flag(
        "Write the run's layers as GeoParquet too",
        help="deposits.parquet, trajectories.parquet and so on, for programs that work on very many rows.",
    )
    report: bool = tool.flag(
        "Add a report to the run", help="One page with maps, figures, tables and a 3-D view: report.html (make-report)."
    )
    output: str = tool.output_folder("Folder of the run", parts=PARTS)
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.results.forecast import planned

    refuse_unfit(ask)
    if not ask.plan:
        return slid_run(ask, feedback)[0]
    kept = trajectories_wanted(ask.trajectories)
    told = planned(
        lambda place: pilot_of(ask, place, kept, feedback), ask.output, ask.where(""), ask.plan_workers, kept
    )
    more = ["at most: --until-ci may end the run earlier"] if ask.until_ci is not None else []
    if ask.report or ask.qgis_project:
        more.append("without what --report and --qgis-project add to time and disk")
    return replace(told, lines=(*told.lines, *more))


def pilot_of(ask: Ask, place: Path, kept: int | None, feedback: Feedback) -> tuple[Pilot, int]:
    """What a run of a few of the logs takes, and how many there are."""
    from deadwood_algorithms.results.forecast import pilot_from
    from deadwood_algorithms.simulate.warm_up import load_kernels

    load_kernels(None, feedback)  # a compilation is no part of what is forecast
    few = replace(
        ask, output=str(place), trajectories="none" if kept == 0 else "all", until_ci=None, plan=False, report=False,
        qgis_project=False, resume=False,
    )  # fmt: skip
    began = time.perf_counter()
    _, logs = slid_run(few, feedback, at_most=ask.plan_logs)
    return pilot_from(place, time.perf_counter() - began), logs


def slid_run(ask: Ask, feedback: Feedback, at_most: int | None = None) -> tuple[Outcome, int]:
    """The run itself, of an even draw of so many logs if not of all; and how many logs the layer has."""
    from deadwood_algorithms.results.asked import Asked
    from deadwood_algorithms.results.capacity import Capacity
    from deadwood_algorithms.results.forecast import refuse_full_disk
    from deadwood_algorithms.results.identity import writing
    from deadwood_algorithms.results.writing import write_results
    from deadwood_algorithms.simulate.log_order import hash_order, keep_by_hash
    from deadwood_algorithms.simulate.look import look
    from deadwood_algorithms.simulate.simulation import open_simulation
    from deadwood_algorithms.simulate.sliding import workers_for
    from deadwood_algorithms.simulate.windows import read_released_scene

    kept_count, began = trajectories_wanted(ask.trajectories), time.perf_counter()
    where = ask.where(f"{TOOL.name}-{Path(ask.output).name}")
    with (
        writing(TOOL, ask, feedback) as outputs,
        open_simulation(ask.inputs(), fidelity_of(ask), where, feedback, counts_danger=True) as simulation,
    ):
        folder = outputs.folder()
        layers, releases = read_released_scene(simulation, feedback)
        logs = len(releases)
        if at_most is not None:
            releases = releases.take(np.sort(hash_order(releases.logs.log_id, ask.seed)[:at_most]))
        keep = keep_by_hash(releases.logs.log_id, kept_count, ask.seed)
        if ask.until_ci is None and not ask.resume:  # what is resumed has a part of it already
            refuse_full_disk(ask.output, len(releases), int(keep.sum()))

        if at_most is None and not ask.resume:
            look(simulation, layers, releases, ask.seed, feedback)
        slide = slide_auto if ask.fidelity == AUTO else slide_all
        with workers_for(where, feedback):
            done, told = slide(ask, simulation, layers, releases, keep, began, feedback)
        asked = Asked(
            scene=tool.taken(ask, ReleasedScene),
            keeps_poses=kept_count != 0,
            danger_least=ask.danger_least,
            danger_counts=ask.danger_counts,
            capacity=tool.taken(ask, Capacity),
            **told,
        )
        outcome = write_results(
            folder,
            Path(ask.output),
            outputs,
            asked,
            done.simulation.fidelity,
            done.slope.layers,
            releases,
            done.queue,
            done.slope.rasters,
            done.work,
            feedback,
            geoparquet=ask.geoparquet,
        )
        outcome = replace(outcome, outputs={**outcome.outputs, **added(ask, folder, done, feedback)})
    done.remove()
    return outcome, logs


def slide_all(
    ask: Ask,
    simulation: Simulation,
    layers: SceneLayers,
    releases: Releases,
    keep: NDArray[np.bool_],
    began: float,
    feedback: Feedback,
) -> tuple[ChunkedRun, dict[str, Any]]:
    """Slide the logs at one fidelity, all or until the intervals are narrow; what slid, and what is told of it."""
    from deadwood_algorithms.simulate.checkpoints import WorkFolder
    from deadwood_algorithms.simulate.chunks import ChunkedRun, DrawnScene, identity_of, queue_of

    queue = queue_of(releases, target=ask.until_ci, line_ids=layers.lines.ids, seed=ask.seed)
    known = identity_of(simulation, layers, releases, **identity(ask), **{"--until-ci": ask.until_ci})
    work = WorkFolder(ask.output, known, resume=ask.resume, feedback=feedback)
    slope = DrawnScene.on(layers, simulation, work, feedback)
    done = ChunkedRun(simulation, releases, keep, keeper_of(ask, releases), slope, queue, work, feedback)
    done.slide()
    return done, {"fidelity": ask.fidelity}


def slide_auto(
    ask: Ask,
    simulation: Simulation,
    layers: SceneLayers,
    releases: Releases,
    keep: NDArray[np.bool_],
    began: float,
    feedback: Feedback,
) -> tuple[ChunkedRun, dict[str, Any]]:
    """Slide as many logs, at such a fidelity, as keep the promise; what slid, and what is told of it."""
    from deadwood_algorithms.simulate.auto_run import AutoRun, Promise

    promise = Promise.of(ask.error, ask.budget, ask.assume)
    auto = AutoRun(
        promise,
        simulation,
        layers,
        releases,
        keep,
        keeper_of(ask, releases),
        ask.output,
        ask.seed,
        ask.resume,
        identity(ask),
        feedback,
    )
    chosen, others_cpu_s = auto.promised(began)
    told = {"fidelity": chosen.option.fidelity, "auto": chosen.record, "pilot_cpu_s": others_cpu_s}
    return auto.taken(chosen.option.fidelity), told


def keeper_of(ask: Ask, releases: Releases) -> Keeper:
    """What is kept of a chunk: with a capacity also the hits above it."""
    from deadwood_algorithms.results.capacity import Capacity, Overloads
    from deadwood_algorithms.results.writing import kept_of

    capacity = tool.taken(ask, Capacity)
    return partial(kept_of, overloads=Overloads.of(capacity, releases)) if capacity else kept_of


def identity(ask: Ask) -> dict[str, Any]:
    """What decides the results beside scene, logs and laws."""
    from deadwood_algorithms.results.capacity import Capacity

    capacity = tool.taken(ask, Capacity)
    more = {"--tree-capacity-kj or --log-capacity-kj": list(vars(capacity).values())} if capacity else {}
    return {"--trajectories or --seed": [ask.trajectories, ask.seed], **more}


def added(ask: Ask, folder: Path, done: ChunkedRun, feedback: Feedback) -> dict[str, Path]:
    """The project and the page, where they are wanted, in the folder that does not stand at its place yet."""
    from deadwood_algorithms.results.qgis_project import PROJECT, add_project
    from deadwood_algorithms.tools import make_report

    final, outputs = Path(ask.output), {}
    if ask.qgis_project:
        layers, releases = done.slope.layers, done.releases
        add_project(folder, final, ask.inputs(), layers, releases, ask.outline_every_s, feedback)
        outputs["qgis_project"] = final / PROJECT
    if ask.report:
        page = make_report.Ask(runs=str(folder), names=final.name, output=str(folder / "report.html"))
        make_report.run(page, feedback)
        outputs["report"] = final / "report.html"
    return outputs


def refuse_unfit(ask: Ask) -> None:
    """Refuse options that do not go together."""
    from deadwood_algorithms.simulate.auto_run import Promise

    if ask.until_ci is not None and ask.lines is None:
        raise UserError("--until-ci needs --lines: it is the reach of lines whose interval it watches")
    if ask.fidelity != AUTO:
        for name in ("error", "budget"):
            if getattr(ask, name) is not None:
                raise UserError(f"--{name} needs --fidelity auto, which picks fidelity and number of logs by it")
        return
    Promise.of(ask.error, ask.budget, ask.assume)
    if ask.plan:
        raise UserError("--plan needs a fidelity: with --fidelity auto the run itself decides what it takes; name one")
    if ask.lines is None:
        raise UserError("--fidelity auto needs --lines: it is the reach of lines whose error is promised")
    for name in ("until_ci", "time_step_s", "station_spacing_m"):
        if getattr(ask, name) is not None:
            flag = "--" + name.replace("_", "-")
            raise UserError(f"{flag} conflicts with --fidelity auto, which chooses it; leave one of them out")


def trajectories_wanted(text: str) -> int | None:
    """How many logs keep their trajectory; None for all."""
    name = str(text).strip().lower()
    if name == "all":
        return None
    if name == "none":
        return 0
    if name.isdigit():
        return int(name)
    raise UserError(f"--trajectories is '{text}', but must be all, none or a whole number")


def fidelity_of(ask: Ask) -> Fidelity:
    """The numbers of the preset, with those that the user gave in their place; for auto those of the yardstick."""
    from deadwood_engine import fidelity_with

    return fidelity_with("reference" if ask.fidelity == AUTO else ask.fidelity, ask.time_step_s, ask.station_spacing_m)


TOOL = Tool(
    "slide-logs",
    "Simulate",
    "Slide the released logs: deposits, trajectories, hit counts, reach",
    Ask,
    run,
    then="deadwood-tool make-report {output} --output report.html",
)
