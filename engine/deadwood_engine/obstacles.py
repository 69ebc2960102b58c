"""Contacts of a log with all obstacles near it, of whatever kind, at the first touch along the predicted path.

Where and how an obstacle is touched first decides whether it stops the log or deflects it. The predicted path is
therefore searched in pieces, the shorter the nearer the obstacle, for the first touch; the contacts are those of that
pose, and those that the rest of the step causes along a shared line (``narrow_phase``, ``barriers``).
"""

from __future__ import annotations

import math

from .barriers import is_its_own, plate_contacts, sides_of
from .compiled import inlined, kernel
from .contacts import Ahead, Query, predict
from .cores import BARRIER, TREE, apart_in_plan, skin_of, swept_sphere
from .limits import (
    FIRST_TOUCH,
    LYING_TRAVEL,
    MOST_LOOKS,
    OBSTACLE_ALONG,
    OBSTACLE_TRAVEL,
    THICK,
    TOUCH_DEPTH,
    UNFORESEEN,
)
from .log_body import BASE_RADIUS, CENTRE, LENGTH, TIP_RADIUS
from .narrow_phase import axis_of, cone_of, deepest, top_chord, touch_core
from .rotation import DX, DY, DZ, VX, VY, VZ, swing_of
from .vectors import axes_nearest, dot, norm, point


@kernel
def _nearest(cone, pose, core):
    """(least clearance [m] of the log from a core, position along its axis, radius of the log there, of the core)."""
    if core.kind == BARRIER:
        clear, _, _, _ = sides_of(cone, pose, core)
        # past the plate's end an oblique log may be on both of its sides
        base = pose.x + cone.back * pose.dx, pose.y + cone.back * pose.dy
        tip = pose.x + cone.front * pose.dx, pose.y + cone.front * pose.dy
        end = core.x + core.long * core.ux, core.y + core.long * core.uy
        clear = max(clear, apart_in_plan(base, tip, (core.x, core.y), end) - cone.thick)
        # its faster end; its thinnest place
        return clear, cone.back if -cone.back > cone.front else cone.front, cone.thin, 0.0
    c, d = axis_of(pose)
    start, u = (core.x, core.y, core.z), (core.ux, core.uy, core.uz)
    s, z = axes_nearest(c, d, cone.back, cone.front, start, u, core.long)
    r = point(point(point(c, s, d), -1.0, start), -z, u)
    distance = norm(r)
    mine, theirs = cone.thick + cone.taper * (s - cone.back), core.wide + core.slope * z
    # after a distance t, the axes are sqrt(distance^2 + apart t^2) apart, and both thicker by at most sqrt(steep) t
    apart, steep = 1.0 - abs(dot(d, u)), cone.taper * cone.taper + core.slope * core.slope
    if steep < 0.5 * apart:
        return distance * math.sqrt(1.0 - steep / apart) - mine - theirs, s, mine, theirs
    return distance - cone.thick - max(core.wide, core.wide + core.slope * core.long), s, mine, theirs


@inlined
def _contacts_at(query, count, step, core, row, within):
    """Contacts of one pose with one obstacle, with gaps below ``within`` [m]; returns the new count."""
    if core.kind == BARRIER:
        return plate_contacts(query, count, step, core, row, within)
    cone, axis = query.cone, axis_of(query.pose)
    swept = swept_sphere(core)
    gap, z, n, touches = deepest(cone, axis, swept, within)
    if touches and core.disc > 0.0 and z >= swept.long:
        swept = top_chord(cone, axis, point(swept.start, swept.long, swept.u), core.disc, swept.wide - core.disc)
        gap, z, n, touches = deepest(cone, axis, swept, within)
    if touches and is_its_own(core, z, n, False):
        count = touch_core(query, count, step, (core.kind, row, 0), swept, (z, n, gap), False)
    return count


