"""Contacts of a convex hull with trees, posts, lying logs and barriers, at the predicted pose.

Round obstacles are a straight core with a radius around it (zero for a post), so their free ends are rounded: a core
stops its radius short of the end. A core outside the hull meets its nearest point: on an edge, a vertex or, from a free
end, a face. A core inside the hull (thin stems, posts, the top edge of a barrier) is separated in the shortest
direction perpendicular to the core, along which the hull projects to a polygon; a free end also through the nearest
face. If a face or an edge lies along the core there are two contacts, at the ends of the shared stretch.

The plate of a barrier meets the vertices of the hull: a vertex has penetrated if the segment from it to the centre of
mass crosses the plate, but not if the segment passes above or beside it. The plate's top edge and its real ends and
bends are cores.
"""

from __future__ import annotations

import math

from .barriers import plate_of
from .cloud import to_world
from .cloud_contacts import AHEAD, CloudQuery, touch_cloud
from .compiled import kernel
from .contacts import Ahead
from .cores import BARRIER, TREE, SweptSphere, skin_of, swept_sphere
from .limits import ASKEW, BEHIND, CORE_APART, FACE_ALIGNED, FLAT_TOLERANCE, OBSTACLE_TRAVEL, POST_LENGTH
from .log_body import REACH
from .vectors import axes_nearest, cross, dot, minus, norm, point

_NOWHERE = (0.0, 0.0, 0.0)


@kernel
def lay_out(cloud, scratch):
    """Write the vertices and normals of the hull at the predicted pose into scratch.corners and scratch.normals."""
    trial = scratch.trial[0]
    place = trial.x, trial.y, trial.z
    for k in range(cloud.corners.shape[0]):
        p = to_world(scratch.turns, AHEAD, cloud.corners[k])
        for axis in range(3):
            scratch.corners[k, axis] = place[axis] + p[axis]
    for k in range(cloud.normals.shape[0]):
        p = to_world(scratch.turns, AHEAD, cloud.normals[k])
        for axis in range(3):
            scratch.normals[k, axis] = p[axis]


@kernel
def _height_over(query, face, p):
    """Distance [m] of a point p from the plane of a face, positive outside: n.(p - centre) - offset."""
    trial = query.scratch.trial[0]
    return dot(query.scratch.normals[face], minus(p, (trial.x, trial.y, trial.z))) - query.cloud.offsets[face]


@kernel
def _clip_to_face(query, face, start, u, low, high):
    """Part [low, high] [m] of a line start + z u within the outline of a face, projected along the face's normal."""
    cloud, scratch = query.cloud, query.scratch
    n = (scratch.normals[face, 0], scratch.normals[face, 1], scratch.normals[face, 2])
    first, last = cloud.starts[face], cloud.starts[face + 1]
    for k in range(first, last):
        a = scratch.corners[cloud.loops[k]]
        b = scratch.corners[cloud.loops[k + 1 if k + 1 < last else first]]
        out = cross(minus(b, a), n)
        away = dot(out, minus(start, a))
        rate = dot(out, u)
        if rate == 0.0:
            if away > 0.0:
                return 1.0, 0.0
        elif rate > 0.0:
            high = min(high, -away / rate)
        else:
            low = max(low, -away / rate)
    return low, high


@kernel
def _way_out(query, core, inside, free):
    """Shortest separation of the hull from a core inside it: (depth [m], outward normal of the hull there, first and
    last position along the core [m]).

    inside : [m] where the core enters and leaves the hull; free : whether its start and its end are free
    """
    cloud, scratch, start, u = query.cloud, query.scratch, core.start, core.u
    corners, (enter, leave) = scratch.corners, inside
    centre = (scratch.trial[0].x, scratch.trial[0].y, scratch.trial[0].z)
    best, m_best, first, last = math.inf, _NOWHERE, enter, leave
    for k in range(cloud.edges.shape[0]):
        a, b = corners[cloud.edges[k, 0]], corners[cloud.edges[k, 1]]
        m = cross(minus(b, a), u)
        size = norm(m)
        if size <= FLAT_TOLERANCE:
            continue
        side = dot(m, minus(a, centre))
        size = size if side >= 0.0 else -size
        m = (m[0] / size, m[1] / size, m[2] / size)
        depth = dot(m, minus(a, start))
        if depth < 0.0 or depth >= best:
            continue
        support = True
        for j in range(corners.shape[0]):
            c = corners[j]
            over = dot(m, minus(c, a))
            if over > BEHIND * (1.0 + abs(side)):
                support = False
                break
        if support:
            best, m_best = depth, m
    for end in range(2):
        z = 0.0 if end == 0 else core.long
        if not (free[0] if end == 0 else free[1]) or not (enter <= z <= leave):
            continue
        p = point(start, z, u)
        outward = -1.0 if end == 0 else 1.0
        for k in range(cloud.normals.shape[0]):
            n = (scratch.normals[k, 0], scratch.normals[k, 1], scratch.normals[k, 2])
            if outward * dot(n, u) < 0.0:
                depth = -_height_over(query, k, p)
                if depth < best:
                    best, m_best, first, last = depth, n, z, z
    return best, m_best, first, last


