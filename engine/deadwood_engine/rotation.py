"""Free rotation of a symmetric top in closed form, exact for any time step.

The angular momentum Lm of a free log is constant, so the motion consists of two rotations about fixed axes:
about Lm in the world (precession, rate |Lm|/A) and about the log's own axis in the body (rate (1/C - 1/A) Lm.d).
Neither energy nor angular momentum can drift, as they do in explicit schemes and in that of 2014 (a slender log has
A/C of 1000 to 10000, and these turn tumbling into spin). Equation numbers: engine/README.md.

symbol  in code           frame, unit
q       state[3:7]        unit quaternion, body -> world
d       state[13:16]      axis from base to tip, world
w       state[10:13]      angular velocity, world, rad/s
A, C    transverse, axial  m2 (per mass)
"""

from __future__ import annotations

import math

import numpy as np

from .compiled import kernel
from .limits import SMALL_TURN, VERTICAL
from .vectors import cross, dot, norm, point

# Columns of a log's working state
X, Y, Z = 0, 1, 2  # centre of mass, local frame [m]
Q0, Q1, Q2, Q3 = 3, 4, 5, 6  # orientation
VX, VY, VZ = 7, 8, 9  # velocity of the centre of mass [m/s]
WX, WY, WZ = 10, 11, 12  # angular velocity, world frame [rad/s]
DX, DY, DZ = 13, 14, 15  # axis, base to tip (follows from the orientation)
STATE_WIDTH = 16


@kernel
def half_turn(angle):
    """cos(angle/2) and sin(angle/2)/angle; a series near zero saves two library calls and the division by zero."""
    h = 0.25 * angle * angle
    if h < SMALL_TURN:
        c = 1.0 - h * (1.0 / 2 - h * (1.0 / 24 - h * (1.0 / 720 - h * (1.0 / 40320 - h / 3628800))))
        s = 1.0 - h * (1.0 / 6 - h * (1.0 / 120 - h * (1.0 / 5040 - h * (1.0 / 362880 - h / 39916800))))
        return c, 0.5 * s
    return math.cos(0.5 * angle), math.sin(0.5 * angle) / angle


@kernel
def set_axis(state):
    """Normalise the quaternion and derive the axis d = R(q) e3 from it."""
    a, b, c, e = state[Q0], state[Q1], state[Q2], state[Q3]
    scale = 1.0 / math.sqrt(a * a + b * b + c * c + e * e)
    a, b, c, e = a * scale, b * scale, c * scale, e * scale
    state[Q0], state[Q1], state[Q2], state[Q3] = a, b, c, e
    state[DX] = 2.0 * (b * e + a * c)
    state[DY] = 2.0 * (c * e - a * b)
    state[DZ] = 1.0 - 2.0 * (b * b + c * c)


@kernel
def spin_of(state):
    """Spin about the axis [1/s]."""
    return dot((state[WX], state[WY], state[WZ]), (state[DX], state[DY], state[DZ]))


@kernel
def swing_of(state):
    """Velocity of the axis' direction, w x d [1/s]."""
    return cross((state[WX], state[WY], state[WZ]), (state[DX], state[DY], state[DZ]))


@kernel
def square_to_axis(state, a):
    """Component of a vector perpendicular to the axis."""
    d = (state[DX], state[DY], state[DZ])
    return point(a, -dot(a, d), d)


@kernel
def first_axis(state):
    """R(q) e1, the first principal axis in the world."""
    a, b, c, e = state[Q0], state[Q1], state[Q2], state[Q3]
    return 1.0 - 2.0 * (c * c + e * e), 2.0 * (b * c + a * e), 2.0 * (b * e - a * c)


@kernel
def drift(state, transverse, axial, time):
    """Eq. [a]: free motion of the log for a time [s]: straight, with the rotation of a free symmetric top."""
    state[X] += time * state[VX]
    state[Y] += time * state[VY]
    state[Z] += time * state[VZ]
    dx, dy, dz = state[DX], state[DY], state[DZ]
    wx, wy, wz = state[WX], state[WY], state[WZ]
    along = spin_of(state)  # constant
    # Angular momentum over A: the precession vector itself
    k = (axial / transverse - 1.0) * along
    px, py, pz = wx + k * dx, wy + k * dy, wz + k * dz
    rate = norm((px, py, pz))
    if rate == 0.0:
        return
    c1, s1 = half_turn(rate * time)
    s1 *= time
    # Own rotation (1/C - 1/A) L.d, with L.d = C along
    own = (1.0 - axial / transverse) * along * time
    c2, s2 = half_turn(own)
    s2 *= own
    a, b, c, e = state[Q0], state[Q1], state[Q2], state[Q3]
    # q * (c2, 0, 0, s2)
    a2, b2, c22, e2 = a * c2 - e * s2, b * c2 + c * s2, c * c2 - b * s2, e * c2 + a * s2
    # (c1, s1 p) * q
    lx, ly, lz = s1 * px, s1 * py, s1 * pz
    state[Q0] = c1 * a2 - lx * b2 - ly * c22 - lz * e2
    state[Q1] = c1 * b2 + lx * a2 + ly * e2 - lz * c22
    state[Q2] = c1 * c22 - lx * e2 + ly * a2 + lz * b2
    state[Q3] = c1 * e2 + lx * c22 - ly * b2 + lz * a2
    set_axis(state)
    dx, dy, dz = state[DX], state[DY], state[DZ]
    state[WX] = px - k * dx
    state[WY] = py - k * dy
    state[WZ] = pz - k * dz


@kernel
def kinetic_energy(state, transverse, axial):
    """Kinetic energy per mass [J/kg]."""
    along = spin_of(state)
    spin = state[WX] ** 2 + state[WY] ** 2 + state[WZ] ** 2
    speed = state[VX] ** 2 + state[VY] ** 2 + state[VZ] ** 2
    return 0.5 * (speed + transverse * (spin - along * along) + axial * along * along)


def quaternion_from_axis(axis: np.ndarray) -> np.ndarray:
    """Unit quaternions that turn e3 into the given unit axes by the shortest way; shapes (n, 3) -> (n, 4)."""
    axis = np.asarray(axis, dtype=float)
    quaternion = np.empty((len(axis), 4))
    quaternion[:, 0] = 1.0 + axis[:, 2]
    quaternion[:, 1] = -axis[:, 1]
    quaternion[:, 2] = axis[:, 0]
    quaternion[:, 3] = 0.0
    upside_down = quaternion[:, 0] < VERTICAL
    quaternion[upside_down] = (0.0, 1.0, 0.0, 0.0)
    return quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