@inlined
def contacts_with(model, log, state, scratch, count, span):
    """Contacts with the near obstacles, after the first ``count`` of the table; span : a ``Span``.

    Returns (count, travel, free, thin, nearest): how far [m] the log's fastest point may move in the next step without
    passing a thin obstacle, and without touching anything (negative where it may touch); which near cores determine
    these, or -1. For thicker stems the table receives where along the log's axis the stem is nearest, and how far [m]
    the axis may move sideways there (``time_beside``).
    """
    settings, body, pose, dt = model.settings, log.body, scratch.pose[0], span.dt
    travel, free, thin, nearest = math.inf, math.inf, -1, -1
    trial, cone = scratch.trial[0], cone_of(body)
    query = Query(model.terrain, log.frame, scratch.contacts, scratch.keys, state, pose, cone)
    swing = _swing(state)
    for m in range(scratch.near[0].cores):
        core, row = scratch.near_cores[m], scratch.listed[m]
        clear, s, mine, theirs = _nearest(cone, trial, core)
        # at most so far that the axes cannot change sides; and, if the log is thin compared with the stems, as the neck
        # between two
        both = mine + theirs
        narrow = min(both, 2.0 * math.sqrt(mine * both))
        core.room, core.clear, bound = math.inf, clear, math.inf
        if core.kind == TREE and both > THICK:
            core.along, core.room = s, max(settings.obstacle_travel * narrow, clear)
        elif core.kind == TREE or core.kind == BARRIER:
            bound = max(min(settings.obstacle_travel, OBSTACLE_TRAVEL) * narrow, clear)
        else:
            narrow = min(narrow, 2.0 * math.sqrt(theirs * both))
            bound = max(min(settings.obstacle_travel, LYING_TRAVEL) * narrow, clear)
        if bound < travel:
            travel, thin = bound, m
        if clear < free:
            free, nearest = clear, m
        if clear > span.advance:
            continue
        friction, restitution = skin_of(settings, core.kind)
        # follow the predicted path until they touch, then bisect the time since the previous query
        before, earlier, time, pace = count, 0.0, 0.0, 0.0
        predict(state, 0.0, settings.gravity, pose)
        clear, s, _, _ = _nearest(cone, pose, core)
        for look in range(MOST_LOOKS):
            within = 0.0
            if count == before and time >= dt:
                # not touched; but an impulse elsewhere within the step may whip an end against it: a contact that does
                # not rebound, and acts only on what would penetrate
                within, at = UNFORESEEN, dt
            elif count == before:
                room = max(FIRST_TOUCH * narrow, clear)
                lasting = _time_to(swing, state, body, settings.gravity, s, room)
                pace = room / lasting
                earlier, time = time, time + lasting if look + 1 < MOST_LOOKS else dt
                time = min(time, dt)
                at = time
            else:
                if (time - earlier) * pace <= TOUCH_DEPTH * narrow:
                    break
                at = 0.5 * (earlier + time)
            predict(state, at, settings.gravity, pose)
            clear, s, _, _ = _nearest(cone, pose, core)
            found = before
            if clear < within:
                step = Ahead(dt, settings.gravity, at, restitution if within == 0.0 else 0.0, friction, 0.0)
                found = _contacts_at(query, before, step, core, row, within)
            if within > 0.0:
                count = found
                break
            if found > before:
                count, time = found, at
            elif count > before:
                earlier = at
    return count, travel, free, thin, nearest


@kernel
def _swing(state):
    """Velocity of the axis due to rotation (its end, from one metre off) and its size [1/s]; speed along it [m/s]."""
    t = swing_of(state)
    sliding = dot((state[VX], state[VY], state[VZ]), (state[DX], state[DY], state[DZ]))
    return t, norm(t), sliding


@kernel
def _time_to(swing, state, body, gravity, s, room):
    """Shortest time [s] in which the log's axis at s moves by the room [m]: sideways, or any way at its ends."""
    t, turn, sliding = swing
    v = point((state[VX], state[VY], state[VZ]), s, t)
    square = dot(v, v)
    if -body[CENTRE] < s < body[LENGTH] - body[CENTRE]:
        square = max(0.0, square - sliding * sliding)
    speed = math.sqrt(square)
    bend = turn * (abs(sliding) + speed) + 0.5 * gravity
    return 2.0 * room / (speed + math.sqrt(square + 4.0 * bend * room))


@inlined
def _pace(state, body, gravity):
    """(swing, speed along the axis, greatest speed of any point, its growth): obstacles that the latter two place out
    of reach within a step are not examined more closely.
    """
    swing = _swing(state)
    sliding = abs(swing[2])
    straight = math.sqrt(state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2)
    speed = straight + swing[1] * max(body[CENTRE], body[LENGTH] - body[CENTRE])
    return swing, sliding, speed, swing[1] * (sliding + speed) + 0.5 * gravity


@inlined
def time_beside(table, number, state, body, gravity, longest):
    """The longest step [s] in which the log passes none of the listed upright obstacles (``contacts_with``), and which
    of them determines it, or -1.

    A log that slides along its own axis past a stem does not come nearer to it: what counts is the sideways velocity of
    the axis at the stem, and the contributions of rotation and gravity. A stem ahead of an end is met at full speed.
    """
    swing, sliding, speed, bend = _pace(state, body, gravity)
    back, front = -body[CENTRE], body[LENGTH] - body[CENTRE]
    taper = (body[TIP_RADIUS] - body[BASE_RADIUS]) / body[LENGTH]
    decider = -1
    for m in range(number):
        s, room, before = table[m].along, table[m].room, longest
        if room > longest * (speed + longest * bend) and room > longest * sliding:
            continue
        if back < s < front:
            # at close range the log's taper is a wedge between two stems: the travel along the axis then counts, too
            mine = body[BASE_RADIUS] + taper * (s - back)
            along = mine + table[m].wide
            if room < along:
                along *= OBSTACLE_ALONG if 4.0 * mine < along else 1.0  # a log that is thin compared with the stems
                longest = min(longest, along / sliding) if sliding > 0.0 else longest
        longest = min(longest, _time_to(swing, state, body, gravity, s, room))
        if longest < before:
            decider = m
    return longest, decider


@kernel
def could_pass(state, body, gravity, room, longest):
    """Whether a step [s] could pass an upright obstacle that is at least this far away [m]: criterion of
    ``time_beside``.
    """
    _, sliding, speed, bend = _pace(state, body, gravity)
    return not (room > longest * (speed + longest * bend) and room > longest * sliding)
