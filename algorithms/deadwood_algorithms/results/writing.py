"""The results of a run as layers, rasters and a summary: converted from the engine's arrays.

Directions become azimuths from grid north, joules become kilojoules, row numbers become the ids of logs, trees,
barriers and lines. `slide_logs` calls `write_results` once, when the last chunk of logs is finished.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import pyarrow as pa
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.files.streams import Stream, write_geoparquet
from deadwood_algorithms.files.vectors import write_vector
from deadwood_algorithms.params.tool import Feedback, Outcome
from deadwood_algorithms.results.barrier_arrivals import arrival_arrays, barrier_arrivals_frame
from deadwood_algorithms.results.capacity import LOGS_ABOVE, TREES_ABOVE, Capacity, Overloads
from deadwood_algorithms.results.checked import SUMMARY
from deadwood_algorithms.results.hits import (
    barrier_hits_frame,
    block_hits_frame,
    hit_arrays,
    lying_hits_frame,
    tree_hits_frame,
)
from deadwood_algorithms.results.identity import Making, write_manifest
from deadwood_algorithms.results.lost import many, reach_records
from deadwood_algorithms.results.maps import write_run_rasters
from deadwood_algorithms.results.own_slope import warn_if_flagged
from deadwood_algorithms.results.run_folder import GEOPACKAGE, MANIFEST, POSES, write_json
from deadwood_algorithms.results.run_settings import RunSettings
from deadwood_algorithms.results.scenario import posture_shares
from deadwood_algorithms.results.summary import (
    lines_of,
    loss_of_run,
    summary_of,
)
from deadwood_algorithms.results.trajectories import pose_table, stream_poses, trajectories
from deadwood_algorithms.scene.items import Items
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import Releases, reached
from deadwood_algorithms.simulate.chunks import ChunkedRun, Keeper
from deadwood_algorithms.simulate.columns import Columns
from deadwood_algorithms.simulate.sinking import Sinking
from deadwood_algorithms.stats.directions import azimuth
from deadwood_algorithms.stats.endings import ended, left_dem, reasons_in_words
from deadwood_engine import Logs

PIECE = 2**14  # number of rows of a layer made at once
COST = "cost_"  # prefix of arrays with one row for each chunk
FAILED = "failed_"  # prefix of arrays of logs that failed
FAILED_STATES = "failed.json"
BY_LOG = (
    "stop_reason",
    "stop_item",
    "duration",
    "path",
    "end_position",
    "release_position",
    "base_end",
    "tip_end",
    "speed_max",
    "speed_mean",
    "energy_max",
    "jump_max",
    "height_max",
    "tree_hits",
    "barrier_hits",
    "energy_error",
    "penetration_max",
    "residual_max",
    "unconverged",
    "steps",
    "grip",
    "started_in_contact",
    "reach",
    "reach_time",
    "barrier_reached",
    "barrier_crossed",
)


def arrays_of(
    result: Any, layers: SceneLayers, log_id: NDArray[np.int64], wall_s: float, overloads: Overloads | None = None
) -> dict[str, NDArray]:
    """The stored results of a chunk: one row for each log, the ledgers of hits, and one row for the chunk's cost."""
    cost = {f"{COST}{name}": np.array([value], np.float64) for name, value in result.cost.items()}
    kept = {name: np.asarray(getattr(result, name)) for name in BY_LOG}
    failed = ended(result.stop_reason, "failed")
    kept |= {f"{FAILED}log_id": log_id[failed], f"{FAILED}state": result.last_state[failed]}
    return kept | hit_arrays(result.hits, log_id, layers, overloads) | cost | {f"{COST}wall_s": np.array([wall_s])}


def kept_of(
    result: Any,
    layers: SceneLayers,
    logs: Logs,
    keep: NDArray[np.bool_],
    wall_s: float,
    overloads: Overloads | None = None,
) -> tuple[dict[str, NDArray], pa.Table]:
    """The stored results of a chunk, and the poses of those of its logs that keep them."""
    kept = arrays_of(result, layers, logs.log_id, wall_s, overloads)
    if layers.barriers.ids:
        kept |= arrival_arrays(result, layers, logs)
    poses = pose_table(result.poses, logs.log_id, layers.dem.crs)
    return kept, poses.filter(pa.array(keep[result.poses.log_row]))


