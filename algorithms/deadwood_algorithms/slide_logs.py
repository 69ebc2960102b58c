"""Slide the released logs down the terrain, through the standing trees, over or into the barriers.

Each log is a rigid truncated cone in hard frictional contact with terrain, trees and barriers (the engine's README has
the physics, after the paper's section 3). The run's folder holds the deposits, the trajectories, the share of logs that
reach each line, and rasters of how often, how fast and how high logs pass. Every released log is accounted for.

Logs do not break, trees and barriers do not give way, logs do not meet each other. An interrupted run goes on with
--resume where it stopped, and gives the same results, bit for bit, as one that was never interrupted.
"""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms import tool
from deadwood_algorithms.tool import Cancelled, Feedback, Outcome, Tool, UserError

if TYPE_CHECKING:
    from deadwood_algorithms.releases_from_layer import Releases
    from deadwood_algorithms.run_folder import WorkFolder
    from deadwood_algorithms.scene_from_layers import SceneLayers
    from deadwood_engine import Fidelity, Rasters

# Logs worked on between two saved states: enough to keep 16 threads busy, little to lose or to hold in memory.
CHUNK = 512
CHECKPOINT_S = 10.0  # between two saved states of the rasters: on 4000 x 4000 cells one takes half a second
DEFAULTED = ("dbh_cm", "length_m", "density_kg_m3", "orientation", "tilt_deg", "azimuth_deg", "speed_ms", "drop_m")


@dataclass(frozen=True, kw_only=True)
class Ask:
    dem: str = tool.raster("Terrain model")
    releases: str = tool.vector("Released logs", "point")
    trees: str | None = tool.vector("Standing trees", "point", default=None)
    barriers: str | None = tool.vector("Barriers", "line", default=None)
    lines: str | None = tool.vector("Roads, railways, houses to be reached", "line", "polygon", default=None)
    friction: str = tool.number_or_layer(
        "Friction coefficient", minimum=0.0, help="A number, a raster, or polygons with a field 'friction' or 'mu'."
    )
    restitution: float = tool.number("Normal restitution of impacts", default=0.0, minimum=0.0, maximum=1.0)
    shape: str = tool.choice("Shape of the logs", "cone", default="cone", advanced=True)
    fidelity: str = tool.choice("Speed against accuracy", "draft", "standard", "fine", "reference", default="standard")
    time_step: float | None = tool.number(
        "Longest time step, instead of the fidelity's", unit="s", default=None, minimum=0, exclusive=True, advanced=True
    )
    station_spacing: float | None = tool.number(
        "Distance of the contact rings, instead of the fidelity's",
        unit="m",
        default=None,
        minimum=0.0,
        exclusive=True,
        advanced=True,
    )
    time_limit: float = tool.number("Longest run of a log", unit="s", default=300.0, minimum=0.0, exclusive=True)
    rest_speed: float = tool.number(
        "Speed below which a log may be at rest", unit="m/s", default=0.1, minimum=0.0, exclusive=True, advanced=True
    )
    dbh_cm: float = tool.number(
        "DBH of logs whose layer names none", unit="cm", default=75.0, minimum=0, exclusive=True
    )
    length_m: float = tool.number("Length, likewise", unit="m", default=30.0, minimum=0.0, exclusive=True)
    density_kg_m3: float = tool.number("Density, likewise", unit="kg/m³", default=300.0, minimum=0.0, exclusive=True)
    orientation: str = tool.choice("Orientation, likewise", "upright", "lying", "tilted", default="upright")
    tilt_deg: float = tool.number("Tilt from the vertical, likewise", unit="°", default=0.0, minimum=0, maximum=180)
    azimuth_deg: float = tool.number("Azimuth of tip and speed, likewise", unit="°", default=0.0)
    speed_ms: float = tool.number("Initial speed, likewise", unit="m/s", default=0.0, minimum=0.0)
    drop_m: float = tool.number("Clearance at the start, likewise", unit="m", default=0.0, minimum=0.0)
    min_runout: float | None = tool.number(
        "Deposits nearer than this do not count for the spread",
        unit="m",
        default=None,
        minimum=0.0,
        help="Default: one log length.",
    )
    trajectories: str = tool.text(
        "Logs whose trajectory is kept: all, none, or how many", default="1000", help="Chosen by seed and log_id alone."
    )
    seed: int = tool.seed()
    threads: int | None = tool.integer("Threads (default: every core)", default=None, minimum=1, advanced=True)
    crs: str | None = tool.crs()
    resume: bool = tool.flag("Go on with an interrupted run")
    output: str = tool.output_folder("Folder of the run")
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.layers import output_folder
    from deadwood_algorithms.releases_from_layer import read_releases
    from deadwood_algorithms.run_folder import WorkFolder
    from deadwood_algorithms.run_results import write_results
    from deadwood_algorithms.scene_from_layers import read_scene
    from deadwood_engine import Rasters

    kept_count = trajectories_wanted(ask.trajectories)
    with output_folder(ask.output, ask.overwrite) as folder:
        layers = read_scene(ask.dem, ask.friction, ask.trees, ask.barriers, ask.lines, crs=ask.crs, feedback=feedback)
        defaults = {name: getattr(ask, name) for name in DEFAULTED}
        releases = read_releases(ask.releases, layers.dem, defaults, feedback=feedback)
        keep = keep_by_hash(releases.logs.log_id, kept_count, ask.seed)

        fidelity = fidelity_of(ask)
        work = WorkFolder(ask.output, identity(ask, fidelity, layers, releases), resume=ask.resume, feedback=feedback)
        rasters = Rasters.allocate(layers.scene, threads_of(ask.threads))
        if work.finished:
            rasters.add(work.rasters(layers.dem.shape))
        slide_chunks(ask, fidelity, layers, releases, keep, rasters, work, feedback)

        outcome = write_results(folder, TOOL, ask, fidelity, layers, releases, rasters, work, feedback)
    work.remove()
    return outcome


