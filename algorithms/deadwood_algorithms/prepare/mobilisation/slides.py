"""The logs of all cells, slid with each friction of a range: which start, which go far, and which reach a line.

For `assess_mobilisation`. Each block of a large DEM is a scene of its own, on a window that grows with its logs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import geopandas
import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.ensemble.variants import Arrays, Ensemble, Variant, joined
from deadwood_algorithms.files.dem_blocks import WHOLE_CELLS
from deadwood_algorithms.params.tool import Feedback, ProgressOnly, Quiet, UserError
from deadwood_algorithms.prepare.mobilisation.cells import Cells, Places, Shares
from deadwood_algorithms.scene.friction import ends_of, number_of
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.reach import first_part
from deadwood_algorithms.scene.releases import Releases, releases_of
from deadwood_algorithms.scene.shape import as_shape
from deadwood_algorithms.schemas import ORIENTATIONS
from deadwood_algorithms.simulate.simulation import Simulation
from deadwood_algorithms.simulate.sliding import workers_for
from deadwood_algorithms.simulate.steps import Steps
from deadwood_algorithms.simulate.windows import GRAVITY, energy_slope, scene_on
from deadwood_algorithms.stats.endings import left_dem
from deadwood_algorithms.stats.statistics import reach_record
from deadwood_engine import Logs

Array = NDArray[np.float64]
STARTS, FAR, REACH = "starts", "goes_far", "reaches"
FACTORS = (0.8, 1.0, 1.2)  # of the friction, without a range
WANTED = ("runout", "reach", "stop_reason")
Posed = Callable[[Logs], Logs]


@dataclass(frozen=True)
class Frictions:
    """The frictions to slide with, ascending: coefficients, or factors of a layer."""

    values: tuple[float, ...]
    of_layer: bool

    @staticmethod
    def of(friction: str | float, span: str | None) -> Frictions:
        """``span``: A-B, or None for 0.8 to 1.2 times the friction."""
        middle = number_of(friction)
        if span is None:
            values = FACTORS if middle is None else tuple(round(middle * each, 6) for each in FACTORS)
            return Frictions(tuple(sorted(set(values))), middle is None)
        if middle is None:
            raise UserError(f"--friction-range is of a number, but --friction is {friction}; a layer varies by 0.8-1.2")
        low, high = ends_of(span) or (np.nan, np.nan)
        if not low <= middle <= high:
            raise UserError(
                f"--friction-range is '{span}', but must be two numbers such as 0.2-0.3, with --friction {middle:g} "
                "between them"
            )
        return Frictions(tuple(sorted({low, middle, high})), of_layer=False)

    def name(self, value: float) -> str:
        return f"{value:g} times the layer's" if self.of_layer else f"{value:g}"

    def words(self) -> str:
        return ", ".join(map(self.name, self.values))

    def variants(self, simulation: Simulation, of_parts: str) -> list[Variant]:
        """The same logs with each of them; ``of_parts`` is added to what progress shows."""

        def at(value: float) -> Callable[[SceneLayers], SceneLayers]:
            return lambda layers: layers.varied(friction=layers.friction * value if self.of_layer else value)

        return [
            Variant(f"sliding at friction {self.name(each)}{of_parts}", simulation, at(each)) for each in self.values
        ]


def block_scene(
    simulation: Simulation, places: Places, posed: Posed, feedback: Feedback
) -> tuple[SceneLayers, Releases]:
    """The scene of a block of logs, on the part of the DEM that they are expected to reach, and the logs."""
    inputs, dem = simulation.inputs, simulation.dem
    log_id, x, y = places
    part = None
    if dem.shape[0] * dem.shape[1] > WHOLE_CELLS:
        length, speed, drop = (inputs.defaults[name] for name in ("length_m", "speed_ms", "drop_m"))
        lift, slope = length + drop + speed**2 / (2.0 * GRAVITY), energy_slope(inputs.friction)
        part = first_part(dem, x, y, lift_m=lift, slope=slope, margin_m=2.0 * length)
    layers = scene_on(simulation, part, feedback)
    frame = geopandas.GeoDataFrame({"log_id": log_id + 1}, geometry=shapely.points(x, y), crs=layers.dem.plan_crs)
    word = inputs.defaults["orientation"]  # one of sample-releases, which ``posed`` makes of what the engine knows
    defaults = {**inputs.defaults, "orientation": word if word in ORIENTATIONS else "lying"}
    logs = releases_of(frame, layers.dem, defaults, feedback=Quiet())
    released = Releases(posed(logs.logs), logs.release_id, logs.x, logs.y, logs.dbh_cm, logs.digest)
    return layers, as_shape(released, layers.shape) if layers.shape else released


@dataclass(frozen=True)
class Distances:
    """start_m : that a log moves which starts; far_m : beyond which it went far, None for its length"""

    start_m: float
    far_m: float | None

    def did(
        self, logs: Logs, slid: list[list[Arrays]]
    ) -> tuple[dict[str, NDArray[np.bool_]], NDArray[np.bool_], NDArray[np.bool_]]:
        """For each outcome, shape (frictions, n), whether a log did it; the same of each line, shape (frictions, n,
        lines); and which left the terrain model.

        The centre of a log that only falls over moves by up to half of its length: it has not started. A log that
        left the terrain model is taken to have gone on.
        """
        upright = logs.orientation != ORIENTATIONS.index("lying")
        tilt = np.where(logs.orientation == ORIENTATIONS.index("tilted"), logs.tilt, 0.0)
        falls = np.where(upright, 0.5 * logs.length * np.abs(np.cos(tilt)), 0.0)
        far = logs.length if self.far_m is None else np.full(logs.length.shape, self.far_m)
        runout, reach, reason = (np.stack([joined(parts, name) for parts in slid]) for name in WANTED)
        left = left_dem(reason)
        starts = (runout > falls + self.start_m) | left
        return {STARTS: starts, FAR: (runout > far) | left, REACH: np.asarray(reach.any(axis=2))}, reach, left


@dataclass(frozen=True)
class Slid:
    """What all logs did.

    totals : in how many slides it did, by friction; by_line : the same of reaching each line; lost : slides that left
    the DEM
    remove : removes what is stored for resuming, once the results are written
    """

    shares: Shares
    totals: dict[str, NDArray[np.int64]]
    by_line: dict[Any, NDArray[np.int64]]
    lost: int
    remove: Callable[[], None]

    def records(self, frictions: Frictions, posture: str) -> list[dict[str, Any]]:
        """The share of all logs for each outcome and friction, of reaching a line for each line too."""
        logs = int(self.shares.logs.sum())
        counts: list[tuple[str, Any, NDArray[np.int64]]] = [(name, None, by) for name, by in self.totals.items()]
        counts += [(REACH, line, by) for line, by in self.by_line.items()]
        return [
            {"outcome": name, "line_id": line, "friction": mu, "posture": posture, **reach_record(int(times[k]), logs)}
            for name, line, times in counts
            for k, mu in enumerate(frictions.values)
        ]


def slide_all(
    simulation: Simulation,
    cells: Cells,
    places: list[Places],
    frictions: Frictions,
    distances: Distances,
    posed: Posed,
    steps_of: Callable[[SceneLayers, Releases], Steps],
    feedback: Feedback,
) -> Slid:
    """Slide the logs of all blocks in turn; ``steps_of``: from the first block that has logs."""
    number, times = cells.shape[0] * cells.shape[1], len(frictions.values)
    names = (STARTS, FAR, REACH) if simulation.lines is not None else (STARTS, FAR)
    shares = Shares(times, np.zeros(number, np.int64), {each: np.zeros(number, np.int64) for each in names})
    totals, by_line, lost = {each: np.zeros(times, np.int64) for each in names}, {}, 0
    steps, some = None, [each for each in places if each[0].size]
    with workers_for(simulation.where, feedback):
        for k, (log_id, x, y) in enumerate(some):
            said = ProgressOnly(feedback) if steps else feedback
            layers, released = block_scene(simulation, (log_id, x, y), posed, said)
            steps = steps or steps_of(layers, released)
            of_parts = f", part {k + 1} of {len(some)}" if len(some) > 1 else ""
            ensemble = Ensemble(simulation, layers, released, released, said)
            slid = ensemble.slide(frictions.variants(simulation, of_parts), WANTED, steps)
            did, reach, left = distances.did(released.logs, slid)
            shares.add(cells.of_places(x, y), {each: did[each] for each in names})
            for name in names:
                totals[name] += did[name].sum(axis=1)
            for line, times_reached in zip(layers.lines.ids, reach.sum(axis=1).T, strict=True):
                by_line[line] = by_line.get(line, 0) + times_reached
            lost += int(left.sum())
    assert steps is not None
    return Slid(shares, totals, by_line, lost, steps.remove)
