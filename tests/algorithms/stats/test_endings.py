"""How logs ended: the same answer for numbers and words, for a single column and a table."""

from __future__ import annotations

import numpy as np
import pandas
import pytest

import deadwood_engine
from deadwood_algorithms import schemas
from deadwood_algorithms.stats.endings import ended, left_dem, reasons_in_words

NUMBERS = np.array([0, 3, 2, 7, 3], np.int8)
WORDS = ["rest", "left_dem", "barrier", "block", "left_dem"]


def test_the_words_are_the_engine_s():
    assert schemas.STOP_REASONS == deadwood_engine.STOP_REASONS


@pytest.mark.parametrize(
    "logs",
    [
        NUMBERS,
        np.array(WORDS, object),
        {"stop_reason": NUMBERS},
        pandas.DataFrame({"stop_reason": WORDS}),
        pandas.DataFrame({"stop_reason": pandas.Categorical(WORDS)}),
    ],
    ids=["numbers", "words", "by log", "table", "categories"],
)
def test_reasons_are_numbers_or_words(logs):
    assert left_dem(logs).tolist() == [False, True, False, False, True]
    assert ended(logs, "block").tolist() == [False, False, False, True, False]
    assert not ended(logs, "failed").any()


def test_numbers_in_words():
    assert reasons_in_words({"stop_reason": NUMBERS}).tolist() == WORDS
