"""Release areas as polygons: cells that touch along a side, counted and measured one by one."""

from __future__ import annotations

import numpy as np
import pyproj
import pytest
from scipy.ndimage import label

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.prepare.mobilisation.cells import Shares
from deadwood_algorithms.prepare.mobilisation.zones import zones

CELL, NY, NX = 2.0, 30, 41
WEST, SOUTH = 2_600_000.0, 1_200_000.0
GRID = Grid.empty((NY, NX), CELL, WEST + CELL / 2, SOUTH + CELL / 2, pyproj.CRS("EPSG:2056"))


@pytest.mark.parametrize("least", [4.0, 24.0])
def test_each_area_has_what_its_cells_have(least):
    """Rows from the south, as in a `Grid`; also if an area has exactly the least area."""
    rng = np.random.default_rng(3)
    mask = rng.random((NY, NX)) < 0.5
    logs = rng.integers(0, 5, (NY, NX))
    did = rng.integers(0, 3 * logs + 1)
    slope = rng.uniform(10.0, 40.0, (NY, NX))
    found = zones(mask, Shares(3, logs.ravel(), {"starts": did.ravel()}), slope, GRID, least, GRID.bounds)
    number, count = label(mask)  # along sides
    sizes = {k: int((number == k).sum()) for k in range(1, count + 1)}
    kept = {k for k, cells in sizes.items() if cells * CELL**2 >= least}
    assert any(sizes[k] * CELL**2 == least for k in kept)
    assert len(found) == len(kept)
    assert found["area_m2"].is_monotonic_decreasing
    assert found["release_id"].tolist() == list(range(1, len(kept) + 1))
    seen = set()
    for _, row in found.iterrows():
        inside = row["geometry"].representative_point()
        j, i = int((inside.y - SOUTH) / CELL), int((inside.x - WEST) / CELL)
        mine = number == number[j, i]
        seen.add(int(number[j, i]))
        assert row["area_m2"] == mine.sum() * CELL**2
        assert row["n_logs"] == logs[mine].sum()
        share = did[mine].sum() / 3.0 / logs[mine].sum() if logs[mine].any() else np.nan
        assert row["starts"] == pytest.approx(share, nan_ok=True)
        assert row["slope_mean_deg"] == pytest.approx(slope[mine].mean())
    assert seen == kept


def test_no_chosen_cell_gives_an_empty_layer():
    shares = Shares(1, np.ones(NY * NX, int), {"starts": np.zeros(NY * NX, int)})
    found = zones(np.zeros((NY, NX), bool), shares, np.zeros((NY, NX)), GRID, 4.0, GRID.bounds)
    assert found.empty
    assert {"release_id", "n_logs", "starts", "starts_ci_low", "slope_mean_deg"} <= set(found.columns)


def test_an_area_ends_where_the_heights_end():
    """Half a cell of the terrain model before its edge; beyond, no log can be released."""
    west, south, east, north = GRID.bounds
    surface = west + 0.25, south + 0.25, east - 0.25, north - 0.25
    every, nothing = np.ones((NY, NX), bool), np.zeros(NY * NX, np.int64)
    found = zones(every, Shares(1, nothing, {"starts": nothing}), np.zeros((NY, NX)), GRID, 4.0, surface)
    assert found["area_m2"].item() == pytest.approx((CELL * NX - 0.5) * (CELL * NY - 0.5))
    assert found.total_bounds == pytest.approx(surface)
