"""The effects of candidates and chosen barriers, as a table, as a layer, and in a few lines for the reader."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import geopandas
import numpy as np
import shapely

from deadwood_algorithms.evaluate.protection.candidate_barriers import contour_angle
from deadwood_algorithms.evaluate.protection.siting import Coming, LogOutcomes, Siting, Step, Trial
from deadwood_algorithms.params import presets
from deadwood_algorithms.params.counts import counted, significant
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.results.lost import reach_phrases, reach_records, share_if_lost, warn_of_lost
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.stats.order_statistics import percentile_record
from deadwood_algorithms.stats.statistics import lost_words, percent_with_interval, points_with_interval


def with_classes(frame: Any, name: str | None) -> Any:
    """A table of barriers with the class that holds the energy of 95 % of the logs that come to each, and the class for
    the interval's upper end.
    """
    if name is None:
        return frame
    energies = zip(*(frame[f"energy_needed_{each}_kj"].astype(float) for each in ("p95", "ci_high")), strict=True)
    records = [presets.BARRIERS[name].record(*each) for each in energies]
    return frame.assign(**{column: [each[column] for each in records] for column in NO_CLASS})


def rows_of(siting: Siting, now: LogOutcomes, alone: Sequence[Trial], steps: Sequence[Step]) -> list[dict[str, Any]]:
    """One row for each single candidate, sorted by the remaining reach, and one per chosen set."""
    rows = []
    for trial in alone:
        outcomes = now.with_rows(trial.rows, trial.outcomes)
        rows.append({"step": 0, **row_of(siting, (trial.number,), trial, now, outcomes)})
    for row in rows:
        row["pareto"] = "yes" if not any(beats(other, row) for other in rows) else "no"
    rows.sort(key=lambda row: row["n_reach"])
    before = now
    for number, step in enumerate(steps, 1):
        rows.append({"step": number, **row_of(siting, step.chosen, step.trial, before, step.outcomes), "pareto": ""})
        before = step.outcomes
    return rows


def beats(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Whether a candidate is as good in length, height and remaining reach, and better in one of them."""
    pairs = [(round(one[name], 6), round(other[name], 6)) for name in ("length_m", "height_m", "n_reach")]
    return all(a <= b for a, b in pairs) and any(a < b for a, b in pairs)


def row_of(
    siting: Siting, chosen: Sequence[int], trial: Trial, before: LogOutcomes, outcomes: LogOutcomes
) -> dict[str, Any]:
    """The last of the chosen barriers; ``before``: the outcomes without it."""
    each = siting.candidates[trial.number]
    return {
        "barriers": " + ".join(siting.candidates[k].id for k in chosen),
        "barrier_id": each.id,
        "length_m": each.length,
        "height_m": each.height,
        "above_m": each.above,
        "place": each.place,
        "angle_deg": contour_angle(each.shape, siting.plain.scene.terrain_height),
        "n_flux": int(before.flux[:, siting.place[trial.number]].sum()),
        "n_near": int(trial.rows.size),
        **share_if_lost(outcomes.any_line, outcomes.left),
        **trial.gain_record(len(before.reach)),
        **what_it_does(outcomes, trial.number, siting.coming(before, chosen[:-1], trial.number)),
    }


def what_it_does(outcomes: LogOutcomes, number: int, coming: Coming) -> dict[str, Any]:
    """Logs that a barrier holds, that jump over it and that pass beside it; 95 % percentiles of energy and height of
    all that come to its place, which needs them, and of those that hit it.
    """
    held = outcomes.held[:, number]
    over = outcomes.crossed[:, number] & ~held
    beside = outcomes.met[:, number] & ~held & ~over
    record: dict[str, Any] = {
        "n_stopped": int(held.sum()),
        "n_overjumped": int(over.sum()),
        "n_passed_beside": int(beside.sum()),
        "n_come": coming.energy.size,
    }
    needed, more = percentiles("needed", coming.energy, coming.height)
    hit = np.isfinite(outcomes.energy[:, number])
    of_hits, _ = percentiles("hit", outcomes.energy[hit, number], outcomes.height[hit, number])
    return record | needed | {"n_more": more, "n_hit": int(hit.sum())} | of_hits


def percentiles(kind: str, energy: Any, height: Any) -> tuple[dict[str, float], int]:
    """95 % percentiles of energy and height with their intervals, and how many logs are missing for upper ends."""
    record, more = {}, 0
    for name, unit, values in ((*each, values) for each, values in zip(QUANTITIES, (energy, height), strict=True)):
        found = percentile_record(values[np.isfinite(values)], 0.95)
        ends = {"p95": found["value"], "ci_low": found["ci_low"], "ci_high": found["ci_high"]}
        record |= {f"{name}_{kind}_{end}_{unit}": value for end, value in ends.items()}
        more = max(more, int(found["n_more"]))
    return record, more


