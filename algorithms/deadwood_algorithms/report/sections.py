"""The sections of the report about one run, each a heading with its content."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from deadwood_algorithms.params.messages import Message, messages_in, warnings_among
from deadwood_algorithms.report import answer_sections
from deadwood_algorithms.report.figures import ARRIVAL_COLUMNS, Drawing
from deadwood_algorithms.report.markup import SHORT, Markup, element, figure_of, joined, remarked, scrolled, table
from deadwood_algorithms.report.plan import MOST_DOTS, QUANTITIES, SHOWN_AT_FIRST, layers_drawn
from deadwood_algorithms.report.provenance import input_words, provenance
from deadwood_algorithms.report.rounded import (
    NBSP,
    decimal,
    in_signs,
    percent_if_lost,
    shown_alike,
    shown_number,
    shown_share,
    shown_shares,
    with_interval,
)
from deadwood_algorithms.report.sources import ReportedRun
from deadwood_algorithms.report.words import Words
from deadwood_algorithms.results.capacity import as_share
from deadwood_algorithms.results.own_slope import interval_of
from deadwood_algorithms.results.passages import UNITS, design_rows
from deadwood_algorithms.schemas.looks import LOOKS
from deadwood_algorithms.simulate.fidelity_trade import REACH_ERRORS, SLOPE_ERRORS, Points
from deadwood_algorithms.stats.order_statistics import missing, quantiles
from deadwood_algorithms.stats.statistics import to_decimals

TOP_TREES = 10
LEVELS = (5, 25, 50, 75, 95)
DESIGN_LEVELS = (0.5, 0.9, 0.95, 0.99)
DESIGN_PHRASES = {
    "energy": "design_energy",
    "translation": "design_translation",
    "rotation": "design_rotation",
    "speed": "design_speed",
    "height_needed": "design_height",
    "energy_hit": "design_energy_hit",
    "speed_hit": "design_speed_hit",
    "height_hit": "design_height_hit",
    "impulse": "design_impulse",
}
Parts = list[Any]
WORDED = {"coarse-cells": "warned_coarse_cells"}  # warnings that the page has in its languages, by code
OWN_WORDS = ("left_dem", "failed", "time_limit")  # stop reasons with a sentence of the page, beside the records
WORDED_BY_PAGE = (*OWN_WORDS, "own_slope")  # warnings of which the page makes its own sentence, from the summary


def warnings_of(sources: Sequence[ReportedRun], words: Words) -> Parts:
    """One box with everything that makes the runs doubtful, each once, with the names of its runs if not of all."""
    found: dict[str, list[str]] = {}
    for source in sources:
        reasons = source.summary["logs"]["by_stop_reason"]
        said = [words.say(f"{name}_warning", n=n) for name in OWN_WORDS if (n := reasons.get(name, 0))]
        said += [
            words.say("input_changed", what=input_words(parameter, words), path=Path(file).name)
            for parameter, file in source.run.changed
        ]
        said += [
            warning_words(each, words)
            for each in warnings_among(messages_in(source.summary))
            if each.code.replace("-", "_") not in WORDED_BY_PAGE
        ]
        if (own := source.summary.get("own_slope")) and own["flagged"]:
            bound = shown_number(100.0 * own["promised"], words, 2)
            said.append(words.say("own_slope_flagged", bound=bound, finer=own["finer"]))
        for text in dict.fromkeys(said):
            found.setdefault(text, []).append(source.name)
    rows = [text if len(names) == len(sources) else f"{', '.join(names)}: {text}" for text, names in found.items()]
    return [element("ul", *(element("li", each) for each in rows), class_="warning")] if rows else []


def warning_words(warning: Message, words: Words) -> str:
    """In the page's language if it has the sentence; without the folders of files, which a reader does not have."""
    text = re.sub(r"(?<!\S)(?:/|[A-Za-z]:[\\/])[^\s:]*[\\/](?=[^\s/\\])", "", warning.text)
    numbers = {name: words.signs(f"{value:g}") for name, value in warning.numbers.items() if value is not None}
    return words.say(WORDED[warning.code], **numbers) if warning.code in WORDED else text


