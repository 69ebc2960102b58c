"""Heights over a line against the highest point of rings drawn around a log's axis."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
import shapely

from deadwood_algorithms.results.arrivals import STATIONS, heights_over

LINE = shapely.LineString([(0.0, -50.0), (0.0, 50.0)])


def ground(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 0.3 * x + 0.1 * y


def table_of(base: np.ndarray, tip: np.ndarray) -> pd.DataFrame:
    ends = {f"{axis}{end}": each[:, k] for end, each in (("b", base), ("t", tip)) for k, axis in enumerate("xyz")}
    return pd.DataFrame({"log": np.arange(len(base))} | ends)


def by_rings(base: np.ndarray, tip: np.ndarray, radii: tuple[float, float], shape: Any) -> float:
    """The highest of 720 points of each station's ring above the ground below its middle; touching or nearest."""
    axis = (tip - base) / np.linalg.norm(tip - base)
    side = np.cross(axis, [0.3, 0.5, 0.8])
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)
    turn = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
    tops, apart = [], []
    for share in np.linspace(0.0, 1.0, STATIONS):
        middle, radius = base + share * (tip - base), radii[0] + share * (radii[1] - radii[0])
        ring = middle + radius * (np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other)
        tops.append(ring[:, 2].max() - ground(middle[0], middle[1]))
        apart.append(shape.distance(shapely.Point(middle[:2])) - radius)
    near = max(min(apart), 0.0)
    return max(top for top, gap in zip(tops, apart, strict=True) if gap <= near)


@pytest.mark.parametrize("tilt_deg", [0.0, 25.0, 50.0, 75.0, 90.0])
def test_the_height_of_a_tilted_log_is_that_of_its_upper_edge(tilt_deg):
    """From upright to lying across the line, tapered; 720 points on a ring miss its top by 1e-5 of the radius."""
    rng = np.random.default_rng(3)
    n, radii = 12, (0.5, 0.25)
    tilt, turn = np.radians(tilt_deg), rng.uniform(0.0, 2.0 * np.pi, n)
    way = np.column_stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.full(n, np.cos(tilt))])
    base = np.column_stack([rng.uniform(-3.0, 0.5, n), rng.uniform(-20.0, 20.0, n), rng.uniform(0.0, 8.0, n)])
    tip = base + 9.0 * way
    found = heights_over(table_of(base, tip), LINE, (np.full(n, radii[0]), np.full(n, radii[1])), ground)
    expected = [by_rings(base[k], tip[k], radii, LINE) for k in range(n)]
    assert found == pytest.approx(expected, abs=1e-4)


def test_an_upright_log_is_as_high_as_its_tip_and_a_lying_one_half_its_thickness_over_its_axis():
    base = np.array([[0.0, 0.0, 2.0], [-2.0, 0.0, 2.0]])
    tip = np.array([[0.0, 0.0, 7.0], [2.0, 0.0, 2.0]])
    radii = np.full(2, 0.4), np.full(2, 0.4)
    upright, lying = heights_over(table_of(base, tip), LINE, radii, ground)
    assert upright == pytest.approx(7.0)
    # Places up to 0.4 m beside the line touch it; the ground falls to the west of it.
    assert lying == pytest.approx(2.4 + 0.3 * 0.4, abs=1e-9)


def test_a_log_that_only_comes_near_counts_where_it_is_nearest():
    """Outlines of stored poses may end just before the line that the log reached between two poses."""
    base, tip = np.array([[-6.0, 0.0, 1.0]]), np.array([[-2.0, 0.0, 5.0]])
    (found,) = heights_over(table_of(base, tip), LINE, (np.array([0.3]), np.array([0.3])), ground)
    assert found == pytest.approx(5.0 + 0.3 * np.sqrt(0.5) + 0.6)


def test_of_a_polygon_the_outline_counts_and_unknown_ground_does_not():
    """A log inside a house is near only the wall that its tip touches."""
    house = shapely.box(-10.0, -5.0, 0.0, 5.0)
    base, tip = np.array([[-5.0, 0.0, 1.0]]), np.array([[0.0, 0.0, 3.0]])
    radii = np.array([0.2]), np.array([0.2])
    (found,) = heights_over(table_of(base, tip), house, radii, ground)
    assert found == pytest.approx(by_rings(base[0], tip[0], (0.2, 0.2), LINE), abs=1e-4)
    assert heights_over(table_of(base, tip), house, radii, lambda x, y: np.full(x.shape, np.nan)).tolist() == [-np.inf]
