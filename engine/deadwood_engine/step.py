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
from typing import NamedTuple

import numpy as np

from . import barriers, contacts, trees
from .compiled import kernel
from .contact_solver import remember, solve, warm_start
from .contacts import (
    ANX,
    ANY,
    ANZ,
    ATX,
    ATY,
    ATZ,
    AUX,
    AUY,
    AUZ,
    BEFORE_N,
    BEFORE_T,
    BEFORE_U,
    GAP,
    NX,
    NY,
    NZ,
    PN,
    PT,
    PU,
    TARGET,
    TERRAIN,
    TREE,
    TX,
    TY,
    TZ,
    UX,
    UY,
    UZ,
    terrain_contacts,
)  # fmt: skip
from .grid_index import insert_sorted
from .limits import (
    NEAR_MARGIN,
    POLL_STEPS,
    REST_ACCELERATION,
    REST_SWEEPS,
    REST_TRAVEL,
    REST_WINDOW,
    ROCKING_GROWTH,
    ROCKING_WINDOW,
    SHORTEST_STEP,
    WILD_SPEED,
)  # fmt: skip
from .log_body import AXIAL, BASE_RADIUS, CENTRE, LENGTH, TRANSVERSE
from .rotation import DX, DY, DZ, VX, VY, VZ, WX, WY, WZ, X, Y, Z, drift, kinetic_energy, set_axis
from .terrain import surface
from .trace import (
    MEMORY_WIDTH,
    PEAK_ENERGY,
    PEAK_JUMP,
    PEAK_SPEED,
    draw,
    ends_moved,
    keep_pose,
    remember_pose,
)  # fmt: skip

STOP_REASONS = ("rest", "tree", "barrier", "left_dem", "time_limit", "failed")
REST, HELD_BY_TREE, HELD_BY_BARRIER, LEFT_DEM, TIME_LIMIT, FAILED, INTERRUPTED = range(7)

# Columns of a log's summary
REASON, ITEM, DURATION, PATH, SPEED_MAX, ENERGY_MAX, JUMP_MAX, ENERGY_ERROR, PENETRATION, OVERLAP = range(10)
RESIDUAL, UNCONVERGED, STEPS, CONTACTS, SWEEPS, TREE_HITS, BARRIER_HITS, STARTED_IN_CONTACT = range(10, 18)
ENERGY_GAIN, AIRBORNE = range(18, 20)
SUMMARY_WIDTH = 20


class Settings(NamedTuple):
    """A run's numbers: those of the fidelity, in metres and seconds, and the user's."""

    time_step: float
    travel: float  # [m] of the fastest point in a step
    tolerance: float  # [-] of g dt
    sweeps: int
    trace_step: float  # [m] of the ends between outlines
    restitution: float
    time_limit: float
    rest_speed: float
    gravity: float


class Scratch(NamedTuple):
    """A worker's memory, made once: nothing is allocated while logs slide."""

    contacts: np.ndarray
    keys: np.ndarray
    old_keys: np.ndarray
    old_impulses: np.ndarray
    near_trees: np.ndarray
    tree_table: np.ndarray
    near_plates: np.ndarray
    plate_table: np.ndarray
    hit_trees: np.ndarray
    hit_barriers: np.ndarray
    trial: np.ndarray  # predicted axis direction and centre
    anchor: np.ndarray  # plan ends for which the near lists were made; their counts; whether they exist
    memory: np.ndarray
    rest: np.ndarray  # ends at the last look at a slow log
    rocking: np.ndarray  # ends at the last look at one that rocks
    trial_state: np.ndarray
    free: np.ndarray  # velocities before the solve
    points: np.ndarray
    hull: np.ndarray
    left: np.ndarray
    right: np.ndarray

    @staticmethod
    def allocate(stations: int, upright_count: int, plate_count: int, raster_rows: int) -> Scratch:
        # every candidate of the log, and three contacts each of the obstacles that it can lean on at once
        table = 3 * stations + 16 + min(3 * (upright_count + plate_count), 8192)
        return Scratch(
            np.zeros((table, contacts.CONTACT_WIDTH)),
            np.zeros((table, contacts.KEY_WIDTH), np.int64),
            np.zeros((table, contacts.KEY_WIDTH), np.int64),
            np.zeros((table, 3)),
            np.zeros(upright_count + 1, np.int64),
            np.zeros((upright_count + 1, 6)),
            np.zeros(plate_count + 1, np.int64),
            np.zeros((plate_count + 1, 7)),
            np.zeros(upright_count + 1, np.int64),
            np.zeros(plate_count + upright_count + 1, np.int64),
            np.zeros(6),
            np.zeros(7),
            np.zeros(MEMORY_WIDTH),
            np.zeros(MEMORY_WIDTH),
            np.zeros(MEMORY_WIDTH),
            np.zeros(16),
            np.zeros(6),
            np.zeros((32, 2)),
            np.zeros((35, 4)),
            np.zeros(max(raster_rows, 1), np.int64),
            np.zeros(max(raster_rows, 1), np.int64),
        )


