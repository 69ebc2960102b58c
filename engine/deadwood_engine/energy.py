"""The energy balance of a step: the work of its contacts (``impacts`` corrects contacts that did too much)."""

from __future__ import annotations

from .compiled import kernel
from .contacts import along_normal, along_t, along_u
from .rolling import rolling_work


@kernel
def contact_work(c, motion, at, fall):
    """Work of one contact's impulse per mass [J/kg]: the mean of the velocities before and after, times the impulse."""
    v = (motion[at], motion[at + 1], motion[at + 2] + fall)
    w = (motion[at + 3], motion[at + 4], motion[at + 5])
    return 0.5 * (
        c.pn * (along_normal(c, v, w) + c.before_n)
        + c.pt * (along_t(c, v, w) + c.before_t)
        + c.pu * (along_u(c, v, w) + c.before_u)
    )


@kernel
def impulse_work(contacts_table, count, motion, at, fall, rolling, spin):
    """Eq. [f]: work of the contact impulses, and of the moment that resists rolling, per mass [J/kg].

    motion[at:at + 6] are the velocities after the impulses [m/s, rad/s], spin [1/s] that about the axis; fall [m/s] is
    the velocity that gravity has already added to them for the time after the node.
    """
    work = rolling_work(rolling, spin)
    for k in range(count):
        if contacts_table[k].pn > 0.0:
            work += contact_work(contacts_table[k], motion, at, fall)
    return work
