"""The pressure along a line of contacts: what no rigid body says, and friction needs to know.

A log on a plane touches along a line. Its weight and the moment of that say how much the line bears, and where the
middle of it lies, N = sum P_k and sum s_k P_k; how it is spread they do not say, but friction's moment against turning
hangs on it. Ground that gives bears in proportion to how deep the log lies in it: the pressure changes linearly along
the line, and is nowhere below zero. However hard the ground, that is what is left of it.

So before a sweep of the solver the normal impulses of a line are spread linearly, with their sum and their moment as
they are [m]. On a straight line that moves no velocity; where it is not quite straight, what it moves is put to the
velocities. Each contact bears for the stretch of the line that is nearest to it, so how many rings there are does not
matter. Two contacts are no matter of choice: a line has three at least, that push the same way and may move as one.
"""

from __future__ import annotations

import math

from .compiled import inlined, kernel
from .limits import LINE_BEND, LINE_STEP, LINE_TURN
from .rotation import DX, DY, DZ, VX, VY, VZ, WX, WY, WZ


@kernel
def _in_line(a, b, last, c, tolerance):
    """Whether contact c lies on the straight line through a and b, beyond ``last``, and pushes and may move as they do.

    By the normals' levers: where across the line a round log is pushed changes none of its velocities.
    """
    between = b.along - a.along
    if abs(between) < LINE_STEP or (c.along - last.along) * math.copysign(1.0, between) < LINE_STEP:
        return False  # points of one ring or face, or of another line
    tx, ty, tz = c.nx - a.nx, c.ny - a.ny, c.nz - a.nz
    if tx * tx + ty * ty + tz * tz > LINE_TURN * LINE_TURN:
        return False
    share = (c.along - a.along) / between
    if abs(c.target - a.target - share * (b.target - a.target)) > tolerance:
        return False
    x = c.rnx - a.rnx - share * (b.rnx - a.rnx)
    y = c.rny - a.rny - share * (b.rny - a.rny)
    z = c.rnz - a.rnz - share * (b.rnz - a.rnz)
    return x * x + y * y + z * z <= LINE_BEND * LINE_BEND


@kernel
def join_lines(contacts, count, state, tolerance):
    """Find runs of three or more contacts on one line, and make each exactly one; returns whether there is one.

    How many there are stands in ``line`` of the first. Their normals, levers and targets become those of the line
    through the first and the last: by the rounding of the DEM's heights they contradict each other, and a solver that
    spreads the pressure finds no end among contradictions. To be called before ``contacts.set_frames``.
    tolerance : [m/s] of the solve; what the contacts leave room for differs by less from one line
    """
    dx, dy, dz = state[DX], state[DY], state[DZ]
    vx, vy, vz, wx, wy, wz = state[VX], state[VY], state[VZ], state[WX], state[WY], state[WZ]
    for k in range(count):
        c = contacts[k]
        c.line = 0
        c.along = c.rx * dx + c.ry * dy + c.rz * dz
    found, first = False, 0
    while first + 2 < count:
        after = first  # of the run
        a, b = contacts[first], contacts[first + 1]
        if _in_line(a, contacts[first + 2], a, b, tolerance):
            after = first + 2
            while after < count and _in_line(a, b, contacts[after - 1], contacts[after], tolerance):
                after += 1
        if after - first < 3:
            first += 1
            continue
        found = True
        a.line = after - first
        b = contacts[after - 1]
        nx, ny, nz = a.nx, a.ny, a.nz
        ax, ay, az, bx, by, bz = a.rnx, a.rny, a.rnz, b.rnx - a.rnx, b.rny - a.rny, b.rnz - a.rnz
        target, more = a.target, b.target - a.target
        for k in range(first, after):
            low, high = max(k - 1, first), min(k + 1, after - 1)
            c = contacts[k]
            c.stretch = 0.5 * abs(contacts[high].along - contacts[low].along)
            share = (c.along - a.along) / (b.along - a.along)
            c.nx, c.ny, c.nz = nx, ny, nz
            c.rnx, c.rny, c.rnz = ax + share * bx, ay + share * by, az + share * bz
            c.target = target + share * more
            c.before_n = nx * vx + ny * vy + nz * vz + c.rnx * wx + c.rny * wy + c.rnz * wz
        first = after
    return found


@kernel
def _linear(contacts, first, after):
    """The pressure a + b s with the sum and the moment that the contacts' normal impulses have, and who bears it.

    Returns (there is one, first and after the last of those that bear, a, b).
    """
    total = moment = 0.0
    for k in range(first, after):
        total += contacts[k].pn
        moment += contacts[k].pn * contacts[k].along
    while total > 0.0 and after - first > 1:
        w0 = w1 = w2 = 0.0
        for k in range(first, after):
            w, s = contacts[k].stretch, contacts[k].along
            w0, w1, w2 = w0 + w, w1 + w * s, w2 + w * s * s
        det = w0 * w2 - w1 * w1
        a, b = (total * w2 - moment * w1) / det, (w0 * moment - w1 * total) / det
        # where the resultant is near one end, the other bears nothing
        if a + b * contacts[first].along < 0.0:
            first += 1
        elif a + b * contacts[after - 1].along < 0.0:
            after -= 1
        else:
            return True, first, after, a, b
    return False, first, after, 0.0, 0.0


@inlined
def spread(contacts, count, vx, vy, vz, wx, wy, wz):
    """Spread the normal impulses of every marked line linearly along it; returns the velocities with that (eq. [m])."""
    first = 0
    while first < count:
        number = contacts[first].line
        fits, low, high, a, b = False, 0, 0, 0.0, 0.0
        if number > 0:
            fits, low, high, a, b = _linear(contacts, first, first + number)
        if fits:
            for k in range(first, first + number):
                c = contacts[k]
                p = c.stretch * (a + b * c.along) if low <= k < high else 0.0
                q, t, u = p - c.pn, 0.0, 0.0
                if p == 0.0:  # what bears nothing has no friction, and the sweep passes it by
                    t, u = -c.pt, -c.pu
                    c.pt, c.pu = 0.0, 0.0
                c.pn = p
                vx += c.nx * q + c.tx * t + c.ux * u
                vy += c.ny * q + c.ty * t + c.uy * u
                vz += c.nz * q + c.tz * t + c.uz * u
                wx += c.bnx * q + c.btx * t + c.bux * u
                wy += c.bny * q + c.bty * t + c.buy * u
                wz += c.bnz * q + c.btz * t + c.buz * u
        first += max(number, 1)
    return vx, vy, vz, wx, wy, wz
