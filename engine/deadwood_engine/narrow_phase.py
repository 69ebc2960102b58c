"""The narrow phase for all obstacles: a log, which is a truncated cone with flat ends, against a swept sphere (core).

Every obstacle is a chain of *cores*: all points within wide + slope z of the points start + z u, 0 <= z <= long. A stem
with its rounded top is one core, a lying log has as many as its line has pieces, a boulder is one of zero length, and
the edge of a barrier is one of zero radius.

The signed distance phi of the cone K (positive outside, negative inside) is convex, because K is. So

    gap = min over z of f(z) = phi(start + z u) - wide - slope z

is a convex search in one dimension, and the normal is the gradient of phi there: side, rim, face and top need no
separate cases. In the plane through the log's axis K is a trapezoid, so phi is the distance to a polygon. If the core
passes through the rim of K, phi has a kink and f its minimum there: the normal is the mean of the gradients on both
sides, weighted so that it is perpendicular to the core (f has no slope along it), and the gap along it follows from the
extent of K in that direction.

If the core lies along the log's side or across its face, f is almost constant: the two ends of the shared stretch are
then contacts too (``line_ends``).

The top of a stump is a disc whose points are the centres of such spheres: the gap is least over all chords of the disc
along the log, h(y) = min over z of f on the chord at y, again convex (``top_chord``), and that chord is treated as any
other core. Beside and below the top a stump is an ordinary core: there the least gap lies on the ray from its axis to
the log.

symbol          in code               unit
c, d            c, d                  m, -   centre and direction of the log's axis
s, rho          s, rho                m      position along that axis, distance from it
a(s), ka        thick, taper          m, -   radius of the log at its base and change along the axis
r(z), kr        wide, slope           m, -   radius of the obstacle at its start, change along the core
"""

from __future__ import annotations

import math
from typing import NamedTuple

from .compiled import inlined, kernel
from .contacts import Ahead, touch
from .cores import SweptSphere
from .limits import (
    ASKEW,
    DEEPEST_STEPS,
    DEEPEST_WITHIN,
    FLAT_TOLERANCE,
    LINE_ANGLE,
    LINE_APART,
    LINE_INSET,
    PUSHES_DOWN,
    SAFE,
    THROUGH_AXIS,
    TOP_LEVEL,
    TOP_LOOKS,
    UNFORESEEN,
    VERTICAL,
)
from .log_body import BASE_RADIUS, CENTRE, LENGTH, TIP_RADIUS
from .rotation import VX, VY, VZ, swing_of
from .vectors import across, blend, dot, norm, point


class Cone(NamedTuple):
    """The trapezoid that generates the log by revolution, in coordinates along its axis (from the centre of mass)."""

    back: float  # [m] s of the base
    front: float  # [m] s of the tip
    thick: float  # [m] radius of the base
    thin: float  # [m] radius of the tip
    taper: float  # [-] change of the radius along the axis
    cosine: float  # of the half angle


class Offset(NamedTuple):
    """A core relative to the log's axis: its point at z is s0 + beta z along the axis and p0 + z pu off it [m]."""

    s0: float
    beta: float
    p0: tuple[float, float, float]
    pu: tuple[float, float, float]


@kernel
def cone_of(body):
    """The ``Cone`` of a log."""
    taper = (body[TIP_RADIUS] - body[BASE_RADIUS]) / body[LENGTH]
    cosine = 1.0 / math.sqrt(1.0 + taper * taper)
    back = -body[CENTRE]
    return Cone(back, back + body[LENGTH], body[BASE_RADIUS], body[TIP_RADIUS], taper, cosine)


@kernel
def axis_of(pose):
    """(centre of mass c [m], direction d) of a pose."""
    return (pose.x, pose.y, pose.z), (pose.dx, pose.dy, pose.dz)


@kernel
def offset_of(axis, core):
    """The ``Offset`` of a core: s0 = (start - c).d, beta = u.d; p0 = start - c - s0 d, pu = u - beta d."""
    c, d = axis
    g0 = point(core.start, -1.0, c)
    s0, beta = dot(g0, d), dot(core.u, d)
    return Offset(s0, beta, point(g0, -s0, d), point(core.u, -beta, d))


@kernel
def signed_distance(cone, s, rho):
    """(phi, its change along the axis, its change away from the axis) of a point at s, rho from the log."""
    back, front, thick, thin, taper, cosine = cone
    aside = (rho - thick - taper * (s - back)) * cosine
    behind, ahead = back - s, s - front
    if aside <= 0.0 and behind <= 0.0 and ahead <= 0.0:
        if aside >= behind and aside >= ahead:
            return aside, -taper * cosine, cosine
        if behind >= ahead:
            return behind, -1.0, 0.0
        return ahead, 1.0, 0.0
    if behind > 0.0 and rho <= thick:
        return behind, -1.0, 0.0
    if ahead > 0.0 and rho <= thin:
        return ahead, 1.0, 0.0
    along = (s - back + taper * (rho - thick)) * cosine
    if aside > 0.0 and 0.0 <= along <= (front - back) / cosine:
        return aside, -taper * cosine, cosine
    x, y = (s - back, rho - thick) if along < 0.0 else (s - front, rho - thin)
    size = math.sqrt(x * x + y * y)
    if size == 0.0:
        return 0.0, -taper * cosine, cosine
    return size, x / size, y / size


