"""Contacts of a cloud's points with the ground, one by one against NumPy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from deadwood_engine import Scene, Shape
from deadwood_engine.cores import TREE
from deadwood_engine.model import Log, Model, Settings
from deadwood_engine.rotation import set_axis
from deadwood_engine.scratch import Scratch
from deadwood_engine.terrain import surfaces_at

DT, G = 0.02, 9.81


@pytest.fixture(scope="module")
def cloud():
    ticks = np.linspace(-0.5, 0.5, 3)
    return Shape.of(np.array(np.meshgrid(ticks, ticks, ticks)).reshape(3, -1).T * [0.8, 1.0, 1.4])


@pytest.fixture(scope="module")
def scene():
    """Rough ground whose friction differs from cell to cell."""
    rng = np.random.default_rng(1)
    return Scene.prepare(
        0.4 * rng.random((30, 30)), 1.0, 0.0, 0.0, friction=rng.uniform(0.2, 0.8, (30, 30)), reference=0.0
    )


def body_at(height, seed=0, plan=(14.3, 15.2), velocity=(3.0, -2.0, -4.0), spin=(1.0, -2.0, 0.5)):
    state = np.zeros(16)
    state[:3], state[7:10], state[10:13] = (*plan, height), velocity, spin
    state[3:7] = np.random.default_rng(seed).normal(size=4)
    set_axis(state)
    return state


def matrix(state):
    return Rotation.from_quat(np.roll(state[3:7], -1)).as_matrix()


def found(plain, scene, cloud, state, slip=0.0):
    """The contacts with the ground of a step: (records, keys, whether there is terrain below all of it)."""
    scratch = Scratch.allocate(8, 1, 1, cloud.cloud)
    step = plain("contacts").Ahead(DT, G, DT, 0.0, -1.0, 0.1)
    law = Settings(DT, 0.2, 1.0, 1e-3, 400, 1.0, 0.0, 9.0, 0.1, G, 0.3, 3, False, 0.1, -1.0, 0.0, -1.0, 0.0)
    law = law._replace(friction_max=2.0, friction_kappa=1.0 if slip else 0.0)
    scratch.way[0].slip = slip
    body = cloud.bodies(np.array([2000.0]))[0]
    model = Model._make((*scene.arrays._replace(cloud=cloud.cloud), law))
    log = Log(np.zeros(2, np.int64), body, 0)
    count, whole = plain("cloud_contacts").cloud_terrain_contacts(model, log, state, scratch, step)
    return scratch.contacts[:count], scratch.keys[:count], whole, scratch


@pytest.mark.parametrize("seed", range(6))
def test_every_point_that_would_be_below_the_ground_is_a_contact(plain, scene, cloud, seed):
    """A step of free motion ahead: which points, the ground's normal and friction there; the lever half way."""
    state = body_at(0.9, seed)
    table, keys, whole, scratch = found(plain, scene, cloud, state.copy())
    ahead = state.copy()
    ahead[9] -= 0.5 * G * DT
    plain("asymmetric_top").move_freely(ahead, cloud.bodies(np.ones(1))[0], DT)
    points = cloud.cloud.points
    there = ahead[:3] + points @ matrix(ahead).T
    ground = surfaces_at(scene.arrays.terrain, there[:, :2])
    gaps = there[:, 2] - ground[:, 0]
    assert whole
    assert keys[:, 1].tolist() == np.flatnonzero(gaps < 0.0).tolist()
    assert len(table) > 0
    assert (keys[:, [0, 2]] == 0).all()
    trial = scratch.trial[0]
    assert (trial.x, trial.y, trial.z, trial.dx, trial.dy, trial.dz) == pytest.approx((*ahead[:3], *ahead[13:16]))
    for c, (_, k, _) in zip(table, keys, strict=True):
        normal = np.array([-ground[k, 1], -ground[k, 2], 1.0])
        assert (c.nx, c.ny, c.nz) == pytest.approx(normal / np.linalg.norm(normal))
        lever = 0.5 * (matrix(state) + matrix(ahead)) @ points[k]
        assert (c.rx, c.ry, c.rz) == pytest.approx(lever)
        # a corner turns with the body: its lever has its part along the axis, and no moment resists its rolling
        assert (c.rnx, c.rny, c.rnz) == pytest.approx(np.cross(lever, normal / np.linalg.norm(normal)))
        assert c.roll == 0.0
        assert c.mu == scene.arrays.terrain.friction[tuple(np.floor(there[k, 1::-1] + 0.5).astype(int))]


