"""The scenario and the counts of a summary, compared with the layers from which they come."""

from __future__ import annotations

import json

import numpy as np
import pytest
import rasterio
import shapely
from slope_case import Case, layer, points, summary, write_layer

from deadwood_algorithms.results.scenario import scenario_line

ROAD = shapely.LineString([(0.5, 25.0), (59.5, 25.0)])


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    """The case with a hole of nodata in its flat ground: 2 x 2 m at the place (6, 6)."""
    made = Case(tmp_path_factory.mktemp("case"))
    with rasterio.open(made.dem, "r+") as dem:
        heights = dem.read(1)
        heights[93:95, 5:7] = -9999.0
        dem.write(heights, 1)
    return made


@pytest.fixture(scope="module")
def told(case, tmp_path_factory) -> dict:
    """Every layer with rows that are not used in the run."""
    folder = tmp_path_factory.mktemp("run")
    stems = points((30.0, 50.0), (59.5, 50.0), (20.0, 99.5), (59.9, 50.0), (6.0, 6.0), (200.0, 50.0), (31.0, 45.0))
    trees = write_layer(
        folder / "t.gpkg", stems, dbh_cm=[29.0, 40.0, 40.0, 40.0, 40.0, 40.0, 57.0], height_m=[11.0] * 6 + [23.0]
    )
    stones = points((25.0, 45.0), (25.0, 99.5), (-30.0, 45.0))
    off = shapely.LineString([(10.0, -45.0), (35.0, -45.0)])
    plates = [
        off,
        shapely.LineString([(10.0, 45.0), (35.0, 45.0)]),
        shapely.MultiLineString([[(40.0, 45.0), (45.0, 45.0)], [(59.8, 45.0), (59.9, 46.0)]]),
        shapely.LineString([(59.8, 20.0), (59.9, 22.0)]),
    ]
    logs = {
        "log_id": list(range(8)),
        "dbh_cm": [29.0, 57.0, 58.0, 40.0, 41.0, 42.0, 43.0, 44.0],
        "length_m": [8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0],
        "orientation": ["lying"] * 4 + ["tilted"] * 2 + ["upright"] * 2,
        "tilt_deg": [30.0] * 8,
    }
    run = case.run(
        output=str(folder / "run"),
        releases=write_layer(folder / "r.gpkg", points(*((20.0 + 2.0 * k, 75.0) for k in range(8))), **logs),
        trees=trees,
        blocks=write_layer(folder / "b.gpkg", stones, diameter_m=[1.0, 1.0, 1.0]),
        barriers=write_layer(folder / "p.gpkg", plates, height_m=[9.0, 1.5, 2.5, 3.5], name=list("abcd")),
        lying_logs=write_layer(
            folder / "l.gpkg", [off, shapely.LineString([(45, 60), (50, 60)])], diameter_cm=[70.0, 29.0]
        ),
        lines=write_layer(folder / "w.gpkg", [off, ROAD, shapely.box(10, 5, 30, 15)], line_id=["far", "road", "house"]),
        seed=7,
    )
    return {**summary(run), "hits": layer(run, "deposits")}


def test_every_row_that_was_read_is_used_or_left_out(told):
    counted = told["counted"]
    rows = {"releases": 8, "trees": 7, "barriers": 4, "lying_logs": 2, "blocks": 3, "lines": 3}
    assert {name: count["read"] for name, count in counted.items()} == rows
    for name, count in counted.items():
        assert count["read"] == count["used"] + sum(each["n"] for each in count["left_out"]), name
        assert all(each["n"] > 0 for each in count["left_out"])


def test_why_rows_are_left_out(told):
    """A tree on the last column of cells, or row, stands at the end of the surface: no log can meet it."""
    out = {name: {each["why"]: each["n"] for each in count["left_out"]} for name, count in told["counted"].items()}
    assert out["trees"] == {"off_dem": 1, "no_terrain": 4}
    assert out["blocks"] == {"off_dem": 1, "no_terrain": 1}
    assert out["barriers"] == {"off_dem": 1, "no_terrain": 1}
    assert out["lying_logs"] == out["lines"] == {"off_dem": 1}
    assert out["releases"] == {}
    assert "2 rigid truncated cones; 1 off the DEM left out; 4 left out where" in told["modelled"]["trees"]
    assert "3 rigid thin plates; 1 off the DEM left out; 1 left out where" in told["modelled"]["barriers"]
    assert told["modelled"]["lines"] == "2 watched, as lines or outlines; 1 off the DEM left out"
    assert [each["line_id"] for each in told["reach"]] == ["road", "house"]


