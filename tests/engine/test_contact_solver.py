"""The contact solver alone: laws of contact on random problems, and impacts with known answers."""

import numpy as np
import pytest
from scipy.optimize import minimize

from deadwood_engine.contact_solver import block_impulse, disc_impulse, solve
from deadwood_engine.contacts import CONTACT, KEY_WIDTH, Ahead, Found, add_contact, set_frames
from deadwood_engine.energy import impulse_work
from deadwood_engine.log_body import AXIAL, CENTRE, LENGTH, TRANSVERSE, cone_bodies
from deadwood_engine.rolling import ROLLING

NO_ROLLING = np.array([(0.0, 0.0, 0.0, 1.0, 1.0)], ROLLING).view(np.recarray)[0]
LOG = cone_bodies(np.array([0.75]), np.array([30.0]), np.array([300.0]))[0]


def problem(points, *, axis=(0, 0, 1), velocity=(0, 0, 0), spin=(0, 0, 0), body=LOG):
    """Contact table of (r, n, mu) triples for a log with the given motion; no gravity, all gaps closed."""
    state = np.zeros(16)
    state[3] = 1.0
    state[7:10], state[10:13], state[13:16] = velocity, spin, np.asarray(axis, float) / np.linalg.norm(axis)
    table = np.zeros(len(points), CONTACT).view(np.recarray)
    keys = np.zeros((len(points), KEY_WIDTH), np.int64)
    count, step = 0, Ahead(1e-9, 0.0, 1e-9, 0.0, -1.0, 0.0)
    for r, n, mu in points:
        normal = np.asarray(n, float) / np.linalg.norm(n)
        found = Found((0, 0, 0), tuple(map(float, r)), tuple(normal), -1.0, mu)
        count = add_contact(table, keys, count, state, found, step, False)
    set_frames(table, count, state, body)
    return table, state


def after(table, state):
    """Relative velocities (n, t, u) of every contact."""
    motion = np.concatenate([state[7:10], state[10:13]])
    rows = [[*(k + j for j in "xyz"), *("r" + k + j for j in "xyz")] for k in "ntu"]
    return np.array([[[c[name] for name in row] @ motion for row in rows] for c in table])


@pytest.mark.parametrize("seed", range(200))
def test_laws_of_contact(seed):
    """T63-T65 on random contact sets of one log: signs, cone, complementarity, slip against the friction, energy."""
    rng = np.random.default_rng(seed)
    number = rng.integers(1, 7)
    axis = rng.standard_normal(3)
    axis /= np.linalg.norm(axis)
    points = []
    for _ in range(number):
        s = rng.uniform(-LOG[CENTRE], LOG[LENGTH] - LOG[CENTRE])
        side = np.cross(axis, rng.standard_normal(3))
        side /= np.linalg.norm(side)
        points.append((s * axis + 0.3 * side, -side + 0.3 * rng.standard_normal(3), rng.choice([0.0, 0.25, 0.6])))
    table, state = problem(
        points, axis=axis, velocity=rng.standard_normal(3) * 5, spin=np.cross(axis, rng.standard_normal(3))
    )
    before = np.column_stack([table["before_n"], table["before_t"], table["before_u"]])
    used, residual = solve(table, len(table), state, NO_ROLLING, (1e-11, 100_000), False)
    assert residual <= 1e-11, f"not solved in {used} sweeps"
    gamma = after(table, state)
    p = np.column_stack([table["pn"], table["pt"], table["pu"]])
    friction, slip = np.hypot(p[:, 1], p[:, 2]), np.hypot(gamma[:, 1], gamma[:, 2])
    assert np.all(p[:, 0] >= 0)
    assert np.all(friction <= table["mu"] * p[:, 0] * (1 + 1e-12))
    # a later contact of the last sweep moves an earlier one by at most the couplings (below 10) times the change
    assert np.all(gamma[:, 0] >= -1e-9)
    assert np.all(p[:, 0] * np.abs(gamma[:, 0]) <= 1e-8)
    sliding = (slip > 1e-6) & (p[:, 0] > 1e-6) & (table["mu"] > 0)
    assert np.all(friction[sliding] == pytest.approx(table["mu"][sliding] * p[sliding, 0], rel=1e-6))
    cosine = (p[:, 1:] * gamma[:, 1:]).sum(axis=1)[sliding] / (friction * slip)[sliding]
    assert np.all(cosine < -1 + 1e-6)
    assert 0.5 * (p * (gamma + before)).sum() <= 1e-12  # plastic impact with friction only takes energy


