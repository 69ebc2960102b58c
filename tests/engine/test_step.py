"""One step, phase by phase: its length, its entries in the balances, and where a slide ends.

The kernels run as Python here; the results of slides are tested in tests/physics and tests/extremes.
"""

import math

import numpy as np
import pytest
from level_ground import DT, LOG, ROLL_ANGLE, SETTINGS, TRAVEL, WHERE, G, level_model

from deadwood_engine.contacts import Ahead, Found, add_contact, set_frames
from deadwood_engine.cores import TREE
from deadwood_engine.ledger import HIT_WIDTH
from deadwood_engine.limits import BURIED, CLOUD_TURN, POLL_STEPS, SHORTEST_STEP, WILD_SPEED
from deadwood_engine.log_body import BASE_RADIUS, CENTRE, LENGTH
from deadwood_engine.rasters import raster_arrays
from deadwood_engine.rest import FAILED, INTERRUPTED, LEFT_DEM, TIME_LIMIT
from deadwood_engine.rotation import drift, set_axis
from deadwood_engine.scratch import Scratch
from deadwood_engine.surroundings import know_nothing
from deadwood_engine.trace import POSE_WIDTH, Marks, Output
from deadwood_engine.way import SUMMARY


@pytest.fixture(scope="module")
def model():
    return level_model()


def flying(seed):
    rng = np.random.default_rng(seed)
    state = np.zeros(16)
    state[:3], state[3:7] = (20.0, 20.0, 9.0), rng.normal(size=4)
    set_axis(state)
    state[7:10] = rng.normal(size=3) * rng.choice([0.1, 3.0, 20.0])
    state[10:13] = rng.normal(size=3) * rng.choice([0.1, 2.0]) + state[13:16] * rng.choice([0.0, 40.0])
    return state


def memory(cores=0):
    """A worker's memory that knows of nothing near, and its way."""
    scratch = Scratch.allocate(9, cores, 1, None)
    know_nothing(scratch.near[0])
    way = scratch.way[0]
    way.travel, way.whole = math.inf, True
    return scratch, way


@pytest.mark.parametrize("seed", range(30))
def test_no_end_moves_farther_than_a_step_s_travel(plain, model, seed):
    """In free fall for the step; and no shorter than that asks for, however fast the log spins."""
    state, (scratch, way) = flying(seed), memory()
    way.before = 0.3 * DT
    fallen = state.copy()
    plain("step").choose_step(model, WHERE, fallen, scratch)
    assert fallen[9] == state[9] - 0.5 * G * way.before  # gravity's half for the way behind
    assert np.array_equal(np.delete(fallen, 9), np.delete(state, 9))
    places = np.array([-LOG[CENTRE], LOG[LENGTH] - LOG[CENTRE]])[:, None]
    first = fallen[:3] + places * fallen[13:16]
    moved = fallen.copy()
    moved[9] -= 0.5 * G * way.dt
    drift(moved, LOG[4], LOG[5], way.dt)
    far = np.linalg.norm(moved[:3] + places * moved[13:16] - first, axis=1).max()
    assert far <= TRAVEL * (1.0 + 1e-12)
    bound = way.fastest * way.dt + 0.5 * way.bend * way.dt**2
    assert bound == pytest.approx(TRAVEL) or (way.dt == DT and bound < TRAVEL)


@pytest.mark.parametrize("touches", [False, True])
@pytest.mark.parametrize("spin", [-400.0, 400.0])
def test_a_log_in_contact_turns_about_its_axis_by_little_in_a_step(plain, model, touches, spin):
    """Not in flight, where the surface of a round log is where it was, however it has turned."""
    state, (scratch, way) = flying(4), memory()
    state[7:10], state[10:13], way.touches = 0.0, spin * state[13:16], touches
    plain("step").choose_step(model, WHERE, state, scratch)
    assert way.dt == pytest.approx(ROLL_ANGLE / abs(spin) if touches else DT)


@pytest.mark.parametrize("allowed", [0.05, 1e-9])
def test_obstacles_shorten_a_step_down_to_a_least(plain, model, allowed):
    state, (scratch, way) = flying(4), memory()
    way.travel = allowed
    plain("step").choose_step(model, WHERE, state, scratch)
    fastest = plain("travel").fastest_point(state, LOG) + 0.5 * G * DT
    assert way.dt == pytest.approx(max(SHORTEST_STEP, min(DT, allowed / fastest)))


