"""Prefetching memory changes nothing, wherever it is used; in plain Python it does nothing at all."""

import numba
import numpy as np

from deadwood_engine.prefetch import prefetch


@numba.njit
def fetch_all(table, step):
    for place in range(-4 * step, table.size * table.itemsize + 4 * step, step):
        prefetch(table, place)


def test_what_is_requested_stays_as_it_is_also_before_and_beyond_an_array():
    table = np.arange(1000, dtype=np.float32).reshape(10, 25, 4)
    before = table.copy()
    fetch_all(table, 64)
    fetch_all(table[:0], 64)
    assert np.array_equal(table, before)


def test_kernels_that_run_as_plain_python_ask_for_nothing(plain):
    assert plain("prefetch").prefetch(np.zeros(3), 0) is None
