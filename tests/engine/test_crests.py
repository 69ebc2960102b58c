"""Crests by themselves: where a side comes nearest to grid lines, and the plane that touches both.

That logs ride over crests, at any distance of rings, is held by whole slides (tests/physics/test_sliding.py).
"""

import math

import numpy as np
import pytest

from deadwood_engine.crests import APEX, Generator, Nodes, _highest, along_side, crest
from deadwood_engine.limits import ALONG_GRID, BESIDE_CREST
from deadwood_engine.terrain import bilinear, prepare

CELL = 0.5
RADIUS = 0.3


def terrain_of(heights):
    return prepare(heights, CELL, 0.0, 0.0, 0.3, reference=0.0)


def nodes_of(terrain):
    return Nodes(terrain.heights, terrain.cell, terrain.inverse_cell, 0, 0)


def side_of(axis, taper):
    """The unit axis, from it to the lowest point of a ring (e), and the side's line there, l = q + taper e / |e|."""
    q = axis / np.linalg.norm(axis)
    e = q[2] * q - [0.0, 0.0, 1.0]
    e *= RADIUS / np.linalg.norm(e)
    return q, e, q + taper * e / RADIUS


def found(terrain, centre, q, e, taper, low, high, gap):
    return crest(nodes_of(terrain), tuple(centre), tuple(q), tuple(e), (RADIUS, taper), (low, high), gap)


def beside(terrain, p, d, taper):
    """The ground's gradient at p, and that of the plane that touches a side along d."""
    height, *gradient = bilinear(terrain.heights, terrain.inverse_cell, 0, 0, *p)
    slope = tuple(gradient)
    return slope, along_side(nodes_of(terrain), (*p, height), slope, tuple(d), (RADIUS, taper), 1.0)


@pytest.mark.parametrize("turn", [0.1, 0.7, 1.2, 2.5])
@pytest.mark.parametrize("taper", [0.0, -0.02])
def test_over_a_straight_ridge_it_is_the_ridge_and_the_plane_holds_both_lines(turn, taper):
    """A ridge along a grid line that rises by the way: touched where the lowest line crosses it, along l x g."""
    x = CELL * np.arange(60)
    rise = 0.2  # of the ridge, along y
    heights = -0.4 * np.abs(x - 15.0)[None, :] + rise * x[:, None]
    terrain = terrain_of(heights)
    q, e, _ = side_of(np.array([math.cos(turn), math.sin(turn), rise * math.sin(turn)]), taper)
    centre = np.array([15.0, 15.0, rise * 15.0 + RADIUS + 0.01]) - 0.13 * q
    height, _, _ = bilinear(terrain.heights, terrain.inverse_cell, 0, 0, *(centre + e)[:2])
    gap = (centre + e)[2] - height
    is_one, t, *to, lower, sx, sy = found(terrain, centre, q, e, taper, -0.5, 0.5, gap)
    assert is_one
    place = centre + t * q + to  # the point on the log, over the ridge
    assert place[0] == pytest.approx(15.0, abs=1e-9)
    assert lower == pytest.approx(place[2] - rise * place[1], abs=1e-6)
    assert lower < gap
    assert np.dot(to, q) == pytest.approx(0.0, abs=1e-9)
    assert np.linalg.norm(to) == pytest.approx(RADIUS + taper * t)
    line = q + taper * np.array(to) / np.linalg.norm(to)
    normal = np.array([-sx, -sy, 1.0])
    assert normal @ [0.0, 1.0, rise] == pytest.approx(0.0, abs=1e-6)  # the grid line
    assert normal @ line == pytest.approx(0.0, abs=1e-9)  # the side


