"""A summary's description of its model: clauses from records."""

from __future__ import annotations

from deadwood_algorithms.results.modelled import BETWEEN, CLAUSES, in_words

FRICTION = [
    {"clause": "friction", "mu": 0.25},
    {"clause": "at_stems", "value": 0.3},
    {"clause": "at_barriers", "value": 0.1},
]


def test_clauses_one_after_the_other():
    assert in_words(FRICTION) == "Coulomb, 0.25 everywhere; 0.3 at stems and lying logs; 0.1 at barriers"
    assert all(BETWEEN not in each for each in CLAUSES.values())


def test_another_language_has_its_own_words_and_signs():
    german = {
        "friction": "Coulomb, überall {mu}",
        "at_stems": "{value} an Bäumen",
        "at_barriers": "{value} an Barrieren",
    }
    said = in_words(FRICTION, german.__getitem__, lambda number: number.replace(".", ","))
    assert said == "Coulomb, überall 0,25; 0,3 an Bäumen; 0,1 an Barrieren"


def test_whole_numbers_stay_whole_and_a_list_is_reported_by_its_names():
    assert in_words([{"clause": "terrain", "nx": 1234567, "ny": 2, "cell_m": 0.5}]).startswith(
        "bilinear surface through 1234567 × 2 cells of 0.5 m"
    )
    assert in_words([{"clause": "not_computed", "parts": ["no_poses", "no_trees"]}]) == (
        "not computed: poses and trajectories (--trajectories none), hits of trees (no trees)"
    )
