"""The contact solver: Signorini contact, spatial Coulomb friction and Newton's impact law in one velocity problem.

Block Gauss-Seidel over the contacts, matrix-free on the six velocities of the log. For each contact the normal impulse
is updated first (projection onto the half line), then the friction impulse is solved exactly on its disc of radius mu
P_n (with an anisotropic G_tt a plain projection needs tens of sweeps to find stick). If normal and tangent are strongly
coupled, mu |G_nt| / G_nn > 1/2 (steep impacts of an end face, up to the Painleve paradox), that splitting converges
slowly, and the whole 3 x 3 block of the contact is solved instead.

symbol      in code            unit
P           pn, pt, pu         m/s (impulse per mass)
gamma       gn, gt, gu         m/s (relative velocity at the contact)
G           gnn, gnt, ...      - (Delassus block times mass)
tol         tolerance          m/s: greatest change of a contact velocity in the last sweep
"""

from __future__ import annotations

import math

from .compiled import inlined, kernel
from .contacts import along_normal, along_t, along_u, pushed
from .extrapolation import before_unloading, go_ahead, sweeps_ahead
from .limits import (
    BISECTIONS,
    BLOCK_SWEEPS,
    DISC_ACCURACY,
    DISC_ITERATIONS,
    EXACT_BLOCK_COUPLING,
    EXTRAPOLATE_EVERY,
    EXTRAPOLATE_FROM,
    EXTRAPOLATE_LINES_FROM,
    EXTRAPOLATE_MOST,
    EXTRAPOLATE_UNTIL,
    SLIP_ARCS,
)
from .pressure import press
from .rotation import DX, DY, DZ, VX, VY, VZ, WX, WY, WZ
from .turning import remember_plane
from .vectors import dot, point


@kernel
def disc_impulse(gtt, gtu, guu, ct, cu, radius, s):
    """Eq. 7: friction impulse p of one contact: gamma = c + G p is zero (stick), or opposes p with |p| = radius (slip).

    Slip solves (G + s I) p = -c for the s >= 0 that puts p on the disc, by Newton's method on 1/|p| (the secular
    equation of the trust-region problem). From the left of the root it converges monotonically; from the right its
    first step leads to the left. It starts from the s of the previous sweep and is only solved as accurately as a sweep
    requires, because the sweeps continue until nothing changes. Returns (pt, pu, s for the next sweep).
    """
    if radius <= 0.0:
        return 0.0, 0.0, s
    size, pt, pu = 1.0, 0.0, 0.0
    for _ in range(DISC_ITERATIONS):
        # everything times the determinant, which leaves one division per iteration
        a, b = gtt + s, guu + s
        det = a * b - gtu * gtu
        pt, pu = gtu * cu - b * ct, gtu * ct - a * cu
        square, most = pt * pt + pu * pu, radius * det
        if s == 0.0 and square <= most * most:
            return pt / det, pu / det, 0.0
        size = math.sqrt(square)
        slope = b * pt * pt - 2.0 * gtu * pt * pu + a * pu * pu  # p (G + s)^-1 p
        s = max(0.0, s + square * (size - most) / (slope * radius))
        if abs(size - most) <= DISC_ACCURACY * most:
            break
    scale = radius / size
    return pt * scale, pu * scale, s


@kernel
def _slip(c, cn, ct, cu, angle):
    """For slip in the direction of the angle, everything times the normal stiffness s: (s, s gamma_t x e, s gamma_t .
    e).

    The normal impulse is -cn / s. Without the division nothing is singular at s = 0, and no root is missed next to it.
    """
    et, eu = math.cos(angle), math.sin(angle)
    mu = c.mu
    stiffness = c.gnn - mu * (c.gnt * et + c.gnu * eu)
    gt = stiffness * ct - cn * (c.gnt - mu * (c.gtt * et + c.gtu * eu))
    gu = stiffness * cu - cn * (c.gnu - mu * (c.gtu * et + c.guu * eu))
    return stiffness, et * gu - eu * gt, et * gt + eu * gu


