"""The first release of the page: on steep ground from which the way down meets a line."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_algorithms.explore.suggested import STEEP_DEG, suggested_place

CELL, ROWS, COLUMNS = 5.0, 60, 40
HIGH = CELL * ROWS


def roof(slope_deg: float) -> np.ndarray:
    """A ridge along the x axis in the middle: its southern side falls to the south, its northern one to the north."""
    y = (ROWS - np.arange(ROWS) - 0.5) * CELL
    z = 500.0 - np.tan(np.radians(slope_deg)) * np.abs(y - HIGH / 2.0)
    return np.repeat(z[:, None], COLUMNS, axis=1)


@pytest.mark.parametrize(("line_y", "side"), [(20.0, -1), (HIGH - 20.0, 1)])
def test_it_is_on_the_side_of_the_line(line_y: float, side: int):
    lines = [{"parts": [[[0.0, line_y], [CELL * COLUMNS, line_y]]]}]
    found = suggested_place(CELL, roof(35.0), lines)
    assert found is not None
    assert side * (found[1] - HIGH / 2.0) > 0.0
    assert abs(found[1] - line_y) > 10.0, "above it"


def test_a_line_beside_the_ways_attracts_none():
    heights = roof(35.0)
    short = [{"parts": [[[0.0, 20.0], [30.0, 20.0]]]}]
    found = suggested_place(CELL, heights, short)
    assert found is not None
    assert found[0] < 40.0
    assert found[1] < HIGH / 2.0
    assert suggested_place(CELL, heights, []) is not None


def test_flat_ground_and_holes_suggest_nothing():
    assert suggested_place(CELL, roof(STEEP_DEG[0] - 5.0), []) is None
    assert suggested_place(CELL, np.full((ROWS, COLUMNS), np.nan), []) is None
    assert suggested_place(CELL, roof(35.0)[:3], []) is None
