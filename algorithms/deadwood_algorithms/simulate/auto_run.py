"""A run with `--fidelity auto`: any number of the first logs of a draw, at any fidelity.

Each fidelity has a separate working folder, so the logs that led to the decision are the run's first if theirs was
chosen.
"""

from __future__ import annotations

import json
import re
import shutil
import time
from dataclasses import dataclass, field, replace

import numpy as np

from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.run_options import AUTO, FidelityOptions
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.scene.releases import reached
from deadwood_algorithms.scene.slope_kind import kind_of
from deadwood_algorithms.simulate import chunks
from deadwood_algorithms.simulate.auto import Chosen, Option, Slid, keep_error, record_of, spend_budget
from deadwood_algorithms.simulate.checkpoints import WorkFolder, part_path
from deadwood_algorithms.simulate.fidelity_trade import COSTS, assumed_errors
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.simulate.log_run import LogRun
from deadwood_algorithms.simulate.promise import Between
from deadwood_algorithms.simulate.queue import Queue, parts_of
from deadwood_algorithms.simulate.warm_up import load_kernels
from deadwood_engine import FIDELITIES

# Share of a budget that the run plans with, and the least time [s] for writing the results, otherwise as long as
# reading took.
WITHIN_BUDGET, WRITING_S = 0.95, 1.0


@dataclass(frozen=True)
class Promise:
    """What is required: an error of every line's reach, or the smallest error possible within a budget [s].

    assume : down to which fidelity the errors of calculation on random slopes are assumed to hold
    """

    error: float | None
    budget_s: float | None
    assume: str


def promise_of(options: FidelityOptions, *, lines: str | None, until_ci: float | None, plan: bool) -> Promise | None:
    """What is promised of a run with ``--fidelity auto``, None for any other fidelity; rejects options that do not go
    together. A budget is ``60s``, ``5min``, ``1h`` or a number of seconds."""
    if options.fidelity != AUTO:
        for name in ("error", "budget"):
            if getattr(options, name) is not None:
                raise UserError(
                    f"--{name} needs --fidelity auto, which chooses the fidelity and the number of logs from it"
                )
        return None
    if (options.error is None) == (options.budget is None):
        raise UserError(
            "--fidelity auto needs one of --error (the permitted error of a line's reach, such as 0.02) and "
            "--budget (the time for the run, such as 60s)"
        )
    budget_s = None if options.budget is None else _seconds_of(options.budget)
    if plan:
        raise UserError(
            "--plan needs a fidelity: with --fidelity auto the run itself decides how many logs it needs; name one"
        )
    if lines is None:
        raise UserError("--fidelity auto needs --lines: the promised error is that of the reach of lines")
    chosen = {"until_ci": until_ci, "time_step_s": options.time_step_s, "station_spacing_m": options.station_spacing_m}
    for name, value in chosen.items():
        if value is not None:
            flag = "--" + name.replace("_", "-")
            raise UserError(f"{flag} conflicts with --fidelity auto, which chooses it; leave one of them out")
    return Promise(options.error, budget_s, options.assume)


