"""`--fidelity auto`: which fidelity, and how many logs, keep a promised error at the least cost, decided on this slope.

The error is the distance of every line's reach from what `reference` would give (``promise``). What is known of each
fidelity's calculation without a pilot: `reference` is off by nothing, by definition; others by a bound that the caller
takes for granted (``assumed``). The cheapest of these that can keep the promise is the *judge*: if nothing better is
found, it makes the run. The first 200 logs of the draw slide at the judge, and at each cheaper fidelity that could
save a tenth if not one log ended differently there. After 200, 400, 800, ... such pairs it is looked at: with what it
is apart from the judge at most, how many logs would it need, and what would that cost; and what if more pairs were slid
first? The pilot ends as soon as nothing that is open promises to be cheaper than the judge, or one is decided on. It
wastes little, for its logs are the first of the run, whichever fidelity makes it.

Pairs cost what the judge costs, and both the pairs for a bound b and the logs for a sampling error s grow with the
inverse square. So whether a pilot pays does not depend on the error that is asked for, but on r, the share of logs that
end differently at the two fidelities over p (1 - p), and on the ratio of costs q: even with the best split it cannot
where sqrt(r) + sqrt(q) > 1. Among trees and bumps r is 0.5 to 1 (benchmarks), and the judge is taken at the first look.

With a budget of time instead, all is the same but the goal: the least error that can be had in the time that is left.
There costs are seconds. With an error to keep, they are counted in steps and contacts, so that every machine, every
number of threads and every resumed run decides alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.fidelity.promise import (
    PILOT_RISK,
    RISK,
    logs_for,
    pairs_bound,
    sampling_of,
    sigma_for,
    sigma_of,
    together_of,
)
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.simulate.fidelity_trade import COSTS
from deadwood_algorithms.simulate.queue import z_of_looks
from deadwood_algorithms.stats.statistics import Z_95

FIRST_LOOK, LOOKS = 200, 6  # of the pilot, each at twice the logs of the one before
LEAST = 50  # logs that any promise takes
PROBE = 32  # logs that tell how long one takes
WORTH = 0.9  # of what the judge would cost, or err by: a pilot that could not do better than this is not begun
MORE = 100  # of the logs that have slid, the least part that is added where they turn out to be too few
MOST_REPEATS = 50  # of the run's end, where the share turned out to need more logs than planned


@dataclass(frozen=True)
class Slid:
    """The first logs of the draw at one fidelity: whether each reached each line (n, lines), and what a log costs."""

    reach: NDArray[np.bool_]
    cost: float

    @property
    def shares(self) -> list[float]:
        return self.reach.mean(axis=0).tolist()


Slide = Callable[[str, int], Slid]  # slides so many logs of the draw at a fidelity, or takes those that were


@dataclass(frozen=True)
class Option:
    """A fidelity that could make the run: by how much its calculation is off at most, by line.

    measured : by pairs with this fidelity; None where the bounds are assumed
    """

    fidelity: str
    bounds: Sequence[float]
    measured: str | None = None

    @property
    def risk(self) -> float:
        """What is left of the promise's risk for sampling."""
        return RISK - PILOT_RISK if self.measured else RISK


@dataclass(frozen=True)
class Chosen:
    """The choice, carried out: the run is the first ``logs`` of the draw at the fidelity of ``option``."""

    option: Option
    logs: int
    why: str
    record: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Error:
    """What is asked for: an error of every line's reach, at the least cost."""

    error: float
    cap: int

    def logs(self, option: Option, shares: Sequence[float]) -> int | None:
        """Logs with which sampling and calculation together come to the error; None where there are not so many."""
        return needed(self.error, option, shares, self.cap)

    def value(self, option: Option, shares: Sequence[float], done: int, rate: float, more: float = 0.0) -> float:
        """Cost until the error is kept: ``more``, and the logs beyond those that are done."""
        logs = self.logs(option, shares)
        return math.inf if logs is None else more + max(0, logs - done) * rate


@dataclass(frozen=True)
class Budget:
    """What is asked for: the least error that can be had in the time that is left."""

    left: Callable[[], float]  # seconds
    cap: int

    def logs(self, done: int, rate: float, more: float = 0.0) -> int:
        """Logs that will have slid in the end, where ``more`` seconds go elsewhere."""
        return min(self.cap, done + max(0, int((self.left() - more) / rate)))

    def value(self, option: Option, shares: Sequence[float], done: int, rate: float, more: float = 0.0) -> float:
        """Error of the line that is farthest off at the end."""
        return math.inf if more > self.left() else worst_of(option, shares, self.logs(done, rate, more))


