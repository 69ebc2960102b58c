"""The narrow phase against brute force: densely sampled cores, and a cone from its definition."""

import numpy as np
import pytest

from deadwood_engine.cores import SweptSphere
from deadwood_engine.log_body import BASE_RADIUS, CENTRE, LENGTH, TIP_RADIUS, cone_bodies
from deadwood_engine.narrow_phase import cone_of, deepest, reach_along, signed_distance, top_chord

pytestmark = pytest.mark.engine_alone

ORIGIN = (0.0, 0.0, 0.0)


def solid(taper=0.5):
    return cone_bodies(np.array([0.75]), np.array([12.0]), np.array([300.0]), taper=taper)[0]


def outline(body, number=200_001):
    """Points of the cone's outline in the plane of its axis: base face, side, tip face, (s, rho)."""
    back, front = -body[CENTRE], body[LENGTH] - body[CENTRE]
    share = np.linspace(0.0, 1.0, number)
    side = np.column_stack([back + share * (front - back), body[BASE_RADIUS] * (1 - share) + body[TIP_RADIUS] * share])
    base = np.column_stack([np.full(number, back), share * body[BASE_RADIUS]])
    tip = np.column_stack([np.full(number, front), share * body[TIP_RADIUS]])
    return np.vstack([base, side, tip])


@pytest.mark.parametrize("taper", [0.5, 1.0, 0.1])
def test_signed_distance_is_that_to_the_outline(taper):
    """From within and without, beside the side, the faces and the rims: the nearest of 600 000 points of the outline.

    These stand 60 um apart, so beyond 5 mm from them the nearest is 0.1 um too far at most.
    """
    body = solid(taper)
    cone, points = cone_of(body), outline(body)
    rng = np.random.default_rng(0)
    for _ in range(60):
        end = rng.choice([-body[CENTRE], body[LENGTH] - body[CENTRE], 0.0])
        s, rho = end + rng.uniform(-0.6, 0.6), rng.uniform(0.0, 0.8)
        phi, along, away = signed_distance(cone, s, rho)
        offset = points - (s, rho)
        nearest = np.hypot(*offset.T).min()
        assert abs(phi) == pytest.approx(nearest, abs=1e-4 if nearest < 5e-3 else 2e-7)
        radius = body[BASE_RADIUS] + (body[TIP_RADIUS] - body[BASE_RADIUS]) * (s + body[CENTRE]) / body[LENGTH]
        inside = -body[CENTRE] < s < body[LENGTH] - body[CENTRE] and rho < radius
        assert (phi < 0.0) == inside
        assert along**2 + away**2 == pytest.approx(1.0, abs=1e-12)
        # its change is what its gradient says, where both places are nearest to the same part
        step = 1e-7
        rise = signed_distance(cone, s + step * along, rho + step * away)[0] - phi
        assert rise == pytest.approx(step, rel=1e-3)


def some_core(rng, number):
    """Axis, direction of the core and core, in any place and direction, some along the axis, some square to it."""
    d, u = rng.standard_normal((2, 3))
    d, u = d / np.linalg.norm(d), u / np.linalg.norm(u)
    if number % 5 == 0:
        u = d + 1e-3 * rng.standard_normal(3)
    if number % 7 == 0:
        u = np.cross(d, u)
    u /= np.linalg.norm(u)
    long, wide = rng.choice([0.0, 0.3, 3.0, 20.0]), rng.choice([0.0, 0.1, 0.4])
    slope = -0.01 if 0.01 * long < wide else 0.0
    place = rng.uniform(-1, 1) * rng.choice([7.0, 0.5, 6.2]) * d + 0.6 * rng.standard_normal(3)
    return d, u, place - long * rng.random() * u, long, wide, slope


def test_the_least_gap_along_a_core_is_found_wherever_it_is():
    """Against 2000 places of each of 600 cores: none has less. Where the core is outside, the gap is that value."""
    body = solid()
    cone, rng = cone_of(body), np.random.default_rng(0)
    for number in range(600):
        d, u, start, long, wide, slope = some_core(rng, number)
        core = SweptSphere(tuple(start), tuple(u), long, wide, slope)
        gap, z, n, found = deepest(cone, (ORIGIN, tuple(d)), core, np.inf)
        assert found
        assert np.linalg.norm(n) == pytest.approx(1.0, abs=1e-12)
        places = np.append(np.linspace(0.0, long, 2000), z)
        x = start + places[:, None] * u
        s = x @ d
        rho = np.linalg.norm(x - s[:, None] * d, axis=1)
        f = np.array([signed_distance(cone, *place)[0] for place in zip(s, rho, strict=True)]) - wide - slope * places
        assert f[-1] <= f.min() + 2e-6
        if (f + wide).min() > 0.0:
            assert gap == pytest.approx(f[-1], abs=5e-6)
        else:
            assert gap <= f.min() + 1e-6  # a way out is never shorter than to the skin


def test_given_up_only_where_nothing_is_near():
    """Given up below a gap, it is so that no place of the core has one."""
    body = solid()
    cone, rng = cone_of(body), np.random.default_rng(1)
    given_up = 0
    for number in range(400):
        d, u, start, long, wide, slope = some_core(rng, number)
        core = SweptSphere(tuple(start), tuple(u), long, wide, slope)
        whole = deepest(cone, (ORIGIN, tuple(d)), core, np.inf)
        _, _, _, found = deepest(cone, (ORIGIN, tuple(d)), core, 0.0)
        given_up += not found
        assert found == (whole[0] < 0.0) or abs(whole[0]) < 2e-6
    assert given_up > 50


