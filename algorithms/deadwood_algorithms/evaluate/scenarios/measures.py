"""The results of the same logs in two scenarios, and whether chance can explain the difference: functions on arrays.

Every log is its own control, so a difference depends on the logs that changed: a share by Tango's interval and
McNemar's exact test, a mean by the scatter of the changes, a spread or quantile by `order_statistics`. The
indices of a protection forest (`indices`) have a bootstrap that draws the same logs in both.
A log that left the terrain model before it reached a line, or before anything held it, may have done so beyond. Shares
and their differences come with bounds for such logs: none did in one scenario and all did in the other, and vice versa.
A mean speed excludes logs that were still moving at the time limit in any of the compared scenarios: they roll slowly
for minutes, so path over time would reflect the limit. These intervals are over logs. Another random forest, friction
or DEM is another scenario, which they do not cover.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.scenarios.indices import LEAST_ARRIVALS, barrier_index, energy_indices, reach_index
from deadwood_algorithms.evaluate.scenarios.paired_runs import Compared, Scenario
from deadwood_algorithms.params.tool import Cancelled, Feedback
from deadwood_algorithms.scene.releases import Group
from deadwood_algorithms.stats.directions import spread_change, spread_of_release
from deadwood_algorithms.stats.order_statistics import paired_percentiles, quantiles
from deadwood_algorithms.stats.statistics import Z_95, mcnemar_p, paired_interval, wilson_interval

Array = NDArray[np.float64]
HELD = ("tree", "lying_log", "block", "barrier", "left_dem", "time_limit")


@dataclass(frozen=True)
class ScenarioRow:
    """One quantity of one scenario, compared with the reference; NaN where it does not exist.

    ci_low, ci_high : 95 % interval of the value; diff_ci_low, diff_ci_high : of the difference, over the same logs
    n_only_reference, n_only_scenario, p_mcnemar : for shares: logs that changed, and the probability that chance
    explains it
    n_lost : logs that left the terrain model before the outcome was known
    value_..., difference_..._if_lost : the smallest and the largest value of both, whatever these logs did
    diff_..._if_lost : the outer ends of the intervals of the smallest and the largest difference
    n_more : arrivals or logs missing to show the value
    """

    scenario: str
    quantity: str
    item: str
    unit: str
    n: int
    value: float
    ci_low: float = math.nan
    ci_high: float = math.nan
    difference: float = math.nan
    diff_ci_low: float = math.nan
    diff_ci_high: float = math.nan
    n_only_reference: float = math.nan
    n_only_scenario: float = math.nan
    p_mcnemar: float = math.nan
    n_lost: float = math.nan
    value_low_if_lost: float = math.nan
    value_high_if_lost: float = math.nan
    difference_low_if_lost: float = math.nan
    difference_high_if_lost: float = math.nan
    diff_ci_low_if_lost: float = math.nan
    diff_ci_high_if_lost: float = math.nan
    n_more: int = 0

    @property
    def loss_matters(self) -> bool:
        """Whether the lost logs could move the value or the difference out of its interval."""
        if self.value_high_if_lost > self.ci_high:
            return True
        return self.difference_low_if_lost < self.diff_ci_low or self.difference_high_if_lost > self.diff_ci_high


def groups_by_release(compared: Compared, min_runout: float | None) -> list[Group]:
    one = compared.reference
    ids = one.column("release_id")
    x, y = one.column("release_x"), one.column("release_y")
    nearest = one.column("length_m").astype(float) if min_runout is None else np.full(ids.size, min_runout)
    found = []
    for each in dict.fromkeys(ids.tolist()):
        rows = np.flatnonzero(ids == each)
        found.append(Group(each, rows, (float(x[rows].mean()), float(y[rows].mean())), nearest[rows]))
    return found


def compared_rows(compared: Compared, min_runout: float | None, seed: int, feedback: Feedback) -> list[ScenarioRow]:
    """Everything that is reported about each scenario, the reference first."""
    releases = groups_by_release(compared, min_runout)
    rows: list[ScenarioRow] = []
    for number, each in enumerate(compared.scenarios):
        if feedback.cancelled():
            raise Cancelled
        feedback.progress(number, len(compared.scenarios), "comparing")
        other = None if each is compared.reference else compared.reference
        for column, line_id in enumerate(compared.line_ids):
            shares = [Share.of(run.reach[:, column], run.left_dem) for run in (each, other) if run]
            rows.append(share_row(each.name, "reach", str(line_id), *shares))
        if other:
            for column, line_id in enumerate(compared.line_ids):
                rows += index_rows(each, other, column, str(line_id), compared.log_id, seed)
        for reason in HELD:
            shares = [
                Share.of(run.column("stop_reason") == reason, run.left_dem & (reason != "time_limit"))
                for run in (each, other)
                if run
            ]
            rows.append(share_row(each.name, "ended", reason, *shares))
        rows += spread_differences(each, other, releases)
        rows += number_rows(each, other)
    feedback.progress(1, 1, "comparing")
    return rows


@dataclass(frozen=True)
class Share:
    """Which logs did something; ``lost`` are those that left the terrain model without having done it."""

    did: NDArray[np.bool_]
    lost: NDArray[np.bool_]

    @staticmethod
    def of(did: NDArray[np.bool_], left: NDArray[np.bool_]) -> Share:
        return Share(did, left & ~did)

    @property
    def most(self) -> NDArray[np.bool_]:
        """Which logs may have done it."""
        return self.did | self.lost


def share_row(name: str, quantity: str, item: str, now: Share, before: Share | None = None) -> ScenarioRow:
    """A share of the logs with its Wilson interval, the paired difference, and the bounds of both for lost logs."""
    n, hit = now.did.size, int(now.did.sum())
    facts: dict[str, Any] = {
        "value": hit / n,
        "value_low_if_lost": hit / n,
        "value_high_if_lost": int(now.most.sum()) / n,
    }
    facts |= dict(zip(("ci_low", "ci_high"), wilson_interval(hit, n), strict=True))
    facts["n_lost"] = int(now.lost.sum())
    if before is not None:
        facts["n_lost"] = int((now.lost | before.lost).sum())
        facts |= dict(zip(("difference", "diff_ci_low", "diff_ci_high"), _paired(before.did, now.did), strict=True))
        lost, gained = int((before.did & ~now.did).sum()), int((now.did & ~before.did).sum())
        facts |= {"n_only_reference": lost, "n_only_scenario": gained, "p_mcnemar": mcnemar_p(lost, gained)}
        least, most = _paired(before.most, now.did), _paired(before.did, now.most)
        facts |= {"difference_low_if_lost": least[0], "diff_ci_low_if_lost": least[1]}
        facts |= {"difference_high_if_lost": most[0], "diff_ci_high_if_lost": most[2]}
    return ScenarioRow(name, quantity, item, "1", n, **facts)


def index_rows(
    each: Scenario, other: Scenario, column: int, line_id: str, log_id: NDArray[np.int64], seed: int
) -> Iterator[ScenarioRow]:
    """BARI of all logs; MIRI and ORPI of those whose trajectory is stored in both scenarios, if any."""
    before, now = (Share.of(run.reach[:, column], run.left_dem) for run in (other, each))
    value, low, high = reach_index(before.did, now.did, log_id, seed)
    more = max(0, LEAST_ARRIVALS["bari"] - int(before.did.sum()))
    row = ScenarioRow(each.name, "bari", line_id, "1", log_id.size, value, low, high, n_more=more)
    yield (
        row
        if more
        else replace(
            row,
            n_lost=int((before.lost | now.lost).sum()),
            value_low_if_lost=barrier_index(before.did, now.most),
            value_high_if_lost=barrier_index(before.most, now.did),
        )
    )
    both = each.stored & other.stored
    if both.any():
        energies = other.energy[both, column], each.energy[both, column]
        fewest = min(int(np.isfinite(values).sum()) for values in energies)
        for name, found in energy_indices(*energies, log_id[both], seed).items():
            more = max(0, LEAST_ARRIVALS[name] - fewest)
            yield ScenarioRow(each.name, name, line_id, "1", int(both.sum()), *found, n_more=more)


def _paired(before: NDArray[np.bool_], now: NDArray[np.bool_]) -> tuple[float, float, float]:
    """Difference of two shares of the same logs, and its interval."""
    lost, gained = int((before & ~now).sum()), int((now & ~before).sum())
    return (gained - lost) / now.size, *paired_interval(lost, gained, now.size)


def spread_differences(each: Scenario, other: Scenario | None, releases: list[Group]) -> Iterator[ScenarioRow]:
    """Lateral spread of each release: the paper's, which single logs decide, and the range from 5 to 95 %."""
    for release in releases:
        name, n = str(release.release_id), release.rows.size
        seen = [
            spread_of_release(
                release.centre, run.places[release.rows, 0], run.places[release.rows, 1], release.min_runout
            )
            for run in (each, other)
            if run
        ]
        now = seen[0][0]
        left = each.left_dem | other.left_dem if other else each.left_dem
        facts: dict[str, Any] = {"n_lost": int(left[release.rows].sum())}
        change = now["spread_deg"] - seen[1][0]["spread_deg"] if other else math.nan
        yield ScenarioRow(each.name, "spread", name, "deg", n, now["spread_deg"], difference=change, **facts)
        facts["n_more"] = int(now["p05_p95_n_more"])
        if other:
            facts |= dict(zip(("difference", "diff_ci_low", "diff_ci_high"), spread_change(*seen), strict=True))
        value, low, high = (now[f"p05_p95_{end}deg"] for end in ("", "ci_low_", "ci_high_"))
        yield ScenarioRow(each.name, "spread_p05_p95", name, "deg", n, value, low, high, **facts)


