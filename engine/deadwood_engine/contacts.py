"""The contact table: what terrain (``rings``) and obstacles add to, and the solver reads (paper, sections 3.2-3.3).

A contact is predicted: a point of the log is looked up where it would be a step ahead if nothing
held it, and is a contact when it would then lie below the surface. The solver lets it approach the plane it
would hit, but not cross it. First touch is met, and no push ever lifts a log out of the ground (that would add energy).

Layout of the contact table (one row a contact, world axes, per unit of mass):
    R.. r, contact point from the centre of mass [m]      N.. T.. U.. normal, two tangents [-]
    AN.. AT.. AU.. r x direction                          BN.. BT.. BU.. inverse inertia times these
    PN, PT, PU impulse [m/s]                              TARGET least normal velocity after the step [m/s]
    GAP gap now [m], negative = penetration               MU friction; BEFORE normal velocity before the step [m/s]
    SHIFT s of the friction disc (``disc_impulse``) in the sweep before
    PLANE_N, PLANE_R normal and point of the plane ahead, three each; FROM_N, FROM_R of that which the log moves along;
    TURN [m/s] its approach to the plane ahead that comes of the difference (``turning``); 0 where there is none
    OLD_ROW row of the same contact among those kept of the step before (``find_old``), -1 where it is new
    ROLL most moment about the log's axis that resists rolling, per normal impulse [m] (``rolling``)
"""

from __future__ import annotations

import math
from typing import NamedTuple

from .compiled import inlined, kernel
from .limits import HOVER, HOVER_MOST
from .log_body import AXIAL, SKEW, TRANSVERSE
from .rotation import DX, DY, DZ, VX, VY, VZ, WX, WY, WZ, X, Y, Z, first_axis
from .terrain import friction_at, surface
from .vectors import cross

RX, RY, RZ, NX, NY, NZ, TX, TY, TZ, UX, UY, UZ = range(12)
ANX, ANY, ANZ, ATX, ATY, ATZ, AUX, AUY, AUZ = range(12, 21)
BNX, BNY, BNZ, BTX, BTY, BTZ, BUX, BUY, BUZ = range(21, 30)
PN, PT, PU, GNN, GTT, GUU, GNT, GNU, GTU, TARGET, GAP, MU, BEFORE_N, BEFORE_T, BEFORE_U, SHIFT = range(30, 46)
PLANE_N, PLANE_R, FROM_N, FROM_R, TURN, OLD_ROW, ROLL, CONTACT_WIDTH = 46, 49, 52, 55, 58, 59, 60, 61
# What is kept of a loaded contact for the next step: its impulse in the world, the plane that the log
# then moves along, and the velocity along its normal
OLD_IMPULSE, OLD_N, OLD_R, OLD_SPEED, OLD_WIDTH = 0, 3, 6, 9, 10

# Kind of contact, first column of the keys: terrain, or a kind of obstacle (``cores``); the second is the slot
# (terrain) or the row among all cores, the third a part
TERRAIN = 0
KEY_WIDTH = 3


class Ahead(NamedTuple):
    """The step whose contacts are sought, and the pose in it for which they are found."""

    dt: float  # [s]
    gravity: float  # [m/s2]
    at: float  # [s] within the step, of that pose
    restitution: float  # [-] of what is touched
    friction: float  # [-] of what is touched; below 0: the ground's there
    rolling: float  # [-] coefficient of rolling friction of what is touched


@kernel
def set_normal(c, state, smooth):
    """Lever of the normal, and velocity along it before the step, of a contact whose point and normal are set.

    smooth: the body is round about its axis. Then its spin brings no part of it nearer to the ground, and no push along
    a normal turns it about that axis. The lever of a candidate that is not the deepest of its ring says otherwise: by
    it a spinning end bored itself in.
    """
    nx, ny, nz = c[NX], c[NY], c[NZ]
    ax, ay, az = cross(c[RX], c[RY], c[RZ], nx, ny, nz)
    if smooth:
        dx, dy, dz = state[DX], state[DY], state[DZ]
        k = ax * dx + ay * dy + az * dz
        ax, ay, az = ax - k * dx, ay - k * dy, az - k * dz
    c[ANX], c[ANY], c[ANZ] = ax, ay, az
    vx, vy, vz, wx, wy, wz = state[VX], state[VY], state[VZ], state[WX], state[WY], state[WZ]
    c[BEFORE_N] = nx * vx + ny * vy + nz * vz + ax * wx + ay * wy + az * wz


@inlined
def set_frames(contacts, count, state, body):
    """Tangents, their levers, Delassus blocks and velocities before the step, of contacts with a normal and its lever.

    Once for all, when no normal changes any more (``turning``).
    """
    dx, dy, dz = state[DX], state[DY], state[DZ]
    vx, vy, vz, wx, wy, wz = state[VX], state[VY], state[VZ], state[WX], state[WY], state[WZ]
    ia = 1.0 / body[TRANSVERSE]
    ic = 1.0 / body[AXIAL] - ia
    for row in range(count):
        c = contacts[row]
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
        anx, any_, anz = c[ANX], c[ANY], c[ANZ]
        atx, aty, atz = cross(rx, ry, rz, tx, ty, tz)
        aux, auy, auz = cross(rx, ry, rz, ux, uy, uz)
        c[ATX], c[ATY], c[ATZ] = atx, aty, atz
        c[AUX], c[AUY], c[AUZ] = aux, auy, auz
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
        c[BEFORE_T] = tx * vx + ty * vy + tz * vz + atx * wx + aty * wy + atz * wz
        c[BEFORE_U] = ux * vx + uy * vy + uz * vz + aux * wx + auy * wy + auz * wz


