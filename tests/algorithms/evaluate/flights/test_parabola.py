"""Flights on arrays: the motion step by step, the underside of a log drawn many times, and what it passes over."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import geopandas as gpd
import numpy as np
import pytest
import shapely

from deadwood_algorithms.evaluate.flights import on_terrain
from deadwood_algorithms.evaluate.flights.from_layers import Barrier, MappedFlight, _of_points
from deadwood_algorithms.evaluate.flights.on_terrain import follow
from deadwood_algorithms.evaluate.flights.parabola import GRAVITY_MS2, Flight, outline, slope_of

FLIGHTS = [Flight(40.0, -25.0, 0.2), Flight(15.0, -2.0, 0.8), Flight(60.0, -40.0, -0.3)]


@pytest.mark.parametrize("flight", FLIGHTS)
def test_the_flight_is_the_motion_of_a_point_under_gravity(flight):
    """From the take-off with its speed and angle, at 400 times: no force but gravity leads to the landing."""
    speed = float(flight.speed(0.0))
    angle = math.atan(flight.fall)
    t = np.linspace(0.0, flight.duration, 400)
    s, z = speed * math.cos(angle) * t, speed * math.sin(angle) * t - 0.5 * GRAVITY_MS2 * t**2
    assert (s[-1], z[-1]) == pytest.approx((flight.distance, flight.rise))
    assert flight.height(s) == pytest.approx(z, abs=1e-9)
    along, up = speed * math.cos(angle), speed * math.sin(angle) - GRAVITY_MS2 * t
    assert flight.speed(s) == pytest.approx(np.hypot(along, up))
    assert flight.slope(s) == pytest.approx(up / along)
    top = int(np.argmax(z))
    assert flight.apex[1] >= z[top] - 1e-12
    assert flight.apex[0] == pytest.approx(s[top], abs=float(np.diff(s).max()))


@pytest.mark.parametrize("flight", FLIGHTS)
def test_nothing_of_the_log_is_lower_than_its_underside(flight):
    """Logs drawn every 4 cm of the way: the lowest of their outlines over a place, to the accuracy of such a step."""
    radius, length = 0.4, 3.0
    drawn = [
        shapely.Polygon(outline(flight, s, length, radius)) for s in np.linspace(-5.0, flight.distance + 5.0, 2000)
    ]
    for s in np.linspace(2.5, flight.distance - 2.5, 7):
        upright = shapely.LineString([(s, -200.0), (s, 200.0)])
        low = min(shapely.intersection(each, upright).bounds[1] for each in drawn if each.intersects(upright))
        assert float(flight.underside(s, radius)) == pytest.approx(low, abs=2e-3)


def test_the_slope_of_a_profile_is_that_of_its_straight_line():
    rng = np.random.default_rng(0)
    s, z = np.sort(rng.random(30)), rng.random(30)
    assert slope_of(s, z) == pytest.approx(np.polyfit(s, z, 1)[0])


def terrain(profile: Any) -> Any:
    """Heights that depend on x alone."""
    return cast(
        "Any", SimpleNamespace(cell=0.5, height=lambda x, y: profile(np.asarray(x, float)) + 0.0 * np.asarray(y))
    )


def cliff(x: np.ndarray) -> np.ndarray:
    return np.where(x <= 0.0, 100.0 - 0.5 * x, 80.0 - 0.1 * x)


def mapped(angle: float = math.nan, distance: float = 30.0) -> MappedFlight:
    return MappedFlight(1, "layer, row 1", (0.0, 0.0), (distance, 0.0), 50.0, 6.0, angle)


def test_the_angle_is_the_slopes_before_the_take_off_or_the_mapped_one():
    found = follow(mapped(), [], terrain(cliff), slope_over_m=4.0, tolerance_m=0.5)
    assert found.flight.fall == pytest.approx(-0.5)
    assert found.terrain_angle
    given = follow(mapped(10.0), [], terrain(cliff), slope_over_m=4.0, tolerance_m=0.5)
    assert given.flight.fall == pytest.approx(math.tan(math.radians(10.0)))
    assert found.start == pytest.approx(100.0 + 0.25 * math.hypot(1.0, 0.5))  # its underside leaves from the ground
    assert found.flight.rise == pytest.approx(-23.0)


@pytest.mark.parametrize(("tolerance", "verdict"), [(1.99, "cuts_terrain"), (2.01, "possible")])
def test_the_terrain_may_stand_into_a_flight_by_the_tolerance(tolerance, verdict):
    """A wall as high as the flight, and one 2 m higher, half way."""
    flight = Flight(30.0, -23.0, -0.5)

    def hump(x: np.ndarray) -> np.ndarray:
        inside = (x > 14.0) & (x < 16.0)
        return np.where(inside, 102.0 + flight.height(x), cliff(x))

    found = follow(mapped(), [], terrain(hump), slope_over_m=4.0, tolerance_m=tolerance)
    assert found.cut == pytest.approx(2.0)
    assert found.verdict == verdict


def test_a_flight_that_touches_nothing_needs_no_tolerance():
    found = follow(mapped(), [], terrain(cliff), slope_over_m=4.0, tolerance_m=0.0)
    assert (found.cut, found.verdict) == (0.0, "possible")


def test_a_barrier_that_is_just_touched_is_hit(monkeypatch):
    """No height of a barrier gives a clearance of exactly zero, so it is inserted."""
    passed = on_terrain._crossings

    def touched(*given: Any) -> Any:
        return [replace(each, clearance=0.0) for each in passed(*given)]

    barrier = Barrier("low", shapely.LineString([(10.0, -5.0), (10.0, 5.0)]), 1.0)
    ask = {"slope_over_m": 4.0, "tolerance_m": 1.0}
    assert follow(mapped(), [barrier], terrain(cliff), **ask).verdict == "possible"
    monkeypatch.setattr(on_terrain, "_crossings", touched)
    assert follow(mapped(), [barrier], terrain(cliff), **ask).verdict == "hits_barrier"


@pytest.mark.parametrize("seed", range(3))
def test_points_are_paired_by_their_id_and_role_in_whatever_order_they_stand(seed):
    rng = np.random.default_rng(seed)
    places = {name: [tuple(each) for each in rng.random((2, 2)).tolist()] for name in ("a", "b", "c")}
    rows = [(name, role, places[name][k]) for name in places for k, role in enumerate(("take-off", "Landing"))]
    rows = [rows[k] for k in rng.permutation(len(rows))]
    ids, roles, points = zip(*rows, strict=True)
    frame = gpd.GeoDataFrame({"flight_id": ids, "role": roles}, geometry=[shapely.Point(each) for each in points])
    frame.attrs["where"] = "flights.gpkg"
    found = _of_points(frame)
    assert {each[0]: [each[2], each[3]] for each in found} == places
    for name, row, takeoff, _ in found:  # sizes are those of the take-off's row
        assert (ids[row], points[row]) == (name, takeoff)


def test_barriers_are_passed_in_the_order_of_the_flight_with_the_clearance_of_its_underside():
    """One is crossed twice, one not at all; the last stands into the way by 1 cm."""
    flight = Flight(30.0, -23.0, -0.5)
    start = 100.0 + 0.25 * math.hypot(1.0, 0.5)

    def room(s: float) -> float:
        return start + float(flight.underside(s, 0.25)) - float(cliff(np.array(s)))

    barriers = [
        Barrier("late", shapely.LineString([(25.0, -5.0), (25.0, 5.0)]), room(25.0) + 0.01),
        Barrier("bent", shapely.LineString([(10.0, -5.0), (10.0, 5.0), (12.0, 5.0), (12.0, -5.0)]), 3.0),
        Barrier("beside", shapely.LineString([(10.0, 1.0), (10.0, 5.0)]), 30.0),
    ]
    found = follow(mapped(), barriers, terrain(cliff), slope_over_m=4.0, tolerance_m=1.0)
    assert [(each.barrier_id, each.distance) for each in found.crossings] == [
        ("bent", 10.0),
        ("bent", 12.0),
        ("late", 25.0),
    ]
    for each in found.crossings:
        assert each.clearance == pytest.approx(room(each.distance) - each.height)
        assert each.ground == cliff(np.array(each.distance))
        assert each.speed == pytest.approx(float(flight.speed(each.distance)))
    assert found.verdict == "hits_barrier"
    assert follow(mapped(), barriers[1:], terrain(cliff), slope_over_m=4.0, tolerance_m=1.0).verdict == "possible"


@pytest.mark.parametrize(("s", "free"), [(1.0, False), (15.0, True), (29.5, False)])
def test_a_log_is_free_where_both_its_ends_have_left_the_ground_and_not_come_back(s, free):
    """6 m long: half of its plan length before the take-off or behind the landing does not count as flight."""
    barrier = Barrier("b", shapely.LineString([(s, -1.0), (s, 1.0)]), 0.1)
    found = follow(mapped(), [barrier], terrain(cliff), slope_over_m=4.0, tolerance_m=30.0)
    slope = float(found.flight.slope(s))
    half = 3.0 * math.cos(math.atan(slope))
    assert (half <= s <= 30.0 - half) is free
    assert found.crossings[0].free is free


def test_a_flight_that_lands_while_it_still_rises_is_highest_at_its_landing():
    rising, falling = Flight(10.0, 4.0, 0.6), Flight(10.0, -9.0, -0.4)
    assert rising.bend > 0.0
    assert rising.slope(10.0) > 0.0
    assert rising.apex == pytest.approx((10.0, 4.0))
    assert falling.apex == (0.0, 0.0)
