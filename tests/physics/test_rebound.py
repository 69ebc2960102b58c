"""Newton's impact law of a single contact, against closed forms, at every fidelity."""

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, Start, Trees
from deadwood_engine.limits import MET_AT_ONCE
from deadwood_engine.log_body import MASS


def together(starts):
    return Start(*(np.vstack([getattr(each, name) for each in starts]) for name in ("frame", "state", "body")))


@pytest.mark.parametrize("fidelity", list(FIDELITIES))
@pytest.mark.parametrize("restitution", [0.3, 0.5, 0.8])
def test_a_level_log_comes_up_again_to_e_squared_of_its_height(physics, fidelity, restitution):
    """Dropped from about 0.5 and 1 m, without friction, while it moves on at 1 m/s, which no impact changes.

    The deviation is what early contact permits (``MET_AT_ONCE`` of a step at the speed of the fall) and the position of
    the top between two nodes, g dt^2 / 8. When half a step of gravity was neglected, it rebounded 3 to 19 % too high.
    """
    scene, solid, number = physics.plane(0.0, size=40.0, cell=0.5, friction=0.0), physics.body(taper=1.0), 8
    drop = np.random.default_rng(0).uniform(1.0, 1.2, number) * np.repeat([0.5, 1.0], number // 2)
    begin = together(
        [physics.start(scene, solid, (1, 0, 0), (0, 0, 0.375 + each), velocity=(0, 1, 0)) for each in drop]
    )
    # until the first rebound of the highest has topped out
    limit = np.sqrt(2.0 * drop.max() / physics.G) * (1.0 + restitution) + 0.03
    result = physics.run(
        scene, begin, fidelity=fidelity, restitution=restitution, time_limit=limit, trace_cells=0.001,
        keep_poses=np.ones(number, bool),
    )  # fmt: skip
    step, poses = FIDELITIES[fidelity].time_step * FIDELITIES[fidelity].rebound_share, result.poses
    for row, height in enumerate(drop):
        landed = np.sqrt(2.0 * height / physics.G)
        mine = (poses.log_row == row) & (poses.time > landed + 0.5 * restitution * landed)
        top = poses.position[mine, 2].max() - 0.375
        early = MET_AT_ONCE * step * np.sqrt(2.0 * physics.G * height)
        # poses are kept where an end has moved by half a millimetre
        assert top == pytest.approx(restitution**2 * height, abs=early + physics.G * step**2 / 8 + 5e-4), row
        assert top <= restitution**2 * height + early  # no energy from nowhere
    assert result.last_state[:, 8] == pytest.approx(np.ones(number), abs=1e-9)
    # what lands again, slower than an impact is, may be given gravity's own share (docs/tests.md, T62)
    assert result.energy_error.max() < 3.0 * (physics.G * step) ** 2 / 8 / physics.G


@pytest.mark.parametrize("fidelity", list(FIDELITIES))
@pytest.mark.parametrize("restitution", [0.2, 0.5, 1.0])
def test_a_central_impact_turns_the_speed_around(physics, fidelity, restitution):
    """Broadside, its centre of mass at a stem, without gravity: from v to -e v, and the stem takes m (1 + e) v."""
    trees = Trees(np.array([20.0]), np.zeros(1), np.array([0.6]), np.array([1e4]))
    scene = physics.plane(0.0, size=40.0, cell=0.5, friction=0.0, trees=trees)
    solid = physics.body(0.5, 12.0, taper=1.0)
    begin = physics.start(scene, solid, (0, 1, 0), (16.0, 0, 8.0), velocity=(12.0, 0, 0))
    result = physics.run(scene, begin, fidelity=fidelity, restitution=restitution, time_limit=0.6, gravity=0.0)
    # the stem's taper, 3e-5, tilts its normal by as much
    assert result.last_state[0, 7:10] == pytest.approx((-12.0 * restitution, 0.0, 0.0), abs=12.0 * 2 * 3e-5)
    assert result.hits.impulse[0] == pytest.approx(solid[0, MASS] * 12.0 * (1.0 + restitution), rel=1e-4)
    assert result.energy_error[0] < 1e-9
