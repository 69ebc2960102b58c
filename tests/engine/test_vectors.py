"""Vectors against numpy, and the nearest points of two segments against a dense search."""

import numpy as np
import pytest

from deadwood_engine.vectors import across, axes_nearest, blend, cross, dot, minus, norm, point


def test_sums_and_products_are_numpys():
    rng = np.random.default_rng(1)
    for a, b in rng.standard_normal((20, 2, 3)):
        assert cross(a, b) == pytest.approx(np.cross(a, b), abs=1e-15)
        assert dot(a, b) == pytest.approx(a @ b, abs=1e-15)
        assert norm(a) == pytest.approx(np.linalg.norm(a), abs=1e-15)
        assert minus(a, b) == pytest.approx(a - b, abs=1e-15)
        assert point(a, 2.5, b) == pytest.approx(a + 2.5 * b, abs=1e-15)
        assert blend(-0.5, a, 3.0, b) == pytest.approx(-0.5 * a + 3.0 * b, abs=1e-15)


def test_across_is_square_to_both_and_of_length_one_also_where_they_are_parallel():
    rng = np.random.default_rng(2)
    pairs = [each / np.linalg.norm(each, axis=1)[:, None] for each in rng.standard_normal((50, 2, 3))]
    pairs += [np.array([axis, sign * axis]) for axis in np.eye(3) for sign in (1.0, -1.0)]
    pairs += [np.array([d, d + 1e-12]) for d, _ in pairs[:10]]
    for d, u in pairs:
        n = np.array(across(d, u))
        assert np.linalg.norm(n) == pytest.approx(1.0, abs=1e-12)
        assert abs(n @ d) < 1e-9
        if np.linalg.norm(np.cross(d, u)) > 1e-6:
            assert abs(n @ u) < 1e-9


@pytest.mark.parametrize("seed", range(20))
def test_nearest_points_of_two_segments(seed):
    """No pair on a dense grid of both is nearer; also of parallel segments, of a point, and where an end is nearest."""
    rng = np.random.default_rng(seed)
    d, along = (each / np.linalg.norm(each) for each in rng.standard_normal((2, 3)))
    if seed % 4 == 3:
        along = d
    c, start = rng.standard_normal((2, 3)) * 4.0
    back, front, long = -rng.uniform(0, 5), rng.uniform(0, 5), rng.choice([0.0, 1.0, 8.0])
    s, z = axes_nearest(c, d, back, front, start, along, long)
    assert back <= s <= front
    assert 0.0 <= z <= long
    ways = np.linspace(back, front, 401)[:, None, None], np.linspace(0.0, long, 401)[None, :, None]
    least = np.linalg.norm(c + ways[0] * d - start - ways[1] * along, axis=2).min()
    found = np.linalg.norm(c + s * d - start - z * along)
    assert found <= least + 1e-9
