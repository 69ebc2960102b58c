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
from deadwood_toolbox.qgis_plugin.help_text import FLAG, labelled, paragraphs
from deadwood_toolbox.shelf import TOOLS

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


@pytest.fixture(scope="module")
def today() -> set[str]:
    return {str(each.id) for each in translations.plugin_messages() if each.id}


@pytest.mark.parametrize("language", OTHERS)
def test_the_catalogue_is_up_to_date(language, today):
    """With exactly the present texts, as Babel reads it; if not: python -m deadwood_toolbox.translations."""
    with translations.PLUGIN_TEXTS.file_of(language).open("rb") as file:
        found = read_po(file, locale=language, abort_invalid=True)
    assert {str(each.id) for each in found if each.id} == today
    assert {str(each.id): each.string for each in found if each.id and each.string and not each.fuzzy} == told(language)


@pytest.mark.parametrize("language", OTHERS)
def test_what_is_typed_is_not_translated(language):
    assert [english for english, text in told(language).items() if kept(text) != kept(english)] == []


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
    texts += [each for each in paragraphs(declared) if not each.startswith("<pre>")]
    bare = [
        (found[0], text)
        for text in texts
        for found in FLAG.finditer(text)
        if text[: found.start()].rstrip().rpartition(" ")[2].strip("(`") not in names
    ]
    assert bare == []


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
