"""find-trees: tops compared with brute force, cell by cell, and slide-logs on the layer."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import rasterio
from rasterio.transform import from_origin
from slope_case import EAST, NORTH

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.prepare.trees.tops import WINDOWS, Tops, Window, find_tops
from deadwood_algorithms.scene.layers import read_trees
from deadwood_algorithms.tools import find_trees


def brute_force(
    heights: np.ndarray, cell: float, diameter: Callable[[float], float], least: float, equals_win: bool = False
) -> list[tuple]:
    """Every cell against every other: in the circle of a top no cell is higher; of equal tops, or of equal cells if
    ``equals_win``, the first counts."""
    rows, columns = np.mgrid[: heights.shape[0], : heights.shape[1]]

    def around(j: int, i: int) -> np.ndarray:
        radius = 0.5 * diameter(heights[j, i]) + 1e-9
        beside = np.maximum(abs(rows - j), abs(columns - i)) == 1
        return beside | (np.hypot((rows - j) * cell, (columns - i) * cell) <= radius)

    cells = [place for place in np.ndindex(heights.shape) if heights[place] >= least]
    highest = [place for place in cells if not (heights[around(*place)] > heights[place]).any()]
    found = []
    for place in highest:
        rivals = cells if equals_win else highest
        equals = [other for other in rivals if other < place and heights[other] == heights[place]]
        circle = around(*place)
        if not any(circle[other] for other in equals):
            found.append((*place, heights[place]))
    return found


def smooth(rng: np.random.Generator, shape: tuple[int, int], highest: float, times: int) -> np.ndarray:
    """Noise that was averaged over neighbours several times, from 0 to ``highest``."""
    values = rng.random(shape)
    for _ in range(times):
        for axis in (0, 1):
            values = (np.roll(values, 1, axis) + values + np.roll(values, -1, axis)) / 3.0
    return highest * (values - values.min()) / np.ptp(values)


def tops(heights: np.ndarray, cell: float, window: Window, least: float = 2.0, **values: Any) -> Tops:
    return find_tops(lambda rows: heights[rows].copy(), heights.shape, cell, window, least, 150.0, **values)


def listed(found: Tops) -> list[tuple]:
    return list(zip(found.row.tolist(), found.column.tolist(), found.height.tolist(), strict=True))


@pytest.mark.parametrize("cell", [0.5, 1.0, 2.5])
@pytest.mark.parametrize("name", WINDOWS)
def test_the_tops_are_those_of_brute_force(name, cell):
    law = {"mixed": lambda h: 2.51503 + 0.00901 * h * h, "deciduous": lambda h: 3.09632 + 0.00895 * h * h}[name]
    for seed, times in enumerate((0, 1, 2, 4)):
        heights = smooth(np.random.default_rng(seed), (31, 26), 45.0, times)
        found = listed(tops(heights, cell, WINDOWS[name]))
        assert found == brute_force(heights, cell, law, 2.0)
        assert found


def test_a_window_that_grows_with_the_height(tmp_path):
    """A linear law, as lidR and ForestTools have them."""
    heights = smooth(np.random.default_rng(2), (31, 26), 30.0, 1)
    found = listed(tops(heights, 1.0, Window(3.0, 0.07)))
    assert found == brute_force(heights, 1.0, lambda h: 3.0 + 0.07 * h, 2.0)
    assert found != listed(tops(heights, 1.0, Window(3.0)))
    chm = write(tmp_path / "chm.tif", heights)
    done = find_trees.TOOL(chm=chm, window_m=3.0, window_growth=0.07, output=str(tmp_path / "t.gpkg"))
    assert done.facts["trees"] == len(found)
    assert "window 3 m + 0.07 h, " in done.lines[0]


@pytest.mark.parametrize("diameter", [0.2, 1.0, 4.0, 6.0])
def test_whole_metres_have_the_tops_of_brute_force(diameter):
    """Plateaus of all shapes, circles through cell centres, and holes."""
    rng = np.random.default_rng(3)
    for times in (0, 1, 2):
        heights = np.round(smooth(rng, (27, 30), 12.0, times))
        heights[rng.random(heights.shape) < 0.1] = np.nan
        for scale, equals_win in ((1.0, True), (1.0 / 64.0, False)):  # in steps of 1 m, and of 1.6 cm
            found = listed(tops(heights * scale, 1.0, Window(diameter), 2.0 * scale))
            assert found == brute_force(heights * scale, 1.0, lambda h: diameter, 2.0 * scale, equals_win)
            assert found


@pytest.mark.parametrize("step", [0.05, 0.1])
@pytest.mark.parametrize("rows", [1, 2, 7, 40, 59, 1000])
def test_the_block_changes_nothing(rows, step):
    rng = np.random.default_rng(5)
    heights = step * np.round(smooth(rng, (60, 50), 60.0, 3) / step)
    heights[rng.random(heights.shape) < 0.05] = np.nan
    heights[rng.random(heights.shape) < 0.01] = 400.0
    whole = tops(heights, 0.5, WINDOWS["mixed"], block_rows=60)
    found = tops(heights, 0.5, WINDOWS["mixed"], block_rows=rows)
    assert listed(found) == listed(whole)
    assert found.too_high == whole.too_high == np.sum(heights > 150.0) > 0
    without = np.where(heights > 150.0, np.nan, heights)
    law = {"diameter": lambda h: 2.51503 + 0.00901 * h * h, "least": 2.0, "equals_win": step > 0.05}
    assert listed(found) == brute_force(without, 0.5, **law)


def test_a_plateau_is_one_tree_at_its_first_cell():
    heights = np.zeros((30, 30))
    heights[4:24, 5:22] = 10.0  # far larger than the window of 3.4 m
    assert listed(tops(heights, 1.0, WINDOWS["mixed"])) == [(4, 5, 10.0)]


def test_an_equal_cell_that_is_no_top_takes_nothing_away():
    """The western of two equal cells has a higher one in its circle; the eastern has not, and is a tree."""
    heights = np.full((12, 20), 0.03)
    heights[5, 5], heights[5, 6], heights[5, 3] = 10.0, 10.0, 12.0
    for rows in (1, 2, 3, 12):
        assert listed(tops(heights, 1.0, Window(4.0), block_rows=rows)) == [(5, 3, 12.0), (5, 6, 10.0)]


def test_rounding_adds_and_takes_few_trees():
    """Flat steps of a rounded slope are no trees. If they were, decimetres would give 7 % more, metres three times."""
    exact = smooth(np.random.default_rng(11), (300, 300), 30.0, 12)
    true = len(listed(tops(exact, 1.0, WINDOWS["mixed"])))
    assert not tops(exact, 1.0, WINDOWS["mixed"]).rounded
    for step, share in ((0.01, 0.01), (0.1, 0.02), (1.0, 0.2)):
        found = tops(step * np.round(exact / step), 1.0, WINDOWS["mixed"])
        assert found.rounded == (step >= 0.1)
        assert abs(len(listed(found)) - true) <= share * true


def test_tops_on_the_edge_and_beside_nothing_are_found():
    heights = np.full((9, 9), np.nan)
    heights[0, 0], heights[8, 8], heights[4, 4], heights[0, 8] = 20.0, 21.0, 1.9, 2.0
    assert listed(tops(heights, 1.0, WINDOWS["mixed"])) == [(0, 0, 20.0), (0, 8, 2.0), (8, 8, 21.0)]
    assert listed(tops(np.full((5, 5), np.nan), 1.0, WINDOWS["mixed"])) == []


PLACES = [(10.0, 10.0, 12.0), (30.0, 14.0, 25.0), (20.0, 40.0, 31.5), (50.0, 50.0, 8.0), (44.0, 20.0, 18.0)]


def cones() -> np.ndarray:
    """Five cones on 60 x 60 cells of 1 m, row 0 in the south; their tips are in the middle of cells."""
    v, u = np.mgrid[0:60, 0:60] * 1.0
    return np.max([np.maximum(0.0, h - 3.0 * np.hypot(u - x, v - y)) for x, y, h in PLACES], axis=0)


def write(path: Path, values: np.ndarray, east: float = 0.0, crs: str | None = "EPSG:2056", cell: float = 1.0) -> str:
    rows, columns = values.shape
    place = from_origin(EAST + east, NORTH + rows * cell, cell, cell)
    facts = {"driver": "GTiff", "dtype": "float64", "count": 1, "nodata": -9999.0, "crs": crs, "transform": place}
    with rasterio.open(path, "w", height=rows, width=columns, **facts) as made:
        made.write(np.where(np.isnan(values), -9999.0, values)[::-1], 1)
    return str(path)


def expected() -> list[tuple]:
    """By row, then column, from the south."""
    return sorted((EAST + x + 0.5, NORTH + y + 0.5, h) for x, y, h in PLACES)


def found_in(path: Path) -> list[tuple]:
    frame = gpd.read_file(path, layer="trees")
    assert frame.tree_id.tolist() == list(range(1, len(frame) + 1))
    assert frame.dbh_cm.to_numpy() == pytest.approx(2.52 * frame.height_m.to_numpy() ** 0.84)
    assert set(frame.dbh_source) == {"modelled"}
    return sorted(zip(frame.geometry.x, frame.geometry.y, frame.height_m, strict=True))


def test_a_forest_of_cones_is_found_and_slide_logs_reads_it(tmp_path, said):
    chm = write(tmp_path / "chm.tif", cones())
    done = find_trees.TOOL(feedback=said, chm=chm, output=str(tmp_path / "t.gpkg"))
    assert found_in(tmp_path / "t.gpkg") == expected()
    assert done.facts == {"trees": 5, "dropped": 0, "cells_too_high": 0}
    assert said.warnings == []
    dem = read_dem(write(tmp_path / "dem.tif", 1000.0 + np.mgrid[0:60, 0:60][0] * 0.5))
    trees = read_trees(str(tmp_path / "t.gpkg"), dem, said)
    assert len(trees.ids) == 5
    assert said.warnings == []


def test_surface_and_terrain_give_the_canopy(tmp_path, said):
    ground = 1000.0 + np.mgrid[0:60, 0:60][0] * 0.7
    ground[50, 50] = np.nan  # below the tree of 8 m, of which only the tip is lost
    dsm = write(tmp_path / "dsm.tif", np.nan_to_num(ground, nan=1035.0) + cones())
    dem = write(tmp_path / "dem.tif", ground)
    find_trees.TOOL(feedback=said, dsm=dsm, dem=dem, window_m=5.0, output=str(tmp_path / "t.gpkg"))
    found = found_in(tmp_path / "t.gpkg")
    high = [each for each in expected() if each[2] != 8.0]
    assert [each for each in found if each[2] != 5.0] == high  # heights are written to the millimetre
    assert len(found) == 5
    assert said.warnings == []


def test_a_south_up_raster_gives_the_same(tmp_path, said):
    chm = tmp_path / "chm.tif"
    place = rasterio.Affine(1.0, 0.0, EAST, 0.0, 1.0, NORTH)
    facts = {"driver": "GTiff", "dtype": "float32", "count": 1, "crs": "EPSG:2056", "transform": place}
    with rasterio.open(chm, "w", height=60, width=60, **facts) as made:
        made.write(cones().astype("float32"), 1)
    find_trees.TOOL(feedback=said, chm=str(chm), output=str(tmp_path / "t.gpkg"))
    assert found_in(tmp_path / "t.gpkg") == expected()


def test_what_is_too_high_for_a_tree_is_counted_and_reported(tmp_path, said):
    canopy = cones()
    canopy[0:2, 0:3] = 9999.0
    chm = write(tmp_path / "chm.tif", canopy)
    done = find_trees.TOOL(feedback=said, chm=chm, output=str(tmp_path / "t.gpkg"))
    assert found_in(tmp_path / "t.gpkg") == expected()
    assert done.facts["cells_too_high"] == 6
    assert done.lines[0].startswith("5 trees of 2 m or more found on 0.3594 ha, window ")  # 60 x 60 cells of 1 m less 6
    assert [each for each in said.warnings if "6 cells stand more than 150 m above the ground" in each]


def test_a_published_law_of_the_dbh(tmp_path):
    chm = write(tmp_path / "chm.tif", cones())
    find_trees.TOOL(chm=chm, dbh_law="fint", min_height_m=20.0, output=str(tmp_path / "t.gpkg"))
    frame = gpd.read_file(tmp_path / "t.gpkg")
    assert sorted(frame.height_m) == [25.0, 31.5]
    assert frame.dbh_cm.to_numpy() == pytest.approx(frame.height_m.to_numpy() ** 1.25)


def test_what_cannot_be_is_refused_in_one_line(tmp_path):
    chm, flat = write(tmp_path / "chm.tif", cones()), write(tmp_path / "flat.tif", np.zeros((60, 60)))
    wrong = {
        "give either --chm, or --dsm and --dem together": [
            {},
            {"chm": chm, "dsm": chm, "dem": flat},
            {"dsm": chm},
            {"chm": chm, "dem": flat},
        ],
        "must be on the same cells": [
            {"dsm": chm, "dem": write(tmp_path / "moved.tif", np.zeros((60, 60)), east=0.5)},
            {"dsm": chm, "dem": write(tmp_path / "small.tif", np.zeros((59, 60)))},
            {"dsm": chm, "dem": write(tmp_path / "coarse.tif", np.zeros((30, 30)), cell=2.0)},
            {"dsm": chm, "dem": write(tmp_path / "other.tif", np.zeros((60, 60)), crs="EPSG:21781")},
        ],
        "no tree of 2 m or more is found; no cell is that high": [{"chm": flat}],
        "5 tops have a DBH that no tree has": [{"chm": chm, "dbh_a": 1e6}],
        "--window-growth goes with --window-m": [{"chm": chm, "window_growth": 0.1}],
        "are two laws": [{"chm": chm, "dbh_law": "fint", "dbh_a": 3.0}],
        "--min-height-m": [{"chm": chm, "min_height_m": 1.0}],
    }
    for words, cases in wrong.items():
        for values in cases:
            with pytest.raises(UserError) as refused:
                find_trees.TOOL(**values, output=str(tmp_path / "t.gpkg"))
            assert words in str(refused.value)
            assert "\n" not in str(refused.value)
            assert not (tmp_path / "t.gpkg").exists()
