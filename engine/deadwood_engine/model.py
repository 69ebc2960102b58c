"""What the kernels take, by what changes and when; as in MuJoCo Warp and Box2D.

argument  what                                                                   changes
model     the scene and the settings of the run (``Model``)                      never
log       one log: its frame, body and rings (``Log``)                           never while it slides
state     its pose and velocities, 16 numbers (``rotation``)                     in every step
scratch   the rest of its slide (``way``) and the worker's memory (``scratch``)  in every step
out       what it leaves behind (``trace.Output``)                               grows

Numba passes such a record word by word: a kernel that is called often and not inlined takes the parts that it needs.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from .cloud import Cloud
    from .cores import Cores
    from .lines import Segments
    from .terrain import Terrain


class Settings(NamedTuple):
    """The settings of a run: those of the fidelity, in metres and seconds, and the user's."""

    time_step: float
    travel: float  # [m] of the axis in a step
    roll_angle: float  # [rad] of a log in contact about its axis in a step
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
    smooth_kinks: float = math.inf  # [-] of the ground under the log up to which it moves by the whole travel in a step


class Model(NamedTuple):
    """What never changes: the arrays of the scene (``scene.SceneArrays``), and the settings."""

    terrain: Terrain
    cores: Cores
    cloud: Cloud | None
    lines: Segments
    fences: Segments
    settings: Settings


class Log(NamedTuple):
    """One log: what does not change while it slides."""

    frame: np.ndarray  # int64 (2,), DEM node (column, row) of its local frame
    body: np.ndarray  # its row of the body table (``log_body``)
    stations: Any  # number of its rings


class Span(NamedTuple):
    """How far a log can move: obstacles farther away need no query."""

    dt: float  # [s] of the step
    path: float  # [m] since its release
    advance: float  # [m] in this step
