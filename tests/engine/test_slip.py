"""The law of slip alone: what a body's slip grows by and decays to, and the coefficient that comes of it."""

import numpy as np
import pytest

from deadwood_engine.contacts import CONTACT, KEY_WIDTH, TERRAIN
from deadwood_engine.cores import TREE
from deadwood_engine.slip import scarred, slip_after


def table(*contacts):
    """Contacts (kind, push)."""
    found, keys = np.zeros(len(contacts), CONTACT).view(np.recarray), np.zeros((len(contacts), KEY_WIDTH), np.int64)
    for k, (kind, push) in enumerate(contacts):
        keys[k, 0], found[k].pn = kind, push
    return found, keys


def test_slip_grows_by_the_way_of_the_centre_while_the_ground_pushes_and_decays_otherwise():
    state = np.zeros(16)
    state[7:10] = 1.0, 2.0, -2.0  # 3 m/s
    on_ground = table((TREE, 9.0), (TERRAIN, 0.0), (TERRAIN, 3.0), (TERRAIN, 1.0))
    assert slip_after(*on_ground, 4, state, 0.5, 10.0, 0.01) == pytest.approx(0.53)
    in_the_air = table((TREE, 9.0), (TERRAIN, 0.0))
    assert slip_after(*in_the_air, 2, state, 0.5, 10.0, 0.01) == pytest.approx(0.5 * np.exp(-0.1))
    slip = 0.5
    for _ in range(100):  # any steps: the same decay
        slip = slip_after(*in_the_air, 2, state, slip, 10.0, 0.003)
    assert slip == pytest.approx(0.5 * np.exp(-3.0))


def test_the_coefficient_goes_from_its_least_to_its_most():
    assert scarred(0.3, 2.0, 0.0, 5.0) == scarred(0.3, 2.0, 1.5, 0.0) == 0.3
    assert scarred(0.3, 2.0, 4.0, 0.25) == pytest.approx(1.15)  # halfway at 1/kappa
    assert scarred(0.3, 2.0, 4.0, 1e9) == pytest.approx(2.0)
    assert scarred(0.3, 0.2, 4.0, 1e9) == 0.3  # ground that holds more than that already
