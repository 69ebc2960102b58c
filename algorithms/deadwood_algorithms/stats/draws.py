"""Random draws that depend on an item, not on the order in which items are drawn.

Philox4x32-10 (Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2, 3") is a function of (seed, item, stream,
turn) without any state: item k draws the same numbers alone or among a million, in any order, chunk or thread. It is
written out here because one numpy generator per item takes 20 microseconds, and a forest has many trees.
"""

from __future__ import annotations

import numpy as np

# Streams of draws. Each is independent, so that log 7 and tree 7 with the same seed have nothing in common.
LOG_PLACE, TREE_PLACE, TREE_SIZE, TREE_SOURCE = range(4)
LOG_CELL, LOG_SIZE, LOG_DENSITY, LOG_ROW, LOG_AXIS = range(16, 21)
STEM_THROWN, STEM_FALL, STEM_LOST = range(32, 35)
# For designs of runs: order and position of a Latin hypercube's rows, and the noise on a terrain model
LATIN_ORDER, LATIN_PLACE, HEIGHT_NOISE = range(48, 51)
# For the evaluating tools, separate from those for the placing of objects.
BOOTSTRAP, HALVES, EVENT_LOG, EVENT_ERROR, ROW_DRAW = range(64, 69)
# Of dead trees: the numbers of their processes, the storms, what becomes of each, and the weights of its slides
PROCESS, STORM_YEAR, STEM_FATE, STEM_REST, FALL_WAY, BREAK_HEIGHT, SLIDE_WEIGHT, PRIOR_WEIGHT, SLID_TREE = range(80, 89)

_LOW = np.uint64(0xFFFFFFFF)
_SHIFT = np.uint64(32)
_MULTIPLIERS = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_WEYL = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_ROUNDS = 10


def philox(counter: np.ndarray, key: tuple[int, int]) -> np.ndarray:
    """Philox4x32-10 of counters, uint64 array of 32-bit words, shape (4, n); same shape out."""
    c0, c1, c2, c3 = counter
    k0, k1 = np.uint64(key[0]), np.uint64(key[1])
    for _ in range(_ROUNDS):
        product0, product1 = _MULTIPLIERS[0] * c0, _MULTIPLIERS[1] * c2
        c0, c1 = (product1 >> _SHIFT) ^ c1 ^ k0, product1 & _LOW
        c2, c3 = (product0 >> _SHIFT) ^ c3 ^ k1, product0 & _LOW
        k0, k1 = np.uint64((int(k0) + int(_WEYL[0])) & 0xFFFFFFFF), np.uint64((int(k1) + int(_WEYL[1])) & 0xFFFFFFFF)
    return np.stack((c0, c1, c2, c3))


def uniforms(seed: int, items: np.ndarray, stream: int, turn: int | np.ndarray = 0) -> tuple[np.ndarray, np.ndarray]:
    """Two draws in [0, 1), 53 bits each, for every item (whole numbers >= 0); another turn gives two others."""
    items = np.asarray(items, np.uint64)
    counter = np.empty((4, items.size), np.uint64)
    counter[0], counter[1] = items & _LOW, items >> _SHIFT
    counter[2], counter[3] = turn, stream
    words = philox(counter, (seed & 0xFFFFFFFF, seed >> 32))
    high, low = words[::2] >> np.uint64(5), words[1::2] >> np.uint64(6)
    pair = (high * 67108864.0 + low) / 9007199254740992.0  # 2^26 and 2^53
    return pair[0], pair[1]


def normals(seed: int, items: np.ndarray, stream: int, turn: int | np.ndarray = 0) -> tuple[np.ndarray, np.ndarray]:
    """Two independent standard normal draws for every item (Box and Muller)."""
    u, v = uniforms(seed, items, stream, turn)
    radius = np.sqrt(-2.0 * np.log1p(-u))
    return radius * np.cos(2 * np.pi * v), radius * np.sin(2 * np.pi * v)
