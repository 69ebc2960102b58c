"""Two correlated sizes drawn for each of many items: normal, and drawn again if impossible.

For `generate_forest` (DBH and height) and `release_logs` (DBH and length).
"""

from __future__ import annotations

import numpy as np

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.stats import draws

TURNS = 100  # of drawing a size; if more are needed, the unit is wrong


def draw_pair(
    mean: tuple[float | np.ndarray, float | np.ndarray],
    sd: tuple[float | np.ndarray, float | np.ndarray],
    correlation: float | np.ndarray,
    least: tuple[float, float],
    seed: int,
    items: np.ndarray,
    stream: int,
    complaint: str,
) -> tuple[np.ndarray, np.ndarray, int]:
    """Two sizes of each item, to 0.01, and how many draws were below ``least`` and repeated.

    Means, standard deviations and correlation are numbers, or arrays with one per item. The sizes of an item
    depend on the seed and its id alone. ``complaint`` is the error message if hardly any draw is possible.
    """
    means, sds = (
        (np.broadcast_to(each, items.shape) for each in mean),
        (np.broadcast_to(each, items.shape) for each in sd),
    )
    (mean_1, mean_2), (sd_1, sd_2) = means, sds
    rho = np.broadcast_to(correlation, items.shape)
    one, other = np.empty(items.size), np.empty(items.size)
    left, redrawn = np.arange(items.size), 0
    for turn in range(TURNS):
        first, second = draws.normals(seed, items[left], stream, turn)
        mixed = rho[left] * first + np.sqrt(1 - rho[left] ** 2) * second
        one[left] = np.round(mean_1[left] + sd_1[left] * first, 2)
        other[left] = np.round(mean_2[left] + sd_2[left] * mixed, 2)
        left = left[(one[left] < least[0]) | (other[left] < least[1])]
        if not left.size:
            return one, other, redrawn
        redrawn += left.size
    raise UserError(complaint)
