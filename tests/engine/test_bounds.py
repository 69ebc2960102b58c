"""No kernel reads or writes beside its tables: scenes of every kind with every index checked (``bounds``)."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import deadwood_engine
from deadwood_engine import STOP_REASONS

pytestmark = pytest.mark.engine_alone


def checked(what: str, mode: str, cache: Path) -> dict:
    environment = {**os.environ, mode: "1", "XDG_CACHE_HOME": str(cache), "OMP_NUM_THREADS": "1"}
    environment["PYTHONPATH"] = str(Path(deadwood_engine.__file__).parents[1])
    environment.pop("NUMBA_CACHE_DIR", None)  # its kernels are compiled without the check
    done = subprocess.run(
        [sys.executable, "-W", "ignore", str(Path(__file__).with_name("bounds.py")), what],
        env=environment, capture_output=True, text=True, timeout=1200,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout)


def assert_seen(told: dict) -> None:
    """Every planted defect was noticed, every log ended, and only that without a pose failed."""
    assert all(told["seen"].values()), told["seen"]
    for name, ends in told["ends"].items():
        assert ends["failed"] == 1, (name, ends)


@pytest.mark.slow
def test_logs_in_every_kind_of_scene(tmp_path):
    """Compiled with NUMBA_BOUNDSCHECK: 65 s of one core, most of it the compiler's."""
    told = checked("cones", "NUMBA_BOUNDSCHECK", tmp_path)
    assert_seen(told)
    reached = {name for ends in told["ends"].values() for name, count in ends.items() if count}
    assert reached >= set(STOP_REASONS) - {"rest"}, "a kind of ending that the scenes no longer have"


def test_clouds_and_sweeps_as_python(tmp_path):
    """The kernels without the compiler: 2 s."""
    told = checked("clouds", "NUMBA_DISABLE_JIT", tmp_path)
    assert_seen(told)
    assert told["swept"] > 50
