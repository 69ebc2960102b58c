"""Numbers for a reader: no more digits than their interval allows, in the language's own signs."""

from __future__ import annotations

import math
from typing import Any

from deadwood_algorithms.report.words import Words

DIGITS = 3  # of a number without an interval
NBSP = "\u00a0"


def number(value: Any, words: Words, digits: int = DIGITS) -> str:
    """So many significant digits, whole numbers as they are; a dash where there is nothing."""
    if value is None or not math.isfinite(value):
        return "–"
    if float(value).is_integer():
        return _grouped(int(value))
    if abs(value) >= 10.0**digits:
        value = round(value, digits - 1 - math.floor(math.log10(abs(value))))
        return _grouped(int(value))
    places = max(0, digits - 1 - math.floor(math.log10(abs(value)))) if value else 0
    if abs(value) < 1e-3:
        return _signs(f"{value:.{digits - 1}g}", words)
    return _signs(f"{value:.{places}f}", words)


def _grouped(value: int) -> str:
    """Thousands apart from five digits on."""
    return f"{value:,}".replace(",", "\u202f") if abs(value) >= 10_000 else str(value)


def places_of(half_width: float) -> int:
    """Decimals that a number may have whose interval is this wide to either side: its first digit counts."""
    return max(0, -math.floor(math.log10(half_width))) if half_width > 0.0 else 1


def percent(record: dict[str, Any], words: Words) -> str:
    """``21 % (18 to 23 %)``; no hit and all hits as what they exclude: ``< 0.4 %``, ``> 99.6 %``."""
    value, low, high = share_of(record), 100.0 * record["ci_low"], 100.0 * record["ci_high"]
    if record["n_total"] == 0:
        return "–"
    if record["n_reach"] == 0:
        return f"<{NBSP}{number(high, words, 2)}{NBSP}%"
    if record["n_reach"] == record["n_total"]:
        return f">{NBSP}{_signs(f'{low:.{places_of(100.0 - low)}f}', words)}{NBSP}%"
    shown = [_signs(f"{each:.{places_of((high - low) / 2.0)}f}", words) for each in (value, low, high)]
    return f"{shown[0]}{NBSP}% ({shown[1]} {words.say('to')} {shown[2]}{NBSP}%)"


def share_of(record: dict[str, Any]) -> float:
    return 100.0 * record["n_reach"] / record["n_total"] if record["n_total"] else math.nan


def with_interval(value: float, low: float, high: float, words: Words, *, signed: bool = False) -> str:
    """``13.4 (13.1 to 13.7)``; the value alone where there is no interval."""
    if not math.isfinite(value):
        return "–"
    if not (math.isfinite(low) and math.isfinite(high)):
        return _signs(f"{value:+.3g}" if signed and value else f"{value:.3g}", words)
    places = places_of((high - low) / 2.0)
    a, b, c = (_signs(f"{each:{'+' if signed else ''}.{places}f}", words) for each in (value, low, high))
    return f"{a} ({b} {words.say('to')} {c})"


def _signs(text: str, words: Words) -> str:
    text = text.replace("-", "−") if text.startswith("-") else text
    return text.replace(".", ",") if words.language == "de" else text


def decimal(value: float, words: Words) -> str:
    """A number that was given, not measured: as short as it is."""
    return _signs(f"{value:g}", words)
