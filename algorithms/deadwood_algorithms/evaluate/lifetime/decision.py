"""The tables and sentences of `decide`, from the arrivals of every draw."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.lifetime.events import Arrivals, energy_of_period
from deadwood_algorithms.params.snag_dynamics import PROCESSES

Array = NDArray[np.float64]
FEWER, NOT_MORE, NOT_DECIDED, NOT_FEWER, MORE = VERDICTS = ("fewer", "not more", "not decided", "not fewer", "more")


@dataclass(frozen=True)
class Answer:
    """Arrivals by treatment; columns of line k begin at ``first[k]``, one for each of its ``energies`` [kJ].

    years : over which events are added up, the first ones of those that were computed
    """

    arrivals: Mapping[str, Arrivals]
    lines: Sequence[str]
    energies: Sequence[Array]
    years: int

    def column(self, line: int, at_least_kj: float = 0.0) -> int:
        first = sum(each.size for each in self.energies[:line])
        return first + int(np.searchsorted(self.energies[line], at_least_kj))

    def rate(self, treatment: str, line: int, at_least_kj: float = 0.0) -> Array:
        """Events a year, shape (draws, years computed)."""
        return self.arrivals[treatment].rate[..., self.column(line, at_least_kj)]

    def total(self, treatment: str, line: int, at_least_kj: float = 0.0) -> Array:
        """Events over all years, shape (draws,)."""
        return self.rate(treatment, line, at_least_kj)[:, : self.years].sum(axis=1)


def mean_record(values: Array, name: str) -> dict[str, float]:
    """Mean over the draws, and the range that contains 95 % of them."""
    low, high = np.percentile(values, [2.5, 97.5]).tolist()
    return {name: float(values.mean()), "ci_low": low, "ci_high": high}


def year_rows(answer: Answer, years: Sequence[int], bounds: Sequence[float]) -> Iterator[dict[str, Any]]:
    for name in answer.arrivals:
        for line, line_id in enumerate(answer.lines):
            for least in (0.0, *bounds):
                values = answer.rate(name, line, least)
                for year in years:
                    head = {"treatment": name, "line_id": line_id, "at_least_kj": least, "year": year}
                    yield head | mean_record(values[:, year], "events_per_year")


def total_rows(answer: Answer, bounds: Sequence[float]) -> Iterator[dict[str, Any]]:
    """By class of energy: events over all years and in a mean year, as a risk tool takes them."""
    for name in answer.arrivals:
        for line, line_id in enumerate(answer.lines):
            above = [answer.total(name, line, least) for least in (0.0, *bounds)]
            classes = [one - more for one, more in zip(above, [*above[1:], np.zeros_like(above[0])], strict=True)]
            rows = [("any", 0.0, above[0])]
            rows += [
                (str(k), low, values) for k, (low, values) in enumerate(zip((0.0, *bounds), classes, strict=True), 1)
            ]
            for intensity, low, values in rows:
                head = {"treatment": name, "line_id": line_id, "intensity": intensity, "from_kj": low}
                rate = mean_record(values / answer.years, "events_per_year")
                rates = {"events_per_year": rate["events_per_year"]}
                rates |= {f"rate_{end}_per_year": rate[end] for end in ("ci_low", "ci_high")}
                yield head | mean_record(values, "events") | rates


def period_rows(answer: Answer, periods: Sequence[float]) -> Iterator[dict[str, Any]]:
    """The energy that comes at least once in a return period, in a mean year; 0: rarer than that."""
    for name, arrivals in answer.arrivals.items():
        chance = np.asarray(arrivals.chance[:, : answer.years].mean(axis=1))
        for line, line_id in enumerate(answer.lines):
            first, energies = answer.column(line), answer.energies[line]
            of_line: Array = chance[:, first : first + energies.size]
            for period in periods:
                energy: Array = np.nan_to_num(energy_of_period(of_line, energies, period))
                low, middle, high = (float(np.percentile(energy, each)) for each in (2.5, 50.0, 97.5))
                head = {"treatment": name, "line_id": line_id, "return_period_years": period}
                yield head | {"energy_kj": middle, "ci_low": low, "ci_high": high}


def difference_rows(answer: Answer) -> Iterator[dict[str, Any]]:
    """Each treatment against each one named before it, draw by draw."""
    names = list(answer.arrivals)
    for line, line_id in enumerate(answer.lines):
        for k, other in enumerate(names):
            for name in names[k + 1 :]:
                record = mean_record(answer.total(name, line) - answer.total(other, line), "difference")
                said = verdict_of(record["difference"], record["ci_low"], record["ci_high"])
                yield {"treatment": name, "line_id": line_id, "against": other} | record | {"verdict": said}


def verdict_of(difference: float, low: float, high: float) -> str:
    """What a range of differences decides; ends of 0 belong to draws in which neither treatment has an event."""
    if low < 0.0 < high or difference == 0.0:
        return NOT_DECIDED
    if difference < 0.0:
        return FEWER if high < 0.0 else NOT_MORE
    return MORE if low > 0.0 else NOT_FEWER


def influence_rows(answer: Answer, numbers: Mapping[str, Array]) -> Iterator[dict[str, Any]]:
    """Rank correlation of each number with the events of the first treatment, the strongest first."""
    first = next(iter(answer.arrivals))
    for line, line_id in enumerate(answer.lines):
        events = answer.total(first, line)
        found = [
            {"line_id": line_id, "process": name, "rank_correlation": _rank_correlation(values[:, 0], events)}
            for name, values in numbers.items()
        ]
        yield from sorted(found, key=lambda each: -abs(each["rank_correlation"]))


def _rank_correlation(one: Array, other: Array) -> float:
    if np.ptp(one) == 0.0 or np.ptp(other) == 0.0:
        return 0.0
    first, second = (each.argsort(kind="stable").argsort(kind="stable").astype(float) for each in (one, other))
    return float(np.asarray(np.corrcoef(first, second))[0, 1])


def treatment_sentences(answer: Answer, line: int) -> list[str]:
    """One sentence a treatment at a line."""
    found = []
    for name in answer.arrivals:
        record = mean_record(answer.total(name, line), "events")
        by_year = answer.rate(name, line)[:, : answer.years].mean(axis=0)
        worst = f", most in year {int(by_year.argmax())}" if by_year.any() else ""
        found.append(
            f"{answer.lines[line]}, {name}: {range_words(record, 'events')} events in {answer.years} years{worst}"
        )
    return found


def difference_sentence(row: Mapping[str, Any], years: int) -> str:
    told = f"{range_words(row, 'difference')} events in {years} years"
    return f"{row['line_id']}, {row['treatment']} against {row['against']}: {row['verdict']}, {told}"


def influence_sentence(rows: Sequence[Mapping[str, Any]], line_id: str) -> str:
    """The two numbers that influence the events most."""
    top = [each for each in rows if each["line_id"] == line_id and each["rank_correlation"]][:2]
    named = " and ".join(f"{each['process']} ({PROCESSES[each['process']].about.lower()})" for each in top)
    return f"{line_id}: the events depend most on {named}" if named else ""


def range_words(record: Mapping[str, Any], name: str) -> str:
    return f"{_short(record[name])} ({_short(record['ci_low'])} to {_short(record['ci_high'])})"


def _short(value: float) -> str:
    return f"{value:.2g}" if abs(value) < 10.0 else f"{value:.0f}"
