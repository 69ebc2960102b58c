"""Fidelity as numbers: a finer one is finer in all of them, and distances follow the cells."""

from itertools import pairwise

import pytest

from deadwood_engine import FIDELITIES
from deadwood_engine.fidelity import station_spacing, trace_step


def test_each_is_at_least_as_fine_as_the_one_before():
    assert list(FIDELITIES) == ["draft", "standard", "fine", "reference"]
    for coarse, fine in pairwise(FIDELITIES.values()):
        for name in ("time_step", "travel_cells", "station_spacing", "spacing_cells", "tolerance", "trace_cells"):
            assert getattr(fine, name) <= getattr(coarse, name), name
        assert fine.sweeps >= coarse.sweeps
        assert fine.ring_points >= coarse.ring_points
        assert fine.time_step < coarse.time_step


@pytest.mark.parametrize("name", list(FIDELITIES))
@pytest.mark.parametrize("cell", [0.05, 0.5, 2.0, 25.0])
def test_distances_are_the_lesser_of_metres_and_cells(name, cell):
    row = FIDELITIES[name]
    assert station_spacing(row, cell) == min(row.station_spacing, row.spacing_cells * cell)
    assert trace_step(row, cell) <= row.trace_cells * cell
    assert trace_step(row, cell) <= max(row.trace_spacing, cell)
    assert trace_step(row, cell) in (row.trace_cells * cell, row.trace_spacing, cell)


def test_nobody_changes_sides_of_a_stem_in_one_step():
    assert all(0.0 < row.obstacle_travel <= 1.0 for row in FIDELITIES.values())