def model_section(source: ReportedRun, words: Words) -> Parts:
    phrases, facts = source.summary["modelled"], source.summary.get("modelled_facts", {})
    rows = [
        (
            words.say_or(f"model_{name}", name.replace("_", " ")),
            words.clauses(facts[name]) if name in facts else str(phrases[name]),
        )
        for name in phrases
    ]
    parts: Parts = [element("p", words.say("modelled_note")), left_table(rows, words.say("modelled"))]
    if phrases and not facts and words.language != "en":
        parts.append(element("p", words.say("modelled_older"), class_="quiet"))
    if source.lacks:
        lacks = []
        for phrase, filled in source.lacks:
            filled = dict(filled)
            if "what" in filled:
                filled["what"] = input_words(str(filled["what"]), words)
                filled["reason"] = filled["reason"] or words.say("gone")
                filled["path"] = Path(filled["path"]).name or filled["path"]
            lacks.append(element("li", words.say(phrase, **filled)))
        parts += [element("h4", words.say("lacks")), element("ul", *lacks)]
    return parts


def left_table(rows: list[tuple[Any, Any]], name: str) -> Markup:
    body = [element("tr", element("th", name, scope="row"), element("td", said)) for name, said in rows]
    return scrolled(element("table", element("tbody", *body), class_="words"), name, short=len(rows) <= SHORT)


def map_section(source: ReportedRun, drawing: Drawing, frame: tuple[float, ...], words: Words) -> Parts:
    """The map with a box for each of its layers; ``frame`` is the position of its axes in the SVG (x, y, width,
    height).
    """
    boxes = []
    for name in layers_drawn(source):
        reason = name.removeprefix("deposits_")
        label = words.say("layer_deposits", stop=words.stop(reason)) if reason != name else words.say(f"layer_{name}")
        if name in QUANTITIES and name != "hits":  # with a scale beside the map
            look = LOOKS[QUANTITIES[name]]
            ends = [shown_number(look.factor * look.stops[k], words) for k in (0, -1)]
            label += f" ({ends[0]}–{ends[1]} {look.shown})"
        on = name in SHOWN_AT_FIRST or reason != name
        box = element(
            "input", type="checkbox", data_layer=f"{drawing.name}-layer_{name}", checked="" if on else None
        ).removesuffix("</input>")
        boxes.append(element("label", Markup(box), label))
    buttons = [
        element("button", words.say(phrase), type="button", data_part=part)
        for phrase, part in (("zoom_in", "in"), ("zoom_out", "out"), ("reset", "reset"))
    ]
    crs = f"{source.run.grid.plan_crs.name} ({source.run.manifest['grid']['crs']})"
    notes = [words.say("map_caption", crs=crs if len(crs) < 120 else source.run.grid.plan_crs.name)]
    for many, what in ((len(source.deposits), "deposits"), (len(source.scene.get("trees", ())), "layer_trees")):
        if many > MOST_DOTS:
            notes.append(words.say("map_some", drawn=MOST_DOTS, n=many, what=words.say(what)))
    on_screen = [words.say("map_moves"), *([words.say("danger_note")] if "danger" in source.rasters else [])]
    caption = joined([" ".join(notes), element("span", " " + " ".join(on_screen), class_="screen")])
    return [
        element(
            "div",
            element("fieldset", *boxes, class_="controls"),
            element("div", *buttons, element("span", class_="where"), class_="controls"),
            figure_of(drawing, caption, card=True),
            class_="map",
            data_frame=" ".join(f"{each:.3f}" for each in frame),
            data_extent=" ".join(f"{each:.3f}" for each in source.extent),
        )
    ]


