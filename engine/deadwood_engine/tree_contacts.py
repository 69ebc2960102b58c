"""Contacts with standing trees: rigid vertical truncated cones that a log cannot pass (paper, section 3.4).

A tree is hard and stays: it blocks, turns and wedges a log for as long as they touch.

Log against tree, at the predicted pose:
- side: both are cones, so the spheres that fill them are compared: minimise |c(s) - t(z)| - a(s) - b(z) over both
  axes, in closed form with both tapers (a wedge needs the log's half angle in the normal, or it would slip through);
- each end face: the point of the disc nearest to the tree's axis in plan (point to ellipse), normal radial from the
  tree. A flat end stays flat: a capsule's round nose would turn head-on hits, the main way of stopping, aside.

symbol        in code          unit
a(s), ka      radius, taper     m, -   radius of the log and its change along the axis
b(z), kb      bole, SLOPE       m, -   radius of the tree and its change with height
"""

from __future__ import annotations

import math

from .compiled import inlined, kernel
from .contacts import TREE, beside_point, cross, pierced_end, predict, touch
from .limits import FIRST_TOUCH, FLAT_TOLERANCE, MOST_LOOKS, OBSTACLE_ALONG, OBSTACLE_TRAVEL, STEEP, THICK, TOUCH_DEPTH
from .log_body import BASE_RADIUS, CENTRE, LENGTH, TIP_RADIUS
from .rotation import DX, DY, DZ, VX, VY, VZ, WX, WY, WZ, X, Y
from .trees import ALONG, FOOT, NEAR_X, NEAR_Y, RADIUS, ROOM, SLOPE, TOP


@kernel
def disc_nearest(a, cosine, tl, tm):
    """Point of a tilted disc (radius a) nearest in plan to a place (tl lateral, tm along the axis' plan direction).

    In plan the disc is an ellipse with half axes a and a |cosine|. Returns (u, w): the point is u lateral and w along
    the disc's second diameter, whose plan component is w * cosine. A place inside the ellipse returns its centre.
    """
    b = a * abs(cosine)
    if (tl / a) ** 2 + (tm / max(b, 1e-300)) ** 2 <= 1.0:
        return 0.0, 0.0
    # the root of |point in units of the half axes| = 1; Newton on one over it, which is all but a straight line in t
    t = max(0.0, a * abs(tl) - a * a, b * abs(tm) - b * b)
    for _ in range(40):
        p, q = a * tl / (t + a * a), b * tm / (t + b * b) if b > 0.0 else 0.0
        size = math.sqrt(p * p + q * q)
        if size - 1.0 <= 1e-14:
            break
        slope = p * p / (t + a * a) + (q * q / (t + b * b) if b > 0.0 else 0.0)
        advance = size * size * (size - 1.0) / slope
        t += advance
        if advance <= 1e-15 * (t + a * a):
            break
    u = a * a * tl / (t + a * a)
    w = a * a * cosine * tm / (t + b * b) if b > 1e-9 * a else 0.0
    return u, w


