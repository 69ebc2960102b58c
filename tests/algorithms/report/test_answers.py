"""The report's sections on results of other tools: their numbers are those of the files, each with its own run."""

from __future__ import annotations

import json
import re
import shutil
from html.parser import HTMLParser
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import geopandas as gpd
import numpy as np
import pandas
import pytest
from matplotlib.figure import Figure
from slope_case import Case, answers, edit_manifest

from deadwood_algorithms.evaluate.sensitivity.factors import CHOICES
from deadwood_algorithms.params.presets import BARRIERS
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.report import answer_figures
from deadwood_algorithms.report.answer_figures import factor_words, range_words
from deadwood_algorithms.report.answer_sections import place_of
from deadwood_algorithms.report.languages import LANGUAGES
from deadwood_algorithms.report.words import Words
from deadwood_algorithms.tools import make_report

SECTIONS = ("tree_effect", "siting", "intensity", "from_where", "varied")


class Shown(HTMLParser):
    """The rows of a page's tables, and its text."""

    def __init__(self, page: str) -> None:
        super().__init__(convert_charrefs=True)
        self.rows: list[list[str]] = []
        self.said: list[str] = []
        self._cell = False
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
            self._cell = True

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self._cell = False

    def handle_data(self, data):
        self.said.append(data)
        if self._cell:
            self.rows[-1][-1] += data


def page_of(run: Path, results: list[Path] | str, output: Path, **more) -> str:
    named = results if isinstance(results, str) else ",".join(map(str, results))
    make_report.TOOL(runs=str(run), results=named, output=str(output), overwrite=True, **more)
    return output.read_text(encoding="utf-8")


def part(page: str, name: str) -> str:
    """A section of a page, without the rest."""
    start = page.index(f'<h3 id="r0-{name}">')
    end = page.find('<h3 id="', start + 5)
    return page[start : end if end > 0 else len(page)]


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("answers"))


@pytest.fixture(scope="module")
def run(case) -> Path:
    return case.run(output=str(case.folder / "run"), **(case.everything() | {"barriers": None}))


@pytest.fixture(scope="module")
def results(case, run) -> dict[str, Path]:
    return answers(case, run)


@pytest.fixture(scope="module")
def page(case, run, results) -> str:
    return page_of(run, list(results.values()), case.folder / "page.html")


def area_size(head: str) -> float:
    """The unit in the header of a column of areas [m2]."""
    return {"ha": 1e4, "m²": 1.0}[head.partition("[")[2].rstrip("]")]


def is_rounded(text: str, value: float) -> bool:
    """Whether a number of the page is this value, rounded to the digits that it has, or, from 1000 on, to three."""
    half = 0.5 * 10.0 ** -len(text.partition(".")[2]) if abs(value) < 1000.0 else 5e-3 * abs(value)
    return abs(float(text.replace("\u202f", "")) - value) <= half * (1.0 + 1e-9)


def test_without_results_there_is_nothing_of_them(case, run):
    make_report.TOOL(runs=str(run), output=str(case.folder / "bare.html"))
    bare = (case.folder / "bare.html").read_text(encoding="utf-8")
    assert [name for name in SECTIONS if f'id="r0-{name}"' in bare] == []


def test_every_section_has_its_figure(page):
    for name in SECTIONS:
        assert re.search(r'<figure><div [^>]*><svg [^>]*class="figure"', part(page, name)), name
        assert f'href="#r0-{name}"' in page  # in the contents


def test_the_worth_is_that_of_the_layer(page, results):
    frame: Any = gpd.read_file(results["tree_effect"], layer="values")
    shown = Shown(part(page, "tree_effect"))
    for line in frame["line_id"].unique():
        of_line = frame[(frame["line_id"] == line) & (frame["kind"] == "tree")]
        keep, bring = (of_line["gain_logs"] > 0).sum(), (of_line["gain_logs"] < 0).sum()
        assert f"{line}, trees: {len(of_line)} in all; logs are kept away by {keep}, brought by {bring}." in shown.said
    best = frame[frame["gain_logs"] > 0].sort_values(["line_id", "rank"]).groupby("line_id").head(10)
    told = sorted((row[0], row[1]) for row in shown.rows if len(row) == 5 and row[1].isdigit())
    assert told == sorted((str(row.id), str(int(row.gain_logs))) for row in best.itertuples())
    assert len(told) > 0


