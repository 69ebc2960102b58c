"""The contact solver's local solves on public frictional-contact problems (Siconos' test data, 1 to 52 contacts).

The engine's ``solve`` works on one rigid body: its Delassus matrix has rank 6 and is never formed. The public problems
are of many bodies, or of one flexible object (OneObject-*: rank about 50 of 75), so none can be put into its table.
Tested here are the two local solves that it is made of, ``disc_impulse`` and ``block_impulse``, chosen by the rule
that ``solve`` uses, in a plain Gauss-Seidel over the given W. So these tests show that the local solves and their
alternation solve problems that others posed, with redundant contacts and strong coupling; they do not show that the
engine's matrix-free bookkeeping is right (test_contact_solver.py does, by the laws of contact).

Judged by the residual of the natural map relative to |q|, and by velocities, which two orders of sweeping must agree
on. Reactions of redundant contacts are not unique and are not compared.

Problem: u = W r + q; u_N + mu |u_T| >= 0, r in Coulomb's cone, complementary. Order in a contact: normal, t1, t2. The
data are read where they lie beside the repository, and are no part of it.
"""

from pathlib import Path

import numpy as np
import pytest

from deadwood_engine.contact_solver import block_impulse, disc_impulse
from deadwood_engine.contacts import CONTACT
from deadwood_engine.limits import BLOCK_SWEEPS, EXACT_BLOCK_COUPLING

DATA = Path(__file__).parents[3] / "shared" / "data" / "fclib"
# (problem, sweeps granted, natural-map residual relative to |q|)
PROBLEMS = [
    ("FrictionContact3D_1c", 100, 1e-10),
    ("FC3D_Example1", 100, 1e-10),
    ("FC3D_Example1_SBM", 100, 1e-10),
    ("Rover4396", 100, 1e-10),
    ("Rover1039", 100, 1e-10),
    ("Rover1040", 100, 1e-10),
    ("NESpheres_10_1", 100, 1e-10),
    ("Confeti-ex13-4contact-Fc3D-SBM", 100, 1e-10),
    ("OneObject-i1028-138.hdf5", 2500, 2e-9),
    ("OneObject-i100000-499.hdf5", 2500, 2e-9),
    ("OneObject-i100000-316.hdf5", 2500, 2e-9),
]


