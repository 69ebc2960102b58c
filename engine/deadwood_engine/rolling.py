"""Rolling friction: ground that gives resists a log that rolls over it.

A rigid cone on rigid ground rolls for ever. Ground that gives by z below a roller of diameter D puts the resultant of
its pressure ahead of the lowest point, by about c a with c = sqrt(z / D): the classic moment c a P_N about the axis,
against the spin, as set-valued as Coulomb's law (Johnson 1985, section 8; Leine & Nijmeijer 2004, section 5.3):

    M = -c sum(a_k P_k) sign(spin), or anything between where the log does not spin about its axis

a_k is how far the ground contact k is from the axis. All contacts turn the same body about the same axis, so one moment
serves them all: one scalar of the solver, clipped, renewed in every sweep. On a plane a log across the slope rests
where c > tan(slope). A body given as a point cloud rolls over its corners, which is its rolling friction.
"""

from __future__ import annotations

import numpy as np

from .compiled import kernel
from .rotation import DX, DY, DZ, WX, WY, WZ

# The one moment, per mass
ROLLING = np.dtype(
    [
        ("moment", "f8"), ("moment_before", "f8"),  # m2/s, its impulse, and that of the step before
        ("spin_before", "f8"),  # 1/s, before the solve
        ("inertia", "f8"),  # m2, of the log about its axis
        ("skin", "f8"),  # m, distance that the spin counts for as a velocity
    ]
)  # fmt: skip


@kernel
def start_rolling(rolling, contacts, count, state, ratio):
    """Eq. [l]: start from the moment of the step before, as contacts do (``contact_solver.warm_start``), after them."""
    most = 0.0
    for k in range(count):
        most += contacts[k].roll * contacts[k].pn
    moment = min(most, max(-most, ratio * rolling.moment_before))
    rolling.moment = moment
    turn = moment / rolling.inertia
    state[WX] += turn * state[DX]
    state[WY] += turn * state[DY]
    state[WZ] += turn * state[DZ]


@kernel
def rolling_work(rolling, spin):
    """Work of the moment per mass [J/kg], the spin after the solve [1/s]."""
    return 0.5 * rolling.moment * (rolling.spin_before + spin)
