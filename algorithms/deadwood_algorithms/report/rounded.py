"""Numbers for a reader: no more digits than their interval justifies, in the notation of the language."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from deadwood_algorithms.params.counts import significant
from deadwood_algorithms.report.markup import NBSP
from deadwood_algorithms.report.words import Words
from deadwood_algorithms.stats.statistics import decimals_of, percent_with_interval, percents_of, to_decimals
from deadwood_algorithms.stats.statistics import percent as share_in_percent

DIGITS = 3  # of a number without an interval
LEAST = 1e-6  # in any unit of the report: smaller values are due to rounding and shown as 0


def shown_number(value: Any, words: Words, digits: int = DIGITS) -> str:
    """A number with a given number of significant digits, whole numbers unchanged; a dash for a missing value."""
    if value is None or not math.isfinite(value):
        return "–"
    value = _zero_if_tiny(value)
    if float(value).is_integer():
        return _grouped(int(value))
    if abs(value) >= 10.0**digits:
        value = round(value, digits - 1 - math.floor(math.log10(abs(value))))
        return _grouped(int(value))
    places = max(0, digits - 1 - math.floor(math.log10(abs(value)))) if value else 0
    if abs(value) < 1e-3:
        return in_signs(significant(value, digits - 1), words)
    return in_signs(f"{value:.{places}f}", words)


def shown_alike(values: Sequence[Any], words: Words, digits: int = DIGITS) -> list[str]:
    """Numbers of one kind, a row or column of a table, with as many decimals each: as the largest one needs."""
    known = [_zero_if_tiny(float(each)) for each in values if each is not None and math.isfinite(each)]
    largest = max(map(abs, known), default=0.0)
    places = max(0, digits - 1 - math.floor(math.log10(largest))) if largest else 0
    while places and all(f"{each:.{places}f}".endswith("0") for each in known):
        places -= 1

    def shown(value: Any) -> str:
        if value is None or not math.isfinite(value) or abs(value) >= 10.0**digits:
            return shown_number(value, words, digits)
        return in_signs(to_decimals(_zero_if_tiny(value), places), words)

    return [shown(each) for each in values]


def area_unit(areas_m2: Sequence[float]) -> tuple[str, float]:
    """The unit of a table's areas and its size [m2]: hectares, or square metres where the largest is under one."""
    return ("ha", 1e4) if max(areas_m2, default=0.0) >= 1e4 else ("m²", 1.0)


def _zero_if_tiny(value: float) -> float:
    return 0.0 if abs(value) < LEAST else value


def _grouped(value: int) -> str:
    """Separate thousands in numbers of five or more digits."""
    return f"{value:,}".replace(",", "\u202f") if abs(value) >= 10_000 else str(value)


def shown_shares(counts: Sequence[int], n_total: int, words: Words) -> list[str]:
    """Counts of the same logs as shares, each with as many decimals (`percents_of`)."""
    return [_localised(each, words) for each in percents_of(counts, n_total)]


def shown_share(record: dict[str, Any], words: Words) -> str:
    """``21.0 % (18.2 to 23.2 %)``, as `percent_with_interval` writes it, in the reader's notation."""
    return _localised(percent_with_interval(record), words) if record["n_total"] else "–"


def percent_if_lost(record: dict[str, Any], words: Words) -> str:
    """``12 to 51 % (10 to 54 %)``: the share if none and if all of the lost logs reach, and the outer interval."""
    low, high = record["ci_low_if_lost"], record["ci_high_if_lost"]
    least, most, bottom, top = (
        share_in_percent(each, low, high) for each in (record["p_low_if_lost"], record["p_high_if_lost"], low, high)
    )
    return _localised(f"{least} to {most} % ({bottom} to {top} %)", words)


def _localised(text: str, words: Words) -> str:
    return in_signs(
        text.replace(" to ", f" {words.say('to')} ")
        .replace(" %", f"{NBSP}%")
        .replace("< ", f"<{NBSP}")
        .replace("> ", f">{NBSP}"),
        words,
    )


def share_of(record: dict[str, Any]) -> float:
    return 100.0 * record["n_reach"] / record["n_total"] if record["n_total"] else math.nan


def with_interval(value: float, low: float, high: float, words: Words, *, signed: bool = False) -> str:
    """``13.4 (13.1 to 13.7)``, ``3700 (1900 to 4100)``; exact zero as ``0``; the value alone without interval."""
    if not math.isfinite(value):
        return "–"
    value, low, high = (_zero_if_tiny(each) for each in (value, low, high))
    if not (math.isfinite(low) and math.isfinite(high)):
        return ("+" if signed and value > 0.0 else "") + shown_number(value, words)
    places = decimals_of(low, high)
    half = (high - low) / 2.0
    tens = max(0, math.floor(math.log10(half)) - 1) if half > 0.0 else 0  # of an interval of hundreds and more
    shown = (round(each, -tens) if tens else each for each in (value, low, high))
    a, b, c = (in_signs(to_decimals(each, places if each else 0, sign=signed), words) for each in shown)
    return f"{a} ({b} {words.say('to')} {c})"


def in_signs(text: str, words: Words) -> str:
    """A number in the notation of the language: its decimal sign, and a true minus sign."""
    text = text.replace("-", "−") if text.startswith("-") else text
    return words.signs(text)


def decimal(value: float, words: Words) -> str:
    """A number that was given, not measured: as short as possible."""
    return in_signs(f"{value:g}", words)
