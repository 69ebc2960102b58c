"""Contacts between the log and the terrain, and the list that every obstacle adds to (paper, sections 3.2-3.3).

A contact is predicted: each candidate point of the log is looked up where it would be a step ahead if nothing
held it, and is a contact when it would then lie below the surface. The solver lets it approach the plane it
would hit, but not cross it. First touch is met, and no push ever lifts a log out of the ground (that would add energy).

Candidates lie on rings (stations) along the axis: the point deepest along the local terrain normal, or the crest that
stands highest under the ring's stretch of the side (``crests``), and two points at 45 degrees beside it, which find the
walls of a channel; on the end faces, eight points of the rim. They are points of the smooth cone, not body-fixed
vertices, so a log rolls without the rolling resistance of a polygon.

Layout of the contact table (one row a contact, world axes, per unit of mass):
    R.. r, contact point from the centre of mass [m]      N.. T.. U.. normal, two tangents [-]
    AN.. AT.. AU.. r x direction                          BN.. BT.. BU.. inverse inertia times these
    PN, PT, PU impulse [m/s]                              TARGET least normal velocity after the step [m/s]
    GAP gap now [m], negative = penetration               MU friction; BEFORE normal velocity before the step [m/s]
    SHIFT s of the friction disc (``disc_impulse``) in the sweep before
    PLANE_N, PLANE_R normal and point of the plane ahead, three each; FROM_N, FROM_R of that which the log moves along;
    TURN [m/s] its approach to the plane ahead that comes of the difference (``turning``); 0 where there is none
"""

from __future__ import annotations

import math

from .compiled import inlined, kernel
from .crests import along_side, crest
from .limits import FLAT_TOLERANCE, HOVER, HOVER_MOST, MERGED, REFINED
from .log_body import AXIAL, BASE_RADIUS, CENTRE, LENGTH, SKEW, TIP_RADIUS, TRANSVERSE
from .rotation import DX, DY, DZ, VX, VY, VZ, WX, WY, WZ, X, Y, Z, first_axis
from .terrain import friction_at, lid_distance, surface

RX, RY, RZ, NX, NY, NZ, TX, TY, TZ, UX, UY, UZ = range(12)
ANX, ANY, ANZ, ATX, ATY, ATZ, AUX, AUY, AUZ = range(12, 21)
BNX, BNY, BNZ, BTX, BTY, BTZ, BUX, BUY, BUZ = range(21, 30)
PN, PT, PU, GNN, GTT, GUU, GNT, GNU, GTU, TARGET, GAP, MU, BEFORE_N, BEFORE_T, BEFORE_U, SHIFT = range(30, 46)
PLANE_N, PLANE_R, FROM_N, FROM_R, TURN, CONTACT_WIDTH = 46, 49, 52, 55, 58, 59
# What is kept of a loaded contact for the next step: its impulse in the world, the plane that the log
# then moves along, and the velocity along its normal
OLD_IMPULSE, OLD_N, OLD_R, OLD_SPEED, OLD_WIDTH = 0, 3, 6, 9, 10

# Kinds of contact, first column of the keys; the second is the slot (terrain) or the item (obstacle), the third a part
TERRAIN, TREE, BARRIER, LYING = 0, 1, 2, 3
KEY_WIDTH = 3
CANDIDATES = 9  # eight points on the rim of an end face and its centre; the rings between use the first three

_DIAGONAL = math.sqrt(0.5)


