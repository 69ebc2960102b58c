"""The contact solver: Signorini contact, spatial Coulomb friction and Newton's impact law in one velocity problem.

Gauss-Seidel over the contacts, matrix-free on the log's six velocities. For each contact the normal impulse is
renewed first (prox on the half line), then the friction impulse is solved exactly on its disc of radius mu P_n
(with G_tt anisotropic a plain projection needs tens of sweeps to stick). Where normal and tangent are strongly
coupled, mu |G_nt| / G_nn > 1/2 (steep impacts of an end face, up to the Painleve paradox), that splitting crawls,
and the contact's whole 3 x 3 block is solved instead.

symbol      in code            unit
P           PN, PT, PU         m/s (impulse per mass)
gamma       gn, gt, gu         m/s (relative velocity at the contact)
G           GNN, GNT, ...      - (Delassus block times mass)
tol         tolerance          m/s: no contact's velocity changes by more in the last sweep
"""

from __future__ import annotations

import math

from .compiled import inlined, kernel
from .contacts import (
    ANX,
    ANY,
    ANZ,
    ATX,
    ATY,
    ATZ,
    AUX,
    AUY,
    AUZ,
    BNX,
    BNY,
    BNZ,
    BTX,
    BTY,
    BTZ,
    BUX,
    BUY,
    BUZ,
    GNN,
    GNT,
    GNU,
    GTT,
    GTU,
    GUU,
    MU,
    NX,
    NY,
    NZ,
    OLD_IMPULSE,
    OLD_ROW,
    PN,
    PT,
    PU,
    ROLL,
    SHIFT,
    TARGET,
    TX,
    TY,
    TZ,
    UX,
    UY,
    UZ,
)  # fmt: skip
from .limits import BLOCK_SWEEPS, DISC_ACCURACY, DISC_ITERATIONS, EXACT_BLOCK_COUPLING, SLIP_ARCS
from .rolling import INERTIA, MOMENT, SKIN
from .rotation import DX, DY, DZ, VX, VY, VZ, WX, WY, WZ
from .turning import remember_plane


@kernel
def disc_impulse(gtt, gtu, guu, ct, cu, radius, s):
    """Friction impulse p of one contact: gamma = c + G p is zero (stick), or opposes p with |p| = radius (slip).

    Slip solves (G + s I) p = -c for the s >= 0 that puts p on the disc, by Newton on 1/|p| (the trust-region secular
    equation). From the left of the root it converges monotonically; from the right its first step leads there. It goes
    on from the s of the sweep before, and no farther than a sweep is worth: the sweeps go on until nothing changes.
    Returns (pt, pu, s for the next sweep).
    """
    if radius <= 0.0:
        return 0.0, 0.0, s
    size, pt, pu = 1.0, 0.0, 0.0
    for _ in range(DISC_ITERATIONS):
        # all times the determinant, which leaves one division a step
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
    """Of a slip in the direction of the angle, all times the normal stiffness s: (s, s gamma_t x e, s gamma_t . e).

    The normal impulse is -cn / s. Without the division nothing is singular where s = 0, and no root hides beside it.
    """
    et, eu = math.cos(angle), math.sin(angle)
    mu = c[MU]
    stiffness = c[GNN] - mu * (c[GNT] * et + c[GNU] * eu)
    gt = stiffness * ct - cn * (c[GNT] - mu * (c[GTT] * et + c[GTU] * eu))
    gu = stiffness * cu - cn * (c[GNU] - mu * (c[GTU] * et + c[GUU] * eu))
    return stiffness, et * gu - eu * gt, et * gt + eu * gu


