"""A point cloud made ready: its mass and axes, its turns, and where it is put. Its hull: ``test_hull``."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from deadwood_engine import Scene, Shape
from deadwood_engine.cloud import lift_cloud, matrix_of, to_world
from deadwood_engine.log_body import AXIAL, BASE_RADIUS, CENTRE, LENGTH, MASS, REACH, SKEW, TRANSVERSE
from deadwood_engine.terrain import surfaces_at

SIDES = np.array([0.6, 1.0, 2.2])


def box(turn=None, sides=SIDES, at=(0.0, 0.0, 0.0)):
    ticks = np.linspace(-0.5, 0.5, 3)
    grid = np.array(np.meshgrid(ticks, ticks, ticks)).reshape(3, -1).T * sides
    return Shape.of((grid if turn is None else turn.apply(grid)) + at)


def turned(seed):
    return Rotation.from_quat(np.random.default_rng(seed).normal(size=4))


def rotation(quaternion):
    """Of the engine's quaternions, whose real part comes first."""
    return Rotation.from_quat(np.roll(quaternion, -1, axis=-1))


@pytest.mark.parametrize("seed", [None, 0, 1, 2])
def test_a_turned_box_has_the_box_s_moments_about_its_own_axes(seed):
    """m (b2 + c2) / 12 about each; e3 has the least, and points along the cloud's +z; the axes are right-handed."""
    turn = None if seed is None else turned(seed)
    shape = box(turn, at=(3.0, -2.0, 5.0))
    assert shape.volume == pytest.approx(SIDES.prod())
    assert shape.centre == pytest.approx((3.0, -2.0, 5.0))
    of_side = (SIDES @ SIDES - SIDES**2) / 12.0
    assert sorted(shape.inertia) == pytest.approx(sorted(of_side))
    assert shape.inertia.argmin() == 2
    assert shape.axes @ shape.axes.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(shape.axes) == pytest.approx(1.0)
    assert shape.axes[2, 2] >= 0.0
    long = np.eye(3)[2] if turn is None else turn.apply([0.0, 0.0, 1.0])
    assert abs(shape.axes[:, 2] @ long) == pytest.approx(1.0)
    # its points in the body frame: about the centre, and as large along each axis as the moments say
    size = np.ptp(shape.cloud.corners, axis=0)
    assert (size @ size - size**2) / 12.0 == pytest.approx(shape.inertia)
    assert shape.cloud.corners.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    assert shape.cloud.thickness == pytest.approx(0.3)
    assert (len(shape.cloud.points), shape.inside) == (26, 1)


def test_an_axis_that_is_principal_is_kept():
    """A log as ``make-log`` draws it lies as it was drawn: nothing is turned that need not be."""
    assert np.array_equal(box().axes, np.eye(3))
    assert np.array_equal(box(sides=np.array([1.0, 1.0, 1.0])).axes, np.eye(3))
    assert np.array_equal(box(sides=np.array([2.0, 1.0, 0.5])).axes[:, 2], [1.0, 0.0, 0.0])


def test_no_number_is_no_place():
    with pytest.raises(ValueError, match="not a finite number"):
        Shape.of(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, np.nan]]))


def test_the_body_table_is_of_the_shape():
    shape = box()
    body = shape.bodies(np.array([2000.0, 2700.0]))
    assert body[:, MASS] == pytest.approx(SIDES.prod() * np.array([2000.0, 2700.0]))
    a1, a2, c = shape.inertia
    assert body[0, [TRANSVERSE, AXIAL, SKEW]] == pytest.approx((a2, c, 1.0 / a1 - 1.0 / a2))
    assert body[0, REACH] == pytest.approx(np.linalg.norm(SIDES) / 2)
    assert body[0, [LENGTH, CENTRE]] == pytest.approx((2.2, 1.1))
    assert body[0, BASE_RADIUS] == pytest.approx(np.hypot(0.3, 0.5))
    assert box(sides=np.array([1.0, 1.0, 3.0])).bodies(np.ones(1))[0, SKEW] == 0.0  # exactly: it is a symmetric top


@pytest.mark.parametrize("seed", range(5))
def test_it_faces_the_given_direction(seed):
    """Its quaternions turn the body; seen from the cloud's own coordinates, x and z point as asked."""
    turn = turned(seed)
    shape = box(turned(seed + 50))
    x, z = turn.apply([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    found = rotation(shape.facing(x[None], z[None]))
    # the body's axes in the world are those of the cloud, turned
    assert found.as_matrix()[0] @ shape.axes.T == pytest.approx(turn.as_matrix(), abs=1e-12)
    given = np.roll(turn.as_quat(), 1)[None]
    assert rotation(shape.turned(given)).as_matrix()[0] == pytest.approx(turn.as_matrix() @ shape.axes, abs=1e-12)


def test_the_matrix_turns_as_the_quaternion():
    rng = np.random.default_rng(0)
    for _ in range(20):
        state, p = np.zeros(16), rng.normal(size=3)
        state[3:7] = rng.normal(size=4)
        state[3:7] /= np.linalg.norm(state[3:7])
        turn = np.full(20, np.nan)
        matrix_of(state, turn, 7)
        assert np.isnan(np.delete(turn, range(7, 16))).all()
        assert turn[7:16].reshape(3, 3) == pytest.approx(rotation(state[3:7]).as_matrix(), abs=1e-14)
        assert to_world(turn, 7, p) == pytest.approx(rotation(state[3:7]).apply(p), abs=1e-14)


def test_it_is_put_on_the_ground_with_its_lowest_point():
    """The least vertical gap of its points to rough ground is the requested one, in every log's own frame."""
    rng = np.random.default_rng(4)
    terrain = Scene.prepare(rng.random((30, 30)), 1.0, 0.0, 0.0, friction=0.3).arrays.terrain
    shape, number = box(), 6
    frame = rng.integers(5, 20, (number, 2))
    state = np.zeros((number, 16))
    state[:, :2], state[:, 2] = rng.uniform(0.0, 1.0, (number, 2)), 77.0
    state[:, 3:7] = np.roll(Rotation.from_quat(rng.normal(size=(number, 4))).as_quat(), 1, axis=1)
    drop = rng.uniform(-0.2, 2.0, number)
    lift_cloud(terrain, shape.cloud, frame, state, drop, np.zeros(9))
    for k in range(number):
        points = rotation(state[k, 3:7]).apply(shape.cloud.points) + state[k, :3] + (*frame[k], 0.0)
        assert (points[:, 2] - surfaces_at(terrain, points[:, :2])[:, 0]).min() == pytest.approx(drop[k], abs=1e-9)
