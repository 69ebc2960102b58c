"""Sliding, sticking, braking and rolling on planes, against closed forms.

Heights are float32: at cells of 10 m and heights below 512 m a plane is wrong by at most 1.5e-5 m at a node, so its
slope by 3e-6 and speeds by about 1e-5 of themselves. Where a plane's heights are exact in binary, so are the tests.
Velocities are those of the middle of a step, positions of its end (leapfrog), so a speed is compared with
the closed form half a step before the end.
"""

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, STOP_REASONS, Logs, Scene, Trees, place_logs, slide
from deadwood_engine.limits import ROCKING_RANGE
from deadwood_engine.log_body import AXIAL, CENTRE, LENGTH, TRANSVERSE

G = 9.81
AZIMUTHS = [0, 17, 45, 90, 133, 200, 301]


def reason(result):
    return STOP_REASONS[result.stop_reason[0]]


def middle(result, fidelity="standard"):
    """Time [s] to which the last velocities belong."""
    return result.duration[0] - 0.5 * FIDELITIES[fidelity].time_step


@pytest.mark.parametrize("azimuth", AZIMUTHS)
@pytest.mark.parametrize("heading", [0.0, 180.0])
def test_sliding_along_the_fall_line(physics, azimuth, heading):
    """T17: a = g (sin - mu cos), whichever way the slope faces, tip first or base first, whatever touches."""
    tangent = np.tan(np.radians(35))
    scene, log = physics.plane(tangent, azimuth), physics.body()
    # so long a way that all steps are equal: the last speed is that of half of one before the end
    result = physics.run(scene, physics.lying(scene, log, tangent, azimuth, heading), time_limit=4.0, travel_cells=3.0)
    sine, cosine = np.sin(np.arctan(tangent)), np.cos(np.arctan(tangent))
    a, t = G * (sine - 0.25 * cosine), result.duration[0]
    assert result.speed_max[0] == pytest.approx(a * middle(result), rel=2e-5)
    moved = result.end_position[0] - result.release_position[0]
    assert np.linalg.norm(moved) == pytest.approx(0.5 * a * t**2, rel=2e-5)
    east, north = np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))
    # isotropy: no drift off the fall line beyond what the rounding of the plane tilts it (3e-6 of 29 m, ten times)
    assert abs(moved[0] * north - moved[1] * east) < 1e-3
    assert result.penetration_max[0] < 1e-3  # 10 ms of gravity's approach is 1 mm


@pytest.mark.parametrize("fidelity", ["draft", "standard", "fine", "reference"])
def test_every_fidelity_slides_right(physics, fidelity):
    """On a plane with binary-exact heights (tan = 0.75) the scheme is exact for any step."""
    scene, log = physics.plane(0.75), physics.body()
    result = physics.run(
        scene, physics.lying(scene, log, 0.75, 0.0, 0.0), fidelity=fidelity, time_limit=3.0, tolerance=1e-9,
        travel_cells=3.0,
    )  # fmt: skip
    assert result.speed_max[0] == pytest.approx(G * (0.6 - 0.25 * 0.8) * middle(result, fidelity), rel=1e-7)
    # the first node alone pushes against half a step of gravity: (g dt)^2 / 8, of the energy of the way down
    drop = result.release_position[0, 2] - result.end_position[0, 2]
    step = FIDELITIES[fidelity].time_step
    assert result.energy_error[0] < (G * step) ** 2 / 8 / (G * drop) + 1e-12


