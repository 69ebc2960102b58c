"""Killed at random moments, also while the results are written, then resumed: the same bytes as in one go.

Alone, and with workers of a Dask scheduler, killing either the program or a worker. A handful of kills;
`pytest --kills 20` sets the number of each.
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest
from dask_processes import PATHS, Site
from killed_run import met_run
from slope_case import Case, assert_same_bytes

from deadwood_algorithms.simulate import chunks

PROGRAM = Path(__file__).parents[1] / "killed_run.py"
pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="signals of POSIX")
SIGNALS = ("SIGKILL", "SIGTERM", "SIGINT")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    kills = int(metafunc.config.getoption("--kills"))
    if "kill" in metafunc.fixturenames:
        metafunc.parametrize("kill", range(kills))
    if "dask_kill" in metafunc.fixturenames:
        metafunc.parametrize("dask_kill", range(kills if kills >= 20 else (kills + 1) // 2))


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def start(case) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Run slide-logs as a program into ``folder/run``, met by a signal at the given moment; 0: by none."""
    values = {name: value for name, value in case.values(**case.everything()).items() if name != "output"}
    (case.folder / "ask.json").write_text(json.dumps(values))

    def run(
        folder: Path, number: int = 0, moment: int = 0, delay_s: float = 0.0, *more: str, victim: int = 0
    ) -> subprocess.CompletedProcess[str]:
        config = case.folder / "ask.json"
        return met_run("slide-logs", config, folder, number, moment, delay_s, *more, victim=victim)

    return run


@pytest.fixture(scope="module")
def whole(case, start) -> tuple[Path, int]:
    """The undisturbed run, and its number of moments."""
    folder = case.folder / "whole"
    folder.mkdir()
    ran = start(folder)
    assert ran.returncode == 0, ran.stderr
    return folder / "run", int(ran.stdout.split("moments: ")[1].split()[0])


def test_a_killed_run_is_resumed_to_the_same_bytes(case, start, whole, tmp_path, monkeypatch, kill):
    undisturbed, moments = whole
    assert moments > 50
    rng = random.Random(kill)
    name = SIGNALS[kill % len(SIGNALS)]
    moment, delay_s = rng.randint(1, moments), rng.choice([0.0, 0.0, 0.02, 0.2])
    ran = start(tmp_path, getattr(signal, name), moment, delay_s)
    what = f"{name} {delay_s} s after moment {moment} of {moments}: {ran.returncode}, {ran.stderr}"
    assert ran.returncode in ((-signal.SIGKILL, 0) if name == "SIGKILL" else (130, 0)), what
    assert "Traceback" not in ran.stderr, what
    if name != "SIGKILL":
        assert not list(tmp_path.glob(".run.partial-*")), what
    resume_and_compare(case, undisturbed, tmp_path, monkeypatch, what)


def resume_and_compare(
    case: Case, undisturbed: Path, folder: Path, monkeypatch, what: str, scheduler: str | None = None
) -> None:
    if (folder / "run").exists():  # it was too late to disturb anything
        assert_same_bytes(undisturbed, folder / "run")
        return
    monkeypatch.setattr(chunks, "CHUNK", 4)
    monkeypatch.setattr(chunks, "CHECKPOINT_S", 0.0)
    case.run(output=str(folder / "run"), resume=True, scheduler=scheduler, **case.everything())
    assert_same_bytes(undisturbed, folder / "run")
    assert [each.name for each in folder.iterdir()] == ["run"], what


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Iterator[Site]:
    made = Site(tmp_path_factory.mktemp("site"))
    made.worker()
    yield made
    made.stop()
    assert all(each.poll() is not None for each in made.started)


def test_a_killed_run_on_workers_is_resumed_with_or_without_them(
    case, start, whole, site, tmp_path, monkeypatch, dask_kill
):
    undisturbed, moments = whole
    rng = random.Random(1000 + dask_kill)
    name = SIGNALS[dask_kill % len(SIGNALS)]
    moment, delay_s = rng.randint(1, moments), rng.choice([0.0, 0.0, 0.02, 0.2])
    ran = start(tmp_path, getattr(signal, name), moment, delay_s, "--scheduler", site.address)
    what = f"{name} {delay_s} s after moment {moment} of {moments}: {ran.returncode}, {ran.stderr}"
    assert ran.returncode in ((-signal.SIGKILL, 0) if name == "SIGKILL" else (130, 0)), what
    assert "Traceback" not in ran.stderr, what
    resume_and_compare(
        case, undisturbed, tmp_path, monkeypatch, what, scheduler=site.address if dask_kill % 2 else None
    )


def test_a_run_does_not_notice_a_killed_worker(start, whole, site, tmp_path, dask_kill):
    """While another is there; before it slides a log, while it does, or while the results are written."""
    undisturbed, moments = whole
    victim = site.worker()
    moment = random.Random(2000 + dask_kill).randint(1, moments)
    ran = start(tmp_path, signal.SIGKILL, moment, 0.0, "--scheduler", site.address, victim=victim.pid)
    assert ran.returncode == 0, ran.stderr
    assert "Traceback" not in ran.stderr
    assert victim.wait(10) == -signal.SIGKILL
    assert_same_bytes(undisturbed, tmp_path / "run")


def test_workers_of_a_killed_program_end_with_it(case, whole, tmp_path):
    """Workers started by `--scheduler local`."""
    words = [sys.executable, PROGRAM, int(signal.SIGKILL), whole[1] // 2, 0.0, 0, tmp_path, "slide-logs", "--config"]
    words += [case.folder / "ask.json", "--output", tmp_path / "run", "--scheduler", "local", "--workers", "1"]
    process = psutil.Popen([str(each) for each in words], env={**os.environ, "PYTHONPATH": PATHS})
    family: set[psutil.Process] = set()
    while process.poll() is None:
        with contextlib.suppress(psutil.NoSuchProcess):
            family |= set(process.children(recursive=True))
        time.sleep(0.05)
    assert process.wait() == -signal.SIGKILL
    assert family
    assert psutil.wait_procs(family, timeout=20)[1] == []


def test_an_interrupt_keeps_the_finished_chunks(start, whole, tmp_path):
    """Long before the ten seconds have passed: the run takes less than one second."""
    _, moments = whole
    for moment in range(moments // 4, moments, 5):
        folder = tmp_path / str(moment)
        folder.mkdir()
        ran = start(folder, signal.SIGINT, moment)
        if list(folder.glob(".run.part/rasters_*.npz")):
            assert ran.returncode == 130
            assert "logs are kept in" in ran.stderr
            return
    pytest.fail("no moment lay between two chunks")