def reach(source: ReportedRun, drawings: Mapping[str, Drawing], words: Words) -> Parts:
    """Each line with both errors."""
    records = source.summary["reach"]
    if not records:
        return [element("p", words.say("no_reach"))]
    calculation = calculation_words(source.summary["accuracy"], source.run.manifest.get("parameters", {}), words)
    head = [words.say(each) for each in ("line", "logs", "n_reach", "sampling", "calculation")]
    rows = [
        [each["line_id"], each["n_total"], each["n_reach"], shown_share(each, words), calculation] for each in records
    ]
    if own := source.summary.get("own_slope"):
        head.append(words.say("own_slope", fidelity=own["fidelity"], finer=own["finer"]))
        for row in rows:
            row.append(shown_range(own["by_line"][str(row[0])], words))
    parts: Parts = [figure_of(drawings.get("reach")), table(head, rows)]
    if lost := [each for each in records if each.get("n_lost")]:
        head = [words.say(each) for each in ("line", "n_lost", "if_lost")]
        parts.append(table(head, [(each["line_id"], each["n_lost"], percent_if_lost(each, words)) for each in lost]))
        parts.append(element("p", words.say("lost_note"), class_="quiet"))
    parts += [
        element("p", words.say("reach_note"), class_="quiet"),
    ]
    if own:
        parts.append(element("p", words.say("own_slope_note", n=own["logs"], finer=own["finer"]), class_="quiet"))
    if promise := source.summary["accuracy"].get("auto"):
        parts.append(element("p", promise_words(promise, words)))
    elif source.summary["accuracy"]["fidelity"] in REACH_ERRORS and not own:
        parts.append(element("p", words.say("calculation_measure"), class_="quiet"))
    if rule := source.summary.get("until_ci"):
        state = words.say("until_reached" if rule["reached"] else "until_missed", n=rule["logs"])
        wanted = shown_number(100.0 * rule["target_half_width"], words, 2)
        parts.append(element("p", words.say("until_ci", wanted=wanted, state=state)))
    return parts


def calculation_words(accuracy: Mapping[str, Any], parameters: Mapping[str, Any], words: Words) -> str:
    """The known error of calculation of a run's fidelity."""
    fidelity = accuracy["fidelity"]
    if promise := accuracy.get("auto"):
        return words.say("calculation_bound", bound=shown_number(100.0 * promise["calculation"], words, 2))
    if parameters.get("time_step_s") is not None or parameters.get("station_spacing_m") is not None:
        return words.say("calculation_unknown")
    if fidelity == "reference":
        return words.say("calculation_none")
    if slopes := SLOPE_ERRORS.get(fidelity):
        sd, low, high = (in_signs(to_decimals(each, 1), words) for each in slopes.sd)
        spread = f"{sd} ({low} {words.say('to')} {high})"
        return words.say("calculation_slopes", mean=points_words(slopes.mean, words), sd=spread)
    if fidelity not in REACH_ERRORS:
        return words.say("calculation_unknown")
    mean, worst = (points_words(each, words) for each in REACH_ERRORS[fidelity])
    return words.say("calculation_known", mean=mean, worst=worst)


def promise_words(promise: Mapping[str, Any], words: Words) -> str:
    """The promise of --fidelity auto: both errors of the line with the largest error, separately and together."""
    points = {name: shown_number(100.0 * promise[name], words, 2) for name in ("sampling", "calculation", "together")}
    how = "calculation_none" if promise["chosen"] == "reference" else "promise_assumed"
    against = promise.get("measured_against")  # from pairs of logs, up to version 0.2
    source = words.say("promise_measured" if against else how, against=against)
    chosen, n = promise["chosen"], promise["logs"]
    return words.say("promise", chosen=chosen, n=n, line=promise["line_id"], source=source, **points)


def points_words(points: Points, words: Words) -> str:
    """``−0.4 (−0.8 to +0.1)``, to a tenth of a point, as in the README."""
    value, low, high = (in_signs(to_decimals(each, 1, sign=True), words) for each in points)
    return f"{value} ({low} {words.say('to')} {high})"


def shown_range(record: Mapping[str, float], words: Words) -> str:
    """``−3 to +9``: the interval of a difference, in points."""
    low, high = (in_signs(each, words) for each in interval_of(record))
    return f"{low} {words.say('to')} {high}"


