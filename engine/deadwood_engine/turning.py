"""Ground contacts whose plane turns from one step to the next: what bears the log's weight does no work.

A push works with the mean of the velocities before and after the step. Where the plane w0 = (n, r x n) that a contact
moves along has turned to w1, the log approaches w1 by -delta = -v.(w1 - w0), and a push P along w1 works P delta / 2.
Of P, the blow alone may do that: it takes delta^2 / (2 G), as an inelastic kink does. The rest bears the weight, square
to the log's way. All of it along w1, a log that rocks in a hollow loses g dt delta / 2 at every turn: at 15 ms a log
that swings in a smooth hollow for 40 s kept 70 % of its height, where the kinks of the DEM leave 94 %. So the push is
along

    w = (1 - share) w0 + share w1,    share = (1 + blow) / 2,    blow = -delta / (g dt n_z - delta),

with a target that keeps the log from w1 just the same. A blow without weight is along w1. Over convex ground
(delta > 0) there is no blow while the weight holds the log down. Where a gap lets the log keep part of its approach,
``left``, to the next step, that part has not turned yet, and the plane that it moves along by then is one between both.
"""

from __future__ import annotations

import math

from .compiled import inlined, kernel
from .contacts import (
    BEFORE_N,
    FROM_N,
    FROM_R,
    NX,
    NZ,
    OLD_N,
    OLD_R,
    OLD_ROW,
    OLD_SPEED,
    PLANE_N,
    PLANE_R,
    RX,
    TARGET,
    TERRAIN,
    TURN,
    set_normal,
)
from .rotation import DX, VX, WX
from .vectors import cross


@kernel
def plane_speed(old, state):
    """Velocity [m/s] of the log along the normal of an old plane, at its point."""
    n, r = old[OLD_N : OLD_N + 3], old[OLD_R : OLD_R + 3]
    ax, ay, az = cross(r[0], r[1], r[2], n[0], n[1], n[2])
    k = ax * state[DX] + ay * state[DX + 1] + az * state[DX + 2]
    ax, ay, az = ax - k * state[DX], ay - k * state[DX + 1], az - k * state[DX + 2]
    straight = n[0] * state[VX] + n[1] * state[VX + 1] + n[2] * state[VX + 2]
    return straight + ax * state[WX] + ay * state[WX + 1] + az * state[WX + 2]


@kernel
def unit_normal(row, at):
    """Give row[at:at + 3] the length 1."""
    scale = 1.0 / math.sqrt(row[at] ** 2 + row[at + 1] ** 2 + row[at + 2] ** 2)
    for q in range(3):
        row[at + q] *= scale


@kernel
def remember_plane(old, c, state):
    """Keep the plane that the log moves along after this step, and its speed along the normal.

    That is the plane ahead, or one between that and the last where the gap left part of the approach to the next step.
    """
    for q in range(3):
        old[OLD_N + q], old[OLD_R + q] = c[PLANE_N + q], c[PLANE_R + q]
    speed = plane_speed(old, state)
    if c[TURN] != 0.0:
        left = min(1.0, max(0.0, speed / c[TURN]))
        for q in range(3):
            old[OLD_N + q] += left * (c[FROM_N + q] - c[PLANE_N + q])
            old[OLD_R + q] += left * (c[FROM_R + q] - c[PLANE_R + q])
        unit_normal(old, OLD_N)
        speed = plane_speed(old, state)
    old[OLD_SPEED] = speed


@inlined
def turn_contacts(contacts, keys, count, state, old_contacts, kick, fall, flat):
    """Push along the plane between the last step's and the one ahead, where a ground contact of both is loaded.

    kick : [m/s] of gravity in this step; fall : [m/s] the part of it that the velocities hold already
    flat : [m/s] smaller turns are none
    """
    for k in range(count):
        c = contacts[k]
        target = c[TARGET]
        if keys[k, 0] != TERRAIN or c[OLD_ROW] < 0.0 or target > 0.0:
            continue
        old = old_contacts[int(c[OLD_ROW])]
        delta = c[BEFORE_N] + fall * c[NZ] - old[OLD_SPEED]
        size = abs(delta)
        if size <= flat:
            continue
        left = max(target, -size)  # what the gap ahead has room for
        taken = left - delta
        blow = taken / (kick * c[NZ] + taken) if taken > 0.0 else 0.0
        share = min(1.0, max(0.0, 0.5 * (1.0 + blow - (1.0 - blow) * left / delta)))
        c[TURN] = delta
        for q in range(3):
            c[FROM_N + q], c[FROM_R + q] = old[OLD_N + q], old[OLD_R + q]
            c[NX + q] = (1.0 - share) * old[OLD_N + q] + share * c[NX + q]
            c[RX + q] = (1.0 - share) * old[OLD_R + q] + share * c[RX + q]
        unit_normal(c, NX)
        set_normal(c, state, True)
        c[TARGET] = target - (1.0 - share) * delta
