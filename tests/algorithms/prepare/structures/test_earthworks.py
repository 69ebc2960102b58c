"""Earthworks on arrays: the surface cell by cell from the drawing, and the volumes moved."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pyproj
import pytest
import shapely

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.prepare.structures.earthworks import Structure, Work, build, stretches, surface_over

CRS = pyproj.CRS.from_epsg(2056)
CELL, NX, NY = 0.5, 120, 100
REACH = 15.0


def grid_of(height: Any) -> Grid:
    x, y = CELL * np.arange(NX), CELL * np.arange(NY)[:, None]
    return Grid(np.broadcast_to(height(x, y), (NY, NX)).astype(float).copy(), CELL, 0.0, 0.0, CRS)


def made(line: Any, ground: Grid, *, sign: float, rise: float, half: float, left: float, right: float) -> Structure:
    path = stretches(line, sign, ground.height, lambda below, z: below + sign * rise, CELL / 2.0)
    return Structure(sign, half, left, right, REACH, [path])


def by_hand(x: float, y: float, ends: Any, level: float, half: float, left: float, right: float) -> float:
    """The height of a straight dam on level ground: over the crest, at its sides, and half a cone at each end."""
    a, b = (np.array(each) for each in ends)
    length = float(np.hypot(*(b - a)))
    unit, place = (b - a) / length, np.array([x, y])
    along, across = float((place - a) @ unit), float((place - a) @ np.array([-unit[1], unit[0]]))
    if 0.0 <= along <= length:
        return level - max(abs(across) - half, 0.0) * (left if across >= 0.0 else right)
    end, out = (a, -along) if along < 0.0 else (b, along - length)
    distance = float(np.hypot(*(place - end)))
    turned = math.atan2(out, across) / math.pi  # from the line's left (0) around the end to its right (1)
    return level - max(distance - half, 0.0) * (left + (right - left) * turned)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("ends", [((20.0, 20.0), (40.0, 20.0)), ((22.25, 14.0), (34.5, 33.25))])
def test_on_level_ground_each_cell_is_that_of_the_drawing(sign, ends):
    """A dam, and a ditch as an inverted dam: every cell, and fill and cut as sums over the cells."""
    half, left, right, rise = 1.25, 0.8, 1.4, 3.0
    ground = grid_of(lambda x, y: 100.0 + 0.0 * x + 0.0 * y)
    structure = made(shapely.LineString(ends), ground, sign=sign, rise=rise, half=half, left=left, right=right)
    work, current = Work(), ground.values.copy()
    changed = build(structure, ground, current, work, lambda *_: ground)
    expected = np.full((NY, NX), 100.0)
    for j, i in np.ndindex(NY, NX):
        above = by_hand(i * CELL, j * CELL, ends, rise, half, left, right)
        if above > 1e-9:
            expected[j, i] += sign * above
    assert current == pytest.approx(expected, abs=1e-9)
    # A cell whose designed height equals the ground to the last digits may count either way.
    assert np.array_equal(changed, np.abs(expected - 100.0) > 1e-9)
    moved = float(np.abs(expected - 100.0).sum()) * CELL**2
    assert (work.fill_m3, work.cut_m3) == pytest.approx((moved, 0.0) if sign > 0 else (0.0, moved))
    assert work.area_m2 == pytest.approx(changed.sum() * CELL**2)
    assert work.open_at is None


def test_a_bend_is_the_higher_of_its_two_segments_and_round_on_the_outside():
    ground = grid_of(lambda x, y: 100.0 + 0.0 * x + 0.0 * y)
    corner = (30.0, 20.0)
    line = shapely.LineString([(15.0, 20.0), corner, (30.0, 40.0)])
    structure = made(line, ground, sign=1.0, rise=3.0, half=1.0, left=1.0, right=1.0)
    surface = surface_over(structure, ground)
    for j, i in np.ndindex(NY, NX):
        distance = line.distance(shapely.Point(i * CELL, j * CELL))
        if distance < REACH - 1e-9 and 103.0 - max(distance - 1.0, 0.0) > 100.0:
            assert surface.height[j, i] == pytest.approx(103.0 - max(distance - 1.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("turns", ["left", "right"])
def test_outside_of_a_bend_the_side_falls_as_on_the_side_that_is_outside(turns):
    """Turning left the outside is the right side, and vice versa."""
    ground = grid_of(lambda x, y: 100.0 + 0.0 * x + 0.0 * y)
    places = [(15.0, 20.0), (30.0, 20.0), (30.0, 40.0)]
    line = shapely.LineString(places if turns == "left" else places[::-1])
    left, right = 1.0, 0.4
    surface = surface_over(made(line, ground, sign=1.0, rise=3.0, half=1.0, left=left, right=right), ground)
    outside, looked_at = right if turns == "left" else left, 0
    for j, i in np.ndindex(NY, NX):
        east, south = i * CELL - 30.0, 20.0 - j * CELL
        above = 3.0 - max(math.hypot(east, south) - 1.0, 0.0) * outside
        if east > 0.0 and south > 0.0 and above > 0.0:
            assert surface.height[j, i] == pytest.approx(100.0 + above, abs=1e-9)
            looked_at += 1
    assert looked_at > 20


@pytest.mark.parametrize("slope", [0.3, -0.5])
def test_on_a_slope_a_side_ends_where_it_meets_the_ground(slope):
    """A dam along the contour: below it the side of 45° runs rise / (1 - slope), above it rise / (1 + slope)."""
    ground = grid_of(lambda x, y: 100.0 + slope * (y - 25.0) + 0.0 * x)
    line = shapely.LineString([(10.0, 25.0), (50.0, 25.0)])
    structure = made(line, ground, sign=1.0, rise=2.0, half=1.0, left=1.0, right=1.0)
    work, current = Work(), ground.values.copy()
    build(structure, ground, current, work, lambda *_: ground)
    raised = (current - ground.values)[:, 60]  # at x = 30 m
    for j in range(NY):
        across = j * CELL - 25.0
        above = 2.0 - max(abs(across) - 1.0, 0.0) - slope * across
        assert raised[j] == pytest.approx(max(above, 0.0), abs=1e-9)


def test_a_side_that_falls_no_steeper_than_the_ground_is_reported_as_open():
    ground = grid_of(lambda x, y: 100.0 + 1.2 * y + 0.0 * x)
    line = shapely.LineString([(20.0, 30.0), (40.0, 30.0)])
    structure = made(line, ground, sign=1.0, rise=2.0, half=1.0, left=1.0, right=1.0)
    work = Work()
    build(structure, ground, ground.values.copy(), work, lambda *_: ground)
    assert work.open_at is not None
    assert 30.0 - work.open_at[1] > REACH - 1.5 * CELL - 1e-9


def test_stations_are_dense_and_a_vertex_twice_is_one():
    line = shapely.LineString([(0, 0, 5), (0, 0, 5), (3, 4, 10)])
    (one,) = stretches(line, -1.0, lambda x, y: 2.0 * x, lambda ground, z: z, 0.7)
    assert one.length == 5.0
    assert np.diff(one.station).max() <= 0.7
    assert (one.station[0], one.station[-1]) == (0.0, 5.0)
    assert one.crest == pytest.approx(-(5.0 + one.station))
    assert one.above == pytest.approx(-(5.0 + one.station - 2.0 * 0.6 * one.station))


def test_earth_that_lies_there_already_is_not_moved_again():
    """The same dam twice, then one 1 m higher on it: only the rise in height is filled."""
    ground = grid_of(lambda x, y: 100.0 + 0.0 * x + 0.0 * y)
    line = shapely.LineString([(20.0, 20.0), (40.0, 20.0)])
    work, current = Work(), ground.values.copy()
    for rise in (3.0, 3.0, 4.0):
        before, filled = current.copy(), work.fill_m3
        structure = made(line, ground, sign=1.0, rise=rise, half=1.0, left=1.0, right=1.0)
        changed = build(structure, ground, current, work, lambda *_: ground)
        assert work.fill_m3 - filled == pytest.approx(float((current - before).sum()) * CELL**2)
        assert np.array_equal(changed, current != before)
    assert work.fill_m3 == pytest.approx(float((current - ground.values).sum()) * CELL**2)
