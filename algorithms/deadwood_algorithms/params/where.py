"""Where logs are slid: the options of every tool that slides logs, declared once, and the record that is passed on."""

from __future__ import annotations

import os
from dataclasses import dataclass

from deadwood_algorithms.params import tool


@dataclass(frozen=True)
class Where:
    """Where logs are slid: on threads of this process, or on the workers of a Dask scheduler.

    threads : None for one per core; scheduler : None, ``local`` or an address; workers : number to start, or to wait
    for
    name : name of the work on the scheduler's page
    """

    threads: int | None = None
    scheduler: str | None = None
    workers: int | None = None
    name: str = ""

    @property
    def cores(self) -> int:
        """The requested number of threads, otherwise one for each core that this process may use."""
        return threads_of(self.threads)


@dataclass(frozen=True, kw_only=True)
class SlidingOptions:
    """Part of the ``Ask`` of every tool that slides logs."""

    threads: int | None = tool.integer("Threads (default: every core)", default=None, minimum=1, advanced=True)
    scheduler: str | None = tool.scheduler()
    workers: int | None = tool.workers()
    plan: bool = tool.flag(
        "Only state what the run would take",
        advanced=True,
        help="From a pilot of --plan-logs: logs, core-hours, memory, disk and time. Nothing is written.",
    )
    plan_logs: int = tool.integer("Logs of the plan's pilot, at most", default=400, minimum=10, advanced=True)
    plan_workers: int = tool.integer(
        "Workers for which the plan also states the time", default=16, minimum=1, maximum=1_000_000, advanced=True
    )
    resume: bool = tool.flag("Continue an interrupted run", advanced=True)
    restart: bool = tool.flag("Give up an interrupted run and start again", advanced=True)

    def where(self, name: str) -> Where:
        return Where(self.threads, self.scheduler, self.workers, name)


def threads_of(asked: int | None) -> int:
    """The requested number of threads, otherwise one for each core that this process may use."""
    if asked is not None:
        return asked
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
