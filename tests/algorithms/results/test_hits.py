"""The ledgers of barriers and trees through files: a shot with a known answer, sums, resume, draws, schemas."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import geopandas as gpd
import numpy as np
import pytest
import shapely
from slope_case import EAST, NORTH, Case, assert_same_run, layer, points, summary, write_dem, write_layer

from deadwood_algorithms import schemas
from deadwood_algorithms.params.tool import Cancelled, Quiet
from deadwood_algorithms.results.hits import barrier_hits_frame, block_hits_frame, hit_arrays, lying_hits_frame
from deadwood_algorithms.simulate import chunks
from deadwood_engine import STOP_REASONS, Hits

G = 9.81


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def full(case) -> Path:
    return case.run(output=str(case.folder / "full"), threads=1, **case.everything())


def test_a_shot_at_a_plate(case, tmp_path):
    """A log flies level at 20 m/s to the south into a plate 20 m away: a parabola gives time, speed, height and angle.

    Its tip meets the plate; the momentum it loses beyond the fall's part is what the plate took, as is the energy.
    """
    flat = write_dem(tmp_path / "flat.tif", flat=True)
    wall = write_layer(tmp_path / "w.gpkg", [shapely.LineString([(20, 40), (40, 40)])], barrier_id=[3], height_m=[9.0])
    one = write_layer(
        tmp_path / "one.gpkg", points((30.0, 65.0)), orientation=["lying"], azimuth_deg=[180.0], speed_ms=[20.0],
        drop_m=[8.0], release_id=["shot"], log_id=[17],
    )  # fmt: skip
    run = case.run(dem=flat, releases=one, barriers=wall, output=str(tmp_path / "run"), fidelity="fine", length_m=6.0)
    deposit, hits = layer(run, "deposits").iloc[0], layer(run, "barrier_hits")
    first = hits.iloc[0]
    assert (first["log_id"], first["release_id"], first["barrier_id"]) == (17, "shot", 3)
    front = 6.0 * (1 - 11 / 28)  # the centre of mass of a cone with r = R/2 lies 11/28 from its base
    t = (25.0 - front) / 20.0
    assert first["t_s"] == pytest.approx(t, abs=0.005)  # the log tilts a little: its taper
    assert first["speed_ms"] == pytest.approx(np.hypot(20.0, G * t), rel=0.005)
    assert first["angle_deg"] == pytest.approx(np.degrees(np.arctan2(G * t, 20.0)), abs=0.3)
    middle = deposit["release_z"] - 1000.0 - 0.5 * G * t * t
    assert first["height_hit_m"] == pytest.approx(middle, abs=0.25)  # somewhere on the tip's face, 0.2 m across
    mass = 300.0 * np.pi * 6.0 / 3.0 * (0.2**2 + 0.2 * 0.1 + 0.1**2)
    assert first["energy_kj"] == pytest.approx(0.5e-3 * mass * (20.0**2 + (G * t) ** 2), rel=0.01)
    assert 0.9 < first["energy_taken_kj"] / (0.5e-3 * mass * 20.0**2) < 1.1
    assert first["impulse_kns"] == pytest.approx(1e-3 * mass * 20.0, rel=0.05)
    assert (first.geometry.x - EAST, first.geometry.y - NORTH) == pytest.approx((30.0, 40.0), abs=0.11)
    assert first.geometry.z - 1000.0 == pytest.approx(first["height_hit_m"], abs=1e-4)
    record = summary(run)["barriers"][0]
    assert record["n_hits"] == len(hits)
    assert record["energy_hit_max_kj"] == hits["energy_kj"].max()


def test_the_ledgers_agree_with_the_deposits(full):
    deposits = layer(full, "deposits").set_index("log_id")
    plates, trees = layer(full, "barrier_hits"), layer(full, "tree_hits")
    by_log = plates.groupby("log_id")["barrier_id"].nunique()
    assert by_log.to_dict() == deposits["barrier_hits"][deposits["barrier_hits"] > 0].to_dict()
    assert trees["n_logs"].sum() == deposits["tree_hits"].sum() > 5
    stops = deposits.loc[deposits["stop_reason"] == "tree", "stop_id"].value_counts()
    assert trees.loc[trees["n_stops"] > 0].set_index("tree_id")["n_stops"].to_dict() == stops.to_dict()
    held = plates[plates["stopped"] == 1].set_index("log_id")["barrier_id"].to_dict()
    assert held == deposits.loc[deposits["stop_reason"] == "barrier", "stop_id"].to_dict()
    assert (trees["n_hits"] >= trees["n_logs"]).all()
    assert (trees["impulse_max_kns"] <= trees["impulse_sum_kns"] + 1e-6).all()
    # no log can lose more than the fall provided
    fall = deposits["fall_m"] * deposits["density_kg_m3"] * np.pi * 10.0 / 3.0 * 0.07 * G / 1000.0
    taken = trees["energy_taken_kj"].sum() + plates["energy_taken_kj"].sum()
    assert 0.0 < taken < fall.sum()
    told = summary(full)
    assert told["trees"]["n_hits"] == trees["n_hits"].sum()
    assert told["trees"]["n_total"] == 59
    counts = plates["barrier_id"].value_counts()
    assert all(each["n_hits"] == counts.get(each["barrier_id"], 0) for each in told["barriers"])


def test_trees_keep_their_place_and_their_columns(case, full):
    trees, source = layer(full, "tree_hits"), gpd.read_file(case.trees).set_index("tree_id")
    for _, tree in trees.iterrows():
        assert tree.geometry.equals(source.geometry[int(tree["tree_id"])])
        assert tree["dbh_cm"] == pytest.approx(50.0)
        assert tree["height_m"] == 20.0


@pytest.mark.parametrize("name", ["barrier_hits", "tree_hits"])
def test_the_layers_hold_what_the_schema_says(full, name):
    frame = layer(full, name)
    wanted = [each for each in schemas.LAYERS[name].columns if each.name != "n_above"]  # with a capacity: test_capacity
    assert [each.name for each in wanted] == [each for each in frame.columns if each != "geometry"]
    assert frame.geometry.has_z.all() == (name == "barrier_hits")
    for column in wanted:
        if column.kind in ("number", "int"):
            faults = [schemas.value_fault(column, each) for each in frame[column.name].tolist()]
            assert not any(faults), (column.name, faults)


class StopAfter(Quiet):
    def __init__(self) -> None:
        self.done = 0.0

    def progress(self, done: float, total: float, what: str) -> None:
        self.done = done if what == "sliding logs" else 0.0

    def cancelled(self) -> bool:
        return self.done >= 11


def test_chunks_threads_and_an_interruption_change_no_bit(case, full, tmp_path, monkeypatch):
    monkeypatch.setattr(chunks, "CHUNK", 5)
    monkeypatch.setattr(chunks, "CHECKPOINT_S", 0.0)
    with pytest.raises(Cancelled):
        case.run(StopAfter(), output=str(tmp_path / "run"), **case.everything())
    assert_same_run(full, case.run(output=str(tmp_path / "run"), resume=True, threads=2, **case.everything()))


def test_no_hit_no_layer(case, tmp_path):
    run = case.run(output=str(tmp_path / "bare"), trajectories="none", time_limit_s=1.0)
    assert not {"barrier_hits", "tree_hits"} & set(gpd.list_layers(run / "run.gpkg")["name"])


def items(ids: list, item: list[int]) -> SimpleNamespace:
    shapes = np.array([shapely.LineString([(k, 0), (k, 1)]) for k in range(len(ids))], object)
    return SimpleNamespace(ids=ids, item=np.array(item, np.int64), geometry=shapes)


def test_the_last_hit_of_the_barrier_that_holds_a_log_is_the_one_that_stopped_it():
    """Log 7 hits net a three times, net b in between, and is held by a, whose second line is the engine's row 2."""
    layers = SimpleNamespace(barriers=items(["a", "b"], [0, 1, 0]))
    logs = SimpleNamespace(log_id=np.array([7, 9]))
    releases = SimpleNamespace(logs=logs, release_id=np.array(["x", "y"]))
    time, item, log_id = np.array([4.0, 1.0, 2.0, 3.0, 1.5]), np.array([2, 0, 2, 1, 0]), np.array([7, 7, 7, 7, 9])
    plain = dict.fromkeys(("duration", "height", "speed", "energy", "angle", "impulse", "energy_taken"), np.ones(5))
    kept = {"time": time, "item": item, "log_id": log_id, "place": np.zeros((5, 3))} | plain
    by_log = {f"hits_barrier_{name}": values for name, values in kept.items()}
    by_log |= {
        "stop_reason": np.array([STOP_REASONS.index("barrier"), STOP_REASONS.index("rest")]),
        "stop_item": np.array([2, -1]),
    }
    frame = barrier_hits_frame(layers, releases, by_log, "EPSG:2056")
    assert frame["t_s"].tolist() == [1.0, 2.0, 3.0, 4.0, 1.5]
    assert frame["barrier_id"].tolist() == ["a", "a", "b", "a", "a"]
    assert frame["stopped"].tolist() == [0, 0, 0, 1, 0]
    by_log["stop_item"] = np.array([1, -1])
    assert barrier_hits_frame(layers, releases, by_log, "EPSG:2056")["stopped"].tolist() == [0, 0, 1, 0, 0]


