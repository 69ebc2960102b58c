"""The sections with the results of other tools: effect of trees, barriers, classes, origins, most influential inputs.

The tool's own remarks, and what an expert must judge, are beside its numbers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from deadwood_algorithms.params.presets import BARRIERS
from deadwood_algorithms.report.answer_figures import (
    CLASS_MAPS,
    factor_words,
    outcome_words,
    outcomes_of,
    range_words,
    swing_words,
)
from deadwood_algorithms.report.figures import Drawing
from deadwood_algorithms.report.markup import Markup, element, figure_of, remarked, table
from deadwood_algorithms.report.rounded import (
    NBSP,
    area_unit,
    decimal,
    shown_alike,
    shown_number,
    shown_share,
    with_interval,
)
from deadwood_algorithms.report.sources import ReportedRun
from deadwood_algorithms.report.words import Words

TOP = 10
LINES = 4  # for which the effect of trees is shown
Parts = list[Any]


def tree_effect(source: ReportedRun, drawings: Mapping[str, Drawing], words: Words) -> Parts:
    """The objects of each kind with the largest effect at each line, and the effect of candidates."""
    parts: Parts = []
    for layer in ("values", "planted"):
        frame = source.answers.tree_effect.get(layer)
        if frame is None or not len(frame):
            continue
        if layer == "values":
            parts += [
                element("p", words.say("tree_effect_note"), class_="quiet"),
                figure_of(drawings.get("tree_effect"), card=True),
            ]
        else:
            parts.append(element("h4", words.say("planted")))
        total = int(frame["n_total"].iloc[0])
        if total < len(source.deposits):
            parts.append(element("p", words.say("tree_effect_of_some", n=total, all=len(source.deposits))))
        for line in list(dict.fromkeys(frame["line_id"].astype(str)))[:LINES]:
            of_line = frame[frame["line_id"].astype(str) == line]
            for kind in dict.fromkeys(of_line["kind"]):
                parts += effect_of_kind(of_line[of_line["kind"] == kind], str(kind), line, words)
    return parts


def effect_of_kind(rows: Any, kind: str, line: str, words: Words) -> Parts:
    keep, bring = int((rows["gain_logs"] > 0).sum()), int((rows["gain_logs"] < 0).sum())
    what = words.say_or(f"kind_{kind}", kind)
    paragraph = element("p", words.say("tree_effect_counts", line=line, n=len(rows), what=what, keep=keep, bring=bring))
    best = rows[rows["gain_logs"] > 0].sort_values("rank").head(TOP)
    if not keep and not bring:
        return [paragraph, element("p", words.say("tree_effect_none", line=line))]
    head = [words.say(each) for each in ("thing", "gain_logs", "gain_points", "n_stops", "energy_taken")]
    energies = shown_alike(best["energy_taken_kj"].astype(float).tolist(), words)
    cells = [
        (
            str(row["id"]),
            int(row["gain_logs"]),
            points(row["gain_p"], row["ci_low"], row["ci_high"], words),
            int(row["stopped"]),
            energy,
        )
        for row, energy in zip(best.to_dict("records"), energies, strict=True)
    ]
    return [paragraph, table(head, cells)] if cells else [paragraph]


def points(value: float, low: float, high: float, words: Words) -> str:
    """A difference of shares in points, with its sign and interval."""
    return with_interval(100.0 * value, 100.0 * low, 100.0 * high, words, signed=True)


def siting(source: ReportedRun, drawings: Mapping[str, Drawing], words: Words) -> Parts:
    """The chosen barriers, and the single candidates that no other one beats."""
    if "site-barriers" not in source.answers.folders:
        return []
    facts = source.answers.folders["site-barriers"][1]
    now = words.say("siting_now", share=shown_share(facts["reach"], words), n=facts["candidates"])
    parts: Parts = [element("p", now), figure_of(drawings.get("siting"), card=True)]
    chosen = [row for row in facts["rows"] if row["step"]]
    if not chosen:
        parts.append(element("p", words.say("siting_none")))
    best = [row for row in facts["rows"] if row["pareto"] == "yes"]
    names = (
        "length_height",
        "still_reach",
        "kept_away",
        "n_stopped",
        "n_overjumped",
        "energy_needed_p95",
        "height_needed_p95",
    )
    head = [words.say("barrier"), words.say("tested_how"), *(words.say(each) for each in names)]
    classed = any(row.get("barrier_class") for row in [*chosen, *best])
    head += [words.say("barrier_class")] if classed else []
    cells = []
    for row in [*chosen, *best]:
        size = f"{shown_number(round(row['length_m'], 2), words)}{NBSP}×{NBSP}{shown_number(row['height_m'], words)}"
        cells.append(
            [
                place_of(row, words),
                words.say("chosen", step=row["step"]) if row["step"] else words.say("alone"),
                size,
                shown_share(row, words),
                points(row["gain_p"], row["gain_ci_low"], row["gain_ci_high"], words),
                int(row["n_stopped"]),
                int(row["n_overjumped"]),
                needed_of(row, "energy", "kj", words),
                needed_of(row, "height", "m", words),
                *([class_of(row)] if classed else []),
            ]
        )
    parts += [table(head, cells), element("p", words.say("siting_note"), class_="quiet")]
    named = source.answers.folders["site-barriers"][2]
    if classed and (found := BARRIERS.get(str(named.get("barrier_classes")))):
        note = words.say("class_note", name=found.name, source=found.source)
        parts.append(element("p", note, class_="quiet"))
    return parts


def place_of(row: Mapping[str, Any], words: Words) -> str:
    """A barrier's name; of one that the tool placed, whose size has a column of its own, where it is."""
    if not row.get("place"):
        return str(row["barrier_id"])
    return words.say("candidate_place", above=decimal(row["above_m"], words), k=row["place"])


