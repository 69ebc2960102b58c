"""Embankments and ditches as surfaces over a grid: the new heights of the ground, and the volumes of fill and cut.

For `add_structures`. A structure is a crest line with a flat crest around it and sides that fall off evenly from it:
a trapezoid, whatever the ground. The sides go round both ends, so that an end is half a truncated cone. Where a
line turns, the parts on both sides of the turn are united and the outside is rounded likewise. A ditch is an embankment
upside down; in this module, all heights of a ditch have the opposite sign.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.files.grid import Grid

Array = NDArray[np.float64]
FIRST_REACH_M = 12.0  # initial reach of a side; doubled until the side has met the ground everywhere
LEAST_HEIGHT_M = 1e-6
NEAR_LIMIT_CELLS = 1.5  # a side still above the ground this close to the end of its reach has not met the ground


@dataclass(frozen=True)
class Stretch:
    """One straight segment of a crest line: from ``a``, ``length`` [m] along the unit vector ``along``."""

    a: Array
    along: Array
    length: float
    station: Array  # [m] from a, ascending
    crest: Array  # [m] at the stations, for a ditch with the opposite sign
    above: Array  # [m] of the crest over the ground at the stations, for a ditch its depth


@dataclass(frozen=True)
class Structure:
    """An embankment or a ditch, ready to be built.

    Attributes
    ----------
    sign : 1.0 for an embankment, -1.0 for a ditch
    half_width : float
        Half the width of the crest (for a ditch: of the bottom) [m].
    left, right : float
        Fall of the sides, height over distance, seen along the line.
    reach : float
        How far from the line a side is followed [m].
    paths : list of list of Stretch
        Segments of each part of the line, one after the other.
    """

    sign: float
    half_width: float
    left: float
    right: float
    reach: float
    paths: list[list[Stretch]]

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east and north limit of what the structure may change [m]."""
        ends = np.array([p for path in self.paths for s in path for p in (s.a, s.a + s.length * s.along)])
        (west, south), (east, north) = ends.min(axis=0) - self.reach, ends.max(axis=0) + self.reach
        return float(west), float(south), float(east), float(north)


@dataclass
class Work:
    """Volumes that building a structure moved so far; ``open_at`` is a place where a side has not met the ground."""

    fill_m3: float = 0.0
    cut_m3: float = 0.0
    area_m2: float = 0.0
    open_at: tuple[float, float] | None = None


def stretches(
    line: Any, sign: float, ground: Callable[[Array, Array], Array], crest: Callable[[Array, Array], Array], step: float
) -> list[Stretch]:
    """The segments of a LineString, with the height of the crest at stations at most ``step`` [m] apart.

    ``ground(x, y)`` is the height of the ground there, and ``crest(ground, z)`` that of the crest; z is the line's own,
    linear between its vertices, NaN where it has none.
    """
    points = shapely.get_coordinates(line, include_z=True)
    moved = np.any(np.diff(points[:, :2], axis=0) != 0.0, axis=1)
    points = points[np.concatenate([[True], moved])]
    found = []
    for start, end in pairwise(points):
        length = float(np.hypot(*(end - start)[:2]))
        share = np.linspace(0.0, 1.0, max(1, int(np.ceil(length / step))) + 1)[:, None]
        x, y, z = (start + share * (end - start)).T
        below = ground(x, y)
        top = crest(below, z)
        unit = (end - start)[:2] / length
        found.append(Stretch(start[:2], unit, length, share[:, 0] * length, sign * top, sign * (top - below)))
    return found


