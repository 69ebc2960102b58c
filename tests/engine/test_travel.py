"""How far a log gets in free motion, against the motion itself."""

import numpy as np
import pytest

from deadwood_engine.log_body import AXIAL, BASE_RADIUS, CENTRE, LENGTH, TRANSVERSE, cone_bodies
from deadwood_engine.rotation import drift, set_axis
from deadwood_engine.travel import travel_bound

NUMBER = 2000


def flights():
    """(body, state) of logs thick and thin, tumbling and spinning at up to some tens of rad/s."""
    rng = np.random.default_rng(11)
    bodies = cone_bodies(rng.uniform(0.1, 1.5, NUMBER), rng.uniform(0.5, 40.0, NUMBER), np.full(NUMBER, 500.0))
    for body in bodies:
        state = np.zeros(16)
        state[3:7] = rng.normal(size=4)
        set_axis(state)
        state[7:10] = rng.normal(size=3) * rng.choice([0.0, 1.0, 10.0])
        state[10:13] = rng.normal(size=3) * rng.choice([0.1, 1.0, 10.0]) + state[13:16] * rng.choice([0.0, 50.0])
        yield body, state


def places_on(body):
    """On the axis, base to tip [m from the centre of mass]."""
    return np.linspace(0.0, body[LENGTH], 5) - body[CENTRE]


@pytest.mark.parametrize("time", [1e-3, 0.02, 0.1])
def test_no_place_of_the_axis_gets_farther(time):
    """The bound holds at rounding, and is no idle one: some end gets within 1 % of it at every length of step."""
    closest = 0.0
    for body, state in flights():
        speed, bend = travel_bound(None, state, body)
        along = places_on(body)
        before = state[:3] + along[:, None] * state[13:16]
        drift(state, body[TRANSVERSE], body[AXIAL], time)
        moved = np.linalg.norm(state[:3] + along[:, None] * state[13:16] - before, axis=1).max()
        way = speed * time + 0.5 * bend * time * time
        assert moved <= way * (1.0 + 1e-9) + 1e-12
        closest = max(closest, moved / way)
    assert closest > 0.99


def test_no_point_of_a_face_s_rim_gets_farther_than_the_bound():
    """A log that does not spin: the swing moves the rim of a disc more than the ends of its axis."""
    closest = 0.0
    for body, state in flights():
        state[10:13] -= (state[10:13] @ state[13:16]) * state[13:16]
        speed, bend = travel_bound(None, state, body)
        axis, swing = state[13:16], state[10:13]
        rim = body[BASE_RADIUS] * np.cross(axis, swing) / np.linalg.norm(swing)  # its point that moves along the axis
        first = state[:3] - body[CENTRE] * axis + rim
        drift(state, body[TRANSVERSE], body[AXIAL], 1e-3)
        turn = np.linalg.norm(swing) * 1e-3
        turned = rim * np.cos(turn) + np.cross(swing, rim) * np.sin(turn) / np.linalg.norm(swing)
        moved = np.linalg.norm(state[:3] - body[CENTRE] * state[13:16] + turned - first)
        bound = speed * 1e-3 + 0.5 * bend * 1e-6
        assert moved <= bound * (1.0 + 1e-9) + 1e-12
        closest = max(closest, moved / bound)
    assert closest > 0.9
