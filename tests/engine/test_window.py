"""A window of a DEM gives the bits of the whole, on a cell size and at coordinates that no float holds exactly."""

from __future__ import annotations

import numpy as np
import pytest

from deadwood_engine import FIDELITIES, Barriers, Lines, Logs, Rasters, Scene, Trees, slide

CELL, X0, Y0 = 0.7, 2_612_345.678, 1_163_210.987
ROWS, COLUMNS = 260, 150
FIRST = (31, 17)  # column and row of the window's corner
PART = (slice(17, 251), slice(31, 131))


def whole_slope() -> tuple[np.ndarray, np.ndarray]:
    """35 degrees, rough, up to the north, with a cliff's foot far below the window; and a friction a cell."""
    rng = np.random.default_rng(8)
    v = np.arange(ROWS)[:, None] * CELL
    heights = 1500.0 + np.tan(np.radians(35.0)) * np.maximum(v - 30.0, 0.0) + rng.normal(0.0, 0.05, (ROWS, COLUMNS))
    heights[0, 0] = 77.0  # decides the reference of the whole
    return heights.astype(np.float32), rng.uniform(0.45, 0.6, (ROWS, COLUMNS))


def obstacles(rng: np.random.Generator) -> dict:
    x, y = X0 + rng.uniform(35, 80, 90), Y0 + rng.uniform(40, 75, 90)
    fence = np.array([[X0 + 40.0, Y0 + 60.0], [X0 + 62.0, Y0 + 62.0]])
    road = np.array([[X0 + 22.0, Y0 + 65.0], [X0 + 91.0, Y0 + 66.0]])
    return {
        "trees": Trees(x, y, rng.uniform(0.2, 0.6, 90), rng.uniform(10, 20, 90)),
        "barriers": Barriers(fence, np.array([0, 2]), np.array([1.5])),
        "lines": Lines(road, np.array([0, 2])),
    }


@pytest.fixture(scope="module")
def runs():
    heights, friction = whole_slope()
    rng = np.random.default_rng(9)
    things = obstacles(rng)
    logs = Logs.alike(X0 + rng.uniform(45, 70, 24), Y0 + rng.uniform(75, 90, 24), length=9.0, diameter=0.4)
    # A log that rolls out of the window leaves the DEM there: the promise is for those that stay.
    scene = Scene.prepare(heights, CELL, X0, Y0, friction=friction, reference=64.0, **things)
    poses = slide(scene, logs, FIDELITIES["draft"], time_limit=30.0, keep_poses=np.ones(24, bool)).poses
    ends = np.concatenate([poses.base, poses.tip])[:, :2]
    low, high = (X0 + 33 * CELL, Y0 + 19 * CELL), (X0 + 128 * CELL, Y0 + 248 * CELL)
    stays = np.ones(24, bool)
    stays[np.tile(poses.log_row, 2)[((ends < low) | (ends > high)).any(axis=1)]] = False
    assert stays.sum() > 15
    logs = logs.take(np.flatnonzero(stays))
    results = []
    for window in (False, True):
        part = PART if window else (slice(None), slice(None))
        scene = Scene.prepare(
            heights[part], CELL, X0, Y0, friction=friction[part], first=FIRST if window else (0, 0), reference=64.0,
            **things,
        )  # fmt: skip
        rasters = Rasters.allocate(scene, 2)
        result = slide(
            scene,
            logs,
            FIDELITIES["draft"],
            time_limit=30.0,
            threads=2,
            keep_poses=np.ones(len(logs), bool),
            rasters=rasters,
        )
        results.append((scene, result, rasters.totals()))
    return logs, results


def test_every_log_has_the_same_history_to_the_bit(runs):
    _, ((_, whole, _), (_, window, _)) = runs
    assert whole.tree_hits.sum() > 10
    assert whole.barrier_hits.sum() > 0
    assert whole.reach.any()
    for name in whole.__dataclass_fields__:
        if name in ("cost", "poses", "frame"):
            continue
        one, other = getattr(whole, name), getattr(window, name)
        if isinstance(one, np.ndarray):
            assert np.array_equal(one, other, equal_nan=one.dtype.kind == "f"), name
    for name in whole.poses.__dataclass_fields__:
        assert np.array_equal(getattr(whole.poses, name), getattr(window.poses, name)), name


def test_the_rasters_are_the_cut_of_the_wholes(runs):
    _, ((_, _, whole), (_, _, window)) = runs
    assert whole["hit_count"].sum() == window["hit_count"].sum() > 1000
    for name, values in whole.items():
        assert np.array_equal(values[PART], window[name], equal_nan=values.dtype.kind == "f"), name


def test_the_surface_is_the_same_at_every_place(runs):
    _, ((whole, _, _), (window, _, _)) = runs
    rng = np.random.default_rng(1)
    x, y = X0 + rng.uniform(23, 90, 500), Y0 + rng.uniform(13, 170, 500)
    assert np.array_equal(whole.terrain_surface(x, y), window.terrain_surface(x, y))
    assert np.isnan(window.terrain_height(np.array([X0 + 10.0]), np.array([Y0 + 50.0]))).all()