@kernel
def add_contact(contacts, keys, count, state, key, rx, ry, rz, nx, ny, nz, mu, gap, step, smooth):
    """Append one contact: point, normal, and the least normal velocity after the step; its frame is left to
    ``set_frames``.

    gap is the gap predicted for the pose of ``step`` (an ``Ahead``); the gap now follows from the free velocity along
    the normal.
    key is (kind, slot or item, part). Returns the new count; a full table keeps what it has (``scratch`` sizes it).
    smooth: as ``set_normal``.
    """
    if count >= contacts.shape[0]:
        return count
    dt, restitution, gravity = step.dt, step.restitution, step.gravity
    keys[count, 0], keys[count, 1], keys[count, 2] = key
    c = contacts[count]
    c[RX], c[RY], c[RZ] = c[PLANE_R], c[PLANE_R + 1], c[PLANE_R + 2] = rx, ry, rz
    c[NX], c[NY], c[NZ] = c[PLANE_N], c[PLANE_N + 1], c[PLANE_N + 2] = nx, ny, nz
    set_normal(c, state, smooth)
    before = c[BEFORE_N]
    now = gap - step.at * (before - 0.5 * nz * gravity * step.at)
    c[GAP] = now
    # A gap that gravity closes within the step counts as closed, or contacts of a resting log would flicker
    now -= min(HOVER * gravity * dt * dt, HOVER_MOST)
    c[TARGET] = -now / dt if now > 0.0 else 0.0
    if restitution > 0.0 and before < -2.0 * gravity * dt:
        c[TARGET] = -restitution * before  # Newton's impact law, eq. 8; what gravity adds in two steps is no impact
    c[MU], c[TURN] = mu, 0.0
    c[ROLL] = 0.0
    if step.rolling > 0.0 and smooth:
        s = rx * state[DX] + ry * state[DY] + rz * state[DZ]
        c[ROLL] = step.rolling * math.sqrt(max(0.0, rx * rx + ry * ry + rz * rz - s * s))
    c[PN], c[PT], c[PU], c[SHIFT] = 0.0, 0.0, 0.0, 0.0
    return count + 1


@kernel
def any_rebound(contacts, count):
    """Whether a contact leaves with a part of the speed that it came with (eq. 8).

    Then the impulses of the step before, which held the log up, are no guess of those to come. To be asked before
    ``turning`` moves the targets.
    """
    fastest = 0.0
    for k in range(count):
        fastest = max(fastest, contacts[k, TARGET])
    return fastest > 0.0


@kernel
def ground_contact(terrain, frame, contacts, keys, count, state, r, gap, slope, mu, slot, step, smooth):
    """Add the contact of point r (from the centre of mass) with the facet of gradient ``slope``."""
    nz = 1.0 / math.sqrt(1.0 + slope[0] * slope[0] + slope[1] * slope[1])
    before = count
    count = add_contact(
        contacts, keys, count, state, (TERRAIN, slot, 0), r[0], r[1], r[2],
        -slope[0] * nz, -slope[1] * nz, nz, mu, gap * nz, step, smooth,
    )  # fmt: skip
    if count > before:
        # The penetration reported is measured on the surface below the point itself, not on the predicted facet's plane
        height, gx, gy = surface(terrain, frame[0], frame[1], state[X] + r[0], state[Y] + r[1])
        contacts[before, GAP] = (state[Z] + r[2] - height) / math.sqrt(1.0 + gx * gx + gy * gy)
    return count


@kernel
def touch(terrain, frame, contacts, keys, count, state, trial, key, p, n, gap, step):
    """Add the contact of an obstacle at the predicted point p with normal n.

    step : an ``Ahead``, of which ``trial`` is the pose

    The lever is taken back to the present axis: the axis turns within the step, and the present spin about it (tens
    of rad/s) times that turn would pass for a speed along the normal.
    """
    rx, ry, rz = p[0] - trial[3], p[1] - trial[4], p[2] - trial[5]
    s = rx * trial[0] + ry * trial[1] + rz * trial[2]
    rx, ry, rz = rx + s * (state[DX] - trial[0]), ry + s * (state[DY] - trial[1]), rz + s * (state[DZ] - trial[2])
    mu = step.friction if step.friction >= 0.0 else friction_at(terrain, frame[0], frame[1], p[0], p[1])
    return add_contact(contacts, keys, count, state, key, rx, ry, rz, n[0], n[1], n[2], mu, gap, step, True)


@kernel
def predict(state, dt, gravity, trial):
    """Axis of the log a step ahead of free motion: trial[0:3] direction, trial[3:6] centre of mass [m]."""
    tx, ty, tz = cross(state[WX], state[WY], state[WZ], state[DX], state[DY], state[DZ])
    qx, qy, qz = state[DX] + dt * tx, state[DY] + dt * ty, state[DZ] + dt * tz
    scale = 1.0 / math.sqrt(qx * qx + qy * qy + qz * qz)
    trial[0], trial[1], trial[2] = qx * scale, qy * scale, qz * scale
    trial[3], trial[4] = state[X] + dt * state[VX], state[Y] + dt * state[VY]
    trial[5] = state[Z] + dt * (state[VZ] - 0.5 * gravity * dt)
