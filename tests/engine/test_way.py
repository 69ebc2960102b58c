"""The records of a log on its way: each column of the summary reaches the user. Its books: ``test_step``."""

from pathlib import Path

import numpy as np
import pytest

import deadwood_engine
from deadwood_engine.way import SUMMARY

FOLDER = Path(deadwood_engine.__file__).parent


@pytest.mark.parametrize("name", SUMMARY.names)
def test_each_column_of_the_summary_is_reported(name):
    """``result_of`` makes a field of it, but for the counts that ``slide`` cuts the tables by, and a part of the
    energy error."""
    elsewhere = {"hits": "slide", "poses": "slide", "influences": "slide", "energy_gain": "step"}
    text = (FOLDER / f"{elsewhere.get(name, 'result')}.py").read_text(encoding="utf-8")
    assert f'summary["{name}"]' in text or (name in elsewhere and f".{name}" in text)


def test_counts_are_whole_numbers():
    """Nothing is rounded or cut on the way out: counts and codes are integers of 8 bytes, all that is measured floats
    of 8."""
    counts = {"reason", "item_row", "unconverged", "steps", "airborne", "contacts", "sweeps", "tree_hits"}
    counts |= {"barrier_hits", "hits", "poses", "influences"}
    for name in SUMMARY.names or ():
        kind = "i8" if name in counts else "b1" if name == "started_in_contact" else "f8"
        assert SUMMARY[name] == np.dtype(kind), name
