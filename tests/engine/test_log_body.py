"""Mass and inertia of the truncated cone against closed forms computed elsewhere and against quadrature."""

import numpy as np
import pytest
from scipy.integrate import quad

from deadwood_engine.log_body import AXIAL, CENTRE, MASS, TRANSVERSE, cone_bodies


# T01 of docs/tests.md: closed forms evaluated independently, printed to the digits given
@pytest.mark.parametrize(
    ("diameter", "length", "mass", "centre", "axial", "transverse"),
    [
        (0.75, 30.0, 2319.379, 11.785714, 108.3326, 155014.71),
        (0.30, 15.0, 185.55032, 5.892857, 1.386657, 3099.9043),
        (0.30, 35.0, 432.951, 13.75, 3.23553, 39373.1),
        (0.05, 40.0, 13.744, 15.714, 0.0028532, 1632.5),
        (0.75, 0.4, 30.925, 0.15714, 1.44443, 1.08953),
    ],
)
def test_published_table(diameter, length, mass, centre, axial, transverse):
    row = cone_bodies(np.array([diameter]), np.array([length]), np.array([300.0]))[0]
    found = row[MASS], row[CENTRE], row[AXIAL] * row[MASS], row[TRANSVERSE] * row[MASS]
    # half a unit of the last printed digit of the table is at most 4e-5 of any entry
    assert found == pytest.approx((mass, centre, axial, transverse), rel=4e-5)


@pytest.mark.parametrize("taper", [0.1, 0.5, 0.999, 1.0])
def test_against_quadrature_and_the_cylinder(taper):
    base, length = 0.4, 12.0
    row = cone_bodies(np.array([2 * base]), np.array([length]), np.array([1.0]), taper=taper)[0]

    def radius(s):
        return base * (1 + (taper - 1) * s / length)

    volume = quad(lambda s: np.pi * radius(s) ** 2, 0, length, epsabs=0, epsrel=1e-13)[0]
    centre = quad(lambda s: np.pi * radius(s) ** 2 * s, 0, length, epsabs=0, epsrel=1e-13)[0] / volume
    axial = quad(lambda s: np.pi * radius(s) ** 4 / 2, 0, length, epsabs=0, epsrel=1e-13)[0] / volume
    transverse = quad(
        lambda s: np.pi * (radius(s) ** 4 / 4 + radius(s) ** 2 * (s - centre) ** 2), 0, length, epsabs=0, epsrel=1e-13
    )[0]
    # quadrature to 1e-13; the parallel-axis shift of the closed form loses one digit
    assert row[MASS] == pytest.approx(volume, rel=1e-12)
    assert row[CENTRE] == pytest.approx(centre, rel=1e-12)
    assert row[AXIAL] == pytest.approx(axial, rel=1e-12)
    assert row[TRANSVERSE] == pytest.approx(transverse / volume, rel=1e-11)
    if taper == 1.0:
        assert row[AXIAL] == pytest.approx(base**2 / 2, rel=1e-14)
        assert row[TRANSVERSE] == pytest.approx((3 * base**2 + length**2) / 12, rel=1e-12)


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_impossible_logs_are_refused(bad):
    with pytest.raises(ValueError, match="diameter"):
        cone_bodies(np.array([bad]), np.array([1.0]), np.array([1.0]))
