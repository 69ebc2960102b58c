"""The ledgers of a run: every hit of a barrier, and the totals of each tree, lying log or boulder that was hit.

The engine reports the hits of each chunk of logs. Those of barriers are stored one by one; those of trees are summed by
tree immediately, because a forest is hit a thousand times more often, so memory grows with barriers' hits and trees
only.
Sums are of whole millinewton-seconds and millijoules, so the order in which hits are added does not matter.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import geopandas
import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.results.capacity import LOGS_ABOVE, TREES_ABOVE
from deadwood_algorithms.stats.endings import ended

if TYPE_CHECKING:
    from deadwood_algorithms.results.capacity import Overloads
    from deadwood_algorithms.scene.layers import SceneLayers
    from deadwood_algorithms.scene.releases import Releases

UNIT = 1e-3  # [N s, J] unit of sums: 2^63 of them are the impulse of 1e9 hits of 9 MN s
HITS = "hits_"  # prefix of the arrays with one row for each hit or tree
BARRIER = (
    "log_row",
    "item",
    "time",
    "duration",
    "place",
    "height",
    "speed",
    "energy",
    "angle",
    "impulse",
    "energy_taken",
)


def hit_arrays(
    hits: Any, log_id: NDArray[np.int64], layers: SceneLayers, overloads: Overloads | None = None
) -> dict[str, NDArray]:
    """The stored hits of a chunk: those of barriers, and the sums for each tree, then lying log, then block.

    With ``overloads`` also how many hits were above capacity, by tree and by log.
    """
    by = hits.by_barrier
    kept = {f"{HITS}barrier_{name}": getattr(hits, name)[by] for name in BARRIER}
    kept[f"{HITS}barrier_log_id"] = log_id[kept.pop(f"{HITS}barrier_log_row")]
    item, log_row = _numbered(layers)[hits.item[~by]], hits.log_row[~by]
    trees, place = np.unique(item, return_inverse=True)
    pairs = np.unique(np.column_stack([place, log_row]), axis=0)[:, 0]
    largest = np.zeros(trees.size)
    np.maximum.at(largest, place, hits.impulse[~by])
    sums = {
        "item": trees,
        "n_logs": np.bincount(pairs, minlength=trees.size),
        "n_hits": np.bincount(place, minlength=trees.size),
        "impulse_sum": _whole_sums(place, hits.impulse[~by], trees.size),
        "impulse_max": largest,
        "energy_taken": _whole_sums(place, hits.energy_taken[~by], trees.size),
        "n_broken": np.bincount(place[hits.broke[~by]], minlength=trees.size),
    }
    above = {}
    if overloads:
        of_tree, of_log = overloads.hits_above(hits, log_id, layers)
        sums["n_above"] = np.bincount(place[of_tree[~by]], minlength=trees.size)
        for name, which in ((TREES_ABOVE, of_tree), (LOGS_ABOVE, of_log)):
            above[name] = np.bincount(hits.log_row[which], minlength=log_id.size)
    return kept | above | {f"{HITS}tree_{name}": values for name, values in sums.items()}


def _numbered(layers: SceneLayers) -> NDArray[np.int64]:
    """The object to which each of the engine's rows belongs: trees, then lying logs, then blocks."""
    trees, lying = len(layers.tree_ids), len(layers.lying.ids)
    blocks = trees + lying + np.arange(len(layers.blocks.ids))
    return np.concatenate([np.arange(trees), trees + layers.lying.item, blocks]).astype(np.int64)


def _whole_sums(place: NDArray[np.intp], values: NDArray[np.float64], number: int) -> NDArray[np.int64]:
    """Sums by object in whole units."""
    out = np.zeros(number, np.int64)
    np.add.at(out, place, np.rint(values / UNIT).astype(np.int64))
    return out


def barrier_hits_frame(
    layers: SceneLayers, releases: Releases, by_log: Mapping[str, NDArray], crs: Any
) -> geopandas.GeoDataFrame:
    """One row for each hit, in the order of the logs, then of time; a point where the log first touched the barrier."""
    found = {name: by_log[f"{HITS}barrier_{name}"] for name in ("log_id", *BARRIER[1:])}
    ids = np.argsort(releases.logs.log_id)
    row = ids[np.searchsorted(releases.logs.log_id, found["log_id"], sorter=ids)].astype(np.int64)
    order = np.lexsort((found["time"], row))
    row, found = row[order], {name: values[order] for name, values in found.items()}
    barrier = layers.barriers.item[found["item"]]
    columns = {
        "log_id": found["log_id"],
        "release_id": releases.release_id[row],
        "barrier_id": np.array(layers.barriers.ids)[barrier],
        "t_s": found["time"],
        "duration_s": found["duration"],
        "height_hit_m": found["height"],
        "speed_ms": found["speed"],
        "energy_kj": found["energy"] / 1000.0,
        "energy_taken_kj": found["energy_taken"] / 1000.0,
        "impulse_kns": found["impulse"] / 1000.0,
        "angle_deg": np.degrees(found["angle"]),
        "stopped": _held(layers, by_log, row, barrier),
    }
    return geopandas.GeoDataFrame(columns, geometry=shapely.points(found["place"]), crs=crs)


