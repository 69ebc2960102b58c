"""The first pages of the report, those that are signed: question, scenario, conclusion, numbers, map, judgement.

Evidence and provenance are in the annex (`page`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from deadwood_algorithms.report.compared import Comparison
from deadwood_algorithms.report.markup import Markup, element, remarked, table
from deadwood_algorithms.report.rounded import (
    decimal,
    percent_if_lost,
    shown_number,
    shown_share,
    shown_shares,
    with_interval,
)
from deadwood_algorithms.report.scenario_box import posture_words, scenario_box, span_words
from deadwood_algorithms.report.sections import calculation_words, design_cell, warnings_of
from deadwood_algorithms.report.sources import ReportedRun
from deadwood_algorithms.report.words import Words
from deadwood_algorithms.results.friction_band import LineBand, band_of_line
from deadwood_algorithms.results.passages import UNITS, design_rows
from deadwood_algorithms.stats.order_statistics import percentile_record
from deadwood_algorithms.stats.statistics import loss_matters

MOST_LINES = 4  # rows in the tables; the annex has all lines
LEVEL = 0.95  # percentile of the energies and heights of arrival
Parts = list[Any]


def signed_pages(
    sources: Sequence[ReportedRun],
    compared: Comparison | None,
    plan: Parts,
    apart: Markup,
    words: Words,
    author: str | None,
    project: str | None,
) -> Markup:
    """All sections of these pages; ``plan`` is the map, ``apart`` those of the differences."""
    parts: Parts = [element("h2", words.say("question"), id="question"), element("p", question(sources, words))]
    parts += scenario_box(list(sources), words, author, project)
    parts += [element("h2", words.say("conclusion"), id="conclusion"), *conclusion(sources, compared, words)]
    parts += [element("h2", words.say("numbers"), id="numbers"), numbers_table(sources, words)]
    if compared is not None and any(row.quantity == "reach" for row in compared.rows):
        parts.append(element("h3", words.say("comparison")))
        parts.append(element("p", words.say("comparison_note", reference=sources[0].name), class_="quiet"))
        parts.append(differences_table(compared, [each.name for each in sources], words))
    parts.append(apart)
    parts += [element("h2", words.say("map"), id="map"), *plan]
    judged = [element("h2", words.say("judgement"), id="judgement"), *judgement(sources, words)]
    parts.append(element("div", *judged, signature(words, author), class_="keep"))
    return element("section", *parts, class_="signed")


def question(sources: Sequence[ReportedRun], words: Words) -> str:
    """The question that the run answers."""
    one = sources[0]
    releases = list(dict.fromkeys(one.deposits["release_id"].astype(str)))
    where = (
        words.say("release_area", name=releases[0])
        if len(releases) == 1
        else words.say("release_areas", n=len(releases))
    )
    names = [words.say("quoted", name=str(each["line_id"])) for each in one.summary["reach"]]
    shown = names[:4] + (["…"] if len(names) > 4 else [])
    lines = f" {words.say('and')} ".join([", ".join(shown[:-1]), shown[-1]]) if len(shown) > 1 else "".join(shown)
    released = shown_number(one.summary["logs"]["released"], words)
    if names:
        return words.say("question_lines", n=released, where=where, lines=lines)
    return words.say("question_none", n=released, where=where)


def conclusion(sources: Sequence[ReportedRun], compared: Comparison | None, words: Words) -> Parts:
    """The answer, one sentence for each line and run and for each difference, and what the intervals do not cover."""
    answers = []
    for source in sources:
        before = f"{source.name} – " if len(sources) > 1 else ""
        for each in source.summary["reach"][:12]:
            share = shown_share(each, words)
            band = band_of_line(source.summary, each["line_id"])
            answer = words.say("answer", line=each["line_id"], share=f"{share} {words.say('of_logs')}")
            if band:
                answer = band_words(band, share, words)
            if each.get("n_lost") and loss_matters(each):
                answer += words.say("answer_lost", n=each["n_lost"], bounds=percent_if_lost(each, words))
            answers.append(element("li", before + answer))
        if not source.summary["reach"]:
            logs = source.summary["logs"]
            counts = {name: int(count) for name, count in logs["by_stop_reason"].items() if count}
            shares = shown_shares(list(counts.values()), int(logs["released"]), words)
            ends = ", ".join(f"{words.stop(name)} {share}" for name, share in zip(counts, shares, strict=True))
            answers.append(element("li", before + ends))
    parts: Parts = [element("ul", *answers, class_="answers answer")]
    if differences := [*idle_words(sources, words), *difference_words(sources, compared, words)]:
        parts.append(element("ul", *(element("li", each) for each in differences), class_="answers"))
    parts += warnings_of(sources, words)
    if assumed := assumed_words(sources, words):
        error = calculation_words(sources[0].summary["accuracy"], sources[0].run.manifest.get("parameters", {}), words)
        phrase = "limits_band" if all(source.summary.get("friction_band") for source in sources) else "limits"
        parts.append(element("p", words.say(phrase, error=error, **assumed)))
    return parts


def idle_words(sources: Sequence[ReportedRun], words: Words) -> list[str]:
    """Barriers that no log reaches, which therefore change nothing."""
    before = (f"{each.name} – " if len(sources) > 1 else "" for each in sources)
    there = ((name, each.summary["barriers"]) for name, each in zip(before, sources, strict=True))
    return [
        name + words.say("answer_idle", n=len(barriers))
        for name, barriers in there
        if barriers and not any(each["n_reached"] for each in barriers)
    ]


def difference_words(sources: Sequence[ReportedRun], compared: Comparison | None, words: Words) -> list[str]:
    """One sentence for each scenario and line: the difference to the first one, and to the one before; whether these
    logs show one.
    """
    if compared is None:
        return []
    reference, found = sources[0].name, []
    rows = [(reference, row) for row in compared.rows if row.quantity == "reach" and row.scenario != reference]
    for before, row in [*rows, *compared.steps]:
        value, low, high = (100.0 * each for each in (row.difference, row.diff_ci_low, row.diff_ci_high))
        shown = row.diff_ci_low > 0.0 or row.diff_ci_high < 0.0
        filled = {"name": row.scenario, "reference": before, "line": row.item}
        change = with_interval(value, low, high, words, signed=True)
        found.append(words.say("answer_difference" if shown else "answer_alike", change=change, **filled))
    return found


def band_words(band: LineBand, share: str, words: Words) -> str:
    """The reach over the plausible friction, then at that of the run, and in another posture."""
    low, high = (words.signs(each) for each in band.shares())
    low_friction, high_friction = (decimal(each, words) for each in band.frictions)
    answer = words.say(
        "answer_band" if low != high else "answer_band_one",
        line=band.own["line_id"],
        low=low,
        high=high,
        low_friction=low_friction,
        high_friction=high_friction,
        friction=decimal(band.own["friction"], words),
        share=share,
    )
    for each in band.postures:
        value, low, high = (100.0 * each[name] for name in ("p", "ci_low", "ci_high"))
        ends = with_interval(value, low, high, words)
        answer += words.say("answer_posture", posture=words.say(f"posture_{each['posture']}"), share=ends)
    return answer


def assumed_words(sources: Sequence[ReportedRun], words: Words) -> dict[str, str]:
    """The friction and posture of the runs, each once; empty for runs of an older version, which do not record them."""
    scenarios = [source.summary["scenario"] for source in sources if "scenario" in source.summary]
    frictions = dict.fromkeys(span_words(each["friction"], words) for each in scenarios)
    postures = dict.fromkeys(posture_words(each["logs"]["posture"], words) for each in scenarios)
    return {"friction": " / ".join(frictions), "posture": " / ".join(postures)} if scenarios else {}


def numbers_table(sources: Sequence[ReportedRun], words: Words) -> Markup:
    """The runs side by side: reach, energies and heights of arrival, how logs ended, run-out."""
    rows: list[list[Any]] = []
    for k, each in enumerate(sources[0].summary["reach"][:MOST_LINES]):
        line = str(each["line_id"])
        records = [source.summary["reach"][k] if k < len(source.summary["reach"]) else None for source in sources]
        shares = [shown_share(record, words) if record else "–" for record in records]
        rows.append([words.say("quantity_reach", item=line), *shares])
        for quantity in ("energy", "height_needed"):
            cells = [arriving(source, line, quantity, words) for source in sources]
            if any(cell != "–" for cell in cells):
                label = words.say(f"arriving_{quantity}", line=line, level=shown_number(100.0 * LEVEL, words))
                rows.append([f"{label} [{UNITS[quantity]}]", *cells])
    reasons = list(sources[0].summary["logs"]["by_stop_reason"])
    ends = []
    for logs in (source.summary["logs"] for source in sources):
        counts = [int(logs["by_stop_reason"].get(reason, 0)) for reason in reasons]
        ends.append(zip(counts, shown_shares(counts, int(logs["released"]), words), strict=True))
    for reason, cells in zip(reasons, zip(*ends, strict=True), strict=True):
        if any(count for count, _ in cells):
            rows.append([words.stop(reason), *(share for _, share in cells)])
    for phrase, level in (("item_median", 0.5), ("item_p95", 0.95)):
        cells = [
            design_cell(percentile_record(far, level), "more_logs", words) if far.size else "–"
            for far in (source.runouts for source in sources)
        ]
        rows.append([f"{words.say('quantity_runout', item=words.say(phrase))} [m]", *cells])
    head = [words.say("quantity"), *(source.name for source in sources)]
    return table(head if len(sources) > 1 else [words.say("quantity"), words.say("value")], rows)


def arriving(source: ReportedRun, line: str, quantity: str, words: Words) -> Any:
    """The percentile of what arrives at a line, with its interval; a dash if it is unknown."""
    for each in source.passages:
        if each.kind == "line" and each.place_id == line and each.log_id.size:
            for row in design_rows(each, (LEVEL,), 0.95):
                if row["quantity"] == quantity and row["n"]:
                    return design_cell(row, "more_logs", words)
    return "–"


def differences_table(compared: Comparison, names: Sequence[str], words: Words) -> Markup:
    """The paired differences of the reach to the first run, in points, and the relative reduction of the reach."""
    bari = {(row.scenario, row.item): row for row in compared.rows if row.quantity == "bari"}
    body = []
    for row in compared.rows:
        if row.quantity != "reach" or row.scenario == names[0]:
            continue
        change = with_interval(
            100.0 * row.difference, 100.0 * row.diff_ci_low, 100.0 * row.diff_ci_high, words, signed=True
        )
        fewer = bari.get((row.scenario, row.item))
        kept: Any = "–"
        if fewer and fewer.n_more:
            kept = remarked("–", words.say("more_hits", n=fewer.n_more))
        elif fewer:
            kept = with_interval(100.0 * fewer.value, 100.0 * fewer.ci_low, 100.0 * fewer.ci_high, words)
        body.append([row.scenario, row.item, change, kept])
    head = [words.say(each) for each in ("scenario_column", "line", "difference_points", "fewer_share")]
    return table(head, body)


def judgement(sources: Sequence[ReportedRun], words: Words) -> Parts:
    """What a run cannot answer."""
    scenarios = [source.summary["scenario"] for source in sources if "scenario" in source.summary]
    points = [words.say("judge_start")]
    if assumed := assumed_words(sources, words):
        points.append(words.say("judge_friction", **assumed))
    if any(each["trees"]["n"] for each in scenarios):
        points.append(words.say("judge_trees"))
    if any(each["barriers"]["n"] for each in scenarios):
        points.append(words.say("judge_barriers"))
    points.append(words.say("judge_terrain", cell=decimal(sources[0].dem_cell, words)))
    points.append(words.say("judge_risk"))
    return [element("ul", *(element("li", each) for each in points))]


def signature(words: Words, author: str | None) -> Markup:
    """Space for place, date, name and signature."""
    cells = [("sign_place", ""), ("sign_date", ""), ("sign_name", author or ""), ("sign_signature", "")]
    return element(
        "div",
        *(
            element("div", element("span", value, class_="written"), element("span", words.say(name), class_="quiet"))
            for name, value in cells
        ),
        class_="signature",
    )
