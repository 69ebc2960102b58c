"""Distances, intervals and rows of the fidelity comparison, on numbers whose answer is known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm, sem, wasserstein_distance

from deadwood_algorithms.evaluate.fidelity.measures import jaccard_distance, rows_of, split_half, wasserstein
from deadwood_algorithms.evaluate.fidelity.records import FidelityRow, FidelityRun
from deadwood_algorithms.evaluate.fidelity.rule import UNDECIDED, WITHIN
from deadwood_algorithms.scene.releases import Group

N = 400
SOME = (np.array([3, 8]), np.array([0.5, 0.25]))


def slid(name: str = "fine", **changes) -> FidelityRun:
    rng = np.random.default_rng(5)
    x, y = rng.normal(0.0, 20.0, N), rng.normal(-100.0, 10.0, N)
    values = {
        "name": name, "cpu_ms": 2.0, "steps": 100.0, "reach": (np.arange(N) < 120)[:, None], "x": x, "y": y,
        "runout": -y, "speed_max": rng.uniform(5.0, 25.0, N), "jump_max": rng.uniform(0.0, 1.0, N),
        "penetration_max": np.linspace(0.0, 0.1, N), "energy_error": np.linspace(0.0, 1e-3, N),
        "unconverged_share": 0.001, "failed": 0, "still_moving": 0, "hits": (SOME, SOME, SOME),
    }  # fmt: skip
    return FidelityRun(**(values | changes))


def rows(one: FidelityRun, finest: FidelityRun, planned: int = N) -> dict[str, FidelityRow]:
    groups = [Group("a", np.arange(N), (0.0, 0.0), np.full(N, 10.0))]
    return {row.quantity: row for row in rows_of(one, finest, ["road"], groups, planned, 0)}


def test_wasserstein():
    assert wasserstein(np.array([0.0, 1.0, 5.0]), np.array([2.0, 3.0, 7.0])) == pytest.approx(2.0)  # all moved by 2
    assert wasserstein(np.array([1.0, 4.0]), np.array([4.0, 1.0])) == 0.0
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=101), rng.exponential(size=57)
    assert wasserstein(a, b) == pytest.approx(wasserstein_distance(a, b))


def test_jaccard_distance():
    a = (np.array([1, 2, 7]), np.array([0.4, 0.2, 0.4]))
    assert jaccard_distance(a, a) == 0.0
    assert jaccard_distance(a, (np.array([3]), np.array([1.0]))) == 1.0
    b = (np.array([2, 7, 9]), np.array([0.4, 0.2, 0.2]))
    assert jaccard_distance(a, b) == pytest.approx(1.0 - (0.2 + 0.2) / (0.4 + 0.4 + 0.4 + 0.2))
    empty = (np.zeros(0, np.int64), np.zeros(0))
    assert jaccard_distance(empty, empty) == 0.0
    assert jaccard_distance(empty, a) == 1.0


def test_the_noise_of_a_run_is_its_distance_from_the_truth():
    """Normal run-outs, whose true distribution is known: the noise derived from halves is that of whole runs."""
    rng = np.random.default_rng(3)
    truth = rng.normal(100.0, 15.0, 200_000)
    runs = rng.normal(100.0, 15.0, (40, N))
    far = np.mean([wasserstein(run, truth) for run in runs])
    told = np.mean([split_half(run, 0) * math.sqrt(N / (4.0 * N)) for run in runs])
    assert told == pytest.approx(far, rel=0.15)


def test_a_run_against_itself():
    found = rows(slid("draft"), slid("fine"))
    for quantity in ("reach", "deposit_distance", "hit_raster_distance", "speed_max_mean", "spread_p05_p95"):
        assert found[quantity].difference == 0.0
    assert found["reach"].verdict == found["deposit_distance"].verdict == WITHIN
    assert found["reach"].ci_high > 0.0  # that no pair differs proves little
    assert found["reach"].noise == pytest.approx(1.96 * math.sqrt(0.3 * 0.7 / N), rel=0.01)
    assert rows(slid("draft"), slid("fine"), planned=100 * N)["reach"].verdict == UNDECIDED


def test_the_finest_is_the_judge_and_is_not_judged():
    fine = slid("fine")
    found = rows(fine, fine)
    assert {row.verdict for row in found.values()} == {""}
    assert all(math.isnan(row.ci_low) for row in found.values())


def test_known_differences_are_reported():
    fine = slid("fine")
    reach = fine.reach.copy()
    reach[:40] = False  # 40 lost
    reach[120:132] = True  # 12 gained
    shifted = replace(
        fine, name="draft", reach=reach, y=fine.y - 3.0, runout=fine.runout + 3.0, speed_max=fine.speed_max + 0.5,
        hits=((np.array([3, 8]), np.array([0.25, 0.25])), SOME, SOME), unconverged_share=0.2, failed=2,
    )  # fmt: skip
    found = rows(shifted, fine)
    assert found["reach"].difference == pytest.approx(-28.0 / N)
    half = 1.96 * math.sqrt((52.0 / N - (28.0 / N) ** 2) / N)  # McNemar's, which is near Tango's here
    assert found["reach"].ci_low == pytest.approx(-28.0 / N - half, abs=0.004)
    assert found["reach"].ci_high == pytest.approx(-28.0 / N + half, abs=0.004)
    assert found["deposit_distance"].difference == pytest.approx(3.0)
    assert found["hit_raster_distance"].difference == pytest.approx(1.0 - 0.5 / 0.75)
    top = found["speed_max_mean"]
    assert (top.difference, top.ci_low, top.ci_high) == pytest.approx(
        (0.5, 0.5, 0.5)
    )  # the same for every log: certain
    assert found["speed_max_p95"].difference == pytest.approx(0.5)
    assert found["penetration_max"].value == 0.1
    assert found["penetration_max_median"].value == pytest.approx(0.05)
    assert (found["unconverged_steps"].value, found["failed"].value) == (0.2, 2)


def test_a_fan_twice_as_wide():
    fine = slid("fine")
    angle = np.radians(180.0) + np.random.default_rng(8).uniform(-0.2, 0.2, N)
    narrow = replace(fine, x=100.0 * np.sin(angle), y=100.0 * np.cos(angle))
    wide = replace(narrow, name="draft", x=100.0 * np.sin(2.0 * angle + np.pi), y=100.0 * np.cos(2.0 * angle + np.pi))
    row = rows(wide, narrow)["spread_p05_p95"]
    assert row.value == pytest.approx(2.0 * row.finest)
    assert row.finest == pytest.approx(np.degrees(0.36), rel=0.05)
    assert 0.0 < row.ci_low < row.difference < row.ci_high


def test_the_mean_of_the_largest_has_the_normal_interval_of_the_changes():
    change = np.random.default_rng(4).normal(0.3, 0.5, N)
    fine = slid()
    row = rows(slid("draft", speed_max=fine.speed_max + change), fine)["speed_max_mean"]
    expected = norm.interval(0.95, loc=change.mean(), scale=sem(change))
    assert (row.difference, row.ci_low, row.ci_high) == pytest.approx((change.mean(), *expected), rel=1e-6)


@pytest.mark.parametrize("n", [71, 72])
def test_the_spread_of_a_release_is_reported_from_a_minimum_number_of_logs(n):
    groups = [Group("a", np.arange(n), (0.0, 0.0), np.full(n, 10.0))]
    found = [row for row in rows_of(slid("draft"), slid(), ["road"], groups, N, 0) if row.quantity == "spread_p05_p95"]
    assert len(found) == (n >= 72)
