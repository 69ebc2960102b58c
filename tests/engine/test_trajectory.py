"""A log from its release to its end: what it begins with, and what its energy lacks when it stops.

The kernels run as Python here; the results of slides are tested in tests/physics and tests/extremes.
"""

import numpy as np
import pytest
from level_ground import DT, LOG, WHERE, G, level_model

from deadwood_engine.asymmetric_top import energy_of
from deadwood_engine.limits import LEAST_SPENT
from deadwood_engine.rotation import set_axis
from deadwood_engine.scratch import Scratch
from deadwood_engine.surroundings import know_nothing
from deadwood_engine.way import SUMMARY, WAY


@pytest.fixture(scope="module")
def model():
    return level_model()


def flying(seed):
    rng = np.random.default_rng(seed)
    state = np.zeros(16)
    state[:3], state[3:7] = (20.0, 20.0, 9.0), rng.normal(size=4)
    set_axis(state)
    state[7:10], state[10:13] = 5.0 * rng.normal(size=3), rng.normal(size=3)
    return state


def test_every_number_of_a_state_must_be_one(plain):
    finite = plain("trajectory").is_finite
    assert finite(flying(0))
    for k in range(16):
        for value in (np.nan, np.inf, -np.inf):
            state = flying(0)
            state[k] = value
            with np.errstate(invalid="ignore"):
                assert not finite(state)


def test_no_book_of_the_log_before_stays_open(plain, model):
    """What ``begin`` leaves as it was is set in every step before it is read."""
    scratch = Scratch.allocate(9, len(model.cores.solid), 1, None)
    know_nothing(scratch.near[0])
    for name in WAY.names or ():
        scratch.way[0][name] = 77
    state, summary = flying(3), np.zeros(1, SUMMARY).view(np.recarray)[0]
    plain("trajectory").begin(model, WHERE, state, scratch, summary)
    left = {name for name in WAY.names or () if scratch.way[0][name] == 77}
    assert left == {"dt", "kick", "fall", "fastest", "bend", "residual", "tolerance", "count"}
    assert summary.started_in_contact == 0.0
    assert summary.speed_max == pytest.approx(np.linalg.norm(state[7:10]))
    state[:3] = 5.0, 5.0, 9.0  # in a stem
    plain("trajectory").begin(model, WHERE, state, scratch, summary)
    assert summary.started_in_contact == 1.0


def test_what_the_energy_balance_lacks_is_relative_to_what_there_was(plain):
    """Free fall for half of the last step from rest: nothing is lacking. 3 J/kg that no contact took are, and what
    contacts generated, of the height fallen so far.
    """
    state, way = flying(5), np.zeros(1, WAY).view(np.recarray)[0]
    energy, height, fall = plain("trajectory").energy_error, state[2], 0.5 * G * DT
    way.before = DT
    state[7:13] = 0.0
    at_node = state.copy()
    at_node[9] -= fall  # gravity's half of the step behind
    begun = energy_of(at_node, LOG) + G * height
    assert energy(way, state, LOG, G, begun, 0.0) == pytest.approx(0.0, abs=1e-12)
    assert state[9] == 0.0
    state[2] = height - 7.0
    way.work = -(begun - energy_of(at_node, LOG) - G * state[2]) + 3.0
    available = begun - G * state[2]
    assert available == pytest.approx(7.0 * G, abs=1e-2)
    assert energy(way, state, LOG, G, begun, 2.0) == pytest.approx(5.0 / available, rel=1e-12)
    way.work = 3.0
    state[2] = begun / G  # all of it is height: relative to a least energy, not to nothing
    lacking = 3.0 - energy_of(at_node, LOG)
    assert energy(way, state, LOG, G, begun, 0.0) == pytest.approx(lacking / LEAST_SPENT, rel=1e-9)
