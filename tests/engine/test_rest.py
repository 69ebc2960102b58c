"""What holds a log at rest, and that logs come to rest."""

import math

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, STOP_REASONS, Logs, Scene, Trees, slide
from deadwood_engine.contacts import CONTACT, KEY_WIDTH, TERRAIN
from deadwood_engine.cores import BARRIER, TREE
from deadwood_engine.rest import HELD_BY_BARRIER, HELD_BY_TREE, REST, holder
from deadwood_engine.scratch import Scratch

MU_STEM = 0.4


def forest(stems=60):
    """A rough slope of 35 degrees, 60 x 80 m, with stems in random places."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[0:160, 0:120] * 0.5
    heights = 0.7 * y + 0.3 * np.sin(x / 1.7) * np.cos(y / 2.3) + 0.05 * rng.random(x.shape)
    place = rng.uniform((3.0, 3.0), (57.0, 60.0), (stems, 2))
    trees = Trees(place[:, 0], place[:, 1], rng.uniform(0.2, 0.8, stems), np.full(stems, 25.0))
    return Scene.prepare(heights, 0.5, 0.0, 0.0, friction=0.3, trees=trees)


def logs(number):
    rng = np.random.default_rng(4)
    return Logs.alike(
        rng.uniform(20, 40, number), rng.uniform(66, 72, number), orientation=1,
        azimuth=rng.uniform(0, 2 * np.pi, number), diameter=0.5, length=12.0,
    )  # fmt: skip


def held(scene, *contacts):
    """``holder`` of contacts (kind, row among the cores, P_N, P_T, P_U)."""
    scratch = Scratch.allocate(8, len(scene.arrays.cores.solid), 1, None)
    scratch = scratch._replace(
        contacts=np.zeros(len(contacts), CONTACT).view(np.recarray), keys=np.zeros((len(contacts), KEY_WIDTH), np.int64)
    )
    for k, (kind, row, *impulse) in enumerate(contacts):
        scratch.keys[k] = kind, row, 0
        c = scratch.contacts[k]
        (c.pn, c.pt, c.pu), c.mu = impulse, MU_STEM
    return holder(scene.arrays.cores, scratch.contacts, scratch.keys, len(contacts))


def test_grip_is_the_angle_that_the_push_of_one_stem_has_left():
    """Of 3 and 1 across on 10 and 10 it is atan(0.4) - atan(0.2); along the normal all of the cone is left."""
    scene = forest()
    reason, row, grip = held(scene, (TREE, 5, 10.0, 3.0, 0.0), (TREE, 5, 10.0, 0.0, -1.0), (TERRAIN, 0, 9.0, 2.0, 0.0))
    assert (reason, row) == (HELD_BY_TREE, scene.arrays.cores.solid[5]["owner"])
    assert grip == pytest.approx(math.atan(MU_STEM) - math.atan(0.2))
    assert held(scene, (TREE, 5, 10.0, 0.0, 0.0))[2] == pytest.approx(math.atan(MU_STEM))
    assert held(scene, (TREE, 5, 10.0, 2.4, 3.2))[2] == pytest.approx(0.0)  # at its edge


def test_what_is_held_by_more_than_one_stem_has_no_grip():
    scene = forest()
    assert math.isnan(held(scene, (TREE, 5, 10.0, 3.0, 0.0), (TREE, 6, 1.0, 0.0, 0.0))[2])
    assert math.isnan(held(scene, (TREE, 5, 1.0, 3.0, 0.0), (BARRIER, 6, 10.0, 0.0, 0.0))[2])
    assert held(scene, (TREE, 5, 1.0, 3.0, 0.0), (BARRIER, 6, 10.0, 0.0, 0.0))[0] == HELD_BY_BARRIER
    assert held(scene, (TERRAIN, 0, 10.0, 1.0, 0.0))[0] == REST
    assert math.isnan(held(scene, (TERRAIN, 0, 10.0, 1.0, 0.0))[2])
    # a stem that touches without a push holds nothing
    assert held(scene, (TREE, 5, 10.0, 0.0, 0.0), (TREE, 6, 0.0, 0.0, 0.0))[2] == pytest.approx(math.atan(MU_STEM))


def test_grips_are_those_of_logs_that_trees_hold():
    """None is beyond its cone; some logs are held near its edge and some well within, so both kinds are seen."""
    result = slide(forest(), logs(200), FIDELITIES["standard"], time_limit=120.0, rolling_friction=0.1)
    by_tree = result.stop_reason == HELD_BY_TREE
    known = np.isfinite(result.grip)
    assert 30 < by_tree.sum() < 200
    assert not (known & ~by_tree).any()
    assert known[by_tree].mean() > 0.3
    assert result.grip[known].min() > -1e-3  # the solver's tolerance
    assert result.grip[known].max() <= math.atan(0.3) + 1e-12
    near = (result.grip[known] < math.radians(5.0)).mean()
    assert 0.05 < near < 0.95


@pytest.mark.parametrize("name", ["draft", "standard"])
@pytest.mark.parametrize("restitution", [0.05, 0.2])
def test_logs_that_rebound_come_to_rest(name, restitution):
    """Before, any restitution let every solve begin from nothing, and at draft one log in fifteen to thirty crept on at
    the solver's tolerance, millimetres a second, to the time limit."""
    result = slide(
        forest(),
        logs(200),
        FIDELITIES[name],
        time_limit=120.0,
        restitution=restitution,
        rolling_friction=0.1,
        threads=2,
    )
    moving = result.stop_reason == STOP_REASONS.index("time_limit")
    assert moving.sum() == 0
