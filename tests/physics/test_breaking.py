"""Trees that break: what they take, what a row of them stops, and that nothing of them is left for the log.

In the air and without gravity the trees are all that takes energy, so balances are exact; on a slope the ground pushes
in the same steps, and each tree must have taken its capacity all the same.
"""

from dataclasses import replace

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, STOP_REASONS, Logs, LyingLogs, Rasters, Scene, Trees, slide
from deadwood_engine.log_body import MASS, TRANSVERSE

EVERY = pytest.mark.parametrize("fidelity", list(FIDELITIES))
RIGHT = 1e-9  # [-] of a balance: rounding of some thousand steps


def flat(*, size=120.0, friction=0.0, **parts):
    count = int(2 * size) + 1
    return Scene.prepare(np.zeros((count, count)), 1.0, -size, -size, friction=friction, **parts)


def stems(*places, capacity, diameter=0.4):
    x, y = np.array(places, float).T
    return Trees(x, y, np.full(len(x), diameter), np.full(len(x), 1e4), np.full(len(x), float(capacity)))


def kinetic(log, state):
    v, w, d = state[7:10], state[10:13], state[13:16]
    along = w @ d
    return log[0, MASS] * 0.5 * (v @ v + log[0, TRANSVERSE] * (w @ w - along**2) + log[0, 5] * along**2)


def broadside(physics, scene, log, energy, **motion):
    """A cylinder across its way, its middle towards the stems along x: one contact, and no lever."""
    speed = np.sqrt(2.0 * energy / log[0, MASS])
    return physics.start(scene, log, (0, 1, 0), (0.0, 0.0, 20.0), velocity=(speed, 0, 0), **motion)


@EVERY
@pytest.mark.parametrize("share", [0.01, 0.5, 0.999, 1.001])
def test_a_stem_takes_what_it_can_and_no_more(physics, fidelity, share):
    """Head-on with the energy E: of a stem of capacity C the log keeps E - C, or nothing where that is less."""
    log, energy = physics.body(diameter=0.5, length=10.0, taper=1.0), 2e5
    scene = flat(trees=stems((20.0, 0.0), capacity=share * energy))
    result = physics.run(scene, broadside(physics, scene, log, energy), fidelity=fidelity, time_limit=3.0, gravity=0.0)
    kept = kinetic(log, result.last_state[0])
    assert kept / energy == pytest.approx(max(0.0, 1.0 - share), abs=RIGHT)
    assert result.hits.broke.tolist() == [share < 1.0]
    assert result.hits.energy_taken[0] / energy == pytest.approx(min(1.0, share), rel=RIGHT)
    assert (result.end_position[0, 0] > 20.0) == (share < 1.0)


@EVERY
@pytest.mark.parametrize("number", [1, 5])
def test_a_row_of_stems_stops_what_has_less_than_all_of_them_take(physics, fidelity, number):
    log, capacity = physics.body(diameter=0.5, length=10.0, taper=1.0), 5e4
    scene = flat(trees=stems(*((10.0 * (k + 1), 0.0) for k in range(number)), capacity=capacity))
    for factor in (0.999, 1.001):
        start = broadside(physics, scene, log, factor * number * capacity)
        result = physics.run(scene, start, fidelity=fidelity, time_limit=60.0, gravity=0.0)
        passes = factor > 1.0
        assert result.hits.broke.tolist() == [True] * (number - 1) + [passes]
        assert result.hits.item.tolist() == list(range(number))
        assert (result.end_position[0, 0] > 10.0 * number) == passes
        left = max(0.0, factor - 1.0) * number * capacity
        assert kinetic(log, result.last_state[0]) == pytest.approx(left, abs=RIGHT * number * capacity)


@pytest.mark.parametrize("restitution", [0.0, 0.3])
@pytest.mark.parametrize("mu", [0.0, 0.5])
def test_oblique_hits_take_the_capacity_too(physics, mu, restitution):
    """Shots into a stand, with levers, friction, spin and rebounds: a stem that broke took its capacity in that hit,
    and all hits together took what the log lost."""
    draw = np.random.default_rng(5)
    places = draw.uniform((10, -25), (60, 25), (150, 2))
    log, capacity, broken = physics.body(diameter=0.4, length=12.0), 2e4, 0
    scene = flat(trees=stems(*places, capacity=capacity), friction=mu)
    for _ in range(8):
        axis = [*draw.normal(size=2), 0.2]
        start = physics.start(scene, log, axis, (0, 0, 30), velocity=(25, draw.uniform(-5, 5), 0), spin=(0, 1, 2))
        result = physics.run(scene, start, time_limit=4.0, gravity=0.0, restitution=restitution)
        hits = result.hits
        lost = kinetic(log, start.state[0]) - kinetic(log, result.last_state[0])
        assert hits.energy_taken.sum() == pytest.approx(lost, rel=RIGHT)
        assert hits.energy_taken[hits.broke] == pytest.approx(capacity, rel=RIGHT)
        assert (hits.energy_taken[~hits.broke] <= capacity * (1.0 + RIGHT)).all()
        assert len(set(hits.item[hits.broke].tolist())) == hits.broke.sum()
        broken += hits.broke.sum()
    assert broken >= 15


