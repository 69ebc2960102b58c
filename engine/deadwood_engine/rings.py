"""Contacts of a log with the terrain: candidate points on rings (contact stations) along its axis.

On each ring, the deepest point along the local normal of the terrain, or the highest crest under the ring's stretch
of the side (``crests``), and two points at 45 degrees beside it, which find the walls of a channel. Where the ground
below is steep, also the mirror image of the first point in the vertical: in a steep channel the two beside the first
are over the same wall. Where the ground is rugged, the same halfway to the neighbours of a ring. A fidelity with one
point a ring, the first, seeks the others and halfway everywhere while the log is slow. On the end faces, eight points
of the rim and the centre. They are points of the smooth cone, not vertices fixed to the body, so a log rolls without
the rolling resistance of a polygon.
"""

from __future__ import annotations

import math

from .compiled import inlined, kernel
from .contacts import Facet, Ground, ground_contact
from .crests import Nodes, along_side, crest, height_at
from .limits import ANY_POINT, CHANNEL, FLAT_TOLERANCE, MERGED, REFINED, RUGGED, SLOW, STEEP_LOG
from .log_body import BASE_RADIUS, CENTRE, LENGTH, TIP_RADIUS
from .ring_look import ABOVE, KINKS, NEAR, PLACE, SLOPE_X, SLOPE_Y, look, unpacked
from .rotation import DX, DY, DZ, VX, VY, VZ
from .terrain import friction_at
from .vectors import cross

CANDIDATES = 9  # eight points on the rim of an end face and its centre; the rings between use one or three, and MIRROR
MIRROR = 3  # candidate of a ring between the ends that mirrors its first

_DIAGONAL = math.sqrt(0.5)


@kernel
def _deepest_on(nodes, c, d, a, slope):
    """Point of a ring (centre c, axis d, radius a) that is deepest against a slope, relative to c, and the surface
    below it.
    """
    (cx, cy, _), (dx, dy, dz), (gx, gy) = c, d, slope
    nd = dz - gx * dx - gy * dy
    ex, ey, ez = nd * dx + gx, nd * dy + gy, nd * dz - 1.0
    size = math.sqrt(ex * ex + ey * ey + ez * ez)
    if size < FLAT_TOLERANCE:
        return 0.0, 0.0, math.inf, 0.0, 0.0, 0.0
    ex, ey, ez = a * ex / size, a * ey / size, a * ez / size
    height, gx, gy = height_at(nodes, cx + ex, cy + ey)
    return ex, ey, ez, height, gx, gy


@kernel
def _look_over_border(rings, stations):
    """List as near those rings, too, that are beyond the terrain and next to one above it, with the slope there.

    The border is a crest, and the stretch of the side that touches it may belong to either of the two rings.
    Returns the number of rings listed.
    """
    near, before = 0, False
    for k in range(stations):
        here = rings[ABOVE, k] == rings[ABOVE, k]
        after = k + 1 < stations and rings[ABOVE, k + 1] == rings[ABOVE, k + 1]
        over = not here and 0 < k < stations - 1 and (before or after)
        if over:
            beside = k - 1 if before else k + 1
            rings[SLOPE_X, k], rings[SLOPE_Y, k] = rings[SLOPE_X, beside], rings[SLOPE_Y, beside]
        if over or rings[ABOVE, k] <= 0.0:
            rings[NEAR, near] = k
            near += 1
        before = here
    return near


@inlined
def _list_places(rings, near, stations, q, everywhere):
    """List the places where contacts are sought, in halves of the distance between rings: the near rings, and where the
    ground is rugged along the axis q, or everywhere, also halfway to their neighbours. Returns their number.
    """
    number, last = 0, -1
    for each in range(near):
        k = int(rings[NEAR, each])
        kx, ky = unpacked(rings[KINKS, k])
        rugged = everywhere or kx * abs(q[0]) + ky * abs(q[1]) >= RUGGED
        for place in range(2 * k - 1, 2 * k + 2):
            if place == 2 * k or (rugged and last < place < 2 * stations - 2):
                rings[PLACE, number] = last = place
                number += 1
    return number


