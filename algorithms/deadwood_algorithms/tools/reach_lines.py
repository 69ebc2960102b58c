"""Find which stored trajectories reach roads, railways or houses (lines or polygons), with what energy, and from where.

A log reaches a line when any part of its plan-view outline touches it at any time, and a polygon also when it starts
inside (paper, equation 10). Each probability comes with its 95 % Wilson interval, over the logs whose trajectory was
stored: with fewer than all of them stored it is an estimate from that sample.

The layers of the output: `reach`, one row for each line; `arrivals`, one row for each log and line, with time, speed,
energy of translation and of rotation, clearance below the log, height of its centre of mass above the terrain,
direction of travel, and the angles to the line and to the log's own axis; `attribution`, one row for each release and
line: which release reaches which object, with what probability; `origins`, the arrivals at the places where their logs
were released. `map-origins` maps the share of logs that reach a line by release cell.

    deadwood-tool sample-releases --areas 'sample_data/sample.gpkg|layername=release_area' --dem sample_data/dem.tif \\
        --count 200 --output releases.gpkg
    deadwood-tool slide-logs --dem sample_data/dem.tif --releases releases.gpkg --friction 0.25 --trajectories all \\
        --output run
    deadwood-tool reach-lines --run run --lines 'sample_data/sample.gpkg|layername=lines' --output reached.gpkg

Logs that left the terrain model would have moved on. The tool warns of them, and of logs that passed near its edge,
where heights are least certain; `p_low_if_lost` and `p_high_if_lost` are the bounds if none or all of those that left
before reaching the line had reached it. The shares are those of logs that have started; the probability of a start is
not included.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError
from deadwood_algorithms.stats.endings import left_dem
from deadwood_algorithms.stats.order_statistics import missing
from deadwood_algorithms.stats.statistics import lost_words, percent_with_interval


@dataclass(frozen=True, kw_only=True)
class Ask:
    run: str = tool.folder("Folder of a run", help="Written by slide-logs.")
    lines: str = tool.vector("Roads, railways, houses", "line", "polygon")
    edge_m: float = tool.number(
        "Distance from the terrain model's edges within which logs cause a warning",
        unit="m",
        default=20.0,
        minimum=0.0,
        help="Edges are its border and its nodata; more than half a log's length is recommended.",
    )
    output: str = tool.output_vector("Reach, arrivals, attribution and origins")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.results import arrivals
    from deadwood_algorithms.results.edges import Edges, edge_words
    from deadwood_algorithms.results.identity import writing
    from deadwood_algorithms.results.run_folder import input_paths, read_run
    from deadwood_algorithms.results.scenario import lines_of_run
    from deadwood_algorithms.scene.layers import read_lines

    with ExitStack() as stack:
        path = stack.enter_context(writing(TOOL, ask, feedback)).file("output", ".gpkg")
        source = read_run(ask.run, feedback=feedback)
        lines, items = read_lines(ask.lines, source.grid, feedback)
        if not source.stored_log_ids.size:
            raise UserError(f"{ask.run}: no trajectory was stored; run slide-logs with --trajectories all")
        total = len(source.deposits)
        if source.stored_log_ids.size < total:
            feedback.note(
                f"{source.stored_log_ids.size} of {total} logs have a stored trajectory; p is based on these",
                code="some-trajectories",
                stored=source.stored_log_ids.size,
                logs=total,
            )

        edges = stack.enter_context(Edges(source.grid, input_paths(source.path, source.manifest, "dem"), feedback))
        arrived = arrivals.find_arrivals(source, lines, items, edges, ask.edge_m, feedback)
        frame = arrivals.arrivals_frame(source, arrived, items, edges)
        reach = arrivals.arrival_counts_frame(source, frame, items)
        attribution = arrivals.attribution_frame(source, frame, items)

        stored = np.isin(source.deposits["log_id"], source.stored_log_ids)
        left = stored & left_dem(source.deposits)
        near = arrived.near_edge & ~left
        if left.any() or near.any():
            counts = int(left.sum()), int(near.sum()), source.stored_log_ids.size
            feedback.warn(f"{ask.run}: " + edge_words(*counts, ask.edge_m, edges.words, "passed"), code="left-dem")
        layers = {"reach": reach, "arrivals": frame, "attribution": attribution}
        write_vector(path, layers | {"origins": arrivals.origins_frame(frame)})
    facts = {
        "reach": reach.drop(columns="geometry").to_dict("records"),
        "attribution": attribution.drop(columns="geometry").to_dict("records"),
        "edges": {"n_left_dem": int(left.sum()), "n_near_edge": int(near.sum()), "edge_m": ask.edge_m},
    }
    return Outcome({"output": Path(ask.output)}, facts, (*lines_of(facts), *lines_of_run(source)))


def lines_of(facts: dict) -> tuple[str, ...]:
    """One line of text for each line; if several releases reach it, one more for each of these."""
    shown = []
    for each in facts["reach"]:
        how = f", median {each['speed_median_ms']:.1f} m/s and {each['energy_median_kj']:.0f} kJ"
        if more := missing(each["n_reach"], 0.5):
            how = f", a median needs {counted(more, 'more arrival')}"
        shown.append(
            f"{each['line_id']}: reached by {each['n_reach']} of {each['n_total']} logs, {percent_with_interval(each)}"
            + lost_words(each)
            + (how if each["n_reach"] else "")
        )
        of_line = [row for row in facts["attribution"] if row["line_id"] == each["line_id"]]
        hits = [row for row in of_line if row["n_reach"]]
        if len(of_line) > 1:
            shown += [f"  from release {row['release_id']}: {percent_with_interval(row)}" for row in hits]
    return tuple(shown)


TOOL = Tool(
    "reach-lines",
    "Evaluate",
    "Compute the probability of reaching roads, railways or houses, and arrivals",
    Ask,
    run,
    then="deadwood-tool design-values --run {run} --output design_values.csv",
)