def slide_chunks(
    ask: Ask,
    fidelity: Fidelity,
    layers: SceneLayers,
    releases: Releases,
    keep: NDArray[np.bool_],
    rasters: Rasters,
    work: WorkFolder,
    feedback: Feedback,
) -> None:
    """Slide the logs that are not yet done, one chunk after the other, each kept as soon as it is finished."""
    from deadwood_algorithms.run_results import arrays_of, pose_table
    from deadwood_engine import Interrupted, slide

    total = len(releases)
    saved = time.perf_counter()
    for start in range(work.finished * CHUNK, total, CHUNK):
        part = slice(start, min(start + CHUNK, total))

        def report(done: int, start: int = start) -> bool:
            feedback.progress(start + done, total, "sliding logs")
            return feedback.cancelled()

        began = time.perf_counter()
        try:
            result = slide(
                layers.scene,
                releases.logs.take(part),
                fidelity,
                restitution=ask.restitution,
                time_limit=ask.time_limit,
                rest_speed=ask.rest_speed,
                threads=threads_of(ask.threads),
                keep_poses=keep[part],
                rasters=rasters,
                report=report,
            )
        except (Interrupted, KeyboardInterrupt) as error:
            kept = work.finished * CHUNK
            feedback.note(f"{kept} of {total} logs are kept in {work.path}; --resume goes on from there")
            raise Cancelled from error
        ended = time.perf_counter()
        poses = pose_table(result.poses, releases.logs.log_id[part], layers.dem.crs)
        work.save(start // CHUNK, arrays_of(result, ended - began), poses)
        if part.stop == total or ended - saved > CHECKPOINT_S:
            work.checkpoint(start // CHUNK + 1, rasters.totals())
            saved = time.perf_counter()
    feedback.progress(total, total, "sliding logs")


def threads_of(asked: int | None) -> int:
    """The threads asked for, else one for each core that this process may use."""
    if asked is not None:
        return asked
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def trajectories_wanted(text: str) -> int | None:
    """How many logs keep their trajectory; None for all."""
    name = str(text).strip().lower()
    if name == "all":
        return None
    if name == "none":
        return 0
    if name.isdigit():
        return int(name)
    raise UserError(f"--trajectories is '{text}', but must be all, none or a whole number")


def keep_by_hash(log_id: NDArray[np.int64], count: int | None, seed: int) -> NDArray[np.bool_]:
    """The ``count`` logs with the smallest hash of seed and log_id: the same logs in whatever order they come."""
    if count is None or count >= log_id.size:
        return np.ones(log_id.size, bool)
    hashes = mix(log_id.astype(np.uint64) ^ mix(np.array([seed], np.uint64)))
    keep = np.zeros(log_id.size, bool)
    keep[np.argsort(hashes, kind="stable")[:count]] = True
    return keep


def mix(value: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The splitmix64 step: a bijection of 64-bit numbers whose output looks random."""
    value = value + np.uint64(0x9E3779B97F4A7C15)
    value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return value ^ (value >> np.uint64(31))


def fidelity_of(ask: Ask) -> Fidelity:
    """The numbers of the preset, with those that the user gave in their place."""
    from deadwood_engine import FIDELITIES

    given = {"time_step": ask.time_step, "station_spacing": ask.station_spacing}
    return FIDELITIES[ask.fidelity]._replace(**{name: value for name, value in given.items() if value is not None})


def identity(ask: Ask, fidelity: Fidelity, layers: SceneLayers, releases: Releases) -> dict[str, Any]:
    """What decides every result, bit for bit: a run is resumed only by one that agrees in all of it."""
    return {
        "version": tool.VERSION,
        "DEM, friction, trees, barriers or lines": layers.digest,
        "releases": releases.digest,
        "fidelity": [float(number) for number in fidelity],
        "options": [ask.restitution, ask.shape, ask.time_limit, ask.rest_speed],
        "trajectories": [ask.trajectories, ask.seed, CHUNK],
    }


TOOL = Tool("slide-logs", "Simulate", "Slide the released logs: deposits, trajectories, hit counts, reach", Ask, run)
