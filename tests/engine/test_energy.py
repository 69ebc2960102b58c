"""The work of contacts against the change of kinetic energy, for impulses that no solver has seen."""

import numpy as np
import pytest

from deadwood_engine.energy import contact_work, impulse_work
from deadwood_engine.rolling import ROLLING
from deadwood_engine.rotation import spin_of

G_DT = 0.3  # [m/s] of gravity in a step


def motion(rng):
    """Inertia matrix [m2] of a slender body, and its state before the impulses."""
    state = np.zeros(16)
    state[7:13] = rng.normal(size=6)
    axis = rng.normal(size=3)
    state[13:16] = axis / np.linalg.norm(axis)
    transverse, axial = 5.0, 0.2
    return transverse * np.eye(3) + (axial - transverse) * np.outer(state[13:16], state[13:16]), axial, state


def pushed(inertia, table, moment, state):
    """The state after the impulses P at r of the table and a moment about the axis: Newton and Euler, in NumPy."""
    after = state.copy()
    for c in table:
        n, t, u = (np.array([c[name + axis] for axis in "xyz"]) for name in "ntu")
        p = c.pn * n + c.pt * t + c.pu * u
        after[7:10] += p
        after[10:13] += np.linalg.solve(inertia, np.cross([c.rx, c.ry, c.rz], p))
    after[10:13] += np.linalg.solve(inertia, moment * state[13:16])
    return after


def booked(table, state, fall):
    """Enter the relative velocities before the step's impulses; ``fall`` is what gravity adds before the node."""
    velocity, spin = state[7:10] + np.array([0.0, 0.0, fall]), state[10:13]
    for c in table:
        point = velocity + np.cross(spin, [c.rx, c.ry, c.rz])
        for name in "ntu":
            c["before_" + name] = point @ [c[name + axis] for axis in "xyz"]


def kinetic(inertia, state, fall=0.0):
    v = state[7:10] + np.array([0.0, 0.0, fall])
    return 0.5 * (v @ v + state[10:13] @ inertia @ state[10:13])


def rolling_of(axial, moment, spin):
    return np.array([(moment, 0.0, spin, axial, 1.0)], ROLLING).view(np.recarray)[0]


@pytest.mark.parametrize("seed", range(20))
def test_work_is_the_change_of_kinetic_energy_at_the_node(random_contacts, seed):
    """Eq. [f], with the moment against rolling: velocities that already hold gravity's half of the way ahead."""
    rng = np.random.default_rng(seed)
    inertia, axial, state = motion(rng)
    table, moment = random_contacts(rng, 4), rng.normal()
    booked(table, state, 0.0)
    after = pushed(inertia, table, moment, state)
    after[9] -= 0.5 * G_DT
    rolling = rolling_of(axial, moment, spin_of(state))
    work = impulse_work(table, 4, after, rolling, 0.5 * G_DT)
    assert work == pytest.approx(kinetic(inertia, after, 0.5 * G_DT) - kinetic(inertia, state), abs=1e-12)
    parts = [contact_work(c, after, 0.5 * G_DT) for c in table]
    rolling.moment = 0.0
    assert impulse_work(table, 4, after, rolling, 0.5 * G_DT) == pytest.approx(sum(parts))
    table[1].pn = 0.0  # what does not push does no work
    parts[1] = 0.0
    assert impulse_work(table, 4, after, rolling, 0.5 * G_DT) == pytest.approx(sum(parts))
