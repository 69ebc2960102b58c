"""Profiles along chosen trajectories: what lies under the log, how high it is, how fast."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.report.sources import ReportedRun, paths_by_log

POINTS = 1200  # of a profile; more would not be visible


@dataclass(frozen=True)
class Profile:
    """Along the path of one log's centre of mass, shape (n,) [m, m/s]; ``chosen`` is the reason: farthest, ..."""

    log_id: int
    chosen: str
    way: NDArray[np.float64]
    terrain: NDArray[np.float64]
    z: NDArray[np.float64]
    clearance: NDArray[np.float64]
    speed: NDArray[np.float64]


def chosen_profiles(source: ReportedRun) -> list[Profile]:
    """The farthest and the fastest of the stored logs, and the one with the median run-out; none without terrain."""
    stored = source.deposits.loc[source.deposits["log_id"].isin(source.run.stored_log_ids.tolist())]
    stored = stored.loc[np.isfinite(stored["runout_m"])]
    if source.ground is None or not len(stored):
        return []
    ids = stored["log_id"].to_numpy(np.int64)
    far = ids[np.lexsort((ids, stored["runout_m"].to_numpy()))]
    fast = ids[np.lexsort((ids, stored["speed_max_ms"].to_numpy()))]
    picks = {
        int(far[-1]): "farthest",
        int(fast[-1]): "fastest",
        int(far[far.size // 2]): "median",
    }
    paths = paths_by_log(source.run, np.array(list(picks), np.int64))
    made = []
    for log_id, chosen in picks.items():
        path = paths[log_id]
        keep = np.unique(np.linspace(0, path["x"].size - 1, min(POINTS, path["x"].size)).astype(int))
        x, y, z = (path[name][keep] for name in "xyz")
        way = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
        terrain = source.ground.height(x, y)
        if way[-1] > 0.0 and np.isfinite(terrain).any():
            made.append(
                Profile(
                    log_id,
                    chosen,
                    way,
                    terrain,
                    z,
                    path["clearance_m"][keep].astype(float),
                    path["speed_ms"][keep].astype(float),
                )
            )
    return made
