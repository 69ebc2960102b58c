"""What the kernels' columns become: places in the world, rows of the user's tables, joules; nothing for nothing."""

import numpy as np
import pytest

from deadwood_engine import STOP_REASONS, Scene, Start
from deadwood_engine.ledger import HIT_WIDTH
from deadwood_engine.log_body import CENTRE, LENGTH, MASS, cone_bodies
from deadwood_engine.result import result_of
from deadwood_engine.trace import POSE_WIDTH
from deadwood_engine.way import SUMMARY

N = 4
ORIGIN = np.array([[2000.0 + 0.5 * (10 + 3), 1000.0 + 0.5 * (20 + 5), 64.0]])


@pytest.fixture(scope="module")
def told():
    """Four logs' last rows, made up: (result, summary, start, last states)."""
    rng = np.random.default_rng(2)
    scene = Scene.prepare(100.0 + np.zeros((9, 9)), 0.5, 2000.0, 1000.0, friction=0.3, first=(10, 20), reference=64.0)
    scene = type(scene)(**{**vars(scene), "tree_count": 100, "lying_count": 30})
    start = Start(
        np.tile(np.array([[3, 5]]), (N, 1)), rng.normal(size=(N, 16)),
        cone_bodies(rng.uniform(0.3, 0.8, N), rng.uniform(5.0, 20.0, N), np.full(N, 500.0)),
    )  # fmt: skip
    state = rng.normal(size=(N, 16))
    state[:, 13:16] /= np.linalg.norm(state[:, 13:16], axis=1, keepdims=True)
    summary = np.zeros(N, SUMMARY).view(np.recarray)
    for name in SUMMARY.names or ():
        summary[name] = rng.integers(1, 50, N)
    summary["reason"] = [STOP_REASONS.index(name) for name in ("tree", "lying_log", "block", "rest")]
    summary["item_row"] = 7, 107, 137, -1
    summary["duration"] = 5.0, 0.0, 2.0, 4.0
    summary["started_in_contact"] = 0, 1, 0, 1
    times = np.array([[1.5, np.inf]] * N)
    marks = np.zeros((N, 1), bool), np.ones((N, 1), bool)
    poses = {2: rng.normal(size=(3, POSE_WIDTH)), 0: rng.normal(size=(2, POSE_WIDTH))}
    hits = {1: rng.uniform(1.0, 2.0, (2, HIT_WIDTH))}
    made = result_of(scene, start, state, summary, poses, hits, {}, np.isfinite(times), times, *marks, 1.25)
    return made, summary, start, state, poses


def test_places_are_those_of_the_world(told):
    """Also in a window of the DEM: its first column and row count."""
    made, _, start, state, poses = told
    assert made.release_position == pytest.approx(start.state[:, :3] + ORIGIN)
    assert made.end_position == pytest.approx(state[:, :3] + ORIGIN)
    # the centre lies between the ends, a log's length apart, at its distance from the base
    assert np.linalg.norm(made.tip_end - made.base_end, axis=1) == pytest.approx(start.body[:, LENGTH])
    assert made.end_position - made.base_end == pytest.approx(start.body[:, CENTRE, None] * state[:, 13:16])
    assert made.poses.log_row.tolist() == [0, 0, 2, 2, 2]
    table = np.vstack([poses[0], poses[2]])
    for values, at in ((made.poses.position, 1), (made.poses.base, 4), (made.poses.tip, 7)):
        assert values == pytest.approx(table[:, at : at + 3] + ORIGIN)
    for values, at in (
        (made.poses.time, 0),
        (made.poses.speed, 10),
        (made.poses.spin, 11),
        (made.poses.clearance, 12),
        (made.poses.height, 13),
    ):
        assert np.array_equal(values, table[:, at])


def test_items_are_rows_of_their_own_tables(told):
    """Lying logs are numbered after 100 trees, blocks after 30 lying logs."""
    assert told[0].stop_item.tolist() == [7, 7, 7, -1]


def test_energy_has_the_mass_and_the_mean_needs_a_time(told):
    made, summary, start, _, _ = told
    assert made.energy_max == pytest.approx(summary["energy_max"] * start.body[:, MASS])
    assert made.speed_mean == pytest.approx(
        np.array([summary["path"][0] / 5, 0.0, summary["path"][2] / 2, summary["path"][3] / 4])
    )
    assert np.array_equal(made.penetration_max, np.maximum(summary["penetration"], summary["overlap"]))
    assert np.array_equal(made.overlap_max, summary["overlap"])
    assert made.started_in_contact.tolist() == [False, True, False, True]
    assert made.cost == {
        "steps": summary["steps"].sum(), "airborne_steps": summary["airborne"].sum(),
        "contacts": summary["contacts"].sum(), "sweeps": summary["sweeps"].sum(), "cpu_s": 1.25,
    }  # fmt: skip


def test_a_line_that_was_not_reached_has_no_time(told):
    assert told[0].reach.tolist() == [[True, False]] * N
    assert np.array_equal(told[0].reach_time, [[1.5, np.nan]] * N, equal_nan=True)


def test_every_column_found_by_its_name_is_that_column(told):
    made, summary, _, _, _ = told
    names = (
        "path",
        "speed_max",
        "jump_max",
        "height_max",
        "energy_error",
        "grip",
        "tree_hits",
        "barrier_hits",
        "unconverged",
        "steps",
    )
    for name in names:
        assert np.array_equal(getattr(made, name), summary[name]), name
    assert np.array_equal(made.residual_max, summary["residual"])
    assert np.array_equal(made.stop_reason, summary["reason"])