@kernel
def block_impulse(c, cn, ct, cu):
    """Exact impulse (n, t, u) of one contact from its free velocity: separate, stick, or slip.

    Slip is a root in the direction of slip: scanned from the free velocity's direction, then bisected.
    Returns (ok, pn, pt, pu); not ok where no branch fits (then the caller keeps the split solve).
    """
    if cn >= 0.0:
        return True, 0.0, 0.0, 0.0
    a, b, d, e, f, h = c[GNN], c[GNT], c[GNU], c[GTT], c[GTU], c[GUU]
    m00, m01, m02 = e * h - f * f, d * f - b * h, b * f - d * e
    det = a * m00 + b * m01 + d * m02
    m11, m12, m22 = a * h - d * d, b * d - a * f, a * e - b * b
    pn = -(m00 * cn + m01 * ct + m02 * cu) / det
    pt = -(m01 * cn + m11 * ct + m12 * cu) / det
    pu = -(m02 * cn + m12 * ct + m22 * cu) / det
    mu = c[MU]
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
            for _ in range(60):
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
def solve(contacts, count, state, rolling, tolerance, sweeps, used=0):
    """Renew the impulses of all contacts until none changes a contact velocity by more than the tolerance.

    The state's velocities must already hold the effect of the impulses in the tables (warm start); they are updated
    in place. rolling : the moment against rolling (``rolling``); ``used``: sweeps made before.

    Returns (sweeps used, largest change of a contact velocity in the last sweep [m/s]).
    """
    vx, vy, vz = state[VX], state[VY], state[VZ]
    wx, wy, wz = state[WX], state[WY], state[WZ]
    dx, dy, dz = state[DX], state[DY], state[DZ]
    moment, inertia, skin = rolling[MOMENT], rolling[INERTIA], rolling[SKIN]
    change = 0.0
    while used < sweeps:
        used += 1
        change, most = 0.0, 0.0
        for k in range(count):
            c = contacts[k]
            pn, pt, pu = c[PN], c[PT], c[PU]
            gn = c[NX] * vx + c[NY] * vy + c[NZ] * vz + c[ANX] * wx + c[ANY] * wy + c[ANZ] * wz - c[TARGET]
            if pn == 0.0 and gn >= 0.0:
                continue
            gt = c[TX] * vx + c[TY] * vy + c[TZ] * vz + c[ATX] * wx + c[ATY] * wy + c[ATZ] * wz
            gu = c[UX] * vx + c[UY] * vy + c[UZ] * vz + c[AUX] * wx + c[AUY] * wy + c[AUZ] * wz
            gnn, gnt, gnu = c[GNN], c[GNT], c[GNU]
            mu = c[MU]
            solved, qn, qt, qu = False, 0.0, 0.0, 0.0
            if used <= BLOCK_SWEEPS and mu * mu * (gnt * gnt + gnu * gnu) > (EXACT_BLOCK_COUPLING * gnn) ** 2:
                solved, qn, qt, qu = block_impulse(
                    c,
                    gn - gnn * pn - gnt * pt - gnu * pu,
                    gt - gnt * pn - c[GTT] * pt - c[GTU] * pu,
                    gu - gnu * pn - c[GTU] * pt - c[GUU] * pu,
                )
            if not solved:
                qn = max(0.0, pn - gn / gnn)
                qt, qu, c[SHIFT] = disc_impulse(
                    c[GTT], c[GTU], c[GUU],
                    gt + gnt * (qn - pn) - c[GTT] * pt - c[GTU] * pu,
                    gu + gnu * (qn - pn) - c[GTU] * pt - c[GUU] * pu,
                    mu * qn,
                    c[SHIFT],
                )  # fmt: skip
            c[PN], c[PT], c[PU] = qn, qt, qu
            most += c[ROLL] * qn
            qn, qt, qu = qn - pn, qt - pt, qu - pu
            change = max(change, gnn * abs(qn), c[GTT] * abs(qt), c[GUU] * abs(qu))
            vx += c[NX] * qn + c[TX] * qt + c[UX] * qu
            vy += c[NY] * qn + c[TY] * qt + c[UY] * qu
            vz += c[NZ] * qn + c[TZ] * qt + c[UZ] * qu
            wx += c[BNX] * qn + c[BTX] * qt + c[BUX] * qu
            wy += c[BNY] * qn + c[BTY] * qt + c[BUY] * qu
            wz += c[BNZ] * qn + c[BTZ] * qt + c[BUZ] * qu
        if most > 0.0 or moment != 0.0:
            renewed = min(most, max(-most, moment - inertia * (wx * dx + wy * dy + wz * dz)))
            turn = (renewed - moment) / inertia
            moment = renewed
            change = max(change, skin * abs(turn))
            wx, wy, wz = wx + turn * dx, wy + turn * dy, wz + turn * dz
        if change <= tolerance:
            break
    rolling[MOMENT] = moment
    state[VX], state[VY], state[VZ] = vx, vy, vz
    state[WX], state[WY], state[WZ] = wx, wy, wz
    return used, change


