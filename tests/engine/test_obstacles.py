"""How long a log may go on beside obstacles: nowhere has its axis left the room that the bound gives it."""

import numpy as np
import pytest

from deadwood_engine.contacts import predict
from deadwood_engine.log_body import CENTRE, LENGTH, cone_bodies
from deadwood_engine.obstacles import _swing, _time_to
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
