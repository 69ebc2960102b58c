"""What the same logs come to in two scenarios, and how far the difference can be chance: functions on arrays.

Every log is its own control, so a difference is told by the logs that changed: a share by Tango's interval and
McNemar's exact test, a mean by the changes' own scatter, a spread or quantile by a bootstrap that draws the same logs
in both.
These intervals are over logs. Another random forest, friction or DEM is another scenario, which they do not cover.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.fidelity_measures import LEAST_OF_A_RELEASE, Group
from deadwood_algorithms.resampling import bootstrap_interval
from deadwood_algorithms.scenario_runs import Compared, Scenario
from deadwood_algorithms.statistics import Z_95, mcnemar_p, paired_interval, spread_of_release, wilson_interval
from deadwood_algorithms.tool import Cancelled, Feedback

Array = NDArray[np.float64]
HELD = ("tree", "lying_log", "barrier", "left_dem", "time_limit")


@dataclass(frozen=True)
class Row:
    """One quantity of one scenario, beside the reference's; NaN where there is nothing to say.

    low, high : 95 % interval of the value; diff_low, diff_high : of the difference, over the same logs
    n_only_reference, n_only_scenario, p_mcnemar : of shares: logs that changed, and whether chance would do as much
    """

    scenario: str
    quantity: str
    item: str
    unit: str
    n: int
    value: float
    low: float = math.nan
    high: float = math.nan
    difference: float = math.nan
    diff_low: float = math.nan
    diff_high: float = math.nan
    n_only_reference: float = math.nan
    n_only_scenario: float = math.nan
    p_mcnemar: float = math.nan


def releases_of(compared: Compared, min_runout: float | None) -> list[Group]:
    one = compared.reference
    ids = one.column("release_id")
    x, y = one.column("release_x"), one.column("release_y")
    nearest = one.column("length_m").astype(float) if min_runout is None else np.full(ids.size, min_runout)
    found = []
    for each in dict.fromkeys(ids.tolist()):
        rows = np.flatnonzero(ids == each)
        found.append(Group(each, rows, (float(x[rows].mean()), float(y[rows].mean())), nearest[rows]))
    return found


def rows_of(compared: Compared, min_runout: float | None, seed: int, feedback: Feedback) -> list[Row]:
    """Everything that is said of each scenario, the reference first."""
    releases = releases_of(compared, min_runout)
    rows: list[Row] = []
    for number, each in enumerate(compared.scenarios):
        if feedback.cancelled():
            raise Cancelled
        feedback.progress(number, len(compared.scenarios), "comparing")
        other = None if each is compared.reference else compared.reference
        for column, line_id in enumerate(compared.line_ids):
            before = other.reach[:, column] if other else None
            rows.append(share_row(each.name, "reach", str(line_id), each.reach[:, column], before))
        for reason in HELD:
            before = other.column("stop_reason") == reason if other else None
            rows.append(share_row(each.name, "ended", reason, each.column("stop_reason") == reason, before))
        rows += spread_rows(each, other, releases, compared.log_id, seed)
        rows += number_rows(each, other, compared.log_id, seed)
    feedback.progress(1, 1, "comparing")
    return rows


def share_row(name: str, quantity: str, item: str, now: NDArray[np.bool_], before: NDArray[np.bool_] | None) -> Row:
    """A share of the logs with its Wilson interval, and the paired difference."""
    n, hit = now.size, int(now.sum())
    low, high = wilson_interval(hit, n)
    if before is None:
        return Row(name, quantity, item, "1", n, hit / n, low, high)
    lost, gained = int((before & ~now).sum()), int((now & ~before).sum())
    bounds = paired_interval(lost, gained, n)
    return Row(
        name, quantity, item, "1", n, hit / n, low, high, (gained - lost) / n, *bounds, lost, gained,
        mcnemar_p(lost, gained),
    )  # fmt: skip


def spread_rows(
    each: Scenario, other: Scenario | None, releases: list[Group], log_id: NDArray[np.int64], seed: int
) -> Iterator[Row]:
    """Lateral spread of each release: the paper's, which single logs decide, and the range from 5 to 95 %."""
    for release in releases:
        name, n = str(release.release_id), release.rows.size
        everything = np.arange(n)

        def spread(run: Scenario, chosen: NDArray[np.intp], release: Group = release) -> dict[str, float]:
            x, y = run.places[release.rows[chosen]].T
            return spread_of_release(release.centre, x, y, release.min_runout[chosen])[0]

        now = spread(each, everything)
        before = spread(other, everything) if other else {"spread_deg": math.nan, "p05_p95_deg": math.nan}
        change = now["spread_deg"] - before["spread_deg"]
        yield Row(each.name, "spread", name, "deg", n, now["spread_deg"], difference=change)
        if n < LEAST_OF_A_RELEASE:
            continue

        def middle(chosen: NDArray[np.intp]) -> float:
            return spread(each, chosen)["p05_p95_deg"]

        def difference(chosen: NDArray[np.intp]) -> float:
            return middle(chosen) - spread(other, chosen)["p05_p95_deg"] if other else math.nan

        ids = log_id[release.rows]
        own = bootstrap_interval(middle, ids, seed)
        bounds = bootstrap_interval(difference, ids, seed) if other else (math.nan, math.nan)
        change = now["p05_p95_deg"] - before["p05_p95_deg"]
        yield Row(each.name, "spread_p05_p95", name, "deg", n, now["p05_p95_deg"], *own, change, *bounds)


