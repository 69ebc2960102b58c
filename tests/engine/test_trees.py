"""The solid of a stem: a truncated cone of half the diameter at its top, which is round; a stump keeps its DBH."""

import numpy as np
import pytest

from deadwood_engine import Scene, Trees


def stem(diameter, height, ground=100.0):
    trees = Trees(*(np.array([float(v)]) for v in (10.3, 12.7, diameter, height)))
    scene = Scene.prepare(np.full((30, 30), ground), 1.0, 0.0, 0.0, friction=0.3, trees=trees)
    assert len(scene.arrays.cores.solid) == 1
    core = scene.arrays.cores.solid[0]
    assert (core.ux, core.uy, core.uz) == (0.0, 0.0, 1.0)
    foot = ground - scene.arrays.terrain.reference
    return core, core.z - foot


@pytest.mark.parametrize("diameter", [0.05, 0.6, 1.5])
@pytest.mark.parametrize("height", [20.0, 3.01])
def test_a_stem_has_its_height_and_ends_in_half_a_sphere(diameter, height):
    core, start = stem(diameter, height)
    top = start + core.long + core.wide + core.slope * core.long
    assert top == pytest.approx(height, abs=1e-9)
    assert core.wide + core.slope * core.long == pytest.approx(0.25 * diameter, abs=1e-12)  # half of the radius
    assert start < 0.0  # it continues below ground, because beside it the ground may be lower
    assert abs(core.slope) <= 1.0  # or the sphere at one end would swallow that at the other


@pytest.mark.parametrize(
    ("diameter", "height"),
    [(0.75, 0.1), (0.75, 0.3), (0.75, 0.5), (0.4, 0.3), (0.3, 0.5), (1.0, 0.5), (0.75, 1.3), (14.0, 0.2), (0.02, 3.0)],
)
def test_a_stump_has_its_dbh_all_the_way_up_and_a_flat_top_at_its_height(diameter, height):
    """Before, half a sphere at its top left 0.62 to 0.93 of the DBH at the ground."""
    core, start = stem(diameter, height)
    assert core.slope == 0.0
    assert core.wide == pytest.approx(0.5 * diameter, abs=1e-12)
    rim = core.wide - core.disc
    assert 0.0 < rim <= 0.125 * diameter + 1e-12  # of the rounding, above which the top is flat
    assert start + core.long + rim == pytest.approx(height, abs=1e-9)
    assert start + core.long >= 0.5 * height - 1e-9  # so far up it is as wide as it says
    assert start <= -3.0


@pytest.mark.parametrize("height", [30.0, 10.0, 3.1])
def test_where_it_is_higher_than_wide_its_foot_is_as_thick_as_it_says(height):
    """Radius of the cores' spheres at the ground: half the DBH, to the slant of the taper."""
    core, start = stem(0.6, height)
    at_ground = core.wide - core.slope * start
    assert at_ground == pytest.approx(0.3, rel=0.02)


def test_what_stands_on_nothing_is_left_out_and_keeps_its_row():
    heights = np.full((20, 20), 5.0)
    heights[:, 10:] = np.nan
    trees = Trees(np.array([15.0, 4.0, 500.0]), np.full(3, 5.0), np.full(3, 0.4), np.full(3, 10.0))
    scene = Scene.prepare(heights, 1.0, 0.0, 0.0, friction=0.3, trees=trees)
    assert scene.trees_outside.tolist() == [0, 2]
    assert scene.arrays.cores.solid.owner.tolist() == [1]
    assert scene.tree_count == 3


@pytest.mark.parametrize(
    ("name", "value"), [("diameter", 0.0), ("diameter", np.nan), ("height", -1.0), ("height", np.inf)]
)
def test_impossible_trees_are_refused(name, value):
    tree = Trees(*(np.array([v]) for v in (5.0, 5.0, 0.4, 10.0)))._replace(**{name: np.array([value])})
    with pytest.raises(ValueError, match=name):
        Scene.prepare(np.zeros((20, 20)), 1.0, 0.0, 0.0, friction=0.3, trees=tree)