def read(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """W, q and mu of a problem."""
    path = DATA / f"{name}.dat"
    if not path.exists():
        pytest.skip(f"{path.name} lies beside no checkout here")
    words = iter(path.read_text().split())

    def integers(count: int) -> list[int]:
        return [int(next(words)) for _ in range(count)]

    def numbers(count: int) -> np.ndarray:
        return np.array([float(next(words)) for _ in range(count)])

    dimension, number, sparse = integers(3)
    assert dimension == 3
    size = 3 * number
    assert integers(2) == [size, size]
    if sparse:
        blocks, rows, columns = integers(3)
        integers(rows + columns)  # cumulative sizes: 3, 6, 9, ...
        starts, filled = integers(2)
        start, column = integers(starts), integers(filled)
        w = np.zeros((size, size))
        place = [(i, column[k]) for i in range(starts - 1) for k in range(start[i], start[i + 1])]
        for k, (i, j) in enumerate(place):
            assert integers(1) == [k]
            w[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] = numbers(9).reshape(3, 3).T
        assert len(place) == blocks
    else:
        integers(2)
        w = numbers(size * size).reshape(size, size).T
    return w, numbers(size), numbers(number)


def gauss_seidel(
    w: np.ndarray, q: np.ndarray, mu: np.ndarray, sweeps: int, accuracy: float, *, backward: bool = False
) -> tuple[np.ndarray, int]:
    """Impulses by sweeps of the engine's local solves, as ``solve`` alternates them: (impulses, sweeps used)."""
    p = np.zeros_like(q)
    order = range(len(mu))[:: -1 if backward else 1]
    rows = np.zeros(len(mu), CONTACT).view(np.recarray)
    for k in order:
        block = w[3 * k : 3 * k + 3, 3 * k : 3 * k + 3]
        row = rows[k]
        row.gnn, row.gnt, row.gnu, row.gtt, row.gtu, row.guu = block[[0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]
        row.mu = mu[k]
    for used in range(1, sweeps + 1):
        for k in order:
            mine = slice(3 * k, 3 * k + 3)
            row = rows[k]
            gnn, gnt, gnu, gtt, gtu, guu = row.gnn, row.gnt, row.gnu, row.gtt, row.gtu, row.guu
            block = np.array([[gnn, gnt, gnu], [gnt, gtt, gtu], [gnu, gtu, guu]])
            free = q[mine] + w[mine] @ p - block @ p[mine]
            solved, impulse = False, []
            if used <= BLOCK_SWEEPS and mu[k] * np.hypot(gnt, gnu) > EXACT_BLOCK_COUPLING * gnn:
                solved, *impulse = block_impulse(row, *free)
            if not solved:
                before = p[mine]
                normal = max(0.0, -(free[0] + gnt * before[1] + gnu * before[2]) / gnn)
                *tangent, row.shift = disc_impulse(
                    gtt, gtu, guu, free[1] + gnt * normal, free[2] + gnu * normal, mu[k] * normal,
                    row.shift,
                )  # fmt: skip
                impulse = [normal, *tangent]
            p[mine] = impulse
        if residual(w, q, mu, p) < accuracy:
            return p, used
    return p, sweeps


def residual(w: np.ndarray, q: np.ndarray, mu: np.ndarray, p: np.ndarray) -> float:
    """Natural map, relative to |q|: p less the projection of p - (u + mu |u_T| n) on Coulomb's cone."""
    p = p.reshape(-1, 3)
    u = (w @ p.ravel() + q).reshape(-1, 3)
    u[:, 0] += mu * np.hypot(u[:, 1], u[:, 2])
    trial = p - u
    normal, tangent = trial[:, 0], np.hypot(trial[:, 1], trial[:, 2])
    onto = np.maximum(0.0, (normal + mu * tangent) / (1 + mu**2))
    inside, polar = tangent <= mu * normal, mu * tangent <= -normal
    onto = np.where(inside, normal, np.where(polar, 0.0, onto))
    share = np.where(inside, 1.0, np.where(polar, 0.0, mu * onto / np.maximum(tangent, 1e-300)))
    projected = np.column_stack([onto, share * trial[:, 1], share * trial[:, 2]])
    return float(np.linalg.norm(p - projected) / np.linalg.norm(q))


@pytest.mark.parametrize(("name", "sweeps", "accuracy"), PROBLEMS, ids=[name for name, _, _ in PROBLEMS])
def test_public_problem(name, sweeps, accuracy):
    """Solved to the residual that a plain projected Gauss-Seidel reaches, in the cone, giving no energy."""
    w, q, mu = read(name)
    p, used = gauss_seidel(w, q, mu, sweeps, accuracy)
    assert residual(w, q, mu, p) < accuracy, f"after {used} sweeps"
    contact = p.reshape(-1, 3)
    assert (contact[:, 0] >= 0).all()
    assert (np.hypot(contact[:, 1], contact[:, 2]) <= mu * contact[:, 0] * (1 + 1e-9)).all()
    # plastic impact with friction takes energy: p . (u + q) / 2 <= 0
    assert p @ (w @ p + 2 * q) <= 1e-9 * np.linalg.norm(p) * np.linalg.norm(q)


@pytest.mark.parametrize("name", ["Rover1039", "Rover1040", "NESpheres_10_1", "Confeti-ex13-4contact-Fc3D-SBM"])
def test_order_of_sweeps_does_not_change_velocities(name):
    """Backward sweeps find the same contact velocities, whatever they make of the reactions."""
    w, q, mu = read(name)
    velocities = [w @ gauss_seidel(w, q, mu, 200, 1e-12, backward=way)[0] + q for way in (False, True)]
    assert np.abs(velocities[0] - velocities[1]).max() < 1e-8 * np.linalg.norm(q)


def test_residual_sees_errors():
    """The residual: zero for a known stick, slip and separation, of the size of the error for perturbed ones."""
    w, mu = np.eye(3), np.array([0.5])
    for q, p in [((-1, 0.2, 0), (1, -0.2, 0)), ((-1, 2.0, 0), (1, -0.5, 0)), ((1, 2.0, 0), (0, 0, 0))]:
        q, p = np.array(q, float), np.array(p, float)
        assert residual(w, q, mu, p) < 1e-15
        assert residual(w, q, mu, p + np.array([0.1, 0, 0])) > 0.01
        assert residual(w, q, mu, p + np.array([0, 0, 0.1])) > 0.01
