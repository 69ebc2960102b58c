"""Lying logs: how they lie, what a shot at them gives, and that they hold what leans on them."""

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, STOP_REASONS, Logs, LyingLogs, Rasters, Scene, Trees, slide
from deadwood_engine.log_body import CENTRE, LENGTH, MASS, TRANSVERSE
from deadwood_engine.lying_logs import rest_line

G = 9.81


def lying(*points, diameter=0.4, tip=None):
    return LyingLogs(
        np.array(points, float), np.array([0, len(points)]), np.array([diameter]), np.array([tip or diameter])
    )


def axis_of(scene, row=0):
    """Ends of a piece's axis in the world."""
    terrain, pieces = scene.arrays.terrain, scene.arrays.lying
    plan = pieces.node[row] * terrain.cell + pieces.offset[row] + (terrain.x0, terrain.y0)
    start = np.array([*plan, pieces.solid[row, 0] + terrain.reference])
    return start, start + pieces.solid[row, 4] * pieces.solid[row, 1:4]


@pytest.mark.parametrize("azimuth", [0.0, 33.0, 90.0])
@pytest.mark.parametrize("tip", [0.4, 0.2])
def test_on_a_plane_it_lies_on_its_side(physics, azimuth, tip):
    """Its surface touches the plane all along: the axis is a radius off the plane, at both ends."""
    tangent = 0.7
    scene = physics.plane(tangent, azimuth, lying_logs=lying((-3, -4), (5, 2), tip=tip))
    east, north = np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))
    normal = np.array([-tangent * east, -tangent * north, 1.0]) / np.hypot(1.0, tangent)
    for end, radius, plan in zip(axis_of(scene), (0.2, 0.5 * tip), ((-3, -4), (5, 2)), strict=True):
        assert end @ normal == pytest.approx(radius, abs=1e-5)
        assert end[:2] == pytest.approx(plan, abs=1e-9)


def test_it_bridges_a_hollow_and_rocks_on_no_hump():
    """A stiff line touches on either side of its middle: the rims of a trench; on a hump, its crest and one side."""
    share = np.linspace(0, 1, 11)
    trench = np.where((share > 0.25) & (share < 0.75), -2.0, 0.0)
    assert rest_line(share, trench) == (0.0, 0.0)
    hump = -np.abs(share - 0.45)
    low, high = rest_line(share, hump)
    line = low + (high - low) * share
    assert (line >= hump - 1e-12).all()
    touched = share[np.abs(line - hump) < 1e-9]
    assert touched.min() <= 0.5 <= touched.max()
    one_side = rest_line(share[:3], np.array([0.0, 1.0, 1.5]))  # the rest has no terrain: it juts out on its last edge
    assert one_side == pytest.approx((0.5, 5.5))


def test_a_bent_line_is_two_pieces_and_off_the_dem_is_none():
    scene = Scene.prepare(np.zeros((21, 21)), 1.0, 0, 0, friction=0.3, lying_logs=lying((2, 2), (8, 2), (8, 9)))
    assert scene.arrays.lying.owner.tolist() == [0, 0]
    gone = Scene.prepare(np.zeros((21, 21)), 1.0, 0, 0, friction=0.3, lying_logs=lying((50, 2), (58, 2)))
    assert (len(gone.arrays.lying.owner), gone.lying_outside.tolist(), gone.lying_count) == (0, [0], 1)
    with pytest.raises(ValueError, match="diameter"):
        Scene.prepare(np.zeros((21, 21)), 1.0, 0, 0, friction=0.3, lying_logs=lying((2, 2), (8, 2), diameter=-1.0))


