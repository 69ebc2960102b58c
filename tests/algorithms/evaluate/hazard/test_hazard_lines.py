"""What a hazard map reports on its events and on logs that left: the frequencies of two areas add up, as stated."""

from __future__ import annotations

import pytest

from deadwood_algorithms.evaluate.hazard.hazard_lines import event_lines, line_words
from deadwood_algorithms.stats.statistics import bounds_if_lost, reach_record


@pytest.mark.parametrize(
    ("rates", "logs", "words"),
    [
        ([1 / 30], 1, "events: 0.0333 a year, 1 log each"),
        ([1 / 30] * 2, 3, "events: 0.0333 a year in each of 2 release areas, 3 logs each; together 0.0667 a year"),
        (
            [0.1, 0.02, 0.03],
            1,
            "events: 0.02 to 0.1 a year in each of 3 release areas, 1 log each; together 0.15 a year",
        ),
    ],
)
def test_frequencies_are_those_of_each_area(rates, logs, words):
    assert event_lines({"areas": [{"events_per_year": each} for each in rates], "logs_per_event": logs}) == [words]


def test_without_frequencies_there_are_no_events():
    assert event_lines({}) == []


def test_a_line_says_what_the_logs_that_left_may_do():
    row = {"line_id": "road", "at_least_kj": 0.0, **reach_record(12, 120), **bounds_if_lost(12, 120, 13)}
    years = {"return_period_years": 150.0, "return_ci_low_years": 88.0, "return_ci_high_years": 277.0}
    assert "; 13 others left the terrain model before it: 21 % if all of them reach it" in line_words(row)
    years["return_ci_low_years_if_lost"] = 50.0
    assert "every 150 years (88 to 277); 13 others" in line_words(row | years)
    assert "others" not in line_words(row | years | {"n_lost": 0})


def test_a_line_that_none_was_seen_to_reach_says_it_too():
    """Before: "< 3.1 %, return period over 325 years" of a line that up to 18.6 % of the logs may reach."""
    row = {"line_id": "road", "at_least_kj": 0.0, **reach_record(0, 120), **bounds_if_lost(0, 120, 14)}
    told = line_words(row | {"return_ci_low_years": 325.0, "return_ci_low_years_if_lost": 53.8})
    assert told.startswith("road: < 3.1 %, return period over 325 years; 14 others left the terrain model before it: ")
    assert told.endswith("chance and these together: 0.0 to 18.6 %, over 53.8 years")
