"""The memory of a worker: the slide of its present log, and everything that a step writes to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from . import contacts
from .cloud import Cloud
from .cores import CORE, CORE_CONTACTS
from .influence import Notes
from .outline import OUTLINE_POINTS
from .ring_look import LOOK_ROOM, ring_table
from .rocking import ROCKING_WIDTH, WINDOWS
from .rolling import ROLLING
from .rotation import STATE_WIDTH
from .surroundings import NEAR, POSE
from .trace import MEMORY_WIDTH
from .way import SUMMARY, WAY


class Scratch(NamedTuple):
    """Memory of a worker, allocated once: nothing is allocated while logs slide."""

    state: np.ndarray  # (16,) pose and velocities of the present log (``rotation``)
    summary: np.ndarray  # its summary; and that of a log that has not started
    way: np.ndarray  # the rest of its slide
    contacts: np.ndarray
    keys: np.ndarray
    old_keys: np.ndarray
    old_contacts: np.ndarray
    spare: np.ndarray  # buffer for a contact that changes its place
    listed: np.ndarray  # rows of the near cores
    near_cores: np.ndarray  # these, in the log's frame
    hit_trees: np.ndarray
    hit_barriers: np.ndarray
    trial: np.ndarray  # the pose at the end of the step
    pose: np.ndarray  # the pose at a time within the step
    near: np.ndarray  # knowledge of the surroundings
    rings: np.ndarray  # results of a query of all rings, and its buffer (``ring_look``)
    look: np.ndarray
    memory: np.ndarray
    rest: np.ndarray  # ends at the last test of a slow log
    rocking: np.ndarray  # recent positions of a slow log (``rocking``)
    trial_state: np.ndarray
    free: np.ndarray  # velocities before the solve
    kicked: np.ndarray  # the same with the impulses of trees that break in the step (``breaking``)
    gone: np.ndarray  # rows of the cores that the log has broken
    rolling: np.ndarray  # the moment that resists rolling
    points: np.ndarray
    hull: np.ndarray
    left: np.ndarray
    right: np.ndarray
    turned: np.ndarray  # a cloud's predicted state
    turns: np.ndarray  # its rotation matrices, now and predicted
    corners: np.ndarray  # its hull at the predicted pose
    normals: np.ndarray
    notes: Notes  # of the obstacles that mattered (``influence``)

    @staticmethod
    def allocate(
        stations: int,
        core_count: int,
        raster_rows: int,
        cloud: Cloud | None,
        noting: bool = False,
    ) -> Scratch:
        # every candidate of the log, and the maximum of each obstacle (``CORE_CONTACTS``), for as many as can touch a
        # log at once. ``add_contact``, the only function that writes to the table, ignores any excess
        table = 6 * stations + 16 + CORE_CONTACTS * min(core_count, 1024)
        cloud = cloud or Cloud.none()
        table += len(cloud.points) + 64 * min(len(cloud.corners), 64)
        outline = max(OUTLINE_POINTS, len(cloud.corners))
        summary = np.zeros(2, SUMMARY).view(np.recarray)
        summary.item_row, summary.grip = -1, np.nan
        return Scratch(
            np.zeros(STATE_WIDTH),
            summary,
            np.zeros(1, WAY).view(np.recarray),
            np.zeros(table, contacts.CONTACT).view(np.recarray),
            np.zeros((table, contacts.KEY_WIDTH), np.int64),
            np.zeros((table, contacts.KEY_WIDTH), np.int64),
            np.zeros(table, contacts.OLD_CONTACT).view(np.recarray),
            np.zeros(1, contacts.CONTACT).view(np.recarray),
            np.zeros(core_count + 1, np.int64),
            np.zeros(core_count + 1, CORE).view(np.recarray),
            np.zeros(core_count + 1, np.int64),
            np.zeros(core_count + 1, np.int64),
            np.zeros(1, POSE).view(np.recarray),
            np.zeros(1, POSE).view(np.recarray),
            np.zeros(1, NEAR).view(np.recarray),
            ring_table(stations),
            np.zeros(LOOK_ROOM),
            np.zeros(MEMORY_WIDTH),
            np.zeros(MEMORY_WIDTH),
            np.zeros((WINDOWS, ROCKING_WIDTH)),
            np.zeros(16),
            np.zeros(6),
            np.zeros(6),
            np.zeros(core_count, np.int64),
            np.zeros(1, ROLLING).view(np.recarray),
            np.zeros((2 * outline, 2)),
            np.zeros((2 * outline + 3, 4)),
            np.zeros(max(raster_rows, 1), np.int64),
            np.zeros(max(raster_rows, 1), np.int64),
            np.zeros(16),
            np.zeros(18),
            np.zeros(cloud.corners.shape),
            np.zeros(cloud.normals.shape),
            Notes.allocate(core_count if noting else 0),
        )
