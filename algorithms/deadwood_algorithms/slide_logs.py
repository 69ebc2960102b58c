"""Slide the released logs down the terrain, through the standing trees, over or into the barriers.

Each log is a rigid truncated cone (or, with --shape, any convex body) in hard frictional contact with terrain, trees,
barriers and lying logs (the engine's README has the physics, after the paper's section 3). The run's folder holds the
deposits, the trajectories, the share of logs that reach each line, every hit of a barrier, what each tree that was hit
has taken, and rasters of how often, how fast and how high logs pass. With --lines, danger.tif has where a moving log
ends on the road: of the logs that passed a cell, the share that reached any line, and each line, with the same outline
or afterwards. Every released log is accounted for.

Logs do not break, trees and barriers do not give way, logs do not meet each other. An interrupted run goes on with
--resume where it stopped, and gives the same results, bit for bit, as one that was never interrupted. With --until-ci
a run takes the logs in an even draw and ends when it has enough of them; those not run are counted apart.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from deadwood_algorithms import tool
from deadwood_algorithms.scene.released_scene import ReleasedScene
from deadwood_algorithms.tool import Cancelled, Feedback, Outcome, Tool, UserError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from deadwood_algorithms.runs.queue import Queue
    from deadwood_algorithms.runs.work_folder import WorkFolder
    from deadwood_algorithms.scene.read import SceneLayers
    from deadwood_algorithms.scene.releases import Releases
    from deadwood_engine import Fidelity, Rasters

# Logs worked on between two saved states: enough to keep 16 threads busy, little to lose or to hold in memory.
CHUNK = 512
# The first chunks are smaller, so that a run that is soon interrupted keeps something, however slow its logs are.
FIRST_CHUNKS = (32, 64, 128, 256)  # logs after which they end
# A state of the rasters is saved after a chunk as often as that costs so much of the time (on 4000 x 4000 cells half a
# second, on others next to nothing), and at least so often: what an interruption loses, beside the chunk at work.
CHECKPOINT_SHARE, CHECKPOINT_S = 0.05, 10.0

# What other programs chain on; a run without lines, for example, has no layer reach.
PARTS = (
    *(f"run.gpkg|layername={name}" for name in ("deposits", "deposited_logs", "trajectories", "reach")),
    *(f"{name}.tif" for name in ("hit_count", "reach_probability", "deposit_count")),
    *(f"{name}.tif" for name in ("speed_max", "energy_max", "jump_max", "danger")),
    "poses.parquet",
    "summary.json",
    "project.qgz",
    "report.html",
)


@dataclass(frozen=True, kw_only=True)
class Ask(ReleasedScene):
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
    trajectories: str = tool.text(
        "Logs whose trajectory is kept: all, none, or how many", default="1000", help="Chosen by seed and log_id alone."
    )
    until_ci: float | None = tool.number(
        "End when every line's reach interval is this narrow (half-width)",
        default=None,
        minimum=0.0,
        maximum=0.5,
        exclusive=True,
        help="0.005 means ±0.5 points. Logs are run in an even draw, at most all; looks after 1000, 2000, 4000, ... "
        "of them take intervals widened for the repetition; the reported 95 % ones are narrower still. Needs --lines.",
    )
    danger_least: int = tool.integer(
        "Logs that must have passed a cell for its danger to be told",
        default=10,
        minimum=1,
        advanced=True,
        help="In danger.tif, which --lines brings, cells with fewer are transparent.",
    )
    qgis_project: bool = tool.flag(
        "Add a QGIS project to the run",
        help="With styled and grouped layers, animated logs and a 3-D view: project.qgz, and scene.gpkg beside it.",
    )
    outline_every_s: float = tool.number(
        "Time between two outlines of the animated logs",
        unit="s",
        default=0.25,
        minimum=0.02,
        advanced=True,
        help="Of the QGIS project, for the logs that keep their trajectory.",
    )
    report: bool = tool.flag(
        "Add a report to the run", help="One page with maps, figures, tables and a 3-D view: report.html (make-report)."
    )
    resume: bool = tool.flag("Go on with an interrupted run")
    output: str = tool.output_folder("Folder of the run", parts=PARTS)
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    from deadwood_algorithms.files.outputs import output_folder
    from deadwood_algorithms.numbers.log_order import keep_by_hash
    from deadwood_algorithms.runs.queue import Queue
    from deadwood_algorithms.runs.results import write_results
    from deadwood_algorithms.runs.summary import Asked
    from deadwood_algorithms.runs.work_folder import WorkFolder
    from deadwood_algorithms.scene.window import read_released_scene

    kept_count = trajectories_wanted(ask.trajectories)
    if ask.until_ci is not None and ask.lines is None:
        raise UserError("--until-ci needs --lines: it is the reach of lines whose interval it watches")
    with output_folder(ask.output, ask.overwrite) as folder:
        layers, releases = read_released_scene(ask, feedback, windowed=True)
        ids = releases.logs.log_id
        queue = Queue.of(ids, CHUNK, FIRST_CHUNKS, target=ask.until_ci, line_ids=layers.lines.ids, seed=ask.seed)
        keep = keep_by_hash(ids, kept_count, ask.seed)

        fidelity = fidelity_of(ask)
        work = WorkFolder(ask.output, identity(ask, fidelity, layers, releases), resume=ask.resume, feedback=feedback)
        slope = DrawnScene.on(layers, ask, work, feedback)
        slide_queue(ask, fidelity, slope, releases, queue, keep, work, feedback)

        asked = Asked(scene=ask, fidelity=ask.fidelity, keeps_poses=kept_count != 0, danger_least=ask.danger_least)
        outcome = write_results(
            folder,
            Path(ask.output),
            tool.manifest(TOOL, ask),
            asked,
            fidelity,
            slope.layers,
            releases,
            queue,
            slope.rasters,
            work,
            feedback,
        )
        if ask.qgis_project:
            from deadwood_algorithms.runs.qgis_project import PROJECT, add_project

            add_project(folder, Path(ask.output), ask, slope.layers, releases, ask.outline_every_s, feedback)
            outcome = replace(outcome, outputs={**outcome.outputs, "qgis_project": Path(ask.output) / PROJECT})
        if ask.report:
            outcome = replace(outcome, outputs={**outcome.outputs, "report": add_report(ask, folder, feedback)})
    work.remove()
    return outcome


def add_report(ask: Ask, folder: Path, feedback: Feedback) -> Path:
    """Write the page into the folder of the run, which does not stand at its place yet; where it will be."""
    from deadwood_algorithms import make_report

    page = make_report.Ask(runs=str(folder), names=Path(ask.output).name, output=str(folder / "report.html"))
    make_report.run(page, feedback)
    return Path(ask.output) / "report.html"


@dataclass
class DrawnScene:
    """What is slid on, and the rasters that logs draw on it; both grow when logs come near a large DEM's window."""

    layers: SceneLayers
    rasters: Rasters

    @staticmethod
    def on(layers: SceneLayers, ask: Ask, work: WorkFolder, feedback: Feedback) -> DrawnScene:
        """With the rasters of the chunks that are finished, on a window that holds them."""
        from deadwood_algorithms.scene.window import scene_again
        from deadwood_engine import Rasters

        if work.part and layers.dem.whole and layers.dem.part.joined(work.part) != layers.dem.part:
            layers = scene_again(ask, layers, layers.dem.part.joined(work.part), feedback)
        rasters = Rasters.allocate(layers.scene, layers.threads, layers.danger_bands())
        if work.finished:
            rasters.add(work.rasters(layers.dem))
        return DrawnScene(layers, rasters)

    def widen(self, sides: list[str], ask: Ask, work: WorkFolder, feedback: Feedback) -> None:
        """Begin again from the last checkpoint, on a wider window."""
        from deadwood_algorithms.scene.window import wider_scene

        self.rasters.workers.clear()  # before the wider ones are made
        wider = DrawnScene.on(wider_scene(ask, self.layers, sides, feedback), ask, work, feedback)
        self.layers, self.rasters = wider.layers, wider.rasters


