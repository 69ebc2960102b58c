"""`--scheduler` with a real scheduler and workers as processes: killed, added late, refused; the same bytes."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
from dask_processes import PATHS, ROOT, Site
from slope_case import Case, assert_same_bytes, assert_same_file, points, write_layer

from deadwood_algorithms.evaluate.protection import changed_scenes
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.simulate import chunks, crew
from deadwood_algorithms.simulate import workers as spread_workers
from deadwood_algorithms.tools import value_trees

LOGS = 400
pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="signals of POSIX")


class Watcher:
    """A feedback that records, and performs an action once a number of logs is done."""

    def __init__(self, act: Callable[[], None] = lambda: None, after: int = 1, what: str = "sliding logs") -> None:
        self.act, self.after, self.acted, self.what = act, after, False, what
        self.notes: list[str] = []
        self.warnings: list[str] = []

    def progress(self, done: float, total: float, what: str) -> None:
        if what.startswith(self.what) and done >= self.after and not self.acted:
            self.acted = True
            assert done < total
            self.act()

    def note(self, message: str, code: str = "", **numbers: Any) -> None:
        self.notes.append(message)

    def warn(self, message: str, code: str = "", **numbers: Any) -> None:
        self.warnings.append(message)

    def cancelled(self) -> bool:
        return False

    def heard(self, words: str) -> int:
        return sum(words in each for each in (*self.notes, *self.warnings))


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    """Many short logs, so that the run can be interrupted in the middle."""
    made = Case(tmp_path_factory.mktemp("case"))
    rng = np.random.default_rng(7)
    places = [(20.0 + 20.0 * a, 70.0 + 10.0 * b) for a, b in rng.random((LOGS, 2))]
    made.releases = write_layer(made.folder / "many.gpkg", points(*places), log_id=np.arange(LOGS))
    return made


@pytest.fixture(scope="module")
def alone(case) -> Path:
    return case.run(output=str(case.folder / "alone"), **case.everything())


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Iterator[Site]:
    made = Site(tmp_path_factory.mktemp("site"))
    yield made
    made.stop()
    assert all(each.poll() is not None for each in made.started)


@pytest.fixture(autouse=True)
def _brisk(monkeypatch):
    """Small pieces and frequent looks, so that much happens in a run of seconds."""
    monkeypatch.setattr(spread_workers, "PIECE_S", 0.05)
    monkeypatch.setattr(crew, "LOOK_EVERY_S", 0.1)


def run_on(site: Site, case: Case, output: Path, watcher: Watcher, **changes) -> Path:
    return case.run(watcher, output=str(output), scheduler=site.address, **case.everything(), **changes)


def test_a_worker_killed_in_mid_run_costs_no_result(case, alone, site, tmp_path):
    """The victim is stopped first, so that it certainly has work when it is killed."""
    victim, other = site.worker(wait=False), site.worker(wait=False)

    def kill() -> None:
        victim.send_signal(signal.SIGSTOP)
        time.sleep(0.3)
        site.kill(victim)

    watcher = Watcher(kill)
    found = run_on(site, case, tmp_path / "run", watcher, workers=2)
    assert watcher.acted
    assert watcher.heard("joins") == 2
    assert watcher.heard("was lost") == 1
    assert_same_bytes(alone, found)
    site.kill(other)


def test_value_trees_loses_nothing_with_a_worker(case, alone, site, tmp_path, monkeypatch):
    """Killed while logs slide without trees."""
    monkeypatch.setattr(changed_scenes, "CHUNK", 200)
    value_trees.TOOL(run=str(alone), output=str(tmp_path / "alone.gpkg"))
    victim, other = site.worker(), site.worker()
    watcher = Watcher(lambda: site.kill(victim), what="sliding without each of")
    spread = {"output": str(tmp_path / "spread.gpkg"), "scheduler": site.address, "workers": 2}
    value_trees.TOOL(feedback=watcher, run=str(alone), **spread)
    assert watcher.acted
    assert watcher.heard("was lost") == 1
    assert_same_file(tmp_path / "alone.gpkg", tmp_path / "spread.gpkg")
    site.kill(other)


def another_engine(folder: Path) -> str:
    """A copy of the engine with one more constant, and the paths by which a worker finds it first."""
    copy = folder / "engine"
    shutil.copytree(ROOT / "engine", copy, ignore=shutil.ignore_patterns("__pycache__"))
    with (copy / "deadwood_engine" / "limits.py").open("a") as source:
        source.write("EDITED = 1\n")
    return os.pathsep.join([str(copy), PATHS])


def test_a_worker_added_late_finishes_what_all_dead_ones_left(case, alone, site, tmp_path):
    """The scene is lost with the only worker that had it; a worker with another engine is there throughout, unused."""
    other = site.worker(wait=False, PYTHONPATH=another_engine(tmp_path))
    first = site.worker()
    late: list[subprocess.Popen] = []

    def replace() -> None:
        site.kill(first)
        late.append(site.worker(wait=False))

    watcher = Watcher(replace)
    found = run_on(site, case, tmp_path / "run", watcher)
    assert watcher.acted
    assert watcher.heard("joins") == 2
    refusals = [each for each in watcher.warnings if "is not used" in each]
    assert len(refusals) == 1
    assert "it has engine" in refusals[0]
    assert "install deadwood-toolbox" in refusals[0]
    assert_same_bytes(alone, found)
    site.kill(other)
    site.kill(late[0])


def test_a_run_with_no_worker_of_its_engine_is_refused(case, site, tmp_path):
    other = site.worker(PYTHONPATH=another_engine(tmp_path))
    with pytest.raises(UserError, match="no worker can be used: it has engine [0-9a-f]{16}, version .*; install"):
        run_on(site, case, tmp_path / "run", Watcher())
    assert [each.name for each in tmp_path.iterdir() if "partial" in each.name or each.name == "run"] == []
    site.kill(other)


def test_a_lost_scheduler_is_reported_and_the_run_continues_without(
    case, alone, tmp_path, tmp_path_factory, monkeypatch
):
    monkeypatch.setattr(crew, "LOST_S", 1.0)
    monkeypatch.setattr(chunks, "CHECKPOINT_S", 0.0)
    site = Site(tmp_path_factory.mktemp("lost"))
    try:
        site.worker()
        watcher = Watcher(lambda: site.kill(site.scheduler), after=40)
        with pytest.raises(UserError, match="the scheduler is lost"):
            run_on(site, case, tmp_path / "run", watcher)
    finally:
        site.stop()
    assert watcher.heard("--resume continues from there") == 1
    assert not (tmp_path / "run").exists()
    found = case.run(output=str(tmp_path / "run"), resume=True, **case.everything())
    assert_same_bytes(alone, found)


def test_local_workers_are_started_and_stopped_and_listen_to_this_machine_alone(case, alone, tmp_path):
    family: set[psutil.Process] = set()
    heard_at: set[str] = set()

    def look() -> None:
        mine = psutil.Process()
        family.update(mine.children(recursive=True))
        for each in (mine, *family):
            heard_at.update(one.laddr.ip for one in each.net_connections("inet") if one.status == psutil.CONN_LISTEN)

    watcher = Watcher(look)
    found = case.run(watcher, output=str(tmp_path / "run"), scheduler="local", workers=2, **case.everything())
    assert watcher.heard("joins") == 2
    assert watcher.heard("the worker tls://127.0.0.1:") == 2
    assert watcher.heard("bytes per log to the workers") == 1
    assert_same_bytes(alone, found)
    assert heard_at == {"127.0.0.1"}
    assert sum("spawn_main" in " ".join(each.cmdline()) for each in psutil.Process().children(recursive=True)) == 0
    assert len(family) >= 2