@kernel
def look_at(cone, d, core, offset, z):
    """f(z) = phi - wide - slope z [m], its derivative [-], and phi's gradient (world), at position z on the core."""
    p = point(offset.p0, z, offset.pu)
    rho = math.sqrt(dot(p, p))
    phi, gs, gr = signed_distance(cone, offset.s0 + z * offset.beta, rho)
    e = blend(1.0 / rho, p, 0.0, p) if rho > 0.0 else across(d, core.u)
    g = blend(gs, d, gr, e)
    return phi - core.wide - core.slope * z, dot(g, core.u) - core.slope, g


@kernel
def _first_guess(cone, core, offset):
    """Minimum z [m] of f if the side of the log is nearest, in closed form: rho' = ka beta + kr / cosine."""
    p0, pu = offset.p0, offset.pu
    w = dot(pu, pu)
    if w < FLAT_TOLERANCE:
        return min(core.long, max(0.0, -offset.s0 * offset.beta))
    z = -dot(p0, pu) / w
    p = point(p0, z, pu)
    lean = cone.taper * offset.beta + core.slope / cone.cosine
    if lean * lean < w:
        z += lean * math.sqrt(dot(p, p) / (w * (w - lean * lean)))
    return min(core.long, max(0.0, z))


@kernel
def reach_along(cone, d, n, p):
    """Distance [m] of a point p (relative to the log's centre) beyond the log in the direction n, exact for any n:
    p.n minus the support function of the cone, the larger of s n.d + a sqrt(1 - (n.d)^2) of its two ends.
    """
    nd = dot(n, d)
    off = math.sqrt(max(0.0, 1.0 - nd * nd))
    return dot(p, n) - max(cone.back * nd + cone.thick * off, cone.front * nd + cone.thin * off)


@kernel
def deepest(cone, axis, core, within):
    """Eq. [d], least gap [m] of a log and a core: (gap, position z [m], gradient n there, whether it is below
    ``within``).

        gap = min over z in [0, long] of phi(start + z u) - wide - slope z

    axis : centre c and direction d of the log; core : a ``SweptSphere``. n points from the log to the core. The search
    is abandoned, and the gap a bound, if no z can have less than ``within`` [m].
    """
    c, d = axis
    u, long = core.u, core.long
    offset = offset_of(axis, core)
    z = _first_guess(cone, core, offset)
    f, rise, g = look_at(cone, d, core, offset, z)
    low, f_low, rise_low, g_low = z, f, rise, g
    high, f_high, rise_high, g_high = z, f, rise, g
    step = 2.0 * cone.thick
    # the minimum is between a falling and a rising position, or at an end of the core
    while rise_low > FLAT_TOLERANCE and low > 0.0:
        high, f_high, rise_high, g_high = low, f_low, rise_low, g_low
        low = max(0.0, low - step)
        step *= 4.0
        f_low, rise_low, g_low = look_at(cone, d, core, offset, low)
    if rise_low > -FLAT_TOLERANCE:
        z, f, g = low, f_low, g_low
    else:
        while rise_high < -FLAT_TOLERANCE and high < long:
            low, f_low, rise_low, g_low = high, f_high, rise_high, g_high
            high = min(long, high + step)
            step *= 4.0
            f_high, rise_high, g_high = look_at(cone, d, core, offset, high)
        if rise_high < FLAT_TOLERANCE:
            z, f, g = high, f_high, g_high
        else:
            for turn in range(DEEPEST_STEPS):
                # f is above its tangents: their intersection gives a bound, and at a kink the position itself
                meet = low + (f_high - f_low + rise_high * (low - high)) / (rise_low - rise_high)
                bound = f_low + rise_low * (meet - low)
                if bound >= within:
                    return bound, meet, g_low, False
                if min(f_low, f_high) - bound <= DEEPEST_WITHIN:
                    break
                at = meet
                if turn % 2 == 1:  # where f is smooth its slope is almost linear
                    at = low - rise_low * (high - low) / (rise_high - rise_low)
                if not low < at < high:
                    at = 0.5 * (low + high)
                f, rise, g = look_at(cone, d, core, offset, at)
                if rise <= 0.0:
                    low, f_low, rise_low, g_low = at, f, rise, g
                if rise >= 0.0:
                    high, f_high, rise_high, g_high = at, f, rise, g
                if low == high:
                    break
            share = rise_high / (rise_high - rise_low) if rise_high > rise_low else 0.5
            g = blend(share, g_low, 1.0 - share, g_high)
            z, f = (low, f_low) if f_low < f_high else (high, f_high)
    if f >= within:
        return f, z, g, False
    size = norm(g)
    # exactly through the axis: a log may be moved to either side of the core
    n = blend(1.0 / size, g, 0.0, g) if size > THROUGH_AXIS else across(d, u)
    reach = reach_along(cone, d, n, point(point(core.start, -1.0, c), z, u))
    return reach - core.wide - core.slope * z, z, n, True


