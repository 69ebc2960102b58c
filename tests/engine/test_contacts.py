"""Records of the contact table: their fields mean the same in compiled kernels and in Python."""

import numpy as np
import pytest

from deadwood_engine.contacts import CONTACT, OLD_CONTACT, Ahead, Found, first_strike, touch_time
from deadwood_engine.cores import CORE
from deadwood_engine.rolling import ROLLING
from deadwood_engine.scratch import Scratch
from deadwood_engine.way import SUMMARY, WAY


@pytest.mark.parametrize("kind", [CONTACT, OLD_CONTACT, CORE, ROLLING, SUMMARY, WAY])
def test_no_field_hides_behind_a_method(kind):
    """In Python a record's own methods come before its fields: ``c.any`` would be a function, not a lever."""
    assert not set(kind.names) & set(dir(np.record))


def test_a_worker_has_contacts_as_records():
    scratch = Scratch.allocate(8, 3, 1, None)
    for table, kind in ((scratch.contacts, CONTACT), (scratch.old_contacts, OLD_CONTACT), (scratch.spare, CONTACT)):
        assert isinstance(table, np.recarray)
        assert table.dtype.fields == kind.fields
    assert len(scratch.spare) == 1


@pytest.mark.parametrize("dt", [0.002, 0.01, 0.03])
@pytest.mark.parametrize("gap", [-0.01, 0.0, 2e-5, 3e-4, 7e-4, 0.02])
def test_a_gap_counts_as_closed_that_gravity_closes_in_the_step_but_half_a_millimetre_at_most(plain, gap, dt):
    """A log at rest in level ground's pose at the step's end: it may come down by the gap less g dt^2 / 2, or 0.5 mm.

    At 30 ms gravity falls 4.4 mm, and a log that may fall so much no more would lie on air by as much.
    """
    gravity = 9.81
    scratch = Scratch.allocate(8, 3, 1, None)
    state = np.zeros(16)
    state[13] = 1.0
    step = Ahead(dt, gravity, dt, 0.0, 0.4, 0.0)
    ahead = gap - 0.5 * gravity * dt * dt  # of the pose of ``step``, to which gravity alone has moved it
    count = plain("contacts").add_contact(
        scratch.contacts,
        scratch.keys,
        0,
        state,
        Found((0, 0, 0), (0.0, 0.0, -0.3), (0.0, 0.0, 1.0), ahead, 0.4),
        step,
        True,
    )
    assert count == 1
    contact = scratch.contacts[0]
    assert contact.gap == pytest.approx(gap, abs=1e-15)
    left = gap - min(0.5 * gravity * dt**2, 0.0005)
    assert contact.target == pytest.approx(-max(left, 0.0) / dt, abs=1e-12)


@pytest.mark.parametrize(
    ("room", "speed", "nz", "gravity"), [(0.3, -2.0, 1.0, 9.81), (0.3, -2.0, 0.6, 9.81), (0.1, -5.0, 0.9, 0.0)]
)
def test_a_point_touches_its_plane_when_it_has_fallen_through_the_room(room, speed, nz, gravity):
    c = np.zeros(1, CONTACT).view(np.recarray)
    c.room, c.before_n, c.nz = room, speed, nz
    t = touch_time(c[0], gravity)
    assert speed * t - 0.5 * gravity * nz * t * t == pytest.approx(-room, rel=1e-12)
    c.room = -0.01
    assert touch_time(c[0], gravity) == 0.0


def test_the_first_strike_is_of_the_contacts_that_close_fast():
    c = np.zeros(3, CONTACT).view(np.recarray)
    c.nz, c.room, c.before_n = 1.0, (0.01, 0.2, 0.1), (-0.4, -4.0, -1.0)
    assert first_strike(c, 3, 0.0, 0.5) == pytest.approx(0.05)
    assert first_strike(c, 3, 0.0, 0.3) == pytest.approx(0.025)
    assert first_strike(c, 3, 0.0, 5.0) == np.inf
    assert first_strike(c, 0, 0.0, 0.0) == np.inf
