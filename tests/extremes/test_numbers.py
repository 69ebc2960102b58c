"""One number at a time to its extreme: friction, slope, size, density, speed, spin, step, place, restitution.

``at.healthy`` checks what must hold: a finite state, a unit quaternion, an end for a reason, and no energy gained;
and by each test besides.
"""

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, Lines, Logs, Scene, Trees, place_logs, slide
from deadwood_engine.fidelity import longest_travel

G = 9.81


def slope(degrees: float, *, cell: float = 0.5, number: int = 80, noise: float = 0.0, seed: int = 0, **parts) -> Scene:
    """A plane that rises to the north, rough by uniform noise [m] at its nodes."""
    rough = noise * np.random.default_rng(seed).random((number, number))
    heights = np.tan(np.radians(degrees)) * cell * np.arange(number)[:, None] + rough
    return Scene.prepare(heights, cell, 0.0, 0.0, **({"friction": 0.25} | parts))


def middle(scene: Scene) -> float:
    terrain = scene.arrays.terrain
    return 0.5 * terrain.cell * terrain.heights.shape[0]


def slid(at, scene, logs, *, fidelity="standard", **options):
    begin = place_logs(scene, logs)
    result = at.run(scene, begin, fidelity=fidelity, **options)
    at.healthy(scene, begin, result, longest=options.get("time_step", FIDELITIES[fidelity].time_step))
    return result


@pytest.mark.parametrize("friction", [0.0, 1e-12, 1e-3, 1.0, 10.0, 1e3, 1e6])
@pytest.mark.parametrize("fidelity", ["draft", "standard", "fine"])
def test_friction(at, friction, fidelity):
    """From ice to glue, on a rough slope: never faster than the fall allows."""
    scene = slope(35.0, noise=0.3, friction=friction)
    x = middle(scene)
    logs = Logs.alike(x + np.arange(4), [x] * 4, length=6.0, diameter=0.4)
    result = slid(at, scene, logs, fidelity=fidelity, time_limit=10.0)
    fall = result.release_position[:, 2] - result.end_position[:, 2]
    assert (result.speed_max**2 <= 2 * G * (fall.max() + 3.0)).all()
    assert result.penetration_max.max() < 0.25
    if friction == 0.0:
        assert at.reasons(result) == ["left_dem"] * 4


@pytest.mark.parametrize("degrees", [0.0, 1e-6, 20.0, 45.0, 60.0, 75.0, 85.0, 89.0, 89.9])
def test_slope(at, degrees):
    """Flat to sheer: a log that slides down a plane, lying along it, reaches a = g (sin - mu cos), or stays."""
    scene = slope(degrees, cell=4.0, number=60)
    logs = Logs.alike([120.0], [200.0], length=10.0, diameter=0.4, orientation=1, azimuth=np.pi)
    result = slid(at, scene, logs, time_limit=1.5)
    angle = np.radians(degrees)
    a = max(0.0, G * (np.sin(angle) - 0.25 * np.cos(angle)))
    if a == 0.0:
        # the thin end, a tenth of a metre up, has come down and that was all
        assert result.speed_max[0] < 1.0
        assert np.linalg.norm(result.last_state[0, 7:10]) < 1e-3
        return
    # the speed is that of the middle of the last step, which the axis' travel of 0.4 m may have shortened
    row = FIDELITIES["standard"]
    last = min(row.time_step, row.travel_cells / result.speed_max[0])
    # float32 heights above the slope's foot (up to 1e5 m) and the settling of the taper on the ground
    assert result.speed_max[0] == pytest.approx(a * (result.duration[0] - 0.5 * last), rel=0.003, abs=0.02)


@pytest.mark.parametrize("cell", [0.1, 0.25, 1.0, 5.0, 25.0])
@pytest.mark.parametrize("log", [(0.5, 0.05), (4.0, 1.0), (30.0, 0.75), (60.0, 3.0), (10.0, 0.01), (0.5, 3.0)])
def test_cell_and_log(at, cell, log):
    """Cells of 0.1 to 25 m under logs of 0.5 to 60 m, 1 cm to 3 m thick, up to 1000 times longer than thick.

    Roughness of a tenth of a cell. The middle of the DEM, at least 40 m wide for the small cells.
    """
    number = {0.1: 400, 0.25: 300, 1.0: 120}.get(cell, 40)
    scene = slope(30.0, cell=cell, number=number, noise=0.1 * cell)
    x = middle(scene)
    logs = Logs.alike(x + cell * np.array([0.0, 0.3, 2.2]), [x] * 3, length=log[0], diameter=log[1])
    result = slid(at, scene, logs, time_limit=3.0)
    # deeper than it moves in a step nothing can sink; nor anything by more than a twentieth of its diameter
    row = FIDELITIES["standard"]
    moves = np.minimum(longest_travel(row, cell), result.speed_max * row.time_step)
    assert (result.penetration_max < np.minimum(moves, 0.05 * log[1]) + 0.02).all()


