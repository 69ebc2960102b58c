"""The scene on the part of a large DEM that logs reach: read for a first estimate, and again, wider, if that is too
small.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from deadwood_algorithms.files.accounts import account, count_of
from deadwood_algorithms.files.columns import number_column
from deadwood_algorithms.files.dem_blocks import WHOLE_CELLS
from deadwood_algorithms.files.dem_windows import DemWindows, read_part, read_whole
from deadwood_algorithms.files.grid import Part
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.tool import Feedback, ProgressOnly
from deadwood_algorithms.scene.counts import account_scene
from deadwood_algorithms.scene.friction import number_of
from deadwood_algorithms.scene.ground import warn_of_ground
from deadwood_algorithms.scene.items import digest_of, plan_of
from deadwood_algorithms.scene.laws import refuse_idle_slip
from deadwood_algorithms.scene.layers import SceneLayers, read_scene
from deadwood_algorithms.scene.memory import LOG_BYTES, refuse_too_many, refuse_too_many_workers, threads_that_fit
from deadwood_algorithms.scene.reach import first_part, wider
from deadwood_algorithms.scene.releases import Releases, releases_of
from deadwood_algorithms.scene.shape import as_shape, read_shape
from deadwood_algorithms.simulate.scheduler import LOCAL
from deadwood_algorithms.simulate.simulation import Simulation

if TYPE_CHECKING:
    import geopandas

GRAVITY = 9.81  # m/s2
# The energy line of the first estimate falls less steeply than friction implies, because logs roll; if that is
# not enough, the window grows.
SLOPE_SHARE, SLOPE_LEAST, SLOPE_MOST = 0.75, 0.1, 0.3


def read_released_scene(simulation: Simulation, feedback: Feedback) -> tuple[SceneLayers, Releases]:
    """Read and check every layer.

    Of a large DEM only the part that logs are expected to reach is read; the caller must then query
    `SceneLayers.escaped` after sliding, and slide again on the result of `wider_scene`.
    """
    inputs, dem = simulation.inputs, simulation.dem
    releases = read_vector(inputs.releases, geometry=("point",), target_crs=dem.crs, what="releases", feedback=feedback)
    fix = "slide them in parts, or release fewer (--until-ci draws as many as it needs)"
    refuse_too_many(len(releases), "logs", inputs.releases, each=LOG_BYTES, fix=fix)
    layers = scene_on(simulation, part_of(dem, releases, inputs.defaults, inputs.friction), feedback)
    warn_of_ground(layers.dem, *plan_of(releases), feedback)
    logs = releases_of(releases, layers.dem, inputs.defaults, feedback=feedback)
    account("releases", count_of(len(releases), len(logs), {}))
    return layers, as_shape(logs, layers.shape) if layers.shape else logs


def part_of(
    dem: DemWindows, releases: geopandas.GeoDataFrame, defaults: Mapping[str, Any], friction: str | float
) -> Part | None:
    """The part of a large DEM that the releases are expected to reach; None for a DEM that is read whole."""
    if dem.shape[0] * dem.shape[1] <= WHOLE_CELLS:
        return None
    length, speed, drop = (
        float(number_column(releases, name, default=defaults[name]).max(initial=0.0))
        for name in ("length_m", "speed_ms", "drop_m")
    )
    lift = length + drop + speed**2 / (2.0 * GRAVITY)
    return first_part(dem, *plan_of(releases), lift_m=lift, slope=energy_slope(friction), margin_m=2.0 * length)


def farthest(layers: SceneLayers, releases: Releases, friction: str | float) -> float:
    """How far [m] in plan a log may come: to the energy line, or to the end of the terrain model."""
    x, y, (west, south, east, north) = releases.x, releases.y, layers.dem.frame.bounds
    to_end = float(np.hypot(np.maximum(x - west, east - x), np.maximum(y - south, north - y)).max())
    fall = float(np.nanmax(layers.scene.terrain_height(x, y))) - float(np.nanmin(layers.dem.values))
    return min(to_end, fall / max(energy_slope(friction), 1e-9))


def energy_slope(friction: str | float) -> float:
    number = number_of(friction)
    if number is None:  # a layer, which is read on the window only
        return 0.5 * (SLOPE_LEAST + SLOPE_MOST)
    return float(np.clip(SLOPE_SHARE * number, SLOPE_LEAST, SLOPE_MOST))


def scene_on(simulation: Simulation, part: Part | None, feedback: Feedback) -> SceneLayers:
    """The scene on a part of the DEM or on the whole."""
    inputs, dem, where = simulation.inputs, simulation.dem, simulation.where
    by_cell = number_of(inputs.friction) is None
    cells = part.cells if part else dem.shape[0] * dem.shape[1]
    # rows that share an id count as one, so this is an upper bound
    counted = len(simulation.lines) if simulation.counts_danger and simulation.lines is not None else 0
    threads = threads_that_fit(
        1 if where.scheduler else where.cores,
        cells,
        friction_by_cell=by_cell,
        what=inputs.dem,
        feedback=feedback,
        cell=dem.cell,
        danger_lines=counted,
    )
    if where.scheduler == LOCAL:
        number = where.workers or where.cores
        refuse_too_many_workers(number, cells, friction_by_cell=by_cell, what=inputs.dem, danger_lines=counted)
    if part is None:
        grid = read_whole(dem, feedback)
    else:
        grid = read_part(dem, part, feedback)
        feedback.note(f"{inputs.dem}: {window_words(grid.part, dem.shape)}")
    layers = read_scene(
        inputs.dem,
        inputs.friction,
        inputs.trees,
        inputs.barriers,
        simulation.lines,
        crs=inputs.crs,
        feedback=feedback,
        lying_logs=inputs.lying_logs,
        lying_diameter_cm=inputs.lying_diameter_cm,
        blocks=inputs.blocks,
        friction_column=inputs.friction_column,
        friction_elsewhere=inputs.friction_elsewhere,
        height_field=inputs.height_field,
        grid=grid,
        breaking=inputs.breaking,
    )
    shape = read_shape(inputs.shape, grid.cell, feedback)
    account_scene(layers)
    refuse_idle_slip(inputs.laws.get("friction_max"), layers.friction)
    digest = digest_of([layers.digest], shape.cloud.points, shape.axes) if shape else layers.digest
    return replace(layers, threads=threads, shape=shape, digest=digest)


def wider_scene(simulation: Simulation, layers: SceneLayers, sides: list[str], feedback: Feedback) -> SceneLayers:
    """The scene on a window enlarged at the sides that logs came too close to; its digest remains that of the first
    one.
    """
    part = wider(layers.dem.part, sides, layers.dem.frame.shape)
    feedback.note(f"logs came near the {' and '.join(sides)} of the DEM's window, which is read wider")
    return scene_again(simulation, layers, part, feedback)


def scene_again(simulation: Simulation, layers: SceneLayers, part: Part, feedback: Feedback) -> SceneLayers:
    """The same scene on another part of the DEM."""
    return replace(scene_on(simulation, part, ProgressOnly(feedback)), digest=layers.digest)


def window_words(part: Part, shape: tuple[int, int]) -> str:
    """How much of the DEM is read."""
    share = part.cells / (shape[0] * shape[1])
    return f"{part.columns} x {part.rows} of {shape[1]} x {shape[0]} cells are read ({share:.2g} of the DEM)"
