"""Sizes as people write them in cells of text: 41,4 cm, 40-45, [40,45), 40 bis unter 45, k.A.

For columns of sizes that are not plain numbers. A class counts as its middle, a word for a gap as a gap, and a word
that the user explains as the number given for it; anything else, such as an open class (>60), which has no middle,
stays unread, so that the message can name its row.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, SupportsFloat

import numpy as np

from deadwood_algorithms.files.units import KINDS, WORDS

MISSING_WORDS = ("", "na", "n/a", "nan", "null", "none", "-", "#n/a")  # words for a gap in any column, in lower case
# Words for a gap in a column of numbers, in lower case without blanks; those of spreadsheets' errors, too.
GAP_WORDS = frozenset(
    {*MISSING_WORDS, "n.a.", "n.a", "nil", "--", "---", "–", "—", "?"}
    | {"k.a.", "k.a", "ka", "k/a", "keineangabe", "keineangaben", "unbekannt", "fehlt", "n.b.", "nichterhoben"}
    | {"nd", "n/d", "n.d.", "n.d", "nc", "n.c.", "n.r.", "nr", "s.d.", "sansdonnée", "inconnu", "nonmesuré"}
    | {"nondisponibile", "nonrilevato", "sconosciuto", "sindato", "unknown", "missing", "nodata"}
    | {"#na", "#nv", "#n/v", "#n/d", "#nd", "#wert!", "#value!", "#valeur!", "#valore!", "#div/0!", "#ref!"}
    | {"#bezug!", "#rif!", "#num!", "#zahl!", "#null!", "#name?"}
    | {"ø", "keine", "(leer)", "(blank)", "(vide)", "(vuoto)"}
)
# No letter and no digit; n.e. and ss.dd.; "nicht gemessen", "non rilevato".
GAP = re.compile(
    r"\W*|<na>|(?:[a-zà-ü]{1,2}\.\s*){2,3}[a-zà-ü]{0,2}"
    r"|(?:nicht|kein\w*|ohne|not|no|non|pas|sans|senza|nessun\w*)\s+[^\d]+"
)
NUMBER = r"(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[-+]?\d+)?"
BEFORE = r"(?:(?:circa|environ|approx|about|von|from|de|da|ca|env|klasse|classe|class|kl)\b\.?|[~≈±])?\s*"
BETWEEN = r"(?:-|–|—|\.\.+|…|bis(?:\s+unter)?|to|à|a)"
UNIT = r"([a-zäöüß\"']*)\.?"
SIZE = re.compile(rf"{BEFORE}([-+]?(?:{NUMBER}))(?:\s*{BETWEEN}\s*({NUMBER}))?\s*{UNIT}")
INTERVAL = re.compile(rf"[\[\](]\s*({NUMBER})\s*(?:;|{BETWEEN})\s*({NUMBER})\s*[\])\[]\s*{UNIT}")
COMMA_INTERVAL = re.compile(rf"[\[\](]\s*(\d+(?:\.\d*)?|\d+,\d+(?=,\s))\s*,\s*({NUMBER})\s*[\])\[]\s*{UNIT}")
GROUPED = re.compile(r"\d[.,]\d{3}(?!\d)")  # whose point or comma may separate groups of three digits

# 2024-10-12, 12.10.2024, 10/12/2024; 12-Oct, Okt 12, 12. Okt
DATE = re.compile(
    r"\s*(\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[-/.]\d{1,2}[-/.]\d{2,4}"
    r"|(\d+[-. ]+)?(jan|feb|f[ée]v|m[aä]r|mrz|a[pv]r|ma[iy]|mag|j[uo]in|giu|jun|jul|juil|lug|aug|ao[uû]t|ago|sep|set"
    r"|o[ck]t|ott|nov|de[zc]|d[ée]c|dic)\w*\.?([-. ]+\d+)?\b)",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Sizes:
    """A column of text read as sizes: values in the column's unit (NaN: a gap), what could not be read, how many
    cells held a class, and one such cell."""

    values: np.ndarray
    unread: np.ndarray
    classes: int
    example: str


def is_gap(text: str) -> bool:
    plain = text.replace("\u00a0", " ").strip().lower()
    return re.sub(r"\s+", "", plain) in GAP_WORDS or GAP.fullmatch(plain) is not None


def is_date(cell: object) -> bool:
    """Whether a cell is a date, or the text of one, in which a spreadsheet has turned it."""
    return hasattr(cell, "year") or DATE.match(str(cell)) is not None


def read_sizes(column: Any, unit: str, words: Mapping[str, float] | None = None) -> Sizes:
    """The cells of a column (a Series) as numbers in ``unit``; a unit after a number takes precedence over ``unit``.

    ``words`` gives the numbers of words (in lower case) that the user explains.
    """
    values, unread, words = np.full(len(column), np.nan), np.zeros(len(column), bool), words or {}
    cells = column.tolist()
    texts = [cell for cell in cells if isinstance(cell, str) and not is_gap(cell)]
    both = any("," in text for text in texts) and any("." in text for text in texts)
    if both and any(map(GROUPED.search, texts)):  # 1.234 beside 35,5: the meaning of the point is ambiguous
        return Sizes(values, np.ones(len(column), bool), 0, "")
    classes, example = 0, ""
    for row, cell in enumerate(cells):
        if isinstance(cell, str) and cell.strip().lower() in words:
            values[row] = words[cell.strip().lower()]
        elif cell is None or cell != cell or (isinstance(cell, str) and is_gap(cell)):
            continue
        elif isinstance(cell, SupportsFloat) and not isinstance(cell, str):
            values[row] = float(cell)
        elif not isinstance(cell, str):
            unread[row] = True  # a date
        elif (size := _read(cell, unit)) is None:
            unread[row] = True
        else:
            values[row] = size[0]
            if size[1]:
                classes, example = classes + 1, example or cell.strip()
    return Sizes(values, unread, classes, example)


def _read(text: str, unit: str) -> tuple[float, bool] | None:
    plain = text.replace("\u00a0", " ").strip().lower()
    match = SIZE.fullmatch(plain) or INTERVAL.fullmatch(plain) or COMMA_INTERVAL.fullmatch(plain)
    if not match:
        return None
    lower, upper, word = match[1], match[2], WORDS.get(match[3], match[3])
    times = 1.0
    if word:
        kind = next((each for each in KINDS.values() if word in each and unit in each), None)
        if kind is None:
            return None
        times = kind[word] / kind[unit]
    low = float(lower.replace(",", "."))
    if upper is None:
        return low * times, False
    high = float(upper.replace(",", "."))
    return (0.5 * (low + high) * times, True) if high > low else None