@kernel
def find_contacts(scene, frame, state, body, stations, settings, dt, scratch, obstacles):
    """Contacts of the pose predicted for a step dt: terrain, then trees, then barriers (if obstacles is true).

    Returns (count, least clearance of the terrain [m], travel allowed in the next step by the obstacles [m],
    whether there is terrain below the whole log).
    """
    terrain = scene.terrain
    count, clearance, whole = terrain_contacts(
        terrain, frame, scratch.contacts, scratch.keys, state, body, stations, dt,
        settings.restitution, settings.gravity, scratch.trial,
    )  # fmt: skip
    travel = math.inf
    if obstacles and (scene.uprights.owner.shape[0] > 0 or scene.plates.owner.shape[0] > 0):
        trial, anchor = scratch.trial, scratch.anchor
        back, front = -body[CENTRE], body[LENGTH] - body[CENTRE]
        bx, by = trial[3] + back * trial[0], trial[4] + back * trial[1]
        tx, ty = trial[3] + front * trial[0], trial[4] + front * trial[1]
        moved = max(abs(bx - anchor[0]), abs(by - anchor[1]), abs(tx - anchor[2]), abs(ty - anchor[3]))
        if anchor[6] == 0.0 or moved > 0.5 * NEAR_MARGIN:
            anchor[0], anchor[1], anchor[2], anchor[3], anchor[6] = bx, by, tx, ty, 1.0
            reach = body[BASE_RADIUS] + NEAR_MARGIN
            anchor[4] = trees.near(
                scene.uprights, frame, terrain.cell, scratch.near_trees, scratch.tree_table, bx, by, tx, ty, reach
            )
            anchor[5] = barriers.near(
                scene.plates, frame, terrain.cell, scratch.near_plates, scratch.plate_table, bx, by, tx, ty, reach
            )
            moved = 0.0
        # what is not listed is farther away than the margin that is left
        travel = NEAR_MARGIN * 0.25
        step = (dt, settings.restitution, settings.gravity)
        count, allowed = trees.contacts_with(
            terrain, frame, scratch.tree_table, scratch.near_trees, int(anchor[4]), scratch.contacts, scratch.keys,
            count, state, body, trial, step,
        )  # fmt: skip
        travel = min(travel, allowed)
        count, allowed = barriers.contacts_with(
            terrain, frame, scratch.plate_table, scratch.near_plates, int(anchor[5]), scratch.contacts, scratch.keys,
            count, state, body, trial, step,
        )  # fmt: skip
        travel = min(travel, allowed)
    return count, clearance, travel, whole


@kernel
def owner_of(scene, key):
    """(is a barrier, row in the user's table) of an obstacle's contact."""
    if key[0] == TREE:
        owner = scene.uprights.owner[key[1]]
        return (True, -1 - owner) if owner < 0 else (False, owner)
    return True, scene.plates.owner[key[1]]


@kernel
def impulse_work(contacts_table, count, state, fall):
    """Work of the contact impulses per mass [J/kg]: the mean of the velocities before and after, times the impulses.

    fall [m/s] is what gravity has already added to the state's velocity for the time after the node.
    """
    work = 0.0
    vx, vy, vz, wx, wy, wz = state[VX], state[VY], state[VZ] + fall, state[WX], state[WY], state[WZ]
    for k in range(count):
        c = contacts_table[k]
        pn, pt, pu = c[PN], c[PT], c[PU]
        if pn > 0.0:
            gn = c[NX] * vx + c[NY] * vy + c[NZ] * vz + c[ANX] * wx + c[ANY] * wy + c[ANZ] * wz
            gt = c[TX] * vx + c[TY] * vy + c[TZ] * vz + c[ATX] * wx + c[ATY] * wy + c[ATZ] * wz
            gu = c[UX] * vx + c[UY] * vy + c[UZ] * vz + c[AUX] * wx + c[AUY] * wy + c[AUZ] * wz
            work += 0.5 * (pn * (gn + c[BEFORE_N]) + pt * (gt + c[BEFORE_T]) + pu * (gu + c[BEFORE_U]))
    return work


