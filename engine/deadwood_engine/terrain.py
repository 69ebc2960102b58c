"""The terrain: one bilinear surface through the DEM's heights at cell centres.

Between four cell centres the height is h = h00 + ... bilinear, its gradient follows analytically, and the normal of a
contact is that of the surface at the contact point. The surface is not triangulated (a diagonal breaks mirror symmetry)
and not smoothed (the edges between cells dissipate energy, and the calibrated friction includes that).

Each log is computed in a local frame: origin at the DEM node (row j0, column i0) below its release, heights
relative to a reference. The numbers of a log therefore do not depend on where on Earth, or where in the DEM, the slope
is.

symbol  in code     unit  frame
h       height      m     above the reference
hx, hy  slope_x,_y  -     gradient, x east, y north
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .compiled import kernel
from .limits import KINK_CELLS, KINK_REACH, WHOLE

# [-] unit of a kink; number of units that no longer fits half a word (a wall of half a kilometre beside a cell of 0.5
# m)
KINK, HALF_WORD = 1.0 / 64.0, 65536.0


class Terrain(NamedTuple):
    """Heights as the kernels read them.

    heights : [m] above ``reference``, shape (rows, columns) float32, row 0 southernmost, NaN outside
    kinks : uint32, same shape; by how much the slope may increase around a cell (``kinks_of``), x and y packed
    kink_reach : [m] radius for which it is valid
    friction : Coulomb's coefficient [-], shape (1, 1) if it is the same everywhere, else the shape of heights
    cell, inverse_cell : cell size [m] and one over it
    x0, y0 : world position of the centre of cell (0, 0) of the whole DEM [m]
    column, row : of heights[0, 0] in the whole DEM; the heights may be a window of it
    reference : [m] height that is zero in the kernels
    """

    heights: np.ndarray
    kinks: np.ndarray
    kink_reach: float
    friction: np.ndarray
    cell: float
    inverse_cell: float
    x0: float
    y0: float
    column: int
    row: int
    reference: float


def prepare(
    heights: np.ndarray,
    cell: float,
    x0: float,
    y0: float,
    friction: float | np.ndarray,
    first: tuple[int, int] = (0, 0),
    reference: float | None = None,
) -> Terrain:
    """Check the terrain and prepare its arrays for the kernels.

    ``first`` is the column and row of heights[0, 0] in the whole DEM, whose cell (0, 0) is at x0, y0. With the same
    ``reference`` [m] a window gives the same bits as the whole; without one, it follows from the lowest height.

    Raises
    ------
    ValueError
        if the grid is smaller than 2 x 2, has no valid cell, or friction is negative, of another shape, or missing
        where there is terrain
    """
    heights = np.asarray(heights)
    if heights.ndim != 2 or min(heights.shape) < 2:
        raise ValueError(f"a terrain needs at least 2 x 2 heights, not {heights.shape}")
    if not np.isfinite(heights).any():
        raise ValueError("the terrain holds no valid height")
    if not (math.isfinite(cell) and cell > 0):
        raise ValueError(f"the cell size must be positive, not {cell}")
    if not (math.isfinite(x0) and math.isfinite(y0)):
        raise ValueError(f"the terrain's corner must be a place, not {x0}, {y0}")
    mu = np.atleast_2d(np.array(friction, dtype=np.float64, order="C"))
    if mu.shape != (1, 1) and mu.shape != heights.shape:
        raise ValueError(f"friction has shape {mu.shape}, the terrain {heights.shape}")
    if np.any(mu < 0):
        raise ValueError("friction must not be negative")
    if not np.all(np.isfinite(mu) | ~np.isfinite(heights)):
        raise ValueError("friction must be a number wherever there is terrain")
    # A multiple of 64 m, so that neighbouring windows of one DEM share it and float32 keeps tenths of a millimetre.
    if reference is None:
        lowest = float(np.min(heights, where=np.isfinite(heights), initial=np.inf))
        reference = 64.0 * math.floor(lowest / 64.0)
    relative = np.ascontiguousarray(heights - reference, dtype=np.float32)
    relative[~np.isfinite(relative)] = np.nan
    around = min(max(1, math.ceil(KINK_REACH / cell - WHOLE)), KINK_CELLS)
    kinks = np.zeros(relative.shape, np.uint32)
    kinks_of(relative, float(cell), around, kinks)
    return Terrain(
        relative,
        kinks,
        around * float(cell),
        mu,
        float(cell),
        1.0 / float(cell),
        float(x0),
        float(y0),
        *first,
        reference,
    )


@kernel
def surface(terrain, i0, j0, x, y):
    """Eq. [b]: height and gradient of the bilinear surface at a place in the frame of node (j0, i0); NaN outside."""
    return bilinear(terrain.heights, terrain.inverse_cell, i0, j0, x, y)


@kernel
def bilinear(heights, inverse_cell, i0, j0, x, y):
    """``surface``, for kernels that are not inlined: passing a terrain's forty words on the stack costs as much as the
    lookup.
    """
    u = x * inverse_cell
    v = y * inverse_cell
    iu = np.floor(u)
    jv = np.floor(v)
    i = i0 + int(iu)
    j = j0 + int(jv)
    if i < 0 or j < 0 or i >= heights.shape[1] - 1 or j >= heights.shape[0] - 1:
        return math.nan, 0.0, 0.0
    fu = u - iu
    fv = v - jv
    # float() of a float32 stays float32 in Numba, and differences of heights would lose seven digits
    h00 = np.float64(heights[j, i])
    h10 = np.float64(heights[j, i + 1])
    h01 = np.float64(heights[j + 1, i])
    h11 = np.float64(heights[j + 1, i + 1])
    bx = h10 - h00
    by = h01 - h00
    twist = h11 - h10 - by
    gx = bx + twist * fv
    gy = by + twist * fu
    return h00 + bx * fu + gy * fv, gx * inverse_cell, gy * inverse_cell


@kernel
def surfaces(terrain, x, y, found):
    """``surface`` at many places in the frame of the whole DEM's node (0, 0); found has shape (n, 3)."""
    for k in range(x.shape[0]):
        found[k, 0], found[k, 1], found[k, 2] = surface(terrain, -terrain.column, -terrain.row, x[k], y[k])


