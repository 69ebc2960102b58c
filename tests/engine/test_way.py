"""The records of a log on its way: each column of the summary reaches the user. Its books: ``test_step``."""

from pathlib import Path

import numpy as np
import pytest

import deadwood_engine
from deadwood_engine.way import SUMMARY

FOLDER = Path(deadwood_engine.__file__).parent


@pytest.mark.parametrize("name", SUMMARY.names)
def test_each_column_of_the_summary_is_told(name):
    """``result_of`` makes a field of it, but for the two counts that ``slide`` cuts the tables by, and a part of the
    energy error."""
    elsewhere = {"hits": "slide", "influences": "slide", "energy_gain": "step"}
    text = (FOLDER / f"{elsewhere.get(name, 'result')}.py").read_text(encoding="utf-8")
    assert f'summary["{name}"]' in text or (name in elsewhere and f".{name}" in text)


def test_all_columns_are_of_one_width():
    """Nothing is cut on the way out: floats of 8 bytes, which hold every count that a slide comes to."""
    assert {SUMMARY[name] for name in SUMMARY.names or ()} == {np.dtype("f8")}