def needed_of(row: Mapping[str, Any], quantity: str, unit: str, words: Words) -> Any:
    """What the place of a barrier needs, with its interval or how many logs are missing for one."""
    ends = ("p95", "ci_low", "ci_high")
    value, low, high = (number(row.get(f"{quantity}_needed_{name}_{unit}")) for name in ends)
    if row.get("n_come") and row["n_more"]:
        return remarked("–", words.say("more_hits", n=int(row["n_more"])))
    return with_interval(value, low, high, words)


def class_of(row: Mapping[str, Any]) -> str:
    low, high = row.get("barrier_class") or "–", row.get("barrier_class_high") or "?"
    return low if low in (high, "–") else f"{low}–{high}"


def number(value: Any) -> float:
    return float("nan") if value is None else float(value)


def intensity(source: ReportedRun, drawings: Mapping[str, Drawing], words: Words) -> Parts:
    """Maps of the classes, their areas, and the lines by minimum energy."""
    if "map-intensity" not in source.answers.folders:
        return []
    facts = source.answers.folders["map-intensity"][1]
    parts: Parts = []
    for name, (title, _) in CLASS_MAPS.items():
        mine = [each for each in facts["classes"] if each["map"] == name]
        if not mine:
            continue
        parts += [element("h4", words.say(title)), figure_of(drawings.get(name), card=True)]
        ground = [number(each["area_m2"]) for each in mine]
        unit, size = area_unit([each for each in ground if np.isfinite(each)])
        areas = shown_alike([each / size for each in ground], words)
        rows = [[words.of_class(each), area] for each, area in zip(mine, areas, strict=True)]
        head = [words.say(title), f"{words.say('class_ground')} [{unit}]"]
        if "at_least_m2" in mine[0]:
            head.append(f"{words.say('class_and_above')} [{unit}]")
            for row, each in zip(rows, mine, strict=True):
                area, low, high = (number(each[f"at_least_{end}m2"]) / size for end in ("", "ci_low_", "ci_high_"))
                ends = {"low": shown_number(low, words, 2), "high": shown_number(high, words, 2)}
                between = np.isfinite(low) and not np.isfinite(area)  # an area that needs more logs has its interval
                row.append(words.say("from_to", **ends) if between else with_interval(area, low, high, words))
        parts.append(table(head, rows))
        if needed := [each["n_needed"] for each in mine if each["area_m2"] is None and each["n_needed"]]:
            parts.append(element("p", words.say("area_needs", n=max(needed)), class_="quiet"))
        if name == "intensity" and (least := facts.get("least_passage")):
            say = "least_passage" if least["share"] else "largest_energy"
            parts.append(element("p", words.say(say, share=shown_number(100 * least["share"], words)), class_="quiet"))
    timed = any("return_period_years" in row for row in facts["lines"])
    head = [words.say(each) for each in ("line", "at_least", "n_reach", "layer_hits")]
    head += [words.say("return_period")] if timed else []
    rows = [
        [row["line_id"], decimal(row["at_least_kj"], words), int(row["n_reach"]), shown_share(row, words)]
        + ([period_of(row, words)] if timed else [])
        for row in facts["lines"]
        if row["n_reach"] is not None
    ]
    parts += [table(head, rows)] if rows else []
    share = f"{shown_number(100.0 * facts['no_hit']['p_high'], words, 2)}{NBSP}%"
    parts.append(element("p", words.say("no_hit", share=share), class_="quiet"))
    parts.append(element("p", words.say("intensity_rule"), class_="quiet"))
    return parts


def period_of(row: Mapping[str, Any], words: Words) -> str:
    """A return period with its interval; the lower end accounts for chance and for logs that left the terrain model
    before.
    """
    years, low, high = (number(row.get(f"return_{name}_years")) for name in ("period", "ci_low", "ci_high"))
    low = number(row.get("return_ci_low_years_if_lost", low))  # older results lack it
    if not np.isfinite(years):
        return words.say("longer_than", years=shown_number(low, words, 2))
    if not np.isfinite(high):
        return f"{shown_number(years, words)} ({words.say('longer_than', years=shown_number(low, words, 2))})"
    return with_interval(years, low, high, words)