def test_an_edge_through_a_rim_leaves_square_to_itself():
    """A thin core askew through the rim: the way out is square to it, and after it nothing touches any more."""
    body = solid()
    cone, rng = cone_of(body), np.random.default_rng(2)
    front, tip = body[LENGTH] - body[CENTRE], body[TIP_RADIUS]
    seen = 0
    for _ in range(200):
        u = rng.standard_normal(3)
        u /= np.linalg.norm(u)
        middle = np.array([tip - rng.uniform(0.0, 0.05), 0.0, front - rng.uniform(0.0, 0.05)])
        start = middle - 10.0 * u
        core = SweptSphere(tuple(start), tuple(u), 20.0, 0.0, 0.0)
        gap, z, n, found = deepest(cone, (ORIGIN, (0.0, 0.0, 1.0)), core, 0.0)
        if not found:
            continue
        seen += 1
        assert abs(np.dot(n, u)) < 1e-3
        assert gap == pytest.approx(reach_along(cone, (0.0, 0.0, 1.0), n, tuple(start + z * u)), abs=1e-12)
        away = tuple(start - (gap - 1e-4) * np.array(n))
        left, _, _, _ = deepest(cone, (ORIGIN, (0.0, 0.0, 1.0)), core._replace(start=away), np.inf)
        assert left > -1e-4
    assert seen > 150


def least_gap_of_a_stump(cone, c, d, foot, long, wide, flat):
    """(gap, n) of a log and a stump, as ``obstacles`` finds them, and whether it is the top's."""
    gap, z, n, _ = deepest(cone, (c, d), SweptSphere(foot, (0.0, 0.0, 1.0), long, wide, 0.0), np.inf)
    if z < long:
        return gap, n, False
    chord = top_chord(cone, (c, d), (foot[0], foot[1], foot[2] + long), flat, wide - flat)
    gap, _, n, _ = deepest(cone, (c, d), chord, np.inf)
    return gap, n, True


def test_a_stump_is_touched_as_the_body_that_it_is():
    """Beside, above, over its rim, by the log's side, its rims and its faces: against 34 000 points of the cylinder
    that is rounded, each the middle of a ball, and 900 more around the best of them. None has less, and the best is
    farther away by no more than the points there are apart."""
    body = solid()
    cone, rng = cone_of(body), np.random.default_rng(4)
    flat, rim, high = 0.3, 0.1, 0.8
    turn, ring = np.meshgrid(np.linspace(0, 2 * np.pi, 240, endpoint=False), np.linspace(0.0, flat, 40))
    top = np.column_stack([(ring * np.cos(turn)).ravel(), (ring * np.sin(turn)).ravel(), np.full(ring.size, high)])
    turn, level = np.meshgrid(np.linspace(0, 2 * np.pi, 120, endpoint=False), np.linspace(-3.0, high, 200))
    side = np.column_stack([flat * np.cos(turn).ravel(), flat * np.sin(turn).ravel(), level.ravel()])
    points, tops, apart = np.vstack([top, side]), 0, 0
    for number in range(300):
        d = rng.standard_normal(3) * (1.0, 1.0, rng.choice([0.0, 0.2, 1.0]))
        d /= np.linalg.norm(d)
        end = rng.choice([-body[CENTRE], body[LENGTH] - body[CENTRE], 0.0]) + rng.uniform(-0.3, 0.3)
        place = np.array([*rng.uniform(-0.6, 0.6, 2), rng.uniform(0.0, 1.6)])
        c = place - end * d
        x = points - c
        s = x @ d
        rho = np.linalg.norm(x - s[:, None] * d, axis=1)
        guess = np.array([s, rho]).T
        least = min(signed_distance(cone, *each)[0] for each in guess[np.argsort(np.abs(rho - 0.3))[::40]])
        if not 0.0 < least < 0.6:  # in the log the shortest way out need not be to the skin
            continue
        phi = [signed_distance(cone, *each)[0] for each in guess]
        best, brute = points[np.argmin(phi)], min(phi) - rim
        for spread in (0.02, 0.005, 0.001):  # closer and closer to the best
            tried = best + spread * rng.uniform(-1.0, 1.0, (300, 3))
            tried[:, :2] *= np.minimum(1.0, flat / np.linalg.norm(tried[:, :2], axis=1))[:, None]
            tried[:, 2] = np.clip(tried[:, 2], -3.0, high)
            s = (tried - c) @ d
            rho = np.linalg.norm(tried - c - s[:, None] * d, axis=1)
            phi = [signed_distance(cone, *each)[0] for each in zip(s, rho, strict=True)]
            best, brute = tried[np.argmin(phi)], min(brute, min(phi) - rim)
        gap, n, on_top = least_gap_of_a_stump(cone, tuple(c), tuple(d), (0.0, 0.0, -3.0), 3.0 + high, flat + rim, flat)
        assert np.linalg.norm(n) == pytest.approx(1.0, abs=1e-12)
        assert gap <= brute + 1e-6, number
        if brute > -rim:  # no deeper than the rounding: further in, the way out is no shorter than to the skin
            assert gap >= brute - 5e-4, number
        tops, apart = tops + on_top, apart + 1
    assert tops > 40
    assert apart - tops > 20


def test_a_log_across_a_stump_lies_on_all_of_its_flat_top():
    """Horizontal, 10 cm beside its middle: the chord below its axis, over its full length."""
    body = solid(taper=1.0)
    cone = cone_of(body)
    start, t, long, wide, slope = top_chord(cone, ((0.0, 0.1, 2.0), (1.0, 0.0, 0.0)), (0.0, 0.0, 1.0), 0.3, 0.1)
    assert (wide, slope) == (0.1, 0.0)
    assert long == pytest.approx(2.0 * np.sqrt(0.3**2 - 0.1**2), abs=1e-9)
    assert start == pytest.approx((-0.5 * long, 0.1, 1.0), abs=1e-9)
    assert t == (1.0, 0.0, 0.0)
