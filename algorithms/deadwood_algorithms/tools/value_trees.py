"""Compute the effect of each tree of a run: how many more logs would reach the road without it.

For every standing tree, lying log and barrier of a run of slide-logs, for the stands of `--stands` (polygons; a stand
is all trees within), and for every line: the number of logs that reach the line, and that would without the object,
with the interval of the difference (paired: the same logs); the logs that it holds at the end, the energy that it takes
from all that hit it, and its rank.

The result is exact for the logs of the run: the same, log by log, as a separate run without the object. Only logs that
it affected are slid again; all others move in the same way without it. A tree that is hit often may have no effect, if
the next one would hold the same logs; another has a negative effect: it deflects logs onto the road.

    deadwood-tool sample-releases --areas 'sample_data/sample.gpkg|layername=release_area' --dem sample_data/dem.tif \\
        --count 200 --output releases.gpkg
    deadwood-tool import-trees --trees sample_data/trees.csv --dem sample_data/dem.tif --output trees.gpkg
    deadwood-tool slide-logs --dem sample_data/dem.tif --releases releases.gpkg --trees trees.gpkg --friction 0.25 \\
        --lines 'sample_data/sample.gpkg|layername=lines' --output run
    deadwood-tool value-trees --run run --output trees_value.gpkg

`--plant` does the opposite: points with `dbh_cm` and `height_m` (trees, or high stumps), each added alone, and how many
fewer logs would then reach each line; `--plant-lying` does so for lines of logs that would be left lying.

The effect of several objects together is not the sum of their effects: two trees side by side may each have none, and
together a large one. Name them as a stand, or compare two runs (compare-scenarios). The effect of a tree holds for
these releases. Trees break only if they did in the run (`slide-logs --break-trees`). Damage to trees is not computed.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError
from deadwood_algorithms.params.where import SlidingOptions
from deadwood_algorithms.stats.endings import left_dem

TIMES = 8  # how often each log slides in a forest, approximately


@dataclass(frozen=True, kw_only=True)
class Ask(SlidingOptions):
    run: str = tool.folder("Folder of a run", help="Written by slide-logs.")
    lines: str | None = tool.other_lines()
    stands: str | None = tool.vector(
        "Stands whose trees are all removed together",
        "polygon",
        default=None,
        help="Their id is stand_id, else name, else the row.",
    )
    plant: str | None = tool.vector(
        "Places where a tree or high stump could stand", "point", default=None, help="With dbh_cm and height_m."
    )
    plant_lying: str | None = tool.vector(
        "Places where a log could be left lying", "line", default=None, help="From base to tip, with diameter_cm."
    )
    logs: int | None = tool.integer(
        "Logs to use (default: all of the run)",
        default=None,
        minimum=1,
        help="A random subset, if all take too long: in a forest about seven times as long as the run.",
    )
    seed: int = tool.seed()
    output: str = tool.output_vector("Effect of each tree, lying log, barrier and stand")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.results.plan import result_or_plan_of_run

    return result_or_plan_of_run(values_of, ask, feedback, times=TIMES)


def values_of(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.evaluate.protection.baseline import slide_baseline
    from deadwood_algorithms.evaluate.protection.changed_scenes import AT_ONCE, CHANGED, CHUNK
    from deadwood_algorithms.evaluate.protection.effect_layer import (
        candidate_effects,
        frame_of,
        lines_of,
        obstacle_effects,
    )
    from deadwood_algorithms.evaluate.protection.obstacles import (
        obstacles_of,
        read_candidates,
        read_stand_areas,
        stands_of,
    )
    from deadwood_algorithms.evaluate.protection.rerun import open_rerun
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.results.identity import writing
    from deadwood_algorithms.results.lost import lost_warning, reach_phrases, reach_records
    from deadwood_algorithms.results.replay import refuse_other_ends
    from deadwood_algorithms.results.run_folder import read_run
    from deadwood_algorithms.results.scenario import lines_of_run
    from deadwood_algorithms.scene.items import digest_of
    from deadwood_algorithms.simulate.chunks import identity_of
    from deadwood_algorithms.simulate.sliding import workers_for
    from deadwood_algorithms.simulate.steps import Steps
    from deadwood_algorithms.simulate.warm_up import load_kernels

    where = ask.where(f"{TOOL.name}-{Path(ask.output).stem}")
    with writing(TOOL, ask, feedback) as outputs, ExitStack() as opened:
        path = outputs.file("output", ".gpkg")
        source = read_run(ask.run, feedback=feedback)
        rerun, layers, rows = opened.enter_context(open_rerun(source, ask.lines, ask.logs, ask.seed, where, feedback))
        # what is wrong with the layers is reported before the logs slide
        stands = read_stand_areas(ask.stands, layers, feedback) if ask.stands else []
        lying_cm = rerun.simulation.inputs.lying_diameter_cm
        could = read_candidates(ask.plant, ask.plant_lying, layers, lying_cm, feedback)
        if not (layers.tree_ids or layers.lying.ids or layers.barriers.ids or len(could)):
            raise UserError(
                f"{ask.run}: no tree, lying log or barrier stands in the run; --plant names places for some"
            )

        decided_by = {
            "groups": [CHUNK, AT_ONCE, *CHANGED],
            "--logs or --seed": [ask.logs, ask.seed],
            "--stands": [[name, shape.wkb_hex] for name, shape in stands],
            "--plant or --plant-lying": digest_of(could.trees, could.lying),
        }
        identity = identity_of(rerun.simulation, layers, rerun.releases, **decided_by)
        steps = Steps(ask.output, identity, resume=ask.resume, feedback=feedback)
        load_kernels(layers.shape, feedback)
        frames: dict[str, Any] = {}
        with workers_for(where, feedback):
            baseline, layers = slide_baseline(rerun, layers, feedback)
            refuse_other_ends(source, rows, baseline.result.end_position)
            left = left_dem(baseline.result.stop_reason)
            phrases = reach_phrases(reach_records(layers.lines.ids, baseline.reach, left))
            if warning := lost_warning(int(left.sum()), left.size, phrases):
                feedback.warn(
                    f"{ask.run}: {warning}; gain_p_low_if_lost and gain_p_high_if_lost bound each gain", code="left-dem"
                )
            if things := [*obstacles_of(layers), *stands_of(stands, layers)]:
                found = obstacle_effects(rerun, layers, baseline, things, steps, feedback)
                frames["values"] = frame_of(found, layers, "n_reach_without", +1)
            if len(could):
                found = candidate_effects(rerun, layers, baseline, could, steps, feedback)
                frames["planted"] = frame_of(found, layers, "n_reach_with", -1)
        write_vector(path, frames)
    steps.remove()
    facts = {name: frame.drop(columns="geometry").to_dict("records") for name, frame in frames.items()}
    return Outcome({"output": Path(ask.output)}, facts, (*lines_of(frames), *lines_of_run(source)))


TOOL = Tool(
    "value-trees",
    "Evaluate",
    "Compute the effect of each tree, lying log, barrier and stand at each line",
    Ask,
    run,
    then="deadwood-tool make-report {run} --results {output} --output report.html",
)
