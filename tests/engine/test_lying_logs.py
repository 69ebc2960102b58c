"""How a stiff log lies on a profile, against every pair of points that could bear it."""

import numpy as np
import pytest

from deadwood_engine import LyingLogs, Scene
from deadwood_engine.lying_logs import rest_line


@pytest.mark.parametrize("seed", range(50))
def test_it_lies_on_two_points_on_either_side_of_its_middle(seed):
    """Of all lines that no point rises above, the rest line is the one that is lowest at the middle."""
    rng = np.random.default_rng(seed)
    number = rng.integers(3, 30)
    share = np.sort(np.concatenate([[0.0, 1.0], rng.random(number)]))
    height = rng.standard_normal(share.size) * rng.choice([0.01, 1.0])
    low, high = rest_line(share, height)
    line = low + (high - low) * share
    assert (line - height).min() > -1e-12
    assert np.sum(np.abs(line - height) < 1e-9) >= 2
    least = np.inf
    for i in range(share.size):
        for j in range(i + 1, share.size):
            rise = (height[j] - height[i]) / (share[j] - share[i]) if share[j] > share[i] else np.inf
            if np.isfinite(rise) and (height[i] + rise * (share - share[i]) >= height - 1e-12).all():
                least = min(least, height[i] + rise * (0.5 - share[i]))
    assert 0.5 * (low + high) == pytest.approx(least, abs=1e-9)


def test_over_one_point_it_is_level():
    assert rest_line(np.array([0.4]), np.array([2.5])) == (2.5, 2.5)


def test_all_points_on_one_side_of_the_middle_bear_it_by_their_last_edge():
    low, high = rest_line(np.array([0.0, 0.2, 0.4]), np.array([1.0, 0.0, 0.6]))
    assert low == pytest.approx(1.0)
    assert high == pytest.approx(0.0)


@pytest.mark.parametrize("tangent", [0.0, 0.7])
def test_a_tapering_log_touches_a_plane_with_its_whole_side(tangent):
    """Its axis is a radius off the plane at both ends, square to it."""
    heights = tangent * np.arange(41.0)[None, :] * np.ones((41, 1))
    log = LyingLogs(np.array([[10.0, 20.0], [22.0, 20.0]]), np.array([0, 2]), np.array([0.8]), np.array([0.4]))
    core = Scene.prepare(heights, 1.0, 0.0, 0.0, friction=0.3, lying_logs=log).arrays.cores.solid
    assert len(core) == 1
    at = np.array([0.0, core.long[0]])
    x, z = 10.0 + core.ux[0] * at, core.z[0] + core.uz[0] * at
    off = (z - tangent * x) / np.hypot(1.0, tangent)
    assert off == pytest.approx([0.4, 0.2], abs=1e-6)
    assert core.wide[0] + core.slope[0] * at == pytest.approx([0.4, 0.2], abs=1e-12)
