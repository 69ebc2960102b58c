"""Rates, return periods and classes: against Wilson's interval, laws of chance, and their coverage by brute force."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_algorithms.evaluate.hazard.legend import (
    COLD,
    CORNERS,
    WARM,
    class_rows,
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


@pytest.mark.parametrize("logs_per_event", [1, 5])
@pytest.mark.parametrize(
    ("count", "n_logs", "p"),
    [(2, 200, 0.01), (2, 50, 0.5), (5, 200, 0.005), (10, 200, 0.003), (20, 100, 0.002), (20, 500, 0.001),
     (50, 200, 0.001), (50, 200, 0.02), (100, 100, 0.0005), (100, 100, 0.3), (3, 40, 0.9)],
)  # fmt: skip
def test_areas_of_unlike_frequency_with_few_hits_are_covered(count, n_logs, p, logs_per_event):
    """Wilson's ends joined in quadrature held the truth in 92 % of cases (5 areas) down to 84 % (100 areas).

    Like every exact interval of a few hits, this one holds it more often than 95 %; of many hits it does not.
    """
    rng = np.random.default_rng(8)
    areas = [ReleaseArea(k, each, n_logs) for k, each in enumerate(rng.uniform(0.01, 0.1, count))]
    shares = np.minimum(p * rng.lognormal(0.0, 0.5, count), 0.98)
    times = 4000
    hits = [rng.binomial(n_logs, each, times) for each in shares]
    rate, low, high = rate_with_interval(hits, areas, logs_per_event)
    reached = 1.0 - (1.0 - shares) ** logs_per_event
    true = sum(each.events_per_year * share for each, share in zip(areas, reached, strict=True))
    covered = ((low <= true) & (true <= high)).mean()
    assert covered > 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / times)
    if n_logs * shares.sum() > 200.0:
        assert covered < 0.975
    assert ((low >= 0.0) & (low <= rate) & (rate <= high)).all()


def test_the_interval_of_many_areas_of_one_weight_is_that_of_their_sum():
    """100 areas alike, 7 hits in all of 10 000 logs: the exact interval of a Poisson count of 7 (2.814 to 14.423)."""
    areas = [ReleaseArea(k, 0.1, 100) for k in range(100)]
    hits = [np.array(int(k < 7)) for k in range(100)]
    rate, low, high = rate_with_interval(hits, areas, 1)
    assert float(rate) == pytest.approx(0.1 * 7 / 100)
    assert float(high) == pytest.approx(0.1 * 14.423 / 100, rel=1e-3)
    # The lower end has the variance of binomial counts, smaller by Wilson's lower end of one hit (0.2 %).
    assert float(low) == pytest.approx(0.1 * 2.814 / 100, rel=2e-3)


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


@pytest.mark.parametrize("ramp", [WARM, COLD])
@pytest.mark.parametrize("number", [2, 3, 4, 5])
def test_classes_beside_each_other_are_told_apart_on_a_grey_printer_too(ramp, number):
    """Each is darker by at least a tenth of the range from white to black (CIE L*); a fiftieth can be seen."""
    colours = [colour for _, colour, _ in class_rows([str(k) for k in range(number)], ramp)]
    parts = np.array([[int(each[k : k + 2], 16) / 255.0 for k in (1, 3, 5)] for each in colours])
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    lightness = 116.0 * np.cbrt(linear @ [0.2126, 0.7152, 0.0722]) - 16.0
    assert (np.diff(lightness) <= -10.0).all(), lightness
