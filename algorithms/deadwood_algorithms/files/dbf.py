"""The encoding of the text in a dBASE table, of a shapefile or alone: by its bytes, because its .cpg is often lost."""

from __future__ import annotations

import codecs
from collections.abc import Callable
from pathlib import Path

import pandas as pd

from deadwood_algorithms.params.commands import quoted
from deadwood_algorithms.params.tool import UserError

BYTES = "ISO-8859-1"  # every byte is one character, so that nothing is lost on the way to UTF-8
UTF8 = ("utf-8", "utf8", "65001", "cp65001")


def read_encoded(read: Callable[[str | None], pd.DataFrame], place: Path, what: str) -> pd.DataFrame:
    """The rows as UTF-8 if their bytes are, else as their .cpg says; rejects text whose .cpg wrongly says UTF-8.

    read : gives the rows in an encoding; None: the one that the file names
    """
    frame = read(BYTES)
    columns = frame.select_dtypes(include=["object", "string"]).drop(columns="geometry", errors="ignore")
    cells = [cell for name in columns for cell in columns[name].unique() if isinstance(cell, str)]
    texts = [text.encode(BYTES) for text in (*frame.columns, *cells) if not text.isascii()]
    if not texts:
        return frame
    whole = [text for text in texts if _decodes(text, whole=True)]
    wrong = next((text for text in texts if not _decodes(text, whole=not whole)), None)
    if wrong is not None:
        _refuse_wrong_cpg(place, wrong, what)
        return read(None)
    again = frame.assign(**{name: columns[name].map(_again) for name in columns})
    return again.rename(columns={name: _again(name) for name in frame.columns})


def _decodes(text: bytes, *, whole: bool) -> bool:
    """Whether it is UTF-8; unless ``whole``, the width of its field may have cut its last character in two.

    Such an end is also that of any French participle in another encoding, so that other texts must be whole.
    """
    try:
        codecs.getincrementaldecoder("utf-8")().decode(text, final=whole)
    except UnicodeDecodeError:
        return False
    return True


def _again(text: object) -> object:
    return text.encode(BYTES).decode("utf-8", "ignore") if isinstance(text, str) else text


def _refuse_wrong_cpg(place: Path, wrong: bytes, what: str) -> None:
    there = (place.with_suffix(each) for each in (".cpg", ".CPG"))
    cpg = next((each for each in there if each.is_file()), None)
    if cpg and cpg.read_text("ascii", "ignore").strip().lower() in UTF8:
        raise UserError(
            f"{place} ({what}): its part {cpg.name} says that its text is UTF-8, but "
            f"'{wrong.decode('cp1252', 'replace').strip()}' is not (read here as Western European); write the true "
            f"encoding there: echo CP1252> {quoted(cpg)}"
        )
