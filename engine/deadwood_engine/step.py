"""The slide of one log: Moreau's time stepping from midpoint to midpoint, until it rests, leaves, or reaches the time
limit.

A step (paper, section 3.2; engine/README.md for the equations) starts at a node, where contacts act. Four phases:
1. ``choose_step``: its length, from the speed of the log's fastest point, the DEM's cell and the obstacles nearby;
2. ``push``: the contacts of the pose that free motion would reach at the next node; gravity, half for the step behind
and
   half for the step ahead; and the velocities that the contacts permit;
3. ``keep_books``: energy, penetration, hits;
4. ``move_on``: the drift to the next node (parabola and rotation are exact, for equal steps or not), and a possible end
there.

The length is chosen before the contacts are found: a step that grew afterwards would carry the log past the plane
that it is only allowed to reach.
"""

from __future__ import annotations

import math

from .asymmetric_top import energy_of, move_freely
from .barriers import pierced
from .breaking import break_trees, note_broken
from .compiled import inlined, kernel
from .contact_solver import find_old, remember, solve, turn_around, warm_start
from .contacts import TERRAIN, first_rebound, set_frames
from .cores import BARRIER
from .detection import contacts_at, find_contacts, lowest_gap, owner_of
from .energy import impulse_work
from .grid_index import insert_sorted
from .impacts import make_admissible, rebounds_at_all
from .influence import NOW, copy_notes, note, note_all, note_step, open_notes
from .ledger import note_pushes
from .limits import (
    AT_ONCE,
    BELOW_GROUND,
    BURIED,
    CLOUD_TURN,
    LEAST_SPENT,
    LEAST_TOLERANCE,
    LEAST_TURN,
    MADE_ANEW,
    MET_AT_ONCE,
    OBSTACLE_TRAVEL,
    POLL_STEPS,
    REST_TRAVEL,
    REST_WINDOW,
    ROCKING_WINDOW,
    SAFE,
    SHORTEST_STEP,
    WILD_SPEED,
)
from .log_body import AXIAL, BASE_RADIUS
from .obstacles import could_pass, time_beside
from .outline import count_danger
from .pressure import join_lines
from .rest import FAILED, INTERRUPTED, LEFT_DEM, ON_ITS_WAY, TIME_LIMIT, holder, rest_reason
from .rocking import forget_windows, rocks_in_place, watch
from .rolling import start_rolling
from .rotation import VX, VY, VZ, WX, WY, WZ, X, Y, Z, set_axis, spin_of
from .scarring import drag, step_in_scar
from .slip import slip_after
from .stages import all_reached, go_on, keep_stage
from .surroundings import know_nothing
from .terrain import surface
from .trace import (
    PEAK_ENERGY,
    PEAK_HEIGHT,
    PEAK_JUMP,
    PEAK_SPEED,
    SEEN,
    Marks,
    draw,
    draw_deposit,
    ends_moved,
    forget_after,
    forget_touches,
    keep_pose,
    outline_is_due,
    remember_peaks,
    remember_pose,
    remember_turn,
)
from .travel import fastest_point, travel_bound
from .turning import turn_contacts


@kernel
def is_finite(state):
    """Whether every number of a state is finite: the terrain lookup and the outlines rely on it."""
    amiss = 0.0
    for k in range(state.shape[0]):
        amiss += state[k] - state[k]  # 0, or NaN
    return amiss == 0.0


