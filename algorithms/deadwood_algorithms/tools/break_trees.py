"""Find how many more logs would reach the road if trees broke: each slides again without the trees it would break.

In a run of slide-logs trees are rigid and unbreakable. `--tree-capacity-kj` is the energy that a tree of 40 cm DBH
absorbs before it breaks (for others a power of the DBH). Every log whose hit exceeds it continues without that tree,
and without the next that it would break, until it breaks none or has reached every line. A tree that breaks absorbs no
energy here, whereas a real one absorbs some; so the true reach lies between that of the run and that of this tool.

    deadwood-tool sample-releases --areas 'sample_data/sample.gpkg|layername=release_area' --dem sample_data/dem.tif \\
        --count 200 --output releases.gpkg
    deadwood-tool import-trees --trees sample_data/trees.csv --dem sample_data/dem.tif --output trees.gpkg
    deadwood-tool slide-logs --dem sample_data/dem.tif --releases releases.gpkg --trees trees.gpkg --friction 0.25 \\
        --lines 'sample_data/sample.gpkg|layername=lines' --output run
    deadwood-tool break-trees --run run --tree-capacity-kj 200 --output breaking.gpkg

The layer `reach_breaking` has both bounds for each line, with the interval of their difference (paired: the same logs);
`broken` has each tree that any log breaks, and how many do. There is no default capacity: use one that was measured for
your species, and both ends of its range. Each log meets all trees: one that another log broke stands again. Logs and
lying logs do not break.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError
from deadwood_algorithms.params.where import SlidingOptions

TIMES = 3  # how often each log slides, approximately


@dataclass(frozen=True, kw_only=True)
class Ask(SlidingOptions):
    run: str = tool.folder(
        "Folder of a run", help="Written by slide-logs, with trees and with roads, railways or houses."
    )
    tree_capacity_kj: float = tool.number(
        "Energy that a tree of 40 cm DBH absorbs before it breaks", unit="kJ", minimum=0.0, exclusive=True
    )
    tree_capacity_power: float = tool.capacity_power()
    lines: str | None = tool.other_lines()
    logs: int | None = tool.integer(
        "Logs to use (default: all of the run)", default=None, minimum=1, help="A random subset."
    )
    seed: int = tool.seed()
    output: str = tool.output_vector("Reach of each line with trees that break, and the trees")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.results.plan import result_or_plan_of_run

    return result_or_plan_of_run(broken_by, ask, feedback, times=TIMES)


def broken_by(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.evaluate.protection.baseline import slide_baseline
    from deadwood_algorithms.evaluate.protection.breaking import break_trees, frames_of, lines_of
    from deadwood_algorithms.evaluate.protection.changed_scenes import AT_ONCE, CHUNK
    from deadwood_algorithms.evaluate.protection.rerun import open_rerun
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.results.capacity import Capacity
    from deadwood_algorithms.results.identity import writing
    from deadwood_algorithms.results.lost import reach_phrases, reach_records, warn_of_lost
    from deadwood_algorithms.results.replay import refuse_other_ends
    from deadwood_algorithms.results.run_folder import read_run
    from deadwood_algorithms.results.scenario import lines_of_run
    from deadwood_algorithms.simulate.chunks import identity_of
    from deadwood_algorithms.simulate.sliding import workers_for
    from deadwood_algorithms.simulate.steps import Steps
    from deadwood_algorithms.simulate.warm_up import load_kernels
    from deadwood_algorithms.stats.endings import left_dem

    where = ask.where(f"{TOOL.name}-{Path(ask.output).stem}")
    capacity = Capacity(tree_capacity_kj=ask.tree_capacity_kj, tree_capacity_power=ask.tree_capacity_power)
    with writing(TOOL, ask, feedback) as outputs, ExitStack() as opened:
        path = outputs.file("output", ".gpkg")
        source = read_run(ask.run, feedback=feedback)
        rerun, layers, rows = opened.enter_context(open_rerun(source, ask.lines, ask.logs, ask.seed, where, feedback))
        if layers.breaking:
            raise UserError(
                f"{ask.run}: trees broke in the run itself (--break-trees), so its reach already lies between the "
                "bounds that are computed here; slide it again without that flag, and read the bounds of that run"
            )
        if not layers.tree_ids:
            raise UserError(f"{ask.run}: no tree stands in the run, so none breaks")
        decided_by = {
            "groups": [CHUNK, AT_ONCE],
            "--logs or --seed": [ask.logs, ask.seed],
            "--tree-capacity-kj or --tree-capacity-power": [ask.tree_capacity_kj, ask.tree_capacity_power],
        }
        identity = identity_of(rerun.simulation, layers, rerun.releases, **decided_by)
        steps = Steps(ask.output, identity, resume=ask.resume, feedback=feedback)
        load_kernels(layers.shape, feedback)
        with workers_for(where, feedback):
            slid, layers = slide_baseline(rerun, layers, feedback)
            refuse_other_ends(source, rows, slid.result.end_position)
            left = left_dem(slid.result.stop_reason)
            phrases = reach_phrases(reach_records(layers.lines.ids, slid.reach, left))
            warn_of_lost(int(left.sum()), left.size, phrases, feedback, where=ask.run)
            broken = break_trees(rerun, layers, slid, capacity, steps, feedback)
        frames = frames_of(broken, slid, layers, capacity)
        write_vector(path, frames)
    steps.remove()
    facts = {name: frame.drop(columns="geometry").to_dict("records") for name, frame in frames.items()}
    return Outcome({"output": Path(ask.output)}, facts, (*lines_of(frames, broken, capacity), *lines_of_run(source)))


TOOL = Tool(
    "break-trees",
    "Evaluate",
    "Compute how many more logs would reach each line if trees broke",
    Ask,
    run,
    then="deadwood-tool value-trees --run {run} --output values.gpkg",
)
