"""Which fidelity is fine enough for the planned number of logs, and whether the comparison can decide that.

A run of N logs has a sampling error: for a reach probability the half-width of its 95 % Wilson interval, the noise. A
fidelity is *within* it if its own error is shown to be smaller: |difference to the finest| + half-width of the paired
interval <= noise, for every line (for an asymmetric interval the farther end counts). It is *beyond* it if, for any
line, even the nearer end is farther from 0 than the noise; otherwise there are too few logs to decide. The cheapest
fidelity that is within is recommended.

Without lines (or if all logs or none reach them) the distances of the run-outs and of the hit rasters are used instead.
Distances are never negative and shrink with the square root of the number of logs. The distance D between two halves of
the n logs of the finest run therefore measures chance: a run of N logs is D * sqrt(n / 4N) from the truth, the noise;
two runs of n different logs are D / sqrt(2) from each other, the most that can be due to chance. A distance is within
if it does not exceed the noise, and beyond if it exceeds it even after subtracting what may be chance.

The finest run is the standard of comparison and cannot be judged: its distance from the truth could only be shown by a
finer one. If the smallest change sends a log elsewhere (among trees), the pairs have little in common, and it takes up
to twice N logs to show that an error is below the noise of N.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from deadwood_algorithms.params.counts import counted, significant, two_digits

if TYPE_CHECKING:
    from deadwood_algorithms.evaluate.fidelity.records import FidelityRow

WITHIN, BEYOND, UNDECIDED = "within noise", "beyond noise", "too thin"
LEAST_LOGS = 50  # with fewer, halves and quantiles are meaningless


@dataclass(frozen=True)
class Recommendation:
    """The result of the comparison.

    fidelity : the cheapest that is shown to be fine enough, or None if there are too few logs
    judged_by : the deciding quantity; verdicts : for each fidelity but the finest; silent_lines : all logs reach them,
    or none
    logs_needed : about how many compared logs would be needed to decide, or None
    """

    fidelity: str | None
    sentence: str
    judged_by: str
    verdicts: dict[str, str]
    silent_lines: list[str]
    logs_needed: int | None = None


def verdict_of_interval(low: float, high: float, noise: float) -> str:
    if max(abs(low), abs(high)) <= noise:
        return WITHIN
    return BEYOND if low > noise or high < -noise else UNDECIDED


def verdict_of_distance(distance: float, halves: float, n_logs: int, planned: int) -> tuple[str, float]:
    """The verdict, and the noise of a run of ``planned`` logs."""
    noise = halves * math.sqrt(n_logs / (4.0 * planned))
    if distance <= noise:
        return WITHIN, noise
    return (BEYOND if distance - halves / math.sqrt(2.0) > noise else UNDECIDED), noise


def recommend(
    rows: Sequence[FidelityRow], names: Sequence[str], n_logs: int, available: int, planned: int
) -> Recommendation:
    """Judge every fidelity by its worst row.

    Parameters
    ----------
    names : from the cheapest to the finest, which is the reference
    n_logs, available, planned : logs that were compared, that the layer holds, and of the run to be decided on
    """
    *cheaper, finest = names
    silent = silent_lines(rows)
    judges = [row for row in rows if row.quantity == "reach" and row.item not in silent]
    judged_by = "reach of lines" if judges else "deposit distance and hit raster"
    judges = judges or [row for row in rows if row.quantity in ("deposit_distance", "hit_raster_distance")]
    of = {name: [row for row in judges if row.fidelity == name] for name in cheaper}
    verdicts = {name: worst([row.verdict for row in of[name]]) for name in cheaper}
    if n_logs < LEAST_LOGS:
        sentence = f"Too few logs to recommend a fidelity: {n_logs} were compared, at least {LEAST_LOGS} are needed."
        return Recommendation(None, sentence, judged_by, verdicts, silent, LEAST_LOGS)

    for name in cheaper:
        if verdicts[name] == WITHIN:
            cost = {row.fidelity: row.value for row in rows if row.quantity == "cpu_per_log"}
            sentence = (
                f"Recommended: {name}, the cheapest fidelity shown to have an error below the sampling noise of "
                f"{planned} logs ({error_words(max(of[name], key=farthest))}); {significant(cost[name], 2)} ms of CPU "
                f"time per log against {significant(cost[finest], 2)} ms at {finest}."
            )
            return Recommendation(name, sentence, judged_by, verdicts, silent)
    if UNDECIDED in verdicts.values():
        sentence, logs = too_thin(of, verdicts, finest, n_logs, available, planned)
        return Recommendation(None, sentence, judged_by, verdicts, silent, logs)
    nearest = max(of[cheaper[-1]], key=farthest)
    sentence = (
        f"Recommended: {finest}, the finest compared: all others have an error larger than the sampling noise of "
        f"{planned} logs ({cheaper[-1]}: {error_words(nearest)})."
    )
    return Recommendation(finest, sentence, judged_by, verdicts, silent)


def too_thin(
    of: Mapping[str, Sequence[FidelityRow]],
    verdicts: Mapping[str, str],
    finest: str,
    n_logs: int,
    available: int,
    planned: int,
) -> tuple[str, int | None]:
    """The open question that the fewest logs would settle, and about how many logs that takes."""
    open_rows = {name: [row for row in of[name] if row.verdict == UNDECIDED] for name in of}
    needs = {
        name: max(logs_needed(row, n_logs) for row in open_rows[name])
        for name in of
        if verdicts[name] == UNDECIDED  # a fidelity that is beyond by another row is settled
    }
    easiest = min(needs, key=lambda name: needs[name])
    logs = None if math.isinf(needs[easiest]) else two_digits(needs[easiest])
    row = max(open_rows[easiest], key=farthest)
    more = "more logs" if logs is None else f"about {logs} logs"
    if n_logs >= available or (logs or 0) > available:
        more += f" (the layer has {available}: release more, and keep the reference with --planned-logs {planned})"
    sentence = (
        f"Too few logs to recommend a fidelity: {counted(n_logs, 'log does', 'logs do')} not decide whether "
        f"{easiest} has an error below the sampling noise of {planned} logs ({error_words(row)}). Compare {more}; "
        f"until then {finest} is the safe choice."
    )
    return sentence, logs


def silent_lines(rows: Sequence[FidelityRow]) -> list[str]:
    """Lines that all logs reach at every fidelity, or none at any: they cannot distinguish fidelities."""
    values: dict[str, set[float]] = {}
    for row in rows:
        if row.quantity == "reach":
            values.setdefault(row.item, set()).add(row.value)
    return [item for item, shares in values.items() if shares in ({0.0}, {1.0})]


def worst(verdicts: Sequence[str]) -> str:
    return next((verdict for verdict in (BEYOND, UNDECIDED) if verdict in verdicts), WITHIN)


def logs_needed(row: FidelityRow, n_logs: int) -> float:
    """About how many compared logs would show this difference to be below the noise, if it stays; infinite if none."""
    if row.quantity == "reach":
        room = row.noise - abs(row.difference)
        return n_logs * max(1.1, ((row.ci_high - row.ci_low) / 2.0 / room) ** 2) if room > 0.0 else math.inf
    return n_logs * (row.difference / row.noise) ** 2 if row.noise > 0.0 else math.inf


def farthest(row: FidelityRow) -> float:
    """How close a row is to the noise, or how far beyond it."""
    size = max(abs(row.ci_low), abs(row.ci_high)) if row.quantity == "reach" else row.difference
    return size / row.noise if row.noise > 0.0 else math.inf


def error_words(row: FidelityRow) -> str:
    """The difference with its interval, and the noise that it is compared with."""
    if row.quantity == "reach":
        span = f"{100 * row.ci_low:+.2g} to {100 * row.ci_high:+.2g}"
        return (
            f"reach of line {row.item} {significant(100 * row.difference, 2, sign=True)} points ({span}), noise "
            f"±{significant(100 * row.noise, 2)}"
        )
    if row.quantity == "deposit_distance":
        return f"run-outs {significant(row.difference, 2)} m apart, noise {significant(row.noise, 2)} m"
    return (
        f"hit rasters {significant(row.difference, 2)} apart (0 alike, 1 disjoint), noise {significant(row.noise, 2)}"
    )
