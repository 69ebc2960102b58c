"""The pressure along a line of contacts: undetermined for rigid bodies, but friction depends on it.

A log on a plane touches along a line. Its weight and the moment of its weight determine the total load on the line and
the centre of that load, N = sum P_k and sum s_k P_k; they do not determine the distribution, on which the moment of
friction against turning depends. Compliant ground carries load in proportion to the depth of the log: the pressure is
linear along the line, and nowhere negative. This also holds in the limit of rigid ground.

The solver therefore treats a line as two impulses, as if it were supported at its two ends, and distributes them
linearly, keeping their sum and their moment [m]; friction is solved contact by contact. Each contact represents the
part of the line nearest to it, so the number of rings does not matter. Two contacts are statically determinate: a line
has at least three with the same direction of impulse and equal freedom to move.
"""

from __future__ import annotations

import math

from .compiled import inlined, kernel
from .contacts import along_normal, pushed
from .limits import LINE_BEND, LINE_ROOM, LINE_STEP, LINE_TURN
from .rotation import DX, DY, DZ, VX, VY, VZ, WX, WY, WZ
from .vectors import dot


@kernel
def _within(low, high, slope, room):
    """Whether a straight line of this slope passes all points so far, and the slopes for which it passes this one too.

    Each point admits the slopes that pass within a tolerance; those of all points are intersected. (A line through the
    first two points would be off by their rounding, extrapolated to the farthest.)
    """
    return low <= slope <= high, max(low, slope - room), min(high, slope + room)


@kernel
def _end_of_line(contacts, first, count, dt):
    """Row after the last of the contacts, from the first on, that lie on one straight line with the same direction of
    impulse.

    Decided by the lever arms of the normals: where across the line a round log is supported changes none of its
    velocities. The gaps that may close within the step must be on one line, too.
    """
    a, after, way = contacts[first], first + 1, 0.0
    low_t = low_x = low_y = low_z = -math.inf
    high_t = high_x = high_y = high_z = math.inf
    while after < count:
        c = contacts[after]
        between = c.along - a.along
        if way == 0.0:
            way = math.copysign(1.0, between)
        if (c.along - contacts[after - 1].along) * way < LINE_STEP:
            break  # points of one ring or face, or of another line
        tx, ty, tz = c.nx - a.nx, c.ny - a.ny, c.nz - a.nz
        if dot((tx, ty, tz), (tx, ty, tz)) > LINE_TURN * LINE_TURN:
            break
        room, bend = LINE_ROOM / abs(between), LINE_BEND / abs(between)
        fits, low_t, high_t = _within(low_t, high_t, (c.target - a.target) * dt / between, room)
        fits_x, low_x, high_x = _within(low_x, high_x, (c.rnx - a.rnx) / between, bend)
        fits_y, low_y, high_y = _within(low_y, high_y, (c.rny - a.rny) / between, bend)
        fits_z, low_z, high_z = _within(low_z, high_z, (c.rnz - a.rnz) / between, bend)
        if not (fits and fits_x and fits_y and fits_z):
            break
        after += 1
    return after


@kernel
def join_lines(contacts, count, state, dt):
    """Find runs of three or more contacts on one line, and make each exactly straight; returns whether there is one.

    Their number is stored in ``line`` of the first, and -1 in that of the others. Their normals, lever arms and targets
    are replaced by those of the line through the first and the last: due to the rounding of the DEM's heights they
    would contradict each other, and a solver does not converge on contradictions. To be called before
    ``contacts.set_frames``.
    dt : [s] the step, in which the gaps may close
    """
    dx, dy, dz = state[DX], state[DY], state[DZ]
    v, w = (state[VX], state[VY], state[VZ]), (state[WX], state[WY], state[WZ])
    for k in range(count):
        c = contacts[k]
        c.along = dot((c.rx, c.ry, c.rz), (dx, dy, dz))
    found, first = False, 0
    while first + 2 < count:
        after = _end_of_line(contacts, first, count, dt)
        if after - first < 3:
            first += 1
            continue
        found = True
        a, b = contacts[first], contacts[after - 1]
        nx, ny, nz = a.nx, a.ny, a.nz
        ax, ay, az, bx, by, bz = a.rnx, a.rny, a.rnz, b.rnx - a.rnx, b.rny - a.rny, b.rnz - a.rnz
        target, more = a.target, b.target - a.target
        for k in range(first, after):
            low, high = max(k - 1, first), min(k + 1, after - 1)
            c = contacts[k]
            c.line = after - first if k == first else -1
            c.stretch = 0.5 * abs(contacts[high].along - contacts[low].along)
            share = (c.along - a.along) / (b.along - a.along)
            c.nx, c.ny, c.nz = nx, ny, nz
            c.rnx, c.rny, c.rnz = ax + share * bx, ay + share * by, az + share * bz
            c.target = target + share * more
            c.before_n = along_normal(c, v, w)
        first = after
    return found


