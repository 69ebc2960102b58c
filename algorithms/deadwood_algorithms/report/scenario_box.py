"""The box at the top of the report: the logs and the scene, with the values that took effect."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Any, NamedTuple

from deadwood_algorithms.report.markup import Markup, element, scrolled
from deadwood_algorithms.report.rounded import decimal, in_signs, shown_number
from deadwood_algorithms.report.sections import Parts
from deadwood_algorithms.report.sources import ReportedRun
from deadwood_algorithms.report.words import Words
from deadwood_algorithms.schemas.obstacles import OBSTACLES
from deadwood_algorithms.stats.statistics import alike

SELDOM = ("model_stumps", "model_lying_logs", "model_blocks", "model_lines")  # no row in the box if no run has any


def made_at(manifest: Mapping[str, Any]) -> str:
    """``2026-11-25 19:44``: when the run began."""
    made = manifest.get("made_utc")
    return element("span", f"{datetime.fromisoformat(made):%Y-%m-%d %H:%M}", class_="whole") if made else "–"


def cells_of(cells: list[str]) -> list[Markup]:
    """One cell for each run, or one across all if they are equal."""
    if len(set(cells)) == 1:
        return [element("td", cells[0], colspan=str(len(cells)))]
    return [element("td", each) for each in cells]


def posture_words(shares: Mapping[str, float], words: Words) -> str:
    """``upright``, or each posture with its share."""
    there = {name: share for name, share in shares.items() if share}
    if len(there) == 1:
        return words.say(f"posture_{next(iter(there))}")
    return ", ".join(
        f"{words.say(f'posture_{name}')} {shown_number(100.0 * share, words)} %" for name, share in there.items()
    )


def span_words(values: Any, words: Words, unit: str = "") -> str:
    """``45 cm``, or ``45 cm (32 to 61)`` where the values differ."""
    if not isinstance(values, Mapping):
        return decimal(values, words)
    if values["median"] is None:
        return "–"
    if values["low"] == values["high"]:
        return f"{decimal(values['median'], words)} {unit}".strip()
    middle, low, high = (in_signs(each, words) for each in alike([values[name] for name in ("median", "low", "high")]))
    return f"{f'{middle} {unit}'.strip()} ({low} {words.say('to')} {high})"


def terrain_words(source: ReportedRun, words: Words) -> str:
    """Cells of the terrain model, and the date of its file, if the run recorded it."""
    dem = source.summary["scenario"]["dem"]
    cells = words.say("scenario_cells", nx=dem["nx"], ny=dem["ny"], cell=decimal(dem["cell_m"], words))
    day = str(source.run.manifest.get("modified_utc", {}).get("dem", ""))[:10]
    return f"{cells}, {words.say('scenario_file_of', day=day)}" if day else cells


class ScenarioRow(NamedTuple):
    """A property of the scenario (a phrase's name), its value in words, and whether it exists."""

    phrase: str
    value: str
    there: bool = True


def scenario_rows(scenario: Mapping[str, Any], words: Words) -> list[ScenarioRow]:
    """The rows for one run."""

    def things(name: str, *sizes: tuple[str, str, str]) -> str:
        each = scenario.get(name, {"n": 0})  # older runs know no stumps
        shown = [shown_number(each["n"], words)]
        shown += [
            f"{words.say(phrase)} {span_words(each[size], words, unit)}" for size, phrase, unit in sizes if size in each
        ]
        return ", ".join(shown)

    dbh, length = ("dbh_cm", "scenario_dbh", "cm"), ("length_m", "scenario_length", "m")
    known = {
        "dbh_cm": dbh,
        "height_m": ("height_m", "scenario_height", "m"),
        "capacity_kj": ("capacity_kj", "scenario_capacity", "kJ"),
    }
    rolling = scenario["rolling_friction"]
    obstacles = {each.key: [known[size] for size in each.sizes] for each in OBSTACLES} | {"lines": []}
    return [
        ScenarioRow("model_logs", things("logs", length, dbh, ("density_kg_m3", "scenario_density", "kg/m³"))),
        ScenarioRow("scenario_posture", posture_words(scenario["logs"]["posture"], words)),
        ScenarioRow("model_friction", span_words(scenario["friction"], words)),
        ScenarioRow(
            "model_rolling_friction", "–" if rolling is None else span_words(rolling, words), rolling is not None
        ),
        ScenarioRow("model_restitution", span_words(scenario["restitution"], words)),
        *(
            ScenarioRow(f"model_{name}", things(name, *sizes), scenario.get(name, {"n": 0})["n"] > 0)
            for name, sizes in obstacles.items()
        ),
        ScenarioRow("scenario_fidelity", str(scenario["fidelity"])),
        ScenarioRow("scenario_seed", str(scenario["seed"])),
    ]


def scenario_box(sources: list[ReportedRun], words: Words, author: str | None, project: str | None) -> Parts:
    """The scenarios, side by side for several runs, with the values that took effect: columns override options."""
    with_scenario = [source for source in sources if "scenario" in source.summary]
    if not with_scenario:
        return []
    of_runs = [
        [
            *scenario_rows(source.summary["scenario"], words),
            ScenarioRow("model_terrain", terrain_words(source, words)),
            ScenarioRow("scenario_made", made_at(source.run.manifest)),
            ScenarioRow("engine_digest", str(source.run.manifest.get("engine", "–"))[:12]),
        ]
        for source in with_scenario
    ]
    whose = [(words.say(name), value) for name, value in (("project", project), ("author", author)) if value]
    body = [
        element("tr", element("th", name, scope="row"), element("td", value, colspan=str(len(with_scenario))))
        for name, value in whose
    ]
    for rows in zip(*of_runs, strict=True):
        phrase = rows[0].phrase
        if phrase not in SELDOM or any(each.there for each in rows):
            cells = cells_of([each.value for each in rows])
            body.append(element("tr", element("th", words.say(phrase), scope="row"), *cells))
    head = (
        [
            element(
                "thead",
                element("tr", element("td", ""), *(element("th", each.name, scope="col") for each in with_scenario)),
            )
        ]
        if len(with_scenario) > 1
        else []
    )
    kind = "words" if len(with_scenario) > 1 else "words pairs"
    return [
        element("h2", words.say("scenario"), id="scenario"),
        scrolled(element("table", *head, element("tbody", *body), class_=kind), words.say("scenario")),
    ]
