"""All contacts of a pose: terrain, then obstacles, from a list of what is near."""

from __future__ import annotations

import math

from . import cores
from .cloud_contacts import cloud_clearance, cloud_terrain_contacts
from .cloud_obstacles import cloud_obstacle_contacts
from .compiled import inlined, kernel
from .contacts import Ahead, predict
from .cores import BARRIER
from .influence import enter, note, note_contacts
from .limits import NEAR_MARGIN
from .log_body import BASE_RADIUS, CENTRE, LENGTH
from .obstacles import contacts_with
from .ring_look import lowest_ring
from .rings import terrain_contacts


@inlined
def _ground(cloud, model, log, state, scratch, step):
    """Terrain contacts of a log, or of a cloud: (count, whether there is terrain below all of it).

    Numba drops the branch that the type of ``cloud`` excludes, so nobody waits for the compilation of kernels for
    shapes that are not used.
    """
    if cloud is None:
        predict(state, step.dt, step.gravity, scratch.trial[0])
        return terrain_contacts(model, log, state, scratch, step)
    return cloud_terrain_contacts(model, log, state, scratch, step)


@inlined
def _near_obstacles(cloud, model, log, state, scratch, count, span):
    """Contacts with all obstacles listed as near: as ``obstacles.contacts_with``."""
    if cloud is None:
        return contacts_with(model, log, state, scratch, count, span)
    count, travel = cloud_obstacle_contacts(model, log, state, scratch, count, span.dt)
    return count, travel, -math.inf, -1, -1  # a cloud queries all near obstacles in every step


@inlined
def lowest_gap(model, log, state, scratch):
    """Clearance [m] of a log, or of a cloud."""
    return _lowest_gap(model.cloud, model, log, state, scratch)


@inlined
def _lowest_gap(cloud, model, log, state, scratch):
    """As ``lowest_gap``, by the type of ``cloud``."""
    if cloud is None:
        return lowest_ring(model.terrain, log, state, scratch.look)
    return cloud_clearance(cloud, model.terrain, log.frame, state, scratch.turns)


@inlined
def find_contacts(model, log, state, scratch, span, obstacles):
    """Contacts of the pose predicted for a step: terrain, then (if obstacles is true) obstacles.

    span : a ``Span``: its time, and how far the log can move. Obstacles farther away than that are not queried

    Returns (count, travel allowed in the next step by the obstacles [m], whether there is terrain below the whole log).
    """
    settings, body, trial, near = model.settings, log.body, scratch.trial[0], scratch.near[0]
    step = Ahead(span.dt, settings.gravity, span.dt, settings.restitution, -1.0, settings.rolling_friction)
    count, whole = _ground(model.cloud, model, log, state, scratch, step)
    travel, ahead = math.inf, span.path + span.advance
    if obstacles and model.cores.solid.shape[0] > 0:
        near.beside = 0
        if ahead + settings.travel < near.obstacles_wake:
            near.clear, near.thin = near.obstacles_wake - ahead, -1
            return count, near.clear, whole
        back, front = -body[CENTRE], body[LENGTH] - body[CENTRE]
        bx, by = trial.x + back * trial.dx, trial.y + back * trial.dy
        tx, ty = trial.x + front * trial.dx, trial.y + front * trial.dy
        moved = max(
            (bx - near.base_x) ** 2 + (by - near.base_y) ** 2,
            (tx - near.tip_x) ** 2 + (ty - near.tip_y) ** 2,
        )
        moved = math.sqrt(moved)
        if not near.listed or moved > 0.5 * NEAR_MARGIN:
            near.base_x, near.base_y, near.tip_x, near.tip_y, near.listed = bx, by, tx, ty, True
            reach = body[BASE_RADIUS] + NEAR_MARGIN
            axis = (bx, by), (tx, ty)
            near.cores = cores.near(
                model.cores, log.frame, model.terrain.cell, scratch.listed, scratch.near_cores, axis, reach
            )
            if near.gone > 0:
                near.cores = cores.still_there(scratch.listed, scratch.near_cores, near.cores, scratch.gone, near.gone)
            moved = 0.0
        near.beside = near.cores
        # obstacles that are not listed are farther away than the remaining margin
        free = travel = NEAR_MARGIN - moved
        ground = count
        count, allowed, clear, thin, nearest = _near_obstacles(model.cloud, model, log, state, scratch, count, span)
        notes = scratch.notes
        if notes.place.shape[0] > 0:
            near.clear, near.thin = travel, scratch.listed[thin] if allowed < travel else -1
            note_contacts(notes, scratch.keys, ground, count)
            if model.cloud is not None:
                for m in range(near.cores):
                    note(notes, scratch.listed[m])
            elif clear < free:
                enter(notes, scratch.listed[nearest])
        travel, free = min(travel, allowed), min(free, clear)
        # the distances are those of the predicted pose, and the present pose is within ``advance`` of it
        near.obstacles_wake = span.path - span.advance + free
    return count, travel, whole


@kernel
def contacts_at(model, log, state, scratch, span, obstacles):
    """``find_contacts`` for the rare calls outside the time step: compiled once, not inlined into each caller."""
    return find_contacts(model, log, state, scratch, span, obstacles)


@kernel
def owner_of(cores, key):
    """(is a barrier, row in the user's table) of an obstacle's contact; other obstacles are numbered after the trees:
    lying logs, then boulders.
    """
    return key[0] == BARRIER, cores.solid[key[1]].owner
