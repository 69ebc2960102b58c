"""What a run's own logs say of its error of calculation: a paired difference with its interval for each line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.counts import counted, significant
from deadwood_algorithms.params.messages import Feedback
from deadwood_algorithms.simulate.fidelity_trade import REACH_ERRORS
from deadwood_algorithms.simulate.own_slope import Sample
from deadwood_algorithms.stats.statistics import decimals_of, paired_interval, to_decimals

FEW_NAMED = 5  # lines named in one line of text


def own_slope_record(
    fidelity: str, sample: Sample, log_id: NDArray[np.int64], reach: NDArray[np.bool_], line_ids: Sequence[Any]
) -> dict[str, Any]:
    """For ``summary.json``: the reach of the sample's logs in the run minus that at the finer fidelity.

    log_id, reach : of all logs of the run (n,), (n, lines)
    """
    ours, finer = reach[np.isin(log_id, sample.log_id)], sample.reach
    gained, lost = ((a & ~b).sum(axis=0).tolist() for a, b in ((ours, finer), (finer, ours)))
    promised = REACH_ERRORS[fidelity].worst.farther_end / 100.0
    by_line = {}
    for line_id, more, less in zip(line_ids, gained, lost, strict=True):
        low, high = paired_interval(less, more, len(finer))
        by_line[str(line_id)] = {"difference": (more - less) / len(finer), "ci_low": low, "ci_high": high}
    return {
        "logs": len(finer),
        "fidelity": fidelity,
        "finer": sample.finer,
        "by_line": by_line,
        "promised": promised,
        "flagged": any(outside(each, promised) for each in by_line.values()),
    }


def outside(record: Mapping[str, float], promised: float) -> bool:
    """Whether the whole interval is farther from 0 than the largest error of the benchmark's slopes."""
    return record["ci_low"] > promised or record["ci_high"] < -promised


def interval_of(record: Mapping[str, float]) -> tuple[str, str]:
    """``-3``, ``+9``: the interval in points, to one digit of its half-width."""
    low, high = 100.0 * record["ci_low"], 100.0 * record["ci_high"]
    places = max(0, decimals_of(low, high) - 1)
    return to_decimals(low, places, sign=True), to_decimals(high, places, sign=True)


def farthest_first(record: Mapping[str, Any]) -> list[tuple[str, Mapping[str, float]]]:
    """The lines, the one with the largest difference first."""
    return sorted(record["by_line"].items(), key=lambda each: -abs(each[1]["difference"]))


def own_slope_words(record: Mapping[str, Any], cpu_s: float) -> str:
    """``on this slope: draft minus fine is -3 to +9 points at line road (the same 150 logs at both, 2.1 s of CPU)``"""
    lines = farthest_first(record)
    shown = ", ".join(f"{' to '.join(interval_of(each))} points at line {name}" for name, each in lines[:FEW_NAMED])
    more = f" (and less at {counted(len(lines) - FEW_NAMED, 'other')})" if len(lines) > FEW_NAMED else ""
    logs = "1 log" if record["logs"] == 1 else f"the same {record['logs']} logs"
    return (
        f"on this slope: reach at {record['fidelity']} minus {record['finer']} is {shown}{more}, at 95 % "
        f"({logs} at both, {significant(cpu_s, 2)} s of CPU)"
    )


def warn_if_flagged(record: Mapping[str, Any] | None, feedback: Feedback) -> None:
    if not (record and record["flagged"]):
        return
    found = [(name, each) for name, each in farthest_first(record) if outside(each, record["promised"])]
    shown = ", ".join(f"{name} ({' to '.join(interval_of(each))} points)" for name, each in found[:FEW_NAMED])
    finer, most = record["finer"], significant(100.0 * record["promised"], 2)
    feedback.warn(
        f"on this slope {record['fidelity']} is farther from {finer} than on any of the benchmark's slopes "
        f"(±{most} points): line {shown}; run again with --fidelity {finer}",
        code="own-slope",
        **found[0][1],
        promised=record["promised"],
        logs=record["logs"],
    )
