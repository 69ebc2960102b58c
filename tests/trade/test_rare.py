"""Fixed-effort splitting (``benchmarks/rare.py``): unbiased on chains with known answers, and slides plain logs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks import rare, scenes
from deadwood_engine import place_logs, slide


@dataclass(frozen=True)
class Chain:
    """Walkers with a fate drawn at birth: a level is reached if fate < its p. Shaking redraws some fates."""

    fate: NDArray[np.float64]
    bounds: tuple[float, ...]
    again: float

    def __len__(self) -> int:
        return len(self.fate)

    def take(self, rows: NDArray[np.int64]) -> Chain:
        return replace(self, fate=self.fate[rows])

    def advance(self, level: int) -> tuple[NDArray[np.int64], Chain]:
        rows = np.flatnonzero(self.fate < self.bounds[level])
        # the fate of those that pass is uniform again: a chain without memory except of the level
        return rows, replace(self, fate=self.fate[rows] / self.bounds[level])

    def shaken(self, rng: np.random.Generator) -> Chain:
        return replace(self, fate=np.where(rng.random(len(self)) < self.again, rng.random(len(self)), self.fate))


@pytest.mark.parametrize("again", [0.0, 0.3, 1.0])
def test_unbiased_whatever_siblings_share(again: float) -> None:
    """p = 0.5 x 0.2 x 0.3: the mean of 4000 repetitions is within 4 standard errors, siblings alike or not."""
    bounds, rng = (0.5, 0.2, 0.3), np.random.default_rng(5)
    found = []
    for _ in range(4000):
        shares, _ = rare.fixed_effort(Chain(rng.random(23), bounds, again), 3, rng)
        found.append(np.prod(shares))
    error = np.std(found) / np.sqrt(len(found))
    assert error < 0.05 * 0.03
    assert abs(np.mean(found) - 0.03) < 4.0 * error


@pytest.mark.parametrize(("again", "expected"), [(0.0, 1.0), (1.0, 0.3)])
def test_siblings_are_distinguished(again: float, expected: float) -> None:
    """If nothing is redrawn, siblings share their fate: if one of a pair reaches, both do. Otherwise p of them."""
    rng = np.random.default_rng(6)
    both = one = 0.0
    for _ in range(300):
        shares, pairs = rare.fixed_effort(Chain(rng.random(40), (0.25, 0.3), again), 2, rng)
        both, one = both + pairs[1, 1], one + shares[1] * pairs[1, 0]
    assert both / one == pytest.approx(expected, abs=0.07)


def test_no_log_comes_through() -> None:
    shares, _ = rare.fixed_effort(Chain(np.ones(5), (0.5, 0.5), 1.0), 2, np.random.default_rng(1))
    assert shares.tolist() == [0.0, 0.0]


def test_the_first_level_is_plain_sampling_and_entries_have_touched() -> None:
    """The same logs, slid plainly, reach the same line; states at the entry are those of logs that have touched it."""
    scene, number = rare.forest(), 200
    start = place_logs(scene, scenes.logs_of_block(3, number))
    cost = {"steps": 0.0, "needed": 0.0}
    rows, entered = rare.Sliding(scene, start, np.zeros((number, len(rare.LEVELS)), bool), 0.0, cost).advance(0)
    plain = slide(scene, start, rare.DRAFT, time_limit=rare.study.TIME_LIMIT)
    assert np.array_equal(rows, np.flatnonzero(plain.reach[:, 0]))
    assert entered.had[:, 0].all()
    # whether reached before or after the restart, a line is reached no later than the plain log's later ones
    assert (entered.had <= plain.reach[rows]).all()
    assert 0.0 < cost["needed"] < cost["steps"]


def test_how_many_logs() -> None:
    """1 in 100 to a tenth of it: z^2 0.99 / (0.01 x 0.01)."""
    assert rare.logs_needed(0.01, 0.1) == pytest.approx(38031.0, abs=1.0)
