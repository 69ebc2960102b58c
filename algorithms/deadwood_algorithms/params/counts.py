"""A number with its noun, for messages: ``1 tree``, ``3 trees``."""

from __future__ import annotations

from typing import SupportsIndex


def counted(number: SupportsIndex, one: str, several: str = "") -> str:
    """``1 tree``, ``3 trees``; a phrase may follow: ``counted(n, "row has", "rows have")``.

    several : what follows any other number; without it ``one`` with an s
    """
    return f"{number} {one if number == 1 else several or f'{one}s'}"


def none_of(number: int, one: str) -> str:
    """``no tree``, of one, and ``none of the 3 trees``; a verb in the singular follows."""
    return f"no {one}" if number == 1 else f"none of the {number} {one}s"
