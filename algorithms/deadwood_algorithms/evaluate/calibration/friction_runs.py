"""The same logs with each friction coefficient in turn, and how they compare with an observed event."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.ensemble.variants import Arrays, Variant, joined
from deadwood_algorithms.evaluate.calibration.score import Observation
from deadwood_algorithms.files.accounts import account, count_of
from deadwood_algorithms.files.columns import id_column, where_of
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.scene.items import Items, digest_of
from deadwood_algorithms.scene.layers import SceneLayers, read_lines
from deadwood_algorithms.scene.releases import Releases
from deadwood_algorithms.simulate.simulation import Simulation
from deadwood_algorithms.stats.endings import at_rest, left_dem
from deadwood_engine import STOP_REASONS, Lines

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FrictionRun:
    """The logs with one coefficient; arrays by log. reach : (n, watched lines)"""

    friction: float
    x: Array
    y: Array
    runout: Array
    speed_max: Array
    stop_reason: NDArray[np.int8]
    reach: NDArray[np.bool_]

    @property
    def resting(self) -> NDArray[np.bool_]:
        """Logs with a valid deposit: they neither left the DEM nor were still moving."""
        return at_rest(self.stop_reason)


@dataclass(frozen=True)
class Watched:
    """Lines and areas whose reach is counted: those of the event first, then the user's; columns of `reach`.

    polylines : the lines of the event, for the engine; event : their names
    """

    polylines: Lines
    event: Items
    items: Items
    reached: NDArray[np.int64]
    not_reached: NDArray[np.int64]
    own: NDArray[np.int64]

    @property
    def digest(self) -> str:
        """Digest of the event's lines."""
        return digest_of(self.polylines, self.event.item)

    @staticmethod
    def of(reached: str | None, not_reached: str | None, layers: SceneLayers, feedback: Feedback) -> Watched:
        """Read the lines and areas that the event reached or did not reach, from paths of layers or None."""
        polylines, event = Lines.none(), Items([], np.array([], object), np.array([], np.int64))
        columns = []
        for parameter, path in (("reached", reached), ("not_reached", not_reached)):
            more, things = read_lines(path, layers.dem, feedback, parameter=parameter)
            columns.append(len(event.ids) + np.arange(len(things.ids)))
            polylines, event = polylines.then(more), event.then(things)
        columns.append(len(event.ids) + np.arange(len(layers.lines.ids)))
        return Watched(polylines, event, event.then(layers.lines), *columns)


WANTED = ("reach", "x", "y", "runout", "speed_max", "stop_reason")


def variants_of(sweep: Sequence[float], simulation: Simulation, watched: Watched) -> list[Variant]:
    """One variant for each coefficient, with the event's lines added to those whose reach is counted."""

    def with_friction(friction: float) -> Callable[[SceneLayers], SceneLayers]:
        def changed(on: SceneLayers) -> SceneLayers:
            on = on.with_lines_first(watched.polylines, watched.event)
            return replace(on, scene=on.scene.with_friction(friction))

        return changed

    return [Variant(f"sliding at friction {each:g}", simulation, with_friction(each)) for each in sweep]


def run_of(friction: float, parts: Sequence[Arrays]) -> FrictionRun:
    """Outcomes of the logs with one coefficient."""
    return FrictionRun(friction=friction, **{name: joined(parts, name) for name in WANTED})


@dataclass(frozen=True)
class Observed:
    """Observed deposits: for each, the rows of the logs that it may have been, and its point or area."""

    geometry: NDArray[Any]
    logs: list[NDArray[np.int64]]
    names: list[str]

    @property
    def are_points(self) -> NDArray[np.bool_]:
        return shapely.get_dimensions(self.geometry) == 0


def read_observed(path: str, layers: SceneLayers, logs: Releases, feedback: Feedback) -> Observed:
    """Read observed deposits, points or areas; a field release_id gives the release of each."""
    kinds = ("point", "polygon")
    frame = read_vector(path, geometry=kinds, target_crs=layers.dem.crs, what="observed deposits", feedback=feedback)
    geometry = np.asarray(frame.geometry)
    off = ~shapely.intersects(geometry, shapely.box(*layers.dem.bounds))
    if off.any():
        row = int(np.argmax(off))
        raise UserError(
            f"{where_of(frame)}, row {row + 1}: the observed deposit does not lie on the DEM; check its CRS"
        )
    account("observed", count_of(len(frame), geometry.size, {}))
    everything = np.arange(len(logs))
    if "release_id" not in frame:
        return Observed(geometry, [everything] * len(frame), [str(row + 1) for row in range(len(frame))])
    named = id_column(frame, "release_id")
    have = logs.release_id.astype(str)
    rows = []
    for row, name in enumerate(named):
        mine = np.flatnonzero(have == str(name))
        if not mine.size:
            known = ", ".join(sorted(set(have.tolist()))[:10])
            raise UserError(
                f"{where_of(frame)}, field 'release_id', row {row + 1}: no released log has '{name}'; they have {known}"
            )
        rows.append(mine)
    return Observed(geometry, rows, [f"{row + 1} (release {name})" for row, name in enumerate(named)])


