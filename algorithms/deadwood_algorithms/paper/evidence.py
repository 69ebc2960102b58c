"""The evidence by which the findings of a site are assessed, gathered from its runs and results."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.rasters import read_raster_on
from deadwood_algorithms.files.vectors import read_table
from deadwood_algorithms.paper.finding import Evidence
from deadwood_algorithms.paper.site_runs import ROCKS, SiteRuns, summary_of
from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.results.run_folder import read_run

HIGH_FRICTION = 0.35  # the smallest of the sweep beyond the paper's range


def evidence_of(runs: SiteRuns, convention: str = "") -> Evidence:
    """The evidence that is needed of a site: from the scenarios, the sweeps of friction (or only the high friction),
    the rocks, the flight and the take-off speeds.
    """
    of = evidence_of_scenarios(runs, convention)
    if runs.klosters:
        if runs.wants("sweeps"):
            of.sweeps = {cell: runs.sweep(cell) for cell in runs.cells()}
        elif runs.wants("friction"):
            of.sweeps = high_friction(runs, convention)
        return of
    line = runs.site.facts["takeoff_line"]
    if runs.wants("rocks"):
        of.spreads = {name: runs.spread(name) for name in ("als", *ROCKS)}
    if runs.wants("takeoffs"):
        of.flight = runs.flight()
        of.takeoffs = {mu: runs.takeoffs(mu) for mu in runs.frictions()} if line else {}
    if line and "barriers" in of.logs and not convention:
        of.jumped = [(row["speed_ms"], row["jump_m"], row["height_m"]) for row in jumps(runs, of)]
    return of


def evidence_of_scenarios(runs: SiteRuns, convention: str = "") -> Evidence:
    """The results of the scenarios."""
    logs, summaries, cells = {}, {}, {}
    for name in runs.scenarios():
        place = runs.slide(name, convention)
        frame = read_table(f"{place / 'run.gpkg'}|layername=deposits", what="deposits")
        logs[name] = {str(column): frame[column].to_numpy() for column in frame.columns if column != "geometry"}
        summaries[name] = summary_of(place)
        cells[name] = cell_speed(place, runs.ground)
    rows = runs.compared(convention)
    return Evidence(runs.site.name, runs.site.facts, rows, logs, summaries, cell_speed=cells, twin=runs.wanted.twin)


def cell_speed(run_folder: Path, ground: Grid) -> float:
    """Mean over the cells that logs passed of the largest speed there [m/s]."""
    speeds = read_raster_on(run_folder / "speed_max.tif", ground, what="speed")
    return float(np.nanmean(speeds[speeds > 0.0]))


def high_friction(runs: SiteRuns, convention: str) -> dict[float, list[dict[str, Any]]]:
    """Reach of the lines with a friction beyond the paper's range, in the form of a sweep's row."""
    record = summary_of(runs.slide("als", convention, friction=HIGH_FRICTION))
    row = {"friction": HIGH_FRICTION, "n": record["logs"]["released"]}
    row |= {f"reach_{each['line_id']}": each["p"] for each in record["reach"]}
    return {runs.ground.cell: [row]}


def jumps(runs: SiteRuns, of: Evidence) -> list[dict[str, Any]]:
    """The logs that fly over the terrace's barrier to the road: take-off speed and jump, the slowest first."""
    rows = runs.arrivals(runs.slide("barriers"))
    lip = rows[rows["line_id"] == runs.site.facts["takeoff_line"]].set_index("log_id")
    road = rows[rows["line_id"] == runs.site.facts["road"]].set_index("log_id")
    logs = of.logs["barriers"]
    jump = dict(zip(logs["log_id"].tolist(), logs["jump_max_m"].tolist(), strict=True))
    both = [each for each in lip.index if each in road.index and road["t_s"][each] > lip["t_s"][each]]
    height = heights(runs, {int(each): float(lip["t_s"][each]) for each in both})
    flights = [
        {
            "log_id": int(each),
            "t_s": float(lip["t_s"][each]),
            "speed_ms": float(lip["speed_ms"][each]),
            "jump_m": jump[each],
            "height_m": height[int(each)],
        }
        for each in both
    ]
    return sorted(flights, key=lambda row: row["speed_ms"])


def heights(runs: SiteRuns, since_s: Mapping[int, float]) -> dict[int, float]:
    """Greatest height of the centre of mass above the terrain after a moment of each log's slide [m]."""
    if not since_s:
        return {}
    ground, found = runs.ground, dict.fromkeys(since_s, 0.0)
    for piece in read_run(str(runs.slide("barriers")), feedback=Quiet()).poses(np.array(sorted(since_s))):
        above = piece["z"] - ground.height(piece["x"], piece["y"])
        for each in np.unique(piece["log_id"]).tolist():
            late = (piece["log_id"] == each) & (piece["t_s"] >= since_s[each])
            found[each] = max(found[each], float(np.nanmax(above[late], initial=0.0)))
    return found
