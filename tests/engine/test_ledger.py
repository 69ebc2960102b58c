"""The ledger by single pushes: what is one hit, what is a blow, and where and how fast the first push was.

Momentum and energy of whole hits are held by slides (tests/physics/test_ledger.py).
"""

import math

import numpy as np
import pytest

from deadwood_engine import Scene, Trees
from deadwood_engine.contacts import CONTACT, KEY_WIDTH, TERRAIN
from deadwood_engine.cores import TREE
from deadwood_engine.ledger import (
    ANGLE,
    BLOW_X,
    BLOW_Z,
    ENERGY,
    FIRST,
    HEIGHT,
    HIT_WIDTH,
    ITEM,
    LAST,
    PLACE,
    SPEED,
    TAKEN,
    hits_of,
    note_pushes,
)  # fmt: skip
from deadwood_engine.limits import HIT_PAUSE
from deadwood_engine.model import Log, Model, Settings
from deadwood_engine.scratch import Scratch

DT, G = 0.01, 9.81
FALL = 0.5 * G * DT
SETTINGS = Settings(DT, 0.2, 1.0, 1e-3, 400, 1.0, 0.0, 9.0, 0.1, G, 0.3, 3, False, 0.1, -1.0, 0.0, -1.0, 0.0)


@pytest.fixture(scope="module")
def scene():
    """Level ground at 2 m, and five stems."""
    trees = Trees(np.arange(5.0) + 3.0, np.full(5, 4.0), np.full(5, 0.5), np.full(5, 9.0))
    return Scene.prepare(np.full((12, 12), 2.0), 1.0, 0.0, 0.0, friction=0.3, trees=trees, reference=0.0).arrays


def pushes(scene, hits, number, time, *contacts, velocity=(-6.0, 0.0, -FALL), step=1, energy=18.0):
    """Enter contacts (stem, P_N, speed along the normal before and after, gap) whose normal is east; returns how many.

    A stem of -1 is the ground.
    """
    state, free = np.zeros(16), np.zeros(6)
    state[:3], state[13] = (5.0, 4.0, 3.0), 1.0
    state[7:10] = free[:3] = velocity
    table = np.zeros(len(contacts), CONTACT).view(np.recarray)
    keys = np.zeros((len(contacts), KEY_WIDTH), np.int64)
    for k, (stem, push, before, after, gap) in enumerate(contacts):
        c = table[k]
        keys[k] = (TERRAIN if stem < 0 else TREE), stem, 0
        c.nx, c.ty, c.uz, c.pn, c.before_n, c.gap, c.rx, c.rz = 1.0, 1.0, 1.0, push, before, gap, -0.4, 0.5
        state[7] = after
    scratch = Scratch.allocate(8, 1, 1, None)._replace(contacts=table, keys=keys, free=free)
    summary, way = scratch.summary[0], scratch.way[0]
    way.time, way.dt, way.fall, way.count, summary.steps, summary.hits = time, DT, FALL, len(contacts), step, number
    log = Log(np.zeros(2, np.int64), np.zeros(9), 8)
    return note_pushes(Model._make((*scene, SETTINGS)), log, state, scratch, hits, summary, energy)


def test_a_pause_ends_a_hit_and_another_stem_is_another(scene):
    hits = np.zeros((9, HIT_WIDTH))
    number = pushes(scene, hits, 0, 1.0, (2, 3.0, -6.0, 0.0, 0.0))
    number = pushes(
        scene, hits, number, 1.0 + 0.9 * HIT_PAUSE, (2, 1.0, -1.0, 0.0, 0.0), (3, 1.0, -1.0, 0.0, 0.0), step=2
    )
    assert number == 2
    number = pushes(scene, hits, number, 1.0 + 1.8 * HIT_PAUSE, (2, 1.0, -1.0, 0.0, 0.0), step=3)
    assert number == 2  # it went on
    number = pushes(scene, hits, number, 1.0 + 2.9 * HIT_PAUSE, (2, 1.0, -1.0, 0.0, 0.0), step=4)
    assert number == 3
    assert hits[:3, ITEM].tolist() == [2, 3, 2]
    assert hits[:3, FIRST] == pytest.approx([1.0, 1.0 + 0.9 * HIT_PAUSE, 1.0 + 2.9 * HIT_PAUSE])
    assert hits[0, LAST] == pytest.approx(1.0 + 1.8 * HIT_PAUSE)