@kernel
def turn_around(contacts, keys, count):
    """Put the contacts into the opposite order, to see what the order of the sweeps does."""
    for k in range(count // 2):
        m = count - 1 - k
        for column in range(contacts.shape[1]):
            contacts[k, column], contacts[m, column] = contacts[m, column], contacts[k, column]
        for column in range(keys.shape[1]):
            keys[k, column], keys[m, column] = keys[m, column], keys[k, column]


@inlined
def find_old(contacts, keys, count, old_keys, old_count):
    """Enter each contact's row among those of the step before.

    Both lists run in the same order, so the search goes on from the last find.
    """
    at = 0
    for k in range(count):
        contacts[k, OLD_ROW] = -1.0
        for tried in range(old_count):
            m = at + tried
            if m >= old_count:
                m -= old_count
            if old_keys[m, 1] == keys[k, 1] and old_keys[m, 0] == keys[k, 0] and old_keys[m, 2] == keys[k, 2]:
                at = m + 1 if m + 1 < old_count else 0
                contacts[k, OLD_ROW] = m
                break


@inlined
def warm_start(contacts, count, state, old_contacts, ratio):
    """Start each contact from its impulse of the step before, turned into its new frame and put back on its cone.

    Impulses scale with the ratio of the time steps.
    """
    for k in range(count):
        c = contacts[k]
        if c[OLD_ROW] < 0.0:
            continue
        old = old_contacts[int(c[OLD_ROW])]
        px, py, pz = ratio * old[OLD_IMPULSE], ratio * old[OLD_IMPULSE + 1], ratio * old[OLD_IMPULSE + 2]
        pn = c[NX] * px + c[NY] * py + c[NZ] * pz
        if pn <= 0.0:
            continue
        pt = c[TX] * px + c[TY] * py + c[TZ] * pz
        pu = c[UX] * px + c[UY] * py + c[UZ] * pz
        size = math.sqrt(pt * pt + pu * pu)
        if size > c[MU] * pn:
            pt *= c[MU] * pn / size
            pu *= c[MU] * pn / size
        c[PN], c[PT], c[PU] = pn, pt, pu
        state[VX] += c[NX] * pn + c[TX] * pt + c[UX] * pu
        state[VY] += c[NY] * pn + c[TY] * pt + c[UY] * pu
        state[VZ] += c[NZ] * pn + c[TZ] * pt + c[UZ] * pu
        state[WX] += c[BNX] * pn + c[BTX] * pt + c[BUX] * pu
        state[WY] += c[BNY] * pn + c[BTY] * pt + c[BUY] * pu
        state[WZ] += c[BNZ] * pn + c[BTZ] * pt + c[BUZ] * pu


@inlined
def remember(contacts, keys, count, state, old_keys, old_contacts, turning):
    """Keep what the next step's warm start, and its turns if there are any, need of the loaded contacts: how many."""
    kept = 0
    for k in range(count):
        c = contacts[k]
        pn, pt, pu = c[PN], c[PT], c[PU]
        if pn > 0.0:
            old_keys[kept, 0], old_keys[kept, 1], old_keys[kept, 2] = keys[k, 0], keys[k, 1], keys[k, 2]
            old = old_contacts[kept]
            old[OLD_IMPULSE] = c[NX] * pn + c[TX] * pt + c[UX] * pu
            old[OLD_IMPULSE + 1] = c[NY] * pn + c[TY] * pt + c[UY] * pu
            old[OLD_IMPULSE + 2] = c[NZ] * pn + c[TZ] * pt + c[UZ] * pu
            if turning:
                remember_plane(old, c, state)
            kept += 1
    return kept
