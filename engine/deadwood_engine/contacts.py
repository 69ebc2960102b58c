"""The contact table, filled by terrain (``rings``) and obstacles and read by the solver (paper, sections 3.2-3.3).

Contacts are predicted: a point of the log is evaluated where it would be at the end of the step if nothing held it, and
is a contact if it would then be below the surface. The solver lets it approach the plane that it would hit, but not
cross it. The first touch is met, and no impulse ever lifts a log out of the ground (which would add energy).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from .compiled import inlined, kernel
from .limits import HOVER, HOVER_MOST, IMPACT
from .log_body import AXIAL, SKEW, TRANSVERSE
from .rotation import DX, DY, DZ, VX, VY, VZ, WX, WY, WZ, X, Y, Z, first_axis, square_to_axis, swing_of
from .terrain import Terrain, friction_at, surface
from .vectors import cross, dot, norm

# A contact: world axes, per unit of mass
CONTACT = np.dtype(
    [
        ("rx", "f8"),
        ("ry", "f8"),
        ("rz", "f8"),  # m, contact point relative to the centre of mass
        ("nx", "f8"),
        ("ny", "f8"),
        ("nz", "f8"),  # normal, pointing away from the touched surface
        ("tx", "f8"),
        ("ty", "f8"),
        ("tz", "f8"),
        ("ux", "f8"),
        ("uy", "f8"),
        ("uz", "f8"),  # two tangents
        ("rnx", "f8"),
        ("rny", "f8"),
        ("rnz", "f8"),  # m, lever arms: r x n, r x t, r x u
        ("rtx", "f8"),
        ("rty", "f8"),
        ("rtz", "f8"),
        ("rux", "f8"),
        ("ruy", "f8"),
        ("ruz", "f8"),
        ("bnx", "f8"),
        ("bny", "f8"),
        ("bnz", "f8"),  # 1/m, inverse inertia times these
        ("btx", "f8"),
        ("bty", "f8"),
        ("btz", "f8"),
        ("bux", "f8"),
        ("buy", "f8"),
        ("buz", "f8"),
        ("pn", "f8"),
        ("pt", "f8"),
        ("pu", "f8"),  # m/s, impulse P
        ("gnn", "f8"),
        ("gtt", "f8"),
        ("guu", "f8"),
        ("gnt", "f8"),
        ("gnu", "f8"),
        ("gtu", "f8"),  # Delassus block G
        ("target", "f8"),  # m/s, least normal velocity after the step
        ("gap", "f8"),  # m, g_N now, negative = penetration
        ("room", "f8"),  # m, gap to the predicted plane, which the step may close
        ("mu", "f8"),  # coefficient of friction
        ("before_n", "f8"),
        ("before_t", "f8"),
        ("before_u", "f8"),  # m/s, gamma before the impulses of the step
        ("shift", "f8"),  # s of the friction disc (``disc_impulse``) in the previous sweep
        # normal and point of the predicted plane, and of the plane along which the log moves
        ("ahead_nx", "f8"),
        ("ahead_ny", "f8"),
        ("ahead_nz", "f8"),
        ("ahead_rx", "f8"),
        ("ahead_ry", "f8"),
        ("ahead_rz", "f8"),
        ("from_nx", "f8"),
        ("from_ny", "f8"),
        ("from_nz", "f8"),
        ("from_rx", "f8"),
        ("from_ry", "f8"),
        ("from_rz", "f8"),
        ("turn", "f8"),  # m/s, approach to the predicted plane due to the difference of the two (``turning``), or 0
        ("old_row", "i8"),  # row of the same contact among those stored in the previous step (``find_old``), -1: new
        ("roll", "f8"),  # m, greatest moment that resists rolling, per normal impulse (``rolling``)
        ("line", "i8"),  # number of contacts on one straight line, from this one on; -1 inside, 0 none (``pressure``)
        ("pressed", "f8"),  # m/s, change of pn due to the line
        ("last_n", "f8"),
        ("last_t", "f8"),
        ("last_u", "f8"),  # m/s, change of P in the last sweep
        ("rebound", "f8"),  # m/s, what restitution adds to the target
        ("tried_n", "f8"),
        ("tried_t", "f8"),
        ("tried_u", "f8"),  # m/s, P of a solve with restitution (``impacts``)
        ("limit", "f8"),  # m/s, limit of friction where a solve does not converge (``impacts``)
        ("along", "f8"),
        ("stretch", "f8"),  # m, position along the log's axis, length represented on the line
    ]
)

# What is stored of a loaded contact for the next step
OLD_CONTACT = np.dtype(
    [
        ("px", "f8"),
        ("py", "f8"),
        ("pz", "f8"),  # m/s, its impulse in world axes
        ("nx", "f8"),
        ("ny", "f8"),
        ("nz", "f8"),  # the plane along which the log then moves: normal and point [m]
        ("rx", "f8"),
        ("ry", "f8"),
        ("rz", "f8"),
        ("speed", "f8"),  # m/s, velocity along that normal
    ]
)

# Kind of contact, first column of the keys: terrain, or a kind of obstacle (``cores``); the second column is the slot
# (terrain) or the row among all cores, the third a part
TERRAIN = 0
KEY_WIDTH = 3


class Found(NamedTuple):
    """A contact as detection finds it, at the pose of an ``Ahead``."""

    key: tuple[int, int, int]  # (kind, slot or row, part): the contact's key
    r: tuple[float, float, float]  # [m] point, relative to the centre of mass
    n: tuple[float, float, float]  # normal, pointing away from the touched surface
    gap: float  # [m] predicted, negative: penetration
    mu: float  # coefficient of friction


class Facet(NamedTuple):
    """The ground below a point of a body that reaches it."""

    slot: int  # of the point in the contact's key
    r: tuple[float, float, float]  # [m] point, relative to the centre of mass
    gap: float  # [m] vertical, predicted
    slope: tuple[float, float]  # [-] gradient of the ground
    mu: float  # coefficient of friction
    crest: bool  # whether its plane is that of a crest and of the body's side, which may hang over the terrain's border


class Ground(NamedTuple):
    """The terrain below a body, and the table that receives its contacts with it."""

    terrain: Terrain
    frame: np.ndarray  # DEM node of the body's frame (column, row)
    contacts: np.ndarray
    keys: np.ndarray
    state: np.ndarray  # at the node from which the step starts


class Query(NamedTuple):
    """A log at one pose of a step, whose contacts with obstacles are sought, and the table that receives them."""

    terrain: Terrain
    frame: np.ndarray  # DEM node of the log's frame (column, row)
    contacts: np.ndarray
    keys: np.ndarray
    state: np.ndarray  # at the node from which the step starts
    pose: Any  # a ``surroundings.POSE``
    cone: Any  # the trapezoid that generates the log (``narrow_phase.Cone``)


class Ahead(NamedTuple):
    """The step whose contacts are sought, and the pose within it for which they are found."""

    dt: float  # [s]
    gravity: float  # [m/s2]
    at: float  # [s] time of that pose within the step
    restitution: float  # [-] of the touched surface
    friction: float  # [-] of the touched surface; negative: that of the ground there
    rolling: float  # [-] coefficient of rolling friction of the touched surface


@kernel
def along_normal(c, v, w):
    """Velocity [m/s] along a contact's normal of a body with velocity v [m/s] and angular velocity w [1/s] (eq. 6)."""
    return dot((c.nx, c.ny, c.nz), v) + dot((c.rnx, c.rny, c.rnz), w)


