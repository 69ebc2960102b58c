"""Trees found twice: the tallest stays, in any order, and every removed tree has a reason."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.prepare.trees.merging import duplicates

NONE = np.full(3, np.nan)


def on_a_line(*x: float) -> np.ndarray:
    return np.asarray(shapely.points([(each, 0.0) for each in x]))


def test_the_taller_of_two_stays_and_then_the_thicker_and_then_the_first():
    places = on_a_line(0, 0.5, 10)
    assert duplicates(places, np.array([20.0, 21, 5]), NONE, 1.0, None).tolist() == [True, False, False]
    thick_and_low = np.array([40.0, 30, 1])
    assert duplicates(places, np.array([20.0, 21, 5]), thick_and_low, 1.0, None).tolist() == [True, False, False]
    assert duplicates(places, np.array([20.0, 20, 5]), np.array([30.0, 31, 1]), 1.0, None).tolist() == [
        True,
        False,
        False,
    ]
    assert duplicates(places, np.array([20.0, 20, 5]), NONE, 1.0, None).tolist() == [False, True, False]


def test_a_tree_that_goes_takes_none_with_it():
    # The middle one is removed because of the left one; the right one is far from the left one and stays.
    assert duplicates(on_a_line(0, 0.9, 1.8), np.array([30.0, 29, 28]), NONE, 1.0, None).tolist() == [
        False,
        True,
        False,
    ]


def test_only_trees_of_different_tiles_are_merged_where_tiles_are_named():
    places, height = on_a_line(0, 0.5, 0.8), np.array([30.0, 29, 28])
    assert duplicates(places, height, NONE, 1.0, np.array(["a", "a", "b"])).tolist() == [False, False, True]


def test_a_thousand_trees_in_any_order():
    rng = np.random.default_rng(3)
    xy, height = rng.uniform(0, 60, (1000, 2)), rng.uniform(5, 40, 1000)
    places, nothing = np.asarray(shapely.points(xy)), np.full(1000, np.nan)
    goes = duplicates(places, height, nothing, 2.0, None)
    distance = np.hypot(*(xy[:, None] - xy[None]).transpose(2, 0, 1))
    near = (distance <= 2.0) & ~np.eye(1000, dtype=bool)
    assert not near[np.ix_(~goes, ~goes)].any()  # no two that stay are close to each other
    reason = near & (height[None] > height[:, None]) & ~goes[None]
    assert reason[goes].any(axis=1).all()  # each removed one is near a taller one that stays
    assert 100 < goes.sum() < 900
    order = rng.permutation(1000)
    assert (duplicates(places[order], height[order], nothing, 2.0, None) == goes[order]).all()


def test_through_the_tool(imported, outcome):
    rows = "x;y;h;tile\n" + "".join(
        f"{2_783_050 + x};1190050;{h};{t}\n" for x, h, t in [(0, 20, "a"), (0.4, 21, "b"), (9, 5, "b")]
    )
    assert imported(rows)["height_m"].tolist() == [20, 21, 5]
    assert imported(rows, merge_within_m=0.5)["height_m"].tolist() == [21, 5]
    assert outcome["last"].facts["dropped"] == 1
    assert imported(rows, merge_within_m=0.5, tile_field="tile")["height_m"].tolist() == [21, 5]
    with pytest.raises(UserError, match="--tile-field is for --merge-within-m"):
        imported(rows, tile_field="tile")
    with pytest.raises(UserError, match=r"no field 'map' \(--tile-field\)"):
        imported(rows, merge_within_m=1.0, tile_field="map")
