"""Poisson resamples: their distribution, which log a draw belongs to, and the coverage of their intervals."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_algorithms.stats.resampling import RESAMPLES, halves, resamples


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


def test_of_few_logs_a_resample_without_any_has_no_value():
    """One resample of three logs in twenty is empty."""
    assert any(not times.any() for times in resamples(np.arange(3), 0))
