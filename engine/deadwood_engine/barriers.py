"""Barriers: thin rigid vertical plates on a plan line, which stop a log and which a log can overjump (paper, 3.4).

A plate has no thickness, so penetration depth cannot say on which side a log belongs. But a log's axis is a straight
line: it crosses a plate's plane at most once. Where it crosses inside the plate, the end nearer to the plane has
poked through and belongs to the other end's side; where it crosses above the top or beside the plate, the log hangs
over it and each end belongs where it is. The step length near obstacles keeps an axis from changing sides at once.

Contacts: the deepest point of each end face below the top edge, against the plate's face; the log's side, and the rims
of its ends, against the top edge. Vertical edges and corners are uprights of zero radius (``trees``). A barrier's line
is cut into pieces of a few cells, so that the top follows the terrain at the given height; where it bends down from one
piece to the next, the log's side against that point, which is beyond the end of either edge.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .compiled import inlined, kernel
from .contacts import BARRIER, beside_point, cross, pierced_end, touch
from .grid_index import GridIndex, index_boxes, list_near
from .limits import FLAT_TOLERANCE, OBSTACLE_TRAVEL
from .log_body import BASE_RADIUS, CENTRE, LENGTH, TIP_RADIUS
from .rotation import DX, DY, DZ, X, Y, Z

Array = NDArray[np.float64]


class Barriers(NamedTuple):
    """Barriers as the user gives them.

    vertices : [m], shape (k, 2); starts : int64, shape (n + 1,): barrier i is vertices[starts[i]:starts[i + 1]]
    height : [m], shape (n,), above the terrain
    """

    vertices: Array
    starts: NDArray[np.int64]
    height: Array

    @staticmethod
    def none() -> Barriers:
        return Barriers(np.zeros((0, 2)), np.zeros(1, np.int64), np.zeros(0))


class Plates(NamedTuple):
    """Straight pieces of barriers as the kernels read them, shape (n, ...).

    node, offset : start point, as for ``Uprights``
    shape : (n, 6) direction x, y [-], length [m], top height at start and end [m above reference], rise [-] of the top
        of the piece before, in the same straight stretch (NaN: there is none)
    owner : int64, row of the barrier
    """

    node: np.ndarray
    offset: np.ndarray
    shape: np.ndarray
    owner: np.ndarray
    index: GridIndex  # pyright: ignore[reportIncompatibleMethodOverride]  (nobody looks a value up in a table)


# Columns of the near table, in the log's frame
START_X, START_Y, ALONG_X, ALONG_Y, WIDTH, TOP_START, TOP_END, RISE_BEFORE = range(8)
NEAR_WIDTH = 8


def prepare(
    start: Array, end: Array, top_start: Array, top_end: Array, rise_before: Array, owner: np.ndarray, cell: float
) -> Plates:
    """Lay out plates; start, end [m] shape (n, 2) in plan from the centre of the DEM's cell (0, 0)."""
    node = np.floor(start / cell).astype(np.int64)
    width = np.hypot(*(end - start).T)
    along = (end - start) / width[:, None]
    return Plates(
        node,
        start - node * cell,
        np.ascontiguousarray(np.column_stack([along, width, top_start, top_end, rise_before])),
        np.asarray(owner, dtype=np.int64),
        index_boxes(np.minimum(start, end), np.maximum(start, end)),
    )


@kernel
def near(plates, frame, cell, listed, table, bx, by, tx, ty, reach):
    """List the plates within reach [m] of the log's plan box, in the log's frame; returns the count."""
    if plates.owner.shape[0] == 0:
        return 0
    ox, oy = frame[0] * cell, frame[1] * cell
    count = list_near(
        plates.index, listed,
        ox + min(bx, tx) - reach, oy + min(by, ty) - reach, ox + max(bx, tx) + reach, oy + max(by, ty) + reach,
    )  # fmt: skip
    for m in range(count):
        item = listed[m]
        table[m, START_X] = (plates.node[item, 0] - frame[0]) * cell + plates.offset[item, 0]
        table[m, START_Y] = (plates.node[item, 1] - frame[1]) * cell + plates.offset[item, 1]
        for column in range(6):
            table[m, ALONG_X + column] = plates.shape[item, column]
    return count