@kernel
def _ends(contacts, first, last, at_first, at_last, before_first, before_last):
    """The least impulses at a line's two ends, as if it were supported there only, with which neither end approaches
    (eq. 6).

    at_first, at_last : velocities there minus their targets; before_... : the impulses that these already include
    """
    a, b = contacts[first], contacts[last]
    gaa, gbb = a.gnn, b.gnn
    gab = dot((a.nx, a.ny, a.nz), (b.nx, b.ny, b.nz)) + dot((a.rnx, a.rny, a.rnz), (b.bnx, b.bny, b.bnz))
    fa = at_first - gaa * before_first - gab * before_last
    fb = at_last - gab * before_first - gbb * before_last
    det = gaa * gbb - gab * gab
    one, other = (gab * fb - gbb * fa) / det, (gab * fa - gaa * fb) / det
    if one >= 0.0 and other >= 0.0:
        return one, other
    one = max(0.0, -fa / gaa)
    if fb + gab * one >= 0.0:
        return one, 0.0
    return 0.0, max(0.0, -fb / gbb)


@kernel
def _linear(contacts, first, after, total, moment):
    """The pressure a + b s along contacts with this sum and moment, and the contacts that carry it.

    Returns (first and after the last of the loaded ones, a, b).
    """
    while after - first > 1:
        w0 = w1 = w2 = 0.0
        for k in range(first, after):
            w, s = contacts[k].stretch, contacts[k].along
            w0, w1, w2 = w0 + w, w1 + w * s, w2 + w * s * s
        det = w0 * w2 - w1 * w1
        a, b = (total * w2 - moment * w1) / det, (w0 * moment - w1 * total) / det
        # if the resultant is near one end, the other carries no load
        if a + b * contacts[first].along < 0.0:
            first += 1
        elif a + b * contacts[after - 1].along < 0.0:
            after -= 1
        else:
            return first, after, a, b
    return first, after, total / contacts[first].stretch, 0.0


@inlined
def press(contacts, count, v, w):
    """Update the normal impulses of every line, distributed linearly along it (eq. [m]).

    v, w : velocities of the log [m/s, 1/s]
    Returns (v, w, largest change of the velocity at an end of a line [m/s]).
    """
    change, start = 0.0, 0
    while start < count:
        number = contacts[start].line
        if number > 0:
            last = start + number - 1
            a, b = contacts[start], contacts[last]
            total = moment = 0.0
            for k in range(start, last + 1):
                total += contacts[k].pn
                moment += contacts[k].pn * contacts[k].along
            length = b.along - a.along
            before_last = (moment - a.along * total) / length
            one, other = _ends(
                contacts,
                start,
                last,
                along_normal(a, v, w) - a.target,
                along_normal(b, v, w) - b.target,
                total - before_last,
                before_last,
            )
            change = max(change, a.gnn * abs(one - total + before_last), b.gnn * abs(other - before_last))
            low, high, rise, base = start, start, 0.0, 0.0
            if one + other > 0.0:
                low, high, base, rise = _linear(contacts, start, last + 1, one + other, one * a.along + other * b.along)
            for k in range(start, last + 1):
                c = contacts[k]
                p = c.stretch * (base + rise * c.along) if low <= k < high else 0.0
                q, t, u = p - c.pn, 0.0, 0.0
                if p == 0.0:  # an unloaded contact has no friction
                    t, u = -c.pt, -c.pu
                    c.pt, c.pu = 0.0, 0.0
                c.pn, c.pressed = p, q
                v, w = pushed(c, v, w, (q, t, u))
        start += max(number, 1)
    return v, w, change
