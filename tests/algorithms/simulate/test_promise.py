"""Two errors combined: compared with closed forms and with brute force."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_algorithms.simulate.promise import (
    TAIL,
    Between,
    logs_for,
    sampling_of,
    sigma_for,
    sigma_of,
    together_of,
)
from deadwood_algorithms.stats.statistics import Z_95, wilson_interval


def test_without_a_bound_it_is_the_usual_interval_and_with_a_large_one_one_side_alone_can_fail():
    assert together_of(Between(0.0), 0.01, risk=0.05) == pytest.approx(Z_95 * 0.01, rel=1e-6)
    assert together_of(Between(0.5), 0.001, risk=0.05) == pytest.approx(0.5 + 1.644854 * 0.001, rel=1e-9)
    assert together_of(Between(0.02), 0.0) == 0.02
    assert together_of(Between(0.0), 0.01, risk=0.025) == pytest.approx(2.241403 * 0.01, rel=1e-6)


@pytest.mark.parametrize("bound", [0.0, 0.3, 1.0, 3.0])
def test_it_is_the_point_within_which_95_of_100_fall(bound):
    """By drawing: 3 standard errors of a share of 0.95 of 400 000 are 0.001."""
    drawn = np.abs(np.random.default_rng(1).normal(bound, 1.0, 400_000))
    together = together_of(Between(bound), 1.0, risk=0.05)
    assert (drawn <= together).mean() == pytest.approx(0.95, abs=0.0011)
    assert max(bound, Z_95) <= together + 1e-6
    assert together <= bound + Z_95 + 1e-6
    assert together < together_of(Between(bound), 1.0)  # a promise is slightly conservative


@pytest.mark.parametrize("bound", [0.0, 0.004, 0.008, 0.0099])
def test_what_is_left_for_sampling_brings_both_together_to_the_error(bound):
    sigma = sigma_for(0.01, Between(bound))
    assert together_of(Between(bound), sigma) == pytest.approx(0.01, rel=1e-9)
    assert sigma_for(0.01, Between(0.01)) == sigma_for(0.01, Between(0.02)) == 0.0


@pytest.mark.parametrize("between", [Between(0.0, 0.5, 3.0), Between(1.0, 2.0, 2.0), Between(-2.0, 0.1, 6.0)])
@pytest.mark.parametrize("sigma", [0.0, 1.0, 4.0])
def test_over_slopes_of_a_kind_95_of_100_are_within(between, sigma):
    """By drawing slopes, a tenth of them from the tail, and a run of each."""
    rng, n = np.random.default_rng(2), 400_000
    spread = np.where(rng.random(n) < TAIL, between.tail, between.usual)
    off = between.mean + spread * rng.standard_normal(n) + sigma * rng.standard_normal(n)
    together = together_of(between, sigma, risk=0.05)
    assert (np.abs(off) <= together).mean() == pytest.approx(0.95, abs=0.0011)
    assert sigma_for(together, between, risk=0.05) == pytest.approx(sigma, abs=0.01 * max(together, 1.0))


def test_a_tail_that_no_number_of_logs_can_make_up_for_leaves_nothing_for_sampling():
    assert sigma_for(0.05, Between(0.0, 0.01, 0.2)) == 0.0
    assert sigma_for(0.05, Between(0.0, 0.001, 0.02)) > 0.02


@pytest.mark.parametrize("share", [0.0, 0.003, 0.2, 0.5, 0.999])
def test_the_number_of_logs_is_the_smallest_that_does(share):
    logs = logs_for(0.004, share)
    assert logs is not None
    assert sigma_of(share, logs) <= 0.004 < sigma_of(share, logs - 1)
    assert logs_for(0.004, share, logs) == logs
    assert logs_for(0.004, share, logs - 1) is None
    assert logs_for(0.0, share) is None


def test_of_lopsided_intervals_the_farther_end_counts():
    low, high = wilson_interval(1, 100)
    assert sampling_of(1, 100) == high - 0.01 > 0.01 - low
    assert sampling_of(0, 100) == pytest.approx(Z_95**2 / (100 + Z_95**2))
    assert sampling_of(0, 0) == 1.0
