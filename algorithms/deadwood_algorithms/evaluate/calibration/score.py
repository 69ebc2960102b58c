"""How well friction coefficients reproduce an observed event: likelihoods from simulated logs, and tests of them.

An event consists of outcomes of single logs: where a log came to rest (a point), or whether it behaved as observed
(came to rest within an area, reached one line and not another). The same logs are slid with every coefficient, so any
difference is due to the coefficient.

Likelihood. A point y has the density of the simulated deposits x_j, observed with an error s in both directions due to
mapping and to what the model does not represent: (sum_j N(y; x_j, s^2) + 1/2 / A) / (n + 1). A yes or no has the share
of the logs that behave so: (k + 1/2) / (n + 1) for k of n. The half a log, which for points is spread evenly over the
ground A on which any log came to rest with any coefficient, prevents a coefficient from being ruled out by too few
logs. Outcomes multiply.

Logs without a deposit on the terrain model (they left it, failed, or were still moving at the time limit) are treated
in one of two ways, depending on what is known of the event:

- deposits were found here, and the number of logs that moved on is unknown. Each deposit then is one of the logs at
rest on
  the terrain model, and n counts only these: its conditional density is (sum_j N(y; x_j, s^2) + 1/2 / A) / (n + 1/2)
  over the n logs at rest. The share of logs that leaves is evidence neither for nor against a coefficient; a
  coefficient with which no simulated log stays cannot have caused a deposit here, and has no likelihood;
- the search was complete: all logs of the event were found. Logs that left then remain in n, and in the simulated
events they
  are an outcome with the share of such logs, (k + 1/2) / (n + 1). A coefficient with which many logs leave must then
  explain why none of the observed ones did.

Range. A coefficient is in the range unless the event is less likely with it, relative to the best coefficient, than 95
% of events simulated with that coefficient and the same number of logs: log j in place of an observed one (of those at
rest on the terrain model, if only such were found), its deposit shifted by a drawn error, its own share removed from
all densities. Whatever the true coefficient is, the range contains it in 95 % of events, for one observed log as for
many (Feldman & Cousins 1998), whereas the usual limit of 1.92 on the log-likelihood requires many. A range that
contains every coefficient means that the event is not informative.

Fit. The best coefficient is the best even if none is good. The likelihood of the event with a coefficient is therefore
also compared with that of events simulated with it, independently of the other coefficients.

Energy score. For points also the mean of E|X - y| - E|X - X'| / 2 [m] (Gneiting & Raftery 2007): the distance of the
simulated deposits from the observed one, minus half their own spread. Lower is better; the true coefficient minimises
it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.stats.draws import EVENT_ERROR, EVENT_LOG, normals, uniforms
from deadwood_algorithms.stats.resampling import resamples

Array = NDArray[np.float64]
EVENTS = 400  # simulated with each coefficient: a p-value of 0.05 is then known to +-0.011
LEVEL = 0.05
PAIRS_AT_ONCE = 4_000_000  # of simulated deposits and logs: 32 MB
SCORED_LOGS = 1000  # for the scatter of the energy score, whose pairs grow with the square
TIE = 1e-9


@dataclass(frozen=True)
class Observation:
    """One observed outcome, and what each simulated log did, with every coefficient.

    logs : rows of the logs that it may have been, shape (m,)
    place : observed deposit [m], or None for a yes or no
    x, y : simulated deposits [m], shape (coefficients, m); NaN where a log came to no rest on the DEM
    done : whether each simulated log did what was observed, shape (coefficients, m), for a yes or no
    yes : whether it was observed
    area : of the ground on which any log came to rest [m2]
    found : which simulated logs came to rest on the DEM, shape (coefficients, m), if the outcome is known to be of
        such a log; None if it may be of any log
    """

    logs: NDArray[np.int64]
    place: tuple[float, float] | None = None
    x: Array | None = None
    y: Array | None = None
    done: NDArray[np.bool_] | None = None
    yes: bool = True
    area: float = math.inf
    found: NDArray[np.bool_] | None = None

    @property
    def counts(self) -> NDArray[np.int64]:
        """Number of logs from which an outcome may be drawn, with each coefficient, shape (c,)."""
        if self.found is not None:
            return self.found.sum(axis=1)
        every = self.done if self.done is not None else self.x
        assert every is not None  # a point
        return np.full(len(every), self.logs.size)

    @property
    def left_over(self) -> float:
        """What the extra half log adds to n: the half itself, plus another half if logs may be lost."""
        return 1.0 if self.found is None else 0.5


@dataclass(frozen=True)
class Scores:
    """By coefficient, shape (c,).

    log_likelihood : of the event; low, high : its 95 % range under other draws of the same number of logs, relative to
    the best
    p_range : share of simulated events that are no more likely, relative to their best, than the observed one; 0 where
    the event is impossible
    p_fit : the same for the likelihood itself
    """

    log_likelihood: Array
    low: Array
    high: Array
    p_range: Array
    p_fit: Array

    @property
    def relative(self) -> Array:
        """Likelihood as a share of the best; 0 where there is none."""
        top = self.log_likelihood.max()
        return np.exp(self.log_likelihood - top) if math.isfinite(top) else np.zeros(self.log_likelihood.size)

    @property
    def within(self) -> NDArray[np.bool_]:
        return self.p_range >= LEVEL


def score(
    outcomes: list[Observation], log_id: NDArray[np.int64], error: float, seed: int, report: Callable[[float], None]
) -> Scores:
    """Score every coefficient; ``log_id`` is by row of the logs, ``error`` [m] is that of observed places."""
    observed = np.stack([log_densities(each, each.place, error) for each in outcomes])
    total = observed.sum(axis=0)
    low, high = sampling_interval(outcomes, log_id, error, seed)
    ranges, fits = np.zeros(total.size), np.zeros(total.size)
    for k in np.flatnonzero(np.isfinite(total)).tolist():  # with the others, the event is impossible
        report(k / total.size)
        parts = [made_densities(each, k, number, log_id, error, seed) for number, each in enumerate(outcomes)]
        made = np.sum(parts, axis=0)
        ranges[k] = share_below(relative_to_best(made, k), relative_to_best(total[None], k)[0])
        fits[k] = share_below(made[:, k], total[k])
    return Scores(total, low, high, ranges, fits)


def relative_to_best(log_likelihood: Array, k: int) -> Array:
    """Log-likelihood of coefficient k relative to the best, for each event; -inf where it has no likelihood."""
    best = log_likelihood.max(axis=1)
    own = log_likelihood[:, k]
    return np.where(np.isfinite(own), own - np.where(np.isfinite(best), best, 0.0), -np.inf)


def share_below(made: Array, seen: float) -> float:
    """Share of the simulated events that are no better than the observed one, which is included in the count."""
    return float((1 + np.count_nonzero(made <= seen + TIE)) / (made.size + 1))


def log_densities(outcome: Observation, place: tuple[float, float] | None, error: float) -> Array:
    """Log-likelihood of one observed outcome with each coefficient, shape (c,)."""
    if outcome.done is not None:
        found = log_share(outcome.done.sum(axis=1), outcome.counts, outcome.yes)
    else:
        assert place is not None  # a point
        kernels = log_kernels(outcome, np.array([place]), error)[:, 0]
        found = log_density(kernels, outcome.counts, outcome.area, outcome.left_over)
    return np.where(outcome.counts > 0, found, -np.inf)


def log_share(hits: NDArray, n: NDArray, yes: bool) -> Array:
    share = (hits + 0.5) / (n + 1.0)
    return np.log(share if yes else 1.0 - share)


def log_kernels(outcome: Observation, places: Array, error: float) -> Array:
    """Log of N(place; deposit, error^2) for places (k, 2), shape (c, k, m); -inf for logs without a deposit."""
    assert outcome.x is not None  # a point
    assert outcome.y is not None
    square = (outcome.x[:, None] - places[None, :, :1]) ** 2 + (outcome.y[:, None] - places[None, :, 1:]) ** 2
    return np.where(np.isnan(square), -np.inf, -square / (2.0 * error**2) - math.log(2.0 * math.pi * error**2))


def log_density(kernels: Array, n: NDArray, area: float, left_over: float) -> Array:
    """Log of the density from the kernels of n logs and half a log; ``kernels`` are logarithms along the last axis."""
    top = kernels.max(axis=-1, keepdims=True)
    top = np.where(np.isfinite(top), top, 0.0)
    with np.errstate(divide="ignore"):
        total = np.log(np.exp(kernels - top).sum(axis=-1)) + top[..., 0]
    return np.logaddexp(total, math.log(0.5) - math.log(area)) - np.log(n + left_over)


def made_densities(
    outcome: Observation, k: int, number: int, log_id: NDArray[np.int64], error: float, seed: int
) -> Array:
    """Log-likelihoods, shape (events, c), of outcomes simulated with coefficient k, each without the log it came from.

    The draws depend on the event and the outcome only: at every coefficient the same logs represent the observed ones.
    """
    item = np.arange(EVENTS) * 1024 + number
    order = np.argsort(log_id[outcome.logs], kind="stable")  # the same log, whatever its row
    if outcome.found is not None:
        order = order[outcome.found[k, order]]
    if not order.size:
        return np.full((EVENTS, outcome.counts.size), -np.inf)
    chosen = order[(uniforms(seed, item, EVENT_LOG)[0] * order.size).astype(np.int64)]
    own_found = np.ones((EVENTS, 1), np.int64) if outcome.found is None else outcome.found[:, chosen].T
    others = outcome.counts - own_found  # (events, c)
    out = np.where(outcome.counts > 0, 0.0, -np.inf) + np.zeros((EVENTS, 1))
    if outcome.done is not None:
        own = outcome.done[:, chosen].T  # (events, c)
        hits = outcome.done.sum(axis=1) - own
        seen = own[:, k]
        return out + np.where(seen[:, None], log_share(hits, others, True), log_share(hits, others, False))
    assert outcome.x is not None  # a point
    assert outcome.y is not None
    shift = error * np.stack(normals(seed, item, EVENT_ERROR), axis=1)
    places = np.stack([outcome.x[k, chosen], outcome.y[k, chosen]], axis=1) + shift
    step = max(1, PAIRS_AT_ONCE // max(1, outcome.x.size))
    for start in range(0, EVENTS, step):
        part = slice(start, min(EVENTS, start + step))
        kernels = log_kernels(outcome, places[part], error)
        rows = np.arange(part.stop - part.start)
        kernels[:, rows, chosen[part]] = -np.inf  # its own place would predict it too well
        out[part] += log_density(kernels, others[part].T, outcome.area, outcome.left_over).T
    if outcome.found is not None:
        return out
    # A log without a deposit is not a deposit elsewhere, and is not replaced by another log: it is a separate outcome.
    lost = np.isnan(outcome.x)
    gone = chosen[lost[k, chosen]]
    out[lost[k, chosen]] = log_share(lost.sum(axis=1) - lost[:, gone].T, others[0], True)
    return out


def sampling_interval(
    outcomes: list[Observation], log_id: NDArray[np.int64], error: float, seed: int
) -> tuple[Array, Array]:
    """95 % bootstrap interval of the log-likelihood relative to the best, over the logs, the same draws for all."""
    weights = np.array(list(resamples(log_id, seed)), np.float64)  # (resamples, n)
    total: Array = np.zeros(1)
    for each in outcomes:
        mine = weights[:, each.logs]
        count = mine.sum(axis=1)[:, None] if each.found is None else mine @ each.found.T.astype(float)
        none = np.where(each.counts > 0, 0.0, -np.inf)
        if each.done is not None:
            share = (mine @ each.done.T.astype(float) + 0.5) / (count + 1.0)
            total = total + np.log(share if each.yes else 1.0 - share) + none
            continue
        kernels = log_kernels(each, np.array([each.place]), error)[:, 0]  # (c, m)
        top = kernels.max(axis=1)
        top = np.where(np.isfinite(top), top, 0.0)
        with np.errstate(divide="ignore"):
            sums = np.log(mine @ np.exp(kernels - top[:, None]).T) + top
        half = math.log(0.5) - math.log(each.area)
        total = total + np.logaddexp(sums, half) - np.log(count + each.left_over) + none
    best = total.max(axis=1, keepdims=True)
    relative = np.where(np.isfinite(total), total - np.where(np.isfinite(best), best, 0.0), -np.inf)
    low, high = np.quantile(relative, [0.025, 0.975], axis=0, method="nearest")
    return low, high


def energy_score(outcome: Observation, place: tuple[float, float]) -> Array:
    """Energy score of simulated deposits against an observed place, by coefficient [m]; NaN without deposits."""
    assert outcome.x is not None  # a point
    assert outcome.y is not None
    out = np.full(outcome.x.shape[0], np.nan)
    for k in range(out.size):
        x, y = (each[k][np.isfinite(each[k])][:SCORED_LOGS] for each in (outcome.x, outcome.y))
        if x.size > 1:
            scatter = np.hypot(x[:, None] - x, y[:, None] - y).sum() / (x.size * (x.size - 1))
            out[k] = np.hypot(x - place[0], y - place[1]).mean() - 0.5 * scatter
    return out


@dataclass(frozen=True)
class Range:
    """The coefficients that reproduce the event; low or high is open where the sweep ended before they did."""

    low: float
    high: float
    best: float
    open_low: bool
    open_high: bool
    gaps: bool  # some between low and high do not
    one: bool = False  # only one does, so how far the range extends towards its neighbours is not known

    def ends(self) -> tuple[str, str]:
        """Both in three digits, or in as many as a narrow range needs."""
        digits = next((n for n in (3, 4, 5) if f"{self.low:.{n}g}" != f"{self.high:.{n}g}"), 6)
        return f"{self.low:.{digits}g}", f"{self.high:.{digits}g}"

    def words(self) -> str:
        text = " to ".join(self.ends())
        if self.open_low or self.open_high:
            ends = " and ".join(
                word for word, is_open in (("below", self.open_low), ("above", self.open_high)) if is_open
            )
            text += f" (perhaps {ends}: the sweep ends there)"
        return text


def range_of(friction: Array, scores: Scores) -> Range | None:
    """From the first coefficient that reproduces the event to the last; ends between two coefficients lie where the
    p-values cross 0.05.
    """
    inside = np.flatnonzero(scores.within)
    if not inside.size:
        return None
    first, last = int(inside[0]), int(inside[-1])

    def crossing(within: int, beyond: int) -> float:
        p, q = scores.p_range[[within, beyond]]
        return float(friction[within] + (p - LEVEL) / (p - q) * (friction[beyond] - friction[within]))

    return Range(
        low=float(friction[first]) if first == 0 else crossing(first, first - 1),
        high=float(friction[last]) if last == friction.size - 1 else crossing(last, last + 1),
        best=float(friction[int(np.argmax(scores.log_likelihood))]),
        open_low=first == 0,
        open_high=last == friction.size - 1,
        gaps=bool((~scores.within[first : last + 1]).any()),
        one=first == last and 0 < first < friction.size - 1,
    )
