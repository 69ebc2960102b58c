"""Barriers chosen one after the other, on made-up ways of logs: trials, bounds and order by brute force."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, cast

import numpy as np
import pytest
import shapely
from scipy.stats import binomtest

from deadwood_algorithms.evaluate.protection.candidate_barriers import (
    Candidate,
    ContourPart,
    contour_parts,
    pieces_where_most_pass,
)
from deadwood_algorithms.evaluate.protection.siting import (
    Siting,
    Trial,
    Ways,
    as_lines,
    chance_of,
    choose,
    flux_of,
)
from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.stats.statistics import paired_interval


def ways_of(reach: np.ndarray, near: np.ndarray) -> Ways:
    n, number = near.shape
    no, nan = np.zeros((n, number), bool), np.full((n, number), np.nan)
    return Ways(reach, near, no, no, no, no, nan, nan)


class Paper(Siting):
    """A siting whose logs are stopped by a candidate where a table says so, whatever else stands."""

    def __init__(self, near: np.ndarray, stops: np.ndarray, candidates: list[Candidate]) -> None:
        self.near, self.stops, self.candidates = near, stops, candidates
        self.place = np.arange(len(candidates))
        self.tried: list[int] = []

    def rows_near(self, ways: Ways, chosen: Any, number: int) -> np.ndarray:
        return np.flatnonzero(self.near[:, number])

    def slide(self, rows: np.ndarray, chosen: Any, what: str, later: Any = ()) -> Any:
        self.tried.append(chosen[-1])
        reach = np.atleast_1d(~self.stops[rows][:, list(chosen)].any(axis=1))
        return ways_of(reach[:, None], self.near[rows]), None


def candidates(*sizes: tuple[float, float]) -> list[Candidate]:
    """Lines far apart, of a length and height."""
    return [
        Candidate(f"c{k}", shapely.LineString([(0, 100 * k), (length, 100 * k)]), height, 1.0)
        for k, (length, height) in enumerate(sizes)
    ]


def greedy(near: np.ndarray, stops: np.ndarray, sizes: list[tuple[float, float]], count: int) -> list[int]:
    """Every candidate tried every time."""
    chosen: list[int] = []
    while len(chosen) < count:

        def kept(k: int) -> int:
            now = stops[:, chosen].any(axis=1) if chosen else np.zeros(len(stops), bool)
            return int((stops[:, k] & near[:, k] & ~now).sum())

        left = [k for k in range(len(sizes)) if k not in chosen]
        chosen.append(min(left, key=lambda k: (-kept(k), sizes[k][0] * sizes[k][1], k)))
    return chosen


@pytest.mark.parametrize("seed", range(6))
def test_the_best_beside_those_chosen_is_that_of_trying_all(seed):
    rng = np.random.default_rng(seed)
    n, sizes = 300, [(20.0, 4.0), (20.0, 3.0), (30.0, 3.0), (20.0, 3.0), (40.0, 5.0)]
    near = rng.random((n, 5)) < rng.uniform(0.2, 0.7, 5)
    stops = near & (rng.random((n, 5)) < 0.5)
    siting = Paper(near, stops, candidates(*sizes))
    start = ways_of(np.ones((n, 1), bool), near)
    first = [siting.trial(start, (), k) for k in range(5)]
    for k, trial in enumerate(first):
        assert (trial.kept, trial.brought) == (int(stops[:, k].sum()), 0)
    steps, why = choose(siting, start, first, 3, Quiet())
    assert why == ""
    assert list(steps[-1].chosen) == greedy(near, stops, sizes, 3)
    gone = stops[:, list(steps[-1].chosen)].any(axis=1)
    assert np.array_equal(~steps[-1].ways.any_line, gone)
    assert [step.trial.gain for step in steps] == np.diff(
        [0, *(int(stops[:, list(step.chosen)].any(axis=1).sum()) for step in steps)]
    ).tolist()


def test_of_equal_gains_the_smaller_face_is_built_then_the_first():
    near = stops = np.tile(np.arange(40)[:, None] < 20, (1, 4))
    siting = Paper(near, stops, candidates((20.0, 4.0), (25.0, 3.0), (30.0, 2.5), (15.0, 5.0)))
    start = ways_of(np.ones((40, 1), bool), near)
    best, among = siting.best(start, (), range(4))
    assert (best.number if best else None, among) == (1, 4)  # 75 m2, as the last two; 80 m2 the first


def test_what_cannot_be_best_is_not_slid():
    near = np.zeros((50, 3), bool)
    near[:30, 0] = near[:12, 1] = near[:8, 2] = True
    stops = near.copy()
    stops[11:, 0] = False  # keeps 11 away: the second might keep 12, the third at most 8
    siting = Paper(near, stops, candidates((20.0, 3.0), (20.0, 3.0), (20.0, 3.0)))
    best, _ = siting.best(ways_of(np.ones((50, 1), bool), near), (), range(3))
    assert siting.tried == [0, 1]
    assert best is not None
    assert (best.number, best.gain) == (1, 12)


def trial(kept: int, brought: int) -> Trial:
    return Trial(0, np.zeros(0, np.int64), cast("Any", None), kept, brought)


def test_the_gain_and_its_chance():
    one = trial(12, 3)
    assert one.gain_record(100)["gain_p"] == 0.09
    assert one.gain == one.gain_record(100)["gain_logs"] == 9
    low, high = list(one.gain_record(100).values())[2:]
    assert (low, high) == paired_interval(3, 12, 100)
    assert low < 0.09 < high
    p = binomtest(3, 15).pvalue
    assert chance_of(one, 1) == pytest.approx(p)
    assert chance_of(one, 2) == pytest.approx(2.0 * p)
    assert chance_of(one, 1000) == 1.0


@pytest.mark.parametrize(("kept", "among", "built"), [(6, 1, True), (6, 2, False), (5, 1, False), (0, 1, False)])
def test_what_chance_alone_does_is_not_built(kept, among, built):
    """Six logs one way: p = 2 / 64 = 0.031; the best of two so good, 0.062; five, 0.0625."""
    sizes = [(20.0, 3.0)] * among
    near = np.zeros((30, among), bool)
    near[:kept, 0] = True
    siting = Paper(near, near, candidates(*sizes))
    start = ways_of(np.ones((30, 1), bool), near)
    steps, why = choose(siting, start, [siting.trial(start, (), k) for k in range(among)], 1, Quiet())
    assert (len(steps) == 1, why == "") == (built, built)
    assert built or f"the best of {among} candidates left would keep {kept} logs" in why


def test_a_candidate_along_a_chosen_one_is_not_free():
    """It may run beside it for 3 m within 1 m, as at a joint."""
    shapes = [[(0, 0), (20, 0)], [(17.9, 0.5), (40, 0.5)], [(16.0, 0.5), (40, 0.5)], [(0, 1.2), (20, 1.2)]]
    siting = Paper(np.zeros((1, 4), bool), np.zeros((1, 4), bool), [
        Candidate(str(k), shapely.LineString(each), 3.0, 1.0) for k, each in enumerate(shapes)
    ])  # fmt: skip
    assert siting.free([0]) == [1, 3]
    assert siting.free([]) == [0, 1, 2, 3]


@pytest.mark.parametrize("seed", range(4))
def test_a_log_passes_a_thing_on_its_way_to_a_line(seed):
    rng = np.random.default_rng(seed)
    touched, lines = (
        np.where(rng.random((60, k)) < 0.5, rng.integers(0, 6, (60, k)).astype(float), np.inf) for k in (4, 2)
    )
    lines[0] = -np.inf  # starts within: reached before anything is touched
    found = flux_of(touched, lines)
    for log in range(60):
        for thing in range(4):
            at = touched[log, thing]
            expected = at < np.inf and any(at <= time < np.inf for time in lines[log])
            assert found[log, thing] == expected


def test_without_lines_nothing_is_passed_on_the_way_to_one():
    assert not flux_of(np.zeros((3, 2)), np.zeros((3, 0))).any()


def test_ways_of_some_logs_replace_theirs_alone():
    rng = np.random.default_rng(0)
    one, other = (
        Ways(*(rng.random((k, 2)) for _ in range(8)))
        for k in (6, 2)  # numbers serve as well
    )
    rows = np.array([4, 1])
    both = one.with_rows(rows, other)
    for each in fields(Ways):
        values = getattr(both, each.name)
        assert np.array_equal(values[rows], getattr(other, each.name))
        assert np.array_equal(np.delete(values, rows, 0), np.delete(getattr(one, each.name), rows, 0))


def test_polygons_are_watched_by_their_rings_and_parts_by_their_thing():
    ring = shapely.box(0, 0, 2, 1)
    two = shapely.MultiLineString([[(0, 0), (1, 0)], [(5, 5), (6, 6), (7, 6)]])
    lines, items = as_lines([two, ring])
    assert items.item.tolist() == [0, 0, 1]
    assert np.diff(lines.starts).tolist() == [2, 3, 5]
    drawn = [shapely.LineString(lines.vertices[a:b]) for a, b in zip(lines.starts, lines.starts[1:], strict=False)]
    assert shapely.union_all(drawn[:2]).equals(two)
    assert drawn[2].equals(ring.exterior)


def test_contours_are_cut_into_parts_of_one_length():
    contours = [shapely.LineString([(0, 0), (23, 0)]), shapely.LineString([(0, 9), (3, 9)])]
    parts = contour_parts(contours, 20.0)
    assert [(each.contour, each.begin, each.end) for each in parts] == [(0, 5.0 * k, 5.0 * k + 5.0) for k in range(4)]
    long = [shapely.LineString([(0, 0), (12_000, 0)])]
    assert len(contour_parts(long, 20.0)) == 600


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("length", [10.0, 17.0, 20.0])
def test_the_places_where_most_pass_are_those_of_every_window(seed, length):
    rng = np.random.default_rng(seed)
    contours = [shapely.LineString([(0, 0), (60, 0)]), shapely.LineString([(0, 9), (30, 9)])]
    parts = [ContourPart(c, 5.0 * k, 5.0 * k + 5.0) for c, n in ((0, 12), (1, 6)) for k in range(n)]
    passed = rng.random((50, 18)) < rng.uniform(0.0, 0.3, 18)
    found = pieces_where_most_pass(contours, parts, passed, length, 3)
    wide = int(np.ceil(length / 5.0))
    windows = []
    for contour, first, n in ((0, 0, 12), (1, 12, 6)):
        for k in range(n - wide + 1):
            logs = sum(bool(row[first + k : first + k + wide].any()) for row in passed)
            windows.append((-logs, contour, 5.0 * k + 0.5 * (5.0 * wide - length)))
    kept: list[tuple[int, int, float]] = []
    for each in sorted(windows):
        if (
            each[0]
            and len(kept) < 3
            and all(each[1] != other[1] or abs(each[2] - other[2]) >= 0.5 * length for other in kept)
        ):
            kept.append(each)
    assert [n for _, n in found] == [-each[0] for each in kept]
    for (shape, _), (_, contour, begin) in zip(found, kept, strict=True):
        assert shape.length == pytest.approx(length)
        assert shapely.get_coordinates(shape)[0] == pytest.approx([begin, 9.0 * contour])
