"""A run with `--fidelity auto`, carried out: any number of the first logs of a draw, at any fidelity.

Each fidelity has a working folder of its own, so the logs that decided are the run's first where theirs was chosen.
"""

from __future__ import annotations

import json
import re
import shutil
import time
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.scene.layers import SceneLayers
from deadwood_algorithms.scene.releases import Releases, reached
from deadwood_algorithms.simulate import chunks
from deadwood_algorithms.simulate.auto import Chosen, Option, Slid, keep_error, record_of, spend_budget
from deadwood_algorithms.simulate.checkpoints import WorkFolder, part_path
from deadwood_algorithms.simulate.fidelity_trade import COSTS, assumed_bounds
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.simulate.queue import Queue, parts_of
from deadwood_algorithms.simulate.simulation import Simulation
from deadwood_algorithms.simulate.warm_up import load_kernels
from deadwood_engine import FIDELITIES

AUTO = "auto"  # the fidelity that is chosen by an error or a budget
# Of a budget, what the run plans with, and what writing the results takes of that at least; else as much as reading.
WITHIN_BUDGET, WRITING_S = 0.95, 1.0


@dataclass(frozen=True)
class Promise:
    """What is asked for: an error of every line's reach, or the least that can be had in so many seconds.

    assume : up to which fidelity the page's errors of calculation are taken for granted
    """

    error: float | None
    budget_s: float | None
    assume: str

    @staticmethod
    def of(error: float | None, budget: str | None, assume: str) -> Promise:
        """From the options; a budget is ``60s``, ``5min``, ``1h`` or a number of seconds."""
        if (error is None) == (budget is None):
            raise UserError(
                "--fidelity auto needs one of --error (the permitted error of a line's reach, such as 0.02) and "
                "--budget (the time for the run, such as 60s)"
            )
        return Promise(error, None if budget is None else _seconds_of(budget), assume)


