"""The energy that at least a given share of the logs bring to each cell: the basis of the classes of intensity.

A cell's largest energy grows with the number of logs, and with it the area of every class, without limit. The energy
that at least a share of the logs bring is a property of the slope: more logs only make it more precise. For n logs and
the share p it is the k-th largest of a cell, k = p n. Its interval has the ranks at which Wilson's interval of k in n
just contains p.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import pandas
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.hazard import cells
from deadwood_algorithms.evaluate.hazard.origins import polygons_of
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.results.cell_quantiles import largest_by_rank
from deadwood_algorithms.results.hit_counts import count_of
from deadwood_algorithms.results.run_folder import Run
from deadwood_algorithms.stats.statistics import Z_95, wilson_bounds

LARGEST = "largest energy of all logs"
SUPPORTED = 0.2  # an area is stated where the share that makes it is known to within a fifth
GROWS = "which grows with the number of logs, and so does the area of each class"


@dataclass(frozen=True)
class Ranks:
    """How many of the logs must bring a cell's energy.

    estimate : number of logs that makes the share; sure : number from which the 95 % interval lies above it; possible :
    number from which the interval is not yet below it
    """

    estimate: int
    sure: int
    possible: int

    @classmethod
    def of(cls, share: float, n_logs: int) -> Ranks:
        if share == 0.0:
            return cls(1, 1, 1)
        low, high = wilson_bounds(np.arange(n_logs + 1), n_logs)
        sure, possible = (int(np.searchsorted(each, share)) for each in (low, high))  # both are ascending
        return cls(max(1, math.ceil(share * n_logs - 1e-9)), max(1, sure), max(1, possible))


@dataclass(frozen=True)
class Energies:
    """Energy by cell [kJ], NaN where too few logs passed; ``low`` and ``high`` are the ends of its 95 % interval."""

    estimate: NDArray[np.float32]
    low: NDArray[np.float32]
    high: NDArray[np.float32]
    what: str
    facts: dict[str, Any]


def energies_of_share(
    source: Run, share: float, raster: str | None, grid: Grid, hits: NDArray[np.float32], feedback: Feedback
) -> Energies:
    """Energies that at least this share of the logs bring; a given raster, or the largest, where enough logs pass."""
    known = source.stored_log_ids
    ranked = share > 0.0 and raster is None and known.size > 0
    n_logs = int(known.size) if ranked else len(source.deposits)
    ranks = Ranks.of(share, n_logs)
    if ranked:
        counts = count_of(source, known, grid, feedback)
        wanted = (ranks.estimate, ranks.sure, ranks.possible)
        found = list(largest_by_rank(source, known, counts, grid, "energy", wanted, feedback))
        what = f"energy that at least {100 * share:g} % of the logs bring"
    else:
        place: str | Path = raster or cells.run_raster(source, cells.ENERGY)
        energy = cells.values_on(place, grid, "energy")
        found = [
            np.where(hits >= rank, energy, np.nan).astype(np.float32)
            for rank in (ranks.estimate, ranks.sure, ranks.possible)
        ]
        if raster and (unknown := int(((hits >= ranks.estimate) & np.isnan(energy)).sum())):
            said = f"{raster}: {counted(unknown, 'cell')} that logs pass without an energy: not classed"
            feedback.warn(said, code="no-energy", cells=unknown)
        what = f"energy of {Path(raster).name}" if raster else LARGEST
        what += f", where at least {100 * share:g} % of the logs pass" if share else ""
        if raster is None and share:
            feedback.warn(
                f"{source.path}: no trajectory is stored, so the energy classed is the largest of all logs, {GROWS}; "
                "run slide-logs with --trajectories all",
                code="no-trajectories",
            )
    facts = {"share": share, "n_logs": n_logs, "logs": ranks.estimate, "logs_sure": ranks.sure}
    facts["logs_possible"] = ranks.possible
    if share and wilson_bounds(0, n_logs)[1] > share:
        needed = math.ceil(Z_95**2 * (1.0 / share - 1.0))
        feedback.warn(
            f"{counted(n_logs, 'log does', 'logs do')} not show whether {100 * share:g} % of the logs pass a cell "
            f"that none of them passed; {needed} can",
            code="few-logs",
            logs=n_logs,
            needed=needed,
        )
    return Energies(found[0], found[1], found[2], what, facts)


def process_area(hits: NDArray[np.float32], share: float, n_logs: int, grid: Grid) -> geopandas.GeoDataFrame:
    """The outline of the cells that at least this share of the logs pass (0: any log); one row, or none without such
    cells. Its area is stated from the number of logs that supports it; none does for any log.
    """
    here = hits >= Ranks.of(share, n_logs).estimate
    needed = supported_from(share)
    area = float(here.sum()) * grid.cell**2 if needed is not None and n_logs >= needed else math.nan
    row = {"least_p": share, "area_m2": area, "n_logs": n_logs, "n_needed": needed}
    table = pandas.DataFrame([row] if here.any() else [], columns=list(row)).astype({"n_needed": "Int64"})
    return geopandas.GeoDataFrame(table, geometry=[polygons_of(here, grid)] if here.any() else [], crs=grid.plan_crs)


def needed_for(share: float) -> int:
    """The number of logs from which the 95 % interval of this share is at most `SUPPORTED` times it to either side."""
    share = max(share, np.finfo(float).eps)
    return math.ceil(Z_95**2 * (1.0 - share) / (share * SUPPORTED**2))


def supported_from(share: float) -> int | None:
    """`needed_for`; None for any log (0): its ground grows with every log, so that no number supports an area."""
    return needed_for(share) if share > 0.0 else None


def areas_of(energies: Energies, bounds: tuple[float, ...], cell_m: float) -> list[dict[str, float]]:
    """For each class of energy, the area with at least its lower bound [m²], and its 95 % interval.

    With few logs the estimate is too large: more cells that are passed too rarely are over the share by chance than
    cells passed often enough are below it (truth 63 cells: 367 from 200 logs, 120 from 1000). So it is NaN below the
    number of logs that determines the share to within `SUPPORTED`. The largest energy of all logs has neither an
    area nor an interval, because its area keeps growing with the number of logs.
    """
    share, n_logs = energies.facts["share"], energies.facts["n_logs"]
    needed = supported_from(share)
    rows = []
    for bound in (0.0, *bounds):
        area, low, high = (
            float(np.count_nonzero(each >= bound)) * cell_m**2  # False for NaN
            for each in (energies.estimate, energies.low, energies.high)
        )
        if not share:
            low = high = math.nan
        area = area if needed is not None and n_logs >= needed else math.nan
        rows.append({"at_least_m2": area, "at_least_ci_low_m2": low, "at_least_ci_high_m2": high})
    return rows
