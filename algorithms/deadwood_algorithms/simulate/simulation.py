"""An open scene, how its logs are slid, and where: the common input of everything that slides logs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from deadwood_algorithms.files.dem_windows import DemWindows, open_windows
from deadwood_algorithms.params.tool import Feedback
from deadwood_algorithms.params.where import Where
from deadwood_algorithms.scene.inputs import SceneInputs, say_presets
from deadwood_algorithms.scene.layers import lines_layer
from deadwood_algorithms.simulate.scheduler import refuse_no_scheduler
from deadwood_algorithms.simulate.sinking import Sinking
from deadwood_engine import Fidelity

if TYPE_CHECKING:
    import geopandas


@dataclass(frozen=True)
class Simulation:
    """How logs are slid.

    dem : open, so that the scene can be read again on a wider window; lines : the layer, read once
    laws : keyword arguments of the engine's ``slide``; counts_danger : whether danger rasters are drawn
    sinking : how deep logs sank so far
    """

    inputs: SceneInputs
    dem: DemWindows
    lines: geopandas.GeoDataFrame | None
    laws: Mapping[str, Any]
    fidelity: Fidelity
    where: Where
    counts_danger: bool = False
    sinking: Sinking = field(default_factory=Sinking, compare=False)


@contextmanager
def open_simulation(
    inputs: SceneInputs, fidelity: Fidelity, where: Where, feedback: Feedback, *, counts_danger: bool = False
) -> Iterator[Simulation]:
    """Open the terrain model while logs slide on it; warns at the end of logs that sank deep."""
    refuse_no_scheduler(where.scheduler, where.workers)
    with open_windows(inputs.dem, crs=inputs.crs, feedback=feedback, look_through=False) as dem:
        say_presets(inputs.presets, dem.cell, feedback)
        lines = lines_layer(inputs.lines, dem.crs, feedback) if inputs.lines else None
        simulation = Simulation(inputs, dem, lines, inputs.laws, fidelity, where, counts_danger)
        try:
            yield simulation
        finally:
            simulation.sinking.say(dem.cell, feedback)
