"""The bilinear surface: exact on what is bilinear, registered at cell centres, nothing outside."""

import numpy as np
import pytest

from deadwood_engine import Scene
from deadwood_engine.terrain import KINK, prepare, surface

NODE = np.zeros(2, np.int64)  # the DEM's first node (column, row)


def scene_of(function, *, cell=0.5, size=12, x0=100.0, y0=200.0):
    axis = np.arange(size) * cell
    heights = function(x0 + axis[None, :], y0 + axis[:, None])
    return Scene.prepare(heights, cell, x0, y0, friction=0.3)


def test_bilinear_is_exact_with_heights_at_cell_centres():
    """z = xy is bilinear: the surface must be it everywhere. A half-cell shift would err by 0.25 (x + y)."""
    scene = scene_of(lambda x, y: (x - 100) * (y - 200) * 4)  # multiples of one: exact in float32
    rng = np.random.default_rng(0)
    x, y = 100 + 5.5 * rng.random(200), 200 + 5.5 * rng.random(200)
    found = scene.terrain_surface(x, y)
    u, v = x - 100, y - 200
    assert found[:, 0] == pytest.approx(4 * u * v, abs=1e-11)
    assert found[:, 1] == pytest.approx(4 * v, abs=1e-11)
    assert found[:, 2] == pytest.approx(4 * u, abs=1e-11)


def test_outside_and_nodata_are_nothing():
    heights = np.zeros((6, 6))
    heights[2, 3] = np.nan
    scene = Scene.prepare(heights, 1.0, 0.0, 0.0, friction=0.3)
    inside = scene.terrain_height(np.array([0.0, 4.9, 0.5]), np.array([0.0, 4.9, 3.5]))
    assert np.all(inside == 0)
    x = np.array([-1e-9, 5.0, 2.5, 3.5, 3.0, np.inf, 1e300])
    y = np.array([0.0, 1.0, 1.5, 2.5, 2.0, 1.0, 1.0])
    assert np.isnan(scene.terrain_height(x, y)).all()


def test_continuous_across_cell_borders():
    rng = np.random.default_rng(1)
    terrain = prepare(rng.random((8, 8)), 1.0, 0.0, 0.0, 0.2)
    for y in rng.random(50) * 6.9:
        for x in range(1, 6):
            left, right = surface(terrain, 0, 0, x - 1e-13, y)[0], surface(terrain, 0, 0, float(x), y)[0]
            assert left == pytest.approx(right, abs=1e-12)


@pytest.mark.parametrize("cell", [0.1, 0.25, 0.5, 2.0])
def test_kinks_bound_every_rise_over_the_tangent_plane(cell):
    """Rings are passed over on the kinks' word, so nowhere as far as they reach may the ground rise higher."""
    rng = np.random.default_rng(2)
    heights = cell * rng.random((48, 48)) * np.repeat([0.1, 3.0, 30.0], 16)[:, None]
    heights[20:22, 30] = np.nan
    terrain = prepare(heights, cell, 0.0, 0.0, 0.2)
    assert terrain.kink_reach == pytest.approx(max(cell, 0.5))
    worst = -np.inf
    for _ in range(20_000):
        x, y = rng.uniform(terrain.kink_reach, 47 * cell - terrain.kink_reach, 2)
        h, gx, gy = surface(terrain, 0, 0, x, y)
        dx, dy = rng.uniform(-terrain.kink_reach, terrain.kink_reach, 2) * rng.choice([0.1, 1.0])
        there = surface(terrain, 0, 0, x + dx, y + dy)[0]
        rise = there - (h + gx * dx + gy * dy)
        packed = int(terrain.kinks[int(y / cell), int(x / cell)])
        bound = KINK * ((packed & 0xFFFF) * abs(dx) + (packed >> 16) * abs(dy))
        assert not rise > bound + 1e-5 * cell
        worst = max(worst, rise / bound if bound > 0.1 * cell else 0.0)
    # a bound so loose that it never comes close would cull nothing; over eleven cells of noise few ways come as close
    assert worst > (0.8 if cell >= 0.5 else 0.6)


@pytest.mark.parametrize(
    ("heights", "cell", "friction", "says"),
    [
        (np.zeros((1, 5)), 1.0, 0.2, "2 x 2"),
        (np.full((4, 4), np.nan), 1.0, 0.2, "no valid height"),
        (np.zeros((4, 4)), 0.0, 0.2, "cell size"),
        (np.zeros((4, 4)), 1.0, -0.1, "negative"),
        (np.zeros((4, 4)), 1.0, np.zeros((2, 3)), "shape"),
    ],
)
def test_impossible_terrain_is_refused(heights, cell, friction, says):
    with pytest.raises(ValueError, match=says):
        Scene.prepare(heights, cell, 0.0, 0.0, friction=friction)
