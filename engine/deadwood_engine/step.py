"""One time step of a log: Moreau's time stepping from midpoint to midpoint (paper, section 3.2; engine/README.md for
the equations). ``trajectory`` repeats it from the release to the end.

A step starts at a node, where contacts act. Four phases:
1. ``choose_step``: its length, from the speed of the log's fastest point, the DEM's cell and the obstacles nearby;
2. ``push``: the contacts of the pose that free motion would reach at the next node; gravity, half for the step behind
   and half for the step ahead; and the velocities that the contacts permit;
3. ``keep_books``: energy, penetration, hits;
4. ``move_on``: the drift to the next node (parabola and rotation are exact, for equal steps or not), and a possible end
   there.

The length is chosen before the contacts are found: a step that grew afterwards would carry the log past the plane
that it is only allowed to reach.
"""

from __future__ import annotations

import math

from .asymmetric_top import energy_of, move_freely
from .breaking import break_trees, note_broken
from .compiled import inlined
from .contact_solver import find_old, remember, solve, turn_around, warm_start
from .contacts import TERRAIN, first_rebound, first_strike, set_frames
from .detection import find_contacts, owner_of
from .energy import impulse_work
from .grid_index import insert_sorted
from .impacts import make_admissible, may_rebound, rebounds_at_all
from .influence import NOW, note_all, note_step
from .ledger import note_pushes
from .limits import (
    BELOW_GROUND,
    BURIED,
    CLOUD_TURN,
    LATE_STRIKE,
    LEAST_TOLERANCE,
    LEAST_TRAVEL,
    LEAST_TURN,
    MADE_ANEW,
    MET_AT_ONCE,
    OBSTACLE_TRAVEL,
    PAST_STRIKE,
    POLL_STEPS,
    REST_TRAVEL,
    REST_WINDOW,
    ROCKING_WINDOW,
    SAFE,
    SHORTEST_STEP,
    STRIKE,
    WILD_SPEED,
)
from .log_body import BASE_RADIUS
from .model import Span
from .obstacles import could_pass, time_beside
from .pressure import join_lines
from .rest import FAILED, INTERRUPTED, LEFT_DEM, TIME_LIMIT, holder, rest_reason
from .ring_look import mean_kinks
from .rocking import rocks_in_place, watch
from .rolling import start_rolling
from .rotation import VX, VY, VZ, WX, WY, WZ, X, Y, Z, spin_of
from .scarring import drag, step_in_scar
from .slip import slip_after
from .terrain import surface
from .trace import PEAK_ENERGY, PEAK_HEIGHT, PEAK_SPEED, ends_moved, remember_pose
from .travel import fastest_point, travel_bound
from .turning import turn_contacts


@inlined
def choose_step(model, log, state, scratch):
    """1. Gravity's second half for the previous step, v_z -= g dt / 2, and the length dt [s] of this one.

    The axis moves no farther than the travel s in it: with the speed V now and the growth B of it [m/s2],
    dt <= s / u,  u = (V + sqrt(V^2 + 2 B s)) / 2.
    On rugged ground s falls with the square of the kinks under a log that touches something, down to LEAST_TRAVEL of
    it.
    A log in contact turns about its axis by at most the roll angle phi: dt <= phi / |w . d|.
    """
    settings, body, way = model.settings, log.body, scratch.way[0]
    gravity = settings.gravity
    state[VZ] -= 0.5 * gravity * way.before
    fastest, bend = travel_bound(model.cloud, state, body)
    bend += gravity
    travel = settings.travel
    if way.kinks > settings.smooth_kinks:
        travel *= max(LEAST_TRAVEL, (settings.smooth_kinks / way.kinks) ** 2)
    pace = 0.5 * (fastest + math.sqrt(fastest * fastest + 2.0 * bend * travel))  # the mean over that distance
    dt = min(settings.time_step, travel / pace) if pace > 0.0 else settings.time_step
    if way.touches and model.cloud is None:
        spin = abs(spin_of(state))
        dt = min(dt, settings.roll_angle / spin) if spin > 0.0 else dt
    limited = False
    if way.travel < settings.travel:
        # beside a thin or lying obstacle: by the surface of the log, which may strike it
        most = way.travel / (fastest_point(state, body) + 0.5 * gravity * settings.time_step)
        limited = most < dt
        dt = min(dt, most)
    dt, decider = time_beside(scratch.near_cores, scratch.near[0].beside, state, body, gravity, dt)
    if scratch.notes.place.shape[0] > 0:
        scratch.notes.book[NOW] = way.time
        unsure = could_pass(state, body, gravity, SAFE * scratch.near[0].clear, dt)
        note_step(scratch, settings.travel, decider, limited, unsure)
    if model.cloud is not None:
        turn = math.sqrt(state[WX] ** 2 + state[WY] ** 2 + state[WZ] ** 2)
        dt = min(dt, CLOUD_TURN / turn) if turn > 0.0 else dt
        if settings.strength > 0.0:
            dt = min(dt, step_in_scar(model.cloud, model.terrain, log.frame, state, settings, way.scar))
    way.dt, way.fastest, way.bend = max(dt, SHORTEST_STEP), fastest, bend


