"""Of the logs that pass a cell, those that touch a line then or later: by hand, and by brute force from the poses."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, Lines, Logs, Rasters, Scene, Trees, segments_of, slide
from deadwood_engine.outline import sweep_danger, sweep_hits, sweep_touches
from deadwood_engine.rasters import NO_BANDS

CELL = 0.5
BANDS = np.array([1, 2, 1, 0, 3])  # two lines of one thing, one that is only watched, and one above the logs
COUNT = 30


def road() -> Lines:
    ends = [[0, 15], [60, 15], [10, 40], [32, 40], [35, 30], [60, 30], [0, 50], [60, 50], [1, 78], [5, 78]]
    return Lines(np.array(ends, float), np.arange(0, 12, 2))


def slope() -> Scene:
    rng = np.random.default_rng(2)
    heights = 0.7 * CELL * np.arange(160)[:, None] + 0.3 * rng.random((160, 120))
    heights[:40] = heights[40]
    stems = Trees(60 * rng.random(60), 30 + 25 * rng.random(60), np.full(60, 0.4), np.full(60, 15.0))
    return Scene.prepare(heights, CELL, 0.0, 0.0, friction=0.25, lines=road(), trees=stems)


def logs() -> Logs:
    rng = np.random.default_rng(5)
    return Logs.alike(25 + 12 * rng.random(COUNT), 55 + 8 * rng.random(COUNT), length=8.0, diameter=0.4)


@pytest.fixture(scope="module")
def runs():
    found = {}
    for threads, bands in ((1, BANDS), (2, BANDS), (1, NO_BANDS)):
        scene = slope()
        rasters = Rasters.allocate(scene, threads, bands)
        result = slide(
            scene, logs(), FIDELITIES["standard"], threads=threads, rasters=rasters, keep_poses=np.ones(COUNT, bool)
        )
        found[threads, len(bands)] = result, rasters.totals()
    return found


def test_what_is_counted_is_what_brute_force_finds_in_the_poses(runs):
    """Each log's own cells, pose by pose, as sets; the first touch by the same sweeps, one pose after the other."""
    result, totals = runs[1, 5]
    poses, segments = result.poses, segments_of(road())
    expected = np.zeros((4, 160, 120), int)
    radius = np.array([0.2])
    for log in range(COUNT):
        rows = np.flatnonzero(poses.log_row == log)
        first_cell = np.full((160, 120), -1)
        first_line = np.full(5, -1)
        for k, row in enumerate(rows):
            pair = rows[max(k - 1, 0)], row
            base, tip = poses.base[list(pair)], poses.tip[list(pair)]
            alone = np.zeros(2, int)
            hit = sweep_hits(alone, base, tip, radius, 0.5 * radius, x0=0.0, y0=0.0, cell=CELL, shape=(160, 120)) > 0
            touched = sweep_touches(alone, base, tip, radius, 0.5 * radius, segments)[0][0]
            first_cell[hit & (first_cell < 0)] = k
            first_line[touched & (first_line < 0)] = k
        bands = [
            first_line[band == BANDS][first_line[band == BANDS] >= 0].min(initial=np.iinfo(int).max)
            for band in (1, 2, 3)
        ]
        bands = np.where(np.array(bands) == np.iinfo(int).max, -1, bands)
        was = first_cell >= 0
        for band, when in enumerate(bands, start=1):
            expected[band] += was & (first_cell <= when)
        expected[0] += was & (first_cell <= bands.max())
    assert np.array_equal(totals["danger"], expected)
    assert 0 < expected[1].max() < COUNT
    assert expected[2].max() > 0
    assert not expected[3].any()
    assert (totals["danger"] <= totals["hit_count"]).all()


def test_stored_poses_tell_the_same(runs):
    result, totals = runs[1, 5]
    poses, radius = result.poses, np.full(COUNT, 0.2)
    _, touch = sweep_touches(poses.log_row, poses.base, poses.tip, radius, 0.5 * radius, segments_of(road()))
    none = np.iinfo(np.int64).max
    late = np.where(touch < 0, none, touch)
    by_band = np.stack([late[:, band == BANDS].min(axis=1) for band in (1, 2, 3)], axis=1)
    count, danger = sweep_danger(
        poses.log_row, poses.base, poses.tip, radius, 0.5 * radius, np.where(by_band == none, -1, by_band),
        x0=0.0, y0=0.0, cell=CELL, shape=(160, 120),
    )  # fmt: skip
    assert np.array_equal(count, totals["hit_count"])
    assert np.array_equal(danger, totals["danger"])


def test_threads_change_nothing_and_nothing_else_changes(runs):
    (one, ours), (two, theirs), (none, without) = runs[1, 5], runs[2, 5], runs[1, 0]
    assert np.array_equal(ours["danger"], theirs["danger"])
    assert "danger" not in without
    for name, values in without.items():
        assert np.array_equal(values, ours[name], equal_nan=True), name
    assert np.array_equal(one.last_state, none.last_state)
    assert np.array_equal(one.last_state, two.last_state)
    assert np.array_equal(one.reach_time, none.reach_time, equal_nan=True)