def test_the_barriers_are_those_of_the_table(page, results):
    facts = json.loads((results["siting"] / "summary.json").read_text(encoding="utf-8"))
    shown = Shown(part(page, "siting"))
    wanted = [row for row in facts["rows"] if row["step"]] + [row for row in facts["rows"] if row["pareto"] == "yes"]
    told = [row for row in shown.rows if row[0] in ("long", "short") or row[0].startswith(("long", "short"))]
    assert [(row[0], int(row[5]), int(row[6])) for row in told] == [
        (row["barrier_id"], row["n_stopped"], row["n_overjumped"]) for row in wanted
    ]
    etag = BARRIERS["etag-027"]
    for row in facts["rows"]:
        low, high = (
            float("nan") if row[f"energy_needed_{end}_kj"] is None else row[f"energy_needed_{end}_kj"]
            for end in ("p95", "ci_high")
        )
        assert (row["barrier_class"], row["barrier_class_high"]) == (etag.class_of(low)[0], etag.class_of(high)[0])
    assert not any(row["barrier_class"] for row in wanted)
    for row, asked in zip(told, wanted, strict=True):
        needs = f"needs {72 - asked['n_come']} more arrivals"
        assert needs in row[7], "72 show the energy that 95 % stay below"
        assert needs in row[8]
    assert "ETAG 027" not in " ".join(shown.said)
    assert "expert" in " ".join(shown.said)


def test_the_classes_have_their_ground_and_lines_their_period(page, results):
    facts = json.loads((results["intensity"] / "classes.json").read_text(encoding="utf-8"))
    shown = Shown(part(page, "intensity"))
    sizes = {row[0]: area_size(row[1]) for row in shown.rows if len(row) in (2, 3) and "[" in row[1]}
    titles = {name: Words("en").say(title) for name, (title, _) in answer_figures.CLASS_MAPS.items()}
    size_of = {name: sizes[title] for name, title in titles.items() if title in sizes}
    ground = {row[0]: row[1] for row in shown.rows if len(row) in (2, 3)}
    above = {row[0]: row[2].split(" ")[0] for row in shown.rows if len(row) == 3}
    for each in facts["classes"]:
        if each["map"] in ("intensity", "passage", "return_class"):
            area = each["area_m2"]
            assert area is not None or each["n_needed"] is None or each["n_needed"] > facts["logs"]
            told = ground[each["meaning"]]
            assert told == "–" if area is None else is_rounded(told, area / size_of[each["map"]])
        if each["map"] == "intensity" and each["at_least_m2"] is not None:
            half = max(
                (each["at_least_ci_high_m2"] - each["at_least_ci_low_m2"]) / (2 * size_of["intensity"]), 1e-6
            )  # two digits of it are shown
            assert float(above[each["meaning"]]) == pytest.approx(
                each["at_least_m2"] / size_of["intensity"], abs=0.05 * half, rel=5e-3
            )
    assert "at least 1 % of the logs" in " ".join(shown.said).replace("\u00a0", " ")
    lines = [row for row in shown.rows if len(row) == 5][1:]
    assert [(row[0], float(row[1]), int(row[2])) for row in lines] == [
        (row["line_id"], row["at_least_kj"], row["n_reach"]) for row in facts["lines"] if row["n_reach"] is not None
    ]
    assert "expert" in " ".join(shown.said)


def test_the_ground_of_origins_is_that_of_the_facts(page, results):
    facts = json.loads((results["origins"] / "origins.json").read_text(encoding="utf-8"))
    rows = [row for row in Shown(part(page, "from_where")).rows if len(row) == 4]
    told = {(row[0], row[1], row[2]) for row in rows}
    (size,) = {area_size(row[2]) for row in rows if row[0] == "line"}
    for row in facts["sources"]:
        key = row["line_id"], f"{100 * row['least_p']:g} %"
        found = [area for line, share, area in told if (line, share.replace("\u00a0", " ")) == key]
        assert any(is_rounded(each, row["area_m2"] / size) for each in found), row


def test_the_most_influential_input_is_the_tools_answer(page, results):
    facts = json.loads((results["varied"] / "summary.json").read_text(encoding="utf-8"))
    section = part(page, "varied")
    rows = [row for row in Shown(section).rows if len(row) == 6 and row[0] in ("friction", "rolling friction")]
    assert len(rows) == len(facts["tornado"])
    swings = sorted(round(float(row[5].split(" ")[0].replace("\u2212", "-")), 0) for row in rows)
    scaled = [(100 if row["outcome"].startswith("reach_") else 1) * row["swing"] for row in facts["tornado"]]
    assert swings == pytest.approx(sorted(np.round(scaled)), abs=1.0)
    for each in facts["answers"]:
        if each["decided"]:
            assert "depends most on friction." in section


