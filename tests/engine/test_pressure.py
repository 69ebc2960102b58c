"""Pressure along a line of contacts: linear, with the sum and the moment that it had, and friction's moment by it."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, Scene, Start, slide
from deadwood_engine.contact_solver import solve
from deadwood_engine.contacts import CONTACT, KEY_WIDTH, Ahead, Found, add_contact, set_frames
from deadwood_engine.log_body import CENTRE, LENGTH, TRANSVERSE, cone_bodies
from deadwood_engine.pressure import _ends, join_lines, press
from deadwood_engine.rolling import ROLLING
from deadwood_engine.rotation import quaternion_from_axis

CYLINDER = cone_bodies(np.array([0.6]), np.array([20.0]), np.array([400.0]), taper=1.0)[0]
MU, KICK = 0.3, 9.81 * 0.01
STILL = (0.0, 0.0, 0.0)


def on_level_ground(places, *, velocity=(0, 0, 0), spin=(0, 0, 0), bumps=0.0, mu=MU):
    """Contact table and state of a cylinder that lies along x, touching at places along it [m]."""
    state = np.zeros(16)
    state[3:7] = quaternion_from_axis(np.array([[1.0, 0, 0]]))[0]
    state[7:10], state[10:13], state[13:16] = velocity, spin, (1, 0, 0)
    table = np.zeros(len(places), CONTACT).view(np.recarray)
    keys = np.zeros((len(places), KEY_WIDTH), np.int64)
    step, rng = Ahead(0.01, 0.0, 0.01, 0.0, -1.0, 0.0), np.random.default_rng(0)
    for count, s in enumerate(places):
        n = np.array([*(bumps * rng.standard_normal(2)), 1.0])
        found = Found((0, count, 0), (s, 0.0, -0.3), tuple(n / np.linalg.norm(n)), -1e-6, mu)
        add_contact(table, keys, count, state, found, step, True)
    found = join_lines(table, len(places), state, 0.01)
    set_frames(table, len(places), state, CYLINDER)
    return table, state, found


def loads(table, values):
    table["pn"] = values
    press(table, len(table), STILL, STILL)
    return table["pn"].copy()


@pytest.mark.parametrize("seed", range(20))
def test_spreading_keeps_sum_and_moment_and_moves_nothing(seed):
    rng = np.random.default_rng(seed)
    places = np.sort(rng.uniform(-10, 10, rng.integers(3, 12)))
    table, _, found = on_level_ground(places)
    assert found
    assert table[0].line == len(places)
    before = rng.uniform(0, 1, len(places)) * (rng.random(len(places)) < 0.6)
    before[rng.integers(len(places))] += 0.1
    table["pn"] = before
    *motion, change = press(table, len(table), STILL, STILL)
    after = table["pn"]
    assert after.sum() == pytest.approx(before.sum(), rel=1e-12)
    assert after @ places == pytest.approx(before @ places, abs=1e-11)
    assert np.all(after >= 0.0)
    assert np.ravel(motion) == pytest.approx(np.zeros(6), abs=1e-14)
    assert change < 1e-12, "neither end moves, so the line bears what it bore"
    borne = after > 0.0
    if borne.sum() > 2:  # on a line where it bears, and in one stretch
        pressure = (after / table["stretch"])[borne]
        assert np.ptp(pressure - np.polyval(np.polyfit(places[borne], pressure, 1), places[borne])) < 1e-10
        assert np.all(np.diff(np.flatnonzero(borne)) == 1)
    assert loads(table, after.copy()) == pytest.approx(after, abs=1e-13), "what is linear stays"


@pytest.mark.parametrize("seed", range(50))
def test_the_ends_of_a_line_do_not_come_nearer(seed):
    """The two impulses against what no other choice of them can do better: complementarity, and the least work."""
    rng = np.random.default_rng(seed)
    places = np.sort(rng.uniform(-10, 10, 5))
    table, _, found = on_level_ground(places, velocity=(0, 0, rng.normal()), spin=(0, rng.normal(scale=0.2), 0))
    assert found
    a, b = table[0], table[4]
    before = rng.uniform(0, 1, 2)
    one, other = _ends(table, 0, 4, a.before_n, b.before_n, *before)
    coupled = a.nz * b.nz + a.rny * b.bny
    block = np.array([[a.gnn, coupled], [coupled, b.gnn]])
    left = np.array([a.before_n, b.before_n]) + block @ (np.array([one, other]) - before)
    assert min(one, other) >= 0.0
    assert left.min() >= -1e-12
    assert abs(one * left[0]) + abs(other * left[1]) < 1e-12


def test_a_resultant_near_one_end_leaves_the_other_without():
    """Closed form: a triangle of three times the distance from the end bears a resultant outside the middle third."""
    places = np.linspace(-10, 10, 2001)
    table, _, _ = on_level_ground(places)
    before = np.zeros(2001)
    before[1800] = 1.0  # 2 m from the end: 6 m bear
    after = loads(table, before)
    assert places[after > 0].min() == pytest.approx(4.0, abs=0.05)
    assert after[-2] / table["stretch"][-2] == pytest.approx(2.0 / 6.0, rel=0.01)
    before[:] = 0.0
    before[-1] = 1.0
    assert loads(table, before) == pytest.approx(before, abs=1e-8), "all at the very end stays there"


@pytest.mark.parametrize("number", [3, 5, 17, 65])
@pytest.mark.parametrize("backward", [False, True])
def test_friction_stops_a_turning_log_as_uniform_pressure_does(number, backward):
    """T35, T36: on level ground mu g L/4 against turning, whatever the number of contacts and their order.

    Trapezoids are exact for |s| where a contact lies in the middle. Two at the ends would give twice that.
    """
    length = CYLINDER[LENGTH]
    places = np.linspace(-0.5 * length, 0.5 * length, number)[:: -1 if backward else 1]
    table, state, found = on_level_ground(places, spin=(0, 0, 0.5))
    assert found
    state[9] = -KICK
    rolling = np.array([(0.0, 0.0, 0.0, 1.0, 1.0)], ROLLING).view(np.recarray)[0]
    used, residual = solve(table, number, state, rolling, (1e-9, 2000), True)
    assert residual <= 1e-9
    assert used < 100
    assert 0.5 - state[12] == pytest.approx(MU * KICK * 0.25 * length / CYLINDER[TRANSVERSE], rel=1e-6)
    assert table["pn"].sum() == pytest.approx(KICK, rel=1e-7)


def test_what_is_no_line_is_left_alone():
    places = np.linspace(-8, 8, 6)
    assert not on_level_ground(places, bumps=1e-2)[2], "normals differ"
    assert not on_level_ground(places[:2])[2], "two are no matter of choice"
    table, _, found = on_level_ground(places)
    before = table.copy()
    table["line"] = 0
    table["pn"] = np.arange(6.0)
    assert found
    assert press(table, 6, (0.0, 1.0, 2.0), (3.0, 4.0, 5.0)) == ((0.0, 1.0, 2.0), (3.0, 4.0, 5.0), 0.0)
    assert np.array_equal(table["pn"], np.arange(6.0))
    assert np.array_equal(table["nx"], before["nx"])


def test_contacts_that_must_move_otherwise_are_no_part_of_a_line():
    """A gap beyond what gravity closes leaves room for more: such a contact bears nothing yet."""
    table, state, _ = on_level_ground(np.linspace(-8, 8, 6))
    table["target"][-1], table["line"] = -0.01, 0
    assert join_lines(table, 6, state, 0.01)
    assert table["line"].tolist() == [5, -1, -1, -1, -1, 0]
    table, state, _ = on_level_ground(np.linspace(-8, 8, 6))
    table["target"][-1] = -1e-3  # a gap of 10 um, which heights in float32 make of none
    assert join_lines(table, 6, state, 0.01)
    assert table[0].line == 6


def test_points_of_one_face_are_no_line():
    """Candidates of an end face lie at one place along the log, but for rounding: no line, and nothing to divide by."""
    places = np.array([5.0, 5.0 + 2e-15, 5.0 - 2e-15, 5.0, 5.0 + 1e-15])
    table, _, found = on_level_ground(places)
    assert not found
    assert np.isfinite(table["rnx"]).all()
    table, _, found = on_level_ground(np.concatenate([np.linspace(-5, 5, 4), places]))
    assert found
    assert table["line"].tolist() == [4, -1, -1, -1, *[0] * 5]


def test_what_bears_nothing_any_more_has_no_friction():
    """A contact that the spread leaves without a load gives its friction back to the log."""
    table, _, _ = on_level_ground(np.linspace(-8, 8, 5), spin=(0, 0, 0.3))
    table["pn"], table["pt"], table["pu"] = [0.2, 0, 0, 0, 1.0], 0.05, 0.0
    assert table["pn"] @ table["along"] / table["pn"].sum() > 8 / 3, "outside the middle third"
    *motion, _ = press(table, 5, STILL, STILL)
    freed = table["pn"] == 0.0
    assert 0 < freed.sum() < 4
    assert np.all(table["pt"][freed] == 0.0)
    assert np.all(table["pt"][~freed] == 0.05)
    taken = [-0.05 * table[name][freed].sum() for name in ("tx", "ty", "tz", "btx", "bty", "btz")]
    assert np.ravel(motion) == pytest.approx(taken, abs=1e-14)


def test_rounded_normals_become_one():
    """Heights in float32 turn normals by 1e-5: a line of such contacts is made exactly one, or no sweep would end."""
    table, state, found = on_level_ground(np.linspace(-9, 9, 7), bumps=1e-5, spin=(0, 0, 0.3))
    assert found
    assert np.ptp(table["nx"]) == np.ptp(table["ny"]) == 0.0
    levers = np.column_stack([table[f"rn{each}"] for each in "xyz"])
    share = (table["along"] - table["along"][0]) / np.ptp(table["along"])
    assert levers == pytest.approx(levers[0] + share[:, None] * (levers[-1] - levers[0]), abs=1e-14)
    state[9] = -KICK
    rolling = np.array([(0.0, 0.0, 0.0, 1.0, 1.0)], ROLLING).view(np.recarray)[0]
    used, residual = solve(table, 7, state, rolling, (1e-10, 2000), True)
    assert residual <= 1e-10
    assert used < 100


@pytest.mark.parametrize("fidelity", ["standard", "fine"])
def test_rings_do_not_decide_where_a_turning_log_gets(fidelity):
    """A log that slides and turns on a plane of float32 heights, with rings 4, 1 and 0.5 m apart.

    While the solver spread the pressure as it came, the answer hung on how many rings there were.
    """
    axis = np.arange(0.0, 120.5, 0.5)
    heights = (0.36 * axis[:, None] + 0.0 * axis[None, :]).astype(np.float32)
    scene = Scene.prepare(heights, 0.5, 0.0, 0.0, friction=0.5)
    solid = cone_bodies(np.array([0.6]), np.array([20.0]), np.array([400.0]))
    fall, normal = np.array([0.0, -1.0, -0.36]), np.array([0.0, -0.36, 1.0])
    fall, normal = fall / np.linalg.norm(fall), normal / np.linalg.norm(normal)
    ends = []
    for spacing in (4.0, 1.0, 0.5):
        states = []
        for turn, yaw in ((0.3, 0.4), (-0.5, 0.2), (0.1, -0.5)):
            along = np.cos(turn) * fall + np.sin(turn) * np.cross(normal, fall)
            lean = np.arcsin((solid[0, 0] - solid[0, 1]) / solid[0, LENGTH])
            d = np.cos(lean) * along - np.sin(lean) * normal
            height = solid[0, 0] * np.cos(lean) - solid[0, CENTRE] * np.sin(lean)
            state = np.zeros(16)
            state[0:3] = np.array([60.0, 90.0, 0.36 * 90.0]) + height * normal
            state[3:7] = quaternion_from_axis(d[None])[0]
            state[7:10], state[10:13], state[13:16] = 8.0 * fall, yaw * normal, d
            states.append(state)
        terrain = scene.arrays.terrain
        begin = np.array(states)
        begin[:, 2] -= terrain.reference
        frame = np.floor(begin[:, :2] / terrain.cell).astype(np.int64)
        begin[:, :2] -= frame * terrain.cell
        row = FIDELITIES[fidelity]._replace(station_spacing=spacing, spacing_cells=1e6)
        result = slide(scene, Start(frame, begin, np.repeat(solid, 3, axis=0)), row, time_limit=3.0)
        # where they are at 3 s: a run ends with the step that comes past it
        late, last = (result.duration - 3.0)[:, None], result.last_state
        swing = np.cross(last[:, 10:13], last[:, 13:16])
        base = result.base_end - late * (last[:, 7:10] - solid[0, CENTRE] * swing)
        tip = result.tip_end - late * (last[:, 7:10] + (solid[0, LENGTH] - solid[0, CENTRE]) * swing)
        ends.append(np.hstack([base, tip]))
    assert np.all(np.linalg.norm(ends[2][:, :3] - [60.0, 90.0, 32.4], axis=1) > 5.0), "they slid"
    # a stretch h about the middle, where friction turns round, is off by (h / L)^2 of the moment: 4 %, and 0.3 %
    assert np.abs(ends[0] - ends[2]).max() < 0.3
    assert np.abs(ends[1] - ends[2]).max() < 0.02
