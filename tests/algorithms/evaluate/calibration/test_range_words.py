"""The ends of a range with a single coefficient are not measured: the sweep is coarser than the event."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_algorithms.evaluate.calibration.answer import sentence_of
from deadwood_algorithms.evaluate.calibration.score import Scores, range_of


@pytest.mark.parametrize(
    ("p", "one"),
    [
        ([0.001, 1.0, 0.001, 0.001], True),  # once "0.205 to 0.395", of likelihoods of 1e-35 at 0.2 and 0.4
        ([0.001, 1.0, 0.4, 0.001], False),
        ([1.0, 0.001, 0.001, 0.001], False),  # the sweep ends there, which is said
    ],
)
def test_one_coefficient_alone_is_reported(p, one):
    scores = Scores(np.array(p), np.array(p), np.array(p), np.array(p), np.array(p))
    found = range_of(np.array([0.2, 0.3, 0.4, 0.5]), scores)
    assert found is not None
    assert found.one == one
    assert ("finer sweep around it" in sentence_of(found, fits=True, best=found.best)) == one
