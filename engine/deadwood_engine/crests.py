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

from .compiled import inlined, kernel
from .limits import FLAT_TOLERANCE, LEAST_UPWARD, REFINED, WALL
from .terrain import surface


@inlined
def along_side(gx, gy, dx, dy, dz, taper):
    """Slope of the plane that touches the cone's side where ground of the gradient (gx, gy) does.

    A side touches no ground that tilts along it: what is left of the gradient is its part across. Walls keep theirs.
    Returns (slope x, slope y, whether the ground is a wall to this axis).
    """
    nz = 1.0 / math.sqrt(1.0 + gx * gx + gy * gy)
    along = nz * (dz - gx * dx - gy * dy)
    turn = taper * math.sqrt(max(0.0, 1.0 - along * along)) - along
    upward = nz + turn * dz
    if abs(along) > WALL or upward < LEAST_UPWARD:
        return gx, gy, True
    return (gx * nz - turn * dx) / upward, (gy * nz - turn * dy) / upward, False


@kernel
def _highest(terrain, i0, j0, px, py, pz, lx, ly, lz, low, high, gap):
    """Of the line p + t l's crossings with grid lines for t in [low, high] the one least above ground, if below ``gap``.

    Returns (gap, t, family of the grid line: 0 north-south, 1 east-west, -1 none, slope along the grid line).
    """
    best, slope, family = 0.0, 0.0, -1
    for way in range(2):
        p, l = (px, lx) if way == 0 else (py, ly)
        if abs(l) < FLAT_TOLERANCE:
            continue
        u, v = (p + low * l) * terrain.inverse_cell, (p + high * l) * terrain.inverse_cell
        for line in range(int(math.ceil(min(u, v))), int(math.floor(max(u, v))) + 1):
            t = (line * terrain.cell - p) / l
            height, gx, gy = surface(terrain, i0, j0, px + t * lx, py + t * ly)
            here = pz + t * lz - height
            if here < gap:
                gap, best, slope, family = here, t, gy if way == 0 else gx, way
    return gap, best, family, slope


@inlined
def crest(terrain, i0, j0, cx, cy, cz, qx, qy, qz, ex, ey, ez, a, taper, low, high, gap):
    """The crest under a log's side between ``low`` and ``high`` [m] along its axis q from the ring with centre c.

    e : from the axis to the ring's lowest point, square to the axis; a : its length, the ring's radius [m]
    gap : [m] vertical, of the ring's own point

    Returns (found, t, e, gap, slope): whether a crest is nearer than the ring's own point; where along the axis [m];
    from the axis to the point there, its vertical gap [m] and the slope (x, y) of the plane that touches log and crest.
    """
    found, place, slope_x, slope_y = False, 0.0, 0.0, 0.0
    ox, oy, oz = ex, ey, ez
    for look in range(2):
        k = taper / a
        lx, ly, lz = qx + k * ex, qy + k * ey, qz + k * ez
        near, t, family, slope = _highest(
            terrain, i0, j0, cx + ex, cy + ey, cz + ez, lx, ly, lz, low, high, math.inf if found else gap
        )
        if family < 0:
            break
        if family == 0:
            sx, sy = (lz - ly * slope) / lx, slope
        else:
            sx, sy = slope, (lz - lx * slope) / ly
        nz = 1.0 / math.sqrt(1.0 + sx * sx + sy * sy)
        if nz < LEAST_UPWARD:
            break
        found, place, gap, slope_x, slope_y = True, t, near, sx, sy
        ox, oy, oz = ex, ey, ez
        if gap > REFINED * a:
            break
        # once more, with the lowest line as this crest has it
        nx, ny = -sx * nz, -sy * nz
        nd = nx * qx + ny * qy + nz * qz
        ex, ey, ez = nd * qx - nx, nd * qy - ny, nd * qz - nz
        scale = a / math.sqrt(ex * ex + ey * ey + ez * ez)
        ex, ey, ez = scale * ex, scale * ey, scale * ez
    k = 1.0 + place * taper / a
    return found, place, k * ox, k * oy, k * oz, gap, slope_x, slope_y