@kernel
def cross(ax, ay, az, bx, by, bz):
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@kernel
def set_frame(c, state, body, smooth):
    """Tangents, levers, Delassus block and velocities before the step, of a contact whose point and normal are set.

    smooth: the body is round about its axis. Then its spin brings no part of it nearer to the ground, and no push along
    a normal turns it about that axis. The lever of a candidate that is not the deepest of its ring says otherwise: by
    it a spinning end bored itself in.
    """
    rx, ry, rz, nx, ny, nz = c[RX], c[RY], c[RZ], c[NX], c[NY], c[NZ]
    # tangents: first along the axis least aligned with the normal, as in Leine et al. (2014)
    if abs(nx) <= abs(ny) and abs(nx) <= abs(nz):
        tx, ty, tz = 0.0, nz, -ny
    elif abs(ny) <= abs(nz):
        tx, ty, tz = -nz, 0.0, nx
    else:
        tx, ty, tz = ny, -nx, 0.0
    scale = 1.0 / math.sqrt(tx * tx + ty * ty + tz * tz)
    tx, ty, tz = tx * scale, ty * scale, tz * scale
    ux, uy, uz = cross(nx, ny, nz, tx, ty, tz)
    c[TX], c[TY], c[TZ] = tx, ty, tz
    c[UX], c[UY], c[UZ] = ux, uy, uz
    dx, dy, dz = state[DX], state[DY], state[DZ]
    anx, any_, anz = cross(rx, ry, rz, nx, ny, nz)
    if smooth:
        k = anx * dx + any_ * dy + anz * dz
        anx, any_, anz = anx - k * dx, any_ - k * dy, anz - k * dz
    atx, aty, atz = cross(rx, ry, rz, tx, ty, tz)
    aux, auy, auz = cross(rx, ry, rz, ux, uy, uz)
    c[ANX], c[ANY], c[ANZ] = anx, any_, anz
    c[ATX], c[ATY], c[ATZ] = atx, aty, atz
    c[AUX], c[AUY], c[AUZ] = aux, auy, auz
    ia = 1.0 / body[TRANSVERSE]
    ic = 1.0 / body[AXIAL] - ia
    k = ic * (anx * dx + any_ * dy + anz * dz)
    bnx, bny, bnz = ia * anx + k * dx, ia * any_ + k * dy, ia * anz + k * dz
    k = ic * (atx * dx + aty * dy + atz * dz)
    btx, bty, btz = ia * atx + k * dx, ia * aty + k * dy, ia * atz + k * dz
    k = ic * (aux * dx + auy * dy + auz * dz)
    bux, buy, buz = ia * aux + k * dx, ia * auy + k * dy, ia * auz + k * dz
    if body[SKEW] != 0.0:
        fx, fy, fz = first_axis(state)
        k = body[SKEW] * (anx * fx + any_ * fy + anz * fz)
        bnx, bny, bnz = bnx + k * fx, bny + k * fy, bnz + k * fz
        k = body[SKEW] * (atx * fx + aty * fy + atz * fz)
        btx, bty, btz = btx + k * fx, bty + k * fy, btz + k * fz
        k = body[SKEW] * (aux * fx + auy * fy + auz * fz)
        bux, buy, buz = bux + k * fx, buy + k * fy, buz + k * fz
    c[BNX], c[BNY], c[BNZ] = bnx, bny, bnz
    c[BTX], c[BTY], c[BTZ] = btx, bty, btz
    c[BUX], c[BUY], c[BUZ] = bux, buy, buz
    c[GNN] = 1.0 + anx * bnx + any_ * bny + anz * bnz
    c[GTT] = 1.0 + atx * btx + aty * bty + atz * btz
    c[GUU] = 1.0 + aux * bux + auy * buy + auz * buz
    c[GNT] = anx * btx + any_ * bty + anz * btz
    c[GNU] = anx * bux + any_ * buy + anz * buz
    c[GTU] = atx * bux + aty * buy + atz * buz
    vx, vy, vz, wx, wy, wz = state[VX], state[VY], state[VZ], state[WX], state[WY], state[WZ]
    c[BEFORE_N] = nx * vx + ny * vy + nz * vz + anx * wx + any_ * wy + anz * wz
    c[BEFORE_T] = tx * vx + ty * vy + tz * vz + atx * wx + aty * wy + atz * wz
    c[BEFORE_U] = ux * vx + uy * vy + uz * vz + aux * wx + auy * wy + auz * wz


@kernel
def add_contact(contacts, keys, count, state, body, key, rx, ry, rz, nx, ny, nz, mu, gap, step, ahead, smooth):
    """Append one contact: its frame (``set_frame``), and the least normal velocity after the step.

    gap is the gap predicted for the time ``ahead`` [s] within the step; the gap now follows from the free velocity
    along the normal. step = (dt, restitution, gravity, ...).
    key is (kind, slot or item, part). Returns the new count; a full table keeps what it has (``scratch`` sizes it).
    smooth: as ``set_frame``.
    """
    if count >= contacts.shape[0]:
        return count
    dt, restitution, gravity = step[0], step[1], step[2]
    keys[count, 0], keys[count, 1], keys[count, 2] = key
    c = contacts[count]
    c[RX], c[RY], c[RZ] = c[PLANE_R], c[PLANE_R + 1], c[PLANE_R + 2] = rx, ry, rz
    c[NX], c[NY], c[NZ] = c[PLANE_N], c[PLANE_N + 1], c[PLANE_N + 2] = nx, ny, nz
    set_frame(c, state, body, smooth)
    before = c[BEFORE_N]
    now = gap - ahead * (before - 0.5 * nz * gravity * ahead)
    c[GAP] = now
    # A gap that gravity closes within the step counts as closed, or contacts of a resting log would flicker
    now -= min(HOVER * gravity * dt * dt, HOVER_MOST)
    c[TARGET] = -now / dt if now > 0.0 else 0.0
    if restitution > 0.0 and before < -2.0 * gravity * dt:
        c[TARGET] = -restitution * before  # Newton's impact law, eq. 8; what gravity adds in two steps is no impact
    c[MU], c[TURN] = mu, 0.0
    c[PN], c[PT], c[PU], c[SHIFT] = 0.0, 0.0, 0.0, 0.0
    return count + 1


