"""The planted errors of ``python -m tests.mutants`` have their places in the sources, and their tests exist."""

from __future__ import annotations

import pytest

from tests.mutants import MUTANTS, ROOT, TESTS, Mutant


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda each: each.name)
def test_a_planted_error_has_its_place(mutant: Mutant):
    assert (ROOT / mutant.file).read_text(encoding="utf-8").count(mutant.old) == 1
    assert [each for each in mutant.tests.split() if not (ROOT / TESTS / each).exists()] == []


def test_no_error_is_planted_twice():
    assert len({each.name for each in MUTANTS}) == len(MUTANTS)