def keep_error(
    error: float, cap: int, line_ids: Sequence[Any], slide: Slide, assumed: Mapping[str, float], many: str = "the layer"
) -> Chosen:
    """Slide what keeps the promise, and say what was chosen and why.

    Parameters
    ----------
    error : of every line's reach, as a share
    cap : all logs of the draw
    assumed : bounds on the error of calculation that are taken for granted; that of `reference` is 0
    many : what has ``cap`` logs, for messages

    Raises
    ------
    UserError
        where not even all logs can keep it; says what they can
    """
    trusted = trusted_of(assumed, len(line_ids))
    judge = _cheapest(error, trusted, [0.5] * len(line_ids), 2**40)
    assert judge is not None
    half = (needed(error, judge, [0.5] * len(line_ids), 2**40) or 0) // 2
    known = slide(judge.fidelity, min(cap, FIRST_LOOK, max(LEAST, half)))
    again = _cheapest(error, trusted, known.shares, cap)
    if again is None:
        raise UserError(_too_small(error, trusted, known.shares, cap, many))
    if again.fidelity != judge.fidelity:
        judge, known = again, slide(again.fidelity, len(known.reach))
    goal = Error(error, cap)
    option, why, looks = _pilot(goal, judge, known, slide)
    logs = _run(goal, option, slide, max([len(known.reach), *(look["n_pairs"] for look in looks)]))
    record = record_of(option, slide(option.fidelity, logs).reach, line_ids, why, looks, cap)
    kept = record["together"] <= error * (1.0 + 1e-9)
    return Chosen(option, logs, why, {**record, "error": error, "reached": kept})


def trusted_of(assumed: Mapping[str, float], lines: int) -> list[Option]:
    """What needs no pilot; `reference` is the last."""
    return [Option(name, [bound] * lines) for name, bound in {**assumed, "reference": 0.0}.items()]


def _cheapest(error: float, options: Sequence[Option], shares: Sequence[float], cap: int) -> Option | None:
    """The option that is likely to keep the error at the least cost; None where none can with so many logs."""
    costs = {
        option.fidelity: logs * COSTS[option.fidelity]
        for option in options
        if (logs := needed(error, option, shares, cap)) is not None
    }
    return min((each for each in options if each.fidelity in costs), key=lambda o: costs[o.fidelity], default=None)


def needed(error: float, option: Option, shares: Sequence[float], cap: int) -> int | None:
    """Logs with which sampling and calculation together come to the error, for every line; None where too many."""
    found = 1
    for bound, share in zip(option.bounds, shares, strict=True):
        logs = logs_for(sigma_for(error, bound, option.risk), share, cap)
        if logs is None:
            return None
        found = max(found, logs)
    return found


def worst_of(option: Option, shares: Sequence[float], n: int) -> float:
    """Both errors together after ``n`` logs, of the line that is farthest off."""
    pairs = zip(option.bounds, shares, strict=True)
    return max(together_of(bound, sigma_of(share, n), option.risk) for bound, share in pairs)


def _pilot(goal: Error | Budget, judge: Option, known: Slid, slide: Slide) -> tuple[Option, str, list[dict[str, Any]]]:
    """Look for a fidelity that serves the goal better than the judge; the option that is to make the run, why, and
    what was seen."""
    names = list(COSTS)
    race = names[: names.index(judge.fidelity)]
    z = z_of_looks(LOOKS, 1.0 - PILOT_RISK / max(1, len(race)))
    looks: list[dict[str, Any]] = []
    most = min(goal.cap, FIRST_LOOK * 2 ** (LOOKS - 1))
    race = [name for name in race if _is_worth(goal, name, judge, known, most, z)]
    for m in (FIRST_LOOK * 2**k for k in range(LOOKS)):
        if m > most or not race or _is_done(goal, judge, known, m):
            break
        known = slide(judge.fidelity, m)
        others = {name: slide(name, m) for name in race}
        rest = goal.value(judge, known.shares, m, known.cost)
        race, decided = [], []
        for name, ours in others.items():
            pairs = _Pairs.of(known.reach, ours.reach)
            now = Option(name, _added(judge.bounds, pairs.bounds(m, z)), judge.fidelity)
            values = [goal.value(now, ours.shares, m, ours.cost)]
            later = m * 2
            while later <= most:
                then = Option(name, _added(judge.bounds, pairs.hoped(later, z)), judge.fidelity)
                more = (later - m) * (known.cost + ours.cost)
                values.append(goal.value(then, ours.shares, later, ours.cost, more))
                later *= 2
            best = min(values)
            looks.append(
                {
                    "fidelity": name,
                    "against": judge.fidelity,
                    "n_pairs": m,
                    "differ": max(pairs.differ),
                    "calculation": max(now.bounds),
                }
            )
            if best < rest:
                race.append(name)
                if values[0] == best:
                    decided.append((best, now))
        if race and len(decided) == len(race):
            option = min(decided, key=lambda each: each[0])[1]
            return option, _why_cheaper(option, m), looks
    return judge, _why_judge(judge, looks), looks


