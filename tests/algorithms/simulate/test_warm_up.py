"""Compilation of kernels is reported before it begins, and only if it happens."""

from __future__ import annotations

import pytest
from numba.core import event

from deadwood_algorithms.simulate import warm_up
from deadwood_algorithms.simulate.warm_up import COMPILING, compiling_said, load_kernels
from deadwood_algorithms.tools import warm_up as warm_up_tool
from deadwood_engine import engine_digest


@pytest.mark.parametrize("kernels", [0, 1, 3])
def test_the_first_kernel_that_is_compiled_is_announced(said, kernels):
    with compiling_said(said):
        for _ in range(kernels):
            with event.trigger_event("numba:compile", data={"dispatcher": None}):
                assert said.notes == [COMPILING]  # before it begins
    assert len(said.notes) == (2 if kernels else 0)
    assert all("compiled (0 s)" in each for each in said.notes[1:])


def test_kernels_that_are_loaded_are_not_announced(said):
    load_kernels(None, said)
    said.notes.clear()
    load_kernels(None, said)
    assert said.notes == []


def test_numba_reports_it_when_it_compiles(said):
    """The event is Numba's own, for a kernel that is in no cache."""
    import numba

    with compiling_said(said):
        numba.njit(lambda x: x + 1)(1)
    assert said.notes[0] == warm_up.COMPILING


@pytest.mark.parametrize("shapes", [False, True])
def test_after_warm_up_nothing_is_compiled(said, shapes):
    """The tool reads or compiles everything slide-logs needs: a second run finds all of it."""
    for again in range(2):
        said.notes.clear()
        made = warm_up_tool.TOOL(shapes=shapes, feedback=said)
        assert made.facts["engine"] == engine_digest()
        assert said.notes[-1].startswith("the engine is ready")
        assert again == 0 or len(said.notes) == 1
