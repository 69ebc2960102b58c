"""Contacts with lying logs, which hold others back.

Sliding log against piece, at the predicted pose; the two are alike, so each test is made both ways:
- side on side: the closed form of ``tree_contacts``, here for any direction of the second axis;
- an end disc against the other's side: seen along that axis the disc is an ellipse, as of an end face at a tree;
- end face against end face.
Nearly parallel, only the ends touch: two contacts, one at each end of what lies side by side.

symbol        in code            unit
a, ka         radius, taper       m, -   of the sliding log
A, u, H       start, along, long  m      of the piece: foot of its axis, direction, length
b, kb         wide, slope         m, -   its radius at the start, and the change along its axis
"""

from __future__ import annotations

import math

from .compiled import inlined, kernel
from .contacts import LYING, cross, pierced_end, touch
from .limits import FLAT_TOLERANCE, LYING_TRAVEL, STEEP
from .log_body import BASE_RADIUS, CENTRE, LENGTH, TIP_RADIUS
from .lying_logs import ALONG_X, ALONG_Y, ALONG_Z, LONG, SLOPE, START_X, START_Y, START_Z, WIDE
from .rotation import DX, DY, DZ, X, Y, Z
from .tree_contacts import disc_nearest


@kernel
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def point(a, s, d):
    """a + s d."""
    return a[0] + s * d[0], a[1] + s * d[1], a[2] + s * d[2]


@kernel
def axes_nearest(c, d, back, front, start, along, long):
    """Nearest points of the segments c + s d, s in [back, front], and start + z along, z in [0, long]: (s, z)."""
    g = point(c, -1.0, start)
    b, e, f = dot(d, along), dot(g, d), dot(g, along)
    across = 1.0 - b * b
    s = back
    if across > FLAT_TOLERANCE:
        s = (b * f - e) / across
    s = min(front, max(back, s))
    z = min(long, max(0.0, f + b * s))
    s = min(front, max(back, b * z - e))
    return s, min(long, max(0.0, f + b * s))


@kernel
def disc_on_side(e, out, a, t, before, u, start, long, wide, slope):
    """An end disc (centre e, outward normal out, radius a) against the side of a cone (start, u, long, wide, slope).

    t : from e to the cone's axis where it is nearest, at the predicted pose; before : the same now
    Returns (touches, whether the cone entered by this face, point of the disc, normal from the cone to the disc, gap).
    As in ``tree_contacts``: seen along the cone's axis the disc is an ellipse, whose outer half is the outline's end.
    An axis outside it meets its nearest point; one that it has overrun, and that lies less deep under the end than
    under the side, now or a step ahead, is pushed out by the end.
    """
    nothing = (0.0, 0.0, 0.0)
    cosine = dot(out, u)
    sine = math.sqrt(max(0.0, 1.0 - cosine * cosine))
    if sine > FLAT_TOLERANCE:
        m = ((out[0] - cosine * u[0]) / sine, (out[1] - cosine * u[1]) / sine, (out[2] - cosine * u[2]) / sine)
    else:
        sine = 0.0
        ux, uy, uz = abs(u[0]), abs(u[1]), abs(u[2])
        if ux <= uy and ux <= uz:
            m = cross(1.0, 0.0, 0.0, u[0], u[1], u[2])
        elif uy <= uz:
            m = cross(0.0, 1.0, 0.0, u[0], u[1], u[2])
        else:
            m = cross(0.0, 0.0, 1.0, u[0], u[1], u[2])
        size = math.sqrt(dot(m, m))
        m = (m[0] / size, m[1] / size, m[2] / size)
    side = cross(u[0], u[1], u[2], m[0], m[1], m[2])
    tl, tm = dot(t, side), dot(t, m)
    height = dot(point(e, -1.0, start), u)  # of the disc's centre along the cone's axis
    entered, w, depth = False, 0.0, 0.0
    if abs(tl) < a and abs(cosine) < STEEP:
        w = a * math.sqrt(1.0 - (tl / a) ** 2)
        if cosine < 0.0:
            w = -w
        edge = w * cosine
        depth = edge - tm
        if depth > 0.0:
            if depth > a - abs(tl) and edge - dot(before, m) > a - abs(tl):
                return False, False, nothing, nothing, 0.0
            entered = True
    flat = a * abs(cosine)
    if entered:
        v, nl, nm, gap = tl, 0.0, -1.0, -depth
    elif flat > 0.0 and tl * tl / (a * a) + tm * tm / (flat * flat) < 1.0:
        # the cone's axis runs through the disc: apart along the line of their centres
        size = math.sqrt(tl * tl + tm * tm)
        nl, nm = (tl / size, tm / size) if size > 0.0 else (1.0, 0.0)
        reach = 1.0 / math.sqrt(nl * nl / (a * a) + nm * nm / (flat * flat))
        v, w, gap = reach * nl, reach * nm / cosine, size - reach
        nl, nm = -nl, -nm
    else:
        v, w = disc_nearest(a, cosine, tl, tm)
        nl, nm = v - tl, w * cosine - tm
        gap = math.sqrt(nl * nl + nm * nm)
        if gap == 0.0:
            return False, False, nothing, nothing, 0.0
        nl, nm = nl / gap, nm / gap
    # the point must lie beside the cone, not beyond its ends; the disc's chord along the cone may still reach it
    z = height - w * sine
    kept = min(long, max(0.0, z))
    if kept != z:
        if sine < 0.1:
            return False, entered, nothing, nothing, 0.0
        moved = (height - kept) / sine
        if v * v + moved * moved > a * a:
            return False, entered, nothing, nothing, 0.0
        gap += abs(w - moved) * abs(cosine)
        w = moved
    gap -= wide + slope * kept
    scale = 1.0 / math.sqrt(1.0 + slope * slope)
    n = (
        (nl * side[0] + nm * m[0] - slope * u[0]) * scale,
        (nl * side[1] + nm * m[1] - slope * u[1]) * scale,
        (nl * side[2] + nm * m[2] - slope * u[2]) * scale,
    )
    p = point(point(e, v, side), w * cosine, m)
    p = point(p, -w * sine, u)
    return gap < 0.0, entered, p, n, gap * scale


