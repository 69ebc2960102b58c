"""What did not matter to a log can be taken away, and every bit of the log's way stays."""

import numpy as np
import pytest
from strewn_slope import TOLD, differing, mattered, obstacles, only, owners, released, slope, spared

from deadwood_engine import FIDELITIES, Barriers, Blocks, Logs, LyingLogs, Scene, Shape, Trees, place_logs, slide


@pytest.mark.parametrize("cell", [0.5, 1.0, 2.0])
@pytest.mark.parametrize(("name", "number"), [("draft", 30), ("standard", 16), ("fine", 6), ("reference", 2)])
def test_what_did_not_matter_can_go(name, number, cell):
    """All of it, or a random part of it, at once: every field of the log is the same."""
    rng = np.random.default_rng(int(10 * cell))
    options = {"time_limit": 5.0 if name == "reference" else 60.0, "restitution": 0.2 if cell == 1.0 else 0.0}
    scene = slope(cell, 7, **obstacles(8))
    start = released(scene, number, 9)
    whole = slide(scene, start, FIDELITIES[name], influences=True, **options)
    told = 0
    for row in range(number):
        mine, _ = mattered(whole, row)
        told += len(mine)
        others = np.setdiff1d(owners(scene), mine)
        for share in (1.0, 0.6, 0.3):
            gone = others[rng.random(len(others)) < share]
            again = slide(spared(scene, gone), only(start, row), FIDELITIES[name], **options)
            assert not differing(whole, row, again), (row, len(gone))
    # neither all nor nothing, or there would be nothing to leave out; two logs in five seconds may meet one thing
    assert (0 if name == "reference" else number) < told < 20 * number


@pytest.mark.parametrize("name", ["draft", "standard"])
def test_what_mattered_changes_nothing_before(name):
    """Without it the poses are the same up to its time; and whatever the log hit did matter, by then."""
    scene = slope(1.0, 3, **obstacles(4))
    start = released(scene, 20, 5)
    keep = np.ones(20, bool)
    whole = slide(scene, start, FIDELITIES[name], influences=True, keep_poses=keep)
    changed = 0
    for row in range(20):
        ours = whole.poses.log_row == row
        for owner, since in zip(*mattered(whole, row), strict=True):
            without = spared(scene, np.array([owner]))
            again = slide(without, only(start, row), FIDELITIES[name], keep_poses=keep[:1])
            before = [poses.time <= since for poses in (whole.poses, again.poses)]
            before[0] &= ours
            assert np.array_equal(whole.poses.position[before[0]], again.poses.position[before[1]])
            changed += not np.array_equal(whole.last_state[row], again.last_state[0])
    hits = whole.hits
    for row, by_barrier, item, time in zip(hits.log_row, hits.by_barrier, hits.item, hits.time, strict=True):
        mine, since = mattered(whole, row)
        assert since[mine == (-1 - item if by_barrier else item)][0] <= time
    assert changed > 0.8 * len(whole.influences.log_row)  # what is noted is seldom noted in vain


@pytest.mark.parametrize("name", ["draft", "standard"])
@pytest.mark.parametrize("kind", ["barriers", "lying_logs"])
def test_what_a_long_log_passes_within_its_box_only_changes_nothing(name, kind):
    """30 m and askew: its box reaches plates and logs that it comes no nearer to than 6 m. Those were listed, and a
    plate's own directions say of such a log that it is beside neither its end nor its face, so its steps were short."""
    heights = np.tan(np.radians(30.0)) * np.arange(81)[:, None] * np.ones((1, 81))
    trees = {"trees": Trees(np.array([75.0]), np.array([75.0]), np.array([0.4]), np.array([20.0]))}
    line, sizes = np.array([[31.0, 40.0], [34.0, 40.0]]), (np.array([0.4]), np.array([0.4]))
    more = (
        Barriers(line, np.array([0, 2]), np.array([3.0]))
        if kind == "barriers"
        else LyingLogs(line, np.array([0, 2]), *sizes)
    )
    logs = Logs.alike([40.0], [48.0], length=30.0, orientation=1, azimuth=np.radians(135.0), speed=3.0)
    plain, full = (
        slide(
            Scene.prepare(heights, 1.0, 0.0, 0.0, friction=0.9, **each), logs, FIDELITIES[name], time_limit=1.0,
            influences=True,
        )
        for each in (trees, trees | {kind: more})
    )  # fmt: skip
    assert len(full.influences.item) == 0
    assert np.array_equal(plain.last_state, full.last_state)
    assert plain.steps == full.steps