@pytest.mark.parametrize(("above", "moves"), [(1 + 1e-4, False), (1 - 1e-4, True), (0.999, True), (0.99, True)])
def test_threshold_of_sliding(physics, above, moves):
    """T16: mu a hair above tan(psi) holds for ever, a hair below slides by 1/2 g (sin - mu cos) t^2, however slowly."""
    scene, log = physics.plane(0.75, friction=0.75 * above), physics.body()
    result = physics.run(scene, physics.lying(scene, log, 0.75, 0.0, 0.0), time_limit=10.0, tolerance=1e-6)
    distance = np.linalg.norm(result.end_position[0] - result.release_position[0])
    if moves:
        assert reason(result) == "time_limit"
        # the start settles by up to half a millimetre (HOVER)
        assert distance == pytest.approx(0.5 * G * 0.6 * (1 - above) * result.duration[0] ** 2, rel=0.02, abs=1e-3)
    else:
        assert reason(result) == "rest"
        assert distance < 1e-3


@pytest.mark.parametrize("heading", [0.0, 37.0])
def test_braking_on_the_flat(physics, heading):
    """T18, T19: s = v0^2 / (2 mu g), in any direction of the grid; the last partial step stops and does not reverse."""
    scene, log = physics.plane(0.0), physics.body()
    begin = physics.lying(scene, log, 0.0, 0.0, heading, centre=(0.0, 150.0), along=20.0)
    result = physics.run(scene, begin, tolerance=1e-6)
    assert reason(result) == "rest"
    # half a step at most is lost at the stop: mu g dt^2 / 8 = 3e-5 m
    assert result.path[0] == pytest.approx(20.0**2 / (2 * 0.25 * G), abs=1e-3)
    assert np.linalg.norm((result.end_position - result.release_position)[0]) == pytest.approx(81.549439, abs=1e-3)


def test_frictionless_keeps_its_spin(physics):
    """T25: mu = 0: a = g sin, spin untouched."""
    scene, log = physics.plane(0.75, friction=0.0), physics.body()
    result = physics.run(scene, physics.lying(scene, log, 0.75, 0.0, 0.0, spin=10.0), time_limit=3.0, travel_cells=3.0)
    assert result.speed_max[0] == pytest.approx(G * 0.6 * middle(result), rel=1e-9)
    w, d = result.last_state[0, 10:13], result.last_state[0, 13:16]
    assert w @ d == pytest.approx(10.0, rel=1e-9)


@pytest.mark.parametrize(
    ("mu", "linear", "angular"),
    [
        (0.30, 2 / 3 * G * 0.6, 2 / 3 * G * 0.6),  # rolls: needs mu >= tan/3 = 0.25
        (0.20, G * (0.6 - 0.2 * 0.8), 2 * 0.2 * G * 0.8),  # slips and spins up
    ],
)
def test_cylinder_across_the_slope(physics, mu, linear, angular):
    """T27, T28: a cylinder rolls at 2/3 g sin, or slips at g (sin - mu cos) while R alpha = 2 mu g cos."""
    scene = physics.plane(0.75, friction=mu)
    log = physics.body(diameter=0.5, length=10.0, taper=1.0)
    begin = physics.lying(scene, log, 0.75, 0.0, 90.0)
    result = physics.run(scene, begin, time_limit=2.0, tolerance=1e-6, travel_cells=3.0, roll_angle=9.0)
    t = middle(result)
    assert result.speed_max[0] == pytest.approx(linear * t, rel=1e-3)
    w, d = result.last_state[0, 10:13], result.last_state[0, 13:16]
    assert abs(w @ d) * 0.25 == pytest.approx(angular * t, rel=1e-3)


def test_thrown_sideways_ends_rolling(physics):
    """T30: thrown across its axis at 15 m/s a cylinder rolls at 10 m/s, from v0 / (3 mu g) on."""
    scene = physics.plane(0.0)
    log = physics.body(diameter=0.5, length=10.0, taper=1.0)
    begin = physics.lying(scene, log, 0.0, 0.0, 90.0, across=15.0)
    result = physics.run(scene, begin, time_limit=2.5, tolerance=1e-6)
    assert np.linalg.norm(result.last_state[0, 7:10]) == pytest.approx(10.0, rel=1e-3)
    w, d = result.last_state[0, 10:13], result.last_state[0, 13:16]
    assert abs(w @ d) * 0.25 == pytest.approx(10.0, rel=1e-3)


