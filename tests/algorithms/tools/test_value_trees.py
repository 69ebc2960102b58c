"""value-trees compared with whole runs without each object, log by log; and with each candidate."""

from __future__ import annotations

import re
import sqlite3
from dataclasses import replace
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import shapely
from slope_case import EAST, NORTH, Case, arrivals, assert_same_file, layer, points, write_layer

from deadwood_algorithms.evaluate.protection import effect_layer, near_candidates
from deadwood_algorithms.evaluate.protection.changed_scenes import ChangedScenes
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.scene import layers, reach
from deadwood_algorithms.simulate import sliding, windows
from deadwood_algorithms.stats.statistics import paired_interval
from deadwood_algorithms.tools import value_trees
from deadwood_engine.limits import NEAR_MARGIN

LINES = ["road", "house"]


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    """More logs than the case has, a lying log across the way, and trees in rows, so that many logs meet many."""
    made = Case(tmp_path_factory.mktemp("case"))
    rng = np.random.default_rng(7)
    places = [(15.0 + 30.0 * a, 65.0 + 20.0 * b) for a, b in rng.random((80, 2))]
    made.releases = write_layer(made.folder / "many.gpkg", points(*places), log_id=np.arange(80) * 2 + 1)
    return made


@pytest.fixture(scope="module")
def lying(case) -> str:
    shapes = [shapely.LineString([(18.0, 50.0), (30.0, 51.0)]), shapely.LineString([(35.0, 55.0), (45.0, 54.0)])]
    return write_layer(case.folder / "lying.gpkg", shapes, lying_id=["first", "second"], diameter_cm=[60.0, 40.0])


@pytest.fixture(scope="module")
def full(case, lying) -> Path:
    return case.run(output=str(case.folder / "full"), lying_logs=lying, **case.everything())


@pytest.fixture(scope="module")
def wooded(case) -> Path:
    """Only trees, so that many logs pass and every tree counts."""
    return case.run(output=str(case.folder / "wooded"), lines=case.lines, trees=case.trees)


@pytest.fixture(scope="module")
def valued(case, full) -> gpd.GeoDataFrame:
    """Values of every object, and of a stand of the western trees."""
    stands = [shapely.box(0.0, 0.0, 25.0, 100.0), shapely.box(50.0, 35.0, 60.0, 100.0)]
    stand = write_layer(case.folder / "stands.gpkg", stands, stand_id=["west", "east"])
    return values(full, case.folder / "values.gpkg", stands=stand)


def values(run: Path, path: Path, name: str = "values", **more: Any) -> gpd.GeoDataFrame:
    value_trees.TOOL(run=str(run), output=str(path), overwrite=True, **more)
    return gpd.read_file(path, layer=name)


def fewer(case: Case, source: str, name: str, gone: list[Any]) -> str:
    """The layer without the rows of these ids."""
    frame = gpd.read_file(source)
    kept = frame[~frame[name].isin(gone)]
    path = case.folder / f"without_{'_'.join(map(str, gone))[:40]}.gpkg"
    kept.to_file(path, layer=path.stem, driver="GPKG")
    return str(path)


def check(rows: gpd.GeoDataFrame, with_it: set, without: set, changed: str, sign: int = 1) -> None:
    assert len(rows) == len(LINES)
    for row in rows.itertuples():
        a, b = ({log for log, line in each if line == row.line_id} for each in (with_it, without))
        assert (row.n_reach, getattr(row, changed)) == (len(a), len(b)), (row.kind, row.id, row.line_id)
        low, high = sorted(sign * each for each in paired_interval(len(a - b), len(b - a), 80))
        assert (row.ci_low, row.ci_high) == pytest.approx((low, high), abs=1e-12)
        assert row.gain_logs == sign * (len(b) - len(a))
        assert row.gain_p == pytest.approx(row.gain_logs / 80)


def test_twenty_trees_are_worth_what_whole_runs_without_them_say(case, wooded):
    """The ten with the largest effect, and ten others; the interval is that of the same logs."""
    trees: Any = values(wooded, case.folder / "wooded.gpkg")
    ids = trees[trees["line_id"] == "road"].sort_values("energy_taken_kj", ascending=False)["id"].tolist()
    assert len(ids) == 59  # one stands beyond the outermost cell centres, on no terrain
    now = arrivals(wooded)
    differing = 0
    for tree_id in ids[:10] + ids[10::5]:
        without = fewer(case, case.trees, "tree_id", [int(tree_id)])
        changed = case.run(output=str(case.folder / "again"), overwrite=True, lines=case.lines, trees=without)
        then = arrivals(changed)
        differing += then != now
        check(trees[trees["id"] == tree_id], now, then, "n_reach_without")
    assert differing > 5, "too few trees change anything to show much"