@kernel
def ground_contact(terrain, frame, contacts, keys, count, state, body, r, gap, slope, mu, slot, step, smooth):
    """Add the contact of point r (from the centre of mass) with the facet of gradient ``slope``."""
    nz = 1.0 / math.sqrt(1.0 + slope[0] * slope[0] + slope[1] * slope[1])
    before = count
    count = add_contact(
        contacts, keys, count, state, body, (TERRAIN, slot, 0), r[0], r[1], r[2],
        -slope[0] * nz, -slope[1] * nz, nz, mu, gap * nz, step, step[0], smooth,
    )  # fmt: skip
    if count > before:
        # The penetration reported is measured on the surface below the point itself, not on the predicted facet's plane
        height, gx, gy = surface(terrain, frame[0], frame[1], state[X] + r[0], state[Y] + r[1])
        contacts[before, GAP] = (state[Z] + r[2] - height) / math.sqrt(1.0 + gx * gx + gy * gy)
    return count


@kernel
def _deepest_on(terrain, i0, j0, cx, cy, cz, dx, dy, dz, a, gx, gy):
    """Point of a ring (centre c, axis d, radius a) deepest against the slope (gx, gy), and the surface below it."""
    nd = dz - gx * dx - gy * dy
    ex, ey, ez = nd * dx + gx, nd * dy + gy, nd * dz - 1.0
    size = math.sqrt(ex * ex + ey * ey + ez * ez)
    if size < FLAT_TOLERANCE:
        return 0.0, 0.0, math.inf, 0.0, 0.0, 0.0
    ex, ey, ez = a * ex / size, a * ey / size, a * ez / size
    height, gx, gy = surface(terrain, i0, j0, cx + ex, cy + ey)
    return ex, ey, ez, height, gx, gy


@kernel
def touch(terrain, frame, contacts, keys, count, state, body, trial, key, p, n, gap, step):
    """Add the contact of an obstacle at the predicted point p with normal n.

    step = (dt, restitution, gravity, obstacle travel, time [s] within the step for which ``trial`` is the pose).

    The lever is taken back to the present axis: the axis turns within the step, and the present spin about it (tens
    of rad/s) times that turn would pass for a speed along the normal.
    """
    rx, ry, rz = p[0] - trial[3], p[1] - trial[4], p[2] - trial[5]
    s = rx * trial[0] + ry * trial[1] + rz * trial[2]
    rx, ry, rz = rx + s * (state[DX] - trial[0]), ry + s * (state[DY] - trial[1]), rz + s * (state[DZ] - trial[2])
    mu = friction_at(terrain, frame[0], frame[1], p[0], p[1])
    return add_contact(
        contacts, keys, count, state, body, key, rx, ry, rz, n[0], n[1], n[2], mu, gap, step, step[4], True
    )


@kernel
def pierced_end(state, body, trial, end, px, py, pz):
    """Gap of a fixed point (the top of a stump, the edge of a plate) under an end face (0 base, 1 tip), and whether
    it is there: within the face, and less deep than under the log's side or still outside before this step."""
    outward = -1.0 if end == 0 else 1.0
    s = -body[CENTRE] if end == 0 else body[LENGTH] - body[CENTRE]
    a = body[BASE_RADIUS] if end == 0 else body[TIP_RADIUS]
    rx = px - trial[3] - s * trial[0]
    ry = py - trial[4] - s * trial[1]
    rz = pz - trial[5] - s * trial[2]
    along = rx * trial[0] + ry * trial[1] + rz * trial[2]
    aside = math.sqrt(max(0.0, rx * rx + ry * ry + rz * rz - along * along))
    gap = outward * along
    if gap >= 0.0 or aside >= a:
        return gap, False
    rx = px - state[X] - s * state[DX]
    ry = py - state[Y] - s * state[DY]
    rz = pz - state[Z] - s * state[DZ]
    now = outward * (rx * state[DX] + ry * state[DY] + rz * state[DZ])
    return gap, -gap < a - aside or now >= 0.0


