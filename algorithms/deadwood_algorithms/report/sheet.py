"""The texts of a run's QGIS project and its print layout, in one language of the report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from deadwood_algorithms.files.qml import Label
from deadwood_algorithms.files.styles import DBH_UNIT
from deadwood_algorithms.params.messages import messages_in, warnings_among
from deadwood_algorithms.params.tool import VERSION
from deadwood_algorithms.report.rounded import shown_share
from deadwood_algorithms.report.scenario_box import scenario_rows
from deadwood_algorithms.report.sections import warning_words
from deadwood_algorithms.report.sheet_phrases import QGIS_PHRASES
from deadwood_algorithms.report.words import Words
from deadwood_algorithms.results.qgis_layout import SheetWords
from deadwood_algorithms.results.run_folder import Run
from deadwood_algorithms.schemas.looks import ENDS

if TYPE_CHECKING:
    import pyproj

MOST_ANSWERS = 3  # lines of several
MOST_DOUBTS = 2  # warnings, for which there is room
SCALE = "[% format_number(map_get(item_variables('map'), 'map_scale'), 0) %]"
DATE = "[% format_date(now(), 'yyyy-MM-dd') %]"
PHRASES = {english: phrase for phrase, english in QGIS_PHRASES.items()} | {
    label: f"stop_{reason}" for reason, (label, *_) in ENDS.items()
}


def sheet_words(run: Run, name: str, crs: pyproj.CRS, words: Words) -> SheetWords:
    """Texts of the project about a run whose folder will have this name."""
    summary = run.summary("reach", "scenario")
    answers = [
        words.say("answer", line=each["line_id"], share=f"{shown_share(each, words)} {words.say('of_logs')}")
        for each in summary["reach"]
    ]
    if (more := len(answers) - MOST_ANSWERS) > 0:
        answers[MOST_ANSWERS:] = [words.say("sheet_more", n=more)]
    known = crs.to_authority()
    where = f"{crs.name} ({':'.join(known)})" if known else crs.name
    doubts = [warning_words(each, words) for each in warnings_among(messages_in(summary))[:MOST_DOUBTS]]
    there = [each for each in scenario_rows(summary["scenario"], words) if each.there]
    scene = "; ".join(f"{words.say(each.phrase)} {each.value}" for each in there)
    return SheetWords(
        title=words.say("sheet_title", name=name),
        answers="   ".join(answers),
        scenario="\n".join([*(words.say("sheet_doubt", text=each) for each in doubts), scene]),
        foot=words.say("sheet_foot", scale=SCALE, crs=where, version=VERSION, date=DATE),
        of=lambda english: in_language(english, words),
    )


def in_language(english: Label, words: Words) -> str:
    """A name in the project, or the label of a class, such as ``20 to 40 cm DBH``; unknown ones are unchanged."""
    if words.language == "en":
        return str(english)
    if isinstance(english, str):
        return words.say(PHRASES[english]) if english in PHRASES else english
    unit = f"cm {words.say('sheet_dbh')}" if english.unit == DBH_UNIT else english.unit
    low, high = (None if end is None else words.signs(f"{end:g}") for end in (english.low, english.high))
    if high is None:
        return words.say("sheet_over", low=f"{low} {unit}")
    if low is None:
        return words.say("sheet_up_to", high=f"{high} {unit}")
    return words.say("sheet_between", low=low, high=f"{high} {unit}")
