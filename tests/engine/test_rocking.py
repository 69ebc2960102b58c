"""A log that rocks in place, by the boxes of made-up motions (in a real hollow: tests/physics/test_sliding.py)."""

import math

import numpy as np
import pytest

from deadwood_engine.limits import ROCKING_RANGE, ROCKING_WINDOW
from deadwood_engine.log_body import cone_bodies
from deadwood_engine.rocking import ROCKING_WIDTH, WINDOWS, forget_windows, rocks_in_place, watch

REST_SPEED = 0.1  # the default
TIMES = np.arange(0.0, 60.0, 0.05)


def decided(place, energy):
    """Time [s] at which a log whose centre moves so, and whose energy is so, counts as rocking; None for never."""
    body = cone_bodies(np.array([0.4]), np.array([9.0]), np.array([500.0]))[0]
    windows, state, next_look = np.zeros((WINDOWS, ROCKING_WIDTH)), np.zeros(16), ROCKING_WINDOW
    forget_windows(windows)
    state[13] = 1.0
    for t in TIMES:
        state[0] = place(t)
        watch(windows, state, body, energy(t), REST_SPEED)
        if t >= next_look:
            if rocks_in_place(windows, REST_SPEED):
                return t
            next_look = t + ROCKING_WINDOW
    return None


def swing(period, size, drift=0.0, decay=0.0):
    """A swing about a place that drifts [m/s], of an amplitude [m] that decays [1/s]: (place, energy) of the time."""
    rate = 2.0 * math.pi / period

    def place(t):
        return size * math.exp(-decay * t) * math.cos(rate * t) + drift * t

    def energy(t):
        return 0.5 * (rate * size * math.exp(-decay * t) * math.sin(rate * t)) ** 2

    return place, energy


@pytest.mark.parametrize(("period", "size"), [(1.0, 0.1), (2.4, 0.3), (4.0, 0.3), (7.0, 0.3)])
def test_a_swing_is_known_when_the_last_window_shows_nothing_new(period, size):
    """Three windows of slow motion have seen all of a swing that takes no longer; the fourth shows nothing new."""
    assert decided(*swing(period, size, decay=0.01)) == pytest.approx(WINDOWS * ROCKING_WINDOW, abs=0.2)


def test_what_does_not_lessen_is_known_too():
    assert decided(*swing(2.4, 0.3)) is not None


@pytest.mark.parametrize(
    ("place", "energy"),
    [
        swing(2.4, 0.3, drift=0.01),  # creeps on, swing by swing
        (lambda t: 0.01 * t, lambda t: 0.5 * 0.01**2),  # slides on, slowly
        swing(2.4, 0.3, decay=-0.01),  # gains
        (lambda t: 1e-4 * math.exp(0.4 * t), lambda t: 0.5 * (4e-5 * math.exp(0.4 * t)) ** 2),  # topples
        swing(2.4, 0.55 * ROCKING_RANGE, decay=0.0001),  # swings too far for a place
        swing(1.5, 0.45),  # is too fast: 1.9 m/s
    ],
    ids=["creeps", "slides", "gains", "topples", "far", "fast"],
)
def test_what_continues_is_never_called_rocking(place, energy):
    assert decided(place, energy) is None


def test_a_slower_creep_is_within_what_a_place_means():
    """Half the speed that is allowed: 3 cm a minute."""
    assert decided(*swing(2.4, 0.3, drift=0.0005)) is not None


def test_a_fast_window_reports_nothing_about_where_a_log_stays():
    """The observation starts again: the slow turning point of a wide oscillation does not count as a place."""
    place, energy = swing(1.0, 0.1)
    fast_until = 10.0
    found = decided(place, lambda t: 100.0 if t < fast_until else energy(t))
    assert found == pytest.approx(fast_until + WINDOWS * ROCKING_WINDOW, abs=0.3)