@pytest.mark.parametrize("sweeps", [1, 10_000])
def test_work_in_the_books_is_the_change_of_kinetic_energy(sweeps):
    """An identity of any impulses, whether the solve came to its end or was stopped after one sweep."""

    def kinetic(state):
        velocity, spin, axis = state[7:10], state[10:13], state[13:16]
        along = spin @ axis
        return 0.5 * (velocity @ velocity + LOG[TRANSVERSE] * (spin @ spin - along**2) + LOG[AXIAL] * along**2)

    rng = np.random.default_rng(9)
    for _ in range(100):
        axis = rng.standard_normal(3)
        axis /= np.linalg.norm(axis)
        points = []
        for _ in range(rng.integers(1, 6)):
            side = np.cross(axis, rng.standard_normal(3))
            side /= np.linalg.norm(side)
            place = rng.uniform(-LOG[CENTRE], LOG[LENGTH] - LOG[CENTRE]) * axis + 0.3 * side
            points.append((place, -side + 0.3 * rng.standard_normal(3), rng.choice([0.0, 0.25, 0.6])))
        table, state = problem(points, axis=axis, velocity=5 * rng.standard_normal(3), spin=rng.standard_normal(3))
        before = kinetic(state)
        solve(table, len(table), state, NO_ROLLING, (1e-12, sweeps), False)
        work = impulse_work(table, len(table), state, NO_ROLLING, 0.0)
        assert work == pytest.approx(kinetic(state) - before, abs=1e-10 * before)


def test_disc_minimises_energy():
    """The friction impulse is the minimum of a convex function on a disc, wherever the search for it starts."""
    rng = np.random.default_rng(3)
    for start in rng.choice([0.0, 0.1, 10.0, 1e4], 50):
        root = rng.standard_normal((2, 2))
        g = root @ root.T + 0.1 * np.eye(2)
        c, radius = rng.standard_normal(2), rng.uniform(0.01, 2.0)
        shift, found = start, []
        for _ in range(20):  # as in sweeps
            *found, shift = disc_impulse(g[0, 0], g[0, 1], g[1, 1], c[0], c[1], radius, shift)
        found = np.array(found)

        def energy(x, g=g, c=c, radius=radius):
            p = radius * np.tanh(x[0]) * np.array([np.cos(x[1]), np.sin(x[1])])
            return 0.5 * p @ g @ p + c @ p

        best = min(
            (minimize(energy, (0.5, a), options={"gtol": 1e-10}).fun for a in np.arange(0, 6.3, 1.0)), default=np.inf
        )
        assert np.hypot(*found) <= radius * (1 + 1e-12)
        assert 0.5 * found @ g @ found + c @ found <= best + 1e-8


@pytest.mark.parametrize("end", ["base", "tip"])
@pytest.mark.parametrize("tilt", [0.0, 30.0])
def test_dropped_on_one_end(end, tilt):
    """T46: frictionless drop at 5 m/s on a point of the axis' end: P = v / (1 + a^2/k^2), a the horizontal lever."""
    arm = LOG[CENTRE] if end == "base" else LOG[LENGTH] - LOG[CENTRE]
    k2 = LOG[TRANSVERSE]
    sign = -1.0 if end == "base" else 1.0
    angle = np.radians(tilt)
    axis = np.array([np.cos(angle), 0, -sign * np.sin(angle)])
    table, state = problem([(sign * arm * axis, (0, 0, 1), 0.0)], axis=axis, velocity=(0, 0, -5))
    solve(table, 1, state, NO_ROLLING, (1e-12, 1000), False)
    lever = arm * np.cos(angle)
    impulse = 5 / (1 + lever**2 / k2)
    assert -state[9] == pytest.approx(5 - impulse, abs=1e-9)
    assert np.linalg.norm(state[10:13]) == pytest.approx(impulse * lever / k2, abs=1e-9)
    if tilt == 0.0:
        published = {"base": (3.375733, 0.286426), "tip": (4.161623, 0.228481)}[end]
        assert (-state[9], np.linalg.norm(state[10:13])) == pytest.approx(published, abs=1e-6)


@pytest.mark.parametrize(
    ("offset", "speed", "turn"), [(0, 0, 0), (2, 0.564696, 0.282348), (5, 2.722286, 0.544457), (8, 4.891673, 0.611459)]
)
def test_sideways_against_a_tree(offset, speed, turn):
    """T47: v+ = 10 b^2/(k^2 + b^2), w+ = v+/b."""
    table, state = problem([((offset, 0, 0), (0, -1, 0), 0.0)], axis=(1, 0, 0), velocity=(0, 10, 0))
    solve(table, 1, state, NO_ROLLING, (1e-12, 1000), False)
    assert state[8] == pytest.approx(speed, abs=1e-6)
    assert abs(state[12]) == pytest.approx(turn, abs=1e-6)