def number_rows(each: Scenario, other: Scenario | None) -> Iterator[ScenarioRow]:
    """Speeds, run-outs and jumps: means from the changes of single logs, tails by order statistics, the largest
    without interval.
    """
    for name, column, unit in (
        ("speed_mean", "speed_mean_ms", "m/s"),
        ("speed_max", "speed_max_ms", "m/s"),
        ("energy_max", "energy_max_kj", "kJ"),
        ("jump_max", "jump_max_m", "m"),
        ("runout", "runout_m", "m"),
    ):
        now = each.column(column).astype(float)
        before = other.column(column).astype(float) if other else None
        if name == "speed_mean":
            yield speed_row(each, other, now, before)
            continue
        change = math.nan if before is None else float((now - before).mean())
        bounds = (math.nan, math.nan) if before is None else around(change, now - before)
        yield ScenarioRow(
            each.name, name, "mean", unit, now.size, float(now.mean()), *around(now.mean(), now), change, *bounds
        )
        ends = [one.runouts if name == "runout" else one.column(column).astype(float) for one in (each, other) if one]
        yield tail_row(each.name, name, unit, *ends)
        top = math.nan if before is None else float(now.max() - before.max())
        yield ScenarioRow(each.name, name, "largest", unit, now.size, float(now.max()), difference=top)
    if other:
        moved = np.hypot(*(each.places - other.places).T)
        yield ScenarioRow(each.name, "deposit_moved", "median", "m", moved.size, *quantiles(moved, [0.5]))


