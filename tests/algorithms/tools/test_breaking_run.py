"""slide-logs with trees that break: what the run reports, how it is repeated, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
from slope_case import EAST, NORTH, Case, assert_same_run, layer, points, summary, write_layer

from deadwood_algorithms.evaluate.protection.obstacles import read_candidates, with_candidates
from deadwood_algorithms.explore.answer import changed_scene
from deadwood_algorithms.explore.questions import Changes
from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.results.scenario import scenario_line
from deadwood_algorithms.scene.laws import Breaking, scar_laws, slip_laws
from deadwood_algorithms.scene.layers import SceneLayers, read_scene
from deadwood_algorithms.stats.statistics import paired_interval
from deadwood_algorithms.tools import break_trees, compare_fidelity, site_barriers, value_trees, vary

WEAK = 2.0  # kJ of a tree of 40 cm: a part of the logs breaks one
BREAKING: dict[str, Any] = {"tree_capacity_kj": WEAK, "break_trees": True}


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    made = Case(tmp_path_factory.mktemp("case"))
    rng = np.random.default_rng(7)
    places = [(15.0 + 30.0 * a, 65.0 + 20.0 * b) for a, b in rng.random((120, 2))]
    made.releases = write_layer(made.folder / "many.gpkg", points(*places), log_id=np.arange(120) * 2 + 1)
    return made


@pytest.fixture(scope="module")
def rigid(case) -> Path:
    """With the capacity for counting, but without breaking."""
    return case.run(output=str(case.folder / "rigid"), lines=case.lines, trees=case.trees, tree_capacity_kj=WEAK)


@pytest.fixture(scope="module")
def broken(case) -> Path:
    return case.run(output=str(case.folder / "broken"), lines=case.lines, trees=case.trees, **BREAKING)


def road(run: Path) -> set[int]:
    """The logs that reach the road."""
    try:
        frame = layer(run, "reached_by")
    except Exception:  # no log reached a line
        return set()
    return set(frame["log_id"][frame["line_id"] == "road"].tolist())


def test_the_run_tells_what_broke(broken):
    told, logs, trees = summary(broken), layer(broken, "deposits"), layer(broken, "tree_hits")
    above = told["above_capacity"]
    assert above["break_trees"] is True
    assert above["of_trees"]["n_hits"] == logs["tree_hits_above"].sum() == trees["n_above"].sum() > 5
    assert above["of_trees"]["all"]["n_above"] == (logs["tree_hits_above"] > 0).sum()
    assert (trees["n_above"] <= trees["n_logs"]).all()  # a log breaks a tree once
    assert told["scenario"]["breaking"] == {"capacity_kj": WEAK, "power": 2.0}
    assert "that would absorb more than 2 kJ" in told["modelled"]["trees"]


def test_the_terminal_says_that_trees_break(case, tmp_path):
    from deadwood_algorithms.tools import slide_logs

    values = case.values(output=str(tmp_path / "run"), lines=case.lines, trees=case.trees, **BREAKING)
    lines = slide_logs.TOOL(**values).lines
    assert any("trees broke (each log meets all trees)" in line for line in lines)
    assert any("trees break (2 kJ at 40 cm DBH)" in line for line in lines)


def test_reach_lies_between_rigid_trees_and_trees_that_take_nothing(case, rigid, broken, tmp_path):
    """On average, not log by log: one that a tree slows may pass where a faster one is caught. So the order is judged
    by paired intervals: more than with rigid trees, and not significantly more than if broken trees take nothing."""
    outcome = break_trees.TOOL(run=str(rigid), tree_capacity_kj=WEAK, output=str(tmp_path / "b.gpkg"))
    upper = {row["line_id"]: row["n_reach_breaking"] for row in outcome.facts["reach_breaking"]}["road"]
    held, between = road(rigid), road(broken)
    assert paired_interval(len(held - between), len(between - held), 120)[0] > 0.0
    assert len(held) < len(between)
    # each log's own result of break-trees is not in its facts: the widest interval with this many differing logs
    apart = abs(upper - len(between))
    assert len(between) <= upper or paired_interval(0, apart, 120)[0] <= 0.0


def test_a_capacity_that_no_hit_reaches_changes_no_bit(case, tmp_path):
    plain = case.run(output=str(tmp_path / "plain"), **case.everything())
    strong = case.run(output=str(tmp_path / "strong"), **case.everything(), tree_capacity_kj=1e12, break_trees=True)
    one, other = (layer(run, "deposits") for run in (plain, strong))
    assert (other["tree_hits_above"] == 0).all()
    for name in one.columns:
        assert one[name].equals(other[name]), name


def test_workers_break_the_same_trees(case, broken, tmp_path):
    pytest.importorskip("distributed")
    run = case.run(
        output=str(tmp_path / "run"), lines=case.lines, trees=case.trees, scheduler="local", workers=2, **BREAKING
    )
    assert_same_run(broken, run)


def test_the_value_of_a_tree_is_that_of_a_run_without_it(case, broken, tmp_path):
    """In a run with breaking trees: the others break as in that run."""
    value_trees.TOOL(run=str(broken), output=str(tmp_path / "v.gpkg"))
    values = gpd.read_file(tmp_path / "v.gpkg", layer="values")
    values = values[values["line_id"] == "road"].set_index("id")
    trees, before = gpd.read_file(case.trees), road(broken)
    worth = values.assign(size=values["gain_logs"].abs()).sort_values("size", ascending=False)
    for tree in [*worth.index[:3], worth.index[-1]]:
        left = tmp_path / "left.gpkg"
        trees[trees["tree_id"].astype(str) != tree].to_file(left, driver="GPKG")
        without = case.run(output=str(tmp_path / "one"), overwrite=True, lines=case.lines, trees=str(left), **BREAKING)
        after = road(without)
        assert values.at[tree, "gain_logs"] == len(after) - len(before), tree
        assert values.at[tree, "n_reach_without"] == len(after)


def test_barriers_are_sited_in_the_run_with_its_law(case, broken, tmp_path):
    """The run is repeated and compared bit for bit before any barrier is added."""
    site_barriers.TOOL(run=str(broken), output=str(tmp_path / "s"), length_m="20", height_m="3", logs=40)


def test_a_run_whose_trees_broke_has_no_other_bounds(broken, tmp_path):
    with pytest.raises(UserError, match="trees broke in the run itself"):
        break_trees.TOOL(run=str(broken), tree_capacity_kj=WEAK, output=str(tmp_path / "b.gpkg"))


def test_what_is_missing_or_idle_is_refused(case, tmp_path):
    out = {"output": str(tmp_path / "x"), "trees": case.trees, "lines": case.lines}
    with pytest.raises(UserError, match="--break-trees needs --tree-capacity-kj"):
        case.run(**out, break_trees=True)
    values = {
        name: value for name, value in case.values(**out, tree_capacity_kj=WEAK).items() if name != "trajectories"
    }
    with pytest.raises(UserError, match="alone changes nothing here"):
        vary.TOOL(**{**values, "logs": 20})
    values.pop("fidelity")
    with pytest.raises(UserError, match="alone changes nothing here"):
        compare_fidelity.TOOL(**values)


@pytest.fixture(scope="module")
def scene(case) -> SceneLayers:
    return read_scene(
        case.dem, 0.25, case.trees, None, case.lines, crs=None, feedback=Quiet(), breaking=Breaking(WEAK, 2.0)
    )


def capacities(layers: SceneLayers) -> np.ndarray:
    """[kJ] of the scene's trees in the engine, by their rows."""
    solid = layers.scene.arrays.cores.solid
    return solid["capacity"][np.argsort(solid["owner"])] / 1000.0


