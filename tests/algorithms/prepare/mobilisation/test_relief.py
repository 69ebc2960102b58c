"""Relief, susceptibility and decay on arrays: least squares of each window, and formulas cell by cell."""

from __future__ import annotations

import math

import geopandas as gpd
import numpy as np
import pytest
import shapely

from deadwood_algorithms.params.presets import BEECH, SPRUCE
from deadwood_algorithms.prepare.mobilisation import decay, rasters
from deadwood_algorithms.prepare.mobilisation.deadwood import Deadwood
from deadwood_algorithms.prepare.mobilisation.rasters import Limits, susceptibility
from deadwood_algorithms.prepare.mobilisation.relief import radius_of, relief

LIMITS = Limits(
    window_m=15.0, slope_none_deg=20.0, slope_full_deg=40.0, roughness_limit_m=0.5, gully_window_m=30.0,
    gully_depth_m=1.0, threshold=0.25,
)  # fmt: skip


@pytest.mark.parametrize("radius", [1, 3])
def test_each_window_is_fitted_by_least_squares(radius):
    """numpy.linalg.lstsq for each window separately: slope, residual, second derivative along the contour."""
    rng = np.random.default_rng(radius)
    n, cell = 2 * radius + 1, 2.0
    heights = 1500.0 + rng.normal(0.0, 0.7, (n + 4, n + 5)) + 0.4 * cell * np.arange(n + 5)
    heights[0, 0] = np.nan
    found = relief(heights, cell, radius)
    assert found.slope.shape == (5, 6)
    y, x = (cell * each.ravel() for each in np.mgrid[-radius : radius + 1, -radius : radius + 1])
    terms = np.column_stack([np.ones(n * n), x, y, x * x, x * y, y * y])
    for j, i in np.ndindex(5, 6):
        z = heights[j : j + n, i : i + n].ravel()
        got = found.slope[j, i], found.roughness[j, i], found.hollow[j, i]
        if np.isnan(z).any():
            assert np.isnan(got).all()
            continue
        (_, b, c, d, e, f), *_ = np.linalg.lstsq(terms, z - z.mean(), rcond=None)
        left = z - z.mean() - terms @ np.linalg.lstsq(terms, z - z.mean(), rcond=None)[0]
        along = np.array([-c, b]) / math.hypot(b, c)
        curvature = along @ np.array([[2.0 * d, e], [e, 2.0 * f]]) @ along
        expected = math.hypot(b, c), math.sqrt((left**2).mean()), 0.5 * curvature * (n * cell / 2.0) ** 2
        assert got == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("window", "cell", "radius"), [(15.0, 0.5, 14), (15.0, 1.0, 7), (15.0, 5.0, 1), (1.0, 5.0, 1), (4.9, 1.0, 2)]
)
def test_a_window_has_the_odd_number_of_cells_next_to_its_width(window, cell, radius):
    assert radius_of(window, cell) == radius


def test_the_susceptibility_is_the_product_of_its_factors():
    """For 2000 cells, by hand: the drive is the share of the downslope force that friction leaves."""
    rng = np.random.default_rng(5)
    slope, rough, friction = rng.uniform(0.0, 1.5, 2000), rng.uniform(0.0, 0.8, 2000), rng.uniform(0.0, 0.6, 2000)
    slope[:3] = 0.0
    friction[0] = 0.0
    found = susceptibility(slope, rough, friction, LIMITS)
    for tangent, height, mu, value in zip(slope, rough, friction, found, strict=True):
        drive = 1.0 - mu / tangent if tangent > mu else 0.0
        ramp = min(1.0, max(0.0, (math.degrees(math.atan(tangent)) - 20.0) / 20.0))
        smooth = min(1.0, max(0.0, 1.0 - height / 0.5))
        assert value == pytest.approx(drive * ramp * smooth, abs=1e-12)
    assert np.isnan(susceptibility(np.array([np.nan]), np.array([0.1]), 0.2, LIMITS)).all()


