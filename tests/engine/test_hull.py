"""Convex hulls against SciPy's, and mass properties of solids with closed forms."""

import numpy as np
import pytest

from deadwood_engine import Shape
from deadwood_engine.hull import hull_of, of_triangles


def box(*sides):
    return np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * sides


def rings(vertices, number=31, length=30.0, base=0.375, tip=0.1875):
    turn, share = 2 * np.pi * np.arange(vertices) / vertices, np.linspace(0, 1, number)[:, None]
    radius = base + (tip - base) * share
    ring = np.stack(
        [radius * np.cos(turn), radius * np.sin(turn), np.broadcast_to(length * share, (number, vertices))], -1
    )
    return ring.reshape(-1, 3)


def rotation(seed):
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.linalg.det(q)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("number", [4, 12, 300])
def test_random_clouds_have_scipys_hull(seed, number):
    spatial = pytest.importorskip("scipy.spatial")
    points = np.random.default_rng(seed).normal(size=(number, 3)) * (1, 5, 0.2) + 7
    hull, other = hull_of(points), spatial.ConvexHull(points)
    assert set(hull.corners) == set(other.vertices)
    volume, _, _ = of_triangles(points, hull.triangles)
    assert volume == pytest.approx(other.volume, rel=1e-12)
    assert (points @ hull.normals.T <= hull.offsets + 1e-9).all()
    assert len(hull.corners) - len(hull.edges) + len(hull.normals) == 2  # Euler


def test_a_grid_of_points_is_a_box_of_six_faces():
    grid = np.array(np.meshgrid(*[np.linspace(0, 1, 6)] * 3)).reshape(3, -1).T @ rotation(0).T + 100
    hull = hull_of(grid)
    assert (len(hull.corners), len(hull.normals), len(hull.edges)) == (8, 6, 12)
    for normal, offset, loop in zip(hull.normals, hull.offsets, hull.loops, strict=True):
        face = grid[hull.corners[loop]]
        assert np.abs(face @ normal - offset).max() < 1e-9
        assert np.cross(face[1] - face[0], face[2] - face[1]) @ normal > 0  # counterclockwise from outside


@pytest.mark.parametrize("vertices", [3, 8, 32])
def test_rings_along_a_cone_leave_its_two_end_rings(vertices):
    hull = hull_of(rings(vertices) @ rotation(1).T)
    assert (len(hull.corners), len(hull.normals), len(hull.edges)) == (2 * vertices, vertices + 2, 3 * vertices)


@pytest.mark.parametrize(
    "points",
    [np.zeros((0, 3)), np.zeros((9, 3)), np.outer(np.arange(9), [1, 2, 3]), box(1, 2, 0), box(1, 2, 1e-8), np.eye(3)],
)
def test_a_cloud_without_volume_is_refused(points):
    with pytest.raises(ValueError, match="no volume"):
        hull_of(points)


@pytest.mark.parametrize("sides", [(1.0, 1.0, 1.0), (2.0, 1.0, 0.5), (0.5, 0.5, 4.0), (0.3, 2.0, 2.0)])
@pytest.mark.parametrize("turned", [False, True])
def test_a_box(sides, turned):
    """V = abc; moments m (b2 + c2) / 12; the longest side is e3, whatever way the cloud was turned and moved."""
    points = box(*sides) @ (rotation(3) if turned else np.eye(3)).T + (5, -3, 11)
    shape = Shape.of(points)
    assert shape.volume == pytest.approx(np.prod(sides), rel=1e-12)
    assert shape.centre == pytest.approx([5, -3, 11], abs=1e-12)
    squares = np.array(sides) ** 2
    assert np.sort(shape.inertia) == pytest.approx(np.sort((squares.sum() - squares) / 12), rel=1e-12)
    assert shape.inertia[2] == pytest.approx(min(shape.inertia), rel=1e-6)
    assert np.linalg.det(shape.axes) == pytest.approx(1.0)
    assert np.ptp(shape.cloud.points, axis=0)[2] == pytest.approx(max(sides), rel=1e-9) or len(set(sides)) < 3
    if not turned and sides[0] == sides[1] == sides[2]:
        assert np.array_equal(shape.axes, np.eye(3))  # a cube lies as it was drawn


@pytest.mark.parametrize("vertices", [8, 16, 64])
def test_rings_come_to_the_cone(vertices):
    """An n-gon's area is (n / 2 pi) sin(2 pi / n) of the circle's; the moments converge to the cone's likewise."""
    from deadwood_engine.log_body import AXIAL, CENTRE, MASS, TRANSVERSE, cone_bodies

    shape = Shape.of(rings(vertices))
    cone = cone_bodies(np.array([0.75]), np.array([30.0]), np.array([1.0]))[0]
    share = vertices / (2 * np.pi) * np.sin(2 * np.pi / vertices)
    assert shape.volume == pytest.approx(share * cone[MASS], rel=1e-10)
    assert shape.centre == pytest.approx([0, 0, cone[CENTRE]], abs=1e-9)
    assert shape.inertia[2] == pytest.approx(cone[AXIAL] * (2 + np.cos(2 * np.pi / vertices)) / 3, rel=1e-9)
    assert shape.inertia[0] == pytest.approx(cone[TRANSVERSE], rel=2e-3)
    assert len(shape.cloud.points) == 31 * vertices  # every ring touches the ground
    assert shape.inside == 0
    assert shape.bodies(np.array([300.0]))[0, 7] == 0.0  # a symmetric top
    assert Shape.of(np.vstack([rings(vertices), [[0, 0, 5.0]]])).inside == 1
