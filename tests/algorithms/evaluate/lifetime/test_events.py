"""Weighted slides: against products by hand, against a direct simulation, and the coverage of the intervals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from deadwood_algorithms.evaluate.lifetime import events, life
from deadwood_algorithms.evaluate.lifetime.decision import Answer, difference_rows, period_rows, total_rows
from deadwood_algorithms.evaluate.lifetime.treatments import BROKEN, TREATMENTS, WHOLE
from deadwood_algorithms.params.snag_dynamics import spans_of

FIXED = {
    "lag_years": 0.0,
    "fall_per_year": 0.1,
    "storm_return_years": 10.0,
    "storm_share": 0.3,
    "broken_share": 0.0,
    "bark_off_years": 0.0,
    "weak_years": 100.0,
    "strength_needed": 0.2,
    "residence_years": 9999.0,
    "hold_loss_per_year": 0.05,
    "start_share": 0.5,
    "mobilised_per_year": 0.0,
    "anchored_share": 0.9,
}
ASKED = {name: (FIXED[name],) for name in ("storm_return_years", "start_share", "mobilised_per_year", "anchored_share")}
STORM = 1.0 - math.exp(-0.1)


def numbers(count: int, **changes: float) -> dict[str, np.ndarray]:
    return life.drawn({name: (each, each) for name, each in (FIXED | changes).items()}, count, 3)


def stand(trees: int, standing: bool = True) -> life.Kinds:
    return life.Kinds(np.zeros(1), np.array([standing]), np.ones(1))


def slides(hits: np.ndarray, picked: np.ndarray | None = None, **scenes: np.ndarray) -> events.Slides:
    """``hits`` : shape (trees, 3 states, repeats), whether a slide arrives at the only line."""
    trees, _, repeats = hits.shape
    rows = np.indices(hits.shape).reshape(3, -1)
    of_tree = np.zeros(trees, bool) if picked is None else picked
    arrived = {name: each.reshape(-1, 1) for name, each in ({events.BARE: hits} | scenes).items()}
    return events.Slides(np.zeros(rows.shape[1], int), rows[1], of_tree[rows[0]], arrived, repeats)


def arrivals(names: str, of: dict, slid: events.Slides, trees: int, years: int = 12, picked: int = 0, kinds=None):
    sizes = np.array([float(picked)]), np.array([float(trees - picked)])
    chosen = [TREATMENTS[name] for name in names.split(",")]
    return events.arrivals_of(chosen, of, kinds or stand(trees), slid, sizes, years, 8)


def test_events_of_one_stem_are_the_product_of_hazard_start_and_reach():
    hits = np.zeros((1, 3, 400), bool)
    hits[0, WHOLE, :100] = True  # a quarter arrives
    found = arrivals("leave", numbers(300), slides(hits), 1)["leave"].rate[..., 0]
    stays = math.exp(-0.1) * (1.0 - STORM * 0.3)
    for year in (0, 1, 7):
        exact = stays**year * (1.0 - stays) * 0.5 * 0.25
        assert found[:, year].mean() == pytest.approx(exact, rel=0.02)
    assert np.percentile(found[:, 0], [2.5, 97.5]) / found[:, 0].mean() == pytest.approx([0.84, 1.17], abs=0.04)


def test_without_a_trigger_there_are_no_events_and_a_storm_brings_its_share():
    hits = np.ones((3, 3, 20), bool)
    calm = numbers(30, fall_per_year=0.0, storm_share=0.0)
    for each in arrivals("leave,fell,fell-across,remove", calm, slides(hits), 3).values():
        assert (each.calm == 0.0).all()
        assert (each.pulse == 0.0).all()
    found = arrivals("leave", numbers(30, fall_per_year=0.0), slides(hits), 3, years=4)["leave"]
    assert (found.calm == 0.0).all()
    # every slide arrives; the half miss that is added, 0.5 of a squared normal among 60, takes off at most a tenth
    assert found.pulse[:, 0, 0] == pytest.approx(3 * 0.3 * 0.5, rel=0.1)
    assert found.rate[:, 2, 0] == pytest.approx(STORM * (1.0 - STORM * 0.3) ** 2 * found.pulse[:, 0, 0])
    certain = 1.0 - np.exp(-found.pulse[:, 0, 0])
    assert found.chance[:, 0, 0] == pytest.approx(STORM * certain)


def test_lying_stems_start_at_their_rate_and_only_loose_ones():
    hits = np.ones((4, 3, 50), bool)
    of = numbers(40, mobilised_per_year=0.02)
    found = arrivals("fell,fell-across,remove", of, slides(hits), 4)
    one = 4 * (1.0 - math.exp(-0.02))
    assert found["fell"].rate[..., 0].mean() == pytest.approx(one, rel=0.01)
    assert found["fell-across"].rate.mean() / found["fell"].rate.mean() == pytest.approx(0.1)
    assert (found["remove"].rate == 0.0).all()


def test_lying_stems_hold_by_their_share_and_lose_it():
    bare, held = np.ones((5, 3, 200), bool), np.zeros((5, 3, 200), bool)
    of = numbers(200, mobilised_per_year=0.02)
    among = arrivals("fell,fell-across", of, slides(bare, fallen=held, across=held), 5)
    free = arrivals("fell,fell-across", of, slides(bare), 5)
    for name, share in (("fell", 1.0), ("fell-across", 0.9)):
        left = among[name].rate[..., 0].mean(axis=0) / free[name].rate[..., 0].mean(axis=0)
        assert left == pytest.approx(
            1.0 - share * np.exp(-0.05 * np.arange(12)) * np.exp(-np.arange(12) / 9999), abs=5e-3
        )


def test_the_picked_stems_have_their_own_fate():
    picked = np.array([True, False, False])
    hits = np.zeros((3, 3, 100), bool)
    hits[0] = True  # only the picked one arrives
    found = arrivals("leave,remove-part,anchor", numbers(50), slides(hits, picked), 3, picked=1)
    assert found["remove-part"].rate.mean() < 0.02 * found["leave"].rate.mean()
    assert found["anchor"].rate.mean() == pytest.approx(found["remove-part"].rate.mean())
    turned = arrivals("anchor,leave", numbers(50), slides(hits, picked), 3, picked=1)  # the order does not matter
    assert (turned["leave"].rate == found["leave"].rate).all()


def test_weighting_equals_the_direct_simulation():
    """Fates drawn tree by tree, each fall one slide of its tree drawn at random: the same events within chance."""
    rng = np.random.default_rng(4)
    trees, repeats, years, times = 6, 5, 10, 4000
    hits = rng.random((trees, 3, repeats)) < rng.random((trees, 3, 1))
    of = numbers(times, broken_share=0.6, lag_years=1.0)
    storms = life.storm_years(of, years, 2)
    chance = np.hstack([storms, np.zeros((times, 1))])
    counts = np.zeros(times)
    for tree in range(trees):
        stands = np.ones(times, bool)
        for year in range(years):
            calm = 1.0 - math.exp(-0.1 * (year >= 1))
            falls = stands & (rng.random(times) < calm + (1.0 - calm) * 0.3 * chance[:, year])
            stands &= ~falls
            state = np.where(rng.random(times) < 0.6, BROKEN, WHOLE)
            starts = falls & (rng.random(times) < 0.5)
            counts += starts & hits[tree, state, rng.integers(0, repeats, times)]
    weighted = arrivals("leave", of, slides(hits), trees, years=years)["leave"].rate[..., 0].sum(axis=1)
    standard_error = math.hypot(counts.std() / math.sqrt(times), weighted.std() / math.sqrt(times))
    exact = weighted.mean()
    bias = 0.5 * abs(1.0 - 2.0 * hits.mean()) * trees / (trees * repeats + 1.0)  # of half a hit and half a miss
    assert abs(counts.mean() - exact) < 3.0 * standard_error + bias
    assert standard_error < 0.03 * exact


@pytest.mark.statistics
def test_intervals_cover_the_truth():
    """Truths drawn from the ranges, slides that arrive by chance: the interval holds the true events in 95 of 100.

    Where a share of the draws has no critical year the range begins at 0 and holds the truth more often, in 97.5 %.
    """
    rng = np.random.default_rng(11)
    spans = spans_of("strength_needed=0.15:0.2", ASKED | {"start_share": (0.1, 0.6), "mobilised_per_year": (0.0, 0.02)})
    truths, trees, repeats, inside = 1000, 8, 5, 0
    theta = life.drawn(spans, truths, 99)
    for k in range(truths):
        p = np.broadcast_to(rng.beta(1.0, 2.0, size=(1, 3, 1)), (trees, 3, repeats))
        hits = rng.random(p.shape) < p
        truth = {name: each[[k]] for name, each in theta.items()}
        rates = events.starts_of(TREATMENTS["leave"].rest, truth, stand(trees), 10)
        per_state = (rates.calm + STORM * rates.pulse)[:, 0, 0].sum(axis=0)
        exact = trees * float((per_state * p[0, :, 0]).sum())
        of = life.drawn(spans, 400, 1000 + k)
        total = arrivals("leave", of, slides(hits), trees, years=10)["leave"].rate[..., 0].sum(axis=1)
        low, high = np.percentile(total, [2.5, 97.5])
        inside += low <= exact <= high
    assert 0.93 <= inside / truths <= 0.97


def test_the_energy_of_a_period_is_the_largest_that_comes_as_often():
    chance = np.array([[0.2, 0.05, 0.01, 0.001], [0.002, 0.001, 0.0, 0.0]])
    energies = np.array([0.0, 30.0, 100.0, 300.0])
    assert events.energy_of_period(chance, energies, 30.0)[0] == 30.0
    assert events.energy_of_period(chance, energies, 100.0)[0] == 100.0
    assert np.isnan(events.energy_of_period(chance, energies, 100.0)[1])


def test_tables_add_up_and_what_overlaps_is_not_decided():
    calm = np.random.default_rng(1).gamma(2.0, 0.1, size=(200, 6, 3))
    calm[..., 1], calm[..., 2] = 0.5 * calm[..., 0], 0.2 * calm[..., 0]
    storm = np.full((200, 1, 1), 0.1)

    def of(factor: float) -> events.Arrivals:
        return events.Arrivals(factor * calm, np.zeros_like(calm), storm)

    noise = events.Arrivals(calm[::-1], np.zeros_like(calm), storm)
    answer = Answer({"leave": of(1.0), "less": of(0.4), "other": noise}, ["road"], [np.array([0.0, 30.0, 300.0])], 5)
    rows = [each for each in total_rows(answer, (30.0, 300.0)) if each["treatment"] == "leave"]
    assert sum(each["events"] for each in rows[1:]) == pytest.approx(rows[0]["events"])
    assert rows[0]["events"] == pytest.approx(calm[:, :5, 0].sum(axis=1).mean())
    verdicts = {(each["treatment"], each["against"]): each["verdict"] for each in difference_rows(answer)}
    assert verdicts == {("less", "leave"): "fewer", ("other", "leave"): "not decided", ("other", "less"): "more"}
    energies = [each["energy_kj"] for each in period_rows(answer, (2.0, 30.0, 1e9))]
    assert energies[:3] == [0.0, 300.0, 300.0]
