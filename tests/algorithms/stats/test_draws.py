"""Philox compared with its authors' known answers, and draws that depend only on their item."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from deadwood_algorithms.stats import draws

ONES = 0xFFFFFFFF


@pytest.mark.parametrize(
    ("counter", "key", "answer"),
    [  # kat_vectors of Random123, philox4x32 with 10 rounds
        ([0] * 4, (0, 0), [0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8]),
        ([ONES] * 4, (ONES, ONES), [0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD]),
        (
            [0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344],
            (0xA4093822, 0x299F31D0),
            [0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1],
        ),
    ],
)
def test_known_answers(counter, key, answer):
    assert draws.philox(np.array(counter, np.uint64)[:, None], key)[:, 0].tolist() == answer


def test_an_item_draws_the_same_alone_in_a_crowd_and_in_any_order():
    items = np.array([0, 7, 2**33 + 5, 123])
    u, v = draws.uniforms(42, items, draws.LOG_PLACE, 3)
    for row, item in enumerate(items):
        assert [a[0] for a in draws.uniforms(42, np.array([item]), draws.LOG_PLACE, 3)] == [u[row], v[row]]
    assert np.array_equal(draws.uniforms(42, items[::-1], draws.LOG_PLACE, 3)[0], u[::-1])


def test_seed_item_stream_and_turn_each_make_other_draws():
    items = np.arange(100)
    seen = [
        draws.uniforms(seed, items + first, stream, turn)[0]
        for seed, first, stream, turn in [
            (1, 0, 0, 0),
            (2, 0, 0, 0),
            (1 + 2**40, 0, 0, 0),
            (1, 1000, 0, 0),
            (1, 2**32, 0, 0),
            (1, 0, 1, 0),
            (1, 0, 0, 1),
        ]
    ]
    assert np.unique(np.concatenate(seen)).size == 700


def test_draws_are_uniform_normal_and_independent():
    n = 100_000
    u, v = draws.uniforms(1, np.arange(n), 0)
    a, b = draws.normals(1, np.arange(n), 0)
    # A sound generator fails each of these once in 10 000 seeds; this seed is fixed.
    for sample, law in ((u, "uniform"), (v, "uniform"), (a, "norm"), (b, "norm")):
        assert stats.kstest(sample, law).pvalue > 1e-4
    for one, other in ((u, v), (a, b), (u[:-1], u[1:])):
        assert abs(np.corrcoef(one, other)[0, 1]) < 4 / np.sqrt(n)
    assert (u.min() >= 0, u.max() < 1) == (True, True)
