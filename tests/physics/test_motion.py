"""Flight, toppling, standing, statics and energy against closed forms and invariants."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from deadwood_engine import FIDELITIES, STOP_REASONS, Logs, Scene, slide
from deadwood_engine.log_body import AXIAL, TRANSVERSE

G = 9.81


@pytest.mark.parametrize("step", [1e-3, 1e-2, 0.1])
def test_projectile_is_exact_for_any_step(physics, step):
    """T06: the parabola to rounding, whatever the step; heights of 500 m keep 1e-13 of relative rounding."""
    scene, log = physics.plane(0.0), physics.body()
    begin = physics.start(scene, log, (1, 0, 0), (0, 0, 300.0), velocity=(20, 0, 10), spin=(0, 0, 0.1))
    result = physics.run(scene, begin, time_step=step, travel_cells=1e9, time_limit=2.0)
    t = result.duration[0]
    assert result.end_position[0] == pytest.approx((20 * t, 0, 300 + 10 * t - 0.5 * G * t**2), abs=1e-9)
    assert result.energy_error[0] < 1e-12


def test_dropped_flat(physics):
    """T15: a horizontal log dropped 5 m lands after 1.00964 s at 9.90454 m/s, and all of its energy is gone."""
    scene = physics.plane(0.0, cell=0.5, size=30.0)
    log = physics.body(taper=1.0)
    begin = physics.start(scene, log, (1, 0, 0), (0, 0, 5.375))
    result = physics.run(scene, begin)
    assert STOP_REASONS[result.stop_reason[0]] == "rest"
    # speeds are those of mid-steps, and the landing may take the last: a step and a half of gravity at most
    assert 9.90454 - 1.5 * FIDELITIES["standard"].time_step * G <= result.speed_max[0] <= 9.90454
    assert result.end_position[0] == pytest.approx((0, 0, 0.375), abs=2e-3)
    # predicted contact meets the ground: nothing sinks in, where first-touch detection would leave 10 cm
    assert result.penetration_max[0] < 1e-3


@pytest.mark.parametrize(("tilt", "stands"), [(0.0, True), (1.5, True), (2.2, False)])
def test_standing_log(physics, tilt, stands):
    """T39: it stands, rocks back below atan(R/zc) = 1.8224 degrees, and topples above (naive rest froze all three)."""
    scene = Scene.prepare(np.zeros((201, 201)), 0.5, -50.0, -50.0, friction=0.8)
    logs = Logs.alike([0.0], [0.0], orientation=2, tilt=np.radians(tilt), azimuth=0.3)
    result = slide(scene, logs, FIDELITIES["fine"], time_limit=60.0)
    upright = result.last_state[0, 15] > 0.99
    assert upright == stands
    # at 1.5 degrees it still rocks after a minute: an impact of the rim takes 0.14 % of the speed only (Housner)
    assert STOP_REASONS[result.stop_reason[0]] == ("time_limit" if tilt == 1.5 else "rest")


@pytest.mark.parametrize(
    ("fidelity", "tolerance"), [("draft", 0.008), ("standard", 0.005), ("fine", 0.001), ("reference", 0.0003)]
)
def test_toppling_about_the_rim(physics, fidelity, tolerance):
    """T37: a log tilted 5 degrees on the flat, held by friction, pivots about its rim: theta'' = m g b sin(theta) / I.

    At any tilt the spin follows from energy, theta'^2 = 2 m g b (cos(theta_0) - cos(theta)) / I; the time of landing is
    that of the pendulum integrated to 1e-12. The spin of a pose is the mean of a step, so at a node it lies between
    those of the steps before and after. The scheme is of order one: measured errors of the spin, from a third of its
    largest value on, are 0.60, 0.41, 0.08 and 0.02 %, and those allowed fall with them.
    """
    scene = Scene.prepare(np.zeros((401, 401)), 0.5, -100.0, -100.0, friction=1000.0)
    log = physics.body()
    radius, zc, transverse = log[0, 0], log[0, 3], log[0, 4]
    arm = np.hypot(radius, zc)
    lean = np.arctan(radius / zc)  # of the line from the rim to the centre when the log stands upright
    inertia = transverse + arm**2
    begin_angle = np.radians(5.0) - lean

    def pendulum(_, s):
        return [s[1], G * arm * np.sin(s[0]) / inertia]

    def tip_touches(_, s):
        # the lowest point of the tip's rim reaches the ground
        tilt = s[0] + lean
        return radius * np.sin(tilt) + log[0, 2] * np.cos(tilt) - log[0, 1] * np.sin(tilt)

    tip_touches.terminal = True  # type: ignore[attr-defined]  # as solve_ivp wants it
    solution = solve_ivp(pendulum, (0, 20), [begin_angle, 0.0], rtol=1e-12, atol=1e-12, events=tip_touches)
    assert solution.t[-1] == pytest.approx(5.432956, abs=1e-4)  # docs/tests.md, T37
    logs = Logs.alike([0.0], [0.0], orientation=2, tilt=np.radians(5.0))
    result = slide(
        scene, logs, FIDELITIES[fidelity]._replace(trace_cells=1e-3), keep_poses=np.ones(1, bool), time_limit=7.0
    )
    poses = result.poses
    lands = int(np.argmax(poses.spin))
    axis = (poses.tip - poses.base)[:lands]
    angle = np.arctan2(np.hypot(axis[:, 0], axis[:, 1]), axis[:, 2]) - lean
    spin = 0.5 * (poses.spin[:lands] + poses.spin[1 : lands + 1])
    exact = np.sqrt(np.maximum(0.0, 2.0 * G * arm * (np.cos(begin_angle) - np.cos(angle)) / inertia))
    fast = exact > solution.y[1, -1] / 3.0
    assert fast.sum() > 20
    assert spin[fast] == pytest.approx(exact[fast], rel=tolerance)
    assert poses.time[lands] == pytest.approx(solution.t[-1], rel=0.001, abs=FIDELITIES[fidelity].time_step)


def rough(seed=0, rows=160, columns=120, cell=0.5, tangent=0.7):
    rng = np.random.default_rng(seed)
    noise = rng.random((rows, columns)) * 0.4
    return tangent * cell * np.arange(rows)[:, None] + noise


@pytest.mark.parametrize("seed", range(8))
def test_energy_is_accounted_for_and_never_gained(seed):
    """T61, T62: contacts' work plus gravity's explains all change of energy to rounding, and contacts only take.

    A contact that separates within a step and is pushed by gravity may give m (g dt)^2 / 8 a step (docs/tests.md);
    the gain of a run is compared with that bound, and with a hundredth of the energy spent.
    """
    scene = Scene.prepare(rough(seed), 0.5, 0.0, 0.0, friction=0.25)
    logs = Logs.alike(np.full(6, 30.0) + np.arange(6), np.full(6, 60.0), length=12.0, diameter=0.4)
    fidelity = FIDELITIES["standard"]
    result = slide(scene, logs, fidelity, time_limit=60.0)
    drop = result.release_position[:, 2] - result.end_position[:, 2]
    allowed = result.steps * (G * fidelity.time_step) ** 2 / 8 / (G * np.maximum(drop, 1.0))
    assert np.all(result.energy_error < 1e-10 + np.minimum(allowed, 0.01))


@pytest.mark.parametrize("fidelity", ["standard", "fine"])
def test_unit_quaternion_and_axis(fidelity):
    scene = Scene.prepare(rough(3), 0.5, 0.0, 0.0, friction=0.25)
    result = slide(scene, Logs.alike([30.0], [60.0], length=12.0, speed=5.0), FIDELITIES[fidelity])
    state = result.last_state[0]
    assert np.linalg.norm(state[3:7]) == pytest.approx(1.0, abs=1e-14)
    assert np.linalg.norm(state[13:16]) == pytest.approx(1.0, abs=1e-13)


def test_same_history_wherever_the_slope_lies():
    """T70: shifted by an LV95 offset, or cut from a larger DEM, a log's history is the same to the bit.

    All numbers of the scene are multiples of 1/64 m, so that adding the offset loses nothing.
    """
    heights = np.round(rough(5) * 64) / 64
    release = Logs.alike([30.25], [60.5], length=12.0)
    ends = []
    for x0, y0 in ((0.0, 0.0), (2_700_000.0, 1_200_000.0), (1e7, -1e7)):
        scene = Scene.prepare(heights, 0.5, x0, y0, friction=0.25)
        shifted = Logs.alike(release.x + x0, release.y + y0, length=12.0)
        ends.append(slide(scene, shifted, FIDELITIES["standard"]))
    padded = np.pad(heights, ((30, 20), (11, 9)), constant_values=np.nan)
    scene = Scene.prepare(padded, 0.5, -5.5, -15.0, friction=0.25)
    ends.append(slide(scene, release, FIDELITIES["standard"]))
    for end in ends[1:]:
        assert np.array_equal(end.last_state, ends[0].last_state)
        assert end.duration == ends[0].duration


@pytest.mark.parametrize("turn", ["mirror x", "mirror y", "swap"])
def test_mirrored_slope_mirrors_the_history(turn):
    """T72: bilinear terrain prefers no direction. One second, before rounding (1e-16) has grown visible."""
    heights = rough(7)
    log = Logs.alike([29.3], [55.7], length=12.0)
    top = np.array([heights.shape[1] - 1, heights.shape[0] - 1]) * 0.5
    if turn == "mirror x":
        other, x, y = heights[:, ::-1], top[0] - log.x, log.y
    elif turn == "mirror y":
        other, x, y = heights[::-1], log.x, top[1] - log.y
    else:
        other, x, y = heights.T, log.y, log.x
    options = {"time_limit": 2.0}
    one = slide(Scene.prepare(heights, 0.5, 0, 0, friction=0.25), log, FIDELITIES["standard"], **options)
    two = slide(
        Scene.prepare(np.ascontiguousarray(other), 0.5, 0, 0, friction=0.25),
        Logs.alike(x, y, length=12.0),
        FIDELITIES["standard"],
        **options,
    )
    a, b = one.end_position[0], two.end_position[0]
    expected = {"mirror x": (top[0] - a[0], a[1]), "mirror y": (a[0], top[1] - a[1]), "swap": (a[1], a[0])}[turn]
    assert np.linalg.norm(one.release_position[0] - a) > 0.5, "the log has not moved: the test shows nothing"
    assert b == pytest.approx((*expected, a[2]), abs=1e-6)


def test_threads_and_order_do_not_matter():
    """T74: 1 or 3 threads, permuted logs, cut in pieces: the same bits for every log and raster."""
    from deadwood_engine import Rasters, Trees

    rng = np.random.default_rng(1)
    trees = Trees(rng.uniform(5, 55, 60), rng.uniform(5, 50, 60), np.full(60, 0.4), np.full(60, 20.0))
    scene = Scene.prepare(rough(2), 0.5, 0.0, 0.0, friction=0.25, trees=trees)
    logs = Logs.alike(25 + 10 * rng.random(40), 60 + 10 * rng.random(40), length=10.0, diameter=0.3)
    one_rasters, many_rasters = Rasters.allocate(scene, 1), Rasters.allocate(scene, 3)
    one = slide(scene, logs, FIDELITIES["draft"], threads=1, rasters=one_rasters)
    order = rng.permutation(40)
    parts = [
        slide(scene, logs.take(order[:13]), FIDELITIES["draft"], threads=3, rasters=many_rasters),
        slide(scene, logs.take(order[13:]), FIDELITIES["draft"], threads=2, rasters=many_rasters),
    ]
    many = np.vstack([part.last_state for part in parts])
    assert np.array_equal(many, one.last_state[order])
    for name, total in one_rasters.totals().items():
        assert np.array_equal(total, many_rasters.totals()[name], equal_nan=True), name


@pytest.mark.parametrize("fidelity", list(FIDELITIES))
def test_free_flight_is_that_of_the_textbook(physics, fidelity):
    """Thrown and tumbling for 3 s: the centre on its parabola, the axis about a momentum that stays.

    Heights of 200 m round by 3e-14 a step, some hundred of them. A round body whose momentum L is fixed turns its axis
    about L at |L| / A, and keeps its angle to it: the axis after any time is a rotation of the first.
    """
    scene, log = physics.plane(0.0), physics.body()
    axis, spin = np.array([0.6, 0.0, 0.8]), np.array([0.3, -0.5, 0.9])
    begin = physics.start(scene, log, axis, (0, 0, 200.0), velocity=(5, -3, 10), spin=spin)
    result = physics.run(scene, begin, fidelity=fidelity, time_limit=3.0)
    t = result.duration[0]
    assert result.end_position[0] == pytest.approx((5 * t, -3 * t, 200 + 10 * t - 0.5 * G * t**2), abs=2e-11)
    along = spin @ axis
    momentum = log[0, TRANSVERSE] * (spin - along * axis) + log[0, AXIAL] * along * axis
    about, angle = momentum / np.linalg.norm(momentum), np.linalg.norm(momentum) / log[0, TRANSVERSE] * t
    turned = axis * np.cos(angle) + np.cross(about, axis) * np.sin(angle) + about * (about @ axis) * (1 - np.cos(angle))
    assert result.last_state[0, 13:16] == pytest.approx(turned, abs=1e-10)