def _seconds_of(budget: str) -> float:
    units = {"": 1.0, "s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0}
    found = re.fullmatch(r"([0-9]*\.?[0-9]+) *([a-z]*)", str(budget).strip().lower())
    if found is None or found[2] not in units or float(found[1]) == 0.0:
        raise UserError(f"--budget is '{budget}', but must be a time such as 60s, 5min or 1h")
    return float(found[1]) * units[found[2]]


@dataclass
class AutoRun:
    """The logs of a run in the order of the hash of seed and id; a window that grows for one fidelity grows for all."""

    promise: Promise
    run: LogRun
    works: dict[str, WorkFolder] = field(default_factory=dict)
    parts: dict[str, list[slice]] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.order = hash_order(self.run.releases.logs.log_id, self.run.seed)
        if not self.run.resume:
            self.remove()

    def promised(self, began: float) -> tuple[Chosen, float]:
        """Slide what keeps the promise, or the budget, which runs since ``began``; returns the choice, and the seconds
        of all cores for logs that are not in the run."""
        kind = kind_of(self.run.layers.scene, self.run.releases.logs).words
        assumed = assumed_errors(self.promise.assume, kind)
        line_ids, cap, many = self.run.layers.lines.ids, self.order.size, self.run.simulation.inputs.releases
        try:
            if self.promise.error is None:
                chosen = self._best_in_time(began, assumed)
            else:
                chosen = keep_error(self.promise.error, cap, line_ids, self.slide, assumed, many)
        except UserError:  # logs slid for it are of no use for another error
            self.remove()
            raise
        chosen = replace(chosen, record={**chosen.record, "kind": kind})
        self.run.feedback.note(
            f"{counted(chosen.logs, 'log')} at {chosen.option.fidelity}: {chosen.option.why} ({kind})",
            code="fidelity-chosen",
            logs=chosen.logs,
        )
        others = [work for name, work in self.works.items() if name != chosen.option.fidelity]
        spent = sum(float(work.chunk(k)["cost_cpu_s"].sum()) for work in others for k in range(work.finished))
        return chosen, spent

    def _best_in_time(self, began: float, assumed: dict[str, Between]) -> Chosen:
        """Slide what the budget allows; a resumed run continues what was decided, however long it takes."""
        line_ids, cap = self.run.layers.lines.ids, self.order.size
        assert self.promise.budget_s is not None
        place = part_path(f"{self.run.output}.{AUTO}") / "choice.json"
        asked = [self.promise.budget_s, self.promise.assume]
        known = {"digests": [self.run.layers.digest, self.run.releases.digest], "asked": asked}

        def decided(option: Option, logs: int) -> None:
            ends = [part.stop for part in self.parts[option.fidelity]]
            place.parent.mkdir(exist_ok=True)
            choice = {**known, "logs": logs, "ends": ends, "option": [option.fidelity, option.between]}
            place.write_text(json.dumps(choice), encoding="utf-8")

        before = json.loads(place.read_text(encoding="utf-8")) if place.is_file() else {}
        if {name: before.get(name) for name in known} != known:
            self.remove()  # its time has run out, and another run would examine other logs
            self.run = replace(self.run, resume=False)
            load_kernels(self.run.layers.shape, self.run.feedback)
            reading = time.perf_counter() - began  # a machine that reads slowly also writes slowly
            end = began + WITHIN_BUDGET * self.promise.budget_s - max(WRITING_S, reading)
            return spend_budget(
                lambda: max(0.0, end - time.perf_counter()), cap, line_ids, self.slide, assumed, decided
            )
        fidelity, between = before["option"]
        option = Option(fidelity, Between(*between))
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
            some = self._run(name, Queue(self.order[:n], parts))
            some.slide()
            self.run = replace(self.run, layers=some.slope.layers)
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - since
        reach = np.concatenate([self.works[name].chunk(chunk)["reach"] for chunk in range(len(parts))])
        touched = reached(self.run.layers.lines, {"reach": reach}, self.run.releases.take(self.order[: len(reach)]))
        return Slid(touched[:n] if n else touched, self.seconds.get(name, 0.0) / len(touched))

    def taken(self, name: str) -> chunks.ChunkedRun:
        """The results at the fidelity of the run."""
        parts = self.parts[name]
        taken = self._run(name, Queue(self.order, parts, slid=parts[-1].stop))
        taken.remove = self.remove
        return taken

    def _run(self, name: str, queue: Queue) -> chunks.ChunkedRun:
        return self.run.at(FIDELITIES[name]).chunked(queue, self.works[name])

    def _begin(self, name: str) -> None:
        asked = {"--error, --budget, --assume": [self.promise.error, self.promise.budget_s, self.promise.assume]}
        self.works[name] = self.run.at(FIDELITIES[name]).work_folder(self._place(name), **asked)
        self.parts[name] = []

    def _place(self, name: str) -> str:
        return f"{self.run.output}.{AUTO}-{name}"

    def remove(self) -> None:
        for name in COSTS:
            shutil.rmtree(part_path(self._place(name)), ignore_errors=True)
        shutil.rmtree(part_path(f"{self.run.output}.{AUTO}"), ignore_errors=True)


def slide_promised(run: LogRun, promise: Promise, began: float) -> tuple[chunks.ChunkedRun, Chosen, float]:
    """Slide the logs, at the fidelity, that keep the promise (a budget runs since ``began``); returns the results,
    what was chosen, and the seconds of all cores for logs that are not in the run."""
    auto = AutoRun(promise, run)
    chosen, others_cpu_s = auto.promised(began)
    return auto.taken(chosen.option.fidelity), chosen, others_cpu_s
