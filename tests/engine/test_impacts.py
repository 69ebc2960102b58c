"""Impulses that are admissible [n]: in their cones, no contact approaches, no work is done; on problems at random, on
such as no solver can finish, and on such as Newton's law gives energy to."""

import numpy as np
import pytest

from deadwood_engine.contact_solver import solve
from deadwood_engine.contacts import CONTACT, KEY_WIDTH, Ahead, Found, add_contact, set_frames
from deadwood_engine.energy import impulse_work
from deadwood_engine.impacts import largest_share, make_admissible
from deadwood_engine.log_body import AXIAL, CENTRE, LENGTH, TRANSVERSE, cone_bodies
from deadwood_engine.rotation import spin_of
from deadwood_engine.scratch import Scratch

pytestmark = pytest.mark.engine_alone

LOG = cone_bodies(np.array([0.75]), np.array([30.0]), np.array([300.0]))[0]
TIGHT = 1e-9


def problem(rng, number, *, restitution, wedge=False):
    """A log with contacts at random, all closed, and its state before their impulses. In a wedge the later contacts are
    opposite to earlier ones, so that no motion leaves both."""
    axis = rng.standard_normal(3)
    axis /= np.linalg.norm(axis)
    state = np.zeros(16)
    state[3], state[13:16] = 1.0, axis
    state[7:10], state[10:13] = 5.0 * rng.standard_normal(3), 0.3 * rng.standard_normal(3)
    table, keys = np.zeros(number, CONTACT).view(np.recarray), np.zeros((number, KEY_WIDTH), np.int64)
    places = []
    for k in range(number):
        side = np.cross(axis, rng.standard_normal(3))
        side /= np.linalg.norm(side)
        place = rng.uniform(-LOG[CENTRE], LOG[LENGTH] - LOG[CENTRE]) * axis + 0.3 * side
        normal = -side + 0.3 * rng.standard_normal(3)
        if wedge and k >= number // 2:
            place, normal = places[k - number // 2]
            normal = -normal
        places.append((place, normal))
        normal = normal / np.linalg.norm(normal)
        step = Ahead(1e-9, 0.0, 1e-9, restitution, -1.0, 0.0)
        found = Found((0, k, 0), tuple(place), tuple(normal), -1.0, rng.choice([0.0, 0.3, 0.6, 1.2]))
        add_contact(table, keys, k, state, found, step, False)
    set_frames(table, number, state, LOG)
    return table, state


def kinetic(state):
    velocity, spin, axis = state[7:10], state[10:13], state[13:16]
    along = spin @ axis
    return 0.5 * (velocity @ velocity + LOG[TRANSVERSE] * (spin @ spin - along**2) + LOG[AXIAL] * along**2)


def approach(table, state):
    """Of each contact, how fast [m/s] it closes after the impulses."""
    n = np.array([[c[name + axis] for axis in "xyz"] for c in table for name in ("n",)])
    lever = np.array([[c["rn" + axis] for axis in "xyz"] for c in table])
    return -(n @ state[7:10] + lever @ state[10:13])


def made_admissible(table, state, sweeps):
    """As a step does it: solved, and put right where that found no end or gave energy."""
    scratch = Scratch.allocate(8, 1, 1, None)._replace(contacts=table)
    free, rolling, way = state[7:13].copy(), scratch.rolling[0], scratch.way[0]
    rolling.inertia, rolling.skin, rolling.spin_before = LOG[AXIAL], 0.3, spin_of(state)
    _, way.residual = solve(table, len(table), state, rolling, (TIGHT, sweeps), False)
    way.tolerance = TIGHT
    gained = impulse_work(table, len(table), state, rolling, 0.0)
    left = gained
    if way.residual > TIGHT or gained > 0.0:
        left, _ = make_admissible(scratch, len(table), state, LOG, free, gained, sweeps)
    return gained, left, way.residual


def check(table, state, before, left, *, tolerance):
    friction = np.hypot(table["pt"], table["pu"])
    assert (table["pn"] >= 0.0).all()
    assert (friction <= table["mu"] * table["pn"] * (1.0 + 1e-9) + 1e-12).all()
    assert approach(table, state).max() <= tolerance
    assert kinetic(state) - before == pytest.approx(left, abs=1e-9 * before)  # the books tell the truth
    assert left <= 1e-9 * before


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.8, 1.0])
@pytest.mark.parametrize("seed", range(60))
def test_no_contact_approaches_and_none_gives_energy(seed, restitution):
    """Whatever Newton's law, contact by contact, demanded. A later contact of the last sweep moves an earlier one by
    the couplings (below 10) times the tolerance, and there are up to six.
    """
    rng = np.random.default_rng(seed)
    table, state = problem(rng, int(rng.integers(1, 7)), restitution=restitution)
    before = kinetic(state)
    _, left, residual = made_admissible(table, state, 20_000)
    assert residual <= TIGHT
    check(table, state, before, left, tolerance=60 * TIGHT)


def test_newton_s_law_gives_energy_in_some_of_these():
    """Or the test above shows nothing."""
    gains = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        table, state = problem(rng, int(rng.integers(1, 7)), restitution=0.8)
        gains += made_admissible(table, state, 20_000)[0] > 0.0
    assert gains > 3


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("seed", range(40))
def test_a_wedge_that_no_motion_leaves_on_both_sides(seed, restitution):
    """Newton's law demands the impossible, and sweeps do not converge. No work is done however few sweeps are
    permitted;
    the log is kept out as soon as there are enough.
    """
    for sweeps in (1, 5, 50, 20_000):
        rng = np.random.default_rng(seed)
        table, state = problem(rng, 2 * int(rng.integers(1, 4)), restitution=restitution, wedge=True)
        before = kinetic(state)
        _, left, _ = made_admissible(table, state, sweeps)
        # between two faces that are opposite the log moves along them, at 1e-6 of its speed
        check(table, state, before, left, tolerance=1e-5 if sweeps == 20_000 else np.inf)


@pytest.mark.parametrize("seed", range(20))
def test_the_largest_share_that_gives_nothing(seed):
    """Against a thousand shares tried one by one."""
    rng = np.random.default_rng(seed)
    held, gained, parting = rng.uniform(-1.0, 0.2), rng.uniform(-0.5, 1.0), rng.uniform(0.0, 2.0)
    share = largest_share(held, gained, parting)

    def work(s):
        return held + s * (gained - held - parting) + s * s * parting

    tried = np.linspace(0.0, 1.0, 1001)
    allowed = tried[work(tried) <= max(0.0, held) + 1e-12]
    assert share == pytest.approx(allowed.max(), abs=1.1e-3)
    assert work(share) <= max(0.0, held) + 1e-12


@pytest.mark.parametrize("restitution", [0.2, 1.0])
def test_a_single_contact_keeps_newton_s_law(restitution):
    """One closed contact without friction: gamma+ = -e gamma-, and the log keeps e^2 of that part of its energy."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        table, state = problem(rng, 1, restitution=restitution)
        table["mu"] = 0.0
        before = approach(table, state)[0]
        _, left, _ = made_admissible(table, state, 1000)
        if before > 0.0:
            assert approach(table, state)[0] == pytest.approx(-restitution * before, abs=1e-9)
            assert left == pytest.approx(-0.5 * (1.0 - restitution**2) * before**2 / table["gnn"][0], rel=1e-9)