@pytest.mark.parametrize("density", [1.0, 300.0, 20_000.0])
def test_density_scales_energy_only(at, density):
    scene = slope(35.0, noise=0.3)
    x = middle(scene)
    result = slid(at, scene, Logs.alike([x], [x], length=6.0, diameter=0.4, density=density), time_limit=5.0)
    light = slid(at, scene, Logs.alike([x], [x], length=6.0, diameter=0.4, density=100.0), time_limit=5.0)
    assert np.array_equal(result.last_state, light.last_state)
    assert result.energy_max[0] == pytest.approx(light.energy_max[0] * density / 100.0, rel=1e-12)


@pytest.mark.parametrize("fidelity", list(FIDELITIES))
@pytest.mark.parametrize("speed", [1e-300, 1e-9, 10.0, 100.0])
def test_speed(at, speed, fidelity):
    """Thrown along and across rough ground among trees, up to 100 m/s."""
    rng = np.random.default_rng(2)
    trees = Trees(rng.uniform(0, 60, 80), rng.uniform(0, 60, 80), rng.uniform(0.05, 0.8, 80), np.full(80, 25.0))
    scene = slope(30.0, noise=0.3, number=121, trees=trees)
    azimuths = np.radians([0, 77, 180, 270])
    logs = Logs.alike([30.0] * 4, [30.0] * 4, length=8.0, diameter=0.3, orientation=1, speed=speed)
    logs = Logs(**{**logs.__dict__, "azimuth": azimuths})
    result = slid(at, scene, logs, fidelity=fidelity, time_limit=6.0)
    assert (result.speed_max >= speed * (1 - 1e-12)).all()
    fall = result.release_position[:, 2] - result.end_position[:, 2]
    assert (result.speed_max**2 <= speed**2 + 2 * G * (np.abs(fall) + 30.0)).all()


@pytest.mark.parametrize("spin", [1.0, 50.0, 1000.0])
@pytest.mark.parametrize("tumble", [0.0, 1.0, 50.0])
def test_spin_in_flight(at, spin, tumble):
    """Spin about the own axis and end over end for 10 s: energy and angular momentum to rounding, at any step.

    Explicit schemes multiply the energy of a slender body (20 rad/s and 1 rad/s) by 43 in 10 s at 1 ms.
    """
    scene = at.flat(size=400.0, cell=10.0)
    solid = at.body()
    axis = np.array([0.6, 0.0, 0.8])
    across = np.array([0.8, 0.0, -0.6])
    begin = at.start(scene, solid, axis, (0, 0, 1000.0), spin=spin * axis + tumble * across)
    result = at.run(scene, begin, time_limit=10.0, time_step=0.1, travel_cells=1e9)
    at.healthy(scene, begin, result, gained=1e-10)
    state, a, c = result.last_state[0], solid[0, 4], solid[0, 5]

    def momentum(w, d):
        return a * w + (c - a) * (w @ d) * d

    kept = momentum(state[10:13], state[13:16])
    assert kept == pytest.approx(momentum(spin * axis + tumble * across, axis), rel=1e-9, abs=1e-8)
    assert state[10:13] @ state[13:16] == pytest.approx(spin, rel=1e-10)


@pytest.mark.parametrize("spin", [20.0, 200.0, 1000.0])
@pytest.mark.parametrize("axial", [True, False])
def test_spin_on_the_ground(at, spin, axial):
    """Let down spinning, up to 1000 rad/s (a rim at 375 m/s): friction takes the energy; nothing is thrown up by it."""
    scene = at.flat(size=300.0, cell=1.0)
    solid = at.body(0.75, 6.0)
    turn = np.array([1.0, 0, 0]) if axial else np.array([0, 0, 1.0])
    begin = at.start(scene, solid, (1, 0, 0), (0, 0, 0.5), spin=spin * turn)
    result = at.run(scene, begin, time_limit=4.0)
    at.healthy(scene, begin, result)
    assert result.penetration_max[0] < 0.25