@kernel
def side_on_side(c, d, back, front, thick, taper, start, u, long, wide, slope):
    """The sliding log's side on the piece's, both strictly between their ends: (touches, point, normal, gap).

    Minimises |c(s) - l(z)| - a(s) - b(z) over both axes; the point is on the sliding log.
    """
    nothing = (0.0, 0.0, 0.0)
    g = point(c, -1.0, start)
    cosine = dot(d, u)
    across = 1.0 - cosine * cosine
    if across <= FLAT_TOLERANCE:
        return False, nothing, nothing, 0.0
    mix = (taper * taper + slope * slope + 2.0 * cosine * taper * slope) / across
    if mix >= 0.5:
        return False, nothing, nothing, 0.0
    e, f = dot(g, d), dot(g, u)
    s = (cosine * f - e) / across
    z = f + cosine * s
    r = point(point(g, s, d), -z, u)
    rho = math.sqrt(dot(r, r)) / math.sqrt(1.0 - mix)
    s += rho * (taper + cosine * slope) / across
    z += rho * (slope + cosine * taper) / across
    if not (back < s < front and 0.0 < z < long):
        return False, nothing, nothing, 0.0
    r = point(point(g, s, d), -z, u)
    rho = math.sqrt(dot(r, r))
    a = thick + taper * (s - back)
    gap = rho - a - wide - slope * z
    if gap >= 0.0:
        return False, nothing, nothing, 0.0
    if rho > 0.0:
        n = (r[0] / rho, r[1] / rho, r[2] / rho)
    else:
        n = cross(d[0], d[1], d[2], u[0], u[1], u[2])
        n = point(nothing, 1.0 / math.sqrt(across), n)
    return True, point(point(c, s, d), -a, n), n, gap


@kernel
def _on_disc(centre, out, radius, towards, aim):
    """A point of a disc (centre, normal out, radius): the farthest towards a direction, or the nearest to a place."""
    t = point(towards, -dot(towards, out), out)
    size = math.sqrt(dot(t, t))
    share = 0.0
    if size > 0.0:
        share = radius / size if aim else min(1.0, radius / size)
    return point(centre, share, t)


@kernel
def _face_on_face(state, body, trial, end, centre, out, radius):
    """A piece's end face (centre, outward normal, radius) on an end face of the log: (touches, point, normal, gap).

    Four points are tried: the piece's that lies deepest against the log's face, and the one nearest to its middle
    (where the deepest lies beside that face), and the same of the log's against the piece's face.
    """
    outward = -1.0 if end == 0 else 1.0
    s = -body[CENTRE] if end == 0 else body[LENGTH] - body[CENTRE]
    a = body[BASE_RADIUS] if end == 0 else body[TIP_RADIUS]
    d = (trial[0], trial[1], trial[2])
    mine = (outward * d[0], outward * d[1], outward * d[2])
    back = (-mine[0], -mine[1], -mine[2])
    if dot(mine, out) >= 0.0:
        return False, mine, mine, 0.0
    e = point((trial[3], trial[4], trial[5]), s, d)
    e_now = point((state[X], state[Y], state[Z]), s, (state[DX], state[DY], state[DZ]))
    for aim in range(2):
        towards = back if aim == 0 else point(e, -1.0, centre)
        p = _on_disc(centre, out, radius, towards, aim == 0)
        gap, there = pierced_end(state, body, trial, end, p[0], p[1], p[2])
        if there:
            return True, p, back, gap
        towards = (-out[0], -out[1], -out[2]) if aim == 0 else point(centre, -1.0, e)
        p = _on_disc(e, mine, a, towards, aim == 0)
        r = point(p, -1.0, centre)
        gap = dot(r, out)
        aside = math.sqrt(max(0.0, dot(r, r) - gap * gap))
        if gap < 0.0 and aside < radius:
            now = dot(point(point(p, 1.0, e_now), -1.0, e), out) - dot(centre, out)
            if -gap < radius - aside or now >= 0.0:
                return True, p, out, gap
    return False, e, out, 0.0


