"""A look at the ground below every ring of a log, in one go: which of them can touch it at all.

Three straight loops over a few dozen rings at a time, of which the processor does four together in the first and the
last; only the one between, which fetches heights from all over the terrain, goes ring by ring. Nothing branches: that
costs less than to ask first which rings can be left out. For the same reason what is passed from loop to loop lies in
rows of a fixed length, for then the compiler sees that they do not overlap.
"""

from __future__ import annotations

import math

import numpy as np

from .compiled import inlined
from .log_body import BASE_RADIUS, CENTRE, LENGTH, TIP_RADIUS
from .terrain import HALF_WORD, KINK

# What a look finds, a row each: how far [m] a ring is above all that can touch it, and the slope below its centre
ABOVE, SLOPE_X, SLOPE_Y = range(3)
RING_ROWS = 3

TOGETHER = 64  # rings
# Where, in the room for these, each quantity has its TOGETHER places
_U, _V, _H00, _H10, _H01, _H11, _KINKS, _OUTSIDE = (TOGETHER * k for k in range(8))
LOOK_ROOM = 8 * TOGETHER

# sqrt(1 + x) <= _STEEP + _STEEPER x: its tangent at x = 0.7, a slope of 40 degrees, and 3 % too much on the level
_STEEPER = 0.5 / math.sqrt(1.7)
_STEEP = math.sqrt(1.7) - 0.7 * _STEEPER


@inlined
def look(terrain, i0, j0, body, stations, trial, rings, room):
    """Look at the ground below every ring of the predicted pose.

    A ring and the stretch of the side that it answers for are above ground whose slope is that below the ring's centre,
    plus or minus the terrain's kinks, on all of the way there. That holds as far as ``kink_reach``; thicker rings
    are always looked at.

    Parameters
    ----------
    i0, j0 : the frame's node; trial : the pose; rings : (RING_ROWS, stations or more), the result
    room : (LOOK_ROOM,), to work in
    """
    inverse_cell, radius, centre = terrain.inverse_cell, body[BASE_RADIUS], body[CENTRE]
    rows, columns = terrain.heights.shape
    heights, kinks = terrain.heights, terrain.kinks
    last_i, last_j, first_i, first_j = columns - 2.0, rows - 2.0, float(i0), float(j0)
    one = np.uint64(1)
    qx, qy, qz, ox, oy, oz = trial.dx, trial.dy, trial.dz, trial.x, trial.y, trial.z
    flat_x, flat_y = abs(qx), abs(qy)
    taper = (body[TIP_RADIUS] - radius) / body[LENGTH]
    narrowing = abs(taper)
    between = body[LENGTH] / (stations - 1)
    # of the stretch of the side that a ring answers for, as far as the kinks' bound goes (a ring is square to the axis)
    covered = math.sqrt(max(0.0, terrain.kink_reach**2 - radius**2))
    inner, outer = min(0.5 * between, covered), min(between, covered)
    thick = math.inf if radius > terrain.kink_reach else 0.0
    for first in range(0, stations, TOGETHER):
        number = min(TOGETHER, stations - first)
        for k in range(number):  # the cell below each
            s = (first + k) * between - centre
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
        for k in range(number):  # its heights and kinks
            i, j = np.uint64(np.int64(room[_H10 + k])), np.uint64(np.int64(room[_H01 + k]))
            room[_H00 + k], room[_H10 + k] = heights[j, i], heights[j, i + one]
            room[_H01 + k], room[_H11 + k] = heights[j + one, i], heights[j + one, i + one]
            room[_KINKS + k] = kinks[j, i]
        for k in range(number):  # and how far above them the ring is
            along = (first + k) * between
            u, v, h00, packed = room[_U + k], room[_V + k], room[_H00 + k], room[_KINKS + k]
            bx, by = room[_H10 + k] - h00, room[_H01 + k] - h00
            twist = room[_H11 + k] - room[_H10 + k] - by
            gx, gy = bx + twist * v, by + twist * u
            height = h00 + bx * u + gy * v
            gx, gy = gx * inverse_cell, gy * inverse_cell
            ky = np.floor(packed / HALF_WORD)
            kx = packed - ky * HALF_WORD
            kx, ky = kx * KINK, ky * KINK
            steepest_x, steepest_y = abs(gx) + kx, abs(gy) + ky
            steep = _STEEP + _STEEPER * (steepest_x * steepest_x + steepest_y * steepest_y)
            # how far the axis comes down on the ring's stretch, and the side with it
            reach = outer if first + k == 1 or first + k == stations - 2 else inner
            lean = reach * (abs(qz - gx * qx - gy * qy) + narrowing + kx * flat_x + ky * flat_y)
            above = oz + (along - centre) * qz - height - (radius + taper * along) * steep - lean - thick
            room[_H00 + k] = above if room[_OUTSIDE + k] == 0.0 else math.nan
            room[_H10 + k], room[_H01 + k] = gx, gy
        for k in range(number):
            rings[ABOVE, first + k] = room[_H00 + k]
            rings[SLOPE_X, first + k], rings[SLOPE_Y, first + k] = room[_H10 + k], room[_H01 + k]
