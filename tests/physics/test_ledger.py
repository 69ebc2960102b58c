"""The ledger of hits: impulse, energy, height and angle of shots with known answers; balances; one hit an episode."""

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, Barriers, Logs, Scene, Trees, slide
from deadwood_engine.limits import HIT_PAUSE
from deadwood_engine.log_body import CENTRE, LENGTH, MASS, TRANSVERSE

G = 9.81
EVERY = pytest.mark.parametrize("fidelity", list(FIDELITIES))


def flat(*, size=60.0, cell=1.0, friction=0.0, **parts):
    count = int(2 * size / cell) + 1
    return Scene.prepare(np.zeros((count, count)), cell, -size, -size, friction=friction, **parts)


def stems(*places, diameter=0.4):
    x, y = np.array(places, float).T
    return Trees(x, y, np.full(len(x), diameter), np.full(len(x), 1e4))


def plates(*lines, height=30.0):
    vertices = np.vstack([np.array(line, float) for line in lines])
    return Barriers(vertices, 2 * np.arange(len(lines) + 1), np.full(len(lines), height))


def kinetic(log, state):
    v, w, d = state[7:10], state[10:13], state[13:16]
    along = w @ d
    return 0.5 * (v @ v + log[0, TRANSVERSE] * (w @ w - along**2) + log[0, 5] * along**2)


@EVERY
@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_a_head_on_hit_of_a_stem_passes_on_the_momentum(physics, fidelity, restitution):
    """On the axis: impulse m (1 + e) v, energy taken m v^2 (1 - e^2) / 2, square on, at the moment of touching.

    Face and stem meet along a line; the engine takes its one end, a tip radius off the axis: 1e-3 is twice a^2/k^2.
    """
    scene = flat(trees=stems((30.0, 0.0)))
    log = physics.body()
    begin = physics.start(scene, log, (1, 0, 0), (0.0, 0.0, 20.0), velocity=(20, 0, 0))
    result = physics.run(scene, begin, fidelity=fidelity, time_limit=1.0, gravity=0.0, restitution=restitution)
    hits, mass = result.hits, log[0, MASS]
    assert (hits.log_row.tolist(), hits.item.tolist(), hits.by_barrier.tolist()) == ([0], [0], [False])
    assert hits.impulse[0] == pytest.approx(mass * (1 + restitution) * 20, rel=1e-3)
    assert hits.energy[0] == pytest.approx(0.5 * mass * 400, rel=1e-9)
    assert hits.energy_taken[0] == pytest.approx(
        0.5 * mass * 400 * (1 - restitution**2), rel=1e-3, abs=1e-3 * 400 * mass
    )
    assert hits.speed[0] == pytest.approx(20)
    assert hits.angle[0] == pytest.approx(0.0, abs=2e-5)  # the stem's own taper is 1e-5
    # the stem's face at the height of the log, and when the tip comes there; Newton's law is met up to a step early
    front, face = log[0, LENGTH] - log[0, CENTRE], 30.0 - 0.2 * (1 - 0.5 * 20 / 1e4)
    early = 0.0 if restitution == 0.0 else FIDELITIES[fidelity].time_step
    assert (face - front) / 20 - early - 1e-6 <= hits.time[0] <= (face - front) / 20 + 1e-6
    assert hits.place[0, :2] == pytest.approx([face, 0.0], abs=0.001 + 20 * early)
    assert abs(hits.place[0, 2] - 20.0) <= log[0, 1] + 1e-6
    assert hits.height[0] == pytest.approx(hits.place[0, 2], abs=1e-9)


