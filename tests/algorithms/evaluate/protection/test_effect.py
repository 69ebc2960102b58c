"""The effect of obstacles, on arrays: which logs must slide again, what is counted, and ranks, by brute force."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import shapely

from deadwood_algorithms.evaluate.protection import baseline, changed_scenes
from deadwood_algorithms.evaluate.protection.baseline import Baseline, held_by, logs_to_slide, taken_by
from deadwood_algorithms.evaluate.protection.changed_scenes import Change, Task, groups_of, tasks_of
from deadwood_algorithms.evaluate.protection.effect import Effect, effects_of, ranks
from deadwood_algorithms.evaluate.protection.obstacles import BARRIER, STAND, TREE, Obstacle
from deadwood_algorithms.evaluate.protection.rerun import Rerun
from deadwood_algorithms.stats.statistics import paired_interval
from deadwood_engine import FIDELITIES, STOP_REASONS
from deadwood_engine.cores import TREE as CORE_TREE
from deadwood_engine.limits import NEAR_MARGIN


def obstacle(kind: str, name: str, *owners: int) -> Obstacle:
    return Obstacle(kind, name, 0.0, 0.0, np.array(owners, np.int64), shapely.Point(0, 0))


def known(reach: np.ndarray, done: np.ndarray, notes: list[tuple[int, int, float]], **more: Any) -> Baseline:
    """notes : (owner, log, since)"""
    owner, log, since = (np.array(each) for each in zip(*sorted(notes), strict=True))
    facts = {"energy": {}, "held": {}} | more
    nothing = cast("Any", None)
    return Baseline(
        reach, done, owner, log, since, facts["energy"], facts["held"], nothing, nothing, nothing
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(5))
def test_the_logs_to_slide_again_are_those_to_which_it_mattered_before_they_were_done(seed):
    rng = np.random.default_rng(seed)
    n = 40
    done = np.where(rng.random(n) < 0.5, rng.integers(0, 10, n).astype(float), np.inf)
    columns = rng.integers(-3, 6, 200), rng.integers(0, n, 200), rng.integers(0, 10, 200).astype(float)
    notes = list(zip(*(each.tolist() for each in columns), strict=True))
    it = known(np.zeros((n, 1), bool), done, notes)
    for owners in ((-3,), (2, 4), (5,), (99,)):
        expected = {log for owner, log, since in notes if owner in owners and since <= done[log]}
        assert it.logs_to_slide(obstacle(STAND, "s", *owners)).tolist() == sorted(expected)


def wood(trees: int) -> Any:
    """A scene with a number of trees, as far as the rule for steps uses it; one more tree has been removed."""
    solid = np.full(trees, CORE_TREE, [("kind", np.int8)])
    cores = SimpleNamespace(solid=solid, index=SimpleNamespace(items=np.arange(trees)))
    return SimpleNamespace(scene=SimpleNamespace(arrays=SimpleNamespace(cores=cores)), dem=SimpleNamespace(cell=0.5))


@pytest.mark.parametrize(
    ("step", "left", "rebound", "every"),
    [
        (0.51, 0, 0.0, True),
        (0.5, 0, 0.0, False),
        (0.51, 1, 0.0, False),
        (0.1, 0, 0.5, True),
        (0.1, 1, 0.5, False),
    ],
)
def test_all_slide_again_without_the_last_obstacle_that_rules_steps(monkeypatch, step, left, rebound, every):
    """Half of the list's margin is the longest step that is the same in a scene without any obstacle; and if
    nothing is left from which logs rebound, steps are longer."""
    fidelity = FIDELITIES["standard"]._replace(travel_cells=step * NEAR_MARGIN / 0.5)
    laws = {"restitution": 0.0, "tree_restitution": rebound, "barrier_restitution": None}
    question = Rerun(cast("Any", SimpleNamespace(fidelity=fidelity, laws=laws)), cast("Any", range(7)))
    monkeypatch.setattr(baseline, "without", lambda layers, missing: wood(left))
    it = known(np.zeros((7, 1), bool), np.full(7, np.inf), [(0, 3, 1.0)])
    found = logs_to_slide(question, wood(left + 1), it, obstacle(TREE, "t", 0))
    assert found.tolist() == (list(range(7)) if every else [3])


def test_what_was_taken_and_held_by_number():
    """Trees from 0, lying logs' rows after them, barriers from -1 down; a stop at a boulder belongs to none."""
    hits = SimpleNamespace(
        by_barrier=np.array([False, True, False, True, False]),
        item=np.array([2, 0, 2, 1, 4]),
        energy_taken=np.array([1.5, 2.0, 0.25, 3.0, 7.0]),
    )
    reasons = ["tree", "barrier", "lying_log", "lying_log", "block", "rest", "tree"]
    result: Any = SimpleNamespace(
        hits=hits,
        stop_reason=np.array([STOP_REASONS.index(each) for each in reasons]),
        stop_item=np.array([2, 1, 0, 1, 0, -1, 2]),
    )
    assert taken_by(result) == {2: 1750, -1: 2000, -2: 3000, 4: 7000}
    layers: Any = SimpleNamespace(scene=SimpleNamespace(tree_count=4))
    assert held_by(layers, result) == {2: 2, -2: 1, 4: 1, 5: 1}