@inlined
def _end_contact(terrain, frame, tree, item, end, contacts, keys, count, state, body, trial, step, advance):
    """Contact of one end face (0 base, 1 tip) with a tree; returns (count, whether the tree entered by this face).

    advance [m]: how far any point of the log moves in this step; a tree farther away than that is not looked at.

    In plan the face is an ellipse, and its outer half is the outline's end. A tree whose axis is outside meets the
    nearest point of the ellipse. One whose axis is inside has been overrun: if it lies less deep under the end than
    under the log's side, now or a step ahead, it entered by the face and is pushed out by it. Without that a stem
    thinner than a step's travel impales the log and is carried along.
    """
    x, y, foot, top, radius, slope = tree[NEAR_X], tree[NEAR_Y], tree[FOOT], tree[TOP], tree[RADIUS], tree[SLOPE]
    dx, dy, dz = trial[0], trial[1], trial[2]
    outward = -1.0 if end == 0 else 1.0
    s = -body[CENTRE] if end == 0 else body[LENGTH] - body[CENTRE]
    a = body[BASE_RADIUS] if end == 0 else body[TIP_RADIUS]
    ex, ey, ez = trial[3] + s * dx, trial[4] + s * dy, trial[5] + s * dz
    away = math.sqrt((ex - x) ** 2 + (ey - y) ** 2)
    tip = radius + slope * (top - foot)
    if away > 2.0 * a + max(radius, tip) + advance:
        return count, False  # neither touched nor entered in this step
    sine = math.sqrt(dx * dx + dy * dy)
    # the tree's top under the face: a log that lands on a stump
    share = min(1.0, tip / away) if away > 0.0 else 0.0
    px, py = x + share * (ex - x), y + share * (ey - y)
    gap, there = pierced_end(state, body, trial, end, px, py, top)
    if there:
        count = touch(
            terrain, frame, contacts, keys, count, state, trial, (TREE, item, 3 + end), (px, py, top),
            (-outward * dx, -outward * dy, -outward * dz), gap, step,
        )  # fmt: skip
        return count, True
    if ez - a * sine > top:
        return count, False
    lx, ly = 1.0, 0.0
    if sine > FLAT_TOLERANCE:
        lx, ly = -dy / sine, dx / sine
    mx, my = ly, -lx  # plan direction of the axis
    tl, tm = (x - ex) * lx + (y - ey) * ly, (x - ex) * mx + (y - ey) * my
    entered, w, depth = False, 0.0, 0.0
    if abs(tl) < a and abs(dz) < STEEP:
        w = outward * a * math.sqrt(1.0 - (tl / a) ** 2)
        if dz < 0.0:
            w = -w
        edge = outward * w * dz
        depth = edge - outward * tm
        if depth > 0.0:
            before_x = state[X] + s * state[DX]
            before_y = state[Y] + s * state[DY]
            before = outward * ((x - before_x) * mx + (y - before_y) * my)
            if depth > a - abs(tl) and edge - before > a - abs(tl):
                return count, False
            entered = True
    wide = a * abs(dz)
    if entered:
        u = tl
        nx, ny, gap = -outward * mx, -outward * my, -depth
    elif wide > 0.0 and tl * tl / (a * a) + tm * tm / (wide * wide) < 1.0:
        # a standing log over a tree: apart along the line of their centres
        size = math.sqrt(tl * tl + tm * tm)
        ul, um = (tl / size, tm / size) if size > 0.0 else (1.0, 0.0)
        reach = 1.0 / math.sqrt(ul * ul / (a * a) + um * um / (wide * wide))
        u, w = reach * ul, reach * um / dz
        nx, ny, gap = -ul * lx - um * mx, -ul * ly - um * my, size - reach
    else:
        u, w = disc_nearest(a, dz, tl, tm)
        nx = ex + u * lx + w * dz * mx - x
        ny = ey + u * ly + w * dz * my - y
        gap = math.sqrt(nx * nx + ny * ny)
        if gap == 0.0:
            return count, False
        nx, ny = nx / gap, ny / gap
    pz = min(ez - w * sine, top)
    lean = -slope if pz > foot else 0.0
    gap -= radius - lean * (pz - foot)
    if gap < 0.0:
        scale = 1.0 / math.sqrt(1.0 + lean * lean)
        count = touch(
            terrain, frame, contacts, keys, count, state, trial, (TREE, item, 1 + end),
            (ex + u * lx + w * dz * mx, ey + u * ly + w * dz * my, pz),
            (nx * scale, ny * scale, lean * scale), gap * scale, step,
        )  # fmt: skip
    return count, entered