def build(
    structure: Structure, original: Grid, current: Array, work: Work, around: Callable[..., Grid]
) -> NDArray[np.bool_]:
    """Build a structure into the heights of a window, ``current``, in place, and return the cells that changed.

    Where it stands follows from the ``original`` ground alone: beyond the crest a side ends where it first meets that
    ground on the way from the line, even if the ground falls away again behind. ``around(west, south, east, north)``
    gives the original ground of an extent.
    """
    sign, cell = structure.sign, original.cell
    surface = surface_over(structure, original)
    with np.errstate(invalid="ignore"):
        stands = surface.height > sign * original.values
        _end_at_ground(stands, surface, structure, original, around)
        changed = stands & (surface.height > sign * current)
    moved = float((surface.height[changed] - sign * current[changed]).sum()) * cell**2
    work.fill_m3 += moved if sign > 0 else 0.0
    work.cut_m3 += moved if sign < 0 else 0.0
    work.area_m2 += float(changed.sum()) * cell**2
    current[changed] = sign * surface.height[changed]
    still = stands & (surface.distance > structure.reach - NEAR_LIMIT_CELLS * cell)
    if work.open_at is None and still.any():
        row, column = np.argwhere(still)[0]
        work.open_at = original.x0 + column * cell, original.y0 + row * cell
    return changed


@dataclass(frozen=True)
class Surface:
    """A structure's surface over the cells of a window, for a ditch with the opposite sign; -inf beyond its reach.

    ``distance`` [m] is that of each cell from its foot on the line, at ``east`` and ``north``, where the crest is
    ``crest`` high and the side falls by ``fall``.
    """

    height: Array
    distance: Array
    crest: Array
    fall: Array
    east: Array
    north: Array


def surface_over(structure: Structure, ground: Grid) -> Surface:
    """The highest of the surfaces of all pieces of a structure."""
    found = Surface(np.full(ground.shape, -np.inf), *(np.zeros(ground.shape) for _ in range(5)))
    east = ground.x0 + ground.cell * np.arange(ground.shape[1], dtype=float)
    north = ground.y0 + ground.cell * np.arange(ground.shape[0], dtype=float)
    for path in structure.paths:
        for place, of in _pieces(path, structure):
            reach = min(structure.reach, structure.half_width + FIRST_REACH_M)
            while True:
                least, most = place.min(axis=0) - reach, place.max(axis=0) + reach
                columns = slice(*np.searchsorted(east, (least[0], most[0])))
                rows = slice(*np.searchsorted(north, (least[1], most[1])))
                whole = least[0] >= east[0] and most[0] <= east[-1] and least[1] >= north[0] and most[1] <= north[-1]
                if not whole and reach < structure.reach:  # the side may be open beyond the window
                    reach = structure.reach
                    continue
                if columns.start == columns.stop or rows.start == rows.stop:
                    break
                distance, crest, fall, *foot = of(east[columns][None, :], north[rows][:, None])
                with np.errstate(invalid="ignore"):
                    height = crest - np.maximum(distance - structure.half_width, 0.0) * fall
                    rim = (distance <= reach) & (distance > reach - NEAR_LIMIT_CELLS * ground.cell)
                    met = height <= structure.sign * ground.values[rows, columns]  # False where the ground is unknown
                    if reach < structure.reach and (rim & ~met).any():
                        reach = min(2.0 * reach, structure.reach)
                        continue
                    higher = (distance <= reach) & (height > found.height[rows, columns])
                for target, values in zip(vars(found).values(), (height, distance, crest, fall, *foot), strict=True):
                    target[rows, columns][higher] = np.broadcast_to(values, higher.shape)[higher]
                break
    return found