def test_a_cloud_turns_by_little_in_a_step(plain, model):
    state, (scratch, way) = flying(1), memory()
    state[10:13] = 0.0, 30.0, 40.0
    state[7:10] = 0.0
    cloud = model._replace(cloud=object(), settings=SETTINGS._replace(travel=9.0))
    plain("step").choose_step(cloud, WHERE, state, scratch)
    assert way.dt == pytest.approx(CLOUD_TURN / 50.0)


def end_of(plain, model, state, *, stop=0, **fields):
    scratch, way = memory()
    summary, told = np.zeros(1, SUMMARY).view(np.recarray)[0], np.array([stop], np.uint8)
    way.next_look = way.next_rocking = 99.0
    way.dt, way.before, way.speed = DT, DT, np.linalg.norm(state[7:10])
    for name, value in fields.items():
        (summary if name in (SUMMARY.names or ()) else way)[name] = value
    reason = plain("step").move_on(model, WHERE, state, scratch, summary, told)
    return reason, way, summary


def test_it_continues_in_free_motion(plain, model):
    state, moved = flying(2), flying(2)
    reason, way, summary = end_of(plain, model, moved, time=1.0, path=2.0, steps=3.0)
    drift(state, LOG[4], LOG[5], DT)
    assert reason == -1
    assert moved == pytest.approx(state, abs=1e-15)
    assert way.time == 1.0 + DT
    assert summary.path == pytest.approx(2.0 + DT * way.speed)


def test_where_a_slide_ends(plain, model):
    """Beyond the terrain, at the time limit, when the user asks, and where a number is wild or none."""
    assert end_of(plain, model, flying(2), time=SETTINGS.time_limit - 0.5 * DT)[0] == TIME_LIMIT
    assert end_of(plain, model, flying(2), time=SETTINGS.time_limit - 1.5 * DT)[0] == -1
    out = flying(2)
    out[0] = 38.999 + 1.0
    assert end_of(plain, model, out)[0] == LEFT_DEM
    assert end_of(plain, model, flying(2), stop=1, steps=float(POLL_STEPS))[0] == INTERRUPTED
    assert end_of(plain, model, flying(2), stop=1, steps=POLL_STEPS + 1.0)[0] == -1
    for wild in ({"speed": WILD_SPEED}, {"speed": np.nan}, {"energy": np.nan}, {"energy": np.inf}):
        assert end_of(plain, model, flying(2), **wild)[0] == FAILED


def booked(plain, model, *contacts, push=2.0, state=None, **fields):
    """Enter a step with contacts (kind, row, gap) below the middle of a log, each of which pushes it up."""
    scratch, way = memory(len(model.cores.solid))
    state = np.zeros(16) if state is None else state
    if not state.any():
        state[:4], state[13], state[9] = (20.0, 20.0, 0.25, 1.0), 1.0, -1.0
    summary = np.zeros(1, SUMMARY).view(np.recarray)[0]
    for name, value in fields.items():
        (summary if name == "started_in_contact" else way)[name] = value
    way.dt, way.fall, way.tolerance, count = DT, 0.5 * G * DT, 1e-3, 0
    for kind, row, gap in contacts:
        step = Ahead(1e-9, 0.0, 1e-9, 0.0, -1.0, 0.0)
        found = Found((kind, row, 0), (0.0, 0.0, -0.25), (0.0, 0.0, 1.0), gap, 0.3)
        count = add_contact(scratch.contacts, scratch.keys, count, state, found, step, True)
    set_frames(scratch.contacts, count, state, LOG)
    way.count, scratch.free[:] = count, state[7:13]
    scratch.rolling[0].inertia = LOG[5]
    scratch.contacts["pn"][:count] = push
    state[9] += push * count - 0.5 * G * DT
    marks = Marks(np.zeros(0, bool), np.zeros(0, bool), np.zeros(0, bool), np.zeros(0), np.zeros(0, bool))
    poses, hits = np.zeros((0, POSE_WIDTH)), np.zeros((9, HIT_WIDTH))
    out = Output(raster_arrays((0, 0)), 0, marks, poses, False, hits, summary)
    plain("step").keep_books(model, WHERE, state, scratch, out)
    return summary, way, scratch, state


def test_the_work_of_a_push_is_booked(plain, model):
    """From 1 m/s down to rest takes 1/2 J/kg, at the node; what a contact gives beyond is gain."""
    summary, way, scratch, _ = booked(plain, model, (0, 1, -0.02), push=1.0)
    assert way.work == pytest.approx(-0.5)
    assert summary.energy_gain == 0.0
    assert (summary.penetration, summary.overlap, summary.contacts) == pytest.approx((0.02, 0.0, 1.0))
    assert way.pressed
    assert (way.before, way.old_count) == (DT, 1)
    assert scratch.old_contacts[0].pz == pytest.approx(1.0)
    summary, way, _, state = booked(plain, model, (0, 1, -0.02), push=3.0)
    assert way.work == summary.energy_gain == pytest.approx(1.5)
    assert summary.speed_max == way.speed == pytest.approx(abs(state[9]))