@kernel
def deepest_below_edge(ex, ey, ez, dx, dy, dz, sine, a, nx, ny, x, y, ax, ay, top0, rise):
    """Point of an end face (centre e, axis d, radius a) deepest against the plate's normal n, of those below its top.

    The face is a disc cut off by the top edge, and depth is linear on it, so the deepest point is the rim's deepest
    where that lies below the edge, else one of the two rim points at the edge's height. A disc whose middle is on its
    own side, and that crosses the plate's plane above the edge only, hangs over the plate: what of it is below the
    edge lies on the other side and has not come through.
    Returns (whether any of the disc lies below the edge, point).
    """
    nd = nx * dx + ny * dy
    qx, qy, qz = nd * dx - nx, nd * dy - ny, nd * dz
    size = math.sqrt(qx * qx + qy * qy + qz * qz)
    px, py, pz = ex, ey, ez
    if size > FLAT_TOLERANCE:
        qx, qy, qz = qx / size, qy / size, qz / size
        px, py, pz = ex + a * qx, ey + a * qy, ez + a * qz
        off = (ex - x) * nx + (ey - y) * ny
        if 0.0 <= off < a * size:
            # both ends of the chord in the plate's plane
            away = off / size
            half = math.sqrt(a * a - away * away)
            hx, hy, hz = cross(dx, dy, dz, qx, qy, qz)
            hangs = True
            for way in range(2):
                turn = half if way == 0 else -half
                u = (ex + away * qx + turn * hx - x) * ax + (ey + away * qy + turn * hy - y) * ay
                hangs = hangs and ez + away * qz + turn * hz > top0 + rise * u
            if hangs:
                return False, px, py, pz
    limit = top0 + rise * ((px - x) * ax + (py - y) * ay)
    if pz <= limit:
        return True, px, py, pz
    height = limit - ez
    if sine < FLAT_TOLERANCE or abs(height) > a * sine:
        return False, px, py, pz
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
    return True, px, py, limit


@kernel
def edge_in_end(state, body, trial, end, x, y, z, tx, ty, tz):
    """Contact of a line (through x, y, z; direction t) with an end's rim (0 base, 1 tip).

    Seen along the line a log is a band between two ellipses, the outlines of its ends (half axes a and a |d . t|), and
    the line is a point. In the outer half of an ellipse the rim is nearest; inboard of its middle the rim counts only
    where the line lies less deep under it than under the log's side, or was still outside before this step.
    Returns (whether there is one, point of the rim, normal, gap [m]).
    """
    outward = -1.0 if end == 0 else 1.0
    s = -body[CENTRE] if end == 0 else body[LENGTH] - body[CENTRE]
    a = body[BASE_RADIUS] if end == 0 else body[TIP_RADIUS]
    dx, dy, dz = trial[0], trial[1], trial[2]
    c = dx * tx + dy * ty + dz * tz
    sine = math.sqrt(max(0.0, 1.0 - c * c))
    ex, ey, ez = trial[3] + s * dx, trial[4] + s * dy, trial[5] + s * dz
    if sine < FLAT_TOLERANCE:
        return False, ex, ey, ez, 0.0, 0.0, 1.0, 0.0
    mx, my, mz = (dx - c * tx) / sine, (dy - c * ty) / sine, (dz - c * tz) / sine
    lx, ly, lz = cross(tx, ty, tz, mx, my, mz)
    rx, ry, rz = x - ex, y - ey, z - ez
    tl, tm = rx * lx + ry * ly + rz * lz, outward * (rx * mx + ry * my + rz * mz)
    b = a * abs(c)
    if abs(tl) >= a or tm >= b:
        return False, ex, ey, ez, 0.0, 0.0, 1.0, 0.0
    edge = b * math.sqrt(1.0 - (tl / a) ** 2)
    under = edge - tm  # along m, to the ellipse
    if under <= 0.0:
        return False, ex, ey, ez, 0.0, 0.0, 1.0, 0.0
    u, v = tl, edge
    if tm > 0.0:
        aside = a * math.sqrt(1.0 - (tm / b) ** 2)
        if aside - abs(tl) < under:
            u, v = math.copysign(aside, tl), tm
    # the ellipse's normal there; a flat end's is the axis
    gl, gm = u * b * b, v * a * a
    size = math.sqrt(gl * gl + gm * gm)
    if size > FLAT_TOLERANCE * a * a * a:
        gl, gm = gl / size, gm / size
    else:
        gl, gm = 0.0, 1.0
    gap = (tl - u) * gl + (tm - v) * gm
    if tm <= 0.0 and -gap >= a - abs(tl):
        bx = x - state[X] - s * state[DX]
        by = y - state[Y] - s * state[DY]
        bz = z - state[Z] - s * state[DZ]
        if edge - outward * (bx * mx + by * my + bz * mz) >= a - abs(tl):
            return False, ex, ey, ez, 0.0, 0.0, 1.0, 0.0
    # on the disc: v along m is v / c along its second diameter, which leans along the line
    lean = -outward * v * sine / c if abs(c) > FLAT_TOLERANCE else 0.0
    px, py, pz = (
        ex + u * lx + outward * v * mx + lean * tx,
        ey + u * ly + outward * v * my + lean * ty,
        ez + u * lz + outward * v * mz + lean * tz,
    )
    gm *= outward
    return True, px, py, pz, -gl * lx - gm * mx, -gl * ly - gm * my, -gl * lz - gm * mz, gap


