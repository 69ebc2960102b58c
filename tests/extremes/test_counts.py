"""No log, one log, very many logs; long rows of obstacles."""

import tracemalloc

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, Logs, Rasters, Scene, Start, slide


def test_no_logs(at):
    """Nothing in, nothing out: every array empty with its right width."""
    scene = at.flat(barriers=at.barrier((20, -5), (20, 5)))
    rasters = Rasters.allocate(scene, 2)
    result = slide(scene, Logs.alike([], []), FIDELITIES["standard"], threads=2, rasters=rasters)
    assert len(result.stop_reason) == 0
    assert result.end_position.shape == (0, 3)
    assert result.barrier_reached.shape == (0, 1)
    assert len(result.poses.time) == 0
    assert rasters.totals()["hit_count"].sum() == 0


def test_one_log_many_threads(at):
    """More workers than logs: one does the work."""
    result = slide(at.flat(), Logs.alike([0.0], [0.0]), FIDELITIES["standard"], threads=16, time_limit=0.1)
    assert len(result.stop_reason) == 1


def test_smallest_terrain():
    """2 x 2 heights are a terrain; the log that tips off its edge has left it."""
    scene = Scene.prepare(np.array([[0.0, 0.0], [1.0, 1.0]]), 1.0, 0.0, 0.0, friction=0.25)
    result = slide(scene, Logs.alike([0.5], [0.5], length=5.0, diameter=0.3), FIDELITIES["standard"], time_limit=60.0)
    assert result.stop_reason[0] in (0, 3)
    with pytest.raises(ValueError, match="2 x 2"):
        Scene.prepare(np.zeros((1, 5)), 1.0, 0.0, 0.0, friction=0.25)
    with pytest.raises(ValueError, match="no valid height"):
        Scene.prepare(np.full((5, 5), np.nan), 1.0, 0.0, 0.0, friction=0.25)


def test_memory_of_a_million_logs(at):
    """On paper a log costs 16 doubles of start, 16 of state, 7 of body, 20 of summary, and the result: 0.8 kB.

    Measured on 1000 and 5000 logs, so that what does not grow with the logs cancels; a million then need 1.5 GB at
    most. No poses are kept and the rasters do not grow.
    """
    scene = at.flat()
    peaks = []
    for number in (1_000, 5_000):
        logs = Logs.alike(np.linspace(-20, 20, number), np.zeros(number), length=4.0, diameter=0.3)
        tracemalloc.start()
        slide(scene, logs, FIDELITIES["draft"], threads=2, time_limit=0.01)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert (peaks[1] - peaks[0]) / 4_000 < 1500


@pytest.mark.parametrize("spacing", [0.05, 0.1])
def test_a_thousand_contacts_at_once(at, spacing):
    """A 60 m log broadside against a wall of stems: every stem holds it, none is forgotten, it does not turn."""
    y = np.arange(-40.0, 40.0, spacing)
    scene = at.flat(trees=at.trees(np.full(len(y), 20.0), y, 0.9 * spacing), size=100.0)
    solid = at.body(0.75, 60.0, taper=1.0)
    begin = at.start(scene, solid, (0, 1, 0), (18.0, 0.0, 5.0), velocity=(5.0, 0, 0))
    result = at.run(scene, begin, gravity=0.0, time_limit=1.0)
    at.healthy(scene, begin, result)
    assert result.tree_hits[0] > 0.9 * 60 / spacing
    assert result.tip_end[0, 0] == pytest.approx(result.base_end[0, 0], abs=0.02)
    assert result.last_state[0, 7] == pytest.approx(0.0, abs=0.05)


def test_logs_slid_by_the_dozen_are_as_alone(at):
    """Bouncing for ever in a ring of stems, without friction: more hits and poses than there is room for at first.

    One worker is handed three logs at a time, and hands them back early for want of room and where poses are kept.
    """
    turn = 2 * np.pi * np.arange(24) / 24
    scene = at.flat(trees=at.trees(8 * np.cos(turn), 8 * np.sin(turn), 1.6, 1e4), friction=0.0)
    number = 13
    way = np.linspace(0.1, 6.0, number)
    begin = at.together(
        [
            at.start(scene, at.body(0.4, 4.0), (1, 0, 0), (0, 0, 0.2), velocity=(20 * np.cos(a), 20 * np.sin(a), 0))
            for a in way
        ]
    )
    options = {"gravity": 0.0, "restitution": 1.0, "time_limit": 60.0}
    row = FIDELITIES["draft"]._replace(trace_cells=1e-6, time_step=0.01)
    kept = np.zeros(number, bool)
    kept[[3, 4, 8]] = True
    rasters = Rasters.allocate(scene, 1)
    result = slide(scene, begin, row, keep_poses=kept, rasters=rasters, **options)
    hits = np.bincount(result.hits.log_row, minlength=number)
    assert hits.max() > 64
    assert hits.sum() > 64 * number
    assert np.bincount(result.poses.log_row).max() > 4096
    deposits = np.zeros_like(rasters.totals()["deposit_count"])
    for k in range(number):
        alone = Start(begin.frame[k : k + 1], begin.state[k : k + 1], begin.body[k : k + 1])
        apart = Rasters.allocate(scene, 1)
        single = slide(scene, alone, row, keep_poses=kept[k : k + 1], rasters=apart, **options)
        deposits += apart.totals()["deposit_count"]
        assert np.array_equal(single.last_state[0], result.last_state[k])
        assert np.array_equal(single.hits.time, result.hits.time[result.hits.log_row == k])
        assert np.array_equal(single.hits.impulse, result.hits.impulse[result.hits.log_row == k])
        assert np.array_equal(single.poses.time, result.poses.time[result.poses.log_row == k])
    assert np.array_equal(rasters.totals()["deposit_count"], deposits)
