"""Lying logs through files: they hold what slides onto them, are counted and named, and bad layers are refused."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas
import pytest
import shapely
from slope_case import NORTH, Case, assert_same_run, layer, points, summary, write_dem, write_layer

from deadwood_algorithms import schemas
from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.results.scenario import scenario_line
from deadwood_algorithms.scene.lying_logs import read_lying_logs, with_more
from deadwood_engine import LyingLogs

ACROSS = [shapely.LineString([(12.0, 50.0), (48.0, 50.0)])]


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def grid(case) -> Grid:
    return read_dem(case.dem, feedback=Quiet())


@pytest.fixture(scope="module")
def held(case) -> Path:
    """24 logs above one long lying log across the slope, and a standing tree that no log meets."""
    tree = write_layer(case.folder / "tree.gpkg", points((2.0, 95.0)), tree_id=[77], dbh_cm=[30.0], height_m=[10.0])
    lying = write_layer(case.folder / "lying.gpkg", ACROSS, lying_id=["old spruce"], diameter_cm=[150.0])
    logs = {"orientation": "lying", "azimuth_deg": 90.0}
    return case.run(lying_logs=lying, trees=tree, output=str(case.folder / "held"), threads=1, **logs)


def test_it_holds_logs_and_reports_it(held):
    deposits, hits, told = layer(held, "deposits"), layer(held, "lying_hits"), summary(held)
    stopped = deposits["stop_reason"] == "lying_log"
    assert stopped.sum() > 15
    assert set(deposits.loc[stopped, "stop_id"]) == {"lying:old spruce"}
    assert hits["lying_id"].tolist() == ["old spruce"]
    assert hits["n_stops"][0] == stopped.sum()
    assert hits["n_logs"][0] == (deposits["tree_hits"] > 0).sum() >= stopped.sum()
    assert hits.geometry[0].length == pytest.approx(36.0)
    assert [each.name for each in schemas.LAYERS["lying_hits"].columns] == [c for c in hits.columns if c != "geometry"]
    assert told["modelled"]["lying_logs"] == "1 rigid truncated cones at rest on the terrain, in 1 straight pieces"
    assert told["lying_logs"]["n_stops"] == stopped.sum()
    assert told["trees"]["n_hits"] == 0
    assert "tree_hits" not in set(gpd.list_layers(held / "run.gpkg")["name"])


@pytest.mark.parametrize("share", [0.25, 0.9, 1.1, None])
def test_one_with_a_capacity_takes_it_and_no_more(tmp_path, share):
    """End-on at a thick lying log across the way, on level ground without friction or rebound: with less than the
    energy E that arrives, C, it breaks and E - C goes on; with more, or rigid, it holds the log.

    E is m v^2 / 2 of the start, to the last digit of the run without it; the engine keeps E - C to 1 % of E (its own
    test of a log broadside), and the speed is half as sensitive.
    """
    case = Case(tmp_path / "case")
    start = write_layer(tmp_path / "one.gpkg", points((30.0, 20.0)), log_id=[1])
    given = {"dem": write_dem(tmp_path / "flat.tif", flat=True), "releases": start, "friction": "0",
             "time_limit_s": 3.0, "rolling_friction": 0.0, "fidelity": "standard", "orientation": "lying",
             "speed_ms": 12.0}  # fmt: skip
    energy = layer(case.run(output=str(tmp_path / "free"), **given), "deposits")["energy_max_kj"][0]
    capacity = {} if share is None else {"capacity_kj": [share * energy]}
    across = [shapely.LineString([(20.0, 35.0), (40.0, 35.0)])]
    thick = {"lying_id": ["a"], "diameter_cm": [200.0], "tip_diameter_cm": [200.0]}
    lying = write_layer(tmp_path / "lying.gpkg", across, **thick, **capacity)
    run = case.run(output=str(tmp_path / "run"), lying_logs=lying, **given)
    hits, told = layer(run, "lying_hits"), summary(run)
    breaks = share is not None and share < 1.0
    assert hits["n_broken"].sum() == told["lying_logs"]["n_broken"] == int(breaks)
    last = pandas.read_parquet(run / "poses.parquet").iloc[-1]
    kept = 1.0 - share if share is not None and breaks else 0.0
    assert last["speed_ms"] ** 2 / 144.0 == pytest.approx(kept, abs=0.02)
    assert hits["energy_taken_kj"][0] / energy == pytest.approx(share if breaks else 1.0, abs=0.02)
    assert (last["y"] > NORTH + 36.0) == breaks
    weak = told["scenario"]["lying_logs"].get("capacity_kj")
    assert weak == (None if share is None else dict.fromkeys(("median", "low", "high"), share * energy))
    assert ("1 of them break" in told["modelled"]["lying_logs"]) == (share is not None)
    assert ("lying logs break (" in scenario_line(told["scenario"])) == (share is not None)


def test_a_log_of_several_lines_that_breaks_is_counted_once(case, tmp_path):
    """Three lines of one log, one off the DEM, a rigid one, one of several vertices: 2 break, those of 5 and 9 kJ."""
    shapes = [
        shapely.LineString([(12.0, 50.0), (20.0, 50.0)]),
        shapely.LineString([(21.0, 50.0), (30.0, 51.0)]),
        shapely.LineString([(900.0, 50.0), (910.0, 50.0)]),
        shapely.LineString([(12.0, 60.0), (48.0, 60.0)]),
        shapely.LineString([(12.0, 70.0), (20.0, 71.0), (30.0, 70.0), (36.0, 72.0)]),
        shapely.LineString([(900.0, 70.0), (910.0, 70.0)]),
    ]
    rows = {"lying_id": ["a", "a", "a", "b", "c", "d"], "capacity_kj": [5.0, 5.0, 1.0, np.nan, 9.0, 2.0]}
    lying = write_layer(tmp_path / "l.gpkg", shapes, diameter_cm=[40.0] * 6, **rows)
    told = summary(case.run(output=str(tmp_path / "run"), lying_logs=lying, threads=1))
    assert "2 of them break" in told["modelled"]["lying_logs"]
    assert told["scenario"]["lying_logs"]["n"] == 3
    assert told["scenario"]["lying_logs"]["capacity_kj"] == {"median": 7.0, "low": 5.0, "high": 9.0}


def test_a_capacity_of_nothing_is_refused_and_a_gap_is_rigid(tmp_path, grid):
    two = [shapely.LineString([(12.0, v), (48.0, v)]) for v in (50.0, 60.0)]
    lying = write_layer(tmp_path / "l.gpkg", two, diameter_cm=[40.0, 40.0], capacity_kj=[3.0, np.nan])
    assert read_lying_logs(lying, grid, 40.0, Quiet())[0].capacity == pytest.approx([3000.0, np.inf])
    lying = write_layer(tmp_path / "m.gpkg", two, diameter_cm=[40.0, 40.0], capacity_kj=[3.0, 0.0])
    with pytest.raises(UserError, match="field 'capacity_kj', row 2"):
        read_lying_logs(lying, grid, 40.0, Quiet())


def test_logs_added_to_those_that_break_are_rigid():
    ends = np.array([[0.0, 0.0], [5.0, 0.0]])
    plain = LyingLogs(ends, np.array([0, 2]), np.array([0.4]), np.array([0.2]))
    assert with_more(plain, plain).capacity is None
    both = with_more(plain._replace(capacity=np.array([5.0])), plain)
    assert both.capacity == pytest.approx([5.0, np.inf])
    assert both.starts.tolist() == [0, 2, 4]


def test_without_it_they_continue(case, held):
    logs = {"orientation": "lying", "azimuth_deg": 90.0}
    free = case.run(output=str(case.folder / "free"), **logs)
    assert layer(free, "deposits")["runout_m"].median() > layer(held, "deposits")["runout_m"].median() + 10.0
    assert summary(free)["modelled"]["lying_logs"].startswith("not modelled")
    assert summary(free)["lying_logs"] is None


def test_threads_do_not_change_a_bit(case, held, tmp_path):
    logs = {"orientation": "lying", "azimuth_deg": 90.0}
    files = {"lying_logs": str(case.folder / "lying.gpkg"), "trees": str(case.folder / "tree.gpkg")}
    again = case.run(output=str(tmp_path / "again"), threads=4, **files, **logs)
    assert_same_run(held, again)
    assert layer(held, "lying_hits").equals(layer(again, "lying_hits"))


def test_diameters_come_from_the_column_the_other_column_or_the_option(tmp_path, grid):
    two = [*ACROSS, shapely.LineString([(10, 60), (20, 61), (25, 70)])]

    def read(name: str, **columns):
        path = write_layer(tmp_path / f"{name}.gpkg", two, **columns)
        return read_lying_logs(path, grid, 40.0, Quiet())

    lying, items = read("own", diameter_cm=[50.0, 60.0], tip_diameter_cm=[20.0, 60.0], dbh_cm=[1.0, 1.0])
    assert lying.diameter.tolist() == [0.5, 0.6]
    assert lying.tip_diameter.tolist() == [0.2, 0.6]
    assert items.ids == [1, 2]
    lying, items = read("dbh", dbh_cm=[30.0, 80.0], tree_id=["a", "b"])
    assert lying.diameter.tolist() == [0.3, 0.8]
    assert lying.tip_diameter.tolist() == [0.15, 0.4]
    assert items.ids == ["a", "b"]
    lying, _ = read("none", species=["x", "y"])
    assert lying.diameter.tolist() == [0.4, 0.4]
    assert np.diff(lying.starts).tolist() == [2, 3]


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"diameter_cm": [0.0]}, "field 'diameter_cm', row 1: 0 is not a number greater than 0"),
        ({"diameter_cm": ["thick"]}, "field 'diameter_cm', row 1: 'thick' is not a number"),
        (
            {"diameter_cm": [20.0], "tip_diameter_cm": [60.0]},
            "field 'tip_diameter_cm', row 1: the tip is more than twice",
        ),
    ],
)
def test_a_bad_diameter_is_named(tmp_path, grid, columns, message):
    path = write_layer(tmp_path / "bad.gpkg", ACROSS, **columns)
    with pytest.raises(UserError, match=message) as error:
        read_lying_logs(path, grid, 40.0, Quiet())
    assert "\n" not in str(error.value)


def test_off_the_dem_or_no_line_is_refused(tmp_path, grid):
    off = write_layer(tmp_path / "off.gpkg", [shapely.LineString([(500, 500), (510, 500)])])
    with pytest.raises(UserError, match="'off': no lying log touches the DEM"):
        read_lying_logs(off, grid, 40.0, Quiet())
    dots = write_layer(tmp_path / "dots.gpkg", points((20, 20)))
    with pytest.raises(UserError, match="row 1: a Point, but the lying_logs must be lines"):
        read_lying_logs(dots, grid, 40.0, Quiet())


def test_diameters_in_metres_are_warned_of(tmp_path, grid, said):
    path = write_layer(tmp_path / "m.gpkg", ACROSS, diameter_cm=[0.5])
    read_lying_logs(path, grid, 40.0, said)
    assert any("multiply by 100" in each for each in said.warnings)
