"""Places from which lines are reached, and the ground that logs of a release area pass, as cells and polygons."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import geopandas
import numpy as np
import rasterio.features
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.hazard.cells import HITS, run_raster, values_on
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.results.hit_counts import count_of
from deadwood_algorithms.results.run_folder import Run
from deadwood_algorithms.stats.statistics import reach_record, wilson_bounds

ROUND_CELLS = (1.0, 2.0, 3.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0, 200.0, 500.0, 1000.0)
ENOUGH = 0.9  # share of the logs that should be in cells with enough logs
CELLS_MOST = 25_000_000
MOST_AREAS = 100  # the stored poses are read once for each
ANY = "any line"
NOWHERE = np.nan


@dataclass(frozen=True)
class Origins:
    """Logs by the cells in which they were released, row 0 in the south.

    released : number of logs; reached : for each line, how many of these reach it
    least : number of logs that a cell must have for a share
    """

    grid: Grid
    released: NDArray[np.int64]
    reached: dict[str, NDArray[np.int64]]
    least: int

    @property
    def enough(self) -> NDArray[np.bool_]:
        return self.released >= self.least

    @property
    def share_with_enough(self) -> float:
        """Share of the logs that were released in cells with enough logs."""
        return float(self.released[self.enough].sum() / self.released.sum())

    def shares(self, line: str) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Share of the logs of each cell that reach the line, and its Wilson interval; NaN if there are too few."""
        share, low, high = (np.full(self.grid.shape, NOWHERE) for _ in range(3))
        for number in np.unique(self.released[self.enough]):
            here = self.released == number
            hit = self.reached[line][here]
            share[here] = hit / number
            low[here], high[here] = wilson_bounds(hit, int(number))
        return share, low, high

    def bands(self) -> tuple[dict[str, NDArray[np.float64]], list[str]]:
        """The raster's bands by description, and their units."""
        bands: dict[str, NDArray[np.float64]] = {}
        units: list[str] = []
        for line, hit in self.reached.items():
            name = line if line == ANY else f"line {line}"
            share, low, high = self.shares(line)
            bands |= {name: share, f"{name}: lower end": low, f"{name}: upper end": high}
            bands[f"{name}: logs that reach"] = np.where(self.released > 0, hit, NOWHERE)
            units += ["1", "1", "1", "logs"]
        bands["logs released"] = np.where(self.released > 0, self.released, NOWHERE)
        return bands, [*units, "logs"]


def cell_for(x: NDArray[np.float64], y: NDArray[np.float64], least: int) -> float:
    """The smallest round cell size [m] with which nine of ten logs are in cells with enough logs; else the largest."""
    for cell in ROUND_CELLS:
        _, count = np.unique(np.stack([np.floor(at / cell) for at in (x, y)]), axis=1, return_counts=True)
        if count[count >= least].sum() >= ENOUGH * x.size:
            return cell
    return ROUND_CELLS[-1]


def origins_of(
    source: Run, rows: NDArray[np.int64], reached: Mapping[str, NDArray[np.bool_]], cell: float, least: int
) -> Origins:
    """Count logs by the cells in which they were released.

    Parameters
    ----------
    rows : rows of the deposits that count
    reached : for each line, which of these logs reach it
    cell : side of the cells [m]; their borders are at multiples of it
    """
    x, y = (source.deposits[f"release_{axis}"].to_numpy()[rows] for axis in "xy")
    i, j = (np.floor(at / cell).astype(np.int64) for at in (x, y))
    shape = (int(np.ptp(j)) + 1, int(np.ptp(i)) + 1)
    if shape[0] * shape[1] > CELLS_MOST:
        raise UserError(f"--cell-m {cell:g} makes a raster of {shape[1]} x {shape[0]} cells; use a larger cell")
    place = (j - j.min()) * shape[1] + (i - i.min())

    def counted(which: NDArray[np.bool_]) -> NDArray[np.int64]:
        return np.bincount(place[which], minlength=shape[0] * shape[1]).reshape(shape)

    everyone = np.ones(rows.size, bool)
    grid = Grid.empty(shape, cell, (i.min() + 0.5) * cell, (j.min() + 0.5) * cell, source.grid.crs)
    return Origins(grid, counted(everyone), {line: counted(hit) for line, hit in reached.items()}, least)


