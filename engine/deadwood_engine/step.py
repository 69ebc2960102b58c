"""One log's slide: Moreau's time stepping from midpoint to midpoint, until it rests, leaves, or runs out of time.

A step (paper, section 3.2; engine/README.md for the equations) stands at a node, where contacts act:
1. choose how far to go from the speed of the log's fastest point, the DEM's cell and the obstacles near;
2. find the contacts of the pose that free motion would reach at the next node;
3. add gravity's impulse, half for the way that lies behind and half for the way ahead, and solve for the velocities;
4. drift to the next node (the parabola and the rotation are exact, for equal steps or not);
5. keep the books: energy, penetration, hits, outlines, rest.

The way ahead is chosen before its contacts are found: a step that grew afterwards would carry the log past the plane
that it may just reach.
"""

from __future__ import annotations

import math

from .asymmetric_top import energy_of, move_freely
from .barriers import pierced
from .compiled import kernel
from .contact_solver import find_old, remember, solve, turn_around, warm_start
from .contacts import GAP, PN, TERRAIN, set_frames
from .cores import BARRIER
from .detection import find_contacts, lowest_gap, owner_of
from .energy import impulse_work, take_no_energy
from .grid_index import insert_sorted
from .ledger import note_pushes
from .limits import (
    CLOUD_TURN,
    LEAST_TURN,
    MADE_ANEW,
    POLL_STEPS,
    REST_TRAVEL,
    REST_WINDOW,
    ROCKING_WINDOW,
    SHORTEST_STEP,
    WILD_SPEED,
)
from .log_body import AXIAL, BASE_RADIUS
from .obstacles import time_beside
from .outline import count_danger
from .rest import FAILED, INTERRUPTED, LEFT_DEM, TIME_LIMIT, holder, rest_reason
from .rocking import forget_windows, rocks_in_place, watch
from .rolling import INERTIA, MOMENT, MOMENT_BEFORE, SKIN, SPIN_BEFORE, spin_of, start_rolling
from .rotation import VX, VY, VZ, WX, WY, WZ, X, Y, Z, set_axis
from .surroundings import BESIDE, CORES
from .terrain import surface
from .trace import (
    PEAK_ENERGY,
    PEAK_JUMP,
    PEAK_SPEED,
    Marks,
    draw,
    draw_deposit,
    ends_moved,
    forget_touches,
    keep_pose,
    remember_peaks,
    remember_pose,
    remember_turn,
)
from .travel import fastest_point, travel_bound
from .turning import turn_contacts

# Columns of a log's summary
REASON, ITEM, DURATION, PATH, SPEED_MAX, ENERGY_MAX, JUMP_MAX, ENERGY_ERROR, PENETRATION, OVERLAP = range(10)
RESIDUAL, UNCONVERGED, STEPS, CONTACTS, SWEEPS, TREE_HITS, BARRIER_HITS, STARTED_IN_CONTACT = range(10, 18)
ENERGY_GAIN, AIRBORNE, HITS = range(18, 21)
SUMMARY_WIDTH = 21


@kernel
def is_finite(state):
    """Whether every number of a state is one: what looks up places and draws outlines counts on that."""
    amiss = 0.0
    for k in range(state.shape[0]):
        amiss += state[k] - state[k]  # 0, or NaN
    return amiss == 0.0


