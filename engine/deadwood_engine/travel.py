"""How far a body can get in free motion: the length of a step, and the sleep of rings and obstacles, rely on it."""

from __future__ import annotations

import math

from .compiled import kernel
from .log_body import AXIAL, BASE_RADIUS, CENTRE, LENGTH, REACH, TRANSVERSE
from .rotation import VX, VY, VZ, WX, WY, WZ, spin_of, swing_of


@kernel
def fastest_point(state, body):
    """Bound of the speed of the body's fastest point [m/s]."""
    along = spin_of(state)
    spin = state[WX] ** 2 + state[WY] ** 2 + state[WZ] ** 2
    across = math.sqrt(max(0.0, spin - along * along))
    arm = max(body[CENTRE], body[LENGTH] - body[CENTRE], body[REACH])
    speed = math.sqrt(state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2)
    return speed + across * arm + abs(along) * body[BASE_RADIUS]


@kernel
def travel_bound(cloud, state, body):
    """(speed, bend, roll): without gravity a body gets no farther in a time t than speed t + bend t^2 / 2 [m/s, m/s2].

    A log is round: where it is, its axis says, and of that an end moves most. The ends' velocity turns with the axis
    about the angular momentum. Its roll [m/s] moves only its skin. Of a cloud every point counts.
    """
    if cloud is not None:
        return fastest_point(state, body), 0.0, 0.0
    ux, uy, uz = swing_of(state)
    along = spin_of(state)
    vx, vy, vz = state[VX], state[VY], state[VZ]
    back, front = -body[CENTRE], body[LENGTH] - body[CENTRE]
    base = (vx + back * ux) ** 2 + (vy + back * uy) ** 2 + (vz + back * uz) ** 2
    tip = (vx + front * ux) ** 2 + (vy + front * uy) ** 2 + (vz + front * uz) ** 2
    turn, spin = ux * ux + uy * uy + uz * uz, body[AXIAL] / body[TRANSVERSE] * along
    bend = max(-back, front) * math.sqrt(turn * (turn + spin * spin))
    return math.sqrt(max(base, tip)), bend, abs(along) * body[BASE_RADIUS]