def test_every_change_of_the_scene_keeps_the_law(case, scene, tmp_path):
    """Trees of another size (vary), candidates (value-trees --plant), and trees planted by hand (explore)."""
    assert capacities(scene) == pytest.approx(WEAK * (50.0 / 40.0) ** 2)
    thicker = scene.varied(trees=scene.trees._replace(diameter=1.1 * scene.trees.diameter))
    assert capacities(thicker) == pytest.approx(WEAK * (55.0 / 40.0) ** 2)
    new = write_layer(tmp_path / "new.gpkg", points((20.0, 50.0)), dbh_cm=[80.0], height_m=[20.0])
    both, _ = with_candidates(scene, read_candidates(new, None, scene, 40.0, Quiet()))
    assert capacities(both)[-1] == pytest.approx(4.0 * WEAK)
    plant = np.array([[EAST + 20.0, NORTH + 50.0, 20.0, 15.0]])
    by_hand = changed_scene(scene, Changes(np.zeros(0, np.int64), plant, (), ()))
    assert capacities(by_hand)[-1] == pytest.approx(0.25 * WEAK)
    assert capacities(by_hand)[:-1] == pytest.approx(WEAK * (50.0 / 40.0) ** 2)
    rigid = read_scene(case.dem, 0.25, case.trees, None, case.lines, crs=None, feedback=Quiet())
    assert rigid.digest != scene.digest
    assert np.isinf(capacities(rigid)).all()


