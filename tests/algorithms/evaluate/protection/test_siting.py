"""Barriers chosen one after the other, on made-up outcomes of logs: trials, bounds and order by brute force."""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, cast

import matplotlib.pyplot as plt
import numpy as np
import pandas
import pytest
import shapely
from scipy.stats import binomtest
from shapely.ops import substring

from deadwood_algorithms.evaluate.protection.candidate_barriers import (
    MOST_ANGLE_DEG,
    Candidate,
    contour_angle,
    places_where_most_pass,
    straight_piece,
    straight_pieces,
    with_barriers,
)
from deadwood_algorithms.evaluate.protection.siting import (
    LogOutcomes,
    Siting,
    Trial,
    as_lines,
    chance_of,
    choose,
    flux_of,
    times_of,
    why_none,
)
from deadwood_algorithms.evaluate.protection.siting_figure import ASIDE_IN, _chart
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.scene.items import Items
from deadwood_algorithms.stats.statistics import paired_interval
from deadwood_engine import Barriers


def outcomes_of(reach: np.ndarray, near: np.ndarray) -> LogOutcomes:
    n, number = near.shape
    no, nan = np.zeros((n, number), bool), np.full((n, number), np.nan)
    return LogOutcomes(np.zeros(n, bool), reach, near, no, no, no, no, nan, nan)


class Paper(Siting):
    """A siting in which a table defines which logs a candidate stops, independently of other barriers."""

    def __init__(self, near: np.ndarray, stops: np.ndarray, candidates: list[Candidate]) -> None:
        self.near, self.stops, self.candidates = near, stops, candidates
        self.place = np.arange(len(candidates))
        self.tried: list[int] = []

    def rows_near(self, outcomes: LogOutcomes, chosen: Any, number: int) -> np.ndarray:
        return np.flatnonzero(self.near[:, number])

    def slide(self, rows: np.ndarray, chosen: Any, what: str, later: Any = ()) -> Any:
        self.tried.append(chosen[-1])
        reach = np.atleast_1d(~self.stops[rows][:, list(chosen)].any(axis=1))
        return outcomes_of(reach[:, None], self.near[rows]), None


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
    start = outcomes_of(np.ones((n, 1), bool), near)
    first = [siting.trial(start, (), k) for k in range(5)]
    for k, trial in enumerate(first):
        assert (trial.kept, trial.brought) == (int(stops[:, k].sum()), 0)
    steps, why = choose(siting, start, first, 3, Quiet())
    assert why == "--count 3 is reached; a larger --count finds the next best"
    assert list(steps[-1].chosen) == greedy(near, stops, sizes, 3)
    gone = stops[:, list(steps[-1].chosen)].any(axis=1)
    assert np.array_equal(~steps[-1].outcomes.any_line, gone)
    assert [step.trial.gain for step in steps] == np.diff(
        [0, *(int(stops[:, list(step.chosen)].any(axis=1).sum()) for step in steps)]
    ).tolist()


def test_of_equal_gains_the_smaller_face_is_built_then_the_first():
    near = stops = np.tile(np.arange(40)[:, None] < 20, (1, 4))
    siting = Paper(near, stops, candidates((20.0, 4.0), (25.0, 3.0), (30.0, 2.5), (15.0, 5.0)))
    start = outcomes_of(np.ones((40, 1), bool), near)
    best, among = siting.best(start, (), range(4))
    assert (best.number if best else None, among) == (1, 4)  # 75 m2, as the last two; 80 m2 the first


def test_what_cannot_be_best_is_not_slid():
    near = np.zeros((50, 3), bool)
    near[:30, 0] = near[:12, 1] = near[:8, 2] = True
    stops = near.copy()
    stops[11:, 0] = False  # keeps 11 away: the second might keep 12, the third at most 8
    siting = Paper(near, stops, candidates((20.0, 3.0), (20.0, 3.0), (20.0, 3.0)))
    best, _ = siting.best(outcomes_of(np.ones((50, 1), bool), near), (), range(3))
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
    start = outcomes_of(np.ones((30, 1), bool), near)
    steps, why = choose(siting, start, [siting.trial(start, (), k) for k in range(among)], 1, Quiet())
    assert (len(steps) == 1, why.startswith("--count 1 is reached")) == (built, built)
    assert built or not kept or f"the best of the {counted(among, 'candidate')} left would keep {kept} more logs" in why


def test_a_candidate_along_a_chosen_one_is_not_free():
    """It may run within 1 m of it for 3 m, as at a joint."""
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
        LogOutcomes(*(rng.random((k, 2)) for _ in fields(LogOutcomes)))
        for k in (6, 2)  # numbers serve as well
    )
    rows = np.array([4, 1])
    both = one.with_rows(rows, other)
    for each in fields(LogOutcomes):
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


@dataclass
class BarrierLayers:
    """The part of a scene that `with_barriers` changes."""

    engine_barriers: Barriers
    barriers: Items

    def prepared_again(self) -> BarrierLayers:
        return self


