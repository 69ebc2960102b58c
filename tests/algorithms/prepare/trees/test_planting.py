"""Trees planted on arrays: which are moved, and that earlier ones do not depend on later ones."""

from __future__ import annotations

import numpy as np
import pyproj
import pytest
import shapely

from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.prepare.trees.patches import patches_over
from deadwood_algorithms.prepare.trees.planting import Ground, numbers_of_trees, plant, too_near

SHAPE = shapely.box(0.0, 0.0, 60.0, 40.0)
GRID = Grid(np.zeros((50, 70)), 1.0, -5.0, -5.0, pyproj.CRS.from_epsg(2056))
PATCHES = patches_over(GRID, GRID.bounds, Quiet())


def ground(shape: shapely.Polygon = SHAPE) -> Ground:
    return Ground(PATCHES, shape, shape.bounds, shape.area)


@pytest.mark.parametrize("seed", range(3))
def test_a_tree_looks_only_at_those_before_it(seed):
    place = 20.0 * np.random.default_rng(seed).random((80, 2))
    expected = [k for k in range(80) if any(np.hypot(*(place[k] - place[j])) <= 1.5 for j in range(k))]
    assert too_near(place, 1.5).tolist() == expected
    assert too_near(place, 0.0).size == 0


@pytest.mark.parametrize("spacing", [0.0, 2.0])
def test_the_first_trees_stand_where_they_did_when_more_are_planted(spacing):
    few, many = (np.column_stack(plant([ground()], [n], spacing, 3, Quiet())) for n in (40, 150))
    assert np.array_equal(many[:40], few)
    assert shapely.contains_xy(SHAPE, *many.T).all()
    apart = np.hypot(*(many[:, None] - many).transpose(2, 0, 1)) + 1e9 * np.eye(150)
    assert apart.min() > spacing


def test_a_ground_keeps_its_trees_when_another_gets_more():
    west, east = ground(shapely.box(0.0, 0.0, 20.0, 40.0)), ground(shapely.box(30.0, 0.0, 60.0, 40.0))
    one, other = (np.column_stack(plant([west, east], [n, 30], 0.0, 3, Quiet())) for n in (10, 50))
    assert np.array_equal(one[10:], other[50:])
    assert np.unique(numbers_of_trees([5, 7, 2])).size == 14


def test_what_has_no_room_is_refused():
    with pytest.raises(UserError, match="leaves no room"):
        plant([ground()], [2000], 2.0, 0, Quiet())