@kernel
def _nearest(query, core):
    """Nearest points of the hull and a core outside it: (distance [m], point of the hull [m], z on the core [m], edge
    or -1).
    """
    cloud, scratch, start, u, long = query.cloud, query.scratch, core.start, core.u, core.long
    corners = scratch.corners
    best, p_best, z_best, edge = math.inf, _NOWHERE, 0.0, -1
    for k in range(cloud.edges.shape[0]):
        a, b = corners[cloud.edges[k, 0]], corners[cloud.edges[k, 1]]
        d = minus(b, a)
        size = math.sqrt(dot(d, d))
        d = (d[0] / size, d[1] / size, d[2] / size)
        s, z = axes_nearest((a[0], a[1], a[2]), d, 0.0, size, start, u, long)
        p = point((a[0], a[1], a[2]), s, d)
        r = point(point(p, -1.0, start), -z, u)
        distance = math.sqrt(dot(r, r))
        if distance < best:
            best, p_best, z_best, edge = distance, p, z, k
    for end in range(2):
        z = 0.0 if end == 0 else long
        q = point(start, z, u)
        for k in range(cloud.normals.shape[0]):
            distance = _height_over(query, k, q)
            if 0.0 <= distance < best:
                low, high = _clip_to_face(query, k, q, u, 0.0, 0.0)
                if low <= high:
                    n = (scratch.normals[k, 0], scratch.normals[k, 1], scratch.normals[k, 2])
                    best, p_best, z_best, edge = distance, point(q, -distance, n), z, -1
    return best, p_best, z_best, edge


@kernel
def core_contacts(query, count, step, key, core, free, most):
    """Contacts of the hull with a round obstacle.

    core : a ``SweptSphere``; free : whether its start and its end are free
    most : [-] share of both thicknesses that the fastest point of the hull may move in a step
    Returns (count, how far [m] it may move in the next).
    """
    cloud, scratch = query.cloud, query.scratch
    start, u, long, wide, slope = core
    end = point(start, long, u)
    thick = max(wide, wide + slope * long)
    clear, enter, leave = -math.inf, 0.0, long
    for k in range(cloud.normals.shape[0]):
        low, high = _height_over(query, k, start), _height_over(query, k, end)
        clear = max(clear, min(low, high) - thick)
        if low > 0.0 and high > 0.0:
            leave = -1.0
        elif low > 0.0:
            enter = max(enter, long * low / (low - high))
        elif high > 0.0:
            leave = min(leave, long * low / (low - high))
    both = cloud.thickness + thick
    travel = max(most * min(both, 2.0 * math.sqrt(cloud.thickness * both)), clear)
    if clear > 0.0:
        return count, travel
    if enter <= leave:
        depth, m, first, last = _way_out(query, core, (enter, leave), free)
        if depth == math.inf:
            return count, travel
        n = (-m[0], -m[1], -m[2])
        apart = last - first > CORE_APART * cloud.thickness
        for part in range(2 if apart else 1):
            z = 0.5 * (first + last)
            if apart:
                z = first if part == 0 else last
            p = point(start, z, u)
            count = touch_cloud(
                query,
                count,
                step,
                (key[0], key[1], key[2] + part),
                point(p, wide + slope * z, n),
                n,
                -depth - wide - slope * z,
            )
        return count, travel
    distance, p, z, edge = _nearest(query, core)
    gap = distance - wide - slope * z
    if gap >= 0.0 or distance == 0.0:
        return count, travel
    r = point(point(p, -1.0, start), -z, u)
    n = (r[0] / distance, r[1] / distance, r[2] / distance)
    # a face along the core: two contacts, where the core enters and leaves the outline of the face
    face, most = -1, FACE_ALIGNED
    for k in range(cloud.normals.shape[0]):
        aligned = -(dot(n, scratch.normals[k]))
        if aligned > most:
            face, most = k, aligned
    low, high = 1.0, 0.0
    if face >= 0:
        low, high = _clip_to_face(query, face, start, u, 0.0, long)
    elif edge >= 0:
        a, b = scratch.corners[cloud.edges[edge, 0]], scratch.corners[cloud.edges[edge, 1]]
        d = minus(b, a)
        along = dot(d, u)
        if along * along > FACE_ALIGNED * FACE_ALIGNED * dot(d, d):
            at = dot(u, minus(a, start))
            low, high = max(0.0, min(at, at + along)), min(long, max(at, at + along))
    if high > low:
        deepest = 0.0
        for part in range(2):
            at = low if part == 0 else high
            q = point(start, at, u)
            if face >= 0:
                away = _height_over(query, face, q)
                side = (-scratch.normals[face, 0], -scratch.normals[face, 1], -scratch.normals[face, 2])
            else:
                a, b = scratch.corners[cloud.edges[edge, 0]], scratch.corners[cloud.edges[edge, 1]]
                d = minus(b, a)
                share = (at - dot(u, minus(a, start))) / dot(d, u)
                r = point(point((a[0], a[1], a[2]), share, d), -1.0, q)
                away = norm(r)
                side = (r[0] / away, r[1] / away, r[2] / away) if away > 0.0 else n
            deepest = min(deepest, away - wide - slope * at)
            if away - wide - slope * at < 0.0:
                count = touch_cloud(
                    query,
                    count,
                    step,
                    (key[0], key[1], key[2] + part),
                    point(q, away, side),
                    side,
                    away - wide - slope * at,
                )
        if gap > deepest - ASKEW:  # otherwise they cross between the two, at a few degrees
            return count, travel
        key = (key[0], key[1], -1 - key[2])
    if 0.0 < z < long:
        # the taper of the stem tilts the normal
        scale = 1.0 / math.sqrt(1.0 + slope * slope)
        n = ((n[0] - slope * u[0]) * scale, (n[1] - slope * u[1]) * scale, (n[2] - slope * u[2]) * scale)
        gap *= scale
    return touch_cloud(query, count, step, key, p, n, gap), travel


