"""Free rotation with three different moments: invariants, order, the Dzhanibekov flip, the symmetric limit."""

import numpy as np
import pytest

from deadwood_engine.asymmetric_top import energy_of, first_axis, move_freely
from deadwood_engine.log_body import AXIAL, BODY_WIDTH, SKEW, TRANSVERSE
from deadwood_engine.rotation import set_axis

MOMENTS = (3.0, 2.0, 1.0)


def body_of(a1, a2, a3):
    body = np.zeros(BODY_WIDTH)
    body[TRANSVERSE], body[AXIAL], body[SKEW] = a2, a3, 1.0 / a1 - 1.0 / a2
    return body


def state_of(spin, seed=0):
    state = np.zeros(16)
    state[3:7] = np.random.default_rng(seed).normal(size=4)
    state[10:13] = spin
    set_axis(state)
    return state


def axes_of(state):
    e1, e3 = np.array(first_axis(state)), state[13:16]
    return np.column_stack([e1, np.cross(e3, e1), e3])


def momentum(state, moments):
    axes = axes_of(state)
    return axes @ (np.array(moments) * (axes.T @ state[10:13]))


@pytest.mark.parametrize("moments", [MOMENTS, (1.01, 1.0, 0.2), (50.0, 40.0, 0.1), (2.0, 3.0, 1.0)])
@pytest.mark.parametrize("spin", [(1, 2, 3), (0.1, -30, 5), (200, 100, 0)])
@pytest.mark.parametrize("dt", [1e-3, 0.02, 0.1])
def test_energy_and_momentum_are_kept(moments, spin, dt):
    """Two thousand steps: rounding is all that there is."""
    body, state = body_of(*moments), state_of(spin)
    energy, before = energy_of(state, body), momentum(state, moments)
    for _ in range(2000):
        move_freely(state, body, dt)
    assert energy_of(state, body) == pytest.approx(energy, rel=1e-11)
    assert momentum(state, moments) == pytest.approx(before, rel=0, abs=1e-11 * np.linalg.norm(before))
    assert np.linalg.norm(state[3:7]) == pytest.approx(1.0, abs=1e-14)


def jacobi(moments, momentum2, energy2):
    """Half the period of the spin between its extremes, in closed form (Landau and Lifshitz, Mechanics, section 37)."""
    integrate = pytest.importorskip("scipy.special")
    i1, i2, i3 = sorted(moments)
    if momentum2 > energy2 * i2:
        k2 = (i2 - i1) * (energy2 * i3 - momentum2) / ((i3 - i2) * (momentum2 - energy2 * i1))
        rate = np.sqrt((i3 - i2) * (momentum2 - energy2 * i1) / (i1 * i2 * i3))
    else:
        k2 = (i3 - i2) * (momentum2 - energy2 * i1) / ((i2 - i1) * (energy2 * i3 - momentum2))
        rate = np.sqrt((i2 - i1) * (energy2 * i3 - momentum2) / (i1 * i2 * i3))
    return 2.0 * integrate.ellipk(k2) / rate


@pytest.mark.parametrize("tilt", [1e-2, 1e-4])
def test_the_dzhanibekov_flip_comes_when_it_should(tilt):
    """Spun about the middle axis (e2), it tips over each half period 2 K(k) / rate of Jacobi's functions."""
    body, state = body_of(*MOMENTS), state_of((0, 0, 0))
    axes = axes_of(state)
    state[10:13] = axes @ np.array([tilt, 10.0, 0.0])
    spin = axes.T @ state[10:13]
    half = jacobi(MOMENTS, float(((np.array(MOMENTS) * spin) ** 2).sum()), float((np.array(MOMENTS) * spin**2).sum()))
    dt, flips, before = 1e-3, [], 1.0
    for k in range(int(4.6 * half / dt)):
        move_freely(state, body, dt)
        along = (axes_of(state).T @ state[10:13])[1]
        if along * before < 0:
            flips.append((k + 1) * dt)
        before = along
    # it starts at the extreme of w2, a quarter before the first zero
    assert len(flips) == 5
    assert np.diff(flips) == pytest.approx(half, rel=1e-4, abs=2 * dt)
    assert flips[0] == pytest.approx(0.5 * half, rel=1e-4, abs=2 * dt)


def test_the_order_is_four():
    """Halving the steps divides the error by sixteen; at the longest that TURN allows it is 2e-8 rad."""

    def after(number):
        body, state = body_of(*MOMENTS), state_of((0.09, 0.15, -0.075))  # so slow that each call is a single step
        for _ in range(number):
            move_freely(state, body, 1.0 / number)
        return state[3:7]

    exact = after(512)
    errors = [np.linalg.norm(after(number) - exact) for number in (2, 4, 8, 16)]
    assert errors[0] < 2e-8
    assert 13 < errors[1] / errors[2] < 19
    assert 13 < errors[2] / errors[3] < 19


def test_nearly_symmetric_is_the_symmetric_top():
    """With a1 - a2 of 1e-9 the closed form of ``rotation.drift`` comes out."""
    spin = (3.0, -8.0, 5.0)
    one, other = state_of(spin), state_of(spin)
    for _ in range(200):
        move_freely(one, body_of(2.0, 2.0, 0.5), 0.01)
        move_freely(other, body_of(2.0 + 1e-9, 2.0, 0.5), 0.01)
    assert other[3:7] == pytest.approx(one[3:7], abs=2e-6)
    assert other[10:13] == pytest.approx(one[10:13], abs=2e-5)
