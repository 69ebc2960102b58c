"""break-trees compared with runs of single logs in layers without the trees that they broke, one after the other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
from slope_case import Case, arrivals, layer, points, write_layer

from deadwood_algorithms.evaluate.protection import breaking
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.results.capacity import Overloads
from deadwood_algorithms.stats.statistics import paired_interval
from deadwood_algorithms.tools import break_trees

WEAK = 2.0  # kJ of a tree of 40 cm: a part of the logs breaks one, some of them several


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    made = Case(tmp_path_factory.mktemp("case"))
    rng = np.random.default_rng(7)
    places = [(15.0 + 30.0 * a, 65.0 + 20.0 * b) for a, b in rng.random((60, 2))]
    made.releases = write_layer(made.folder / "many.gpkg", points(*places), log_id=np.arange(60) * 2 + 1)
    return made


@pytest.fixture(scope="module")
def wooded(case) -> Path:
    return case.run(output=str(case.folder / "wooded"), lines=case.lines, trees=case.trees)


def one_log_breaking(case: Case, log_id: int, capacity: float, monkeypatch: Any) -> tuple[list[str], set]:
    """Runs of one log, each without the first tree overloaded in the previous run; until none is, or it is through."""
    seen: list[tuple[float, str]] = []

    def watched(self: Overloads, hits: Any, log_ids: Any, layers: Any) -> Any:
        for k in range(hits.item.size):
            tree = int(hits.item[k])
            limit = 1000.0 * capacity * (layers.trees.diameter[tree] / 0.4) ** 2
            if hits.energy_taken[k] > limit:
                seen.append((float(hits.time[k]), layers.tree_ids[tree]))
        return np.zeros(hits.item.size, bool), np.zeros(hits.item.size, bool)

    monkeypatch.setattr(Overloads, "hits_above", watched)
    frame = gpd.read_file(case.releases)
    place = case.folder / "one.gpkg"
    frame[frame["log_id"] == log_id].to_file(place, driver="GPKG")
    trees, gone = gpd.read_file(case.trees), []
    while True:
        seen.clear()
        left = case.folder / "left.gpkg"
        trees[~trees["tree_id"].astype(str).isin(gone)].to_file(left, driver="GPKG")
        run = case.run(
            releases=str(place), lines=case.lines, trees=str(left), output=str(case.folder / "single"), overwrite=True,
            tree_capacity_kj=1.0,
        )  # fmt: skip
        reached = arrivals(run)
        times = [row.t_s for row in layer(run, "reached_by").itertuples()] if reached else []
        done = max(times) if len(times) == 2 else np.inf  # both lines
        first = min((each for each in seen if each[0] <= done), default=None)
        if first is None:
            return gone, reached
        gone.append(first[1])


def test_each_log_continues_without_the_trees_that_it_breaks(case, wooded, tmp_path, monkeypatch):
    """Fifteen logs, including those that break most, compared with separate runs."""
    kept = {}
    original = breaking.break_trees

    def watched(question: Any, layers: Any, known: Any, *more: Any) -> Any:
        found = original(question, layers, known, *more)
        kept.update(found=found, ids=question.releases.logs.log_id, trees=layers.tree_ids, lines=layers.lines.ids)
        return found

    monkeypatch.setattr(breaking, "break_trees", watched)
    outcome = break_trees.TOOL(run=str(wooded), tree_capacity_kj=WEAK, output=str(tmp_path / "b.gpkg"))
    monkeypatch.undo()
    broken = [[kept["trees"][tree] for tree in each] for each in kept["found"].trees]
    numbers = np.array([len(each) for each in broken])
    assert 0 < (numbers > 0).sum() < numbers.size, "every log breaks one, or none does"
    assert numbers.max() > 1, "no log goes on to break another"
    for row in np.argsort(-numbers, kind="stable")[::4].tolist()[:15]:
        log_id = int(kept["ids"][row])
        gone, reached = one_log_breaking(case, log_id, WEAK, monkeypatch)
        assert broken[row] == gone, log_id
        told = {(log_id, line) for line, hit in zip(kept["lines"], kept["found"].reach[row], strict=True) if hit}
        assert told == reached, log_id

    before = arrivals(wooded)
    frame = gpd.read_file(tmp_path / "b.gpkg", layer="reach_breaking")
    for k, row in enumerate(frame.itertuples()):
        a = {log for log, line in before if line == row.line_id}
        b = set(kept["ids"][kept["found"].reach[:, k]].tolist())
        assert (row.n_total, row.n_reach, row.n_reach_breaking) == (60, len(a), len(b))
        assert (row.ci_low, row.ci_high) == pytest.approx(paired_interval(len(a - b), len(b - a), 60))
    trees = gpd.read_file(tmp_path / "b.gpkg", layer="broken").set_index("tree_id")["n_broken"]
    every = [tree for each in broken for tree in each]
    assert trees.to_dict() == {tree: every.count(tree) for tree in every}
    assert f"{(numbers > 0).sum()} of 60 logs would break a tree" in outcome.lines[0]
    assert outcome.lines[0].endswith(f"of 40 cm DBH absorbs {WEAK:g} kJ and others (DBH / 40 cm)^2 times that")


def test_trees_that_hold_everything_change_nothing_and_without_any_hold_it_is_the_bare_slope(case, wooded, tmp_path):
    strong = break_trees.TOOL(run=str(wooded), tree_capacity_kj=1e9, output=str(tmp_path / "s.gpkg"))
    assert all(row["gain_logs"] == 0 for row in strong.facts["reach_breaking"])
    assert "broken" not in strong.facts
    weak = break_trees.TOOL(run=str(wooded), tree_capacity_kj=1e-9, output=str(tmp_path / "w.gpkg"))
    bare = arrivals(case.run(output=str(tmp_path / "bare"), lines=case.lines))
    for row in weak.facts["reach_breaking"]:
        assert row["n_reach_breaking"] == sum(line == row["line_id"] for _, line in bare)


def test_a_run_without_trees_or_lines_is_refused(case, tmp_path):
    bare = case.run(output=str(tmp_path / "bare"), lines=case.lines, trajectories="none")
    with pytest.raises(UserError, match="no tree stands in the run, so none breaks"):
        break_trees.TOOL(run=str(bare), tree_capacity_kj=1.0, output=str(tmp_path / "b.gpkg"))
    nowhere = case.run(output=str(tmp_path / "nowhere"), trees=case.trees, trajectories="none")
    with pytest.raises(UserError, match="the run has no roads, railways or houses; name them with --lines LAYER"):
        break_trees.TOOL(run=str(nowhere), tree_capacity_kj=1.0, output=str(tmp_path / "b.gpkg"))
