"""Tell what each tree of a run is worth: how many logs more would reach the road without it.

For every standing tree, lying log and barrier of a run of slide-logs, and for the stands that `--stands` names
(polygons; a stand is all trees within), and every line: the logs that reach the line as things are, and those that
would without it, with the interval of the difference (paired: the same logs); the logs that it holds at the end, the
energy that it takes from all that hit it, and its rank.

The answer is exact for the logs of the run: the same, log by log, as a run of its own without the thing. Only logs to
which it mattered are slid again, for all others go the same way without it. A tree that is hit often may be worth
nothing, where the next one would hold what it holds; another turns logs aside that would have missed the road, and so
is worth less than nothing.

    deadwood-tool sample-releases --areas 'sample_data/sample.gpkg|layername=release_area' --dem sample_data/dem.tif \\
        --count 200 --output releases.gpkg
    deadwood-tool import-trees --trees sample_data/trees.csv --dem sample_data/dem.tif --output trees.gpkg
    deadwood-tool slide-logs --dem sample_data/dem.tif --releases releases.gpkg --trees trees.gpkg --friction 0.25 \\
        --lines 'sample_data/sample.gpkg|layername=lines' --output run
    deadwood-tool value-trees --run run --output trees_value.gpkg

`--plant` asks the other way round: points with `dbh_cm` and `height_m` (trees, or high stumps), each put there alone,
and how many logs fewer would reach each line then; `--plant-lying` does so for lines of logs that would be left lying.

What several things are worth together is not the sum of what each is worth: two trees side by side may each be worth
nothing, and both together much. Name them as a stand, or compare two runs (compare-scenarios). The worth of a tree is
that for these releases. Trees do not break here; what a log does to the tree is not reckoned.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import Feedback, Outcome, Quiet, Tool, UserError
from deadwood_algorithms.params.where import SlidingOptions

if TYPE_CHECKING:
    import geopandas

    from deadwood_algorithms.evaluate.protection.effect import Question, Worth
    from deadwood_algorithms.evaluate.protection.obstacles import Candidates
    from deadwood_algorithms.scene.layers import SceneLayers
    from deadwood_algorithms.simulate.steps import Steps

MANY = 2**40
TIMES = 8  # so many times, about, each log slides in a forest
SHOWN = 5  # of each kind and line


@dataclass(frozen=True, kw_only=True)
class Ask(SlidingOptions):
    run: str = tool.folder("Folder of a run of slide-logs")
    lines: str | None = tool.vector(
        "Other roads, railways or houses than those of the run",
        "line",
        "polygon",
        default=None,
        help="Without it, the lines of the run.",
    )
    stands: str | None = tool.vector(
        "Stands, of which all trees are taken away together",
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
        "Logs to ask with (default: all of the run)",
        default=None,
        minimum=1,
        help="An even draw, where all would take too long: in a forest some seven times as long as the logs slid.",
    )
    seed: int = tool.seed()
    output: str = tool.output_vector("What each tree, lying log, barrier and stand is worth")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    return told_plan(ask, feedback) if ask.plan else values_of(ask, feedback)


def told_plan(ask: Ask, feedback: Feedback) -> Outcome:
    """What the run would take."""
    from deadwood_algorithms.results.forecast import planned_from_few
    from deadwood_algorithms.results.run_folder import read_run

    def few(output: str, logs: int, feedback: Feedback) -> Outcome:
        return values_of(replace(ask, output=output, logs=logs, plan=False, resume=False), feedback)

    logs = min(ask.logs or MANY, len(read_run(ask.run, feedback=Quiet()).deposits))
    of_one = max(10, ask.plan_logs // TIMES)
    return planned_from_few(few, of_one, logs, ask.output, ask.where(""), ask.plan_workers, feedback)


def values_of(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.evaluate.protection.effect import AT_ONCE, CHUNK, asked_again, slide_known
    from deadwood_algorithms.evaluate.protection.obstacles import (
        obstacles_of,
        read_candidates,
        read_stand_areas,
        stands_of,
    )
    from deadwood_algorithms.files.outputs import output_path
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.results.replay import refuse_other_ends
    from deadwood_algorithms.results.run_folder import read_run
    from deadwood_algorithms.scene.items import digest_of
    from deadwood_algorithms.simulate.chunks import identity_of
    from deadwood_algorithms.simulate.sliding import workers_for
    from deadwood_algorithms.simulate.steps import Steps
    from deadwood_algorithms.simulate.warm_up import load_kernels

    inputs = [ask.lines, ask.stands, ask.plant, ask.plant_lying]
    where = ask.where(f"{TOOL.name}-{Path(ask.output).stem}")
    with output_path(ask.output, ask.overwrite, suffix=".gpkg", inputs=inputs) as path, ExitStack() as opened:
        source = read_run(ask.run, feedback=feedback)
        question, layers, rows = opened.enter_context(
            asked_again(source, ask.lines, ask.logs, ask.seed, where, feedback)
        )
        # what is wrong with the layers is said before the logs slide
        stands = read_stand_areas(ask.stands, layers, feedback) if ask.stands else []
        lying_cm = question.simulation.inputs.lying_diameter_cm
        could = read_candidates(ask.plant, ask.plant_lying, layers, lying_cm, feedback)
        if not (layers.tree_ids or layers.lying.ids or layers.barriers.ids or len(could)):
            raise UserError(
                f"{ask.run}: no tree, lying log or barrier stands in the run; --plant names places for some"
            )

        known = {
            "groups": [CHUNK, AT_ONCE],
            "--logs or --seed": [ask.logs, ask.seed],
            "--stands": [[name, shape.wkb_hex] for name, shape in stands],
            "--plant or --plant-lying": digest_of(could.trees, could.lying),
        }
        identity = identity_of(question.simulation, layers, question.releases, **known)
        steps = Steps(ask.output, identity, resume=ask.resume, feedback=feedback)
        load_kernels(layers.shape, feedback)
        frames: dict[str, Any] = {}
        with workers_for(where, feedback):
            known, layers = slide_known(question, layers, feedback)
            refuse_other_ends(source, rows, known.result.end_position)
            if things := [*obstacles_of(layers), *stands_of(stands, layers)]:
                found = value(question, layers, known, things, steps, feedback)
                frames["values"] = frame_of(found, layers, "n_reach_without", +1)
            if len(could):
                found = value_planted(question, layers, known, could, steps, feedback)
                frames["planted"] = frame_of(found, layers, "n_reach_with", -1)
        write_vector(path, frames)
    steps.remove()
    facts = {name: frame.drop(columns="geometry").to_dict("records") for name, frame in frames.items()}
    return Outcome({"output": Path(ask.output)}, facts, lines_of(frames))


def value(
    question: Question, layers: SceneLayers, known: Any, things: list[Any], steps: Steps, feedback: Feedback
) -> list[Worth]:
    """Slide again without each thing the logs to which it mattered."""
    from deadwood_algorithms.evaluate.protection.effect import Again, logs_to_slide, tasks_of, worths

    tasks = tasks_of(things, [logs_to_slide(question, layers, known, each) for each in things])
    again = Again(question, layers, known, None)
    changes = again.all(tasks, steps, feedback, f"sliding without each of {len(things)}")
    return worths(question, layers, known, things, changes)


def value_planted(
    question: Question, layers: SceneLayers, known: Any, could: Candidates, steps: Steps, feedback: Feedback
) -> list[Worth]:
    """Slide again with each candidate the logs that come near it."""
    from deadwood_algorithms.evaluate.protection.effect import AgainWith, logs_near, tasks_of, worths
    from deadwood_algorithms.evaluate.protection.obstacles import with_candidates

    _, found = with_candidates(layers, could)
    near, layers = logs_near(question, layers, found, could.widest_radius, steps, feedback)
    again = AgainWith(question, layers, known, lambda on: with_candidates(on, could))
    changes = again.all(tasks_of(again.found, near), steps, feedback, f"sliding with each of {len(again.found)}")
    return worths(question, layers, known, again.found, changes, planted=True)


def frame_of(found: Sequence[Worth], layers: SceneLayers, changed: str, sign: int) -> geopandas.GeoDataFrame:
    """One row a thing and line, those of one line together, each by rank.

    sign : 1 where the change takes something away, so that what more reach is its worth; -1 where it puts something up
    """
    import geopandas
    import shapely

    from deadwood_algorithms.evaluate.protection.effect import ranks

    gains = [tuple(sign * each for each in worth.gain()) for worth in found]
    columns = {
        "kind": [each.obstacle.kind for each in found],
        "id": [each.obstacle.id for each in found],
        "line_id": [each.line_id for each in found],
        "n_total": [each.n_total for each in found],
        "n_reach": [each.n_reach for each in found],
        changed: [each.n_changed for each in found],
        "gain_logs": [sign * (each.gained - each.lost) for each in found],
        "gain_p": [each[0] for each in gains],
        "ci_low": [min(each[1:]) for each in gains],
        "ci_high": [max(each[1:]) for each in gains],
        "stopped": [each.stopped for each in found],
        "energy_taken_kj": [each.energy_taken_kj for each in found],
        "rank": ranks([each[0] for each in gains], found),
    }
    points = shapely.points([[each.obstacle.x, each.obstacle.y] for each in found])
    frame = geopandas.GeoDataFrame(columns, geometry=points, crs=layers.dem.plan_crs)
    kinds, lines = (list(dict.fromkeys(columns[name])) for name in ("kind", "line_id"))
    place = np.lexsort(
        [columns["rank"], list(map(kinds.index, columns["kind"])), list(map(lines.index, columns["line_id"]))]
    )
    return frame.iloc[place].reset_index(drop=True)


def lines_of(frames: dict[str, Any]) -> tuple[str, ...]:
    """For each line and kind how many are worth something, and the first few."""
    from deadwood_algorithms.stats.statistics import points_with_interval

    shown = []
    for name, frame in frames.items():
        for (line_id, kind), rows in frame.groupby(["line_id", "kind"], sort=False):
            keep, harm = int((rows["gain_logs"] > 0).sum()), int((rows["gain_logs"] < 0).sum())
            head = rows["n_reach"].iloc[0], rows["n_total"].iloc[0]
            what = f"{len(rows)} {'candidates: ' if name == 'planted' else ''}{PLURAL[kind]}"
            shown.append(
                f"{line_id}, reached by {head[0]} of {head[1]} logs; of {what} {keep} keep logs away, {harm} bring some"
            )
            for row in rows[rows["gain_logs"] > 0].head(SHOWN).itertuples():
                points = points_with_interval(row.gain_p, row.ci_low, row.ci_high)
                shown.append(
                    f"  {row.rank}. {kind} {row.id}: {row.gain_logs} logs, {points} points; holds {row.stopped}"
                )
    return tuple(shown)


PLURAL = {"tree": "trees", "lying_log": "lying logs", "barrier": "barriers", "stand": "stands"}

TOOL = Tool(
    "value-trees",
    "Evaluate",
    "A run: what each tree, lying log, barrier and stand is worth at each line",
    Ask,
    run,
)