def test_tasks_hold_each_log_once_and_no_more_than_go_at_once(monkeypatch):
    monkeypatch.setattr(changed_scenes, "AT_ONCE", 4)
    things = [obstacle(TREE, "a", 0), obstacle(TREE, "b", 1), obstacle(TREE, "c", 2)]
    rows = [np.arange(9), np.zeros(0, np.int64), np.array([3, 5, 7, 8])]
    tasks = tasks_of(things, rows)
    assert [task.rows.size for task in tasks] == [4, 4, 1, 4]
    for number, expected in enumerate(rows):
        mine = [task for task in tasks if task.number == number]
        assert all(task.obstacle is things[number] for task in mine)
        assert np.concatenate([np.zeros(0, np.int64), *(task.rows for task in mine)]).tolist() == expected.tolist()


def test_groups_are_cut_after_they_are_full(monkeypatch):
    monkeypatch.setattr(changed_scenes, "CHUNK", 10)
    tasks = [Task(0, obstacle(TREE, "a", 0), np.arange(size)) for size in (4, 4, 4, 4, 12, 1)]
    assert [list(group) for group in groups_of(tasks)] == [[0, 1], [2, 3], [4, 5]]
    assert groups_of([]) == []


@pytest.mark.parametrize("planted", [False, True])
def test_changes_add_up_by_obstacle_and_line(planted):
    """Three tasks of two obstacles, two lines; an obstacle of the run holds what it held there, a candidate now."""
    things = [obstacle(TREE, "a", 0), obstacle(BARRIER, "n", -1, -2)]
    reach = np.array([[True, False], [True, True], [False, False], [True, False]])
    it = known(
        reach, np.full(4, np.inf), [(0, 0, 0.0)], energy={0: 2_000_000, -2: 5_000_000}, held={0: 3, -1: 1, -2: 2}
    )
    tasks = tasks_of([things[0], things[1], things[0]], [np.array([0]), np.array([1]), np.array([2])])
    tasks[2] = type(tasks[2])(0, things[0], np.array([2]))
    changes = [
        Change(np.array([1, 0]), np.array([0, 1]), np.array([1, 0]), np.array([0, 1]), 1, 1_500_000),
        Change(np.array([0, 1]), np.array([0, 0]), np.array([0, 0]), np.array([2, 0]), 4, 250_000),
        Change(np.array([0, 0]), np.array([1, 0]), np.array([2, 1]), np.array([0, 0]), 2, 500_000),
    ]
    question: Any = SimpleNamespace(releases=range(4))
    layers: Any = SimpleNamespace(lines=SimpleNamespace(ids=["road", "rail"]))
    found = effects_of(question, layers, it, things, zip(tasks, changes, strict=True), planted=planted)
    assert [(each.obstacle.id, each.line_id) for each in found] == [
        ("a", "road"), ("a", "rail"), ("n", "road"), ("n", "rail")
    ]  # fmt: skip
    assert [(each.lost, each.gained) for each in found] == [(1, 1), (0, 1), (0, 0), (1, 0)]
    assert [(each.unseen, each.unseen_now) for each in found] == [(3, 0), (1, 1), (0, 2), (0, 0)]
    assert [(each.n_total, each.n_reach, each.n_changed) for each in found] == [
        (4, 3, 3),
        (4, 1, 2),
        (4, 3, 3),
        (4, 1, 0),
    ]
    held, energy = ([3, 3, 4, 4], [2.0, 0.25]) if planted else ([3, 3, 3, 3], [2.0, 5.0])
    assert [each.stopped for each in found] == held
    assert [each.energy_taken_kj for each in found] == [energy[0]] * 2 + [energy[1]] * 2


def test_the_gain_is_of_the_logs_that_reach_without_it():
    one = Effect(obstacle(TREE, "a", 0), "road", 200, 30, 2, 9, 5, 3, 4, 1.0)
    value, low, high = one.gain()
    assert value == 7 / 200
    assert (low, high) == paired_interval(2, 9, 200)
    assert one.n_changed == 37
    # whatever the logs that left the terrain model did: the 5 of the run all reach it, or the 3 without the tree do
    assert one.gain_if_lost() == (2 / 200, 10 / 200)


def test_ranks_are_among_the_same_kind_and_line():
    rng = np.random.default_rng(2)
    found = [
        Effect(obstacle(kind, str(k), k), line, 100, 50, 0, 0, 0, 0, int(rng.integers(3)), float(rng.integers(2)))
        for k in range(12)
        for kind in (TREE, BARRIER)
        for line in ("road", "rail")
    ]
    gains = rng.integers(0, 4, len(found)).astype(float).tolist()
    got = ranks(gains, found)
    for k, each in enumerate(found):

        def better(j: int, each: Effect = each, k: int = k) -> bool:
            other = found[j]
            if (other.obstacle.kind, other.line_id) != (each.obstacle.kind, each.line_id) or j == k:
                return False
            one = (gains[k], each.stopped, each.energy_taken_kj, -k)
            return (gains[j], other.stopped, other.energy_taken_kj, -j) > one

        assert got[k] == 1 + sum(better(j) for j in range(len(found)))
