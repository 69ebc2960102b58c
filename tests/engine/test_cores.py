"""All obstacles in one table: the cores near a log against every core looked at, and whose friction is whose."""

from types import SimpleNamespace

import numpy as np
import pytest

from deadwood_engine import Barriers, Blocks, LyingLogs, Scene, Trees
from deadwood_engine.cores import BARRIER, BLOCK, CORE, LYING, TREE, lay_out, near, skin_of


@pytest.fixture(scope="module")
def scene() -> Scene:
    rng = np.random.default_rng(3)

    def places(number):
        return rng.uniform(5.0, 95.0, (number, 2))

    lying, plates = places(20), places(12)
    (tree_x, tree_y), (block_x, block_y) = places(60).T, places(15).T
    lying[1::2] = lying[::2] + rng.uniform(1, 4, (10, 2))
    return Scene.prepare(
        np.zeros((101, 101)), 1.0, 0.0, 0.0, friction=0.3,
        trees=Trees(tree_x, tree_y, rng.uniform(0.1, 1.0, 60), np.full(60, 20.0)),
        lying_logs=LyingLogs(lying, 2 * np.arange(11), np.full(10, 0.5), np.full(10, 0.3)),
        barriers=Barriers(plates, 2 * np.arange(7), np.full(6, 2.0)),
        blocks=Blocks(block_x, block_y, np.full(15, 2.0), np.full(15, 1.5)),
    )  # fmt: skip


def test_what_is_no_barrier_is_numbered_after_the_trees(scene):
    solid = scene.arrays.cores.solid
    owners = {kind: set(solid.owner[solid.kind == kind].tolist()) for kind in (TREE, BARRIER, LYING, BLOCK)}
    assert owners == {
        TREE: set(range(60)), LYING: set(range(60, 70)), BLOCK: set(range(70, 85)), BARRIER: set(range(6)),
    }  # fmt: skip


@pytest.mark.parametrize("seed", range(10))
def test_no_core_in_reach_of_a_log_is_left_out(scene, seed):
    rng = np.random.default_rng(seed)
    cores = scene.arrays.cores
    listed, table = np.zeros(500, np.int64), np.zeros(500, CORE).view(np.recarray)
    frame = rng.integers(10, 90, 2)
    base = rng.uniform(0.0, 1.0, 2)
    tip = base + rng.uniform(-10.0, 10.0, 2)
    reach = rng.uniform(0.1, 3.0)
    count = near(cores, frame, 1.0, listed, table, (tuple(base), tuple(tip)), reach)
    assert (np.diff(listed[:count]) > 0).all()
    # brute force: least distance in plan of both axes on dense grids, less the core's widest radius
    log = frame + base + np.linspace(0, 1, 201)[:, None] * (tip - base)
    for item in range(len(cores.solid)):
        core = cores.solid[item]
        start = cores.node[item] + (core.x, core.y)
        line = start + np.linspace(0, core.long, 101)[:, None] * (core.ux, core.uy)
        wide = max(core.wide, core.wide + core.slope * core.long)
        gap = np.linalg.norm(log[:, None] - line[None], axis=2).min() - wide
        if gap < reach - 0.05:  # the grids' coarseness
            assert item in listed[:count]
        if gap > reach + 0.05:
            assert item not in listed[:count], "listed though it is out of reach"
    rows = np.arange(count)
    assert np.allclose(table.x[rows] + frame[0], cores.node[listed[rows], 0] + cores.solid.x[listed[rows]])


def test_a_point_has_a_direction_all_the_same():
    core = lay_out(BLOCK, np.array([7]), np.zeros((1, 3)), np.zeros((1, 3)), np.ones(1), np.zeros(1))[0]
    assert (core["ux"], core["uy"], core["uz"], core["long"]) == (0.0, 0.0, 1.0, 0.0)
    assert (core["kind"], core["owner"]) == (BLOCK, 7)


def test_wood_is_wood_and_boulders_are_ground():
    laws = SimpleNamespace(
        tree_friction=0.6, tree_restitution=0.1, barrier_friction=0.5, barrier_restitution=0.2, restitution=0.3
    )
    skin = getattr(skin_of, "py_func", skin_of)
    assert skin(laws, TREE) == skin(laws, LYING) == (0.6, 0.1)
    assert skin(laws, BARRIER) == (0.5, 0.2)
    assert skin(laws, BLOCK) == (-1.0, 0.3)  # below 0: the ground's where it lies
