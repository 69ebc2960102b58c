"""Enough logs? The order in which a run takes its logs, and when it may end before the last of them.

With ``--until-ci W`` the logs are taken in the order of a hash of seed and log_id, so that those run so far are always
a random sample of all. After 1000, 2000, 4000, ... logs, and after all of them, the run checks the interval of every
line's reach probability; it ends when the widest is at most +-W. The checks depend on the number of logs alone, never
on chunks, threads or an interruption, so the same logs are run in any case.

A run that ends when its result is favourable is biased, and with enough checks chance makes it favourable. The rule
therefore never uses the position of an interval, only its width, and the intervals at the checks are widened, as Pocock
did for clinical trials (1977), such that those of ALL checks contain their true value simultaneously with 95 %: at
whichever check the run ends, its interval does. The estimates after n and 2n logs share half their logs, so with m
checks the worst of them behaves like the largest of m standard normal numbers of which neighbours correlate by
sqrt(1/2). That gives z = 2.18 for 2 checks, 2.41 for 4, 2.75 for 11 (Pocock's own 2.41 for 5 is for equidistant checks,
which correlate more). There is no correction between lines: each line's interval is a separate statement.

The estimate itself is not corrected. Its interval narrows earlier if by chance few logs reach, so for a rare reach a
stopped run underestimates on average: by up to 14 % of the reach if it is 0.1 to 1 %, by less than 1 % from 5 % on
(tested). Lines that so few logs reach are named.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.stats.statistics import wilson_interval

FIRST_LOOK = 1000
COVERAGE = 0.95
RARE = 0.02  # share below which a stopped run underestimates on average: at it by at most 2 to 3 % of it
NODES = 64  # of the quadrature over one check: z is exact to 1e-10


@dataclass
class Queue:
    """The logs in the order in which they are slid, in chunks, and the rule that may end the run early.

    rows : rows of the releases in that order; parts : the chunks; slid : number of logs that were slid in the end
    """

    rows: NDArray[np.int64]
    parts: list[slice]
    rule: UntilNarrow | None = None
    slid: int = 0

    @staticmethod
    def of(
        log_id: NDArray[np.int64],
        chunk: int,
        borders: tuple[int, ...] = (),
        *,
        target: float | None,
        line_ids: list[Any],
        seed: int,
    ) -> Queue:
        """All logs in the order of their rows, or, with a target, in the order of the hash.

        ``borders`` are numbers of logs after which a chunk ends early.
        """
        early = tuple(border for border in borders if border < min(chunk, log_id.size))
        if target is None:
            return Queue(np.arange(log_id.size), parts_of(log_id.size, chunk, early))
        rule = UntilNarrow(target, log_id.size, line_ids)
        return Queue(hash_order(log_id, seed), parts_of(log_id.size, chunk, (*early, *rule.looks)), rule)

    @property
    def goal(self) -> int:
        """Number of logs after which the run will probably end."""
        return self.rule.goal if self.rule else self.rows.size

    def slid_rows(self) -> tuple[NDArray[np.int64], NDArray[np.intp]]:
        """Rows of the releases that were slid, ascending, and the position of each in the order of sliding."""
        order = np.argsort(self.rows[: self.slid], kind="stable")
        return self.rows[: self.slid][order], order


@dataclass
class UntilNarrow:
    """The rule: given how many logs of each part reached each line, it decides whether the run has enough."""

    target: float
    cap: int
    line_ids: list[Any]
    slid: int = 0
    goal: int = 0
    records: list[dict[str, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.looks = looks_of(self.cap)
        self.z = z_of_looks(len(self.looks))
        self.goal = self.looks[0]
        self._reached = np.zeros(len(self.line_ids), np.int64)

    def enough(self, n_logs: int, n_reach: NDArray[np.int64]) -> bool:
        """Add the next part; at a check, whether the widest interval is narrow enough."""
        self.slid += n_logs
        self._reached += n_reach
        if self.slid not in self.looks:
            return False
        widths = [half_width(int(count), self.slid, self.z) for count in self._reached]
        widest = int(np.argmax(widths))
        half = widths[widest]
        self.records.append({"n_logs": self.slid, "half_width": half, "line_id": self.line_ids[widest]})
        wanted = self.slid * (half / self.target) ** 2
        self.goal = next((look for look in self.looks if look > self.slid and look >= wanted), self.cap)
        return half <= self.target

    def record(self) -> dict[str, Any]:
        """For ``summary.json``; half-widths are of the intervals widened by z."""
        last = self.records[-1]
        return {
            "target_half_width": self.target,
            "reached": last["half_width"] <= self.target,
            "half_width": last["half_width"],
            "line_id": last["line_id"],
            "logs": self.slid,
            "logs_at_most": self.cap,
            "told_too_low": self._underestimated(),
            "z": self.z,
            "looks": self.records,
        }

    def _underestimated(self) -> list[Any]:
        """Lines with a rare reach, if the run stopped before its last log."""
        if self.slid >= self.cap:
            return []
        rare = self._reached < RARE * self.slid
        return [line for line, few in zip(self.line_ids, rare.tolist(), strict=True) if few]


def looks_of(total: int) -> tuple[int, ...]:
    """Numbers of logs after which a run of at most ``total`` logs is checked: 1000, 2000, 4000, ..., and the last
    log.
    """
    looks = [FIRST_LOOK]
    while looks[-1] < total:
        looks.append(2 * looks[-1])
    return (*looks[:-1], total)


def parts_of(total: int, chunk: int, borders: tuple[int, ...] = ()) -> list[slice]:
    """Chunks of bounded size, with borders after given numbers of logs."""
    ends = sorted({*borders, total})
    spans = zip([0, *ends], ends, strict=False)
    return [slice(start, min(start + chunk, end)) for begin, end in spans for start in range(begin, end, chunk)]


def half_width(n_hit: int, n_total: int, z: float) -> float:
    low, high = wilson_interval(n_hit, n_total, z=z)
    return (high - low) / 2.0


@cache
def z_of_looks(looks: int, coverage: float = COVERAGE) -> float:
    """The number of standard errors that keeps 95 % coverage over several checks, each at twice the logs of the
    previous one.
    """
    low, high = 1.0, 5.0
    while high - low > 1e-10:
        middle = (low + high) / 2.0
        low, high = (middle, high) if _all_within(middle, looks) < coverage else (low, middle)
    return high


def _all_within(z: float, looks: int) -> float:
    """Probability that a stationary normal chain with neighbours' correlation sqrt(1/2) always stays within +-z."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    x, weights = z * nodes, z * weights
    density = np.exp(-(x**2) / 2.0) / np.sqrt(2.0 * np.pi)
    # Given the previous check, the next is normal with mean x * sqrt(1/2) and variance 1/2.
    onward = np.exp(-((x[:, None] - np.sqrt(0.5) * x[None, :]) ** 2)) / np.sqrt(np.pi)
    for _ in range(looks - 1):
        density = onward @ (weights * density)
    return float(weights @ density)