@kernel
def slide_log(
    scene, frame, state, body, stations, settings, scratch, rasters, row, marks, poses, keep, hits, summary, stop
):
    """Slide one log from its initial state to its end.

    Parameters
    ----------
    scene : SceneArrays; frame : int64 (2,), DEM node of the log's frame; body : row of the body table
    state : (16,), initial state, replaced by the final one; stations : number of rings
    rasters, marks, poses, hits, summary : outputs; row : the log's number, for the rasters' stamp; keep : keep poses
    stop : uint8 (1,), not zero when the user interrupts

    Returns
    -------
    number of poses wanted (more than ``poses`` or, in the summary, ``hits`` holds: run again with more room)
    """
    set_axis(state)
    gravity = settings.gravity
    work = (scratch.points, scratch.hull, scratch.left, scratch.right)
    memory, rolling = scratch.memory, scratch.rolling
    bounces = settings.restitution + settings.tree_restitution + settings.barrier_restitution > 0.0
    rolling[:] = 0.0
    rolling[INERTIA], rolling[SKIN] = body[AXIAL], body[BASE_RADIUS]
    scratch.near[:] = 0.0
    summary[:] = 0.0
    summary[ITEM] = -1
    if not is_finite(state):
        summary[REASON] = FAILED
        return 0
    energy_start = energy_of(state, body) + gravity * state[Z]
    time, before, last_kick, done_work, next_look, next_rocking = 0.0, 0.0, 0.0, 0.0, REST_WINDOW, ROCKING_WINDOW
    kept, steps, old_count, tree_hits, barrier_hits, hit_count = 0, 0, 0, 0, 0, 0
    count, travel, whole = find_contacts(scene, frame, state, body, stations, settings, 1e-9, 0.0, 0.0, scratch, True)
    for k in range(count):
        if scratch.keys[k, 0] != TERRAIN and scratch.contacts[k, GAP] < 0.0:
            summary[STARTED_IN_CONTACT] = 1.0
    for k in range(int(scratch.near[CORES])):
        if scratch.near_cores[k].kind == BARRIER and pierced(body, state, scratch.near_cores[k]):
            summary[STARTED_IN_CONTACT] = 1.0
    gap = lowest_gap(scene, frame, state, body, stations, scratch)
    path = 0.0
    remember_pose(memory, state, body)
    remember_turn(memory, state)
    speed, energy = math.sqrt(state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2), energy_of(state, body)
    remember_peaks(memory, speed, energy, gap)
    summary[SPEED_MAX], summary[ENERGY_MAX], summary[JUMP_MAX] = speed, energy, gap
    draw(scene, frame, state, body, memory, work, rasters, row, marks, 0.0)
    remember_pose(scratch.rest, state, body)
    forget_windows(scratch.rocking)
    if keep:
        kept = keep_pose(poses, kept, 0.0, state, body, gap)
    reason, pressed, used, residual, tolerance = -1, False, 0, 0.0, 0.0
    while reason < 0:
        # 1. gravity's second half for the step before, and the length of this one
        state[VZ] -= 0.5 * gravity * before
        fastest, bend, roll = travel_bound(scene.cloud, state, body)
        bend += gravity
        pace = fastest + roll
        pace = 0.5 * (pace + math.sqrt(pace * pace + 2.0 * bend * settings.travel))  # the mean on that way
        dt = min(settings.time_step, settings.travel / pace) if pace > 0.0 else settings.time_step
        if travel < settings.travel:
            # beside what is thin, or lies: by the skin, which may strike it
            dt = min(dt, travel / (fastest_point(state, body) + 0.5 * gravity * settings.time_step))
        dt = time_beside(scratch.near_cores, int(scratch.near[BESIDE]), state, body, gravity, dt)
        if scene.cloud is not None:
            turn = math.sqrt(state[WX] ** 2 + state[WY] ** 2 + state[WZ] ** 2)
            dt = min(dt, CLOUD_TURN / turn) if turn > 0.0 else dt
        dt = max(dt, SHORTEST_STEP)
        steps += 1
        # 2. contacts of the pose a step ahead, 3. velocities; anew where these would pass a tree well within the step
        kick, on_terrain = 0.0, True
        for attempt in range(2):
            advance = dt * (fastest + 0.5 * bend * dt)
            kick = 0.5 * (before + dt)
            count, travel, on_terrain = find_contacts(
                scene, frame, state, body, stations, settings, dt, path, advance, scratch, True
            )
            find_old(scratch.contacts, scratch.keys, count, scratch.old_keys, old_count)
            if scene.cloud is None:  # the points of a cloud turn with it
                turn_contacts(
                    scratch.contacts, scratch.keys, count, state, scratch.old_contacts,
                    gravity * kick, 0.5 * gravity * before, LEAST_TURN * gravity * dt,
                )  # fmt: skip
            set_frames(scratch.contacts, count, state, body)
            if settings.backward:
                turn_around(scratch.contacts, scratch.keys, count)
            state[VZ] -= 0.5 * gravity * dt
            if count == 0:
                break
            for k in range(6):
                scratch.free[k] = state[VX + k]
            rolling[SPIN_BEFORE] = spin_of(state)
            ratio = kick / last_kick if last_kick > 0.0 and not bounces else 0.0
            if ratio > 0.0:
                warm_start(scratch.contacts, count, state, scratch.old_contacts, ratio)
            start_rolling(rolling, scratch.contacts, count, state, ratio)
            tolerance = settings.tolerance * gravity * dt + 1e-15
            used, residual = solve(scratch.contacts, count, state, rolling, tolerance, settings.sweeps)
            summary[SWEEPS] += used
            beside = int(scratch.near[BESIDE])
            if attempt == 1 or beside == 0:
                break
            sooner = time_beside(scratch.near_cores, beside, state, body, gravity, dt)
            if sooner >= MADE_ANEW * dt:
                break
            for k in range(6):
                state[VX + k] = scratch.free[k]
            state[VZ] += 0.5 * gravity * dt
            dt = max(sooner, SHORTEST_STEP)
        whole = whole and on_terrain
        if count > 0:
            summary[CONTACTS] += count
            summary[RESIDUAL] = max(summary[RESIDUAL], residual)
            # the work is that of the velocities at the node, between gravity's two halves
            gained = impulse_work(scratch.contacts, count, state, VX, 0.5 * gravity * dt, rolling, spin_of(state))
            unfinished = residual > tolerance
            if unfinished:
                summary[UNCONVERGED] += 1
            # Newton's law, contact by contact, can give energy where several act: not beyond gravity's own share
            bouncing = bounces and gained > 0.125 * (gravity * dt) ** 2
            if gained > 0.0 and (unfinished or bouncing):
                gained = take_no_energy(
                    scratch.contacts, count, state, scratch.free, gained, 0.5 * gravity * dt, rolling
                )
            # 5. books
            done_work += gained
            summary[ENERGY_GAIN] += max(0.0, gained)
            pushed = pressed = False  # against an obstacle, on the ground
            for k in range(count):
                ground = scratch.keys[k, 0] == TERRAIN
                pressed = pressed or (ground and scratch.contacts[k, PN] > 0.0)
                # not the overlap that a log was released with, nor what sank where the DEM ends
                if whole if ground else summary[STARTED_IN_CONTACT] == 0.0:
                    at = PENETRATION if ground else OVERLAP
                    summary[at] = max(summary[at], -scratch.contacts[k, GAP])
                if not ground and scratch.contacts[k, PN] > 0.0:
                    pushed = True
                    is_barrier, item = owner_of(scene, scratch.keys[k])
                    if is_barrier:
                        marks.fences[item] = True
                        barrier_hits = insert_sorted(scratch.hit_barriers, barrier_hits, item)
                    else:
                        tree_hits = insert_sorted(scratch.hit_trees, tree_hits, item)
            if pushed:
                fall = 0.5 * gravity * dt
                struck = energy_of(state, body) + fall * (state[VZ] + 0.5 * fall) - gained
                hit_count = note_pushes(
                    scene, frame, state, scratch.free, scratch.contacts, scratch.keys, count,
                    (time, dt, steps, gravity), struck, hits, hit_count,
                )  # fmt: skip
            rolling[MOMENT_BEFORE] = rolling[MOMENT]
        else:
            pressed = False
            rolling[MOMENT_BEFORE] = 0.0
            summary[AIRBORNE] += 1
        old_count = remember(
            scratch.contacts, scratch.keys, count, state, scratch.old_keys, scratch.old_contacts, scene.cloud is None
        )
        before, last_kick = dt, kick
        speed = math.sqrt(state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2)
        energy = energy_of(state, body)
        memory[PEAK_SPEED] = max(memory[PEAK_SPEED], speed)
        memory[PEAK_ENERGY] = max(memory[PEAK_ENERGY], energy)
        summary[SPEED_MAX] = max(summary[SPEED_MAX], speed)
        summary[ENERGY_MAX] = max(summary[ENERGY_MAX], energy)
        if not (speed < WILD_SPEED and energy < math.inf):  # NaN, of the spin or the axis too, is less than nothing
            reason = FAILED
            break
        # 4. free motion to the next node
        fastest, bend, _ = travel_bound(scene.cloud, state, body)
        path += dt * (fastest + 0.5 * bend * dt)
        move_freely(state, body, dt)
        time += dt
        summary[PATH] += dt * speed
        watch(scratch.rocking, state, body, energy, settings.rest_speed)
        height, _, _ = surface(scene.terrain, frame[0], frame[1], state[X], state[Y])
        if height != height:
            reason = LEFT_DEM
        elif time >= settings.time_limit:
            reason = TIME_LIMIT
        elif time >= next_look:
            next_look = time + REST_WINDOW
            if ends_moved(scratch.rest, state, body) < REST_TRAVEL * settings.rest_speed * REST_WINDOW:
                reason, item = rest_reason(
                    scene, frame, state, body, stations, settings, path, scratch, old_count, 1.0 / before
                )
                summary[ITEM] = item
            remember_pose(scratch.rest, state, body)
        elif time >= next_rocking:
            next_rocking = time + ROCKING_WINDOW
            if rocks_in_place(scratch.rocking, settings.rest_speed):
                reason, item = holder(scene, scratch, count)
                summary[ITEM] = item
        elif steps % POLL_STEPS == 0 and stop[0] != 0:
            reason = INTERRUPTED
        if reason < 0 and ends_moved(memory, state, body) >= settings.trace_step:
            gap = 0.0 if pressed else lowest_gap(scene, frame, state, body, stations, scratch)
            memory[PEAK_JUMP] = max(memory[PEAK_JUMP], gap)
            summary[JUMP_MAX] = max(summary[JUMP_MAX], gap)
            draw(scene, frame, state, body, memory, work, rasters, row, marks, time)
            remember_peaks(memory, speed, energy, gap)
            if keep:
                kept = keep_pose(poses, kept, time, state, body, gap)
    if reason != FAILED:
        draw(scene, frame, state, body, memory, work, rasters, row, marks, time)
        if keep:
            gap = 0.0 if pressed else lowest_gap(scene, frame, state, body, stations, scratch)
            kept = keep_pose(poses, kept, time, state, body, gap)
    sunk = state[VZ]
    state[VZ] -= 0.5 * gravity * before
    change = energy_of(state, body) + gravity * state[Z] - energy_start - done_work
    state[VZ] = sunk
    # of the energy that the run had to spend, at least that of a metre's fall
    summary[ENERGY_ERROR] = (abs(change) + summary[ENERGY_GAIN]) / max(energy_start - gravity * state[Z], 9.81)
    summary[REASON] = reason
    summary[DURATION] = time
    summary[STEPS] = steps
    summary[TREE_HITS] = tree_hits
    summary[BARRIER_HITS] = barrier_hits
    summary[HITS] = hit_count
    return kept


