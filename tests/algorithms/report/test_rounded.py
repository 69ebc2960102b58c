"""Numbers of the report: rounded as far as their interval allows."""

from __future__ import annotations

import pytest

from deadwood_algorithms.report.rounded import shown_number, with_interval
from deadwood_algorithms.report.words import Words


@pytest.mark.parametrize(
    ("value", "low", "high", "signed", "text"),
    [
        (-0.004, -0.5, 0.4, True, "0.00 (−0.50 to +0.40)"),  # what rounds to nothing has no sign
        (0.0, 0.0, 0.192, False, "0 (0 to 0.192)"),  # an exact zero needs no decimals
        (13.41, 13.1, 13.7, False, "13.41 (13.10 to 13.70)"),
        (75.2, 62.0, 88.0, False, "75 (62 to 88)"),
        (2.3e-15, 1.1e-15, 3.6e-15, False, "0 (0 to 0)"),  # what arithmetic leaves of nothing
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