@pytest.mark.parametrize(
    ("kind", "flag", "field", "gone"),
    [
        ("barrier", "barriers", "barrier_id", "west"),
        ("barrier", "barriers", "barrier_id", "east"),
        ("lying_log", "lying_logs", "lying_id", "first"),
        ("lying_log", "lying_logs", "lying_id", "second"),
    ],
)
def test_barriers_and_lying_logs_likewise(case, lying, full, valued, kind, flag, field, gone):
    layers = case.everything() | {"lying_logs": lying}
    layers[flag] = fewer(case, layers[flag], field, [gone])
    changed = case.run(output=str(case.folder / "again"), overwrite=True, trajectories="none", **layers)
    rows = valued[(valued["kind"] == kind) & (valued["id"] == gone)]
    check(rows, arrivals(full), arrivals(changed), "n_reach_without")


def test_a_stand_is_all_its_trees_at_once(case, lying, full, valued):
    frame = gpd.read_file(case.trees)
    inside = frame[
        shapely.contains_xy(shapely.box(0.0, 0.0, 25.0, 100.0), frame.geometry.x - EAST, frame.geometry.y - NORTH)
    ]
    layers = case.everything() | {"trees": fewer(case, case.trees, "tree_id", inside["tree_id"].tolist())}
    changed = case.run(output=str(case.folder / "again"), overwrite=True, lying_logs=lying, **layers)
    rows = valued[(valued["kind"] == "stand") & (valued["id"] == "west")]
    check(rows, arrivals(full), arrivals(changed), "n_reach_without")
    trees = valued[valued["id"].isin(inside["tree_id"].astype(str)) & (valued["line_id"] == "road")]
    assert rows["stopped"].iloc[0] == trees["stopped"].sum()


def test_stopped_and_taken_are_those_of_the_run(full, valued):
    road = valued[valued["line_id"] == "road"].set_index(["kind", "id"])
    deposits, hits = layer(full, "deposits"), layer(full, "tree_hits").set_index("tree_id")
    for kind, prefix in (("tree", ""), ("barrier", ""), ("lying_log", "lying:")):
        held = deposits[deposits["stop_reason"] == kind]["stop_id"].value_counts()
        mine = road.loc[kind]
        assert {prefix + str(name): n for name, n in mine["stopped"].items() if n} == held.to_dict()
    taken = road.loc["tree", "energy_taken_kj"]
    for tree_id, row in hits.iterrows():
        assert taken[str(tree_id)] == pytest.approx(row["energy_taken_kj"], abs=2e-6 * row["n_hits"])
    assert taken.sum() == pytest.approx(hits["energy_taken_kj"].sum())


def test_the_map_shows_the_worth_at_once(case, valued):
    with sqlite3.connect(case.folder / "values.gpkg") as package:
        ((style,),) = package.execute("SELECT styleQML FROM layer_styles WHERE f_table_name = 'values'").fetchall()
    assert 'type="graduatedSymbol" attr="gain_p"' in style
    lower = [float(each) for each in re.findall(r'<range [^>]*lower="([^"]+)"', style)]
    upper = [float(each) for each in re.findall(r'<range [^>]*upper="([^"]+)"', style)]
    assert (lower[0], upper[-1]) == (-1.0, 1.0)
    assert lower[1:] == upper[:-1]


def test_ranks_are_a_place_for_each_of_a_kind(valued):
    for _, rows in valued.groupby(["kind", "line_id"]):
        assert sorted(rows["rank"]) == list(range(1, len(rows) + 1))
        assert rows.sort_values("rank")["gain_logs"].is_monotonic_decreasing


def test_threads_change_no_byte(full, tmp_path):
    for threads in (1, 3):
        value_trees.TOOL(run=str(full), output=str(tmp_path / f"{threads}.gpkg"), threads=threads)
    assert_same_file(tmp_path / "1.gpkg", tmp_path / "3.gpkg")


def both_ways(run: Path, folder: Path, monkeypatch, feedback: Any = None, **more: Any) -> float:
    """The same bytes, whether logs continue from stages or from their release; returns the share that had a stage."""
    stages_of, used = ChangedScenes.stages_of, []

    def from_release(self, scene, task):
        used.append(stages_of(self, scene, task)["going_on"] >= 0)
        assert self.shorter_before() == {"until_reached": True}
        return {}

    value_trees.TOOL(feedback=feedback, run=str(run), output=str(folder / "short.gpkg"), **more)
    with monkeypatch.context() as changed:
        changed.setattr(ChangedScenes, "shorter_before", ChangedScenes.shorter, raising=False)
        changed.setattr(ChangedScenes, "shorter", lambda self: {})
        changed.setattr(ChangedScenes, "stages_of", from_release)
        value_trees.TOOL(run=str(run), output=str(folder / "long.gpkg"), **more)
    assert_same_file(folder / "short.gpkg", folder / "long.gpkg")
    return float(np.concatenate(used).mean())


