"""Outlines, swept areas and rasters against hand counts and against polygons of another library."""

import numpy as np
import pytest
import shapely

from deadwood_engine import FIDELITIES, Lines, Logs, Rasters, Scene, segments_of, slide, sweep_hits, sweep_touches
from deadwood_engine.outline import OUTLINE_POINTS, convex_hull, hull_rows


def test_hand_counted_outlines():
    """A log of 4 m by 1 m (tip 0.5 m) lying along x on cells of 1 m: cells whose area it overlaps."""
    base, tip = np.array([[0.6, 3.0, 0.0]]), np.array([[4.6, 3.0, 0.0]])
    radii = np.array([0.45]), np.array([0.225])
    count = sweep_hits(np.array([0]), base, tip, *radii, x0=0.0, y0=0.0, cell=1.0, shape=(6, 8))
    # x from 0.6 to 4.6: cells centred 1..5 (0.5-5.5); y within 2.55..3.45: the cell centred 3 alone
    expected = np.zeros((6, 8), int)
    expected[3, 1:6] = 1
    assert np.array_equal(count, expected)
    # 0.1 m further north the base end reaches the next row; its edge leaves it where the radius is 0.4: x < 1.49
    north = np.array([0, 0.1, 0])
    count = sweep_hits(np.array([0]), base + north, tip + north, *radii, x0=0.0, y0=0.0, cell=1.0, shape=(6, 8))
    expected[4, 1] = 1
    assert np.array_equal(count, expected)


def test_each_log_once_a_cell_and_the_sweep_has_no_gaps():
    """A log moving 5 m sideways between two poses sweeps all between; two logs count two."""
    rows = np.array([0, 0, 0, 1])
    base = np.array([[1, 1, 0], [1, 6, 0], [1, 1, 0], [1, 1, 0]], float)
    tip = base + np.array([3.0, 0, 0])
    radii = np.full(2, 0.2)
    count = sweep_hits(rows, base, tip, radii, radii, x0=0.0, y0=0.0, cell=1.0, shape=(9, 9))
    assert np.array_equal(np.unique(count[2:7, 1:5]), [1])
    assert np.array_equal(np.unique(count[1, 1:5]), [2])
    assert count.sum() == 6 * 4 + 4


@pytest.mark.parametrize("seed", range(20))
def test_cells_equal_polygon_overlap(seed):
    """Brute force: every cell square against the hull of both outlines by shapely (ellipses by the same points)."""
    rng = np.random.default_rng(seed)
    base = 6 + 8 * rng.random((2, 3))
    direction = rng.standard_normal(3)
    tip = base + 5 * direction / np.linalg.norm(direction)
    big, small = 0.4, 0.2
    count = sweep_hits(
        np.array([0, 0]), base, tip, np.array([big]), np.array([small]), x0=0.0, y0=0.0, cell=0.5, shape=(40, 40)
    )
    angle = np.arange(8) * np.pi / 4
    points = []
    for b, t in zip(base, tip, strict=True):
        axis = (t - b) / np.linalg.norm(t - b)
        plan = axis[:2] / np.linalg.norm(axis[:2])
        left = np.array([-plan[1], plan[0]])
        for end, radius in ((b, big), (t, small)):
            offsets = np.cos(angle)[:, None] * left + abs(axis[2]) * np.sin(angle)[:, None] * plan
            points.append(end[:2] + radius * offsets)
    hull = shapely.convex_hull(shapely.multipoints(np.vstack(points)))
    x, y = np.meshgrid(np.arange(40) * 0.5, np.arange(40) * 0.5)
    cells = shapely.box(x - 0.25, y - 0.25, x + 0.25, y + 0.25)
    assert np.array_equal(count > 0, shapely.intersects(cells, hull))


def test_upright_log_is_a_disc_in_plan():
    base, tip = np.array([[5.0, 5.0, 0.0]]), np.array([[5.0, 5.0, 30.0]])
    count = sweep_hits(
        np.array([0]), base, tip, np.array([2.0]), np.array([1.0]), x0=0.0, y0=0.0, cell=1.0, shape=(11, 11)
    )
    # a circle of 2 m reaches the cells up to 2 away along the axes, but not the corner 2.12 m away
    assert count[5, 3:8].sum() == 5
    assert count[3, 3] == 0
    assert count[4, 4] == 1


