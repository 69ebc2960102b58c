"""The one sentence: the most influential input, or that this many logs do not decide it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.sensitivity.indices import Indices
from deadwood_algorithms.evaluate.sensitivity.tornado import Bar
from deadwood_algorithms.stats.statistics import (
    decimals_of,
    percent,
    percent_with_interval,
    points_with_interval,
    reach_record,
)

SURE = 0.95


@dataclass(frozen=True)
class Measured:
    """What is known of one outcome: its bars, and its indices where a design was run.

    name : ``reach_LINE`` or ``runout_mean_m``; line : the line's id, empty for the run-out
    """

    name: str
    line: str
    bars: list[Bar]
    indices: Indices | None

    @property
    def is_share(self) -> bool:
        return self.name != "runout_mean_m"

    @property
    def words(self) -> str:
        return f"the reach of {self.line}" if self.is_share else "the mean run-out"

    @property
    def by_index(self) -> bool:
        """Whether factors are ranked by their total-effect index, rather than by their effect alone."""
        return self.indices is not None and bool(np.isfinite(self.indices.total).all())

    @property
    def strongest_first(self) -> list[int]:
        """The factors sorted by total index if there is one, otherwise by swing."""
        if self.indices is not None and self.by_index:
            strength = self.indices.total
        else:
            strength = np.array([abs(bar.swing) for bar in self.bars])
        return [int(k) for k in np.argsort(-strength, kind="stable")]

    def as_it_is(self, logs: int) -> str:
        """The outcome with nothing varied; a share has its interval for this number of logs."""
        base = self.bars[0].base
        if self.is_share:
            return percent_with_interval(reach_record(round(base * logs), logs))
        return self.level(base, self.bars[0])

    def change(self, bar: Bar) -> str:
        """``-12 points (-15 to -9)``, or in metres."""
        if self.is_share:
            text = points_with_interval(bar.swing, bar.ci_low, bar.ci_high)
            number, space, rest = text.partition(" ")
            return f"{number} points{space}{rest}"
        if not bar.n_changed:
            return "0 m (no log changes)"
        decimals = decimals_of(bar.ci_low, bar.ci_high)
        swing, low, high = (f"{each:+.{decimals}f}" for each in (bar.swing, bar.ci_low, bar.ci_high))
        return f"{swing} m ({low} to {high})"

    def level(self, value: float, bar: Bar) -> str:
        """An outcome's value, rounded as the interval of the bar justifies."""
        if self.is_share:
            return f"{percent(value, bar.ci_low, bar.ci_high)} %"
        return f"{value:.{decimals_of(bar.ci_low, bar.ci_high)}f} m"


@dataclass(frozen=True)
class Answer:
    """Which factors an outcome depends on, the strongest first; empty if none is beyond chance.

    decided : whether the first one is the strongest in enough resamples; by : ``total`` index or ``swing``
    """

    outcome: str
    by: str
    factors: list[str]
    decided: bool
    sentence: str


def most_influential(measured: Measured, logs: int) -> Answer:
    bars, indices = measured.bars, measured.indices
    by_index = measured.by_index
    if indices is not None and by_index:
        draws, beyond = indices.total_draws, indices.total_interval[0] > 0.0
    else:
        draws = np.abs(np.stack([bar.draws for bar in bars], 1))
        beyond = np.array([bar.beyond_chance for bar in bars])
    by = "total" if by_index else "swing"
    order = measured.strongest_first
    found = [k for k in order if beyond[k]]
    if not found:
        return Answer(measured.name, by, [], False, _undecided(measured, logs))
    first = order_of_strength(found, draws)
    names = [bars[k].factor.name for k in first]
    if len(first) == 1:
        bar = bars[first[0]]
        low, high = measured.level(bar.at_low, bar), measured.level(bar.at_high, bar)
        text = (
            f"The most influential input is {bar.factor.words}: {bar.factor.range_words} takes {measured.words} from "
            f"{low} to {high}, {measured.change(bar)}"
        )
        if indices is not None and by_index:
            text += f"; its total-effect index is {indices.total_words(first[0])}"
        return Answer(measured.name, by, names, True, text + ".")
    several = " or ".join(f"{bars[k].factor.words} ({bars[k].factor.range_words})" for k in first)
    effects = "; ".join(f"{bars[k].factor.words} {measured.change(bars[k])}" for k in first)
    rows = " and rows of the design" if by_index else ""
    text = (
        f"The most influential input is {several}: the number of logs{rows} ({logs}) is too small to decide which of "
        f"them changes {measured.words} more: {effects}."
    )
    return Answer(measured.name, by, names, False, text)


def order_of_strength(found: list[int], draws: NDArray[np.float64]) -> list[int]:
    """The fewest factors, the strongest first, of which one is the strongest in `SURE` of the resamples."""
    usable = draws[np.isfinite(draws).all(axis=1)][:, found]
    if not len(usable):
        return found
    # If two are equal in a resample, the one listed first counts as the strongest
    share = np.bincount(np.argmax(usable, axis=1), minlength=len(found)) / len(usable)
    kept = int(np.searchsorted(np.cumsum(share), SURE - 1e-12)) + 1
    return found[:kept]


def _undecided(measured: Measured, logs: int) -> str:
    """No index is beyond chance, or no change; a factor alone may change the outcome beyond chance all the same."""
    bar = max(measured.bars, key=lambda each: abs(each.swing))
    runs = " and rows of the design" if measured.indices is not None else ""
    largest = f"The largest change is that of {bar.factor.words}"
    if measured.by_index and bar.beyond_chance:
        why, largest = "total-effect index is beyond chance", f"{largest} alone, which is beyond chance"
    else:
        why = "factor changes it beyond chance"
    return (
        f"The number of logs{runs} ({logs}) is too small to decide which input influences {measured.words} most: no "
        f"{why}. {largest}, {measured.change(bar)}."
    )
