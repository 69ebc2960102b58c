"""What of its surroundings the command refuses in words before anything starts."""

from __future__ import annotations

import pytest

from deadwood_algorithms.params.tool import UserError
from deadwood_toolbox.environment import refuse_no_threads


@pytest.mark.parametrize("given", ["0", "-2", " 0 "])
def test_no_thread_at_all_is_refused(given):
    """Before: a fault of ours, from the compiler's import."""
    with pytest.raises(UserError, match="NUMBA_NUM_THREADS is .*must be at least 1"):
        refuse_no_threads({"NUMBA_NUM_THREADS": given})


@pytest.mark.parametrize("given", ["1", "16", "", "x"])
def test_other_numbers_and_what_the_compiler_ignores_are_not(given):
    refuse_no_threads({"NUMBA_NUM_THREADS": given})
    refuse_no_threads({})