def keeper_of(capacity: Capacity, releases: Releases) -> Keeper:
    """The function that selects the stored results of a chunk; with a capacity, hits above it are included."""
    return partial(kept_of, overloads=Overloads.of(capacity, releases)) if capacity else kept_of


def write_results(
    folder: Path,
    final: Path,
    making: Making,
    settings: RunSettings,
    done: ChunkedRun,
    feedback: Feedback,
    *,
    geoparquet: bool = False,
) -> Outcome:
    """Write every file of the run's folder, whose final place is ``final``; with ``geoparquet`` its layers in both
    formats.

    Rows are in the order of the releases, whatever the order in which logs were slid.
    """
    feedback.progress(0, 3, "writing the results")
    layers, releases, queue, work = done.slope.layers, done.releases, done.queue, done.work
    rows, order = queue.slid_rows()
    releases = releases if rows.size == len(releases) else releases.take(rows)
    by_log = work.by_log((*BY_LOG, TREES_ABOVE, LOGS_ABOVE) if settings.capacity else BY_LOG, order)
    touched = reached(layers.lines, by_log, releases)
    crs = layers.dem.plan_crs
    tables: dict[str, geopandas.GeoDataFrame | Stream] = {
        "deposits": in_pieces(layers, releases, by_log, "Point Z", lambda deposits, part: deposits),
        "deposited_logs": in_pieces(layers, releases, by_log, "LineString Z", axes_frame),
    }
    with stream_poses(folder / POSES, work, layers.dem.crs) as paths:
        if len(paths):
            tables["trajectories"] = trajectories(paths, layers, releases, by_log)
        if layers.lines.ids:
            tables["reach"] = reach_frame(layers.lines, touched, left_dem(by_log), crs)
            if touched.any():
                tables["reached_by"] = Stream("Point Z", partial(reached_by, layers, touched, by_log, releases))
        plates = barrier_hits_frame(layers, releases, by_log, crs)
        hits = {
            "barrier_arrivals": barrier_arrivals_frame(layers, releases, by_log, plates, crs),
            "barrier_hits": plates,
            "tree_hits": tree_hits_frame(layers, by_log, crs),
            "lying_hits": lying_hits_frame(layers, by_log, crs),
            "block_hits": block_hits_frame(layers, by_log, crs),
        }
        tables |= {name: each for name, each in hits.items() if len(each)}
        write_vector(folder / GEOPACKAGE, tables)
        for name, layer in tables.items() if geoparquet else ():
            write_geoparquet(folder / f"{name}.parquet", layer if isinstance(layer, Stream) else Stream.of(layer))
    feedback.progress(1, 3, "writing the results")

    outputs = write_run_rasters(
        folder, done.slope.rasters, layers, len(releases), settings.danger_least, danger_counts=settings.danger_counts
    )
    feedback.progress(2, 3, "writing the results")

    summary = summary_of(settings, done.simulation.fidelity, layers, releases, by_log, touched, hits, queue)
    still = summary["logs"]["by_stop_reason"]["time_limit"]
    if many(still, len(releases)):
        fix = "raise --time-limit-s"
        if layers.shape is None and not settings.scene.rolling_friction:
            fix += ", or --rolling-friction, without which a log that rolls on smooth ground does not stop"
        feedback.warn(
            f"{still} of {len(releases)} logs still moved at --time-limit-s {settings.scene.time_limit_s:g}, so their "
            f"deposits are not final; {fix}",
            code="time-limit",
            still_moving=still,
            logs=len(releases),
        )
    if loss := loss_of_run(summary):
        feedback.warn(loss, code="left-dem", left=summary["logs"]["by_stop_reason"]["left_dem"], logs=len(releases))
    warn_if_flagged(summary.get("own_slope"), feedback)
    if states := failed_states(layers, releases, by_log):
        write_json(folder / FAILED_STATES, {"logs": states})
        feedback.warn(
            f"{len(states)} of {len(releases)} logs failed, the others are not affected; {FAILED_STATES} has their "
            "last states, from which the engine can continue (deadwood_engine.Start): please report them",
            code="failed",
            failed=len(states),
            logs=len(releases),
        )
    sinking = Sinking()  # of all logs, also of those slid before the run was resumed
    sinking.add(releases.logs, layers.shape, by_log["penetration_max"])
    sinking.say(layers.dem.cell, feedback)
    done.simulation.sinking.deep = 0  # said
    by_log.close()
    write_json(folder / SUMMARY, {**summary, "warnings": making.warnings})
    making.facts |= {**_facts(layers, releases), "effective": effective_values(releases)}
    if settings.auto is not None:  # chosen by --fidelity auto, which depends on the clock of the machine
        making.facts["chosen"] = {"fidelity": settings.fidelity, "logs": len(releases)}
    write_manifest(folder, making.manifest())  # for code that reads the run before it is complete and sealed
    feedback.progress(3, 3, "writing the results")
    names = {"run": GEOPACKAGE, "poses": POSES, "summary": SUMMARY, "manifest": MANIFEST} | outputs
    paths = {"output": final} | {key: final / name for key, name in names.items()}
    return Outcome(paths, summary, lines_of(summary))


