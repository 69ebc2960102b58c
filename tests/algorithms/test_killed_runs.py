"""Killed at random moments, also while the results are written, then resumed: the same bytes as in one go.

A handful of kills; `pytest --kills 20` asks for as many as one likes.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from slope_case import RASTERS, Case, assert_same_run

from deadwood_algorithms import slide_logs

ROOT = Path(__file__).parents[2]
PROGRAM = Path(__file__).parent / "killed_run.py"
pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="signals of POSIX")
SIGNALS = ("SIGKILL", "SIGTERM", "SIGINT")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "kill" in metafunc.fixturenames:
        metafunc.parametrize("kill", range(metafunc.config.getoption("--kills")))


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def start(case) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Run slide-logs as a program into ``folder/run``, met by a signal at the given moment; 0: by none."""
    values = {name: value for name, value in case.values(**case.everything()).items() if name != "output"}
    (case.folder / "ask.json").write_text(json.dumps(values))
    paths = os.pathsep.join(str(ROOT / each) for each in ("", "engine", "algorithms"))

    def run(folder: Path, number: int = 0, moment: int = 0, delay_s: float = 0.0) -> subprocess.CompletedProcess[str]:
        words = [sys.executable, PROGRAM, int(number), moment, delay_s, folder, "slide-logs", "--config"]
        words += [case.folder / "ask.json", "--output", folder / "run"]
        return subprocess.run(
            [str(each) for each in words],
            env={**os.environ, "PYTHONPATH": paths},
            capture_output=True,
            text=True,
            timeout=300,
        )

    return run


@pytest.fixture(scope="module")
def whole(case, start) -> tuple[Path, int]:
    """The run that nothing disturbs, and how many moments it has."""
    folder = case.folder / "whole"
    folder.mkdir()
    ran = start(folder)
    assert ran.returncode == 0, ran.stderr
    return folder / "run", int(ran.stdout.split("moments: ")[1].split()[0])


def assert_same_bytes(one: Path, other: Path) -> None:
    """Layers value by value (a GeoPackage holds the time at which it was made), the other results byte by byte."""
    assert_same_run(one, other)
    assert sorted(each.name for each in one.iterdir()) == sorted(each.name for each in other.iterdir())
    for name in ("poses.parquet", *(f"{each}.tif" for each in RASTERS)):
        assert (one / name).read_bytes() == (other / name).read_bytes(), name


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
    if (tmp_path / "run").exists():  # it was too late to disturb anything
        assert_same_bytes(undisturbed, tmp_path / "run")
        return
    monkeypatch.setattr(slide_logs, "CHUNK", 4)
    monkeypatch.setattr(slide_logs, "CHECKPOINT_S", 0.0)
    case.run(output=str(tmp_path / "run"), resume=True, **case.everything())
    assert_same_bytes(undisturbed, tmp_path / "run")
    assert [each.name for each in tmp_path.iterdir()] == ["run"], what


def test_an_interrupt_keeps_the_finished_chunks(start, whole, tmp_path):
    """Long before the ten seconds are over: the run takes less than one of them."""
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