def test_what_begins_no_hit(scene):
    """The ground, a contact without an impulse, and an impulse that is rounding; the last continues a hit."""
    hits = np.zeros((9, HIT_WIDTH))
    none = (-1, 5.0, -3.0, 0.0, 0.0), (1, 0.0, -3.0, 0.0, 0.0), (1, 1e-9, -3.0, 0.0, 0.0)
    assert pushes(scene, hits, 0, 1.0, *none) == 0
    assert pushes(scene, hits, 0, 1.0, (1, 3.0, -3.0, 0.0, 0.0)) == 1
    assert pushes(scene, hits, 1, 1.05, (1, 1e-9, -3.0, 0.0, 0.0), step=2) == 1
    assert hits[0, LAST] == pytest.approx(1.05)


def test_blows_are_struck_and_leaning_is_not(scene):
    """What approaches faster than twice g dt; work is taken by both: P (before + after) / 2."""
    hits = np.zeros((9, HIT_WIDTH))
    pushes(scene, hits, 0, 1.0, (2, 6.0, -6.0, 0.0, 0.0))
    assert hits[0, BLOW_X : BLOW_Z + 1].tolist() == [6.0, 0.0, 0.0]
    assert hits[0, TAKEN] == pytest.approx(18.0)
    pushes(scene, hits, 1, 1.0 + DT, (2, 1.0, -0.9 * 2.0 * G * DT, 0.0, 0.0), step=2)  # slow
    assert hits[0, BLOW_X] == 6.0
    assert hits[0, TAKEN] == pytest.approx(18.0 + 0.9 * 2.0 * G * DT * 0.5)


def test_a_jam_adds_no_blow_and_a_blow_no_more_than_it_stops(scene):
    """Squeezed with 500 m/s between two stems, or a stem and the ground, at rest: none, even where another contact is
    struck. And of a push of 500 m/s on what approaches with 6 the 6 that stop it."""
    hits = np.zeros((9, HIT_WIDTH))
    number = pushes(
        scene, hits, 0, 1.0, (2, 500.0, 0.0, 0.0, 0.0), (3, 500.0, 0.0, 0.0, 0.0), (-1, 500.0, -6.0, 0.0, 0.0)
    )
    assert number == 2
    assert (hits[:2, BLOW_X : BLOW_Z + 1] == 0.0).all()
    pushes(scene, hits, 2, 1.5, (4, 500.0, -6.0, 0.0, 0.0), step=2)
    assert hits[2, ITEM] == 4
    assert hits[2, BLOW_X : BLOW_Z + 1] == pytest.approx([6.0, 0.0, 0.0])


def test_no_blow_is_more_than_the_energy_before_it_can_bring(plain, scene, random_contacts):
    """Of any contacts with one stem, whatever they push: |blow| <= sqrt(2 E), with E the energy before them."""
    rng, ledger, largest = np.random.default_rng(2), plain("ledger"), 0.0
    for _ in range(300):
        number, axial, across = int(rng.integers(1, 6)), rng.uniform(0.01, 0.1), rng.uniform(1.0, 20.0)
        table, v, w = random_contacts(rng, number), 9.0 * rng.normal(size=3), rng.normal(size=3)
        keys = np.tile(np.array([TREE, 2, 0], np.int64), (number, 1))
        for c in table:
            c.pn *= 10.0 ** rng.uniform(-1, 3)
            for name in "ntu":
                lever = np.array([c["r" + name + axis] for axis in "xyz"])
                for axis, value in zip("xyz", lever / (across, across, axial), strict=True):
                    c["b" + name + axis] = value
                c["before_" + name] = v @ [c[name + axis] for axis in "xyz"] + w @ lever
        blow = ledger._blow(scene.cores, table, keys, (0, number), 0.0)
        energy = 0.5 * (v @ v + w @ ((across, across, axial) * w))
        assert np.linalg.norm(blow) <= np.sqrt(2.0 * energy) * (1.0 + 1e-12)
        largest = max(largest, np.linalg.norm(blow) / np.sqrt(2.0 * energy))
    assert largest > 0.8  # the bound is no loose one


