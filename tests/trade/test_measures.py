"""The study's own statistics, against answers known beforehand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks import measures


def test_reach_difference_counts_only_the_logs_that_disagree():
    theirs = np.repeat([True, False], [300, 700])
    ours = theirs.copy()
    ours[:10], ours[990:] = False, True  # ten lost, ten gained
    record = measures.reach_difference(ours, theirs)
    assert record["delta"] == 0.0
    assert record["discordant"] == pytest.approx(0.02)
    # McNemar: sqrt(b + c) / n is 0.45 points; independent samples would have 2.0
    assert record["se"] == pytest.approx(math.sqrt(20) / 1000, rel=0.1)
    assert record["low"] < 0.0 < record["high"]


def test_reach_difference_of_the_same_run_is_zero_but_not_certain():
    same = np.arange(400) < 100
    record = measures.reach_difference(same, same)
    assert record["delta"] == 0.0
    assert 0.001 < record["high"] < 0.02


def test_interval_of_the_reach_difference_covers_the_true_value_as_often_as_it_says():
    rng = np.random.default_rng(5)
    covered = 0
    for _ in range(400):
        draw = rng.random(500)
        theirs, ours = draw < 0.30, (draw > 0.05) & (draw < 0.39)  # truth: +4 points
        record = measures.reach_difference(ours, theirs)
        covered += record["low"] <= 0.04 <= record["high"]
    assert 0.91 < covered / 400 < 0.99


def test_wasserstein_of_a_shift_is_the_shift_and_order_does_not_matter():
    sample = np.random.default_rng(1).normal(size=1000)
    assert measures.wasserstein(sample + 3.5, sample[::-1]) == pytest.approx(3.5)


def test_energy_distance_of_two_points_is_twice_their_distance():
    ours, theirs = np.array([[0.0, 0.0]]), np.array([[3.0, 4.0]])
    assert measures.energy_distance(ours, theirs) == pytest.approx(10.0)
    many = np.random.default_rng(2).normal(size=(1200, 2))
    assert measures.energy_distance(many, many[::-1]) == pytest.approx(0.0, abs=1e-12)
    assert measures.energy_distance(many, many + 1.0, rows=7) == pytest.approx(
        measures.energy_distance(many, many + 1.0, rows=1200)
    )


def test_weighted_jaccard_distance_of_known_rasters():
    assert measures.jaccard_distance([4, 0, 2], [2, 0, 2]) == pytest.approx(1 - 4 / 6)
    assert measures.jaccard_distance([1, 0], [0, 1]) == 1.0
    assert measures.jaccard_distance([0, 0], [0, 0]) == 0.0


@pytest.mark.parametrize(("power", "distance"), [(0.5, "wasserstein"), (1.0, "energy")])
def test_noise_floor_is_what_two_runs_without_any_difference_are_apart(power, distance):
    rng = np.random.default_rng(3)
    apart = {
        "wasserstein": lambda a, b: measures.wasserstein(a[:, 0], b[:, 0]),
        "energy": measures.energy_distance,
    }[distance]
    real = np.mean([apart(rng.normal(size=(600, 2)), rng.normal(size=(600, 2))) for _ in range(30)])
    floors = []
    for _ in range(10):
        one = rng.normal(size=(600, 2))
        floors.append(measures.noise_floor(lambda i, j, one=one: apart(one[i], one[j]), 600, power=power, splits=5))
    assert np.mean(floors) == pytest.approx(real, rel=0.25)


def test_bootstrap_difference_finds_a_shift_of_a_quantile():
    rng = np.random.default_rng(4)
    theirs = rng.normal(size=2000)
    record = measures.bootstrap_difference(lambda v: float(np.quantile(v, 0.95)), theirs + 0.5, theirs)
    assert record["difference"] == pytest.approx(0.5)
    assert record["low"] <= 0.5 + 1e-9
    assert record["high"] >= 0.5 - 1e-9


def test_pooled_difference_narrows_with_the_root_of_the_scenes():
    record = {"delta": 0.01, "se": 0.02}
    pooled = measures.pooled_difference([record] * 4)
    assert pooled["delta"] == pytest.approx(0.01)
    assert pooled["se"] == pytest.approx(0.01)


def test_slope_through_the_origin_weighs_by_certainty():
    slope, error = measures.slope_through(np.array([-0.02, 0.01]), np.array([0.06, -0.03]), np.array([0.01, 0.01]))
    assert slope == pytest.approx(-3.0)
    assert error == pytest.approx(0.01 / math.hypot(0.02, 0.01))
    slope, _ = measures.slope_through(np.array([0.01, 0.02]), np.array([0.01, 0.2]), np.array([1e-6, 1.0]))
    assert slope == pytest.approx(1.0, rel=1e-3)


def test_fall_of_the_median_covers_the_true_value_as_often_as_it_says():
    """Depths of first order in the step with noise of their own: two halvings divide their median by four."""
    rng, covered = np.random.default_rng(6), 0
    for _ in range(300):
        coarse = rng.lognormal(0.0, 0.5, 200)
        record = measures.fall_of_median(coarse, 0.25 * coarse * rng.lognormal(0.0, 0.3, 200), 2)
        covered += record["low"] <= 2.0 <= record["high"]
    assert 0.91 < covered / 300 < 0.99


def test_pooled_fall_of_the_same_scene_twice_is_the_scene_with_less_noise():
    row = {"factor": 1.9, "se": 0.02}
    pooled = measures.pooled_fall([row, row])
    assert pooled["factor"] == pytest.approx(1.9)
    assert math.log(pooled["high"] / pooled["low"]) == pytest.approx(2 * 1.96 * 0.02 / math.sqrt(2), rel=1e-3)
