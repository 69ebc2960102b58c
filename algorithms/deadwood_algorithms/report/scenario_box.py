"""The box at the head of the report: what was slid through what, as it took effect."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from deadwood_algorithms.report.markup import element
from deadwood_algorithms.report.rounded import decimal, shown_number
from deadwood_algorithms.report.sections import Parts
from deadwood_algorithms.report.sources import ReportedRun
from deadwood_algorithms.report.words import Words


def made_at(manifest: Mapping[str, Any]) -> str:
    """``2026-11-25 19:44``: when the run began."""
    told = manifest.get("made_utc")
    return datetime.fromisoformat(told).strftime("%Y-%m-%d %H:%M") if told else "–"


def scenario_box(sources: list[ReportedRun], words: Words, author: str | None, project: str | None) -> Parts:
    """What was asked, beside each other for several runs, as it took effect: columns before options."""
    told = [(source, source.summary["scenario"]) for source in sources if "scenario" in source.summary]
    if not told:
        return []

    def span(values: Any, unit: str = "") -> str:
        if not isinstance(values, Mapping):
            return decimal(values, words)
        if values["median"] is None:
            return "–"
        middle, low, high = (decimal(values[name], words) for name in ("median", "low", "high"))
        shown = f"{middle} {unit}".strip()
        return shown if low == high else f"{shown} ({low} {words.say('to')} {high})"

    def things(each: Mapping[str, Any], *sizes: tuple[str, str, str]) -> str:
        shown = [shown_number(each["n"], words)]
        shown += [f"{words.say(phrase)} {span(each[name], unit)}" for name, phrase, unit in sizes if name in each]
        return ", ".join(shown)

    dbh, length, height = (("dbh_cm", "scenario_dbh", "cm"), ("length_m", "scenario_length", "m"),
                           ("height_m", "scenario_height", "m"))  # fmt: skip
    density = ("density_kg_m3", "scenario_density", "kg/m³")
    rows = [
        (words.say("model_logs"), [things(each["logs"], length, dbh, density) for _, each in told]),
        (
            words.say("scenario_posture"),
            [
                ", ".join(
                    f"{words.say(f'posture_{name}')} {shown_number(100.0 * share, words)} %"
                    for name, share in each["logs"]["posture"].items()
                    if share
                )
                for _, each in told
            ],
        ),
        (words.say("model_friction"), [span(each["friction"]) for _, each in told]),
        (
            words.say("model_rolling_friction"),
            ["–" if each["rolling_friction"] is None else span(each["rolling_friction"]) for _, each in told],
        ),
        (words.say("model_restitution"), [span(each["restitution"]) for _, each in told]),
        (words.say("model_trees"), [things(each["trees"], dbh, height) for _, each in told]),
        (words.say("model_barriers"), [things(each["barriers"], height) for _, each in told]),
        *(
            (words.say(f"model_{name}"), [things(each[name]) for _, each in told])
            for name in ("lying_logs", "blocks", "lines")
            if any(each[name]["n"] for _, each in told)
        ),
        (
            words.say("model_terrain"),
            [
                words.say(
                    "scenario_cells",
                    nx=each["dem"]["nx"],
                    ny=each["dem"]["ny"],
                    cell=decimal(each["dem"]["cell_m"], words),
                )
                for _, each in told
            ],
        ),
        (words.say("scenario_fidelity"), [str(each["fidelity"]) for _, each in told]),
        (words.say("scenario_seed"), [str(each["seed"]) for _, each in told]),
        (words.say("scenario_made"), [made_at(source.run.manifest) for source, _ in told]),
        (words.say("engine_digest"), [str(source.run.manifest.get("engine", "–"))[:12] for source, _ in told]),
    ]
    whose = [(words.say(name), value) for name, value in (("project", project), ("author", author)) if value]
    body = [
        element("tr", element("th", name, scope="row"), element("td", value, colspan=str(len(told))))
        for name, value in whose
    ]
    body += [
        element("tr", element("th", name, scope="row"), *(element("td", each) for each in cells))
        for name, cells in rows
    ]
    head = (
        [
            element(
                "thead",
                element("tr", element("th", ""), *(element("th", source.name, scope="col") for source, _ in told)),
            )
        ]
        if len(told) > 1
        else []
    )
    return [
        element("h2", words.say("scenario"), id="scenario"),
        element("div", element("table", *head, element("tbody", *body), class_="words"), class_="scroll"),
    ]
