"""Trees that break, by single steps: the share of a push that takes just so much, and what is left out of a list."""

import math

import numpy as np
import pytest

from deadwood_engine import Scene, Trees
from deadwood_engine.contacts import CONTACT, KEY_WIDTH
from deadwood_engine.cores import CORE, LYING, TREE


def pushed(rng, number):
    """Contacts with one body of unit inertia, as a rigid tree ends them: each pushes against its approach."""
    table = np.zeros(number, CONTACT).view(np.recarray)
    for c in table:
        frame, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        r = rng.normal(size=3)
        for k, name in enumerate("ntu"):
            lever = np.cross(r, frame[:, k])
            for axis, value, arm in zip("xyz", frame[:, k], lever, strict=True):
                c[name + axis], c["r" + name + axis], c["b" + name + axis] = value, arm, arm
        c.tried_n, c.tried_t, c.tried_u = rng.uniform(0.5, 2.0), *rng.normal(0.0, 0.2, 2)
        c.pn, c.pt, c.pu = c.tried_n, c.tried_t, c.tried_u
    return table


def speeds(c, motion):
    """Velocities (n, t, u) of a contact's point; motion (6,)."""
    return (
        np.array([[c[name + axis] for axis in "xyz"] for name in "ntu"]) @ motion[:3]
        + np.array([[c["r" + name + axis] for axis in "xyz"] for name in "ntu"]) @ motion[3:]
    )


def impulse(c):
    """What a contact's rigid push changes of the velocities (6,)."""
    p = np.array([c.tried_n, c.tried_t, c.tried_u])
    turn = np.array([[c["b" + name + axis] for axis in "xyz"] for name in "ntu"])
    return np.concatenate([p @ np.array([[c[name + axis] for axis in "xyz"] for name in "ntu"]), p @ turn])


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("share", [1.0, 0.4])
def test_the_share_absorbs_the_requested_energy(plain, seed, share):
    """Of one or two contacts of a tree, whatever the share that acts now: the energy of the body falls by just that."""
    rng = np.random.default_rng(seed)
    table = pushed(rng, 1 + seed % 2)
    kick = np.sum([impulse(c) for c in table], axis=0)
    before = rng.normal(0.0, 0.1, 6) - 1.2 * kick  # an approach that the push about stops
    for c in table:
        c.before_n, c.before_t, c.before_u = speeds(c, before)
    most = -(before @ kick) - 0.5 * (kick @ kick)
    assert most > 0.0
    for part in (1e-6, 0.3, 0.999):
        state, whole = np.zeros(16), np.zeros(16)
        state[7:13], whole[7:13] = before + share * kick, kick
        s = plain("breaking").share_taking(table, (0, len(table)), state, whole, share, 0.0, part * most)
        after = before + s * kick
        assert 0.5 * (before @ before - after @ after) == pytest.approx(part * most, rel=1e-9)
        assert 0.0 < s <= 1.0


def test_no_share_takes_more_than_the_push_can(plain):
    rng = np.random.default_rng(3)
    table = pushed(rng, 1)
    kick = impulse(table[0])
    before = -1.2 * kick
    table[0].before_n, table[0].before_t, table[0].before_u = speeds(table[0], before)
    state, whole = np.zeros(16), np.zeros(16)
    state[7:13], whole[7:13] = before, kick
    share_taking = plain("breaking").share_taking
    assert share_taking(table, (0, 1), state, whole, 0.0, 0.0, 10.0 * (kick @ kick)) == -1.0
    state[7:13] = -before  # it goes away
    table[0].before_n, table[0].before_t, table[0].before_u = speeds(table[0], -before)
    assert share_taking(table, (0, 1), state, whole, 0.0, 0.0, 1e-3) == -1.0


def test_a_trees_contacts_come_last_and_keep_their_keys(plain):
    table, keys = np.zeros(6, CONTACT).view(np.recarray), np.zeros((6, KEY_WIDTH), np.int64)
    keys[:, 0], keys[:, 1], keys[:, 2] = (0, TREE, TREE, LYING, TREE, TREE), (7, 7, 4, 3, 7, 5), range(6)
    table["mu"] = np.arange(6.0)
    left = plain("breaking").put_last(table, keys, 6, 7, np.zeros(1, CONTACT).view(np.recarray))
    assert left == 4
    assert sorted(keys[left:, 2].tolist()) == [1, 4]  # the ground's slot 7 stays; a core's row is its own
    assert table["mu"].tolist() == keys[:, 2].tolist()
    assert sorted(keys[:, 2].tolist()) == list(range(6))
    spare = np.zeros(1, CONTACT).view(np.recarray)
    assert plain("breaking").put_last(table, keys, left, 3, spare) == 3
    assert keys[3, 2] == 3  # a lying log's likewise


def test_what_a_log_broke_is_left_out_of_what_is_near(plain):
    listed, table, gone = np.array([3, 8, 9, 12, 0, 0]), np.zeros(6, CORE), np.array([9, 3, 99])
    table["wide"][:4] = listed[:4]
    still_there = plain("cores").still_there
    assert still_there(listed.copy(), table.copy(), 4, gone, 0) == 4
    assert still_there(listed, table, 4, gone, 2) == 2
    assert listed[:2].tolist() == table["wide"][:2].tolist() == [8, 12]


def test_a_scene_keeps_what_each_tree_takes():
    trees = Trees(
        np.array([2.0, 99.0, 5.0]), np.full(3, 4.0), np.full(3, 0.5), np.full(3, 9.0), np.array([1e3, 2e3, 3e3])
    )
    ground = {"cell": 1.0, "x0": 0.0, "y0": 0.0, "friction": 0.3}
    scene = Scene.prepare(np.zeros((9, 9)), trees=trees, **ground)
    assert scene.arrays.cores.solid["capacity"].tolist() == [1e3, 3e3]  # the second stands on no terrain
    rigid = Scene.prepare(np.zeros((9, 9)), trees=trees._replace(capacity=None), **ground)
    assert np.isinf(rigid.arrays.cores.solid["capacity"]).all()
    again = rigid.with_trees(trees)
    assert again.arrays.cores.solid.tobytes() == scene.arrays.cores.solid.tobytes()
    for wrong in (0.0, -1.0, math.nan):
        with pytest.raises(ValueError, match="more than nothing"):
            Scene.prepare(np.zeros((9, 9)), trees=trees._replace(capacity=np.full(3, wrong)), **ground)


def test_trees_behind_others_keep_their_capacities():
    one, two = (Trees(*np.full((4, n), 1.0)) for n in (2, 1))
    assert one.then(two).capacity is None
    told = one.then(two._replace(capacity=np.array([5.0]))).capacity
    assert told is not None
    assert told.tolist() == [math.inf, math.inf, 5.0]
