"""Trees and barriers: hit where they stand, never passed, overjumped only from above."""

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, STOP_REASONS, Barriers, Lines, Logs, Scene, Trees, slide
from deadwood_engine.log_body import CENTRE, LENGTH, TRANSVERSE

G = 9.81


def flat(*, size=60.0, cell=0.5, friction=0.25, **parts):
    count = int(2 * size / cell) + 1
    return Scene.prepare(np.zeros((count, count)), cell, -size, -size, friction=friction, **parts)


def barrier(*points, height=3.0):
    return Barriers(np.array(points, float), np.array([0, len(points)]), np.array([height]))


def crosses(poses, row, x, width):
    """Whether the log's axis ever crosses the plane x within ``width`` of the middle (as any log that gets behind it
    does).
    """
    mine = poses.log_row == row
    base, tip = poses.base[mine], poses.tip[mine]
    before, after = base[:, 0] - x, tip[:, 0] - x
    apart = before * after < 0
    share = before[apart] / (before - after)[apart]
    return np.any(np.abs(base[apart, 1] + share * (tip - base)[apart, 1]) < width)


@pytest.mark.parametrize(("offset", "speed"), [(0.0, 0.0), (2.0, 0.564696), (5.0, 2.722286), (8.0, 4.891673)])
def test_sideways_hit_keeps_what_the_lever_leaves(physics, offset, speed):
    """T47 in the whole engine: a horizontal log flying broadside at 10 m/s into a tree b off its centre.

    v+ = 10 b^2/(k^2 + b^2) for a force square to the axis; the tapers tilt it by 0.4 and 0.9 degrees, hence 1 %.
    """
    trees = Trees(np.array([offset]), np.array([5.0]), np.array([0.4]), np.array([100.0]))
    scene = flat(trees=trees, friction=0.0)
    log = physics.body()
    begin = physics.start(scene, log, (1, 0, 0), (0, 3.0, 20.0), velocity=(0, 10, 0))
    result = physics.run(scene, begin, time_limit=0.4, gravity=0.0, travel_cells=0.1)
    assert result.tree_hits[0] == 1
    assert result.last_state[0, 8] == pytest.approx(speed, rel=0.01, abs=0.01)
    # energy left: translation and rotation of the exact answer
    k2, b = log[0, TRANSVERSE], offset
    expected = 0.5 * 100 * b**2 / (k2 + b**2)
    v, w = result.last_state[0, 7:10], result.last_state[0, 10:13]
    assert 0.5 * v @ v + 0.5 * k2 * w @ w == pytest.approx(expected, rel=0.02, abs=0.02)


@pytest.mark.parametrize("offset", [0.0, 0.1])
def test_head_on_stops_at_the_flat_end(physics, offset):
    """T50: a flat end that meets a tree within its width is stopped head-on; a capsule's nose would glide aside.

    For an offset e inside the face the normal is the face's, so v+ = v - P with P = v / (1 + e^2/k^2): almost a stop.
    """
    trees = Trees(np.array([30.0]), np.array([offset]), np.array([0.6]), np.array([1000.0]))
    scene = flat(trees=trees, friction=0.0)
    log = physics.body()
    begin = physics.start(scene, log, (1, 0, 0), (5.0, 0.0, 20.0), velocity=(20, 0, 0))
    result = physics.run(scene, begin, time_limit=1.0, gravity=0.0)
    k2 = log[0, TRANSVERSE]
    left = 20 * (1 - 1 / (1 + offset**2 / k2))
    assert result.last_state[0, 7] == pytest.approx(left, abs=0.02)
    # the tip stands at the tree's face: neither short of it nor in it
    assert result.tip_end[0, 0] == pytest.approx(30.0 - np.sqrt(0.3**2 - 0 * offset), abs=0.12)
    assert result.tip_end[0, 0] < 30.0


def test_wedge_between_two_trees_holds(physics):
    """T43: the thin end pushed between two trees 5 % closer than its thickness jams; it never passes."""
    log = physics.body()
    tip_to_gap = 4.0
    local = 2 * (log[0, 1] + (log[0, 0] - log[0, 1]) * tip_to_gap / log[0, LENGTH])
    gap = 0.95 * local + 0.5
    trees = Trees(np.array([20.0, 20.0]), np.array([-gap / 2, gap / 2]), np.full(2, 0.5), np.full(2, 1e5))
    scene = flat(trees=trees)
    begin = physics.start(
        scene, log, (1, 0, 0), (19.0 - (log[0, LENGTH] - log[0, CENTRE]), 0.0, log[0, 0]), velocity=(5.0, 0, 0)
    )
    result = physics.run(scene, begin, time_limit=10.0)
    assert np.linalg.norm(result.last_state[0, 7:10]) < 1e-3
    # the trees' surfaces leave 0.95 of the thickness 4 m from the tip: that section cannot pass, thinner ones do
    assert 20.0 < result.tip_end[0, 0] < 20.0 + tip_to_gap
    # four steps of the jam hit the cap of 200 sweeps; what they leave unsolved gives 1e-6 of the energy back
    assert result.energy_error[0] < 1e-5


