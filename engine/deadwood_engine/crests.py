"""Crests: where the side of a log touches terrain that consists of bilinear cells.

The lateral surface of a cone is straight along its axis and cells are almost straight along a line, so between its ends
a log touches the terrain where its lowest generator crosses the grid lines of the DEM, as a plank touches stairs at
their edges. The normal there is perpendicular to the generator and to the grid line, both of which are known; the
slopes of the cells on either side do not matter. With those slopes as normals and rings at fixed places, rings act like
the teeth of a gear: each drops between two crests and strikes the flank of the next. Measured (slow logs on a rough
slope, two seconds): a log moved less the denser its rings, by 2 % for each halving of their distance, without limit.

A twisted cell may be highest along the log between its grid lines: there the log touches along the tangent of the
ground.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .compiled import inlined
from .limits import ALONG_GRID, BESIDE_CREST, CREST, LEAST_UPWARD, REFINED, SAME_CELL, WALL
from .terrain import bilinear


class Nodes(NamedTuple):
    """The heights of the DEM's nodes, in a log's frame."""

    heights: np.ndarray
    cell: float  # [m]
    inverse_cell: float
    i0: int  # column and row of the frame's node
    j0: int


@inlined
def height_at(nodes, x, y):
    """Eq. [b]: height and gradient of the ground, as ``terrain.surface``."""
    return bilinear(nodes.heights, nodes.inverse_cell, nodes.i0, nodes.j0, x, y)


@inlined
def along_side(nodes, p, slope, d, side, reach):
    """Eq. [j]: slope of the plane that touches the side of a cone with axis d, on ground of this slope at p.

    p : (x, y, height of the ground) [m]; side : radius there [m], and by how much it grows per metre of axis [-]

    Ground that falls away from its own tangent within the reach [m] along the axis is the flank of a crest, which the
    side touches: only the component of its gradient across the axis is kept. Other ground, and walls, keep their
    gradient.
    """
    (px, py, height), (gx, gy), (dx, dy, dz), (a, taper) = p, slope, d, side
    nz = 1.0 / math.sqrt(1.0 + gx * gx + gy * gy)
    along = nz * (dz - gx * dx - gy * dy)
    turn = taper * math.sqrt(max(0.0, 1.0 - along * along)) - along
    upward = nz + turn * dz
    if abs(along) > WALL or upward < LEAST_UPWARD:
        return gx, gy
    rise = reach * (gx * dx + gy * dy)
    ahead, _, _ = height_at(nodes, px + reach * dx, py + reach * dy)
    behind, _, _ = height_at(nodes, px - reach * dx, py - reach * dy)
    if ahead < height + rise - CREST * a or behind < height - rise - CREST * a:
        return (gx * nz - turn * dx) / upward, (gy * nz - turn * dy) / upward
    return gx, gy


APEX = 2  # in place of a grid line's family: between grid lines, where a twisted cell is highest along the log


class Generator(NamedTuple):
    """A straight line p + t l [m] on the side of a log, and the part of it, t in [low, high], that is looked at."""

    p: tuple[float, float, float]
    along: tuple[float, float, float]
    low: float
    high: float


@inlined
def _crossing(nodes, line, inverse, way, number):
    """Where the line p + t l crosses a grid line: (vertical gap there [m], t, slope along the grid line).

    inverse : [-] one over the component of l across these grid lines; way : 0 grid lines north-south, 1 east-west
    number : of the grid line, its column or row from the node (j0, i0). Outside the DEM the gap is infinite.
    """
    heights, cell, inverse_cell, i0, j0 = nodes
    (px, py, pz), (lx, ly, lz), _, _ = line
    p, q, across = (px, py, ly) if way == 0 else (py, px, lx)
    t = (number * cell - p) * inverse
    place = (q + t * across) * inverse_cell
    node = np.floor(place)
    i, j = (i0 + number, j0 + int(node)) if way == 0 else (i0 + int(node), j0 + number)
    rows, columns = heights.shape
    last_i, last_j = (columns - 1, rows - 2) if way == 0 else (columns - 2, rows - 1)
    if i < 0 or j < 0 or i > last_i or j > last_j:
        return math.inf, t, 0.0
    # between its nodes a grid line is straight
    height = np.float64(heights[j, i])
    rise = np.float64(heights[j + 1, i] if way == 0 else heights[j, i + 1]) - height
    return pz + t * lz - height - rise * (place - node), t, rise * inverse_cell


@inlined
def _highest_of(nodes, line, way, highest):
    """The highest crossing so far, and those with the grid lines of one family (``way``): as ``_highest``."""
    gap, best, slope, family, number = highest
    p, along = (line.p[0], line.along[0]) if way == 0 else (line.p[1], line.along[1])
    if abs(along) >= ALONG_GRID:  # otherwise it would not tell in which direction the crest is touched
        inverse = 1.0 / along
        u, v = (p + line.low * along) * nodes.inverse_cell, (p + line.high * along) * nodes.inverse_cell
        for k in range(int(math.ceil(min(u, v))), int(np.floor(max(u, v))) + 1):
            here, t, rise = _crossing(nodes, line, inverse, way, k)
            if here < gap:
                gap, best, slope, family, number = here, t, rise, way, k
    return gap, best, slope, family, number


@inlined
def _highest(nodes, line, gap):
    """Of a line's crossings with grid lines, the one with the least height above ground, if below ``gap`` [m].

    Returns (gap, t, slope along the grid line, its family as in ``_crossing``, -1 for none, and its number). If the
    line continues to approach the ground on one side, the family is APEX if it touches the twisted cell there, and none
    if it touches farther along, as on a plane.
    """
    # each family separately, because the compiler then knows which it is (three quarters of the time)
    none = (gap, 0.0, 0.0, -1, 0)
    first = _highest_of(nodes, line, 0, none)
    gap, best, slope, family, number = _highest_of(nodes, line, 1, first)
    if family >= 0:
        heights, cell, inverse_cell, i0, j0 = nodes
        (px, py, pz), (lx, ly, lz), low, high = line
        for side in range(2):
            ahead = (BESIDE_CREST if side == 0 else -BESIDE_CREST) * cell
            t = best + ahead
            height, gx, gy = bilinear(heights, inverse_cell, i0, j0, px + t * lx, py + t * ly)
            beside = pz + t * lz - height
            if beside < gap:
                # within a cell the gap is a parabola in t
                rate = lz - gx * lx - gy * ly
                bend = (gap - beside + rate * ahead) / (ahead * ahead)
                t -= 0.5 * rate / bend
                beside -= 0.25 * rate * rate / bend
                height, _, _ = bilinear(heights, inverse_cell, i0, j0, px + t * lx, py + t * ly)
                # the lowest point is in another cell, or there is none
                if not (bend > 0.0 and low <= t <= high and abs(pz + t * lz - height - beside) < SAME_CELL * cell):
                    return gap, best, slope, -1, number
                return beside, t, 0.0, APEX, 0
    return gap, best, slope, family, number


@inlined
def _plane_through(lx, ly, lz, family, slope):
    """Slope (x, y) of the plane that contains a generator l and a grid line of this slope; too steep, if so."""
    sx, sy = ((lz - ly * slope) / lx, slope) if family == 0 else (slope, (lz - lx * slope) / ly)
    return sx, sy, (1.0 + sx * sx + sy * sy) * LEAST_UPWARD * LEAST_UPWARD > 1.0


@inlined
def crest(nodes, c, q, e, side, stretch, gap):
    """The crest under the stretch (low, high) [m] of a log's side along its axis q, from the ring with centre c [j].

    e : [m] from the axis to the lowest point of the ring, perpendicular to the axis
    side : radius of the ring [m], the length of e; and by how much it grows per metre of axis [-]
    gap : [m] vertical, of the ring's own point

    Returns (found, t, e, gap, slope): whether a crest rises above the ring's own point; its position along the axis
    [m]; from the axis to the point there, its vertical gap [m] and the slope (x, y) of the plane that touches log and
    crest.
    """
    (cx, cy, cz), (qx, qy, qz), (ex, ey, ez), (a, taper), (low, high) = c, q, e, side, stretch
    k = taper / a
    lx, ly, lz = qx + k * ex, qy + k * ey, qz + k * ez
    most = min(gap - CREST * a, REFINED * a)  # a higher one is not a contact, even after refinement
    lowest = Generator((cx + ex, cy + ey, cz + ez), (lx, ly, lz), low, high)
    gap, t, slope, family, number = _highest(nodes, lowest, most)
    if family < 0:
        return False, 0.0, ex, ey, ez, gap, 0.0, 0.0
    if family == APEX:
        k = 1.0 + t * taper / a
        _, sx, sy = height_at(nodes, cx + ex + t * lx, cy + ey + t * ly)
        return True, t, k * ex, k * ey, k * ez, gap, sx, sy
    sx, sy, steep = _plane_through(lx, ly, lz, family, slope)
    if steep:
        return False, 0.0, ex, ey, ez, gap, 0.0, 0.0
    # once more, with the generator that is lowest at this crest
    nd = qz - sx * qx - sy * qy  # times n_z, like the rest
    ox, oy, oz = nd * qx + sx, nd * qy + sy, nd * qz - 1.0
    scale = a / math.sqrt(ox * ox + oy * oy + oz * oz)
    ox, oy, oz = scale * ox, scale * oy, scale * oz
    lx, ly, lz = qx + k * ox, qy + k * oy, qz + k * oz
    along = lx if family == 0 else ly
    if abs(along) >= ALONG_GRID:
        other = Generator((cx + ox, cy + oy, cz + oz), (lx, ly, lz), low, high)
        near, place, slope = _crossing(nodes, other, 1.0 / along, family, number)
        if low <= place <= high and near < gap:
            nx, ny, steep = _plane_through(lx, ly, lz, family, slope)
            if not steep:
                ex, ey, ez, t, gap, sx, sy = ox, oy, oz, place, near, nx, ny
    k = 1.0 + t * taper / a
    return True, t, k * ex, k * ey, k * ez, gap, sx, sy
