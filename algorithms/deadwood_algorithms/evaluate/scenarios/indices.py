"""The indices of a protection forest that are used in practice, for each line: BARI, MIRI and ORPI.

After Dupire et al. (2016), "Novel quantitative indicators to characterize the protective effect of mountain forests
against rockfall", with logs for rocks, the baseline for the slope without forest, and energies at the line:

    BARI = 1 - N / N0            N  logs that reach the line, N0 of the baseline
    MIRI = 1 - E95 / E95_0       E95  95 % quantile of the energies of those that reach it
    ORPI = 1 - S / S0            S  sum of the energies of all that reach it

1 is full protection, 0 none; below 0 it is worse than in the baseline. The same logs slide in both, so intervals
come from a bootstrap that draws the same logs in both.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.stats.order_statistics import LEAST_OF_A_RATIO, values_needed
from deadwood_algorithms.stats.resampling import resamples
from deadwood_algorithms.stats.statistics import paired_interval, wilson_interval

Array = NDArray[np.float64]
INDICES = ("bari", "miri", "orpi")
TAIL = 0.95
ENDS = (0.025, 0.975)
# Arrivals from which an index is shown: in the baseline, for MIRI and ORPI in each of the two scenarios
LEAST_ARRIVALS = {"bari": LEAST_OF_A_RATIO, "miri": values_needed(TAIL), "orpi": LEAST_OF_A_RATIO}


def barrier_index(before: NDArray[np.bool_], now: NDArray[np.bool_], times: NDArray[np.int64] | None = None) -> float:
    """BARI with these weights of the logs; NaN if no log reaches the line in the baseline."""
    n0, n = (float(np.dot(_times(each, times), each)) for each in (before, now))
    return 1.0 - n / n0 if n0 else math.nan


def intensity_index(before: Array, now: Array, times: NDArray[np.int64] | None = None) -> float:
    """MIRI from energies (NaN for a log that does not reach); NaN if none reaches in either scenario."""
    tails = []
    for each in (before, now):
        arrived = np.isfinite(each)
        values = np.repeat(each[arrived], _times(each, times)[arrived])
        tails.append(float(np.quantile(values, TAIL)) if values.size else math.nan)
    return 1.0 - tails[1] / tails[0] if tails[0] else math.nan


def overall_index(before: Array, now: Array, times: NDArray[np.int64] | None = None) -> float:
    """ORPI from energies (NaN for a log that does not reach)."""
    sums = [float(np.dot(_times(each, times), np.nan_to_num(each))) for each in (before, now)]
    return 1.0 - sums[1] / sums[0] if sums[0] else math.nan


def _times(values: NDArray, times: NDArray[np.int64] | None) -> NDArray[np.int64]:
    return np.ones(values.size, np.int64) if times is None else times


def reach_index(
    before: NDArray[np.bool_], now: NDArray[np.bool_], log_id: NDArray[np.int64], seed: int
) -> tuple[float, float, float]:
    """BARI with its interval; NaN from too few arrivals in the baseline.

    If no log changed, a bootstrap has no width; the interval is then that of the paired difference, divided by the
    share of the baseline. If no log reaches the line in the scenario, none does in any resample; the lower end is then
    that of the rarest arrivals which the number of logs cannot exclude, against the fewest of the baseline.
    """
    value = barrier_index(before, now)
    if before.sum() < LEAST_ARRIVALS["bari"]:
        return math.nan, math.nan, math.nan
    if not now.any():
        low = 1.0 - wilson_interval(0, now.size)[1] / wilson_interval(int(before.sum()), before.size)[0]
        return value, low, 1.0
    if np.array_equal(before, now):
        low, high = paired_interval(0, 0, now.size)
        return value, -high / before.mean(), min(-low / before.mean(), 1.0)
    return value, *_interval(barrier_index(before, now, times) for times in resamples(log_id, seed))


def energy_indices(
    before: Array, now: Array, log_id: NDArray[np.int64], seed: int
) -> dict[str, tuple[float, float, float]]:
    """MIRI and ORPI with their intervals; NaN where too few logs arrive in either scenario."""
    arrivals = min(np.isfinite(each).sum() for each in (before, now))
    found = {}
    for name, index in (("miri", intensity_index), ("orpi", overall_index)):
        found[name] = math.nan, math.nan, math.nan
        if arrivals >= LEAST_ARRIVALS[name]:
            ends = _interval(index(before, now, times) for times in resamples(log_id, seed))
            found[name] = (index(before, now), *ends)
    return found


def _interval(values: Iterable[float]) -> tuple[float, float]:
    """95 % percentile interval of the resamples that have a value."""
    known = np.array([each for each in values if math.isfinite(each)])
    if not known.size:
        return math.nan, math.nan
    low, high = np.quantile(known, ENDS)
    return float(low), float(high)
