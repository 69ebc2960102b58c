"""The catalogues of what QGIS shows: up to date, with the placeholders, options, code and numbers of the English."""

from __future__ import annotations

import re
from collections import Counter

import pytest
from babel.messages.pofile import read_po

from deadwood_algorithms.explore.phrases import PHRASES
from deadwood_algorithms.report.languages import LANGUAGES
from deadwood_algorithms.report.phrases import MESSAGES
from deadwood_algorithms.report.words import read_catalogue
from deadwood_algorithms.results.qgis_project import TITLES
from deadwood_algorithms.schemas.brought import LINES
from deadwood_toolbox import parameters, translations
from deadwood_toolbox.qgis_plugin.help_text import FLAG, labelled, output_labels, output_names, paragraphs, title
from deadwood_toolbox.shelf import TOOLS, find

OTHERS = LANGUAGES[1:]
# What one types or reads in a file is the same in every language: placeholders, options, code, columns, files, numbers.
KEPT = re.compile(
    r"\{\w*\}|--[a-z][a-z0-9-]*[a-z0-9]|``.+?``|`[^`]+`|\b\w+_\w+\b|\b\w+\.(?:tif|gpkg|csv|json|html|qgz)\b|\d+(?:\.\d+)?"
)


def told(language: str) -> dict[str, str]:
    text = translations.PLUGIN_TEXTS.file_of(language).read_text(encoding="utf-8")
    return {english: translation for (_, english), translation in read_catalogue(text).items()}


def kept(text: str) -> Counter[str]:
    return Counter(KEPT.findall(text))


# A number with a decimal point that is no typed list or range (0.1:0.5:0.05), no version and no section of the paper.
POINTED = re.compile(r"(?<![\w.:,])\d+\.\d+(?![\w:]|\.\d|,\d)")
NUMBERED = re.compile(r"(?:Python|[Vv]ersione?|Abschnitt|section|sezione) $")


def pointed(text: str) -> list[str]:
    prose = re.sub(r"`[^`]+`", lambda code: "_" * len(code[0]), text)
    return [each[0] for each in POINTED.finditer(prose) if not NUMBERED.search(prose[: each.start()])]


def with_points(text: str) -> str:
    """A translation with the numbers of the English: decimal commas are points again."""
    return re.sub(r"(?<![\w.:,])(\d+),(\d+)(?![\w:]|,\d|\.\d)", r"\1.\2", text)


@pytest.fixture(scope="module")
def today() -> set[str]:
    return {str(each.id) for each in translations.plugin_messages() if each.id}


@pytest.mark.parametrize("language", OTHERS)
def test_the_catalogue_is_up_to_date(language, today):
    """With exactly the present texts, as Babel reads it; if not: python -m deadwood_toolbox.translations."""
    with translations.PLUGIN_TEXTS.file_of(language).open("rb") as file:
        found = read_po(file, locale=language, abort_invalid=True)
    assert {str(each.id) for each in found if each.id} == today
    assert [
        str(each.id) for each in found if each.id and each.fuzzy
    ] == []  # translations of what the English said before
    assert {str(each.id): each.string for each in found if each.id and each.string} == told(language)


@pytest.mark.parametrize("language", OTHERS)
def test_what_is_typed_is_not_translated(language):
    assert [english for english, text in told(language).items() if kept(with_points(text)) != kept(english)] == []


@pytest.mark.parametrize("language", OTHERS)
def test_numbers_in_texts_have_a_decimal_comma(language):
    """As in the report; what is typed into a text field has a point in every language."""
    assert {english: pointed(text) for english, text in told(language).items() if pointed(text)} == {}


def test_a_decimal_point_would_be_found():
    assert pointed("0.2 bis 0.3 (friction 0.25)") == ["0.2", "0.3", "0.25"]
    assert pointed("Python 3.11, Abschnitt 6.1, `0.5`, 0.1:0.5:0.05, 0:0.1,20:0.3") == []


@pytest.mark.parametrize("language", OTHERS)
def test_every_name_is_translated(language):
    """Groups, tools, summaries and labels of parameters; a help text that nobody has translated yet is English."""
    known = told(language)
    names = {name for tool in TOOLS if tool.in_qgis for name in (tool.group, tool.label, tool.summary)}
    labels = {parameter.label for tool in TOOLS if tool.in_qgis for parameter in tool.parameters()}
    assert sorted((names | labels) - known.keys()) == []


def test_texts_of_the_plugin_and_of_the_declarations_are_found(today):
    assert {"Canceled; nothing was left behind", "Open the results in the map", "Prepare", "Hit count"} <= today
    assert any(each.startswith("A .pts file (x y z on each line") for each in today)


