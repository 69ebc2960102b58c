"""The report's texts in one language: its messages, notation of numbers, and sentences that are made from records."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

from deadwood_algorithms.report.markup import NBSP
from deadwood_algorithms.report.phrases import MESSAGES
from deadwood_algorithms.results.modelled import in_words

POINTS = {"en": "."}  # the decimal sign; the others have a comma
PERIODS = {True: ("class_up_to", "class_between", "class_over"), False: ("class_below", "class_between", "class_from")}
UNITS = {"kJ": "unit_kj", "%": "unit_percent", "years": "unit_years"}  # of classes


def read_catalogue(text: str) -> dict[tuple[str, str], str]:
    """Messages of a gettext catalogue (.po) by context and English text, without those that are not translated.

    Only the part of the format that simple catalogues need; they are maintained with Babel (`python -m
    deadwood_toolbox.translations`), which is not needed to run the toolbox.
    """
    found = {}
    for block in re.split(r"\n\s*\n", text):
        lines = [line for line in block.splitlines() if not line.startswith("#~")]
        if any(line.startswith("#,") and "fuzzy" in line for line in lines):
            continue
        entry: dict[str, str] = {}
        word = ""
        for line in lines:
            if part := re.fullmatch(r'(?:(\w+)\s+)?(".*")\s*', line):
                word = part[1] or word
                entry[word] = entry.get(word, "") + ast.literal_eval(part[2])
        if entry.get("msgid") and entry.get("msgstr"):
            found[entry.get("msgctxt", ""), entry["msgid"]] = entry["msgstr"]
    return found


@cache
def catalogue(language: str) -> dict[tuple[str, str], str]:
    """The catalogue of a language; English is the language of the messages themselves."""
    if language == "en":
        return {}
    file = resources.files("deadwood_algorithms.report") / "locale" / language / "LC_MESSAGES" / "report.po"
    return read_catalogue(file.read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Words:
    """The phrases of one language; missing ones are shown in English."""

    language: str

    def say(self, phrase: str, **filled: Any) -> str:
        """The phrase with its gaps filled; values are plain text, not markup."""
        english = MESSAGES[phrase]
        text = catalogue(self.language).get((phrase, english), english)
        if self.language == "fr":  # no line begins with a sign that a space precedes
            text = re.sub(" (?=[?!:;»])|(?<=«) ", NBSP, text)
        return text.format(**filled) if filled else text

    def say_or(self, phrase: str, otherwise: str, **filled: Any) -> str:
        return self.say(phrase, **filled) if phrase in MESSAGES else otherwise

    def signs(self, number: str) -> str:
        """A number as Python writes it, with the language's decimal sign."""
        return number.replace(".", POINTS.get(self.language, ","))

    def stop(self, reason: str) -> str:
        """A stop reason in words; an unknown one unchanged."""
        return self.say_or(f"stop_{reason}", reason)

    def clauses(self, records: Sequence[Mapping[str, Any]]) -> str:
        """The description of the model in a summary, in words."""
        return in_words(records, lambda name: self.say(f"clause_{name}"), self.signs)

    def of_class(self, record: Mapping[str, Any]) -> str:
        """The name of a class, from its bounds; from older versions, as written by the tool."""
        if "unit" not in record:
            return record["meaning"]
        low, high, unit = record["low"], record["high"], record["unit"]
        first, between, last = PERIODS[unit == "years"]
        phrase = first if low is None else last if high is None else between
        ends = {name: self.signs(f"{value:g}") for name, value in (("low", low), ("high", high)) if value is not None}
        return self.say(phrase, unit=self.say(UNITS[unit]), **ends)
