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
RINGS = 7  # of a log of 6 m at standard, without those at its ends


def chute(grade: float, side: float, floor: float, friction: float) -> Scene:
    """A channel that falls to the south; its sides rise with ``side`` beyond half a ``floor`` from its axis."""
    rise = side * np.maximum(np.abs(AXIS) - 0.5 * floor, 0.0)
    return Scene.prepare(grade * AXIS[:, None] + rise[None, :], CELL, -SIZE, -SIZE, friction=friction)


@pytest.mark.parametrize(("below", "starts"), [(1.002, False), (0.998, True)])
@pytest.mark.parametrize("grade", [0.15625, 0.078125, 0.03125])  # dry, watered, iced, nearly
@pytest.mark.parametrize(("side", "floor"), [(1.0, 2.0), (0.25, 0.0), (0.5, 0.0), (1.0, 0.0), (1.5, 0.0)])
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


@pytest.mark.parametrize("fidelity", ["draft", "standard", "fine"])
@pytest.mark.parametrize(
    ("side", "floor"),
    [(1.0, 2.0), (0.25, 0.0), (0.5, 0.0), (0.8125, 0.0), (1.0, 0.0), (1.25, 0.0), (1.5, 0.0), (2.0, 0.0)],
)
def test_a_wedged_log_brakes_harder(physics, side, floor, fidelity):
    """Down a steep V: a = g (sin - mu cos / cos(beta)); the flat chute's is g (sin - mu cos)."""
    grade, mu = 0.75, 0.25
    cos_beta = 1.0 if floor else np.sqrt((1.0 + grade**2) / (1.0 + grade**2 + side**2))
    scene = chute(grade, side, floor, mu)
    log = physics.body(diameter=2.0 * RADIUS, length=6.0, taper=1.0)
    up, down = np.array([0.0, -0.6, 0.8]), np.array([0.0, -0.8, -0.6])
    begin = physics.start(scene, log, down, RADIUS / cos_beta * up + [0.0, 30.0, 30.0 * grade])
    result = physics.run(scene, begin, time_limit=3.0, fidelity=fidelity)
    moved = np.linalg.norm(result.end_position[0] - result.release_position[0])
    assert moved == pytest.approx(0.5 * G * (0.6 - mu * 0.8 / cos_beta) * result.duration[0] ** 2, rel=2e-3)


@pytest.mark.parametrize("fidelity", ["draft", "standard", "fine"])
@pytest.mark.parametrize("angle", [18.0, 24.0, 26.0, 35.0, 45.0, 50.0, 60.0, 70.0])
def test_a_cone_of_any_length_is_wedged_all_the_way(physics, angle, fidelity):
    """The same for cones of usual lengths in a V whose sides rise by these angles across it, for four seconds.

    Its normals are the walls', whatever its taper. What it settles by at the start is a distance that grows with time,
    so the acceleration is that between two and four seconds. A plane between both walls taken for one that had turned
    gave up to 56 % more; a limit on the turn of 53 degrees still 2 % in the V of 24 degrees at draft.
    """
    grade, mu = 0.75, 0.15
    slant = np.sqrt(1.0 + grade**2)
    cos_beta = np.cos(np.radians(angle))
    scene = chute(grade, np.tan(np.radians(angle)) * slant, 0.0, mu)
    up, down = np.array([0.0, -0.6, 0.8]), np.array([0.0, -0.8, -0.6])
    for diameter, length in ((0.26, 8.0), (0.43, 15.0), (0.75, 30.0)):
        log = physics.body(diameter=diameter, length=length)
        place = 0.51 * diameter / cos_beta * up + [0.0, 41.3, 41.3 * grade]
        ways = []
        for seconds in (2.0, 4.0):
            result = physics.run(scene, physics.start(scene, log, down, place), time_limit=seconds, fidelity=fidelity)
            ways.append((result.duration[0], np.linalg.norm(result.end_position[0] - place)))
        (t1, s1), (t2, s2) = ways
        a = 2.0 * (s2 / t2 - s1 / t1) / (t2 - t1)
        assert a == pytest.approx(G * (0.6 - mu * 0.8 / cos_beta), rel=0.01)


@pytest.mark.parametrize("side", [0.25, 0.5, 1.0, 1.25, 1.5, 2.0, 3.0])
def test_both_walls_are_found_wherever_the_log_lies(physics, side):
    """Poses across a V and along its cells that both walls penetrate, one up to 19 times as deep as the other.

    Each ring then touches both walls, and the deepest penetration is a cylinder's.
    """
    grade, deep = 0.5, 0.01
    scene = chute(grade, side, 0.0, 0.0)
    log = physics.body(diameter=2.0 * RADIUS, length=6.0, taper=1.0)
    down = np.array([0.0, -1.0, -grade]) / np.sqrt(1.0 + grade**2)
    steep = np.sqrt(1.0 + grade**2 + side**2)  # vertical distance over the distance from a wall
    for along in np.linspace(20.0, 20.5, 11):
        for share in (-0.9, -0.5, -0.1, 0.0, 0.3, 0.7):
            across = share * deep * steep / side
            place = np.array([across, along, along * grade + (RADIUS - deep) * steep])
            result = physics.run(scene, physics.start(scene, log, down, place), time_limit=1e-9, time_step=1e-6)
            assert result.penetration_max[0] == pytest.approx((1.0 + abs(share)) * deep, abs=1e-5)
            assert result.cost["contacts"] / result.steps[0] >= 2 * RINGS