@pytest.mark.parametrize("fidelity", list(FIDELITIES))
def test_tree_row_cannot_be_passed(fidelity):
    """A palisade with gaps of 10 cm under 30 cm logs, shot at from all angles at 40 m/s: nothing is ever behind it."""
    rng = np.random.default_rng(4)
    y = np.arange(-40, 40.01, 0.4)
    trees = Trees(np.full(len(y), 20.0), y, np.full(len(y), 0.3), np.full(len(y), 60.0))
    scene = flat(trees=trees, cell=1.0)
    number = 40
    logs = Logs.alike(
        np.full(number, 10.0) - 4 * rng.random(number), 20 * rng.random(number) - 10, diameter=0.4, length=8.0,
        orientation=1, speed=40.0, drop=1.0,
    )  # fmt: skip
    azimuth = np.radians(rng.uniform(30, 150, number))
    logs = Logs(**{**logs.__dict__, "azimuth": azimuth})
    result = slide(scene, logs, FIDELITIES[fidelity], threads=2, keep_poses=np.ones(number, bool))
    assert (result.tree_hits > 0).sum() > 30
    assert not any(crosses(result.poses, row, 20.05, 39.0) for row in range(number))


@pytest.mark.parametrize("fidelity", list(FIDELITIES))
@pytest.mark.parametrize("thickness", [0.4, 0.05])
def test_barrier_cannot_be_passed(fidelity, thickness):
    """T54: a plate without thickness, broadside, head-on and spinning, at 40 m/s, at any step and fidelity."""
    rng = np.random.default_rng(6)
    scene = flat(barriers=barrier((20, -55), (20, 0), (20, 55), height=30.0), cell=1.0)
    number = 30
    base = Logs.alike(
        np.full(number, 8.0), 20 * rng.random(number) - 10, diameter=thickness, length=8.0, orientation=1,
        speed=40.0, drop=1.0,
    )  # fmt: skip
    logs = Logs(**{**base.__dict__, "azimuth": np.radians(rng.uniform(45, 135, number))})
    from deadwood_engine import place_logs

    begin = place_logs(scene, logs)
    begin.state[: number // 2, 13:16] = (0, 1, 0)  # half of them broadside, spinning about the vertical
    from deadwood_engine.rotation import quaternion_from_axis

    begin.state[: number // 2, 3:7] = quaternion_from_axis(np.array([[0.0, 1.0, 0.0]]))
    begin.state[: number // 2, 12] = rng.uniform(-20, 20, number // 2)
    result = slide(scene, begin, FIDELITIES[fidelity], threads=2, keep_poses=np.ones(number, bool))
    assert (result.barrier_hits > 0).all()
    # an end may penetrate by what a step's contact leaves open, never by its own thickness or 5 cm
    assert not any(crosses(result.poses, row, 20.05, 39.0) for row in range(number))
    assert not result.barrier_crossed.any()
    assert result.barrier_reached.all()


@pytest.mark.parametrize(("clearance", "passes"), [(0.05, True), (-0.05, False)])
def test_flight_over_the_top_edge(physics, clearance, passes):
    """T54d: a level log at 24 m/s along its axis clears a 3.5 m barrier 20 m ahead iff its tail does, at t = 35/24 s.

    Head at x = 0, log of 15 m: the tail passes the barrier at (20 + 15)/24 s, after a fall of 10.431641 m.
    """
    log = physics.body(diameter=0.3, length=15.0)
    scene = flat(barriers=barrier((20, -20), (20, 20), height=3.5), size=120.0, cell=1.0)
    fall = 0.5 * G * (35 / 24) ** 2
    assert fall == pytest.approx(10.431641, abs=1e-6)
    centre = (-(log[0, LENGTH] - log[0, CENTRE]), 0.0, 3.5 + fall + log[0, 0] + clearance)
    begin = physics.start(scene, log, (1, 0, 0), centre, velocity=(24, 0, 0))
    result = physics.run(scene, begin, fidelity="fine", time_limit=1.6)
    assert (result.barrier_hits[0] == 0) == passes
    assert result.barrier_crossed[0, 0]


def test_resting_against_a_barrier_does_not_seep_through(physics):
    """T54e: 60 s on a 35 degree slope against a barrier: held, certified, and not a millimetre further."""
    tangent = np.tan(np.radians(35))
    scene = physics.plane(tangent, cell=1.0, size=60.0, barriers=barrier((-50, -20), (50, -20)), friction=0.25)
    log = physics.body(diameter=0.4, length=10.0)
    begin = physics.lying(scene, log, tangent, 0.0, 90.0, centre=(0.0, -15.0))
    result = physics.run(scene, begin, time_limit=60.0, rest_speed=0.0)  # never certified: it must hold on its own
    assert STOP_REASONS[result.stop_reason[0]] == "time_limit"
    early = physics.run(scene, begin, time_limit=30.0, rest_speed=0.0)
    assert np.linalg.norm(result.end_position - early.end_position) < 1e-3
    held = physics.run(scene, begin)
    assert STOP_REASONS[held.stop_reason[0]] == "barrier"
    assert held.stop_item[0] == 0
    assert held.barrier_reached[0, 0]


def test_held_by_the_tree_that_holds(physics):
    """On a slope too steep for friction a log across two trees rests on them; stop_item names one of the two."""
    tangent = np.tan(np.radians(35))
    trees = Trees(np.array([30.0, -3.0, 3.0]), np.array([0.0, -20.0, -20.0]), np.full(3, 0.4), np.full(3, 20.0))
    scene = physics.plane(tangent, cell=1.0, size=60.0, trees=trees)
    log = physics.body(diameter=0.4, length=10.0)
    result = physics.run(scene, physics.lying(scene, log, tangent, 0.0, 90.0, centre=(0.0, -15.0)))
    assert STOP_REASONS[result.stop_reason[0]] == "tree"
    assert result.stop_item[0] in (1, 2)
    assert result.tree_hits[0] == 2
    assert result.penetration_max[0] < 0.02


def test_started_inside_a_tree_is_not_shot_away():
    """A log released overlapping a tree starts in contact with it and gains no speed that gravity did not give."""
    trees = Trees(np.array([0.2]), np.array([0.0]), np.array([0.6]), np.array([20.0]))
    scene = flat(trees=trees, friction=0.8)
    result = slide(scene, Logs.alike([0.0], [0.0]), FIDELITIES["standard"], time_limit=20.0)
    assert result.started_in_contact[0]
    assert result.speed_max[0] < 0.01
    far = slide(scene, Logs.alike([5.0], [0.0]), FIDELITIES["standard"], time_limit=1.0)
    assert not far.started_in_contact[0]


def test_absent_obstacles_change_nothing():
    """A scene with trees and barriers out of reach gives the bits of a scene without any."""
    rng = np.random.default_rng(0)
    heights = 0.7 * 0.5 * np.arange(160)[:, None] + 0.4 * rng.random((160, 160))
    far = Trees(np.array([78.0]), np.array([78.0]), np.array([0.5]), np.array([20.0]))
    logs = Logs.alike([20.0], [60.0], length=10.0)
    line = Lines(np.array([[0.0, 70.0], [5.0, 70.0]]), np.array([0, 2]))
    plain = slide(Scene.prepare(heights, 0.5, 0, 0, friction=0.25), logs, FIDELITIES["standard"])
    full = Scene.prepare(heights, 0.5, 0, 0, friction=0.25, trees=far, lines=line, barriers=barrier((75, 70), (75, 79)))
    assert np.array_equal(slide(full, logs, FIDELITIES["standard"]).last_state, plain.last_state)


def test_leaving_the_terrain():
    """Nodata is outside: the log ends there with left_dem, nothing is read as a height."""
    heights = np.tile(0.7 * 0.5 * np.arange(120)[:, None], (1, 60))
    heights[:40] = np.nan
    logs = Logs.alike([15.0], [50.0], length=6.0)
    result = slide(Scene.prepare(heights, 0.5, 0, 0, friction=0.1), logs, FIDELITIES["standard"])
    assert STOP_REASONS[result.stop_reason[0]] == "left_dem"
    # the first node row with terrain is at y = 20 m; a step at most farther
    assert 19.0 < result.end_position[0, 1] < 20.0
    assert result.speed_max[0] < np.sqrt(2 * G * 0.7 * 32)


@pytest.mark.parametrize("apart", [0.05, 0.3, 0.45, 0.6])
def test_standing_log_over_a_tree_starts_in_contact(apart):
    """Two vertical stems of 0.375 and 0.3 m radius overlap when their axes are closer than 0.675 m, however little."""
    trees = Trees(np.array([apart]), np.array([0.0]), np.array([0.6]), np.array([20.0]))
    scene = flat(trees=trees, friction=0.8)
    result = slide(scene, Logs.alike([0.0], [0.0]), FIDELITIES["standard"], time_limit=5.0)
    assert result.started_in_contact[0]
    assert result.speed_max[0] < 0.01
    clear = slide(scene, Logs.alike([-0.1 - 0.6 + apart], [0.0]), FIDELITIES["standard"], time_limit=1.0)
    assert not clear.started_in_contact[0]
