"""A pilot before a run: a few of its logs slide at ``draft``, and those that leave the terrain model are reported.

After the run the number is known, but then the time has been spent. The pilot costs a fraction of a second, changes no
result, and shows on which side the terrain model is too small and, roughly, by how much.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.scene.friction import number_of
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import Releases
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.simulate.simulation import Simulation
from deadwood_algorithms.simulate.warm_up import load_kernels
from deadwood_algorithms.simulate.windows import GRAVITY, energy_slope
from deadwood_algorithms.stats.endings import left_dem
from deadwood_engine import FIDELITIES, Result, slide
from deadwood_engine.rotation import VX, VY

Array = NDArray[np.float64]

LOGS = 50  # slid in the pilot; a run with fewer logs needs none
WORTH_TELLING = 0.05  # share of these logs that causes a warning
LONGEST_S = 120.0  # longest time that a log slides; logs still moving then are not counted
NEAR_M, FAR_M = 3.0, 23.0  # distances before the edge, between which the slope is measured
ROUNDED_M = 10.0
# Distance from a side of the DEM within which a log that left has crossed it: heights end half a cell before the side
NEAR_CELLS = 1.5
COMPASS = ("east", "north-east", "north", "north-west", "west", "south-west", "south", "south-east")


def look(simulation: Simulation, layers: SceneLayers, releases: Releases, seed: int, feedback: Feedback) -> None:
    """Warn if more than a few of a random sample of the logs leave the terrain model."""
    if len(releases) <= LOGS:
        return
    load_kernels(layers.shape, feedback)
    rows = np.sort(hash_order(releases.logs.log_id, seed)[:LOGS])
    laws = {**simulation.laws}
    laws["time_limit"] = min(LONGEST_S, laws.get("time_limit", LONGEST_S))
    result = slide(
        layers.scene,
        releases.logs.take(rows),
        FIDELITIES["draft"],
        **laws,
        threads=layers.threads,
        shape=layers.shape,
    )
    # on a window of a large terrain model the logs near its sides continue when the run has widened it
    seen = ~result.reach[:, result.reach.shape[1] - len(layers.watched) :].any(axis=1)
    left = seen & left_dem(result.stop_reason)
    if left.sum() <= WORTH_TELLING * seen.sum():
        return
    more = further(layers, result, np.flatnonzero(left), energy_slope(simulation.inputs.friction))
    sides = sides_of(result, left, layers.dem.frame)
    feedback.warn(warning(int(left.sum()), int(seen.sum()), sides, more, number_of(simulation.inputs.friction)))


def sides_of(result: Result, left: NDArray[np.bool_], dem: Grid) -> list[str]:
    """The sides of the DEM over which these logs left, or towards which they moved when they came onto nodata inside
    it.

    The most frequent first: those of a tenth of the logs or more. A log that turns in a valley may cross the northern
    side while it moves east.
    """
    x, y = result.end_position[left, :2].T
    west, south, east, north = dem.bounds
    near = NEAR_CELLS * dem.cell
    right = (x >= east - near).astype(float) - (x <= west + near)
    up = (y >= north - near).astype(float) - (y <= south + near)
    within = (right == 0.0) & (up == 0.0)
    vx = np.where(within, result.last_state[left, VX], right)
    vy = np.where(within, result.last_state[left, VY], up)
    octant = np.rint(np.arctan2(vy, vx) / (np.pi / 4.0)).astype(int) % len(COMPASS)
    count = np.bincount(octant, minlength=len(COMPASS))
    return [COMPASS[k] for k in np.argsort(-count, kind="stable") if count[k] >= max(1.0, 0.1 * left.sum())]


def further(layers: SceneLayers, result: Result, rows: NDArray[np.intp], falls: float) -> Array:
    """How far [m] in plan logs would continue if the ground were as steep as before the edge; infinite if too steep.

    falls : slope of the energy line, as for the first window of a large terrain model
    """
    v = result.last_state[rows][:, [VX, VY]]
    speed = np.maximum(np.hypot(*v.T), 1e-9)
    way = v / speed[:, None]
    end = result.end_position[rows, :2]
    heights = [layers.scene.terrain_height(*(end - each * way).T) for each in (NEAR_M, FAR_M)]
    steep = (heights[1] - heights[0]) / (FAR_M - NEAR_M)
    steep = np.where(np.isfinite(steep), steep, 0.0)
    head = speed**2 / (2.0 * GRAVITY)
    return np.where(steep < falls, head / np.maximum(falls - steep, 1e-9), np.inf)


def warning(n_left: int, n: int, sides: list[str], more: Array, friction: float | None) -> str:
    """The warning, with the distance that nine of ten of these logs need.

    friction : if it is a single number: tools that try several use the smallest
    """
    how = "draft" if friction is None else f"draft, friction {friction:g}"
    need = float(np.quantile(more, 0.9, method="higher"))
    where = " and ".join(sides)
    if np.isfinite(need):
        need_words = f"some {ROUNDED_M * np.ceil(need / ROUNDED_M):.0f} m more are needed there"
    else:
        need_words = (
            "how much more is needed cannot be estimated, because the ground at the edge is too steep for them to stop"
        )
    return (
        f"a pilot before the run: {n_left} of {n} logs ({how}) leave the terrain model to the {where}; {need_words}. "
        "Reach and spread will not include what they do beyond it: use a larger terrain model"
    )