def test_going_on_from_stages_changes_no_byte(full, valued, tmp_path, monkeypatch):
    """All kinds of things, and stands."""
    assert both_ways(full, tmp_path, monkeypatch, stands=str(full.parent / "stands.gpkg")) > 0.5


def test_nor_does_it_in_a_window_that_grows(case, said, tmp_path, monkeypatch):
    monkeypatch.setattr(reach, "BLOCK_CELLS", 8)
    monkeypatch.setattr(windows, "WHOLE_CELLS", 100)
    monkeypatch.setattr(layers, "WHOLE_CELLS", 100)
    monkeypatch.setattr(windows, "SLOPE_LEAST", 20.0)
    monkeypatch.setattr(windows, "SLOPE_MOST", 20.0)
    run = case.run(output=str(tmp_path / "run"), lines=case.lines, trees=case.trees)
    assert both_ways(run, tmp_path, monkeypatch, said) > 0.5
    assert any("is read wider" in each for each in said.notes)


@pytest.mark.parametrize("trees", [True, False])
def test_what_is_planted_holds_what_whole_runs_with_it_say(case, tmp_path, trees):
    """Trees and a high stump as points, and lying logs as lines; also where nothing stands yet."""
    layers = {"lines": case.lines} | ({"trees": case.trees} if trees else {})
    now = case.run(output=str(tmp_path / "now"), **layers)
    spots = [(20.0, 50.0), (30.0, 60.0), (5.0, 40.0), (33.0, 45.0)]
    sizes = {"dbh_cm": [80.0, 60.0, 30.0, 60.0], "height_m": [25.0, 1.3, 20.0, 2.0]}
    plant = write_layer(tmp_path / "plant.gpkg", points(*spots), tree_id=[1, 2, 3, 4], **sizes)
    lines = [shapely.LineString([(15.0, 48.0), (35.0, 49.0)]), shapely.LineString([(30.0, 58.0), (40.0, 55.0)])]
    lay = write_layer(tmp_path / "lay.gpkg", lines, lying_id=[7, 8], diameter_cm=[70.0, 50.0])
    found = values(now, tmp_path / "v.gpkg", "planted", plant=plant, plant_lying=lay)
    assert found["kind"].value_counts().to_dict() == {"tree": 8, "lying_log": 4}
    before, differing = arrivals(now), 0
    for row in range(4):
        frame = gpd.read_file(plant).iloc[[row]]
        if trees:
            frame = gpd.GeoDataFrame(gpd.pd.concat([gpd.read_file(case.trees), frame]), crs=frame.crs)
        frame.to_file(tmp_path / "more.gpkg", driver="GPKG")
        after = arrivals(
            case.run(output=str(tmp_path / "then"), overwrite=True, **(layers | {"trees": str(tmp_path / "more.gpkg")}))
        )
        differing += after != before
        check(found[(found["kind"] == "tree") & (found["id"] == str(row + 1))], before, after, "n_reach_with", -1)
    for row in range(2):
        gpd.read_file(lay).iloc[[row]].to_file(tmp_path / "more.gpkg", driver="GPKG")
        after = arrivals(
            case.run(output=str(tmp_path / "then"), overwrite=True, lying_logs=str(tmp_path / "more.gpkg"), **layers)
        )
        differing += after != before
        check(found[(found["kind"] == "lying_log") & (found["id"] == str(row + 7))], before, after, "n_reach_with", -1)
    assert differing > 2