@pytest.mark.parametrize("mu", [0.0, 1e9])
def test_one_impact_is_an_own_exact_solution(mu):
    """One contact anywhere on the log, without friction and with so much that it sticks: W P = -u, solved by itself.

    W = I/m - [r]x J [r]x, a 3 x 3 matrix of condition 1e3 at most here, so rounding is 1e-13 of the speeds.
    """
    rng, struck, condition = np.random.default_rng(0), 0, []
    for _ in range(300):
        axis = rng.standard_normal(3)
        axis /= np.linalg.norm(axis)
        side = np.cross(axis, rng.standard_normal(3))
        side /= np.linalg.norm(side)
        r = rng.uniform(-LOG[CENTRE], LOG[LENGTH] - LOG[CENTRE]) * axis + 0.3 * side
        normal = -side + 0.2 * rng.standard_normal(3)
        normal /= np.linalg.norm(normal)
        velocity, spin = 5.0 * rng.standard_normal(3), rng.standard_normal(3)
        table, state = problem([(r, normal, mu)], axis=axis, velocity=velocity, spin=spin)
        solve(table, 1, state, NO_ROLLING, (1e-14, 1000), False)
        cross = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
        inertia = np.eye(3) / LOG[TRANSVERSE] + (1 / LOG[AXIAL] - 1 / LOG[TRANSVERSE]) * np.outer(axis, axis)
        approach, delassus = velocity + np.cross(spin, r), np.eye(3) - cross @ inertia @ cross
        push = np.zeros(3)
        if normal @ approach < 0.0:
            condition.append(np.linalg.cond(delassus))
            push = -np.linalg.solve(delassus, approach)
            if mu == 0.0:
                push = -normal * (normal @ approach) / (normal @ delassus @ normal)
        if push @ normal < 0.0:
            continue  # to stick it would have to pull: another law
        struck += normal @ approach < 0.0
        exact = np.concatenate([velocity + push, spin + inertia @ np.cross(r, push)])
        assert state[7:13] == pytest.approx(exact, abs=1e-12 * np.linalg.norm(velocity))
    assert struck > 100
    assert max(condition) < 1e3


def test_two_trees_at_once():
    """T48: symmetric trees stop the log with equal impulses; of two on one side only the near one acts."""
    table, state = problem(
        [((5, 0, 0), (0, -1, 0), 0.0), ((-5, 0, 0), (0, -1, 0), 0.0)], axis=(1, 0, 0), velocity=(0, 10, 0)
    )
    solve(table, 2, state, NO_ROLLING, (1e-12, 10_000), False)
    assert state[7:13] == pytest.approx(np.zeros(6), abs=1e-9)
    assert table["pn"] == pytest.approx([5, 5], abs=1e-9)
    table, state = problem(
        [((8, 0, 0), (0, -1, 0), 0.0), ((2, 0, 0), (0, -1, 0), 0.0)], axis=(1, 0, 0), velocity=(0, 10, 0)
    )
    solve(table, 2, state, NO_ROLLING, (1e-13, 10_000), False)
    assert table[1].pn == pytest.approx(9.435304, abs=1e-6)
    assert table[0].pn == 0
    assert state[8] == pytest.approx(0.564696, abs=1e-6)
    assert after(table, state)[0, 0] == pytest.approx(1.694088, abs=1e-6)


@pytest.mark.parametrize("mu", [0.6, 1.0, 1.5, 10.0])
def test_painleve(mu):
    """T52: tip leading at 68 degrees from the horizontal, 5 m/s: beyond the critical mu (0.984) the contact sticks."""
    angle = np.radians(68)
    axis = np.array([np.cos(angle), 0, -np.sin(angle)])
    arm = (LOG[LENGTH] - LOG[CENTRE]) * axis
    falling = -9.81 * 0.002  # one step of gravity at 2 ms
    table, state = problem([(arm, (0, 0, 1), mu)], axis=axis, velocity=(5, 0, falling))
    used, residual = solve(table, 1, state, NO_ROLLING, (1e-12, 1000), False)
    assert residual <= 1e-12
    assert used < 20, "the exact block should not need many sweeps"
    p, gamma = (table[0].pn, table[0].pt, table[0].pu), after(table, state)[0]
    assert gamma[0] == pytest.approx(0, abs=1e-10)
    sideways = np.hypot(p[1], p[2])
    if mu == 0.6:
        assert (p[0], sideways) == pytest.approx((0.0296, 0.0178), abs=1e-4)
    else:
        assert (p[0], sideways) == pytest.approx((1.4628, 1.4281), abs=1e-4)
        assert np.hypot(gamma[1], gamma[2]) < 1e-9


def test_block_agrees_with_the_laws():
    """Where the exact block answers, its answer satisfies Signorini and Coulomb to rounding."""
    rng = np.random.default_rng(5)
    answered = 0
    for _ in range(300):
        table, _ = problem([(rng.standard_normal(3) * 8, rng.standard_normal(3), rng.uniform(0, 2))])
        c = rng.standard_normal(3)
        ok, pn, pt, pu = block_impulse(table[0], *c)
        if not ok:
            continue
        answered += 1
        t = table[0]
        g = np.array([[t.gnn, t.gnt, t.gnu], [t.gnt, t.gtt, t.gtu], [t.gnu, t.gtu, t.guu]])
        p = np.array([pn, pt, pu])
        gamma = c + g @ p
        friction, slip = np.hypot(pt, pu), np.hypot(gamma[1], gamma[2])
        scale = 1e-9 * max(1.0, np.abs(p).max() * np.abs(g).max())
        assert pn >= 0
        assert gamma[0] >= -scale
        assert pn * abs(gamma[0]) <= scale * max(1, pn)
        assert friction <= t.mu * pn * (1 + 1e-9)
        if slip > 1e-6 and pn > 0:
            assert friction == pytest.approx(t.mu * pn, rel=1e-9)
            assert p[1:] @ gamma[1:] == pytest.approx(-friction * slip, rel=1e-6, abs=scale)
    assert answered >= 297