@inlined
def _side_contact(terrain, frame, tree, item, contacts, keys, count, state, body, trial, step):
    """Contact of the log's side, strictly between its ends, with a tree's side or top; returns the new count."""
    foot, top, radius = tree[FOOT], tree[TOP], tree[RADIUS]
    dx, dy, dz, ox, oy, oz = trial[0], trial[1], trial[2], trial[3], trial[4], trial[5]
    back, front = -body[CENTRE], body[LENGTH] - body[CENTRE]
    taper = (body[TIP_RADIUS] - body[BASE_RADIUS]) / body[LENGTH]
    gx, gy = ox - tree[NEAR_X], oy - tree[NEAR_Y]
    plan = dx * dx + dy * dy  # square of the sine of the tilt
    # nearly parallel, the tapers outweigh the angle between the axes: what touches are the end faces and the tree's top
    s, z, kb, mix = 0.0, math.inf, tree[SLOPE], 1.0
    if plan > FLAT_TOLERANCE:
        nearest = -(gx * dx + gy * dy) / plan
        if oz + nearest * dz <= foot:
            kb = 0.0  # the stem goes on below the ground
        mix = (taper * taper + kb * kb + 2.0 * dz * taper * kb) / plan
        across = math.sqrt((gx + nearest * dx) ** 2 + (gy + nearest * dy) ** 2)
        # a stem beyond an end is the end's affair, though the taper's normals may reach it from within
        if mix < 0.5 and back < nearest < front:
            rho = across / math.sqrt(1.0 - mix)
            s = nearest + rho * (taper + dz * kb) / plan
            z = oz + nearest * dz + rho * (kb + dz * taper) / plan
    if z > top:
        # the top's rim: nearest point of the log's axis to the end of the tree's
        z = top
        s = beside_point(gx, gy, oz - top, dx, dy, dz, taper)
    if not back < s < front:
        return count
    ax, ay, az = gx + s * dx, gy + s * dy, oz + s * dz - z
    rho = math.sqrt(ax * ax + ay * ay + az * az)
    a = body[BASE_RADIUS] + taper * (s - back)
    gap = rho - a - (radius + kb * (z - foot) if z > foot else radius)
    if gap < 0.0:
        # a log released right through a stem's axis is put to its left as well as to its right; one that stands in it,
        # both axes one, has no left: its end faces are pushed west too
        nx, ny, nz = -1.0, 0.0, 0.0
        if rho > 0.0:
            nx, ny, nz = ax / rho, ay / rho, az / rho
        elif plan > 0.0:
            nx, ny, nz = -dy / math.sqrt(plan), dx / math.sqrt(plan), 0.0
        count = touch(
            terrain, frame, contacts, keys, count, state, trial, (TREE, item, 0),
            (ox + s * dx - a * nx, oy + s * dy - a * ny, oz + s * dz - a * nz), (nx, ny, nz), gap, step,
        )  # fmt: skip
    return count


@kernel
def _nearest(pose, body, tree):
    """(place along the log's axis, distance in plan [m]) nearest to a tree's axis."""
    gx, gy = pose[3] - tree[NEAR_X], pose[4] - tree[NEAR_Y]
    dx, dy = pose[0], pose[1]
    plan = dx * dx + dy * dy
    s = 0.0
    if plan > 0.0:
        s = min(body[LENGTH] - body[CENTRE], max(-body[CENTRE], -(gx * dx + gy * dy) / plan))
    return s, math.sqrt((gx + s * dx) ** 2 + (gy + s * dy) ** 2)


@inlined
def _contacts_at(terrain, frame, tree, item, contacts, keys, count, state, body, pose, step, advance):
    """Contacts of one pose with one tree."""
    lower = min(pose[5] - body[CENTRE] * pose[2], pose[5] + (body[LENGTH] - body[CENTRE]) * pose[2])
    if lower - body[BASE_RADIUS] > tree[TOP]:
        return count
    count, by_base = _end_contact(
        terrain, frame, tree, item, 0, contacts, keys, count, state, body, pose, step, advance
    )
    count, by_tip = _end_contact(terrain, frame, tree, item, 1, contacts, keys, count, state, body, pose, step, advance)
    if by_base or by_tip:
        return count
    return _side_contact(terrain, frame, tree, item, contacts, keys, count, state, body, pose, step)


