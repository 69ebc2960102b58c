"""All contacts of a pose: what is not looked at, because it is known to be far away, is never missed.

The kernels run as Python here. Their parts: ``test_rings``, ``test_narrow_phase``, ``test_cores``.
"""

import math

import numpy as np
import pytest

from deadwood_engine import Barriers, Blocks, LyingLogs, Scene, Shape, Trees
from deadwood_engine.cores import BARRIER
from deadwood_engine.log_body import BASE_RADIUS, CENTRE, LENGTH, cone_bodies
from deadwood_engine.model import Log, Model, Settings, Span
from deadwood_engine.scratch import Scratch
from deadwood_engine.surroundings import know_nothing

DT = 0.01
STATIONS = 13
SETTINGS = Settings(DT, 0.05, 1.0, 1e-3, 400, 1.0, 0.0, 9.0, 0.1, 9.81, 0.3, 3, False, 0.1, -1.0, 0.0, -1.0, 0.0)
LOG = cone_bodies(np.array([0.5]), np.array([6.0]), np.array([400.0]))[0]
WHERE = Log(np.zeros(2, np.int64), LOG, STATIONS)
SIZE = 60.0


def scene_of(*kinds):
    rng = np.random.default_rng(1)
    parts = {}
    if "all" in kinds:
        x, y = rng.uniform(2.0, SIZE - 2.0, (2, 60))
        parts["trees"] = Trees(x, y, rng.uniform(0.2, 0.6, 60), rng.choice([0.5, 12.0], 60))
        parts["barriers"] = Barriers(np.array([[5.0, 30.0], [40.0, 31.0]]), np.array([0, 2]), np.array([1.0]))
        parts["lying_logs"] = LyingLogs(
            np.array([[10.0, 10.0], [16.0, 14.0]]), np.array([0, 2]), np.array([0.4]), np.array([0.3])
        )
        parts["blocks"] = Blocks(np.array([45.0]), np.array([45.0]), np.array([1.5]), np.array([1.0]))
    if "far" in kinds:  # first out of the list's margin, then across the way
        parts["trees"] = Trees(np.full(116, 23.0), np.arange(1.0, 59.0, 0.5), np.full(116, 0.4), np.full(116, 9.0))
    heights = 0.3 * rng.random((int(2 * SIZE), int(2 * SIZE)))
    return Scene.prepare(heights, 0.5, 0.0, 0.0, friction=0.4, reference=0.0, **parts)


def way(seed, number=120):
    """Poses of a log that bounds over the ground, turning as it goes: (state, most that it has moved)."""
    rng = np.random.default_rng(seed)
    centre = np.array([*rng.uniform(10.0, 15.0, 2), 0.9])
    ahead, turn = rng.uniform(0.1, 0.9), rng.uniform(0.0, 2 * np.pi)
    ends = None
    for k in range(number):
        turn += 0.03 * rng.normal()
        axis = np.array([np.cos(turn), np.sin(turn), 0.25 * np.sin(0.2 * k)])
        axis /= np.linalg.norm(axis)
        state = np.zeros(16)
        state[:3], state[13:16] = centre, axis
        now = [centre + s * axis for s in (-LOG[CENTRE], LOG[LENGTH] - LOG[CENTRE])]
        moved = 0.0 if ends is None else max(np.linalg.norm(a - b) for a, b in zip(now, ends, strict=True))
        ends = now
        yield state, moved
        centre = centre + 0.2 * np.array([np.cos(ahead), np.sin(ahead), 0.0])
        centre[2] = 1.9 + 1.6 * np.cos(0.15 * k + 1.0)