@inlined
def terrain_contacts(terrain, frame, contacts, keys, state, body, stations, points, step, trial, path, advance, wake):
    """Find the terrain contacts of this step.

    stations is the number of rings; those between the ends have 1 or 3 candidate ``points``. frame holds the log's node
    (column i0, row j0); step is that of the obstacles.
    trial[0:6] holds the predicted axis (direction, centre). path [m]: how far any point of the log can have moved so
    far; advance [m]: in this step. A ring is not looked at before the path reaches its ``wake``.
    Returns (count, least wake of the rings [m], whether there is terrain below every ring).
    """
    dx, dy, dz = state[DX], state[DY], state[DZ]
    qx, qy, qz = trial[0], trial[1], trial[2]
    ox, oy, oz = trial[3], trial[4], trial[5]
    length, centre = body[LENGTH], body[CENTRE]
    taper = (body[TIP_RADIUS] - body[BASE_RADIUS]) / length
    between = length / (stations - 1)
    # the bound on roughness covers three cells around the ring's centre, so thicker rings are always looked at
    thick = body[BASE_RADIUS] > terrain.cell
    block = terrain.lid_cells * terrain.cell
    ahead = path + advance
    count = 0
    earliest = math.inf
    whole = True
    i0, j0 = frame[0], frame[1]
    for k in range(stations):
        if ahead < wake[k]:
            earliest = min(earliest, wake[k])
            continue
        along = k * between
        s = along - centre
        a = body[BASE_RADIUS] + taper * along
        free = lid_distance(terrain, i0, j0, state[X] + s * dx, state[Y] + s * dy, state[Z] + s * dz) - a
        wake[k] = path + min(free, block - a)
        earliest = min(earliest, wake[k])
        if ahead < wake[k]:
            continue
        cx, cy, cz = ox + s * qx, oy + s * qy, oz + s * qz
        height, gx, gy = surface(terrain, i0, j0, cx, cy)
        square = gx * gx + gy * gy
        # vertical gap below the ring if the terrain were its tangent plane; 1 + g^2/2 bounds the plane's 1/n_z
        gap = cz - height - a * (1.0 + 0.5 * square)
        if gap != gap:
            whole = False
            continue
        rise = math.inf
        if not thick:
            i = i0 + int(math.floor(cx * terrain.inverse_cell))
            j = j0 + int(math.floor(cy * terrain.inverse_cell))
            rise = terrain.roughness[j, i]
        if gap > rise:
            continue
        nz = 1.0 / math.sqrt(1.0 + square)
        nx, ny = -gx * nz, -gy * nz
        nd = nx * dx + ny * dy + nz * dz
        size = math.sqrt(max(0.0, 1.0 - nd * nd))
        above = (cz - height - rise) * nz
        # support direction on the ring: against the normal, square to the axis
        ex, ey, ez = nd * dx - nx, nd * dy - ny, nd * dz - nz
        if size < 1e-6:
            # axis along the normal: every point of the ring is as deep as any other
            if abs(dx) < 0.9:
                ex, ey, ez = 1.0 - dx * dx, -dx * dy, -dx * dz
            else:
                ex, ey, ez = -dy * dx, 1.0 - dy * dy, -dy * dz
        scale = a / math.sqrt(ex * ex + ey * ey + ez * ez)
        ex, ey, ez = scale * ex, scale * ey, scale * ez
        fx, fy, fz = cross(dx, dy, dz, ex, ey, ez)
        # the stretch of the side that this ring answers for: halfway to the next, and up to the ends
        side = 0 < k < stations - 1
        low = -between if k == 1 else -0.5 * between
        high = between if k == stations - 2 else 0.5 * between
        ox1, oy1, oz1, ox2, oy2, oz2 = math.inf, 0.0, 0.0, math.inf, 0.0, 0.0
        for m in range(CANDIDATES if k == 0 or k == stations - 1 else points):
            if m == 0:
                ce, cf = 1.0, 0.0
            elif m < 3:
                ce, cf = _DIAGONAL, _DIAGONAL if m == 1 else -_DIAGONAL
            elif m < 5:
                ce, cf = 0.0, 1.0 if m == 3 else -1.0
            elif m < 7:
                ce, cf = -_DIAGONAL, _DIAGONAL if m == 5 else -_DIAGONAL
            else:
                # the rim's last, and the middle of the face, where ground may poke into a standing log
                ce, cf = -1.0 if m == 7 else 0.0, 0.0
            # a point this far above the tangent plane is out of the terrain's reach
            if above > a * size * ce:
                continue
            rx, ry, rz = ce * ex + cf * fx, ce * ey + cf * fy, ce * ez + cf * fz
            px, py = cx + rx, cy + ry
            height, gx, gy = surface(terrain, i0, j0, px, py)
            if m < 3 and cz + rz - height < REFINED * a:
                # once more, square to the ground found there: deeper by up to 8 % of the radius, and exact on a plane
                hx, hy, hz, other, kx, ky = _deepest_on(terrain, i0, j0, cx, cy, cz, dx, dy, dz, a, gx, gy)
                if cz + hz - other < cz + rz - height:
                    rx, ry, rz, height, gx, gy = hx, hy, hz, other, kx, ky
                    px, py = cx + rx, cy + ry
                # two that have met at one point are one contact
                if m == 0:
                    ox1, oy1, oz1, ox2, oy2, oz2 = rx, ry, rz, rx, ry, rz
                else:
                    one = (rx - ox1) ** 2 + (ry - oy1) ** 2 + (rz - oz1) ** 2
                    two = (rx - ox2) ** 2 + (ry - oy2) ** 2 + (rz - oz2) ** 2
                    if min(one, two) < (MERGED * a) ** 2:
                        continue
                    ox2, oy2, oz2 = rx, ry, rz
            gap, t = cz + rz - height, 0.0
            found = False
            if m == 0 and side:
                found, ct, hx, hy, hz, lower, kx, ky = crest(
                    terrain, i0, j0, cx, cy, cz, qx, qy, qz, rx, ry, rz, a, taper, low, high, gap
                )
                if found:
                    t, rx, ry, rz, gap, gx, gy = ct, hx, hy, hz, lower, kx, ky
                    px, py = cx + t * qx + rx, cy + t * qy + ry
            # predicted below the surface (a NaN height, no ground, compares false)
            if gap < 0.0:
                if side and not found:
                    reach = max(between, 2.0 * terrain.cell)
                    gx, gy = along_side(terrain, i0, j0, px, py, height, gx, gy, dx, dy, dz, a, taper, reach)
                r = ((s + t) * dx + rx, (s + t) * dy + ry, (s + t) * dz + rz)
                count = ground_contact(
                    terrain, frame, contacts, keys, count, state, body, r, gap, (gx, gy),
                    friction_at(terrain, i0, j0, px, py), k * CANDIDATES + m, step, True,
                )  # fmt: skip
    return count, earliest, whole


