"""Find the friction coefficients that reproduce an observed event: where logs came to rest, or what they reached.

The released logs, the same for all, are slid with one coefficient after the other. Each is scored by the likelihood of
what was observed, and the range of those that reproduce it holds the true one in 95 % of events, if all else is right
(the scores are defined in `calibration/score.py`). Observed is one of

- --observed: deposits, as points (with --error-m, the error of the place and of what the model cannot know) or as
  areas in which logs came to rest (the width of a road). A field release_id says which release each came from;
- --reached and --not-reached: lines or areas that --event-logs of the event's logs reached, or did not. Both together
  are a stop line: with too little friction logs go beyond, with too much they do not come so far.

The folder holds `calibration.csv` (a row a coefficient), `calibration.json`, `calibration.png`, and
`calibration.gpkg` with the simulated deposits of every coefficient (`no_deposit`: the last places of logs that have
none) and the observed ones.

    deadwood-tool sample-releases --areas 'sample_data/sample.gpkg|layername=release_area' --dem sample_data/dem.tif \\
        --count 200 --output releases.gpkg
    deadwood-tool calibrate-friction --dem sample_data/dem.tif --releases releases.gpkg --trees sample_data/trees.csv \\
        --reached 'sample_data/sample.gpkg|layername=lines' --event-logs 4 --event-reached 1 \\
        --friction 0.15:0.45:0.1 --output calibration

The paper found 0.2 to 0.3 on 0.5 m cells. A coefficient holds for the cells that it was found on: a coarser terrain
model has lost roughness, which friction must make up for. It also makes up for whatever else is wrong here: the
releases, the trees, the shape of the logs. Few observed logs leave wide ranges.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.presets import FRICTION_CELL_M
from deadwood_algorithms.params.tool import Cancelled, Feedback, Outcome, Tool, UserError
from deadwood_algorithms.scene.released_scene import ReleasedScene
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.stats.statistics import percent, percent_of, reach_record

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from deadwood_algorithms.evaluate.calibration.friction_runs import FrictionRun, Watched
    from deadwood_algorithms.evaluate.calibration.score import Range, Scores

TABLE, FACTS, PICTURE, LAYERS, MANIFEST = (
    "calibration.csv", "calibration.json", "calibration.png", "calibration.gpkg", "manifest.json",
)  # fmt: skip
MOST = 100  # coefficients
FEW_LOGS = 100
WORTH_A_WARNING = 0.05  # share of the logs without a deposit


@dataclass(frozen=True, kw_only=True)
class Ask(ReleasedScene):
    friction: str = tool.text(
        "Friction coefficients to try", default="0.1:0.5:0.05", help="from:to:step, or single ones with commas."
    )
    observed: str | None = tool.vector(
        "Observed deposits: points, or areas in which logs came to rest",
        "point",
        "polygon",
        default=None,
        help="The middles of the logs; a field release_id says from which release each came.",
    )
    error_m: float = tool.number(
        "Error of observed points, and of what the model cannot know",
        unit="m",
        default=10.0,
        minimum=0.0,
        exclusive=True,
        help="Standard deviation in each direction.",
    )
    reached: str | None = tool.vector("Line or area that the event reached", "line", "polygon", default=None)
    not_reached: str | None = tool.vector("Line or area that it did not reach", "line", "polygon", default=None)
    event_logs: int = tool.integer("Logs of the event, for the two above", default=1, minimum=1, maximum=1000)
    event_reached: int | None = tool.integer(
        "Of these, the logs that did so", default=None, minimum=0, maximum=1000, help="Default: all."
    )
    logs: int = tool.integer(
        "Logs to slide with each coefficient",
        default=1000,
        minimum=2,
        help="An even draw by seed and log_id; all if the layer has fewer.",
    )
    fidelity: str = tool.choice("Speed against accuracy", "draft", "standard", "fine", "reference", default="standard")
    output: str = tool.output_folder("Folder of the calibration")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    import pandas

    from deadwood_algorithms.evaluate.calibration import friction_runs
    from deadwood_algorithms.evaluate.calibration import score as friction_score
    from deadwood_algorithms.evaluate.calibration.friction_figure import draw
    from deadwood_algorithms.files.outputs import output_folder
    from deadwood_algorithms.files.tables import write_csv
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.results.run_folder import write_json
    from deadwood_algorithms.simulate.sliding import workers_for
    from deadwood_algorithms.simulate.warm_up import load_kernels
    from deadwood_algorithms.simulate.windows import read_released_scene
    from deadwood_engine import FIDELITIES

    sweep = coefficients(ask.friction)
    did = refuse_unclear(ask)
    with output_folder(ask.output, ask.overwrite) as folder:
        least = replace(ask, friction=float(sweep[0]))  # with it logs go farthest: the window that they need
        layers, releases = read_released_scene(least, feedback, windowed=True)
        watched = friction_runs.Watched.of(ask.reached, ask.not_reached, layers, feedback)
        logs = releases.take(hash_order(releases.logs.log_id, ask.seed)[: ask.logs])
        warn_of_cells(layers.dem.cell, feedback)
        observed = friction_runs.read_observed(ask.observed, layers, logs, feedback) if ask.observed else None

        fidelity = FIDELITIES[ask.fidelity]
        load_kernels(layers.shape, feedback)
        slid = []
        with workers_for(ask, feedback):
            for mu in sweep:
                one, layers = friction_runs.slide_with(mu, least, fidelity, watched, layers, logs, feedback)
                slid.append(one)
        if observed:
            outcomes = friction_runs.outcomes_of_deposits(observed, slid, ask.error_m)
        else:
            outcomes = friction_runs.outcomes_of_reach(watched, slid, ask.event_logs, did)
        lost = None if observed else [friction_runs.lost_for(watched, each) for each in slid]
        warn_of_logs(slid, min(each.logs.size for each in outcomes), lost, feedback)

        def report(share: float) -> None:
            feedback.progress(share, 1.0, "scoring")
            if feedback.cancelled():
                raise Cancelled

        scores = friction_score.score(outcomes, logs.logs.log_id, ask.error_m, ask.seed, report)
        found = friction_score.range_of(np.array(sweep), scores)
        best = int(np.argmax(scores.log_likelihood))
        fits = found is not None and bool((scores.p_fit[scores.within] >= friction_score.LEVEL).any())
        rows = records_of(slid, scores, outcomes, watched, lost)
        feedback.progress(1, 1, "scoring")

        write_csv(folder / TABLE, pandas.DataFrame(rows))
        write_vector(folder / LAYERS, friction_runs.layers_of(slid, logs, observed, layers.dem.plan_crs))
        facts: dict[str, Any] = {
            "range": asdict(found) if found else None,
            "best": sweep[best],
            "fits": fits,
            "logs": len(logs),
            "event": {"deposits": len(outcomes)} if observed else {"logs": ask.event_logs, "did": did},
            "cell_m": layers.dem.cell,
        }
        write_json(folder / FACTS, {**facts, "rows": rows})
        sentence = sentence_of(found, fits, sweep[best])
        share_seen = None if observed else did / ask.event_logs
        draw(folder / PICTURE, rows, found, sentence, slid[best], layers, logs, observed, watched, share_seen)
        write_json(folder / MANIFEST, tool.manifest(TOOL, ask))
    final = Path(ask.output)
    parts = {"table": TABLE, "facts": FACTS, "picture": PICTURE, "layers": LAYERS, "manifest": MANIFEST}
    outputs = {"output": final} | {key: final / name for key, name in parts.items()}
    return Outcome(outputs, facts, lines_of(rows, sentence, len(logs)))


def coefficients(text: str) -> list[float]:
    """The coefficients of a sweep, ascending."""
    wrong = UserError(
        f"--friction is '{text}', but must be from:to:step, such as 0.1:0.5:0.05, or at least two numbers with commas"
    )
    try:
        if ":" in text:
            low, high, step = (float(part) for part in text.split(":"))
            if not (0.0 <= low < high and step > 0.0) or (high - low) / step > MOST - 1:
                raise wrong
            values = [round(low + k * step, 10) for k in range(math.floor((high - low) / step + 1e-9) + 1)]
        else:
            values = sorted(float(part) for part in text.split(",") if part.strip())
    except ValueError:
        raise wrong from None
    fits = all(math.isfinite(each) and each >= 0.0 for each in values)
    if not fits or not 2 <= len(set(values)) == len(values) <= MOST:
        raise wrong
    return values


def refuse_unclear(ask: Ask) -> int:
    """How many of the event's logs did what was seen; refuses an event of two kinds, or of none."""
    reach = ask.reached or ask.not_reached
    if not reach and not ask.observed:
        raise UserError("--observed is missing: give the event's deposits, or --reached and --not-reached")
    if reach and ask.observed:
        raise UserError("--observed and --reached tell the same event twice; give one of them")
    did = ask.event_logs if ask.event_reached is None else ask.event_reached
    if did > ask.event_logs:
        raise UserError(f"--event-reached is {did}, but the event has {ask.event_logs} logs (--event-logs)")
    return did