def test_over_the_border_the_rest_is_looked_at(plain, scene, cloud):
    table, _, whole, _ = found(plain, scene, cloud, body_at(0.3, plan=(0.2, 15.0), velocity=(0, 0, 0)))
    assert not whole
    assert 0 < len(table) < 26
    assert not found(plain, scene, cloud, body_at(9.0, plan=(-3.0, 15.0)))[2]


@pytest.mark.parametrize(
    ("height", "plan", "seed"), [(3.0, (14.3, 15.2), 0), (1.4, (8.1, 9.9), 1), (0.2, (8.1, 9.9), 1)]
)
def test_clearance_is_that_of_the_lowest_point_along_the_normal(plain, scene, cloud, height, plan, seed):
    state = body_at(height, seed, plan)
    there = state[:3] + cloud.cloud.points @ matrix(state).T
    ground = surfaces_at(scene.arrays.terrain, there[:, :2])
    gaps = (there[:, 2] - ground[:, 0]) / np.sqrt(1.0 + ground[:, 1] ** 2 + ground[:, 2] ** 2)
    clear = plain("cloud_contacts").cloud_clearance
    told = clear(cloud.cloud, scene.arrays.terrain, np.zeros(2, np.int64), state, np.zeros(18))
    assert told == pytest.approx(max(0.0, gaps.min()), abs=1e-12)
    assert (told == 0.0) == (height == 0.2)
    state[0] = -50.0
    assert clear(cloud.cloud, scene.arrays.terrain, np.zeros(2, np.int64), state, np.zeros(18)) == 0.0


def test_after_slip_the_ground_holds_more(plain, scene, cloud):
    """Friction of every contact from the ground's towards the most, by the same share; all else is the same."""
    before, after = (found(plain, scene, cloud, body_at(0.9), slip)[0].copy() for slip in (0.0, 1.0))
    assert after["mu"] == pytest.approx(0.5 * (before["mu"] + 2.0))  # kappa is 1/m
    assert (after["gap"] == before["gap"]).all()
    assert len(before) > 3


@pytest.mark.parametrize("friction", [0.45, -1.0])
def test_an_obstacle_s_contact_is_at_the_point_ahead(plain, scene, cloud, friction):
    """Its lever is the predicted one; below 0 its friction is the ground's there."""
    state, (_, _, _, scratch) = body_at(5.0), found(plain, scene, cloud, body_at(5.0))
    step = plain("contacts").Ahead(DT, G, DT, 0.3, friction, 0.0)
    p, n, trial = (14.0, 15.0, 5.2), (0.0, 1.0, 0.0), scratch.trial[0]
    file = plain("cloud_contacts")
    query = file.CloudQuery(cloud.cloud, scene.arrays.terrain, np.zeros(2, np.int64), scratch, state)
    count = file.touch_cloud(query, 0, step, (TREE, 4, 1), p, n, -0.03)
    c = scratch.contacts[0]
    assert count == 1
    assert scratch.keys[0].tolist() == [TREE, 4, 1]
    assert (c.rx, c.ry, c.rz) == pytest.approx((14.0 - trial.x, 15.0 - trial.y, 5.2 - trial.z))
    assert (c.nx, c.ny, c.nz) == n
    assert c.mu == (0.45 if friction > 0.0 else scene.arrays.terrain.friction[15, 14])
