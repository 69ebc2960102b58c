"""Vectors of three numbers, as tuples."""

from __future__ import annotations

import math

from .compiled import kernel
from .limits import FLAT_TOLERANCE, SKEW_LINES


@kernel
def cross(a, b):
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def dot(a, b):
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def norm(a):
    """|a|."""
    return math.sqrt(dot(a, a))


@kernel
def point(a, s, d):
    """a + s d."""
    return a[0] + s * d[0], a[1] + s * d[1], a[2] + s * d[2]


@kernel
def minus(a, b):
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@kernel
def blend(p, a, q, b):
    """p a + q b."""
    return p * a[0] + q * b[0], p * a[1] + q * b[1], p * a[2] + q * b[2]


@kernel
def unit(a):
    """Unit vector in the direction of a."""
    scale = 1.0 / norm(a)
    return a[0] * scale, a[1] * scale, a[2] * scale


@kernel
def across(d, u):
    """A unit vector perpendicular to d and, unless they are parallel, to u (both unit)."""
    n = cross(d, u)
    if dot(n, n) < FLAT_TOLERANCE**2:
        ax, ay, az = abs(d[0]), abs(d[1]), abs(d[2])
        if ax <= ay and ax <= az:
            n = cross(d, (1.0, 0.0, 0.0))
        elif ay <= az:
            n = cross(d, (0.0, 1.0, 0.0))
        else:
            n = cross(d, (0.0, 0.0, 1.0))
    return blend(1.0 / norm(n), n, 0.0, n)


@kernel
def axes_nearest(c, d, back, front, start, along, long):
    """Nearest points of the segments c + s d, s in [back, front], and start + z along, z in [0, long]: (s, z)."""
    g = point(c, -1.0, start)
    b, e, f = dot(d, along), dot(g, d), dot(g, along)
    square = 1.0 - b * b
    s = back
    if square > SKEW_LINES:
        s = (b * f - e) / square
    s = min(front, max(back, s))
    z = min(long, max(0.0, f + b * s))
    s = min(front, max(back, b * z - e))
    return s, min(long, max(0.0, f + b * s))
