"""Records of findings and of their evidence, and the rules by which an interval decides.

A finding holds if its whole 95 % interval satisfies the rule, does not hold if no part of it does, and is not decided
otherwise. It
cannot be judged if a twin was built so that it holds, or if most of the bodies concerned never move.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from numpy.typing import NDArray

Row = Mapping[str, Any]
QUICK = "Not judged: a --quick run is not evidence. "
VERDICTS = {True: "holds", False: "does not hold", None: "not decided"}
CANNOT = "cannot be judged here"


@dataclass(frozen=True)
class Variation:
    """A finding with one chosen number changed."""

    what: str
    ours: float | None
    ci_low: float | None
    ci_high: float | None
    verdict: str


@dataclass(frozen=True)
class Finding:
    """One statement; ``ours`` with its interval is in the unit that the statement names.

    ``holds`` is None where the verdict is neither that it holds nor that it does not.
    """

    id: str
    statement: str
    section: str
    paper: str
    ours: float | None
    ci_low: float | None
    ci_high: float | None
    holds: bool | None
    why: str
    verdict: str = ""
    panel: tuple[Variation, ...] = ()

    def __post_init__(self) -> None:
        if not self.verdict:
            object.__setattr__(self, "verdict", VERDICTS[self.holds])

    def unjudged(self, why: str) -> Finding:
        """The same figures, marked as not assessed."""
        return replace(self, holds=None, verdict=CANNOT, why=why + self.why)


@dataclass
class Evidence:
    """The results of the runs of one site, for one representation of the log.

    rows : of `compare-scenarios`, by (scenario, quantity, item); differences are to the scenario ``als``
    logs : arrays by column of ``deposits``, by scenario
    summaries : ``summary.json`` by scenario
    sweeps : rows of `calibrate-friction` by cell size [m]
    spreads : rows of `lateral-spread` of single scenarios
    takeoffs : by friction coefficient, the speeds at the take-off line [m/s], and how many logs were slid
    flight : the record of `fit-flight`
    jumped : for the logs that passed the terrace and reached the road: take-off speed [m/s], largest clearance and
        greatest height of the centre of mass above the terrain after it [m]; None if it was not determined
    cell_speed : mean over the cells that logs passed of the largest speed there [m/s], by scenario
    twin : whether it is a twin, some of whose findings hold by construction
    """

    site: str
    facts: Mapping[str, Any]
    rows: Mapping[tuple[str, str, str], Row]
    logs: Mapping[str, Mapping[str, NDArray]]
    summaries: Mapping[str, Mapping[str, Any]]
    sweeps: Mapping[float, Sequence[Row]] = field(default_factory=dict)
    spreads: Mapping[str, Row] = field(default_factory=dict)
    takeoffs: Mapping[float, tuple[NDArray, int]] = field(default_factory=dict)
    flight: Row | None = None
    jumped: Sequence[tuple[float, float, float]] | None = None
    cell_speed: Mapping[str, float] = field(default_factory=dict)
    twin: bool = True

    def reach(self, scenario: str) -> Row:
        return self.rows[scenario, "reach", str(self.facts["road"])]

    def randoms(self) -> list[str]:
        road = str(self.facts["road"])
        return [name for name, what, item in self.rows if name.startswith("random") and (what, item) == ("reach", road)]


def above(low: float, high: float, bound: float) -> bool | None:
    """Whether an interval lies above a bound; None if it contains the bound, or is not an interval."""
    return True if low > bound else False if high < bound else None


def within(low: float, high: float, least: float, most: float) -> bool | None:
    return True if least <= low and high <= most else False if high < least or low > most else None


def all_of(verdicts: Sequence[bool | None]) -> bool | None:
    """True if all are True, False if all are False, otherwise None: not decided."""
    if not verdicts:
        return None
    return (
        True if all(each is True for each in verdicts) else False if all(each is False for each in verdicts) else None
    )


def ratio_interval(one: Row, other: Row) -> tuple[float, float, float]:
    """The ratio of two shares, with an interval from the ends of theirs, which covers at least 95 %."""
    value = one["value"] / other["value"] if other["value"] > 0 else math.inf
    low = one["ci_low"] / other["ci_high"] if other["ci_high"] > 0 else math.inf
    high = one["ci_high"] / other["ci_low"] if other["ci_low"] > 0 else math.inf
    return value, low, high


def with_panel(finding: Finding, others: Sequence[tuple[str, Sequence[Finding]]]) -> Finding:
    """The finding with its result in each variation, by the variation's description."""
    rows = [
        Variation(what, each.ours, each.ci_low, each.ci_high, each.verdict)
        for what, found in others
        for each in found
        if each.id == finding.id
    ]
    return replace(finding, panel=tuple(rows))


def tidy(finding: Finding) -> Finding:
    """Replace NaN and infinity by None, because they are not JSON."""
    plain = {
        name: None if value is None or not math.isfinite(value) else float(value)
        for name, value in (("ours", finding.ours), ("ci_low", finding.ci_low), ("ci_high", finding.ci_high))
    }
    return replace(finding, **plain)
