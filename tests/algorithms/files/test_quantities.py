"""Sizes in text cells: units, classes, words for gaps; anything else is not interpreted."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from deadwood_algorithms.files.quantities import is_gap, read_sizes


@pytest.mark.parametrize(
    ("cell", "unit", "value"),
    [
        ("41", "cm", 41.0),
        ("41,4 cm", "cm", 41.4),
        ("0.414 m", "cm", 41.4),
        ("414mm", "cm", 41.4),
        ("40-45", "cm", 42.5),
        ("40 bis 45 cm", "cm", 42.5),
        ("40–45", "cm", 42.5),
        ("12 ft", "m", 3.6576),
        ("-1", "cm", -1.0),
    ],
)
def test_a_size_is_read_in_the_unit_of_its_column(cell, unit, value):
    read = read_sizes(pd.Series([cell]), unit)
    assert read.values[0] == pytest.approx(value)
    assert not read.unread[0]


@pytest.mark.parametrize("cell", ["thick", "45-40", ">60", "40-45-50", "12 kg", "1.234,5"])
def test_what_is_no_size_stays_unread(cell):
    assert read_sizes(pd.Series([cell]), "cm").unread[0]


@pytest.mark.parametrize(
    "cell", ["k.A.", "k. A.", "#NV", "n/d", "nd", "#N/A", " - ", "keine Angabe", "?", None, np.nan]
)
def test_words_for_a_gap_are_gaps(cell):
    read = read_sizes(pd.Series([cell, "3"], dtype=object), "cm")
    assert np.isnan(read.values[0])
    assert not read.unread.any()


def test_points_and_commas_in_one_column_are_left_unread():
    assert read_sizes(pd.Series(["1.234", "35,5 cm"]), "cm").unread.all()


def test_a_number_is_no_gap():
    assert not any(map(is_gap, ("0", "7", "-1", "tot", "lebend")))


def test_classes_are_counted_and_one_is_shown():
    read = read_sizes(pd.Series(["40-45", "41", "50-55"]), "cm")
    assert (read.classes, read.example) == (2, "40-45")
