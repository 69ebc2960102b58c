"""When a log rests, and what holds it: by a certificate, not by a threshold of speed.

A speed threshold freezes logs that slide at friction's limit and standing logs that must topple.
"""

from __future__ import annotations

from .compiled import kernel
from .contact_solver import find_old, solve, warm_start
from .contacts import GAP, PN, TARGET, TERRAIN, set_frames
from .cores import BARRIER, BLOCK, LYING
from .detection import find_contacts, owner_of
from .limits import REST_ACCELERATION, REST_LOOK, REST_STEP, REST_SWEEPS
from .rolling import start_rolling
from .rotation import VX, VZ, WZ
from .travel import fastest_point

# What comes later goes to the end: stored codes keep their meaning
STOP_REASONS = ("rest", "tree", "barrier", "left_dem", "time_limit", "failed", "lying_log", "block")
REST, HELD_BY_TREE, HELD_BY_BARRIER, LEFT_DEM, TIME_LIMIT, FAILED, HELD_BY_LYING_LOG, HELD_BY_BLOCK, INTERRUPTED = (
    range(9)
)


@kernel
def stays(scene, frame, state, body, stations, settings, path, scratch, old_count, ratio, obstacles):
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
    # as in the run, or contacts that hover within its tolerance would be missed; but what a longer step might touch
    # holds nothing up yet
    dt = min(settings.time_step, REST_STEP)
    trial[VZ] = -0.5 * settings.gravity * dt  # as of a log at rest: gravity's half of the step before
    advance = settings.gravity * dt * dt
    count, _, _ = find_contacts(scene, frame, trial, body, stations, settings, dt, path, advance, scratch, obstacles)
    for k in range(count):
        # what would touch within this step counts as touching; an obstacle farther away holds nothing up
        if scratch.keys[k, 0] == TERRAIN or scratch.contacts[k, GAP] <= advance:
            scratch.contacts[k, TARGET] = 0.0
    set_frames(scratch.contacts, count, trial, body)
    trial[VZ] -= 0.5 * settings.gravity * dt
    find_old(scratch.contacts, scratch.keys, count, scratch.old_keys, old_count)
    warm_start(scratch.contacts, count, trial, scratch.old_contacts, ratio * dt)
    start_rolling(scratch.rolling, scratch.contacts, count, trial, ratio * dt)
    allowed = REST_ACCELERATION * settings.gravity * dt
    used, decided, moving = 0, False, 0.0
    while used < REST_SWEEPS and not decided:
        used, change = solve(scratch.contacts, count, trial, scratch.rolling, 0.01 * allowed, used + REST_LOOK, used)
        moving = fastest_point(trial, body)
        # what is still so much faster than it changes does not come to rest in the sweeps that are left
        decided = change <= 0.01 * allowed or moving > max(allowed, REST_SWEEPS * change)
    return count > 0 and moving <= allowed, count


@kernel
def holder(scene, scratch, count):
    """(reason, item): the obstacle that pushes most, or the terrain where none does; items as in ``owner_of``."""
    most, reason, item = 0.0, REST, -1
    for k in range(count):
        if scratch.keys[k, 0] != TERRAIN and scratch.contacts[k, PN] > most:
            most = scratch.contacts[k, PN]
            _, item = owner_of(scene, scratch.keys[k])
            kind, reason = scratch.keys[k, 0], HELD_BY_TREE
            if kind == BARRIER:
                reason = HELD_BY_BARRIER
            elif kind == LYING:
                reason = HELD_BY_LYING_LOG
            elif kind == BLOCK:
                reason = HELD_BY_BLOCK
    return reason, item


@kernel
def rest_reason(scene, frame, state, body, stations, settings, path, scratch, old_count, ratio):
    """(reason, item) of a log that stays, or (-1, -1): on terrain alone, or held by the obstacle that pushes most."""
    held, _ = stays(scene, frame, state, body, stations, settings, path, scratch, old_count, ratio, False)
    if held:
        return REST, -1
    held, count = stays(scene, frame, state, body, stations, settings, path, scratch, old_count, ratio, True)
    return holder(scene, scratch, count) if held else (-1, -1)
