"""Candidate places of barriers: given lines, or straight pieces along contours above the roads, railways or houses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import contourpy
import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.files.accounts import NO_TERRAIN, OFF_DEM, account, count_of
from deadwood_algorithms.files.columns import schema_column, where_of
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.counts import first_of
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.scene.items import Items, ids_of, paths_of, shared_words
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.schemas import BARRIERS
from deadwood_engine import Barriers

Array = NDArray[np.float64]
Terrain = Callable[[Array, Array], Array]  # heights [m] of places x, y [m], NaN off the terrain
CELLS_LOOKED_AT = 250_000  # cells of the terrain at which heights above the lines are computed for contours
ROAD_STEP = 5.0  # [m] between the places of a line at which its height is taken
STEPS_A_LENGTH = 4  # places along a contour are tried in steps of the shortest length divided by this
PIECES_MOST = 600  # at most so many straight pieces along a contour, of all lengths, are considered
STATIONS = 8  # places along a barrier's line at which the direction of the contours is computed
MOST_ANGLE_DEG = 30.0  # off the contours: logs that meet a barrier at an angle slide along it and past its end


@dataclass(frozen=True)
class Candidate:
    """A barrier that could be built: its line, height and length in plan [m].

    above : [m] its contour's height above the nearest place of a line; NaN where it was given
    place : number of its place on that contour, from the one that most logs pass; 0 where it was given
    """

    id: str
    shape: Any
    height: float
    above: float
    place: int = 0

    @property
    def length(self) -> float:
        return float(self.shape.length)


def read_given(path: str, heights: Sequence[float], layers: SceneLayers, feedback: Feedback) -> list[Candidate]:
    """Lines of a layer, each with its own height_m, or where it has none with each of ``heights`` [m]."""
    frame = read_vector(path, geometry=("line",), target_crs=layers.dem.crs, what="candidates", feedback=feedback)
    on = np.unique(paths_of(frame, layers.dem, "candidate", feedback).item)  # rows on the DEM
    ids = np.array([str(each) for each in ids_of(frame, "barrier_id", "name").tolist()], object)
    field = next((name for name in ("barrier_id", "name") if name in frame), "")
    if twins := shared_words(frame, field, ids.tolist()):
        raise UserError(f"{twins}; give each candidate its own id")
    named = list(zip(ids[on].tolist(), shapely.force_2d(np.asarray(frame.geometry)[on]), strict=True))
    if "height_m" in frame:
        own = schema_column(frame, BARRIERS.column("height_m"))[on].tolist()
        found = [Candidate(*each, height, np.nan) for each, height in zip(named, own, strict=True)]
    elif len(heights) == 1:
        found = [Candidate(*each, heights[0], np.nan) for each in named]
    else:
        found = [
            Candidate(f"{name} {height:g} m", shape, height, np.nan) for name, shape in named for height in heights
        ]
    angles = [contour_angle(shape, layers.scene.terrain_height) for _, shape in named]
    bare = [name for (name, _), angle in zip(named, angles, strict=True) if not np.isfinite(angle)]
    if bare:
        feedback.warn(
            f"{where_of(frame)}: the DEM has no height under {first_of(bare, len(bare))}: no log reaches it",
            code="off-dem",
            lines=len(bare),
        )
    why = {OFF_DEM: len(frame) - on.size, NO_TERRAIN: len(bare)}
    account("candidates", count_of(len(frame), np.isfinite(angles).sum(), why))
    taken = {str(each) for each in layers.barriers.ids} & {each.id for each in found}
    if taken:
        raise UserError(
            f"{where_of(frame)}: a barrier of the run is called '{min(taken)}' already; rename the candidate"
        )
    return found


def contours_above(layers: SceneLayers, above: float) -> list[Any]:
    """Lines on the terrain at these heights [m] above the nearest place of the nearest line."""
    dem = layers.dem
    step = max(1, int(np.ceil(np.sqrt(dem.values.size / CELLS_LOOKED_AT))))
    heights = np.asarray(dem.values[::step, ::step], np.float64)
    x = dem.x0 + dem.cell * step * np.arange(heights.shape[1])
    y = dem.y0 + dem.cell * step * np.arange(heights.shape[0])
    roads = shapely.segmentize(shapely.union_all(layers.lines.geometry), ROAD_STEP)
    places = shapely.get_coordinates(roads)
    level = layers.scene.terrain_height(places[:, 0], places[:, 1])
    places, level = places[np.isfinite(level)], level[np.isfinite(level)]
    if not level.size or min(heights.shape) < 2:
        return []
    nodes: Any = shapely.points(np.column_stack([each.ravel() for each in np.meshgrid(x, y)]))
    grounds: Any = shapely.points(places)
    nearest = shapely.STRtree(grounds).nearest(nodes)
    over = np.ma.masked_invalid(heights - level[nearest].reshape(heights.shape))
    found: Any = contourpy.contour_generator(x, y, over).lines(above)
    lines = [shapely.LineString(each) for each in found if len(each) > 1]
    return [each for each in lines if each.length > 0.0]


def straight_piece(along: Array, way: Array, begin: float, length: float) -> Any:
    """The straight piece from a place on a contour to the next place ``length`` [m] away in plan; None if the contour
    ends.

    along, way : vertices of the contour, shape (n, 2), and how far along it [m] they lie, shape (n,)
    """
    start = np.array([np.interp(begin, way, axis) for axis in along.T])
    rest = along[np.searchsorted(way, begin, side="right") :]
    beyond = np.flatnonzero(np.hypot(*(rest - start).T) >= length)
    if not beyond.size:
        return None
    last = int(beyond[0])
    a = rest[last - 1] if last else start
    towards, offset = rest[last] - a, a - start  # |offset + t towards| = length, has one solution for t from 0 to 1
    square, mixed = towards @ towards, offset @ towards
    t = (np.sqrt(mixed**2 + square * (length**2 - offset @ offset)) - mixed) / square
    return shapely.LineString([start, a + t * towards])


def straight_pieces(contours: Sequence[Any], length: float, step: float, terrain: Terrain) -> list[Any]:
    """Straight lines of one length [m] with both ends on a contour, starting one step [m] along it from each other.

    None deviates by more than ``MOST_ANGLE_DEG`` from the contours of the ground under it.
    """
    found = []
    for each in contours:
        along = shapely.get_coordinates(each)
        way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(along, axis=0).T))])
        for begin in np.arange(0.0, way[-1], step):
            piece = straight_piece(along, way, float(begin), length)
            if piece is None:
                break
            if contour_angle(piece, terrain) <= MOST_ANGLE_DEG:
                found.append(piece)
    return found


def contour_angle(shape: Any, terrain: Terrain) -> float:
    """Angle [degrees] between a barrier's line and the contours of the ground under it; NaN off the terrain.

    From the ground's rise along and across the line, both without their signs, so that one over a spur or a gully is
    not called level because its ends are; each over an eighth of the line's length, so that bumps do not count.
    """
    arm = shape.length / STATIONS
    rises = []
    for line in shapely.get_parts(shape):
        count = max(1, round(line.length / arm))
        at = (np.arange(count) + 0.5) / count * line.length
        ends = [shapely.get_coordinates(shapely.line_interpolate_point(line, at + k * arm / 2)) for k in (-1, 1)]
        middle, way = (ends[0] + ends[1]) / 2, ends[1] - ends[0]
        long = np.hypot(*way.T)
        middle, way = middle[long > 0.0], way[long > 0.0] / long[long > 0.0, None]
        for sides in (way, np.column_stack([-way[:, 1], way[:, 0]])):
            a, b = (terrain(*(middle + k * arm / 2 * sides).T) for k in (-1, 1))
            rises.append(np.abs(b - a))
    along, across = (np.concatenate(rises[k::2]) for k in (0, 1))
    known = np.isfinite(along + across)
    if not known.any():
        return np.nan
    return float(np.degrees(np.arctan2(along[known].sum(), across[known].sum())))


def places_where_most_pass(
    pieces: Sequence[Any], passed: NDArray[np.bool_], length: float, number: int
) -> list[tuple[Any, int]]:
    """Of the pieces of one length [m], those that most logs pass, with that number, in descending order; midpoints are
    at least half the length apart.

    passed : (n, pieces), which log passes which piece and reaches a line afterwards
    """
    logs = passed.sum(axis=0)
    kept: list[tuple[Any, int]] = []
    for k in np.argsort(-logs, kind="stable").tolist():
        if len(kept) == number or not logs[k]:
            break
        middle = pieces[k].centroid
        if all(middle.distance(other.centroid) >= 0.5 * length for other, _ in kept):
            kept.append((pieces[k], int(logs[k])))
    return kept


def contour_candidates(
    layers: SceneLayers,
    above: Sequence[float],
    lengths: Sequence[float],
    heights: Sequence[float],
    number: int,
    passed: Callable[[Sequence[Any]], NDArray[np.bool_]],
) -> list[Candidate]:
    """For each contour, length and height, the ``number`` places that most logs pass on their way to a line.

    passed : returns which log passes which of many lines and then reaches a line to be protected
    """
    found = []
    taken = {str(each) for each in layers.barriers.ids}
    for level in above:
        contours = [each for each in contours_above(layers, level) if each.length >= min(lengths)]
        total = sum(each.length for each in contours) * len(lengths)
        step = max(min(lengths) / STEPS_A_LENGTH, total / PIECES_MOST)
        pieces = [straight_pieces(contours, length, step, layers.scene.terrain_height) for length in lengths]
        ends = np.cumsum([len(each) for each in pieces])
        if not ends[-1]:
            continue
        logs = np.split(passed(list(chain(*pieces))), ends[:-1], axis=1)
        for length, mine, passing in zip(lengths, pieces, logs, strict=True):
            for k, (shape, _) in enumerate(places_where_most_pass(mine, passing, length, number), 1):
                for height in heights:
                    name = f"{level:g} m above, {length:g} m long, {height:g} m high, place {k}"
                    while name in taken:
                        name += " new"
                    found.append(Candidate(name, shape, height, level, k))
    return found


def with_barriers(layers: SceneLayers, candidates: Sequence[Candidate]) -> SceneLayers:
    """The scene with all candidates as barriers appended to its own."""
    own = layers.engine_barriers
    parts, item = shapely.get_parts([each.shape for each in candidates], return_index=True)
    vertices, string = shapely.get_coordinates(parts, return_index=True)
    ends = np.cumsum(np.bincount(string, minlength=len(parts)))
    heights = np.array([each.height for each in candidates])
    plates = Barriers(
        np.concatenate([np.reshape(own.vertices, (-1, 2)), vertices]),
        np.concatenate([own.starts, own.starts[-1] + ends]).astype(np.int64),
        np.concatenate([own.height, heights[item]]),
    )
    shapes = np.empty(len(candidates), object)
    shapes[:] = [each.shape for each in candidates]
    items = layers.barriers.then(Items([each.id for each in candidates], shapes, item.astype(np.int64)))
    return replace(layers, engine_barriers=plates, barriers=items).prepared_again()