@inlined
def begin(scene, frame, state, body, stations, settings, scratch, way, summary):
    """The contacts of the release, and all balances initialised."""
    rolling = scratch.rolling[0]
    rolling.moment = rolling.moment_before = rolling.spin_before = 0.0
    rolling.inertia, rolling.skin = body[AXIAL], body[BASE_RADIUS]
    know_nothing(scratch.near[0])
    way.time = way.before = way.last_kick = way.path = way.work = way.slip = 0.0
    way.scar = way.scar_ahead = way.dragged = 0.0
    way.enters = math.inf
    way.next_look, way.next_rocking = REST_WINDOW, ROCKING_WINDOW
    way.old_count, way.kept, way.pressed, way.undermined, way.sunk, way.lost = 0, 0, False, False, math.inf, False
    count, way.travel, way.whole = contacts_at(
        scene, frame, state, body, stations, settings, AT_ONCE, 0.0, 0.0, scratch, True
    )
    way.buried = False
    for k in range(count):
        if scratch.keys[k, 0] != TERRAIN and scratch.contacts[k].gap < 0.0:
            summary.started_in_contact = True
        way.buried = way.buried or (scratch.keys[k, 0] == TERRAIN and scratch.contacts[k].gap < -body[BASE_RADIUS])
    for k in range(scratch.near[0].cores):
        if scratch.near_cores[k].kind == BARRIER and pierced(body, state, scratch.near_cores[k]):
            summary.started_in_contact = True
            if scratch.noted.shape[0] > 0:
                note(scratch.noted, scratch.notes, scratch.book, scratch.listed[k])
    way.gap = lowest_gap(scene, frame, state, body, stations, scratch)
    way.speed = math.sqrt(state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2)
    way.energy = energy_of(state, body)
    height, _, _ = surface(scene.terrain, frame[0], frame[1], state[X], state[Y])
    way.height = state[Z] - height if height == height else 0.0
    summary.speed_max, summary.energy_max, summary.jump_max = way.speed, way.energy, way.gap
    summary.height_max = way.height
    remember_pose(scratch.memory, state, body)
    remember_turn(scratch.memory, state)
    remember_peaks(scratch.memory, way.speed, way.energy, way.gap, way.height)
    remember_pose(scratch.rest, state, body)
    forget_windows(scratch.rocking)


@inlined
def choose_step(scene, frame, state, body, settings, scratch, way):
    """1. Gravity's second half for the previous step, and the length of this one."""
    gravity = settings.gravity
    state[VZ] -= 0.5 * gravity * way.before
    fastest, bend, roll = travel_bound(scene.cloud, state, body)
    bend += gravity
    pace = fastest + roll
    pace = 0.5 * (pace + math.sqrt(pace * pace + 2.0 * bend * settings.travel))  # the mean over that distance
    dt = min(settings.time_step, settings.travel / pace) if pace > 0.0 else settings.time_step
    limited = False
    if way.travel < settings.travel:
        # beside a thin or lying obstacle: by the surface of the log, which may strike it
        most = way.travel / (fastest_point(state, body) + 0.5 * gravity * settings.time_step)
        limited = most < dt
        dt = min(dt, most)
    dt, decider = time_beside(scratch.near_cores, scratch.near[0].beside, state, body, gravity, dt)
    if scratch.noted.shape[0] > 0:
        scratch.book[NOW] = way.time
        note_step(
            scratch.noted, scratch.notes, scratch.book, scratch.listed, scratch.near_cores, scratch.near[0],
            settings.travel, decider, limited, could_pass(state, body, gravity, SAFE * scratch.near[0].clear, dt),
        )  # fmt: skip
    if scene.cloud is not None:
        turn = math.sqrt(state[WX] ** 2 + state[WY] ** 2 + state[WZ] ** 2)
        dt = min(dt, CLOUD_TURN / turn) if turn > 0.0 else dt
        if settings.strength > 0.0:
            dt = min(dt, step_in_scar(scene.cloud, scene.terrain, frame, state, settings, way.scar))
    way.dt, way.fastest, way.bend = max(dt, SHORTEST_STEP), fastest, bend