def warn_of_cells(cell: float, feedback: Feedback) -> None:
    if not math.isclose(cell, FRICTION_CELL_M, rel_tol=0.02):
        roughness = (
            "has lost roughness, which friction makes up for" if cell > FRICTION_CELL_M else "shows more roughness"
        )
        feedback.warn(
            f"the terrain model's cells are {cell:g} m, not {FRICTION_CELL_M:g} m: the coefficient found holds for "
            f"this terrain model alone, and is not the paper's 0.2 to 0.3; one with {cell:g} m cells {roughness}"
        )


def warn_of_logs(
    slid: list[FrictionRun], fewest: int, lost: list[NDArray[np.bool_]] | None, feedback: Feedback
) -> None:
    """``lost``, of an event that was seen at lines: logs that left before it was known whether they did the same."""
    if fewest < FEW_LOGS:
        feedback.warn(f"an observed deposit is compared with {fewest} logs only; release some hundreds at least")
    for k, each in enumerate(slid):
        if lost is not None:
            gone = int(lost[k].sum())
            if gone > WORTH_A_WARNING * each.x.size:
                feedback.warn(
                    f"at friction {each.friction:g} {gone} of {each.x.size} logs left the terrain model before it "
                    "was seen whether they reach the lines; they count as far as they were seen; take a larger one"
                )
            continue
        without = int((~each.resting).sum())
        if without > WORTH_A_WARNING * each.x.size:
            feedback.warn(
                f"at friction {each.friction:g} {without} of {each.x.size} logs left the terrain model, failed, or "
                "still moved at the time limit: they are no deposits, which speaks against this coefficient as far as "
                "all logs of the event were found on the terrain model; if not, take a larger one"
            )