def speed_row(each: Scenario, other: Scenario | None, now: Array, before: Array | None) -> ScenarioRow:
    """The mean over the logs of their path over time, without those that still moved at the time limit in either
    scenario.
    """
    ended = ~each.still_moving if other is None else ~(each.still_moving | other.still_moving)
    n = int(ended.sum())
    if not n:
        return ScenarioRow(each.name, "speed_mean", "mean", "m/s", 0, math.nan)
    values = now[ended]
    mean = float(values.mean())
    row = ScenarioRow(each.name, "speed_mean", "mean", "m/s", n, mean, *around(mean, values))
    if before is None:
        return row
    change = values - before[ended]
    low, high = around(float(change.mean()), change)
    return replace(row, difference=float(change.mean()), diff_ci_low=low, diff_ci_high=high)


def tail_row(name: str, quantity: str, unit: str, now: Array, before: Array | None = None) -> ScenarioRow:
    found, *change = paired_percentiles(now, now if before is None else before, 0.95)
    facts = (found["value"], found["ci_low"], found["ci_high"], *([] if before is None else change))
    return ScenarioRow(name, quantity, "p95", unit, now.size, *facts, n_more=int(found["n_more"]))


def around(mean: float, values: Array) -> tuple[float, float]:
    """95 % interval of a mean."""
    half = Z_95 * float(values.std(ddof=1)) / math.sqrt(values.size) if values.size > 1 else math.nan
    return float(mean) - half, float(mean) + half
