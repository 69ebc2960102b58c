"""How widely the deposits of each release spread: sectors and azimuths, deposits at the edges, and the lines."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.results.edges import edge_words, edges_of_deposits
from deadwood_algorithms.results.run_folder import read_manifest, run_folder_of
from deadwood_algorithms.results.scenario import lines_of_folder
from deadwood_algorithms.stats.directions import arc_start, middle_words, smallest_arc, spread_of_release
from deadwood_algorithms.stats.resampling import halves

ARC_STEP_DEG = 2.0
HALVES = 100  # random halves of the logs, to show how the smallest angle grows with their number


@dataclass(frozen=True)
class Deposits:
    """Properties of each deposit other than its position; arrays by row."""

    log_id: NDArray[np.int64]
    release_id: NDArray[Any]
    release_x: NDArray[np.float64]
    release_y: NDArray[np.float64]
    nearest: NDArray[np.float64]  # [m]: a deposit within this distance does not count
    left: NDArray[np.bool_]
    near_edge: NDArray[np.bool_]


def words_of(row: dict[str, Any]) -> str:
    """A line about one release; with fewer than two deposits that count there is no angle."""
    counted = row["n"] - row["n_left_out"]
    if counted < 2:
        return (
            f"release {row['release_id']}: no spread, {counted or 'none'} of {row['n']} deposits lies beyond "
            "--min-runout-m from the release"
        )
    return (
        f"release {row['release_id']}: spread {row['spread_deg']:.1f}° ({row['spread_half_deg']:.1f}° with half the "
        f"logs), {middle_words(row)}, {counted} of {row['n']} deposits"
    )


def at_edges(
    source: str, deposits: geopandas.GeoDataFrame, dem: str | None, edge_m: float, feedback: Feedback
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which logs left the terrain model, and which others ended within ``edge_m`` of its edges; warns of both.

    source : the layer of the deposits as the user named it
    dem : the terrain model; None: that of the run
    """
    left = np.zeros(len(deposits), bool)
    if "stop_reason" in deposits:
        left = (deposits["stop_reason"] == "left_dem").to_numpy(bool)
    near, words = np.zeros(len(deposits), bool), "its edges"
    assert deposits.crs is not None  # a layer without a CRS is rejected when it is read
    with edges_of_deposits(source, dem, deposits.crs, feedback) as edges:
        if edges:
            x, y = deposits.geometry.x.to_numpy(), deposits.geometry.y.to_numpy()
            near, words = edges.near(x, y, edge_m) & ~left, edges.words
    if left.any() or near.any():
        counts, known = (int(left.sum()), int(near.sum()), len(deposits)), "stop_reason" in deposits
        warning = edge_words(*counts, edge_m, words, "ended", known=known)
        feedback.warn(f"{source}: {warning}", code="left-dem")
    return left, near


def scenario_of_deposits(deposits: str) -> tuple[str, ...]:
    """The scenario of the run to which the deposits belong; empty for a layer outside a run's folder."""
    folder = run_folder_of(deposits)
    return lines_of_folder(folder, read_manifest(folder)[0]) if folder else ()


def layer_of(deposits: str) -> str:
    """The layer of deposits in a run's folder or its GeoPackage; any other layer as named by the user."""
    path = Path(deposits)
    package = path / "run.gpkg" if path.is_dir() else path
    return f"{package}|layername=deposits" if package.name == "run.gpkg" else deposits


def spreads(
    deposits: geopandas.GeoDataFrame, at: Deposits, seed: int
) -> tuple[geopandas.GeoDataFrame, geopandas.GeoDataFrame]:
    """One sector for each release, and one point for each deposit."""
    x, y = deposits.geometry.x.to_numpy(), deposits.geometry.y.to_numpy()
    rows: list[dict[str, Any]] = []
    angle, distance, used = np.zeros(x.size), np.zeros(x.size), np.zeros(x.size, bool)
    for each in dict.fromkeys(at.release_id.tolist()):
        member = at.release_id == each
        centre = float(at.release_x[member].mean()), float(at.release_y[member].mean())
        record, angle[member], used[member] = spread_of_release(centre, x[member], y[member], at.nearest[member])
        distance[member] = np.hypot(x[member] - centre[0], y[member] - centre[1])
        counted = member & used
        low = arc_start(angle[counted])
        far = float(distance[counted].max()) if counted.any() else 0.0
        several = np.count_nonzero(counted) > 1
        shape = sector(centre, far, low, record["spread_deg"]) if several else shapely.Polygon()
        half = half_arc(angle[counted], at.log_id[counted], seed)
        edges = {"n_left_dem": int(at.left[member].sum()), "n_near_edge": int(at.near_edge[member].sum())}
        place = {"from_deg": low, "runout_max_m": far, "geometry": shape}
        rows.append({"release_id": each, **record, "spread_half_deg": half, **edges, **place})
    points = geopandas.GeoDataFrame(
        {
            "log_id": at.log_id,
            "release_id": at.release_id,
            "azimuth_deg": angle,
            "distance_m": distance,
            "counted": used,
            "near_edge": at.near_edge,
        },
        geometry=np.asarray(deposits.geometry),
        crs=deposits.crs,
    )
    return geopandas.GeoDataFrame(rows, geometry="geometry", crs=deposits.crs), points


def half_arc(azimuths: NDArray[np.float64], log_id: NDArray[np.int64], seed: int) -> float:
    """The smallest angle with half the logs, on average [deg]; NaN below two logs."""
    if azimuths.size < 2:
        return float("nan")
    arcs = [smallest_arc(azimuths[half]) for half in halves(log_id, seed, HALVES) if half.any()]
    return float(np.mean(arcs)) if arcs else float("nan")


def sector(centre: tuple[float, float], radius: float, low: float, width: float) -> shapely.Polygon:
    """The sector of a circle from azimuth ``low`` over ``width`` degrees clockwise, for the map."""
    steps = max(2, int(np.ceil(width / ARC_STEP_DEG)) + 1)
    angles = np.radians(low + np.linspace(0.0, width, steps))
    arc = np.column_stack([centre[0] + radius * np.sin(angles), centre[1] + radius * np.cos(angles)])
    return shapely.Polygon(np.vstack([centre, arc, centre]))