def _end_at_ground(
    stands: NDArray[np.bool_], surface: Surface, structure: Structure, original: Grid, around: Callable[..., Grid]
) -> None:
    """Remove the cells whose side meets the ground earlier, tested at every cell along the side."""
    cell, half = original.cell, structure.half_width
    rows, columns = np.nonzero(stands & (surface.distance > half + 1.5 * cell))
    if not rows.size:
        return
    x, y = original.x0 + columns * cell, original.y0 + rows * cell
    distance, crest, fall, east, north = (
        each[rows, columns] for each in (surface.distance, surface.crest, surface.fall, surface.east, surface.north)
    )
    ground = around(
        min(x.min(), east.min()), min(y.min(), north.min()), max(x.max(), east.max()), max(y.max(), north.max())
    )
    left = np.arange(rows.size)
    for step in range(1, int(np.ceil((distance.max() - half) / cell))):
        out = half + step * cell
        left = left[distance[left] > out + 0.5 * cell]
        share = out / distance[left]
        below = ground.height(
            east[left] + share * (x[left] - east[left]), north[left] + share * (y[left] - north[left])
        )
        # Outside the DEM a side meets nothing; rounding must not end a side.
        met = structure.sign * below > crest[left] - (out - half) * fall[left] + LEAST_HEIGHT_M
        stands[rows[left[met]], columns[left[met]]] = False
        left = left[~met]


class Piece(Protocol):
    """Distance (inf outside the piece), crest, fall, and east and north of the foot on the line, at x, y."""

    def __call__(self, x: Array, y: Array) -> tuple[Any, Any, Any, Any, Any]: ...


def _pieces(path: list[Stretch], structure: Structure) -> Iterator[tuple[Array, Piece]]:
    """The pieces of which a path's surface is composed, and the points of the line between which each lies."""
    closed = bool(np.all(path[0].a == path[-1].a + path[-1].length * path[-1].along)) and len(path) > 1
    for before, here in zip([path[-1], *path[:-1]], path, strict=True):
        yield np.array([here.a, here.a + here.length * here.along]), _side_by_side(here, structure)
        if here is not path[0] or closed:
            yield here.a[None], _outside_of_turn(before, here, structure)
    if not closed:
        first, last = path[0], path[-1]
        yield first.a[None], _end(first.a, first.crest[0], -first.along, structure.right, structure.left)
        tip = last.a + last.length * last.along
        yield tip[None], _end(tip, last.crest[-1], last.along, structure.left, structure.right)


def _side_by_side(of: Stretch, structure: Structure) -> Piece:
    def piece(x: Array, y: Array) -> tuple[Any, Any, Any, Any, Any]:
        east, north = x - of.a[0], y - of.a[1]
        along = east * of.along[0] + north * of.along[1]
        across = north * of.along[0] - east * of.along[1]  # to the left
        beside = (along >= 0.0) & (along <= of.length)
        fall = np.where(across >= 0.0, structure.left, structure.right)
        foot = of.a[0] + along * of.along[0], of.a[1] + along * of.along[1]
        return np.where(beside, np.abs(across), np.inf), np.interp(along, of.station, of.crest), fall, *foot

    return piece


def _outside_of_turn(before: Stretch, after: Stretch, structure: Structure) -> Piece:
    to_the_left = before.along[0] * after.along[1] - before.along[1] * after.along[0] > 0.0

    def piece(x: Array, y: Array) -> tuple[Any, Any, Any, Any, Any]:
        east, north = x - after.a[0], y - after.a[1]
        past = east * before.along[0] + north * before.along[1] > 0.0
        not_yet = east * after.along[0] + north * after.along[1] < 0.0
        distance = np.where(past & not_yet, np.hypot(east, north), np.inf)
        return distance, after.crest[0], structure.right if to_the_left else structure.left, *after.a

    return piece


def _end(place: Array, crest: float, outward: Array, left: float, right: float) -> Piece:
    """Half a truncated cone; its fall passes from that of the one side to that of the other, evenly with the angle."""

    def piece(x: Array, y: Array) -> tuple[Any, Any, Any, Any, Any]:
        east, north = x - place[0], y - place[1]
        out = east * outward[0] + north * outward[1]
        across = north * outward[0] - east * outward[1]  # to the left, seen outward
        share = np.arctan2(out, across) / np.pi  # 0 on the left, 1 on the right
        distance = np.where(out > 0.0, np.hypot(east, north), np.inf)
        return distance, crest, left + (right - left) * share, *place

    return piece
