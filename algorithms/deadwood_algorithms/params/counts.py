"""A number with its noun, for messages: ``1 tree``, ``3 trees``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Protocol, SupportsIndex


class Rows(Protocol):
    """Row numbers from 0: a list, or an array."""

    def __len__(self) -> int: ...

    def __getitem__(self, part: slice, /) -> Any: ...


NAMED = 5  # a message names this many, then counts the rest


def counted(number: SupportsIndex, one: str, several: str = "") -> str:
    """``1 tree``, ``3 trees``; a phrase may follow: ``counted(n, "row has", "rows have")``.

    several : what follows any other number; without it ``one`` with an s
    """
    return f"{number} {one if number == 1 else several or f'{one}s'}"


def none_of(number: int, one: str) -> str:
    """``no tree``, or ``none of the 3 trees`` if there are several; a verb in the singular follows."""
    return f"no {one}" if number == 1 else f"none of the {number} {one}s"


def first_of(names: Sequence[str], number: int, most: int = NAMED) -> str:
    """``a, b`` or ``a, b, c, d, e and 12 more``.

    names : at least the first of them; number : how many there are
    """
    more = f" and {number - most} more" if number > most else ""
    return f"{', '.join(names[:most])}{more}"


def rows_named(rows: Rows) -> str:
    """``row 7`` or ``rows 1, 2, 3, 4, 5 and 12 more``; the first row is row 1."""
    shown = first_of([str(int(row) + 1) for row in rows[:NAMED]], len(rows))
    return f"row{'s' if len(rows) > 1 else ''} {shown}"


def significant(value: float, digits: int, *, sign: bool = False) -> str:
    """A number with so many significant digits, without trailing zeros, and never with an exponent: ``1230``,
    ``0.000025``.
    """
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    text = f"{round(value, places):{'+' if sign else ''}.{max(places, 0)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def two_digits(value: float) -> int:
    """Rounded up to two digits: 1432 -> 1500."""
    step = 10 ** max(0, math.floor(math.log10(value)) - 1)
    return math.ceil(value / step) * step
