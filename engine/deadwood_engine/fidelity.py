"""Fidelity: what a run may cost and how exact it is, as plain numbers. Kernels never learn a preset's name.

The four rows are measured by ``benchmarks``; the errors that each number governs are named beside it.
"""

from __future__ import annotations

from typing import NamedTuple


class Fidelity(NamedTuple):
    """The numbers that trade speed for accuracy.

    time_step : [s] longest step; governs the order-one error of impacts and friction
    travel_cells : [DEM cells, of 1 m at most] the log moves at most so far in a step (``travel``); governs penetration
        and what of the terrain's roughness is seen
    station_spacing : [m] longest distance of the log's contact rings; each finds the highest crest of its stretch
    spacing_cells : [DEM cells] the same, in cells; governs how deep a second crest of the same stretch may poke in
    tolerance : [-] of g dt; contact velocities are solved to this; governs creep
    sweeps : most Gauss-Seidel sweeps a step; a step that needs more is counted as unconverged
    trace_cells : [DEM cells] the log's ends move at most so far between two outlines in rasters and trajectories; less
        where they go astray from the straight way or the log turns (``trace.outline_is_due``)
    trace_spacing : [m] the same, in metres, where that is more than a cell
    obstacle_travel : [-] of the two thicknesses (radius of the log + radius of a stem) the log moves at most in a step
        beside it, sideways; beyond 1 the axes could change sides, which is passing through. Beside what is thin it
        is 0.3 at most, of the fastest point (``limits.OBSTACLE_TRAVEL``)
    ring_points : 3, or 1: the deepest point of a contact ring, and the two at 45 degrees beside it, which find the
        walls of a channel; the end faces always have nine
    backward : sweep the contacts from last to first (for the study of what the order does)
    coarse_cells : [DEM cells] rings stand no closer than this, however far that is in metres. The ground is straight
        within a cell but for its twist: more rings see no more of it (half a metre on cells of 5 m: 1.4 to 1.6 times
        the time for the same reach and the same depth)
    rebound_share : [-] of time_step and travel_cells where something rebounds: a log that hops meets ground and stems
        anew in every step, and each time by how far the last one carried it
    """

    time_step: float
    travel_cells: float
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


FIDELITIES: dict[str, Fidelity] = {
    "draft": Fidelity(0.070, 1.0, 2.0, 4.0, 1e-3, 300, 4.0, ring_points=1, coarse_cells=0.5, rebound_share=0.25),
    "standard": Fidelity(
        0.022, 0.3, 0.75, 1.5, 1e-3, 400, 4.0, obstacle_travel=0.1, coarse_cells=0.5, rebound_share=0.5
    ),
    "fine": Fidelity(0.004, 0.2, 0.5, 1.0, 1e-3, 400, 1.0, obstacle_travel=0.1, coarse_cells=0.25),
    "reference": Fidelity(0.001, 0.04, 0.5, 1.0, 1e-4, 1000, 0.5),
}


# [m] size of cells from which on a step is no longer: by how much the ground turns from cell to cell does not grow with
# them, so with a way of as many cells what a log of the same size sinks by would. On rough cells of 5 m draft's sank by
# 0.16 of their diameter in the median, now by 0.08, for 1.4 times the steps
LARGEST_CELL = 1.0


def longest_travel(fidelity: Fidelity, cell: float) -> float:
    """Most way [m] of a log in a step on a DEM of this cell size."""
    return fidelity.travel_cells * min(cell, LARGEST_CELL)


def station_spacing(fidelity: Fidelity, cell: float) -> float:
    """Distance of the contact rings [m] on a DEM of this cell size."""
    finest = min(fidelity.station_spacing, fidelity.spacing_cells * cell)
    return max(finest, fidelity.coarse_cells * cell)


def fidelity_with(name: str, time_step: float | None, station_spacing: float | None) -> Fidelity:
    """A row with a user's numbers in the place of its own, where there are some: they hold on any cells, at any
    restitution."""
    row = FIDELITIES[name]
    if time_step is not None:
        row = row._replace(time_step=time_step, rebound_share=1.0)
    if station_spacing is not None:
        row = row._replace(station_spacing=station_spacing, coarse_cells=0.0)
    return row


def where_things_rebound(fidelity: Fidelity, *restitutions: float) -> Fidelity:
    """The row for a scene: its share of step and travel, if any of the restitutions [-] of what is there is above 0."""
    share = fidelity.rebound_share if any(each > 0.0 for each in restitutions) else 1.0
    return fidelity._replace(time_step=share * fidelity.time_step, travel_cells=share * fidelity.travel_cells)


def trace_step(fidelity: Fidelity, cell: float) -> float:
    """Most way [m] of a log's ends between two outlines on a DEM of this cell size."""
    return min(fidelity.trace_cells * cell, max(fidelity.trace_spacing, cell))
