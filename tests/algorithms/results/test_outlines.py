"""Outlines and solids of logs: areas, volumes and times that are known, and the run's own hit counts."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pandas
import pytest
import rasterio
import shapely
from slope_case import Case

from deadwood_algorithms.results import outlines as log_outlines
from deadwood_algorithms.results.outlines import Ends, hulls, outlines, solids
from deadwood_algorithms.results.run_folder import read_run

OCTAGON = 2.0 * np.sqrt(2.0)  # area over the square of the radius


def ends(axis: tuple[float, float, float], length: float = 20.0, base: float = 0.4, tip: float = 0.2) -> Ends:
    unit = np.array(axis) / np.linalg.norm(axis)
    start = np.array([[2_786_000.0, 1_196_000.0, 1000.0]])
    one = np.ones(1)
    return Ends(np.zeros(1, np.int64), 0 * one, 0 * one, start, start + length * unit, base * one, tip * one)


def test_a_log_that_lies_is_a_trapezoid_and_one_that_stands_an_octagon():
    assert shapely.area(hulls(ends((3.0, 4.0, 0.0))))[0] == pytest.approx(20.0 * (0.4 + 0.2), rel=1e-9)
    assert shapely.area(hulls(ends((0.0, 0.0, 1.0))))[0] == pytest.approx(OCTAGON * 0.4**2, rel=1e-9)
    tilted = shapely.area(hulls(ends((1.0, 0.0, 1.0))))[0]
    # between the trapezoid of its plan length and that with both round ends (half ellipses, of half their width) added
    plan = 20.0 / np.sqrt(2.0) * 0.6
    assert plan < tilted < plan + np.pi * (0.4**2 + 0.2**2) / 2.0 / np.sqrt(2.0)


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (1.0, -2.0, 0.5)])
def test_a_solid_is_closed_and_has_the_volume_of_its_frustum(axis):
    solid = solids(ends(axis))[0]
    volume, edges = 0.0, {}
    origin = shapely.get_coordinates(solid, include_z=True).mean(axis=0)
    for face in solid.geoms:
        ring = shapely.get_coordinates(face.exterior, include_z=True) - origin
        for a, b in itertools.pairwise(ring):
            key = tuple(sorted((tuple(np.round(a, 6)), tuple(np.round(b, 6)))))
            edges[key] = edges.get(key, 0) + 1
        for k in range(1, len(ring) - 2):
            volume += np.linalg.det([ring[0], ring[k], ring[k + 1]]) / 6.0
    assert set(edges.values()) == {2}
    exact = OCTAGON * 20.0 / 3.0 * (0.4**2 + 0.4 * 0.2 + 0.2**2)
    assert abs(volume) == pytest.approx(exact, rel=1e-6)  # coordinates of 1e6 m in doubles


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = Case(tmp_path_factory.mktemp("outlines"))
    return made.run(time_limit_s=20.0, **made.everything())


def test_each_moment_shows_each_log_once_and_where_the_run_counted_it(case, said):
    run = read_run(str(case), feedback=said)
    frame, step = outlines(run, 0.5, said)
    assert step == 0.5
    durations = run.deposits.set_index("log_id")["duration_s"]
    assert set(frame["log_id"]) == set(durations.index)
    last = durations.max() + log_outlines.STAYS_S
    start = pandas.Timestamp("2000-01-01", tz="UTC")
    for _, of_log in frame.groupby("log_id"):
        begin = (of_log["t"] - start).dt.total_seconds().to_numpy()
        end = (of_log["t_end"] - start).dt.total_seconds().to_numpy()
        assert begin[0] == 0.0
        assert begin[-1] == pytest.approx(durations[of_log["log_id"].iloc[0]], abs=0.001)
        assert begin[1:] - end[:-1] == pytest.approx(np.full(len(begin) - 1, 0.010), abs=0.0011)  # to a millisecond
        assert end[-1] == pytest.approx(last, abs=0.001)

    with rasterio.open(case / "hit_count.tif") as source:
        hits, transform = source.read(1), source.transform
    rows, columns = np.nonzero(hits == 0)
    x, y = transform * (columns + 0.5, rows + 0.5)
    inside = frame.geometry.buffer(-0.15)  # poses are a little apart, and a log turns between two of them
    tree = shapely.STRtree(shapely.points(x, y))
    assert tree.query(inside[~inside.is_empty], predicate="contains").size == 0


def test_too_many_outlines_are_thinned_and_reported(case, said, monkeypatch):
    monkeypatch.setattr(log_outlines, "MOST", 150)
    run = read_run(str(case), feedback=said)
    frame, step = outlines(run, 0.1, said)
    assert step > 0.1
    assert len(frame) <= 150
    assert said.warnings == [f"an outline every 0.1 s would be more than 150; one is written every {step:g} s"]
