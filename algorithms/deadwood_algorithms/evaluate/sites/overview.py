"""The results of the sites, side by side: one row for each site and line, and the same on the map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import pyproj
import shapely

from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.results.checked import WHOLE, read_summary
from deadwood_algorithms.results.run_folder import GEOPACKAGE, read_manifest
from deadwood_algorithms.schemas.results import IF_LOST
from deadwood_algorithms.stats.statistics import bounds_if_lost, lost_words, percent_with_interval, reach_record

AREA_M = 5.0  # margin around the releases of a site, so that a single release has an area
DONE, FAILED = "done", "failed"


@dataclass(frozen=True)
class SiteRow:
    """A row of the overview: a site and a line, or a site that has no lines or that failed."""

    site: str
    status: str
    message: str = ""
    line_id: str | None = None
    released: int | None = None
    n_reach: int | None = None
    p: float | None = None
    ci_low: float | None = None
    ci_high: float | None = None
    n_lost: int | None = None
    p_low_if_lost: float | None = None
    p_high_if_lost: float | None = None
    ci_low_if_lost: float | None = None
    ci_high_if_lost: float | None = None
    spread_deg: float | None = None
    speed_max_ms: float | None = None
    energy_max_kj: float | None = None
    penetration_max_m: float | None = None
    wall_s: float | None = None


REACH = ("n_reach", "p", "ci_low", "ci_high", *(each.name for each in IF_LOST))


@dataclass(frozen=True)
class SiteFound:
    """A site's rows, and where it is: the ground around its releases, None if that is not known."""

    name: str
    rows: list[SiteRow]
    area: Any = None
    crs: pyproj.CRS | None = None
    folder: Path | None = None
    logs: int = 0
    scenario: dict[str, Any] | None = None

    @property
    def failed(self) -> bool:
        return self.rows[0].status == FAILED


def found_of_run(name: str, folder: Path) -> SiteFound:
    """The results of a site's run."""
    manifest, grid = read_manifest(folder)
    summary = read_summary(folder, manifest, *WHOLE)
    layer = f"{folder / GEOPACKAGE}|layername=deposits"
    deposits = read_vector(layer, geometry=("point",), target_crs=grid.crs, what="deposits", feedback=Quiet())
    spreads = [each["spread_deg"] for each in summary["spread"] if each["spread_deg"] is not None]
    common = {
        "released": summary["logs"]["released"],
        "spread_deg": max(spreads, default=None),
        "speed_max_ms": summary["speed"]["max_ms"],
        "energy_max_kj": float(deposits["energy_max_kj"].to_numpy(np.float64).max()),
        "penetration_max_m": summary["accuracy"]["penetration_max_m"],
        "wall_s": summary["cost"]["wall_s"],
    }
    lines = [{"line_id": str(each["line_id"]), **{key: each.get(key) for key in REACH}} for each in summary["reach"]]
    rows = [SiteRow(name, DONE, **common, **line) for line in lines or [{}]]
    places = deposits[["release_x", "release_y"]].to_numpy(np.float64)
    return SiteFound(
        name, rows, area_around(places), grid.plan_crs, folder, common["released"], summary.get("scenario")
    )


def found_of_failure(name: str, message: str, values: dict[str, Any]) -> SiteFound:
    """A site that failed, at its place where its releases can be read."""
    row = SiteRow(name, FAILED, " ".join(message.split()))
    try:
        frame = read_vector(str(values["releases"]), geometry=("point",), target_crs=None, crs=values.get("crs"))
    except (UserError, KeyError):
        return SiteFound(name, [row])
    return SiteFound(name, [row], area_around(shapely.get_coordinates(np.asarray(frame.geometry))), frame.crs)


def area_around(places: np.ndarray) -> Any:
    return shapely.buffer(shapely.convex_hull(shapely.multipoints(places)), AREA_M)


def sites_layer(found: Sequence[SiteFound]) -> geopandas.GeoDataFrame | None:
    """All rows whose place is known, in the CRS of the first run (or failure)."""
    placed = [each for each in found if each.area is not None]
    if not placed:
        return None
    crs = next((each.crs for each in placed if not each.failed), placed[0].crs)
    frames = [
        geopandas.GeoDataFrame([vars(row) for row in each.rows], geometry=[each.area] * len(each.rows), crs=each.crs)
        for each in placed
    ]
    moved = [frame if crs is None or frame.crs == crs else frame.to_crs(crs) for frame in frames]
    columns = {name: [value for frame in moved for value in frame[name]] for name in vars(found[0].rows[0])}
    numbers = [name for name in columns if name not in ("site", "status", "message", "line_id")]
    whole = geopandas.GeoDataFrame(columns, geometry=[shape for frame in moved for shape in frame.geometry], crs=crs)
    return whole.astype({name: "Int64" if name in ("released", "n_reach", "n_lost") else "float64" for name in numbers})


def reach_of_all(found: Sequence[SiteFound]) -> list[dict[str, Any]]:
    """For each line, the share of the logs of all sites that watched it."""
    totals: dict[str, list[int]] = {}
    for row in (row for each in found for row in each.rows if row.line_id is not None):
        total = totals.setdefault(str(row.line_id), [0, 0, 0, 0])
        for k, more in enumerate((row.n_reach or 0, row.released or 0, row.n_lost or 0, 1)):
            total[k] += more
    return [
        {"line_id": line, "sites": sites, **reach_record(reached, logs), **bounds_if_lost(reached, logs, lost)}
        for line, (reached, logs, lost, sites) in totals.items()
    ]


def words_of_sites(found: Sequence[SiteFound]) -> list[str]:
    """One line for each site, for the reader."""
    wide = max(len(each.name) for each in found)
    lines = []
    for each in found:
        if each.failed:
            lines.append(f"{each.name:<{wide}}  failed: {each.rows[0].message}")
            continue
        reached = "; ".join(
            f"{row.line_id}: {percent_with_interval(reach_record(row.n_reach or 0, row.released or 0))}"
            + lost_words(vars(row), ", ")
            for row in each.rows
            if row.line_id is not None
        )
        lines.append(f"{each.name:<{wide}}  {counted(each.logs, 'log')}" + (f"; {reached}" if reached else ""))
    return lines
