"""Of a large terrain model the surroundings of the layers are explored: nobody knows yet where logs will start."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.files.dem_blocks import WHOLE_CELLS
from deadwood_algorithms.files.dem_windows import DemWindows
from deadwood_algorithms.files.grid import Part
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.tool import Feedback, Quiet
from deadwood_algorithms.simulate.simulation import Simulation

AROUND_M = 500.0  # beyond the layers: logs start above the trees, and stop below the road


def part_to_explore(simulation: Simulation, feedback: Feedback) -> Part | None:
    """The window around the layers; None for a terrain model that is read whole, or without a layer."""
    dem = simulation.dem
    if dem.shape[0] * dem.shape[1] <= WHOLE_CELLS:
        return None
    found = {name: around(box, dem) for name, box in boxes_of(simulation).items()}
    on_dem = sorted((name for name in found if found[name].cells), key=lambda name: found[name].cells)
    if not on_dem:
        feedback.note(
            f"{dem.path} is read completely; with --trees or --lines only {AROUND_M:g} m around them are read",
            code="whole-dem",
        )
        return None
    part, left_out = found[on_dem[0]], []
    for name in on_dem[1:]:
        joined = part.joined(found[name])
        if joined.cells <= WHOLE_CELLS:
            part = joined
        else:
            left_out.append(name)
    feedback.note(
        f"of this large terrain model only {AROUND_M:g} m around the layers are used: a log that leaves this part "
        "counts as having left the terrain model"
        + (
            f"; {' and '.join(left_out)} extend farther, and are used only as far as they lie within"
            if left_out
            else ""
        ),
        code="surroundings-only",
        around_m=AROUND_M,
    )
    return part


def boxes_of(simulation: Simulation) -> dict[str, NDArray[np.float64]]:
    """West, south, east and north of each layer, in the terrain model's CRS."""
    inputs, crs = simulation.inputs, simulation.dem.crs
    asked: dict[str, tuple[str | None, tuple[Any, ...]]] = {
        "trees": (inputs.trees, ("point",)),
        "barriers": (inputs.barriers, ("line",)),
        "lying logs": (inputs.lying_logs, ("line",)),
        "blocks": (inputs.blocks, ("point",)),
    }
    layers = {
        name: read_vector(path, geometry=kind, target_crs=crs, what=name.replace(" ", "_"), feedback=Quiet())
        for name, (path, kind) in asked.items()
        if path
    }
    if simulation.lines is not None:
        layers["lines"] = simulation.lines
    return {name: frame.total_bounds for name, frame in layers.items() if len(frame)}


def around(box: NDArray[np.float64], dem: DemWindows) -> Part:
    """The cells of a box and of `AROUND_M` beyond it, as far as the terrain model has them."""
    west, south, east, north = box.tolist()
    column, row = (math.floor((low - AROUND_M - at) / dem.cell) for low, at in ((west, dem.x0), (south, dem.y0)))
    columns, rows = (math.ceil((size + 2.0 * AROUND_M) / dem.cell) + 1 for size in (east - west, north - south))
    return Part(column, row, columns, rows).cut_to(dem.shape)
