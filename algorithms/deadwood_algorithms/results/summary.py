"""The result of a run: the content of ``summary.json``, and its most important lines for the reader."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import geopandas
import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.accounts import account
from deadwood_algorithms.params.counts import counted, first_of, significant
from deadwood_algorithms.results.barrier_arrivals import barrier_ledger
from deadwood_algorithms.results.capacity import overload_lines, overload_record
from deadwood_algorithms.results.friction_band import band_lines, band_records
from deadwood_algorithms.results.hits import obstacle_record
from deadwood_algorithms.results.lost import lost_warning, many, reach_phrases, reach_records
from deadwood_algorithms.results.modelled import in_words, modelled
from deadwood_algorithms.results.own_slope import own_slope_record, own_slope_words
from deadwood_algorithms.results.run_settings import RunSettings
from deadwood_algorithms.results.scenario import counted_of, scenario_line, scenario_of
from deadwood_algorithms.scene.items import Items
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import Releases
from deadwood_algorithms.schemas.results import STOPS
from deadwood_algorithms.simulate.queue import Queue
from deadwood_algorithms.stats.directions import middle_words, spread_of_release
from deadwood_algorithms.stats.endings import LEFT, ended, left_dem
from deadwood_algorithms.stats.order_statistics import percentile_record
from deadwood_algorithms.stats.statistics import (
    loss_matters,
    lost_words,
    percent_with_interval,
    wilson_interval,
)
from deadwood_engine import STOP_REASONS, Fidelity, station_spacing, where_things_rebound

NEAR_EDGE_DEG = 5.0  # from the edge of a friction cone: equivalent to mu 0.21 or 0.39 instead of 0.30
FEW_NAMED = 10  # releases named in one line of text
SPREAD_MOVED_DEG = 1.0  # change of the spread due to logs that left the terrain model that causes a warning


def summary_of(
    settings: RunSettings,
    fidelity: Fidelity,
    layers: SceneLayers,
    releases: Releases,
    by_log: Mapping[str, NDArray],
    touched: NDArray[np.bool_],
    hits: dict[str, geopandas.GeoDataFrame],
    queue: Queue,
) -> dict[str, Any]:
    """The content of ``summary.json``; ``releases`` are the logs that were slid."""
    left = left_dem(by_log)
    reasons = np.bincount(by_log["stop_reason"], minlength=len(STOP_REASONS))
    scene = settings.scene
    stems = scene.tree_restitution if layers.tree_ids or layers.lying.ids else None
    fences = scene.barrier_restitution if len(layers.barriers.ids) else None
    restitutions = (scene.restitution, stems or 0.0, fences or 0.0)
    counted = counted_of(layers, releases, queue.rows.size)
    for name, count in counted.items():
        account(name, count)
    clauses = modelled(settings, layers, counted)
    own, finer = None, settings.own_slope
    if finer:
        own = own_slope_record(settings.fidelity, finer, releases.logs.log_id, touched, layers.lines.ids)
    cpu, wall, steps = (float(by_log[f"cost_{name}"].sum()) for name in ("cpu_s", "wall_s", "steps"))
    reach = reach_records(layers.lines.ids, touched, left)
    band = settings.band
    return {
        "logs": {
            "released": len(releases),
            "not_run": queue.rows.size - len(releases),
            "by_stop_reason": {name: int(count) for name, count in zip(STOP_REASONS, reasons, strict=True)},
            "started_in_contact": int(by_log["started_in_contact"].sum()),
        },
        "reach": reach,
        **({"own_slope": own} if own else {}),
        "friction_band": band_records(band, reach, releases.logs.log_id, touched) if band else None,
        "until_ci": queue.rule.record() if queue.rule else None,
        "spread": spread_records(releases, by_log["end_position"], left, settings.scene.min_runout_m),
        "barriers": barrier_ledger(
            barrier_records(layers.barriers, by_log), hits["barrier_hits"], hits["barrier_arrivals"]
        ),
        "trees": obstacle_record(hits["tree_hits"], len(layers.tree_ids)) if layers.tree_ids else None,
        "held": held_record(by_log["grip"]) if layers.tree_ids else None,
        "above_capacity": overload_record(settings.capacity, layers.lines, by_log, touched),
        "lying_logs": obstacle_record(hits["lying_hits"], len(layers.lying.ids)) if layers.lying.ids else None,
        "blocks": obstacle_record(hits["block_hits"], len(layers.blocks.ids)) if layers.blocks.ids else None,
        "speed": speed_record(by_log),
        "accuracy": {
            "fidelity": settings.fidelity,
            "time_step_s": float(where_things_rebound(fidelity, *restitutions).time_step),
            "station_spacing_m": float(station_spacing(fidelity, layers.dem.cell)),
            "penetration_max_m": float(by_log["penetration_max"].max()),
            "energy_error_rel_max": float(by_log["energy_error"].max()),
            "contact_residual_max": float(by_log["residual_max"].max()),
            "unconverged_steps": int(by_log["unconverged"].sum()),
            "auto": settings.auto,
        },
        "scenario": scenario_of(settings.scene, settings.fidelity, layers, releases),
        "counted": counted,
        "modelled": {name: in_words(each) for name, each in clauses.items()},
        "modelled_facts": clauses,
        "cost": {
            "cpu_s": cpu,
            "wall_s": wall,
            **({"pilot_cpu_s": settings.pilot_cpu_s} if settings.auto else {}),
            **({"own_slope_cpu_s": finer.cpu_s} if finer else {}),
            **({"friction_band_cpu_s": band.cpu_s} if band else {}),
            "steps": int(steps),
            "logs_per_s": len(releases) / max(wall, 1e-9),
        },
    }


def held_record(grip: NDArray[np.float64]) -> dict[str, Any]:
    """How many of the logs held by a single standing tree would slip off it with slightly less friction there.

    grip : [rad] as in the engine's ``Result.grip``, NaN if no tree, or not only a tree, holds the log
    """
    alone = np.degrees(grip[np.isfinite(grip)])
    near = int(np.sum(alone < NEAR_EDGE_DEG))
    low, high = wilson_interval(near, len(alone))
    return {
        "n_by_one_tree": len(alone),
        "near_edge_deg": NEAR_EDGE_DEG,
        "n_near_edge": near,
        "p_near_edge": near / len(alone) if len(alone) else None,
        "ci_low": low,
        "ci_high": high,
    }


def speed_record(by_log: Mapping[str, NDArray]) -> dict[str, float]:
    """Speeds over the logs. The mean excludes those that were still moving at the time limit: they roll slowly for
    minutes, so path over time would reflect the limit; NaN if every log was.
    """
    stopped = ~ended(by_log, "time_limit")
    return {
        "mean_ms": float(by_log["speed_mean"][stopped].mean()) if stopped.any() else np.nan,
        "n_mean": int(stopped.sum()),
        "p95_ms": percentile_record(by_log["speed_max"], 0.95)["value"],
        "max_ms": float(by_log["speed_max"].max()),
    }


def spread_records(
    releases: Releases, ends: NDArray[np.float64], left: NDArray[np.bool_], min_runout: float | None
) -> list[dict[str, Any]]:
    """Lateral spread of each release, seen from the mean of its release points; also without the logs that left."""
    records = []
    x, y = np.ascontiguousarray(ends[:, 0]), np.ascontiguousarray(ends[:, 1])
    nearest = releases.logs.length if min_runout is None else np.full(x.size, min_runout)
    for release_id in dict.fromkeys(releases.release_id.tolist()):
        rows = releases.release_id == release_id
        centre = float(releases.x[rows].mean()), float(releases.y[rows].mean())
        record, _, _ = spread_of_release(centre, x[rows], y[rows], nearest[rows])
        seen = rows & ~left
        without, _, _ = spread_of_release(centre, x[seen], y[seen], nearest[seen])
        lost = {"n_left_dem": int((rows & left).sum())}
        lost |= {f"{name}_without_lost_deg": without[f"{name}_deg"] for name in ("spread", "p05_p95")}
        records.append({"release_id": release_id, **record, **lost})
    return records


def barrier_records(barriers: Items, by_log: Mapping[str, NDArray]) -> list[dict[str, Any]]:
    """Effect of each barrier: reached = stopped + overjumped + passed beside; each log counts once for each barrier."""
    records = []
    crossed = barriers.any_row(by_log["barrier_crossed"])
    met = barriers.any_row(by_log["barrier_reached"]) | crossed
    held_by = np.full(by_log["stop_item"].size, -1)
    held = ended(by_log, "barrier")
    held_by[held] = barriers.item[by_log["stop_item"][held]] if len(barriers.item) else -1
    for column, barrier_id in enumerate(barriers.ids):
        stopped = held_by == column
        over = crossed[:, column] & ~stopped
        beside = met[:, column] & ~stopped & ~over
        records.append(
            {
                "barrier_id": barrier_id,
                "n_reached": int((stopped | over | beside).sum()),
                "n_stopped": int(stopped.sum()),
                "n_overjumped": int(over.sum()),
                "n_passed_beside": int(beside.sum()),
            }
        )
    return records


def lines_of(summary: dict[str, Any]) -> tuple[str, ...]:
    """The most important results, as lines of text."""
    logs, speed, accuracy = summary["logs"], summary["speed"], summary["accuracy"]
    ends = ", ".join(f"{count} {STOPS[name]}" for name, count in logs["by_stop_reason"].items() if count)
    lines = [f"{counted(logs['released'], 'log')}: {ends}"]
    for record in summary["reach"]:
        lines.append(
            f"line {record['line_id']}: reached by {record['n_reach']} of {record['n_total']} logs, "
            f"{percent_with_interval(record)}{lost_words(record)}"
        )
    if summary["until_ci"]:
        lines.append(enough_words(summary["until_ci"]))
    if own := summary.get("own_slope"):
        lines.append(own_slope_words(own, summary["cost"]["own_slope_cpu_s"]))
    if accuracy.get("auto"):
        lines.append(promised_words(accuracy["auto"]) + unseen_words(summary["reach"]))
    for record in summary["spread"]:
        if np.isfinite(record["spread_deg"]):
            lines.append(
                f"release {record['release_id']}: lateral spread {record['spread_deg']:.0f}° "
                f"({middle_words(record)}), {record['n_left_out']} of {record['n']} logs left out"
                f"{spread_words(record)}"
            )
    lines += spreadless_lines(summary["spread"])
    for record in summary["barriers"]:
        lines.append(
            f"barrier {record['barrier_id']}: {counted(record['n_reached'], 'log reaches', 'logs reach')} it, "
            f"{record['n_stopped']} stopped, {record['n_overjumped']} overjumped, {record['n_passed_beside']} passed "
            f"beside{needed_words(record)}"
        )
    lines += overload_lines(summary["above_capacity"])
    lines.append(f"speed: {mean_words(speed, logs['released'])}, max {speed['max_ms']:.1f} m/s")
    lines.append(
        f"accuracy: penetration up to {100 * accuracy['penetration_max_m']:.1f} cm, energy error up to "
        f"{significant(100 * accuracy['energy_error_rel_max'], 2)} %"
    )
    lines.append(scenario_line(summary["scenario"]))
    return (*lines, *band_lines(summary))


def needed_words(record: dict[str, Any]) -> str:
    """The height that 95 % of the logs that come to a barrier do not exceed; empty if no upper end can be given."""
    ends = [record[f"height_needed_{name}_m"] for name in ("p95", "ci_low", "ci_high")]
    if None in ends:
        return ""
    value, low, high = (significant(each, 3) for each in ends)
    return f"; 95 % of those that come there are within {value} m above the terrain ({low} to {high})"


def spreadless_lines(records: list[dict[str, Any]]) -> list[str]:
    """The releases without a lateral spread, in one line."""
    without = [str(record["release_id"]) for record in records if not np.isfinite(record["spread_deg"])]
    if not without:
        return []
    shown = first_of(without, len(without), FEW_NAMED)
    which = f"release {shown}" if len(without) == 1 else f"releases {shown}"
    return [f"{which}: no lateral spread, for fewer than two logs went farther than the minimum run-out"]


def mean_words(speed: dict[str, Any], n_logs: int) -> str:
    """The mean speed, and which logs it leaves out."""
    if not speed["n_mean"]:
        return "no mean (every log still moved at the time limit)"
    left_out = n_logs - speed["n_mean"]
    suffix = f" (without {counted(left_out, 'log')} that still moved at the time limit)" if left_out else ""
    return f"mean {speed['mean_ms']:.1f} m/s{suffix}"


def spread_words(record: dict[str, Any]) -> str:
    """The influence on the spread of logs that left the terrain model; empty if none left."""
    if not record["n_left_dem"]:
        return ""
    without = record["spread_without_lost_deg"]
    suffix = f" ({without:.0f}° without them)" if np.isfinite(without) else ""
    return f"; {record['n_left_dem']} left the terrain model{suffix}"


def loss_of_run(summary: dict[str, Any]) -> str | None:
    """Results in a summary that depend on logs that left the terrain model; None if they hardly do."""
    logs = summary["logs"]
    lost, released = logs["by_stop_reason"][LEFT], logs["released"]
    phrases = reach_phrases(summary["reach"])
    names = []
    for record in summary["spread"]:
        moved = abs(record["spread_deg"] - record["spread_without_lost_deg"]) >= SPREAD_MOVED_DEG
        if moved or many(record["n_left_dem"], record["n"]):
            names.append(str(record["release_id"]))
    if names:
        releases = f"release{'s' if len(names) > 1 else ''} {first_of(names, len(names))}"
        phrases.append(f"the lateral spread of {releases} refers to the places where they left")
    if many(lost, released):
        phrases.append("their deposits and run-outs end where they left")
    return lost_warning(lost, released, phrases)


def enough_words(record: dict[str, Any]) -> str:
    """Whether the intervals became as narrow as requested, and after how many logs."""
    wide, wanted = 100 * record["half_width"], 100 * record["target_half_width"]
    widest = f"the widest interval, of line {record['line_id']}, is ±{significant(wide, 2)} points"
    if record["reached"]:
        text = (
            f"enough logs: after {record['logs']} of {record['logs_at_most']}, {widest} (wanted: "
            f"±{significant(wanted, 2)})"
        )
        rare = ", ".join(str(each) for each in record.get("told_too_low", []))
        low = (
            f"; of line {rare}, which few logs reach, a run that stops in this way underestimates the reach by up to"
            f" a seventh on average"
        )
        return text + (f"{low} (the interval holds)" if rare else "")
    return f"not enough logs: after all {record['logs']}, {widest} (wanted: ±{significant(wanted, 2)}); release more"


def unseen_words(records: Sequence[Mapping[str, Any]]) -> str:
    """What a promise does not cover: logs that left the terrain model before they reached a line."""
    worst = max(records, key=lambda record: record["n_lost"], default=None)
    if worst is None or not loss_matters(worst):
        return ""
    return (
        f"; this does not hold for the {worst['n_lost']} logs that left the terrain model before line "
        f"{worst['line_id']}: if all of them reach it, {100 * worst['p_high_if_lost']:.0f} %"
    )


def promised_words(record: dict[str, Any]) -> str:
    """Both errors of the line with the largest error, separately and together, and the source of the latter."""
    sampling, calculation, together = (100 * record[name] for name in ("sampling", "calculation", "together"))
    source = "by definition" if record["chosen"] == "reference" else "as on the benchmark's slopes, assumed"
    if record.get("measured_against"):  # from pairs of logs, up to version 0.2
        source = f"measured on this slope against {record['measured_against']}"
    asked = f", ±{significant(100 * record['error'], 2)} requested" if record.get("error") else ""
    missed = "" if record.get("reached", True) else "; NOT kept, all logs were slid: release more"
    return (
        f"{counted(record['logs'], 'log')} at {record['chosen']}: reach of lines within "
        f"±{significant(together, 2)} points at 95 %{asked} (line {record['line_id']}: "
        f"sampling ±{significant(sampling, 2)}, calculation "
        f"±{significant(calculation, 2)} {source}){missed}"
    )
