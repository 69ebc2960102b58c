"""How many of the logs must reach a cell's energy: the ranks of a share, for every number of logs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas
import pyproj
import pytest

from deadwood_algorithms.evaluate.hazard.least_passage import Energies, Ranks, areas_of, process_area
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.stats.statistics import wilson_interval


@pytest.mark.parametrize("share", [0.001, 0.01, 0.1, 0.29])
@pytest.mark.parametrize("n", [1, 30, 100, 999, 1000])
def test_the_ranks_are_the_least_numbers_of_logs_that_will_do(share, n):
    """0.1 of 30 logs are 3, though 0.1 * 30 is 3.0000000000000004; with one log less the share is not reached."""
    ranks, counts = Ranks.of(share, n), range(n + 1)
    assert ranks.estimate == max(1, next(k for k in counts if k >= share * n - 1e-9))
    ends = [wilson_interval(k, n) for k in counts]
    for rank, end in ((ranks.sure, 0), (ranks.possible, 1)):
        least = next((k for k in counts if ends[k][end] >= share), n + 1)
        assert rank == max(1, least)
    assert ranks.possible <= ranks.estimate <= ranks.sure


def test_without_a_share_any_log_will_do():
    assert Ranks.of(0.0, 500) == Ranks(1, 1, 1)


def grid_of(shape: tuple[int, int]) -> Grid:
    return Grid.empty(shape, 2.0, 0.0, 0.0, pyproj.CRS("EPSG:2056"))


def test_a_process_area_has_the_cells_that_this_number_of_logs_pass():
    rng = np.random.default_rng(5)
    hits = rng.integers(0, 7, (12, 9)).astype(np.float32)
    row = process_area(hits, 0.1, 30, grid_of(hits.shape)).iloc[0]  # at least 3 of 30 logs
    assert 4.0 * (hits >= 3).sum() == pytest.approx(row["geometry"].area)
    needed = math.ceil(1.959964**2 * 0.9 / (0.1 * 0.2**2))  # the share known to within a fifth of it
    assert (row["least_p"], row["n_logs"], row["n_needed"]) == (0.1, 30, needed)
    assert math.isnan(row["area_m2"])
    for n, stated in ((needed - 1, False), (needed, True)):
        row = process_area(hits * n / 30.0, 0.1, n, grid_of(hits.shape)).iloc[0]
        assert (row["area_m2"] == pytest.approx(row["geometry"].area)) == stated
    row = process_area(hits, 0.0, 10**6, grid_of(hits.shape)).iloc[0]  # of any log: it grows with every one
    assert math.isnan(row["area_m2"])
    assert row["n_needed"] is pandas.NA
    assert process_area(np.zeros((2, 2), np.float32), 0.1, 30, grid_of((2, 2))).empty


def test_the_ground_of_a_class_is_that_of_its_lower_bound_and_above():
    rng = np.random.default_rng(6)
    estimate, low, high = (rng.choice([np.nan, 10.0, 30.0, 299.0, 300.0], (6, 7)).astype(np.float32) for _ in range(3))
    facts: dict[str, Any] = {"share": 0.01, "n_logs": 9508}  # 1.96² 0.99 / (0.01 0.2²), rounded up
    rows = areas_of(Energies(estimate, low, high, "", facts), (30.0, 300.0), 2.0)
    for row, bound in zip(rows, (0.0, 30.0, 300.0), strict=True):
        counted = [sum(each >= bound for each in cells.ravel().tolist()) * 4.0 for cells in (estimate, low, high)]
        assert list(row.values()) == counted
    assert all(
        np.isnan(row["at_least_ci_low_m2"])
        for row in areas_of(Energies(low, low, low, "", facts | {"share": 0}), (), 1.0)
    )