def test_candidates_stand_behind_the_runs_own_barriers_each_with_its_line_and_height():
    own = [shapely.LineString([(0, 0), (1, 0), (2, 1)]), shapely.LineString([(9, 9), (8, 9)])]
    could = [
        Candidate("two parts", shapely.MultiLineString([[(0, 5), (1, 5)], [(3, 5), (4, 6), (5, 6)]]), 2.5, np.nan),
        Candidate("one", shapely.LineString([(7, 7), (7, 8)]), 4.0, np.nan),
    ]
    watched, items = as_lines(own)
    layers: Any = BarrierLayers(Barriers(watched.vertices, watched.starts, np.array([1.0, 3.0])), items)
    both = with_barriers(layers, could)
    assert [str(each) for each in both.barriers.ids] == ["0", "1", "two parts", "one"]
    starts = both.engine_barriers.starts
    assert (starts[0], starts[-1]) == (0, len(both.engine_barriers.vertices))
    parts = [both.engine_barriers.vertices[a:b] for a, b in pairwise(starts.tolist())]
    stand = [*zip(own, (1.0, 3.0), strict=True), *((each.shape, each.height) for each in could)]
    for number, (shape, height) in enumerate(stand):
        rows = np.flatnonzero(both.barriers.item == number)
        assert shapely.union_all([shapely.LineString(parts[row]) for row in rows]).equals(shape)
        assert set(both.engine_barriers.height[rows].tolist()) == {height}


class Started(SimpleNamespace):
    """Where logs start: the part of the releases that is used."""

    def __len__(self) -> int:
        return len(self.x)


def test_a_log_that_starts_inside_touches_before_all_others_and_one_that_never_does_after_all():
    _, items = as_lines([shapely.box(0, 0, 2, 2), shapely.LineString([(5, 0), (5, 9)])])
    starts: Any = Started(x=np.array([1.0, 1.0, 9.0, 9.0]), y=np.ones(4))
    times = np.array([[np.nan, 3.0], [2.0, np.nan], [4.0, 1.0], [np.nan, np.nan]])
    result: Any = SimpleNamespace(reach=np.isfinite(times), reach_time=times)
    inf = np.inf
    assert times_of(items, result, starts).tolist() == [[-inf, 3.0], [-inf, inf], [4.0, 1.0], [inf, inf]]


GULLY_M = 8.0  # amplitude of the contours of a slope with gullies, every 25 m


def winding() -> shapely.LineString:
    x = np.arange(0.0, 200.0, 0.25)
    return shapely.LineString(np.column_stack([x, 40.0 + GULLY_M * np.sin(2.0 * np.pi * x / 25.0)]))


def slope_angle(piece: shapely.LineString, bend: float) -> float:
    """Between a straight line and the contours, of the slope's formula at 400 places, weighted by steepness."""
    (x0, y0), (x1, y1) = piece.coords
    x = x0 + (np.arange(400) + 0.5) / 400 * (x1 - x0)
    east = -0.7 * bend * 2.0 * np.pi / 25.0 * np.cos(2.0 * np.pi * x / 25.0)
    way = np.array([x1 - x0, y1 - y0]) / piece.length
    along, across = np.abs(east * way[0] + 0.7 * way[1]), np.abs(-east * way[1] + 0.7 * way[0])
    return float(np.degrees(np.arctan2(along.sum(), across.sum())))


@pytest.mark.parametrize("length", [10.0, 20.0, 40.0])
def test_a_piece_along_a_winding_contour_is_straight_and_as_long_as_requested(length):
    """From end to end; a piece of 20 m cut from this contour spans 10 to 12 m. On the contour with its ends, and never
    far off the contours under it, by the slope's formula (to a degree and a half: gradients over an eighth)."""
    contour = winding()
    assert shapely.LineString(substring(contour, 20.0, 40.0).boundary.geoms).length < 0.65 * 20.0
    gentle = shapely.LineString(shapely.get_coordinates(contour) * [1.0, 0.2])
    for each, bend in ((contour, GULLY_M), (gentle, 0.2 * GULLY_M)):

        def terrain(x: np.ndarray, y: np.ndarray, bend: float = bend) -> np.ndarray:
            return 0.7 * (y - bend * np.sin(2.0 * np.pi * x / 25.0))

        found = straight_pieces([each], length, 2.5, terrain)
        for piece in found:
            ends = shapely.points(piece.coords)
            assert len(piece.coords) == 2
            assert ends[0].distance(ends[1]) == pytest.approx(length, abs=1e-9)
            assert each.distance(ends).max() < 1e-9
            assert slope_angle(piece, bend) < MOST_ANGLE_DEG + 1.5
        if bend < 2.0:  # to and fro by 3.2 m: nearly everywhere
            assert len(found) > 0.8 * (each.length - length) / 2.5 - 10


