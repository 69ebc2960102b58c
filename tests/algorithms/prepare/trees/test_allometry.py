"""Laws of DBH and height: hand calculations, inverses, and a fit that finds the law that made the sample."""

from __future__ import annotations

import math

import numpy as np
import pytest

from deadwood_algorithms.prepare.trees.allometry import (
    ABOUT,
    NAMED_LAWS,
    CrownLaw,
    LawsByTree,
    PowerLaw,
    fit,
    laws_described,
    outside_region,
)

NO_CROWN = np.full(1, np.nan)


def one(value: float) -> np.ndarray:
    return np.array([value])


@pytest.mark.parametrize(
    ("name", "height", "crown", "dbh"),
    [
        ("fint-ch", 44.0, math.nan, 60.5),  # the paper's mean DBH at Klosters, 60.2 cm, needs 44 m by this law
        ("fint", 26.5, math.nan, 60.1),  # and 26.5 m by that one
        ("chablais-all", 20.0, math.nan, 1.527 * 20**0.987),
        ("jucker-global", 20.0, 5.0, 0.557 * 100**0.809 * math.exp(0.056**2 / 2)),
        ("jucker-conifer-forest-gymnosperm", 20.0, 5.0, 0.974 * 100**0.748),
    ],
)
def test_the_published_laws(name, height, crown, dbh):
    assert NAMED_LAWS[name].dbh(one(height), one(crown))[0] == pytest.approx(dbh, rel=2e-3)


@pytest.mark.parametrize("name", NAMED_LAWS)
def test_each_law_undoes_itself_and_gives_a_tree(name):
    law, crown = NAMED_LAWS[name], one(4.0)
    dbh = law.dbh(one(20.0), crown)
    assert law.height(dbh, crown)[0] == pytest.approx(20.0, rel=1e-12)
    assert 8 < dbh[0] < 70  # at 20 m; the laws differ by more than a factor of two, as the description warns
    assert f"``{name}``" in laws_described()


def test_each_law_is_described():
    assert list(ABOUT) == list(NAMED_LAWS)


def test_the_law_with_the_crown_knows_nothing_without_one():
    law = CrownLaw(1.0, 0.5)
    assert np.isnan(law.dbh(one(20.0), NO_CROWN)[0])
    assert np.isnan(law.height(one(20.0), one(0.0))[0])


def test_a_sample_without_scatter_gives_its_law_back():
    height = np.linspace(5.0, 40.0, 12)
    law = fit(1.357 * height**1.071, height)
    assert (law.dbh_law.a, law.dbh_law.b) == pytest.approx((1.357, 1.071), rel=1e-9)
    assert law.height(law.dbh(height, height), height) == pytest.approx(height, rel=1e-9)
    assert (law.spread, law.r2) == pytest.approx((0.0, 1.0), abs=1e-9)


def test_the_correction_brings_the_mean_back_that_the_logarithms_lose():
    """Trees drawn from DBH = a H^b exp(N(0, s)): the mean at a height is a H^b exp(s^2 / 2), the median a H^b."""
    rng = np.random.default_rng(1)
    n, spread = 20_000, 0.35
    height = rng.uniform(10.0, 40.0, n)
    dbh = 2.0 * height**0.9 * np.exp(rng.normal(0.0, spread, n))
    law = fit(dbh, height)
    # Standard errors: of the exponent s / (sd(ln H) sqrt(n)) = 0.006; of the mean 0.37 / sqrt(n) = 0.3 %; four of each.
    assert law.dbh_law.b == pytest.approx(0.9, abs=0.025)
    assert law.spread == pytest.approx(spread, rel=0.02)
    assert law.dbh(height, height).mean() / dbh.mean() == pytest.approx(1.0, abs=0.012)
    # Without it the mean comes out 6 % low, which the line above would see.
    assert np.exp(-(spread**2) / 2) == pytest.approx(0.94, abs=0.01)


