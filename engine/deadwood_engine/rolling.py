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

from .compiled import kernel
from .contacts import PN, ROLL
from .rotation import DX, DY, DZ, WX, WY, WZ

# The table of the one moment, per mass: its impulse [m2/s], that of the step before, the spin before the solve [1/s],
# the log's moment of inertia about its axis [m2], the distance that the spin counts for as a velocity [m]
MOMENT, MOMENT_BEFORE, SPIN_BEFORE, INERTIA, SKIN, ROLLING_WIDTH = range(6)


@kernel
def spin_of(state):
    """Spin about the axis [1/s]."""
    return state[WX] * state[DX] + state[WY] * state[DY] + state[WZ] * state[DZ]


@kernel
def start_rolling(rolling, contacts, count, state, ratio):
    """Start from the moment of the step before, as the contacts do (``contact_solver.warm_start``), after them."""
    most = 0.0
    for k in range(count):
        most += contacts[k, ROLL] * contacts[k, PN]
    moment = min(most, max(-most, ratio * rolling[MOMENT_BEFORE]))
    rolling[MOMENT] = moment
    turn = moment / rolling[INERTIA]
    state[WX] += turn * state[DX]
    state[WY] += turn * state[DY]
    state[WZ] += turn * state[DZ]


@kernel
def rolling_work(rolling, spin):
    """Work of the moment per mass [J/kg], the spin after the solve [1/s]."""
    return 0.5 * rolling[MOMENT] * (rolling[SPIN_BEFORE] + spin)
