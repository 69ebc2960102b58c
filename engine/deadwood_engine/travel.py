"""How far a body can move in free motion: the basis of the length of a step and of the inactivity of rings and
obstacles.
"""

from __future__ import annotations

import math

from .compiled import kernel
from .log_body import AXIAL, BASE_RADIUS, CENTRE, LENGTH, REACH, TRANSVERSE
from .rotation import VX, VY, VZ, WX, WY, WZ, spin_of, swing_of


@kernel
def fastest_point(state, body):
    """Upper bound of the speed of the body's fastest point [m/s]."""
    along = spin_of(state)
    spin = state[WX] ** 2 + state[WY] ** 2 + state[WZ] ** 2
    across = math.sqrt(max(0.0, spin - along * along))
    arm = max(body[CENTRE], body[LENGTH] - body[CENTRE], body[REACH])
    speed = math.sqrt(state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2)
    return speed + across * arm + abs(along) * body[BASE_RADIUS]


@kernel
def travel_bound(cloud, state, body):
    """(speed, bend): without gravity a body moves at most speed t + bend t^2 / 2 in a time t [m/s, m/s2].

    A log is round: its axis defines where it is, and the ends of the axis move fastest. The velocity of the ends turns
    with the axis about the angular momentum, and the rim of a face moves with the axis' turn, too, which is most of the
    motion of a disc. Its spin moves only its surface. For a cloud every point counts.
    """
    if cloud is not None:
        return fastest_point(state, body), 0.0
    ux, uy, uz = swing_of(state)
    along = spin_of(state)
    vx, vy, vz = state[VX], state[VY], state[VZ]
    back, front = -body[CENTRE], body[LENGTH] - body[CENTRE]
    base = (vx + back * ux) ** 2 + (vy + back * uy) ** 2 + (vz + back * uz) ** 2
    tip = (vx + front * ux) ** 2 + (vy + front * uy) ** 2 + (vz + front * uz) ** 2
    turn, spin = ux * ux + uy * uy + uz * uz, body[AXIAL] / body[TRANSVERSE] * along
    bend = max(-back, front) * math.sqrt(turn * (turn + spin * spin))
    return math.sqrt(max(base, tip)) + math.sqrt(turn) * body[BASE_RADIUS], bend