@inlined
def push(scene, frame, state, body, stations, settings, scratch, way, summary):
    """2. The contacts of the pose at the end of the step, and the velocities that they permit (eq. 5).

    Repeated with a shorter step if these velocities would pass a stem well within it, or if a contact rebounds late in
    it, or if a body enters ground that it scars.
    """
    gravity, rolling, contacts, keys = settings.gravity, scratch.rolling[0], scratch.contacts, scratch.keys
    bounces = settings.restitution + settings.tree_restitution + settings.barrier_restitution > 0.0
    dt, on_terrain, count, rebounds, met, anew = way.dt, True, 0, False, False, False
    vx, vy, vz, enters = state[VX], state[VY], state[VZ], False
    for _ in range(4):
        advance = dt * (way.fastest + 0.5 * way.bend * dt)
        way.kick = 0.5 * (way.before + dt)
        if settings.strength > 0.0:
            state[VX], state[VY], state[VZ] = vx, vy, vz
            way.dragged = drag(scene.cloud, scene.terrain, frame, state, body, settings, scratch, way.kick)
        count, way.travel, on_terrain = find_contacts(
            scene, frame, state, body, stations, settings, dt, way.path, advance, scratch, True
        )
        if settings.strength > 0.0 and not enters and way.enters < dt:
            dt, enters = max(way.enters, SHORTEST_STEP), True
            continue
        if bounces:
            touch = first_rebound(contacts, count, gravity)
            rebounds = touch < math.inf
            if rebounds and not met and not anew and MET_AT_ONCE * dt < touch < dt:
                dt, met = max(touch, SHORTEST_STEP), True
                continue
        find_old(contacts, keys, count, scratch.old_keys, way.old_count)
        if scene.cloud is None:  # the points of a cloud turn with it
            turn_contacts(
                contacts, keys, count, state, scratch.old_contacts,
                gravity * way.kick, 0.5 * gravity * way.before, LEAST_TURN * gravity * dt,
            )  # fmt: skip
        if settings.backward:
            turn_around(contacts, keys, count, scratch.spare)
        way.tolerance = settings.tolerance * gravity * dt + LEAST_TOLERANCE
        lines = scene.cloud is None and count > 2 and join_lines(contacts, count, state, dt)
        set_frames(contacts, count, state, body)
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
        used, way.residual = solve(contacts, count, state, rolling, way.tolerance, settings.sweeps, lines)
        summary.sweeps += used
        if anew:
            break
        noting = scratch.noted.shape[0] > 0
        if noting and could_pass(state, body, gravity, SAFE * scratch.near[0].clear, MADE_ANEW * dt):
            note_all(scratch.notes, scratch.book)
        beside = scratch.near[0].beside
        if beside == 0:
            break
        sooner, decider = time_beside(scratch.near_cores, beside, state, body, gravity, dt)
        if sooner >= MADE_ANEW * dt:
            break
        if noting:
            note_step(
                scratch.noted, scratch.notes, scratch.book, scratch.listed, scratch.near_cores, scratch.near[0],
                settings.travel, decider, False, False,
            )  # fmt: skip
        for k in range(6):
            state[VX + k] = scratch.free[k]
        state[VZ] += 0.5 * gravity * dt
        dt, anew = max(sooner, SHORTEST_STEP), True
    way.dt, way.count, way.whole = dt, count, way.whole and on_terrain