def sources_frame(origins: Origins, least_shares: Sequence[float]) -> geopandas.GeoDataFrame:
    """Polygons of the cells from which at least a given share of the logs reach a line; no row without cells."""
    rows, shapes = [], []
    for line, hit in origins.reached.items():
        share = origins.shares(line)[0]
        for least in least_shares:
            here = share >= least  # False for NaN
            if here.any():
                number, arrived = int(origins.released[here].sum()), int(hit[here].sum())
                ground = float(here.sum()) * origins.grid.cell**2
                rows.append({"line_id": line, "least_p": least, "area_m2": ground, **reach_record(arrived, number)})
                shapes.append(polygons_of(here, origins.grid))
    columns = ("line_id", "least_p", "area_m2", "n_total", "n_reach", "p", "ci_low", "ci_high")
    return _frame(rows, columns, shapes, origins.grid)


def affected_frame(
    source: Run, grid: Grid, least_shares: Sequence[float], feedback: Feedback
) -> geopandas.GeoDataFrame | None:
    """Polygons of the cells that at least a given share of a release area's logs pass; None if that is not known.

    A run with one release area has counted its hits itself; with several they are counted from stored trajectories.
    """
    found = _hits_by_area(source, grid, feedback)
    if found is None:
        return None
    rows, shapes = [], []
    for release_id, count, hits in found:
        for least in least_shares:
            # Compare counts instead of shares, so that 3 of 30 logs are 0.1 exactly
            here = (hits > 0) & (hits >= least * count - 1e-9)
            if here.any():
                ground = float(here.sum()) * grid.cell**2
                rows.append({"release_id": release_id, "least_p": least, "area_m2": ground, "n_logs": count})
                shapes.append(polygons_of(here, grid))
    return _frame(rows, ("release_id", "least_p", "area_m2", "n_logs"), shapes, grid)


def _hits_by_area(source: Run, grid: Grid, feedback: Feedback) -> Iterator[tuple[Any, int, NDArray[Any]]] | None:
    of_log = source.deposits["release_id"].to_numpy()
    areas = list(dict.fromkeys(of_log.tolist()))
    ids = source.deposits["log_id"].to_numpy(np.int64)
    if len(areas) == 1:
        path = run_raster(source, HITS)
        return ((area, ids.size, values_on(path, grid, "hits")) for area in areas)
    if len(areas) > MOST_AREAS:
        feedback.warn(
            f"{source.path}: its releases name {len(areas)} areas (release_id), more than {MOST_AREAS}; the layer "
            "'affected' is left out",
            code="too-many-areas",
            areas=len(areas),
        )
        return None
    wanted = {area: np.intersect1d(ids[of_log == area], source.stored_log_ids) for area in areas}
    silent = [str(area) for area, logs in wanted.items() if not logs.size]
    if silent:
        feedback.warn(
            f"{source.path}: release area '{silent[0]}' has no stored trajectory, so the layer 'affected' is left out; "
            "run slide-logs with --trajectories all",
            code="no-trajectories",
        )
        return None
    stored = sum(logs.size for logs in wanted.values())
    if stored < ids.size:
        feedback.note(
            f"{stored} of {ids.size} logs have a stored trajectory; the layer 'affected' is based on these",
            code="some-trajectories",
            stored=stored,
            logs=ids.size,
        )
    return ((area, logs.size, count_of(source, logs, grid, feedback)) for area, logs in wanted.items())


def polygons_of(here: NDArray[np.bool_], grid: Grid) -> Any:
    """Cells (row 0 in the south) as one multipolygon; cells that touch only at a corner are separate parts."""
    north_up = np.ascontiguousarray(here[::-1]).astype(np.uint8)
    found = rasterio.features.shapes(north_up, mask=north_up.astype(bool), transform=grid.transform)
    whole = shapely.union_all([shapely.geometry.shape(shape) for shape, _ in found])
    return shapely.multipolygons(shapely.get_parts(whole))


def _frame(rows: list[dict[str, Any]], columns: Sequence[str], shapes: list[Any], grid: Grid) -> geopandas.GeoDataFrame:
    import pandas

    table = pandas.DataFrame(rows, columns=list(columns))
    return geopandas.GeoDataFrame(table, geometry=shapes, crs=grid.plan_crs)
