"""`--fidelity auto`: which fidelity, and how many logs, keep a promised error at the lowest cost, decided on this
slope.

The error is the distance of every line's reach from what `reference` would give (``promise``). What is known about each
fidelity's calculation: the error of `reference` is zero by definition; those of the others are distributed as the
caller assumes (``assumed``), as measured on random slopes of the same kind. The cheapest that can keep the promise
slides its first logs; the shares observed determine how many are needed, and whether another fidelity would be cheaper
after all.

With a budget of time instead, everything is the same except the goal: the smallest error within the remaining time.
Costs are then in seconds. With an error to keep, they are those of the page, so that every machine, every number of
threads and every resumed run makes the same decision.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.counts import significant, two_digits
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.simulate.fidelity_trade import COSTS
from deadwood_algorithms.simulate.promise import Between, logs_for, sampling_of, sigma_for, sigma_of, together_of
from deadwood_algorithms.stats.statistics import Z_95

FIRST_LOOK = 200  # logs from which the number needed is estimated
LEAST = 50  # minimum number of logs for any promise
PROBE = 32  # logs from which the time of one is estimated
MORE = 100  # smallest addition, as a part of the logs slid so far, if they turn out to be too few
MOST_REPEATS = 50  # repetitions at the run's end if the share turns out to need more logs than planned


@dataclass(frozen=True)
class Slid:
    """The first logs of the draw at one fidelity: whether each reached each line (n, lines), and its seconds."""

    reach: NDArray[np.bool_]
    seconds: float = math.nan  # per log

    @property
    def shares(self) -> list[float]:
        return self.reach.mean(axis=0).tolist()


Slide = Callable[[str, int], Slid]  # slides a number of logs of the draw at a fidelity, or reuses those already slid


@dataclass(frozen=True)
class Option:
    """A fidelity that could make the run: the error of its calculation, over slopes like this one."""

    fidelity: str
    between: Between

    @property
    def calculation(self) -> float:
        """What that error does not exceed on 95 of 100 such slopes."""
        return together_of(self.between, 0.0, risk=0.05)

    @property
    def why(self) -> str:
        if self.fidelity == "reference":
            return "reference is the reference"
        points = significant(100 * self.calculation, 2)
        return f"{self.fidelity} was within ±{points} points of reference on 95 of 100 random slopes of this kind"


@dataclass(frozen=True)
class Chosen:
    """The choice, carried out: the run is the first ``logs`` of the draw at the fidelity of ``option``."""

    option: Option
    logs: int
    record: dict[str, Any] = field(default_factory=dict)


def keep_error(
    error: float,
    cap: int,
    line_ids: Sequence[Any],
    slide: Slide,
    assumed: Mapping[str, Between],
    many: str = "the layer",
) -> Chosen:
    """Slide as many logs as keep the promise, and report the choice and its reason.

    Parameters
    ----------
    error : error of every line's reach, as a share
    cap : all logs of the draw
    assumed : assumed errors of calculation; that of `reference` is 0
    many : name of the source with ``cap`` logs, for messages

    Raises
    ------
    UserError
        if not even all logs can keep it; states what they can keep
    """
    trusted = trusted_of(assumed)
    option = _cheapest(error, trusted, [0.5] * len(line_ids), 2**40)
    assert option is not None
    half = (needed(error, option, [0.5] * len(line_ids), 2**40) or 0) // 2
    known = slide(option.fidelity, min(cap, FIRST_LOOK, max(LEAST, half)))
    again = _cheapest(error, trusted, known.shares, cap)
    if again is None:
        raise UserError(_too_small(error, trusted, known.shares, cap, many))
    if again.fidelity != option.fidelity:
        option, known = again, slide(again.fidelity, len(known.reach))
    logs = len(known.reach)
    for _ in range(MOST_REPEATS):  # if the shares of the first logs were misleading, some more
        need = needed(error, option, slide(option.fidelity, logs).shares, cap) or cap
        if need <= logs:
            break
        logs = min(cap, max(need, logs + logs // MORE))
    record = record_of(option, slide(option.fidelity, logs).reach, line_ids, cap)
    kept = record["together"] <= error * (1.0 + 1e-9)
    return Chosen(option, logs, {**record, "error": error, "reached": kept})


def trusted_of(assumed: Mapping[str, Between]) -> list[Option]:
    """The fidelities whose error of calculation is known; `reference` is the last."""
    return [Option(name, between) for name, between in {**assumed, "reference": Between()}.items()]


def _cheapest(error: float, options: Sequence[Option], shares: Sequence[float], cap: int) -> Option | None:
    """The option that probably keeps the error at the lowest cost; None if none can with the available logs."""
    costs = {
        option.fidelity: logs * COSTS[option.fidelity]
        for option in options
        if (logs := needed(error, option, shares, cap)) is not None
    }
    return min((each for each in options if each.fidelity in costs), key=lambda o: costs[o.fidelity], default=None)


def needed(error: float, option: Option, shares: Sequence[float], cap: int) -> int | None:
    """Number of logs with which sampling and calculation together reach the error, for every line; None if too many."""
    found, sigma = 1, sigma_for(error, option.between)
    for share in shares:
        logs = logs_for(sigma, share, cap)
        if logs is None:
            return None
        found = max(found, logs)
    return found


def worst_of(option: Option, shares: Sequence[float], n: int) -> float:
    """Both errors together after ``n`` logs, of the line with the largest error."""
    return together_of(option.between, max(sigma_of(share, n) for share in shares))


def spend_budget(
    left: Callable[[], float],
    cap: int,
    line_ids: Sequence[Any],
    slide: Slide,
    assumed: Mapping[str, Between],
    decided: Callable[[Option, int], None],
) -> Chosen:
    """Slide what is most accurate in the remaining time, and report the choice and its reason.

    Parameters
    ----------
    left : returns the seconds left
    decided : called with the fidelity and the number of logs as soon as they are chosen, and again if that number is
        changed later
    """
    trusted = trusted_of(assumed)

    def logs_in_time(done: int, seconds: float) -> int:
        return min(cap, done + max(0, int(left() / seconds)))

    def best(shares: Sequence[float], name: str, seconds: float) -> Option:
        """The best option, from the seconds of a log at one fidelity and the relative costs of the others on the
        benchmark's slopes.
        """
        each = {option.fidelity: seconds * COSTS[option.fidelity] / COSTS[name] for option in trusted}
        return min(trusted, key=lambda option: worst_of(option, shares, logs_in_time(0, each[option.fidelity])))

    probe = min(trusted, key=lambda option: COSTS[option.fidelity])
    known = slide(probe.fidelity, min(PROBE, cap))
    option = best([0.5] * len(line_ids), probe.fidelity, known.seconds)
    if option.fidelity != probe.fidelity:
        known = slide(option.fidelity, min(PROBE, cap))
    for _ in range(2):  # the shares may favour another option
        quarter = logs_in_time(len(known.reach), known.seconds) // 4
        known = slide(option.fidelity, min(cap, max(len(known.reach), min(FIRST_LOOK, quarter))))
        again = best(known.shares, option.fidelity, known.seconds)
        if again.fidelity == option.fidelity:
            break
        option, known = again, slide(again.fidelity, min(PROBE, cap))
    done = slide(option.fidelity, 0)
    for part in (0.5, 1.0):  # the time of a log is known better half-way
        more = logs_in_time(len(done.reach), done.seconds) - len(done.reach)
        logs = len(done.reach) + (more if part == 1.0 else more // 2)
        decided(option, len(done.reach) + more)
        if logs > len(done.reach):
            done = slide(option.fidelity, logs)
    return Chosen(option, len(done.reach), record_of(option, done.reach, line_ids, cap))


def record_of(option: Option, reach: NDArray[np.bool_], line_ids: Sequence[Any], cap: int) -> dict[str, Any]:
    """For ``summary.json``: both errors of the line with the largest error, separately and together, as shares."""
    n = len(reach)
    rows = [(sampling_of(hit, n), line_id) for line_id, hit in zip(line_ids, reach.sum(axis=0).tolist(), strict=True)]
    sampling, line_id = max(rows, key=lambda row: row[0])
    return {
        "chosen": option.fidelity,
        "why": option.why,
        "sampling": sampling,
        "calculation": option.calculation,
        "together": together_of(option.between, sampling / Z_95),
        "line_id": line_id,
        "logs": n,
        "logs_at_most": cap,
    }


def _too_small(error: float, trusted: Sequence[Option], shares: Sequence[float], cap: int, many: str) -> str:
    """What all logs together can promise, and how many more logs are needed."""
    best, least = min(
        ((together_of(each.between, max(sigma_of(share, cap) for share in shares)), each) for each in trusted),
        key=lambda found: found[0],
    )
    option = _cheapest(error, trusted, shares, 2**40)
    assert option is not None
    need = needed(error, option, shares, 2**40) or cap
    return (
        f"--error {error:g} cannot be promised with the {cap} logs of {many}: all of them, at {least.fidelity}, allow "
        f"--error {math.ceil(best * 1e4) / 1e4:g}; this one takes about {two_digits(need)} "
        f"at {option.fidelity}"
    )
