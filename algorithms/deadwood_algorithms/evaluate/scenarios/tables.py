"""The comparison as a table: long for a spreadsheet, and a line for each scenario for the terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from deadwood_algorithms.evaluate.scenarios.indices import INDICES
from deadwood_algorithms.evaluate.scenarios.measures import ScenarioRow
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.stats.statistics import (
    IN_BRACKETS,
    decimals_of,
    percent,
    percent_of,
    points_if_lost_words,
    share_if_lost_words,
)

SHOWN = 4  # lines and releases in the printed table; the files have them all


def long_table(rows: Sequence[ScenarioRow]) -> list[dict[str, Any]]:
    """The rows for a spreadsheet: the scenarios of a quantity one below the other, shares in percent, rounded as their
    intervals justify."""
    keys = list(dict.fromkeys((row.quantity, row.item) for row in rows))
    return [table_row(row) for row in sorted(rows, key=lambda row: keys.index((row.quantity, row.item)))]


def table_row(row: ScenarioRow) -> dict[str, Any]:
    scale = 100.0 if row.unit == "1" else 1.0

    def rounded(value: float, low: float, high: float) -> float | None:
        if not math.isfinite(value):
            return None
        if math.isfinite(low):
            return round(scale * value, decimals_of(scale * low, scale * high))
        return float(f"{scale * value:.3g}")

    own, change = (row.ci_low, row.ci_high), (row.diff_ci_low, row.diff_ci_high)
    record: dict[str, Any] = {"quantity": row.quantity, "of": row.item, "scenario": row.scenario}
    record |= {"unit": "%" if row.unit == "1" else row.unit, "logs": row.n}
    record |= {"value": rounded(row.value, *own), "from": rounded(row.ci_low, *own), "to": rounded(row.ci_high, *own)}
    record["difference"] = rounded(row.difference, *change)
    record |= {f"difference_{word}": rounded(end, *change) for word, end in zip(("from", "to"), change, strict=True)}
    record["logs_lost"] = int(row.n_lost) if math.isfinite(row.n_lost) else None
    record |= {
        f"if_lost_{word}": rounded(getattr(row, f"value_{end}_if_lost"), *own)
        for word, end in (("from", "low"), ("to", "high"))
    }
    record |= {
        f"difference_if_lost_{word}": rounded(getattr(row, f"difference_{end}_if_lost"), *change)
        for word, end in (("from", "low"), ("to", "high"))
    }
    record["needs_more"] = row.n_more
    return record


def table_lines(
    rows: Sequence[ScenarioRow], names: Sequence[str], differences: dict[str, dict[str, Any]], n_logs: int, file: str
) -> tuple[str, ...]:
    """A table with a line for each scenario, and what makes the scenarios differ."""
    of = {(row.scenario, row.quantity, row.item): row for row in rows}
    lines = list(dict.fromkeys(row.item for row in rows if row.quantity == "reach"))
    releases = list(dict.fromkeys(row.item for row in rows if row.quantity == "spread"))
    head = ["scenario"]
    for line in lines[:SHOWN]:
        head += [f"reach {line}", f"minus {names[0]} [points]"]
    head += [f"spread {release} (5-95 %)" for release in releases[:SHOWN]]
    held = {"tree": "held by trees", "lying_log": "by lying logs", "block": "by boulders", "barrier": "by barriers"}
    if not any(of[name, "ended", "block"].value for name in names):
        del held["block"]  # few scenes have boulders
    head += ["mean speed", "max speed", *held.values()]
    table = [head]
    for name in names:
        cells = [name]
        for line in lines[:SHOWN]:
            row = of[name, "reach", line]
            cells += [share_words(row), difference_words(row) if name != names[0] else "-"]
        for release in releases[:SHOWN]:
            row, middle = of[name, "spread", release], of[name, "spread_p05_p95", release]
            cells.append(f"{degrees(row.value)} ({degrees(middle.value)})")
        cells += [speed_words(of[name, *key]) for key in (("speed_mean", "mean"), ("speed_max", "largest"))]
        cells += [share_of_end(of[name, "ended", each]) for each in held]
        table.append(cells)
    widths = [max(len(row[k]) for row in table) for k in range(len(head))]
    shown = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in table]
    if any("[" in cell for row in table[1:] for cell in row):
        shown.append(IN_BRACKETS)
    shown += index_lines(rows, names[0])
    for parameter, values in differences.items():
        text = ", ".join(f"{name}: {Path(str(value)).name if value else 'none'}" for name, value in values.items())
        shown.append(f"--{parameter.replace('_', '-')} differs: {text}")
    if not differences:
        shown.append("the runs do not differ in any parameter of slide-logs (their layers may)")
    hidden = max(len(lines) - SHOWN, 0) + max(len(releases) - SHOWN, 0)
    more = f"; {counted(hidden, 'more line or release', 'more lines or releases')} in {file}" if hidden else ""
    return (f"{counted(n_logs, 'log')} in each scenario, intervals 95 %{more}:", *shown)


def index_lines(rows: Sequence[ScenarioRow], reference: str) -> tuple[str, ...]:
    """The indices of the protection forest, a line for each scenario and line; none without lines."""
    of = {(row.scenario, row.quantity, row.item): row for row in rows}
    shown = []
    for scenario, item in dict.fromkeys((row.scenario, row.item) for row in rows if row.quantity == "bari"):
        lines = [index_words(of[scenario, name, item]) for name in INDICES if (scenario, name, item) in of]
        shown.append(f"{scenario} against {reference}, line {item}: {', '.join(lines)}")
    return tuple(shown)


def index_words(row: ScenarioRow) -> str:
    """``BARI 60 % (43 to 75 %)``; with ``[..]`` where logs were lost that could change it."""
    name = row.quantity.upper()
    if not math.isfinite(row.value):
        return f"{name} - (needs {counted(row.n_more, 'more arrival')})"
    value, low, high = (percent(each, row.ci_low, row.ci_high) for each in (row.value, row.ci_low, row.ci_high))
    text = f"{name} {value} % ({low} to {high} %)"
    if row.value_low_if_lost < row.ci_low or row.value_high_if_lost > row.ci_high:
        ends = (percent(each, row.ci_low, row.ci_high) for each in (row.value_low_if_lost, row.value_high_if_lost))
        text += f" [{' to '.join(ends)} %]"
    return text


def share_words(row: ScenarioRow) -> str:
    """``30 % (18 to 45 %)``, with ``[18 to 67 %]`` where logs were lost that could change it."""
    n_reach = round(row.value * row.n)
    return share_if_lost_words(n_reach, row.n, round(row.value_high_if_lost * row.n) - n_reach)


def difference_words(row: ScenarioRow) -> str:
    """``-45 (-62 to -25)``, with its bounds where logs were lost that could change it."""
    return points_if_lost_words(
        row.difference,
        (row.diff_ci_low, row.diff_ci_high),
        (row.difference_low_if_lost, row.difference_high_if_lost),
        (row.diff_ci_low_if_lost, row.diff_ci_high_if_lost),
    )


def share_of_end(row: ScenarioRow) -> str:
    return percent_of(round(row.value * row.n), row.n)


def speed_words(row: ScenarioRow) -> str:
    return f"{row.value:.1f} m/s" if math.isfinite(row.value) else "-"


def degrees(angle: float) -> str:
    return f"{angle:.0f}°" if math.isfinite(angle) else "-"