def test_noting_changes_nothing_and_threads_change_no_note():
    scene = slope(1.0, 3, **obstacles(4))
    start = released(scene, 40, 5)
    plain = slide(scene, start, FIDELITIES["draft"])
    noted = [slide(scene, start, FIDELITIES["draft"], influences=True, threads=threads) for threads in (1, 3)]
    assert len(plain.influences.log_row) == 0
    for name in TOLD:
        assert np.array_equal(getattr(plain, name), getattr(noted[0], name), equal_nan=True)
    for name in ("log_row", "by_barrier", "item", "time"):
        assert np.array_equal(*(getattr(each.influences, name) for each in noted))
    order = np.lexsort([noted[0].influences.item, noted[0].influences.by_barrier, noted[0].influences.log_row])
    assert np.array_equal(order, np.arange(len(order)))


def test_a_scene_without_is_the_scene_prepared_without():
    """For each kind of obstacle, and for all of them: the same last states."""
    parts = obstacles(4)
    scene = slope(1.0, 3, **parts)
    start = released(scene, 60, 5)
    whole = slide(scene, start, FIDELITIES["draft"])
    trees, lying = parts["trees"], parts["lying_logs"]
    after = len(trees.x) + len(lying.diameter)
    fewer = {
        "trees": (Trees(*(values[5:] for values in trees[:4])), {"others": np.arange(5)}),
        "barriers": (Barriers(parts["barriers"].vertices[2:], np.array([0, 2]), np.array([3.0])), {"barriers": [0]}),
        "lying_logs": (
            LyingLogs(lying.vertices[:-2], lying.starts[:-1], lying.diameter[:-1], lying.tip_diameter[:-1]),
            {"others": [after - 1]},
        ),
        "blocks": (Blocks.none(), {"others": after + np.arange(10)}),
    }
    for kind, (rest, gone) in fewer.items():
        expected = slide(slope(1.0, 3, **(parts | {kind: rest})), start, FIDELITIES["draft"])
        again = slide(scene.without(**gone), start, FIDELITIES["draft"])
        assert np.array_equal(expected.last_state, again.last_state), kind
        if kind in ("trees", "barriers"):
            assert not np.array_equal(whole.last_state, again.last_state), "nobody came near"
    nothing = scene.without(barriers=np.arange(2), others=np.arange(after + 10))
    bare = slide(slope(1.0, 3), start, FIDELITIES["draft"])
    assert np.array_equal(slide(nothing, start, FIDELITIES["draft"]).last_state, bare.last_state)


def test_more_notes_than_there_is_room_for():
    """A log that bounces across a slope full of stumps: it is slid again, with more room, and is the same."""
    x, y = (places.ravel() for places in np.meshgrid(np.arange(20.0, 80), np.arange(10.0, 80, 0.25)))
    stumps = Trees(x, y, np.full(len(x), 0.03), np.full(len(x), 0.1))
    scene = slope(1.0, 3, trees=stumps)
    across = Logs.alike(50.0, 85.0, diameter=0.4, length=20.0, orientation=1, azimuth=1.57, drop=1.0)
    start = place_logs(scene, across)
    start.state[0, 7:10] = 0.0, -25.0, -18.0
    few = slide(scene, start, FIDELITIES["standard"])
    many = slide(scene, start, FIDELITIES["standard"], influences=True)
    assert len(many.influences.log_row) > 64
    assert np.array_equal(few.last_state, many.last_state)


def test_a_cloud_notes_all_that_is_near():
    shape = Shape.of(np.random.default_rng(1).normal(size=(14, 3)) * [0.3, 0.4, 0.9])
    scene = slope(1.0, 3, **obstacles(4))
    start = released(scene, 4, 5, shape)
    whole = slide(scene, start, FIDELITIES["draft"], shape=shape, time_limit=8.0, influences=True)
    for row in range(4):
        mine, _ = mattered(whole, row)
        gone = np.setdiff1d(owners(scene), mine)
        again = slide(spared(scene, gone), only(start, row), FIDELITIES["draft"], shape=shape, time_limit=8.0)
        assert not differing(whole, row, again)
    assert len(whole.influences.log_row) > 4
