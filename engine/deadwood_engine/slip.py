"""Friction that grows with slip: ground scarred by a rock resists it the more, the longer its path in it.

The law of Leine et al. (2014; Multibody System Dynamics 32:241-271, section 3.7, equations 46 and 47) for rocks, with
one state variable per body, the slip s:

    mu(s) = mu_min + (2 / pi) (mu_max - mu_min) atan(kappa s)                                        [p]
    ds/dt = |v| while at least one contact with the ground is loaded,   ds/dt = -beta s otherwise

v is the velocity of the centre of mass, so s also grows while a body rolls. mu_min is the coefficient of the ground; if
it exceeds mu_max, friction does not grow. At s = 1/kappa friction is halfway to mu_max.

mu of a step is that of s at its node, and s is advanced with the velocity at the middle of the step, as positions are:
a leapfrog of second order. In the air s decays exactly. Slip applies only to point clouds, and only to contacts with
the terrain.

symbol      in code         unit
s           slip            m
kappa       friction_kappa  1/m; 0: friction does not depend on slip
beta        friction_beta   1/s
"""

from __future__ import annotations

import math

from .compiled import kernel
from .contacts import TERRAIN
from .rotation import VX, VY, VZ


@kernel
def scarred(mu, most, kappa, slip):
    """Eq. [p]: Coulomb's coefficient [-] after a slip [m]; mu, most : mu_min and mu_max."""
    if kappa == 0.0:
        return mu
    return mu + 2.0 / math.pi * max(0.0, most - mu) * math.atan(kappa * slip)


@kernel
def slip_after(contacts, keys, count, state, slip, beta, dt):
    """The slip [m] at the end of a step whose velocities are in ``state``."""
    for k in range(count):
        if keys[k, 0] == TERRAIN and contacts[k].pn > 0.0:
            return slip + dt * math.sqrt(state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2)
    return slip * math.exp(-beta * dt)