def test_stops_are_those_of_the_boulder_although_a_lying_log_has_several_lines():
    """Two trees, two lying logs of three lines together, three boulders: each stop by hand, in the engine's rows."""
    reasons = ["block", "lying_log", "lying_log", "tree", "block", "rest", "block"]
    rows = [1, 2, 0, 1, 2, -1, 1]
    solid = SimpleNamespace(diameter=np.ones(3), height=np.ones(3), x=np.arange(3.0), y=np.zeros(3))
    layers = SimpleNamespace(
        tree_ids=["s", "t"],
        lying=items(["l", "m"], [0, 0, 1]),
        blocks=SimpleNamespace(ids=["p", "q", "r"], solid=solid),
    )
    by_log = {"stop_reason": np.array([STOP_REASONS.index(each) for each in reasons]), "stop_item": np.array(rows)}
    empty = np.zeros(0, np.int64)
    names = ("item", "n_logs", "n_hits", "n_broken", "impulse_sum", "impulse_max", "energy_taken")
    by_log |= {f"hits_tree_{name}": empty for name in names}
    blocks = block_hits_frame(layers, by_log, "EPSG:2056")
    assert dict(zip(blocks["block_id"], blocks["n_stops"], strict=True)) == {"q": 2, "r": 1}
    lying = lying_hits_frame(layers, by_log, "EPSG:2056")
    assert dict(zip(lying["lying_id"], lying["n_stops"], strict=True)) == {"l": 1, "m": 1}


