"""The random surface of a terrain model's errors: its deviation, its correlation, and that no window changes it."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_algorithms.evaluate.sensitivity.noise import error_surface


@pytest.mark.parametrize(("cell", "length"), [(1.0, 4.0), (0.5, 3.3), (2.0, 2.0)])
def test_deviation_and_correlation(cell, length):
    """40 surfaces of 120 x 120 cells hold thousands of independent patches: means are within 0.05."""
    found = np.stack([error_surface((120, 120), (0, 0), cell, length, 1, k) for k in range(40)])
    assert abs(found.mean()) < 0.05
    assert found.std() == pytest.approx(1.0, abs=0.03)
    assert np.std(found, axis=0).mean() == pytest.approx(1.0, abs=0.05)  # equal everywhere
    for lag in (1, 2, 4):
        expected = np.exp(-((lag * cell / length) ** 2))
        for one, other in (
            (found[:, lag:], found[:, :-lag]),
            (found[:, :, lag:], found[:, :, :-lag]),
        ):
            assert np.mean(one * other) == pytest.approx(expected, abs=0.05)
    across = np.mean(found[:, 1:, 1:] * found[:, :-1, :-1])
    assert across == pytest.approx(np.exp(-2.0 * (cell / length) ** 2), abs=0.05)


def test_a_window_gets_what_the_whole_gets():
    whole = error_surface((60, 80), (0, 0), 0.7, 3.1, 9, 4)
    part = error_surface((20, 31), (37, 25), 0.7, 3.1, 9, 4)
    assert np.array_equal(part, whole[25:45, 37:68])


def test_seeds_and_numbers_are_other_surfaces():
    one = error_surface((40, 40), (0, 0), 1.0, 3.0, 1, 0)
    for seed, number in ((2, 0), (1, 1)):
        other = error_surface((40, 40), (0, 0), 1.0, 3.0, seed, number)
        assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 0.3
