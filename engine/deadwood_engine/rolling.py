"""Rolling friction: compliant ground resists a log that rolls over it.

A rigid cone on rigid ground rolls for ever. Ground that yields by z below a roller of diameter D shifts the resultant
of its pressure ahead of the lowest point, by about c a with c = sqrt(z / D): the classical moment c a P_N about the
axis, against the spin, set-valued like Coulomb's law (Johnson 1985, section 8; Leine & Nijmeijer 2004, section 5.3):

    M = -c sum(a_k P_k) sign(spin), or any value in between where the log does not spin about its axis

a_k is the distance of ground contact k from the axis. All contacts turn the same body about the same axis, so one
moment is enough: one scalar of the solver, clipped, updated in every sweep. On a plane a log across the slope rests
where c > tan(slope). A body given as a point cloud rolls over its vertices, which is its rolling resistance.
"""

from __future__ import annotations

import numpy as np

from .compiled import kernel
from .rotation import DX, DY, DZ, WX, WY, WZ

# The one moment, per mass
ROLLING = np.dtype(
    [
        ("moment", "f8"),
        ("moment_before", "f8"),  # m2/s, its impulse, and that of the previous step
        ("spin_before", "f8"),  # 1/s, before the solve
        ("inertia", "f8"),  # m2, of the log about its axis
        ("skin", "f8"),  # m, lever arm that converts the spin to a velocity
    ]
)


@kernel
def start_rolling(rolling, contacts, count, state, ratio):
    """Eq. [l]: start from the previous step's moment, as contacts do (``contact_solver.warm_start``), after them."""
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
    """Work of the moment per mass [J/kg]; the spin after the solve [1/s]."""
    return 0.5 * rolling.moment * (rolling.spin_before + spin)