def test_a_hit_of_any_line_of_a_lying_log_is_the_logs():
    """Hits by rows of the engine: two trees, three lines of two lying logs, two boulders."""
    layers = SimpleNamespace(
        tree_ids=["s", "t"], lying=items(["l", "m"], [0, 0, 1]), blocks=SimpleNamespace(ids=["p", "q"])
    )
    item = np.array([0, 2, 3, 3, 4, 5, 6, 6])
    values = {name: np.ones(item.size) for name in Hits.__dataclass_fields__}
    values |= {"item": item, "log_row": np.array([0, 0, 0, 1, 1, 2, 2, 2]), "place": np.zeros((item.size, 3))}
    values |= {"by_barrier": np.zeros(item.size, bool), "broke": np.array([0, 0, 0, 1, 0, 0, 0, 0], bool)}
    kept = hit_arrays(Hits(**values), np.arange(3), layers)
    counts = {name: kept[f"hits_tree_{name}"].tolist() for name in ("item", "n_logs", "n_hits", "n_broken")}
    assert counts["item"] == [0, 2, 3, 4, 5]
    assert counts["n_logs"] == [1, 2, 1, 1, 1]
    assert counts["n_hits"] == [1, 3, 1, 1, 2]
    assert counts["n_broken"] == [0, 1, 0, 0, 0]


def test_sums_do_not_depend_on_how_hits_are_split():
    """Impulses whose float sums depend on the order give the same bits."""
    rng = np.random.default_rng(0)
    n = 4000
    values = {name: rng.lognormal(3.0, 3.0, n) for name in Hits.__dataclass_fields__}
    values |= {
        "log_row": np.sort(rng.integers(0, 300, n)),
        "item": rng.integers(0, 5, n),
        "by_barrier": np.zeros(n, bool),
        "broke": rng.random(n) < 0.1,
    }
    values["place"] = np.zeros((n, 3))
    none = SimpleNamespace(ids=[], item=np.zeros(0, np.int64))
    forest = SimpleNamespace(tree_ids=list("abcde"), lying=none, blocks=none)

    def part(rows):
        return hit_arrays(Hits(**{name: column[rows] for name, column in values.items()}), np.arange(300), forest)

    whole = part(np.ones(n, bool))
    parts = [part(values["log_row"] < 150), part(values["log_row"] >= 150)]
    for name in ("n_logs", "n_hits", "n_broken", "impulse_sum", "energy_taken"):
        assert np.array_equal(whole[f"hits_tree_{name}"], sum(each[f"hits_tree_{name}"] for each in parts))
    assert whole["hits_tree_impulse_sum"].sum() == pytest.approx(values["impulse"].sum() * 1000.0, rel=1e-6)


def test_sizes_come_out_as_they_were_given(case, tmp_path):
    """Of 1 to 100 cm, 8 change if they are divided by 100 and multiplied by 100 again: 29 is one."""
    odd = [cm for cm in map(float, range(1, 101)) if 100.0 * (cm / 100.0) != cm]
    assert 29.0 in odd
    places = points(*((20.0 + 20.0 * k / len(odd), 40.0 + 0.5 * (k % 3)) for k in range(len(odd))))
    trees = write_layer(tmp_path / "t.gpkg", places, dbh_cm=odd, height_m=[20.0] * len(odd))
    run = case.run(trees=trees, output=str(tmp_path / "run"))
    hit = layer(run, "tree_hits")
    assert len(hit)
    assert set(hit["dbh_cm"]) <= set(odd)
