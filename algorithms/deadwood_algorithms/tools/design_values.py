"""Compute design values for barriers and lines: percentiles of energy, speed, height and impulse, with intervals.

For each barrier of the run, and each line (a road, or a profile line across the slope where a barrier might stand): the
50, 90, 95 and 99 % percentiles, or others, over the logs that arrive there:

- `energy`: kinetic energy of translation and rotation together; `translation` and `rotation`: each separately;
- `speed`: of the centre of mass;
- `height`: at a barrier, the height above the terrain of the point that is hit; at a line, that of the upper edge of
  the log where it first touches the line, which a barrier there would have to exceed;
- `impulse`: the momentum that the barrier takes up in a hit. A line has none, because nothing is hit there.

At a barrier the values are those just before a hit, the largest of each log; they are stored in every run. At a line
they are those of the first touch, from stored trajectories: energies of rotation are within a few percent of the run's
own.

The interval of a percentile is exact, by order statistics: the binomial distribution gives the two sorted values that
enclose it with at least 95 % probability, whatever the distribution. Where the hits are too few for an upper bound,
`ci_high` is empty and `note` states how many more hits are needed: 72 in total for 95 %, 368 for 99 %.

    deadwood-tool sample-releases --areas 'sample_data/sample.gpkg|layername=release_area' --dem sample_data/dem.tif \\
        --count 200 --output releases.gpkg
    deadwood-tool slide-logs --dem sample_data/dem.tif --releases releases.gpkg --friction 0.25 --trajectories all \\
        --barriers 'sample_data/sample.gpkg|layername=barriers' --lines 'sample_data/sample.gpkg|layername=lines' \\
        --output run
    deadwood-tool design-values --run run --output design_values.csv

`--rule` derives design values from one percentile each of energy and height, with the factors of a national rule, and
states which of its numbers were read in the source and which are from memory. `--barrier-classes` names the weakest
class of rockfall nets that holds each percentile of the energy and the upper end of its interval, with the rule's
factor where it has one.

The percentiles hold for the logs that were released: heavier logs or another friction give others. Barriers are rigid,
so impulses are those of a wall, not of a net that deforms. Percentiles include no safety factor.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from deadwood_algorithms.params import presets, tool
from deadwood_algorithms.params.tool import Feedback, Outcome, Tool, UserError

if TYPE_CHECKING:
    from deadwood_algorithms.results.passages import Passages
    from deadwood_algorithms.results.run_folder import Run


@dataclass(frozen=True, kw_only=True)
class Ask:
    run: str = tool.folder("Folder of a run of slide-logs")
    lines: str | None = tool.vector(
        "Other lines or houses than those of the run, such as profile lines across the slope",
        "line",
        "polygon",
        default=None,
        help="Without it, the lines of the run. Lines need stored trajectories.",
    )
    percentiles: tuple[float, ...] = tool.numbers(
        "Percentiles", 50.0, 90.0, 95.0, 99.0, unit="%", minimum=0.0, maximum=100.0, exclusive=True,
        exclusive_maximum=True,
    )  # fmt: skip
    confidence: float = tool.number(
        "Probability with which an interval holds its percentile, at least",
        unit="%",
        default=95.0,
        minimum=50.0,
        maximum=99.9,
        advanced=True,
    )
    barrier_classes: str | None = tool.choice(
        "Classes of barriers, to find the weakest that holds the energies",
        *presets.BARRIERS,
        default=None,
        help=presets.choices_told(presets.BARRIERS)
        + " They were made for rocks; whether they suit wood is for an expert to decide.",
    )
    rule: str | None = tool.choice(
        "Rule that derives design values from percentiles",
        *presets.RULES,
        default=None,
        help=presets.choices_told(presets.RULES)
        + " They were made for rocks; whether they suit wood is for an expert to decide.",
    )
    output: str = tool.output_table("Design values by barrier or line, quantity and percentile")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    import pandas

    from deadwood_algorithms.files.tables import write_csv
    from deadwood_algorithms.results.identity import writing
    from deadwood_algorithms.results.passages import barrier_passages, design_rows, passages_of_lines
    from deadwood_algorithms.results.run_folder import read_run
    from deadwood_algorithms.results.scenario import lines_of_run

    rule = presets.RULES[ask.rule] if ask.rule else None
    wanted = {*ask.percentiles, *(rule.percentiles.values() if rule else ())}
    levels = [each / 100.0 for each in sorted(wanted)]
    with writing(TOOL, ask, feedback) as outputs:
        path = outputs.file("output", ".csv")
        source = read_run(ask.run, feedback=feedback)
        found = [*barrier_passages(source), *passages_of_lines(source, ask.lines, feedback)]
        if not found:
            raise UserError(f"{ask.run}: the run has neither barriers nor lines; --lines names some")
        rows = [row for each in found for row in design_rows(each, levels, ask.confidence / 100.0)]
        lost = lost_before(source, found, feedback)
        rows = [row | {"n_lost": lost[row["kind"], row["place_id"]]} for row in rows]
        rows = [row | (rule.record(row) if rule else {}) for row in rows]
        classes = presets.BARRIERS[ask.barrier_classes] if ask.barrier_classes else None
        rows = [row | (class_record(classes, row) if classes else {}) for row in rows]
        write_csv(path, pandas.DataFrame(rows))
    shown = (*lines_of(found, rows), *rule_lines(rows, rule), *class_lines(rows, classes), *lines_of_run(source))
    return Outcome({"output": Path(ask.output)}, {"rows": rows}, shown)


def lost_before(source: Run, found: Sequence[Passages], feedback: Feedback) -> dict[tuple[str, str], int]:
    """Of each place the logs that left the terrain model and had not come to it; a warning where they are many."""
    from deadwood_algorithms.results.lost import left_dem, many, warn_of_lost

    ids = source.deposits["log_id"].to_numpy()
    left = ids[left_dem(source.deposits["stop_reason"].to_numpy())]
    counts = {(each.kind, each.place_id): int((~np.isin(left, each.log_id)).sum()) for each in found}
    told = [
        f"the percentiles of {each.kind} {each.place_id} are of the {each.log_id.size} logs that were seen there"
        for each in found
        if each.values and many(counts[each.kind, each.place_id], each.log_id.size)  # else it is not known who came
    ]
    warn_of_lost(left.size, ids.size, told, feedback, where=str(source.path))
    return counts


def class_record(classes: presets.BarrierClasses, row: dict[str, Any]) -> dict[str, str]:
    """The classes that hold an energy: its design value where a rule makes one, else the percentile as it is."""
    if row["quantity"] != "energy":
        return {"barrier_class": "", "barrier_class_high": ""}
    designed = row.get("factor", math.nan) == row.get("factor", math.nan)
    names = ("design_value", "design_high") if designed else ("value", "ci_high")
    return classes.record(*(row[name] for name in names))


def lines_of(found: Sequence[Passages], rows: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    """For each place its hits, of each quantity the highest percentile that can be given, and what cannot."""
    shown = []
    for each in found:
        mine = [row for row in rows if (row["kind"], row["place_id"]) == (each.kind, each.place_id)]
        shown.append(f"{each.kind} {each.place_id}: {each.log_id.size} logs come to it")
        told = {
            row["quantity"]: row for row in mine if row["n"] and not row["n_more"]
        }  # the highest that has both ends
        shown += [f"  {value_words(row)}" for row in told.values()]
        short = {row["percentile"]: row["note"] for row in mine if row["n_more"]}
        shown += [f"  {percentile:g} % {note}" for percentile, note in short.items()]
        for why in dict.fromkeys(each.lacks.values()):
            named = ", ".join(quantity for quantity, reason in each.lacks.items() if reason == why)
            shown.append(f"  no {named}: {why}")
    return tuple(shown)


def rule_lines(rows: Sequence[dict[str, Any]], rule: presets.DesignRule | None) -> list[str]:
    """Of each place the design values; whose rule it is, and what to mind."""
    if rule is None:
        return []
    shown = []
    for row in rows:
        if not math.isnan(row["design_value"]):
            high = (
                f"up to {row['design_high']:.3g}" if not math.isnan(row["design_high"]) else "no upper end can be given"
            )
            shown.append(
                f"{row['kind']} {row['place_id']}, design value of the {row['quantity']}: {row['design_value']:.3g} "
                f"{row['unit']} ({high}), {row['percentile']:g} % times {row['factor']:.4g}"
            )
    return [*shown, rule.said]


def class_lines(rows: Sequence[dict[str, Any]], classes: presets.BarrierClasses | None) -> list[str]:
    """Of each place the class that holds each percentile of the energy; whose classes they are, and who decides."""
    if classes is None:
        return []
    shown = [
        f"{row['kind']} {row['place_id']}, {row['percentile']:g} % of the energy{factor_words(row)}: "
        f"{classes.words(row)}"
        for row in rows
        if row["barrier_class"]
    ]
    return [*shown, classes.said]


def factor_words(row: dict[str, Any]) -> str:
    """With which factor a percentile is classed."""
    factor = row.get("factor", math.nan)
    return " without a factor" if math.isnan(factor) else f" times {factor:.4g}"


def value_words(row: dict[str, Any]) -> str:
    """``energy, 95 %: 310 kJ (250 to 420)``."""
    value, low, high = (f"{float(f'{row[name]:.3g}'):g}" for name in ("value", "ci_low", "ci_high"))
    ends = f"{low} to {high}" if row["ci_low"] == row["ci_low"] else f"up to {high}"
    return f"{row['quantity']}, {row['percentile']:g} %: {value} {row['unit']} ({ends})"


TOOL = Tool(
    "design-values",
    "Evaluate",
    "Compute percentiles of energy, speed, height and impulse at barriers and lines",
    Ask,
    run,
)