def test_totals_continue_where_they_were(runs):
    _, totals = runs[1, 5]
    scene = slope()
    halves = Rasters.allocate(scene, 1, BANDS)
    slide(scene, logs().take(np.arange(11)), FIDELITIES["standard"], rasters=halves)
    resumed = Rasters.allocate(scene, 2, BANDS)
    resumed.add(halves.totals())
    slide(scene, logs().take(np.arange(11, COUNT)), FIDELITIES["standard"], rasters=resumed, threads=2)
    for name, values in resumed.totals().items():
        assert np.array_equal(values, totals[name], equal_nan=values.dtype.kind == "f"), name


def test_straight_down_a_plane():
    """By hand: one log slides straight down over two lines. Above the upper all reach both, between them the lower."""
    heights = np.tile(0.7 * np.arange(120.0)[:, None], (1, 40))
    ends = np.array([[0.0, 30.0], [39.0, 30.0], [0.0, 60.0], [39.0, 60.0]])
    scene = Scene.prepare(heights, 1.0, 0.0, 0.0, friction=0.2, lines=Lines(ends, np.array([0, 2, 4])))
    rasters = Rasters.allocate(scene, 1, np.array([1, 2]))
    log = Logs.alike([20.3], [100.0], length=6.0, diameter=0.4, orientation=1, azimuth=np.pi)
    result = slide(scene, log, FIDELITIES["standard"], rasters=rasters, time_limit=60.0)
    assert result.reach.all()
    totals = rasters.totals()
    hits, (any_line, lower, upper) = totals["hit_count"], totals["danger"]
    column = hits[:, 20] > 0
    assert column[2:95].all()
    assert (upper[62:, 20] == column[62:]).all()
    assert (lower[32:, 20] == column[32:]).all()
    # the outline that first touches goes no farther than what it moves between two outlines, 4 cells
    assert not upper[:55].any()
    assert not lower[:25].any()
    assert np.array_equal(any_line, lower)


def test_a_log_released_on_a_line_or_within_has_reached_it_with_its_first_outline():
    heights = np.tile(0.7 * np.arange(120.0)[:, None], (1, 40))
    ends = np.array([[0.0, 100.0], [39.0, 100.0], [2.0, 5.0], [3.0, 5.0]])
    scene = Scene.prepare(heights, 1.0, 0.0, 0.0, friction=0.2, lines=Lines(ends, np.array([0, 2, 4])))
    log = Logs.alike([20.3], [100.0], length=6.0, diameter=0.4, orientation=1, azimuth=np.pi)
    rasters = Rasters.allocate(scene, 1, np.array([1, 2]))
    slide(scene, log, FIDELITIES["draft"], rasters=rasters, inside=np.array([[False, True]]))
    any_line, on, within = rasters.totals()["danger"]
    assert np.array_equal(on, within)
    assert np.array_equal(on, any_line)
    assert 6 <= on.sum() <= 12
    assert on[97:103, 20].all()


def test_more_room_changes_neither_danger_nor_the_time_of_touch(monkeypatch):
    """A log that wants more poses than the buffer holds slides again: its lines are as if it had not."""
    heights = np.tile(0.75 * 0.25 * np.arange(8200)[:, None], (1, 9))
    lines = Lines(np.array([[0.0, 500.0], [2.0, 500.0]]), np.array([0, 2]))
    scene = Scene.prepare(heights, 0.25, 0.0, 0.0, friction=0.1, lines=lines)
    log = Logs.alike([1.0], [2030.0], length=2.0, diameter=0.4, orientation=1, azimuth=np.pi)
    row = FIDELITIES["draft"]._replace(trace_cells=1.0)
    monkeypatch.setattr(sys.modules[slide.__module__], "POSES_AT_ONCE", 1000)
    found = []
    for keep in (False, True):
        rasters = Rasters.allocate(scene, 1, np.array([1]))
        result = slide(scene, log, row, rasters=rasters, keep_poses=np.full(1, keep))
        found.append((result.reach_time, rasters.totals()["danger"]))
    assert len(result.poses.time) > 4000
    assert found[0][0][0, 0] > 10.0
    assert np.array_equal(found[0][0], found[1][0])
    assert np.array_equal(found[0][1], found[1][1])
    assert found[0][1][1, :1900].sum() == 0
    assert found[0][1][1, 2010:8000].any(axis=1).all()


def test_rasters_of_other_lines_and_starts_of_other_logs_are_refused():
    scene = slope()
    with pytest.raises(ValueError, match="scene's lines"):
        slide(scene, logs(), FIDELITIES["draft"], rasters=Rasters.allocate(scene, 1, np.array([1, 2])))
    with pytest.raises(ValueError, match="inside must say so"):
        slide(scene, logs(), FIDELITIES["draft"], inside=np.zeros((COUNT, 2), bool))


def test_no_log_no_danger():
    scene = slope()
    rasters = Rasters.allocate(scene, 2, BANDS)
    slide(scene, logs().take(np.arange(0)), FIDELITIES["draft"], rasters=rasters)
    assert not rasters.totals()["danger"].any()