@kernel
def block_impulse(c, cn, ct, cu):
    """Eq. [c]: exact impulse (n, t, u) of one contact from its free velocity: separation, stick or slip.

    Slip is a root in the direction of slip: found by a scan from the direction of the free velocity, then by bisection.
    Returns (ok, pn, pt, pu); not ok if no branch applies (the caller then keeps the split solution).
    """
    if cn >= 0.0:
        return True, 0.0, 0.0, 0.0
    a, b, d, e, f, h = c.gnn, c.gnt, c.gnu, c.gtt, c.gtu, c.guu
    m00, m01, m02 = e * h - f * f, d * f - b * h, b * f - d * e
    det = a * m00 + b * m01 + d * m02
    m11, m12, m22 = a * h - d * d, b * d - a * f, a * e - b * b
    pn = -(m00 * cn + m01 * ct + m02 * cu) / det
    pt = -(m01 * cn + m11 * ct + m12 * cu) / det
    pu = -(m02 * cn + m12 * ct + m22 * cu) / det
    mu = c.mu
    if pn >= 0.0 and pt * pt + pu * pu <= mu * mu * pn * pn:
        return True, pn, pt, pu
    start = math.atan2(cu, ct)
    arc = math.pi / SLIP_ARCS
    for k in range(SLIP_ARCS):
        for side in range(2):
            low = start + (k * arc if side == 0 else -(k + 1) * arc)
            high = low + arc
            _, excess, _ = _slip(c, cn, ct, cu, low)
            _, other, _ = _slip(c, cn, ct, cu, high)
            if (excess > 0.0) == (other > 0.0):
                continue
            angle = low
            for _ in range(BISECTIONS):
                angle = 0.5 * (low + high)
                _, other, _ = _slip(c, cn, ct, cu, angle)
                if (other > 0.0) == (excess > 0.0):
                    low = angle
                else:
                    high = angle
            stiffness, _, along = _slip(c, cn, ct, cu, angle)
            if stiffness > 0.0 and along >= 0.0:
                pn = -cn / stiffness
                return True, pn, -mu * pn * math.cos(angle), -mu * pn * math.sin(angle)
    return False, 0.0, 0.0, 0.0


@inlined
def solve(contacts, count, state, rolling, until, lines, used=0):
    """Update the impulses of all contacts until no contact velocity changes by more than the tolerance (eq. 5 to 9).

    The velocities of the state must already include the impulses in the tables (warm start); they are updated in place.
    rolling : the moment that resists rolling, a ROLLING; until : (tolerance [m/s], most sweeps)
    lines : whether there are lines of contacts along which the pressure is distributed (``pressure``)
    used : sweeps made before

    Returns (sweeps used, largest change of a contact velocity in the last sweep [m/s]).
    """
    tolerance, sweeps = until
    v, w = (state[VX], state[VY], state[VZ]), (state[WX], state[WY], state[WZ])
    d = (state[DX], state[DY], state[DZ])
    moment, inertia, skin = rolling.moment, rolling.inertia, rolling.skin
    change = 0.0
    slow_from = EXTRAPOLATE_LINES_FROM if lines else EXTRAPOLATE_FROM
    while used < sweeps:
        used += 1
        change, most, slow = 0.0, 0.0, used > slow_from
        same = before = now = 0.0
        if lines:
            v, w, change = press(contacts, count, v, w)
        for k in range(count):
            c = contacts[k]
            pn, pt, pu = c.pn, c.pt, c.pu
            gn = along_normal(c, v, w) - c.target
            pressed = 0.0
            if lines and c.line != 0:  # the line has updated the normal impulse
                gn, pressed = 0.0, c.pressed
            if pn == 0.0 and gn >= 0.0:
                if slow:
                    before += c.last_n * c.last_n + c.last_t * c.last_t + c.last_u * c.last_u
                    c.last_n, c.last_t, c.last_u = 0.0, 0.0, 0.0
                continue
            gt, gu = along_t(c, v, w), along_u(c, v, w)
            gnn, gnt, gnu = c.gnn, c.gnt, c.gnu
            mu = c.mu
            solved, qn, qt, qu = False, 0.0, 0.0, 0.0
            alone = not lines or c.line == 0
            if alone and used <= BLOCK_SWEEPS and mu * mu * (gnt * gnt + gnu * gnu) > (EXACT_BLOCK_COUPLING * gnn) ** 2:
                solved, qn, qt, qu = block_impulse(
                    c,
                    gn - gnn * pn - gnt * pt - gnu * pu,
                    gt - gnt * pn - c.gtt * pt - c.gtu * pu,
                    gu - gnu * pn - c.gtu * pt - c.guu * pu,
                )
            if not solved:
                qn = max(0.0, pn - gn / gnn)
                qt, qu, c.shift = disc_impulse(
                    c.gtt,
                    c.gtu,
                    c.guu,
                    gt + gnt * (qn - pn) - c.gtt * pt - c.gtu * pu,
                    gu + gnu * (qn - pn) - c.gtu * pt - c.guu * pu,
                    mu * qn,
                    c.shift,
                )
            c.pn, c.pt, c.pu = qn, qt, qu
            most += c.roll * qn
            qn, qt, qu = qn - pn, qt - pt, qu - pu
            change = max(change, gnn * abs(qn), c.gtt * abs(qt), c.guu * abs(qu))
            if slow:
                total = qn + pressed
                same += total * c.last_n + qt * c.last_t + qu * c.last_u
                before += c.last_n * c.last_n + c.last_t * c.last_t + c.last_u * c.last_u
                now += total * total + qt * qt + qu * qu
                c.last_n, c.last_t, c.last_u = total, qt, qu
            v, w = pushed(c, v, w, (qn, qt, qu))
        if most > 0.0 or moment != 0.0:
            renewed = min(most, max(-most, moment - inertia * dot(w, d)))
            turn = (renewed - moment) / inertia
            moment = renewed
            change = max(change, skin * abs(turn))
            w = point(w, turn, d)
        if change <= tolerance:
            break
        if slow and used % EXTRAPOLATE_EVERY == 0 and used < min(sweeps, EXTRAPOLATE_UNTIL):
            times = before_unloading(contacts, count, min(sweeps_ahead(same, before, now), EXTRAPOLATE_MOST))
            if times > 1.0:
                v, w = go_ahead(contacts, count, times, v, w)
    rolling.moment = moment
    state[VX], state[VY], state[VZ] = v
    state[WX], state[WY], state[WZ] = w
    return used, change


