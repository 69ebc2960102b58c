"""The same logs with one friction coefficient after the other, and what of an event each of them did."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.friction_score import Outcome
from deadwood_algorithms.layers import id_column, read_vector, where_of
from deadwood_algorithms.releases_from_layer import Releases
from deadwood_algorithms.run_results import reached
from deadwood_algorithms.scene_from_layers import Items, SceneLayers, read_lines
from deadwood_algorithms.scene_window import wider_scene
from deadwood_algorithms.tool import Cancelled, Feedback, Quiet, UserError
from deadwood_engine import STOP_REASONS, Fidelity, Interrupted, Lines, Result, Scene, Segments, segments_of, slide

if TYPE_CHECKING:
    from deadwood_algorithms.calibrate_friction import Ask

Array = NDArray[np.float64]
AT_REST = [STOP_REASONS.index(name) for name in ("rest", "tree", "barrier", "lying_log")]


@dataclass(frozen=True)
class Slid:
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
        """Logs whose deposit is one: they neither left the DEM nor still moved."""
        return np.isin(self.stop_reason, AT_REST)


@dataclass(frozen=True)
class Watched:
    """Lines and areas whose reach is counted: of the event first, then the user's own; columns of `Slid.reach`."""

    items: Items
    reached: NDArray[np.int64]
    not_reached: NDArray[np.int64]
    own: NDArray[np.int64]


@dataclass(frozen=True)
class Slope:
    """The scene with the event's lines besides the user's own; of a large DEM on the window that logs reach."""

    layers: SceneLayers
    watched: Watched

    @staticmethod
    def of(layers: SceneLayers, reached_path: str | None, not_reached_path: str | None, feedback: Feedback) -> Slope:
        """Put the event's lines before those of the scene, whose last ones watch the sides of the window."""
        ids, shapes, rows, columns = [], [], [], []
        vertices, sizes = [np.zeros((0, 2))], [np.zeros(0, np.int64)]
        for path in (reached_path, not_reached_path):
            marks, items = read_lines(path, layers.dem, feedback)
            columns.append(np.arange(len(ids), len(ids) + len(items.ids)))
            rows.append(items.item + len(ids))
            ids += items.ids
            shapes += list(items.geometry)
            vertices.append(marks.vertices.reshape(-1, 2))
            sizes.append(np.diff(marks.starts))
        own = layers.lines
        columns.append(np.arange(len(ids), len(ids) + len(own.ids)))
        rows.append(own.item + len(ids))
        ids, shapes = [*ids, *own.ids], [*shapes, *own.geometry]
        for path in paths_of_segments(layers.scene.arrays.lines):
            vertices.append(path)
            sizes.append(np.array([len(path)]))
        geometry = np.empty(len(ids), object)
        geometry[:] = shapes
        items = Items(ids, geometry, np.concatenate(rows))
        starts = np.concatenate([[0], np.cumsum(np.concatenate(sizes))]).astype(np.int64)
        lines = Lines(np.concatenate(vertices), starts)
        scene, terrain = layers.scene, layers.scene.arrays.terrain
        arrays = scene.arrays._replace(lines=segments_of(lines, terrain.x0, terrain.y0))
        scene = replace(scene, arrays=arrays, line_count=starts.size - 1)
        return Slope(replace(layers, scene=scene, lines=items), Watched(items, *columns))


def paths_of_segments(segments: Segments) -> list[Array]:
    """The lines that were cut into these segments, in world coordinates [m]."""
    paths = []
    for line in range(segments.lines):
        ends = segments.ends[segments.owner == line]
        paths.append(np.add(np.vstack([ends[:1, :2], ends[:, 2:]]), (segments.x0, segments.y0)))
    return paths


def with_friction(scene: Scene, friction: float) -> Scene:
    """The scene with one coefficient everywhere; the rest of it is shared."""
    terrain = scene.arrays.terrain._replace(friction=np.array([[friction]], np.float64))
    return replace(scene, arrays=scene.arrays._replace(terrain=terrain))