def spend_budget(
    left: Callable[[], float],
    cap: int,
    line_ids: Sequence[Any],
    slide: Slide,
    assumed: Mapping[str, float],
    decided: Callable[[Chosen], None],
) -> Chosen:
    """Slide what comes nearest to the truth in the time that is left, and say what was chosen and why.

    Parameters
    ----------
    left : seconds, now; costs of what ``slide`` returns are seconds a log
    decided : told what is chosen as soon as it is, and again where the number of logs is set anew on the way
    """
    goal, trusted, middle = Budget(left, cap), trusted_of(assumed, len(line_ids)), [0.5] * len(line_ids)

    def best(shares: Sequence[float], name: str, rate: float) -> Option:
        """By the seconds of a log at one fidelity, and what the others cost of it on the benchmark's slopes."""
        each = {option.fidelity: rate * COSTS[option.fidelity] / COSTS[name] for option in trusted}
        return min(trusted, key=lambda option: goal.value(option, shares, 0, each[option.fidelity]))

    probe = min(trusted, key=lambda option: COSTS[option.fidelity])
    known = slide(probe.fidelity, min(PROBE, cap))
    judge = best(middle, probe.fidelity, known.cost)
    if judge.fidelity != probe.fidelity:
        known = slide(judge.fidelity, min(PROBE, cap))
    for _ in range(2):  # the shares may speak for another
        quarter = goal.logs(len(known.reach), known.cost) // 4
        known = slide(judge.fidelity, min(cap, max(len(known.reach), min(FIRST_LOOK, quarter))))
        again = best(known.shares, judge.fidelity, known.cost)
        if again.fidelity == judge.fidelity:
            break
        judge, known = again, slide(again.fidelity, min(PROBE, cap))
    option, why, looks = _pilot(goal, judge, known, slide)
    done = slide(option.fidelity, 0)

    def chosen(logs: int, record: dict[str, Any]) -> Chosen:
        return Chosen(option, logs, why, {"looks": looks, **record})

    for part in (0.5, 1.0):  # what a log takes is known better half-way
        more = goal.logs(len(done.reach), done.cost) - len(done.reach)
        logs = len(done.reach) + (more if part == 1.0 else more // 2)
        decided(chosen(len(done.reach) + more, {}))
        if logs > len(done.reach):
            done = slide(option.fidelity, logs)
    return chosen(len(done.reach), record_of(option, done.reach, line_ids, why, looks, cap))


def _is_worth(goal: Error | Budget, name: str, judge: Option, known: Slid, most: int, z: float) -> bool:
    """Whether a fidelity would serve the goal so much better, if no log at all ended differently there."""
    rate, done = known.cost * COSTS[name] / COSTS[judge.fidelity], len(known.reach)
    best, later = math.inf, FIRST_LOOK
    while later <= most:
        then = Option(name, _added(judge.bounds, [pairs_bound(0, 0, later, z)] * len(judge.bounds)), judge.fidelity)
        more = max(0, later - done) * known.cost + later * rate
        best = min(best, goal.value(then, known.shares, later, rate, more))
        later *= 2
    return best < WORTH * goal.value(judge, known.shares, done, known.cost)


def _is_done(goal: Error | Budget, judge: Option, known: Slid, m: int) -> bool:
    """Whether the judge will have made the whole run before the pilot has so many pairs."""
    if isinstance(goal, Error):
        return m >= (goal.logs(judge, known.shares) or goal.cap)
    return m >= goal.logs(len(known.reach), known.cost)


def _added(a: Sequence[float], b: Sequence[float]) -> list[float]:
    return [one + other for one, other in zip(a, b, strict=True)]


@dataclass(frozen=True)
class _Pairs:
    """Of logs that slid at two fidelities, by line: how many reach it at the judge alone, and at the other alone."""

    lost: list[int]
    gained: list[int]
    n: int

    @staticmethod
    def of(judge: NDArray[np.bool_], other: NDArray[np.bool_]) -> _Pairs:
        lost, gained = (judge & ~other).sum(axis=0), (other & ~judge).sum(axis=0)
        return _Pairs(lost.tolist(), gained.tolist(), len(judge))

    @property
    def differ(self) -> list[float]:
        return [(a + b) / self.n for a, b in zip(self.lost, self.gained, strict=True)]

    def bounds(self, n: int, z: float) -> list[float]:
        scale = n / self.n
        pairs = zip(self.lost, self.gained, strict=True)
        return [pairs_bound(scale * a, scale * b, n, z) for a, b in pairs]

    def hoped(self, n: int, z: float) -> list[float]:
        """The bounds after more pairs, if the two are no farther apart than chance may have let them seem."""
        found = []
        for a, b in zip(self.lost, self.gained, strict=True):
            rate, apart = (a + b) / self.n, abs(b - a) / self.n
            apart = max(0.0, apart - math.sqrt(rate / self.n))
            found.append(pairs_bound(n * (rate - apart) / 2.0, n * (rate + apart) / 2.0, n, z))
        return found


def _run(goal: Error, option: Option, slide: Slide, logs: int) -> int:
    """Slide as many logs as the shares of the first ones ask for; where these misled about it, some more."""
    for _ in range(MOST_REPEATS):
        need = goal.logs(option, slide(option.fidelity, logs).shares) or goal.cap
        if need <= logs:
            break
        logs = min(goal.cap, max(need, logs + logs // MORE))
    return logs


def cost_of(chunks: Sequence[Mapping[str, NDArray]]) -> float:
    """Cost of a log of these chunks, in microseconds of a machine that is nobody's: 1.8 a step and 0.18 a contact.

    Within 25 % of what the benchmark measures for any fidelity and slope, and the same on every machine.
    """
    logs, steps, contacts = (
        sum(float(part(chunk)) for chunk in chunks)
        for part in (lambda c: len(c["reach"]), lambda c: c["cost_steps"].sum(), lambda c: c["cost_contacts"].sum())
    )
    return (1.8 * steps + 0.18 * contacts) / logs


def record_of(
    option: Option,
    reach: NDArray[np.bool_],
    line_ids: Sequence[Any],
    why: str,
    looks: Sequence[Mapping[str, Any]],
    cap: int,
) -> dict[str, Any]:
    """For ``summary.json``: both errors of the line that is farthest off, apart and together, as shares."""
    n = len(reach)
    rows = []
    for line_id, bound, hit in zip(line_ids, option.bounds, reach.sum(axis=0).tolist(), strict=True):
        sampling = sampling_of(hit, n)
        rows.append((together_of(bound, sampling / Z_95, option.risk), sampling, bound, line_id))
    together, sampling, bound, line_id = max(rows, key=lambda row: row[0])
    return {
        "chosen": option.fidelity,
        "why": why,
        "sampling": sampling,
        "calculation": bound,
        "together": together,
        "line_id": line_id,
        "measured_against": option.measured,
        "logs": n,
        "logs_at_most": cap,
        "looks": list(looks),
    }


def _why_judge(judge: Option, looks: Sequence[Mapping[str, Any]]) -> str:
    bound = 100 * max(judge.bounds)
    has = "is the reference" if judge.fidelity == "reference" else f"is taken to be off by ±{bound:.2g} points at most"
    if not looks:
        return f"{judge.fidelity} {has}; pairs that show a cheaper one to do would cost more than they save"
    last = {look["fidelity"]: look for look in looks}
    seen = "; ".join(
        f"{name}: {100 * look['differ']:.2g} % of {look['n_pairs']} logs end differently" for name, look in last.items()
    )
    return f"{judge.fidelity} {has}; to show a cheaper fidelity good enough would cost more than this run ({seen})"


def _why_cheaper(option: Option, pairs: int) -> str:
    return (
        f"{option.fidelity} is off by ±{100 * max(option.bounds):.2g} points at most, by {pairs} logs of this slope "
        f"that slid at {option.measured} as well"
    )


def _too_small(error: float, trusted: Sequence[Option], shares: Sequence[float], cap: int, many: str) -> str:
    """What all logs can promise, and how many more it takes."""
    best, bound = min(
        (
            (max(together_of(b, sampling_of(s * cap, cap) / Z_95) for b, s in zip(o.bounds, shares, strict=True)), o)
            for o in trusted
        ),
        key=lambda each: each[0],
    )
    option = _cheapest(error, trusted, shares, 2**40)
    assert option is not None
    need = needed(error, option, shares, 2**40) or cap
    digit = 10 ** max(0, math.floor(math.log10(need)) - 1)
    return (
        f"--error {error:g} cannot be promised with the {cap} logs of {many}: all of them, at {bound.fidelity}, allow "
        f"--error {math.ceil(best * 1e4) / 1e4:g}; this one takes about {math.ceil(need / digit) * digit} "
        f"at {option.fidelity}"
    )