def test_the_first_push_is_where_the_gap_closes(scene):
    """Found 3 cm off at 6 m/s: 5 ms later, 3 cm farther; the angle of the velocity at the node to the square."""
    hits = np.zeros((9, HIT_WIDTH))
    pushes(scene, hits, 0, 1.0, (2, 6.0, -6.0, 0.0, 0.03), velocity=(-3.0, 4.0, -FALL), energy=77.0)
    assert hits[0, FIRST] == hits[0, LAST] == pytest.approx(1.005)
    assert hits[0, PLACE : PLACE + 3] == pytest.approx([5.0 - 0.4 - 0.03, 4.0, 3.5])
    assert hits[0, HEIGHT] == pytest.approx(1.5)
    assert hits[0, SPEED] == pytest.approx(5.0)
    assert hits[0, ANGLE] == pytest.approx(math.acos(0.6))
    assert hits[0, ENERGY] == 77.0


def test_of_several_contacts_of_one_stem_the_strongest_is_the_first(scene):
    hits = np.zeros((9, HIT_WIDTH))
    number = pushes(scene, hits, 0, 1.0, (2, 1.0, -6.0, 0.0, 0.0), (2, 2.0, -6.0, 0.0, 0.03), (2, 1.5, -6.0, 0.0, 0.0))
    assert number == 1
    assert hits[0, FIRST] == pytest.approx(1.005)
    assert hits[0, BLOW_X] == pytest.approx(4.5)


def test_without_room_one_more_than_there_is_is_reported(scene):
    hits = np.zeros((1, HIT_WIDTH))
    two = (2, 3.0, -6.0, 0.0, 0.0), (3, 3.0, -6.0, 0.0, 0.0)
    assert pushes(scene, hits, 0, 1.0, *two) == 2
    assert pushes(scene, hits, 2, 1.0, *two) == 2


def test_a_table_in_the_world():
    """Ordered by log, then by their beginning; energies and impulses with the log's own mass."""
    rng = np.random.default_rng(0)
    tables = {5: rng.uniform(1.0, 2.0, (2, HIT_WIDTH)), 1: rng.uniform(1.0, 2.0, (1, HIT_WIDTH))}
    origin, mass = rng.normal(size=(6, 3)), np.arange(6.0) * 100.0
    tables[1][0, 0], tables[5][:, 0] = 0.0, 1.0
    told, table = hits_of(tables, origin, mass), np.vstack([tables[1], tables[5]])
    assert told.log_row.tolist() == [1, 5, 5]
    assert told.by_barrier.tolist() == [False, True, True]
    heavy = np.array([100.0, 500.0, 500.0])
    assert told.place == pytest.approx(table[:, PLACE : PLACE + 3] + origin[[1, 5, 5]])
    assert told.duration == pytest.approx(table[:, LAST] - table[:, FIRST])
    assert told.impulse == pytest.approx(heavy * np.linalg.norm(table[:, BLOW_X : BLOW_Z + 1], axis=1))
    assert told.energy_taken == pytest.approx(heavy * table[:, TAKEN])
    assert told.energy == pytest.approx(heavy * table[:, ENERGY])
    assert len(hits_of({}, origin, mass).item) == 0
