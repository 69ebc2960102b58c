"""Proximity query for the ground below all rings of a log at once: which of them can touch it at all.

Three straight loops over a few dozen rings at a time, of which the processor runs four iterations together in the first
and the last; only the middle one, which fetches heights from all over the terrain, goes ring by ring. There are no
branches: that costs less than to test first which rings can be omitted. For the same reason the arrays passed from loop
to loop are rows of a fixed length, because the compiler then knows that they do not overlap.
"""

from __future__ import annotations

import math

import numpy as np

from .compiled import inlined
from .log_body import BASE_RADIUS, CENTRE, LENGTH, TIP_RADIUS
from .rotation import DX, DY, DZ, X, Y, Z
from .terrain import HALF_WORD, KINK

# Results, a row each: height [m] of a ring above all that can touch it, and the slope and the kinks below its centre;
# and, one after the other, the rings that can be touched, and the places where contacts are sought (``rings``)
ABOVE, SLOPE_X, SLOPE_Y, KINKS, NEAR, PLACE = range(6)

TOGETHER = 64  # positions along the axis
# The compiled loops process this many at a time, and a remainder one by one, which for a log of a dozen
# rings would be all of them. They therefore process a full block, over positions beyond the log that nobody reads
AT_A_TIME = 16
# Where, in the buffer for these, each quantity has its TOGETHER positions
_U, _V, _H00, _H10, _H01, _H11, _KINKS, _OUTSIDE, _ALONG = (TOGETHER * k for k in range(9))
LOOK_ROOM = 9 * TOGETHER

# sqrt(1 + x) <= _STEEP + _STEEPER x: its tangent at x = 0.7, a slope of 40 degrees, and 3 % too large on level ground
_STEEPER = 0.5 / math.sqrt(1.7)
_STEEP = math.sqrt(1.7) - 0.7 * _STEEPER


def ring_table(stations: int) -> np.ndarray:
    """Room for the results for a log of this number of rings, and for a place between any two."""
    return np.zeros((PLACE + 1, 2 * stations))


@inlined
def _ground_below(terrain, frame, centre, axis, number, full, room):
    """Heights and kinks of the cells below positions along an axis; where in its cell each is, and whether there is
    one.

    frame : DEM node of the log's frame; centre : [m] centre of mass, and its position along the axis; axis : direction,
        base to tip
    number : of positions on the log; full : in whole blocks, of which the remainder holds meaningless numbers
    room : with the positions along the axis [m] from the base, in _ALONG
    """
    inverse_cell, heights, kinks = terrain.inverse_cell, terrain.heights, terrain.kinks
    rows, columns = heights.shape
    last_i, last_j, first_i, first_j = columns - 2.0, rows - 2.0, float(frame[0]), float(frame[1])
    ox, oy, _, middle = centre
    qx, qy, _ = axis
    one = np.uint64(1)
    for k in range(full):
        s = room[_ALONG + k] - middle
        u, v = (ox + s * qx) * inverse_cell, (oy + s * qy) * inverse_cell
        iu, jv = np.floor(u), np.floor(v)
        room[_U + k], room[_V + k] = u - iu, v - jv
        i, j = first_i + iu, first_j + jv
        column = i if i > 0.0 else 0.0
        column = column if column < last_i else last_i
        row = j if j > 0.0 else 0.0
        row = row if row < last_j else last_j
        room[_H10 + k], room[_H01 + k] = column, row
        room[_OUTSIDE + k] = abs(i - column) + abs(j - row)
    for k in range(number):
        i, j = np.uint64(np.int64(room[_H10 + k])), np.uint64(np.int64(room[_H01 + k]))
        room[_H00 + k], room[_H10 + k] = heights[j, i], heights[j, i + one]
        room[_H01 + k], room[_H11 + k] = heights[j + one, i], heights[j + one, i + one]
        room[_KINKS + k] = kinks[j, i]


@inlined
def _height(inverse_cell, k, room):
    """Height and slope of the ground below position k: as ``terrain.bilinear``."""
    u, v, h00 = room[_U + k], room[_V + k], room[_H00 + k]
    bx, by = room[_H10 + k] - h00, room[_H01 + k] - h00
    twist = room[_H11 + k] - room[_H10 + k] - by
    gx, gy = bx + twist * v, by + twist * u
    return h00 + bx * u + gy * v, gx * inverse_cell, gy * inverse_cell


@inlined
def unpacked(packed):
    """Kinks [-] along x and y, from a word of ``terrain.kinks_of``."""
    ky = np.floor(packed / HALF_WORD)
    return (packed - ky * HALF_WORD) * KINK, ky * KINK


@inlined
def mean_kinks(rings, stations):
    """Mean over the near rings of the terrain's kinks [-], the greater of x and y; 0 if no ring is near the ground.

    rings : as ``look`` left them. Independent of the direction in which the log moves: with the kinks along its motion
    alone, logs on a bench across a gully, and in a rough gully, kept the error of long steps, because there they are
    thrown from wall to wall.
    """
    total, near = 0.0, 0
    for k in range(stations):
        if rings[ABOVE, k] <= 0.0:
            kx, ky = unpacked(rings[KINKS, k])
            total += max(kx, ky)
            near += 1
    return total / near if near > 0 else 0.0