@pytest.mark.parametrize("fidelity", list(FIDELITIES))
@pytest.mark.parametrize("speed", [2.0, 8.0, 12.0])
def test_a_cone_rolls_about_its_apex(physics, speed, fidelity):
    """T34: without slip its angular velocity lies along the line of contact, v / h; it turns about the apex with v/rho.

    The error is that of the angle by which it rolls in a step (``Fidelity.roll_angle``): with no limit but 70 ms and
    0.8 m it loses 0.8 % of its speed at 8 m/s and 1.4 % at 12 m/s, in six seconds.
    """
    scene, log = physics.plane(0.0, friction=0.6), physics.body(diameter=0.6, length=20.0)
    begin = physics.lying(scene, log, 0.0, 0.0, 0.0)
    axis = begin.state[0, 13:16].copy()
    line = np.array([axis[0], axis[1], 0.0]) / np.hypot(axis[0], axis[1])
    height = begin.state[0, 2] + scene.arrays.terrain.reference
    begin.state[0, 10:13] = speed / height * line
    begin.state[0, 7:10] = np.cross(begin.state[0, 10:13], (0.0, 0.0, height))
    result = physics.run(scene, begin, fidelity=fidelity, time_limit=6.0)
    base, tip, length, centre = log[0, 0], log[0, 1], log[0, LENGTH], log[0, CENTRE]
    # of the foot of the centre of mass on the line of contact, from the apex
    rho = (length * base / (base - tip) - centre) * np.sqrt(1.0 - ((base - tip) / length) ** 2)
    end = result.last_state[0, 13:16]
    turned = np.arctan2(axis[0] * end[1] - axis[1] * end[0], axis[0] * end[0] + axis[1] * end[1])
    assert abs(turned) == pytest.approx(speed / rho * result.duration[0], rel=0.003)
    assert np.linalg.norm(result.last_state[0, 7:10]) == pytest.approx(speed, rel=0.003)


def test_mass_does_not_matter(physics):
    """T26: density is bitwise irrelevant to the motion."""
    rng = np.random.default_rng(0)
    heights = 0.7 * 2 * np.arange(60)[:, None] + rng.random((60, 40))
    ends = []
    for density in (1.0, 7.0, 300.0, 25_000.0):
        scene = Scene.prepare(heights, 2.0, 0.0, 0.0, friction=0.25)
        logs = Logs.alike([40.0], [90.0], density=density)
        ends.append(slide(scene, logs, FIDELITIES["standard"], time_limit=20.0).last_state)
    assert all(np.array_equal(ends[0], end) for end in ends[1:])


@pytest.mark.parametrize(("mu", "kept"), [(0.0, 0.8), (0.25, 0.8 - 0.25 * 0.6)])
@pytest.mark.parametrize("fidelity", ["draft", "standard", "reference"])
def test_kink_takes_the_normal_velocity(physics, mu, kept, fidelity):
    """T22: at a concave kink a sliding body keeps cos(delta) - mu sin(delta) of its speed, at any step.

    With an inertia that permits no rotation a log is a point mass; the loss at a kink is the model's, not the step's.
    """
    y = np.arange(-400.0, 401.0, 10.0)
    heights = np.where(y > 0, 0.75 * y, 0.0)[:, None] * np.ones(81)[None, :]
    scene = Scene.prepare(heights, 10.0, -400.0, -400.0, friction=mu)
    log = physics.body(diameter=0.2, length=0.4, taper=0.999)
    log[0, [TRANSVERSE, AXIAL]] = 1e15
    begin = physics.lying(scene, log, 0.75, 0.0, 0.0, centre=(0.0, 30.0))
    result = physics.run(
        scene, begin, fidelity=fidelity, time_limit=20.0, keep_poses=np.ones(1, bool), tolerance=1e-6, trace_cells=0.01
    )
    ahead = 0.5 * 0.4 * 0.8  # its front is on the flat when its centre is this far from the kink
    arrival = np.sqrt(2 * G * (0.6 - mu * 0.8) * (30.0 - ahead) / 0.8)
    y, speed = result.poses.position[:, 1], result.poses.speed
    after = speed[np.argmax(y < -1.0)]
    since = -1.0 - ahead  # friction on the flat since the kink
    # The kink is felt up to a step's travel ahead, which then is not fallen, and friction acts until the pose looked
    # at, which is as far behind. Each changes the speed by that travel's share of g, over the speed.
    step = FIDELITIES[fidelity].time_step
    assert after == pytest.approx(np.sqrt((kept * arrival) ** 2 + 2 * mu * G * since), rel=0.002, abs=0.6 * G * step)