@EVERY
@pytest.mark.parametrize("degrees", [0.0, 30.0, 60.0])
def test_a_plate_takes_the_momentum_square_to_it(physics, fidelity, degrees):
    """A cylinder broadside, without friction: stopped square to the plate (both ends, one hit), not along it."""
    scene = flat(barriers=plates([(20, -59), (20, 59)]), cell=30.0)  # one piece: no joints
    log = physics.body(diameter=0.4, length=10.0, taper=1.0)
    turn = np.radians(degrees)
    velocity = 12 * np.array([np.cos(turn), np.sin(turn), 0.0])
    begin = physics.start(scene, log, (0, 1, 0), (18.0, -15.0, 10.0), velocity=velocity)
    result = physics.run(scene, begin, fidelity=fidelity, time_limit=1.5, gravity=0.0)
    hits, mass = result.hits, log[0, MASS]
    assert hits.by_barrier.tolist() == [True]
    assert hits.angle[0] == pytest.approx(turn, abs=1e-6)
    assert hits.impulse[0] == pytest.approx(mass * velocity[0], rel=1e-6)
    assert hits.place[0, 0] == pytest.approx(20.0, abs=1e-6)
    assert hits.time[0] == pytest.approx((2.0 - log[0, 0]) / velocity[0], abs=1e-6)
    lost = mass * (kinetic(log, begin.state[0]) - kinetic(log, result.last_state[0]))
    assert hits.energy_taken[0] == pytest.approx(lost, rel=1e-9)


@pytest.mark.parametrize("fidelity", ["standard", "reference"])
def test_height_energy_and_angle_of_a_flight_into_a_plate(physics, fidelity):
    """A parabola: the tip arrives at t = distance / v, fallen by g t^2 / 2, with the energy of the fall."""
    scene = flat(barriers=plates([(30, -30), (30, 30)], height=8.0))
    log = physics.body(diameter=0.3, length=6.0)
    front = log[0, LENGTH] - log[0, CENTRE]
    begin = physics.start(scene, log, (1, 0, 0), (0.0, 0.0, 12.0), velocity=(24, 0, 0))
    hits = physics.run(scene, begin, fidelity=fidelity, time_limit=1.3).hits
    t = (30 - front) / 24
    assert hits.time[0] == pytest.approx(t, abs=1e-6)
    axis = 12.0 - 0.5 * G * t**2
    step = FIDELITIES[fidelity].time_step  # the node before the touch, where speed and energy are taken
    assert hits.energy[0] / log[0, MASS] == pytest.approx(0.5 * 24**2 + G * (12.0 - axis), abs=G**2 * t * step)
    assert hits.angle[0] == pytest.approx(np.arctan2(G * t, 24), abs=G * step / 24)
    assert axis - log[0, 1] - 0.02 <= hits.height[0] <= axis + log[0, 1] + 0.02


def test_what_all_hits_took_is_what_the_log_lost(physics):
    """Shots into a stand of stems, with friction and spin, in the air: the works of the hits add up to the loss."""
    rng = np.random.default_rng(3)
    x, y = rng.uniform(10, 50, 120), rng.uniform(-20, 20, 120)
    scene = flat(trees=stems(*zip(x, y, strict=True)), friction=0.4)
    log = physics.body(diameter=0.4, length=12.0)
    for seed in range(6):
        draw = np.random.default_rng(seed)
        axis = [*draw.normal(size=2), 0.2]
        begin = physics.start(scene, log, axis, (0, 0, 30), velocity=(25, draw.uniform(-5, 5), 0), spin=(0, 1, 2))
        result = physics.run(scene, begin, time_limit=4.0, gravity=0.0)
        lost = log[0, MASS] * (kinetic(log, begin.state[0]) - kinetic(log, result.last_state[0]))
        assert len(result.hits.time) >= 2
        assert result.hits.energy_taken.sum() == pytest.approx(lost, rel=1e-9)
        assert len(set(result.hits.item.tolist())) == result.tree_hits[0]


