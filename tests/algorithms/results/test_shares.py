"""Shares of logs by cell, compared with the formula in double precision: to the last bit written."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_algorithms.results.danger import ANY, COUNT, danger_bands
from deadwood_algorithms.results.maps import shares_of


@pytest.mark.parametrize("n_logs", [3, 4000, 2**24 + 3])
def test_shares_are_quotients_rounded_once(n_logs):
    rng = np.random.default_rng(4)
    hits = rng.integers(0, n_logs, (37, 53), dtype=np.uint32)
    outside = rng.random(hits.shape) < 0.1
    share = shares_of(hits, n_logs, outside)
    assert share.dtype == np.float32
    expected = (hits.astype(np.float64) / float(np.float32(n_logs))).astype(np.float32)
    assert np.array_equal(share[~outside], expected[~outside])
    assert np.isnan(share[outside]).all()


@pytest.mark.parametrize("least", [1, 10, 1000])
def test_bands_of_danger_are_quotients_where_enough_logs_passed(least):
    rng = np.random.default_rng(5)
    passed = rng.integers(0, 300, (37, 53), dtype=np.uint32)
    danger = (passed * rng.random((3, *passed.shape))).astype(np.uint32)
    bands = danger_bands(passed, danger, ["road", "rail"], least)
    assert list(bands) == [ANY, COUNT, "road", "rail"]
    few = passed < least
    for name, counts in (*zip((ANY, "road", "rail"), danger, strict=True), (COUNT, passed.astype(np.uint64) ** 2)):
        with np.errstate(divide="ignore", invalid="ignore"):
            expected = (counts.astype(np.float64) / passed).astype(np.float32)
        assert bands[name].dtype == np.float32
        assert np.isnan(bands[name][few]).all()
        assert np.array_equal(bands[name][~few], expected[~few])
