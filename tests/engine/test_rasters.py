"""Rasters of several workers and of an earlier run: sums are sums, maxima maxima, and no log is no value."""

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, Lines, Logs, Rasters, Scene, slide
from deadwood_engine.outline import LISTED
from deadwood_engine.rasters import raster_arrays
from deadwood_engine.trace import HITS

SHAPE = (4, 5)


@pytest.fixture(scope="module")
def scene():
    lines = Lines(np.array([[0.0, 1.0], [4.0, 1.0], [0.0, 2.0], [4.0, 2.0]]), np.array([0, 2, 4]))
    return Scene.prepare(np.zeros(SHAPE), 1.0, 0.0, 0.0, friction=0.3, lines=lines)


def filled(scene, workers, seed=0, bands=None):
    """Rasters as if each worker had slid logs: where a cell has hits it has maxima."""
    rng = np.random.default_rng(seed)
    made = Rasters.allocate(scene, workers, *([] if bands is None else [np.array(bands)]))
    for worker in made.workers:
        worker.hits[:, :, HITS] = rng.integers(0, 3, SHAPE)
        worker.maxima[...] = rng.uniform(0.0, 9.0, (*SHAPE, 4)) * (worker.hits[:, :, HITS] > 0)[:, :, None]
        worker.deposits[...] = rng.integers(0, 2, SHAPE)
        worker.danger[...] = rng.integers(0, 4, worker.danger.shape)
    return made


def test_workers_are_put_together(scene):
    made = filled(scene, 3, seed=2, bands=[1, 2])
    told = made.totals()
    hits = sum(worker.hits[:, :, HITS] for worker in made.workers)
    assert np.array_equal(told["hit_count"], hits)
    assert np.array_equal(told["deposit_count"], sum(worker.deposits for worker in made.workers))
    most = np.max([worker.maxima for worker in made.workers], axis=0)
    for k, name in enumerate(("speed_max", "energy_max", "jump_max", "height_max")):
        assert np.array_equal(told[name], np.where(hits > 0, most[:, :, k], np.nan).astype(np.float32), equal_nan=True)
        assert np.isnan(told[name]).any()
    danger = sum(worker.danger for worker in made.workers)
    assert np.array_equal(told["danger"], danger.reshape(3, *SHAPE))
    # the returned arrays are copies: the run continues
    told["hit_count"][...] = 99
    assert np.array_equal(made.totals()["hit_count"], hits)


@pytest.mark.parametrize("first", [1, 2])
def test_an_earlier_run_is_added(scene, first):
    """Two runs one after the other tell what one of all workers tells; a cell without a log is no maximum."""
    together = filled(scene, 3, 5, [1, 1])
    expected = together.totals()
    earlier, later = Rasters(together.workers[:first]), Rasters(together.workers[first:])
    later.add(earlier.totals())
    told = later.totals()
    assert set(told) == set(expected)
    for name, values in expected.items():
        assert np.array_equal(told[name], values, equal_nan=values.dtype.kind == "f"), name


def test_no_danger_unless_requested(scene):
    assert "danger" not in filled(scene, 1).totals()
    assert raster_arrays(SHAPE).passed.size == 0
    assert raster_arrays(SHAPE, np.array([0, 0])).band.size == 0
    asked = raster_arrays(SHAPE, np.array([0, 2, 1]))
    assert asked.danger.shape == (3, 20)
    assert asked.passed.size == 20
    assert asked.order.tolist() == [0, -1, -1]
    assert asked.order[LISTED] == 0


def test_at_least_one_worker(scene):
    assert len(Rasters.allocate(scene, 0).workers) == 1
    assert Rasters.allocate(scene, 2).workers[1].deposits.shape == SHAPE


def test_hits_alone_are_those_beside_maxima():
    """Without maxima rasters take 12 of 28 bytes a cell, and count the same hits and deposits."""
    heights = 0.7 * np.arange(40.0)[:, None] + np.zeros((40, 30))
    ground = Scene.prepare(heights, 1.0, 0.0, 0.0, friction=0.4)
    logs = Logs.alike(np.linspace(14.0, 14.5, 6), np.full(6, 32.0), length=6.0, diameter=0.4)
    told = []
    for maxima in (True, False):
        made = Rasters.allocate(ground, 2, maxima=maxima)
        slide(ground, logs, FIDELITIES["draft"], time_limit=20.0, rasters=made, threads=2)
        told.append(made.totals())
    assert set(told[1]) == {"hit_count", "deposit_count"}
    assert told[0]["hit_count"].max() > 1
    for name, values in told[1].items():
        assert np.array_equal(values, told[0][name]), name