@kernel
def take_no_energy(contacts_table, count, state, free, gained, fall):
    """Scale the impulses of an unfinished solve so that they do no positive work; returns the work left.

    A jam between opposed normals (unbounded inner force) can hit the cap with impulses that do not fit each other and
    push. Scaled by f, they do the work f a + f^2 b, with a + b = gained and a that of their infinitesimal part.
    """
    a = 0.0
    for k in range(count):
        c = contacts_table[k]
        pn, pt, pu = c[PN], c[PT], c[PU]
        if pn > 0.0:
            gn = c[NX] * free[0] + c[NY] * free[1] + c[NZ] * (free[2] + fall)
            gn += c[ANX] * free[3] + c[ANY] * free[4] + c[ANZ] * free[5]
            gt = c[TX] * free[0] + c[TY] * free[1] + c[TZ] * (free[2] + fall)
            gt += c[ATX] * free[3] + c[ATY] * free[4] + c[ATZ] * free[5]
            gu = c[UX] * free[0] + c[UY] * free[1] + c[UZ] * (free[2] + fall)
            gu += c[AUX] * free[3] + c[AUY] * free[4] + c[AUZ] * free[5]
            a += 0.5 * (pn * (gn + c[BEFORE_N]) + pt * (gt + c[BEFORE_T]) + pu * (gu + c[BEFORE_U]))
    b = gained - a
    share = max(0.0, -a / b) if b > 0.0 else 0.0
    for k in range(count):
        for column in (PN, PT, PU):
            contacts_table[k, column] *= share
    for k in range(6):
        state[VX + k] = free[k] + share * (state[VX + k] - free[k])
    return share * (a + share * b)


@kernel
def fastest_point(state, body):
    """Bound of the speed of the log's fastest point [m/s]."""
    along = state[WX] * state[DX] + state[WY] * state[DY] + state[WZ] * state[DZ]
    spin = state[WX] ** 2 + state[WY] ** 2 + state[WZ] ** 2
    across = math.sqrt(max(0.0, spin - along * along))
    arm = max(body[CENTRE], body[LENGTH] - body[CENTRE])
    speed = math.sqrt(state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2)
    return speed + across * arm + abs(along) * body[BASE_RADIUS]


@kernel
def stays(scene, frame, state, body, stations, settings, scratch, old_count, ratio, obstacles):
    """Whether the log, stopped where it is and let go, stays: the certificate of rest.

    One step from zero velocity, solved far more tightly than a step of the run, from the impulses that hold it now
    (friction among several contacts has many solutions, and this is the one the log is in). Returns (stays, count of
    contacts): a log that only friction's threshold or a hair's tilt keeps moving does not stay.
    """
    trial = scratch.trial_state
    for k in range(16):
        trial[k] = state[k]
    for k in range(VX, WZ + 1):
        trial[k] = 0.0
    dt = settings.time_step  # as in the run, or contacts that hover within its tolerance would be missed
    trial[VZ] = -0.5 * settings.gravity * dt  # as of a log at rest: gravity's half of the step before
    count, _, _, _ = find_contacts(scene, frame, trial, body, stations, settings, dt, scratch, obstacles)
    for k in range(count):
        scratch.contacts[k, TARGET] = 0.0  # what would touch within this step counts as touching
    trial[VZ] -= 0.5 * settings.gravity * dt
    warm_start(
        scratch.contacts, scratch.keys, count, trial, scratch.old_keys, scratch.old_impulses, old_count, ratio * dt
    )
    allowed = REST_ACCELERATION * settings.gravity * dt
    solve(scratch.contacts, count, trial, 0.01 * allowed, REST_SWEEPS)
    return count > 0 and fastest_point(trial, body) <= allowed, count


@kernel
def holder(scene, scratch, count):
    """(reason, item): the obstacle that pushes most, or the terrain where none does."""
    most, reason, item = 0.0, REST, -1
    for k in range(count):
        if scratch.keys[k, 0] != TERRAIN and scratch.contacts[k, PN] > most:
            most = scratch.contacts[k, PN]
            is_barrier, item = owner_of(scene, scratch.keys[k])
            reason = HELD_BY_BARRIER if is_barrier else HELD_BY_TREE
    return reason, item