def slide_with(
    friction: float, ask: Ask, fidelity: Fidelity, slope: Slope, logs: Releases, feedback: Feedback
) -> tuple[Slid, Slope]:
    """Slide the logs with one coefficient; also returns the slope that they needed, on a wider window or the same.

    ``ask`` holds one coefficient, with which the scene is read; it is exchanged before the logs are slid.
    """
    while True:
        result = _slide(friction, ask, fidelity, slope.layers, logs, feedback)
        sides = slope.layers.escaped(result)
        if not sides:
            break
        wider = wider_scene(ask, slope.layers, sides, feedback)
        slope = Slope.of(wider, ask.reached, ask.not_reached, Quiet())
    result = slope.layers.without_watch(result)
    end, start = result.end_position, result.release_position
    slid = Slid(
        friction=friction,
        x=end[:, 0],
        y=end[:, 1],
        runout=np.hypot(*(end - start)[:, :2].T),
        speed_max=result.speed_max,
        stop_reason=result.stop_reason,
        reach=reached(slope.layers.lines, {"reach": result.reach}, logs),
    )
    return slid, slope


def _slide(
    friction: float, ask: Ask, fidelity: Fidelity, layers: SceneLayers, logs: Releases, feedback: Feedback
) -> Result:
    what = f"sliding at friction {friction:g}"

    def report(done: int) -> bool:
        feedback.progress(done, len(logs), what)
        return feedback.cancelled()

    try:
        result = slide(
            with_friction(layers.scene, friction),
            logs.logs,
            fidelity,
            restitution=ask.restitution,
            time_limit=ask.time_limit,
            rest_speed=ask.rest_speed,
            threads=layers.threads,
            report=report,
            shape=layers.shape,
        )
    except (Interrupted, KeyboardInterrupt) as error:
        raise Cancelled from error
    feedback.progress(len(logs), len(logs), what)
    return result


@dataclass(frozen=True)
class Observed:
    """Observed deposits, one a row: the rows of the logs that each may have been, and its point or area."""

    geometry: NDArray[Any]
    logs: list[NDArray[np.int64]]
    names: list[str]

    @property
    def are_points(self) -> NDArray[np.bool_]:
        return shapely.get_dimensions(self.geometry) == 0


def read_observed(path: str, layers: SceneLayers, logs: Releases, feedback: Feedback) -> Observed:
    """Observed deposits as points or areas; a field release_id says which release each belongs to."""
    kinds = ("point", "polygon")
    frame = read_vector(path, geometry=kinds, target_crs=layers.dem.crs, what="observed deposits", feedback=feedback)
    geometry = np.asarray(frame.geometry)
    off = ~shapely.intersects(geometry, shapely.box(*layers.dem.bounds))
    if off.any():
        row = int(np.argmax(off))
        raise UserError(
            f"{where_of(frame)}, row {row + 1}: the observed deposit does not lie on the DEM; check its CRS"
        )
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


def outcomes_of_deposits(observed: Observed, slid: list[Slid], error: float) -> list[Outcome]:
    """Each observed deposit, and what the logs that it may have been did with every coefficient."""
    x, y = (np.stack([np.where(each.resting, getattr(each, name), np.nan) for each in slid]) for name in "xy")
    sides = [np.nanmax(at) - np.nanmin(at) + 4.0 * error if np.isfinite(at).any() else math.inf for at in (x, y)]
    area = float(sides[0] * sides[1])  # two errors beyond the outermost deposits
    out = []
    for shape, rows, is_point in zip(observed.geometry, observed.logs, observed.are_points, strict=True):
        if is_point:
            out.append(Outcome(rows, (shape.x, shape.y), x[:, rows], y[:, rows], area=area))
        else:
            inside = shapely.contains_xy(shape, x[:, rows], y[:, rows])
            out.append(Outcome(rows, done=inside & np.isfinite(x[:, rows])))
    return out


def outcomes_of_reach(watched: Watched, slid: list[Slid], logs: int, did: int) -> list[Outcome]:
    """So many logs of the event, of which so many reached one thing and not the other."""
    done = np.stack([did_it(watched, each) for each in slid])
    rows = np.arange(done.shape[1])
    return [Outcome(rows, done=done, yes=k < did) for k in range(logs)]


def did_it(watched: Watched, slid: Slid) -> NDArray[np.bool_]:
    """Which logs reached what the event reached, and not what it did not."""
    done = np.logical_not(slid.reach[:, watched.not_reached].any(axis=1))
    return done & slid.reach[:, watched.reached].any(axis=1) if watched.reached.size else done


def layers_of(slid: list[Slid], logs: Releases, observed: Observed | None, crs: Any) -> dict[str, Any]:
    """The simulated deposits of every coefficient, and the observed ones."""
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
    layers = {"deposits": geopandas.GeoDataFrame(columns, geometry=places, crs=crs)}
    if observed:
        layers["observed"] = geopandas.GeoDataFrame({"name": observed.names}, geometry=observed.geometry, crs=crs)
    return layers
