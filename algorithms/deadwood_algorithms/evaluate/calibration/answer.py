"""The results of a calibration: a record per coefficient, the sentence, the table for a reader, and warnings."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.calibration.friction_runs import FrictionRun, Watched
from deadwood_algorithms.evaluate.calibration.score import Observation, Range, Scores, energy_score
from deadwood_algorithms.params.counts import counted, significant
from deadwood_algorithms.params.presets import FRICTION_CELL_M
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.results import lost as lost_logs
from deadwood_algorithms.stats.endings import known_runouts
from deadwood_algorithms.stats.order_statistics import quantiles
from deadwood_algorithms.stats.statistics import percent, percent_of, reach_record

FEW_LOGS = 100
LEAST_LIKELY = 1e-3  # smallest relative likelihood that is printed as a number
SHOWN = 6  # coefficients that are named in the warning


def facts_of(span: Range | None, best: float, fits: bool, logs: int, event: dict[str, Any]) -> dict[str, Any]:
    """``calibration.json`` without its rows."""
    return {"range": asdict(span) if span else None, "best": best, "fits": fits, "logs": logs, "event": event}


def warn_of_cells(cell: float, feedback: Feedback) -> None:
    if not math.isclose(cell, FRICTION_CELL_M, rel_tol=0.02):
        roughness = (
            "lacks roughness, for which friction compensates" if cell > FRICTION_CELL_M else "shows more roughness"
        )
        feedback.warn(
            f"the terrain model's cells are {cell:g} m, not {FRICTION_CELL_M:g} m: the coefficient found holds for "
            f"this terrain model alone, and is not the paper's 0.2 to 0.3; one with {cell:g} m cells {roughness}",
            code="coarse-cells",
            cell_m=cell,
        )


def warn_of_logs(
    slid: list[FrictionRun],
    outcomes: list[Observation],
    lost: list[NDArray[np.bool_]] | None,
    *,
    search_complete: bool,
    feedback: Feedback,
) -> None:
    """Warn of logs whose behaviour is unknown; ``lost`` left the terrain model before they could match an event seen at
    lines.
    """
    fewest = min(each.logs.size for each in outcomes)
    if fewest < FEW_LOGS:
        what = "an observed deposit" if lost is None else "the event"
        feedback.warn(
            f"{what} is compared with only {counted(fewest, 'log')}; release at least a few hundred",
            code="few-logs",
            logs=fewest,
        )
    n = slid[0].x.size
    gone = [int(each.sum()) for each in lost] if lost is not None else [int((~each.resting).sum()) for each in slid]
    many = [k for k, each in enumerate(gone) if lost_logs.many(each, n)]
    if not many:
        return
    who = ", ".join(f"{gone[k]} at friction {slid[k].friction:g}" for k in many[:SHOWN])
    if len(many) > SHOWN:
        who += f", and more than {100 * lost_logs.WORTH_A_WARNING:.0f} % at {counted(len(many) - SHOWN, 'other')}"
    if lost is not None:
        feedback.warn(
            f"of {n} logs, {who} left the terrain model before it was known whether they reach the lines: they count "
            "up to where they left; use a larger one",
            code="left-dem",
            logs=n,
        )
    elif search_complete:
        feedback.warn(
            f"of {n} logs, {who} left the terrain model, failed, or still moved at the time limit: they left no "
            f"deposits, which reduces the likelihood of these coefficients, because all logs of the event were found "
            "(--search-complete)",
            code="logs-without-deposit",
            logs=n,
        )
    else:
        feedback.warn(
            f"of {n} logs, {who} left the terrain model, failed, or still moved at the time limit: observed deposits "
            "are compared with those that came to rest on the terrain model, because only such could be found in the "
            "event. If all logs of the event were found, use --search-complete; if not, a larger terrain model helps",
            code="logs-without-deposit",
            logs=n,
        )
        few = min(int(each.counts[k]) for each in outcomes for k in many)
        if few < FEW_LOGS <= fewest:
            feedback.warn(
                f"only {counted(few, 'log is', 'logs are')} compared with an observed deposit; release more",
                code="few-logs",
                logs=few,
            )


def runout_quantiles(slid: FrictionRun) -> list[float]:
    """The 5, 50 and 95 % quantiles of the run-outs of all logs [m]; NaN among logs without a deposit."""
    return quantiles(known_runouts(slid.runout, slid.stop_reason), [0.05, 0.5, 0.95]).tolist()


def records_of(
    slid: list[FrictionRun],
    scores: Scores,
    outcomes: list[Observation],
    watched: Watched,
    lost: list[NDArray[np.bool_]] | None,
) -> list[dict[str, Any]]:
    """One record for each coefficient."""
    distances = [energy_score(each, each.place) for each in outcomes if each.place]
    distance = np.mean(distances, axis=0) if distances else None
    areas = {
        id(each.done): (each.done, each.counts) for each in outcomes if each.done is not None
    }  # one an area, or one
    rows = []
    for k, each in enumerate(slid):
        low, middle, high = runout_quantiles(each)
        row: dict[str, Any] = {
            "friction": each.friction,
            "in_range": bool(scores.within[k]),
            "p_range": scores.p_range[k],
            "p_fit": scores.p_fit[k],
            "log_likelihood": scores.log_likelihood[k],
            "relative_likelihood": scores.relative[k],
            "relative_ci_low": float(np.exp(scores.low[k])),
            "relative_ci_high": float(np.exp(scores.high[k])),
            "energy_score_m": math.nan if distance is None else distance[k],
            "runout_p05_m": low,
            "runout_median_m": middle,
            "runout_p95_m": high,
            "speed_max_ms": float(each.speed_max.max()),
            "without_deposit": int((~each.resting).sum()),
        }
        if areas:
            hits = sum(int(done[k].sum()) for done, _ in areas.values())
            record = reach_record(hits, sum(int(counts[k]) for _, counts in areas.values()))
            row |= {"share": record["p"], "share_ci_low": record["ci_low"], "share_ci_high": record["ci_high"]}
        if lost is not None:
            done, n = next(iter(areas.values()))[0][k], each.x.size
            row |= {"n_lost": int(lost[k].sum())}
            row |= {"share_low_if_lost": int((done & ~lost[k]).sum()) / n}
            row |= {"share_high_if_lost": int((done | lost[k]).sum()) / n}
        for column in watched.own:
            row[f"reach_{watched.items.ids[column]}"] = float(each.reach[:, column].mean())
        rows.append(row)
    return rows


def sentence_of(found: Range | None, fits: bool, best: float) -> str:
    if found is None:
        return "No coefficient of the sweep reproduces this event: widen the sweep, and check releases and layers."
    text = f"Friction {found.words()} reproduces the event (95 %); most likely: {found.best:g}."
    if found.open_low and found.open_high:
        text = (
            f"The event does not distinguish the coefficients of the sweep, {found.words()}; most likely: "
            f"{found.best:g}."
        )
    if found.one:
        text += (
            " It is the only coefficient of the sweep that does, and the ends of the range are interpolated: use a "
            "finer sweep around it."
        )
    if found.gaps:
        text += " Some coefficients between do not."
    if not fits:
        text += (
            " But even the best reproduces such an event in fewer than 1 of 20 cases: use a finer sweep, or check the "
            "layers."
        )
    return text


def varied(found: Range, best: float) -> dict[str, Any]:
    """The values of ``vary`` for the range that was found; options that mean something else there are unset."""
    return {"friction": best, "vary": f"friction={':'.join(found.ends())}", "fidelity": None, "logs": None}


def small_or(likelihood: float) -> str:
    """A probability with two digits, or that it is below what can be distinguished from 0."""
    return "< 0.001" if likelihood < LEAST_LIKELY else significant(likelihood, 2)


def whole_or_dash(value: float) -> str:
    return f"{value:.0f}" if math.isfinite(value) else "-"


def lines_of(rows: list[dict[str, Any]], sentence: str, n_logs: int) -> tuple[str, ...]:
    """A table with a line for each coefficient, and the result."""
    with_share, with_score = "share" in rows[0], any(math.isfinite(row["energy_score_m"]) for row in rows)
    with_lost, with_bounds = any(row["without_deposit"] for row in rows), any(row.get("n_lost") for row in rows)
    head = ["friction", "relative likelihood", "p", "run-out (5-95 %)"]
    head += ["no deposit"] * with_lost + ["energy score"] * with_score + ["logs that behave as observed"] * with_share
    head += ["if lost ones do"] * with_bounds + ["in range"]
    table = [head]
    for row in rows:
        likely, low, high = (small_or(row[f"relative_{name}"]) for name in ("likelihood", "ci_low", "ci_high"))
        cells = [f"{row['friction']:g}", f"{likely} ({low} to {high})", f"{row['p_range']:.2f}"]
        low, middle, high = (whole_or_dash(row[f"runout_{name}_m"]) for name in ("p05", "median", "p95"))
        cells.append(f"{middle} m ({low} to {high})")
        cells += [percent_of(row["without_deposit"], n_logs)] * with_lost
        cells += [f"{row['energy_score_m']:.1f} m"] * with_score
        if with_share:
            known = math.isfinite(row["share"])
            cells.append(
                f"{percent(row['share'], row['share_ci_low'], row['share_ci_high'])} %" if known else "unknown"
            )
        if with_bounds:
            ends = (row[f"share_{end}_if_lost"] for end in ("low", "high"))
            cells.append(f"{' to '.join(percent(each, row['share_ci_low'], row['share_ci_high']) for each in ends)} %")
        table.append([*cells, "yes" if row["in_range"] else "no"])
    widths = [max(len(row[k]) for row in table) for k in range(len(head))]
    shown = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in table]
    return (f"{counted(n_logs, 'log')} with each coefficient:", *shown, sentence)