def _held(
    layers: SceneLayers, by_log: Mapping[str, NDArray], row: NDArray[np.int64], barrier: NDArray[np.int64]
) -> NDArray[np.int64]:
    """1 for a log's last hit of the barrier that holds it, else 0."""

    held = ended(by_log, "barrier")
    by = np.full(held.size, -1)
    by[held] = layers.barriers.item[by_log["stop_item"][held]]
    last = {(r, b): place for place, (r, b) in enumerate(zip(row.tolist(), barrier.tolist(), strict=True))}
    out = np.zeros(row.size, np.int64)
    out[[place for (r, b), place in last.items() if by[r] == b]] = 1
    return out


def _totals(layers: SceneLayers, by_log: Mapping[str, NDArray], *own: str) -> dict[str, NDArray]:
    """Sums over all chunks, one row for each tree, then for each lying log, then for each block; ``own`` : counts that
    only one kind has.
    """
    from deadwood_engine import STOP_REASONS

    number = len(layers.tree_ids) + len(layers.lying.ids) + len(layers.blocks.ids)
    reason, item = by_log["stop_reason"], by_log["stop_item"]
    before = {"tree": 0, "lying_log": len(layers.tree_ids), "block": len(layers.tree_ids) + len(layers.lying.item)}
    rows = [first + item[reason == STOP_REASONS.index(name)] for name, first in before.items()]
    held = _numbered(layers)[np.concatenate(rows)]
    item = by_log[f"{HITS}tree_item"]
    total = {"n_stops": np.bincount(held, minlength=number)}
    for name in ("n_logs", "n_hits", "impulse_sum", "energy_taken", *own):
        values = by_log[f"{HITS}tree_{name}"]
        total[name] = np.zeros(number, values.dtype)
        np.add.at(total[name], item, values)
    largest = np.zeros(number)
    np.maximum.at(largest, item, by_log[f"{HITS}tree_impulse_max"])
    return {
        "n_logs": total["n_logs"],
        "n_hits": total["n_hits"],
        "n_stops": total["n_stops"],
        "impulse_sum_kns": total["impulse_sum"] * UNIT / 1000.0,
        "impulse_max_kns": largest / 1000.0,
        "energy_taken_kj": total["energy_taken"] * UNIT / 1000.0,
        **{name: total[name] for name in own},
    }


def tree_hits_frame(layers: SceneLayers, by_log: Mapping[str, NDArray], crs: Any) -> geopandas.GeoDataFrame:
    """One row for each tree that was hit or holds a log, in the order of the trees: hits, stops, impulse and energy
    taken.
    """
    own = ("n_above",) if TREES_ABOVE in by_log else ()
    total = {name: values[: len(layers.tree_ids)] for name, values in _totals(layers, by_log, *own).items()}
    tree = np.flatnonzero((total["n_hits"] > 0) | (total["n_stops"] > 0))
    columns = {
        "tree_id": np.array(layers.tree_ids, object)[tree],
        "dbh_cm": layers.tree_dbh_cm[tree],
        "height_m": layers.trees.height[tree],
        **{name: values[tree] for name, values in total.items()},
    }
    points = shapely.points(layers.trees.x[tree], layers.trees.y[tree])
    return geopandas.GeoDataFrame(columns, geometry=points, crs=crs)


def lying_hits_frame(layers: SceneLayers, by_log: Mapping[str, NDArray], crs: Any) -> geopandas.GeoDataFrame:
    """The same for the lying logs, as lines."""
    first = len(layers.tree_ids)
    mine = slice(first, first + len(layers.lying.ids))
    total = {name: values[mine] for name, values in _totals(layers, by_log, "n_broken").items()}
    log = np.flatnonzero((total["n_hits"] > 0) | (total["n_stops"] > 0))
    ids = np.empty(len(layers.lying.ids), object)
    ids[:] = [str(each) for each in layers.lying.ids]
    columns = {"lying_id": ids[log]} | {name: values[log] for name, values in total.items()}
    return geopandas.GeoDataFrame(columns, geometry=layers.lying.geometry[log], crs=crs)


def block_hits_frame(layers: SceneLayers, by_log: Mapping[str, NDArray], crs: Any) -> geopandas.GeoDataFrame:
    """The same for the boulders."""
    first = len(layers.tree_ids) + len(layers.lying.ids)
    total = {name: values[first:] for name, values in _totals(layers, by_log).items()}
    block = np.flatnonzero((total["n_hits"] > 0) | (total["n_stops"] > 0))
    solid = layers.blocks.solid
    columns = {
        "block_id": np.array(layers.blocks.ids, object)[block],
        "diameter_m": solid.diameter[block],
        "height_m": solid.height[block],
        **{name: values[block] for name, values in total.items()},
    }
    return geopandas.GeoDataFrame(columns, geometry=shapely.points(solid.x[block], solid.y[block]), crs=crs)


def obstacle_record(hit: geopandas.GeoDataFrame, number: int) -> dict[str, Any]:
    """Total effect of the standing trees, the lying logs or the boulders."""
    hits, stops = hit["n_hits"].to_numpy(), hit["n_stops"].to_numpy()
    return {
        "n_total": number,
        "n_hit": int(np.count_nonzero(hits)),
        "n_stopping": int(np.count_nonzero(stops)),
        "n_hits": int(hits.sum()),
        "n_stops": int(stops.sum()),
        "impulse_sum_kns": float(hit["impulse_sum_kns"].to_numpy().sum()),
        "energy_taken_kj": float(hit["energy_taken_kj"].to_numpy().sum()),
        **({"n_broken": int(hit["n_broken"].to_numpy().sum())} if "n_broken" in hit else {}),
    }
