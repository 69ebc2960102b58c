"""All contacts of a pose: terrain, then trees, barriers and lying logs, from lists of what is near."""

from __future__ import annotations

import math

from . import barriers, lying_logs, trees
from .cloud_contacts import cloud_terrain_contacts
from .cloud_obstacles import cloud_obstacle_contacts
from .compiled import kernel
from .contacts import LYING, TREE, terrain_contacts
from .limits import NEAR_MARGIN
from .log_body import BASE_RADIUS, CENTRE, LENGTH


@kernel
def _ground(cloud, scene, frame, state, body, stations, settings, dt, scratch):
    """Terrain contacts of a log, or of a cloud. Numba drops the branch that the type of ``cloud`` rules out, so nobody
    waits for kernels of shapes that do not slide to be compiled."""
    if cloud is None:
        return terrain_contacts(
            scene.terrain, frame, scratch.contacts, scratch.keys, state, body, stations, dt,
            settings.restitution, settings.gravity, scratch.trial,
        )  # fmt: skip
    return cloud_terrain_contacts(cloud, scene, frame, state, body, settings, dt, scratch)


@kernel
def _near_obstacles(cloud, scene, frame, scratch, count, state, body, step):
    """Contacts with all that is listed as near: (count, travel), as ``trees.contacts_with``."""
    if cloud is None:
        terrain, contacts, keys, trial, anchor = (
            scene.terrain, scratch.contacts, scratch.keys, scratch.trial, scratch.anchor,
        )  # fmt: skip
        count, travel = trees.contacts_with(
            terrain, frame, scratch.tree_table, scratch.near_trees, int(anchor[4]), contacts, keys, count, state, body,
            trial, step,
        )  # fmt: skip
        count, allowed = barriers.contacts_with(
            terrain, frame, scratch.plate_table, scratch.near_plates, int(anchor[5]), contacts, keys, count, state,
            body, trial, step,
        )  # fmt: skip
        travel = min(travel, allowed)
        count, allowed = lying_logs.contacts_with(
            terrain, frame, scratch.lying_table, scratch.near_lying, int(anchor[7]), contacts, keys, count, state, body,
            trial, step,
        )  # fmt: skip
        return count, min(travel, allowed)
    return cloud_obstacle_contacts(cloud, scene, frame, scratch, count, state, body, step)


@kernel
def find_contacts(scene, frame, state, body, stations, settings, dt, scratch, obstacles):
    """Contacts of the pose predicted for a step dt: terrain, then trees, barriers, lying logs (if obstacles is true).

    Returns (count, least clearance of the terrain [m], travel allowed in the next step by the obstacles [m],
    whether there is terrain below the whole log).
    """
    terrain = scene.terrain
    count, clearance, whole = _ground(scene.cloud, scene, frame, state, body, stations, settings, dt, scratch)
    travel = math.inf
    standing = scene.uprights.owner.shape[0] + scene.plates.owner.shape[0]
    if obstacles and standing + scene.lying.owner.shape[0] > 0:
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
            anchor[7] = lying_logs.near(
                scene.lying, frame, terrain.cell, scratch.near_lying, scratch.lying_table, bx, by, tx, ty, reach
            )
            moved = 0.0
        # what is not listed is farther away than the margin that is left
        travel = NEAR_MARGIN * 0.25
        step = (dt, settings.restitution, settings.gravity)
        count, allowed = _near_obstacles(scene.cloud, scene, frame, scratch, count, state, body, step)
        travel = min(travel, allowed)
    return count, clearance, travel, whole


@kernel
def owner_of(scene, key):
    """(is a barrier, row in the user's table) of an obstacle's contact; lying logs are numbered after the trees."""
    if key[0] == TREE:
        owner = scene.uprights.owner[key[1]]
        return (True, -1 - owner) if owner < 0 else (False, owner)
    if key[0] == LYING:
        return False, scene.lying.owner[key[1]]
    return True, scene.plates.owner[key[1]]