def test_the_factors_have_one_order_in_the_file_the_table_and_the_figure(page, results):
    """One for all outcomes, which is not the order in which they were asked; so has vary's own picture and its lines
    (`tests/algorithms/evaluate/sensitivity/test_answer.py`)."""
    facts = json.loads((results["varied"] / "summary.json").read_text(encoding="utf-8"))
    table = pandas.read_csv(results["varied"] / "tornado.csv")
    shown = [row[0] for row in Shown(part(page, "varied")).rows if row and row[0] in ("friction", "rolling friction")]
    outcomes = answer_figures.outcomes_of(facts)
    assert len(outcomes) > 1
    order = ["friction", "rolling_friction"]  # of the line whose sentence is given for all
    words = [factor_words(each, Words("en")) for each in order]
    for k, outcome in enumerate(outcomes):
        (axes,) = answer_figures.tornado_figure(facts, outcome, Words("en")).axes
        assert list(table.loc[table["outcome"] == outcome, "factor"]) == order
        assert shown[k * len(words) : (k + 1) * len(words)] == words
        assert [each.get_text().partition(",")[0] for each in axes.get_yticklabels()] == words


def test_a_range_is_in_the_readers_language():
    """Numbers with its decimal sign, postures in its words; the names of fidelities are those of the option."""
    assert range_words({"low": 0.8, "high": 1.2}, Words("it")) == "0,8–1,2"
    assert range_words({"low": "draft", "high": "standard"}, Words("it")) == "draft / standard"
    english = set(CHOICES["orientation"])
    for language in LANGUAGES:
        for low, high in combinations(CHOICES["orientation"], 2):
            told = range_words({"low": low, "high": high}, Words(language))
            assert language == "en" or not english & set(told.split(" / ")), told
            assert "random-lying" not in told


def test_no_name_on_a_map_covers_another():
    """Each is beside its place; if there is no more room, one is left out."""
    figure = Figure(figsize=(5.0, 4.0), dpi=100)
    axes = figure.subplots()
    axes.set(xlim=(0.0, 10.0), ylim=(0.0, 10.0))
    places = [(f"tree {k}", (5.0 + 0.01 * k, 5.0)) for k in range(40)]
    answer_figures.show_names(figure, axes, places)
    boxes = [each.get_window_extent() for each in axes.texts]
    assert 4 <= len(boxes) < 40
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))


def test_a_placed_barrier_is_named_by_its_place_and_any_other_by_its_name():
    placed = {"barrier_id": "30 m above, 40 m long, 3 m high, place 2", "above_m": 30.0, "place": 2}
    assert place_of(placed, Words("de")) == "30 m oberhalb, Nr. 2"
    assert place_of({"barrier_id": "net, 2", "above_m": None, "place": 0}, Words("de")) == "net, 2"
    assert place_of({"barrier_id": "net, 2", "above_m": None}, Words("de")) == "net, 2"  # before version 0.3


def test_what_was_varied_stands_with_the_run_of_the_same_scene(case, run, results, tmp_path):
    """Before: with the first run of the page, so that 23 % "as it is" stood below a reach of 88 %."""
    bare = case.run(output=str(tmp_path / "bare"), lines=case.lines)
    page = page_of(f"{run},{bare}", [results["varied"]], tmp_path / "both.html", baseline=run.name)  # it comes first
    assert 'id="r1-varied"' in page
    assert 'id="r0-varied"' not in page
    assert "The run that was varied differs" not in page
    alone = Shown(part(page_of(run, [results["varied"]], tmp_path / "alone.html"), "varied"))
    (told,) = [each for each in alone.said if each.startswith("The run that was varied differs from this one in its ")]
    assert "in its trees" in told  # the one input that differs


def test_an_outcome_that_nothing_changes_has_its_table_and_no_empty_figure(case, run, results, tmp_path):
    still = shutil.copytree(results["varied"], tmp_path / "still")
    facts = json.loads((still / "summary.json").read_text(encoding="utf-8"))
    outcome = answer_figures.outcomes_of(facts)[0]
    for row in answer_figures.of_outcome(facts, outcome):
        row["at_low"] = row["at_high"] = row["as_it_is"]
    source = SimpleNamespace(answers=SimpleNamespace(tree_effect={}, folders={"vary": (still, facts, {})}))
    drawn = answer_figures.drawings_of_answers(source, Words("en"), "r0")  # type: ignore[arg-type]
    assert "varied_0" not in drawn
    last = len(answer_figures.outcomes_of(facts)) - 1  # the run-out, which friction changes
    assert f"varied_{last}" in drawn