@pytest.mark.parametrize("step", [1e-5, 1e-4, 1e-3, 0.01, 0.03, 0.1])
def test_time_step(at, step):
    """Steps over four orders of magnitude: on a rough slope with trees nothing blows up, nothing sinks in for good."""
    rng = np.random.default_rng(5)
    trees = Trees(rng.uniform(0, 40, 60), rng.uniform(0, 40, 60), rng.uniform(0.1, 0.6, 60), np.full(60, 25.0))
    scene = slope(35.0, noise=0.3, trees=trees)
    logs = Logs.alike([20.0], [20.0], length=6.0, diameter=0.4)
    slid(at, scene, logs, time_step=step, time_limit=0.2 if step < 1e-4 else 3.0)


@pytest.mark.parametrize("origin", [(1e7, 1e7), (-1e7, 3e6)])
def test_far_from_the_origin(at, origin):
    """At coordinates of 1e7 m, with trees, a barrier and a line: the same end to the bit.

    Everything stands on multiples of 1/64 m, so that moving it loses nothing.
    """
    rng = np.random.default_rng(3)
    heights = np.round((0.35 * np.arange(120)[:, None] + 0.3 * rng.random((120, 120))) * 64) / 64
    plan = np.round(rng.uniform(2, 55, (70, 2)) * 64) / 64
    results = []
    for x0, y0 in ((0.0, 0.0), origin):
        shift = np.array([x0, y0])
        parts = {
            "trees": Trees(plan[:, 0] + x0, plan[:, 1] + y0, np.full(70, 0.3), np.full(70, 20.0)),
            "barriers": at.barrier(*(np.array([[10.25, 12.5], [45.5, 9.25]]) + shift), height=2.0),
            "lines": Lines(np.array([[5.0, 20.0], [55.0, 22.0]]) + shift, np.array([0, 2])),
        }
        scene = Scene.prepare(heights, 0.5, x0, y0, friction=0.25, **parts)
        logs = Logs.alike(x0 + np.array([20.25, 30.5, 41.0]), y0 + np.full(3, 50.25), length=8.0, diameter=0.3)
        results.append(slide(scene, logs, FIDELITIES["standard"], time_limit=20.0))
    near, far = results
    assert np.array_equal(near.last_state, far.last_state)
    assert np.array_equal(near.reach, far.reach)
    assert np.array_equal(near.stop_item, far.stop_item)
    assert near.tree_hits.sum() > 0, "no tree was hit: the test shows nothing"


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.7, 1.0])
def test_restitution_without_friction(at, restitution):
    """Frictionless, Newton's law takes (1 - e^2) of each impact and never gives: bounces on a rough slope."""
    scene = slope(20.0, noise=0.3, friction=0.0)
    x = middle(scene)
    logs = Logs.alike(x + np.arange(3), [x] * 3, length=6.0, diameter=0.4, drop=2.0)
    result = slid(at, scene, logs, time_limit=6.0, restitution=restitution)
    assert result.penetration_max.max() < 0.25


@pytest.mark.parametrize("restitution", [0.3, 1.0])
def test_bounce_height(at, restitution):
    """Dropped level from H = 5 m the log comes up again to e^2 H.

    A contact is predicted, so the bounce may begin up to a step's way (at 9.9 m/s) above the ground.
    """
    scene = at.flat(size=30.0, cell=0.5)
    solid = at.body(taper=1.0)
    begin = at.start(scene, solid, (1, 0, 0), (0, 0, 5.375))
    # just after the first rebound has topped out: fall 1.00964 s, rise e times as long
    result = at.run(
        scene, begin, time_limit=1.00964 * (1 + 2 * restitution) - 0.1, restitution=restitution,
        keep_poses=np.ones(1, bool), trace_cells=0.02,
    )  # fmt: skip
    poses = result.poses
    after = poses.time > 1.05
    assert poses.position[after, 2].max() - 0.375 == pytest.approx(
        restitution**2 * 5.0, abs=9.9 * FIDELITIES["standard"].time_step
    )


@pytest.mark.parametrize("restitution", [0.3, 0.7, 1.0])
def test_restitution_with_friction(at, restitution):
    """Newton's law with Coulomb friction can gain energy where normal and tangent couple (Kane's paradox: Newton's
    coefficient fixes the normal speed whatever friction did to it). Stated bound: 2 % of the energy spent."""
    scene = slope(30.0, noise=0.3)
    x = middle(scene)
    logs = Logs.alike(x + np.arange(4), [x] * 4, length=6.0, diameter=0.4, drop=2.0)
    begin = place_logs(scene, logs)
    result = at.run(scene, begin, time_limit=8.0, restitution=restitution)
    at.healthy(scene, begin, result, gained=0.02)
