"""What a summary says of its model, and the same in German."""

from __future__ import annotations

import re

import pytest

from deadwood_algorithms.results.modelled import AMONG, BETWEEN, CLAUSES, clause, in_german

LIST = AMONG.join(clause(name) for name in ("no_poses", "no_trees"))
GERMAN_LIST = AMONG.join(CLAUSES[name][1] for name in ("no_poses", "no_trees"))


def gaps(text: str) -> set[str]:
    return set(re.findall(r"\{(\w+)\}", text))


@pytest.mark.parametrize("name", CLAUSES)
def test_every_clause_is_known_again(name):
    english, german = CLAUSES[name]
    assert gaps(english) == gaps(german)
    assert BETWEEN not in english
    numbers = {gap: f"{k}.5" for k, gap in enumerate(sorted(gaps(english)))}
    filled = {gap: LIST if gap == "parts" else number for gap, number in numbers.items()}
    expected = {gap: GERMAN_LIST if gap == "parts" else number.replace(".", ",") for gap, number in numbers.items()}
    assert in_german(clause(name, **filled)) == german.format(**expected)


def test_clauses_one_after_the_other():
    said = "Coulomb, 0.25 everywhere; 0.3 at stems and lying logs; 0.1 at barriers"
    assert in_german(said) == "Coulomb, überall 0,25; 0,3 an Bäumen und liegenden Stämmen; 0,1 an Barrieren"


def test_what_an_older_run_said_stays_as_it_was():
    assert in_german("a word of 2019; the whole DEM") == "a word of 2019; das ganze DEM"
