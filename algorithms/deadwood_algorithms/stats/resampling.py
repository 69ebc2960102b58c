"""Bootstrap intervals whose draws depend on the logs' ids: the same for any order of rows, and paired between runs.

Instead of drawing n of n logs again, each log of a resample counts as often as a Poisson number of mean 1 that is drawn
from the seed, its log_id and the number of the resample (Hanley & MacGibbon 2006, "Creating non-parametric bootstrap
samples using Poisson frequencies"). For more than a few dozen logs the intervals are those of the usual bootstrap.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.stats.draws import BOOTSTRAP, HALVES, uniforms

RESAMPLES = 400  # each end of a 95 % interval is then based on 10 resamples
# P(N <= k) of a Poisson number of mean 1, k = 0, 1, ...; beyond the last one, a number is never drawn with 53 bits
_CUMULATIVE = np.cumsum([math.exp(-1.0) / math.factorial(k) for k in range(19)])


def resamples(log_id: NDArray[np.int64], seed: int, count: int = RESAMPLES) -> Iterator[NDArray[np.int64]]:
    """How often each log counts in each resample; shape (n,)."""
    for turn in range((count + 1) // 2):
        for draws in uniforms(seed, log_id, BOOTSTRAP, turn)[: count - 2 * turn]:
            yield np.searchsorted(_CUMULATIVE, draws, side="right")


def halves(log_id: NDArray[np.int64], seed: int, count: int) -> Iterator[NDArray[np.bool_]]:
    """Random halves of the logs, by a coin toss that depends on the log; shape (n,)."""
    for turn in range(count):
        yield uniforms(seed, log_id, HALVES, turn)[0] < 0.5
