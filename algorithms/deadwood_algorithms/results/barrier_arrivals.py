"""What comes to each barrier: every log as it is when it comes there, whether the barrier stops it or not.

Only logs that meet the plate are hits, so heights of hits never exceed the barrier's own. The height that a place needs
is therefore that of all logs, in the plane of the barrier: when their outline in plan first touches its line, as at a
line (`arrivals`), or when they first hit the plate, to where they moved on uniformly from their last poses before.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import geopandas
import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.results.arrivals import between, first_touches, heights_over, touch_between
from deadwood_algorithms.results.motion import energies_kj
from deadwood_algorithms.scene.items import Items
from deadwood_algorithms.stats.order_statistics import percentile_record
from deadwood_engine import Lines
from deadwood_engine.log_body import BASE_RADIUS, MASS, TIP_RADIUS, cone_bodies

if TYPE_CHECKING:
    from deadwood_algorithms.scene.layers import SceneLayers
    from deadwood_algorithms.scene.releases import Releases
    from deadwood_engine import Logs

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
ARRIVAL = "arrival_"  # prefix of the arrays with one row for each log and barrier
LEVEL = 0.95
MOST_ON = 3.0  # a log moves on after its last pose before a hit for at most twice the time between its last two


def piece_of(poses: Any) -> dict[str, NDArray]:
    """The engine's poses by the names of ``poses.parquet``, as if read back from there."""
    columns = {"log_row": poses.log_row, "t_s": poses.time, "speed_ms": poses.speed, "spin_rad_s": poses.spin}
    for ending, points in (("", poses.position), ("b", poses.base), ("t", poses.tip)):
        columns |= {axis + ending: points[:, k] for k, axis in enumerate("xyz")}
    return columns


def states_at(
    piece: dict[str, NDArray],
    lines: Lines,
    items: Items,
    bodies: Array,
    ground: Callable[[Array, Array], Array],
    origin: tuple[float, float],
    hits: Mapping[str, NDArray] | None = None,
) -> dict[str, NDArray]:
    """One row for each log and item that it comes to, by log: its time, place, speed, energies and height there.

    bodies : mass properties by log row; hits : log, item, time [s], speed [m/s], energy [kJ], height [m] of each hit
    """
    radii = np.ascontiguousarray(bodies[:, BASE_RADIUS]), np.ascontiguousarray(bodies[:, TIP_RADIUS])
    first = first_touches(piece, lines, items, radii, origin)
    hit_of = np.full(first.shape, -1)  # the first hit, if the log does not touch the line at a pose before
    ends = np.searchsorted(piece["log_row"], np.arange(len(bodies) + 1))
    for row, (log, item, time) in enumerate(zip(hits["log"], hits["item"], hits["time"], strict=True) if hits else ()):
        start, stop = ends[log], ends[log + 1]
        last = max(start, start + int(np.searchsorted(piece["t_s"][start:stop], time, side="right")) - 1)
        if first[log, item] < 0 or last < first[log, item]:
            first[log, item], hit_of[log, item] = last, row
    log, item = np.nonzero(first >= 0)
    pose, hit = first[log, item], hit_of[log, item]
    before, share = touch_between(piece, pose, items.geometry[item], *(each[log] for each in radii))
    moving, turning = energies_kj(piece, bodies)
    values = {"speed": piece["speed_ms"], "translation": moving, "rotation": turning}
    found = {name: between(each, before, pose, share) for name, each in values.items()}
    if hits:
        struck = np.flatnonzero(hit >= 0)
        of = {name: each[hit[struck]] for name, each in hits.items()}
        step = piece["t_s"][pose[struck]] - piece["t_s"][before[struck]]
        on = (of["time"] - piece["t_s"][before[struck]]) / np.where(step > 0.0, step, np.inf)
        share[struck] = np.where(step > 0.0, np.minimum(on, MOST_ON), 1.0)
        found["speed"][struck] = of["speed"]
        found["translation"][struck] = 0.0005 * bodies[log[struck], MASS] * of["speed"] ** 2
        found["rotation"][struck] = np.maximum(of["energy"] - found["translation"][struck], 0.0)
    there = {
        name: between(piece[name], before, pose, share) for name in ("t_s", *"xyz", "xb", "yb", "zb", "xt", "yt", "zt")
    }
    height = np.full(log.size, -np.inf)
    for each in np.unique(item):
        mine = item == each
        part = {name: column[mine] for name, column in (there | {"log": log}).items()}
        height[mine] = heights_over(part, items.geometry[each], radii, ground)
    if hits:  # it moved on uniformly, but may have met the ground since: it is at least as high as what hit the plate
        height = np.maximum(height, np.where(hit >= 0, np.append(hits["height"], 0.0)[hit], -np.inf))
    place = np.column_stack([there[axis] for axis in "xyz"])
    height = np.where(np.isfinite(height), height, np.nan)
    return {"log": log, "item": item, "time": there["t_s"], "place": place, "height": height} | found


