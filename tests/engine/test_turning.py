"""Planes that turn under a sliding body: the work of weight and impact, on a body whose contact is at its centre.

There are no lever arms and the Delassus block is 1, so that a solve is one line in the test.
"""

import math

import numpy as np
import pytest

from deadwood_engine.contacts import CONTACT, KEY_WIDTH, OLD_CONTACT, TERRAIN
from deadwood_engine.cores import TREE
from deadwood_engine.turning import plane_speed, remember_plane, turn_contacts

G_DT = 0.1  # [m/s] of gravity in a step, half of it for the way behind
SPEED = 5.0


def normal(angle):
    """Of ground that rises so [rad] to the east."""
    return np.array([-math.sin(angle), 0.0, math.cos(angle)])


def turned(angle, *, target=0.0, kick=G_DT, flat=1e-9, kind=TERRAIN, row=0):
    """A body that slid along level ground reaches ground that rises by ``angle``: (contact, velocity at the node)."""
    state = np.zeros(16)
    state[7], state[13] = SPEED, 1.0
    state[9] = -0.5 * kick
    old = np.zeros(1, OLD_CONTACT).view(np.recarray)
    old[0].nz = 1.0
    table = np.zeros(1, CONTACT).view(np.recarray)
    c = table[0]
    c.nx, c.ny, c.nz = c.ahead_nx, c.ahead_ny, c.ahead_nz = normal(angle)
    c.before_n, c.target, c.old_row = state[7:10] @ normal(angle), target, row
    keys = np.full((1, KEY_WIDTH), kind)
    turn_contacts(table, keys, 1, state, old, (kick, 0.5 * kick, flat))
    return c, state


def pushed(c, state, kick=G_DT):
    """Solve it: (impulse, velocity after, work at the node)."""
    n = np.array([c.nx, c.ny, c.nz])
    free = state[7:10] - (0.0, 0.0, 0.5 * kick)
    push = max(0.0, c.target - free @ n)
    after = free + push * n
    return push, after, 0.5 * push * n @ (state[7:10] + after + (0.0, 0.0, 0.5 * kick))


@pytest.mark.parametrize("angle", [-0.01, -0.003, 0.0002, 0.001, 0.003, 0.01, 0.03])
def test_weight_does_no_work_and_the_blow_takes_its_own(angle):
    """Into rising ground delta^2 / 2, as an inelastic kink does, and off falling ground nothing, to the angle's third
    order. Along the plane ahead it would be g dt |delta| / 2 besides, sixteen times as much at a milliradian."""
    delta = SPEED * normal(angle)[0]
    push, after, work = pushed(*turned(angle))
    blow = 0.5 * delta**2 if angle > 0.0 else 0.0
    assert work == pytest.approx(-blow, abs=3.0 * SPEED * G_DT * angle**2 + 2.0 * SPEED**2 * abs(angle) ** 3)
    if push > 0.0:  # and the plane ahead is kept all the same
        assert after @ normal(angle) == pytest.approx(0.0, abs=SPEED * angle**2)


def test_a_blow_without_weight_is_along_the_plane_ahead():
    c, state = turned(0.02, kick=0.0)
    assert (c.nx, c.ny, c.nz) == pytest.approx(tuple(normal(0.02)), abs=1e-15)
    assert c.target == pytest.approx(0.0, abs=1e-15)
    assert pushed(c, state, 0.0)[2] == pytest.approx(-0.5 * (SPEED * math.sin(0.02)) ** 2)


def test_what_the_gap_leaves_room_for_is_no_turn_yet():
    """Room for all of the approach: nothing is struck, and the push is along the old plane."""
    delta = SPEED * normal(0.01)[0]
    c, _ = turned(0.01, target=2.0 * delta)
    assert (c.nx, c.ny, c.nz) == pytest.approx((0.0, 0.0, 1.0))
    assert c.target == pytest.approx(delta, rel=1e-6)


@pytest.mark.parametrize(("angle", "same"), [(0.40, True), (0.48, False), (1.2, False)])
def test_a_plane_that_turned_too_far_is_another_wall(angle, same):
    """The limit is a cosine of 0.9: 0.451 rad."""
    c, _ = turned(angle)
    assert ((c.nx, c.ny, c.nz) != tuple(normal(angle))) == same
    assert (c.turn != 0.0) == same


@pytest.mark.parametrize("how", [{"kind": TREE}, {"row": -1}, {"flat": 1.0}], ids=["a stem", "new", "flat"])
def test_only_loaded_ground_that_turned_is_turned(how):
    c, _ = turned(0.01, **how)
    assert (c.nx, c.ny, c.nz) == tuple(normal(0.01))
    assert (c.target, c.turn) == (0.0, 0.0)


def test_speed_along_a_plane_is_that_of_its_point_without_the_spin_about_the_axis():
    rng = np.random.default_rng(1)
    old = np.zeros(1, OLD_CONTACT).view(np.recarray)[0]
    for _ in range(20):
        state, n, r = rng.normal(size=16), rng.normal(size=3), rng.normal(size=3)
        state[13:16] /= np.linalg.norm(state[13:16])
        (old.nx, old.ny, old.nz), (old.rx, old.ry, old.rz) = n, r
        spin = state[10:13] - state[10:13] @ state[13:16] * state[13:16]
        assert plane_speed(old, state) == pytest.approx(n @ (state[7:10] + np.cross(spin, r)))


@pytest.mark.parametrize(("speed", "left"), [(0.0, 0.0), (-0.02, 0.5), (-0.04, 1.0), (-0.08, 1.0), (0.03, 0.0)])
def test_the_plane_that_is_kept_is_as_far_back_as_the_approach_is_left(speed, left):
    """The plane ahead, where all of the turn was taken; the one before, where all of it is left to the next step."""
    c = np.zeros(1, CONTACT).view(np.recarray)[0]
    c.turn = -0.04
    c.ahead_nx, c.ahead_ny, c.ahead_nz = 0.0, 0.0, 1.0
    c.from_nx, c.from_ny, c.from_nz = normal(0.2)
    c.ahead_rx, c.from_rx, c.from_rz = 1.0, 3.0, -1.0
    state = np.zeros(16)
    state[9], state[13] = speed, 1.0
    old = np.zeros(1, OLD_CONTACT).view(np.recarray)[0]
    remember_plane(old, c, state)
    between = (1.0 - left) * np.array([0.0, 0.0, 1.0]) + left * normal(0.2)
    between /= np.linalg.norm(between)
    assert (old.nx, old.ny, old.nz) == pytest.approx(tuple(between))
    assert (old.rx, old.ry, old.rz) == pytest.approx((1.0 + 2.0 * left, 0.0, -left))
    assert old.speed == pytest.approx(between @ state[7:10])