def test_touched_lines():
    """A line is touched by the outline's edge, not only by the axis; a near miss does not count; the first pose is
    reported.
    """
    lines = Lines(np.array([[0, 3.0], [10, 3.0], [0, 8.0], [10, 8.0], [20, 0], [20, 9.0]]), np.array([0, 2, 4, 6]))
    base = np.array([[2, 1, 0], [2, 2.0, 0], [2, 2.75, 0]], float)
    tip = base + np.array([4.0, 0, 0])
    touched, pose = sweep_touches(np.zeros(3, int), base, tip, np.array([0.3]), np.array([0.3]), segments_of(lines))
    assert touched.tolist() == [[True, False, False]]
    assert pose.tolist() == [[2, -1, -1]]
    touched, _ = sweep_touches(
        np.zeros(2, int), base[:2], tip[:2], np.array([0.3]), np.array([0.3]), segments_of(lines)
    )
    assert not touched.any()


def test_rasters_of_a_run_equal_those_of_its_poses():
    """What slide accumulates in its kernel is what count-hits makes of the stored poses; deposits sit at the ends."""
    rng = np.random.default_rng(2)
    heights = 0.7 * 0.5 * np.arange(160)[:, None] + 0.3 * rng.random((160, 120))
    heights[:40] = heights[40]
    road = Lines(np.array([[0.0, 15.0], [60.0, 15.0]]), np.array([0, 2]))
    scene = Scene.prepare(heights, 0.5, 0.0, 0.0, friction=0.25, lines=road)
    logs = Logs.alike(30 + 5 * rng.random(12), 60 + 5 * rng.random(12), length=8.0, diameter=0.4)
    rasters = Rasters.allocate(scene, 2)
    result = slide(scene, logs, FIDELITIES["standard"], threads=2, rasters=rasters, keep_poses=np.ones(12, bool))
    poses, radius = result.poses, np.full(12, 0.2)
    totals = rasters.totals()
    again = sweep_hits(
        poses.log_row, poses.base, poses.tip, radius, 0.5 * radius, x0=0.0, y0=0.0, cell=0.5, shape=heights.shape
    )
    assert np.array_equal(totals["hit_count"], again)
    touched, first = sweep_touches(poses.log_row, poses.base, poses.tip, radius, 0.5 * radius, segments_of(road))
    assert np.array_equal(touched, result.reach)
    assert 0 < touched.sum() < 12 or touched.all()
    seen = touched[:, 0]
    assert poses.time[first[seen, 0]] == pytest.approx(result.reach_time[seen, 0])
    assert totals["hit_count"].max() <= 12
    last = np.flatnonzero(np.append(np.diff(poses.log_row) > 0, True))
    stopped = result.stop_reason != 3
    end = sweep_hits(
        np.flatnonzero(stopped), poses.base[last][stopped], poses.tip[last][stopped], radius, 0.5 * radius,
        x0=0.0, y0=0.0, cell=0.5, shape=heights.shape,
    )  # fmt: skip
    assert np.array_equal(totals["deposit_count"], end)
    assert np.nanmax(totals["speed_max"]) == pytest.approx(result.speed_max.max(), rel=1e-6)
    assert np.nanmax(totals["energy_max"]) == pytest.approx(result.energy_max.max(), rel=1e-6)
    assert np.isnan(totals["speed_max"][totals["hit_count"] == 0]).all()


def test_more_poses_than_room_are_kept_all_the_same():
    """A log that wants more poses than the buffer holds slides again with more room, and is counted once."""
    heights = np.tile(0.75 * 0.25 * np.arange(8200)[:, None], (1, 9))
    scene = Scene.prepare(heights, 0.25, 0.0, 0.0, friction=0.1)
    rasters = Rasters.allocate(scene, 1)
    logs = Logs.alike([1.0], [2030.0], length=2.0, diameter=0.4, orientation=1, azimuth=np.pi)
    row = FIDELITIES["draft"]._replace(trace_cells=1.0)
    result = slide(scene, logs, row, rasters=rasters, keep_poses=np.ones(1, bool))
    assert len(result.poses.time) > 4096
    assert rasters.totals()["hit_count"].max() == 1
    assert np.all(np.diff(result.poses.time) > 0)


def poison(rng: np.random.Generator) -> np.ndarray:
    """Points of which some or all are no numbers, or too large to be multiplied."""
    points = rng.uniform(-50.0, 50.0, (2 * OUTLINE_POINTS, 2))
    chosen = rng.random(points.shape) < rng.choice([0.02, 0.3, 1.0])
    chosen.flat[rng.integers(chosen.size)] = True
    points[chosen] = rng.choice([np.nan, np.inf, -np.inf, 1e200, -1e200, 1e308], chosen.sum())
    return points