@inlined
def _rise(axis, narrowing, gx, gy, packed):
    """(steep, lean): per metre of radius, and of distance along the axis, how much lower [-] than the axis a point of
    the side can be over ground of the slope (gx, gy), plus or minus its kinks.
    """
    qx, qy, qz = axis
    kx, ky = unpacked(packed)
    steepest_x, steepest_y = abs(gx) + kx, abs(gy) + ky
    steep = _STEEP + _STEEPER * (steepest_x * steepest_x + steepest_y * steepest_y)
    return steep, abs(qz - gx * qx - gy * qy) + narrowing + kx * abs(qx) + ky * abs(qy)


@inlined
def look(terrain, log, trial, rings, room):
    """Query the ground below every ring of the predicted pose.

    A ring and its stretch of the side are above ground whose slope is that below the ring's centre, plus or minus the
    terrain's kinks, over the whole stretch. That is valid as far as ``kink_reach``; thicker rings are always queried
    in full.

    Parameters
    ----------
    log : a ``Log``; trial : the pose; rings : as of ``ring_table``, the result
    room : (LOOK_ROOM,), buffer

    Returns (number of rings that can be touched, whether there is terrain below every ring).
    """
    frame, body, stations = log
    radius, oz, inverse_cell = body[BASE_RADIUS], trial.z, terrain.inverse_cell
    axis = (trial.dx, trial.dy, trial.dz)
    centre = (trial.x, trial.y, oz, body[CENTRE])
    taper = (body[TIP_RADIUS] - radius) / body[LENGTH]
    narrowing = abs(taper)
    between = body[LENGTH] / (stations - 1)
    # for the stretch of the side that belongs to a ring, as far as the kinks' bound is valid (a ring is perpendicular
    # to the axis)
    covered = math.sqrt(max(0.0, terrain.kink_reach**2 - radius**2))
    inner, outer = min(0.5 * between, covered), min(between, covered)
    thick = math.inf if radius > terrain.kink_reach else 0.0
    near, whole = 0, True
    for first in range(0, stations, TOGETHER):
        number = min(TOGETHER, stations - first)
        full = (number + AT_A_TIME - 1) // AT_A_TIME * AT_A_TIME
        for k in range(full):
            room[_ALONG + k] = (first + k) * between
        _ground_below(terrain, frame, centre, axis, number, full, room)
        for k in range(full):
            along = room[_ALONG + k]
            height, gx, gy = _height(inverse_cell, k, room)
            steep, lean = _rise(axis, narrowing, gx, gy, room[_KINKS + k])
            # how far the axis drops on the ring's stretch, and the side with it
            reach = outer if first + k == 1 or first + k == stations - 2 else inner
            above = (
                oz + (along - centre[3]) * axis[2] - height - (radius + taper * along) * steep - reach * lean - thick
            )
            room[_H00 + k] = above if room[_OUTSIDE + k] == 0.0 else math.nan
            room[_H10 + k], room[_H01 + k] = gx, gy
        for k in range(number):
            above = room[_H00 + k]
            rings[ABOVE, first + k] = above
            rings[SLOPE_X, first + k], rings[SLOPE_Y, first + k] = room[_H10 + k], room[_H01 + k]
            rings[KINKS, first + k] = room[_KINKS + k]
            rings[NEAR, near] = first + k
            near += 1 if above <= 0.0 else 0
            whole = whole and above == above
    return near, whole


@inlined
def lowest_ring(terrain, log, state, room):
    """Gap [m] of the lowest ring above the tangent plane below it; not below 0, and 0 where there is no terrain."""
    frame, body, stations = log
    radius, inverse_cell = body[BASE_RADIUS], terrain.inverse_cell
    axis = (state[DX], state[DY], state[DZ])
    centre = (state[X], state[Y], state[Z], body[CENTRE])
    taper = (body[TIP_RADIUS] - radius) / body[LENGTH]
    between = body[LENGTH] / (stations - 1)
    lowest, least = math.inf, 0.0
    for first in range(0, stations, TOGETHER):
        number = min(TOGETHER, stations - first)
        full = (number + AT_A_TIME - 1) // AT_A_TIME * AT_A_TIME
        for k in range(full):
            room[_ALONG + k] = (first + k) * between
        _ground_below(terrain, frame, centre, axis, number, full, room)
        for k in range(full):
            height, gx, gy = _height(inverse_cell, k, room)
            above = centre[2] + (room[_ALONG + k] - centre[3]) * axis[2] - height
            gap = above - (radius + taper * room[_ALONG + k]) * (1.0 + 0.5 * (gx * gx + gy * gy))
            room[_H00 + k] = gap if room[_OUTSIDE + k] == 0.0 else math.inf
            room[_H10 + k], room[_H01 + k], room[_H11 + k] = gx, gy, above
        for k in range(number):
            if room[_H00 + k] < lowest:
                lowest, gx, gy = room[_H00 + k], room[_H10 + k], room[_H01 + k]
                nz = 1.0 / math.sqrt(1.0 + gx * gx + gy * gy)
                nd = nz * (axis[2] - gx * axis[0] - gy * axis[1])
                a = radius + taper * room[_ALONG + k]
                least = room[_H11 + k] * nz - a * math.sqrt(max(0.0, 1.0 - nd * nd))
    return max(0.0, least)
