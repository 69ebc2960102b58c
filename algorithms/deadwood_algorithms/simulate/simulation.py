"""A scene that is open, how its logs are slid, and where: what everything takes that slides."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from deadwood_algorithms.files.dem_windows import DemWindows, open_windows
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.params.where import Where
from deadwood_algorithms.scene.inputs import SceneInputs, say_presets
from deadwood_algorithms.scene.layers import lines_layer
from deadwood_algorithms.simulate.scheduler import refuse_no_scheduler
from deadwood_engine import Fidelity

if TYPE_CHECKING:
    import geopandas


@dataclass(frozen=True)
class Simulation:
    """How logs are slid.

    dem : open, so that the scene can be read again on a wider window; lines : the layer, read once
    laws : keyword arguments of the engine's ``slide``; counts_danger : whether rasters of danger are drawn
    """

    inputs: SceneInputs
    dem: DemWindows
    lines: geopandas.GeoDataFrame | None
    laws: Mapping[str, Any]
    fidelity: Fidelity
    where: Where
    counts_danger: bool = False


@contextmanager
def open_simulation(
    inputs: SceneInputs, fidelity: Fidelity, where: Where, feedback: Feedback, *, counts_danger: bool = False
) -> Iterator[Simulation]:
    """Open the terrain model for as long as logs slide on it."""
    refuse_no_scheduler(where.scheduler, where.workers)
    with open_windows(inputs.dem, crs=inputs.crs, feedback=feedback, look_through=False) as dem:
        say_presets(inputs.presets, dem.cell, feedback)
        lines = lines_layer(inputs.lines, dem.crs, feedback) if inputs.lines else None
        yield Simulation(inputs, dem, lines, inputs.laws, fidelity, where, counts_danger)