@kernel
def exchange(contacts, keys, k, m, spare):
    """Exchange two contacts; spare: buffer for one."""
    spare[0] = contacts[k]
    contacts[k] = contacts[m]
    contacts[m] = spare[0]
    for column in range(keys.shape[1]):
        keys[k, column], keys[m, column] = keys[m, column], keys[k, column]


@kernel
def turn_around(contacts, keys, count, spare):
    """Reverse the order of the contacts, to measure the effect of the order of the sweeps; spare: buffer for one."""
    for k in range(count // 2):
        exchange(contacts, keys, k, count - 1 - k, spare)


@inlined
def find_old(contacts, keys, count, old_keys, old_count):
    """Find the row of each contact among those of the previous step.

    Both lists have the same order, so the search continues from the last match.
    """
    at = 0
    for k in range(count):
        contacts[k].old_row = -1
        for tried in range(old_count):
            m = at + tried
            if m >= old_count:
                m -= old_count
            if old_keys[m, 1] == keys[k, 1] and old_keys[m, 0] == keys[k, 0] and old_keys[m, 2] == keys[k, 2]:
                at = m + 1 if m + 1 < old_count else 0
                contacts[k].old_row = m
                break


@kernel
def add_impulse(c, state, pn, pt, pu):
    """Add a contact's impulse (n, t, u), per mass [m/s], to the velocities (eq. 5)."""
    v, w = (state[VX], state[VY], state[VZ]), (state[WX], state[WY], state[WZ])
    v, w = pushed(c, v, w, (pn, pt, pu))
    state[VX], state[VY], state[VZ] = v
    state[WX], state[WY], state[WZ] = w


@inlined
def warm_start(contacts, count, state, old_contacts, ratio):
    """Start each contact from its impulse in the previous step, rotated into its new frame and projected onto its cone.

    Impulses are scaled by the ratio of the time steps.
    """
    for k in range(count):
        c = contacts[k]
        if c.old_row < 0:
            continue
        old = old_contacts[c.old_row]
        px, py, pz = ratio * old.px, ratio * old.py, ratio * old.pz
        pn = c.nx * px + c.ny * py + c.nz * pz
        if pn <= 0.0:
            continue
        pt = c.tx * px + c.ty * py + c.tz * pz
        pu = c.ux * px + c.uy * py + c.uz * pz
        size = math.sqrt(pt * pt + pu * pu)
        if size > c.mu * pn:
            pt *= c.mu * pn / size
            pu *= c.mu * pn / size
        c.pn, c.pt, c.pu = pn, pt, pu
        add_impulse(c, state, pn, pt, pu)


@inlined
def remember(contacts, keys, count, state, old_keys, old_contacts, turning):
    """Store what the next step's warm start and turning need of the loaded contacts; returns how many there are."""
    kept = 0
    for k in range(count):
        c = contacts[k]
        pn, pt, pu = c.pn, c.pt, c.pu
        if pn > 0.0:
            old_keys[kept, 0], old_keys[kept, 1], old_keys[kept, 2] = keys[k, 0], keys[k, 1], keys[k, 2]
            old = old_contacts[kept]
            old.px = c.nx * pn + c.tx * pt + c.ux * pu
            old.py = c.ny * pn + c.ty * pt + c.uy * pu
            old.pz = c.nz * pn + c.tz * pt + c.uz * pu
            if turning:
                remember_plane(old, c, state)
            kept += 1
    return kept
