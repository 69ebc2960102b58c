"""Rates, return periods and classes: against Wilson's interval, laws of chance, and their coverage by brute force."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_algorithms.evaluate.hazard.legend import (
    CORNERS,
    matrix_rows,
    mixed,
    period_labels,
    rising_labels,
)
from deadwood_algorithms.evaluate.hazard.rates import (
    ReleaseArea,
    period_class,
    pooled,
    rate_with_interval,
    reached_by_event,
    return_period,
    rising_class,
)
from deadwood_algorithms.stats.statistics import wilson_bounds, wilson_interval


def test_many_intervals_are_those_of_one():
    hits = np.array([0, 1, 17, 39, 40])
    low, high = wilson_bounds(hits, 40)
    for k, hit in enumerate(hits.tolist()):
        assert (low[k], high[k]) == pytest.approx(wilson_interval(hit, 40), abs=1e-15)
    assert wilson_bounds(0, 0)[1] == 1.0


def test_the_rate_of_one_area_is_its_wilson_interval():
    rate, low, high = rate_with_interval([np.array([0, 3])], [ReleaseArea("a", 0.2, 50)], 1)
    assert rate.tolist() == [0.0, pytest.approx(0.2 * 3 / 50)]
    for k, hit in enumerate((0, 3)):
        assert (low[k], high[k]) == pytest.approx(tuple(0.2 * each for each in wilson_interval(hit, 50)))


def test_the_interval_of_several_areas_covers_as_often_as_it_says():
    areas = [ReleaseArea("a", 0.1, 100), ReleaseArea("b", 0.5, 60), ReleaseArea("c", 0.02, 400)]
    p = np.array([0.10, 0.05, 0.3])
    rng = np.random.default_rng(3)
    hits = [rng.binomial(each.n_logs, share, 20_000) for each, share in zip(areas, p, strict=True)]
    _, low, high = rate_with_interval(hits, areas, 1)
    true = sum(each.events_per_year * share for each, share in zip(areas, p, strict=True))
    assert 0.94 < ((low <= true) & (true <= high)).mean() < 0.975


def test_an_event_of_several_logs_reaches_when_one_does():
    rng = np.random.default_rng(5)
    brute = (rng.random((200_000, 4)) < 0.15).any(axis=1).mean()
    assert reached_by_event(0.15, 4) == pytest.approx(brute, abs=0.004)
    assert reached_by_event(0.15, 1) == 0.15


def test_areas_are_pooled_where_each_log_stands_for_as_much():
    even = [ReleaseArea("a", 0.1, 100), ReleaseArea("b", 0.2, 200)]
    (one,) = pooled(even, 1) or []
    assert (one.events_per_year, one.n_logs) == (pytest.approx(0.3), 300)
    together = rate_with_interval([np.array(30)], [one], 1)[0]
    assert together == pytest.approx(float(rate_with_interval([np.array(20), np.array(10)], even, 1)[0]))
    assert pooled(even, 2) is None
    assert pooled([even[0], ReleaseArea("b", 0.1, 200)], 1) is None


def test_bounds_belong_to_one_class():
    energies = [0.0, 29.99, 30.0, 299.99, 300.0, 1e5, np.nan]
    assert rising_class(energies, [30.0, 300.0]).tolist() == [1, 1, 2, 2, 3, 3, 0]
    years = [1.0, 30.0, 30.1, 100.0, 300.0, 301.0, np.nan]
    assert period_class(years, [30.0, 100.0, 300.0]).tolist() == [1, 1, 2, 2, 3, 4, 0]
    assert np.isnan(return_period([0.0, 0.1])).tolist() == [True, False]


def test_classes_are_named_and_the_matrix_has_its_corners():
    strong, often = rising_labels([30.0, 300.0], "kJ"), period_labels([30.0, 100.0, 300.0])
    assert strong == ["below 30 kJ", "30 to 300 kJ", "300 kJ and more"]
    assert often == ["up to 30 years", "30 to 100 years", "100 to 300 years", "over 300 years"]
    rows = {value: (colour, label) for value, colour, label in matrix_rows(strong, often, rarest_first=False)}
    assert set(rows) == {10 * i + j for i in (1, 2, 3) for j in (1, 2, 3, 4)}
    assert rows[31] == (CORNERS[1][1], "300 kJ and more, up to 30 years")
    assert rows[14][0] == CORNERS[0][0]
    assert rows[11][0] == CORNERS[0][1]
    assert mixed(0.5, 0.5) not in sum(CORNERS, ())