@EVERY
def test_nothing_is_left_of_a_broken_stem(physics, fidelity):
    """The log flies on through where it stood, straight and at one speed; its second neighbour stands as it did."""
    log, energy = physics.body(diameter=0.5, length=10.0, taper=1.0), 2e5
    trees = stems((20.0, 0.0), (24.0, 30.0), capacity=1e5)
    result = physics.run(
        scene := flat(trees=trees), broadside(physics, scene, log, energy), fidelity=fidelity, time_limit=3.0,
        gravity=0.0, keep_poses=np.ones(1, bool),
    )  # fmt: skip
    poses, broke = result.poses, result.hits.time[0] + result.hits.duration[0]
    after = poses.time > broke + 1e-9
    assert poses.speed[after] == pytest.approx(np.sqrt(2.0 * 1e5 / log[0, MASS]), rel=RIGHT)
    x, time = poses.position[after, 0], poses.time[after]
    assert poses.position[0, 0] < 19.0
    assert x[-1] > 30.0
    assert np.diff(x) / np.diff(time) == pytest.approx(poses.speed[after][0], rel=1e-7)
    assert np.ptp(poses.position[:, 1]) < 1e-9
    assert len(result.hits.item) == 1


def slope_in_a_stand(capacity, *, friction=0.35, number=260, seed=2):
    """A plane of 35 degrees with roughness and stems."""
    draw = np.random.default_rng(seed)
    heights = np.tan(np.radians(35.0)) * np.arange(161.0)[:, None] + draw.normal(0.0, 0.05, (161, 81))
    places = draw.uniform((5, 20), (75, 125), (number, 2))
    size = draw.uniform(0.2, 0.5, number)
    limit = None if capacity is None else capacity * (size / 0.4) ** 2
    return Scene.prepare(
        heights, 1.0, 0.0, 0.0, friction=friction,
        trees=Trees(places[:, 0], places[:, 1], size, np.full(number, 25.0), limit),
    )  # fmt: skip


def some_logs(number, seed=1):
    draw = np.random.default_rng(seed)
    values = {"diameter": 0.4, "length": 12.0, "orientation": 1}
    logs = Logs.alike(draw.uniform(10, 70, number), draw.uniform(135, 145, number), **values)
    return replace(logs, azimuth=draw.uniform(0.0, 2.0 * np.pi, number))


@EVERY
def test_on_a_slope_a_tree_takes_its_capacity_beside_the_ground(fidelity):
    """Ground, other trees and the one that breaks push in the same steps."""
    scene = slope_in_a_stand(15e3)
    result = slide(scene, some_logs(60), FIDELITIES[fidelity], time_limit=60.0)
    hits = result.hits
    capacity = scene.arrays.cores.solid["capacity"][hits.item]
    taken = hits.energy_taken / capacity
    assert hits.broke.sum() >= 40
    # but for two that break in one step, of which the second changes the first one's share
    last = np.column_stack([hits.log_row, hits.time + hits.duration])[hits.broke]
    alone = (np.abs(last[:, None] - last[None]) < (1, 0.1)).all(axis=2).sum(axis=1) == 1
    assert alone.sum() >= 40
    assert taken[hits.broke][alone] == pytest.approx(1.0, rel=RIGHT)
    assert (taken[~hits.broke] <= 1.0 + RIGHT).all()
    assert result.energy_error.max() < {"draft": 5e-3, "standard": 5e-4, "fine": 1e-4, "reference": 1e-5}[fidelity]
    assert not (result.stop_reason == STOP_REASONS.index("failed")).any()


def test_trees_that_cannot_break_and_trees_without_a_capacity_are_the_same_bits():
    """An infinite capacity; and one that no hit reaches, although it is monitored in every step."""
    found = []
    for capacity in (None, np.inf, 1e12):
        scene = slope_in_a_stand(capacity)
        rasters = Rasters.allocate(scene, 1)
        result = slide(scene, some_logs(40), FIDELITIES["standard"], time_limit=60.0, rasters=rasters, influences=True)
        arrays = [result.last_state, result.duration, result.hits.energy_taken, result.energy_error]
        found.append([each.tobytes() for each in (*arrays, *rasters.totals().values())])
    assert found[0] == found[1] == found[2]