@pytest.mark.parametrize("seed", range(5))
def test_a_piece_ends_where_the_contour_first_is_so_far_away(seed):
    rng = np.random.default_rng(seed)
    along = np.cumsum(rng.normal([1.0, 0.0], 1.5, (80, 2)), axis=0)
    contour = shapely.LineString(along)
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(along, axis=0).T))])
    dense = np.arange(0.0, contour.length, 1e-3)
    places = shapely.get_coordinates(shapely.line_interpolate_point(contour, dense))
    for begin in (0.0, 3.3, 0.3 * way[-1], way[-1] - 4.0):
        piece = straight_piece(along, way, begin, 12.0)
        start = np.array(contour.interpolate(begin).coords[0])
        far = (np.hypot(*(places - start).T) >= 12.0) & (dense > begin)
        assert (piece is None) == (not far.any())
        if piece is not None:
            assert piece.length == pytest.approx(12.0)
            assert np.array(piece.coords) == pytest.approx(np.array([start, places[np.argmax(far)]]), abs=2e-3)


@pytest.mark.parametrize("turned", [0.0, 17.0, 45.0, 80.0])
def test_the_angle_to_the_contours_of_a_plane(turned):
    angle = np.radians(turned)
    line = shapely.LineString([(5.0, 5.0), (5.0 + 20.0 * np.cos(angle), 5.0 + 20.0 * np.sin(angle))])
    assert contour_angle(line, lambda x, y: 0.6 * y) == pytest.approx(turned)
    two = shapely.MultiLineString([[(0, 0), (8, 0)], [(9, 0), (9, 8)]])
    assert contour_angle(two, lambda x, y: 0.6 * y) == pytest.approx(45.0)
    assert np.isnan(contour_angle(line, lambda x, y: np.full(x.shape, np.nan)))


def test_a_line_over_a_spur_is_not_level_because_its_ends_are():
    """On a ridge with sides of 45 degrees that falls by a fifth, straight across: atan(1 / 0.2)."""
    line = shapely.LineString([(-10.0, 0.0), (10.0, 0.0)])
    assert contour_angle(line, lambda x, y: 0.2 * y - np.abs(x)) == pytest.approx(np.degrees(np.arctan(5.0)))


@pytest.mark.parametrize("seed", range(5))
def test_the_places_where_most_pass_are_apart_and_none_is_passed_over(seed):
    """By brute force: the piece with most logs, then the next of those not within half a length of a chosen one."""
    rng = np.random.default_rng(seed)
    pieces = [shapely.LineString([(3.0 * k, 0.0), (3.0 * k + 20.0, 0.0)]) for k in range(30)]
    passed = rng.random((50, 30)) < rng.uniform(0.0, 0.4, 30)
    found = places_where_most_pass(pieces, passed, 20.0, 4)
    left, expected = set(range(30)), []
    while left and len(expected) < 4:
        best = min(left, key=lambda k: (-int(passed[:, k].sum()), k))
        expected.append(best)
        left -= {k for k in left if abs(3.0 * (k - best)) < 10.0}
    assert [(pieces[k], int(passed[:, k].sum())) for k in expected] == found
    assert places_where_most_pass(pieces, np.zeros((50, 30), bool), 20.0, 4) == []


def test_a_candidate_that_brings_more_logs_is_reported_to():
    """Before: "would keep -28 logs more away"."""
    assert "the best of the 7 candidates left would keep 3 more logs away" in why_none(trial(5, 2), 7)
    assert "none of the 7 candidates left" in why_none(trial(2, 2), 7)
    worse = why_none(trial(2, 30), 7)
    assert "-28" not in worse
    assert "would let more logs reach a line, the best 28 more" in worse


def test_the_chart_has_a_row_for_each_place_and_a_mark_for_each_height():
    """A place's marks stand at its row, those of two heights side by side on paper, in the order of the places."""
    reach = {1: 0.1, 2: 0.4, 3: 0.25}
    places = [
        (
            None,
            pandas.DataFrame(
                [
                    {"length_m": 10.0 * n, "height_m": h, "p": p - 0.01 * h, "ci_low": p - 0.06, "ci_high": p + 0.2}
                    for h in (2.0, 4.0)
                ]
            ),
        )
        for n, p in reach.items()
    ]
    figure, axes = plt.subplots()
    _chart(axes, places)
    figure.canvas.draw()
    shown = [each.lines[0] for each in axes.containers]
    assert [np.asarray(each.get_ydata()).tolist() for each in shown] == [[1, 2, 3]] * 2
    for each, height in zip(shown, (2.0, 4.0), strict=True):
        assert each.get_xdata() == pytest.approx([100.0 * (p - 0.01 * height) for p in reach.values()])
    on_paper = [each.get_transform().transform(each.get_xydata())[:, 1] for each in shown]
    assert on_paper[0] - on_paper[1] == pytest.approx(np.full(3, ASIDE_IN * figure.dpi))
    assert (on_paper[0] > axes.transData.transform([(0.0, n) for n in reach])[:, 1]).all()
    assert [each.get_text() for each in axes.get_yticklabels()] == [f"{n}: {10 * n} m long" for n in reach]
    rows = axes.get_ylim()
    assert rows[0] > rows[1], "the first is at the top"
    plt.close(figure)
