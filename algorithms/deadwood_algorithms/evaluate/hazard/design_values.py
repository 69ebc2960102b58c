"""Design values at barriers and lines: logs lost before they arrived, classes of nets, and the lines of text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from deadwood_algorithms.params import presets
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.results.lost import many, warn_of_lost
from deadwood_algorithms.results.passages import Passages
from deadwood_algorithms.results.run_folder import Run
from deadwood_algorithms.stats.endings import left_dem


def lost_before(source: Run, found: Sequence[Passages], feedback: Feedback) -> dict[tuple[str, str], int]:
    """For each place, the logs that left the terrain model before they reached it; warns if they are many."""
    ids = source.deposits["log_id"].to_numpy()
    left = ids[left_dem(source.deposits)]
    counts = {(each.kind, each.place_id): int((~np.isin(left, each.log_id)).sum()) for each in found}
    warnings = [
        f"the percentiles of {each.kind} {each.place_id} are of the {counted(each.log_id.size, 'log')} seen there"
        for each in found
        if each.values and many(counts[each.kind, each.place_id], each.log_id.size)  # else unknown which arrived
    ]
    warn_of_lost(left.size, ids.size, warnings, feedback, where=str(source.path))
    return counts


def class_record(classes: presets.BarrierClasses, row: dict[str, Any]) -> dict[str, str]:
    """Barrier classes that hold a percentile of the energy of all logs that come there, and its upper end."""
    if row["quantity"] != "energy":
        return {"barrier_class": "", "barrier_class_high": ""}
    return classes.record(row["value"], row["ci_high"])


def lines_of(found: Sequence[Passages], rows: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    """For each place its hits, the highest percentile of each quantity that can be given, and those that cannot."""
    shown = []
    for each in found:
        mine = [row for row in rows if (row["kind"], row["place_id"]) == (each.kind, each.place_id)]
        shown.append(f"{each.kind} {each.place_id}: {counted(each.log_id.size, 'log comes', 'logs come')} there")
        by_quantity = {
            row["quantity"]: row for row in mine if row["n"] and not row["n_more"]
        }  # the highest whose interval has both ends
        shown += [f"  {value_words(row)}" for row in by_quantity.values()]
        short = {row["percentile"]: row["note"] for row in mine if row["n_more"]}
        shown += [f"  {percentile:g} % {note}" for percentile, note in short.items()]
        for why in dict.fromkeys(each.lacks.values()):
            named = ", ".join(quantity for quantity, reason in each.lacks.items() if reason == why)
            shown.append(f"  no {named}: {why}")
    return tuple(shown)


def class_lines(rows: Sequence[dict[str, Any]], classes: presets.BarrierClasses | None) -> list[str]:
    """For each place the class that holds each percentile of the energy; then the source of the classes, and a
    caveat.
    """
    if classes is None:
        return []
    shown = [
        f"{row['kind']} {row['place_id']}, {row['percentile']:g} % of the energy without a factor: {classes.words(row)}"
        for row in rows
        if row["barrier_class"]
    ]
    return [*shown, classes.said]


def value_words(row: dict[str, Any]) -> str:
    """``energy, 95 %: 310 kJ (250 to 420)``."""
    value, low, high = (f"{float(f'{row[name]:.3g}'):g}" for name in ("value", "ci_low", "ci_high"))
    ends = f"{low} to {high}" if row["ci_low"] == row["ci_low"] else f"up to {high}"
    return f"{row['quantity']}, {row['percentile']:g} %: {value} {row['unit']} ({ends})"
