"""Friction that grows with slip: ground that a rock scars resists it the more, the farther it has slid in it.

The law of Leine et al. (2014; Multibody System Dynamics 32:241-271) for rocks, with one state a body, the slip s. That
it is theirs was read in the paper's abstract; its form is from memory, not checked against the paper:

    mu(s) = mu_min + (2 / pi) (mu_max - mu_min) atan(kappa s)                                        [p]
    ds/dt = |v_s| in contact with the ground,   ds/dt = -beta s in the air

mu_min is the ground's coefficient, and where that is more than mu_max it does not grow; at s = 1/kappa friction is
halfway to mu_max. A body has the mean slip speed of its ground contacts, each with its share of their normal impulse:
whatever the number of points on which it slides.

mu of a step is that of s at its node, and s goes on by the velocity of its middle, as positions do: a leapfrog of
second order. In the air s decays exactly. Only bodies of points (clouds) know slip, and only the terrain's contacts.

symbol      in code         unit
s           slip            m
kappa       friction_kappa  1/m; 0: friction does not depend on slip
beta        friction_beta   1/s
"""

from __future__ import annotations

import math

from .compiled import kernel
from .contacts import TERRAIN, along_t, along_u
from .rotation import VX, VY, VZ, WX, WY, WZ


@kernel
def scarred(mu, most, kappa, slip):
    """Eq. [p]: Coulomb's coefficient [-] after a slip [m]; mu, most : mu_min and mu_max."""
    if kappa == 0.0:
        return mu
    return mu + 2.0 / math.pi * max(0.0, most - mu) * math.atan(kappa * slip)


@kernel
def slip_after(contacts, keys, count, state, slip, beta, dt):
    """The slip [m] at the end of a step of which ``state`` has the velocities."""
    v, w = (state[VX], state[VY], state[VZ]), (state[WX], state[WY], state[WZ])
    push = sliding = 0.0
    for k in range(count):
        c = contacts[k]
        if keys[k, 0] == TERRAIN and c.pn > 0.0:
            push += c.pn
            sliding += c.pn * math.sqrt(along_t(c, v, w) ** 2 + along_u(c, v, w) ** 2)
    if push > 0.0:
        return slip + dt * sliding / push
    return slip * math.exp(-beta * dt)
