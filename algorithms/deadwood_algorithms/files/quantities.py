"""Sizes as people write them in cells of text: 41,4 cm, 40-45, 40 bis 45, k.A.

For columns of sizes that are not plain numbers. A class counts as its middle, a word for a gap as a gap; anything else
stays unread, so that the message can name its row.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from deadwood_algorithms.files.units import KINDS, WORDS

MISSING_WORDS = ("", "na", "n/a", "nan", "null", "none", "-", "#n/a")  # for a gap in any column, in lower case
# Words for a gap in a column of numbers, in lower case without blanks; those of spreadsheets' errors, too.
GAP_WORDS = frozenset(
    {*MISSING_WORDS, "n.a.", "n.a", "nil", "--", "---", "–", "—", "?"}
    | {"k.a.", "k.a", "ka", "k/a", "keineangabe", "keineangaben", "unbekannt", "fehlt", "n.b.", "nichterhoben"}
    | {"nd", "n/d", "n.d.", "n.d", "nc", "n.c.", "n.r.", "nr", "s.d.", "sansdonnée", "inconnu", "nonmesuré"}
    | {"nondisponibile", "nonrilevato", "sconosciuto", "sindato", "unknown", "missing", "nodata"}
    | {"#na", "#nv", "#n/v", "#n/d", "#nd", "#wert!", "#value!", "#valeur!", "#valore!", "#div/0!", "#ref!"}
    | {"#bezug!", "#rif!", "#num!", "#zahl!", "#null!", "#name?"}
)
NUMBER = r"\d+(?:[.,]\d*)?|[.,]\d+"
SIZE = re.compile(rf"([-+]?(?:{NUMBER}))(?:\s*(?:-|–|—|bis|to|à|a)\s*({NUMBER}))?\s*([a-zäöüß\"']*)\.?")


@dataclass(frozen=True)
class Sizes:
    """A column of text read as sizes: values in the column's unit (NaN: a gap), what could not be read, how many
    cells held a class, and one such cell."""

    values: np.ndarray
    unread: np.ndarray
    classes: int
    example: str


def is_gap(text: str) -> bool:
    return re.sub(r"\s+", "", text).lower() in GAP_WORDS


def read_sizes(column: Any, unit: str) -> Sizes:
    """The cells of a column (a Series) as numbers in ``unit``; a unit behind a number counts before it."""
    values, unread = np.full(len(column), np.nan), np.zeros(len(column), bool)
    texts = [cell for cell in column.tolist() if isinstance(cell, str) and not is_gap(cell)]
    if any("," in text for text in texts) and any("." in text for text in texts):
        return Sizes(
            values, np.ones(len(column), bool), 0, ""
        )  # 1.234 beside 35,5: the meaning of the point is ambiguous
    classes, example = 0, ""
    for row, cell in enumerate(column.tolist()):
        if cell is None or cell != cell or (isinstance(cell, str) and is_gap(cell)):
            continue
        if not isinstance(cell, str):
            values[row] = float(cell)
            continue
        size = _read(cell, unit)
        if size is None:
            unread[row] = True
            continue
        values[row] = size[0]
        if size[1]:
            classes, example = classes + 1, example or cell.strip()
    return Sizes(values, unread, classes, example)


def _read(text: str, unit: str) -> tuple[float, bool] | None:
    match = SIZE.fullmatch(text.replace("\u00a0", " ").strip().lower())
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
