"""The look at all rings in one go: what it passes over touches no ground, and its numbers are those of each ring."""

import math

import numpy as np
import pytest

from deadwood_engine.log_body import BASE_RADIUS, CENTRE, LENGTH, TIP_RADIUS, cone_bodies
from deadwood_engine.model import Log
from deadwood_engine.ring_look import ABOVE, LOOK_ROOM, SLOPE_X, SLOPE_Y, TOGETHER, look, lowest_ring, ring_table
from deadwood_engine.surroundings import POSE
from deadwood_engine.terrain import prepare, surfaces_at

SIDE = 40.0


def terrain_of(heights, cell):
    return prepare(heights, cell, 0.0, 0.0, 0.3, reference=0.0)


def seen(terrain, body, axis, centre, stations, node=(0, 0)):
    """What a look finds, as of ``ring_table``; centre : in the frame of a node."""
    pose = np.array([(*axis, *centre)], POSE).view(np.recarray)[0]
    rings = np.full_like(ring_table(stations), 99.0)[:, :stations]
    look(terrain, Log(np.array(node), body, stations), pose, rings, np.full(LOOK_ROOM, np.nan))
    return rings


def stretch(body, axis, centre, stations, k):
    """Points (n, 3) of the cone that ring k answers for: to half way to the next ring, beside an end up to the end."""
    between = body[LENGTH] / (stations - 1)
    low, high = (k - (1.0 if k == 1 else 0.5)) * between, (k + (1.0 if k == stations - 2 else 0.5)) * between
    along = np.linspace(k * between if k == 0 else low, k * between if k == stations - 1 else high, 7)
    side = np.cross(axis, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    turn = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
    ring = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * np.cross(axis, side)
    radius = body[BASE_RADIUS] + (body[TIP_RADIUS] - body[BASE_RADIUS]) * along / body[LENGTH]
    points = centre + ((along - body[CENTRE])[:, None] * axis)[:, None] + radius[:, None, None] * ring
    return points.reshape(-1, 3)


@pytest.mark.parametrize("seed", range(4))
def test_what_is_passed_over_is_out_of_the_ground(seed):
    """Logs that dip into rough ground: of no ring that the look calls clear does a place of the stretch lie below."""
    rng = np.random.default_rng(seed)
    cell = 0.5
    count = int(SIDE / cell)
    heights = 0.7 * cell * np.arange(count)[:, None] + rng.choice([0.05, 0.4]) * rng.random((count, count))
    terrain = terrain_of(heights, cell)
    over, below = 0, 0
    for _ in range(30):
        # thin enough for the kinks' bound, and rings so close that it holds as far as half way to the next
        body = cone_bodies(np.array([rng.uniform(0.2, 0.6)]), np.array([rng.uniform(2.0, 9.0)]), np.array([400.0]))[0]
        stations = max(8, math.ceil(body[LENGTH] / 0.5) + 1)
        axis = rng.normal(size=3) * (1.0, 1.0, 0.4)
        axis /= np.linalg.norm(axis)
        plan = rng.uniform(12.0, SIDE - 12.0, (1, 2))
        centre = np.array([*plan[0], surfaces_at(terrain, plan)[0, 0] + rng.uniform(0.0, 1.5)])
        rings = seen(terrain, body, axis, centre, stations)
        for k in range(stations):
            points = stretch(body, axis, centre, stations, k)
            free = (points[:, 2] - surfaces_at(terrain, points[:, :2])[:, 0]).min() > 0.0
            if rings[ABOVE, k] > 0.0:
                over += 1
                assert free
            below += not free
    assert over > 30
    assert below > 30


@pytest.mark.parametrize("turn", [0.0, 0.5 * np.pi, np.pi])
def test_ground_that_steepens_beside_a_ring_counts_with_its_stretch(turn):
    """A thin level log over ground that is level below a ring and rises by 45 degrees within its stretch: no ring is
    passed over whose stretch is in the ground, at any height, and all are two metres up."""
    x = 0.5 * np.arange(80)
    rise = np.maximum(0.0, x - 20.0)
    axis = np.array([math.cos(turn), math.sin(turn), 0.0])
    terrain = terrain_of(np.tile(rise, (80, 1)).T.copy() if abs(axis[1]) > 0.5 else np.tile(rise, (80, 1)), 0.5)
    body = cone_bodies(np.array([0.1]), np.array([6.0]), np.array([400.0]), taper=1.0)[0]
    below = 0
    for away in np.linspace(-0.6, 0.6, 5):
        for height in np.linspace(0.06, 0.3, 5):
            centre = np.array([20.0, 20.0, height]) - (3.0 - away) * abs(axis)
            rings = seen(terrain, body, axis, centre, 13)
            for k in range(13):
                points = stretch(body, axis, centre, 13, k)
                free = (points[:, 2] - surfaces_at(terrain, points[:, :2])[:, 0]).min() > 0.0
                assert free or not rings[ABOVE, k] > 0.0
                below += not free
    assert below >= 20
    assert (seen(terrain, body, axis, np.array([17.0, 17.0, 9.0]), 13)[ABOVE] > 0.0).all()


@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_on_a_plane_it_is_the_distance_of_the_ring_from_it(tilt):
    """Vertically, for all of a cylinder's side alike: at about 40 degrees the root that is not taken is exact."""
    tangent = 0.8125  # 39 degrees; exact in float32, so there are no kinks
    y = np.arange(81) * 0.5
    terrain = terrain_of(tangent * y[:, None] + 0.0 * y[None, :], 0.5)
    body = cone_bodies(np.array([0.5]), np.array([6.0]), np.array([400.0]), taper=1.0)[0]
    axis = np.array([math.cos(tilt), math.sin(tilt), tangent * math.sin(tilt)])  # along the plane
    axis /= np.linalg.norm(axis)
    rings = seen(terrain, body, axis, np.array([20.0, 20.0, tangent * 20.0 + 3.0]), 13)
    assert rings[SLOPE_X] == pytest.approx(np.zeros(13), abs=1e-5)
    assert rings[SLOPE_Y] == pytest.approx(np.full(13, tangent), abs=1e-5)
    assert rings[ABOVE] == pytest.approx(np.full(13, 3.0 - 0.25 * math.sqrt(1.0 + tangent**2)), abs=1e-4)


def test_many_rings_and_another_frame_are_the_same():
    """More rings than are looked at together, seen from a node of the DEM's middle, each as by itself."""
    rng = np.random.default_rng(3)
    terrain = terrain_of(rng.random((90, 90)), 0.5)
    body = cone_bodies(np.array([0.4]), np.array([30.0]), np.array([400.0]))[0]
    axis = np.array([0.8, 0.6, 0.0])
    stations = 2 * TOGETHER + 9
    rings = seen(terrain, body, axis, np.array([20.0, 20.0, 2.0]), stations)
    assert seen(terrain, body, axis, np.array([10.0, 5.0, 2.0]), stations, (20, 30)) == pytest.approx(rings, abs=1e-9)
    places = np.array([20.0, 20.0]) + (np.arange(stations) * 30.0 / (stations - 1) - body[CENTRE])[:, None] * axis[:2]
    slopes = rings[[SLOPE_X, SLOPE_Y]].T
    assert slopes == pytest.approx(surfaces_at(terrain, places)[:, 1:], abs=1e-9)


def test_where_there_is_no_terrain_a_ring_is_nowhere():
    """Beyond the border, and over a hole: NaN, and the rings beside it are what they are."""
    heights = np.zeros((40, 40))
    heights[20, 25] = np.nan
    terrain = terrain_of(heights, 0.5)
    body = cone_bodies(np.array([0.3]), np.array([8.0]), np.array([400.0]))[0]
    rings = seen(terrain, body, np.array([1.0, 0.0, 0.0]), np.array([18.0, 5.0, 1.0]), 17)
    x = 18.0 + np.arange(17) * 0.5 - body[CENTRE]
    assert np.array_equal(np.isnan(rings[ABOVE]), x >= 19.5)
    rings = seen(terrain, body, np.array([1.0, 0.0, 0.0]), np.array([12.0, 10.2, 1.0]), 17)
    x = 12.0 + np.arange(17) * 0.5 - body[CENTRE]
    assert np.array_equal(np.isnan(rings[ABOVE]), (x >= 12.0) & (x < 13.0))


def test_rings_thicker_than_the_kinks_reach_are_always_looked_at():
    terrain = terrain_of(np.zeros((60, 60)), 0.5)
    body = cone_bodies(np.array([1.2]), np.array([8.0]), np.array([400.0]))[0]
    rings = seen(terrain, body, np.array([1.0, 0.0, 0.0]), np.array([15.0, 15.0, 9.0]), 17)
    assert (rings[ABOVE] == -np.inf).all()


def height_of_lowest(terrain, body, axis, centre, stations):
    state = np.zeros(16)
    state[:3], state[13:16] = centre, axis
    return lowest_ring(terrain, Log(np.zeros(2, np.int64), body, stations), state, np.full(LOOK_ROOM, np.nan))


@pytest.mark.parametrize("stations", [9, 2 * TOGETHER + 9])
def test_the_lowest_ring_is_the_nearest_to_its_tangent_plane(stations):
    """Ring by ring: that which is vertically lowest, and the distance of its circle from the plane below its centre."""
    rng = np.random.default_rng(8)
    terrain = terrain_of(0.6 * 0.5 * np.arange(80)[:, None] + 0.5 * rng.random((80, 80)), 0.5)
    body = cone_bodies(np.array([0.5]), np.array([12.0]), np.array([400.0]))[0]
    for _ in range(20):
        axis = rng.normal(size=3) * (1.0, 1.0, 0.3)
        axis /= np.linalg.norm(axis)
        along = np.linspace(0.0, body[LENGTH], stations)
        centre = np.array([*rng.uniform(14.0, 26.0, 2), rng.uniform(9.0, 14.0)])
        rings = centre + (along - body[CENTRE])[:, None] * axis
        radius = body[BASE_RADIUS] + (body[TIP_RADIUS] - body[BASE_RADIUS]) * along / body[LENGTH]
        height, gx, gy = surfaces_at(terrain, rings[:, :2]).T
        steep = np.sqrt(1.0 + gx**2 + gy**2)
        sine = np.sqrt(1.0 - ((axis[2] - gx * axis[0] - gy * axis[1]) / steep) ** 2)
        k = np.argmin(rings[:, 2] - height - radius * (1.0 + 0.5 * (gx**2 + gy**2)))
        least = (rings[k, 2] - height[k]) / steep[k] - radius[k] * sine[k]
        assert height_of_lowest(terrain, body, axis, centre, stations) == pytest.approx(max(0.0, least), abs=1e-9)


def test_the_lowest_ring_on_a_plane_in_the_ground_and_where_there_is_none():
    tangent = 0.75  # exact in float32
    y = np.arange(81) * 0.5
    terrain = terrain_of(tangent * y[:, None] + 0.0 * y[None, :], 0.5)
    body = cone_bodies(np.array([0.5]), np.array([6.0]), np.array([400.0]), taper=1.0)[0]
    axis = np.array([1.0, 0.0, 0.0])
    above = np.array([20.0, 20.0, tangent * 20.0 + 3.0])
    assert height_of_lowest(terrain, body, axis, above, 13) == pytest.approx(3.0 / 1.25 - 0.25, abs=1e-12)
    assert height_of_lowest(terrain, body, axis, above - (0.0, 0.0, 3.1), 13) == 0.0
    assert height_of_lowest(terrain, body, axis, above - (60.0, 0.0, 0.0), 13) == 0.0