@kernel
def slide_logs(
    scene, frames, starts, bodies, stations, settings, scratch, rasters, stamps, marks, poses, keep, hits, own, told,
    states, summaries, first, last, stop,
):  # fmt: skip
    """Slide the logs from row ``first`` to before ``last``, one after the other, up to one whose poses are kept.

    Parameters are those of ``slide_log``, of all logs; own, told : room for one log's state and summary, which come to
    lie in their rows of states and summaries. The hits of one log follow those of another in ``hits``.

    Returns (row of the next log, number of poses wanted by the last one): the first row where that one found too little
    room for its poses or, as ``told`` has it, its hits.
    """
    used = 0
    for row in range(first, last):
        for k in range(own.shape[0]):
            own[k] = starts[row, k]
        each = Marks(marks.lines[row], marks.fences[row], marks.crossed[row], marks.line_time[row], marks.inside[row])
        wanted = slide_log(
            scene, frames[row], own, bodies[row], stations[row], settings, scratch, rasters, stamps[row], each,
            poses if keep[row] else poses[:0], keep[row], hits[used:], told, stop,
        )  # fmt: skip
        struck = int(told[HITS])
        if (keep[row] and wanted > poses.shape[0]) or struck > hits.shape[0] - used:
            forget_touches(each)
            return row, wanted
        count_danger(rasters.passed, rasters.order, rasters.danger)
        used += struck
        for k in range(own.shape[0]):
            states[row, k] = own[k]
        for k in range(SUMMARY_WIDTH):
            summaries[row, k] = told[k]
        if told[REASON] != LEFT_DEM and told[REASON] != FAILED and told[REASON] != INTERRUPTED:
            work = (scratch.points, scratch.hull, scratch.left, scratch.right)
            draw_deposit(scene, frames[row], own, bodies[row], scratch.memory, work, rasters)
        if keep[row]:
            return row + 1, wanted
    return last, 0
