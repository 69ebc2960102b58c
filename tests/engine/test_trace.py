"""What is remembered between two outlines: how far the ends have moved, and the poses that are kept."""

import numpy as np
import pytest

from deadwood_engine import limits, trace
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


def test_a_kept_pose_has_ends_speed_spin_and_the_number_needed_is_counted_beyond_the_room():
    state = pose((1, 2, 3), (1, 1, 1), velocity=(3, 4, 12), spin=(2, -1, 2))
    poses = np.zeros((1, trace.POSE_WIDTH))
    assert trace.keep_pose(poses, 0, 0.7, state, LOG, 0.25, 1.5) == 1
    row = poses[0].tolist()
    base, tip = ends(state)
    assert row == pytest.approx([0.7, 1, 2, 3, *base, *tip, 13.0, 3.0, 0.25, 1.5])
    assert trace.keep_pose(poses, 1, 0.9, state, LOG, 0.5, 1.75) == 2  # it is slid again with more room
    assert poses[0].tolist() == row


def chord_misses(places, start, end):
    """The farthest [m] that any of the places (n, 2) lies off the stretch from start to end."""
    way = end - start
    share = np.clip((places - start) @ way / max(way @ way, 1e-30), 0.0, 1.0)
    return np.hypot(*(places - start - share[:, None] * way).T).max()


@pytest.mark.parametrize("seed", range(6))
def test_between_two_outlines_both_ends_go_straight(seed):
    """Logs that wind, turn, stop and go back: the chord from one outline to the next misses no place of an end by more
    than is allowed, aside and beyond its end, and the last step's way, by which the chord moves at most."""
    rng = np.random.default_rng(seed)
    cell, most, within = 0.5, 2.0, limits.WITHIN * 0.5
    place, heading, speed, turning, tilt = np.zeros(3), rng.uniform(0, 2 * np.pi), 0.1, 0.0, 0.1
    axis = rng.uniform(0, 2 * np.pi)
    memory, since, outlines, worst = np.zeros(trace.MEMORY_WIDTH), [], 0, 0.0
    trace.remember_pose(memory, pose(place, (np.cos(axis), np.sin(axis), tilt)), LOG)
    for step in range(4000):
        if step % 40 == 0:
            speed, turning = rng.choice([-0.08, 0.0, 0.02, 0.1, 0.15]), rng.choice([-0.03, 0.0, 0.0, 0.002, 0.03])
        heading += rng.choice([0.0, 0.02]) * rng.standard_normal()
        axis += turning
        place = place + speed * np.array([np.cos(heading), np.sin(heading), 0.0])
        state = pose(place, (np.cos(axis), np.sin(axis), tilt))
        since.append(np.array(ends(state))[:, :2])
        if trace.outline_is_due(memory, state, LOG, trace.ends_moved(memory, state, LOG), most, cell):
            ways = np.array(since)
            last = np.hypot(*(ways[-1] - ways[-2]).T).max() if len(ways) > 1 else np.inf
            for end in range(2):
                start = memory[3 * end : 3 * end + 2].copy()
                off = chord_misses(ways[:, end], start, ways[-1, end])
                assert off <= np.sqrt(2.0) * within + last + 1e-12
                worst = max(worst, off)
                # up to the step before, all was within what is allowed
                if len(ways) > 1:
                    assert chord_misses(ways[:-1, end], start, ways[-2, end]) <= np.sqrt(2.0) * within + 1e-12
            trace.remember_pose(memory, state, LOG)
            since = []
            outlines += 1
    assert outlines > 60
    assert worst > 0.5 * within


def test_a_straight_path_has_an_outline_at_a_fixed_distance():
    memory = np.zeros(trace.MEMORY_WIDTH)
    trace.remember_pose(memory, pose((0, 0, 0), (1, 1, 0.3)), LOG)
    due = [
        trace.outline_is_due(memory, state, LOG, trace.ends_moved(memory, state, LOG), 2.0, 0.5)
        for state in (pose((0.3 * x, 0.1 * x, -0.2 * x), (1, 1, 0.3)) for x in np.arange(0.1, 8.0, 0.1))
    ]
    assert due.index(True) == np.ceil(2.0 / np.sqrt(0.14) / 0.1) - 1
