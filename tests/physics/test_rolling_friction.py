"""The moment against rolling, against closed forms of a cylinder on a plane, and its work in the books."""

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, Logs, Scene, Trees, place_logs
from deadwood_engine.log_body import AXIAL, BASE_RADIUS

EVERY = pytest.mark.parametrize("fidelity", list(FIDELITIES))
TANGENT = 0.3
SINE, COSINE = TANGENT / np.hypot(1, TANGENT), 1 / np.hypot(1, TANGENT)


def cylinder(physics, diameter=0.6, length=8.0):
    return physics.body(diameter, length, taper=1.0)


def across(physics, solid, **options):
    """A cylinder that lies across a plane, let go: its result and where it was."""
    scene = physics.plane(TANGENT, friction=options.pop("friction", 0.6), size=200.0)
    begin = physics.lying(scene, solid, TANGENT, 0.0, 90.0)
    return physics.run(scene, begin, **options), begin


@EVERY
@pytest.mark.parametrize("coefficient", [0.0, 0.05, 0.15, 0.28])
def test_a_cylinder_rolls_down_a_plane_as_it_must(physics, fidelity, coefficient):
    """It does not slip: v = g t (sin - c cos) / (1 + I / (m a2)), I / (m a2) = 1/2; and the books close."""
    solid = cylinder(physics)
    result, _ = across(physics, solid, fidelity=fidelity, rolling_friction=coefficient, time_limit=3.0)
    k2 = solid[0, AXIAL] / solid[0, BASE_RADIUS] ** 2
    assert k2 == pytest.approx(0.5)
    expected = physics.G * (SINE - coefficient * COSINE) / (1 + k2) * result.duration[0]
    # half a step of gravity: the velocity told is that of the middle of the last step
    speed = np.linalg.norm(result.last_state[0, 7:10])
    assert speed == pytest.approx(expected, abs=physics.G * FIDELITIES[fidelity].time_step)
    # let go between two nodes: gravity's half step may be given back once (docs/tests.md, T62)
    once = (physics.G * FIDELITIES[fidelity].time_step) ** 2 / 8
    assert result.energy_error[0] < 1e-6 + once / 9.81


@EVERY
@pytest.mark.parametrize(("more", "reason"), [(0.01, 0), (-0.01, 4)])
def test_it_rests_where_the_coefficient_is_more_than_the_slope(physics, fidelity, more, reason):
    """c = tan(slope) is the edge: 3 % above it the log rests where it was let go, 3 % below it rolls away."""
    coefficient = TANGENT + more
    result, _ = across(physics, cylinder(physics), fidelity=fidelity, rolling_friction=coefficient, time_limit=5.0)
    assert result.stop_reason[0] == reason
    if more > 0.0:
        assert result.path[0] < 1e-3
    else:
        assert result.path[0] > 0.25 * 5.0**2 * physics.G * -more * COSINE / 1.5


@EVERY
def test_it_rolls_out_on_level_ground(physics, fidelity):
    """From 6 m/s without slip it comes to rest after v2 (1 + k2) / (2 c g), and lies there."""
    solid = cylinder(physics)
    scene = physics.plane(0.0, friction=0.5, size=200.0)
    radius = solid[0, BASE_RADIUS]
    begin = physics.lying(scene, solid, 0.0, 0.0, 90.0, across=-6.0)
    begin.state[0, 10:13] = -6.0 / radius * begin.state[0, 13:16]
    if np.cross(begin.state[0, 10:13], (0, 0, radius)) @ begin.state[0, 7:10] < 0.0:
        begin.state[0, 10:13] *= -1.0
    result = physics.run(scene, begin, fidelity=fidelity, rolling_friction=0.1, time_limit=60.0)
    assert result.stop_reason[0] == 0
    assert result.path[0] == pytest.approx(36.0 * 1.5 / (2 * 0.1 * physics.G), rel=5e-3)
    assert result.energy_error[0] < 1e-3


@EVERY
def test_where_it_resists_more_than_friction_can_turn_the_log_slips_without_spin(physics, fidelity):
    """c > mu: sliding friction cannot make it roll, so it slides across, g (sin - mu cos), and does not spin."""
    result, _ = across(
        physics, cylinder(physics), fidelity=fidelity, friction=0.1, rolling_friction=0.2, time_limit=3.0
    )
    state = result.last_state[0]
    expected = physics.G * (SINE - 0.1 * COSINE) * result.duration[0]
    assert np.linalg.norm(state[7:10]) == pytest.approx(expected, abs=physics.G * FIDELITIES[fidelity].time_step)
    assert abs(state[10:13] @ state[13:16]) < 1e-6


@EVERY
def test_what_does_not_roll_is_not_held(physics, fidelity):
    """Down the fall line, base first, a log slides as without: same place to a tenth of a millimetre a second."""
    scene = physics.plane(0.6, friction=0.25, size=200.0)
    ends = []
    for coefficient in (0.0, 0.3):
        begin = physics.lying(scene, physics.body(), 0.6, 0.0, 180.0)
        ends.append(physics.run(scene, begin, fidelity=fidelity, rolling_friction=coefficient, time_limit=5.0))
    assert ends[0].end_position == pytest.approx(ends[1].end_position, abs=5e-4)


@pytest.mark.parametrize("coefficient", [0.05, 0.1, 0.3])
def test_it_gives_no_energy_on_rough_ground_among_trees(physics, coefficient):
    """A hundred logs on ground of knee-high humps: energy is booked to 0.1 %, none is made."""
    rng = np.random.default_rng(5)
    heights = 0.55 * np.arange(120)[:, None] + 0.5 * rng.random((120, 90))
    trees = Trees(rng.uniform(5, 85, 120), rng.uniform(5, 115, 120), rng.uniform(0.2, 0.6, 120), np.full(120, 20.0))
    scene = Scene.prepare(heights, 1.0, 0.0, 0.0, friction=0.3, trees=trees)
    logs = Logs.alike(rng.uniform(20, 70, 100), rng.uniform(80, 110, 100), length=9.0, diameter=0.4)
    result = physics.run(scene, place_logs(scene, logs), rolling_friction=coefficient, threads=2, time_limit=60.0)
    assert (result.stop_reason != 5).all()
    assert result.energy_error.max() < 1e-3
