"""Energy and frequency with which logs reach each line: the rows of the table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.hazard.frequencies import stored_areas
from deadwood_algorithms.evaluate.hazard.rates import (
    ReleaseArea,
    period_class,
    pooled,
    rate_with_interval,
    return_period,
)
from deadwood_algorithms.files.vectors import read_table
from deadwood_algorithms.results.lost import share_if_lost
from deadwood_algorithms.results.passages import Passages
from deadwood_algorithms.results.run_folder import GEOPACKAGE, Run, layers_in
from deadwood_algorithms.stats.endings import left_dem

NO_ENERGY = "energies need stored trajectories; run slide-logs with --trajectories all"


def line_rows(
    source: Run,
    passages: Sequence[Passages],
    areas: Sequence[ReleaseArea],
    logs_per_event: int,
    energies: Sequence[float],
    periods: Sequence[float],
    *,
    of_run: bool,
) -> list[dict[str, Any]]:
    """Rows for each line and minimum energy: 0, then the bounds of the classes.

    of_run : the lines are the run's own, so the reach of all its logs is known; otherwise only that of logs with a
    stored trajectory
    """
    everyone = source.deposits["log_id"].to_numpy(np.int64)
    left = everyone[left_dem(source.deposits)]
    reached = reached_logs(source) if of_run else {}
    rows = []
    for each in passages:
        for bound in (0.0, *energies):
            if bound == 0.0 and of_run:
                ids, among = reached.get(each.place_id, np.zeros(0, np.int64)), everyone
            elif "energy" in each.values:
                ids, among = each.log_id[each.values["energy"] >= bound], source.stored_log_ids
            else:
                rows.append(_row(each.place_id, bound, None, {}, NO_ENERGY))
                continue
            # Energies are those of a log's first touch: one that left after it has come with less, and is not unknown
            unseen = np.setdiff1d(left, each.log_id if bound else ids)
            record = share_if_lost(np.isin(among, ids), np.isin(among, unseen))
            lost = np.intersect1d(among, unseen)
            rates = rates_of(source, ids, lost, among, areas, logs_per_event, periods) if areas else {}
            note = "" if ids.size else "no log of the run; the upper ends are what that leaves possible"
            rows.append(_row(each.place_id, bound, record, rates, note))
    return rows


def reached_logs(source: Run) -> dict[str, NDArray[np.int64]]:
    """For each line the logs that reached it, as recorded by the run itself."""
    if "reached_by" not in layers_in(source.path):
        return {}
    rows = read_table(f"{source.path / GEOPACKAGE}|layername=reached_by", what="reached_by")
    names = rows["line_id"].astype(str)
    return {str(line): rows["log_id"].to_numpy(np.int64)[names == line] for line in names.unique()}


def rates_of(
    source: Run,
    ids: NDArray[np.int64],
    lost: NDArray[np.int64],
    among: NDArray[np.int64],
    areas: Sequence[ReleaseArea],
    logs_per_event: int,
    periods: Sequence[float],
) -> dict[str, Any]:
    """Events a year, return period and its class, with their intervals; ``lost`` logs left the terrain model before."""
    of_log = source.deposits.set_index("log_id")["release_id"]
    counted = list(areas) if among.size == len(of_log) else stored_areas(source, list(areas))
    together = pooled(counted, logs_per_event)  # as in the map, so that 0 hits of n have the same return period in both

    def rate_of(logs: NDArray[np.int64]) -> tuple[Any, Any, Any]:
        if together:
            return rate_with_interval([np.array(logs.size)], together, logs_per_event)
        hit = of_log.loc[logs].to_numpy()
        counts = [np.array(int((hit == each.release_id).sum())) for each in counted]
        return rate_with_interval(counts, counted, logs_per_event)

    rate, low, high = rate_of(ids)
    highest = rate_of(np.union1d(ids, lost))[2]
    years, shortest, longest = (float(return_period(each)) for each in (rate, high, low))
    return {
        "rate_per_year": float(rate),
        "rate_ci_low_per_year": float(low),
        "rate_ci_high_per_year": float(high),
        "return_period_years": years,
        "return_ci_low_years": shortest,
        "return_ci_high_years": longest,
        "return_ci_low_years_if_lost": float(return_period(highest)),
        "return_class": int(period_class(years, periods)),
    }


def _row(
    line_id: str, bound: float, record: dict[str, float] | None, rates: dict[str, Any], note: str
) -> dict[str, Any]:
    empty = dict.fromkeys(share_if_lost(np.zeros(0, bool), np.zeros(0, bool)))
    return {"line_id": line_id, "at_least_kj": bound} | (record or empty) | rates | {"note": note}