@kernel
def along_t(c, v, w):
    """The same along its first tangent."""
    return dot((c.tx, c.ty, c.tz), v) + dot((c.rtx, c.rty, c.rtz), w)


@kernel
def along_u(c, v, w):
    """The same along its second tangent."""
    return dot((c.ux, c.uy, c.uz), v) + dot((c.rux, c.ruy, c.ruz), w)


@kernel
def pushed(c, v, w, p):
    """Velocities (v, w) [m/s, 1/s] of a body after a contact's impulse p = (n, t, u), per mass [m/s] (eq. 5):
    v + n p_n + t p_t + u p_u,  w + I^-1 (r x n p_n + r x t p_t + r x u p_u).
    """
    pn, pt, pu = p
    return (
        (
            v[0] + (c.nx * pn + c.tx * pt + c.ux * pu),
            v[1] + (c.ny * pn + c.ty * pt + c.uy * pu),
            v[2] + (c.nz * pn + c.tz * pt + c.uz * pu),
        ),
        (
            w[0] + (c.bnx * pn + c.btx * pt + c.bux * pu),
            w[1] + (c.bny * pn + c.bty * pt + c.buy * pu),
            w[2] + (c.bnz * pn + c.btz * pt + c.buz * pu),
        ),
    )


@kernel
def set_normal(c, state, smooth):
    """Lever arm of the normal, and velocity along it before the step, of a contact whose point and normal are set.

    smooth: the body is round about its axis. Its spin then brings no part of it nearer to the ground, and no impulse
    along a normal turns it about that axis. The exact lever arm of a candidate that is not the deepest of its ring
    would differ: with it, a spinning end drilled itself into the ground.
    """
    a = cross((c.rx, c.ry, c.rz), (c.nx, c.ny, c.nz))
    if smooth:
        a = square_to_axis(state, a)
    c.rnx, c.rny, c.rnz = a
    c.before_n = along_normal(c, (state[VX], state[VY], state[VZ]), (state[WX], state[WY], state[WZ]))


