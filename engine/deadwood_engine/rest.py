"""Whether a log is at rest, and what holds it: by a static equilibrium test (certificate), not by a threshold of speed.

A speed threshold would freeze logs that slide at the limit of friction, and standing logs that must topple.
"""

from __future__ import annotations

import math

from .compiled import kernel
from .contact_solver import find_old, solve, warm_start
from .contacts import TERRAIN, set_frames
from .cores import BARRIER, BLOCK, LYING, TREE
from .detection import contacts_at, owner_of
from .limits import REST_ACCELERATION, REST_LOOK, REST_SOLVED, REST_STEP, REST_SWEEPS
from .model import Span
from .pressure import join_lines
from .rolling import start_rolling
from .rotation import STATE_WIDTH, VX, VZ, WZ
from .travel import fastest_point

# New reasons are appended, so that stored codes keep their meaning
STOP_REASONS = ("rest", "tree", "barrier", "left_dem", "time_limit", "failed", "lying_log", "block")
REST, HELD_BY_TREE, HELD_BY_BARRIER, LEFT_DEM, TIME_LIMIT, FAILED, HELD_BY_LYING_LOG, HELD_BY_BLOCK, INTERRUPTED = (
    range(9)
)
ON_ITS_WAY = -1  # the run ended there because all that was requested of the log is known


@kernel
def stays(model, log, state, scratch, obstacles):
    """Whether the log, stopped in place and released, stays there: the certificate of rest.

    One step from zero velocity, solved far more tightly than a step of the run, from the impulses that hold it now
    (friction at several contacts is not unique, and this is the log's actual solution). Returns (stays, count of
    contacts): a log that moves only at the limit of friction, or at a minimal tilt, does not stay.
    """
    settings, body, way = model.settings, log.body, scratch.way[0]
    contacts, keys, rolling, trial = scratch.contacts, scratch.keys, scratch.rolling[0], scratch.trial_state
    for k in range(STATE_WIDTH):
        trial[k] = state[k]
    for k in range(VX, WZ + 1):
        trial[k] = 0.0
    # as in the run, otherwise contacts that hover within its tolerance would be missed; but what a longer step might
    # touch does not support the log yet
    dt = min(settings.time_step, REST_STEP)
    trial[VZ] = -0.5 * settings.gravity * dt  # as for a log at rest: gravity's half of the previous step
    advance = settings.gravity * dt * dt
    count, _, _ = contacts_at(model, log, trial, scratch, Span(dt, way.path, advance), obstacles)
    for k in range(count):
        # an obstacle that would touch within this step counts as touching; one farther away supports nothing
        if keys[k, 0] == TERRAIN or contacts[k].gap <= advance:
            contacts[k].target = 0.0
    allowed = REST_ACCELERATION * settings.gravity * dt
    solved = REST_SOLVED * allowed
    lines = model.cloud is None and count > 2 and join_lines(contacts, count, trial, dt)
    set_frames(contacts, count, trial, body)
    trial[VZ] -= 0.5 * settings.gravity * dt
    find_old(contacts, keys, count, scratch.old_keys, way.old_count)
    ratio = 1.0 / way.before
    warm_start(contacts, count, trial, scratch.old_contacts, ratio * dt)
    start_rolling(rolling, contacts, count, trial, ratio * dt)
    used, decided, moving = 0, False, 0.0
    while used < REST_SWEEPS and not decided:
        used, change = solve(contacts, count, trial, rolling, (solved, used + REST_LOOK), lines, used)
        moving = fastest_point(trial, body)
        # a velocity that is still so large compared with its change does not vanish within the remaining sweeps
        decided = change <= solved or moving > max(allowed, REST_SWEEPS * change)
    return count > 0 and moving <= allowed, count


@kernel
def holder(cores, contacts, keys, count):
    """(reason, row, grip): the obstacle with the largest impulse, or the terrain if none acts; rows as in ``owner_of``.

    grip [rad]: the angle by which the impulse of a single stem would have to turn to leave its friction cone, that is
    the angle of friction minus the angle between its total impulse and its normals; NaN if no stem holds the log, or
    not it alone. Whether a log is held within a few degrees depends on the coefficient of friction there.
    """
    most, reason, row, alone, normal, across, cone = 0.0, REST, -1, True, 0.0, 0.0, 0.0
    for k in range(count):
        c, kind = contacts[k], keys[k, 0]
        if kind == TERRAIN or c.pn <= 0.0:
            continue
        _, owner = owner_of(cores, keys[k])
        alone = alone and kind == TREE and (most == 0.0 or owner == row)
        normal += c.pn
        across += math.sqrt(c.pt * c.pt + c.pu * c.pu)
        cone += c.mu * c.pn
        if c.pn > most:
            most, row, reason = c.pn, owner, HELD_BY_TREE
            if kind == BARRIER:
                reason = HELD_BY_BARRIER
            elif kind == LYING:
                reason = HELD_BY_LYING_LOG
            elif kind == BLOCK:
                reason = HELD_BY_BLOCK
    if most == 0.0 or not alone:
        return reason, row, math.nan
    return reason, row, math.atan(cone / normal) - math.atan(across / normal)


@kernel
def rest_reason(model, log, state, scratch):
    """As ``holder``, for a log that stays, on terrain alone or with the obstacle that holds it; otherwise (-1, -1,
    NaN).
    """
    held, _ = stays(model, log, state, scratch, False)
    if held:
        return REST, -1, math.nan
    held, count = stays(model, log, state, scratch, True)
    return holder(model.cores, scratch.contacts, scratch.keys, count) if held else (-1, -1, math.nan)