@inlined
def contacts_with(
    terrain, frame, table, listed, number, joints, contacts, keys, count, state, body, trial, step, advance, pose
):
    """Contacts with the near uprights; step = (dt, restitution, gravity, obstacle travel, dt).

    A tree is round: where and how it is touched first decides whether it stops the log or turns it aside. So the way
    ahead is followed in pieces, as short as the tree is near, to the first touch. ``joints`` (posts in a straight
    stretch of a barrier, flush with its plates) are passed over.

    Returns (count, travel, free): how far [m] the log's fastest point may move in the next step without passing what is
    thin, and without touching anything (less than 0 where it may touch). For thicker stems the table receives
    where along the log's axis it is nearest, and how far [m] the axis may move there, sideways (``time_beside``).
    """
    travel, free = math.inf, math.inf
    thick = body[BASE_RADIUS]
    taper = (body[TIP_RADIUS] - thick) / body[LENGTH]
    swing = _swing(state)
    for m in range(number):
        tree, item = table[m], listed[m]
        if joints[item]:
            table[m, ROOM] = math.inf
            continue
        nearest, distance = _nearest(trial, body, tree)
        clear = distance - thick - tree[RADIUS]
        # no farther than the axes could change sides; and, for a log thin beside its stems, than the neck between two
        mine = thick + taper * (nearest + body[CENTRE])
        both = mine + tree[RADIUS]
        narrow = min(both, 2.0 * math.sqrt(mine * both))
        if both > THICK:
            table[m, ALONG], table[m, ROOM] = nearest, max(step[3] * narrow, clear)
        else:
            table[m, ROOM] = math.inf
            travel = min(travel, max(min(step[3], OBSTACLE_TRAVEL) * narrow, clear))
        free = min(free, clear)
        if clear > advance:
            continue
        # follow the way ahead until they touch, then halve the time since the look before
        before, earlier, time, pace = count, 0.0, 0.0, 0.0
        predict(state, 0.0, step[2], pose)
        s, distance = _nearest(pose, body, tree)
        clear = distance - thick - tree[RADIUS]
        for look in range(MOST_LOOKS):
            if count == before:
                if time >= step[0]:
                    break
                room = max(FIRST_TOUCH * narrow, clear)
                lasting = _time_to(swing, state, body, step[2], s, room)
                pace = room / lasting
                earlier, time = time, time + lasting if look + 1 < MOST_LOOKS else step[0]
                time = min(time, step[0])
                at = time
            else:
                if (time - earlier) * pace <= TOUCH_DEPTH * narrow:
                    break
                at = 0.5 * (earlier + time)
            predict(state, at, step[2], pose)
            s, distance = _nearest(pose, body, tree)
            clear = distance - thick - tree[RADIUS]
            found = before
            if clear < 0.0:
                found = _contacts_at(
                    terrain, frame, tree, item, contacts, keys, before, state, body, pose,
                    (step[0], step[1], step[2], step[3], at), advance,
                )  # fmt: skip
            if found > before:
                count, time = found, at
            elif count > before:
                earlier = at
    return count, travel, free


@kernel
def _swing(state):
    """The axis' velocity as it turns (its end, seen from a metre behind) and its size [1/s]; speed along it [m/s]."""
    dx, dy, dz = state[DX], state[DY], state[DZ]
    tx, ty, tz = cross(state[WX], state[WY], state[WZ], dx, dy, dz)
    turn = math.sqrt(tx * tx + ty * ty + tz * tz)
    return tx, ty, tz, turn, state[VX] * dx + state[VY] * dy + state[VZ] * dz


@kernel
def _time_to(swing, state, body, gravity, s, room):
    """The least time [s] in which the log's axis at s moves by the room [m]: sideways, or any way at its ends."""
    tx, ty, tz, turn, sliding = swing
    vx, vy, vz = state[VX] + s * tx, state[VY] + s * ty, state[VZ] + s * tz
    square = vx * vx + vy * vy + vz * vz
    if -body[CENTRE] < s < body[LENGTH] - body[CENTRE]:
        square = max(0.0, square - sliding * sliding)
    speed = math.sqrt(square)
    bend = turn * (abs(sliding) + speed) + 0.5 * gravity
    return 2.0 * room / (speed + math.sqrt(square + 4.0 * bend * room))


@inlined
def time_beside(table, number, state, body, gravity, longest):
    """The longest step [s] in which the log passes none of the listed uprights (``contacts_with``).

    A log that slides along its own axis beside a stem does not come nearer to it: what counts is the axis' velocity
    sideways, where the stem is, and what turning and falling add to it. A stem ahead of an end is met at full speed.
    """
    swing = _swing(state)
    sliding = abs(swing[4])
    # of any point: what is farther away than that within the step is not looked at more closely
    straight = math.sqrt(state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2)
    speed = straight + swing[3] * max(body[CENTRE], body[LENGTH] - body[CENTRE])
    bend = swing[3] * (sliding + speed) + 0.5 * gravity
    back, front = -body[CENTRE], body[LENGTH] - body[CENTRE]
    taper = (body[TIP_RADIUS] - body[BASE_RADIUS]) / body[LENGTH]
    for m in range(number):
        s, room = table[m, ALONG], table[m, ROOM]
        if room > longest * (speed + longest * bend) and room > longest * sliding:
            continue
        if back < s < front:
            # close by, the log's taper is a wedge between two stems: then the way along counts, too
            along = body[BASE_RADIUS] + taper * (s - back) + table[m, RADIUS]
            if room < OBSTACLE_ALONG * along:
                along *= OBSTACLE_ALONG  # a log thin beside its stems
            if room < along and longest * sliding > along:
                longest = along / sliding
        longest = min(longest, _time_to(swing, state, body, gravity, s, room))
    return longest
