"""Where a barrier could stand: lines that are given, or pieces of contours above the lines that are to be protected."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import contourpy
import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.ops import substring

from deadwood_algorithms.files.columns import schema_column, where_of
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.scene.items import Items, ids_of, paths_of, shared_words
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.schemas import BARRIERS
from deadwood_engine import Barriers

Array = NDArray[np.float64]
CELLS_LOOKED_AT = 250_000  # of the terrain, at which heights above the lines are taken for contours
ROAD_STEP = 5.0  # [m] between places of a line whose height counts
PARTS_A_LENGTH = 4  # a barrier's place is sought in steps of this part of the shortest one
PARTS_MOST = 600
SMOOTHED = 1.0  # [m] by which a barrier may run beside its contour, that is as rough as the terrain model


@dataclass(frozen=True)
class Candidate:
    """A barrier that could be built: its line, height and length in plan [m].

    above : [m] its contour's height above the nearest place of a line; NaN where it was given
    """

    id: str
    shape: Any
    height: float
    above: float

    @property
    def length(self) -> float:
        return float(self.shape.length)


def read_given(path: str, heights: Sequence[float], layers: SceneLayers, feedback: Feedback) -> list[Candidate]:
    """Lines of a layer, each with its own height_m, or where it has none with each of ``heights`` [m]."""
    frame = read_vector(path, geometry=("line",), target_crs=layers.dem.crs, what="candidates", feedback=feedback)
    paths_of(frame, layers.dem, "candidate")  # refuses what is off the DEM or has no length
    ids = [str(each) for each in ids_of(frame, "barrier_id", "name").tolist()]
    field = next((name for name in ("barrier_id", "name") if name in frame), "")
    if twins := shared_words(frame, field, ids):
        raise UserError(f"{twins}; give each candidate an id of its own")
    shapes = list(shapely.force_2d(np.asarray(frame.geometry)))
    if "height_m" in frame:
        own = schema_column(frame, BARRIERS.column("height_m"))
        found = [Candidate(*each, np.nan) for each in zip(ids, shapes, own.tolist(), strict=True)]
    elif len(heights) == 1:
        found = [Candidate(*each, heights[0], np.nan) for each in zip(ids, shapes, strict=True)]
    else:
        found = [
            Candidate(f"{name} {height:g} m", shape, height, np.nan)
            for name, shape in zip(ids, shapes, strict=True)
            for height in heights
        ]
    taken = {str(each) for each in layers.barriers.ids} & {each.id for each in found}
    if taken:
        raise UserError(
            f"{where_of(frame)}: a barrier of the run is called '{min(taken)}' already; rename the candidate"
        )
    return found


def contours_above(layers: SceneLayers, above: float) -> list[Any]:
    """Lines on the terrain that lie so high [m] above the nearest place of the nearest line."""
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
    return [each.simplify(SMOOTHED) for each in lines if each.length > 0.0]


@dataclass(frozen=True)
class ContourPart:
    """A short part of a contour: which contour, how far along it begins and ends [m]."""

    contour: int
    begin: float
    end: float


def contour_parts(contours: Sequence[Any], shortest: float) -> list[ContourPart]:
    """Contours cut into parts of one length, in their order; what is left at an end is no part."""
    total = sum(each.length for each in contours)
    size = max(shortest / PARTS_A_LENGTH, total / PARTS_MOST)
    return [
        ContourPart(number, k * size, (k + 1) * size)
        for number, each in enumerate(contours)
        for k in range(int(each.length / size + 1e-9))
    ]


def pieces_where_most_pass(
    contours: Sequence[Any], parts: Sequence[ContourPart], passed: NDArray[np.bool_], length: float, number: int
) -> list[tuple[Any, int]]:
    """Pieces of one length [m], and how many logs pass each: the most first, none over half of another.

    passed : (n, parts), which log passes which part and reaches a line afterwards
    """
    rows = np.array([each.contour for each in parts], np.int64)
    found: list[tuple[int, int, float]] = []  # logs, contour, begin
    for contour in np.unique(rows).tolist():
        mine = np.flatnonzero(rows == contour)
        size = parts[mine[0]].end - parts[mine[0]].begin
        wide = int(np.ceil(length / size - 1e-9))
        if wide > mine.size:
            continue
        sums = np.pad(np.cumsum(passed[:, mine], axis=1, dtype=np.int64), ((0, 0), (1, 0)))
        logs = ((sums[:, wide:] - sums[:, :-wide]) > 0).sum(axis=0)
        inset = 0.5 * (wide * size - length)
        found += [(int(n), contour, k * size + inset) for k, n in enumerate(logs.tolist()) if n]
    found.sort(key=lambda each: (-each[0], each[1], each[2]))
    kept: list[tuple[int, int, float]] = []
    for each in found:
        if len(kept) == number:
            break
        if all(each[1] != other[1] or abs(each[2] - other[2]) >= 0.5 * length for other in kept):
            kept.append(each)
    return [(substring(contours[contour], begin, begin + length), n) for n, contour, begin in kept]


def contour_candidates(
    layers: SceneLayers,
    above: Sequence[float],
    lengths: Sequence[float],
    heights: Sequence[float],
    number: int,
    passed: Callable[[Sequence[Any]], NDArray[np.bool_]],
) -> list[Candidate]:
    """For each contour, length and height the ``number`` places that most logs pass on their way to a line.

    passed : tells which log passes which of many lines and reaches a line to be protected afterwards
    """
    found = []
    taken = {str(each) for each in layers.barriers.ids}
    for level in above:
        contours = [each for each in contours_above(layers, level) if each.length >= min(lengths)]
        parts = contour_parts(contours, min(lengths))
        if not parts:
            continue
        logs = passed([substring(contours[each.contour], each.begin, each.end) for each in parts])
        for length in lengths:
            for k, (shape, _) in enumerate(pieces_where_most_pass(contours, parts, logs, length, number), 1):
                for height in heights:
                    name = f"{level:g} m above, {length:g} m long, {height:g} m high, {k}"
                    while name in taken:
                        name += " new"
                    found.append(Candidate(name, shape, height, level))
    return found


def with_barriers(layers: SceneLayers, candidates: Sequence[Candidate]) -> SceneLayers:
    """The scene with all candidates as barriers behind its own."""
    own = layers.plates
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
    return replace(layers, plates=plates, barriers=items).prepared_again()
