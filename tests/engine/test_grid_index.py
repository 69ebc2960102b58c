"""The grid of boxes against every box looked at."""

import numpy as np
import pytest

from deadwood_engine.grid_index import floor_within, index_boxes, insert_sorted, list_near


def near(index, low, high, number):
    listed = np.zeros(number + 1, np.int64)
    return listed[: list_near(index, listed, *low, *high)].tolist()


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("spread", [10.0, 1e3, 1e7])
def test_no_box_that_overlaps_is_left_out_and_each_comes_once_in_order(seed, spread):
    rng = np.random.default_rng(seed)
    low = rng.uniform(-spread, spread, (60, 2))
    high = low + 10 ** rng.uniform(-3, 1.5, (60, 2))
    index = index_boxes(low, high)
    for _ in range(40):
        a = rng.uniform(-1.2 * spread, 1.2 * spread, 2) if rng.random() < 0.5 else low[rng.integers(60)] - 1e-9
        b = a + 10 ** rng.uniform(-3, 2, 2)
        found = near(index, a, b, 60)
        overlap = np.flatnonzero((low <= b).all(axis=1) & (high >= a).all(axis=1))
        assert found == sorted(set(found))
        assert set(overlap) <= set(found)
        # nothing from farther away than the two cells beside it
        reach = 2.0 * index.cell
        assert all((low[k] <= b + reach).all() and (high[k] >= a - reach).all() for k in found)


def test_nothing_indexed_nothing_found():
    index = index_boxes(np.zeros((0, 2)), np.zeros((0, 2)))
    assert near(index, (-1e9, -1e9), (1e9, 1e9), 1) == []


def test_boxes_far_apart_do_not_fill_the_memory():
    index = index_boxes(np.array([[0.0, 0.0], [1e6, 1e6]]), np.array([[1.0, 1.0], [1e6 + 1, 1e6 + 1]]))
    assert index.columns * index.rows < 5_000_000
    assert near(index, (0, 0), (1, 1), 2) == [0]


@pytest.mark.parametrize(
    ("x", "answer"), [(2.7, 2), (-0.1, -1), (-9.0, -3), (99.0, 5), (np.nan, -3), (np.inf, 5), (-np.inf, -3)]
)
def test_floor_stays_within(x, answer):
    assert floor_within(x, -3, 5) == answer


def test_a_list_stays_sorted_and_takes_each_once():
    listed, count = np.zeros(8, np.int64), 0
    for item in (5, 1, 3, 5, 1, 9, 0):
        count = insert_sorted(listed, count, item)
    assert listed[:count].tolist() == [0, 1, 3, 5, 9]