def number_rows(each: Scenario, other: Scenario | None, log_id: NDArray[np.int64], seed: int) -> Iterator[Row]:
    """Speeds, run-outs and jumps: means by the logs' own changes, tails by bootstrap, the largest without interval."""
    for name, column, unit in (
        ("speed_mean", "speed_mean_ms", "m/s"),
        ("speed_max", "speed_max_ms", "m/s"),
        ("energy_max", "energy_max_kj", "kJ"),
        ("jump_max", "jump_max_m", "m"),
        ("runout", "runout_m", "m"),
    ):
        now = each.column(column).astype(float)
        before = other.column(column).astype(float) if other else None
        change = math.nan if before is None else float((now - before).mean())
        bounds = (math.nan, math.nan) if before is None else around(change, now - before)
        yield Row(each.name, name, "mean", unit, now.size, float(now.mean()), *around(now.mean(), now), change, *bounds)
        if name == "speed_mean":
            continue
        yield tail_row(each.name, name, unit, now, before, log_id, seed)
        top = math.nan if before is None else float(now.max() - before.max())
        yield Row(each.name, name, "largest", unit, now.size, float(now.max()), difference=top)
    if other:
        moved = np.hypot(*(each.places - other.places).T)
        yield Row(each.name, "deposit_moved", "median", "m", moved.size, float(np.median(moved)))


def tail_row(
    name: str, quantity: str, unit: str, now: Array, before: Array | None, log_id: NDArray[np.int64], seed: int
) -> Row:
    def tail(values: Array) -> Callable[[NDArray[np.intp]], float]:
        return lambda rows: float(np.quantile(values[rows], 0.95))

    value = float(np.quantile(now, 0.95))
    own = bootstrap_interval(tail(now), log_id, seed)
    if before is None:
        return Row(name, quantity, "p95", unit, now.size, value, *own)
    bounds = bootstrap_interval(lambda rows: tail(now)(rows) - tail(before)(rows), log_id, seed)
    return Row(name, quantity, "p95", unit, now.size, value, *own, value - float(np.quantile(before, 0.95)), *bounds)


def around(mean: float, values: Array) -> tuple[float, float]:
    """95 % interval of a mean."""
    half = Z_95 * float(values.std(ddof=1)) / math.sqrt(values.size) if values.size > 1 else math.nan
    return float(mean) - half, float(mean) + half