@inlined
def contacts_with(terrain, frame, table, listed, number, contacts, keys, count, state, body, trial, step):
    """Contacts with the near pieces, as for ``tree_contacts``."""
    travel, free = math.inf, math.inf
    d, c = (trial[0], trial[1], trial[2]), (trial[3], trial[4], trial[5])
    d_now, c_now = (state[DX], state[DY], state[DZ]), (state[X], state[Y], state[Z])
    back, front, thick = -body[CENTRE], body[LENGTH] - body[CENTRE], body[BASE_RADIUS]
    taper = (body[TIP_RADIUS] - thick) / body[LENGTH]
    base = point(c, back, d)
    for m in range(number):
        piece, item = table[m], listed[m]
        start = (piece[START_X], piece[START_Y], piece[START_Z])
        u = (piece[ALONG_X], piece[ALONG_Y], piece[ALONG_Z])
        long, wide, slope = piece[LONG], piece[WIDE], piece[SLOPE]
        s, z = axes_nearest(c, d, back, front, start, u, long)
        r = point(point(point(c, s, d), -1.0, start), -z, u)
        distance = math.sqrt(dot(r, r))
        mine = thick + taper * (s - back)
        both = mine + wide + slope * z
        clear = distance - thick - max(wide, wide + slope * long)
        narrow = min(both, 2.0 * math.sqrt(mine * both), 2.0 * math.sqrt((both - mine) * both))
        least = min(step[3], LYING_TRAVEL) * narrow
        travel = min(travel, max(least, clear))
        free = min(free, clear)
        if clear > 0.0:
            continue
        by_end = False
        for end in range(2):
            # the log's end against the piece's side
            outward, s, a = (-1.0, back, thick) if end == 0 else (1.0, front, body[TIP_RADIUS])
            out = (outward * d[0], outward * d[1], outward * d[2])
            e = point(c, s, d)
            z = dot(point(e, -1.0, start), u)
            t = point(point(point(start, z, u), -1.0, e), 0.0, u)
            before = point(point(start, z, u), -1.0, point(c_now, s, d_now))
            hit, entered, p, n, gap = disc_on_side(e, out, a, t, before, u, start, long, wide, slope)
            if hit:
                by_end = by_end or entered
                count = touch(
                    terrain, frame, contacts, keys, count, state, trial, (LYING, item, 1 + end), p, n, gap, step
                )
            # the piece's end against the log's side
            z, a = (0.0, wide) if end == 0 else (long, wide + slope * long)
            out = (outward * u[0], outward * u[1], outward * u[2])
            e = point(start, z, u)
            s = dot(point(e, -1.0, c), d)
            t = point(point(c, s, d), -1.0, e)
            before = point(point(c_now, s, d_now), -1.0, e)
            hit, entered, p, n, gap = disc_on_side(e, out, a, t, before, d, base, body[LENGTH], thick, taper)
            if hit:
                by_end = by_end or entered
                count = touch(
                    terrain, frame, contacts, keys, count, state, trial, (LYING, item, 3 + end), p,
                    (-n[0], -n[1], -n[2]), gap, step,
                )  # fmt: skip
            for mine_end in range(2):
                hit, p, n, gap = _face_on_face(state, body, trial, mine_end, e, out, a)
                if hit:
                    by_end = True
                    count = touch(
                        terrain, frame, contacts, keys, count, state, trial,
                        (LYING, item, 5 + 2 * end + mine_end), p, n, gap, step,
                    )  # fmt: skip
        if not by_end:
            hit, p, n, gap = side_on_side(c, d, back, front, thick, taper, start, u, long, wide, slope)
            if hit:
                count = touch(terrain, frame, contacts, keys, count, state, trial, (LYING, item, 0), p, n, gap, step)
    return count, travel, free
