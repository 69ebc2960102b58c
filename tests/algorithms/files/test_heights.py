"""Invalid heights: cells mixed with nodata, steps of a terrain model, holes in it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from hypothesis import given, settings
from hypothesis import strategies as st
from rasterio.transform import from_origin

from deadwood_algorithms.files.dem_windows import open_windows, read_dem, read_part
from deadwood_algorithms.files.grid import Part
from deadwood_algorithms.files.heights import Holes, holes_in, steps_of, without_ground
from deadwood_algorithms.params.tool import Quiet, UserError

ROWS, COLUMNS = 240, 160
X, Y = np.meshgrid(np.arange(COLUMNS) + 0.5, np.arange(ROWS)[::-1] + 0.5)
HILL = 800.0 + np.maximum(Y - 60.0, 0.0) * np.tan(np.radians(35.0)) + 0.3 * np.sin(X / 6.0) * np.cos(Y / 7.0)


def write(path: Path, values: Any, cell: float = 1.0, dtype: str = "float32", nodata: float = -9999.0) -> Path:
    profile = {"driver": "GTiff", "dtype": dtype, "count": 1, "height": values.shape[0], "width": values.shape[1]}
    place = from_origin(2_700_000.0, 1_200_240.0, cell, cell)
    with rasterio.open(path, "w", crs="EPSG:2056", transform=place, nodata=nodata, **profile) as made:
        made.write(values.astype(dtype), 1)
    return path


def interpolated(coarse: np.ndarray, times: int) -> np.ndarray:
    """The bilinear values of coarse cells at the centres of finer ones, as if nodata were a height."""

    def weights(n: int) -> np.ndarray:
        at = np.clip((np.arange(n * times) + 0.5) / times - 0.5, 0.0, n - 1.0)
        low = np.minimum(at.astype(int), n - 2)
        matrix = np.zeros((n * times, n))
        matrix[np.arange(n * times), low] = 1.0 - (at - low)
        matrix[np.arange(n * times), low + 1] = at - low
        return matrix

    return weights(coarse.shape[0]) @ coarse @ weights(coarse.shape[1]).T


def mixed(nodata: float, times: int = 5) -> tuple[np.ndarray, np.ndarray]:
    """A hillside of coarse cells with a hole and an empty corner, brought to finer ones; and the weight of nodata."""
    shape = ROWS // times, COLUMNS // times
    coarse = HILL.reshape(shape[0], times, shape[1], times).mean(axis=(1, 3))
    empty = np.zeros(shape, bool)
    empty[18:22, 13:17] = True
    empty[:, :3] = np.tri(shape[0], 3, -shape[0] + 12, dtype=bool)
    weight = interpolated(empty.astype(float), times)
    heights = interpolated(np.where(empty, nodata, coarse), times)
    return np.where(weight > 1.0 - 1e-9, np.nan, heights), weight


@pytest.mark.parametrize("nodata", [-9999.0, -32768.0, -1e6, 32767.0, 3.4e38])
def test_cells_mixed_with_nodata_are_outside_and_all_others_stay(nodata):
    heights, weight = mixed(nodata)
    bad = without_ground(heights, 1.0)
    assert bad[(weight > 0.008) & np.isfinite(heights)].all()
    away = np.lib.stride_tricks.sliding_window_view(np.pad(weight, 2), (5, 5)).max(axis=(2, 3)) == 0.0
    assert not bad[away].any()


def test_a_dem_of_mixed_cells_is_read_without_them_and_reported(tmp_path, said):
    heights, weight = mixed(-9999.0)
    path = write(tmp_path / "d.tif", np.where(np.isfinite(heights), heights, -9999.0))
    grid = read_dem(path, feedback=said)
    kept = np.isfinite(grid.values[::-1])
    assert np.nanmin(grid.values) > 799.0
    assert kept[weight == 0.0].mean() > 0.97
    told = said.warnings[-1]
    assert "cells beside nodata hold impossible heights (-" in told


@settings(max_examples=40, deadline=None)
@given(st.integers(0, COLUMNS - 2), st.integers(0, ROWS - 2), st.integers(1, 90), st.integers(1, 90))
def test_a_window_holds_what_the_whole_holds(tmp_path_factory, column, row, columns, rows):
    path = tmp_path_factory.getbasetemp() / "mixed.tif"
    if not path.exists():
        heights, _ = mixed(-9999.0)
        write(path, np.where(np.isfinite(heights), heights, -9999.0))
    whole = read_dem(path).values
    part = Part(column, row, columns, rows).cut_to(whole.shape)
    with open_windows(path, crs=None, feedback=Quiet(), look_through=False) as dem:
        assert np.array_equal(read_part(dem, part, Quiet()).values, whole[part.slices], equal_nan=True)
        assert np.array_equal(dem.grid(*part.slices).values, whole[part.slices], equal_nan=True)


@pytest.mark.parametrize(("empty", "others"), [(0.0, 100), (-1.0, 99), (-9.0, 91), (-99.0, 1)])
def test_an_undeclared_collar_is_found_behind_the_cells_mixed_with_it(tmp_path, said, empty, others):
    """The lowest height is then a mixed one; a window and the whole give the same, and a low coast stays unchanged."""
    heights, _ = mixed(empty)
    path = write(tmp_path / "d.tif", np.where(np.isfinite(heights), heights, empty), nodata=-9999.0)
    whole = read_dem(path, feedback=said).values
    assert np.nanmin(whole) > 799.0
    assert any(f"exactly {empty:g} m, all others more than {others} m" in each for each in said.warnings)
    part = Part(3, 100, 60, 90)
    with open_windows(path, crs=None, feedback=Quiet()) as dem:
        assert np.array_equal(read_part(dem, part, Quiet()).values, whole[part.slices], equal_nan=True)
        assert np.array_equal(dem.grid(*part.slices).values, whole[part.slices], equal_nan=True)
    coast = np.maximum(HILL - 800.0 + empty, empty)
    coast[HILL < 805.0] = empty
    assert np.isfinite(read_dem(write(tmp_path / "c.tif", coast)).values).all()


@pytest.mark.parametrize(
    ("times", "dtype", "words"),
    [
        (100.0, "int32", "in centimetres they would be 800 to 926 m"),
        (1000.0, "int32", "in millimetres"),
        (-1.0, "float32", "its sign"),
    ],
)
def test_numbers_that_are_no_heights_in_metres_are_not_called_nodata(tmp_path, times, dtype, words):
    path = write(tmp_path / "d.tif", np.rint(HILL * times), dtype=dtype)
    with pytest.raises(UserError, match=words):
        read_dem(path)


def test_decimetres_are_not_called_feet(tmp_path, said):
    read_dem(write(tmp_path / "d.tif", np.rint((HILL - 400.0) * 10.0), dtype="int16"), feedback=said)
    assert any("are its heights in decimetres (then it is 35 degrees)" in each for each in said.warnings)


def test_walls_and_pits_of_the_ground_stay():
    """300 m high within the DEM, and 40 m at its border: neither is a mean of ground and nodata."""
    walls = HILL.copy()
    walls[100:, :] -= 300.0
    walls[-1, :] += 40.0
    walls[50, 50] -= 200.0
    assert not without_ground(walls, 1.0).any()


def test_a_valley_below_the_sea_stays_and_nothing_deeper():
    assert not without_ground(HILL - 1240.0, 1.0).any()
    assert without_ground(np.full((5, 5), -600.0), 1.0).all()


def blocks(times: int) -> np.ndarray:
    shape = ROWS // times, COLUMNS // times
    coarse = HILL.reshape(shape[0], times, shape[1], times).mean(axis=(1, 3))
    return np.repeat(np.repeat(coarse, times, axis=0), times, axis=1)


@pytest.mark.parametrize(
    ("heights", "rounded", "repeated"),
    [
        (np.rint(HILL), 1.0, 1),
        (np.rint(HILL / 0.3048) * 0.3048, 0.3048, 1),
        (np.rint(HILL[::5, ::5]), 1.0, 1),
        (np.rint(HILL / 5.0) * 5.0, 5.0, 1),
        (blocks(5), 0.0, 5),
        (blocks(2), 0.0, 2),
        (blocks(10), 0.0, 10),
        (np.rint(blocks(5)), 0.0, 5),
        (np.rint(HILL * 2.0) / 2.0, 0.5, 1),
        (HILL[::3, ::3][np.ix_(np.arange(118) * 2 // 3, np.arange(78) * 2 // 3)], 0.0, 1),
    ],
    ids=[
        "whole metres",
        "whole feet",
        "whole metres of coarse cells",
        "5 m",
        "5 x 5",
        "2 x 2",
        "10 x 10",
        "both",
        "half metres",
        "3 m cells on 2 m ones",
    ],
)
def test_steps_are_found_with_their_cause(heights, rounded, repeated):
    steps = steps_of([heights.astype(np.float32)])
    assert steps is not None
    assert steps.rounded_m == pytest.approx(rounded, rel=1e-3)
    assert steps.repeated == repeated


def lake(heights: np.ndarray) -> np.ndarray:
    return np.maximum(heights, 830.0)


@pytest.mark.parametrize(
    "heights",
    [
        HILL,
        np.round(HILL, 1),
        np.round(HILL, 2),
        lake(HILL),
        np.full_like(HILL, 500.0),
        1000.0 + Y,  # a plane of whole metres
        500.0 + 2.0 * X + Y,
        np.where(Y > 100.0, 900.0, 800.0),  # a wall
        np.where((X // 40) % 2 > 0, HILL, 780.0 + HILL / 10),
        np.where(HILL < 850.0, np.nan, HILL),
    ],
    ids=["hill", "decimetres", "centimetres", "lake", "flat", "45 degrees", "plane", "wall", "terraces", "cut"],
)
def test_ground_has_none(heights):
    assert steps_of([heights.astype(np.float32)]) is None


@pytest.mark.parametrize(
    ("values", "dtype", "words"),
    [
        (np.rint(HILL), "int16", "its heights are rounded to 1 m"),
        (blocks(5), "float32", "it repeats cells of 5 m as 5 x 5 of its own, in steps of 3.5 m"),
    ],
)
def test_every_reader_of_a_dem_reports_it_once(tmp_path, said, values, dtype, words):
    path = write(tmp_path / "d.tif", values, dtype=dtype)
    read_dem(path, feedback=said)
    with open_windows(path, crs=None, feedback=said):
        pass
    assert [words in each for each in said.warnings] == [True, True]


def test_squares_of_a_large_dem_tell_its_steps(tmp_path, said):
    large = np.tile(blocks(5), (3, 4))
    with open_windows(write(tmp_path / "d.tif", large), crs=None, feedback=said, look_through=False):
        pass
    assert "it repeats cells of 5 m" in said.warnings[0]


def test_holes_are_those_that_do_not_touch_the_border():
    heights = HILL.copy()
    heights[:30, :10] = np.nan  # a corner
    heights[50:60, 20:40] = np.nan
    heights[60:62, 40:42] = np.nan  # touches it by its corner
    heights[100, 100] = np.nan
    found = holes_in(heights)
    assert found is not None
    assert (found.number, found.cells, found.largest) == (2, 205, 204)
    assert np.isnan(heights[found.row, found.column])
    assert holes_in(HILL) is None
    heights[:, 20:60] = np.nan
    assert holes_in(heights) == Holes(1, 1, 1, 100, 100)


def test_holes_of_a_large_array_are_found_in_blocks(monkeypatch):
    monkeypatch.setattr("deadwood_algorithms.files.heights.HOLE_CELLS", 1000)
    heights = HILL.copy()
    heights[50:90, 40:90] = np.nan
    found = holes_in(heights)
    assert found is not None
    assert found.number == 1
    assert 2000 <= found.cells <= 3500