@pytest.mark.parametrize("fidelity", list(FIDELITIES))
def test_without_friction_the_spin_about_the_axis_stays(physics, fidelity):
    """No push along a normal turns a round body about its axis: on bumps, against stems, at any candidate point.

    Candidates beside a ring's deepest point had such a lever; a spinning end bored itself in by up to 25 cm.
    """
    rng = np.random.default_rng(3)
    heights = 0.5 * np.arange(120)[:, None] + 0.3 * rng.random((120, 80))
    trees = Trees(rng.uniform(5, 75, 40), rng.uniform(5, 80, 40), np.full(40, 0.5), np.full(40, 20.0))
    scene = Scene.prepare(heights, 1.0, 0.0, 0.0, friction=0.0, trees=trees)
    begin = place_logs(scene, Logs.alike(rng.uniform(25, 55, 12), np.full(12, 100.0), length=10.0, drop=0.5))
    begin.state[:, 10:13] = 3.0 * begin.state[:, 13:16]
    result = slide(scene, begin, FIDELITIES[fidelity], time_limit=5.0, rolling_friction=0.0)
    state = result.last_state
    assert result.cost["contacts"] > 100
    assert result.tree_hits.sum() > 3
    spin = (state[:, 10:13] * state[:, 13:16]).sum(axis=1)
    assert spin == pytest.approx(3.0, abs=1e-9)
    assert result.penetration_max.max() < 0.3


@pytest.mark.parametrize("spacing", [2.0, 0.5, 0.1])
@pytest.mark.parametrize("fidelity", ["draft", "standard", "fine", "reference"])
@pytest.mark.parametrize("azimuth", [90.0, 60.0])
def test_a_log_rides_over_crests(physics, azimuth, fidelity, spacing):
    """Lengthwise over level ridges, without friction: only their crests touch, square to its way, so it keeps its
    speed, however dense its rings are.

    Rings that take the flanks' normals are the teeth of a cogwheel: of 5 m/s they left this log 0.01 to 1, or turned it
    along the ridges. Two per cent: the log sinks by a millimetre, and its end ahead strikes that much of 13 flanks.
    """
    heights = np.zeros((161, 161))
    heights[:, ::3] = 0.1  # a ridge every 1.5 m, its flanks rise by 0.2
    scene = Scene.prepare(heights, 0.5, -40.0, -40.0, friction=0.0)
    axis = np.array([np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth)), 0.0])
    solid = physics.body(0.4, 9.0, taper=1.0)
    begin = physics.start(scene, solid, axis, (-15.0, 0.0, 0.1 + 0.2), velocity=5.0 * axis)
    result = physics.run(scene, begin, fidelity=fidelity, time_limit=4.0, station_spacing=spacing, spacing_cells=1e9)
    assert result.last_state[0, 7:9] @ axis[:2] == pytest.approx(5.0, rel=0.02)
    assert abs(result.end_position[0, 2] - result.release_position[0, 2]) < 0.02