def test_an_unfinished_solve_gives_nothing(plain, model):
    summary, way, _, state = booked(plain, model, (0, 1, -0.02), push=3.0, residual=1.0)
    assert summary.unconverged == 1.0
    assert way.work <= 1e-12
    assert summary.energy_gain <= 1e-12
    assert state[9] == pytest.approx(0.0, abs=1e-12)  # held out in the middle of the step, and no more


def test_what_is_deeper_than_a_step_can_bring_it_fails(plain, model):
    """By its radius and a step's travel; what it touched since it was deeper than its radius counts for nothing."""
    radius = LOG[BASE_RADIUS]
    for kind, row in ((0, 1), (TREE, 1)):
        depths = (0.5 * radius, 1.1 * radius, radius + 1.01 * max(TRAVEL, 0.3 * (radius + 0.4)))
        for depth, sunk, lost in zip(depths, (math.inf, 3.0, 3.0), (False, False, True), strict=True):
            _, way, _, state = booked(plain, model, (kind, row, -depth), push=0.1, time=3.0, sunk=math.inf, lost=False)
            at_once = lost and kind == TREE  # the ground may hold it so deep for half a second
            assert (way.sunk, way.lost) == (sunk, at_once)
            for since, late in ((2.6, False), (2.4, True)):
                way = booked(plain, model, (kind, row, -depth), push=0.1, time=3.0, sunk=since, lost=False)[1]
                assert way.lost == (at_once or (lost and late))
            assert end_of(plain, model, state, lost=lost)[0] == (FAILED if lost else -1)
        # since the first of such steps in a row; and neither what was released in contact nor where terrain is missing
        _, way, *_ = booked(plain, model, (kind, row, -1.1 * radius), push=0.1, time=3.0, sunk=2.0, lost=False)
        assert way.sunk == 2.0
        exempt = {"whole": False} if kind == 0 else {"started_in_contact": 1.0}
        _, way, *_ = booked(plain, model, (kind, row, -9.0), push=0.1, time=3.0, sunk=2.0, lost=False, **exempt)
        assert (way.sunk, way.lost) == (math.inf, False)
    marks = Marks(
        np.ones(3, bool), np.ones(2, bool), np.ones(2, bool), np.array([1.0, 2.0, 3.0]), np.zeros(3, bool)
    )  # fmt: skip
    plain("trace").forget_after(marks, 2.0)
    assert marks.lines.tolist() == [True, False, False]
    assert marks.line_time.tolist() == [1.0, math.inf, math.inf]
    assert not marks.crossed.any()


def test_the_obstacle_that_acted_is_reported(plain, model):
    """A stem is hit once, however many contacts it has, and its depth is an overlap, not a penetration."""
    summary, way, scratch, _ = booked(plain, model, (TREE, 1, -0.03), (TREE, 1, -0.01), (0, 3, -0.005), push=0.1)
    assert (summary.tree_hits, summary.barrier_hits, summary.hits) == (1.0, 0.0, 1.0)
    assert scratch.hit_trees[0] == 1
    assert (summary.penetration, summary.overlap) == pytest.approx((0.005, 0.03))
    summary, way, *_ = booked(plain, model, (TREE, 1, -0.03), push=0.0)
    assert (summary.tree_hits, summary.hits, way.pressed) == (0.0, 0.0, False)


def test_what_a_release_does_is_no_depth_and_what_came_in_below_the_border_has_left(plain, model):
    """Up to half the log's radius it is a depth like any other, there too; NaN is where the ground begins ahead."""
    assert booked(plain, model, (TREE, 1, -0.03), started_in_contact=1.0)[0].overlap == 0.0
    least = BURIED * LOG[BASE_RADIUS]
    for whole, depth, told, sunk in (
        (True, 2.0 * least, 2.0 * least, False), (False, 0.99 * least, 0.99 * least, False),
        (False, 1.01 * least, 0.0, True), (False, math.nan, 0.0, False),
    ):  # fmt: skip
        summary, way, *_ = booked(plain, model, (0, 1, -depth), whole=whole)
        assert (summary.penetration, way.undermined) == (pytest.approx(told), sunk)


def test_a_step_without_contacts_is_airborne(plain, model):
    summary, way, _, _ = booked(plain, model)
    assert (summary.airborne, summary.contacts, way.work, way.old_count) == (1.0, 0.0, 0.0, 0)
    assert not way.pressed
