"""The terrain: one bilinear surface through the DEM's heights at cell centres.

Between four cell centres the height is h = h00 + ... bilinear, its gradient follows analytically, and a contact's
normal is that of the surface at the contact point. Nothing is triangulated (a diagonal breaks mirror symmetry) and
nothing is smoothed (the kinks between cells dissipate energy, and the calibrated friction counts on that).

Each log computes in a frame of its own: origin at the DEM node (row j0, column i0) below its release, heights
relative to a reference. So a log's numbers do not depend on where on Earth, or where in the DEM, the slope lies.

symbol  in code     unit  frame
h       height      m     above the reference
hx, hy  slope_x,_y  -     gradient, x east, y north
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .compiled import kernel
from .limits import LID_REACH, LID_SLACK


class Terrain(NamedTuple):
    """Heights as the kernels read them.

    heights : [m] above ``reference``, shape (rows, columns) float32, row 0 southernmost, NaN outside
    roughness : [m], same shape; how far the 3 x 3 cells around a cell rise above its tangent plane, at most
    lids : float32, shape (blocks north, blocks east, 4); over each block of ``lid_cells`` cells a plane (normal x, y,
        z; distance from the block's south-west node) that no terrain in the 3 x 3 blocks around it rises above
    lid_cells : cells along a block's side; inverse_block : [1/m] one over that side
    friction : Coulomb's coefficient [-], shape (1, 1) when it is the same everywhere, else the shape of heights
    cell, inverse_cell : cell size [m] and one over it
    x0, y0 : world position of the centre of cell (0, 0) of the whole DEM [m]
    column, row : of the whole DEM, where heights[0, 0] stands; the heights may be a window of it
    reference : [m] height that is zero in the kernels
    """

    heights: np.ndarray
    roughness: np.ndarray
    lids: np.ndarray
    lid_cells: int
    inverse_block: float
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
    """Check the terrain and lay it out for the kernels.

    ``first`` is the column and row of heights[0, 0] in the whole DEM, whose cell (0, 0) is at x0, y0. With the same
    ``reference`` [m] a window gives the same bits as the whole; without, it is taken from the lowest height.

    Raises
    ------
    ValueError
        when the grid is smaller than 2 x 2, holds no valid cell, or friction is negative, of another shape, or missing
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
    mu = np.atleast_2d(np.asarray(friction, dtype=np.float32 if np.ndim(friction) else np.float64)).astype(np.float64)
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
    roughness = np.zeros_like(relative)
    roughness_of(relative, roughness)
    lid_cells = max(1, math.ceil(LID_REACH / cell - 1e-9))
    lids = np.zeros((-(-relative.shape[0] // lid_cells), -(-relative.shape[1] // lid_cells), 4), np.float32)
    lids_of(relative, float(cell), lid_cells, lids)
    return Terrain(
        relative, roughness, lids, lid_cells, 1.0 / (lid_cells * float(cell)), mu,
        float(cell), 1.0 / float(cell), float(x0), float(y0), *first, reference,
    )  # fmt: skip


@kernel
def surface(terrain, i0, j0, x, y):
    """Height and gradient of the bilinear surface at a place in the frame of node (j0, i0); NaN outside."""
    return bilinear(terrain.heights, terrain.inverse_cell, i0, j0, x, y)


@kernel
def bilinear(heights, inverse_cell, i0, j0, x, y):
    """``surface``, for kernels that are not inlined: a terrain's forty words on the stack cost as much as the look."""
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
    """Coulomb's coefficient of the DEM cell that holds the place (nearest cell centre)."""
    friction = terrain.friction
    if friction.shape[0] == 1:
        return friction[0, 0]
    i = min(max(i0 + int(np.floor(x * terrain.inverse_cell + 0.5)), 0), friction.shape[1] - 1)
    j = min(max(j0 + int(np.floor(y * terrain.inverse_cell + 0.5)), 0), friction.shape[0] - 1)
    return friction[j, i]


@kernel
def lid_distance(terrain, i0, j0, x, y, z, dx, dy, dz):
    """How far [m] a place in the frame of node (j0, i0) is above its block's lid, and the cosine between the lid's
    normal and a direction d; -inf where no lid holds."""
    lids, block = terrain.lids, terrain.lid_cells * terrain.cell
    x += i0 * terrain.cell
    y += j0 * terrain.cell
    i, j = np.floor(x * terrain.inverse_block), np.floor(y * terrain.inverse_block)
    bi, bj = int(i), int(j)
    if bi < 0 or bj < 0 or bi >= lids.shape[1] or bj >= lids.shape[0]:
        return -math.inf, 0.0
    lid = lids[bj, bi]
    above = lid[0] * (x - i * block) + lid[1] * (y - j * block) + lid[2] * z - lid[3]
    return above, lid[0] * dx + lid[1] * dy + lid[2] * dz


@kernel
def lids_of(heights, cell, blocks, lids):
    """Planes above the terrain, one a block: fitted to the nodes of the 3 x 3 blocks around, and lifted over them all.

    A bilinear patch minus a plane has its maximum at a node, so the nodes are a bound for every point. Where a window
    holds no terrain somewhere, or reaches over the grid's edge, there is no lid.
    """
    rows, columns = heights.shape
    for bj in range(lids.shape[0]):
        for bi in range(lids.shape[1]):
            i0, j0 = (bi - 1) * blocks, (bj - 1) * blocks
            span = 3 * blocks
            lids[bj, bi, 0], lids[bj, bi, 1], lids[bj, bi, 2], lids[bj, bi, 3] = 0.0, 0.0, 0.0, math.inf
            if i0 < 0 or j0 < 0 or i0 + span >= columns or j0 + span >= rows:
                continue
            mean = sx = sy = 0.0
            for j in range(j0, j0 + span + 1):
                for i in range(i0, i0 + span + 1):
                    h = np.float64(heights[j, i])
                    mean += h
                    sx += h * (i - i0 - 0.5 * span)
                    sy += h * (j - j0 - 0.5 * span)
            if mean != mean:
                continue
            number = span + 1.0
            spread = number * number * (number * number - 1.0) / 12.0  # sum of squares of the offsets
            mean /= number * number
            gx, gy = sx / spread, sy / spread
            rise = 0.0
            for j in range(j0, j0 + span + 1):
                for i in range(i0, i0 + span + 1):
                    over = np.float64(heights[j, i]) - mean - gx * (i - i0 - 0.5 * span) - gy * (j - j0 - 0.5 * span)
                    rise = max(rise, over)
            # height of the lid above the block's own first node, half a block short of the window's middle
            height = mean - 0.5 * blocks * (gx + gy) + rise
            gx, gy = gx / cell, gy / cell
            nz = 1.0 / math.sqrt(1.0 + gx * gx + gy * gy)
            lids[bj, bi, 0], lids[bj, bi, 1], lids[bj, bi, 2] = -gx * nz, -gy * nz, nz
            lids[bj, bi, 3] = height * nz + LID_SLACK


@kernel
def roughness_of(heights, rise):
    """How far the nodes of the 3 x 3 cells around each cell rise above the tangent planes of the cell's own points.

    The rise of a node over the tangent plane at (u, v) is bilinear in (u, v), so its maximum lies at a corner of the
    cell; and a bilinear patch minus a plane has its maximum at a node. Sixteen nodes at four corners are therefore
    a bound for every point, not a sample. Outside the DEM is no terrain, so nothing rises there.
    """
    rows, columns = heights.shape
    for j in range(rows - 1):
        for i in range(columns - 1):
            h00 = np.float64(heights[j, i])
            bx = np.float64(heights[j, i + 1]) - h00
            by = np.float64(heights[j + 1, i]) - h00
            twist = np.float64(heights[j + 1, i + 1]) - h00 - bx - by
            if twist != twist:
                continue
            worst = 0.0
            for dj in range(-1, 3):
                for di in range(-1, 3):
                    if not (0 <= j + dj < rows and 0 <= i + di < columns):
                        continue
                    node = np.float64(heights[j + dj, i + di]) - h00
                    for corner in range(4):
                        cu = float(corner % 2)
                        cv = float(corner // 2)
                        plane = bx * cu + by * cv + twist * cu * cv
                        plane += (bx + twist * cv) * (di - cu) + (by + twist * cu) * (dj - cv)
                        if node - plane > worst:  # a NaN node compares false
                            worst = node - plane
            rise[j, i] = worst