@inlined
def contacts_with(terrain, frame, table, listed, number, contacts, keys, count, state, body, trial, step):
    """Contacts with the near plates, as for ``tree_contacts``."""
    travel, free = math.inf, math.inf
    dx, dy, dz, ox, oy, oz = trial[0], trial[1], trial[2], trial[3], trial[4], trial[5]
    length, back = body[LENGTH], -body[CENTRE]
    front = length + back
    thick, thin = body[BASE_RADIUS], body[TIP_RADIUS]
    taper = (thin - thick) / length
    sine = math.sqrt(dx * dx + dy * dy)
    for m in range(number):
        x, y, ax, ay, width = (
            table[m, START_X], table[m, START_Y], table[m, ALONG_X], table[m, ALONG_Y], table[m, WIDTH],
        )  # fmt: skip
        top0, rise = table[m, TOP_START], (table[m, TOP_END] - table[m, TOP_START]) / width
        before = table[m, RISE_BEFORE]
        nx, ny = -ay, ax
        off_base = (ox + back * dx - x) * nx + (oy + back * dy - y) * ny
        off_tip = (ox + front * dx - x) * nx + (oy + front * dy - y) * ny
        u_base = (ox + back * dx - x) * ax + (oy + back * dy - y) * ay
        u_tip = (ox + front * dx - x) * ax + (oy + front * dy - y) * ay
        z_base, z_tip = oz + back * dz, oz + front * dz
        # how far the log's box is from the plate, in its own directions: a cheap bound of the distance
        beside = max(min(u_base, u_tip) - width, -max(u_base, u_tip)) - thick
        above = min(z_base, z_tip) - max(top0, table[m, TOP_END]) - thick
        away = (min(abs(off_base), abs(off_tip)) if off_base * off_tip > 0.0 else 0.0) - thick
        clear = max(beside, above, away)
        least = min(step[3], OBSTACLE_TRAVEL) * thin
        travel = min(travel, max(least, clear))
        free = min(free, clear)
        if clear > 0.0:
            continue
        side_base = 1.0 if off_base >= 0.0 else -1.0
        side_tip = 1.0 if off_tip >= 0.0 else -1.0
        over = False  # whether the log lies over the top edge
        if side_base != side_tip:
            share = off_base / (off_base - off_tip)
            u = u_base + share * (u_tip - u_base)
            by_tip = abs(off_tip) < abs(off_base)
            a = thin if by_tip else thick
            beside = max(-u, u - width)
            # beside the plate, but by less than the end's radius and no deeper: the face overlaps the plate's edge
            poked = beside <= 0.0 or (beside < a and min(abs(off_base), abs(off_tip)) < a)
            higher = z_base + share * (z_tip - z_base) > top0 + rise * u
            over = higher and beside < a
            if poked and not higher:
                if by_tip:
                    side_tip = side_base
                else:
                    side_base = side_tip
        item = listed[m]
        by_end, held_base, held_tip = False, False, False
        scale = 1.0 / math.sqrt(1.0 + rise * rise)
        tx, ty, tz = ax * scale, ay * scale, rise * scale  # along the top edge
        c = dx * tx + dy * ty + dz * tz
        apart = 1.0 - c * c  # square of the sine of the angle between axis and edge
        # end faces against the plate
        for end in range(2):
            s = back if end == 0 else front
            a = thick if end == 0 else thin
            side = side_base if end == 0 else side_tip
            ex, ey, ez = ox + s * dx, oy + s * dy, oz + s * dz
            reach, px, py, pz = deepest_below_edge(
                ex, ey, ez, dx, dy, dz, sine, a, side * nx, side * ny, x, y, ax, ay, top0, rise
            )
            u = (px - x) * ax + (py - y) * ay
            gap = side * ((px - x) * nx + (py - y) * ny)
            # what lies over the edge reaches the plate nowhere but through the edge, for it is convex
            held = reach and gap < 0.0 and 0.0 <= u <= width and not over
            # the top edge under the end: a log that lands on the barrier, or whose end has just come over it
            there, qx, qy, qz, mx, my, mz, under = edge_in_end(state, body, trial, end, x, y, top0, tx, ty, tz)
            u = (qx - x) * ax + (qy - y) * ay
            if there and not 0.0 <= u <= width:
                # where the rim is, there is the next piece or nothing; between two pieces may be a bend, in the face
                by_end, there = True, False
                if u < 0.0 and before > rise:
                    qx, qy, qz = x, y, top0
                    under, there = pierced_end(state, body, trial, end, qx, qy, qz)
                    inward = 1.0 if end == 0 else -1.0
                    mx, my, mz = inward * dx, inward * dy, inward * dz
            # the shorter way out; below the edge is the plate, so that an edge does not push down
            if held and not (there and mz >= 0.0 and under > gap):
                held_base, held_tip = held_base or end == 0, held_tip or end == 1
                count = touch(
                    terrain, frame, contacts, keys, count, state, trial, (BARRIER, item, end),
                    (px, py, pz), (side * nx, side * ny, 0.0), gap, step,
                )  # fmt: skip
            elif there:
                by_end = True
                count = touch(
                    terrain, frame, contacts, keys, count, state, trial, (BARRIER, item, 3 + end),
                    (qx, qy, qz), (mx, my, mz), under, step,
                )  # fmt: skip
        if by_end:
            continue
        gx, gy, gz = ox - x, oy - y, oz - top0
        if before > rise:
            # where the top bends down, the log's side against the point between the two edges
            s = beside_point(gx, gy, gz, dx, dy, dz, taper)
            rx, ry, rz = gx + s * dx, gy + s * dy, gz + s * dz
            rho, a = math.sqrt(rx * rx + ry * ry + rz * rz), thick + taper * (s - back)
            level = rx * ax + ry * ay
            beyond = level + before * rz >= 0.0 and level + rise * rz <= 0.0
            if back < s < front and 0.0 < rho < a and beyond:
                rx, ry, rz = rx / rho, ry / rho, rz / rho
                count = touch(
                    terrain, frame, contacts, keys, count, state, trial, (BARRIER, item, 5),
                    (ox + s * dx - a * rx, oy + s * dy - a * ry, oz + s * dz - a * rz), (rx, ry, rz), rho - a, step,
                )  # fmt: skip
        # the log's side against the top edge: nearest points of two lines
        if apart > FLAT_TOLERANCE:
            gd = gx * dx + gy * dy + gz * dz
            ge = gx * tx + gy * ty + gz * tz
            s = (c * ge - gd) / apart
            t = (ge - c * gd) / apart
            rx, ry, rz = gx + s * dx - t * tx, gy + s * dy - t * ty, gz + s * dz - t * tz
            distance = math.sqrt(rx * rx + ry * ry + rz * rz)
            mix = taper * taper / apart
            if distance > 0.0 and mix < 0.5:
                rho = distance / math.sqrt(1.0 - mix)
                abeam = back < s < front  # beyond that it is the rim's
                s = max(back, s + rho * taper / apart)
                t += rho * c * taper / apart
                if abeam and 0.0 <= t * scale <= width:
                    a = thick + taper * (s - back)
                    rx, ry, rz = gx + s * dx - t * tx, gy + s * dy - t * ty, gz + s * dz - t * tz
                    # an edge that is nearer to a face than to the side left or entered by that, if the plate holds it
                    by_face = (held_base and s - back < a - rho) or (held_tip and front - s < a - rho)
                    # below the edge is the plate, which holds by its faces: an edge does not push down
                    if rho < a and rz >= 0.0 and not by_face:
                        rx, ry, rz = rx / rho, ry / rho, rz / rho
                        count = touch(
                            terrain, frame, contacts, keys, count, state, trial, (BARRIER, item, 2),
                            (ox + s * dx - a * rx, oy + s * dy - a * ry, oz + s * dz - a * rz), (rx, ry, rz),
                            rho - a, step,
                        )  # fmt: skip
    return count, travel, free