def height_after_swings(x, nodes, heights, swings):
    """Height [m] to which a frictionless bead climbs after a number of swings, on a chain of straight pieces.

    Energy from kink to kink, and the cosine of its angle times the speed at each: independent of the engine.
    """
    slope = np.diff(heights) / np.diff(nodes)
    piece = np.searchsorted(nodes, x) - 1
    z = heights[piece] + slope[piece] * (x - nodes[piece])
    for _ in range(swings):
        energy, way = 0.0, -1 if slope[piece] > 0 else 1
        while True:
            corner = piece + (way > 0)
            if energy + G * (z - heights[corner]) < 0.0:
                break  # it turns on this piece
            energy += G * (z - heights[corner])
            z, piece = heights[corner], piece + way
            energy *= np.cos(np.arctan(slope[piece]) - np.arctan(slope[piece - way])) ** 2
        z += energy / G
    return z


@pytest.mark.parametrize("fidelity", ["draft", "standard", "fine", "reference"])
def test_a_log_swings_in_a_hollow(physics, fidelity):
    """Broadside to and fro for 40 s without friction: only the DEM's kinks take energy, at any step.

    Contacts whose push works while their plane turns leave 45 % (draft), 70 %, 87 % and 92 % of the height where
    the kinks leave 94 %. Two per cent: a step of 70 ms meets a kink up to 0.2 m from where it is, and steps of 1 ms
    meet 144 kinks some 0.04 mm deep.
    """
    nodes = np.arange(-20.0, 20.25, 0.5)
    heights, x, radius = nodes**2 / 40.0, 4.25, 0.2
    scene = Scene.prepare(np.tile(heights, (81, 1)), 0.5, -20.0, -20.0, friction=0.0)
    up = np.array([-(heights[49] - heights[48]), 0.5])
    centre = np.array([x, np.interp(x, nodes, heights)]) + radius * up / np.linalg.norm(up)
    begin = physics.start(scene, physics.body(2 * radius, 9.0, taper=1.0), (0, 1, 0), (centre[0], 0.0, centre[1]))
    result = physics.run(
        scene, begin, fidelity=fidelity, time_limit=43.0, rest_speed=1e-6, keep_poses=np.ones(1, bool),
        trace_cells=0.01, tolerance=1e-5,
    )  # fmt: skip
    late = np.abs(result.poses.time - 9 * np.pi * np.sqrt(20.0 / G)) < 1.0
    left = result.poses.position[late, 2].max() - centre[1] + np.interp(x, nodes, heights)
    assert left == pytest.approx(height_after_swings(x, nodes, heights, 9), rel=0.02)


@pytest.mark.parametrize("fidelity", ["draft", "standard", "fine"])
def test_a_log_in_a_hollow_rests_there(physics, fidelity):
    """Broadside in a trough, a third of a metre off its bottom: unwatched it rolls on to the end, watched it rests.

    What it does afterwards stays in the box: its centre never leaves the metre.
    """
    x = np.arange(-20.0, 20.25, 0.5)
    scene = Scene.prepare(np.tile(x**2 / 8.0, (81, 1)), 0.5, -20.0, -20.0, friction=0.4)
    begin = physics.start(scene, physics.body(0.4, 9.0, taper=1.0), (0, 1, 0), (0.35, 0.0, 0.25))
    watched = physics.run(scene, begin, fidelity=fidelity, time_limit=120.0)
    assert STOP_REASONS[watched.stop_reason[0]] == "rest"
    assert watched.duration[0] < 15.0
    endless = physics.run(
        scene, begin, fidelity=fidelity, time_limit=120.0, rest_speed=1e-9, keep_poses=np.ones(1, bool),
        trace_cells=0.02,
    )  # fmt: skip
    assert STOP_REASONS[endless.stop_reason[0]] == "time_limit"
    late = endless.poses.time >= watched.duration[0]
    away = np.abs(endless.poses.position[late, :2] - watched.end_position[0, :2]).max()
    assert 0.01 < away < ROCKING_RANGE