def slide_queue(
    ask: Ask,
    fidelity: Fidelity,
    slope: DrawnScene,
    releases: Releases,
    queue: Queue,
    keep: NDArray[np.bool_],
    work: WorkFolder,
    feedback: Feedback,
) -> None:
    """Slide the logs that are not yet done, one chunk after the other, until all are or the rule has enough.

    A log near the side of the DEM's window has drawn on the rasters what it may not do on the whole DEM, so all since
    the last checkpoint is slid again on a wider one.
    """
    from deadwood_algorithms.scene.releases import reached
    from deadwood_algorithms.scene.warm_up import load_kernels

    load_kernels(slope.layers.shape, feedback)
    total = queue.rows.size
    saved, saving_s = time.perf_counter(), 0.05  # how long it takes, until that has been measured
    for chunk, part in enumerate(queue.parts):
        fresh = chunk >= work.finished
        if fresh or chunk in work.lost:
            first = work.finished if fresh else chunk
            try:
                todo = [chunk]
                while todo:
                    sides = slide_chunk(ask, fidelity, slope, releases, queue, keep, work, todo[0], feedback)
                    if sides:
                        slope.widen(sides, ask, work, feedback)
                    todo = list(range(first, chunk + 1)) if sides else todo[1:]
            except (Cancelled, KeyboardInterrupt) as error:
                kept = queue.parts[work.finished].start
                feedback.note(f"{kept} of {total} logs are kept in {work.path}; --resume goes on from there")
                raise Cancelled from error
        queue.slid = part.stop
        last = part.stop == total
        if queue.rule:
            rows = queue.rows[part]
            touched = reached(slope.layers.lines, work.chunk(chunk), releases.take(rows))
            last = queue.rule.enough(rows.size, touched.sum(axis=0)) or last
        since = time.perf_counter() - saved
        due = last or since > min(CHECKPOINT_S, saving_s / CHECKPOINT_SHARE) or feedback.cancelled()
        if fresh and due:
            work.checkpoint(chunk + 1, slope.rasters.totals(), slope.layers.dem)
            saving_s, saved = time.perf_counter() - saved - since, time.perf_counter()
        if last:
            break
    feedback.progress(queue.slid, queue.slid, "sliding logs")


