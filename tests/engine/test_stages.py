"""From a stage a log continues without an obstacle as it would from its release, bit for bit."""

import sys

import numpy as np
import pytest
from strewn_slope import TOLD, differing, mattered, obstacles, only, owners, released, slope, spared

from deadwood_engine import FIDELITIES, Rasters, Scene, Shape, Stages, Start, slide

pytestmark = pytest.mark.engine_alone

# the reported hits are those of what follows
SAME = {*TOLD} - {"tree_hits", "barrier_hits"} | {"end_position", "barrier_reached", "barrier_crossed"}
ON_ITS_WAY = -1


def kept(scene: Scene, start: Start, name: str, **options):
    found = Stages()
    return slide(scene, start, FIDELITIES[name], influences=True, stages=found, **options), found


def check(scene: Scene, start: Start, name: str, seed: int, **options) -> tuple[int, float]:
    """Without each thing that mattered, and without many at once; how often from a stage, the share of steps saved."""
    rng = np.random.default_rng(seed)
    whole, found = kept(scene, start, name, **options)
    later = saved = steps = 0
    for row in range(len(start.state)):
        mine, _ = mattered(whole, row)
        some = [owners(scene)[rng.random(len(owners(scene))) < share] for share in (0.02, 0.1, 0.5)]
        for gone in [*mine[:, None], *some]:
            at = found.before(np.array([row]), gone)
            without = spared(scene, gone)
            again = slide(without, only(start, row), FIDELITIES[name], **options)
            on = slide(without, only(start, row), FIDELITIES[name], stages=found, going_on=at, **options)
            for field in SAME:
                assert np.array_equal(getattr(again, field), getattr(on, field), equal_nan=True), (row, gone, field)
            steps += again.steps[0]
            if at[0] >= 0:
                later += 1
                saved += found.table.summary[at[0]].steps
    return later, saved / steps


@pytest.mark.parametrize("cell", [0.5, 1.0, 2.0])
@pytest.mark.parametrize(("name", "number"), [("draft", 20), ("standard", 10), ("fine", 3)])
def test_a_log_continues_as_from_its_release(name, number, cell):
    """Trees, barriers, lying logs, blocks, alone and many together; with restitution, too."""
    options = {"restitution": 0.2 if cell == 1.0 else 0.0, "time_limit": 40.0}
    scene = slope(cell, 17, **obstacles(18))
    later, saved = check(scene, released(scene, number, 19), name, 20, **options)
    assert later > number
    assert saved > 0.1


def test_a_cloud_continues_likewise():
    shape = Shape.of(np.random.default_rng(1).normal(size=(14, 3)) * [0.3, 0.4, 0.9])
    scene = slope(1.0, 3, **obstacles(4))
    later, _ = check(scene, released(scene, 6, 5, shape), "draft", 6, shape=shape, time_limit=8.0)
    assert later > 6


def test_keeping_changes_nothing_and_threads_change_no_stage():
    scene = slope(1.0, 3, **obstacles(4))
    start = released(scene, 40, 5)
    plain = slide(scene, start, FIDELITIES["draft"], influences=True)
    whole, one = kept(scene, start, "draft")
    _, three = kept(scene, start, "draft", threads=3)
    for row in range(40):
        assert not differing(plain, row, slide(scene, only(start, row), FIDELITIES["draft"]))
    for name in TOLD:
        assert np.array_equal(getattr(plain, name), getattr(whole, name), equal_nan=True)
    for name in ("log_row", "by_barrier", "item", "time"):
        assert np.array_equal(getattr(plain.influences, name), getattr(whole.influences, name))
    assert one.table.state.tobytes() == three.table.state.tobytes()
    assert one.table.summary.tobytes() == three.table.summary.tobytes()
    for name in ("log", "owner", "stage"):
        assert np.array_equal(getattr(one, name), getattr(three, name))


def test_where_there_is_no_more_room_logs_continue_from_earlier(monkeypatch):
    """From the last stage that there was room for, or from the release: the same bits."""
    scene = slope(1.0, 3, **obstacles(4))
    start = released(scene, 10, 5)
    _, found = kept(scene, start, "draft")
    number = len(found.table.state)
    for module, name, value in (
        ("slide", "MOST_STAGES", 2),
        ("stages", "STAGE_CONTACTS", 0),
        ("stages", "STAGE_BYTES", 20_000),
    ):
        with monkeypatch.context() as less:
            less.setattr(sys.modules[f"deadwood_engine.{module}"], name, value)
            _, fewer = kept(scene, start, "draft")
            assert len(fewer.table.state) < number
            check(scene, start, "draft", 7)


def test_a_log_is_left_when_it_has_reached_every_line():
    """Where it first touched the last of them, at the same times; a line that it starts within it need not touch."""
    scene = slope(1.0, 7)
    start = released(scene, 40, 5)
    whole = slide(scene, start, FIDELITIES["draft"])
    left = slide(scene, start, FIDELITIES["draft"], until_reached=True)
    assert np.array_equal(whole.reach, left.reach)
    assert np.array_equal(whole.reach_time, left.reach_time, equal_nan=True)
    there = whole.reach.all(axis=1)
    assert 0 < there.sum() < 40
    assert (left.stop_reason[there] == ON_ITS_WAY).all()
    assert (left.duration[there] == left.reach_time[there, 0]).all()
    assert np.array_equal(whole.last_state[~there], left.last_state[~there])
    rasters = Rasters.allocate(scene, 1)
    at_once = slide(
        scene, start, FIDELITIES["draft"], until_reached=True, inside=np.ones((40, 1), bool), rasters=rasters
    )
    assert (at_once.steps == 0).all()
    assert rasters.totals()["deposit_count"].sum() == 0


def test_stages_of_something_else_are_refused():
    scene = slope(1.0, 3, **obstacles(4))
    start = released(scene, 3, 5)
    with pytest.raises(ValueError, match="ask for influences"):
        slide(scene, start, FIDELITIES["draft"], stages=Stages())
    _, found = kept(scene, start, "draft")
    with pytest.raises(ValueError, match="must name a stage for each of 3 logs"):
        slide(scene, start, FIDELITIES["draft"], stages=found, going_on=np.full(3, len(found.table.state)))
    with pytest.raises(ValueError, match="must name a stage for each of 3 logs"):
        slide(scene, start, FIDELITIES["draft"], going_on=np.zeros(3, int))
    fewer = found.table._replace(lines=np.zeros((len(found.table.state), 2), bool))
    with pytest.raises(ValueError, match="not of this scene's lines"):
        slide(scene, start, FIDELITIES["draft"], stages=Stages(fewer), going_on=np.zeros(3, int))


def test_no_log_and_no_obstacle():
    bare = slope(1.0, 3)
    whole, found = kept(bare, released(bare, 5, 5), "draft")
    assert len(found.log) == len(found.table.state) == len(whole.influences.item) == 0
    assert found.before(np.arange(5), np.array([3])).tolist() == [-1] * 5
    start = released(bare, 5, 5)
    none = Start(start.frame[:0], start.state[:0], start.body[:0])
    assert len(kept(bare, none, "draft")[1].log) == 0
