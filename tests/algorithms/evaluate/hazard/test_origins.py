"""Origins on arrays: counts cell by cell, and bounds that include values equal to them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pyproj
import pytest
import shapely

from deadwood_algorithms.evaluate.hazard import origins as hazard_origins
from deadwood_algorithms.evaluate.hazard.origins import (
    ROUND_CELLS,
    Origins,
    affected_frame,
    cell_for,
    origins_of,
    polygons_of,
    sources_frame,
)
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.stats.statistics import wilson_interval

CRS = pyproj.CRS.from_epsg(2056)


def run_of(x: np.ndarray, y: np.ndarray) -> Any:
    deposits = pd.DataFrame({"release_x": x, "release_y": y, "release_id": 1, "log_id": np.arange(x.size)})
    return cast("Any", SimpleNamespace(deposits=deposits, grid=SimpleNamespace(crs=CRS), path="run"))


@pytest.mark.parametrize("cell", [1.0, 3.0, 7.5])
def test_logs_are_counted_where_they_were_released(cell):
    """A log on the border of two cells is in the eastern, and in the northern."""
    rng = np.random.default_rng(1)
    x, y = 2_600_000.0 + 40.0 * rng.random(80), 1_200_000.0 + 25.0 * rng.random(80)
    x[20:24] = cell * (np.ceil(2_600_000.0 / cell) + np.arange(4))
    rows = np.arange(5, 75)
    hit = rng.random(rows.size) < 0.4
    found = origins_of(run_of(x, y), rows, {"road": hit}, cell, 2)
    released, reached = np.zeros(found.grid.shape, int), np.zeros(found.grid.shape, int)
    for k, row in enumerate(rows):
        for j, i in np.ndindex(released.shape):
            east, north = found.grid.x0 + (i - 0.5) * cell, found.grid.y0 + (j - 0.5) * cell
            if east <= x[row] < east + cell and north <= y[row] < north + cell:
                released[j, i] += 1
                reached[j, i] += int(hit[k])
    assert released.sum() == rows.size
    assert np.array_equal(found.released, released)
    assert np.array_equal(found.reached["road"], reached)


def test_a_raster_without_end_is_refused():
    far = run_of(np.array([0.0, 1e5]), np.array([0.0, 1e5]))
    with pytest.raises(UserError, match="use a larger cell"):
        origins_of(far, np.arange(2), {}, 1.0, 1)


def example(least: int) -> Origins:
    grid = Grid.empty((1, 4), 2.0, 1.0, 1.0, CRS)
    released = np.array([[2, 3, 4, 0]])
    return Origins(grid, released, {"road": np.array([[2, 1, 2, 0]])}, least)


def test_a_cell_with_just_enough_logs_is_reported():
    found = example(3)
    assert found.enough.tolist() == [[False, True, True, False]]
    assert found.share_with_enough == 7 / 9
    share, low, high = found.shares("road")
    assert share[0].tolist() == pytest.approx([np.nan, 1 / 3, 0.5, np.nan], nan_ok=True)
    for column, (hit, n) in ((1, (1, 3)), (2, (2, 4))):
        assert (low[0, column], high[0, column]) == pytest.approx(wilson_interval(hit, n))
    bands, units = found.bands()
    assert list(bands) == [
        "line road", "line road: lower end", "line road: upper end", "line road: logs that reach", "logs released",
    ]  # fmt: skip
    assert units == ["1", "1", "1", "logs", "logs"]
    assert bands["line road: logs that reach"][0].tolist() == pytest.approx([2, 1, 2, np.nan], nan_ok=True)
    assert bands["logs released"][0].tolist() == pytest.approx([2, 3, 4, np.nan], nan_ok=True)


def test_a_source_whose_share_is_the_bound_is_one():
    """Half of the logs reach from the third cell: it counts at 0.5, and no more just above."""
    frame = sources_frame(example(3), (0.3, 0.5, 0.5 + 1e-9))
    assert frame["least_p"].tolist() == [0.3, 0.5]
    assert frame["area_m2"].tolist() == [8.0, 4.0]
    assert frame[["n_reach", "n_total"]].to_numpy().tolist() == [[3, 7], [2, 4]]
    assert frame.geometry.iloc[1].equals(shapely.box(4.0, 0.0, 6.0, 2.0))
    assert sources_frame(example(5), (0.1,)).empty


@pytest.mark.parametrize(("least", "cells"), [(0.1, 3), (0.1 + 1e-6, 2), (0.2, 2), (1.0, 1), (0.0, 4)])
def test_ground_that_exactly_this_number_pass_is_affected(monkeypatch, least, cells):
    """0.1 of 30 logs are 3, which 0.1 * 30 is not in floating point; a cell that no log passes never counts."""
    grid = Grid.empty((1, 5), 1.0, 0.5, 0.5, CRS)
    hits = np.array([[0, 1, 3, 6, 30]])
    monkeypatch.setattr(hazard_origins, "_hits_by_area", lambda *_: [("a", 30, hits)])
    frame = affected_frame(run_of(np.zeros(1), np.zeros(1)), grid, (least,), Quiet())
    assert frame is not None
    assert frame["area_m2"].tolist() == [float(cells)]
    assert frame["n_logs"].tolist() == [30]


def test_the_smallest_round_cell_holds_nine_of_ten_logs_with_enough_others():
    """Ten logs: nine within one metre, the tenth far off. Then one of the nine is moved away as well."""
    x = np.array([10.1, 10.2, 10.3, 10.4, 10.5, 10.6, 10.7, 10.8, 10.9, 900.0])
    y = np.full(10, 0.5)
    assert cell_for(x, y, 9) == 1.0
    assert cell_for(x, y, 10) == 1000.0
    x[0] = 14.9
    assert cell_for(x, y, 8) == 5.0  # the cell from 10 to 15 m is the first with eight and the ninth
    assert cell_for(x, y, 11) == ROUND_CELLS[-1]


def test_cells_that_touch_at_a_corner_are_apart():
    grid = Grid.empty((2, 2), 1.0, 0.5, 0.5, CRS)
    shape = polygons_of(np.array([[True, False], [False, True]]), grid)
    assert len(shapely.get_parts(shape)) == 2
    assert shape.area == 2.0
    assert shapely.contains_xy(shape, [0.5, 1.5, 0.5], [0.5, 1.5, 1.5]).tolist() == [True, True, False]
