"""The ruler of a step: the work that its contacts did, and the mend where an unfinished solve did too much."""

from __future__ import annotations

from .compiled import kernel
from .contacts import along_normal, along_t, along_u
from .rolling import rolling_work
from .rotation import VX


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
    """Eq. [f]: work of the contact impulses, and of the moment against rolling, per mass [J/kg].

    motion[at:at + 6] are the velocities after [m/s, rad/s], spin [1/s] that about the axis; fall [m/s] is what gravity
    has already added to them for the time after the node.
    """
    work = rolling_work(rolling, spin)
    for k in range(count):
        if contacts_table[k].pn > 0.0:
            work += contact_work(contacts_table[k], motion, at, fall)
    return work


@kernel
def take_no_energy(contacts_table, count, state, free, gained, fall, rolling):
    """Scale the impulses of an unfinished solve so that they do no positive work; returns the work left.

    A jam between opposed normals (unbounded inner force) can hit the cap with impulses that do not fit each other and
    push. Scaled by f, they do the work f a + f^2 b, with a + b = gained and a that of their infinitesimal part.
    """
    a = impulse_work(contacts_table, count, free, 0, fall, rolling, rolling.spin_before)
    b = gained - a
    share = max(0.0, -a / b) if b > 0.0 else 0.0
    for k in range(count):
        c = contacts_table[k]
        c.pn, c.pt, c.pu = share * c.pn, share * c.pt, share * c.pu
    rolling.moment *= share
    for k in range(6):
        state[VX + k] = free[k] + share * (state[VX + k] - free[k])
    return share * (a + share * b)