def test_no_log_that_would_list_a_candidate_is_left_out(case, monkeypatch, tmp_path, said):
    """812 candidates all over the slope, compared with poses two centimetres apart: a log whose axis comes within the
    engine's margin of one is slid again with it, at the run's fidelity. And with steps and outlines as short as those,
    no log that stays 20 cm farther away: the margin beyond the engine's is for these alone.
    """
    run = case.run(output=str(tmp_path / "run"), lines=case.lines, trees=case.trees, trajectories="none")
    spots = [(3.0 + 2.0 * k, 8.0 + 3.1 * j) for k in range(28) for j in range(29)]
    sizes = {"dbh_cm": np.full(len(spots), 30.0), "height_m": np.full(len(spots), 20.0)}
    plant = write_layer(tmp_path / "plant.gpkg", points(*spots), tree_id=np.arange(len(spots)), **sizes)
    told: list[Any] = []

    def caught(question, layers, both, found, widest, steps, feedback):
        fine = question.simulation.fidelity._replace(trace_cells=0.02, travel_cells=0.05)
        short = replace(question, simulation=replace(question.simulation, fidelity=fine))
        near = [logs_near(each, layers, both, found, widest, steps, feedback)[0] for each in (question, short)]
        told.append((question, short, layers, found, widest, near))
        raise UserError("enough")

    logs_near = near_candidates.logs_near
    monkeypatch.setattr(effect_layer, "logs_near", caught)
    with pytest.raises(UserError, match="enough"):
        value_trees.TOOL(run=str(run), output=str(tmp_path / "v.gpkg"), plant=plant)
    question, short, layers, found, widest, near = told[0]
    keep, outside = np.ones(len(question.releases), bool), [0, 0]
    for each, told_near in zip((question, short), near, strict=True):
        fine = each.simulation.fidelity._replace(trace_cells=0.02)
        report = sliding.reporter(said, keep.size, "")
        result, _ = sliding.slide_once(
            layers, each.releases.logs, replace(each.simulation, fidelity=fine), report, keep_poses=keep
        )
        poses = result.poses
        tree = shapely.STRtree(shapely.linestrings(np.stack([poses.base[:, :2], poses.tip[:, :2]], axis=1)))
        reach = widest + 0.5 * float(each.releases.logs.diameter.max()) + NEAR_MARGIN
        for one, rows in zip(found, told_near, strict=True):
            listed = set(poses.log_row[tree.query(one.shape, "dwithin", reach)].tolist())
            assert listed <= set(rows.tolist())
            if each is short:
                assert set(rows.tolist()) <= set(poses.log_row[tree.query(one.shape, "dwithin", reach + 0.2)].tolist())
            outside[each is short] += len(rows) < keep.size
    assert min(outside) > 100


def test_a_run_that_was_moved_with_its_inputs_is_found(case, tmp_path):
    made = Case(tmp_path / "before")
    made.run(lines=made.lines, trees=made.trees)
    (tmp_path / "before").rename(tmp_path / "after")
    found = values(tmp_path / "after" / "run", tmp_path / "v.gpkg")
    assert found["n_total"].unique().tolist() == [24]


def test_other_lines_and_a_draw_of_the_logs(case, wooded, tmp_path):
    """For a line far up, and for only ten logs: their results are those of the run."""
    high = write_layer(tmp_path / "high.gpkg", [shapely.LineString([(0.5, 60.0), (59.5, 60.0)])], name=["high"])
    found = values(wooded, tmp_path / "v.gpkg", lines=high, logs=10, seed=3)
    assert set(found["line_id"]) == {"high"}
    assert found["n_total"].unique().tolist() == [10]
    assert found["n_reach"].iloc[0] > 0


def test_a_run_that_ended_early_is_evaluated_over_its_own_logs(case, tmp_path):
    made = case.run(output=str(tmp_path / "run"), lines=case.lines, trees=case.trees, until_ci=0.4)
    n = len(layer(made, "deposits"))
    assert values(made, tmp_path / "v.gpkg")["n_total"].unique().tolist() == [n]


def refused(match: str, run: Path, path: Path, **more: Any) -> None:
    with pytest.raises(UserError, match=match):
        value_trees.TOOL(run=str(run), output=str(path), **more)
    assert not path.exists()


def test_what_cannot_be_asked_is_refused(case, wooded, tmp_path):
    out = tmp_path / "v.gpkg"
    bare = case.run(output=str(tmp_path / "bare"), lines=case.lines)
    refused("no tree, lying log or barrier stands in the run; --plant names places", bare, out)
    silent = case.run(output=str(tmp_path / "silent"), trees=case.trees)
    refused("the run has no roads, railways or houses; name them with --lines LAYER", silent, out)
    refused("must be a .gpkg file", wooded, tmp_path / "v.csv")
    nowhere = write_layer(tmp_path / "s.gpkg", [shapely.box(0.0, 1.0, 5.0, 5.0)])
    refused("no stand holds a tree of the run", wooded, out, stands=nowhere)
    sizeless = write_layer(tmp_path / "p.gpkg", points((20.0, 50.0)), tree_id=[1])
    refused("have no field 'dbh_cm'", wooded, out, plant=sizeless)
    refused("does not exist", tmp_path / "none", out)


def test_inputs_that_changed_or_are_gone_are_reported(tmp_path):
    made = Case(tmp_path)
    run = made.run(lines=made.lines, trees=made.trees)
    trees = gpd.read_file(made.trees)
    write_layer(
        tmp_path / "trees.gpkg",
        points((30.0, 60.0), (25.0, 55.0)),
        tree_id=[1, 2],
        dbh_cm=[90.0] * 2,
        height_m=[9.0] * 2,
    )
    refused("end elsewhere than in the run: an input has changed since", run, tmp_path / "v.gpkg")
    trees.to_file(tmp_path / "trees.gpkg", layer="trees", driver="GPKG")
    (tmp_path / "releases.gpkg").unlink()
    refused("releases.gpkg, the run's releases, no longer exists", run, tmp_path / "v.gpkg")
