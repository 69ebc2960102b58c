"""Numbers of the report: rounded as far as their interval allows."""

from __future__ import annotations

import pytest

from deadwood_algorithms.report.rounded import area_unit, shown_alike, shown_number, with_interval
from deadwood_algorithms.report.words import Words
from deadwood_algorithms.stats.statistics import alike, percents_of


@pytest.mark.parametrize(
    ("value", "low", "high", "signed", "text"),
    [
        (-0.004, -0.5, 0.4, True, "0.00 (−0.50 to +0.40)"),  # a value that rounds to zero has no sign
        (0.0, 0.0, 0.192, False, "0 (0 to 0.192)"),  # an exact zero needs no decimals
        (13.41, 13.1, 13.7, False, "13.41 (13.10 to 13.70)"),
        (75.2, 62.0, 88.0, False, "75 (62 to 88)"),
        (3691.2, 1914.4, 4100.0, False, "3700 (1900 to 4100)"),  # before: 3691 (1914 to 4100)
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


@pytest.mark.parametrize(
    ("values", "texts"),
    [
        ((0.024, 0.24, 0.606, 5.08), ["0.02", "0.24", "0.61", "5.08"]),  # before: 0.0240 beside 5.08
        ((68.0, 32.3, None), ["68.0", "32.3", "–"]),  # before: 68 beside 32.3
        ((0.726, 13.6, 140.4), ["1", "14", "140"]),
        ((9298.4, 492.2, 2588.1), ["9300", "492", "2590"]),
        ((2.0, 4.0, float("nan")), ["2", "4", "–"]),
        ((0.0, 2e-15), ["0", "0"]),
        ((-0.001, 3.25), ["0.00", "3.25"]),  # a value that rounds to zero has no sign
    ],
)
def test_a_row_or_column_has_as_many_decimals_each(values, texts):
    assert shown_alike(values, Words("en")) == texts
    assert shown_alike(values, Words("it")) == [each.replace(".", ",") for each in texts]


@pytest.mark.parametrize(
    ("counts", "total", "texts"),
    [
        ((2, 26, 5, 1, 6), 40, ["5.0 %", "65.0 %", "12.5 %", "2.5 %", "15.0 %"]),  # before: 5.0, 65, 12, 2.5, 15
        ((650, 350), 1000, ["65.0 %", "35.0 %"]),
        ((6521, 3478, 1), 10_000, ["65.21 %", "34.78 %", "0.01 %"]),
        ((40, 0), 40, ["100 %", "0 %"]),
        ((130, 60), 1000, ["13.0 %", "6.0 %"]),  # not all logs
    ],
)
def test_shares_of_the_same_logs_have_as_many_decimals_and_add_up(counts, total, texts):
    assert percents_of(counts, total) == texts
    if sum(counts) == total:
        assert sum(float(each.removesuffix(" %")) for each in texts) == pytest.approx(100.0, abs=1e-9)


def test_small_areas_are_in_square_metres():
    """Before, 73 m² were 0.00730 ha beside 0.007 ha."""
    assert area_unit([73.0, 9_999.0]) == ("m²", 1.0)
    assert area_unit([73.0, 10_000.0]) == ("ha", 1e4)
