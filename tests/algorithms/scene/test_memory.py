"""The number of threads that fit into memory, and the refusal if none does."""

from __future__ import annotations

from pathlib import Path

import pytest

from deadwood_algorithms.files.free_memory import free_bytes
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.scene import memory
from deadwood_algorithms.scene.memory import refuse_too_many_workers, threads_that_fit

CELLS = 10_000_000
DEM = str(Path(__file__).parents[3] / "sample_data" / "dem.tif")


@pytest.mark.parametrize(("free_gb", "threads"), [(100.0, 16), (2.0, 5), (0.8, 1)])
def test_as_many_threads_as_there_is_memory_for(monkeypatch, said, free_gb, threads):
    """24 bytes per cell for the scene and the writing, 28 more for each thread, of nine tenths of what is free."""
    monkeypatch.setattr(memory, "free_bytes", lambda: int(free_gb * 1e9))
    expected = min(16, int((0.9 * free_gb * 1e9 / CELLS - 24) // 28))
    assert threads_that_fit(16, CELLS, friction_by_cell=False, what=DEM, feedback=said) == expected == threads
    assert len(said.notes) == (threads < 16)


def test_friction_by_cell_takes_its_share(monkeypatch, said):
    monkeypatch.setattr(memory, "free_bytes", lambda: int(CELLS * 60 / 0.9))
    assert threads_that_fit(2, CELLS, friction_by_cell=False, what=DEM, feedback=said) == 1
    with pytest.raises(UserError, match=r"dem.tif: 10 million cells need 0.6 GB of memory, .* free; .*rio warp"):
        threads_that_fit(2, CELLS, friction_by_cell=True, what=DEM, feedback=said)


def test_without_a_report_of_memory_nothing_is_refused(monkeypatch, said):
    monkeypatch.setattr(memory, "free_bytes", lambda: None)
    assert threads_that_fit(7, 10**12, friction_by_cell=True, what=DEM, feedback=said) == 7


def test_this_machine_has_some_memory():
    free = free_bytes()
    assert free is None or 10**7 < free < 10**14


def test_more_threads_than_help_are_not_used(monkeypatch, said):
    monkeypatch.setattr(memory, "free_bytes", lambda: None)
    used = threads_that_fit(1_000_000, 100, friction_by_cell=False, what=DEM, feedback=said)
    assert 64 <= used < 10_000
    assert f"--threads 1000000: {used} threads are used" in said.notes[0]


@pytest.mark.parametrize(("free_gb", "words"), [(100.0, ""), (3.5, "--workers 3 fit"), (1.0, "leave out --scheduler")])
def test_processes_share_no_memory(monkeypatch, free_gb, words):
    """52 bytes per cell here, 40 in each process plus 300 MB of libraries, of nine tenths of what is free."""
    monkeypatch.setattr(memory, "free_bytes", lambda: int(free_gb * 1e9))
    fitting = int((0.9 * free_gb * 1e9 - 52 * CELLS) // (300e6 + 40 * CELLS))
    assert (fitting >= 4, f"--workers {fitting} fit" == words, fitting < 1) == (
        not words,
        "fit" in words,
        "out" in words,
    )
    if not words:
        refuse_too_many_workers(4, CELLS, friction_by_cell=False, what=DEM)
        return
    with pytest.raises(UserError, match=rf"4 workers on the 10 million cells of .*dem.tif need 3.1 GB .*; {words}"):
        refuse_too_many_workers(4, CELLS, friction_by_cell=False, what=DEM)