@pytest.mark.parametrize("first", [(0, 0), (300, 700)])
def test_what_is_no_place_stays_within_the_tables(first):
    """Any hull, and the rows of any hull, in tables amid larger ones: nothing beside them is written."""
    rng = np.random.default_rng(1)
    count, rows, columns = 2 * OUTLINE_POINTS, 20, 30
    overran = 0
    for _ in range(500):
        points = poison(rng)
        around = np.full((200, 4), 7.0)
        size = convex_hull(points.copy(), count, around[50 : 50 + count + 3])
        overran += not (around[:50] == 7.0).all() or not (around[50 + count + 2 :] == 7.0).all()
        assert 0 <= size <= count + 2
        spans = np.full((2, 200), 7)
        left, right = spans[:, 50 : 50 + rows]
        # also without a hull in between, as if that were wrong: any points, in any order
        for hull, number in ((around[50 : 50 + count + 3], size), (np.hstack([points, points]), count)):
            bottom, top = hull_rows(hull, number, (0.0, 0.0, 0.5), (*first, columns, rows), left, right)
            overran += not (spans[:, :50] == 7).all() or not (spans[:, 50 + rows :] == 7).all()
            assert top < bottom or 0 <= bottom <= top < rows
            for j in range(bottom, top + 1):
                assert left[j] > right[j] or 0 <= left[j] <= right[j] < columns
    assert overran == 0


def test_poses_that_are_no_places_sweep_nothing():
    """Stored poses may hold anything: of a log with NaN or infinite ends no cell and no line knows."""
    rows = np.array([0, 0, 1, 1, 1, 2, 2])
    base = np.tile([2.0, 2.0, 0.0], (7, 1)) + np.arange(7)[:, None] * [0.5, 0.1, 0.0]
    tip = base + np.array([4.0, 0.0, 0.0])
    base[2], tip[3], base[4, 0] = np.nan, np.inf, -1e308
    radii, place = np.full(3, 0.3), {"x0": 0.0, "y0": 0.0, "cell": 0.5, "shape": (16, 24)}
    count = sweep_hits(rows, base, tip, radii, radii, **place)
    others = rows != 1
    alone = sweep_hits(rows[others], base[others], tip[others], radii, radii, **place)
    assert np.array_equal(count, alone)
    line = segments_of(Lines(np.array([[0.0, 2.2], [12.0, 2.2]]), np.array([0, 2])))
    touched, _ = sweep_touches(rows, base, tip, radii, radii, line)
    assert touched[:, 0].tolist() == [True, False, True]


def test_rows_of_logs_that_there_are_not_are_refused():
    ends, radii = np.zeros((2, 3)), np.full(2, 0.3)
    for rows in ([0, 2], [-1, 0]):
        with pytest.raises(ValueError, match="but there are 2 logs"):
            sweep_hits(np.array(rows), ends, ends, radii, radii, x0=0.0, y0=0.0, cell=1.0, shape=(4, 4))
    with pytest.raises(ValueError, match="there are 3 rows"):
        sweep_hits(np.zeros(3, int), ends, ends, radii, radii, x0=0.0, y0=0.0, cell=1.0, shape=(4, 4))


def test_outlines_far_apart_lose_no_cell_and_no_line():
    """The same trajectories with an outline in every step, and with those that are due: both hit the same, except
    within a fifth of a cell and a step's travel of the area's border; and the latter hits few more.
    """
    rng = np.random.default_rng(5)
    heights = 0.7 * 0.5 * np.arange(240)[:, None] + 0.4 * rng.random((240, 160))
    roads = Lines(np.array([[x, y] for y in range(10, 100, 5) for x in (0.0, 80.0)]), 2 * np.arange(19))
    scene = Scene.prepare(heights, 0.5, 0.0, 0.0, friction=0.3, lines=roads)
    number = 40
    logs = Logs.alike(40 + 5 * rng.random(number), 105 + 3 * rng.random(number), length=9.0, diameter=0.4)
    row = FIDELITIES["standard"]
    all_rows, far_rows = (Rasters.allocate(scene, 1) for _ in range(2))
    every = slide(scene, logs, row._replace(trace_cells=1e-6), rasters=all_rows)
    due = slide(scene, logs, row, rasters=far_rows)
    assert np.array_equal(every.last_state, due.last_state)
    assert np.array_equal(every.reach, due.reach)
    assert every.reach.any()
    fine, coarse = (each.totals()["hit_count"].astype(int) for each in (all_rows, far_rows))
    lost = np.maximum(fine - coarse, 0).sum() / fine.sum()
    assert lost < 0.005
    assert abs(coarse.sum() / fine.sum() - 1.0) < 0.03
    seen = every.reach
    late = due.reach_time[seen] - every.reach_time[seen]
    assert (late >= 0.0).all()
    assert np.median(late * every.speed_mean[:, None].repeat(18, 1)[seen]) < row.trace_spacing
