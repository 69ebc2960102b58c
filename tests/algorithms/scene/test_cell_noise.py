"""The noise of a terrain model from cell to cell, on slopes whose noise is known."""

from __future__ import annotations

import numpy as np
import pyproj
import pytest
import rasterio
import shapely
from slope_case import Case, write_layer

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.scene.cell_noise import cell_noise

CELL = 0.5
COLUMNS, ROWS = np.meshgrid(np.arange(300.0), np.arange(200.0))
SMOOTH = 0.3 * CELL * ROWS + 0.1 * CELL * COLUMNS + 2.0 * np.sin(COLUMNS * CELL / 8.0) * np.cos(ROWS * CELL / 5.0)


def noise_of(heights: np.ndarray, x: object = (40.0, 90.0), y: object = (30.0, 80.0)) -> float:
    grid = Grid(heights.astype(np.float32), CELL, 1000.0, 2000.0, pyproj.CRS("EPSG:2056"))
    return cell_noise(grid, 1000.0 + np.asarray(x, float), 2000.0 + np.asarray(y, float))


def test_independent_errors_are_measured_on_a_curved_slope():
    errors = np.random.default_rng(5).standard_normal(SMOOTH.shape)
    for sigma in (0.02, 0.16):
        assert noise_of(SMOOTH + sigma * errors) == pytest.approx(sigma, rel=0.05)


def test_relief_walls_and_boulders_are_no_noise():
    heights = SMOOTH.copy()
    heights[90:] += 6.0  # a cliff
    heights[:, 120] += 1.5  # a wall
    at = np.random.default_rng(6).integers(5, 195, (60, 2))
    for row, column in at:
        heights[row : row + 3, column : column + 3] += 1.0
    assert noise_of(heights) < 0.01


def test_only_what_surrounds_the_releases_counts():
    rough = SMOOTH + 0.1 * np.random.default_rng(7).standard_normal(SMOOTH.shape) * (COLUMNS >= 192)
    assert noise_of(rough, [10.0], [10.0]) < 0.01
    # a square has 3844 differences of nine heights each, as good as some 430 independent ones: 5 % (standard error)
    assert noise_of(rough, [110.0], [10.0]) == pytest.approx(0.1, rel=0.1)
    assert np.isnan(noise_of(np.full_like(SMOOTH, np.nan)))
    assert np.isnan(noise_of(SMOOTH, [-500.0], [10.0]))


@pytest.mark.parametrize(
    ("fidelity", "noise_m", "doubted"), [("draft", 0.3, 1), ("draft", 0.1, 0), ("standard", 0.3, 0)]
)
def test_draft_is_doubted_where_it_goes_too_far(said, tmp_path, fidelity, noise_m, doubted):
    case = Case(tmp_path)
    with rasterio.open(case.dem, "r+") as dem:
        heights = dem.read(1)
        dem.write(heights + noise_m * np.random.default_rng(8).standard_normal(heights.shape).astype("float32"), 1)
    write_layer(tmp_path / "one.gpkg", [shapely.Point(30.0, 80.0)], log_id=[1])
    case.run(said, releases=str(tmp_path / "one.gpkg"), fidelity=fidelity, time_limit_s=0.1)
    assert sum("rough from cell to cell" in each for each in said.warnings) == doubted
