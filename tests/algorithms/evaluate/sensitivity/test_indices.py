"""Indices against functions whose indices are known, and against draws whose truth is known."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_algorithms.evaluate.sensitivity.design import cube, latin_hypercube, rows_of_design, sobol_sequence
from deadwood_algorithms.evaluate.sensitivity.factors import Factor
from deadwood_algorithms.evaluate.sensitivity.indices import in_order, indices_of, rows_drawn, weights_of
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.stats.resampling import RESAMPLES, resamples


def ishigami(u: np.ndarray) -> np.ndarray:
    x = np.pi * (2.0 * u - 1.0)
    return np.sin(x[..., 0]) + 7.0 * np.sin(x[..., 1]) ** 2 + 0.1 * x[..., 2] ** 4 * np.sin(x[..., 0])


def ishigami_indices() -> tuple[np.ndarray, np.ndarray, float]:
    """Closed forms (Ishigami & Homma 1990): first-order, total, variance."""
    a, b, pi = 7.0, 0.1, np.pi
    one = 0.5 * (1.0 + b * pi**4 / 5.0) ** 2
    two = a**2 / 8.0
    both = b**2 * pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    variance = one + two + both
    return np.array([one, two, 0.0]) / variance, np.array([one + both, two, both]) / variance, variance


WEIGHTS = np.array([0.0, 0.5, 3.0, 9.0, 99.0])


def sobol_g(u: np.ndarray) -> np.ndarray:
    return np.prod((np.abs(4.0 * u - 2.0) + WEIGHTS) / (1.0 + WEIGHTS), axis=-1)


def sobol_g_indices() -> tuple[np.ndarray, np.ndarray, float]:
    """Closed forms (Saltelli & Sobol' 1995)."""
    alone = 1.0 / (3.0 * (1.0 + WEIGHTS) ** 2)
    variance = np.prod(1.0 + alone) - 1.0
    total = alone * np.prod(1.0 + alone) / (1.0 + alone)
    return alone / variance, total / variance, float(variance)


KNOWN = {"ishigami": (ishigami, 3, ishigami_indices), "sobol g": (sobol_g, 5, sobol_g_indices)}


def found_for(function, factors: int, design: str, rows: int, seed: int, count: int = 200):
    a, b = cube(design, rows, factors, seed)
    mixed = np.stack([np.where(np.arange(factors) == k, b, a) for k in range(factors)])
    weights = weights_of(np.array([0]), seed, count)
    of_a, of_b, of_mixed = (function(u)[..., None] for u in (a, b, mixed))
    return indices_of(of_a, of_b, of_mixed, weights, rows_drawn(rows, seed, count))


@pytest.mark.parametrize("name", KNOWN)
@pytest.mark.parametrize(("design", "off"), [("sobol", 0.03), ("latin", 0.06)])
def test_the_indices_of_functions_that_are_known(name, design, off):
    """4096 rows: an estimate's standard error is about 1/sqrt(4096) = 0.016 times the scatter of its terms, 1 to 2."""
    function, factors, known = KNOWN[name]
    first, total, variance = known()
    found = found_for(function, factors, design, 4096, seed=1)
    assert found.first == pytest.approx(first, abs=off)
    assert found.total == pytest.approx(total, abs=off)
    assert found.variance == pytest.approx(variance, rel=2 * off)


@pytest.mark.parametrize("name", KNOWN)
def test_the_intervals_hold_what_is_known(name):
    """60 designs of 256 rows: at least 85 % of their 95 % intervals contain the truth (3 sd of 60 draws is 8.4 %)."""
    function, factors, known = KNOWN[name]
    first, total, _ = known()
    held = np.zeros((2, factors))
    for seed in range(60):
        found = found_for(function, factors, "latin", 256, seed)
        for row, (low, high), truth in (
            (0, found.first_interval, first),
            (1, found.total_interval, total),
        ):
            held[row] += (low <= truth) & (truth <= high)
    assert (held / 60 >= 0.85).all(), held / 60


def test_a_factor_that_does_nothing_has_nothing():
    found = found_for(lambda u: u[..., 0] ** 2, 2, "latin", 64, seed=3)
    assert found.total[1] == 0.0
    assert found.total_interval[:, 1].tolist() == [0.0, 0.0]
    assert found.total[0] == pytest.approx(1.0, abs=0.3)


def noisy(rng: np.random.Generator, rows: int, logs: int) -> tuple[np.ndarray, ...]:
    """Logs that reach with 0.3 + 0.4 u0 + 0.1 u1 + 0 u2: half of the logs keep their coin, half toss again in each run,
    as chaotic ones do. The shares of the explainable variance: 16/17, 1/17 and 0."""
    a, b = (latin_hypercube(rows, 3, int(rng.integers(2**31))) for _ in range(2))
    mixed = np.stack([np.where(np.arange(3) == k, b, a) for k in range(3)])
    kept = rng.random(logs)

    def reach(u: np.ndarray) -> np.ndarray:
        p = 0.3 + 0.4 * u[..., 0] + 0.1 * u[..., 1]
        coins = np.where(np.arange(logs) % 2, kept, rng.random((*p.shape, logs)))
        return (coins < p[..., None]).astype(float)

    return reach(a), reach(b), reach(mixed)


def test_the_noise_of_the_logs_is_taken_off():
    """Otherwise the factor without effect has an index of 0.1 and more: half of 0.25/50, of a variance of 0.0142."""
    rng = np.random.default_rng(5)
    rows, logs = 64, 50
    found, held, raw = [], np.zeros(3), []
    truth = np.array([16.0, 1.0, 0.0]) / 17.0
    for seed in range(60):
        a, b, mixed = noisy(rng, rows, logs)
        one = indices_of(a, b, mixed, weights_of(np.arange(logs), seed, 200), rows_drawn(rows, seed, 200))
        found.append(one.total)
        held += (one.total_interval[0] <= truth) & (truth <= one.total_interval[1])
        raw.append(0.5 * np.mean((mixed[2].mean(axis=1) - a.mean(axis=1)) ** 2) / one.variance)
    mean, error = np.mean(found, axis=0), np.std(found, axis=0) / np.sqrt(60)
    assert np.mean(raw) > 0.1
    assert (np.abs(mean - truth) < 3.0 * error + 0.02).all(), (mean, error)  # 0.02: a ratio of estimates is biased
    assert (held / 60 >= 0.85).all(), held / 60


def test_an_outcome_that_does_not_vary_has_no_indices():
    values = np.random.default_rng(2).random((2, 32, 40)) < 0.5
    a, b = values.astype(float)
    mixed = (np.random.default_rng(3).random((2, 32, 40)) < 0.5).astype(float)
    found = indices_of(a, b, mixed, weights_of(np.arange(40), 0), rows_drawn(32, 0))
    assert found.variance_ci_low <= 0.0 <= found.variance_ci_high
    assert np.isnan(found.total).all()
    assert np.isnan(found.first_interval).all()
    none = indices_of(a * 0.0, b * 0.0, mixed * 0.0, weights_of(np.arange(40), 0), rows_drawn(32, 0))
    assert np.isnan(none.total).all()


def test_each_strip_of_a_latin_hypercube_has_one_point():
    points = latin_hypercube(50, 4, seed=7)
    assert (np.sort(np.floor(points * 50).astype(int), axis=0) == np.arange(50)[:, None]).all()
    assert np.abs(np.corrcoef(points.T) - np.eye(4)).max() < 0.5  # 50 points: sd 0.14
    assert not np.array_equal(points, latin_hypercube(50, 4, seed=8))


def test_sobols_sequence_wants_a_power_of_two_and_scipy(monkeypatch):
    with pytest.raises(UserError, match="give 32 or 64"):
        sobol_sequence(48, 4, 0)
    assert np.array_equal(sobol_sequence(32, 4, 1), sobol_sequence(32, 4, 1))
    monkeypatch.setitem(__import__("sys").modules, "scipy.stats", None)
    with pytest.raises(UserError, match=r"deadwood-toolbox\[sobol\]"):
        sobol_sequence(32, 4, 0)


def test_the_variance_is_that_of_all_runs_of_both_samples():
    """The second sample scatters three times as much as the first, by chance of few rows; all logs count equally."""
    rng = np.random.default_rng(12)
    a, b = rng.normal(0.0, 1.0, (6, 1)), rng.normal(1.0, 3.0, (6, 1))
    found = indices_of(a, b, np.stack([b]), weights_of(np.arange(1), 0, 50), rows_drawn(6, 0, 50))
    assert found.variance == pytest.approx(np.concatenate([a, b]).var(ddof=1))
    assert found.mean == pytest.approx(np.concatenate([a, b]).mean())


def test_a_resample_of_one_log_counts_all_once():
    """The noise of a mean needs two logs; a resample of three has fewer in one case of five."""
    drawn = weights_of(np.arange(3), 0)
    assert drawn.shape == (3, RESAMPLES)
    assert drawn.sum(axis=0).min() >= 2.0
    plain = np.stack(list(resamples(np.arange(3), 0)), axis=1)
    few = plain.sum(axis=0) < 2
    assert few.any()
    assert (drawn[:, few] == 1.0).all()
    assert np.array_equal(drawn[:, ~few], plain[:, ~few])


def test_the_rows_of_the_design_by_hand():
    """A factor from B, the others from A; the surface of the terrain's error goes with the row of its own column."""
    factors = [Factor("friction", 0.0, 1.0), Factor("dem_noise_m", 0.0, 10.0)]
    a, b = np.array([[0.1, 0.2], [0.3, 0.4]]), np.array([[0.5, 0.6], [0.7, 0.8]])
    found = rows_of_design(factors, a, b)
    shown = [(each.label, *each.values.values(), each.surface) for each in found]
    assert shown == [
        ("A 1", pytest.approx(0.1), pytest.approx(2.0), 1), ("A 2", pytest.approx(0.3), pytest.approx(4.0), 2),
        ("B 1", pytest.approx(0.5), pytest.approx(6.0), 3), ("B 2", pytest.approx(0.7), pytest.approx(8.0), 4),
        ("A, friction of B 1", pytest.approx(0.5), pytest.approx(2.0), 1),
        ("A, friction of B 2", pytest.approx(0.7), pytest.approx(4.0), 2),
        ("A, dem_noise_m of B 1", pytest.approx(0.1), pytest.approx(6.0), 3),
        ("A, dem_noise_m of B 2", pytest.approx(0.3), pytest.approx(8.0), 4),
    ]  # fmt: skip


def test_no_factor_accounts_for_more_alone_than_with_others():
    """An additive function: both indices of a factor are one number, so that half of the estimates cross by chance.

    Both become a mean of the two, between them; no resample crosses, and one that is not crossed is left as it was.
    """
    first, total = np.array([0.9, 0.2, 0.3]), np.array([0.7, 0.4, 0.3])
    one, other = in_order(first, total, np.array([0.03, 1.0, 0.0]), np.array([0.01, 1.0, 0.0]))
    assert one == pytest.approx([0.75, 0.2, 0.3])  # three parts of the more exact one
    assert other == pytest.approx([0.75, 0.4, 0.3])
    crossed = 0
    for seed in range(20):
        found = found_for(lambda u: u[..., 0] + u[..., 1], 2, "latin", 32, seed)
        crossed += int(found.crossed.sum())
        assert (found.first <= found.total + 1e-12).all()
        assert (found.first_interval <= found.total_interval + 1e-12).all()
        assert ((found.total_interval[0] <= found.total) | (found.total > 1.0)).all()
    assert crossed >= 10
