"""Slide the released logs down the terrain, through the standing trees, over or into the barriers.

Each log is a rigid truncated cone (or, with --shape, any convex body) in hard frictional contact with terrain, trees,
barriers, lying logs and boulders (the engine's README has the physics, after the paper's section 3). The run's folder
holds the deposits, the trajectories, the share of logs that reach each line, every hit of a barrier, what each tree
that was hit has taken, and rasters of how often, how fast and how high logs pass. With --lines, danger.tif has where a
moving log ends on the road: of the logs that passed a cell, the share that reached any line, and each line, with the
same outline or afterwards. Every released log is accounted for.

    deadwood-tool slide-logs --dem dem.tif --releases releases.gpkg --trees trees.gpkg --blocks boulders.gpkg \\
        --lines road.gpkg --friction 0.25 --output run

Logs do not break, trees, barriers and boulders do not give way, logs do not meet each other. An interrupted run goes
on with --resume where it stopped, and gives the same results, bit for bit, as one that was never interrupted. With
--until-ci a run takes the logs in an even draw and ends when it has enough of them; those not run are counted apart.

With --fidelity auto you say how far the reach of a line may be off, and the tool picks the fidelity and the number of
logs: --error 0.02 for 2 points, at 95 %, against what `reference` would give for all logs of the kind. Logs that slide
at several fidelities show on this slope whether a cheaper one is good enough, and count in the result where they can.
What they cannot show at a bearable cost is said to be assumed: that `standard` is off by no more than it may be on the
worst of the benchmark's slopes (--assume). summary.json and the report tell both errors, apart and together. With
--budget 60s instead of --error it is what comes nearest in that time. Where logs part ways after the first bumps, pairs
that show a cheaper fidelity good enough cost more than they save, and are not slid.
"""

from __future__ import annotations

import json
import re
import shutil
import tempfile
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from deadwood_algorithms.params import tool
from deadwood_algorithms.params.tool import Cancelled, Feedback, Outcome, Quiet, Tool, UserError
from deadwood_algorithms.scene.released_scene import SceneByName

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from deadwood_algorithms.evaluate.fidelity.auto import Chosen, Slid
    from deadwood_algorithms.scene.layers import SceneLayers
    from deadwood_algorithms.scene.releases import Releases
    from deadwood_algorithms.simulate.checkpoints import WorkFolder
    from deadwood_algorithms.simulate.queue import Queue
    from deadwood_engine import Fidelity, Rasters

# Logs worked on between two saved states: enough to keep 16 threads busy, little to lose or to hold in memory.
CHUNK = 512
# The first chunks are smaller, so that a run that is soon interrupted keeps something, however slow its logs are.
FIRST_CHUNKS = (32, 64, 128, 256)  # logs after which they end
# A state of the rasters is saved after a chunk as often as that costs so much of the time (on 4000 x 4000 cells half a
# second, on others next to nothing), and at least so often: what an interruption loses, beside the chunk at work.
CHECKPOINT_SHARE, CHECKPOINT_S = 0.05, 10.0

