"""Fidelity: the cost and accuracy of a run, as plain numbers. Kernels do not know the names of presets.

The four rows are measured by ``benchmarks``; the errors that each number controls are stated beside it.
"""

from __future__ import annotations

import math
from typing import NamedTuple


class Fidelity(NamedTuple):
    """The numbers that trade speed for accuracy.

    time_step : [s] longest step; controls the first-order error of impacts and friction
    travel_cells : [DEM cells, of at most 1 m] greatest distance that the log's axis moves in a step (``travel``);
        controls penetration, how high logs jump, and how much of the terrain's roughness is resolved
    roll_angle : [rad] greatest angle by which a log in contact turns about its axis in a step; controls the error of
        rolling on smooth ground, which grows with this angle, not with the distance
    station_spacing : [m] greatest distance between the log's contact rings; each finds the highest crest of its stretch
    spacing_cells : [DEM cells] the same, in cells; controls how deep a second crest of the same stretch may penetrate
    tolerance : [-] of g dt, of the contact velocities in the solver; controls creep
    sweeps : greatest number of Gauss-Seidel sweeps in a step; a step that needs more is counted as not converged
    trace_cells : [DEM cells] greatest distance that the log's ends move between two outlines in rasters and
        trajectories; less if they deviate from a straight path or the log turns (``trace.outline_is_due``)
    trace_spacing : [m] the same, in metres, if that is more than a cell
    obstacle_travel : [-] share of the two thicknesses (radius of the log + radius of a stem) that the log moves
        sideways in a step beside it; beyond 1 the axes could change sides, and the log would pass through. Beside thin
        obstacles it is at most 0.3, of the fastest point (``limits.OBSTACLE_TRAVEL``)
    ring_points : 1, the deepest point of a contact ring, or 3, with the two at 45 degrees beside it, which find the
        walls of a channel; the end faces always have nine. With 1, a slow log has 3, and rings at half the distance,
        because it would sink while it jams (``limits.SLOW``)
    backward : sweep the contacts from last to first (to study the effect of the order)
    coarse_cells : [DEM cells] least distance between rings, whatever it is in metres. The ground is straight within a
        cell except for its twist, so more rings resolve no more of it (half a metre on cells of 5 m: 1.4 to 1.6 times
        the time for the same reach and the same depth)
    smooth_kinks : [-] mean kinks of the ground under a log in contact (``ring_look.mean_kinks``) up to which it moves
        by the whole of travel_cells in a step; beyond, by a share that falls with their square, down to
        ``limits.LEAST_TRAVEL``. Controls the error on ground that is rough at the size of a cell, in channels and at
        the edges of benches, where a long step passes facets that the log would have struck
    rebound_share : [-] of time_step, travel_cells and roll_angle where anything rebounds: a bouncing log meets ground
        and stems in new places in every step, and the error grows with the distance between them
    """

    time_step: float
    travel_cells: float
    roll_angle: float
    station_spacing: float
    spacing_cells: float
    tolerance: float
    sweeps: int
    trace_cells: float
    obstacle_travel: float = 0.3
    ring_points: int = 3
    trace_spacing: float = 2.0
    backward: bool = False
    coarse_cells: float = 0.0
    rebound_share: float = 1.0
    smooth_kinks: float = math.inf


FIDELITIES: dict[str, Fidelity] = {
    "draft": Fidelity(
        0.070, 1.0, 0.5, 2.0, 4.0, 1e-3, 300, 4.0, ring_points=1, coarse_cells=0.5, rebound_share=0.2, smooth_kinks=0.4
    ),
    "standard": Fidelity(
        0.030,
        0.6,
        0.4,
        1.25,
        2.5,
        1e-3,
        400,
        4.0,
        obstacle_travel=0.15,
        coarse_cells=0.5,
        rebound_share=0.25,
        smooth_kinks=0.4,
    ),
    "fine": Fidelity(0.004, 0.2, 0.2, 0.5, 1.0, 1e-3, 400, 1.0, obstacle_travel=0.1, coarse_cells=0.25),
    "reference": Fidelity(0.001, 0.04, 0.04, 0.5, 1.0, 1e-4, 1000, 0.5),
}


# [m] cell size above which a step does not grow any more: the change of slope from cell to cell does not grow with
# the cells, so at a constant number of cells per step the depth to which a log sinks would. On rough cells of 5 m
# draft's logs sank by 0.16 of their diameter in the median, now by 0.08, for 1.4 times the steps
LARGEST_CELL = 1.0


def longest_travel(fidelity: Fidelity, cell: float) -> float:
    """Greatest distance [m] that a log moves in a step on a DEM of this cell size."""
    return fidelity.travel_cells * min(cell, LARGEST_CELL)


def station_spacing(fidelity: Fidelity, cell: float) -> float:
    """Distance of the contact rings [m] on a DEM of this cell size."""
    finest = min(fidelity.station_spacing, fidelity.spacing_cells * cell)
    return max(finest, fidelity.coarse_cells * cell)


def fidelity_with(name: str, time_step: float | None, station_spacing: float | None) -> Fidelity:
    """A row in which a user's numbers, as far as given, replace its own: they apply on any cells and at any
    restitution.
    """
    row = FIDELITIES[name]
    if time_step is not None:
        row = row._replace(time_step=time_step, rebound_share=1.0)
    if station_spacing is not None:
        row = row._replace(station_spacing=station_spacing, coarse_cells=0.0)
    return row


def where_things_rebound(fidelity: Fidelity, *restitutions: float) -> Fidelity:
    """The row for a scene: with its share of step and travel if any restitution [-] in the scene is above 0."""
    share = fidelity.rebound_share if any(each > 0.0 for each in restitutions) else 1.0
    return fidelity._replace(
        time_step=share * fidelity.time_step,
        travel_cells=share * fidelity.travel_cells,
        roll_angle=share * fidelity.roll_angle,
    )


def trace_step(fidelity: Fidelity, cell: float) -> float:
    """Greatest distance [m] that a log's ends move between two outlines on a DEM of this cell size."""
    return min(fidelity.trace_cells * cell, max(fidelity.trace_spacing, cell))
