"""The energy balance of a step: the work of its contacts (``impacts`` corrects contacts that did too much)."""

from __future__ import annotations

from .compiled import kernel
from .contacts import along_normal, along_t, along_u
from .rolling import rolling_work
from .rotation import VX, VY, VZ, WX, WY, WZ, spin_of


@kernel
def contact_work(c, state, fall):
    """Work of one contact's impulse per mass [J/kg]: P . (gamma- + gamma+) / 2, velocities before and after it.

    fall : [m/s] due to gravity since the node, already in the state
    """
    v = (state[VX], state[VY], state[VZ] + fall)
    w = (state[WX], state[WY], state[WZ])
    return 0.5 * (
        c.pn * (along_normal(c, v, w) + c.before_n)
        + c.pt * (along_t(c, v, w) + c.before_t)
        + c.pu * (along_u(c, v, w) + c.before_u)
    )


@kernel
def impulse_work(contacts, count, state, rolling, fall):
    """Eq. [f]: work of the contact impulses, and of the moment that resists rolling, per mass [J/kg]:
    sum P_k . (gamma_k- + gamma_k+) / 2 + M (spin- + spin+) / 2.

    state : after the impulses; fall : as in ``contact_work``
    """
    work = rolling_work(rolling, spin_of(state))
    for k in range(count):
        if contacts[k].pn > 0.0:
            work += contact_work(contacts[k], state, fall)
    return work
