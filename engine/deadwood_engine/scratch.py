"""The settings of a run and the memory of a worker, as the kernels take them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from . import contacts
from .cloud import Cloud
from .cores import CORE, CORE_CONTACTS
from .influence import BOOK_WIDTH, NOTE
from .outline import OUTLINE_POINTS
from .ring_look import LOOK_ROOM, RING_ROWS
from .rocking import ROCKING_WIDTH, WINDOWS
from .rolling import ROLLING
from .stages import StageTable
from .surroundings import NEAR, POSE
from .trace import MEMORY_WIDTH
from .way import WAY


class Settings(NamedTuple):
    """The settings of a run: those of the fidelity, in metres and seconds, and the user's."""

    time_step: float
    travel: float  # [m] of the fastest point in a step
    tolerance: float  # [-] of g dt
    sweeps: int
    trace_step: float  # [m] of the ends between outlines
    restitution: float  # of the ground
    time_limit: float
    rest_speed: float
    gravity: float
    obstacle_travel: float  # [-] of the two thicknesses, of the fastest point in a step near an obstacle
    ring_points: int  # candidates of a ring between the ends
    backward: bool  # sweep the contacts from last to first
    rolling_friction: float  # [-] of the ground
    tree_friction: float  # [-] of stems and lying logs; negative: the ground's
    tree_restitution: float
    barrier_friction: float
    barrier_restitution: float
    stage_steps: int = 0  # steps between two stored stages; 0: none is stored
    until_reached: bool = False  # a log ends when it has touched every line
    breaks: bool = False  # whether any tree can break
    friction_max: float = 0.0  # of the ground, for large slip (``slip``)
    friction_kappa: float = 0.0  # [1/m]; 0: friction does not depend on slip
    friction_beta: float = 0.0  # [1/s]
    strength: float = 0.0  # [kN/m2] of soft ground (``scarring``); 0: it is hard
    scar_drag: float = 0.0  # [-]


class Scratch(NamedTuple):
    """Memory of a worker, allocated once: nothing is allocated while logs slide."""

    way: np.ndarray  # state of the log's slide
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
    noted: np.ndarray  # each core's place among the notes (``influence``); empty if nothing is noted
    notes: np.ndarray
    book: np.ndarray
    stages: StageTable  # stages stored for the current log, or those from which logs are continued

    @staticmethod
    def allocate(
        stations: int,
        core_count: int,
        raster_rows: int,
        cloud: Cloud | None,
        noting: bool = False,
        stages: StageTable | None = None,
    ) -> Scratch:
        # every candidate of the log, and the maximum of each obstacle (``CORE_CONTACTS``), for as many as can touch a
        # log at once. ``add_contact``, the only function that writes to the table, ignores any excess
        table = 3 * stations + 16 + CORE_CONTACTS * min(core_count, 1024)
        cloud = cloud or Cloud.none()
        table += len(cloud.points) + 64 * min(len(cloud.corners), 64)
        outline = max(OUTLINE_POINTS, len(cloud.corners))
        return Scratch(
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
            np.zeros((RING_ROWS, stations)),
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
            np.zeros(core_count if noting else 0, np.int64),
            np.zeros(core_count if noting else 0, NOTE).view(np.recarray),
            np.zeros(BOOK_WIDTH),
            stages or StageTable.allocate(0, 0, 0),
        )
