"""The surface of a DEM, one bit per patch, compared with the heights themselves."""

from __future__ import annotations

import numpy as np
import pyproj
import pytest
import shapely

from deadwood_algorithms.files import squares
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.prepare.trees.patches import patches_over
from deadwood_algorithms.prepare.trees.planting import ground_of

CRS = pyproj.CRS.from_epsg(2056)


@pytest.fixture(autouse=True)
def small_squares(monkeypatch):
    monkeypatch.setattr(squares, "SIDE", 16)


def grid(holes: int = 30) -> Grid:
    """55 x 70 cells of 2 m: one square of 16 x 16 patches complete, one of nodata, the others with holes."""
    rng = np.random.default_rng(5)
    values = rng.normal(900.0, 20.0, (55, 70)).astype(np.float32)
    values[rng.integers(17, 55, holes), rng.integers(17, 70, holes)] = np.nan
    if holes:
        values[16:34, 30:60] = np.nan
    return Grid(values, 2.0, 1000.0, 500.0, CRS)


def test_places_are_held_where_the_surface_has_a_height():
    """At random, at cell centres, on the seams of squares, on the rim and beyond it."""
    dem = grid()
    patches = patches_over(dem, dem.bounds, Quiet())
    rng = np.random.default_rng(2)
    x, y = rng.uniform(990.0, 1150.0, 20_000), rng.uniform(490.0, 620.0, 20_000)
    centres = np.meshgrid(1000.0 + 2.0 * np.arange(-1, 72), 500.0 + 2.0 * np.arange(-1, 57))
    x, y = (np.concatenate([random, at.ravel()]) for random, at in zip((x, y), centres, strict=True))
    assert np.array_equal(patches.hold(x, y), dem.contains(x, y))
    kinds = {block if isinstance(block, bool) else "some" for block in patches.blocks.values()}
    assert kinds == {True, False, "some"}
    assert not patches.whole
    assert patches.hold(np.zeros(0), np.zeros(0)).shape == (0,)


def test_patches_are_counted():
    dem = grid()
    known = np.isfinite(dem.values)
    expected = sum(known[j : j + 2, i : i + 2].all() for j in range(54) for i in range(69))
    assert patches_over(dem, dem.bounds, Quiet()).count == expected
    assert patches_over(grid(0), dem.bounds, Quiet()).whole


def test_of_a_stand_only_the_squares_below_it_are_looked_at():
    dem = grid(0)
    stand = shapely.box(1040.0, 540.0, 1060.0, 560.0)
    patches = patches_over(dem, stand.bounds, Quiet())
    assert set(patches.blocks) == {(1, 1)}
    assert ground_of(patches, stand, None).area == pytest.approx(400.0)


def test_the_area_of_a_stand_is_what_lies_on_the_surface():
    """Brute force over the patches, each 4 m2, of a stand whose sides follow the cells."""
    dem = grid()
    stand = shapely.box(1010.0, 510.0, 1120.0, 600.0)
    ground = ground_of(patches_over(dem, stand.bounds, Quiet()), stand, None)
    known = np.isfinite(dem.values)
    inside = [known[j : j + 2, i : i + 2].all() for j in range(5, 50) for i in range(5, 60)]
    assert ground.area == pytest.approx(4.0 * sum(inside))
    assert not ground.holds(np.array([1121.0]), np.array([550.0])).any()


def test_a_stand_beyond_the_dem_is_refused():
    stand = shapely.box(5000.0, 510.0, 5100.0, 600.0)
    with pytest.raises(UserError, match="leave no place on the DEM"):
        ground_of(patches_over(grid(), stand.bounds, Quiet()), stand, None)