@inlined
def _stretch(rings, each, places, stations):
    """The part of the log's side that belongs to a place between the ends, relative to it, in distances between rings:
    halfway to the next place on either side if that is listed or a ring, and up to the ends.
    """
    place, last = rings[PLACE, each], 2 * stations - 2
    if place % 2 == 1:
        return -0.5 if place == 1 else -0.25, 0.5 if place == last - 1 else 0.25
    low = -0.25 if each > 0 and rings[PLACE, each - 1] == place - 1 else -1.0 if place == 2 else -0.5
    high = 0.25 if each + 1 < places and rings[PLACE, each + 1] == place + 1 else 1.0 if place == last - 2 else 0.5
    return low, high


@inlined
def terrain_contacts(model, log, state, scratch, step):
    """Find the terrain contacts of this step.

    step is an ``Ahead``, of the pose ``scratch.trial``. Returns (count, whether there is terrain below every ring).
    """
    terrain, points, rings, trial = model.terrain, model.settings.ring_points, scratch.rings, scratch.trial[0]
    slow = points < MIRROR and state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2 < SLOW * SLOW
    if slow:
        points = MIRROR
    frame, body, stations = log
    d = dx, dy, dz = state[DX], state[DY], state[DZ]
    q = qx, qy, qz = trial.dx, trial.dy, trial.dz
    ox, oy, oz = trial.x, trial.y, trial.z
    length, centre = body[LENGTH], body[CENTRE]
    taper = (body[TIP_RADIUS] - body[BASE_RADIUS]) / length
    between = length / (stations - 1)
    i0, j0 = frame[0], frame[1]
    nodes = Nodes(terrain.heights, terrain.cell, terrain.inverse_cell, i0, j0)
    ground = Ground(terrain, frame, scratch.contacts, scratch.keys, state)
    near, whole = look(terrain, log, trial, rings, scratch.look)
    if not whole:
        near = _look_over_border(rings, stations)
    count, places = 0, _list_places(rings, near, stations, q, slow)
    for each in range(places):
        place = int(rings[PLACE, each])
        along = 0.5 * place * between
        s = along - centre
        a = body[BASE_RADIUS] + taper * along
        c = cx, cy, cz = ox + s * qx, oy + s * qy, oz + s * qz
        k, side = place // 2, 0 < place < 2 * stations - 2
        gx, gy = rings[SLOPE_X, k], rings[SLOPE_Y, k]
        if place % 2 == 1:
            height, gx, gy = height_at(nodes, cx, cy)
            if height != height:
                continue  # the rings on both sides of the border look for its crest
        square = gx * gx + gy * gy
        nz = 1.0 / math.sqrt(1.0 + square)
        nx, ny = -gx * nz, -gy * nz
        nd = nx * dx + ny * dy + nz * dz
        size = math.sqrt(max(0.0, 1.0 - nd * nd))
        above = rings[ABOVE, k] * nz + a
        # support direction on the ring: against the normal, perpendicular to the axis
        ex, ey, ez = nd * dx - nx, nd * dy - ny, nd * dz - nz
        if size < ANY_POINT:
            # axis along the normal: all points of the ring are equally deep
            if abs(dx) < 0.9:
                ex, ey, ez = 1.0 - dx * dx, -dx * dy, -dx * dz
            else:
                ex, ey, ez = -dy * dx, 1.0 - dy * dy, -dy * dz
        scale = a / math.sqrt(ex * ex + ey * ey + ez * ez)
        ex, ey, ez = scale * ex, scale * ey, scale * ez
        fx, fy, fz = cross((dx, dy, dz), (ex, ey, ez))
        # squared depth of the ring's lowest point below its centre; ez * ez is its first candidate's
        lowest = a * a * (1.0 - dz * dz)
        channel = side and 1.0 - dz * dz > STEEP_LOG and ez * ez < CHANNEL * CHANNEL * lowest
        mirror_cos, mirror_sin = (ez * ez - fz * fz) / lowest, 2.0 * ez * fz / lowest
        ox1, oy1, oz1, ox2, oy2, oz2 = math.inf, 0.0, 0.0, math.inf, 0.0, 0.0
        before, other_gap = count, math.inf
        for number in range((points + 1 if channel else points) if side else CANDIDATES):
            mirrored = side and number == points
            m = MIRROR if mirrored else number
            if m == 0:
                ce, cf = 1.0, 0.0
            elif m < 3:
                ce, cf = _DIAGONAL, _DIAGONAL if m == 1 else -_DIAGONAL
            elif mirrored:
                ce, cf = mirror_cos, mirror_sin
            elif m < 5:
                ce, cf = 0.0, 1.0 if m == 3 else -1.0
            elif m < 7:
                ce, cf = -_DIAGONAL, _DIAGONAL if m == 5 else -_DIAGONAL
            else:
                # the last of the rim, and the centre of the face, where ground may penetrate a standing log
                ce, cf = -1.0 if m == 7 else 0.0, 0.0
            # a point of an end face this far above the tangent plane is out of the terrain's reach. On the side it
            # would also have to be out of reach once it is sought again: the other wall of a shallow channel is not
            if not side and above > a * size * ce:
                continue
            rx, ry, rz = ce * ex + cf * fx, ce * ey + cf * fy, ce * ez + cf * fz
            px, py = cx + rx, cy + ry
            height, gx, gy = height_at(nodes, px, py)
            if (m < 3 or mirrored) and cz + rz - height < REFINED * a:
                # once more, perpendicular to the ground found there: deeper by up to 8 % of the radius, and exact on a
                # plane
                hx, hy, hz, other, kx, ky = _deepest_on(nodes, c, d, a, (gx, gy))
                if cz + hz - other < cz + rz - height:
                    rx, ry, rz, height, gx, gy = hx, hy, hz, other, kx, ky
                    px, py = cx + rx, cy + ry
                # two that coincide in one point are one contact
                if m == 0:
                    ox1, oy1, oz1, ox2, oy2, oz2 = rx, ry, rz, rx, ry, rz
                else:
                    one = (rx - ox1) ** 2 + (ry - oy1) ** 2 + (rz - oz1) ** 2
                    two = (rx - ox2) ** 2 + (ry - oy2) ** 2 + (rz - oz2) ** 2
                    if one < (MERGED * a) ** 2:
                        continue
                    if two < (MERGED * a) ** 2:
                        # of the two beside the first, the deeper one; otherwise a mirrored slope would give another
                        # contact
                        if cz + rz - height >= other_gap:
                            continue
                        count = before
                    before, other_gap = count, cz + rz - height
                    ox2, oy2, oz2 = rx, ry, rz
            gap, t = cz + rz - height, 0.0
            found = False
            if m == 0 and side:
                gap = gap if gap == gap else math.inf  # this point is beyond the border, but not all of the stretch
                low, high = _stretch(rings, each, places, stations)
                low, high = low * between, high * between
                found, ct, hx, hy, hz, lower, kx, ky = crest(nodes, c, q, (rx, ry, rz), (a, taper), (low, high), gap)
                if found:
                    t, rx, ry, rz, gap, gx, gy = ct, hx, hy, hz, lower, kx, ky
                    px, py = cx + t * qx + rx, cy + t * qy + ry
            # predicted to be below the surface (a NaN height, no ground, compares false)
            if gap < 0.0:
                if side and not found:
                    far = max(between, 2.0 * terrain.cell)
                    gx, gy = along_side(nodes, (px, py, height), (gx, gy), d, (a, taper), far)
                r = ((s + t) * dx + rx, (s + t) * dy + ry, (s + t) * dz + rz)
                mu = friction_at(terrain, i0, j0, px, py)
                facet = Facet(place * CANDIDATES + m, r, gap, (gx, gy), mu, found)
                count = ground_contact(ground, count, step, facet, True)
    return count, whole