def effective_values(releases: Releases) -> dict[str, dict[str, float]]:
    """Minimum, median and maximum of the logs' values, from their columns or from the options; shares of postures."""
    logs = releases.logs
    columns = {
        "dbh_cm": releases.dbh_cm,
        "length_m": logs.length,
        "density_kg_m3": logs.density,
        "tilt_deg": np.degrees(logs.tilt),
        "azimuth_deg": np.degrees(logs.azimuth),
        "speed_ms": logs.speed,
        "drop_m": logs.drop,
    }
    ranges = {
        name: {"min": float(values.min()), "median": float(np.median(values)), "max": float(values.max())}
        for name, values in columns.items()
        if values.size
    }
    return ranges | {"orientation": posture_shares(releases)}


def in_pieces(
    layers: SceneLayers,
    releases: Releases,
    by_log: Columns,
    geometry: str,
    frame_of: Callable[[geopandas.GeoDataFrame, Mapping[str, NDArray]], geopandas.GeoDataFrame],
) -> Stream:
    """A layer of one row for each log, made for `PIECE` deposits at a time."""

    def pieces() -> Iterator[geopandas.GeoDataFrame]:
        for start in range(0, len(releases), PIECE):
            rows = slice(start, start + PIECE)
            part = by_log.rows(rows)
            yield frame_of(deposits_frame(layers, releases.take(rows), part), part)

    return Stream(geometry, pieces)


def deposits_frame(layers: SceneLayers, releases: Releases, by_log: Mapping[str, NDArray]) -> geopandas.GeoDataFrame:
    """One row for each released log: where it ended, and how it moved."""
    start, end, axis = by_log["release_position"], by_log["end_position"], by_log["tip_end"] - by_log["base_end"]
    dx, dy, dz = (end - start).T
    columns: dict[str, Any] = {
        "log_id": releases.logs.log_id,
        "release_id": releases.release_id,
        "release_x": start[:, 0],
        "release_y": start[:, 1],
        "release_z": start[:, 2],
        "stop_reason": reasons_in_words(by_log),
        "stop_id": _stop_ids(layers, by_log),
        "duration_s": by_log["duration"],
        "path_m": by_log["path"],
        "runout_m": np.hypot(dx, dy),
        "fall_m": -dz,
        "bearing_deg": azimuth(dx, dy),
        "heading_deg": azimuth(axis[:, 0], axis[:, 1]),
        "tilt_deg": np.degrees(np.arctan2(np.hypot(axis[:, 0], axis[:, 1]), axis[:, 2])),
        "speed_max_ms": by_log["speed_max"],
        "speed_mean_ms": by_log["speed_mean"],
        "energy_max_kj": by_log["energy_max"] / 1000.0,
        "jump_max_m": by_log["jump_max"],
        "height_max_m": by_log["height_max"],
        "tree_hits": by_log["tree_hits"],
        "barrier_hits": by_log["barrier_hits"],
        **{name: by_log[name] for name in (TREES_ABOVE, LOGS_ABOVE) if name in by_log},
        "energy_error_rel": by_log["energy_error"],
        "penetration_max_m": by_log["penetration_max"],
        "dbh_cm": releases.dbh_cm,
        "length_m": releases.logs.length,
        "density_kg_m3": releases.logs.density,
    }
    return geopandas.GeoDataFrame(columns, geometry=shapely.points(end), crs=layers.dem.plan_crs)