def outcomes_of_deposits(
    observed: Observed, slid: list[FrictionRun], error: float, *, search_complete: bool
) -> list[Observation]:
    """Each observed deposit, with the outcomes, at every coefficient, of the logs that it may have been.

    search_complete : all logs of the event were found; otherwise some of those at rest on the terrain model
    """
    rests = np.stack([each.resting for each in slid])
    x, y = (np.where(rests, np.stack([getattr(each, name) for each in slid]), np.nan) for name in "xy")
    sides = [np.nanmax(at) - np.nanmin(at) + 4.0 * error if np.isfinite(at).any() else math.inf for at in (x, y)]
    area = float(sides[0] * sides[1])  # up to two standard errors beyond the outermost deposits
    out = []
    for shape, rows, is_point in zip(observed.geometry, observed.logs, observed.are_points, strict=True):
        found = None if search_complete else rests[:, rows]
        if is_point:
            out.append(Observation(rows, (shape.x, shape.y), x[:, rows], y[:, rows], area=area, found=found))
        else:
            inside = shapely.contains_xy(shape, x[:, rows], y[:, rows])
            out.append(Observation(rows, done=inside & rests[:, rows], found=found))
    return out


def outcomes_of_reach(watched: Watched, slid: list[FrictionRun], logs: int, did: int) -> list[Observation]:
    """The number of logs of the event, and how many of them reached one object and not the other."""
    done = np.stack([did_it(watched, each) for each in slid])
    rows = np.arange(done.shape[1])
    return [Observation(rows, done=done, yes=k < did) for k in range(logs)]


def did_it(watched: Watched, slid: FrictionRun) -> NDArray[np.bool_]:
    """Logs that reached what the event reached, and not what it did not, up to where they left the terrain model."""
    done = np.logical_not(slid.reach[:, watched.not_reached].any(axis=1))
    return done & slid.reach[:, watched.reached].any(axis=1) if watched.reached.size else done


def lost_for(watched: Watched, slid: FrictionRun) -> NDArray[np.bool_]:
    """Which logs left the terrain model before it was known whether they would do what the event did."""
    left = left_dem(slid.stop_reason)
    beyond = slid.reach[:, watched.not_reached].any(axis=1)  # contradicts the event whatever happened later
    arrived = slid.reach[:, watched.reached].any(axis=1)
    settled = beyond | (arrived & (watched.not_reached.size == 0))
    return left & ~settled


def layers_of(slid: list[FrictionRun], logs: Releases, observed: Observed | None, crs: Any) -> dict[str, Any]:
    """The simulated deposits of every coefficient, and the observed ones; logs without a deposit apart."""
    import geopandas

    columns = {
        "friction": np.repeat([each.friction for each in slid], len(logs)),
        "log_id": np.tile(logs.logs.log_id, len(slid)),
        "release_id": np.tile(logs.release_id, len(slid)),
        "stop_reason": np.array(STOP_REASONS, object)[np.concatenate([each.stop_reason for each in slid])],
        "runout_m": np.concatenate([each.runout for each in slid]),
        "speed_max_ms": np.concatenate([each.speed_max for each in slid]),
    }
    places = shapely.points(*(np.concatenate([getattr(each, name) for each in slid]) for name in "xy"))
    everything = geopandas.GeoDataFrame(columns, geometry=places, crs=crs)
    rests = np.concatenate([each.resting for each in slid])
    layers = {"deposits": everything[rests].reset_index(drop=True)}
    if not rests.all():
        layers["no_deposit"] = everything[~rests].reset_index(drop=True)
    if observed:
        layers["observed"] = geopandas.GeoDataFrame({"name": observed.names}, geometry=observed.geometry, crs=crs)
    return layers
