"""Correlated sizes on arrays: their distribution, redraws, and which item a draw belongs to."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.prepare.drawn_sizes import draw_pair
from deadwood_algorithms.stats import draws

ITEMS = np.arange(20_000)


def drawn(items: np.ndarray = ITEMS, *, least: tuple[float, float] = (-1e9, -1e9), rho: float = 0.6):
    return draw_pair((50.0, 30.0), (8.0, 5.0), rho, least, 1, items, draws.TREE_SIZE, "no such thing")


@pytest.mark.parametrize("rho", [-1.0, 0.0, 0.6, 1.0])
def test_both_have_their_mean_scatter_and_correlation(rho):
    """20 000 draws: standard errors of means sd / 141, of deviations 0.5 %, of the correlation 0.007; four of each."""
    one, other, redrawn = drawn(rho=rho)
    assert redrawn == 0
    assert (one.mean(), other.mean()) == pytest.approx((50.0, 30.0), abs=4.0 * 8.0 / 141.0)
    assert (one.std(), other.std()) == pytest.approx((8.0, 5.0), rel=0.02)
    assert np.corrcoef(one, other)[0, 1] == pytest.approx(rho, abs=0.028)


@pytest.mark.parametrize("least", [(45.0, -1e9), (-1e9, 28.0), (45.0, 28.0)])
def test_what_is_below_the_least_of_either_is_drawn_again_and_the_rest_stays(least):
    one, other, redrawn = drawn(least=least)
    before = drawn()
    fits = (before[0] >= least[0]) & (before[1] >= least[1])
    assert (one >= least[0]).all()
    assert (other >= least[1]).all()
    assert np.array_equal(one[fits], before[0][fits])
    assert np.array_equal(other[fits], before[1][fits])
    assert redrawn >= np.count_nonzero(~fits)


def test_an_items_sizes_are_its_own():
    some = np.array([7, 19_000, 3])
    for whole, part in zip(drawn()[:2], drawn(some)[:2], strict=True):
        assert np.array_equal(whole[some], part)


def test_numbers_that_give_no_such_thing_are_refused():
    with pytest.raises(UserError, match="no such thing"):
        drawn(np.arange(5), least=(1e6, 0.0))
