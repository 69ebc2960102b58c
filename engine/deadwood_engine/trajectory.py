"""The trajectories of logs, from the release to the end: until each rests, leaves, or reaches the time limit.

``slide_logs`` takes one log after the other, ``slide_log`` repeats the time step (``step``) and writes its traces. The
arguments of the kernels, by what changes and when: ``model``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .asymmetric_top import energy_of
from .barriers import pierced
from .compiled import inlined, kernel
from .contacts import TERRAIN
from .cores import BARRIER
from .detection import contacts_at, lowest_gap
from .influence import copy_notes, note, open_notes
from .limits import AT_ONCE, LEAST_SPENT, REST_WINDOW, ROCKING_WINDOW
from .log_body import AXIAL, BASE_RADIUS
from .model import Log, Span
from .outline import count_danger
from .rest import FAILED, INTERRUPTED, LEFT_DEM, ON_ITS_WAY
from .rocking import forget_windows
from .rotation import VX, VY, VZ, X, Y, Z, set_axis
from .stages import all_reached, go_on, keep_stage
from .step import choose_step, keep_books, move_on, push
from .surroundings import know_nothing
from .terrain import surface
from .trace import (
    PEAK_JUMP,
    Marks,
    Output,
    RasterArrays,
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


class Batch(NamedTuple):
    """Logs to slide, a row each, as in ``model.Log``, and what else each begins with."""

    frames: np.ndarray
    states: np.ndarray  # (n, 16), initial
    bodies: np.ndarray
    stations: np.ndarray
    stamps: np.ndarray  # int64 (n,), numbers that no other logs have, for the rasters
    keep: np.ndarray  # bool (n,), whether poses are stored
    going_on: np.ndarray  # int64 (n,), rows of the stages from which logs are continued, -1: from their start


class Results(NamedTuple):
    """Where the logs of a batch leave their results, a row each; and room for what is as long as it happens to be: the
    hits of one log follow those of another, and so do its poses and the notes of the obstacles that mattered to it.
    """

    rasters: RasterArrays
    marks: Marks  # of all logs
    poses: np.ndarray
    hits: np.ndarray
    notes: np.ndarray
    states: np.ndarray  # final
    summaries: np.ndarray  # have the numbers of each log's poses, hits and notes


@kernel
def is_finite(state):
    """Whether every number of a state is finite: the terrain lookup and the outlines rely on it."""
    amiss = 0.0
    for k in range(state.shape[0]):
        amiss += state[k] - state[k]  # 0, or NaN
    return amiss == 0.0


@inlined
def begin(model, log, state, scratch, summary):
    """The contacts of the release, and all balances initialised."""
    body, way, rolling, contacts, keys = log.body, scratch.way[0], scratch.rolling[0], scratch.contacts, scratch.keys
    rolling.moment = rolling.moment_before = rolling.spin_before = 0.0
    rolling.inertia, rolling.skin = body[AXIAL], body[BASE_RADIUS]
    know_nothing(scratch.near[0])
    way.time = way.before = way.last_kick = way.path = way.work = way.slip = 0.0
    way.scar = way.scar_ahead = way.dragged = way.kinks = 0.0
    way.enters = math.inf
    way.next_look, way.next_rocking = REST_WINDOW, ROCKING_WINDOW
    way.old_count, way.kept, way.pressed, way.undermined, way.sunk, way.lost = 0, 0, False, False, math.inf, False
    count, way.travel, way.whole = contacts_at(model, log, state, scratch, Span(AT_ONCE, 0.0, 0.0), True)
    way.buried = way.touches = False
    for k in range(count):
        way.touches = way.touches or keys[k, 0] == TERRAIN
        if keys[k, 0] != TERRAIN and contacts[k].gap < 0.0:
            summary.started_in_contact = True
        way.buried = way.buried or (keys[k, 0] == TERRAIN and contacts[k].gap < -body[BASE_RADIUS])
    for k in range(scratch.near[0].cores):
        if scratch.near_cores[k].kind == BARRIER and pierced(body, state, scratch.near_cores[k]):
            summary.started_in_contact = True
            if scratch.notes.place.shape[0] > 0:
                note(scratch.notes, scratch.listed[k])
    way.gap = lowest_gap(model, log, state, scratch)
    way.speed = math.sqrt(state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2)
    way.energy = energy_of(state, body)
    height, _, _ = surface(model.terrain, log.frame[0], log.frame[1], state[X], state[Y])
    way.height = state[Z] - height if height == height else 0.0
    summary.speed_max, summary.energy_max, summary.jump_max = way.speed, way.energy, way.gap
    summary.height_max = way.height
    remember_pose(scratch.memory, state, body)
    remember_turn(scratch.memory, state)
    remember_peaks(scratch.memory, way.speed, way.energy, way.gap, way.height)
    remember_pose(scratch.rest, state, body)
    forget_windows(scratch.rocking)


@inlined
def trace(model, log, state, scratch, out, reason, first):
    """Draw the outline if it is due, and store the pose; and the clearance of every pose.

    reason : why the log stops here, -1 if it does not; first : whether this is its release
    """
    settings, way, memory, summary = model.settings, scratch.way[0], scratch.memory, out.summary
    over, cell, moved = reason >= 0, model.terrain.cell, ends_moved(memory, state, log.body)
    grain = max(cell, 2.0 * settings.travel)
    most = settings.trace_step if model.cloud is None else min(settings.trace_step, cell)  # a cloud's outline turns
    drawn = first or over or outline_is_due(memory, state, log.body, moved, most, grain)
    if reason != FAILED and not first:
        way.gap = 0.0 if way.pressed else lowest_gap(model, log, state, scratch)
        if not over:
            memory[PEAK_JUMP] = max(memory[PEAK_JUMP], way.gap)
            summary.jump_max = max(summary.jump_max, way.gap)
    if reason != FAILED and drawn:
        draw(model, log, state, scratch, out, way.time)
        remember_peaks(memory, way.speed, way.energy, way.gap, way.height)
        if out.keep:
            way.kept = keep_pose(out.poses, way.kept, way.time, state, log.body, way.gap, way.height)


@kernel
def slide_log(model, log, state, scratch, out, stage, stop):
    """Slide one log from its initial state to its end.

    Parameters
    ----------
    model, log, scratch, out : as ``model`` describes them
    state : (16,), initial state, replaced by the final one
    stage : table of stages, stored for this log or those from which logs are continued; and row of the one from which
        it is, whose summary is given, or -1
    stop : uint8 (1,), non-zero when the user interrupts

    Returns
    -------
    number of poses needed (if more than fit in ``out.poses`` or, in the summary, ``out.hits``: run again with more
    room)
    """
    settings, way, summary = model.settings, scratch.way[0], out.summary
    set_axis(state)
    if not is_finite(state):
        summary.reason = FAILED
        return 0
    energy_start = energy_of(state, log.body) + settings.gravity * state[Z]
    stages, row = stage
    if row >= 0:
        go_on(stage, model, log, state, scratch, out.marks)
    else:
        begin(model, log, state, scratch, summary)
    reason, first = -1, row < 0
    while True:
        trace(model, log, state, scratch, out, reason, first)
        if reason >= 0:
            break
        first = False
        if settings.until_reached and all_reached(out.marks):
            reason = ON_ITS_WAY
            break
        if settings.stage_steps > 0 and summary.steps % settings.stage_steps == 0:
            keep_stage(stages, scratch, state, summary, out.marks, settings.travel)
        summary.steps += 1
        choose_step(model, log, state, scratch)
        push(model, log, state, scratch, summary)
        keep_books(model, log, state, scratch, out)
        reason = move_on(model, log, state, scratch, summary, stop)
    if reason == FAILED:
        forget_after(out.marks, way.sunk)
    summary.energy_error = energy_error(way, state, log.body, settings.gravity, energy_start, summary.energy_gain)
    summary.reason, summary.duration = reason, way.time
    return way.kept


@kernel
def energy_error(way, state, body, gravity, start, generated):
    """What the energy balance [f] lacks, and what contacts generated, relative to the energy that was available:
    (|E - E0 - W| + generated) / (E0 - g z) [-].

    start : [J/kg] kinetic and potential energy E0 at the release
    """
    fall = 0.5 * gravity * way.before  # the velocities are those of the middle of the previous step
    before = state[VZ]
    state[VZ] -= fall
    change = energy_of(state, body) + gravity * state[Z] - start - way.work
    state[VZ] = before
    spent = max(start - gravity * state[Z], LEAST_SPENT)
    return (abs(change) + generated) / spent


@kernel
def slide_logs(model, batch, scratch, results, stages, rows, stop):
    """Slide the logs of these rows of a batch (first, last + 1), one after the other; stages, stop : as in
    ``slide_log``.

    Logs whose stages are stored are processed one at a time, and none is started if less than half of the room for
    poses is left: a log that finds too little has to slide again.

    Returns (row of the next log, number of poses needed by it if there was too little room for them or, according to
    ``scratch.summary``, for its hits or notes).
    """
    state, summary, marks = scratch.state, scratch.summary, results.marks
    poses, hits, notes = results.poses, results.hits, results.notes
    first, last = rows
    used, filled, posed = 0, 0, 0
    for row in range(first, last):
        stage, keep = batch.going_on[row], batch.keep[row]
        for k in range(state.shape[0]):
            state[k] = batch.states[row, k]
        summary[0] = summary[1]
        if stage >= 0:
            summary[0] = stages.summary[stage]
            summary[0].hits, summary[0].tree_hits, summary[0].barrier_hits = 0, 0, 0
        open_notes(scratch.notes)
        log = Log(batch.frames[row], batch.bodies[row], batch.stations[row])
        mine = Marks(marks.lines[row], marks.fences[row], marks.crossed[row], marks.line_time[row], marks.inside[row])
        room = poses[posed:] if keep else poses[:0]
        out = Output(results.rasters, batch.stamps[row], mine, room, keep, hits[used:], summary[0])
        wanted = slide_log(model, log, state, scratch, out, (stages, stage), stop)
        struck, mattered = summary[0].hits, copy_notes(scratch.notes, notes, filled)
        summary[0].influences, summary[0].poses = mattered, wanted if keep else 0
        full = keep and wanted > poses.shape[0] - posed
        if full or struck > hits.shape[0] - used or filled + mattered > len(notes):
            forget_touches(mine)
            return row, wanted
        count_danger(results.rasters.passed, results.rasters.order, results.rasters.danger)
        used, filled, posed = used + struck, filled + mattered, posed + summary[0].poses
        for k in range(state.shape[0]):
            results.states[row, k] = state[k]
        results.summaries[row] = summary[0]
        reason = summary[0].reason
        if reason != LEFT_DEM and reason != FAILED and reason != INTERRUPTED and reason != ON_ITS_WAY:
            draw_deposit(model, log, state, scratch, results.rasters)
        if model.settings.stage_steps > 0 or 2 * posed > poses.shape[0]:
            return row + 1, wanted
    return last, 0
