"""The life of dead trees against closed forms: products of yearly chances, and the same law drawn tree by tree."""

from __future__ import annotations

import math

import numpy as np
import pytest

from deadwood_algorithms.evaluate.lifetime import life
from deadwood_algorithms.params import snag_dynamics
from deadwood_algorithms.params.presets import BEECH
from deadwood_algorithms.params.tool import UserError

FIXED = {
    "lag_years": 1.5,
    "fall_per_year": 0.12,
    "storm_return_years": 8.0,
    "storm_share": 0.28,
    "broken_share": 0.75,
    "bark_off_years": 3.0,
    "weak_years": 9.0,
    "strength_needed": 0.3,
    "residence_years": 40.0,
    "hold_loss_per_year": 0.1,
}
DRAWS = 4000


def numbers(count: int = DRAWS, **changes: float) -> dict[str, np.ndarray]:
    return life.drawn({name: (each, each) for name, each in (FIXED | changes).items()}, count, 3)


def one(years_dead: float = 0.0, standing: bool = True, speed: float = 1.0) -> life.Kinds:
    return life.Kinds(np.array([years_dead]), np.array([standing]), np.array([speed]))


def drawn_ages(kinds: life.Kinds, of: dict[str, np.ndarray], storms: np.ndarray, trees: int = 1) -> life.Ages:
    return life.aged(of, kinds, np.zeros(trees, int), np.arange(7, 7 + trees, dtype=np.uint64), storms, 5)


def test_the_share_standing_is_the_product_of_the_yearly_chances():
    of = numbers()
    found = drawn_ages(one(), of, life.storm_years(of, 12, 9)).shares[..., 0].mean(axis=0)
    storm = (1.0 - math.exp(-1.0 / 8.0)) * 0.28
    for year in (1, 2, 5, 12):
        exact = math.exp(-0.12 * max(0.0, year - 1.5)) * (1.0 - storm) ** year
        assert found[year] == pytest.approx(exact, abs=4.0 * math.sqrt(exact * (1 - exact) / DRAWS))


def test_without_a_trigger_nothing_falls():
    of = numbers(50, fall_per_year=0.0, storm_share=0.0)
    ages = drawn_ages(one(), of, np.ones((50, 20)), trees=4)
    assert (ages.shares[..., 0] == 1.0).all()
    years = list(life.lives(of, one(), np.ones((50, 20))))
    assert all((each.calm == 0.0).all() and (each.pulse == 0.0).all() for each in years)


def test_a_storm_takes_its_share_in_its_year_and_none_in_others():
    of, storms = numbers(40, fall_per_year=0.0), np.zeros((40, 9))
    storms[:, 4] = 1.0
    found = drawn_ages(one(), of, storms, trees=500).shares[..., 0].mean(axis=0)
    assert (found[:5] == 1.0).all()
    assert np.ptp(found[5:]) == 0.0
    assert found[5] == pytest.approx(0.72, abs=4.0 * math.sqrt(0.72 * 0.28 / 20_000))


@pytest.mark.parametrize(("dead", "standing", "speed"), [(0.0, True, 1.0), (4.0, True, 1.6), (2.0, False, 1.0)])
def test_drawn_fates_have_the_expected_shares_of_every_state(dead, standing, speed):
    of, kinds = numbers(300), one(dead, standing, speed)
    storms = life.storm_years(of, 25, 1)
    ages = drawn_ages(kinds, of, storms, trees=60)
    years = list(life.lives(of, kinds, np.hstack([storms, np.zeros((300, 1))])))
    for at in (0, 1, 6, 15, 25):
        expected = [float(each.mean()) for each in (years[at].standing, years[at].broken, years[at].lying)]
        found = ages.shares[:, at].mean(axis=0)
        assert found.sum() == pytest.approx(1.0)
        assert found[:3] == pytest.approx(expected, abs=0.02)
    assert ages.of_trees.sum(axis=2) == pytest.approx(1.0)


def test_a_tree_is_critical_from_the_loss_of_its_bark_until_it_is_too_weak():
    of = numbers(1)
    end = 9.0 * math.log(0.3) / math.log(0.11)
    assert 4.0 < end < 5.0
    assert [bool(life.critical_at(of, one(), year)) for year in (2.9, 3.0, end - 0.01, end + 0.01)] == [0, 1, 1, 0]
    assert [bool(life.critical_at(of, one(speed=2.0), year)) for year in (1.4, 1.5, end)] == [0, 1, 0]
    critical = [each.critical.item() for each in life.lives(of, one(1.0), np.zeros((1, 5)))]
    assert critical == pytest.approx([0.0, 0.0, 1.0, end - 4.0, 0.0])  # in the ages 1-2, 2-3, 3-4, ...


def test_numbers_fill_their_ranges_and_depend_on_the_seed_alone():
    spans = snag_dynamics.spans_of("lag_years=1:2", {"storm_return_years": (10.0, 30.0)})
    of = life.drawn(spans, 2000, 4)
    for name, (low, high) in spans.items():
        assert low <= of[name].min()
        assert of[name].max() <= high
        assert of[name].mean() == pytest.approx(0.5 * (low + high), abs=0.05 * (high - low))
    assert (life.drawn(spans, 50, 4)["lag_years"] == of["lag_years"][:50]).all()
    assert abs(np.corrcoef(of["lag_years"][:, 0], of["storm_share"][:, 0])[0, 1]) < 0.1


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("bark=1:2", "'bark' is not one of lag_years"),
        ("storm_share=high", "'storm_share=high' is not NAME=LOW:HIGH"),
        ("storm_share=0.3:0.2", "storm_share: 0.3 to 0.2 is not a range"),
        ("storm_share=0.3:1.2", "within 0 to 1"),
    ],
)
def test_wrong_ranges_are_refused(text, words):
    with pytest.raises(UserError, match=words):
        snag_dynamics.spans_of(text, {})


def test_every_process_has_a_source_and_a_range_or_is_asked_for():
    for name, each in snag_dynamics.PROCESSES.items():
        assert each.name == name
        assert each.source
        assert each.known
        assert each.about
        assert each.span is None or each.least <= each.span[0] < each.span[1] <= each.most


def test_lying_logs_disappear_with_time_the_thin_ones_first():
    assert snag_dynamics.lost_share(10.0, 20.0) == pytest.approx(1.0 - math.exp(-10.0 / 71.0))
    assert snag_dynamics.lost_share(10.0, 35.0) == pytest.approx(1.0 - math.exp(-10.0 / 113.0))
    assert snag_dynamics.lost_share(10.0, 20.0, BEECH) == pytest.approx(1.0 - math.exp(-10.0 / 71.0 * 0.054 / 0.033))
    assert 2.1 * snag_dynamics.height_left(20.0) == pytest.approx(0.8, abs=0.01)