def test_any_number_of_threads_breaks_the_same_trees():
    scene, logs = slope_in_a_stand(15e3), some_logs(80)
    one, three = (slide(scene, logs, FIDELITIES["draft"], time_limit=60.0, threads=n) for n in (1, 3))
    assert one.hits.broke.any()
    for name in ("log_row", "item", "time", "energy_taken", "broke"):
        assert getattr(one.hits, name).tobytes() == getattr(three.hits, name).tobytes()
    assert one.last_state.tobytes() == three.last_state.tobytes()


def test_what_did_not_matter_to_a_log_can_be_taken_away():
    """As where nothing breaks (test_influence): without any of the other trees a log goes the same way, to the bit, and
    breaks the same ones."""
    scene, logs = slope_in_a_stand(15e3), some_logs(40)
    whole = slide(scene, logs, FIDELITIES["standard"], time_limit=60.0, influences=True)
    draw, told = np.random.default_rng(3), whole.influences
    assert whole.hits.broke.sum() >= 20
    for row in range(len(logs)):
        mine = told.item[told.log_row == row]
        others = np.setdiff1d(np.arange(scene.tree_count), mine)
        gone = others[draw.random(others.size) < draw.uniform(0.2, 1.0)]
        again = slide(
            scene.without(others=gone), logs.take(slice(row, row + 1)), FIDELITIES["standard"], time_limit=60.0
        )
        assert again.last_state.tobytes() == whole.last_state[row : row + 1].tobytes()
        assert again.hits.broke.tolist() == whole.hits.broke[whole.hits.log_row == row].tolist()


def test_reach_with_trees_that_break_is_the_same_at_every_fidelity():
    """Reach of a line below the stand, 400 paired logs: between those of rigid trees and of none, and draft, standard
    and fine apart by no more than four standard errors of two such shares."""
    shares = {}
    for name in ("draft", "standard", "fine"):
        result = slide(slope_in_a_stand(15e3), some_logs(400), FIDELITIES[name], time_limit=60.0)
        shares[name] = float((result.end_position[:, 1] < 60.0).mean())
    ends = [
        float((slide(scene, some_logs(400), FIDELITIES["standard"], time_limit=60.0).end_position[:, 1] < 60.0).mean())
        for scene in (slope_in_a_stand(None), slope_in_a_stand(1.0))
    ]
    assert ends[0] < shares["standard"] < ends[1]
    error = np.sqrt(2.0 * 0.25 / 400)
    assert max(shares.values()) - min(shares.values()) < 4.0 * error


@EVERY
@pytest.mark.parametrize("capacity", [1e4, 1.9e5, 2.1e5, None])
def test_a_lying_log_takes_what_it_can_and_is_gone_for_this_log_only(physics, fidelity, capacity):
    """Broadside along the ground at a log that lies across the way: E - C is kept, or the log is stopped."""
    log, energy = physics.body(diameter=0.4, length=10.0, taper=1.0), 2e5
    lying = LyingLogs(np.array([[20.0, -8.0], [20.0, 8.0]]), np.array([0, 2]), *np.full((2, 1), 0.4))
    scene = flat(lying_logs=lying._replace(capacity=None if capacity is None else np.array([capacity])))
    speed = np.sqrt(2.0 * energy / log[0, MASS])
    start = physics.start(scene, log, (0, 1, 0), (0.0, 0.0, 0.201), velocity=(speed, 0, 0))
    result = physics.run(scene, start, fidelity=fidelity, time_limit=3.0, gravity=0.0)
    breaks = capacity is not None and capacity < energy
    kept = kinetic(log, result.last_state[0])
    assert result.hits.broke.tolist() == [breaks]
    if breaks and capacity is not None:
        assert kept / energy == pytest.approx(1.0 - capacity / energy, abs=RIGHT)
        assert result.hits.energy_taken[0] == pytest.approx(capacity, rel=RIGHT)
    else:
        assert kept < 1e-3 * energy  # it lies a millimetre above the other's axis, so a little is turned upwards
    assert (result.end_position[0, 0] > 20.0) == breaks


def test_a_lying_log_that_takes_anything_changes_no_bit(physics):
    """An infinite capacity beside a tree that breaks is the same as none; what is not more than nothing is refused."""
    log = physics.body(diameter=0.4, length=10.0, taper=1.0)
    lying = LyingLogs(np.array([[25.0, -8.0], [25.0, 8.0]]), np.array([0, 2]), *np.full((2, 1), 0.4))
    ends = []
    for each in (lying, lying._replace(capacity=np.array([np.inf]))):
        scene = flat(lying_logs=each, trees=stems((10.0, 0.0), capacity=5e4), friction=0.2)
        start = physics.start(scene, log, (0, 1, 0), (0.0, 0.0, 0.3), velocity=(20.0, 0, 0))
        ends.append(physics.run(scene, start, time_limit=5.0))
    assert ends[0].last_state.tobytes() == ends[1].last_state.tobytes()
    with pytest.raises(ValueError, match="lying log breaks"):
        flat(lying_logs=lying._replace(capacity=np.array([0.0])))