def arrivals(source: ReportedRun, drawings: Mapping[str, Drawing], words: Words) -> Parts:
    if source.arrivals is None:
        return []
    if not len(source.arrivals):
        return [element("p", words.say("arrivals_none"))]
    parts: Parts = [element("p", words.say("arrivals_note"), class_="quiet"), figure_of(drawings.get("arrivals"))]
    for line_id, mine in source.arrivals.groupby("line_id", sort=False):
        rows = [(words.say(phrase), mine[name].to_numpy(float)) for name, phrase in ARRIVAL_COLUMNS.items()]
        parts.append(quantile_table(rows, words, f"{words.say('line')} {line_id}"))
    return parts


def quantile_table(rows: Sequence[tuple[str, Any]], words: Words, caption: str = "") -> Markup:
    """Quantiles of named values and the largest; in the last row how many more logs those missing need. Infinite
    values are larger than is known.
    """
    head = [words.say("quantity"), words.say("n_logs"), *(f"{each}{NBSP}%" for each in LEVELS), words.say("largest")]
    levels, body, more = [each / 100.0 for each in LEVELS], [], [0] * len(LEVELS)
    for label, values in rows:
        known = values[~np.isnan(values)]
        largest = known.max() if known.size else math.nan
        body.append((label, known.size, *shown_alike([*quantiles(known, levels), largest], words)))
        if known.size:
            more = [max(n, missing(known.size, level)) for n, level in zip(more, levels, strict=True)]
    if any(more):
        body.append((words.say("design_more"), "", *(n or "–" for n in more), ""))
    return table(head, body, caption)


def design(source: ReportedRun, words: Words) -> Parts:
    """Percentiles at each barrier and line, with exact intervals, and their limitations."""
    found = [each for each in source.passages if each.log_id.size]
    if not found:
        return []
    head = [words.say("quantity"), *(f"{100 * level:g}{NBSP}%" for level in DESIGN_LEVELS)]
    parts: Parts = [element("p", words.say("design_note"), class_="quiet")]
    for each in found:
        records = list(design_rows(each, DESIGN_LEVELS, 0.95))
        rows, more = [], [0] * len(DESIGN_LEVELS)
        for quantity, unit in UNITS.items():
            mine = [row for row in records if row["quantity"] == quantity]
            if mine and mine[0]["n"]:
                rows.append((f"{words.say(DESIGN_PHRASES[quantity])} [{unit}]", *design_cells(mine, words)))
                more = [max(n, row["n_more"]) for n, row in zip(more, mine, strict=True)]
        if any(more):
            rows.append((words.say("design_more"), *(n or "–" for n in more)))
        caption = f"{words.say(each.kind)} {each.place_id}, {words.say('n_logs')}: {each.log_id.size}"
        parts.append(table(head, rows, caption))
    return parts


def design_cells(rows: Sequence[Mapping[str, Any]], words: Words) -> list[str]:
    """``310 (250 to 420)`` for each percentile of a quantity; a dash for one that cannot be shown."""
    return [with_interval(row["value"], row["ci_low"], row["ci_high"], words) for row in rows]


def design_cell(row: Mapping[str, Any], more: str, words: Words) -> Any:
    """``310 (250 to 420)``; if it cannot be shown, the number of additional hits or logs needed (``more``), on as many
    lines as the column needs.
    """
    (shown,) = design_cells([row], words)
    return remarked(shown, words.say(more, n=int(row["n_more"]))) if row["n_more"] else shown


def spread(source: ReportedRun, drawings: Mapping[str, Drawing], words: Words) -> Parts:
    records = source.summary["spread"]
    head = [words.say(each) for each in ("release", "counted", "left_out", "spread_deg", "p05_p95_deg")]
    rows = [
        (
            each["release_id"],
            each["n"] - each["n_left_out"],
            each["n_left_out"],
            whole(each["spread_deg"]),
            middle_of(each, words),
        )
        for each in records
    ]
    shown = element("p", words.say("spread_none"))
    if "spread" in drawings:
        shown = element("div", figure_of(drawings["spread"]), class_="rose")
    return [shown, table(head, rows), element("p", words.say("spread_note"), class_="quiet")]