@inlined
def push(model, log, state, scratch, summary):
    """2. The contacts of the pose at the end of the step, and the velocities that they permit (eq. 5):
    v+ = v - g dt e_z + sum P, w+ = w + sum I^-1 (r x P).

    Repeated with a shorter step if these velocities would pass a stem well within it, or if a contact rebounds late in
    it or strikes early in it, or if a body enters ground that it scars.
    """
    settings, way, rolling = model.settings, scratch.way[0], scratch.rolling[0]
    gravity, contacts = settings.gravity, scratch.contacts
    bounces, noting = may_rebound(settings), scratch.notes.place.shape[0] > 0
    dt, on_terrain, count, rebounds, met, anew = way.dt, True, 0, False, False, False
    vx, vy, vz, enters = state[VX], state[VY], state[VZ], False
    for _ in range(4):
        advance = dt * (way.fastest + 0.5 * way.bend * dt)
        way.kick = 0.5 * (way.before + dt)
        if settings.strength > 0.0:
            state[VX], state[VY], state[VZ] = vx, vy, vz
            way.dragged = drag(model.cloud, model, log, state, scratch, way.kick)
        count, way.travel, on_terrain = find_contacts(model, log, state, scratch, Span(dt, way.path, advance), True)
        if settings.strength > 0.0 and not enters and way.enters < dt:
            dt, enters = max(way.enters, SHORTEST_STEP), True
            continue
        if bounces:
            touch = first_rebound(contacts, count, gravity)
            rebounds = touch < math.inf
            if rebounds and not met and not anew and MET_AT_ONCE * dt < touch < dt:
                dt, met = max(touch, SHORTEST_STEP), True
                continue
        if model.cloud is None and not met and not anew:
            struck = first_strike(contacts, count, gravity, STRIKE * way.speed + gravity * dt) + PAST_STRIKE * dt
            if struck < LATE_STRIKE * dt:
                dt, met = max(struck, SHORTEST_STEP), True
                continue
        lines = prepare_contacts(model, log, state, scratch, count, dt)
        state[VZ] -= 0.5 * gravity * dt
        if count == 0:
            break
        for k in range(6):
            scratch.free[k] = state[VX + k]
        rolling.spin_before = spin_of(state)
        ratio = way.kick / way.last_kick if way.last_kick > 0.0 and not rebounds else 0.0
        if ratio > 0.0:
            warm_start(contacts, count, state, scratch.old_contacts, ratio)
        start_rolling(rolling, contacts, count, state, ratio)
        used, way.residual = solve(contacts, count, state, rolling, (way.tolerance, settings.sweeps), lines)
        summary.sweeps += used
        if anew:
            break
        if noting and could_pass(state, log.body, gravity, SAFE * scratch.near[0].clear, MADE_ANEW * dt):
            note_all(scratch.notes)
        beside = scratch.near[0].beside
        if beside == 0:
            break
        sooner, decider = time_beside(scratch.near_cores, beside, state, log.body, gravity, dt)
        if sooner >= MADE_ANEW * dt:
            break
        if noting:
            note_step(scratch, settings.travel, decider, False, False)
        for k in range(6):
            state[VX + k] = scratch.free[k]
        state[VZ] += 0.5 * gravity * dt
        dt, anew = max(sooner, SHORTEST_STEP), True
    way.dt, way.fall, way.count, way.whole = dt, 0.5 * gravity * dt, count, way.whole and on_terrain


