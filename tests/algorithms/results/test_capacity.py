"""Hits above the capacity of trees and logs: counted by brute force from the engine's hits; nothing else changes."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from slope_case import Case, layer, summary

from deadwood_algorithms.report import sections
from deadwood_algorithms.report.words import Words
from deadwood_algorithms.results.capacity import Capacity, Overloads, overload_lines
from deadwood_algorithms.stats.statistics import wilson_interval

TREE, LOG = 0.5, 0.3  # kJ of a stem of 40 cm: some hits of the case are above, some below


def test_a_capacity_grows_with_its_power_of_dbh():
    capacity = Capacity(tree_capacity_kj=100.0, tree_capacity_power=2.5, log_capacity_kj=50.0)
    assert capacity.of_trees(np.array([40.0, 80.0])) == pytest.approx([1e5, 1e5 * 2.0**2.5])
    assert capacity.of_logs(np.array([20.0])) == pytest.approx([5e4 / 4.0])
    assert np.isinf(Capacity(log_capacity_kj=1.0).of_trees(np.array([10.0]))).all()
    assert capacity
    assert not Capacity()


def test_a_hit_is_above_its_own_trees_and_its_own_logs_capacity():
    """Standing trees 0 and 1 of 40 and 20 cm, a lying log behind them, and a barrier of the same number as tree 0."""
    capacity = Capacity(tree_capacity_kj=1.0, log_capacity_kj=2.0)
    overloads = Overloads(capacity, np.array([3, 7]), capacity.of_logs(np.array([40.0, 20.0])))
    scene: Any = SimpleNamespace(tree_ids=["a", "b"], trees=SimpleNamespace(diameter=np.array([0.4, 0.2])))
    hits = SimpleNamespace(
        item=np.array([0, 0, 1, 1, 2, 0]),
        by_barrier=np.array([False, False, False, False, False, True]),
        log_row=np.array([0, 1, 0, 1, 0, 1]),
        energy_taken=np.array([999.0, 1001.0, 249.0, 251.0, 2001.0, 501.0]),
        broke=np.array([False, True, False, False, True, False]),
    )
    tree, log = overloads.hits_above(hits, np.array([3, 7]), scene)
    assert tree.tolist() == [False, True, False, True, False, False]
    assert log.tolist() == [False, True, False, False, True, True]
    broken = Overloads(replace(capacity, break_trees=True), overloads.log_id, overloads.log_capacity)
    assert broken.hits_above(hits, np.array([3, 7]), scene)[0].tolist() == [False, True, *[False] * 4]


def test_each_log_has_the_capacity_of_its_own_dbh_whatever_the_order_of_the_layer():
    releases: Any = SimpleNamespace(
        logs=SimpleNamespace(log_id=np.array([7, 3, 5])), dbh_cm=np.array([20.0, 40.0, 80.0])
    )
    found = Overloads.of(Capacity(log_capacity_kj=2.0), releases)
    assert dict(zip(found.log_id, found.log_capacity, strict=True)) == {3: 2000.0, 5: 8000.0, 7: 500.0}


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


def test_a_runs_hits_above_are_those_of_the_engine(case, tmp_path, monkeypatch):
    """Every hit of the run is checked separately; the motion is that of a run without a capacity."""
    seen = []
    original = Overloads.hits_above

    def watched(self: Overloads, hits: Any, log_id: Any, layers: Any) -> Any:
        standing = ~hits.by_barrier & (hits.item < len(layers.tree_ids))
        for k in range(hits.item.size):
            tree = int(hits.item[k]) if standing[k] else -1
            dbh = 100.0 * layers.trees.diameter[tree] if tree >= 0 else np.inf
            seen.append((int(log_id[hits.log_row[k]]), tree, float(hits.energy_taken[k]), dbh))
        return original(self, hits, log_id, layers)

    monkeypatch.setattr(Overloads, "hits_above", watched)
    given = case.everything() | {"trajectories": "none"}
    run = case.run(**given, output=str(tmp_path / "run"), tree_capacity_kj=TREE, log_capacity_kj=LOG)
    plain = case.run(**given, output=str(tmp_path / "plain"))
    logs: Any = layer(run, "deposits")
    trees, told = layer(run, "tree_hits"), summary(run)["above_capacity"]
    before = layer(plain, "deposits")
    assert logs[list(before)].equals(before)
    assert summary(plain)["above_capacity"] is None

    dbh = logs.set_index("log_id")["dbh_cm"]
    above = {  # by log: hits of trees above theirs, hits above the log's own
        log: (
            sum(e > 1000.0 * TREE * (d / 40.0) ** 2 for one, tree, e, d in seen if one == log and tree >= 0),
            sum(e > 1000.0 * LOG * (dbh[log] / 40.0) ** 2 for one, _, e, _ in seen if one == log),
        )
        for log in logs["log_id"]
    }
    assert dict(zip(logs["log_id"], logs["tree_hits_above"], strict=True)) == {log: n for log, (n, _) in above.items()}
    assert dict(zip(logs["log_id"], logs["log_hits_above"], strict=True)) == {log: n for log, (_, n) in above.items()}
    assert 0 < logs["tree_hits_above"].sum() < trees["n_hits"].sum()
    assert trees["n_above"].sum() == logs["tree_hits_above"].sum() == told["of_trees"]["n_hits"]
    assert told["of_logs"]["n_hits"] == logs["log_hits_above"].sum()

    held = logs["stop_reason"] == "tree"
    reached: Any = layer(run, "reached_by").groupby("line_id")["log_id"].agg(set)
    groups = {"held_by_trees": set(logs["log_id"][held]), "all": set(logs["log_id"])}
    shares = [(told["of_trees"][name], group) for name, group in groups.items()]
    shares += [(each, reached.get(each["line_id"], set())) for each in told["of_trees"]["reach"]]
    for record, group in shares:
        count = sum(above[log][0] > 0 for log in group)
        assert (record["n_logs"], record["n_above"]) == (len(group), count)
        assert (record["ci_low"], record["ci_high"]) == pytest.approx(wilson_interval(count, len(group)))
    assert any(line.startswith("logs with a hit above the capacity of a tree:") for line in overload_lines(told))
    page = " ".join(map(str, sections.above_capacity(told, Words("de"))))
    assert "über der Tragfähigkeit" in page
    assert sections.above_capacity(None, Words("en")) == []


def test_only_what_is_requested_is_reported(case, tmp_path):
    run = case.run(**case.everything(), trajectories="none", output=str(tmp_path / "run"), log_capacity_kj=1e9)
    told = summary(run)["above_capacity"]
    assert told["of_trees"] is None
    assert told["of_logs"]["n_hits"] == 0
    assert all("a tree can take" not in line for line in overload_lines(told))
