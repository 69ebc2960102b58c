"""Free rotation of a body with three different moments of inertia (a point cloud); logs and cubes use ``rotation``.

The implicit midpoint rule for the angular momentum y in the body frame and the Cayley map for the orientation q,
    y' - y = h m x w,   q' = q (1, h w / 2) / |.|,   m = (y + y') / 2, w = I^-1 m,
conserve energy and the angular momentum in the world frame exactly: the midpoint rule conserves every quadratic
invariant, and its step is exactly the rotation given by the Cayley map. In Suzuki's five-stage composition the rule is
of fourth order in time; the steps are so short that the body turns by at most TURN in each. Energy and momentum
therefore do not drift, and a rotation about the intermediate axis becomes unstable when it should (Dzhanibekov effect).

symbol       in code               frame, unit
y            momentum              body, m2/s (per mass)
A1, A2, A3   1 / (ia + skew), 1 / ia, AXIAL   m2 (per mass), about e1, e2, e3
"""

from __future__ import annotations

import math

from .compiled import kernel
from .limits import MIDPOINT_ACCURACY, MIDPOINT_ITERATIONS, TURN
from .log_body import AXIAL, SKEW, TRANSVERSE
from .rotation import (
    DX,
    DY,
    DZ,
    Q0,
    Q1,
    Q2,
    Q3,
    VX,
    VY,
    VZ,
    WX,
    WY,
    WZ,
    X,
    Y,
    Z,
    drift,
    first_axis,
    kinetic_energy,
    set_axis,
)
from .vectors import cross, dot, norm

_FIFTH = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))  # weight of the four outer stages in Suzuki's composition


@kernel
def energy_of(state, body):
    """Kinetic energy per mass [J/kg] of any body."""
    energy = kinetic_energy(state, body[TRANSVERSE], body[AXIAL])
    if body[SKEW] != 0.0:
        ex, ey, ez = first_axis(state)
        along = state[WX] * ex + state[WY] * ey + state[WZ] * ez
        first = 1.0 / (1.0 / body[TRANSVERSE] + body[SKEW])
        energy += 0.5 * (first - body[TRANSVERSE]) * along * along
    return energy


@kernel
def move_freely(state, body, time):
    """Eq. [a], [i]: drift of any body without forces: position from velocity, orientation from its free rotation."""
    if body[SKEW] == 0.0:
        drift(state, body[TRANSVERSE], body[AXIAL], time)
        return
    state[X] += time * state[VX]
    state[Y] += time * state[VY]
    state[Z] += time * state[VZ]
    i1, i2, i3 = 1.0 / body[TRANSVERSE] + body[SKEW], 1.0 / body[TRANSVERSE], 1.0 / body[AXIAL]
    wx, wy, wz = state[WX], state[WY], state[WZ]
    spin = norm((wx, wy, wz))
    if spin == 0.0:
        return
    # angular momentum in body axes
    fx, fy, fz = first_axis(state)
    dx, dy, dz = state[DX], state[DY], state[DZ]
    gx, gy, gz = cross((dx, dy, dz), (fx, fy, fz))
    y1 = dot((fx, fy, fz), (wx, wy, wz)) / i1
    y2 = dot((gx, gy, gz), (wx, wy, wz)) / i2
    y3 = dot((dx, dy, dz), (wx, wy, wz)) / i3
    a, b, c, e = state[Q0], state[Q1], state[Q2], state[Q3]
    # the energy bounds the angular velocity at all times: |w|^2 <= 2 E / least moment of inertia
    most = math.sqrt((i1 * y1 * y1 + i2 * y2 * y2 + i3 * y3 * y3) * max(i1, i2, i3))
    steps = max(1, int(math.ceil(most * time / TURN)))
    for _ in range(steps):
        for stage in range(5):
            h = time / steps * (_FIFTH if stage != 2 else 1.0 - 4.0 * _FIFTH)
            m1, m2, m3 = y1, y2, y3
            for _ in range(MIDPOINT_ITERATIONS):
                w1, w2, w3 = i1 * m1, i2 * m2, i3 * m3
                n1 = y1 + 0.5 * h * (m2 * w3 - m3 * w2)
                n2 = y2 + 0.5 * h * (m3 * w1 - m1 * w3)
                n3 = y3 + 0.5 * h * (m1 * w2 - m2 * w1)
                change = abs(n1 - m1) + abs(n2 - m2) + abs(n3 - m3)
                m1, m2, m3 = n1, n2, n3
                if change <= MIDPOINT_ACCURACY * (abs(m1) + abs(m2) + abs(m3)):
                    break
            y1, y2, y3 = 2.0 * m1 - y1, 2.0 * m2 - y2, 2.0 * m3 - y3
            w1, w2, w3 = 0.5 * h * i1 * m1, 0.5 * h * i2 * m2, 0.5 * h * i3 * m3
            scale = 1.0 / math.sqrt(1.0 + w1 * w1 + w2 * w2 + w3 * w3)
            p, q, r, s = a, b, c, e
            a = (p - q * w1 - r * w2 - s * w3) * scale
            b = (q + p * w1 + r * w3 - s * w2) * scale
            c = (r + p * w2 + s * w1 - q * w3) * scale
            e = (s + p * w3 + q * w2 - r * w1) * scale
    state[Q0], state[Q1], state[Q2], state[Q3] = a, b, c, e
    set_axis(state)
    fx, fy, fz = first_axis(state)
    dx, dy, dz = state[DX], state[DY], state[DZ]
    gx, gy, gz = cross((dx, dy, dz), (fx, fy, fz))
    w1, w2, w3 = i1 * y1, i2 * y2, i3 * y3
    state[WX] = w1 * fx + w2 * gx + w3 * dx
    state[WY] = w1 * fy + w2 * gy + w3 * dy
    state[WZ] = w1 * fz + w2 * gz + w3 * dz