def _stop_ids(layers: SceneLayers, by_log: Mapping[str, NDArray]) -> NDArray[Any]:
    """Id, as text, of the tree, lying log (``lying:ID``), boulder (``block:ID``) or barrier that holds each log; None
    for the others."""
    ids = np.full(by_log["stop_item"].size, None, object)
    reason = reasons_in_words(by_log)
    for row in np.flatnonzero(by_log["stop_item"] >= 0):
        item = int(by_log["stop_item"][row])
        if reason[row] == "tree":
            ids[row] = layers.tree_ids[item]
        elif reason[row] == "lying_log":
            ids[row] = f"lying:{layers.lying.ids[layers.lying.item[item]]}"
        elif reason[row] == "block":
            ids[row] = f"block:{layers.blocks.ids[item]}"
        elif reason[row] == "barrier":
            ids[row] = str(layers.barriers.ids[layers.barriers.item[item]])
    return ids


def failed_states(layers: SceneLayers, releases: Releases, by_log: Columns) -> list[dict[str, Any]]:
    """The last finite state of each log that failed, in world coordinates and SI units, for a replay."""
    failed = np.flatnonzero(np.isin(releases.logs.log_id, by_log[f"{FAILED}log_id"]))
    rows = deposits_frame(layers, releases.take(failed), by_log.rows(failed)).set_index("log_id")
    return [
        {
            "log_id": int(log_id),
            "t_s": float(rows.at[log_id, "duration_s"]),
            "position_m": [rows.at[log_id, "geometry"].x, rows.at[log_id, "geometry"].y, rows.at[log_id, "geometry"].z],
            "quaternion_wxyz": state[3:7],
            "velocity_ms": state[7:10],
            "angular_velocity_rad_s": state[10:13],
            "dbh_cm": float(rows.at[log_id, "dbh_cm"]),
            "length_m": float(rows.at[log_id, "length_m"]),
            "density_kg_m3": float(rows.at[log_id, "density_kg_m3"]),
        }
        for log_id, state in zip(by_log[f"{FAILED}log_id"], by_log[f"{FAILED}state"], strict=True)
    ]


def axes_frame(deposits: geopandas.GeoDataFrame, by_log: Mapping[str, NDArray]) -> geopandas.GeoDataFrame:
    """The logs as they lie at the end: a line from base to tip."""
    ends = np.stack([by_log["base_end"], by_log["tip_end"]], axis=1)
    columns = deposits[["log_id", "release_id", "stop_reason", "dbh_cm", "length_m"]]
    return geopandas.GeoDataFrame(columns, geometry=shapely.linestrings(ends), crs=deposits.crs)


def reach_frame(lines: Items, touched: NDArray[np.bool_], left: NDArray[np.bool_], crs: Any) -> geopandas.GeoDataFrame:
    """One row for each line: how many logs reached it, and the probability with its interval."""
    records = reach_records(lines.ids, touched, left)
    columns = {name: [record[name] for record in records] for name in records[0]}
    return geopandas.GeoDataFrame(columns, geometry=lines.geometry, crs=crs)


def reached_by(
    layers: SceneLayers, touched: NDArray[np.bool_], by_log: Columns, releases: Releases
) -> Iterator[geopandas.GeoDataFrame]:
    """One row for each log and line that it reached, drawn at the log's release point: where do arrivals come from?"""
    lines = layers.lines
    for start in range(0, len(releases), PIECE):
        rows = slice(start, start + PIECE)
        log, line = np.nonzero(touched[rows])
        if not log.size:
            continue
        part = by_log.rows(rows)
        columns = {
            "log_id": releases.logs.log_id[rows][log],
            "release_id": releases.release_id[rows][log],
            "line_id": np.array(lines.ids)[line],
            "t_s": np.nan_to_num(lines.first_time(part["reach_time"])[log, line]),  # inside from the start: 0 s
        }
        points = shapely.points(part["release_position"][log])
        yield geopandas.GeoDataFrame(columns, geometry=points, crs=layers.dem.plan_crs)


def _facts(layers: SceneLayers, releases: Releases) -> dict[str, Any]:
    dem = layers.dem.frame
    crs = dem.plan_crs.to_string()
    grid = {"nx": dem.shape[1], "ny": dem.shape[0], "cell": dem.cell, "x0": dem.x0, "y0": dem.y0, "crs": crs}
    return {"grid": grid, "digests": {"scene": layers.digest, "releases": releases.digest}}
