"""How far a log may move beside obstacles: its axis nowhere leaves the room given by the bound."""

import numpy as np
import pytest

from deadwood_engine.contacts import predict
from deadwood_engine.cores import BARRIER, CORE, TREE, swept_sphere
from deadwood_engine.limits import SKEW_LINES
from deadwood_engine.log_body import CENTRE, LENGTH, cone_bodies
from deadwood_engine.narrow_phase import cone_of, deepest
from deadwood_engine.obstacles import _nearest, _swing, _time_to
from deadwood_engine.surroundings import POSE

LOG = cone_bodies(np.array([0.6]), np.array([12.0]), np.array([300.0]))[0]


@pytest.mark.parametrize("seed", range(60))
def test_the_axis_stays_in_its_room(seed):
    """The place s of the axis, between its ends, leaves its first line sideways by no more than the room in the time.

    An end may move in any way, but no farther either. Fast, slow, spinning and falling logs; the bound is no idle one.
    """
    rng = np.random.default_rng(seed)
    state = np.zeros(16)
    axis = rng.standard_normal(3)
    state[13:16] = axis / np.linalg.norm(axis)
    turn = rng.choice([0.0, 0.3, 5.0])
    state[7:10], state[10:13] = rng.choice([0.1, 5.0, 40.0]) * rng.standard_normal(3), turn * rng.standard_normal(3)
    back, front = -LOG[CENTRE], LOG[LENGTH] - LOG[CENTRE]
    room = 10 ** rng.uniform(-2, 0.5)
    for s in (back, front, rng.uniform(back + 0.1, front - 0.1)):
        time = _time_to(_swing(state), state, LOG, 9.81, s, room)
        assert time > 0.0
        first, d = state[:3] + s * state[13:16], state[13:16].copy()
        pose, far = np.zeros(1, POSE).view(np.recarray)[0], []
        for t in np.linspace(0.0, time, 40):
            predict(state, t, 9.81, pose)
            ahead = np.array([pose.x, pose.y, pose.z]) + s * np.array([pose.dx, pose.dy, pose.dz])
            moved = ahead - first
            if back < s < front:
                moved = moved - (moved @ d) * d
            far.append(np.linalg.norm(moved))
        assert max(far) <= room * (1.0 + 1e-9)
        if turn == 0.0 and np.linalg.norm(state[7:10]) > 3.0 and s in (back, front):
            assert max(far) > 0.3 * room


@pytest.mark.parametrize("taper", [0.02, 0.5, 1.0])
def test_a_log_is_as_clear_of_a_core_as_is_reported(taper):
    """Against the least gap of 3000 pairs: never nearer than said; and where their axes pass one another at 16 degrees
    or more, hardly farther, 3 % of the axes' distance."""
    rng = np.random.default_rng(7)
    cone = cone_of(cone_bodies(np.array([0.6]), np.array([12.0]), np.array([300.0]), taper=taper)[0])
    pose, core = np.zeros(1, POSE).view(np.recarray)[0], np.zeros(1, CORE).view(np.recarray)[0]
    core.kind, passing = TREE, 0
    for number in range(3000):
        d, u = rng.standard_normal((2, 3))
        if number % 4 == 0:
            u = d + 10.0 ** rng.uniform(-6, 0) * u
        d, u = d / np.linalg.norm(d), u / np.linalg.norm(u)
        core.long, core.wide = rng.choice([0.0, 0.5, 25.0]), rng.choice([0.05, 0.4, 0.8])
        core.slope = rng.choice([0.0, -0.95 * core.wide / max(core.long, 1.0), -0.01 * core.wide])
        place = rng.uniform(-8.0, 8.0) * d + 10.0 ** rng.uniform(-2, 0.7) * rng.standard_normal(3)
        core.x, core.y, core.z = place - core.long * rng.uniform(-0.1, 1.1) * u
        core.ux, core.uy, core.uz = u
        pose.dx, pose.dy, pose.dz = d
        clear, s, mine, theirs = _nearest(cone, pose, core)
        gap, z, _, _ = deepest(cone, ((0.0, 0.0, 0.0), tuple(d)), swept_sphere(core), np.inf)
        # axes within 3e-5 rad of parallel are taken for parallel: 0.4 mm on the log's 12 m
        parallel = np.sum(np.cross(d, u) ** 2) < SKEW_LINES
        assert clear <= max(gap, 0.0) + (12.0 * SKEW_LINES**0.5 if parallel else 1e-9)
        assert mine == pytest.approx(cone[2] + cone[4] * (s - cone[0]))
        if gap > 0.0 and core.long > 20.0 and cone[0] < s < cone[1] and 0.0 < z < core.long and abs(d @ u) < 0.96:
            passing += 1
            # the axes' distance, less sqrt(1 - steep / apart) of it: steep is 2e-3 at most, apart 0.04 at least
            assert gap - clear < 0.03 * (gap + mine + theirs)
    assert passing > 100


def test_a_log_past_the_end_of_a_barrier_is_as_clear_of_it_as_it_is_in_plan():
    """An oblique log may lie on both sides of the plate's plane metres past its end: that is no reason for short steps,
    and one that were taken only if the barrier happens to be listed.
    """
    rng, past = np.random.default_rng(5), 0
    cone = cone_of(cone_bodies(np.array([0.6]), np.array([12.0]), np.array([300.0]))[0])
    pose, core = np.zeros(1, POSE).view(np.recarray)[0], np.zeros(1, CORE).view(np.recarray)[0]
    core.kind, core.long, core.ux, core.first_post, core.last_post = BARRIER, 4.0, 1.0, 1.0, 1.0
    along = np.linspace(cone[0], cone[1], 400)
    radius = cone[2] + cone[4] * (along - cone[0])
    for _ in range(2000):
        d = rng.standard_normal(3)
        pose.dx, pose.dy, pose.dz = d / np.linalg.norm(d)
        pose.x, pose.y, pose.z = rng.uniform((-12.0, -9.0, -6.0), (16.0, 9.0, 6.0))
        clear, _, _, _ = _nearest(cone, pose, core)
        x, y, z = np.array([[pose.x], [pose.y], [pose.z]]) + np.array([[pose.dx], [pose.dy], [pose.dz]]) * along
        beyond = np.maximum(0.0, np.maximum(-x, x - 4.0))
        assert clear <= (np.sqrt(beyond**2 + y**2 + np.maximum(0.0, z) ** 2) - radius).min() + 1e-9
        apart = np.hypot(beyond, y).min() - radius.max()
        assert clear > apart - 0.02  # of the points 3 cm apart
        past += apart > 1.0 and y.min() < 0.0 < y.max()
    assert past > 100
