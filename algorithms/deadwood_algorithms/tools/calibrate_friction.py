"""Find the friction coefficients that reproduce an observed event: where logs came to rest, or what they reached.

The same released logs slide with one coefficient after the other. Each coefficient is scored by the likelihood of the
observation. The range of those that reproduce it contains the true one in 95 % of events, if everything else is right.
The observation is one of

- --observed: deposits, as points (with --error-m, the error of the place and of what the model cannot represent) or as
  areas in which logs came to rest (the width of a road). A field release_id gives the release of each. They
  count as a sample of an unknown number of logs: each is compared with the simulated logs that came to rest on the
  terrain model, and the number that leave it has no influence. If all logs of the event were found, set
  --search-complete; coefficients with which logs leave are then less likely, because none did in the event;
- --reached and --not-reached: lines or areas that --event-logs of the event's logs reached, or did not reach. Both
  together define a stop line: with too little friction logs go beyond, with too much they do not get there.

The folder holds `calibration.csv` (one row for each coefficient), `calibration.json`, `calibration.png`, and
`calibration.gpkg` with the simulated deposits of every coefficient (`no_deposit`: the last positions of logs that have
none) and the observed ones.

    deadwood-tool sample-releases --areas 'sample_data/sample.gpkg|layername=release_area' --dem sample_data/dem.tif \\
        --count 200 --output releases.gpkg
    deadwood-tool calibrate-friction --dem sample_data/dem.tif --releases releases.gpkg --trees sample_data/trees.csv \\
        --reached 'sample_data/sample.gpkg|layername=lines' --event-logs 4 --event-reached 1 \\
        --friction 0.15:0.45:0.1 --output calibration

The paper found 0.2 to 0.3 on cells of 0.5 m. A coefficient is valid for the cell size on which it was found: a coarser
terrain model lacks roughness, for which friction compensates. It also compensates for any other error: the releases,
the trees, the shape of the logs. Few observed logs give wide ranges.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.commands import following
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Cancelled, Feedback, Outcome, Tool, UserError
from deadwood_algorithms.params.where import SlidingOptions
from deadwood_algorithms.scene.laws import refuse_idle_capacity
from deadwood_algorithms.scene.released_scene import ReleasedScene
from deadwood_algorithms.tools import vary

TABLE, FACTS, PICTURE, LAYERS = (f"calibration.{kind}" for kind in ("csv", "json", "png", "gpkg"))
MANIFEST = "manifest.json"


@dataclass(frozen=True, kw_only=True)
class Ask(SlidingOptions, ReleasedScene):
    friction: tuple[float, ...] = tool.numbers(  # pyright: ignore[reportIncompatibleVariableOverride]
        "Friction coefficients to try",
        *(round(0.1 + 0.05 * k, 2) for k in range(9)),
        minimum=0.0,
        least_count=2,
        help="Separated by commas, or from:to:step, such as 0.1:0.5:0.05.",
    )
    observed: str | None = tool.vector(
        "Observed deposits: points, or areas in which logs came to rest",
        "point",
        "polygon",
        default=None,
        help="The centres of the logs; a field release_id gives the release of each.",
    )
    error_m: float = tool.number(
        "Error of the observed points and of what the model cannot represent",
        unit="m",
        default=10.0,
        minimum=0.0,
        exclusive=True,
        help="Standard deviation in each direction.",
    )
    search_complete: bool = tool.flag(
        "All logs of the event were found",
        help="With --observed: none came to rest elsewhere. Otherwise logs that leave the terrain model have no "
        "influence on the score.",
    )
    reached: str | None = tool.vector("Line or area that the event reached", "line", "polygon", default=None)
    not_reached: str | None = tool.vector("Line or area that it did not reach", "line", "polygon", default=None)
    event_logs: int = tool.integer(
        "Logs of the event, of which lines or areas were reached or not", default=1, minimum=1, maximum=1000
    )
    event_reached: int | None = tool.integer(
        "Number of these that reached it", default=None, minimum=0, maximum=1000, help="Default: all."
    )
    logs: int = tool.integer(
        "Logs to slide with each coefficient",
        default=1000,
        minimum=2,
        help="A random subset by seed and log_id; all if the layer has fewer.",
    )
    fidelity: str = tool.choice("Speed against accuracy", "draft", "standard", "fine", "reference", default="standard")
    output: str = tool.output_folder("Folder of the calibration")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.results.plan import logs_of_layer, result_or_plan

    refuse_idle_capacity(ask.break_trees, ask.tree_capacity_kj)
    refuse_unclear(ask)
    return result_or_plan(
        calibrate, ask, feedback, times=len(ask.friction), logs_there=lambda: logs_of_layer(ask.releases)
    )


def calibrate(ask: Ask, feedback: Feedback) -> Outcome:
    import pandas

    from deadwood_algorithms.ensemble.variants import open_ensemble
    from deadwood_algorithms.evaluate.calibration import answer, friction_runs, score
    from deadwood_algorithms.evaluate.calibration.friction_figure import draw
    from deadwood_algorithms.files.tables import write_csv
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.results.identity import result_folder
    from deadwood_algorithms.results.run_folder import write_json
    from deadwood_algorithms.results.scenario import scenario_line, scenario_of
    from deadwood_algorithms.simulate.chunks import identity_of
    from deadwood_algorithms.simulate.steps import Steps
    from deadwood_engine import FIDELITIES

    sweep, did = sorted(ask.friction), refuse_unclear(ask)
    least = replace(ask.inputs(), friction=sweep[0])  # with it logs go farthest and need the largest window
    where = ask.where(f"{TOOL.name}-{Path(ask.output).name}")
    with (
        result_folder(TOOL, ask, feedback) as folder,
        open_ensemble(least, FIDELITIES[ask.fidelity], where, ask.logs, ask.seed, feedback) as ensemble,
    ):
        layers, logs = ensemble.layers, ensemble.logs
        watched = friction_runs.Watched.of(ask.reached, ask.not_reached, layers, feedback)
        answer.warn_of_cells(layers.dem.cell, feedback)
        observed = friction_runs.read_observed(ask.observed, layers, logs, feedback) if ask.observed else None
        decided_by = {
            "--friction": sweep,
            "--logs or --seed": [ask.logs, ask.seed],
            "--reached or --not-reached": watched.digest,
        }
        identity = identity_of(ensemble.simulation, layers, ensemble.released, **decided_by)
        steps = Steps(ask.output, identity, resume=ask.resume, feedback=feedback)
        variants = friction_runs.variants_of(sweep, ensemble.simulation, watched)
        found = ensemble.slide(variants, friction_runs.WANTED, steps)
        slid = [friction_runs.run_of(mu, parts) for mu, parts in zip(sweep, found, strict=True)]
        complete = ask.search_complete
        if observed:
            outcomes = friction_runs.outcomes_of_deposits(observed, slid, ask.error_m, search_complete=complete)
        else:
            outcomes = friction_runs.outcomes_of_reach(watched, slid, ask.event_logs, did)
        lost = None if observed else [friction_runs.lost_for(watched, each) for each in slid]
        answer.warn_of_logs(slid, outcomes, lost, search_complete=complete, feedback=feedback)

        def report(share: float) -> None:
            feedback.progress(share, 1.0, "scoring")
            if feedback.cancelled():
                raise Cancelled

        scores = score.score(outcomes, logs.logs.log_id, ask.error_m, ask.seed, report)
        span = score.range_of(np.array(sweep), scores)
        best = int(np.argmax(scores.log_likelihood))
        fits = span is not None and bool((scores.p_fit[scores.within] >= score.LEVEL).any())
        rows = answer.records_of(slid, scores, outcomes, watched, lost)
        feedback.progress(1, 1, "scoring")
        write_csv(folder / TABLE, pandas.DataFrame(rows))
        write_vector(folder / LAYERS, friction_runs.layers_of(slid, logs, observed, layers.dem.plan_crs))
        seen = {"logs": ask.event_logs, "did": did}
        event = {"deposits": len(outcomes), "search_complete": complete} if observed else seen
        facts = answer.facts_of(span, sweep[best], fits, len(logs), event) | {"cell_m": layers.dem.cell}
        write_json(folder / FACTS, {**facts, "rows": rows})
        sentence = answer.sentence_of(span, fits, sweep[best])
        tried = {"median": sweep[best], "low": min(sweep), "high": max(sweep)}
        scenario = scenario_of(ask, ask.fidelity, ensemble.layers, logs) | {"friction": tried}
        share_seen = None if observed else did / ask.event_logs
        draw(folder / PICTURE, rows, span, sentence, slid[best], ensemble.layers, logs, observed, watched, share_seen)
    steps.remove()
    parts = {"table": TABLE, "facts": FACTS, "picture": PICTURE, "layers": LAYERS, "manifest": MANIFEST}
    shown = (*answer.lines_of(rows, sentence, len(logs)), scenario_line(scenario))
    lines = ask.lines or ask.reached or ask.not_reached
    then = following(vary.TOOL, ask, **answer.varied(span, sweep[best]), lines=lines, output="varied") if span else ""
    return Outcome.of_folder(ask.output, parts, facts, shown, then)


def refuse_unclear(ask: Ask) -> int:
    """How many of the event's logs did what was observed; rejects an event of two kinds, or of none."""
    reach = ask.reached or ask.not_reached
    if not reach and not ask.observed:
        raise UserError("--observed is missing: give the event's deposits, or --reached and --not-reached")
    if reach and ask.observed:
        raise UserError("--observed and --reached describe the same event twice; give one of them")
    if reach and ask.search_complete:
        raise UserError("--search-complete is about observed deposits; leave it out, or give --observed")
    did = ask.event_logs if ask.event_reached is None else ask.event_reached
    if did > ask.event_logs:
        raise UserError(f"--event-reached is {did}, but the event has {counted(ask.event_logs, 'log')} (--event-logs)")
    return did


TOOL = Tool(
    "calibrate-friction",
    "Evaluate",
    "Find the friction that reproduces an observed event",
    Ask,
    run,
)
