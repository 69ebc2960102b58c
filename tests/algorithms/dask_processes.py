"""A real scheduler and real workers, each a process of its own on the loopback, for the tests of `--scheduler`."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).parents[2]
PATHS = os.pathsep.join(str(ROOT / each) for each in ("", "engine", "algorithms"))
QUIET = {"DASK_LOGGING__DISTRIBUTED": "critical"}


class Site:
    """A scheduler, and workers on request. `stop` ends all that it has started, whatever their state."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.started: list[subprocess.Popen] = []
        self.scheduler = self._start("dask_scheduler", "--port", "0", "--no-show", "--dashboard-address", "127.0.0.1:0")
        self.address = self._said("Scheduler at:", self.scheduler).split()[-1]

    def _start(self, program: str, *words: str, environ: Mapping[str, str] | None = None) -> subprocess.Popen:
        log = (self.folder / f"{len(self.started)}.log").open("w")
        command = [sys.executable, "-m", f"distributed.cli.{program}", "--host", "127.0.0.1", *words]
        environ = {**os.environ, "PYTHONPATH": PATHS, **(environ or {})}
        process = subprocess.Popen(command, env=environ, stdout=log, stderr=log, cwd=self.folder)
        self.started.append(process)
        return process

    def _said(self, what: str, process: subprocess.Popen, patience: float = 60.0) -> str:
        """The first line with these words that a process has written."""
        log, end = self.folder / f"{self.started.index(process)}.log", time.monotonic() + patience
        while time.monotonic() < end:
            for line in log.read_text().splitlines():
                if what in line:
                    return line.strip()
            assert process.poll() is None, log.read_text()
            time.sleep(0.05)
        raise AssertionError(f"no '{what}' within {patience} s: {log.read_text()}")

    def worker(self, *, wait: bool = True, **environ: str) -> subprocess.Popen:
        words = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--memory-limit", "0"]
        found = self._start("dask_worker", self.address, *words, environ=environ)
        if wait:
            self._said("Registered to:", found)
        return found

    def kill(self, process: subprocess.Popen) -> None:
        process.send_signal(signal.SIGKILL)
        process.wait(10)

    def stop(self) -> None:
        for process in reversed(self.started):
            if process.poll() is None:
                process.send_signal(signal.SIGCONT)
                process.kill()
            process.wait(10)