@inlined
def set_frames(contacts, count, state, body):
    """Tangents, their lever arms, Delassus blocks and velocities before the step, of contacts whose normals are set.

    Called once, when no normal changes any more (``turning``).
    """
    dx, dy, dz = state[DX], state[DY], state[DZ]
    v, w = (state[VX], state[VY], state[VZ]), (state[WX], state[WY], state[WZ])
    ia = 1.0 / body[TRANSVERSE]
    ic = 1.0 / body[AXIAL] - ia
    for row in range(count):
        c = contacts[row]
        rx, ry, rz, nx, ny, nz = c.rx, c.ry, c.rz, c.nx, c.ny, c.nz
        # tangents: the first along the axis least aligned with the normal, as in Leine et al. (2014)
        if abs(nx) <= abs(ny) and abs(nx) <= abs(nz):
            tx, ty, tz = 0.0, nz, -ny
        elif abs(ny) <= abs(nz):
            tx, ty, tz = -nz, 0.0, nx
        else:
            tx, ty, tz = ny, -nx, 0.0
        scale = 1.0 / norm((tx, ty, tz))
        tx, ty, tz = tx * scale, ty * scale, tz * scale
        ux, uy, uz = cross((nx, ny, nz), (tx, ty, tz))
        c.tx, c.ty, c.tz = tx, ty, tz
        c.ux, c.uy, c.uz = ux, uy, uz
        anx, any_, anz = c.rnx, c.rny, c.rnz
        atx, aty, atz = cross((rx, ry, rz), (tx, ty, tz))
        aux, auy, auz = cross((rx, ry, rz), (ux, uy, uz))
        c.rtx, c.rty, c.rtz = atx, aty, atz
        c.rux, c.ruy, c.ruz = aux, auy, auz
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
        c.bnx, c.bny, c.bnz = bnx, bny, bnz
        c.btx, c.bty, c.btz = btx, bty, btz
        c.bux, c.buy, c.buz = bux, buy, buz
        c.gnn = 1.0 + anx * bnx + any_ * bny + anz * bnz
        c.gtt = 1.0 + atx * btx + aty * bty + atz * btz
        c.guu = 1.0 + aux * bux + auy * buy + auz * buz
        c.gnt = anx * btx + any_ * bty + anz * btz
        c.gnu = anx * bux + any_ * buy + anz * buz
        c.gtu = atx * bux + aty * buy + atz * buz
        c.before_t = along_t(c, v, w)
        c.before_u = along_u(c, v, w)


@kernel
def add_contact(contacts, keys, count, state, found, step, smooth):
    """Append one contact: point, normal, and the least normal velocity after the step (eq. 6, 8 and 9); its frame
    is set later, by ``set_frames``.

        g_N = gap - t (gamma_N - n_z g t / 2)                              [m] present gap: gap is that after the time t
        b0 = -max(0, g_N) / dt                                             [m/s] a gap may close, and no more
        b = max(b0, -eps gamma_N - n_z g dt / 2)                           [m/s] Newton's law, for an impact

    found : a ``Found``; step : an ``Ahead``, for whose pose it was found; smooth : as in ``set_normal``
    Returns the new count; a full table ignores further contacts (``scratch`` sizes it).
    """
    if count >= contacts.shape[0]:
        return count
    dt, restitution, gravity = step.dt, step.restitution, step.gravity
    keys[count, 0], keys[count, 1], keys[count, 2] = found.key
    c, r, nz = contacts[count], found.r, found.n[2]
    c.rx, c.ry, c.rz = c.ahead_rx, c.ahead_ry, c.ahead_rz = r
    c.nx, c.ny, c.nz = c.ahead_nx, c.ahead_ny, c.ahead_nz = found.n
    set_normal(c, state, smooth)
    before = c.before_n
    now = found.gap - step.at * (before - 0.5 * nz * gravity * step.at)
    c.gap = c.room = now
    # A gap that gravity closes within the step counts as closed; otherwise the contacts of a resting log would flicker
    now -= min(HOVER * gravity * dt * dt, HOVER_MOST)
    c.target = -now / dt if now > 0.0 else 0.0
    c.rebound = 0.0
    if restitution > 0.0 and before < -IMPACT * gravity * dt:
        # Newton's impact law, eq. 8, holds for the velocities at the node; by the middle of the step gravity has acted
        # for half of it. With -eps gamma- as the target there, a log rose by eps v dt / 2 too high
        c.rebound = max(0.0, -restitution * before - 0.5 * nz * gravity * dt - c.target)
        c.target += c.rebound
    c.mu, c.turn = found.mu, 0.0
    c.roll = 0.0
    if step.rolling > 0.0 and smooth:
        s = dot(r, (state[DX], state[DY], state[DZ]))
        c.roll = step.rolling * math.sqrt(max(0.0, dot(r, r) - s * s))
    c.pn, c.pt, c.pu, c.shift = 0.0, 0.0, 0.0, 0.0
    c.last_n, c.last_t, c.last_u, c.line = 0.0, 0.0, 0.0, 0
    return count + 1


