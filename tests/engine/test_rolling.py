"""The one moment against rolling by itself: what it is clipped to, what it turns, and its work."""

import numpy as np
import pytest

from deadwood_engine.contacts import CONTACT
from deadwood_engine.rolling import ROLLING, rolling_work, start_rolling
from deadwood_engine.rotation import spin_of

INERTIA = 0.08  # [m2]
AXIS = np.array([0.6, 0.0, 0.8])


def state_of(spin, across=0.0):
    """A log that turns about its axis, and across it."""
    state = np.zeros(16)
    state[13:16] = AXIS
    state[10:13] = spin * AXIS + across * np.array([0.8, 0.0, -0.6]) + across * np.array([0.0, 1.0, 0.0])
    return state


def started(before, ratio, state):
    """``start_rolling`` on three contacts: 0.03 m of 10 m/s, 0.01 m of 5 m/s, and one that resists nothing."""
    table = np.zeros(3, CONTACT).view(np.recarray)
    table["roll"], table["pn"] = (0.03, 0.01, 0.0), (10.0, 5.0, 7.0)
    rolling = np.array([(9.9, before, 9.9, INERTIA, 1.0)], ROLLING).view(np.recarray)[0]
    start_rolling(rolling, table, 3, state, ratio)
    return rolling.moment


def test_spin_is_the_part_about_the_axis():
    assert spin_of(state_of(3.0, across=5.0)) == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("before", "ratio", "moment"),
    [(0.2, 0.5, 0.1), (-0.2, 0.5, -0.1), (2.0, 1.0, 0.35), (-2.0, 1.0, -0.35), (2.0, 0.0, 0.0)],
)
def test_it_starts_from_the_step_before_within_what_the_contacts_allow(before, ratio, moment):
    """c sum(a_k P_k) = 0.03 x 10 + 0.01 x 5 = 0.35 m2/s at most, either way; it turns the log about its axis alone."""
    state = state_of(2.0, across=1.0)
    still = state.copy()
    assert started(before, ratio, state) == pytest.approx(moment)
    assert state[10:13] == pytest.approx(still[10:13] + moment / INERTIA * AXIS)
    assert np.array_equal(np.delete(state, [10, 11, 12]), np.delete(still, [10, 11, 12]))


def test_its_work_is_the_change_of_the_energy_of_the_spin():
    for spin, moment in ((4.0, -0.1), (4.0, -0.5), (-1.0, 0.3), (0.0, 0.2)):
        after = spin + moment / INERTIA
        rolling = np.array([(moment, 0.0, spin, INERTIA, 1.0)], ROLLING).view(np.recarray)[0]
        assert rolling_work(rolling, after) == pytest.approx(0.5 * INERTIA * (after**2 - spin**2))