def middle_of(record: Mapping[str, Any], words: Words) -> Any:
    """The range from 5 to 95 % with its interval; runs of an older version have the value alone."""
    if record.get("p05_p95_n_more"):
        return remarked("–", words.say("more_logs", n=int(record["p05_p95_n_more"])))
    if "p05_p95_n_more" not in record:
        return whole(record["p05_p95_deg"])
    value, low, high = (f"{float(record[f'p05_p95_{name}deg']):.0f}" for name in ("", "ci_low_", "ci_high_"))
    return f"{value} ({low} {words.say('to')} {high})"


def whole(value: Any) -> str:
    return "–" if value is None or not np.isfinite(value) else f"{value:.0f}"


def ways(source: ReportedRun, drawings: Mapping[str, Drawing], words: Words) -> Parts:
    names = {
        "runout_axis": "runout_m",
        "max_speed_axis": "speed_max_ms",
        "jump_axis": "jump_max_m",
        "energy_max": "energy_max_kj",
    }
    rows = []
    for phrase, column in names.items():
        label = words.say(phrase) + (" [kJ]" if column.endswith("_kj") else "")
        rows.append((label, source.runouts if column == "runout_m" else source.column(column)))
    logs = source.summary["logs"]
    counts = {name: int(count) for name, count in logs["by_stop_reason"].items() if count}
    shares = shown_shares(list(counts.values()), int(logs["released"]), words)
    ends = [(words.stop(name), n, share) for (name, n), share in zip(counts.items(), shares, strict=True)]
    return [
        figure_of(drawings.get("runout")),
        figure_of(drawings.get("distributions")),
        quantile_table(rows, words),
        table([words.say("stops"), words.say("n_logs"), words.say("layer_hits")], ends),
    ]


def profile_section(drawings: Mapping[str, Drawing], words: Words) -> Parts:
    """One figure for each trajectory, so that a printed page may end between two."""
    shown = [figure_of(each) for kind, each in drawings.items() if kind.startswith("profile_")]
    return (
        [element("div", *shown, class_="profiles"), element("p", words.say("profile_note"), class_="quiet")]
        if shown
        else []
    )


def ledgers(source: ReportedRun, words: Words) -> Parts:
    """The balances of barriers, trees, lying logs and boulders."""
    parts: Parts = []
    barriers = source.summary["barriers"]
    if barriers:
        names = ("n_reached", "n_stopped", "n_overjumped", "n_passed_beside", "n_hits")
        largest = {"energy_needed": "energy_needed_max_kj", "height_needed": "height_needed_max_m"}
        largest |= {"energy_hit": "energy_hit_max_kj", "height_hit": "height_hit_max_m"}
        head = [words.say(each) for each in ("barrier", *names, *largest)]
        columns = [shown_alike([each.get(key) for each in barriers], words, 2) for key in largest.values()]
        rows = [
            (each["barrier_id"], *(each[name] for name in names), *cells)
            for each, *cells in zip(barriers, *columns, strict=True)
        ]
        parts.append(table(head, rows))
    wood = [(name, source.summary.get(name)) for name in ("trees", "lying_logs", "blocks")]
    wood = [(name, record) for name, record in wood if record]
    if wood:
        names = ("n_total", "n_hit", "n_stopping", "n_hits", "n_stops")
        head = [words.say(each) for each in ("wood", *names, "impulse", "energy_taken")]
        taken = (
            shown_alike([record[name] for _, record in wood], words) for name in ("impulse_sum_kns", "energy_taken_kj")
        )
        rows = [
            (words.say(f"layer_{name}"), *(record[each] for each in names), impulse, energy)
            for (name, record), impulse, energy in zip(wood, *taken, strict=True)
        ]
        parts.append(table(head, rows))
    parts += above_capacity(source.summary.get("above_capacity"), words)
    if source.tree_hits is not None and len(source.tree_hits):
        top = source.tree_hits.sort_values(["n_stops", "energy_taken_kj"], ascending=False).head(TOP_TREES)
        head = [words.say(each) for each in ("tree", "n_stops", "n_hits", "energy_taken")]
        head[1:1] = [f"{words.say('scenario_dbh')} [cm]", f"{words.say('height')} [m]"]
        sizes = [shown_alike(top[name].tolist(), words) for name in ("dbh_cm", "height_m")]
        energies = shown_alike(top["energy_taken_kj"].tolist(), words)
        columns = (top["tree_id"], *sizes, top["n_stops"], top["n_hits"], energies)
        parts.append(table(head, zip(*columns, strict=True), words.say("top_trees")))
    return parts or [element("p", words.say("ledgers_none"))]