@pytest.mark.parametrize("seed", range(6))
def test_of_all_grid_lines_the_highest_is_found_or_where_the_cell_beside_it_is_higher(seed):
    """Lines over rough ground, against all their crossings one by one and places 2 mm apart in the cells beside."""
    rng = np.random.default_rng(seed)
    terrain = terrain_of(0.2 * rng.random((60, 60)))
    ground = terrain.heights, terrain.inverse_cell, 0, 0
    seen = []
    for _ in range(200):
        (px, py), way = rng.uniform(10.0, 20.0, 2), rng.normal(size=3) * (1.0, 1.0, 0.2)
        way /= np.linalg.norm(way)

        def gap_at(t, p=(px, py), way=way):
            return 0.15 + t * way[2] - bilinear(*ground, p[0] + t * way[0], p[1] + t * way[1])[0]

        least = rng.uniform(-0.05, 0.1)
        low, high = -rng.uniform(0.1, 1.0), rng.uniform(0.1, 1.0)
        crossings = [
            (line * CELL - p) / along for p, along in zip((px, py), way[:2], strict=True) if abs(along) >= ALONG_GRID
            for line in range(60) if low <= (line * CELL - p) / along <= high
        ]  # fmt: skip
        best = min(crossings, key=gap_at, default=math.inf)
        line = Generator((px, py, 0.15), tuple(way), low, high)
        found_one = _highest(Nodes(terrain.heights, CELL, 1.0 / CELL, 0, 0), line, least)
        gap, t, slope, family, _ = found_one
        if not crossings or gap_at(best) >= least:
            assert (gap, family) == (least, -1)
            continue
        beside = min((best + BESIDE_CREST * CELL, best - BESIDE_CREST * CELL), key=gap_at)
        goes_on = gap_at(beside) < gap_at(best) - 1e-12
        assert (family in (0, 1)) == (not goes_on)
        seen.append(family)
        if family == APEX:
            # the lowest of its neighbourhood, and lower than any grid line
            assert gap == pytest.approx(gap_at(t), abs=1e-8)
            assert gap < gap_at(best)
            assert low <= t <= high
            assert gap <= min(gap_at(t - 2e-3), gap_at(t + 2e-3))
        else:
            assert (gap, t) == pytest.approx((gap_at(best), best), abs=1e-9)
        if family in (0, 1):
            aside = (0.0, 1e-6) if family == 0 else (1e-6, 0.0)
            here = np.array([px, py]) + t * way[:2] - 1e-9 * way[:2]
            rise = bilinear(*ground, *(here + aside))[0] - bilinear(*ground, *here)[0]
            assert slope == pytest.approx(rise / 1e-6, abs=1e-6)
    assert {0, 1, APEX} <= set(seen)


def test_a_plane_has_no_crest():
    y = CELL * np.arange(40)
    terrain = terrain_of(0.5 * y[:, None] + 0.3 * y[None, :])
    q, e, _ = side_of(np.array([0.6, 0.4, 0.1]), 0.0)
    centre = np.array([10.0, 10.0, 8.0 + RADIUS])
    height, _, _ = bilinear(terrain.heights, terrain.inverse_cell, 0, 0, *(centre + e)[:2])
    assert not found(terrain, centre, q, e, 0.0, -0.5, 0.5, (centre + e)[2] - height)[0]


@pytest.mark.parametrize("taper", [0.0, -0.015, 0.02])
@pytest.mark.parametrize("turn", [0.3, 1.0, 2.0])
def test_on_a_flank_the_plane_is_tangent_to_the_cone(taper, turn):
    """Beside a ridge the normal n leans from the axis as a cone's does, n.d = taper / sqrt(1 + taper^2), and is the
    ground's across the axis; on a plane, and on a wall, it is the ground's as it is."""
    x = CELL * np.arange(60)
    ridge = terrain_of(np.tile(-0.4 * np.abs(x - 15.0), (60, 1)))
    d = np.array([math.cos(turn), math.sin(turn), 0.05])
    d /= np.linalg.norm(d)
    p = np.array([15.2, 14.3])
    (gx, gy), (sx, sy) = beside(ridge, p, d, taper)
    ground, normal = np.array([-gx, -gy, 1.0]), np.array([-sx, -sy, 1.0])
    assert normal @ d / np.linalg.norm(normal) == pytest.approx(taper / math.sqrt(1.0 + taper**2), abs=1e-12)
    one, other = (each - (each @ d) * d for each in (ground, normal))
    assert np.cross(one, other) == pytest.approx(np.zeros(3), abs=1e-12)
    assert one @ other > 0.0
    plane = terrain_of(np.tile(-0.4 * (x - 15.0), (60, 1)))
    gradient, found_one = beside(plane, p, d, taper)
    assert found_one == gradient
    wall = terrain_of(np.tile(-4.0 * np.abs(x - 15.0), (60, 1)))
    gradient, found_one = beside(wall, p, (1.0, 0.0, 0.0), taper)
    assert found_one == gradient