def test_the_scenario_has_the_sizes_that_columns_gave_and_not_the_defaults(told):
    scenario = told["scenario"]
    assert scenario["logs"] == {
        "n": 8,
        "length_m": {"median": 11.5, "low": 8.0, "high": 15.0},
        "dbh_cm": {"median": 42.5, "low": 29.0, "high": 58.0},
        "density_kg_m3": {"median": 300.0, "low": 300.0, "high": 300.0},
        "posture": {"upright": 0.25, "lying": 0.5, "tilted": 0.25},
    }
    assert scenario["trees"] == {
        "n": 2,
        "dbh_cm": {"median": 43.0, "low": 29.0, "high": 57.0},
        "height_m": {"median": 17.0, "low": 11.0, "high": 23.0},
    }
    assert scenario["barriers"] == {"n": 2, "height_m": {"median": 2.0, "low": 1.5, "high": 2.5}}
    assert (scenario["lying_logs"]["n"], scenario["blocks"]["n"], scenario["lines"]["n"]) == (1, 1, 2)
    assert (scenario["friction"], scenario["rolling_friction"], scenario["restitution"]) == (0.25, 0.1, 0.0)
    assert scenario["dem"] == {"nx": 60, "ny": 100, "cell_m": 1.0}
    assert (scenario["fidelity"], scenario["seed"]) == ("draft", 7)


def test_a_friction_by_cell_is_reported_by_its_range_to_the_last_digit(case, tmp_path):
    areas = [shapely.box(-5, -5, 65, 60), shapely.box(-5, 60, 65, 105)]
    mu = write_layer(tmp_path / "mu.gpkg", areas, friction=[0.3, 0.7])
    told = summary(case.run(output=str(tmp_path / "run"), friction=mu))
    assert told["scenario"]["friction"] == {"median": 0.3, "low": 0.3, "high": 0.7}
    assert told["scenario"]["trees"] == {"n": 0}
    assert set(told["counted"]) == {"releases"}


def test_logs_that_were_not_run_are_counted(case, tmp_path):
    """With a wide requested interval, a draw of 1100 logs ends at the first check, after 1000."""
    rng = np.random.default_rng(3)
    places = points(*np.column_stack([rng.uniform(10, 50, 1100), rng.uniform(65, 90, 1100)]).tolist())
    releases = write_layer(tmp_path / "r.gpkg", places, log_id=range(1100))
    told = summary(case.run(output=str(tmp_path / "run"), releases=releases, lines=case.lines, until_ci=0.25))
    assert told["logs"]["not_run"] == 100
    count = told["counted"]["releases"]
    assert count["left_out"] == [{"why": "not_run", "n": told["logs"]["not_run"]}]
    assert (count["read"], count["used"]) == (1100, told["logs"]["released"])
    assert told["scenario"]["logs"]["n"] == told["logs"]["released"]


def test_clauses_are_records_of_names_and_numbers(told):
    """The facts of the sentences are stored beside them: no text has to be parsed."""
    facts = told["modelled_facts"]
    assert facts.keys() == told["modelled"].keys()
    assert facts["friction"] == [{"clause": "friction", "mu": 0.25}]
    assert facts["trees"][0] == {"clause": "trees", "n": 2}
    for clauses in facts.values():
        for each in clauses:
            for value in each.values():
                assert isinstance(value, (int, float, list)) or value == each["clause"]
    assert json.loads(json.dumps(facts)) == facts


def test_the_scenario_in_a_line(told):
    assert scenario_line(told["scenario"]) == (
        "scenario: 8 logs, 25 % upright, 50 % lying, 25 % tilted, 11.5 m (8.0 to 15.0) long, DBH 42.5 cm (29.0 to "
        "58.0); friction 0.25, rolling friction 0.1, restitution 0; 2 trees, 2 barriers, 1 lying log, 1 boulder; "
        "60 x 100 cells of 1 m; draft, seed 7"
    )