def arrival_arrays(result: Any, layers: SceneLayers, logs: Logs) -> dict[str, NDArray]:
    """The arrivals at the barriers of a chunk's logs, all of whose poses are in the result."""
    bodies = (
        layers.shape.bodies(logs.density) if layers.shape else cone_bodies(logs.diameter, logs.length, logs.density)
    )
    plates, frame, by = layers.engine_barriers, layers.dem.frame, result.hits.by_barrier
    hits = {"log": result.hits.log_row[by], "item": layers.barriers.item[result.hits.item[by]]}
    hits |= {name: getattr(result.hits, name)[by] for name in ("time", "speed", "height")}
    hits["energy"] = result.hits.energy[by] / 1000.0
    found = states_at(
        piece_of(result.poses),
        Lines(plates.vertices, plates.starts),
        layers.barriers,
        bodies,
        layers.scene.terrain_height,
        (frame.x0, frame.y0),
        hits,
    )
    found["log_id"] = logs.log_id[found.pop("log")]
    return {ARRIVAL + name: values for name, values in found.items()}


def barrier_arrivals_frame(
    layers: SceneLayers, releases: Releases, by_log: Mapping[str, NDArray], hits: geopandas.GeoDataFrame, crs: Any
) -> geopandas.GeoDataFrame:
    """One row for each log and barrier that it comes to, in the order of the logs; drawn at its centre of mass."""
    names = ("log_id", "item", "time", "place", "speed", "translation", "rotation", "height")
    found = {name: by_log.get(ARRIVAL + name, np.zeros((0, 3) if name == "place" else 0)) for name in names}
    ids = np.argsort(releases.logs.log_id)
    row = ids[np.searchsorted(releases.logs.log_id, found["log_id"], sorter=ids)].astype(np.int64)
    order = np.lexsort((found["item"], row))
    row, found = row[order], {name: values[order] for name, values in found.items()}
    stops: Any = hits.groupby(["log_id", "barrier_id"])["stopped"].max()
    held = stops.to_dict()
    barrier_id = np.array(layers.barriers.ids)[found["item"].astype(np.int64)]
    pairs = list(zip(found["log_id"].tolist(), barrier_id.tolist(), strict=True))
    columns = {
        "log_id": found["log_id"].astype(np.int64),
        "release_id": releases.release_id[row],
        "barrier_id": barrier_id,
        "t_s": found["time"],
        "speed_ms": found["speed"],
        "energy_kj": found["translation"] + found["rotation"],
        "rotation_kj": found["rotation"],
        "height_needed_m": found["height"],
        "hit": np.array([int(pair in held) for pair in pairs], np.int64),
        "stopped": np.array([int(held.get(pair, 0)) for pair in pairs], np.int64),
    }
    return geopandas.GeoDataFrame(columns, geometry=shapely.points(found["place"]), crs=crs)


def barrier_ledger(
    records: list[dict[str, Any]], hits: geopandas.GeoDataFrame, arrivals: geopandas.GeoDataFrame
) -> list[dict[str, Any]]:
    """The barriers' records of the summary, with what their places need, and what hit them; None where nothing did."""
    out = []
    for record in records:
        of: list[Any] = [each[each["barrier_id"] == record["barrier_id"]] for each in (hits, arrivals)]
        hit, came = of
        needed = percentile_record(came["height_needed_m"].dropna().to_numpy(), LEVEL)
        ends = {"p95": needed["value"], "ci_low": needed["ci_low"], "ci_high": needed["ci_high"]}
        out.append(
            {
                **record,
                "n_hits": len(hit),
                "energy_hit_max_kj": _largest(hit["energy_kj"]),
                "height_hit_max_m": _largest(hit["height_hit_m"]),
                "energy_needed_max_kj": _largest(came["energy_kj"]),
                "height_needed_max_m": _largest(came["height_needed_m"]),
                **{f"height_needed_{name}_m": value if value == value else None for name, value in ends.items()},
            }
        )
    return out


def _largest(values: Any) -> float | None:
    return float(values.max()) if values.notna().any() else None