def slide_chunk(
    ask: Ask,
    fidelity: Fidelity,
    slope: DrawnScene,
    releases: Releases,
    queue: Queue,
    keep: NDArray[np.bool_],
    work: WorkFolder,
    chunk: int,
    feedback: Feedback,
) -> list[str]:
    """Slide the logs of one chunk and keep what comes of them; or the sides of the window that were too near.

    The rasters of the last checkpoint hold all chunks before it, so one of those that was lost is not drawn again.
    """
    from deadwood_algorithms.runs.results import arrays_of, pose_table
    from deadwood_algorithms.scene.releases import starts_inside
    from deadwood_algorithms.scene.sliding import reporter, slide_once

    part = queue.parts[chunk]
    rows = queue.rows[part]
    logs = releases.logs.take(rows)

    report = reporter(feedback, queue.goal, "sliding logs", before=part.start)
    began = time.perf_counter()
    rasters = slope.rasters if chunk >= work.finished else None
    inside = slope.layers.by_scene_line(starts_inside(slope.layers.lines, releases.take(rows)))
    result, sides = slide_once(
        slope.layers, logs, fidelity, ask, report, keep_poses=keep[rows], rasters=rasters, inside=inside
    )
    wall_s = time.perf_counter() - began
    if not sides:
        poses = pose_table(result.poses, logs.log_id, slope.layers.dem.crs)
        work.save(chunk, arrays_of(result, slope.layers, logs.log_id, wall_s), poses)
    return sides


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


def fidelity_of(ask: Ask) -> Fidelity:
    """The numbers of the preset, with those that the user gave in their place."""
    from deadwood_engine import FIDELITIES

    given = {"time_step": ask.time_step, "station_spacing": ask.station_spacing}
    return FIDELITIES[ask.fidelity]._replace(**{name: value for name, value in given.items() if value is not None})


def identity(ask: Ask, fidelity: Fidelity, layers: SceneLayers, releases: Releases) -> dict[str, Any]:
    """What decides every result, bit for bit: a run is resumed only by one that agrees in all of it."""
    return {
        "version": tool.VERSION,
        "engine": tool.engine_digest(),
        "DEM, friction, trees, barriers, lying logs or lines": layers.digest,
        "releases": releases.digest,
        "fidelity": [float(number) for number in fidelity],
        "options": [*ask.laws().values(), ask.shape, ask.time_limit, ask.rest_speed],
        "trajectories": [ask.trajectories, ask.seed, CHUNK, list(FIRST_CHUNKS)],
        "--until-ci": ask.until_ci,
    }


TOOL = Tool("slide-logs", "Simulate", "Slide the released logs: deposits, trajectories, hit counts, reach", Ask, run)
