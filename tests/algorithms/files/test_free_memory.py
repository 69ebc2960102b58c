"""Free memory on Linux, in a container, on Windows and on macOS."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest

from deadwood_algorithms.files import free_memory
from deadwood_algorithms.files.free_memory import free_bytes
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.scene.memory import threads_that_fit

NOWHERE = Path("/nowhere")
DEM = str(Path(__file__).parents[3] / "sample_data" / "dem.tif")


@pytest.fixture
def elsewhere(monkeypatch):
    """A system other than Linux: without its files, and psutil's answer [bytes]."""

    def answer(available: float | Exception) -> None:
        def asked() -> SimpleNamespace:
            if isinstance(available, Exception):
                raise available
            return SimpleNamespace(available=available)

        monkeypatch.setattr(free_memory, "MEMINFO", NOWHERE)
        monkeypatch.setattr(free_memory, "CGROUP", NOWHERE)
        monkeypatch.setattr(psutil, "virtual_memory", asked)

    return answer


def test_windows_and_macos_tell_it_too(elsewhere):
    elsewhere(3 * 2**30)
    assert free_bytes() == 3 * 2**30


def test_the_guards_work_there(elsewhere, said):
    """40 bytes per cell and 24 a thread, of nine tenths of a gigabyte: no thread fits 20 million cells."""
    elsewhere(10**9)
    with pytest.raises(UserError, match=r"dem.tif: 20 million cells need .* free"):
        threads_that_fit(4, 20_000_000, friction_by_cell=False, what=DEM, feedback=said)


@pytest.mark.parametrize("fault", [psutil.Error("no"), OSError(1, "no"), RuntimeError("no"), NotImplementedError()])
def test_a_system_that_does_not_tell_refuses_nothing(elsewhere, fault):
    elsewhere(fault)
    assert free_bytes() is None


def test_what_linux_says_is_what_psutil_reads(monkeypatch):
    """On this machine, to what other programs take meanwhile: a tenth."""
    if not free_memory.MEMINFO.is_file():
        pytest.skip("no Linux")
    monkeypatch.setattr(free_memory, "CGROUP", NOWHERE)
    assert free_bytes() == pytest.approx(psutil.virtual_memory().available, rel=0.1)


def test_a_container_has_what_its_limit_leaves(elsewhere, monkeypatch, tmp_path):
    """Cached files do not count as used memory."""
    elsewhere(10**10)
    for name, text in (
        ("memory.max", "3000"),
        ("memory.current", "1700"),
        ("memory.stat", "anon 1\ninactive_file 500"),
    ):
        (tmp_path / name).write_text(text + "\n")
    monkeypatch.setattr(free_memory, "CGROUP", tmp_path)
    assert free_bytes() == 3000 - 1700 + 500
    (tmp_path / "memory.max").write_text("max\n")
    assert free_bytes() == 10**10
