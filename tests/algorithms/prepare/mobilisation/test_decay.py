"""Stages of decay, and the years since death at which wood of a species is in them."""

from __future__ import annotations

import pytest

from deadwood_algorithms.params.presets import BEECH, SPRUCE
from deadwood_algorithms.prepare.mobilisation import decay


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("II", "possible"), ("3", "possible"), ("stage iii", "possible"), ("late II", "critical"),
        ("early 3", "critical"), ("Early  III", "critical"), ("early II", "outside"), ("late III", "outside"),
        ("I", "outside"), ("late I", "outside"), ("IV", "outside"), ("5", "outside"), ("2.5", "critical"),
        ("3,4", "critical"), ("3.5", "outside"), ("2.4", "outside"), ("VI", None), ("0", None), ("late 2.5", None),
        ("rotten", None), ("", None),
    ],
)  # fmt: skip
def test_stages_of_decay(word, expected):
    assert decay.of_stage(word) == expected


@pytest.mark.parametrize(
    ("species", "years", "expected"),
    [
        ("Picea abies", 2.0, "critical"), ("Fichte", 5.0, "critical"), ("spruce", 5.1, "outside"),
        ("spruce", 1.9, "outside"), ("", 3.0, "critical"), ("Abies alba", 3.0, "critical"),
        # 2 to 5 years times 0.033 / 0.054: 1.22 to 3.06
        ("Fagus sylvatica", 1.3, "critical"), ("Buche", 1.2, "outside"), ("beech", 3.0, "critical"),
        ("Hêtre", 3.1, "outside"),
        # times 0.033 / 0.032: 2.06 to 5.16
        ("Pinus sylvestris", 5.1, "critical"), ("Waldföhre", 2.05, "outside"), ("pin", 2.1, "critical"),
    ],
)  # fmt: skip
def test_years_since_death(species, years, expected):
    assert decay.of_years(years, species, (2.0, 5.0)) == expected


@pytest.mark.parametrize(
    ("years", "species", "expected"),
    [
        (2.0, "", decay.CRITICAL), (5.0, "Picea abies", decay.CRITICAL), (1.99, "", decay.OUTSIDE),
        (2.0 * SPRUCE.rate / BEECH.rate + 1e-9, "Buche", decay.CRITICAL),
        (5.0 * SPRUCE.rate / BEECH.rate + 1e-9, "Buche", decay.OUTSIDE), (3.0, "unknown tree", decay.CRITICAL),
    ],
)  # fmt: skip
def test_years_hold_both_ends_of_their_window(years, species, expected):
    assert decay.of_years(years, species, (2.0, 5.0)) == expected


@pytest.mark.parametrize(("word", "expected"), [("2.49", "outside"), ("2.5", "critical"), ("3.49", "critical")])
def test_stages_at_the_ends_of_what_is_critical(word, expected):
    assert decay.of_stage(word) == expected