ROCK = "\n".join(f"{x} {y} {z}" for x in (-0.6, 0.6) for y in (-0.6, 0.6) for z in (-0.3, 0.3))
SLIP: dict[str, Any] = {"friction_max": 1.5, "friction_kappa": 2.0, "friction_beta": 50.0}


def test_friction_that_grows_with_slip_is_of_shapes(case, tmp_path):
    rock = tmp_path / "rock.pts"
    rock.write_text(ROCK)
    whole = {"lines": case.lines, "shape": str(rock), "density_kg_m3": 2700.0}
    plain = case.run(output=str(tmp_path / "plain"), **whole)
    slipping = case.run(output=str(tmp_path / "slipping"), **whole, **SLIP)
    farther, nearer = (layer(run, "deposits")["runout_m"].mean() for run in (plain, slipping))
    assert nearer < farther
    told = summary(slipping)
    assert told["scenario"]["slip_friction"] == {"friction_max": 1.5, "kappa_per_m": 2.0, "beta_per_s": 50.0}
    assert "growing to 1.5 with the slip s" in told["modelled"]["friction"]
    assert summary(plain)["scenario"]["slip_friction"] is None


SOFT: dict[str, Any] = {"soil_strength_mn_m2": 1.0, "scar_drag": 3.0}


def test_soft_ground_brakes_a_rock(case, tmp_path):
    rock = tmp_path / "rock.pts"
    rock.write_text(ROCK)
    whole = {"lines": case.lines, "shape": str(rock), "density_kg_m3": 2700.0, "drop_m": 1.0}
    hard = case.run(output=str(tmp_path / "hard"), **whole)
    soft = case.run(output=str(tmp_path / "soft"), **whole, **SOFT)
    faster, slower = (layer(run, "deposits")["speed_max_ms"].mean() for run in (hard, soft))
    assert slower < 0.9 * faster
    told = summary(soft)
    assert told["scenario"]["soft_ground"] == {"strength_mn_m2": 1.0, "drag": 3.0}
    assert "as deep as a soil strength of 1 MN/m² allows" in told["modelled"]["friction"]
    assert "soft ground (1 MN/m2, drag 3)" in scenario_line(told["scenario"])
    assert summary(hard)["scenario"]["soft_ground"] is None


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (SLIP | {"shape": "cone"}, "--friction-max applies to point clouds only: give --shape"),
        (SLIP | {"friction_beta": None}, "--friction-max needs --friction-beta, too"),
        (SLIP | {"friction_max": None}, "--friction-kappa needs --friction-max, too"),
        (SLIP | {"friction_max": 0.2}, "--friction-max is 0.2, but must be above --friction, 0.25"),
        (SOFT | {"shape": "cone"}, "--soil-strength-mn-m2 applies to point clouds only: give --shape; to logs"),
        (SOFT | {"scar_drag": None}, "--soil-strength-mn-m2 needs --scar-drag, too: soft ground has these two numbers"),
        (SOFT | {"soil_strength_mn_m2": None}, "--scar-drag needs --soil-strength-mn-m2, too"),
    ],
)
def test_half_a_law_of_bodies_of_points_is_refused(case, tmp_path, changes, words):
    rock = tmp_path / "rock.pts"
    rock.write_text(ROCK)
    with pytest.raises(UserError, match=words):
        case.run(output=str(tmp_path / "x"), **({"shape": str(rock)} | changes))


def test_without_the_law_the_engine_receives_nothing_of_it():
    assert slip_laws("rock.pts", None, None, None) == scar_laws("rock.pts", None, None) == {}
    assert Breaking.from_options(False, 3.0, 2.0) is None
