"""Embankments and ditches as surfaces over a grid: what the ground becomes, and how much is filled or cut.

For `add_structures`. A structure is its crest line with a flat crest around it and sides that fall away from it evenly:
a trapezoid, whatever the ground. Beyond its ends the sides go round, so that an end is half a truncated cone. Where a
line turns, the parts on both sides of the turn are united and the outside is rounded likewise. A ditch is an embankment
upside down; below, all heights of a ditch are taken with the other sign.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.grid import Grid

Array = NDArray[np.float64]
NEAR_LIMIT_CELLS = 1.5  # a side that is still in the air this near to the end of its reach has not met the ground


@dataclass(frozen=True)
class Stretch:
    """One straight segment of a crest line: from ``a``, ``length`` [m] along the unit vector ``along``."""

    a: Array
    along: Array
    length: float
    station: Array  # [m] from a, rising
    crest: Array  # [m] at the stations, of a ditch with the other sign
    above: Array  # [m] of the crest over the ground at the stations, of a ditch its depth


@dataclass(frozen=True)
class Structure:
    """An embankment or a ditch, ready to be built.

    Attributes
    ----------
    sign : 1.0 for an embankment, -1.0 for a ditch
    half_width : float
        Of the crest (of a ditch: the bottom) [m].
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
    """What building a structure moved so far; ``open_at`` is a place where a side has not met the ground."""

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


def build(structure: Structure, ground: Grid, work: Work) -> NDArray[np.bool_]:
    """Build a structure into a window of the ground, in place, and say which cells it changed."""
    grounds, sign = ground.values, structure.sign
    surface, distance = surface_over(structure, ground)
    with np.errstate(invalid="ignore"):
        changed = surface > sign * grounds
    moved = float((surface[changed] - sign * grounds[changed]).sum()) * ground.cell**2
    work.fill_m3 += moved if sign > 0 else 0.0
    work.cut_m3 += moved if sign < 0 else 0.0
    work.area_m2 += float(changed.sum()) * ground.cell**2
    grounds[changed] = sign * surface[changed]
    still = changed & (distance > structure.reach - NEAR_LIMIT_CELLS * ground.cell)
    if work.open_at is None and still.any():
        row, column = np.argwhere(still)[0]
        work.open_at = ground.x0 + column * ground.cell, ground.y0 + row * ground.cell
    return changed


def surface_over(structure: Structure, ground: Grid) -> tuple[Array, Array]:
    """Height of a structure's surface at the cells [m], of a ditch with the other sign, -inf beyond its reach.

    And the distance [m] of each cell from where on the line that surface comes from.
    """
    surface = np.full(ground.shape, -np.inf)
    distance = np.zeros(ground.shape)
    east = ground.x0 + ground.cell * np.arange(ground.shape[1], dtype=float)
    north = ground.y0 + ground.cell * np.arange(ground.shape[0], dtype=float)
    for path in structure.paths:
        for place, of in _pieces(path, structure):
            least, most = place.min(axis=0) - structure.reach, place.max(axis=0) + structure.reach
            columns = slice(*np.searchsorted(east, (least[0], most[0])))
            rows = slice(*np.searchsorted(north, (least[1], most[1])))
            if columns.start == columns.stop or rows.start == rows.stop:
                continue
            here, crest, fall = of(east[columns][None, :], north[rows][:, None])
            with np.errstate(invalid="ignore"):
                height = crest - np.maximum(here - structure.half_width, 0.0) * fall
                higher = (here <= structure.reach) & (height > surface[rows, columns])
            surface[rows, columns][higher] = np.broadcast_to(height, higher.shape)[higher]
            distance[rows, columns][higher] = np.broadcast_to(here, higher.shape)[higher]
    return surface, distance


Piece = Callable[[Array, Array], tuple[Array, Any, Any]]


def _pieces(path: list[Stretch], structure: Structure) -> Iterator[tuple[Array, Piece]]:
    """The pieces that a path is united of: where each lies, and distance (inf outside it), crest and fall at x, y."""
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
    def piece(x: Array, y: Array) -> tuple[Array, Any, Any]:
        east, north = x - of.a[0], y - of.a[1]
        along = east * of.along[0] + north * of.along[1]
        across = north * of.along[0] - east * of.along[1]  # to the left
        beside = (along >= 0.0) & (along <= of.length)
        fall = np.where(across >= 0.0, structure.left, structure.right)
        return np.where(beside, np.abs(across), np.inf), np.interp(along, of.station, of.crest), fall

    return piece


def _outside_of_turn(before: Stretch, after: Stretch, structure: Structure) -> Piece:
    to_the_left = before.along[0] * after.along[1] - before.along[1] * after.along[0] > 0.0

    def piece(x: Array, y: Array) -> tuple[Array, Any, Any]:
        east, north = x - after.a[0], y - after.a[1]
        past = east * before.along[0] + north * before.along[1] > 0.0
        not_yet = east * after.along[0] + north * after.along[1] < 0.0
        distance = np.where(past & not_yet, np.hypot(east, north), np.inf)
        return distance, after.crest[0], structure.right if to_the_left else structure.left

    return piece


def _end(place: Array, crest: float, outward: Array, left: float, right: float) -> Piece:
    """Half a truncated cone; its fall passes from that of the one side to that of the other, evenly with the angle."""

    def piece(x: Array, y: Array) -> tuple[Array, Any, Any]:
        east, north = x - place[0], y - place[1]
        out = east * outward[0] + north * outward[1]
        across = north * outward[0] - east * outward[1]  # to the left, seen outward
        share = np.arctan2(out, across) / np.pi  # 0 on the left, 1 on the right
        return np.where(out > 0.0, np.hypot(east, north), np.inf), crest, left + (right - left) * share

    return piece
