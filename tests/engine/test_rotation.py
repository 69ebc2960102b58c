"""Free motion against the closed form of the symmetric top."""

import numpy as np
import pytest

from deadwood_engine.log_body import AXIAL, TRANSVERSE, cone_bodies
from deadwood_engine.rotation import (
    drift,
    kinetic_energy,
    quaternion_from_axis,
    set_axis,
    spin_of,
    square_to_axis,
    swing_of,
)


def top(diameter=0.75, length=30.0, spin_body=(1.0, 0.0, 20.0)):
    body = cone_bodies(np.array([diameter]), np.array([length]), np.array([300.0]))[0]
    state = np.zeros(16)
    state[3] = 1.0
    state[10:13] = spin_body  # the body frame is the world's at the start
    set_axis(state)
    return state, body[TRANSVERSE], body[AXIAL]


def momentum(state, transverse, axial):
    d, w = state[13:16], state[10:13]
    return transverse * w + (axial - transverse) * (w @ d) * d


@pytest.mark.parametrize("step", [1e-3, 1e-2, 0.1])
def test_precession_rate(step):
    """After pi A/|L| the axis has turned half way round L: d.d0 = 2 cos^2(beta) - 1 (docs/tests.md, T08)."""
    state, a, c = top()
    rate = np.linalg.norm(momentum(state, a, c)) / a
    assert rate == pytest.approx(1.00009767, abs=1e-8)
    time = np.pi / rate
    whole = int(time / step)
    for _ in range(whole):
        drift(state, a, c, step)
    drift(state, a, c, time - whole * step)
    assert state[15] == pytest.approx(-0.99960936, abs=1e-8)


def test_energy_and_momentum_stay():
    """1e5 steps: rounding of 1e-16 a step may add up to 1e-11 when every step errs the same way."""
    state, a, c = top()
    energy, before = kinetic_energy(state, a, c), momentum(state, a, c)
    for _ in range(100_000):
        drift(state, a, c, 0.01)
    assert kinetic_energy(state, a, c) == pytest.approx(energy, rel=1e-11)
    assert np.linalg.norm(momentum(state, a, c) - before) < 1e-10 * np.linalg.norm(before)
    assert np.linalg.norm(state[3:7]) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize(("diameter", "length", "w3"), [(0.75, 30.0, 0.1), (0.30, 15.0, 100.0), (0.75, 0.4, 5.0)])
def test_tumbling_does_not_become_spin(diameter, length, w3):
    """The published 2014 scheme turns w3 = 0.1 into 36 rad/s in 5 s (T10); also fast spin (T11), oblate (T12)."""
    state, a, c = top(diameter, length, (1.0, 0.0, w3))
    energy = kinetic_energy(state, a, c)
    for _ in range(500):
        drift(state, a, c, 0.01)
    assert state[10:13] @ state[13:16] == pytest.approx(w3, abs=1e-10)
    assert kinetic_energy(state, a, c) == pytest.approx(energy, rel=1e-11)


def test_flight_is_reversible():
    state, a, c = top(spin_body=(0.3, -2.0, 7.0))
    state[7:10] = (3.0, 4.0, 5.0)
    before = state.copy()
    for _ in range(100):
        drift(state, a, c, 0.013)
    for _ in range(100):
        drift(state, a, c, -0.013)
    assert state == pytest.approx(before, abs=1e-12)


def test_body_frame_turns_with_the_spin():
    """Pure spin about the axis turns the body frame by w3 t: the quaternion is (cos, 0, 0, sin) of half of it."""
    state, a, c = top(spin_body=(0.0, 0.0, 2.0))
    drift(state, a, c, 0.4)
    assert state[3:7] == pytest.approx((np.cos(0.4), 0, 0, np.sin(0.4)), abs=1e-15)


def test_still_log_stays():
    state, a, c = top(spin_body=(0.0, 0.0, 0.0))
    before = state.copy()
    drift(state, a, c, 1.0)
    assert np.array_equal(state, before)


def test_quaternions_point_the_axis():
    axes = np.array([[0, 0, 1], [0, 0, -1], [1, 0, 0], [0.6, 0, -0.8], [-0.36, 0.48, 0.8]], float)
    for axis, quaternion in zip(axes, quaternion_from_axis(axes), strict=True):
        state = np.zeros(16)
        state[3:7] = quaternion
        set_axis(state)
        assert state[13:16] == pytest.approx(axis, abs=1e-15)


def test_what_turns_the_axis_and_what_does_not():
    """w = (w.d) d + d x (w x d), and what is square to d has no part along it; of random axes, to rounding."""
    rng = np.random.default_rng(3)
    for axis, w, a in rng.standard_normal((20, 3, 3)):
        state = np.zeros(16)
        state[10:13], state[13:16] = w, axis / np.linalg.norm(axis)
        d = state[13:16]
        assert spin_of(state) * d + np.cross(d, swing_of(state)) == pytest.approx(w, abs=1e-14)
        square = np.array(square_to_axis(state, a))
        assert square @ d == pytest.approx(0.0, abs=1e-15)
        assert np.cross(d, square) == pytest.approx(np.cross(d, a), abs=1e-14)
