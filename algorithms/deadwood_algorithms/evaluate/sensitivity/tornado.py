"""What each factor alone does between the ends of its range, over the same logs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.sensitivity.factors import Factor
from deadwood_algorithms.stats.statistics import paired_interval

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Bar:
    """A factor's effect on one outcome; swing: the value at the high end minus that at the low end, with its paired 95
    % interval.

    draws : the swing in each resample of the logs
    """

    factor: Factor
    base: float
    at_low: float
    at_high: float
    swing: float
    ci_low: float
    ci_high: float
    n_changed: int
    draws: Array

    @property
    def beyond_chance(self) -> bool:
        """Whether the interval excludes zero."""
        return self.ci_low > 0.0 or self.ci_high < 0.0


def bars_of(factors: list[Factor], values: Array, weights: Array, *, share: bool) -> list[Bar]:
    """One bar for each factor, in the order of the factors.

    Parameters
    ----------
    values : shape (1 + 2 factors, logs), of the runs of `places_at_ends`; 0 or 1 for a share
    weights : shape (logs, resamples)
    share : whether the outcome is a share, whose interval is Tango's; that of a mean is by bootstrap over the logs
    """
    bars = []
    logs = values.shape[1]
    for k, factor in enumerate(factors):
        low, high = values[1 + 2 * k], values[2 + 2 * k]
        change = high - low
        draws = change @ weights / weights.sum(axis=0)
        if share:
            ends = paired_interval(int((change < 0.0).sum()), int((change > 0.0).sum()), logs)
        else:
            ends = tuple(float(each) for each in np.quantile(draws, [0.025, 0.975]))
        bars.append(
            Bar(
                factor=factor,
                base=float(values[0].mean()),
                at_low=float(low.mean()),
                at_high=float(high.mean()),
                swing=float(change.mean()),
                ci_low=ends[0],
                ci_high=ends[1],
                n_changed=int((change != 0.0).sum()),
                draws=draws,
            )
        )
    return bars
