"""Find which stored trajectories reach lines or polygons (roads, houses), and with what probability.

A log reaches a line when any part of its plan-view outline touches it at any time, and a polygon also when it starts
inside (paper, equation 10). Each probability comes with its 95 % Wilson interval, over the logs whose trajectory was
stored: with fewer than all of them stored it is an estimate from that sample. The arrivals say which log touched what,
when, where, and how fast.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms import tool
from deadwood_algorithms.statistics import percent_with_interval, reach_record
from deadwood_algorithms.tool import Cancelled, Feedback, Outcome, Tool, UserError

if TYPE_CHECKING:
    import geopandas

    from deadwood_algorithms.run_folder import Run
    from deadwood_algorithms.scene_from_layers import Items
    from deadwood_engine import Lines


@dataclass(frozen=True, kw_only=True)
class Ask:
    run: str = tool.folder("Folder of a run of slide-logs")
    lines: str = tool.vector("Roads, railways, houses to be reached", "line", "polygon")
    output: str = tool.output_vector("Reach and arrivals")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    import geopandas

    from deadwood_algorithms.layers import output_path, write_vector
    from deadwood_algorithms.run_folder import read_run
    from deadwood_algorithms.scene_from_layers import read_lines

    with output_path(ask.output, ask.overwrite, suffix=".gpkg", inputs=[ask.lines]) as path:
        source = read_run(ask.run, feedback=feedback)
        lines, items = read_lines(ask.lines, source.grid, feedback)
        if not source.stored_log_ids.size:
            raise UserError(f"{ask.run}: no trajectory was stored; run slide-logs with --trajectories all")
        total = len(source.deposits)
        if source.stored_log_ids.size < total:
            feedback.note(f"{source.stored_log_ids.size} of {total} logs have a stored trajectory; p is theirs")

        arrivals = arrivals_of(source, lines, items, feedback)

        counts = np.bincount(arrivals.pop("line").to_numpy(), minlength=len(items.ids))
        records = [
            {"line_id": line_id, **reach_record(int(counts[k]), source.stored_log_ids.size)}
            for k, line_id in enumerate(items.ids)
        ]
        columns = {name: [record[name] for record in records] for name in records[0]}
        reach = geopandas.GeoDataFrame(columns, geometry=items.geometry, crs=source.deposits.crs)
        write_vector(path, {"reach": reach, "arrivals": arrivals})
    shown = tuple(
        f"{each['line_id']}: reached by {each['n_reach']} of {each['n_total']} logs, {percent_with_interval(each)}"
        for each in records
    )
    return Outcome({"output": Path(ask.output)}, {"reach": records}, shown)


def arrivals_of(source: Run, lines: Lines, items: Items, feedback: Feedback) -> geopandas.GeoDataFrame:
    """One row a log and line that it reached: the first touch, as a point at the log's centre of mass then."""
    import geopandas
    import pandas

    pieces: list[dict[str, Any]] = []
    done = 0
    for piece in source.poses(source.stored_log_ids):
        if feedback.cancelled():
            raise Cancelled
        first = first_touches(source, piece, lines, items)
        log_row, line = np.nonzero(first >= 0)
        pose = first[log_row, line]
        piece["path_m"] = path_so_far(piece)
        pieces.append({"log_row": log_row, "line": line} | {name: piece[name][pose] for name in WANTED})
        done += np.unique(piece["log_id"]).size
        feedback.progress(done, source.stored_log_ids.size, "following trajectories")
    found = pandas.DataFrame({name: np.concatenate([each[name] for each in pieces]) for name in pieces[0]})
    found = found.sort_values(["line", "log_row"], kind="stable")
    of_log = source.deposits.iloc[found["log_row"].to_numpy()]
    energy = 0.5 * mass_of_cone(*(of_log[name].to_numpy(float) for name in SIZES)) * found["speed_ms"].to_numpy() ** 2
    columns = {
        "log_id": of_log["log_id"].to_numpy(),
        "release_id": of_log["release_id"].to_numpy(),
        "line_id": np.array(items.ids)[found["line"].to_numpy()],
        "t_s": found["t_s"].to_numpy(),
        "path_m": found["path_m"].to_numpy(),
        "speed_ms": found["speed_ms"].to_numpy(np.float64),
        "energy_kj": energy / 1000.0,
        "stop_reason": of_log["stop_reason"].to_numpy(),
        "line": found["line"].to_numpy(),
    }
    points = shapely.points(found[["x", "y", "z"]].to_numpy())
    return geopandas.GeoDataFrame(columns, geometry=points, crs=source.deposits.crs)


WANTED = ("t_s", "path_m", "x", "y", "z", "speed_ms")
SIZES = ("dbh_cm", "length_m", "density_kg_m3")


def first_touches(source: Run, piece: dict[str, NDArray], lines: Lines, items: Items) -> NDArray[np.int64]:
    """Row in ``piece`` of the first pose of each log that touches each item, -1 for none; shape (n_logs, n_items)."""
    from deadwood_engine import segments_of, sweep_touches

    n_logs = len(source.deposits)
    segments = segments_of(lines, source.grid.x0, source.grid.y0)
    base = np.stack([piece["xb"], piece["yb"], piece["zb"]], axis=1)
    tip = np.stack([piece["xt"], piece["yt"], piece["zt"]], axis=1)
    _, pose = sweep_touches(piece["log_row"], base, tip, *source.radii(), segments)
    none = np.iinfo(np.int64).max
    first = np.full((n_logs, len(items.ids)), none)
    for row, item in enumerate(items.item):
        first[:, item] = np.minimum(first[:, item], np.where(pose[:, row] < 0, none, pose[:, row]))
    starts = np.flatnonzero(np.diff(piece["log_row"], prepend=-1))
    for column, shape in enumerate(items.geometry):
        if shapely.get_dimensions(shape) == 2:
            inside = starts[shapely.contains_xy(shape, piece["x"][starts], piece["y"][starts])]
            first[piece["log_row"][inside], column] = inside
    return np.where(first == none, -1, first)


def path_so_far(piece: dict[str, NDArray]) -> NDArray[np.float64]:
    """Length of the path of the centre of mass up to each pose, from the first pose of its log [m]."""
    points = np.stack([piece["x"], piece["y"], piece["z"]], axis=1)
    steps = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
    first = np.diff(piece["log_row"], prepend=-1) != 0
    steps[first] = 0.0
    path = np.cumsum(steps)
    return path - path[first][np.cumsum(first) - 1]


def mass_of_cone(dbh_cm: NDArray, length_m: NDArray, density_kg_m3: NDArray) -> NDArray[np.float64]:
    """Mass of a truncated cone whose tip has half the diameter of its base [kg]."""
    return density_kg_m3 * np.pi / 12.0 * length_m * 1.75 * (dbh_cm / 100.0) ** 2


TOOL = Tool("reach-lines", "Evaluate", "Stored trajectories: probability of reaching roads or houses", Ask, run)