@kernel
def top_chord(cone, axis, middle, flat, wide):
    """The chord of a flat top along the log with the least gap, as a ``SweptSphere``.

    middle : of the disc of radius ``flat`` [m], about which the top is rounded by ``wide`` [m]

    The chord at y, from -b to b with b^2 = flat^2 - y^2, has its least gap at s. The derivative of that with respect to
    y is n.l, n the gap's gradient and l the direction across; at an end of the chord, s = +-b, n.l + n.t ds/dy with
    ds/dy = -y/s.
    """
    c, d = axis
    level = math.sqrt(d[0] * d[0] + d[1] * d[1])
    t = (d[0] / level, d[1] / level, 0.0) if level > VERTICAL else (1.0, 0.0, 0.0)
    across_x, across_y = -t[1], t[0]
    low, high = -flat, flat
    y = (c[0] - middle[0]) * across_x + (c[1] - middle[1]) * across_y
    y = min(SAFE * flat, max(-SAFE * flat, y))  # below the log's axis, if the top is there
    start, long = middle, 0.0
    for _ in range(TOP_LOOKS):
        half = math.sqrt(max(0.0, flat * flat - y * y))
        start, long = point(point(middle, y, (across_x, across_y, 0.0)), -half, t), 2.0 * half
        _, z, n, _ = deepest(cone, axis, SweptSphere(start, t, long, wide, 0.0), math.inf)
        rise, along = n[0] * across_x + n[1] * across_y, dot(n, t)
        if z <= 0.0:
            rise = rise * half + along * y
        elif z >= long:
            rise = rise * half - along * y
        else:
            rise *= half
        if abs(rise) <= TOP_LEVEL * flat:
            break
        if rise > 0.0:
            high = y
        else:
            low = y
        y = 0.5 * (low + high)
    return SweptSphere(start, t, long, wide, 0.0)


@inlined
def line_ends(cone, d, core, offset, z, n):
    """(first, last) position [m] of the core that lies along the log's side or face; both are z if there is none."""
    s0, beta, p0, pu = offset
    w, nd = dot(pu, pu), dot(n, d)
    first, last = z, z
    if abs(nd) < 0.5 and w < LINE_ANGLE:
        first, last = (cone.back - s0) / beta, (cone.front - s0) / beta
    elif abs(nd) > 0.5 and 1.0 - w < LINE_ANGLE:
        a = cone.thick if nd < 0.0 else cone.thin
        middle = -dot(p0, pu) / w
        p = point(p0, middle, pu)
        half = math.sqrt(max(0.0, a * a - dot(p, p)) / w)
        first, last = middle - half, middle + half
    first, last = min(first, last), max(first, last)
    first, last = max(0.0, first), min(core.long, last)
    if last - first < LINE_APART * cone.thick:
        return z, z
    inset = LINE_INSET * (last - first)
    return first + inset, last - inset


@kernel
def gap_at_end(state, pose, p, n, gap, left):
    """Remaining gap [m] at a point p of the log after it has moved for a time [s]; n points to the log."""
    s = dot((p[0] - pose.x, p[1] - pose.y, p[2] - pose.z), (pose.dx, pose.dy, pose.dz))
    t = swing_of(state)
    v = point((state[VX], state[VY], state[VZ]), s, t)
    return gap + left * dot(v, n)


@inlined
def touch_core(query, count, step, key, core, least, plate):
    """Add the contacts of a pose with a core; returns the new count.

    least : (z, n, gap) as from ``deepest``; plate : nothing may be pressed down, because there is a plate below the
        core

    If both share a line, each of its two ends that comes within ``UNFORESEEN`` in the rest of the step is a
    contact: both instead of the least gap, unless the log crosses the core between them; one in addition to it.
    """
    z, n, gap = least
    cone, axis = query.cone, axis_of(query.pose)
    d, offset = axis[1], offset_of(axis, core)
    first, last = line_ends(cone, d, core, offset, z, n)
    if first < last:
        before, deepest_end = count, math.inf
        for end in range(2):
            at = first if end == 0 else last
            if abs(at - z) < LINE_APART * cone.thick:
                continue
            f, _, g = look_at(cone, d, core, offset, at)
            p = point(point(core.start, at, core.u), -f - core.wide - core.slope * at, g)
            g = blend(-1.0, g, 0.0, g)
            deepest_end = min(deepest_end, f)
            left = gap_at_end(query.state, query.pose, p, g, f, step.dt - step.at)
            if left < UNFORESEEN and not (plate and g[2] < -PUSHES_DOWN):
                restitution = step.restitution if left < 0.0 else 0.0
                late = Ahead(step.dt, step.gravity, step.at, restitution, step.friction, step.rolling)
                count = touch(query, count, late, (key[0], key[1], key[2] + 1 + end), p, g, f)
        if count - before == 2 and gap > deepest_end - ASKEW:
            return count
    p = point(point(core.start, z, core.u), -gap - core.wide - core.slope * z, n)
    return touch(query, count, step, key, p, (-n[0], -n[1], -n[2]), gap)