ABOVE = {"of_trees": "above_of_trees", "of_logs": "above_of_logs"}


def above_capacity(record: Mapping[str, Any] | None, words: Words) -> Parts:
    """The shares of the logs held by trees, and of those that reach a line, with a hit above the capacity of stems."""
    if not record:
        return []
    asked = [name for name in ("of_trees", "of_logs") if record[name]]
    groups = [("all", words.say("all_logs")), ("held_by_trees", words.say("held_by_trees"))]
    rows = [
        [group_name, *(shown_share(as_share(record[name][group]), words) for name in asked)]
        for group, group_name in groups
    ]
    for k, line in enumerate(record[asked[0]]["reach"]):
        shares = (shown_share(as_share(record[name]["reach"][k]), words) for name in asked)
        rows.append([f"{words.say('line')} {line['line_id']}", *shares])
    head = [words.say("n_logs"), *(words.say(ABOVE[name]) for name in asked)]
    return [table(head, rows, words.say("above_capacity")), element("p", words.say("above_note"), class_="quiet")]


def accuracy(source: ReportedRun, words: Words) -> Parts:
    facts, logs, steps = source.summary["accuracy"], source.summary["logs"], source.summary["cost"]["steps"]
    reasons = logs["by_stop_reason"]
    rows = [
        (words.say("fidelity"), facts["fidelity"]),
        (words.say("time_step"), f"{decimal(facts['time_step_s'], words)} s"),
        (words.say("spacing"), f"{decimal(facts['station_spacing_m'], words)} m"),
        (words.say("penetration"), f"{shown_number(100.0 * facts['penetration_max_m'], words, 2)} cm"),
        (words.say("energy_error"), f"{shown_number(100.0 * facts['energy_error_rel_max'], words, 2)} %"),
        (words.say("residual"), shown_number(facts["contact_residual_max"], words, 2)),
        (
            words.say("unconverged"),
            shown_number(facts.get("unconverged_steps", 0), words)
            + " "
            + words.say("of_steps", n=shown_number(steps, words)),
        ),
        (words.say("failed_logs"), reasons.get("failed", 0)),
        (words.say("left_dem_logs"), reasons.get("left_dem", 0)),
        (words.say("started_in_contact"), logs["started_in_contact"]),
        (words.say("not_run"), logs.get("not_run", 0)),
    ]
    return [left_table(rows, words.say("accuracy")), element("p", words.say("accuracy_note"), class_="quiet")]


def sections_of(
    source: ReportedRun, key: str, drawings: Mapping[str, Drawing], plan: Parts, words: Words
) -> list[tuple[str, str, Markup]]:
    """Id, title and content of each section about a run; empty ones are omitted."""
    makers: list[tuple[str, Callable[[], Parts]]] = [
        ("modelled", lambda: model_section(source, words)),
        ("map", lambda: plan),
        ("reach", lambda: reach(source, drawings, words)),
        ("arrivals", lambda: arrivals(source, drawings, words)),
        ("design", lambda: design(source, words)),
        ("tree_effect", lambda: answer_sections.tree_effect(source, drawings, words)),
        ("siting", lambda: answer_sections.siting(source, drawings, words)),
        ("intensity", lambda: answer_sections.intensity(source, drawings, words)),
        ("from_where", lambda: answer_sections.from_where(source, drawings, words)),
        ("varied", lambda: answer_sections.varied(source, drawings, words)),
        ("spread", lambda: spread(source, drawings, words)),
        ("ways", lambda: ways(source, drawings, words)),
        ("profile", lambda: profile_section(drawings, words)),
        ("ledgers", lambda: ledgers(source, words)),
        ("accuracy", lambda: accuracy(source, words)),
        ("provenance", lambda: provenance(source, words)),
    ]
    made = []
    for name, make in makers:
        if content := make():
            made.append((f"{key}-{name}", words.say(name), joined(content)))
    return made
