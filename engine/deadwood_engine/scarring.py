"""Scarring drag: soft ground that a rock penetrates slows it down before it meets the hard plane below.

The model of Lu et al. (2019; Landslides 16:2353-2367). Between the surface and a rebound plane that lies ``depth``
below it, the ground resists the centre of mass against its velocity v, and exerts no torque:

    F = -1/2 (C_f + C_s) rho A |v| v                            their eq. 9 and 12            [q]
    depth = 0.1 M^(1/3) M_E^-0.4 |v_z|^0.8                      their eq. 11                  [r]

A is the projected area, along v, of the part of the body below the surface; C_f = 1 (fluid part) and rho = 1700 kg/m3
are theirs. depth is set by the vertical speed at the node from which a step first reaches below the surface, and is
valid until the whole body is above it again. The contacts, with friction and restitution as usual, act on the rebound
plane.

Within a step A is constant, and [q] is solved exactly: |v| falls by the factor 1 / (1 + k |v| dt) with
k = (C_f + C_s) rho A / (2 M). The surface is the plane of the facet below the body's deepest vertex; the body is its
hull, cut by that plane. In the ground a step moves towards the plane, or away from it, by at most a share of depth.

symbol   in code             unit
M_E      settings.strength   kN/m2, of the ground; 0: it is hard, and no body penetrates
C_s      settings.scar_drag  -, due to compaction
M        body[MASS]          kg
"""

from __future__ import annotations

import math

from .cloud import matrix_of, to_world
from .compiled import kernel
from .limits import SCAR_STEP, SOIL_DENSITY
from .log_body import MASS
from .rotation import VX, VY, VZ, X, Y, Z
from .terrain import surface
from .vectors import blend, cross, dot


@kernel
def scar_depth(mass, speed, strength):
    """Eq. [r]: depth [m] of the rebound plane below the surface; vertical speed [m/s], strength [kN/m2]."""
    return 0.1 * mass ** (1.0 / 3.0) * strength**-0.4 * abs(speed) ** 0.8


@kernel
def area_below(cloud, corners, p, n, along):
    """Area [m2], projected along a unit vector, of the part of a hull below the plane through p with the normal n.

    Half of the area that the faces of a convex body, the cut included, project along a line: the vector of the cut
    closes the sum.

    corners : (m, 3), of the hull, in the coordinates of p
    """
    shown, rest_x, rest_y, rest_z = 0.0, 0.0, 0.0, 0.0
    for face in range(cloud.starts.shape[0] - 1):
        first, last = cloud.starts[face], cloud.starts[face + 1]
        ax, ay, az = 0.0, 0.0, 0.0  # twice the area vector of the face's part below the plane
        begun, start, previous = False, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        b = corners[cloud.loops[last - 1]]
        below_b = dot((b[0] - p[0], b[1] - p[1], b[2] - p[2]), n)
        for k in range(first, last):
            a, below_a = b, below_b
            b = corners[cloud.loops[k]]
            below_b = dot((b[0] - p[0], b[1] - p[1], b[2] - p[2]), n)
            for which in range(2):  # where the edge crosses the plane, then its end, if it is below
                if which == 0:
                    if (below_a < 0.0) == (below_b < 0.0):
                        continue
                    share = below_a / (below_a - below_b)
                    q = blend(1.0 - share, (a[0], a[1], a[2]), share, (b[0], b[1], b[2]))
                else:
                    if below_b >= 0.0:
                        continue
                    q = (b[0], b[1], b[2])
                if begun:
                    c = cross(
                        (previous[0] - start[0], previous[1] - start[1], previous[2] - start[2]),
                        (q[0] - start[0], q[1] - start[1], q[2] - start[2]),
                    )
                    ax, ay, az = ax + c[0], ay + c[1], az + c[2]
                else:
                    begun, start = True, q
                previous = q
        shown += 0.5 * abs(dot((ax, ay, az), along))
        rest_x, rest_y, rest_z = rest_x + 0.5 * ax, rest_y + 0.5 * ay, rest_z + 0.5 * az
    return 0.5 * (shown + abs(dot((rest_x, rest_y, rest_z), along)))


@kernel
def drag(cloud, model, log, state, scratch, dt):
    """Slow down a body that is in the ground for dt by eq. [q]. Returns the work [J/kg].

    Logs (cloud is None) are round and rigid, and so is their ground.
    """
    if cloud is None:
        return 0.0
    terrain, frame = model.terrain, log.frame
    speed = math.sqrt(state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2)
    if scratch.way[0].scar == 0.0 or speed == 0.0:
        return 0.0
    matrix_of(state, scratch.turns, 0)
    least, p, n = 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    for k in range(cloud.corners.shape[0]):
        q = to_world(scratch.turns, 0, cloud.corners[k])
        scratch.corners[k, 0], scratch.corners[k, 1], scratch.corners[k, 2] = q
        height, gx, gy = surface(terrain, frame[0], frame[1], state[X] + q[0], state[Y] + q[1])
        gap = state[Z] + q[2] - height
        if gap < least:
            nz = 1.0 / math.sqrt(1.0 + gx * gx + gy * gy)
            least, p, n = gap, (q[0], q[1], q[2] - gap), (-gx * nz, -gy * nz, nz)
    if least == 0.0:
        return 0.0
    along = (state[VX] / speed, state[VY] / speed, state[VZ] / speed)
    area = area_below(cloud, scratch.corners, p, n, along)
    rate = 0.5 * (1.0 + model.settings.scar_drag) * SOIL_DENSITY * area / log.body[MASS]  # [1/m]
    left = 1.0 / (1.0 + rate * speed * dt)
    state[VX], state[VY], state[VZ] = left * state[VX], left * state[VY], left * state[VZ]
    return 0.5 * speed * speed * (left * left - 1.0)


@kernel
def step_in_scar(cloud, terrain, frame, state, settings, depth):
    """Longest step [s] of a body whose rebound plane is ``depth`` [m] below the surface: a share of it, towards or away
    from it.
    """
    if cloud is None or depth == 0.0:
        return math.inf
    _, gx, gy = surface(terrain, frame[0], frame[1], state[X], state[Y])
    rate = abs(state[VZ] - gx * state[VX] - gy * state[VY])  # [m/s] NaN beyond the terrain
    if rate > 0.0:
        return max(settings.obstacle_travel * depth / rate, SCAR_STEP)
    return math.inf