AUTO = "auto"  # the fidelity that is chosen by --error or --budget
# Of a budget, what the run plans with, and what writing the results takes of that at least; else as much as reading.
WITHIN_BUDGET, WRITING_S = 0.95, 1.0

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
class Ask(SceneByName):
    fidelity: str = tool.choice(
        "Speed against accuracy",
        "draft",
        "standard",
        "fine",
        "reference",
        AUTO,
        default="standard",
        help="auto: the cheapest that keeps --error, or the best within --budget.",
    )
    error: float | None = tool.number(
        "How far the reach of a line may be off (--fidelity auto)",
        default=None,
        minimum=0.0,
        maximum=0.5,
        exclusive=True,
        help="0.02 means ±2 points from what reference would give, at 95 %, by sampling and by calculation together. "
        "Needs --lines.",
    )
    budget: str | None = tool.text(
        "Time for the run, instead of --error (--fidelity auto)",
        default=None,
        help="60s, 5min or 1h: the fidelity and the number of logs that come nearest to the truth in that time on this "
        "machine, give or take a tenth. --report and --qgis-project come on top.",
    )
    assume: str = tool.choice(
        "Errors of calculation taken from the benchmark's slopes (--fidelity auto)",
        "none",
        "standard",
        "draft",
        default="standard",
        advanced=True,
        help="none: all that is promised is measured on this slope, which mostly takes reference. standard: that "
        "standard is off by no more than it may be on the worst of them. draft: draft as well.",
    )
    time_step_s: float | None = tool.number(
        "Longest time step, instead of the fidelity's", unit="s", default=None, minimum=0, exclusive=True, advanced=True
    )
    station_spacing_m: float | None = tool.number(
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
    danger_counts: bool = tool.flag(
        "Keep the counts behind danger.tif too",
        advanced=True,
        help="danger_count.tif, from which those of several runs add up; run-sites asks for it.",
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
    plan: bool = tool.flag(
        "Only say what the run would take, and end",
        help="From a pilot of --plan-logs: logs, core-hours, memory, disk and time. Nothing is written.",
    )
    plan_logs: int = tool.integer("Logs of the pilot of --plan, at most", default=400, minimum=10, advanced=True)
    plan_workers: int = tool.integer(
        "Workers for which --plan tells the time as well", default=16, minimum=1, maximum=1_000_000, advanced=True
    )
    geoparquet: bool = tool.flag(
        "Write the run's layers as GeoParquet too",
        help="deposits.parquet, trajectories.parquet and so on, for programs that work on very many rows.",
    )
    report: bool = tool.flag(
        "Add a report to the run", help="One page with maps, figures, tables and a 3-D view: report.html (make-report)."
    )
    resume: bool = tool.flag("Go on with an interrupted run")
    output: str = tool.output_folder("Folder of the run", parts=PARTS)
    overwrite: bool = tool.overwrite()


def run(ask: Ask, feedback: Feedback) -> Outcome:
    refuse_unfit(ask)
    return told_plan(ask, feedback) if ask.plan else slid_run(ask, feedback)


def slid_run(ask: Ask, feedback: Feedback) -> Outcome:
    """The run itself."""
    from deadwood_algorithms.results.forecast import refuse_full_disk
    from deadwood_algorithms.results.identity import writing
    from deadwood_algorithms.results.summary import Asked
    from deadwood_algorithms.results.writing import write_results
    from deadwood_algorithms.simulate.checkpoints import WorkFolder
    from deadwood_algorithms.simulate.log_order import keep_by_hash
    from deadwood_algorithms.simulate.queue import Queue
    from deadwood_algorithms.simulate.sliding import workers_for
    from deadwood_algorithms.simulate.windows import read_released_scene
    from deadwood_engine import FIDELITIES

    kept_count = trajectories_wanted(ask.trajectories)
    began = time.perf_counter()
    with writing(TOOL, ask, feedback) as outputs:
        folder = outputs.folder()
        layers, releases = read_released_scene(ask, feedback, windowed=True)
        ids = releases.logs.log_id
        keep = keep_by_hash(ids, kept_count, ask.seed)
        if ask.until_ci is None and not ask.resume:  # what is resumed has a part of it already
            refuse_full_disk(ask.output, len(releases), int(keep.sum()))

        asked = Asked(
            scene=ask,
            fidelity=ask.fidelity,
            keeps_poses=kept_count != 0,
            danger_least=ask.danger_least,
            danger_counts=ask.danger_counts,
        )
        with workers_for(ask, feedback):
            if ask.fidelity == AUTO:
                draw = Draw(ask, layers, releases, keep, feedback)
                asked = replace(asked, **draw.promised(began))
                fidelity = FIDELITIES[asked.fidelity]
                queue, work, slope = draw.taken(asked.fidelity)
            else:
                queue = Queue.of(
                    ids, CHUNK, FIRST_CHUNKS, target=ask.until_ci, line_ids=layers.lines.ids, seed=ask.seed
                )
                fidelity, draw = fidelity_of(ask), None
                known = identity(ask, fidelity, layers, releases)
                work = WorkFolder(ask.output, known, resume=ask.resume, feedback=feedback)
                slope = DrawnScene.on(layers, ask, work, feedback)
                slide_queue(ask, fidelity, slope, releases, queue, keep, work, feedback)

        outcome = write_results(
            folder,
            Path(ask.output),
            outputs,
            asked,
            fidelity,
            slope.layers,
            releases,
            queue,
            slope.rasters,
            work,
            feedback,
            geoparquet=ask.geoparquet,
        )
        if ask.qgis_project:
            from deadwood_algorithms.results.qgis_project import PROJECT, add_project

            add_project(folder, Path(ask.output), ask, slope.layers, releases, ask.outline_every_s, feedback)
            outcome = replace(outcome, outputs={**outcome.outputs, "qgis_project": Path(ask.output) / PROJECT})
        if ask.report:
            outcome = replace(outcome, outputs={**outcome.outputs, "report": add_report(ask, folder, feedback)})
    if draw:
        draw.remove()
    work.remove()
    return outcome


def told_plan(ask: Ask, feedback: Feedback) -> Outcome:
    """What the run would take, from a run of a few of its logs in a folder that goes."""
    from deadwood_algorithms.files.vectors import write_vector
    from deadwood_algorithms.results import forecast
    from deadwood_algorithms.scene.released_scene import threads_of
    from deadwood_algorithms.scene.releases import read_numbered
    from deadwood_algorithms.simulate.warm_up import load_kernels

    kept = trajectories_wanted(ask.trajectories)
    load_kernels(None, feedback)  # a compilation is no part of what is forecast
    with tempfile.TemporaryDirectory(prefix="deadwood-plan-") as folder:
        frame = read_numbered(ask.dem, ask.releases, ask.crs, Quiet())
        few, place = Path(folder) / "releases.gpkg", Path(folder) / "pilot"
        write_vector(few, {"releases": forecast.pilot_of(frame, ask.seed, ask.plan_logs)})
        pilot = replace(
            ask, releases=str(few), output=str(place), trajectories="none" if kept == 0 else "all", until_ci=None,
            plan=False, report=False, qgis_project=False, resume=False,
        )  # fmt: skip
        began = time.perf_counter()
        slid_run(pilot, feedback)
        took = forecast.pilot_from(place, time.perf_counter() - began)
    logs = len(frame)
    found = forecast.forecast(
        took,
        logs,
        logs if kept is None else min(kept, logs),
        threads=threads_of(ask.threads),
        workers=ask.plan_workers,
    )
    forecast.refuse_too_large(found, ask.output)
    lines = forecast.words_of_forecast(found, ask.output)
    if ask.until_ci is not None:
        lines = (*lines, "at most: --until-ci may end the run earlier")
    if ask.report or ask.qgis_project:
        lines = (*lines, "without what --report and --qgis-project add to time and disk")
    return Outcome({}, {**forecast.facts_of_forecast(found, ask.output), "pilot": vars(took)}, lines)


def refuse_unfit(ask: Ask) -> None:
    """Refuse options that do not go together."""
    if ask.until_ci is not None and ask.lines is None:
        raise UserError("--until-ci needs --lines: it is the reach of lines whose interval it watches")
    if ask.fidelity != AUTO:
        for name in ("error", "budget"):
            if getattr(ask, name) is not None:
                raise UserError(f"--{name} needs --fidelity auto, which picks fidelity and number of logs by it")
        return
    if (ask.error is None) == (ask.budget is None):
        raise UserError(
            "--fidelity auto needs one of --error (how far the reach of a line may be off, such as 0.02) and --budget "
            "(the time for the run, such as 60s)"
        )
    if ask.budget is not None:
        seconds_of(ask.budget)
    if ask.plan:
        raise UserError("--plan needs a fidelity: with --fidelity auto the run itself decides what it takes; name one")
    if ask.lines is None:
        raise UserError("--fidelity auto needs --lines: it is the reach of lines whose error is promised")
    for name in ("until_ci", "time_step_s", "station_spacing_m"):
        if getattr(ask, name) is not None:
            flag = "--" + name.replace("_", "-")
            raise UserError(f"{flag} does not go with --fidelity auto, which picks it; leave one of them out")


def seconds_of(budget: str) -> float:
    """``60s``, ``5min``, ``1h`` or a number of seconds."""
    units = {"": 1.0, "s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0}
    found = re.fullmatch(r"([0-9]*\.?[0-9]+) *([a-z]*)", str(budget).strip().lower())
    if found is None or found[2] not in units or float(found[1]) == 0.0:
        raise UserError(f"--budget is '{budget}', but must be a time such as 60s, 5min or 1h")
    return float(found[1]) * units[found[2]]


def add_report(ask: Ask, folder: Path, feedback: Feedback) -> Path:
    """Write the page into the folder of the run, which does not stand at its place yet; where it will be."""
    from deadwood_algorithms.tools import make_report

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
        from deadwood_algorithms.simulate.windows import scene_again
        from deadwood_engine import Rasters

        if work.part and layers.dem.whole and layers.dem.part.joined(work.part) != layers.dem.part:
            layers = scene_again(ask, layers, layers.dem.part.joined(work.part), feedback)
        rasters = Rasters.allocate(layers.scene, layers.threads, layers.danger_bands())
        if work.finished:
            rasters.add(work.rasters(layers.dem))
        return DrawnScene(layers, rasters)

    def widen(self, sides: list[str], ask: Ask, work: WorkFolder, feedback: Feedback) -> None:
        """Begin again from the last checkpoint, on a wider window."""
        from deadwood_algorithms.simulate.windows import wider_scene

        self.rasters.workers.clear()  # before the wider ones are made
        wider = DrawnScene.on(wider_scene(ask, self.layers, sides, feedback), ask, work, feedback)
        self.layers, self.rasters = wider.layers, wider.rasters


@dataclass
class Draw:
    """The logs of a run with --fidelity auto, in the order of the hash: any number of the first, at any fidelity.

    Each fidelity has a working folder of its own, so the pilot's logs are the run's first where it was the one chosen.
    """

    ask: Ask
    layers: SceneLayers
    releases: Releases
    keep: NDArray[np.bool_]
    feedback: Feedback
    works: dict[str, WorkFolder] = field(default_factory=dict)
    parts: dict[str, list[slice]] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        from deadwood_algorithms.simulate.log_order import hash_order

        self.order = hash_order(self.releases.logs.log_id, self.ask.seed)
        if not self.ask.resume:
            self.remove()

    def promised(self, began: float) -> dict[str, Any]:
        """Slide what keeps the promise; the fidelity, what is said of it, and what the pilot cost beside the run."""
        from deadwood_algorithms.evaluate.fidelity.auto import keep_error
        from deadwood_algorithms.simulate.fidelity_trade import assumed_bounds

        assumed = assumed_bounds(self.ask.assume)
        line_ids = self.layers.lines.ids
        try:
            if self.ask.error is None:
                chosen = self.best_in_time(began, assumed)
            else:
                chosen = keep_error(self.ask.error, self.order.size, line_ids, self.slide, assumed, self.ask.releases)
        except UserError:  # what slid for it is of no use to another error
            self.remove()
            raise
        self.feedback.note(f"{chosen.logs} logs at {chosen.option.fidelity}: {chosen.why}")
        others = [work for name, work in self.works.items() if name != chosen.option.fidelity]
        spent = sum(float(work.chunk(k)["cost_cpu_s"].sum()) for work in others for k in range(work.finished))
        return {"fidelity": chosen.option.fidelity, "auto": chosen.record, "pilot_cpu_s": spent}

    def best_in_time(self, began: float, assumed: dict[str, float]) -> Chosen:
        """Slide what the budget allows; a resumed run goes on with what was decided, however long it takes."""
        from deadwood_algorithms.evaluate.fidelity.auto import Chosen, Option, record_of, spend_budget
        from deadwood_algorithms.results.run_folder import write_json
        from deadwood_algorithms.simulate.checkpoints import part_path
        from deadwood_algorithms.simulate.warm_up import load_kernels

        line_ids, cap = self.layers.lines.ids, self.order.size
        place = part_path(f"{self.ask.output}.{AUTO}") / "choice.json"
        known = {"digests": [self.layers.digest, self.releases.digest], "asked": [self.ask.budget, self.ask.assume]}

        def decided(chosen: Chosen) -> None:
            option, ends = chosen.option, [part.stop for part in self.parts[chosen.option.fidelity]]
            facts = {"why": chosen.why, "looks": chosen.record["looks"], "logs": chosen.logs, "ends": ends}
            place.parent.mkdir(exist_ok=True)
            write_json(place, {**known, **facts, "option": [option.fidelity, list(option.bounds), option.measured]})

        before = json.loads(place.read_text(encoding="utf-8")) if place.is_file() else {}
        if {name: before.get(name) for name in known} != known:
            self.remove()  # its clock has run out, and another would look at other logs
            self.ask = replace(self.ask, resume=False)
            load_kernels(self.layers.shape, self.feedback)
            reading = time.perf_counter() - began  # a machine that reads slowly writes slowly
            end = began + WITHIN_BUDGET * seconds_of(str(self.ask.budget)) - max(WRITING_S, reading)
            return spend_budget(
                lambda: max(0.0, end - time.perf_counter()), cap, line_ids, self.slide, assumed, decided
            )
        option, why, looks = Option(*before["option"]), before["why"], before["looks"]
        for n in before["ends"]:
            self.slide(option.fidelity, n)
        slid = self.slide(option.fidelity, before["logs"])
        return Chosen(option, before["logs"], why, record_of(option, slid.reach, line_ids, why, looks, cap))

    def slide(self, name: str, n: int) -> Slid:
        """The first ``n`` logs at a fidelity; those that have not slid yet do."""
        import numpy as np

        from deadwood_algorithms.evaluate.fidelity.auto import Slid, cost_of
        from deadwood_algorithms.scene.releases import reached
        from deadwood_algorithms.simulate.checkpoints import WorkFolder
        from deadwood_algorithms.simulate.queue import Queue, parts_of

        ask = replace(self.ask, fidelity=name)
        fidelity = fidelity_of(ask)
        if name not in self.works:
            known = identity(ask, fidelity, self.layers, self.releases)
            known["--error, --budget, --assume"] = [ask.error, ask.budget, ask.assume]
            self.works[name] = WorkFolder(self.place(name), known, resume=ask.resume, feedback=self.feedback)
            self.parts[name] = []
        work, parts = self.works[name], self.parts[name]
        done = parts[-1].stop if parts else 0
        since = time.perf_counter()
        if n > done:
            early = () if done else tuple(border for border in FIRST_CHUNKS if border < n)
            parts += [slice(p.start + done, p.stop + done) for p in parts_of(n - done, CHUNK, early)]
            slope = DrawnScene.on(self.layers, ask, work, self.feedback)
            queue = Queue(self.order[:n], parts)
            slide_queue(ask, fidelity, slope, self.releases, queue, self.keep, work, self.feedback)
            self.layers = slope.layers
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - since
        chunks = [work.chunk(chunk) for chunk in range(len(parts))]
        reach = {"reach": np.concatenate([each["reach"] for each in chunks])}
        touched = reached(self.layers.lines, reach, self.releases.take(self.order[: len(reach["reach"])]))
        rate = cost_of(chunks) if ask.error is not None else self.seconds.get(name, 0.0) / len(touched)
        return Slid(touched[:n] if n else touched, rate)

    def taken(self, name: str) -> tuple[Queue, WorkFolder, DrawnScene]:
        """What slid at the fidelity that makes the run."""
        from deadwood_algorithms.simulate.queue import Queue

        work, parts = self.works[name], self.parts[name]
        slope = DrawnScene.on(self.layers, self.ask, work, self.feedback)
        return Queue(self.order, parts, slid=parts[-1].stop), work, slope

    def place(self, name: str) -> str:
        return f"{self.ask.output}.{AUTO}-{name}"

    def remove(self) -> None:
        from deadwood_algorithms.simulate.checkpoints import part_path
        from deadwood_algorithms.simulate.fidelity_trade import COSTS

        for name in COSTS:
            shutil.rmtree(part_path(self.place(name)), ignore_errors=True)
        shutil.rmtree(part_path(f"{self.ask.output}.{AUTO}"), ignore_errors=True)


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
    from deadwood_algorithms.simulate.warm_up import load_kernels

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
            except (Cancelled, KeyboardInterrupt, UserError) as error:
                kept = queue.parts[work.finished].start
                feedback.note(f"{kept} of {total} logs are kept in {work.path}; --resume goes on from there")
                if isinstance(error, UserError):  # the workers are lost
                    raise
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
    Workers elsewhere begin with the chunks behind it while a slow log keeps it waiting.
    """
    from deadwood_algorithms.results.writing import arrays_of, pose_table
    from deadwood_algorithms.scene.releases import starts_inside
    from deadwood_algorithms.simulate.batch import Batch
    from deadwood_algorithms.simulate.sliding import reporter, slide_batch

    def batch_of(number: int) -> Batch:
        part = queue.parts[number]
        rows = queue.rows[part]
        inside = slope.layers.by_scene_line(starts_inside(slope.layers.lines, releases.take(rows)))
        return Batch(releases.logs.take(rows), keep[rows], inside, part.start, queue.goal)

    batch = batch_of(chunk)
    fresh = chunk >= work.finished
    following = range(chunk + 1, len(queue.parts)) if fresh else ()
    later = (batch_of(number) for number in following if queue.parts[number].start < queue.goal)
    report = reporter(feedback, queue.goal, "sliding logs", before=batch.first)
    began = time.perf_counter()
    rasters = slope.rasters if fresh else None
    result, sides = slide_batch(slope.layers, batch, fidelity, ask, report, rasters=rasters, later=later)
    wall_s = time.perf_counter() - began
    if not sides:
        log_id = releases.logs.log_id[queue.rows[queue.parts[chunk]]]
        poses = pose_table(result.poses, log_id, slope.layers.dem.crs)
        work.save(chunk, arrays_of(result, slope.layers, log_id, wall_s), poses)
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
    from deadwood_engine import fidelity_with

    return fidelity_with(ask.fidelity, ask.time_step_s, ask.station_spacing_m)


def identity(ask: Ask, fidelity: Fidelity, layers: SceneLayers, releases: Releases) -> dict[str, Any]:
    """What decides every result, bit for bit: a run is resumed only by one that agrees in all of it."""
    return {
        "version": tool.VERSION,
        "engine": tool.engine_digest(),
        "DEM, friction, trees, barriers, lying logs, blocks or lines": layers.digest,
        "releases": releases.digest,
        "fidelity": [float(number) for number in fidelity],
        "options": [*ask.laws().values(), ask.shape, ask.time_limit_s, ask.rest_speed_ms],
        "trajectories": [ask.trajectories, ask.seed, CHUNK, list(FIRST_CHUNKS)],
        "--until-ci": ask.until_ci,
    }


TOOL = Tool("slide-logs", "Simulate", "Slide the released logs: deposits, trajectories, hit counts, reach", Ask, run)
