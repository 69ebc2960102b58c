"""Timber chutes: the grade at which a log starts tells its friction (Meyers 1905 told it so), as a balance of forces.

On a flat floor between walls mu is the grade. In a V the log wedges: each side takes W cos(psi) / (2 cos(beta)), beta
being the angle of a side seen along the chute, so the grade is mu / cos(beta). Heights are exact in binary.
"""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_engine import STOP_REASONS, Scene

G = 9.81
SIZE, CELL = 64.0, 0.5
AXIS = np.arange(-SIZE, SIZE + 0.5 * CELL, CELL)
RADIUS = 0.25


def chute(grade: float, side: float, floor: float, friction: float) -> Scene:
    """A channel that falls to the south; its sides rise with ``side`` beyond half a ``floor`` from its axis."""
    rise = side * np.maximum(np.abs(AXIS) - 0.5 * floor, 0.0)
    return Scene.prepare(grade * AXIS[:, None] + rise[None, :], CELL, -SIZE, -SIZE, friction=friction)


@pytest.mark.parametrize(("below", "starts"), [(1.002, False), (0.998, True)])
@pytest.mark.parametrize("grade", [0.15625, 0.078125, 0.03125])  # dry, watered, iced, nearly
@pytest.mark.parametrize(("side", "floor"), [(1.0, 2.0), (0.5, 0.0), (1.0, 0.0)])
def test_a_log_starts_where_the_grade_is_its_friction(physics, side, floor, grade, below, starts):
    cos_beta = 1.0 if floor else np.sqrt((1.0 + grade**2) / (1.0 + grade**2 + side**2))
    mu = below * grade * cos_beta
    scene = chute(grade, side, floor, mu)
    log = physics.body(diameter=2.0 * RADIUS, length=6.0, taper=1.0)
    slant = np.sqrt(1.0 + grade**2)
    up, down = np.array([0.0, -grade, 1.0]) / slant, np.array([0.0, -1.0, -grade]) / slant
    begin = physics.start(scene, log, down, RADIUS / cos_beta * up + [0.0, 20.0, 20.0 * grade])
    result = physics.run(scene, begin, time_limit=10.0, tolerance=1e-6)
    moved = float(np.linalg.norm(result.end_position[0] - result.release_position[0]))
    if starts:
        assert STOP_REASONS[result.stop_reason[0]] == "time_limit"
        way = 0.5 * G * (grade - mu / cos_beta) / slant * result.duration[0] ** 2
        assert moved == pytest.approx(way, rel=0.02, abs=1e-3)  # as it settles by up to half a millimetre at the start
    else:
        assert STOP_REASONS[result.stop_reason[0]] == "rest"
        assert moved < 1e-3


@pytest.mark.parametrize(
    ("side", "floor"),
    [
        (1.0, 2.0), (0.5, 0.0), (0.8125, 0.0), (1.0, 0.0),
        pytest.param(0.25, 0.0, marks=pytest.mark.xfail(reason="half of the wedging is lost: friction 1 % too low")),
        pytest.param(1.5, 0.0, marks=pytest.mark.xfail(reason="friction 30 % too low between sides of 56 degrees")),
    ],
)  # fmt: skip
def test_a_wedged_log_brakes_harder(physics, side, floor):
    """Down a steep V: a = g (sin - mu cos / cos(beta)); the flat chute's is g (sin - mu cos)."""
    grade, mu = 0.75, 0.25
    cos_beta = 1.0 if floor else np.sqrt((1.0 + grade**2) / (1.0 + grade**2 + side**2))
    scene = chute(grade, side, floor, mu)
    log = physics.body(diameter=2.0 * RADIUS, length=6.0, taper=1.0)
    up, down = np.array([0.0, -0.6, 0.8]), np.array([0.0, -0.8, -0.6])
    begin = physics.start(scene, log, down, RADIUS / cos_beta * up + [0.0, 30.0, 30.0 * grade])
    result = physics.run(scene, begin, time_limit=3.0)
    moved = np.linalg.norm(result.end_position[0] - result.release_position[0])
    assert moved == pytest.approx(0.5 * G * (0.6 - mu * 0.8 / cos_beta) * result.duration[0] ** 2, rel=2e-3)