@inlined
def prepare_contacts(model, log, state, scratch, count, dt):
    """Ready the contacts for the solver: planes that turn, straight lines, frames; and its tolerance. Returns whether
    there are lines.
    """
    settings, way, contacts, keys = model.settings, scratch.way[0], scratch.contacts, scratch.keys
    gravity = settings.gravity
    find_old(contacts, keys, count, scratch.old_keys, way.old_count)
    if model.cloud is None:  # the points of a cloud turn with it
        speeds = gravity * way.kick, 0.5 * gravity * way.before, LEAST_TURN * gravity * dt
        turn_contacts(contacts, keys, count, state, scratch.old_contacts, speeds)
    if settings.backward:
        turn_around(contacts, keys, count, scratch.spare)
    way.tolerance = settings.tolerance * gravity * dt + LEAST_TOLERANCE
    lines = model.cloud is None and count > 2 and join_lines(contacts, count, state, dt)
    set_frames(contacts, count, state, log.body)
    return lines


@inlined
def keep_books(model, log, state, scratch, out):
    """3. The effect of the contacts: their work, their depth, the obstacles hit, and the initial state of the next
    step.
    """
    settings, way, rolling, summary = model.settings, scratch.way[0], scratch.rolling[0], out.summary
    contacts, keys = scratch.contacts, scratch.keys
    pressed, touches, deepest = False, False, 0.0
    if way.count > 0:
        gained, standing = balance_energy(model, log, state, scratch, out)
        pressed, touches, pushed, deepest = measure_depths(model, log, scratch, out)
        touches = touches or pushed  # not an obstacle that was merely close: it changes nothing (``influence``)
        if pushed:
            struck = energy_of(state, log.body) + way.fall * (state[VZ] + 0.5 * way.fall) - gained
            summary.hits = note_pushes(model, log, state, scratch, out.hits, summary, struck)
        if standing < way.count:
            note_broken(model.cores, keys, (standing, way.count), out.hits, summary.hits, way.time)
            way.count = standing  # broken trees support nothing any more
        rolling.moment_before = rolling.moment
    else:
        rolling.moment_before = 0.0
        summary.airborne += 1
    if settings.strength > 0.0:
        way.work += way.dragged
        way.scar = way.scar_ahead
    if model.cloud is not None and settings.friction_kappa > 0.0:
        way.slip = slip_after(contacts, keys, way.count, state, way.slip, settings.friction_beta, way.dt)
    way.pressed, way.touches = pressed, touches
    way.kinks = mean_kinks(scratch.rings, log.stations) if touches and model.cloud is None else 0.0
    way.sunk = min(way.sunk, way.time) if deepest > log.body[BASE_RADIUS] else math.inf
    turning = model.cloud is None
    way.old_count = remember(contacts, keys, way.count, state, scratch.old_keys, scratch.old_contacts, turning)
    way.before, way.last_kick = way.dt, way.kick
    way.speed = math.sqrt(state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2)
    way.energy = energy_of(state, log.body)
    memory = scratch.memory
    memory[PEAK_SPEED] = max(memory[PEAK_SPEED], way.speed)
    memory[PEAK_ENERGY] = max(memory[PEAK_ENERGY], way.energy)
    summary.speed_max = max(summary.speed_max, way.speed)
    summary.energy_max = max(summary.energy_max, way.energy)


@inlined
def balance_energy(model, log, state, scratch, out):
    """The work of the contacts [f], of impulses made admissible [n] where they are not, and of trees that break [o].

    Returns (work [J/kg], how many contacts, the first of the table, are with obstacles that still stand).
    """
    settings, way, rolling, summary = model.settings, scratch.way[0], scratch.rolling[0], out.summary
    contacts, count = scratch.contacts, way.count
    summary.contacts += count
    # the work is that of the velocities at the node, between gravity's two halves
    gained = impulse_work(contacts, count, state, rolling, way.fall)
    # Newton's law, contact by contact, can generate energy where several act
    if way.residual > way.tolerance or (gained > 0.0 and may_rebound(settings) and rebounds_at_all(contacts, count)):
        gained, used = make_admissible(scratch, count, state, log.body, scratch.free, gained, settings.sweeps)
        summary.sweeps += used
    standing = count
    if settings.breaks:
        standing = break_trees(model, log, state, scratch, out.hits, summary.hits)
        if standing < count:
            gained = impulse_work(contacts, count, state, rolling, way.fall)
    if way.residual > way.tolerance:
        summary.unconverged += 1
    summary.residual = max(summary.residual, way.residual)
    way.work += gained
    summary.energy_gain += max(0.0, gained)
    return gained, standing


