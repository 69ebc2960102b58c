"""The promise is kept, by simulation with pools of logs whose true values and pairs are known; and time is saved."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.simulate.auto import Chosen, Option, Slid, keep_error, spend_budget
from deadwood_algorithms.simulate.fidelity_trade import COSTS
from deadwood_algorithms.simulate.promise import Between, sigma_of, together_of

ASSUMED = {"standard": Between(0.008)}  # no spread: a bound
CAP = 60_000
RUNS = 300


@dataclass
class Pool:
    """Logs that reach a line with probability ``p`` at `reference`. At a cheaper fidelity a share of
    ``r`` p (1 - p) ends differently, and ``off`` more reach it than at `reference`."""

    rng: np.random.Generator
    p: float
    r: float
    off: dict[str, float]
    slid: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        chance = self.rng.random((4, CAP))
        reference = chance[0] < self.p
        self.reach = {"reference": reference}
        for row, name in zip(chance[1:], ("draft", "standard", "fine"), strict=True):
            off = self.off.get(name, 0.0)
            differ = max(self.r * self.p * (1.0 - self.p), abs(off))
            up, down = (differ + off) / 2.0 / (1.0 - self.p), (differ - off) / 2.0 / self.p
            self.reach[name] = np.where(reference, row >= down, row < up)

    def slide(self, name: str, n: int) -> Slid:
        self.slid[name] = max(n, self.slid.get(name, 0))
        return Slid(self.reach[name][:n, None], COSTS[name])

    def cost(self) -> float:
        return sum(COSTS[name] * n for name, n in self.slid.items())


def promise(pool: Pool, error: float, assumed: dict[str, Between]) -> tuple[Chosen, float]:
    chosen = keep_error(error, CAP, ["road"], pool.slide, assumed)
    return chosen, abs(float(pool.reach[chosen.option.fidelity][: chosen.logs].mean()) - pool.p)


# p, r, error of calculation of draft and of standard, requested error, assumption
CASES = (
    (0.3, 0.8, 0.02, 0.008, 0.03, ASSUMED),  # chaotic, and standard with the largest allowed error
    (0.3, 0.8, 0.02, -0.008, 0.03, ASSUMED),
    (0.05, 0.8, 0.02, 0.008, 0.02, ASSUMED),
    (0.3, 0.8, 0.02, 0.008, 0.03, {}),  # nothing assumed: reference
    (0.5, 0.02, 0.01, 0.008, 0.03, ASSUMED),  # smooth
    (0.01, 0.5, 0.002, 0.0, 0.01, ASSUMED),
)


@pytest.mark.parametrize("case", CASES)
def test_the_promised_error_holds_in_95_of_100_runs(case):
    """300 runs a case: at exactly 95 %, fewer than 92 % would be 2.4 standard errors off."""
    p, r, draft, standard, error, assumed = case
    rng = np.random.default_rng(3)
    held = 0
    for _ in range(RUNS):
        chosen, off = promise(Pool(rng, p, r, {"draft": draft, "standard": standard}), error, assumed)
        held += off <= error
        assert chosen.record["together"] <= error * 1.000001
        assert chosen.record["reached"]
    assert held / RUNS >= 0.92


def test_over_all_cases_it_holds_in_95_of_100():
    """Cases drawn at random, one run each: 3 standard errors below 95 % of 1500 are 93.3 %."""
    rng = np.random.default_rng(4)
    held = []
    for _ in range(1500):
        p, r = rng.uniform(0.02, 0.98), 10.0 ** rng.uniform(-2.5, 0.0)
        most = 0.8 * p * (1.0 - p)
        off = {"draft": rng.uniform(-0.04, 0.04), "standard": rng.uniform(-0.008, 0.008), "fine": 0.0}
        off = {name: float(np.clip(value, -most, most)) for name, value in off.items()}
        error = rng.uniform(0.015, 0.06)
        held.append(promise(Pool(rng, p, r, off), error, [{}, ASSUMED][rng.integers(2)])[1] <= error)
    assert np.mean(held) >= 0.95


@pytest.mark.parametrize(("error", "fidelity"), [(0.06, "reference"), (0.1, "standard")])
def test_over_slopes_whose_errors_have_a_tail_it_holds_in_95_of_100(error, fidelity):
    """Slopes drawn from the assumption itself, a run on each: 3 standard errors below 95 % of 300 are 91.2 %."""
    rng, assumed = np.random.default_rng(10), {"standard": Between(0.005, 0.012, 0.08)}
    held = []
    for _ in range(RUNS):
        spread = 0.08 if rng.random() < 0.1 else 0.012
        off = float(np.clip(0.005 + spread * rng.standard_normal(), -0.2, 0.2))
        chosen, away = promise(Pool(rng, 0.4, 0.9, {"standard": off}), error, assumed)
        held.append(away <= error)
        assert chosen.option.fidelity == fidelity
    assert np.mean(held) >= 0.912


def test_a_promise_slides_at_one_fidelity_alone():
    rng = np.random.default_rng(5)
    for error, assumed, fidelity in ((0.02, ASSUMED, "standard"), (0.01, {}, "reference")):
        pool = Pool(rng, 0.3, 0.9, {})
        chosen, _ = promise(pool, error, assumed)
        assert chosen.option.fidelity == fidelity
        assert pool.slid == {fidelity: chosen.logs}


def test_a_smaller_error_than_standard_is_known_to_keep_takes_reference():
    chosen, _ = promise(Pool(np.random.default_rng(6), 0.05, 0.9, {}), 0.008, ASSUMED)
    assert chosen.option.fidelity == "reference"
    assert chosen.option.between == Between()


def test_the_wider_of_two_lines_decides_and_lines_are_distinguished():
    rng = np.random.default_rng(7)
    reach = np.column_stack([rng.random(CAP) < 0.02, rng.random(CAP) < 0.5])
    chosen = keep_error(0.03, CAP, ["house", "road"], lambda name, n: Slid(reach[:n]), {})
    assert chosen.record["line_id"] == "road"
    assert chosen.logs > 1000


def test_what_all_logs_can_promise_can_then_be_requested():
    pool = Pool(np.random.default_rng(8), 0.4, 0.9, {})
    with pytest.raises(UserError) as told:
        keep_error(0.01, 2000, ["road"], pool.slide, ASSUMED, "releases.gpkg")
    said = str(told.value)
    assert said.startswith("--error 0.01 cannot be promised with the 2000 logs of releases.gpkg")
    most = float(said.split("allow --error ")[1].split(";")[0])
    assert 0.02 < most < 0.024
    assert keep_error(most + 1e-3, 2000, ["road"], pool.slide, ASSUMED).logs <= 2000


@pytest.mark.parametrize(("seconds", "share", "fidelity"), [(400.0, 0.4, "standard"), (150_000.0, 0.4, "reference")])
def test_a_budget_is_spent_on_what_comes_nearest(seconds, share, fidelity):
    """A clock that advances with the logs: standard in a short time, but not in a long one because of its bound."""
    pool = Pool(np.random.default_rng(9), share, 0.9, {})
    told: list[Option] = []
    chosen = spend_budget(
        lambda: max(0.0, seconds - pool.cost()),
        CAP,
        ["road"],
        pool.slide,
        ASSUMED,
        lambda option, n: told.append(option),
    )
    assert chosen.option.fidelity == fidelity
    assert 0.98 * seconds < pool.cost() <= seconds
    assert told == [chosen.option] * 2
    found = chosen.record["together"]
    others = {"standard": together_of(Between(0.008), sigma_of(share, min(CAP, int(seconds)))),
              "reference": together_of(Between(), sigma_of(share, int(seconds / COSTS["reference"])))}  # fmt: skip
    # the share of so few random logs is off by some percent
    assert found == pytest.approx(min(others.values()), rel=0.1)
