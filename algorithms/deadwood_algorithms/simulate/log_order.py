"""The order of logs by a hash of the run's seed and each log's id: by which a part of the logs is drawn.

The first n logs of this order are a random sample of all, whatever the order of the layer, and they are the same
logs when others are appended or when n grows. The hash shares nothing with the draws that placed the logs
(``draws``, another generator), so the sample does not favour a place.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def hash_order(log_id: NDArray[np.int64], seed: int) -> NDArray[np.int64]:
    """Rows of the logs by the hash of seed and log_id; the same logs in the same order, whatever rows they are in."""
    return np.argsort(mix(log_id.astype(np.uint64) ^ mix(np.array([seed], np.uint64))), kind="stable")


def keep_by_hash(log_id: NDArray[np.int64], count: int | None, seed: int) -> NDArray[np.bool_]:
    """The first ``count`` logs of the order, as a mask over the rows; None: all logs."""
    keep = np.zeros(log_id.size, bool)
    keep[hash_order(log_id, seed)[:count]] = True
    return keep


def mix(value: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The splitmix64 step: a bijection of 64-bit numbers whose output looks random."""
    value = value + np.uint64(0x9E3779B97F4A7C15)
    value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return value ^ (value >> np.uint64(31))