def layer_of(siting: Siting, layers: SceneLayers, now: LogOutcomes, steps: Sequence[Step]) -> geopandas.GeoDataFrame:
    """The run's own barriers, then the chosen ones in the order of the candidates, with the effect of each when all
    stand.
    """
    rows: list[dict[str, Any]] = []
    shapes: list[Any] = []
    own, starts = layers.engine_barriers, layers.engine_barriers.starts
    for k, item in enumerate(layers.barriers.item.tolist()):
        rows.append({"barrier_id": str(layers.barriers.ids[item]), "height_m": float(own.height[k]), "step": 0})
        shapes.append(shapely.LineString(own.vertices[starts[k] : starts[k + 1]]))
    final = steps[-1].outcomes if steps else now
    number = {step.trial.number: k for k, step in enumerate(steps, 1)}
    for k in sorted(number):
        each, step = siting.candidates[k], steps[number[k] - 1]
        gain = step.trial.gain_record(len(now.reach))
        facts = {"length_m": each.length, "above_m": each.above}
        facts |= {"angle_deg": contour_angle(each.shape, siting.plain.scene.terrain_height)}
        facts |= {"n_flux": int(now.flux[:, siting.place[k]].sum())}
        does = what_it_does(final, k, siting.coming(final, [each for each in number if each != k], k))
        for part in shapely.get_parts(each.shape):
            record = {"barrier_id": each.id, "height_m": each.height, "step": number[k]}
            rows.append(record | facts | gain | does)
            shapes.append(part)
    columns = ["barrier_id", "height_m", "step", "length_m", "above_m", "angle_deg", "n_flux", *COUNTS]
    frame = geopandas.GeoDataFrame(rows, columns=columns, geometry=shapes, crs=layers.dem.plan_crs)
    return frame.astype({name: float for name in columns if name not in ("barrier_id", "step")})


QUANTITIES = (("energy", "kj"), ("height", "m"))
COUNTS = (
    "gain_logs",
    "gain_p",
    "gain_ci_low",
    "gain_ci_high",
    "n_stopped",
    "n_overjumped",
    "n_passed_beside",
    "n_come",
    *(f"{name}_needed_{end}_{unit}" for name, unit in QUANTITIES for end in ("p95", "ci_low", "ci_high")),
    "n_more",
    "n_hit",
    *(f"{name}_hit_{end}_{unit}" for name, unit in QUANTITIES for end in ("p95", "ci_low", "ci_high")),
)


NO_CLASS = {"barrier_class": "", "barrier_class_high": ""}


def by_line(siting: Siting, outcomes: LogOutcomes) -> list[dict[str, Any]]:
    return reach_records(map(str, siting.plain.lines.ids), outcomes.reach, outcomes.left)


def warn_of_reach(facts: dict[str, Any], now: LogOutcomes, feedback: Feedback) -> None:
    """Warn of lines whose reach, at present or with the chosen barriers, depends on logs that left the terrain
    model.
    """
    phrases = reach_phrases(facts["reach_by_line"])
    phrases += [f"with the barriers chosen, {each}" for each in reach_phrases(facts["reach_by_line_after"])]
    warn_of_lost(int(now.left.sum()), now.left.size, phrases, feedback)


def lines_of(facts: dict[str, Any], classes: str | None) -> tuple[str, ...]:
    """The present reach of the lines, the chosen barriers with the remaining reach, and why no more were chosen."""
    record = facts["reach"]
    shown = [
        f"{record['n_reach']} of {record['n_total']} logs reach a line, {percent_with_interval(record)}"
        f"{lost_words(record)}; {counted(facts['candidates'], 'candidate')}, {counted(facts['slid_again'], 'log')} "
        "slid again"
    ]
    for row in facts["chosen"]:
        points = points_with_interval(-row["gain_p"], -row["gain_ci_high"], -row["gain_ci_low"])  # of the reach
        shown.append(
            f"{row['step']}. {row['barrier_id']}: {counted(row['gain_logs'], 'fewer log', 'fewer logs')}, {points} "
            f"points; {row['n_reach']} still reach a line; it holds {row['n_stopped']}, {row['n_overjumped']} jump over"
        )
        if row["n_come"]:
            shown.append(
                f"   95 % of the {counted(int(row['n_come']), 'log')} that come there: "
                + (
                    f"needs {counted(int(row['n_more']), 'more arrival')}"
                    if row["n_more"]
                    else f"up to {significant(row['energy_needed_p95_kj'], 3)} kJ and "
                    f"{significant(row['height_needed_p95_m'], 2)} m above the terrain"
                )
                + f"; {row['n_hit']} hit it"
            )
            if classes and not row["n_more"]:
                shown.append(f"   without a factor: {presets.BARRIERS[classes].words(row)}")
    if facts["stopped_because"]:
        shown.append(f"no more: {facts['stopped_because']}")
    if classes:
        shown.append(presets.BARRIERS[classes].said)
    return tuple(shown)
