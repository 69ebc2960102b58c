"""Crests: where the side of a log touches terrain, as it must on a surface made of bilinear cells.

A cone's side is straight along its axis and cells are all but straight along a line, so between its ends a log touches
the terrain where its lowest line crosses the grid lines of the DEM, as a plank touches a stair at its edges. The normal
there is square to the cone's side and to the grid line, both of which are known; the slopes of the cells on either side
do not matter. With those slopes for normals and rings at fixed places, rings are the teeth of a cogwheel: each falls
between two crests and strikes the flank of the next. Measured (slow logs on a rough slope, two seconds): a log then
moved the less the denser its rings, by 2 % for each halving of their distance, without an end.
"""

from __future__ import annotations

import math

import numpy as np

from .compiled import inlined, kernel
from .limits import ALONG_GRID, BESIDE_CREST, CREST, LEAST_UPWARD, REFINED, WALL
from .terrain import bilinear, surface


@inlined
def along_side(terrain, i0, j0, px, py, height, gx, gy, dx, dy, dz, a, taper, reach):
    """Slope of the plane that touches the cone's side at p, where the ground has this height and gradient (gx, gy).

    Ground that falls away from its own tangent within the reach [m] along the axis is the flank of a crest, which the
    side touches: what is left of its gradient is the part across the axis. Other ground, and walls, keep theirs.
    """
    nz = 1.0 / math.sqrt(1.0 + gx * gx + gy * gy)
    along = nz * (dz - gx * dx - gy * dy)
    turn = taper * math.sqrt(max(0.0, 1.0 - along * along)) - along
    upward = nz + turn * dz
    if abs(along) > WALL or upward < LEAST_UPWARD:
        return gx, gy
    rise = reach * (gx * dx + gy * dy)
    ahead, _, _ = surface(terrain, i0, j0, px + reach * dx, py + reach * dy)
    behind, _, _ = surface(terrain, i0, j0, px - reach * dx, py - reach * dy)
    if ahead < height + rise - CREST * a or behind < height - rise - CREST * a:
        return (gx * nz - turn * dx) / upward, (gy * nz - turn * dy) / upward
    return gx, gy


@kernel
def _highest(heights, cell, inverse_cell, i0, j0, px, py, pz, lx, ly, lz, low, high, gap):
    """Of the line p + t l's crossings with grid lines, t in [low, high], the one least above ground, if below ``gap``.

    Returns (gap, t, family of the grid line: 0 north-south, 1 east-west, -1 none, slope along the grid line). None
    where the line goes on coming nearer to the ground on one side: it touches farther along, as on a plane.
    """
    rows, columns = heights.shape
    best, slope, family = 0.0, 0.0, -1
    for way in range(2):
        p, q, along, across = (px, py, lx, ly) if way == 0 else (py, px, ly, lx)
        if abs(along) < ALONG_GRID:
            continue  # it would not tell which way the crest is touched
        to_t = cell / along
        p *= inverse_cell
        u, v = p + low / to_t, p + high / to_t
        for line in range(int(math.ceil(min(u, v))), int(math.floor(max(u, v))) + 1):
            t = (line - p) * to_t
            place = (q + t * across) * inverse_cell
            node = math.floor(place)
            i, j = (i0 + line, j0 + int(node)) if way == 0 else (i0 + int(node), j0 + line)
            if i < 0 or j < 0 or i >= columns - 1 or j >= rows - 1:
                continue
            # between its nodes a grid line is straight
            height = np.float64(heights[j, i])
            rise = np.float64(heights[j + 1, i] if way == 0 else heights[j, i + 1]) - height
            here = pz + t * lz - height - rise * (place - node)
            if here < gap:
                gap, best, slope, family = here, t, rise * inverse_cell, way
    if family >= 0:
        for side in range(2):
            t = best + (BESIDE_CREST if side == 0 else -BESIDE_CREST) * cell
            height, _, _ = bilinear(heights, inverse_cell, i0, j0, px + t * lx, py + t * ly)
            if pz + t * lz - height < gap:
                family = -1
    return gap, best, family, slope


@inlined
def crest(terrain, i0, j0, cx, cy, cz, qx, qy, qz, ex, ey, ez, a, taper, low, high, gap):
    """The crest under a log's side between ``low`` and ``high`` [m] along its axis q from the ring with centre c.

    e : from the axis to the ring's lowest point, square to the axis; a : its length, the ring's radius [m]
    gap : [m] vertical, of the ring's own point

    Returns (found, t, e, gap, slope): whether a crest stands out over the ring's own point; where along the axis [m];
    from the axis to the point there, its vertical gap [m] and the slope (x, y) of the plane that touches log and crest.
    """
    found, place, slope_x, slope_y = False, 0.0, 0.0, 0.0
    ox, oy, oz = ex, ey, ez
    most = min(gap - CREST * a, REFINED * a)  # higher than that is no contact, even looked at once more
    for look in range(2):
        k = taper / a
        lx, ly, lz = qx + k * ex, qy + k * ey, qz + k * ez
        near, t, family, slope = _highest(
            terrain.heights, terrain.cell, terrain.inverse_cell, i0, j0, cx + ex, cy + ey, cz + ez, lx, ly, lz,
            low, high, most,
        )  # fmt: skip
        if family < 0:
            break
        if family == 0:
            sx, sy = (lz - ly * slope) / lx, slope
        else:
            sx, sy = slope, (lz - lx * slope) / ly
        steep = 1.0 + sx * sx + sy * sy
        if steep * LEAST_UPWARD * LEAST_UPWARD > 1.0:
            break
        found, place, gap, slope_x, slope_y = True, t, near, sx, sy
        ox, oy, oz = ex, ey, ez
        if look == 1:
            break
        most = math.inf
        # once more, with the lowest line as this crest has it, and only about there
        nd = qz - sx * qx - sy * qy  # times n_z, as the rest
        ex, ey, ez = nd * qx + sx, nd * qy + sy, nd * qz - 1.0
        scale = a / math.sqrt(ex * ex + ey * ey + ez * ez)
        ex, ey, ez = scale * ex, scale * ey, scale * ez
        low, high = max(low, t - terrain.cell), min(high, t + terrain.cell)
    k = 1.0 + place * taper / a
    return found, place, k * ox, k * oy, k * oz, gap, slope_x, slope_y
