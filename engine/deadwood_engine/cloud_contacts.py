"""Contacts of a point cloud with the terrain: each of its points, predicted one step ahead as the rings of a log are.

A vertex turns while it is in contact: its lever arm is the mean of those of the present pose and of the predicted pose
in which it was found below the ground. With that of the present pose, a wheel with many vertices is supported at a
point ahead of its lowest by the angle of the step: it rolls against sin(omega dt) of its weight (0.26 at 8 m/s, 0.6 m
and 10 ms), whatever the number of vertices, and cubes stop too soon; with that of the predicted pose, cubes keep
tumbling. With the mean, half of the wheel's spurious resistance remains, so the angle of a step is bounded
(``limits.CLOUD_TURN``).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from .asymmetric_top import move_freely
from .cloud import Cloud, matrix_of, to_world
from .compiled import kernel
from .contacts import Facet, Found, Ground, add_contact, ground_contact
from .log_body import MASS
from .rotation import DX, DY, DZ, STATE_WIDTH, VZ, X, Y, Z
from .scarring import scar_depth
from .slip import scarred
from .terrain import Terrain, friction_at, surface
from .vectors import blend

NOW, AHEAD = 0, 9  # offsets of the rotation matrices of the present and the predicted pose in scratch.turns


class CloudQuery(NamedTuple):
    """As ``contacts.Query``, for a cloud: the pose ahead of it is laid out in the memory of the worker."""

    cloud: Cloud
    terrain: Terrain
    frame: np.ndarray
    scratch: Any
    state: np.ndarray


@kernel
def cloud_terrain_contacts(model, log, state, scratch, step):
    """As ``rings.terrain_contacts``, for the points of the cloud; scratch.turns receives both rotations."""
    cloud, terrain, settings, frame, body = model.cloud, model.terrain, model.settings, log.frame, log.body
    turned, trial = scratch.turned, scratch.trial[0]
    for k in range(STATE_WIDTH):
        turned[k] = state[k]
    turned[VZ] -= 0.5 * step.gravity * step.dt
    move_freely(turned, body, step.dt)
    trial.dx, trial.dy, trial.dz = turned[DX], turned[DY], turned[DZ]
    trial.x, trial.y, trial.z = turned[X], turned[Y], turned[Z]
    matrix_of(state, scratch.turns, NOW)
    matrix_of(turned, scratch.turns, AHEAD)
    most, kappa, way = settings.friction_max, settings.friction_kappa, scratch.way[0]
    slip, depth, inside = way.slip, way.scar, False
    way.enters = math.inf
    ground = Ground(terrain, frame, scratch.contacts, scratch.keys, state)
    count, whole = 0, True
    for k in range(cloud.points.shape[0]):
        p = to_world(scratch.turns, AHEAD, cloud.points[k])
        px, py, pz = turned[X] + p[0], turned[Y] + p[1], turned[Z] + p[2]
        height, gx, gy = surface(terrain, frame[0], frame[1], px, py)
        gap = pz - height
        if gap != gap:
            whole = False
            continue
        if gap < 0.0 and settings.strength > 0.0:
            inside = True
            if way.scar == 0.0:
                depth = scar_depth(body[MASS], state[VZ], settings.strength)
                p_now = to_world(scratch.turns, NOW, cloud.points[k])
                at, _, _ = surface(terrain, frame[0], frame[1], state[X] + p_now[0], state[Y] + p_now[1])
                above = max(0.0, state[Z] + p_now[2] - at)
                # only to the surface, or by a share of the depth
                way.enters = min(
                    way.enters, step.dt * max(above, settings.obstacle_travel * depth) / max(above - gap, above)
                )
        if gap + depth < 0.0:
            before = count
            r = blend(0.5, p, 0.5, to_world(scratch.turns, NOW, cloud.points[k]))
            mu = scarred(friction_at(terrain, frame[0], frame[1], px, py), most, kappa, slip)
            count = ground_contact(ground, count, step, Facet(k, r, gap + depth, (gx, gy), mu, False), False)
            if depth > 0.0 and count > before:  # in the hard ground
                c = scratch.contacts[before]
                height, gx, gy = surface(terrain, frame[0], frame[1], state[X] + c.rx, state[Y] + c.ry)
                c.gap = (state[Z] + c.rz - height + depth) / math.sqrt(1.0 + gx * gx + gy * gy)
    way.scar_ahead = depth if inside or not whole else 0.0  # nothing is known beyond the border of the terrain
    return count, whole


@kernel
def cloud_clearance(cloud, terrain, frame, state, turns):
    """As ``ring_look.lowest_ring``, for the points of the cloud: the least gap [m], not below 0."""
    matrix_of(state, turns, NOW)
    least = math.inf
    for k in range(cloud.points.shape[0]):
        p = to_world(turns, NOW, cloud.points[k])
        height, gx, gy = surface(terrain, frame[0], frame[1], state[X] + p[0], state[Y] + p[1])
        gap = (state[Z] + p[2] - height) / math.sqrt(1.0 + gx * gx + gy * gy)
        if gap < least:
            least = gap
    return max(0.0, least) if least < math.inf else 0.0


@kernel
def touch_cloud(query, count, step, key, p, n, gap):
    """Add the contact of an obstacle at the predicted point p [m] with normal n and gap [m]: as ``contacts.touch``."""
    scratch, frame = query.scratch, query.frame
    trial = scratch.trial[0]
    r = (p[0] - trial.x, p[1] - trial.y, p[2] - trial.z)
    mu = step.friction if step.friction >= 0.0 else friction_at(query.terrain, frame[0], frame[1], p[0], p[1])
    found = Found(key, r, n, gap, mu)
    return add_contact(scratch.contacts, scratch.keys, count, query.state, found, step, False)
