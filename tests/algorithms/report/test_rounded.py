"""Numbers of the report: rounded as far as their interval allows."""

from __future__ import annotations

import pytest

from deadwood_algorithms.report.rounded import shown_number, with_interval
from deadwood_algorithms.report.words import Words
from deadwood_algorithms.stats.statistics import alike


@pytest.mark.parametrize(
    ("value", "low", "high", "signed", "text"),
    [
        (-0.004, -0.5, 0.4, True, "0.00 (−0.50 to +0.40)"),  # a value that rounds to zero has no sign
        (0.0, 0.0, 0.192, False, "0 (0 to 0.192)"),  # an exact zero needs no decimals
        (13.41, 13.1, 13.7, False, "13.41 (13.10 to 13.70)"),
        (75.2, 62.0, 88.0, False, "75 (62 to 88)"),
        (2.3e-15, 1.1e-15, 3.6e-15, False, "0 (0 to 0)"),  # a rounding residue of zero
        (-3e-12, -1e-11, 2e-12, True, "0 (0 to 0)"),
    ],
)
def test_a_number_with_its_interval(value, low, high, signed, text):
    assert with_interval(value, low, high, Words("en"), signed=signed) == text


@pytest.mark.parametrize(
    ("value", "text"), [(2.35e-15, "0"), (-6.3e-14, "0"), (2.5e-4, "0.00025"), (2.5e-5, "0.000025"), (1234.5, "1230")]
)
def test_a_number_without_an_interval(value, text):
    assert shown_number(value, Words("en")) == text


@pytest.mark.parametrize(
    ("values", "texts"),
    [
        ((21.4, 8.694, 32.2), ["21.4", "8.7", "32.2"]),  # as many decimals each
        ((0.25, 0.2, 0.3), ["0.25", "0.20", "0.30"]),
        ((0.25, 0.055, 0.315), ["0.250", "0.055", "0.315"]),  # given values lose no digit
        ((45.0, 32.0, 61.0), ["45", "32", "61"]),
        ((450.3, 380.21, 1210.7), ["450", "380", "1211"]),
        ((0.0, 0.0, 0.5), ["0.0", "0.0", "0.5"]),
        ((0.0, 0.0, 0.0), ["0", "0", "0"]),
    ],
)
def test_numbers_of_one_kind_have_as_many_decimals_each(values, texts):
    assert alike(values) == texts