def surfaces_at(terrain: Terrain, plan: np.ndarray) -> np.ndarray:
    """Height [m above reference, NaN outside] and gradient at places (n, 2) from the whole DEM's first node."""
    found = np.empty((len(plan), 3))
    surfaces(terrain, np.ascontiguousarray(plan[:, 0], float), np.ascontiguousarray(plan[:, 1], float), found)
    return found


@kernel
def friction_at(terrain, i0, j0, x, y):
    """Coulomb's coefficient of the DEM cell that contains the place (nearest cell centre)."""
    friction = terrain.friction
    if friction.shape[0] == 1:
        return friction[0, 0]
    i = min(max(i0 + int(np.floor(x * terrain.inverse_cell + 0.5)), 0), friction.shape[1] - 1)
    j = min(max(j0 + int(np.floor(y * terrain.inverse_cell + 0.5)), 0), friction.shape[0] - 1)
    return friction[j, i]


@kernel
def kinks_of(heights, cell, around, kinks):
    """By how much the slope may increase, seen from any point of a cell, on the way to any point within ``around``
    cells of it: in units of KINK, rounded up, for displacements along x (the lower half of a word) and y (the upper).

    Along a straight displacement (dx, dy) the ground thus rises by at most kx |dx| + ky |dy| above the tangent plane of
    its starting point. The slopes along x that a displacement eastwards can meet are those between nodes of the same
    columns and of those to the east, and within a cell a slope is between those of its two sides: a bound for every
    point, not a sample. Ground that falls away, as beyond a crest, does not count. Outside the DEM nothing rises.
    """
    rows, columns = heights.shape
    unit = KINK * cell
    for j in range(rows - 1):
        for i in range(columns - 1):
            sx, tx = (
                np.float64(heights[j, i + 1]) - heights[j, i],
                np.float64(heights[j + 1, i + 1]) - heights[j + 1, i],
            )
            sy, ty = (
                np.float64(heights[j + 1, i]) - heights[j, i],
                np.float64(heights[j + 1, i + 1]) - heights[j, i + 1],
            )
            if sx + tx != sx + tx:
                continue
            least_x, most_x, least_y, most_y = min(sx, tx), max(sx, tx), min(sy, ty), max(sy, ty)
            kx = ky = 0.0
            for b in range(max(0, j - around), min(rows - 1, j + around + 1) + 1):
                for a in range(max(0, i - around), min(columns - 2, i + around) + 1):
                    rise = np.float64(heights[b, a + 1]) - heights[b, a]  # a NaN compares false below
                    if a >= i and rise - least_x > kx:
                        kx = rise - least_x
                    if a <= i and most_x - rise > kx:
                        kx = most_x - rise
            for b in range(max(0, j - around), min(rows - 2, j + around) + 1):
                for a in range(max(0, i - around), min(columns - 1, i + around + 1) + 1):
                    rise = np.float64(heights[b + 1, a]) - heights[b, a]
                    if b >= j and rise - least_y > ky:
                        ky = rise - least_y
                    if b <= j and most_y - rise > ky:
                        ky = most_y - rise
            kx, ky = min(np.ceil(kx / unit), HALF_WORD - 1.0), min(np.ceil(ky / unit), HALF_WORD - 1.0)
            kinks[j, i] = np.uint32(ky * HALF_WORD + kx)
