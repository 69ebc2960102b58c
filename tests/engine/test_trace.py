"""What is remembered between two outlines: how far the ends have moved, and the poses that are kept."""

import numpy as np
import pytest

from deadwood_engine import trace
from deadwood_engine.log_body import CENTRE, LENGTH, cone_bodies

LOG = cone_bodies(np.array([0.6]), np.array([12.0]), np.array([300.0]))[0]


def pose(place, axis, velocity=(0, 0, 0), spin=(0, 0, 0)):
    state = np.zeros(16)
    state[:3], state[7:10], state[10:13] = place, velocity, spin
    state[13:16] = np.asarray(axis, float) / np.linalg.norm(axis)
    return state


def ends(state):
    return [state[:3] + s * state[13:16] for s in (-LOG[CENTRE], LOG[LENGTH] - LOG[CENTRE])]


def test_the_farther_end_counts():
    rng = np.random.default_rng(1)
    for _ in range(50):
        one, two = (pose(rng.standard_normal(3), rng.standard_normal(3)) for _ in range(2))
        memory = np.zeros(trace.MEMORY_WIDTH)
        trace.remember_pose(memory, one, LOG)
        assert trace.ends_moved(memory, one, LOG) == 0.0
        moved = max(np.linalg.norm(b - a) for a, b in zip(ends(one), ends(two), strict=True))
        assert trace.ends_moved(memory, two, LOG) == pytest.approx(moved, abs=1e-12)


def test_a_kept_pose_has_ends_speed_spin_and_the_number_wanted_goes_on_without_room():
    state = pose((1, 2, 3), (1, 1, 1), velocity=(3, 4, 12), spin=(2, -1, 2))
    poses = np.zeros((1, trace.POSE_WIDTH))
    assert trace.keep_pose(poses, 0, 0.7, state, LOG, 0.25, 1.5) == 1
    row = poses[0].tolist()
    base, tip = ends(state)
    assert row == pytest.approx([0.7, 1, 2, 3, *base, *tip, 13.0, 3.0, 0.25, 1.5])
    assert trace.keep_pose(poses, 1, 0.9, state, LOG, 0.5, 1.75) == 2  # it is slid again with more room
    assert poses[0].tolist() == row