def told(scratch, count):
    names = ("rx", "ry", "rz", "nx", "ny", "nz", "room", "mu", "target")
    table = scratch.contacts[:count]
    return scratch.keys[:count].tolist(), [[c[name] for name in names] for c in table]


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("kind", ["open", "far", "all"])
def test_what_is_known_to_be_far_is_not_missed(plain, seed, kind):
    """A log that stores where no query is needed, beside one without that knowledge at any pose: the same contacts."""
    find = plain("detection").find_contacts
    model, rows = Model(*scene_of(kind).arrays, SETTINGS), 130
    knowing, fresh = (Scratch.allocate(STATIONS, rows, 1, None) for _ in range(2))
    know_nothing(knowing.near[0])
    path, contacts, blind = 0.0, 0, 0
    for state, moved in way(seed):
        path += moved
        know_nothing(fresh.near[0])
        found = []
        for scratch in (knowing, fresh):
            near = scratch.near[0]
            blind += scratch is knowing and path + SETTINGS.travel < near.obstacles_wake
            # no step is taken: the log stands at the pose, but for the gravity of DT
            count, travel, whole = find(model, WHERE, state, scratch, Span(DT, path, 5e-4), True)
            assert whole
            assert travel > 0.0
            found.append(told(scratch, count))
        assert found[0] == found[1]
        contacts += len(found[0][0])
    assert contacts > 20
    assert blind > 5 or kind == "open"


def test_without_obstacles_a_step_is_bound_by_none(plain):
    scratch = Scratch.allocate(STATIONS, 0, 1, None)
    know_nothing(scratch.near[0])
    state = next(way(0))[0]
    state[2] = 9.0
    model = Model(*scene_of().arrays, SETTINGS)
    found = plain("detection").find_contacts(model, WHERE, state, scratch, Span(DT, 0.0, 0.0), True)
    assert found == (0, math.inf, True)


def test_obstacles_are_left_out_where_they_are_not_requested(plain):
    """As where the ground alone is asked whether it holds a log at rest."""
    model, state = Model(*scene_of("all").arrays, SETTINGS), np.zeros(16)
    state[:3], state[13] = (22.0, 30.5, 0.8), 1.0  # in the barrier
    kinds = []
    for obstacles in (True, False):
        scratch = Scratch.allocate(STATIONS, 80, 1, None)
        know_nothing(scratch.near[0])
        count, *_ = plain("detection").find_contacts(model, WHERE, state, scratch, Span(DT, 0.0, 0.0), obstacles)
        kinds.append(set(scratch.keys[:count, 0].tolist()))
    assert BARRIER in kinds[0]
    assert kinds[1] <= {0}


def test_what_is_no_barrier_is_numbered_behind_the_trees(plain):
    scene = scene_of("all").arrays
    for row, core in enumerate(scene.cores.solid):
        is_barrier, item = plain("detection").owner_of(scene.cores, (core.kind, row, 0))
        assert is_barrier == (core.kind == BARRIER)
        assert item == core.owner


@pytest.mark.parametrize("height", [0.0, 2.0])
def test_the_lowest_gap_is_that_of_the_cone_or_of_the_cloud(plain, height):
    """Over level ground: the base of a level log, 5 cm lower where its tip is raised by as much; a box's face."""
    scene = Scene.prepare(np.zeros((60, 60)), 0.5, 0.0, 0.0, friction=0.4, reference=0.0)
    state = np.zeros(16)
    state[:4], state[13] = (15.0, 15.0, LOG[BASE_RADIUS] + height, 1.0), 1.0
    gap = plain("detection").lowest_gap
    scratch = Scratch.allocate(STATIONS, 0, 1, None)
    assert gap(Model(*scene.arrays, SETTINGS), WHERE, state, scratch) == pytest.approx(height)
    box = Shape.of(np.array(np.meshgrid([0, 0.5], [0, 0.6], [0, 0.4])).reshape(3, -1).T)
    model, log = (
        Model(*scene.arrays._replace(cloud=box.cloud), SETTINGS),
        WHERE._replace(body=box.bodies(np.ones(1))[0]),
    )
    state[3:7] = box.turned(np.array([[1.0, 0.0, 0.0, 0.0]]))[0]
    scratch = Scratch.allocate(STATIONS, 0, 1, box.cloud)
    expected = max(0.0, LOG[BASE_RADIUS] + height - 0.2)
    assert gap(model, log, state, scratch) == pytest.approx(expected)