def test_in_german_no_english_class_is_left(case, run, results):
    page = page_of(run, list(results.values()), case.folder / "de.html", language="de")
    for name in SECTIONS:
        text = " ".join(Shown(part(page, name)).said)
        for english in (" and more", "below", " of the logs", " years", "depends most on", "keep logs", "a person"):
            assert english not in text, (name, english)


def test_classes_are_named_from_their_bounds_as_the_tool_names_them(results):
    """In English the words of the records are those that the tool wrote; of an older version these are taken."""
    classes = json.loads((results["intensity"] / "classes.json").read_text(encoding="utf-8"))["classes"]
    assert {each["unit"] for each in classes if "unit" in each} == {"kJ", "%", "years"}
    for each in classes:
        assert Words("en").of_class(each) == each["meaning"]
        assert Words("de").of_class({"meaning": each["meaning"]}) == each["meaning"]
    share = {"low": 0.1, "high": 1.0, "unit": "%"}
    assert Words("de").of_class(share) == "0,1 bis 1 % der Stämme"
    assert Words("de").of_class({"low": None, "high": 30.0, "unit": "kJ"}) == "unter 30 kJ"
    assert Words("fr").of_class({"low": 300.0, "high": None, "unit": "years"}) == "plus de 300 ans"


def test_figures_are_written_too(case, run, results):
    page_of(run, list(results.values()), case.folder / "f.html", figures=str(case.folder / "figures"))
    names = {each.name for each in (case.folder / "figures").glob("*.png")}
    wanted = ("tree_effect", "siting", "intensity", "passage", "return_class", "from_where")
    assert {f"r0_{name}.png" for name in wanted} <= names
    # of an outcome that no varied input changes there is no chart; which ones these few logs change is chance
    assert any(name.startswith("r0_varied_") for name in names)


def test_results_are_given_to_their_own_run(case, run, results, tmp_path):
    other = case.run(output=str(tmp_path / "other"), lines=case.lines, friction="0.5")
    make_report.TOOL(
        runs=f"{other},{run}",
        results=f"{results['tree_effect']},{results['intensity']}",
        output=str(tmp_path / "two.html"),
    )
    page = (tmp_path / "two.html").read_text(encoding="utf-8")
    assert 'id="r1-intensity"' in page
    assert 'id="r1-tree_effect"' in page
    assert 'id="r0-intensity"' not in page
    with pytest.raises(
        UserError, match=r"intensity belongs to the run .*run \(run [0-9a-f]{16}\), which is not on the page"
    ):
        page_of(other, [results["intensity"]], tmp_path / "no.html")
    with pytest.raises(UserError, match=r"tree_effect.gpkg belongs to the run [0-9a-f]{16}, which is not one of other"):
        page_of(other, [results["tree_effect"]], tmp_path / "no.html")
    # a run and its results that were moved together
    moved = tmp_path / "moved"
    shutil.copytree(results["intensity"], moved)
    edit_manifest(moved, run=str(tmp_path / "gone"))
    assert 'id="r0-intensity"' in page_of(run, [moved], tmp_path / "moved.html")


def test_what_is_no_result_is_refused_in_a_line(case, run, results, tmp_path):
    with pytest.raises(UserError, match=r"--results: 'nowhere' does not exist; name a layer of value-trees"):
        page_of(run, "nowhere", tmp_path / "no.html")
    with pytest.raises(UserError, match=r"run is not a layer of value-trees, or a folder of site-barriers"):
        page_of(run, [run], tmp_path / "no.html")
    with pytest.raises(UserError, match=r"trees.gpkg has no layer 'values' or 'planted'"):
        page_of(run, [Path(case.trees)], tmp_path / "no.html")
    (tmp_path / "odd.gpkg").write_text("no layer")
    with pytest.raises(UserError, match=r"odd.gpkg cannot be read; name a layer"):
        page_of(run, [tmp_path / "odd.gpkg"], tmp_path / "no.html")
    with pytest.raises(UserError, match=r"--results names two results of map-intensity for the run run"):
        page_of(run, [results["intensity"], results["intensity"]], tmp_path / "no.html")
    with pytest.raises(UserError, match=r"--results names two results of value-trees for the run run"):
        page_of(run, [results["tree_effect"], results["tree_effect"]], tmp_path / "no.html")