def wall(thick=4.0, length=40.0, **parts):
    """A lying log as thick as a wall, across the way at x = 0, on the flat."""
    heights = np.zeros((121, 121))
    return Scene.prepare(
        heights, 1.0, -60, -60, **({"friction": 0.0} | parts),
        lying_logs=lying((0, -0.5 * length), (0, 0.5 * length), diameter=thick),
    )  # fmt: skip


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize(
    ("offset", "kept"), [(0.0, 0.0), (2.0, 4.0 / (66.834578 + 4.0)), (5.0, 25.0 / (66.834578 + 25))]
)
def test_sideways_hit_keeps_what_the_lever_leaves(physics, restitution, offset, kept):
    """T47 at a lying log's level axis: a vertical log, b off its middle: v+ = v (b^2 - e k^2) / (k^2 + b^2)."""
    scene = Scene.prepare(
        np.full((121, 121), -100.0), 1.0, -60, -60, friction=0.0, lying_logs=lying((0, -20), (0, 20), diameter=4.0)
    )
    log = physics.body()
    k2 = log[0, TRANSVERSE]
    begin = physics.start(scene, log, (0, 0, 1), (-5.0, 0.0, -98.0 + offset), velocity=(10, 0, 0))
    result = physics.run(scene, begin, time_limit=0.5, gravity=0.0, restitution=restitution, travel_cells=0.02)
    assert result.tree_hits[0] == 1
    assert result.last_state[0, 7] == pytest.approx(10 * (kept - restitution * k2 / (k2 + offset**2)), abs=0.15)
    assert result.hits.impulse[0] == pytest.approx(log[0, MASS] * (10 - result.last_state[0, 7]), rel=1e-3)


def test_head_on_stops_at_the_flat_end(physics):
    """Square into a lying log's side at the height of its axis: the face stops, as at a tree."""
    scene = wall()
    log = physics.body()
    front = log[0, LENGTH] - log[0, CENTRE]
    begin = physics.start(scene, log, (1, 0, 0), (-4.0 - front, 0.0, 2.0), velocity=(20, 0, 0))
    result = physics.run(scene, begin, time_limit=0.5, gravity=0.0)
    assert result.last_state[0, 7] == pytest.approx(0.0, abs=0.05)
    assert result.tip_end[0, 0] == pytest.approx(-2.0, abs=0.03)


@pytest.mark.parametrize("fidelity", list(FIDELITIES))
@pytest.mark.parametrize("heading", [90.0, 70.0])
def test_it_holds_a_log_on_a_slope_too_steep_for_friction(physics, fidelity, heading):
    """35 degrees, mu 0.25: the log slides down to the lying one and is held by it; hits count it after the trees."""
    tangent = np.tan(np.radians(35))
    trees = Trees(np.array([40.0]), np.array([40.0]), np.array([0.4]), np.array([20.0]))
    scene = physics.plane(
        tangent, cell=1.0, size=60.0, trees=trees, lying_logs=lying((-12, -20), (12, -20), diameter=0.5)
    )
    log = physics.body(diameter=0.4, length=10.0)
    begin = physics.lying(scene, log, tangent, 0.0, heading, centre=(0.0, -15.0))
    result = physics.run(scene, begin, fidelity=fidelity, time_limit=120.0)
    assert STOP_REASONS[result.stop_reason[0]] == "lying_log"
    assert result.stop_item[0] == 0
    assert result.hits.item[0] == 1
    assert result.end_position[0, 1] > -20.0
    # what curves within a step sinks in; draft's steps are twice as long as those of standard
    assert result.penetration_max[0] < (0.06 if fidelity == "draft" else 0.03)


def test_resting_on_it_does_not_creep(physics):
    """A minute across a lying log, base on the ground, never certified: not a millimetre."""
    scene = Scene.prepare(
        np.zeros((121, 121)), 1.0, -60, -60, friction=0.5, lying_logs=lying((-8, 0), (8, 0), diameter=0.4)
    )
    log = physics.body(diameter=0.4, length=10.0)
    across = physics.start(scene, log, (0, 1, 0), (0, -2.0, 0.65))
    early, late = (physics.run(scene, across, time_limit=t, rest_speed=1e-9) for t in (20.0, 60.0))
    assert np.linalg.norm(late.end_position - early.end_position) < 1e-3
    held = physics.run(scene, across, time_limit=60.0)
    assert STOP_REASONS[held.stop_reason[0]] == "lying_log"