def from_where(source: ReportedRun, drawings: Mapping[str, Drawing], words: Words) -> Parts:
    """The map of the shares, the areas from which at least a given share reach a line, and the areas that are
    passed.
    """
    if "map-origins" not in source.answers.folders:
        return []
    facts = source.answers.folders["map-origins"][1]
    note = words.say("from_where_note", n=facts["logs"], cell=decimal(facts["cell_m"], words), least=facts["least"])
    parts: Parts = [figure_of(drawings.get("from_where"), note, card=True)]
    only = len({row["line_id"] for row in facts["reach"]}) == 2  # with one line, "any line" would repeat it
    mine = [row for row in facts["sources"] if not (only and row["line_id"] == "any line")]
    if mine:
        names = [words.say("any_line") if row["line_id"] == "any line" else row["line_id"] for row in mine]
        parts.append(area_table("line", names, mine, "reach_it", [shown_share(row, words) for row in mine], words))
    if mine := facts["affected"][: 4 * TOP]:
        names = [str(row["release_id"]) for row in mine]
        logs = [int(row["n_logs"]) for row in mine]
        parts.append(area_table("release", names, mine, "n_logs", logs, words, words.say("affected")))
    return parts


def area_table(
    what: str,
    names: Sequence[str],
    rows: Sequence[Mapping[str, Any]],
    last: str,
    values: Sequence[Any],
    words: Words,
    caption: str | None = None,
) -> Markup:
    """The ground with at least a given share, of each line or release."""
    unit, size = area_unit([row["area_m2"] for row in rows])
    areas = shown_alike([row["area_m2"] / size for row in rows], words)
    least = [f"{shown_number(100.0 * row['least_p'], words)}{NBSP}%" for row in rows]
    head = [words.say(what), words.say("at_least_share"), f"{words.say('class_ground')} [{unit}]", words.say(last)]
    return table(head, zip(names, least, areas, values, strict=True), caption)


def varied(source: ReportedRun, drawings: Mapping[str, Drawing], words: Words) -> Parts:
    """The sentence of each outcome, its tornado, and its numbers."""
    if "vary" not in source.answers.folders:
        return []
    facts = source.answers.folders["vary"][1]
    answers = {each["outcome"]: each for each in facts["answers"]}
    items = [element("li", influence_words(answers[name], words)) for name in outcomes_of(facts) if name in answers]
    note = words.say("varied_note", n=facts["logs"], runs=facts["runs"], fidelity=facts.get("fidelity", "?"))
    parts: Parts = [element("ul", *items), element("p", note, class_="quiet")]
    if apart := source.answers.varied_apart:
        names = ", ".join(words.say_or(f"input_{each}", each) for each in apart)
        parts.insert(0, element("p", words.say("varied_apart", names=names), class_="warning"))
    totals = {
        (row["outcome"], row["factor"]): row for row in facts["indices"] if np.isfinite(number(row["total"]))
    }  # if any variance remains after subtracting the logs' noise
    head = [words.say(each) for each in ("factor", "range", "low_end", "as_it_is", "high_end", "swing")]
    head += [words.say("total_effect")] if totals else []
    for k, name in enumerate(outcomes_of(facts)):
        scale = 100.0 if name.startswith("reach_") else 1.0
        rows = []
        for row in (r for r in facts["tornado"] if r["outcome"] == name):
            ends = shown_alike([scale * row[each] for each in ("at_low", "as_it_is", "at_high")], words)
            swing = swing_words(row, scale, words)
            between = range_words(row, words)
            whole = between if " / " in between else element("span", between)  # not torn at its dash
            cells = [factor_words(row["factor"], words), whole, *ends, swing]
            if totals:
                index = totals.get((name, row["factor"]), {})
                low, high = number(index.get("total_ci_low")), number(index.get("total_ci_high"))
                cells.append(with_interval(number(index.get("total")), low, high, words))
            rows.append(cells)
        parts += [figure_of(drawings.get(f"varied_{k}")), table(head, rows, outcome_words(name, words))]
    return parts


def influence_words(answer: Mapping[str, Any], words: Words) -> str:
    """The sentence that names an outcome's most influential inputs, or states that there are too few logs to decide."""
    outcome = outcome_words(answer["outcome"], words).rpartition(" [")[0]
    outcome = outcome[:1].upper() + outcome[1:]
    if not answer["factors"]:
        return words.say("no_index" if answer["by"] == "total" else "no_influence", outcome=outcome)
    factors = ", ".join(factor_words(each, words) for each in answer["factors"])
    name = "most_influential" if answer["decided"] else "influence_undecided"
    return words.say(name, outcome=outcome, factors=factors)