@inlined
def measure_depths(model, log, scratch, out):
    """How deep [m] the log is in the ground and in obstacles, and which of these act on it.

    Returns (whether the ground carries load, whether the log reaches it, whether an obstacle pushes, the greatest depth
    [m] that counts).
    """
    settings, way, marks, summary = model.settings, scratch.way[0], out.marks, out.summary
    radius, contacts, keys = log.body[BASE_RADIUS], scratch.contacts, scratch.keys
    pressed, reached, pushed, deepest = False, False, False, 0.0
    for k in range(way.count):
        ground = keys[k, 0] == TERRAIN
        reached = reached or ground
        pressed = pressed or (ground and contacts[k].pn > 0.0)
        depth = -contacts[k].gap  # NaN if the ground begins within the step
        if ground and not way.whole and depth > BURIED * radius:
            way.undermined = True
        elif ground and depth > summary.penetration:
            summary.penetration = depth
        if ground and way.whole and not way.buried:
            deepest = max(deepest, depth)
            below = depth > radius + settings.travel
            way.lost = way.lost or (below and way.time - way.sunk > BELOW_GROUND)
        if not ground and not summary.started_in_contact:  # not the overlap with which a log was released
            summary.overlap = max(summary.overlap, depth)
            deepest = max(deepest, depth)
            both = radius + model.cores.solid[keys[k, 1]].wide
            way.lost = way.lost or depth > radius + max(settings.travel, OBSTACLE_TRAVEL * both)
        if not ground and contacts[k].pn > 0.0:
            pushed = True
            is_barrier, item = owner_of(model.cores, keys[k])
            if is_barrier:
                marks.fences[item] = True
                summary.barrier_hits = insert_sorted(scratch.hit_barriers, summary.barrier_hits, item)
            else:
                summary.tree_hits = insert_sorted(scratch.hit_trees, summary.tree_hits, item)
    return pressed, reached, pushed, deepest


@inlined
def move_on(model, log, state, scratch, summary, stop):
    """4. Free motion to the next node, x += dt v, and the rotation of a free top [a]. Returns the reason to stop there,
    -1 for none.
    """
    settings, way = model.settings, scratch.way[0]
    dt = way.dt
    if not (way.speed < WILD_SPEED and way.energy < math.inf):  # a NaN, also of the spin or the axis, fails both
        return FAILED
    if way.lost:
        return FAILED
    fastest, bend = travel_bound(model.cloud, state, log.body)
    way.path += dt * (fastest + 0.5 * bend * dt)
    move_freely(state, log.body, dt)
    way.time += dt
    summary.path += dt * way.speed
    watch(scratch.rocking, state, log.body, way.energy, settings.rest_speed)
    height, _, _ = surface(model.terrain, log.frame[0], log.frame[1], state[X], state[Y])
    if height != height or way.undermined:
        return LEFT_DEM
    way.height = state[Z] - height
    scratch.memory[PEAK_HEIGHT] = max(scratch.memory[PEAK_HEIGHT], way.height)
    summary.height_max = max(summary.height_max, way.height)
    if way.time >= settings.time_limit:
        return TIME_LIMIT
    if way.time >= way.next_look:
        way.next_look = way.time + REST_WINDOW
        reason = -1
        if ends_moved(scratch.rest, state, log.body) < REST_TRAVEL * settings.rest_speed * REST_WINDOW:
            reason, summary.item_row, summary.grip = rest_reason(model, log, state, scratch)
        remember_pose(scratch.rest, state, log.body)
        return reason
    if way.time >= way.next_rocking:
        way.next_rocking = way.time + ROCKING_WINDOW
        if rocks_in_place(scratch.rocking, settings.rest_speed):
            held = holder(model.cores, scratch.contacts, scratch.keys, way.count)
            reason, summary.item_row, summary.grip = held
            return reason
    elif summary.steps % POLL_STEPS == 0 and stop[0] != 0:
        return INTERRUPTED
    return -1
