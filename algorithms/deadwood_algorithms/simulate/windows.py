"""The scene on the part of a large DEM that logs reach: read for a first guess, and again, wider, when that fails."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from deadwood_algorithms.files.columns import number_column
from deadwood_algorithms.files.dem_windows import DemWindows, open_windows, read_part, read_whole
from deadwood_algorithms.files.grid import Part
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.tool import Feedback, Quiet
from deadwood_algorithms.scene.default_log import DEFAULTED
from deadwood_algorithms.scene.friction import number_of
from deadwood_algorithms.scene.ground import warn_of_ground
from deadwood_algorithms.scene.items import digest_of, plan_of
from deadwood_algorithms.scene.layers import SceneLayers, read_scene
from deadwood_algorithms.scene.memory import LOG_BYTES, refuse_too_many, refuse_too_many_workers, threads_that_fit
from deadwood_algorithms.scene.reach import WHOLE_CELLS, first_part, wider
from deadwood_algorithms.scene.released_scene import (
    ReleasedScene,
    refuse_no_friction,
    say_friction,
    threads_of,
)
from deadwood_algorithms.scene.releases import Releases, releases_of
from deadwood_algorithms.scene.shape import as_shape, read_shape
from deadwood_algorithms.simulate.scheduler import LOCAL, refuse_no_scheduler

if TYPE_CHECKING:
    import geopandas

GRAVITY = 9.81  # m/s2
# The energy line of the first guess falls less steeply than friction would have it, for logs that roll; where that is
# not enough, the window grows.
SLOPE_SHARE, SLOPE_LEAST, SLOPE_MOST = 0.75, 0.1, 0.3


def read_released_scene(
    ask: ReleasedScene, feedback: Feedback, *, windowed: bool = False
) -> tuple[SceneLayers, Releases]:
    """Read and check every layer.

    With ``windowed``, of a large DEM only the part is read that logs are expected to reach; the caller must then ask
    `SceneLayers.escaped` after sliding, and slide again what `wider_scene` gives.
    """
    refuse_no_friction(ask)
    refuse_no_scheduler(ask.scheduler, ask.workers)
    with open_windows(ask.dem, crs=ask.crs, feedback=feedback, look_through=False) as dem:
        say_friction(ask, dem.cell, feedback)
        releases = read_vector(
            ask.releases, geometry=("point",), target_crs=dem.crs, what="releases", feedback=feedback
        )
        defaults = {name: getattr(ask, name) for name in DEFAULTED}
        mend = "slide them in parts, or release fewer (--until-ci draws as many as it needs)"
        refuse_too_many(len(releases), "logs", ask.releases, each=LOG_BYTES, mend=mend)
        part = part_of(dem, releases, defaults, ask.friction) if windowed else None
        layers = scene_on(ask, dem, part, feedback)
    warn_of_ground(layers.dem, *plan_of(releases), feedback)
    logs = releases_of(releases, layers.dem, defaults, feedback=feedback)
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


def energy_slope(friction: str | float) -> float:
    number = number_of(friction)
    if number is None:  # a layer, which is read on the window alone
        return 0.5 * (SLOPE_LEAST + SLOPE_MOST)
    return float(np.clip(SLOPE_SHARE * number, SLOPE_LEAST, SLOPE_MOST))


def scene_on(ask: ReleasedScene, dem: DemWindows, part: Part | None, feedback: Feedback) -> SceneLayers:
    """The scene of a tool that slides logs, on a part of the DEM or on the whole."""
    by_cell = number_of(ask.friction) is None
    cells = part.cells if part else dem.shape[0] * dem.shape[1]
    counted = danger_lines(ask, dem)
    threads = threads_that_fit(
        1 if ask.scheduler else threads_of(ask.threads),
        cells,
        friction_by_cell=by_cell,
        what=ask.dem,
        feedback=feedback,
        cell=dem.cell,
        danger_lines=counted,
    )
    if ask.scheduler == LOCAL:
        number = ask.workers or threads_of(ask.threads)
        refuse_too_many_workers(number, cells, friction_by_cell=by_cell, what=ask.dem, danger_lines=counted)
    if part is None:
        grid = read_whole(dem, feedback)
    else:
        grid = read_part(dem, part, feedback)
        feedback.note(f"{ask.dem}: {window_words(grid.part, dem.shape)}")
    layers = read_scene(
        ask.dem,
        ask.friction,
        ask.trees,
        ask.barriers,
        ask.lines,
        crs=ask.crs,
        feedback=feedback,
        lying_logs=ask.lying_logs,
        lying_diameter_cm=ask.lying_diameter_cm,
        blocks=ask.blocks,
        friction_column=ask.friction_column,
        friction_elsewhere=ask.friction_elsewhere,
        grid=grid,
    )
    shape = read_shape(ask.shape, grid.cell, feedback)
    digest = digest_of([layers.digest], shape.cloud.points, shape.axes) if shape else layers.digest
    return replace(layers, threads=threads, shape=shape, digest=digest)


def danger_lines(ask: ReleasedScene, dem: DemWindows) -> int:
    """How many lines' danger the tool counts on each cell, at most: rows that share an id count as one."""
    if ask.lines is None or not hasattr(ask, "danger_least"):
        return 0
    return len(read_vector(ask.lines, geometry=("line", "polygon"), target_crs=dem.crs, what="lines", feedback=Quiet()))


def wider_scene(ask: ReleasedScene, layers: SceneLayers, sides: list[str], feedback: Feedback) -> SceneLayers:
    """The scene on a window grown at the sides that logs came too near to; its digest stays that of the first."""
    part = wider(layers.dem.part, sides, layers.dem.frame.shape)
    feedback.note(f"logs came near the {' and '.join(sides)} of the DEM's window, which is read wider")
    return scene_again(ask, layers, part, feedback)


def scene_again(ask: ReleasedScene, layers: SceneLayers, part: Part, feedback: Feedback) -> SceneLayers:
    """The same scene on another part of the DEM."""
    with open_windows(ask.dem, crs=ask.crs, feedback=Quiet(), look_through=False) as dem:
        again = scene_on(ask, dem, part, _ProgressOnly(feedback))
    return replace(again, digest=layers.digest)


def window_words(part: Part, shape: tuple[int, int]) -> str:
    """How much of the DEM is read."""
    share = part.cells / (shape[0] * shape[1])
    return f"{part.columns} x {part.rows} of {shape[1]} x {shape[0]} cells are read ({share:.2g} of the DEM)"


class _ProgressOnly(Quiet):
    """A feedback that passes on progress alone: what notes would say, the user has read."""

    def __init__(self, feedback: Feedback) -> None:
        self.progress, self.cancelled = feedback.progress, feedback.cancelled
