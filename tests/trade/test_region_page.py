"""The page of the region agrees with its two files of measurements, and its arithmetic is right."""

from __future__ import annotations

import json

import pytest

from benchmarks import engines, region_page, study

RESULTS = study.read_results()
BESIDE = json.loads(region_page.MEASURED.read_text(encoding="utf-8"))


def test_the_page_is_that_of_the_files():
    assert region_page.PAGE.read_text(encoding="utf-8") == engines.noted(region_page.page(RESULTS, BESIDE))


def test_every_number_says_where_it_comes_from():
    text = region_page.page(RESULTS, BESIDE)
    for source in (BESIDE["source"], RESULTS["entries"]["forest"]["standard"]["source"]):
        for what in ("machine", "versions", "engine", "date"):
            assert source[what] in text
    assert all(region.source and "https://" in region.source for region in region_page.REGIONS)


def test_the_arithmetic_by_hand():
    results = {"entries": {"gully": {"draft": {"cpu_ms_per_log": 18.0}}}}
    beside = {"other_cpu_s_per_log": 0.018, "other_cpu_s_per_run": 1.8}
    assert region_page.core_hours(results, beside, 1_000_000, 2_000, "gully", "draft") == pytest.approx(11.0)


def test_a_change_of_the_cost_changes_the_page():
    other = json.loads(json.dumps(RESULTS))
    other["entries"]["gully"]["standard"]["cpu_ms_per_log"] *= 2.0
    assert region_page.page(other, BESIDE) != region_page.page(RESULTS, BESIDE)


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.123, "0.12"), (9.94, "9.9"), (9.96, "10"), (99.6, "100"), (1349.0, "1 300"), (1.28e8, "130 000 000")],
)
def test_numbers_have_two_digits(value, text):
    assert region_page.round_number(value) == text


@pytest.mark.parametrize(
    ("low", "high", "text"), [(0.01, 0.1, "0.6 to 6 min"), (1.0, 12.0, "1 to 12 h"), (48.0, 480.0, "2 to 20 days")]
)
def test_times_are_reported_in_the_unit_of_the_longer(low, high, text):
    assert region_page.span(low, high) == text
