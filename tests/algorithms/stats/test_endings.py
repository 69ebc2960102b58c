"""How logs ended: the same answer for numbers and words, for a single column and a table."""

from __future__ import annotations

import numpy as np
import pandas
import pytest

import deadwood_engine
from deadwood_algorithms import schemas
from deadwood_algorithms.stats.endings import ended, known_runouts, left_dem, reasons_in_words
from deadwood_algorithms.stats.order_statistics import percentile_record, quantiles

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


def test_a_log_without_a_deposit_went_farther_than_any_other():
    """Of 100 logs with run-outs of 1 to 100 m, the 30 that went farthest were lost at 40 m."""
    runout = np.arange(1.0, 101.0)
    words = np.array(["rest", "tree", "barrier", "lying_log", "block"] * 14 + ["left_dem", "time_limit", "failed"] * 10)
    runout[70:] = 40.0
    found = known_runouts(runout, words)
    assert found[:70].tolist() == runout[:70].tolist()
    assert np.isinf(found[70:]).all()
    middle, most = quantiles(found, [0.5, 0.95])
    assert middle == 50.5
    assert np.isnan(most), "among logs whose run-out is not known"
    assert np.quantile(runout, 0.95) < 70.0  # what counting them up to the edge would say
    record = percentile_record(found, 0.65)  # its interval of 95 % has ranks 56 to 75, of which the latter is not known
    assert np.isnan([record["value"], record["ci_low"], record["ci_high"]]).all()
    assert record["n_more"] == 0