@inlined
def keep_books(scene, frame, state, body, settings, scratch, way, marks, hits, summary):
    """3. The effect of the contacts: their work, their depth, the obstacles hit, and the initial state of the next
    step.
    """
    gravity, rolling, contacts, keys = settings.gravity, scratch.rolling[0], scratch.contacts, scratch.keys
    bounces = settings.restitution + settings.tree_restitution + settings.barrier_restitution > 0.0
    dt, count, pressed, deepest = way.dt, way.count, False, 0.0
    if count > 0:
        summary.contacts += count
        # the work is that of the velocities at the node, between gravity's two halves
        gained = impulse_work(contacts, count, state, VX, 0.5 * gravity * dt, rolling, spin_of(state))
        # Newton's law, contact by contact, can generate energy where several act
        if way.residual > way.tolerance or (gained > 0.0 and bounces and rebounds_at_all(contacts, count)):
            gained, way.residual, used = make_admissible(
                contacts, count, state, body, scratch.free, scratch.trial_state, rolling, way.tolerance,
                settings.sweeps, way.residual, 0.5 * gravity * dt, gained,
            )  # fmt: skip
            summary.sweeps += used
        standing = count
        if settings.breaks:
            fall = 0.5 * gravity * dt
            standing = break_trees(scene, state, body, settings, scratch, way, hits, summary.hits, count, fall, bounces)
            if standing < count:
                gained = impulse_work(contacts, count, state, VX, fall, rolling, spin_of(state))
        if way.residual > way.tolerance:
            summary.unconverged += 1
        summary.residual = max(summary.residual, way.residual)
        way.work += gained
        summary.energy_gain += max(0.0, gained)
        pushed = False  # by an obstacle
        for k in range(count):
            ground = keys[k, 0] == TERRAIN
            pressed = pressed or (ground and contacts[k].pn > 0.0)
            depth = -contacts[k].gap  # NaN if the ground begins within the step
            if ground and not way.whole and depth > BURIED * body[BASE_RADIUS]:
                way.undermined = True
            elif ground and depth > summary.penetration:
                summary.penetration = depth
            if ground and way.whole and not way.buried:
                deepest = max(deepest, depth)
                below = depth > body[BASE_RADIUS] + settings.travel
                way.lost = way.lost or (below and way.time - way.sunk > BELOW_GROUND)
            if not ground and not summary.started_in_contact:  # not the overlap with which a log was released
                summary.overlap = max(summary.overlap, depth)
                deepest = max(deepest, depth)
                both = body[BASE_RADIUS] + scene.cores.solid[keys[k, 1]].wide
                allowed = body[BASE_RADIUS] + max(settings.travel, OBSTACLE_TRAVEL * both)
                way.lost = way.lost or depth > allowed
            if not ground and contacts[k].pn > 0.0:
                pushed = True
                is_barrier, item = owner_of(scene, keys[k])
                if is_barrier:
                    marks.fences[item] = True
                    summary.barrier_hits = insert_sorted(scratch.hit_barriers, summary.barrier_hits, item)
                else:
                    summary.tree_hits = insert_sorted(scratch.hit_trees, summary.tree_hits, item)
        if pushed:
            fall = 0.5 * gravity * dt
            struck = energy_of(state, body) + fall * (state[VZ] + 0.5 * fall) - gained
            summary.hits = note_pushes(
                scene, frame, state, scratch.free, contacts, keys, count,
                (way.time, dt, summary.steps, gravity), struck, hits, summary.hits,
            )  # fmt: skip
        if standing < count:
            note_broken(scene, keys, standing, count, hits, summary.hits, way.time)
            count = way.count = standing  # broken trees support nothing any more
        rolling.moment_before = rolling.moment
    else:
        rolling.moment_before = 0.0
        summary.airborne += 1
    if settings.strength > 0.0:
        way.work += way.dragged
        way.scar = way.scar_ahead
    if scene.cloud is not None and settings.friction_kappa > 0.0:
        way.slip = slip_after(contacts, keys, count, state, way.slip, settings.friction_beta, dt)
    way.pressed = pressed
    way.sunk = min(way.sunk, way.time) if deepest > body[BASE_RADIUS] else math.inf
    way.old_count = remember(contacts, keys, count, state, scratch.old_keys, scratch.old_contacts, scene.cloud is None)
    way.before, way.last_kick = dt, way.kick
    way.speed = math.sqrt(state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2)
    way.energy = energy_of(state, body)
    memory = scratch.memory
    memory[PEAK_SPEED] = max(memory[PEAK_SPEED], way.speed)
    memory[PEAK_ENERGY] = max(memory[PEAK_ENERGY], way.energy)
    summary.speed_max = max(summary.speed_max, way.speed)
    summary.energy_max = max(summary.energy_max, way.energy)


