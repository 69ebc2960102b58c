"""Poisson resamples: their distribution, which log a draw belongs to, and the coverage of their intervals."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_algorithms.stats.resampling import RESAMPLES, bootstrap_interval, halves, resamples


def test_each_log_counts_a_poisson_number_of_times():
    """Shares of 0, 1, 2, 3 in 200 000 draws, within 4 standard errors (at most 0.0045); logs are independent."""
    times = np.array(list(resamples(np.arange(1000), 5, 200)))
    assert times.shape == (200, 1000)
    for k, share in enumerate((0.36788, 0.36788, 0.18394, 0.06131)):
        assert np.mean(times == k) == pytest.approx(share, abs=4.0 * np.sqrt(share / times.size))
    assert times.sum(axis=1).std() == pytest.approx(np.sqrt(1000.0), rel=0.2)  # of 200: 5 % standard error
    assert times.sum(axis=0).std() == pytest.approx(np.sqrt(200.0), rel=0.1)


def test_draws_belong_to_the_log_and_the_seed():
    ids = np.array([7, 2**40, 3, 11])
    one, other = list(resamples(ids, 1)), list(resamples(ids[::-1], 1))
    assert len(one) == RESAMPLES
    assert all(np.array_equal(a, b[::-1]) for a, b in zip(one, other, strict=True))
    assert not np.array_equal(np.array(one), np.array(list(resamples(ids, 2))))
    assert len(list(resamples(ids, 1, 3))) == 3
    masks = np.array(list(halves(np.arange(500), 1, 100)))
    assert masks.mean() == pytest.approx(0.5, abs=0.01)


def test_the_interval_of_a_mean_is_the_textbooks():
    rng = np.random.default_rng(2)
    values = rng.gamma(2.0, 3.0, 600)
    low, high = bootstrap_interval(lambda rows: float(values[rows].mean()), np.arange(600), 0)
    half = 1.96 * values.std() / np.sqrt(600.0)
    # 400 resamples: each end is uncertain by about 0.1 half-widths (three of them allowed)
    assert low == pytest.approx(values.mean() - half, abs=0.3 * half)
    assert high == pytest.approx(values.mean() + half, abs=0.3 * half)


def test_intervals_of_a_quantile_range_cover_it():
    """200 samples of 150 normal numbers: the range from 5 to 95 % is 3.2897. The percentile interval of a tail's
    quantile covers slightly less than nominal; 0.88 is 3 standard errors below 0.93."""
    rng = np.random.default_rng(7)
    held = 0
    for repeat in range(200):
        values = rng.standard_normal(150)
        low, high = bootstrap_interval(
            lambda rows, v=values: float(np.ptp(np.quantile(v[rows], [0.05, 0.95]))), np.arange(150), repeat
        )
        held += low <= 3.2897 <= high
    assert 0.88 <= held / 200 <= 0.99


def test_a_statistic_without_a_value_has_no_interval():
    assert np.isnan(bootstrap_interval(lambda rows: float("nan"), np.arange(5), 0)).all()


def test_of_few_logs_a_resample_without_any_has_no_value():
    """One resample of three logs in twenty is empty; its quantile caused a traceback in compare-scenarios."""
    assert any(not times.any() for times in resamples(np.arange(3), 0))
    values = np.array([1.0, 5.0, 9.0])
    low, high = bootstrap_interval(lambda rows: float(np.quantile(values[rows], 0.95)), np.arange(3), 0)
    assert 1.0 <= low < high <= 9.0