def test_a_fit_agrees_with_numpys_polynomial():
    rng = np.random.default_rng(2)
    height = rng.uniform(5.0, 30.0, 25)
    dbh = 1.5 * height * np.exp(rng.normal(0, 0.2, 25))
    law = fit(dbh, height)
    (b, a), residuals, *_ = np.polyfit(np.log(height), np.log(dbh), 1, full=True)
    assert law.dbh_law.b == pytest.approx(b)
    assert law.dbh_law.a == pytest.approx(np.exp(a + residuals[0] / 23 / 2))
    assert law.r2 == pytest.approx(np.corrcoef(np.log(height), np.log(dbh))[0, 1] ** 2)


def test_the_inverse_is_a_fit_of_its_own_with_its_own_correction():
    """Trees drawn from H = a DBH^b exp(N(0, s)): heights by the law have the mean of the drawn ones (as above, the
    other way round). Neither the inverse of the law of DBH nor the fit without correction does."""
    rng = np.random.default_rng(4)
    n, spread = 20_000, 0.35
    dbh = rng.uniform(15.0, 80.0, n)
    height = 1.7 * dbh**0.7 * np.exp(rng.normal(0.0, spread, n))
    law = fit(dbh, height)
    (b, a), residuals, *_ = np.polyfit(np.log(dbh), np.log(height), 1, full=True)
    correction = float(np.exp(residuals[0] / (n - 2) / 2))
    assert correction == pytest.approx(np.exp(spread**2 / 2), rel=0.01)
    assert (law.a_height, law.b_height) == pytest.approx((np.exp(a) * correction, b))
    # Standard error of the mean 0.37 / sqrt(n) = 0.3 %; four of it. Without the correction it is 6 % low.
    assert law.height(dbh, dbh).mean() / height.mean() == pytest.approx(1.0, abs=0.012)


def test_laws_by_tree():
    laws = LawsByTree((PowerLaw(1.0, 1.0), PowerLaw(2.0, 1.0), PowerLaw(3.0, 1.0)), np.array([2, 0, 1]))
    assert laws.dbh(np.array([10.0, 10.0, 10.0]), np.full(3, np.nan)).tolist() == [30, 10, 20]
    assert laws.height(np.array([30.0, 10.0, 20.0]), np.full(3, np.nan)).tolist() == [10, 10, 10]


@pytest.mark.parametrize(
    ("name", "place", "words"),
    [
        ("fint-ch", (9.9, 46.9), ""),
        ("fint-ch", (174.5, -41.2), "trees of Switzerland, and these stand at 41.2° S 174.5° E"),
        ("fint-ch", (-71.3, 44.1), "and these stand at 44.1° N 71.3° W"),
        ("fint", (11.4, 47.3), "the law fint was made of trees of Switzerland"),  # Innsbruck
        ("oregon-douglas-fir", (-122.0, 44.0), ""),
        ("oregon-douglas-fir", (9.9, 46.9), "made of trees of Oregon"),
        ("chablais-all", (6.7, 46.2), ""),
        ("chablais-all", (9.9, 46.9), "made of trees of the French Alps"),
        ("jucker-mixed-forest-gymnosperm", (9.9, 46.9), ""),
        ("jucker-mixed-forest-gymnosperm", (-122.0, 44.0), "made of trees of the temperate Palearctic"),
        ("jucker-boreal-angiosperm", (9.9, 46.9), "made of trees of the boreal Palearctic"),
        ("jucker-global", (174.5, -41.2), ""),
    ],
)  # fmt: skip
def test_a_law_used_far_from_its_trees_is_reported(name, place, words):
    assert words in outside_region(NAMED_LAWS[name], *place)
    assert bool(words) == bool(outside_region(NAMED_LAWS[name], *place))


def test_the_users_own_laws_have_no_region():
    assert outside_region(PowerLaw(2.0, 1.0), 174.5, -41.2) == ""