@inlined
def move_on(scene, frame, state, body, stations, settings, scratch, way, summary, stop):
    """4. Free motion to the next node. Returns the reason to stop there, -1 for none."""
    dt = way.dt
    if not (way.speed < WILD_SPEED and way.energy < math.inf):  # a NaN, also of the spin or the axis, fails both
        return FAILED
    if way.lost:
        return FAILED
    fastest, bend, _ = travel_bound(scene.cloud, state, body)
    way.path += dt * (fastest + 0.5 * bend * dt)
    move_freely(state, body, dt)
    way.time += dt
    summary.path += dt * way.speed
    watch(scratch.rocking, state, body, way.energy, settings.rest_speed)
    height, _, _ = surface(scene.terrain, frame[0], frame[1], state[X], state[Y])
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
        if ends_moved(scratch.rest, state, body) < REST_TRAVEL * settings.rest_speed * REST_WINDOW:
            reason, summary.item_row, summary.grip = rest_reason(
                scene, frame, state, body, stations, settings, way.path, scratch, way.old_count, 1.0 / way.before
            )
        remember_pose(scratch.rest, state, body)
        return reason
    if way.time >= way.next_rocking:
        way.next_rocking = way.time + ROCKING_WINDOW
        if rocks_in_place(scratch.rocking, settings.rest_speed):
            reason, summary.item_row, summary.grip = holder(scene, scratch, way.count)
            return reason
    elif summary.steps % POLL_STEPS == 0 and stop[0] != 0:
        return INTERRUPTED
    return -1


@kernel
def slide_log(
    scene, frame, state, body, stations, settings, scratch, rasters, row, marks, poses, keep, hits, summary, stage, stop
):
    """Slide one log from its initial state to its end.

    Parameters
    ----------
    scene : SceneArrays; frame : int64 (2,), DEM node of the log's frame; body : row of the body table
    state : (16,), initial state, replaced by the final one; stations : number of rings
    rasters, marks, poses, hits, summary : outputs; row : the log's number, for the rasters' stamp; keep : whether to
    store poses
    stage : row of the stage from which it is continued, whose summary is given, or -1
    stop : uint8 (1,), non-zero when the user interrupts

    Returns
    -------
    number of poses needed (if more than fit in ``poses`` or, in the summary, ``hits``: run again with more room)
    """
    set_axis(state)
    if not is_finite(state):
        summary.reason = FAILED
        return 0
    way, memory, work = scratch.way[0], scratch.memory, (scratch.points, scratch.hull, scratch.left, scratch.right)
    energy_start = energy_of(state, body) + settings.gravity * state[Z]
    if stage >= 0:
        go_on(scratch.stages, stage, scene, frame, body, scratch, state, marks)
    else:
        begin(scene, frame, state, body, stations, settings, scratch, way, summary)
    reason, first = -1, stage < 0
    while True:
        over = reason >= 0
        cell, moved = scene.terrain.cell, ends_moved(memory, state, body)
        grain = max(cell, 2.0 * settings.travel)
        most = settings.trace_step if scene.cloud is None else min(settings.trace_step, cell)  # a cloud's outline turns
        drawn = first or over or outline_is_due(memory, state, body, moved, most, grain)
        flies = way.count == 0 and moved >= memory[SEEN] + grain
        if reason != FAILED and not first and ((drawn and (keep or not over)) or flies):
            way.gap = 0.0 if way.pressed else lowest_gap(scene, frame, state, body, stations, scratch)
            memory[SEEN] = moved
            if not over:
                memory[PEAK_JUMP] = max(memory[PEAK_JUMP], way.gap)
                summary.jump_max = max(summary.jump_max, way.gap)
        if reason != FAILED and drawn:
            draw(scene, frame, state, body, memory, work, rasters, row, marks, way.time)
            remember_peaks(memory, way.speed, way.energy, way.gap, way.height)
            if keep:
                way.kept = keep_pose(poses, way.kept, way.time, state, body, way.gap, way.height)
        if over:
            if reason == FAILED:
                forget_after(marks, way.sunk)
            break
        first = False
        if settings.until_reached and all_reached(marks):
            reason = ON_ITS_WAY
            break
        if settings.stage_steps > 0 and summary.steps % settings.stage_steps == 0:
            keep_stage(scratch.stages, scratch, state, summary, marks, settings.travel)
        summary.steps += 1
        choose_step(scene, frame, state, body, settings, scratch, way)
        push(scene, frame, state, body, stations, settings, scratch, way, summary)
        keep_books(scene, frame, state, body, settings, scratch, way, marks, hits, summary)
        reason = move_on(scene, frame, state, body, stations, settings, scratch, way, summary, stop)
    fall = 0.5 * settings.gravity * way.before  # the velocities are those of the middle of the previous step
    sunk = state[VZ]
    state[VZ] -= fall
    change = energy_of(state, body) + settings.gravity * state[Z] - energy_start - way.work
    state[VZ] = sunk
    spent = max(energy_start - settings.gravity * state[Z], LEAST_SPENT)  # the energy that was available
    summary.energy_error = (abs(change) + summary.energy_gain) / spent
    summary.reason, summary.duration = reason, way.time
    return way.kept