@kernel
def rest_reason(scene, frame, state, body, stations, settings, scratch, old_count, ratio):
    """(reason, item) of a log that stays, or (-1, -1): on terrain alone, or held by the obstacle that pushes most."""
    held, _ = stays(scene, frame, state, body, stations, settings, scratch, old_count, ratio, False)
    if held:
        return REST, -1
    held, count = stays(scene, frame, state, body, stations, settings, scratch, old_count, ratio, True)
    return holder(scene, scratch, count) if held else (-1, -1)


@kernel
def slide_log(scene, frame, state, body, stations, settings, scratch, rasters, row, marks, poses, keep, summary, stop):
    """Slide one log from its initial state to its end.

    Parameters
    ----------
    scene : SceneArrays; frame : int64 (2,), DEM node of the log's frame; body : row of the body table
    state : (16,), initial state, replaced by the final one; stations : number of rings
    rasters, marks, poses, summary : outputs; row : the log's number, for the rasters' stamp; keep : keep poses
    stop : uint8 (1,), not zero when the user interrupts

    Returns
    -------
    number of poses wanted (more than ``poses`` holds: run again with more room)
    """
    set_axis(state)
    transverse, axial, gravity = body[TRANSVERSE], body[AXIAL], settings.gravity
    work = (scratch.points, scratch.hull, scratch.left, scratch.right)
    memory = scratch.memory
    scratch.anchor[6] = 0.0
    summary[:] = 0.0
    summary[ITEM] = -1
    energy_start = kinetic_energy(state, transverse, axial) + gravity * state[Z]
    time, before, last_kick, done_work, next_look = 0.0, 0.0, 0.0, 0.0, REST_WINDOW
    kept, steps, old_count, tree_hits, barrier_hits = 0, 0, 0, 0, 0
    next_rocking, rocking_peak, peak = ROCKING_WINDOW, 0.0, 0.0
    count, clearance, travel, whole = find_contacts(scene, frame, state, body, stations, settings, 1e-9, scratch, True)
    for k in range(count):
        if scratch.keys[k, 0] != TERRAIN:
            summary[STARTED_IN_CONTACT] = 1.0
    clearance = max(0.0, clearance)
    remember_pose(memory, state, body)
    memory[PEAK_SPEED] = math.sqrt(state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2)
    memory[PEAK_ENERGY] = kinetic_energy(state, transverse, axial)
    memory[PEAK_JUMP] = clearance
    summary[SPEED_MAX], summary[ENERGY_MAX], summary[JUMP_MAX] = memory[PEAK_SPEED], memory[PEAK_ENERGY], clearance
    draw(scene, frame, state, body, memory, work, rasters, row, marks, 0.0)
    remember_pose(scratch.rest, state, body)
    remember_pose(scratch.rocking, state, body)
    if keep:
        kept = keep_pose(poses, kept, 0.0, state, body, clearance)
    reason = -1
    while reason < 0:
        # 1. gravity's second half for the step before, and the length of this one
        state[VZ] -= 0.5 * gravity * before
        fastest = fastest_point(state, body) + 0.5 * gravity * settings.time_step
        dt = min(settings.time_step, min(settings.travel, travel) / fastest) if fastest > 0.0 else settings.time_step
        dt = max(dt, SHORTEST_STEP)
        kick = 0.5 * (before + dt)
        steps += 1
        # 2. contacts of the pose a step ahead, 3. velocities
        count, clearance, travel, on_terrain = find_contacts(
            scene, frame, state, body, stations, settings, dt, scratch, True
        )
        whole = whole and on_terrain
        state[VZ] -= 0.5 * gravity * dt
        if count > 0:
            for k in range(6):
                scratch.free[k] = state[VX + k]
            if settings.restitution == 0.0:
                warm_start(
                    scratch.contacts, scratch.keys, count, state, scratch.old_keys, scratch.old_impulses, old_count,
                    kick / last_kick if last_kick > 0.0 else 0.0,
                )  # fmt: skip
            tolerance = settings.tolerance * gravity * dt + 1e-15
            used, residual = solve(scratch.contacts, count, state, tolerance, settings.sweeps)
            summary[SWEEPS] += used
            summary[CONTACTS] += count
            summary[RESIDUAL] = max(summary[RESIDUAL], residual)
            # the work is that of the velocities at the node, between gravity's two halves
            gained = impulse_work(scratch.contacts, count, state, 0.5 * gravity * dt)
            unfinished = residual > tolerance
            if unfinished:
                summary[UNCONVERGED] += 1
            # Newton's law, contact by contact, can give energy where several act: not beyond gravity's own share
            bouncing = settings.restitution > 0.0 and gained > 0.125 * (gravity * dt) ** 2
            if gained > 0.0 and (unfinished or bouncing):
                gained = take_no_energy(scratch.contacts, count, state, scratch.free, gained, 0.5 * gravity * dt)
            # 5. books
            done_work += gained
            summary[ENERGY_GAIN] += max(0.0, gained)
            for k in range(count):
                ground = scratch.keys[k, 0] == TERRAIN
                # not the overlap that a log was released with, nor what sank where the DEM ends
                if whole if ground else summary[STARTED_IN_CONTACT] == 0.0:
                    at = PENETRATION if ground else OVERLAP
                    summary[at] = max(summary[at], -scratch.contacts[k, GAP])
                if not ground and scratch.contacts[k, PN] > 0.0:
                    is_barrier, item = owner_of(scene, scratch.keys[k])
                    if is_barrier:
                        marks.fences[item] = True
                        barrier_hits = insert_sorted(scratch.hit_barriers, barrier_hits, item)
                    else:
                        tree_hits = insert_sorted(scratch.hit_trees, tree_hits, item)
        else:
            summary[AIRBORNE] += 1
        old_count = remember(scratch.contacts, scratch.keys, count, scratch.old_keys, scratch.old_impulses)
        before, last_kick = dt, kick
        speed = math.sqrt(state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2)
        energy = kinetic_energy(state, transverse, axial)
        clearance = max(0.0, clearance) if clearance < math.inf else 0.0
        memory[PEAK_SPEED] = max(memory[PEAK_SPEED], speed)
        memory[PEAK_ENERGY] = max(memory[PEAK_ENERGY], energy)
        memory[PEAK_JUMP] = max(memory[PEAK_JUMP], clearance)
        summary[SPEED_MAX] = max(summary[SPEED_MAX], speed)
        summary[ENERGY_MAX] = max(summary[ENERGY_MAX], energy)
        summary[JUMP_MAX] = max(summary[JUMP_MAX], clearance)
        if not speed < WILD_SPEED:
            reason = FAILED
            break
        peak = max(peak, energy)
        # 4. free motion to the next node
        drift(state, transverse, axial, dt)
        time += dt
        summary[PATH] += dt * speed
        height, _, _ = surface(scene.terrain, frame[0], frame[1], state[X], state[Y])
        if height != height:
            reason = LEFT_DEM
        elif time >= settings.time_limit:
            reason = TIME_LIMIT
        elif time >= next_look:
            next_look = time + REST_WINDOW
            if ends_moved(scratch.rest, state, body) < REST_TRAVEL * settings.rest_speed * REST_WINDOW:
                reason, item = rest_reason(
                    scene, frame, state, body, stations, settings, scratch, old_count, 1.0 / before
                )
                summary[ITEM] = item
            remember_pose(scratch.rest, state, body)
        elif time >= next_rocking:
            next_rocking = time + ROCKING_WINDOW
            # A cradled log rolls to and fro for ever. It rests if it has stayed slow, has not gained, and has not left.
            slow = peak <= settings.rest_speed**2 and rocking_peak <= settings.rest_speed**2
            stays_near = ends_moved(scratch.rocking, state, body) < settings.trace_step
            if slow and stays_near and peak <= ROCKING_GROWTH * rocking_peak and time > 1.5 * ROCKING_WINDOW:
                reason, item = holder(scene, scratch, count)
                summary[ITEM] = item
            remember_pose(scratch.rocking, state, body)
            rocking_peak, peak = peak, 0.0
        elif steps % POLL_STEPS == 0 and stop[0] != 0:
            reason = INTERRUPTED
        if reason < 0 and ends_moved(memory, state, body) >= settings.trace_step:
            draw(scene, frame, state, body, memory, work, rasters, row, marks, time)
            if keep:
                kept = keep_pose(poses, kept, time, state, body, clearance)
    if reason != FAILED:
        draw(scene, frame, state, body, memory, work, rasters, row, marks, time)
        if keep:
            kept = keep_pose(poses, kept, time, state, body, clearance)
    sunk = state[VZ]
    state[VZ] -= 0.5 * gravity * before
    change = kinetic_energy(state, transverse, axial) + gravity * state[Z] - energy_start - done_work
    state[VZ] = sunk
    # of the energy that the run had to spend, at least that of a metre's fall
    summary[ENERGY_ERROR] = (abs(change) + summary[ENERGY_GAIN]) / max(energy_start - gravity * state[Z], 9.81)
    summary[REASON] = reason
    summary[DURATION] = time
    summary[STEPS] = steps
    summary[TREE_HITS] = tree_hits
    summary[BARRIER_HITS] = barrier_hits
    return kept
