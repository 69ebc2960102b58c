"""The reach of a run over the friction that is plausible, from a part of its logs that slid again at ``draft``.

The share at another friction is that of the run plus the difference of the same logs, slid at both frictions: pairs
show the difference better than two samples. The interval combines the run's and that of the difference (Zou and Donner
2008), as if they were independent. It does not contain the error of ``draft``, which does not cancel in differences of
forests (``benchmarks.what_if``); between frictions it was not measured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.stats.statistics import (
    decimals_of,
    paired_interval,
    percent_with_interval,
    reach_record,
    to_decimals,
)

SHARE = ("p", "ci_low", "ci_high")
OTHER_POSTURE = {"upright": "random-lying"}  # else upright
HOW = "--friction-range auto gives the reach over the plausible friction, too, for about a third more time"


@dataclass(frozen=True)
class Member:
    """The logs slid again at a friction, in a posture; reach : (logs, lines)."""

    friction: float
    posture: str
    reach: NDArray[np.bool_]


@dataclass(frozen=True)
class SlidBand:
    """What the logs did at other frictions and in another posture.

    log_id : (n,), of the logs that slid again; friction, posture : those of the run
    unchanged : reach at draft as the run has it; None: the run itself is at draft
    """

    log_id: NDArray[np.int64]
    friction: float
    posture: str
    unchanged: NDArray[np.bool_] | None
    members: tuple[Member, ...]
    cpu_s: float


def band_records(
    band: SlidBand, reach: Sequence[Mapping[str, Any]], log_id: NDArray[np.int64], touched: NDArray[np.bool_]
) -> list[dict[str, Any]]:
    """One record for each line, friction and posture; the run's own first.

    reach : the records of the run's lines; touched : (logs, lines), of all logs of the run
    """
    order = np.argsort(log_id)
    own = touched[order[np.searchsorted(log_id, band.log_id, sorter=order)]]
    before = own if band.unchanged is None else band.unchanged
    found = []
    for k, line in enumerate(reach):
        facts = {"line_id": line["line_id"], "friction": band.friction, "posture": band.posture}
        found.append(facts | {name: line[name] for name in SHARE} | {"n": line["n_total"]})
        for each in band.members:
            lost = int((before[:, k] & ~each.reach[:, k]).sum())
            gained = int((each.reach[:, k] & ~before[:, k]).sum())
            n, reached = len(band.log_id), int(each.reach[:, k].sum())
            if n == line["n_total"] and band.unchanged is None:  # the same logs at the same fidelity: a run of its own
                ends = {name: value for name, value in reach_record(reached, n).items() if name in SHARE}
            else:
                ends = summed(line, (gained - lost) / n, *paired_interval(lost, gained, n))
            found.append({**facts, "friction": each.friction, "posture": each.posture, **ends, "n": n})
    return found


def summed(share: Mapping[str, Any], difference: float, low: float, high: float) -> dict[str, float]:
    """A share plus a difference, with the interval of the sum."""
    below = np.hypot(share["p"] - share["ci_low"], difference - low)
    above = np.hypot(share["ci_high"] - share["p"], high - difference)
    p = share["p"] + difference
    ends = {"p": p, "ci_low": p - below, "ci_high": p + above}
    return {name: float(np.clip(value, 0.0, 1.0)) for name, value in ends.items()}


@dataclass(frozen=True)
class LineBand:
    """The band of a line: the run's record, those with the lowest and the highest share over friction in its posture,
    and those in another posture."""

    own: Mapping[str, Any]
    low: Mapping[str, Any]
    high: Mapping[str, Any]
    frictions: tuple[float, float]
    postures: tuple[Mapping[str, Any], ...]

    def shares(self) -> tuple[str, str]:
        """Lowest and highest share, as of `roughly`."""
        return roughly(self.low), roughly(self.high)


def roughly(record: Mapping[str, Any]) -> str:
    """A share in percent, with a digit less than its interval allows: the ends of a range are no estimates."""
    places = decimals_of(100.0 * record["ci_low"], 100.0 * record["ci_high"])
    return to_decimals(100.0 * record["p"], max(0, places - 1))


def band_of_line(summary: Mapping[str, Any], line_id: Any) -> LineBand | None:
    """The band of a line in the summary of a run; None in runs without."""
    mine = [each for each in summary.get("friction_band") or () if str(each["line_id"]) == str(line_id)]
    if not mine:
        return None
    alike = [each for each in mine if each["posture"] == mine[0]["posture"]]
    others = tuple(each for each in mine if each["posture"] != mine[0]["posture"])
    shares, frictions = sorted(alike, key=lambda each: each["p"]), sorted(each["friction"] for each in alike)
    return LineBand(mine[0], shares[0], shares[-1], (frictions[0], frictions[-1]), others)


def band_lines(summary: Mapping[str, Any]) -> list[str]:
    """For a reader: the band of each line, or how to get one."""
    if not summary["reach"]:
        return []
    if not summary.get("friction_band"):
        return [HOW] if isinstance(summary["scenario"]["friction"], float) else []
    lines = []
    for record in summary["reach"]:
        if (band := band_of_line(summary, record["line_id"])) is None:
            continue
        low, high = band.shares()
        ends = " to ".join(f"{each:g}" for each in band.frictions)
        own = percent_with_interval(dict(record))
        words = f"about {low}" if low == high else f"between {low} and {high}"
        words += f" % over friction {ends}; at {band.own['friction']:g}: {own}"
        words += "".join(f"; {each['posture']}: {roughly(each)} %" for each in band.postures)
        lines.append(f"line {record['line_id']}: {words}")
    return lines
