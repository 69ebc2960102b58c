"""Aitken's extrapolation: exact on a geometric sequence, and it stops where a contact opens and at the cones."""

import math

import numpy as np
import pytest

from deadwood_engine.extrapolation import before_unloading, go_ahead, sweeps_ahead
from deadwood_engine.limits import EXTRAPOLATE_ALIKE


@pytest.mark.parametrize("rate", [0.3, 0.9, 0.99, 0.9999])
def test_all_sweeps_to_come_of_one_mode(rate):
    """x + rate x + rate^2 x ... has its limit at x / (1 - rate): summed by hand and told from two changes."""
    change = np.array([0.3, -0.7, 0.2])
    now = rate * change
    times = sweeps_ahead(now @ change, change @ change, now @ now)
    place, step = now.copy(), now.copy()
    for _ in range(400_000 if rate > 0.99 else 5_000):
        step = rate * step
        place = place + step
    assert now + times * now == pytest.approx(place, rel=1e-9)


def test_an_undamped_mode_continues_for_ever_and_a_turning_one_gives_no_estimate():
    assert sweeps_ahead(1.0, 1.0, 1.0) == math.inf
    assert sweeps_ahead(1.2, 1.0, 1.44) == math.inf
    assert sweeps_ahead(0.0, 0.0, 0.0) == 0.0
    assert sweeps_ahead(-0.5, 1.0, 0.25) == 0.0  # to and fro
    for cosine, tells in ((EXTRAPOLATE_ALIKE - 1e-6, False), (EXTRAPOLATE_ALIKE + 1e-6, True)):
        assert (sweeps_ahead(cosine * 0.5, 1.0, 0.25) > 0.0) == tells


def test_it_stops_where_the_first_contact_lets_go(random_contacts):
    table = random_contacts(np.random.default_rng(0), 3)
    table["pn"], table["last_n"] = (1.0, 2.0, 3.0), (0.1, -0.02, -0.5)
    assert before_unloading(table, 3, 1000.0) == pytest.approx(6.0)
    assert before_unloading(table, 2, 1000.0) == pytest.approx(100.0)
    assert before_unloading(table, 1, 1000.0) == 1000.0


@pytest.mark.parametrize("seed", range(20))
def test_of_a_line_it_stops_where_an_end_lets_go(random_contacts, seed):
    """What counts is the share of the two ends, sum P s and sum P (1 - s), not the single contacts of the line."""
    rng = np.random.default_rng(seed)
    table = random_contacts(rng, 6)
    table["along"][1:5] = np.sort(rng.uniform(-3.0, 5.0, 4))
    table["line"][1:5] = 4, -1, -1, -1
    table["last_n"] = rng.normal(size=6)
    times = before_unloading(table, 6, 1e9)
    share = (table["along"][1:5] - table["along"][1]) / (table["along"][4] - table["along"][1])
    weights = np.zeros((4, 6))
    weights[0, 0] = weights[1, 5] = 1.0
    weights[2, 1:5], weights[3, 1:5] = share, 1.0 - share
    bears, changes = weights @ table["pn"], weights @ table["last_n"]
    most = min((-b / c for b, c in zip(bears, changes, strict=True) if c < 0.0), default=1e9)
    assert times == pytest.approx(most)


@pytest.mark.parametrize("seed", range(20))
def test_impulses_and_velocities_continue_together(random_contacts, seed):
    """Each stays in its cone, and the velocities change according to the remaining change of the impulses."""
    rng = np.random.default_rng(seed)
    table, times = random_contacts(rng, 5), rng.uniform(0.0, 50.0)
    for name in ("last_n", "last_t", "last_u"):
        table[name] = 0.05 * rng.normal(size=5)
    for name in "ntu":
        for axis in "xyz":
            table["b" + name + axis] = rng.normal(size=5)
    before, motion = table.copy(), rng.normal(size=6)
    found = np.ravel(go_ahead(table, 5, times, tuple(motion[:3]), tuple(motion[3:])))
    expected = motion.copy()
    for c, b in zip(table, before, strict=True):
        pn = max(0.0, b.pn + times * b.last_n)
        aside = np.array([b.pt + times * b.last_t, b.pu + times * b.last_u])
        aside *= min(1.0, b.mu * pn / np.hypot(*aside))
        assert (c.pn, c.pt, c.pu) == pytest.approx((pn, *aside), abs=1e-14)
        for name, q in zip("ntu", (c.pn - b.pn, c.pt - b.pt, c.pu - b.pu), strict=True):
            expected[:3] += q * np.array([b[name + axis] for axis in "xyz"])
            expected[3:] += q * np.array([b["b" + name + axis] for axis in "xyz"])
    assert found == pytest.approx(expected)
