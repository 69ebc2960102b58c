"""Barriers: thin rigid vertical plates along a line in plan, which stop a log or are overjumped by it (paper, 3.4).

A plate has no thickness, so penetration depth cannot tell on which side a log belongs. A log's axis, however, is a
straight line and crosses a plate's plane at most once. If it crosses inside the plate, the end nearer to the plane has
penetrated and belongs to the other end's side; if it crosses above or beside the plate, the log hangs over it and each
end belongs where it is. The step length near obstacles prevents an axis from changing sides at once.

A barrier's line is cut into pieces of a few cells, so that the top follows the terrain at the given height. Each piece
is a swept sphere of zero radius, the edge, with a plate below it; posts, at free ends and bends, are such swept spheres
too. The plate itself is touched by the deepest point of an end face below the edge. Of plate and edges, the contact
with the shorter separation counts.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .compiled import inlined, kernel
from .contacts import touch
from .cores import BARRIER, CORE, SweptSphere, lay_out
from .limits import BEHIND_FACE, FLAT_TOLERANCE, POST_LEAN, POST_LENGTH, PUSHES_DOWN, STRAIGHT
from .log_body import CENTRE, LENGTH
from .narrow_phase import axis_of, deepest, gap_at_end, touch_core
from .rotation import DX, DY, DZ, X, Y, Z
from .terrain import Terrain, surfaces_at
from .vectors import cross, dot, norm, point

Array = NDArray[np.float64]

# Parts of a barrier that a contact may belong to: its edge, the posts at its start and end, the plate against an end of
# the log
EDGE, POST, FACE = 0, 3, 9


class Barriers(NamedTuple):
    """Barriers as given by the user.

    vertices : [m], shape (k, 2); starts : int64, shape (n + 1,): barrier i is vertices[starts[i]:starts[i + 1]]
    height : [m], shape (n,), above the terrain
    """

    vertices: Array
    starts: NDArray[np.int64]
    height: Array

    @staticmethod
    def none() -> Barriers:
        return Barriers(np.zeros((0, 2)), np.zeros(1, np.int64), np.zeros(0))


def _straight(points: Array) -> NDArray[np.bool_]:
    """Which points of a line are inside a straight stretch of it."""
    way = np.diff(points, axis=0)
    way /= np.linalg.norm(way, axis=1)[:, None]
    turn = way[:-1, 0] * way[1:, 1] - way[:-1, 1] * way[1:, 0]
    onward = (way[:-1] * way[1:]).sum(axis=1) > 0.0
    return np.concatenate([[False], (np.abs(turn) < STRAIGHT) & onward, [False]])


def prepare(terrain: Terrain, barriers: Barriers) -> tuple[Any, NDArray[np.int64]]:
    """Edges of the barriers, and the rows of barriers outside the terrain; the part of a barrier that is outside is
    dropped.

    There is no post inside a straight stretch: it would stop a log that slides along the barrier (from 10 m/s to zero).
    """
    piece = max(2.0, 4.0 * terrain.cell)
    parts, outside = [np.zeros(0, CORE)], []
    plan = np.asarray(barriers.vertices, float).reshape(-1, 2) - (terrain.x0, terrain.y0)
    for row, height in enumerate(barriers.height):
        corners = plan[barriers.starts[row] : barriers.starts[row + 1]]
        cuts = [corners[:1]]
        for a, b in pairwise(corners):
            number = max(1, int(np.ceil(np.hypot(*(b - a)) / piece)))
            if np.hypot(*(b - a)) > 0:
                cuts.append(a + (b - a) * (np.arange(1, number + 1) / number)[:, None])
        points = np.vstack(cuts)
        ground = surfaces_at(terrain, points)[:, 0]
        valid = np.isfinite(ground)
        both = valid[:-1] & valid[1:]
        if not both.any():
            outside.append(row)
            continue
        goes_on = np.append(False, both) & np.append(both, False)  # one piece ends and the next begins at this point
        joint = _straight(points) & goes_on
        top = np.column_stack([points, ground + height])
        way = np.diff(top, axis=0)
        way /= np.linalg.norm(way, axis=1)[:, None]
        before = np.where(goes_on[:-1, None], np.vstack([np.zeros((1, 3)), -way[:-1]]), 0.0)[both]
        none, item = np.zeros(both.sum()), np.full(both.sum(), row)
        parts.append(
            lay_out(
                BARRIER,
                item,
                top[:-1][both],
                top[1:][both],
                none,
                none,
                before_x=before[:, 0],
                before_y=before[:, 1],
                before_z=before[:, 2],
                after=goes_on[1:][both],
                first_post=~joint[:-1][both],
                last_post=~joint[1:][both],
            )
        )
    return np.concatenate(parts), np.array(outside, np.int64)


class Plate(NamedTuple):
    """A vertical plate: in plan from (x, y) along (ax, ay) for the width, below its top z + rise u at u."""

    x: float  # [m]
    y: float
    z: float  # [m] height of the top at its start
    ax: float  # unit vector in plan
    ay: float
    rise: float  # [-] of the top
    width: float  # [m] in plan


@kernel
def plate_of(edge):
    """The ``Plate`` below an edge, a record of CORE."""
    level = math.sqrt(edge.ux * edge.ux + edge.uy * edge.uy)
    return Plate(edge.x, edge.y, edge.z, edge.ux / level, edge.uy / level, edge.uz / level, edge.long * level)


@kernel
def deepest_below_edge(e, d, a, n, plate):
    """Point of an end face (centre e [m], axis d, radius a [m]) that is deepest against the plate's normal n (in plan)
    and below its top.

    The face is a disc cut by the top edge, and depth is linear on it, so the deepest point is the deepest point of the
    rim if that is below the edge, otherwise one of the two points of the rim at the height of the edge. A disc whose
    centre is on its own side, and that crosses the plate's plane above the edge only, hangs over the plate: its part
    below the edge is on the other side and has not penetrated. Returns (whether any of the disc is below the edge,
    point).
    """
    (ex, ey, ez), (dx, dy, dz), (nx, ny) = e, d, n
    x, y, top0, ax, ay, rise, _ = plate
    sine = math.sqrt(dx * dx + dy * dy)
    nd = nx * dx + ny * dy
    qx, qy, qz = nd * dx - nx, nd * dy - ny, nd * dz
    size = norm((qx, qy, qz))
    px, py, pz = ex, ey, ez
    if size > FLAT_TOLERANCE:
        qx, qy, qz = qx / size, qy / size, qz / size
        px, py, pz = ex + a * qx, ey + a * qy, ez + a * qz
        off = (ex - x) * nx + (ey - y) * ny
        if 0.0 <= off < a * size:
            # both ends of the chord in the plane of the plate
            away = off / size
            half = math.sqrt(a * a - away * away)
            hx, hy, hz = cross((dx, dy, dz), (qx, qy, qz))
            hangs = True
            for way in range(2):
                turn = half if way == 0 else -half
                u = (ex + away * qx + turn * hx - x) * ax + (ey + away * qy + turn * hy - y) * ay
                hangs = hangs and ez + away * qz + turn * hz > top0 + rise * u
            if hangs:
                return False, (px, py, pz)
    limit = top0 + rise * ((px - x) * ax + (py - y) * ay)
    if pz <= limit:
        return True, (px, py, pz)
    height = limit - ez
    if sine < FLAT_TOLERANCE or abs(height) > a * sine:
        return False, (px, py, pz)
    height /= sine
    half = math.sqrt(max(0.0, a * a - height * height))
    best = math.inf
    for way in range(2):
        turn = half if way == 0 else -half
        rx = (-turn * dy - height * dz * dx) / sine
        ry = (turn * dx - height * dz * dy) / sine
        depth = rx * nx + ry * ny
        if depth < best:
            best = depth
            px, py = ex + rx, ey + ry
    return True, (px, py, limit)


@kernel
def sides_of(cone, pose, edge):
    """Position of a log relative to a plate: (least clearance [m], side of the base, side of the tip, whether it is
    above the plate).

    The sides are 1 or -1; the clearance is measured along the plate's own directions.
    """
    back, front, thick, thin, _, _ = cone
    _, _, _, ax, ay, rise, width = plate_of(edge)
    gx, gy, dx, dy = pose.x - edge.x, pose.y - edge.y, pose.dx, pose.dy
    off_base, off_tip = (gy + back * dy) * ax - (gx + back * dx) * ay, (gy + front * dy) * ax - (gx + front * dx) * ay
    u_base, u_tip = (gx + back * dx) * ax + (gy + back * dy) * ay, (gx + front * dx) * ax + (gy + front * dy) * ay
    z_base, z_tip = pose.z + back * pose.dz - edge.z, pose.z + front * pose.dz - edge.z
    beside = max(min(u_base, u_tip) - width, -max(u_base, u_tip)) - thick
    above = min(z_base, z_tip) - max(0.0, rise * width) - thick
    away = (min(abs(off_base), abs(off_tip)) if off_base * off_tip > 0.0 else 0.0) - thick
    base, tip = 1.0 if off_base >= 0.0 else -1.0, 1.0 if off_tip >= 0.0 else -1.0
    over = False
    if base != tip:
        share = off_base / (off_base - off_tip)
        u = u_base + share * (u_tip - u_base)
        by_tip = abs(off_tip) < abs(off_base)
        a = thin if by_tip else thick
        past = max(-u, u - width)
        # beside the plate, by less than the radius of the end, and no deeper than that: the face overlaps the plate's
        # edge
        poked = past <= 0.0 or (past < a and min(abs(off_base), abs(off_tip)) < a)
        higher = z_base + share * (z_tip - z_base) > rise * u
        # a straight stretch continues beyond its joints: what is above it there is above it here
        joined = (u < 0.0 and edge.first_post == 0.0) or (u > width and edge.last_post == 0.0)
        over = higher and (past < a or joined)
        if poked and not higher:
            if by_tip:
                tip = base
            else:
                base = tip
    return max(beside, above, away), base, tip, over


@kernel
def pierced(body, state, edge):
    """Whether the axis of a log passes through a plate: below the edge and between its ends, wherever the log's ends
    are.
    """
    back, front = -body[CENTRE], body[LENGTH] - body[CENTRE]
    _, _, _, ax, ay, rise, width = plate_of(edge)
    gx, gy, gz = state[X] - edge.x, state[Y] - edge.y, state[Z] - edge.z
    off, turn = gy * ax - gx * ay, state[DY] * ax - state[DX] * ay
    base, tip = off + back * turn, off + front * turn
    if base * tip > 0.0 or base == tip:
        return False
    s = back + (front - back) * base / (base - tip)
    u = (gx + s * state[DX]) * ax + (gy + s * state[DY]) * ay
    return 0.0 <= u <= width and gz + s * state[DZ] <= rise * u


@kernel
def _below(low, high, at, rate):
    """Part of [low, high] where at + rate t <= 0, as (low, high); low > high if there is none."""
    if rate == 0.0:
        return (low, high) if at <= 0.0 else (1.0, 0.0)
    return (low, min(high, -at / rate)) if rate > 0.0 else (max(low, -at / rate), high)


@kernel
def _reaches_plate(e, d, a, n, edge):
    """Whether a disc (centre e [m], axis d, radius a [m]) whose centre is on the side n of a plate's plane reaches the
    plate itself.

    A disc that crosses the plane only above the edge or beside a post hangs over or beside the plate.
    """
    (ex, ey, ez), (dx, dy, dz), (nx, ny) = e, d, n
    x, y, z, ax, ay, rise, width = plate_of(edge)
    gx, gy = ex - x, ey - y
    off, nd = gx * nx + gy * ny, nx * dx + ny * dy
    size = math.sqrt(max(0.0, 1.0 - nd * nd))
    if not 0.0 <= off < a * size:
        return True
    # the chord in the plane, parametrised by t from its middle
    away = off / size
    qx, qy, qz = (nd * dx - nx) / size, (nd * dy - ny) / size, nd * dz / size
    hx, hy, hz = cross((dx, dy, dz), (qx, qy, qz))
    u, along = (gx + away * qx) * ax + (gy + away * qy) * ay, hx * ax + hy * ay
    high = math.sqrt(a * a - away * away)
    low = -high
    low, high = _below(low, high, ez + away * qz - z - rise * u, hz - rise * along)
    if edge.first_post > 0.0:
        low, high = _below(low, high, -u, -along)
    if edge.last_post > 0.0:
        low, high = _below(low, high, u - width, along)
    return low <= high


@kernel
def face_of_end(cone, pose, edge, end, side):
    """An end face (0 base, 1 tip) against the plate, on its side.

    Returns (whether it has a deepest point below the edge, whether that point is on the plate and the face reaches it,
    point, normal, gap).
    """
    plate = plate_of(edge)
    s, a = (cone.back, cone.thick) if end == 0 else (cone.front, cone.thin)
    c, d = axis_of(pose)
    e, n = point(c, s, d), (-side * plate.ay, side * plate.ax)
    below, p = deepest_below_edge(e, d, a, n, plate)
    u = (p[0] - plate.x) * plate.ax + (p[1] - plate.y) * plate.ay
    gap = (p[0] - plate.x) * n[0] + (p[1] - plate.y) * n[1]
    reaches = 0.0 <= u <= plate.width
    if below and reaches and gap < 0.0:
        reaches = _reaches_plate(e, d, a, n, edge)
    return below, reaches, p, (n[0], n[1], 0.0), gap


@kernel
def is_its_own(core, z, n, plate):
    """Whether a least gap at z, along n, belongs to this core: neither to a neighbour beyond a joint nor to a plate."""
    if plate and n[2] > PUSHES_DOWN:
        return False
    if z >= core.long and core.after > 0.0:
        return False
    before = (core.before_x, core.before_y, core.before_z)
    return z > 0.0 or dot(before, before) == 0.0 or dot(n, before) + core.slope >= -FLAT_TOLERANCE


@inlined
def plate_contacts(query, count, step, edge, row, within):
    """Eq. [e]: contacts of a pose with a plate, its top edge and its posts; returns the new count.

    within : [m] edge and posts count if their gap is smaller
    """
    state, pose, cone = query.state, query.pose, query.cone
    clear, base, tip, over = sides_of(cone, pose, edge)
    if clear > within:
        return count
    left, axis = step.dt - step.at, axis_of(pose)
    # an object above the edge can reach the plate only through the edge, because it is convex
    by_base, held_base, p_base, n_base, gap_base = face_of_end(cone, pose, edge, 0, base)
    by_tip, held_tip, p_tip, n_tip, gap_tip = face_of_end(cone, pose, edge, 1, tip)
    by_base = by_base and not over and gap_at_end(state, pose, p_base, n_base, gap_base, left) < 0.0
    by_tip = by_tip and not over and gap_at_end(state, pose, p_tip, n_tip, gap_tip, left) < 0.0
    up, down = (edge.ux, edge.uy, edge.uz), (0.0, 0.0, -1.0)
    start = (edge.x, edge.y, edge.z)
    before = count
    for part in range(3):
        first, u, long = start, up, edge.long
        if part > 0:
            if (edge.first_post if part == 1 else edge.last_post) == 0.0:
                continue
            first, u, long = start if part == 1 else point(start, edge.long, up), down, POST_LENGTH
        core = SweptSphere(first, u, long, 0.0, 0.0)
        gap, z, n, touches = deepest(cone, axis, core, within)
        # inclination of a post's normal towards its plate: an object from that side touches the plate, not the post
        lean = (edge.ux * n[0] + edge.uy * n[1]) * (0.0, -1.0, 1.0)[part]
        if not touches or n[2] > PUSHES_DOWN:
            continue
        if lean > POST_LEAN:
            # if a post is just behind an end face, the lateral surface of the log is inside the plate, and no
            # separation leads along it
            out = dot(n, axis[1])
            held_base = held_base or (gap < 0.0 and out < -BEHIND_FACE)
            held_tip = held_tip or (gap < 0.0 and out > BEHIND_FACE)
            continue
        # the shorter separation; a plate in which the log is deeper than in its edge is not the one that it hit
        if lean <= 0.0:  # a direction that clears the whole plate
            by_base, by_tip = by_base and gap_base > gap, by_tip and gap_tip > gap
        # the top of a post belongs to the edge
        if is_its_own(edge, z, n, True) if part == 0 else z > 0.0:
            count = touch_core(query, count, step, (BARRIER, row, POST * part), core, (z, n, gap), part == 0)
    by_base, by_tip = by_base and held_base, by_tip and held_tip
    if count == before and not (by_base and gap_base < 0.0) and not (by_tip and gap_tip < 0.0):
        return count  # no contact yet
    if by_base:
        count = touch(query, count, step, (BARRIER, row, FACE), p_base, n_base, gap_base)
    if by_tip:
        count = touch(query, count, step, (BARRIER, row, FACE + 1), p_tip, n_tip, gap_tip)
    return count