@kernel
def touch_time(c, gravity):
    """Time [s] in which the point of a contact reaches the plane that it would hit; 0 if it is there."""
    root = math.sqrt(max(0.0, c.before_n * c.before_n + 2.0 * gravity * c.nz * c.room))
    return 2.0 * max(0.0, c.room) / (root - c.before_n)


@kernel
def first_rebound(contacts, count, gravity):
    """Time [s] within the step at which the first rebounding contact touches (eq. 8); infinity if none does.

    A log that still has some distance to travel must not rebound earlier: it would continue above the ground, fall
    back, and lose the work g dt delta / 2 in addition to the impact's dissipation. To be called before ``turning``
    changes the targets.
    """
    first = math.inf
    for k in range(count):
        if contacts[k].target > 0.0:
            first = min(first, touch_time(contacts[k], gravity))
    return first


@kernel
def first_strike(contacts, count, gravity, least):
    """Time [s] within the step at which the log first strikes something; infinity if it does not.

    least : [m/s] slowest approach that is a strike

    The contacts are those of the pose at the end of the step. Where the log has struck by then, it was another facet
    of the ground, on average a steeper one, since it is the steep ones that a log meets first. With the normals of the
    end, logs jumped 8 to 9 % less high, with 0.4 cells a step, and stopped too early in a gully.
    """
    first = math.inf
    for k in range(count):
        if contacts[k].before_n < -least:
            first = min(first, touch_time(contacts[k], gravity))
    return first


@kernel
def ground_contact(ground, count, step, facet, smooth):
    """Add the contact of a point with a ``Facet`` of the ``Ground``; returns the new count.

    step : an ``Ahead``, for whose pose it was found; smooth : as in ``set_normal``
    """
    terrain, frame, contacts, keys, state = ground
    (gx, gy), r = facet.slope, facet.r
    nz = 1.0 / math.sqrt(1.0 + gx * gx + gy * gy)
    before = count
    found = Found((TERRAIN, facet.slot, 0), r, (-gx * nz, -gy * nz, nz), facet.gap * nz, facet.mu)
    count = add_contact(contacts, keys, count, state, found, step, smooth)
    if count > before:
        # The reported penetration is measured at the surface below the point itself, not at the plane of the predicted
        # facet
        height, gx, gy = surface(terrain, frame[0], frame[1], state[X] + r[0], state[Y] + r[1])
        if height == height or not facet.crest:
            contacts[before].gap = (state[Z] + r[2] - height) / math.sqrt(1.0 + gx * gx + gy * gy)
    return count


@kernel
def touch(query, count, step, key, p, n, gap):
    """Add the contact of an obstacle at the point p [m] of the query's pose, with normal n and gap [m]; returns the new
    count. step : an ``Ahead``, for that pose

    The lever arm is rotated back to the present axis: the axis turns within the step, and the present spin about it
    (tens of rad/s) times that rotation would appear as a velocity along the normal.
    """
    state, pose, frame = query.state, query.pose, query.frame
    rx, ry, rz = p[0] - pose.x, p[1] - pose.y, p[2] - pose.z
    s = dot((rx, ry, rz), (pose.dx, pose.dy, pose.dz))
    r = (rx + s * (state[DX] - pose.dx), ry + s * (state[DY] - pose.dy), rz + s * (state[DZ] - pose.dz))
    mu = step.friction if step.friction >= 0.0 else friction_at(query.terrain, frame[0], frame[1], p[0], p[1])
    return add_contact(query.contacts, query.keys, count, state, Found(key, r, n, gap, mu), step, True)


@kernel
def predict(state, dt, gravity, trial):
    """Pose of a log after free motion for dt, into ``trial`` (``surroundings.POSE``)."""
    tx, ty, tz = swing_of(state)
    qx, qy, qz = state[DX] + dt * tx, state[DY] + dt * ty, state[DZ] + dt * tz
    scale = 1.0 / norm((qx, qy, qz))
    trial.dx, trial.dy, trial.dz = qx * scale, qy * scale, qz * scale
    trial.x, trial.y = state[X] + dt * state[VX], state[Y] + dt * state[VY]
    trial.z = state[Z] + dt * (state[VZ] - 0.5 * gravity * dt)
