"""The runs of a page side by side: a table of the paired differences, the run-outs, and maps of the differences."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.report.figures import Drawing, runout_figure
from deadwood_algorithms.report.markup import Markup, element, figure_of, joined, remarked, table
from deadwood_algorithms.report.plan import draw_differences
from deadwood_algorithms.report.rounded import DIGITS, decimal, shown_alike, with_interval
from deadwood_algorithms.report.sections import left_table
from deadwood_algorithms.report.sources import Extent, ReportedRun
from deadwood_algorithms.report.words import Words

COMPARED = (
    "reach",
    "bari",
    "miri",
    "orpi",
    "ended",
    "spread_p05_p95",
    "speed_mean",
    "speed_max",
    "runout",
    "jump_max",
    "deposit_moved",
)


@dataclass
class Comparison:
    """Two or more runs side by side: rows as of `compare-scenarios`, and maps of the differences."""

    rows: list[Any] = field(default_factory=list)
    differing: dict[str, dict[str, Any]] = field(default_factory=dict)
    steps: list[tuple[str, Any]] = field(default_factory=list)  # reach against the run before, and that run's name
    maps: dict[str, tuple[NDArray[np.float64], Extent]] = field(default_factory=dict)
    lacks: list[tuple[str, dict[str, Any]]] = field(default_factory=list)


def comparison(sources: Sequence[ReportedRun], compared: Comparison, words: Words) -> tuple[Markup, list[Drawing]]:
    """The runs side by side: one table for each quantity, and the run-outs."""
    reference = sources[0].name
    parts: list[Any] = [element("h2", words.say("comparison_whole"), id="comparison")]
    parts += [element("p", words.say(phrase, **filled), class_="warning") for phrase, filled in compared.lacks]
    drawings = [Drawing("comparison_runout", words.say("runout"), partial(runout_figure, list(sources), words), words)]
    if compared.rows:
        parts.append(element("p", words.say("comparison_note", reference=reference)))
        parts.append(comparison_table(compared.rows, [each.name for each in sources], words))
        differ = [
            (
                words.say_or(f"model_{name}", name.replace("_", " ")),
                "; ".join(f"{run}: {shown_value(value, words)}" for run, value in values.items()),
            )
            for name, values in compared.differing.items()
        ]
        parts.append(element("h3", words.say("parameters_differ")))
        parts.append(
            left_table(differ, words.say("parameters_differ")) if differ else element("p", words.say("parameters_same"))
        )
    parts.append(figure_of(drawings[0]))
    return joined(parts), drawings


def difference_maps(sources: Sequence[ReportedRun], compared: Comparison, words: Words) -> Drawing | None:
    """The maps of the differences to the first run; None if there are none."""
    title = words.say("difference_maps", reference=sources[0].name)
    draw = partial(draw_differences, compared.maps, joint_extent(sources), sources, words)
    return Drawing("differences", title, draw, words) if compared.maps else None


def shown_value(value: Any, words: Words) -> str:
    """The value of a parameter; of a file only the name, because its path is in the last section of the annex."""
    if isinstance(value, bool):
        return words.say("yes" if value else "no")
    if isinstance(value, float):
        return decimal(value, words)
    return words.say("none") if value in (None, "") else Path(str(value)).name


def joint_extent(sources: Sequence[ReportedRun]) -> Extent:
    sides = np.array([each.extent for each in sources])
    west, south = sides[:, :2].min(axis=0)
    east, north = sides[:, 2:].max(axis=0)
    return float(west), float(south), float(east), float(north)


def comparison_table(rows: Sequence[Any], names: Sequence[str], words: Words) -> Markup:
    """One row for each quantity: the value of each run and, from the second on, its difference from the first."""
    ends = {row.item for row in rows if row.quantity == "ended" and row.value > 0.0}
    kept = [row for row in rows if row.quantity in COMPARED and (row.quantity != "ended" or row.item in ends)]
    of = {(row.scenario, row.quantity, row.item): row for row in rows}
    head = [words.say("quantity")]
    for k, name in enumerate(names):
        head += [name] + ([f"{name}: {words.say('difference')}"] if k else [])
    body = []
    for quantity, item, unit in dict.fromkeys((row.quantity, row.item, row.unit) for row in kept):
        shown = words.stop(item) if quantity == "ended" else words.say_or(f"item_{item}", item)
        scale, shown_unit = (100.0, "%") if unit == "1" else (1.0, "°" if unit == "deg" else unit)
        cells: list[Any] = [f"{words.say_or(f'quantity_{quantity}', quantity, item=shown)} [{shown_unit}]"]
        cells += _cells([of.get((name, quantity, item)) for name in names], scale, words)
        if any(each != "–" for each in cells[1:]):
            body.append(cells)
    return table(head, body)


def _cells(rows: Sequence[Any], scale: float, words: Words) -> list[str]:
    """The cells of one quantity. Numbers without intervals have as many decimals as their differences, so that these
    can be checked by eye.
    """
    numbers: list[tuple[float, float, float, bool]] = []  # value, ends of its interval, whether it is a difference
    for k, row in enumerate(rows):
        if row is not None:
            numbers.append((row.value, row.ci_low, row.ci_high, False))
        if row is not None and k:
            numbers.append((row.difference, row.diff_ci_low, row.diff_ci_high, True))
    if any(math.isfinite(low) for _, low, _, _ in numbers):
        texts = [
            with_interval(scale * value, scale * low, scale * high, words, signed=signed)
            for value, low, high, signed in numbers
        ]
    else:
        alike = shown_alike([scale * value for value, *_ in numbers], words, DIGITS + 1)
        texts = [
            "+" * (signed and value > 0.0) + text for (value, _, _, signed), text in zip(numbers, alike, strict=True)
        ]
    known = [row for row in rows if row is not None]
    if any(row.n_more for row in known) and not any(math.isfinite(value) for value, *_ in numbers):
        return [remarked("–", words.say("more_hits", n=max(row.n_more for row in known))), *["–"] * (2 * len(rows) - 2)]
    found = iter(texts)
    return [next(found) if row is not None else "–" for k, row in enumerate(rows) for _ in range(2 if k else 1)]
