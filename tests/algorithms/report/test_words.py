"""The report's messages and their catalogues: complete, with the same placeholders, none unused."""

from __future__ import annotations

import re
import string
from pathlib import Path

import pytest
from babel.messages.pofile import read_po

from deadwood_algorithms.report.languages import LANGUAGES
from deadwood_algorithms.report.phrases import MESSAGES
from deadwood_algorithms.report.sheet_phrases import QGIS_PHRASES
from deadwood_algorithms.report.words import Words, catalogue, read_catalogue
from deadwood_algorithms.schemas.results import STOPS
from deadwood_engine import STOP_REASONS
from deadwood_toolbox import translations

ROOT = Path(__file__).parents[3]
OTHERS = LANGUAGES[1:]


def gaps(text: str) -> list[str]:
    return sorted(field for _, field, _, _ in string.Formatter().parse(text) if field)


@pytest.mark.parametrize("language", OTHERS)
def test_every_message_is_translated_with_the_same_gaps_and_none_is_left_over(language):
    told = catalogue(language)
    assert told.keys() == {(name, english) for name, english in MESSAGES.items()}
    for (name, english), text in told.items():
        assert gaps(text) == gaps(english), name
        assert text.strip() == text or name == "answer_lost", name


@pytest.mark.parametrize("language", OTHERS)
def test_the_catalogue_is_one_of_gettext_and_is_up_to_date(language):
    """Babel reads the same as the toolbox and has nothing to add."""
    with translations.REPORT.file_of(language).open("rb") as file:
        found = read_po(file, locale=language, abort_invalid=True)
    theirs = {(each.context, each.id): each.string for each in found if each.id}
    assert theirs == catalogue(language)
    assert {(each.context, each.id) for each in translations.REPORT.updated(language) if each.id} == theirs.keys()


def test_what_of_the_format_is_read():
    text = """# a comment
msgid ""
msgstr "Language: de\\n"

#. of a translator
#: file.py:3
msgctxt "a"
msgid "one \\"two\\""
msgstr ""
"eins "
"\\"zwei\\" ä\\n"

#, fuzzy
msgctxt "b"
msgid "three"
msgstr "vier"

msgctxt "c"
msgid "five"
msgstr ""

#~ msgctxt "d"
#~ msgid "gone"
#~ msgstr "fort"
"""
    assert read_catalogue(text) == {("a", 'one "two"'): 'eins "zwei" ä\n'}


def test_what_a_catalogue_lacks_is_reported_in_english(monkeypatch):
    monkeypatch.setitem(MESSAGES, "map", "A map that nobody has translated")
    assert Words("de").say("map") == "A map that nobody has translated"


def test_every_message_is_reported_somewhere():
    """By its name; or by a name composed of a prefix and a word in a source; or, for names in a QGIS project, by the
    English name or the file or layer from which it is made.
    """
    rooms = ROOT / "algorithms" / "deadwood_algorithms"
    tables = {rooms / "report" / name for name in ("phrases.py", "answer_phrases.py", "sheet_phrases.py")}
    source = "".join(each.read_text(encoding="utf-8") for each in rooms.rglob("*.py") if each not in tables)
    made = set(re.findall(r"""(?:say|say_or)\(f["'](\w+_)\{""", source)) | {"stop_", "clause_"}
    words = set(re.findall(r"\w+", source)) | set(STOPS)

    def said(name: str) -> bool:
        beginnings = [each for each in made if name.startswith(each)]
        return (
            re.search(f"[\"']{name}[\"']", source) is not None
            or any(name.removeprefix(each) in words for each in beginnings)
            or name.endswith("_warning")
            or (name in QGIS_PHRASES and (f'"{QGIS_PHRASES[name]}"' in source or name.removeprefix("qgis_") in words))
        )

    assert [name for name in MESSAGES if not said(name)] == []


def test_every_way_to_end_has_its_words():
    assert set(STOPS) >= set(STOP_REASONS)


def test_in_french_no_line_begins_with_a_question_mark():
    """Before, the question ended in a line of its own with the question mark."""
    asked = Words("fr").say("question_lines", n=40, where="zone 1", lines="route")
    assert asked.endswith("\u00a0?")
    plain = [name for name in MESSAGES if "{" not in MESSAGES[name]]
    assert [name for name in plain if re.search(" [?!:;»]|« ", Words("fr").say(name))] == []
