"""Near an edge or not: by brute force over all cells, across blocks; heights compared with the grid; missing files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyproj
import pytest
import rasterio
from rasterio.transform import Affine, from_origin

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.results import edges
from deadwood_algorithms.results.edges import Edges, near_mask
from deadwood_algorithms.results.run_folder import input_paths

CELL, SHAPE = 0.5, (97, 81)
PLACES = 4000


@pytest.fixture
def dem(tmp_path) -> str:
    """Rough ground with two holes, an open corner, and heights as whole centimetres from an offset."""
    rng = np.random.default_rng(8)
    heights = rng.integers(0, 900, SHAPE).astype("int16")
    heights[20:24, 30:33] = heights[70, 5] = heights[80:, 60:] = -32768
    facts = {"height": SHAPE[0], "width": SHAPE[1], "dtype": "int16", "nodata": -32768, "crs": "EPSG:2056"}
    place = from_origin(2_786_000.0, 1_196_000.0 + CELL * SHAPE[0], CELL, CELL)
    with rasterio.open(tmp_path / "dem.tif", "w", driver="GTiff", count=1, transform=place, **facts) as made:
        made.write(heights, 1)
        made.scales, made.offsets = (0.01,), (1000.0,)
    return str(tmp_path / "dem.tif")


def places(grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    west, south, east, north = grid.bounds
    rng = np.random.default_rng(2)
    return rng.uniform(west - 3.0, east + 3.0, PLACES), rng.uniform(south - 3.0, north + 3.0, PLACES)


def near_by_hand(grid: Grid, x: np.ndarray, y: np.ndarray, distance: float) -> np.ndarray:
    """Every cell without height, and a collar of them around the grid, for the cell of every position."""
    margin = 12
    valid = np.pad(np.isfinite(grid.values), margin)
    j, i = np.nonzero(~valid)
    at_i, at_j = np.rint((x - grid.x0) / grid.cell) + margin, np.rint((y - grid.y0) / grid.cell) + margin
    far = np.hypot(at_i[:, None] - i, at_j[:, None] - j).min(axis=1) * grid.cell
    return far <= distance


@pytest.mark.parametrize("block", [512, 16])
@pytest.mark.parametrize("distance", [0.0, 0.5, 1.3, 4.0])
def test_near_is_what_a_look_at_every_cell_says(dem, said, monkeypatch, block, distance):
    monkeypatch.setattr(edges, "BLOCK", block)
    grid = read_dem(dem)
    x, y = places(grid)
    expected = near_by_hand(grid, x, y, distance)
    with Edges(grid, [Path(dem)], said) as known:
        assert np.array_equal(known.near(x, y, distance), expected)
    assert 0 < expected.sum() < PLACES
    assert said.notes == []


@pytest.mark.parametrize("block", [512, 16])
def test_heights_are_the_grids(dem, said, monkeypatch, block):
    monkeypatch.setattr(edges, "BLOCK", block)
    monkeypatch.setattr(edges, "BLOCKS_KEPT", 3)
    grid = read_dem(dem)
    x, y = places(grid)
    with Edges(grid, [Path("nowhere.tif"), Path(dem)], said) as known:
        ours, theirs = known.heights(x, y), grid.height(x, y)
    assert np.array_equal(np.isnan(ours), np.isnan(theirs))
    assert np.nanmax(np.abs(ours - theirs)) < 1e-3  # float32 heights


def test_a_south_up_file_is_read_right(dem, said, tmp_path):
    with rasterio.open(dem) as source:
        values, t, profile = source.read(1), source.transform, source.profile
    turned = Affine(t.a, 0.0, t.c, 0.0, -t.e, t.f + t.e * SHAPE[0])
    with rasterio.open(tmp_path / "up.tif", "w", **(profile | {"transform": turned})) as made:
        made.write(values[::-1], 1)
        made.scales, made.offsets = (0.01,), (1000.0,)
    grid = read_dem(dem)
    x, y = places(grid)
    with Edges(grid, [tmp_path / "up.tif"], said) as known:
        assert np.array_equal(known.near(x, y, 2.0), near_by_hand(grid, x, y, 2.0))
        assert np.nanmax(np.abs(known.heights(x, y) - grid.height(x, y))) < 1e-3


def test_without_the_file_the_grids_border_is_the_edge(dem, said):
    grid = read_dem(dem)
    other = Grid(grid.values, grid.cell, grid.x0 + 1.0, grid.y0, grid.crs)
    whole = Grid(np.zeros(SHAPE), CELL, other.x0, other.y0, pyproj.CRS.from_epsg(2056))
    x, y = places(grid)
    with Edges(other, [Path(dem)], said) as known:  # a file of another grid is not the run's
        assert known.path is None
        assert np.array_equal(known.near(x, y, 2.0), near_by_hand(whole, x, y, 2.0))
        assert np.isnan(known.heights(x, y)).all()
    assert "was not found" in said.notes[0]


def test_a_reach_between_two_whole_cells():
    valid = np.ones((11, 11), bool)
    valid[5, 5] = False
    mask = near_mask(valid, 3, 3.7)
    assert mask.shape == (5, 5)
    assert mask.all()  # the farthest corner is hypot(2, 2) = 2.83 away


def test_the_dem_is_looked_for_where_it_may_lie(tmp_path):
    found = input_paths(tmp_path / "a" / "run", {"parameters": {"dem": "maps/dem.tif"}}, "dem")
    assert found == [Path("maps/dem.tif"), tmp_path / "a" / "maps" / "dem.tif", tmp_path / "a" / "dem.tif"]
    assert input_paths(tmp_path, {}, "dem") == []


def test_only_logs_that_left_are_unknown():
    """Before: of logs that stayed near an edge, too, reach and spread "may be wrong by up to that number"."""
    both = edges.edge_words(2, 21, 240, 20.0, "the edges of the terrain model", "passed")
    assert both == (
        "2 of 240 logs left the terrain model, and their further movement is not known: reach and spread count only "
        "up to where they left; 21 more passed within 20 m of the edges of the terrain model: check that the heights "
        "there "
        "are sound"
    )
    near = edges.edge_words(0, 3, 8, 20.0, "its edges", "ended", known=False)
    assert near == "3 of 8 logs ended within 20 m of its edges: these may have left it"