def records_of(
    slid: list[FrictionRun], scores: Scores, outcomes: list[Any], watched: Watched, lost: list[NDArray[np.bool_]] | None
) -> list[dict[str, Any]]:
    """One record a coefficient."""
    from deadwood_algorithms.evaluate.calibration.score import energy_score

    points = [each for each in outcomes if each.place]
    distance = np.mean([energy_score(each, each.place) for each in points], axis=0) if points else None
    yes_no = list({id(each.done): each for each in outcomes if each.done is not None}.values())  # one an area, or one
    rows = []
    for k, each in enumerate(slid):
        resting = each.runout[each.resting]
        low, middle, high = np.quantile(resting, [0.05, 0.5, 0.95]) if resting.size else [math.nan] * 3
        row: dict[str, Any] = {
            "friction": each.friction,
            "in_range": bool(scores.within[k]),
            "p_range": scores.p_range[k],
            "p_fit": scores.p_fit[k],
            "log_likelihood": scores.log_likelihood[k],
            "relative_likelihood": scores.relative[k],
            "relative_low": float(np.exp(scores.low[k])),
            "relative_high": float(np.exp(scores.high[k])),
            "energy_score_m": math.nan if distance is None else distance[k],
            "runout_p05_m": low,
            "runout_median_m": middle,
            "runout_p95_m": high,
            "speed_max_ms": float(each.speed_max.max()),
            "without_deposit": int((~each.resting).sum()),
        }
        if yes_no:
            record = reach_record(sum(int(one.done[k].sum()) for one in yes_no), sum(one.logs.size for one in yes_no))
            row |= {"share": record["p"], "share_low": record["ci_low"], "share_high": record["ci_high"]}
        if lost is not None:
            done, n = outcomes[0].done[k], each.x.size
            row |= {"n_lost": int(lost[k].sum())}
            row |= {"share_low_if_lost": int((done & ~lost[k]).sum()) / n}
            row |= {"share_high_if_lost": int((done | lost[k]).sum()) / n}
        for column in watched.own:
            row[f"reach_{watched.items.ids[column]}"] = float(each.reach[:, column].mean())
        rows.append(row)
    return rows