@kernel
def slide_logs(
    scene, frames, starts, bodies, stations, settings, scratch, rasters, stamps, marks, poses, keep, hits, notes, own,
    told, states, summaries, going_on, first, last, stop,
):  # fmt: skip
    """Slide the logs from row ``first`` to before ``last``, one after the other.

    Parameters are those of ``slide_log``, for all logs; own (16,), told (2,) : buffers for one log's state and summary,
    which are copied to their rows of states and summaries, and the summary of a log that has not started. The hits of
    one log follow those of another in ``hits``, and so do its stored poses in ``poses`` and the obstacles that mattered
    to it in ``notes``; the summaries have their numbers.
    going_on : int64 (n,), rows of the stages from which logs are continued, -1: from their start

    Logs whose stages are stored are processed one at a time, and none is started if less than half of the room for
    poses is left: a log that finds too little has to slide again.

    Returns (row of the next log, number of poses needed by it if there was too little room for them or, according to
    ``told``, for its hits or notes).
    """
    used, filled, posed = 0, 0, 0
    for row in range(first, last):
        for k in range(own.shape[0]):
            own[k] = starts[row, k]
        told[0] = told[1]
        if going_on[row] >= 0:
            told[0] = scratch.stages.summary[going_on[row]]
            told[0].hits, told[0].tree_hits, told[0].barrier_hits = 0, 0, 0
        open_notes(scratch.noted, scratch.notes, scratch.book)
        each = Marks(marks.lines[row], marks.fences[row], marks.crossed[row], marks.line_time[row], marks.inside[row])
        wanted = slide_log(
            scene, frames[row], own, bodies[row], stations[row], settings, scratch, rasters, stamps[row], each,
            poses[posed:] if keep[row] else poses[:0], keep[row], hits[used:], told[0], going_on[row], stop,
        )  # fmt: skip
        struck, mattered = told[0].hits, copy_notes(scratch.notes, scratch.book, notes, filled)
        told[0].influences, told[0].poses = mattered, wanted if keep[row] else 0
        full = keep[row] and wanted > poses.shape[0] - posed
        if full or struck > hits.shape[0] - used or filled + mattered > len(notes):
            forget_touches(each)
            return row, wanted
        count_danger(rasters.passed, rasters.order, rasters.danger)
        used, filled, posed = used + struck, filled + mattered, posed + told[0].poses
        for k in range(own.shape[0]):
            states[row, k] = own[k]
        summaries[row] = told[0]
        reason = told[0].reason
        if reason != LEFT_DEM and reason != FAILED and reason != INTERRUPTED and reason != ON_ITS_WAY:
            work = (scratch.points, scratch.hull, scratch.left, scratch.right)
            draw_deposit(scene, frames[row], own, bodies[row], scratch.memory, work, rasters)
        if settings.stage_steps > 0 or 2 * posed > poses.shape[0]:
            return row + 1, wanted
    return last, 0