@kernel
def _plate_contacts(query, count, step, reach, row, edge, most):
    """Contacts of the vertices of the hull with the plate below an edge; returns (count, travel [m]).

    reach : [m] of the farthest vertex from the centre of mass; row : of the edge; most : as in ``core_contacts``
    """
    cloud, scratch, trial = query.cloud, query.scratch, query.scratch.trial[0]
    x, y, top0, ax, ay, rise, width = plate_of(edge)
    nx, ny = -ay, ax
    off_c = (trial.x - x) * nx + (trial.y - y) * ny
    u_c = (trial.x - x) * ax + (trial.y - y) * ay
    side = 1.0 if off_c >= 0.0 else -1.0
    beside = max(-u_c, u_c - width)
    above = trial.z - max(top0, top0 + rise * width)
    clear = max(abs(off_c), beside, above) - reach
    travel = max(most * cloud.thickness, clear)
    if clear > 0.0:
        return count, travel
    for k in range(cloud.corners.shape[0]):
        c = scratch.corners[k]
        off = (c[0] - x) * nx + (c[1] - y) * ny
        if off * side >= 0.0:
            continue
        u = (c[0] - x) * ax + (c[1] - y) * ay
        share = off / (off - off_c)
        at = u + share * (u_c - u)
        if 0.0 <= at <= width and c[2] + share * (trial.z - c[2]) <= top0 + rise * at:
            p, n = (c[0], c[1], c[2]), (side * nx, side * ny, 0.0)
            count = touch_cloud(query, count, step, (BARRIER, row, 8 + k), p, n, -abs(off))
    return count, travel


@kernel
def cloud_obstacle_contacts(model, log, state, scratch, count, dt):
    """Contacts with all obstacles nearby. Returns (count, travel [m])."""
    settings, near = model.settings, scratch.near[0]
    lay_out(model.cloud, scratch)
    query, travel = CloudQuery(model.cloud, model.terrain, log.frame, scratch, state), math.inf
    most = min(settings.obstacle_travel, OBSTACLE_TRAVEL)
    for m in range(near.cores):
        core, row = scratch.near_cores[m], scratch.listed[m]
        swept, before = swept_sphere(core), (core.before_x, core.before_y, core.before_z)
        plate = core.kind == BARRIER
        friction, restitution = skin_of(settings, core.kind)
        step = Ahead(dt, settings.gravity, dt, restitution, friction, 0.0)
        free = (not plate and core.kind != TREE and dot(before, before) == 0.0, not plate and core.after == 0.0)
        rounded = SweptSphere(swept.start, swept.u, core.long - core.disc, core.wide, core.slope)
        count, allowed = core_contacts(query, count, step, (core.kind, row, 0), rounded, free, most)
        travel = min(travel, allowed)
        if plate:
            count, allowed = _plate_contacts(query, count, step, log.body[REACH], row, core, most)
            travel = min(travel, allowed)
            for end in range(2):
                if (core.first_post if end == 0 else core.last_post) > 0.0:
                    top = point(swept.start, core.long * end, swept.u)
                    post = SweptSphere(top, (0.0, 0.0, -1.0), POST_LENGTH, 0.0, 0.0)
                    count, allowed = core_contacts(
                        query, count, step, (core.kind, row, 2 + 2 * end), post, (False, False), most
                    )
                    travel = min(travel, allowed)
    return count, travel
