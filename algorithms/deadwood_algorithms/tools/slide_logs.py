"""Slide the released logs down the terrain, among standing trees and barriers.

Each log is a rigid truncated cone (or, with --shape, any convex body) in hard frictional contact with terrain, trees,
barriers, lying logs and boulders (after section 3 of the paper). The run's folder holds the
deposits, the trajectories, the share of logs that reach each line, every hit of a barrier, impulse and energy taken by
each tree that was hit, and rasters of how often, how fast and how high logs pass. With --lines, danger.tif is the share
of passing logs that later reach a line: one band for any line, and one for each. Every released log is accounted for.

    deadwood-tool slide-logs --dem dem.tif --releases releases.gpkg --trees trees.gpkg --blocks boulders.gpkg \\
        --lines road.gpkg --friction 0.25 --output run

Logs neither break nor collide with each other; barriers and boulders do not give way, trees only with --break-trees.
--resume continues an interrupted run and gives the same results, bit for bit, as a run that was never interrupted. With
--until-ci a run takes the logs in a random order and ends when the intervals are narrow enough; logs that were not run
are counted separately. With --friction-range the reach of lines is given over a range of friction, too.

With --fidelity auto --error 0.02 the tool chooses fidelity and number of logs so that every line's reach is within 2
points, at 95 % confidence, of what `reference` would give; the error of the calculation is taken from random slopes of
the same kind (--assume). The run states both errors. With --budget 60s the result is the most accurate in that time.

With --lines, 100 to 200 of the logs slide again at a finer fidelity (--own-slope N|none): the interval of the paired
difference shows how far each line's reach is off on this slope.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.run_options import AddedOptions, CapacityOptions, FidelityOptions, KeptOptions
from deadwood_algorithms.params.tool import Feedback, Outcome, ProgressOnly, Tool
from deadwood_algorithms.params.where import SlidingOptions
from deadwood_algorithms.report.languages import LANGUAGES
from deadwood_algorithms.scene.released_scene import ReleasedScene, SceneByName

if TYPE_CHECKING:
    from deadwood_algorithms.results.forecast import Pilot
    from deadwood_algorithms.simulate.auto_run import Promise
    from deadwood_algorithms.simulate.chunks import ChunkedRun


@dataclass(frozen=True, kw_only=True)
class Ask(AddedOptions, CapacityOptions, KeptOptions, FidelityOptions, SlidingOptions, SceneByName):
    language: str = tool.choice("Language of report and QGIS project", *LANGUAGES, default="en", advanced=True)
    output: str = tool.output_folder("Folder of the run")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.results.plan import planned
    from deadwood_algorithms.simulate.auto_run import promise_of

    ask.refuse_without_lines(ask.lines)
    promise = promise_of(ask, lines=ask.lines, until_ci=ask.until_ci, plan=ask.plan)
    if not ask.plan:
        return slid_run(ask, promise, feedback)[0]
    pilot, kept = partial(pilot_run, ask, feedback), ask.trajectories_kept
    plan = planned(pilot, ask.output, ask.where(""), ask.plan_workers, kept)
    more = ["at most: --until-ci may end the run earlier"] if ask.until_ci else []
    if ask.report or ask.qgis_project or ask.friction_range:
        more.append("without what --report and --qgis-project add to time and disk, and --friction-range to the time")
    return replace(plan, lines=(*plan.lines, *more))


def pilot_run(ask: Ask, feedback: Feedback, place: Path) -> tuple[Pilot, int]:
    """The cost of a run of a few logs, and the number of all logs."""
    from deadwood_algorithms.results.plan import pilot_from
    from deadwood_algorithms.simulate.own_slope import again_in_logs
    from deadwood_algorithms.simulate.warm_up import load_kernels

    load_kernels(None, feedback)  # compilation is not part of the forecast
    few = replace(
        ask,
        output=str(place),
        trajectories="none" if ask.trajectories_kept == 0 else "all",
        until_ci=None,
        plan=False,
        friction_range=None,
        report=False,
        qgis_project=False,
        resume=False,
        own_slope="none",
    )
    began = time.perf_counter()
    _, logs = slid_run(few, None, feedback, at_most=ask.plan_logs)
    again = again_in_logs(ask.fidelity, logs, ask.own_slope_logs) if ask.lines is not None else 0.0
    return replace(pilot_from(place, time.perf_counter() - began), again=again), logs


def slid_run(ask: Ask, promise: Promise | None, feedback: Feedback, at_most: int | None = None) -> tuple[Outcome, int]:
    """The run of all logs, or of a random subset; and the number of logs in the layer."""
    import numpy as np

    from deadwood_algorithms.evaluate.sensitivity.friction_band import friction_ends, slid_band
    from deadwood_algorithms.results.capacity import Capacity
    from deadwood_algorithms.results.forecast import judge_disk
    from deadwood_algorithms.results.identity import writing
    from deadwood_algorithms.results.run_settings import RunSettings
    from deadwood_algorithms.results.writing import keeper_of, write_results
    from deadwood_algorithms.scene.cell_noise import doubt_draft
    from deadwood_algorithms.simulate.auto_run import slide_promised
    from deadwood_algorithms.simulate.checkpoints import part_path
    from deadwood_algorithms.simulate.log_order import hash_order, keep_by_hash
    from deadwood_algorithms.simulate.log_run import LogRun, slide_logs
    from deadwood_algorithms.simulate.look import look
    from deadwood_algorithms.simulate.own_slope import own_sample
    from deadwood_algorithms.simulate.simulation import open_simulation
    from deadwood_algorithms.simulate.sliding import workers_for
    from deadwood_algorithms.simulate.windows import farthest, read_released_scene
    from deadwood_engine import fidelity_with

    kept_count, began, capacity = ask.trajectories_kept, time.perf_counter(), tool.taken(ask, Capacity)
    ends = friction_ends(ask.friction_range, ask.friction, ask.friction_preset)
    fidelity = fidelity_with("reference" if promise else ask.fidelity, ask.time_step_s, ask.station_spacing_m)
    where = ask.where(f"{TOOL.name}-{Path(ask.output).name}")
    with (
        writing(TOOL, ask, feedback) as outputs,
        open_simulation(ask.inputs(), fidelity, where, feedback, counts_danger=True) as simulation,
    ):
        folder = outputs.folder()
        layers, releases = read_released_scene(simulation, feedback)
        logs = len(releases)
        if at_most is not None:
            releases = releases.take(np.sort(hash_order(releases.logs.log_id, ask.seed)[:at_most]))
        keep = keep_by_hash(releases.logs.log_id, kept_count, ask.seed)
        if ask.until_ci is None and not ask.resume:  # a resumed run has done a part of it already
            judge_disk(ask.output, len(releases), int(keep.sum()), farthest(layers, releases, ask.friction), feedback)
        if at_most is None and not (ask.resume and part_path(ask.output).is_dir()):  # what began was looked at
            look(simulation, layers, releases, ask.seed, feedback)
        if ask.fidelity == "draft":
            doubt_draft(layers.dem, releases.x, releases.y, feedback)
        capacities = {"--tree-capacity-kj or --log-capacity-kj": list(vars(capacity).values())} if capacity else {}
        identity = {"--trajectories or --seed": [ask.trajectories, ask.seed], **capacities}
        keeper = keeper_of(capacity, releases)
        prepared = LogRun(
            simulation, layers, releases, keep, keeper, ask.output, ask.seed, ask.resume, identity, feedback
        )
        with workers_for(where, feedback):
            if promise:
                done, chosen, pilot_cpu_s = slide_promised(prepared, promise, began)
            else:
                done, chosen, pilot_cpu_s = slide_logs(prepared, ask.until_ci), None, 0.0
            used = chosen.option.fidelity if chosen else ask.fidelity
            own_slope = own_sample(done, used, ask, ask.seed)
            band = slid_band(done, ends, used, ask.seed, feedback)
        settings = RunSettings(
            scene=tool.taken(ask, ReleasedScene),
            fidelity=used,
            keeps_poses=kept_count != 0,
            capacity=capacity,
            danger_least=ask.danger_least,
            danger_counts=ask.danger_counts,
            auto=chosen.record if chosen else None,
            pilot_cpu_s=pilot_cpu_s,
            own_slope=own_slope,
            band=band,
        )
        outcome = write_results(folder, Path(ask.output), outputs, settings, done, feedback, geoparquet=ask.geoparquet)
        outcome = replace(outcome, outputs={**outcome.outputs, **added(ask, folder, done, feedback)})
    done.remove()
    return outcome, logs


def added(ask: Ask, folder: Path, done: ChunkedRun, feedback: Feedback) -> dict[str, Path]:
    """Add the requested project and page to the folder before it is moved to its place."""
    final, outputs, scene = Path(ask.output), {}, (done.slope.layers, done.releases)
    if ask.qgis_project:
        from deadwood_algorithms.report.sheet import sheet_words
        from deadwood_algorithms.report.words import Words
        from deadwood_algorithms.results.qgis_project import PROJECT, add_project

        words = partial(sheet_words, words=Words(ask.language))
        add_project(folder, final, ask.inputs(), *scene, ask.outline_every_s, words, feedback)
        outputs["qgis_project"] = final / PROJECT
    if ask.report:
        from deadwood_algorithms.tools import make_report

        page = make_report.Ask(
            runs=str(folder), names=final.name, language=ask.language, output=f"{folder}/report.html"
        )
        make_report.run(page, ProgressOnly(feedback))
        outputs["report"] = final / "report.html"
    return outputs


TOOL = Tool(
    "slide-logs",
    "Simulate",
    "Slide the released logs: deposits, trajectories, hit counts, reach",
    Ask,
    run,
    then="deadwood-tool make-report {output} --output report.html",
)
