"""Errors of a terrain model as a random surface: normal, with mean 0 and standard deviation 1, correlated over a
distance.

Two places d apart have the correlation exp(-(d / length)^2). The surface is a sum of Gaussian bells at the nodes of a
lattice; the height of each depends on its node's number only. So a window of a terrain model gets the same error as
the whole, bit for bit, whatever has been read.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.stats.draws import HEIGHT_NOISE, normals

Array = NDArray[np.float64]
# With nodes one standard deviation of the bell apart, variance and correlation are exact to 1e-4 (tested).
BELLS = 5  # nodes to each side; beyond them a bell is below 4e-6 of its maximum
SIDE = 2**26  # nodes in a row of the lattice, more than any terrain model needs


def error_surface(
    shape: tuple[int, int], first: tuple[int, int], cell: float, length: float, seed: int, number: int
) -> Array:
    """Heights [-] of a surface on the cells of a window, shape (rows, columns).

    Parameters
    ----------
    first : column and row of the whole terrain model where the window begins
    cell, length : side of a cell, distance over which errors are alike [m]
    number : which of the surfaces of this seed
    """
    step = 0.5 * length / cell  # cells between nodes, which is the bell's deviation
    row_node, row_weight = _bells(np.arange(shape[0]) + first[1], step)
    column_node, column_weight = _bells(np.arange(shape[1]) + first[0], step)
    south, west = row_node.min(), column_node.min()
    rows, columns = (int(np.ptp(each)) + 2 * BELLS + 2 for each in (row_node, column_node))
    i, j = np.arange(rows)[:, None] + south, np.arange(columns)[None, :] + west
    nodes = (i * SIDE + j).ravel()
    heights = normals(seed, nodes, HEIGHT_NOISE, number)[0].reshape(rows, columns)
    # Summed bell by bell, because the order of summation of a matrix product would depend on the window.
    lines = np.zeros((shape[0], columns))
    for k in range(2 * BELLS + 2):
        lines += row_weight[k][:, None] * heights[row_node - south + k]
    out = np.zeros(shape)
    for k in range(2 * BELLS + 2):
        out += column_weight[k][None, :] * lines[:, column_node - west + k]
    return out


def _bells(cells: NDArray[np.int64], step: float) -> tuple[NDArray[np.int64], Array]:
    """For each cell of an axis its first node, and the weights of this and the next nodes, whose squares add up to
    1.
    """
    at = cells / step
    node = np.floor(at).astype(np.int64)
    weights = np.array([np.exp(-0.5 * (at - (node - BELLS + k)) ** 2) for k in range(2 * BELLS + 2)])
    # One by one, to give the same bits in any window
    total = np.zeros(cells.size)
    for each in weights:
        total += each * each
    return node, weights / np.sqrt(total)
