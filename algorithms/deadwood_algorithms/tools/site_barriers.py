"""Find where a barrier has most effect, and how long and high it must be, sliding only the affected logs again.

Candidates are the lines of a layer (--candidates), or straight pieces along contours above the lines of the run: for
each height above them (--above-m) and each length (--length-m) the few places that most logs pass on their way to a
line (--places). Such a piece has both ends on the contour, has the requested length in plan from end to end, and
deviates by at most 30 degrees from the contours of the ground under it (`angle_deg`). Each candidate is tested alone,
with each --height-m, and the logs that come near it slide again. Then the best is chosen, then the best one in
addition, until there are --count, or none has an effect beyond chance.

    deadwood-tool sample-releases --areas 'sample_data/sample.gpkg|layername=release_area' --dem sample_data/dem.tif \\
        --count 200 --output releases.gpkg
    deadwood-tool slide-logs --dem sample_data/dem.tif --releases releases.gpkg --friction 0.25 \\
        --lines 'sample_data/sample.gpkg|layername=lines' --output run
    deadwood-tool site-barriers --run run --above-m 10,20 --length-m 20,40 --height-m 2,4 --count 2 --output barriers

The folder holds

- `pareto.csv`: each candidate alone, and each chosen set: how many logs still reach a line, the interval of that and of
  the gain (paired), how many it holds and how many jump over or pass beside it. What its place needs are the 95 %
  percentiles of energy and height of all logs that come there, without its plate (`height_needed_p95_m`,
  `energy_needed_p95_kj`, with exact intervals): the same for each height of a place. Those of the logs that hit the
  barrier stand beside them (`height_hit_p95_m`, never more than its height). `pareto` marks the candidates that no
  other of the same or smaller length and height outperforms; `--barrier-classes` adds the weakest class of rockfall
  nets that holds the energy needed;
- `barriers.gpkg`: the run's own barriers and those chosen, for slide-logs --barriers, with the effect of each once all
  stand; `barriers.png`: a map, and remaining reach against length and height; `summary.json`.

The results are exact for the logs of the run: the same as a separate run with those barriers. But the best of many was
selected on these logs and has a slightly smaller effect on others (another seed). Barriers are rigid and infinitely
strong. Where one can be founded, and at what cost, is for an expert to decide.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from deadwood_algorithms.params import presets, tool
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError
from deadwood_algorithms.params.where import SlidingOptions
from deadwood_algorithms.schemas import BARRIER_M

if TYPE_CHECKING:
    from deadwood_algorithms.evaluate.protection.candidate_barriers import Candidate
    from deadwood_algorithms.evaluate.protection.rerun import Rerun
    from deadwood_algorithms.scene.layers import SceneLayers

TABLE, LAYER, PICTURE = "pareto.csv", "barriers.gpkg", "barriers.png"
FACTS, MANIFEST = "summary.json", "manifest.json"
TIMES = 9  # how often each log slides, approximately
MANY = 200  # above this number of candidates a message announces the work


@dataclass(frozen=True, kw_only=True)
class Ask(SlidingOptions):
    run: str = tool.folder("Folder of a run", help="Written by slide-logs, with roads, railways or houses.")
    lines: str | None = tool.other_lines()
    candidates: str | None = tool.vector(
        "Lines where a barrier could stand",
        "line",
        default=None,
        help="With barrier_id and, optionally, height_m; without that field each has every --height-m. Without the "
        "layer, straight pieces along contours.",
    )
    above_m: tuple[float, ...] = tool.class_bounds(
        "Heights of contours above the lines", 10.0, 30.0, unit="m", help="Above the nearest place."
    )
    length_m: tuple[float, ...] = tool.class_bounds("Lengths of pieces along contours", 20.0, 40.0, unit="m")
    height_m: tuple[float, ...] = tool.class_bounds(
        "Heights of barriers", 2.0, 4.0, unit="m", maximum=BARRIER_M, exclusive_maximum=True
    )
    places: int = tool.integer("Places for each contour and length", default=2, minimum=1)
    count: int = tool.integer("Barriers to choose, at most", default=1, minimum=1)
    barrier_classes: str | None = tool.choice(
        "Classes of barriers, to find the weakest that holds the energies",
        *presets.BARRIERS,
        default=None,
        help=presets.choices_help(presets.BARRIERS)
        + " They were made for rocks; whether they suit wood is for an expert to decide.",
    )
    logs: int | None = tool.integer(
        "Logs to use (default: all of the run)", default=None, minimum=1, help="A random subset."
    )
    seed: int = tool.seed()
    output: str = tool.output_folder("Folder of table, layer and map")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.results.plan import result_or_plan_of_run

    return result_or_plan_of_run(sited, ask, feedback, times=TIMES)


def sited(ask: Ask, feedback: Feedback) -> Outcome:
    import pandas

    from deadwood_algorithms.evaluate.protection.candidate_barriers import read_given
    from deadwood_algorithms.evaluate.protection.contour_search import contours_of
    from deadwood_algorithms.evaluate.protection.rerun import open_rerun
    from deadwood_algorithms.evaluate.protection.siting import Siting, choose, trials_alone
    from deadwood_algorithms.evaluate.protection.siting_figure import draw
    from deadwood_algorithms.evaluate.protection.siting_table import (
        by_line,
        layer_of,
        lines_of,
        rows_of,
        warn_of_reach,
        with_classes,
    )
    from deadwood_algorithms.files.tables import write_csv
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.results.identity import result_folder
    from deadwood_algorithms.results.lost import share_if_lost
    from deadwood_algorithms.results.replay import refuse_other_ends
    from deadwood_algorithms.results.run_folder import read_run, write_json
    from deadwood_algorithms.results.scenario import lines_of_run
    from deadwood_algorithms.simulate.sliding import workers_for
    from deadwood_algorithms.simulate.steps import Steps
    from deadwood_algorithms.simulate.warm_up import load_kernels

    where = ask.where(f"{TOOL.name}-{Path(ask.output).name}")
    with result_folder(TOOL, ask, feedback) as folder, ExitStack() as opened:
        source = read_run(ask.run, feedback=feedback)
        rerun, layers, rows = opened.enter_context(open_rerun(source, ask.lines, ask.logs, ask.seed, where, feedback))
        found = read_given(ask.candidates, ask.height_m, layers, feedback) if ask.candidates else []
        kept = opened.enter_context(
            Steps(ask.output, identity(ask, rerun, layers, found), resume=ask.resume, feedback=feedback)
        )
        load_kernels(layers.shape, feedback)
        with workers_for(where, feedback):
            if not ask.candidates:
                found, layers = contours_of(
                    ask.run,
                    rerun,
                    layers,
                    kept,
                    feedback,
                    above_m=ask.above_m,
                    length_m=ask.length_m,
                    height_m=ask.height_m,
                    places=ask.places,
                )
            if len(found) > MANY:
                feedback.warn(f"{counted(len(found), 'candidate')} to slide, each alone; fewer take less time")
            siting = Siting(rerun, layers, found, kept, feedback)
            now, ends = siting.slide(np.arange(rows.size), (), "sliding the run again")
            refuse_other_ends(source, rows, ends)
            if not now.any_line.any():
                raise UserError(f"{ask.run}: no log of the run reaches a line; there is nothing to keep away")
            siting.slid = 0
            alone = list(trials_alone(siting, now))
            steps, why = choose(siting, now, alone, ask.count, feedback)
            table = with_classes(pandas.DataFrame(rows_of(siting, now, alone, steps)), ask.barrier_classes)
            frame = with_classes(layer_of(siting, layers, now, steps), ask.barrier_classes)
        write_csv(folder / TABLE, table)
        write_vector(folder / LAYER, {"barriers": frame})
        draw(folder / PICTURE, source, siting, table, frame)
        facts: dict[str, Any] = {
            "logs": int(rows.size),
            "slid_again": siting.slid,
            "candidates": len(found),
            "reach": share_if_lost(now.any_line, now.left),
            "reach_by_line": by_line(siting, now),
            "chosen": [row for row in table.to_dict("records") if row["step"]],
            "reach_by_line_after": by_line(siting, steps[-1].outcomes if steps else now),
            "stopped_because": why,
            "rows": table.to_dict("records"),
        }
        warn_of_reach(facts, now, feedback)
        write_json(folder / FACTS, facts)
    kept.remove()
    parts = {"table": TABLE, "layer": LAYER, "picture": PICTURE, "facts": FACTS, "manifest": MANIFEST}
    shown = (*lines_of(facts, ask.barrier_classes), *lines_of_run(source))
    return Outcome.of_folder(ask.output, parts, facts, shown)


def identity(ask: Ask, rerun: Rerun, layers: SceneLayers, given: Sequence[Candidate]) -> dict[str, Any]:
    """Everything that determines the steps: stored ones are reused only if all of it agrees."""
    from deadwood_algorithms.evaluate.protection.changed_scenes import CHUNK
    from deadwood_algorithms.simulate.chunks import identity_of

    decided_by = {
        "groups": CHUNK,
        "--logs or --seed": [ask.logs, ask.seed],
        "--candidates": [[each.id, each.shape.wkb_hex, each.height] for each in given],
        "--above-m, --length-m, --height-m, --places or --count": [
            list(ask.above_m),
            list(ask.length_m),
            list(ask.height_m),
            ask.places,
            ask.count,
        ],
    }
    return identity_of(rerun.simulation, layers, rerun.releases, **decided_by)


TOOL = Tool(
    "site-barriers",
    "Evaluate",
    "Find where a barrier keeps most logs away, by its length and height",
    Ask,
    run,
    then="deadwood-tool make-report {run} --results {output} --output report.html",
)