def _seconds_of(budget: str) -> float:
    units = {"": 1.0, "s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0}
    found = re.fullmatch(r"([0-9]*\.?[0-9]+) *([a-z]*)", str(budget).strip().lower())
    if found is None or found[2] not in units or float(found[1]) == 0.0:
        raise UserError(f"--budget is '{budget}', but must be a time such as 60s, 5min or 1h")
    return float(found[1]) * units[found[2]]


@dataclass
class AutoRun:
    """The logs in the order of the hash of seed and id."""

    promise: Promise
    simulation: Simulation
    layers: SceneLayers
    releases: Releases
    keep: NDArray[np.bool_]
    keeper: chunks.Keeper
    output: str
    seed: int
    resume: bool
    identity: dict[str, Any]
    feedback: Feedback
    works: dict[str, WorkFolder] = field(default_factory=dict)
    parts: dict[str, list[slice]] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.order = hash_order(self.releases.logs.log_id, self.seed)
        if not self.resume:
            self.remove()

    def promised(self, began: float) -> tuple[Chosen, float]:
        """Slide what keeps the promise, or the budget, which runs since ``began``; the choice, and the seconds of all
        cores for logs that are not in the run."""
        assumed = assumed_bounds(self.promise.assume)
        line_ids, cap, many = self.layers.lines.ids, self.order.size, self.simulation.inputs.releases
        try:
            if self.promise.error is None:
                chosen = self._best_in_time(began, assumed)
            else:
                chosen = keep_error(self.promise.error, cap, line_ids, self.slide, assumed, many)
        except UserError:  # what slid for it is of no use to another error
            self.remove()
            raise
        self.feedback.note(f"{chosen.logs} logs at {chosen.option.fidelity}: {chosen.option.why}")
        others = [work for name, work in self.works.items() if name != chosen.option.fidelity]
        spent = sum(float(work.chunk(k)["cost_cpu_s"].sum()) for work in others for k in range(work.finished))
        return chosen, spent

    def _best_in_time(self, began: float, assumed: dict[str, float]) -> Chosen:
        """Slide what the budget allows; a resumed run continues what was decided, however long it takes."""
        line_ids, cap = self.layers.lines.ids, self.order.size
        assert self.promise.budget_s is not None
        place = part_path(f"{self.output}.{AUTO}") / "choice.json"
        asked = [self.promise.budget_s, self.promise.assume]
        known = {"digests": [self.layers.digest, self.releases.digest], "asked": asked}

        def decided(option: Option, logs: int) -> None:
            ends = [part.stop for part in self.parts[option.fidelity]]
            place.parent.mkdir(exist_ok=True)
            choice = {**known, "logs": logs, "ends": ends, "option": [option.fidelity, list(option.bounds)]}
            place.write_text(json.dumps(choice), encoding="utf-8")

        before = json.loads(place.read_text(encoding="utf-8")) if place.is_file() else {}
        if {name: before.get(name) for name in known} != known:
            self.remove()  # its clock has run out, and another would look at other logs
            self.resume = False
            load_kernels(self.layers.shape, self.feedback)
            reading = time.perf_counter() - began  # a machine that reads slowly writes slowly
            end = began + WITHIN_BUDGET * self.promise.budget_s - max(WRITING_S, reading)
            return spend_budget(
                lambda: max(0.0, end - time.perf_counter()), cap, line_ids, self.slide, assumed, decided
            )
        option = Option(*before["option"])
        for n in before["ends"]:
            self.slide(option.fidelity, n)
        slid = self.slide(option.fidelity, before["logs"])
        return Chosen(option, before["logs"], record_of(option, slid.reach, line_ids, cap))

    def slide(self, name: str, n: int) -> Slid:
        """The first ``n`` logs at a fidelity; those that have not slid yet do."""
        if name not in self.works:
            self._begin(name)
        parts = self.parts[name]
        done = parts[-1].stop if parts else 0
        since = time.perf_counter()
        if n > done:
            early = () if done else tuple(border for border in chunks.FIRST_CHUNKS if border < n)
            parts += [slice(p.start + done, p.stop + done) for p in parts_of(n - done, chunks.CHUNK, early)]
            run = self._run(name, Queue(self.order[:n], parts))
            run.slide()
            self.layers = run.slope.layers
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - since
        reach = np.concatenate([self.works[name].chunk(chunk)["reach"] for chunk in range(len(parts))])
        touched = reached(self.layers.lines, {"reach": reach}, self.releases.take(self.order[: len(reach)]))
        return Slid(touched[:n] if n else touched, self.seconds.get(name, 0.0) / len(touched))

    def taken(self, name: str) -> chunks.ChunkedRun:
        """What slid at the fidelity that makes the run."""
        parts = self.parts[name]
        run = self._run(name, Queue(self.order, parts, slid=parts[-1].stop))
        run.remove = self.remove
        return run

    def _run(self, name: str, queue: Queue) -> chunks.ChunkedRun:
        simulation, work = replace(self.simulation, fidelity=FIDELITIES[name]), self.works[name]
        slope = chunks.DrawnScene.on(self.layers, simulation, work, self.feedback)
        return chunks.ChunkedRun(simulation, self.releases, self.keep, self.keeper, slope, queue, work, self.feedback)

    def _begin(self, name: str) -> None:
        simulation = replace(self.simulation, fidelity=FIDELITIES[name])
        known = chunks.identity_of(simulation, self.layers, self.releases, **self.identity)
        known["--error, --budget, --assume"] = [self.promise.error, self.promise.budget_s, self.promise.assume]
        self.works[name] = WorkFolder(self._place(name), known, resume=self.resume, feedback=self.feedback)
        self.parts[name] = []

    def _place(self, name: str) -> str:
        return f"{self.output}.{AUTO}-{name}"

    def remove(self) -> None:
        for name in COSTS:
            shutil.rmtree(part_path(self._place(name)), ignore_errors=True)
        shutil.rmtree(part_path(f"{self.output}.{AUTO}"), ignore_errors=True)