def test_one_stem_one_balance(physics):
    """Off centre, oblique, with friction: the impulse is the change of momentum, whatever way it points."""
    scene = flat(trees=stems((10.0, 1.5)), friction=0.6)
    log = physics.body(diameter=0.4, length=12.0)
    begin = physics.start(scene, log, (0.3, 1, 0), (0, 0, 30), velocity=(15, 4, 0), spin=(0, 0.5, 0))
    result = physics.run(scene, begin, time_limit=1.2, gravity=0.0)
    assert len(result.hits.time) == 1
    change = result.last_state[0, 7:10] - begin.state[0, 7:10]
    assert result.hits.impulse[0] == pytest.approx(log[0, MASS] * np.linalg.norm(change), rel=1e-9)


def test_leaning_is_no_blow(physics):
    """Held against two stems on a steep slope: another minute of leaning adds nothing to what they were struck."""
    tangent = np.tan(np.radians(35))
    trees = Trees(np.array([-3.0, 3.0]), np.array([-20.0, -20.0]), np.full(2, 0.4), np.full(2, 20.0))
    scene = physics.plane(tangent, cell=1.0, size=60.0, trees=trees)
    log = physics.body(diameter=0.4, length=10.0)
    begin = physics.lying(scene, log, tangent, 0.0, 90.0, centre=(0.0, -15.0))
    short, long = (physics.run(scene, begin, time_limit=t, rest_speed=0.0).hits for t in (20.0, 80.0))
    assert np.array_equal(short.impulse, long.impulse)
    # each held episode lasts to the end, and what two stems were struck is about the log's momentum
    assert long.duration.max() > 70.0
    speed = np.sqrt(2 * G * (np.sin(np.radians(35)) - 0.25 * np.cos(np.radians(35))) * 5.0 / np.cos(np.radians(35)))
    assert short.impulse.sum() == pytest.approx(log[0, MASS] * speed, rel=0.3)


@EVERY
def test_to_and_fro_between_two_plates(physics, fidelity):
    """A cylinder broadside between plates 4.4 m apart, without loss, at 20 m/s: a hit every 0.2 s, more than there was
    room for at first."""
    scene = flat(barriers=plates([(-2.2, -20), (-2.2, 20)], [(2.2, -20), (2.2, 20)]), cell=10.0)
    log = physics.body(diameter=0.4, length=10.0, taper=1.0)
    begin = physics.start(scene, log, (0, 1, 0), (0, 0, 20), velocity=(20, 0, 0))
    result = physics.run(scene, begin, fidelity=fidelity, time_limit=20.0, gravity=0.0, restitution=1.0)
    hits = result.hits
    step = FIDELITIES[fidelity].time_step  # Newton's law is met up to a step before the plate
    assert 0.2 - step > HIT_PAUSE
    assert 99 <= len(hits.time) <= 20.0 / (0.2 - step) + 1
    assert hits.item.tolist() == [(row + hits.item[0]) % 2 for row in range(len(hits.item))]
    assert hits.impulse == pytest.approx(2 * 20 * log[0, MASS], rel=1e-6)
    assert result.barrier_hits[0] == 2  # the deposits count different barriers, the ledger every hit


def test_the_same_bits_on_any_number_of_threads():
    rng = np.random.default_rng(8)
    scene = flat(trees=stems(*rng.uniform(-40, 40, (300, 2))), friction=0.2)
    logs = Logs.alike(*rng.uniform(-30, 30, (2, 40)), diameter=0.4, length=8.0, orientation=1, speed=15.0)
    one, two, many = (slide(scene, logs, FIDELITIES["draft"], time_limit=5.0, threads=n).hits for n in (1, 2, 16))
    assert len(one.time) > 50
    assert (np.diff(one.log_row) >= 0).all()
    for name in one.__dataclass_fields__:
        assert np.array_equal(getattr(one, name), getattr(two, name))
        assert np.array_equal(getattr(one, name), getattr(many, name))


def test_a_scene_without_obstacles_has_no_hits(physics):
    result = slide(flat(friction=0.3), Logs.alike([0.0], [0.0], orientation=1), FIDELITIES["draft"], time_limit=1.0)
    assert len(result.hits.time) == 0
    assert result.hits.place.shape == (0, 3)