@pytest.mark.parametrize("tool", [each for each in TOOLS if each.in_qgis], ids=lambda each: each.name)
def test_what_qgis_shows_has_the_dialogs_words_and_no_flags(tool):
    """Except in a command that is given in full, of this tool or of another one: `slide-logs --trajectories`."""
    declared = parameters.describe(tool)
    names = {each.name for each in TOOLS} | {"list"}
    texts = [each["label"] for each in declared["parameters"]]
    texts += [labelled(each["help"] or "", declared).partition("deadwood-tool ")[0] for each in declared["parameters"]]
    texts += paragraphs(declared)
    assert [each for each in texts if re.search(r"\w+/[\w/]+\.(?:md|py|gpkg|csv)\b", each)] == []
    bare = [
        (found[0], text)
        for text in texts
        for found in FLAG.finditer(text)
        if text[: found.start()].rstrip().rpartition(" ")[2].strip("(`") not in names
    ]
    assert bare == []


def test_a_tool_goes_by_its_name_in_the_toolbox():
    """Before, help in QGIS spoke of a run of slide-logs; a command in full, a path and a choice stay as they are."""
    others = {"slide-logs": "Slide logs", "make-report": "Make report"}
    tool = {
        "parameters": [{"flag": "--lines", "label": "Roads"}],
        "others": others,
        "description": "Of ``slide-logs``.",
    }
    assert labelled("Written by slide-logs.", tool) == "Written by 'Slide logs'."
    assert labelled("report.html (make-report).", tool) == "report.html ('Make report')."
    assert paragraphs(tool) == ["Of <i>Slide logs</i>."]
    for same in ("slide-logs --trajectories all", "/a/slide-logs/run.gpkg", "slide-logs.json", "wet-debarked"):
        assert labelled(same, tool) == same
    assert labelled("fix: deadwood-tool slide-logs --lines x", tool) == "fix: deadwood-tool slide-logs --lines x"


@pytest.mark.parametrize("tool", [each for each in TOOLS if each.in_qgis], ids=lambda each: each.name)
def test_no_label_has_the_typed_name_of_a_tool(tool):
    names = {each.name for each in TOOLS if "-" in each.name}
    assert [each.label for each in tool.parameters() if any(name in each.label for name in names)] == []


def test_roads_railways_houses_have_one_name():
    """In dialogs and help, the report, explore, the QGIS project, the model, the page of layers and every picture."""
    name = "Roads, railways, houses"
    labels = {p.label for tool in TOOLS for p in tool.parameters() if p.name in ("lines", "reaching")}
    assert {label for label in labels if not label.startswith(name)} == set()
    assert MESSAGES["layer_lines"] == MESSAGES["model_lines"] == name.lower()
    assert PHRASES["layer_lines"] == TITLES["lines"] == name
    assert LINES.meaning.startswith(name)
    assert f'"lines": _("{name}")' in (translations.PLUGIN / "slope_model.py").read_text(encoding="utf-8")
    assert f'value="{name}"' in (translations.PLUGIN / "models" / "slope_to_report.model3").read_text(encoding="utf-8")
    shown = re.compile(r"label=\"[^\"]*lines to be \w+")
    sources = sorted((translations.ROOT / "algorithms" / "deadwood_algorithms").rglob("*.py"))
    assert [each.name for each in sources if shown.search(each.read_text(encoding="utf-8"))] == []


def test_every_part_of_a_result_has_a_name_of_its_own_in_models():
    """map-origins has a raster, a picture and facts called origins: a step that takes ORIGINS gets the raster."""
    for tool in TOOLS:
        told = parameters.describe(tool)
        names = output_names(told)
        asked = {each["name"].upper() for each in told["parameters"] if each["direction"] == "output"}
        assert len({*names.values()} - asked) == len(names), tool.name
        assert all(re.fullmatch("[A-Z0-9_]+", each) for each in names.values()), tool.name
        assert len({*output_labels(told, title).values()}) == len(names), tool.name
    of = {tool.name: output_names(parameters.describe(tool)) for tool in TOOLS}
    assert {part: name for part, name in of["map-origins"].items() if name.startswith("ORIGINS")} == {
        "origins.tif": "ORIGINS",
        "origins.png": "ORIGINS_PNG",
        "origins.json": "ORIGINS_JSON",
    }
    assert output_labels(parameters.describe(find("map-origins")), title)["origins.png"] == "Origins (PNG)"


def test_every_layer_of_every_tool_can_be_chained_on_in_models():
    """They are taken from what tools write (`schemas.written`): those of windthrow by their forest."""
    names = {tool.name: set(output_names(parameters.describe(tool)).values()) for tool in TOOLS}
    assert {"TREES_BEFORE", "TREES_AFTER", "TREES_LATER", "TREES_CLEARED", "LYING_AFTER"} <= names["windthrow"]
    for tool, layers in (
        ("slide-logs", {"DEPOSITS", "REACH", "TREE_HITS", "BARRIER_HITS", "DANGER"}),
        ("map-intensity", {"INTENSITY", "PASSAGE", "PROCESS_AREA"}),
        ("compare-scenarios", {"MOVED", "CHANGED"}),
        ("calibrate-friction", {"DEPOSITS", "OBSERVED"}),
        ("value-trees", {"VALUES", "PLANTED"}),
        ("break-trees", {"BROKEN"}),
    ):
        assert layers <= names[tool], tool