def test_absent_lying_logs_change_nothing():
    """A lying log out of reach gives the bits of a scene without it; so does the order of threads."""
    rng = np.random.default_rng(0)
    heights = 0.7 * 0.5 * np.arange(160)[:, None] + 0.4 * rng.random((160, 160))
    logs = Logs.alike([20.0, 30.0], [60.0, 55.0], length=10.0)
    plain = slide(Scene.prepare(heights, 0.5, 0, 0, friction=0.25), logs, FIDELITIES["standard"])
    far = Scene.prepare(heights, 0.5, 0, 0, friction=0.25, lying_logs=lying((75, 70), (79, 79)))
    assert np.array_equal(slide(far, logs, FIDELITIES["standard"], threads=2).last_state, plain.last_state)


def test_moved_by_a_map_offset_the_bits_stay():
    """T70 with lying logs: LV95 coordinates or the corner of a small grid, the same bits."""
    rng = np.random.default_rng(1)
    heights = 0.7 * np.arange(100)[:, None] + 0.4 * rng.random((100, 100))
    ends = []
    for x0, y0 in ((0.0, 0.0), (2_600_000.0, 1_200_000.0)):
        obstacle = lying((x0 + 20, y0 + 40), (x0 + 80, y0 + 40), diameter=0.8, tip=0.4)
        scene = Scene.prepare(heights, 1.0, x0, y0, friction=0.3, lying_logs=obstacle)
        logs = Logs.alike(x0 + np.arange(30.0, 70.0, 8.0), np.full(5, y0 + 70.0), length=12.0)
        result = slide(scene, logs, FIDELITIES["standard"], time_limit=60.0)
        assert (result.tree_hits > 0).any()
        ends.append(result.last_state)
    assert np.array_equal(*ends)


def test_what_holds_is_distinguished():
    """Three logs on one slope: a stem holds the first, the second of two lying logs the next, nothing the last. A log
    held by a lying log lies where it is: the raster of deposits has it. Codes of stored runs keep their meaning."""
    assert STOP_REASONS[:6] == ("rest", "tree", "barrier", "left_dem", "time_limit", "failed")
    heights = np.tan(np.radians(35)) * np.arange(100)[:, None] + np.zeros(100)
    trees = Trees(np.array([18.0, 22.0]), np.full(2, 40.0), np.full(2, 0.4), np.full(2, 20.0))
    both = lying((80, 5), (90, 5), diameter=0.4), lying((42, 40), (58, 40), diameter=0.6)
    two = LyingLogs(
        np.vstack([each.vertices for each in both]), np.array([0, 2, 4]),
        np.concatenate([each.diameter for each in both]), np.concatenate([each.tip_diameter for each in both]),
    )  # fmt: skip
    scene = Scene.prepare(heights, 1.0, 0.0, 0.0, friction=0.25, trees=trees, lying_logs=two)
    rasters = Rasters.allocate(scene, 1)
    logs = Logs.alike([20.0, 50.0, 75.0], [43.0] * 3, diameter=0.4, length=8.0, orientation=1, azimuth=np.pi / 2)
    result = slide(scene, logs, FIDELITIES["standard"], time_limit=60.0, rasters=rasters)
    assert [STOP_REASONS[code] for code in result.stop_reason] == ["tree", "lying_log", "left_dem"]
    assert result.stop_item[0] in (0, 1)
    assert result.stop_item[1:].tolist() == [1, -1]
    assert set(result.hits.item[result.hits.log_row == 1]) == {3}
    deposits = rasters.totals()["deposit_count"]
    assert deposits[36:46, 40:60].sum() > 0
    assert deposits[36:46, 10:30].sum() > 0
    assert deposits[:, 65:].sum() == 0
