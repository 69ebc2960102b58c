"""What of a hull is below a plane, seen along a line, against SciPy; and the depth of a scar."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from deadwood_engine import Shape
from deadwood_engine.scarring import area_below, scar_depth


def unit(rng):
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


@pytest.mark.parametrize("seed", range(40))
def test_the_area_below_a_plane_is_that_of_the_shadow_of_what_is_cut_off(seed):
    """The shadow of a convex body is the hull of its corners' shadows: those below, and where edges cross."""
    rng = np.random.default_rng(seed)
    cloud = Shape.of(rng.normal(size=(4 + seed, 3)) * rng.uniform(0.2, 2.0, 3)).cloud
    n, along = unit(rng), unit(rng)
    heights = cloud.corners @ n
    p = rng.uniform(heights.min(), heights.max()) * n + np.cross(n, rng.normal(size=3))
    level = p @ n
    cut = [cloud.corners[heights < level]]
    for a, b in cloud.edges:
        if (heights[a] < level) != (heights[b] < level):
            share = (level - heights[a]) / (heights[b] - heights[a])
            cut.append((cloud.corners[a] + share * (cloud.corners[b] - cloud.corners[a]))[None])
    u = np.cross(along, [1.0, 0.0, 0.0])
    u /= np.linalg.norm(u)
    shadow = np.vstack(cut) @ np.column_stack([u, np.cross(along, u)])
    expected = ConvexHull(shadow).volume if len(shadow) > 2 else 0.0
    assert area_below(cloud, cloud.corners, tuple(p), tuple(n), tuple(along)) == pytest.approx(expected, rel=1e-9)


def test_above_the_plane_there_is_nothing_and_below_it_all():
    cube = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    cloud = Shape.of(cube).cloud
    down, across = (0.0, 0.0, -1.0), (np.sqrt(0.5), np.sqrt(0.5), 0.0)
    for height, share in ((-0.6, 0.0), (0.6, 1.0), (0.0, 0.5)):
        p = (7.0, -3.0, height)
        assert area_below(cloud, cloud.corners, p, (0.0, 0.0, 1.0), across) == pytest.approx(share * np.sqrt(2.0))
        assert area_below(cloud, cloud.corners, p, (0.0, 0.0, 1.0), down) == pytest.approx(float(share > 0.0))


def test_the_depth_grows_as_equation_11_has_it():
    """0.1 m at 1 kg, 1 kN/m2 and 1 m/s; with the cube root of the mass, and so on."""
    assert scar_depth(1.0, -1.0, 1.0) == pytest.approx(0.1)
    assert scar_depth(8.0, 1.0, 1.0) == pytest.approx(0.2)
    assert scar_depth(1.0, 32.0, 1.0) == pytest.approx(0.1 * 2.0**4)
    assert scar_depth(1.0, 1.0, 32.0) == pytest.approx(0.1 / 4.0)
    # the rock of Chant Sura, 780 kg, where the scar was 0.15 m deep in ground of 15 MN/m2: it must have fallen at
    # 12.7 m/s, and Table 2 has 10.7 m/s at a place 'on the ballistic trajectory' before
    assert scar_depth(780.0, 12.7, 15_000.0) == pytest.approx(0.15, rel=0.01)
