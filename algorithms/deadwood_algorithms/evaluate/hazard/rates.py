"""How often something is reached: rates of independent release areas with intervals, return periods, classes.

An area releases ``events_per_year`` times a year, each time so many logs, which go their ways independently. The rate
of a place is the sum, over the areas, of events a year times the probability that an event reaches it. Its interval is
put together from the areas' Wilson intervals by the method of variance estimates recovery (Zou and Donner 2008,
"Construction of confidence limits about effect measures"): of one area it is Wilson's interval itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from deadwood_algorithms.stats.statistics import wilson_bounds

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ReleaseArea:
    """How often logs start there, and how many of the run did."""

    release_id: Any
    events_per_year: float
    n_logs: int


def reached_by_event(p: ArrayLike, logs: int) -> Array:
    """Probability that at least one of so many logs reaches, each with probability p."""
    p = np.asarray(p, np.float64)
    return p if logs == 1 else 1.0 - (1.0 - p) ** logs


def rate_with_interval(
    hits: Iterable[NDArray[Any]], areas: Sequence[ReleaseArea], logs_per_event: int
) -> tuple[Array, Array, Array]:
    """Events a year that reach, and the ends of its 95 % interval, from the hits of each area's logs."""
    rate: Any = 0.0
    below: Any = 0.0
    above: Any = 0.0
    for count, area in zip(hits, areas, strict=True):
        p = np.asarray(count, np.float64) / max(area.n_logs, 1)
        ends = wilson_bounds(count, area.n_logs)
        value, low, high = (reached_by_event(each, logs_per_event) for each in (p, *ends))
        rate = rate + area.events_per_year * value
        below = below + (area.events_per_year * (value - low)) ** 2
        above = above + (area.events_per_year * (high - value)) ** 2
    rate = np.asarray(rate, np.float64)
    return rate, np.maximum(rate - np.sqrt(below), 0.0), rate + np.sqrt(above)


def return_period(rate: ArrayLike) -> Array:
    """Mean time between events [years]; NaN where there are none."""
    rate = np.asarray(rate, np.float64)
    return np.divide(1.0, rate, out=np.full(rate.shape, np.nan), where=rate > 0.0)


def pooled(areas: Sequence[ReleaseArea], logs_per_event: int) -> list[ReleaseArea] | None:
    """All areas as one, where that says the same: each log then stands for as many events a year.

    None where it does not: a log of one area is rarer than one of another, or several go in one event.
    """
    if len(areas) == 1:
        return list(areas)
    each = np.array([area.events_per_year / max(area.n_logs, 1) for area in areas])
    if logs_per_event > 1 or np.ptp(each) > 1e-9 * each.max(initial=0.0):
        return None
    events, logs = sum(area.events_per_year for area in areas), sum(area.n_logs for area in areas)
    return [ReleaseArea("all", events, logs)]


def rising_class(values: ArrayLike, bounds: Sequence[float]) -> NDArray[np.uint8]:
    """Class from 1, with its lower bound in it; 0 where there is no value."""
    values = np.asarray(values, np.float64)
    found = np.searchsorted(np.asarray(bounds), values, side="right") + 1
    return np.where(np.isfinite(values), found, 0).astype(np.uint8)


def period_class(years: ArrayLike, bounds: Sequence[float]) -> NDArray[np.uint8]:
    """Class from 1, the shortest, with its upper bound in it; 0 where nothing reaches."""
    years = np.asarray(years, np.float64)
    found = np.searchsorted(np.asarray(bounds), years, side="left") + 1
    return np.where(np.isfinite(years), found, 0).astype(np.uint8)