def sentence_of(found: Range | None, fits: bool, best: float) -> str:
    if found is None:
        return "No coefficient of the sweep can have made this event: widen the sweep, and check releases and layers."
    text = f"Friction {found.words()} reproduces the event (95 %); likeliest: {found.best:g}."
    if found.open_low and found.open_high:
        text = f"The event tells no coefficient of the sweep from another ({found.words()}); likeliest: {found.best:g}."
    if found.gaps:
        text += " Some coefficients between do not."
    if not fits:
        text += " But even the best makes such an event less often than once in 20: sweep finer, or check the layers."
    return text


def lines_of(rows: list[dict[str, Any]], sentence: str, n_logs: int) -> tuple[str, ...]:
    """A table with a line a coefficient, and what it comes to."""
    with_share, with_score = "share" in rows[0], any(math.isfinite(row["energy_score_m"]) for row in rows)
    with_lost, with_bounds = any(row["without_deposit"] for row in rows), any(row.get("n_lost") for row in rows)
    head = ["friction", "relative likelihood", "p", "run-out (5-95 %)"]
    head += ["no deposit"] * with_lost + ["energy score"] * with_score + ["logs that do as observed"] * with_share
    head += ["if lost ones do"] * with_bounds + ["in range"]
    table = [head]
    for row in rows:
        spread = f"{row['relative_low']:.2g} to {row['relative_high']:.2g}"
        cells = [f"{row['friction']:g}", f"{row['relative_likelihood']:.2g} ({spread})", f"{row['p_range']:.2f}"]
        cells.append(f"{row['runout_median_m']:.0f} m ({row['runout_p05_m']:.0f} to {row['runout_p95_m']:.0f})")
        cells += [percent_of(row["without_deposit"], n_logs)] * with_lost
        cells += [f"{row['energy_score_m']:.1f} m"] * with_score
        if with_share:
            cells.append(f"{percent(row['share'], row['share_low'], row['share_high'])} %")
        if with_bounds:
            ends = (row[f"share_{end}_if_lost"] for end in ("low", "high"))
            cells.append(f"{' to '.join(percent(each, row['share_low'], row['share_high']) for each in ends)} %")
        table.append([*cells, "yes" if row["in_range"] else "no"])
    widths = [max(len(row[k]) for row in table) for k in range(len(head))]
    shown = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in table]
    return (f"{n_logs} logs with each coefficient:", *shown, sentence)


TOOL = Tool("calibrate-friction", "Evaluate", "An observed event: the friction that reproduces it", Ask, run)
