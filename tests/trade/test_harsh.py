"""Penetration depth of a log, measured by sampling its surface: compared with exact values for cones and planes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks import harsh
from deadwood_engine import Logs

CELL, DIAMETER, LENGTH = 0.5, 0.6, 12.0


def posed(base, tip) -> Any:
    """A result with one log in these poses."""
    base, tip = np.atleast_2d(np.asarray(base, float)), np.atleast_2d(np.asarray(tip, float))
    poses = SimpleNamespace(log_row=np.zeros(len(base), np.int64), base=base, tip=tip)
    return SimpleNamespace(poses=poses, steps=np.zeros(1))


@pytest.mark.parametrize("degrees", [0.0, 35.0])
@pytest.mark.parametrize("sunk", [0.0, 0.2, 3.0])
def test_depth_of_a_cone_pushed_into_a_plane(degrees, sunk):
    """The rim of its base is deepest, by as much as the axis is lowered: a plane is bilinear on any cells."""
    y = (np.arange(80)[:, None] + 0.5) * CELL
    heights = np.tan(np.radians(degrees)) * y + np.zeros((80, 80))
    up = np.array([0.0, -np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])
    above = 0.5 * DIAMETER - sunk
    base = np.array([12.0, 20.0, 20.0 * np.tan(np.radians(degrees))]) + above * up
    tip = base + np.array([LENGTH, 0.0, 0.0])
    result = posed([base, base + 5.0 * up], [tip, tip + 5.0 * up])
    logs = Logs.alike(np.zeros(1), np.zeros(1), diameter=DIAMETER, length=LENGTH)
    found = harsh.depth_in_ground(heights, CELL, degrees, result, logs)
    # the lowest of 16 points of a rim is at most pi/16 from its lowest point
    assert sunk - 0.5 * DIAMETER * (1.0 - np.cos(np.pi / harsh.AROUND)) - 1e-9 <= found[0] <= sunk + 1e-9


def test_height_is_that_of_the_bilinear_surface_and_nothing_beyond_it():
    heights = np.arange(12.0).reshape(3, 4) ** 2
    assert harsh.height_at(heights, CELL, np.array([0.75]), np.array([0.25]))[0] == heights[0, 1]
    centre = harsh.height_at(heights, CELL, np.array([1.0]), np.array([1.0]))[0]
    assert centre == pytest.approx(heights[1:3, 1:3].mean())
    assert np.isnan(harsh.height_at(heights, CELL, np.array([0.2]), np.array([0.3])))[0]


@pytest.mark.parametrize(
    ("x", "z", "through"),
    [(40.0, 1.0, True), (40.0, harsh.BARRIER_HEIGHT + 0.1, False), (harsh.BARRIER_X[1] + 1.0, 1.0, False)],
    ids=["through", "over", "beside"],
)
def test_an_axis_cuts_the_barrier_below_its_top_and_between_its_ends(x, z, through):
    heights = np.zeros((160, 160))
    result = posed((x, harsh.BARRIER_Y + 4.0, z), (x, harsh.BARRIER_Y - 6.0, z))
    assert harsh.cut_by_barrier(heights, CELL, result)[0] == through
    before = posed((x, harsh.BARRIER_Y + 8.0, z), (x, harsh.BARRIER_Y + 0.1, z))
    assert not harsh.cut_by_barrier(heights, CELL, before)[0]


def test_rows_tell_restitution_and_fidelity():
    """Logs without rebound are held by the barrier, and are no deeper in the ground than half their radius."""
    found = harsh.rebounds(threads=1, logs=4, fidelities=("draft",))
    assert [(row["e"], row["fidelity"], row["logs"]) for row in found["rows"]] == [
        (e, "draft", 4) for e in harsh.REBOUNDS
    ]
    held = found["rows"][0]
    assert (held["through"], held["past"]["p"], held["failed"]) == (0, 0.0, 0)
    assert held["sampled_m"]["max"] < 0.5 * found["radius_m"]