def test_slopes_without_a_ramp_are_a_step_that_holds_its_bound():
    limits = Limits(**{**vars(LIMITS), "slope_none_deg": 30.0, "slope_full_deg": 30.0})
    slope = np.tan(np.radians([29.9, 30.0 + 1e-9, 45.0]))
    assert susceptibility(slope, np.zeros(3), 0.0, limits).tolist() == [0.0, 1.0, 1.0]


@pytest.mark.parametrize("shape", [(1, 1), (512, 513), (1100, 700)])
def test_windows_cover_each_cell_once_from_the_north(shape):
    count = np.zeros(shape, int)
    found = rasters._windows(shape)
    for rows, columns in found:
        count[rows, columns] += 1
    assert (count == 1).all()
    assert found[0][0].stop == shape[0]


@pytest.mark.parametrize(
    ("years", "species", "expected"),
    [
        (2.0, "", decay.CRITICAL), (5.0, "Picea abies", decay.CRITICAL), (1.99, "", decay.OUTSIDE),
        (5.01, "spruce", decay.OUTSIDE), (2.0 * SPRUCE.rate / BEECH.rate + 1e-9, "Buche", decay.CRITICAL),
        (5.0 * SPRUCE.rate / BEECH.rate + 1e-9, "Buche", decay.OUTSIDE), (3.0, "unknown tree", decay.CRITICAL),
    ],
)  # fmt: skip
def test_years_hold_both_ends_of_their_window(years, species, expected):
    assert decay.of_years(years, species, (2.0, 5.0)) == expected


@pytest.mark.parametrize(
    ("word", "expected"),
    [("2.49", decay.OUTSIDE), ("2.5", decay.CRITICAL), ("3.49", decay.CRITICAL), ("3.5", decay.OUTSIDE),
     ("II", decay.POSSIBLE), ("3", decay.POSSIBLE), ("late 2", decay.CRITICAL), ("early II", decay.OUTSIDE),
     ("late iii", decay.OUTSIDE), ("early iii", decay.CRITICAL), ("late 2.5", None), ("VI", None)],
)  # fmt: skip
def test_stages_at_the_ends_of_what_is_critical(word, expected):
    assert decay.of_stage(word) == expected


def test_mapped_wood_takes_the_values_of_its_cell_and_is_split_by_them():
    """Each of 60 points by hand: the window of its cell, and why it could not slide."""
    rng = np.random.default_rng(8)
    n, shape, threshold = 60, (9, 7), 0.5
    row, column = rng.integers(0, 9, n), rng.integers(0, 7, n)
    row[:5] = -1
    kinds = rng.choice([decay.CRITICAL, decay.POSSIBLE, decay.OUTSIDE, decay.UNKNOWN], n)
    frame = gpd.GeoDataFrame({"id": np.arange(n)}, geometry=shapely.points(column, row), crs="EPSG:2056")
    values = rng.random(shape)
    values[2, 3], values[4, 4] = np.nan, threshold
    row[5], column[5], kinds[5] = 4, 4, decay.CRITICAL
    wood = Deadwood(frame, row, column, kinds, {"susceptibility": np.full(n, np.nan), "gully": np.full(n, np.nan)})
    for rows in (slice(0, 4), slice(4, 9)):
        for columns in (slice(0, 5), slice(5, 7)):
            wood.look(rows, columns, susceptibility=values[rows, columns])
    parts = wood.split(threshold)
    could, reason = (
        set(parts["candidates"]["id"]),
        dict(zip(parts["others"]["id"], parts["others"]["reason"], strict=True)),
    )
    assert 5 in could  # exactly the threshold
    for k in range(n):
        value = values[row[k], column[k]] if row[k] >= 0 else math.nan
        sound, steep = kinds[k] != decay.OUTSIDE, value >= threshold
        if math.isnan(value):
            assert reason[k] == "off_dem"
        elif sound and steep:
            assert k in could
        else:
            assert reason[k] == ("ground" if sound else "decay" if steep else "decay and ground")
