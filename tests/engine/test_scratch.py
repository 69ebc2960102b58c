"""A worker's memory: room for all that a log can have at once."""

from types import SimpleNamespace

import numpy as np
import pytest

from deadwood_engine import Shape
from deadwood_engine.contacts import CONTACT
from deadwood_engine.cores import CORE_CONTACTS
from deadwood_engine.outline import OUTLINE_POINTS
from deadwood_engine.ring_look import ring_table
from deadwood_engine.rings import CANDIDATES
from deadwood_engine.scratch import Scratch
from deadwood_engine.surroundings import NEAR, POSE
from deadwood_engine.way import WAY


@pytest.mark.parametrize("stations", [8, 100])
@pytest.mark.parametrize("cores", [0, 1, 40])
def test_every_candidate_and_every_obstacle_has_its_contact(stations, cores):
    """Two ends with nine points, rings and the places halfway with three, and what each core may have."""
    made = Scratch.allocate(stations, cores, 30, None)
    most = 2 * CANDIDATES + 3 * (2 * stations - 3) + CORE_CONTACTS * cores
    assert min(map(len, (made.contacts, made.keys, made.old_keys, made.old_contacts))) >= most
    assert len(made.contacts) == len(made.keys) == len(made.old_keys) == len(made.old_contacts)
    assert made.rings.shape == ring_table(stations).shape
    # one more than there are, for a list that is read one place beyond its last
    assert min(map(len, (made.listed, made.near_cores, made.hit_trees, made.hit_barriers))) >= cores
    assert min(len(made.left), len(made.right)) >= 30


def test_what_a_log_leans_on_at_once_bounds_the_table():
    """A forest of a million stems takes no more contacts than one of a thousand."""
    assert len(Scratch.allocate(8, 10**6, 1, None).contacts) == len(Scratch.allocate(8, 2000, 1, None).contacts)


@pytest.mark.parametrize("number", [4, 40])
def test_a_cloud_has_room_for_its_points_and_its_outline(number):
    cloud = Shape.of(np.random.default_rng(number).normal(size=(number, 3))).cloud
    made, bare = Scratch.allocate(8, 3, 1, cloud), Scratch.allocate(8, 3, 1, None)
    assert len(made.contacts) >= len(bare.contacts) + len(cloud.points) + len(cloud.corners)
    assert made.corners.shape == cloud.corners.shape
    assert made.normals.shape == cloud.normals.shape
    assert len(made.points) >= 2 * max(OUTLINE_POINTS, len(cloud.corners))
    assert len(made.hull) > len(made.points)  # and the way of the centre behind it


def test_notes_have_room_where_they_are_requested():
    for noting, rows in ((False, 0), (True, 5)):
        notes = Scratch.allocate(8, 5, 1, None, noting).notes
        assert len(notes.rows) == len(notes.place) == rows


def test_records_are_named():
    """What kernels read as records are such in Python too, under the names that they have."""
    made = SimpleNamespace(**Scratch.allocate(8, 1, 1, None)._asdict())
    for table, kind in (
        (made.way, WAY),
        (made.trial, POSE),
        (made.pose, POSE),
        (made.near, NEAR),
        (made.spare, CONTACT),
    ):
        assert table.dtype.fields == kind.fields
        assert isinstance(table, np.recarray)
        assert len(table) == 1