@kernel
def predict(state, dt, gravity, trial):
    """Axis of the log a step ahead of free motion: trial[0:3] direction, trial[3:6] centre of mass [m]."""
    tx, ty, tz = cross(state[WX], state[WY], state[WZ], state[DX], state[DY], state[DZ])
    qx, qy, qz = state[DX] + dt * tx, state[DY] + dt * ty, state[DZ] + dt * tz
    scale = 1.0 / math.sqrt(qx * qx + qy * qy + qz * qz)
    trial[0], trial[1], trial[2] = qx * scale, qy * scale, qz * scale
    trial[3], trial[4] = state[X] + dt * state[VX], state[Y] + dt * state[VY]
    trial[5] = state[Z] + dt * (state[VZ] - 0.5 * gravity * dt)


@kernel
def clearance(terrain, frame, state, body, stations):
    """Gap [m] of the lowest ring over the tangent plane below it; not below 0, and 0 where there is no terrain."""
    dx, dy, dz = state[DX], state[DY], state[DZ]
    taper = (body[TIP_RADIUS] - body[BASE_RADIUS]) / body[LENGTH]
    between = body[LENGTH] / (stations - 1)
    lowest, least = math.inf, 0.0
    for k in range(stations):
        s = k * between - body[CENTRE]
        a = body[BASE_RADIUS] + taper * k * between
        height, gx, gy = surface(terrain, frame[0], frame[1], state[X] + s * dx, state[Y] + s * dy)
        square = gx * gx + gy * gy
        above = state[Z] + s * dz - height
        gap = above - a * (1.0 + 0.5 * square)
        if gap < lowest:
            nz = 1.0 / math.sqrt(1.0 + square)
            nd = nz * (dz - gx * dx - gy * dy)
            lowest, least = gap, above * nz - a * math.sqrt(max(0.0, 1.0 - nd * nd))
    return max(0.0, least)
