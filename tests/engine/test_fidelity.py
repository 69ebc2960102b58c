"""Fidelity as numbers: a finer one is finer in all of them, and distances follow the cells."""

from itertools import pairwise

import pytest

from deadwood_engine import FIDELITIES
from deadwood_engine.fidelity import fidelity_with, station_spacing, trace_step, where_things_rebound


def test_each_is_at_least_as_fine_as_the_one_before():
    assert list(FIDELITIES) == ["draft", "standard", "fine", "reference"]
    for coarse, fine in pairwise(FIDELITIES.values()):
        names = (
            "time_step",
            "travel_cells",
            "roll_angle",
            "station_spacing",
            "spacing_cells",
            "tolerance",
            "trace_cells",
            "coarse_cells",
        )
        for name in names:
            assert getattr(fine, name) <= getattr(coarse, name), name
        assert fine.sweeps >= coarse.sweeps
        assert fine.ring_points >= coarse.ring_points
        assert fine.time_step < coarse.time_step


@pytest.mark.parametrize("name", list(FIDELITIES))
@pytest.mark.parametrize("cell", [0.05, 0.5, 2.0, 25.0])
def test_distances_are_the_lesser_of_metres_and_cells(name, cell):
    """Rings besides no closer than a part of a cell, unless a user asks for them."""
    row = FIDELITIES[name]
    least = min(row.station_spacing, row.spacing_cells * cell)
    assert station_spacing(row, cell) == max(least, row.coarse_cells * cell)
    assert row.coarse_cells * 0.5 <= row.station_spacing  # it says nothing on the cells that the rows are measured on
    asked = fidelity_with(name, None, 0.3)
    assert station_spacing(asked, cell) == min(0.3, row.spacing_cells * cell)
    assert fidelity_with(name, 0.05, None) == row._replace(time_step=0.05, rebound_share=1.0)
    assert trace_step(row, cell) <= row.trace_cells * cell
    assert trace_step(row, cell) <= max(row.trace_spacing, cell)
    assert trace_step(row, cell) in (row.trace_cells * cell, row.trace_spacing, cell)


@pytest.mark.parametrize("name", list(FIDELITIES))
def test_steps_are_shorter_where_something_rebounds_unless_a_user_chose_them(name):
    row = FIDELITIES[name]
    assert where_things_rebound(row, 0.0, 0.0) == row
    found = where_things_rebound(row, 0.0, 0.05)
    assert found.time_step == row.rebound_share * row.time_step
    assert found.travel_cells == row.rebound_share * row.travel_cells
    assert found.roll_angle == row.rebound_share * row.roll_angle
    asked = fidelity_with(name, 0.05, None)
    assert where_things_rebound(asked, 0.5) == asked


def test_nobody_changes_sides_of_a_stem_in_one_step():
    assert all(0.0 < row.obstacle_travel <= 1.0 for row in FIDELITIES.values())
