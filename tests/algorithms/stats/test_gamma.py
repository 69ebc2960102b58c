"""Quantiles of gamma distributions and Fay and Feuer's interval: against sums of Poisson probabilities."""

from __future__ import annotations

import math

import numpy as np
import pytest

from deadwood_algorithms.stats.gamma import SIDE, gamma_bounds, probability_below, relative_quantile


def poisson_below(k: int, mean: float) -> float:
    """Probability of fewer than k."""
    return math.fsum(math.exp(j * math.log(mean) - mean - math.lgamma(j + 1)) for j in range(k))


@pytest.mark.parametrize("shape", [1, 2, 3, 7, 30, 200, 900, 1500])
def test_quantiles_of_whole_shapes_are_those_of_poisson_counts(shape):
    """A gamma variable of shape k is below x exactly when a Poisson count of mean x is k or more."""
    for upper, level in ((False, SIDE), (True, 1.0 - SIDE)):
        x = shape * float(relative_quantile(np.array(float(shape)), upper=upper))
        spread = math.sqrt(shape)
        steep = (poisson_below(shape, x) - poisson_below(shape, x + 1e-4 * spread)) / 1e-4
        assert abs(1.0 - poisson_below(shape, x) - level) < 1e-4 * max(steep, 1e-3)  # x is right to 1e-4 spreads


def test_the_incomplete_gamma_function_has_its_closed_forms():
    for x in (1e-3, 0.5, 3.0, 40.0):
        assert probability_below(1.0, x) == pytest.approx(-math.expm1(-x), rel=1e-13)
        assert probability_below(0.5, x) == pytest.approx(math.erf(math.sqrt(x)), rel=1e-13)
    assert probability_below(2.0, 0.0) == 0.0


def test_counts_of_one_weight_have_the_exact_interval_of_poisson():
    low, high = gamma_bounds(np.array([0.0, 1.0, 10.0]), np.array([0.0, 1.0, 10.0]), 1.0)
    assert low == pytest.approx([0.0, 0.0253178, 4.7953887], rel=1e-4)  # Garwood 1936
    assert high == pytest.approx([3.6888795, 5.5716434, 18.3903560], rel=1e-4)


def test_the_unit_of_the_weights_does_not_matter():
    one, other = gamma_bounds(3.0, 4.0, 2.0), gamma_bounds(3e-3, 4e-6, 2e-3)
    assert np.array(other) == pytest.approx(1e-3 * np.array(one), rel=1e-12)
