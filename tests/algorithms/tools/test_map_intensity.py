"""map-intensity cell by cell and line by line compared with counts by hand."""

from __future__ import annotations

import json
from pathlib import Path
from statistics import NormalDist
from typing import Any
from xml.etree import ElementTree

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import rasterio
import shapely
from hand_run import Track, write_run
from slope_case import EAST, LENGTH, NORTH, WIDTH, Case, layer, points, raster, write_layer

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.stats.statistics import wilson_interval
from deadwood_algorithms.tools import map_intensity
from deadwood_engine.log_body import MASS, cone_bodies

N = 50
ROAD = shapely.LineString([(0.5, 50.0), (59.5, 50.0)])


def fields(seed: int = 2) -> dict[str, np.ndarray]:
    """Hits of up to 50 logs in a corner of the grid, and energies on either side of every bound."""
    rng = np.random.default_rng(seed)
    hits = np.zeros((LENGTH, WIDTH), np.uint32)
    hits[20:70, 10:40] = rng.integers(0, N + 1, (50, 30)) * (rng.random((50, 30)) < 0.6)
    energy = np.where(hits > 0, rng.choice([5.0, 30.0, 299.0, 300.0, 2000.0], hits.shape), np.nan).astype(np.float32)
    return {"hit_count": hits, "energy_max": energy}


def tracks(count: int = N, **more: Any) -> list[Track]:
    return [Track((20.0, 70.0), (20.0, 30.0), speed=1.0 + k, **more) for k in range(count)]


@pytest.fixture
def made(tmp_path) -> Path:
    lines = {"road": (ROAD, list(range(20))), "far": (shapely.LineString([(1.0, 5.0), (9.0, 5.0)]), [])}
    return write_run(tmp_path / "run", tracks(), lines=lines, rasters=fields())


def maps(run: Path, folder: Path, **values: Any) -> dict[str, np.ndarray]:
    """From the run's rasters, which here are not those of its tracks, unless another least passage is given."""
    map_intensity.TOOL(**{"run": str(run), "output": str(folder), "overwrite": True, "least_passage": 0.0} | values)
    return {each.stem: raster(each)[::-1] for each in folder.glob("*.tif")}


def layer_rows(path: Path) -> list[Any]:
    return list(gpd.read_file(path).itertuples())


def table(folder: Path) -> Any:
    return pd.read_csv(folder / "lines.csv", encoding="utf-8-sig").set_index(["line_id", "at_least_kj"]).sort_index()


def whole(values: np.ndarray) -> np.ndarray:
    assert values.shape == (LENGTH, WIDTH)
    return values


def test_every_cell_has_the_classes_of_its_numbers(made, tmp_path):
    found, given = maps(made, tmp_path / "m"), fields()
    assert set(found) == {"intensity", "passage", "matrix"}
    for row, column in np.ndindex(LENGTH, WIDTH):
        hits, energy = int(given["hit_count"][row, column]), float(given["energy_max"][row, column])
        strong = 0 if not hits else 1 if energy < 30.0 else 2 if energy < 300.0 else 3
        share = 100.0 * hits / N
        often = 0 if not hits else 1 if share < 0.1 else 2 if share < 1.0 else 3 if share < 10.0 else 4
        assert whole(found["intensity"])[row, column] == strong
        assert found["passage"][row, column] == often
        assert found["matrix"][row, column] == (10 * strong + often if hits else 0)


CORRIDOR = 6.0  # standard deviation of where the tracks run [m]
HEAVY = 0.12  # share of the logs that bring 300 kJ


def passages(folder: Path, count: int) -> Path:
    """Straight tracks side by side, normally spread about u = 30 m, a share of them fast."""
    rng = np.random.default_rng(count)
    places = rng.normal(30.0, CORRIDOR, count).clip(1.0, 59.0)
    mass = float(cone_bodies(np.array([0.4]), np.array([4.0]), np.array([300.0]))[0, MASS])
    speeds = np.sqrt(2.0 * 1000.0 * np.where(rng.random(count) < HEAVY, 350.0, 100.0) / mass)
    ways = [Track((u, 80.0), (u, 20.0), speed=v, spacing=100.0) for u, v in zip(places, speeds, strict=True)]
    hits = np.zeros((LENGTH, WIDTH), np.uint32)
    hits[15:85] = 1
    rasters = {"hit_count": hits, "energy_max": np.where(hits > 0, 350.0, np.nan).astype(np.float32)}
    return write_run(folder, ways, rasters=rasters)


def heavy_cells(least: float) -> int:
    """Cells across the corridor that at least this share of all logs pass with 300 kJ, from the normal law."""
    law = NormalDist(30.0, CORRIDOR)
    share = [HEAVY * (law.cdf(k + 1.2) - law.cdf(k - 0.2)) for k in range(WIDTH)]  # the base's radius is 0.2 m
    return sum(each >= least for each in share)


def rows_of(folder: Path, name: str) -> list[dict[str, Any]]:
    facts = json.loads((folder / "classes.json").read_text())
    return [each for each in facts["classes"] if each["map"] == name]


def test_areas_do_not_grow_with_the_number_of_logs(tmp_path):
    """With 500, 2000 and 8000 logs the interval of the area contains the truth; that of the largest energies grows."""
    areas, largest = [], []
    for count in (500, 2000, 8000):
        run = passages(tmp_path / f"run{count}", count)
        maps(run, tmp_path / f"m{count}", least_passage=0.5)
        row = rows_of(tmp_path / f"m{count}", "intensity")[2]
        areas.append((row["at_least_ci_low_m2"], row["at_least_ci_high_m2"]))
        assert row["at_least_m2"] is row["area_m2"] is None, "they need 19 112 logs"
        assert row["n_needed"] == 19112  # 1.96² (1 - p) / (p 0.2²)
        every = maps(run, tmp_path / f"e{count}", least_passage=100.0 / count)["intensity"]  # one log: the maximum
        largest.append(int((every == 3).sum()))
    true = 60.0 * heavy_cells(0.005)  # and 4 rows at the ends, which are touched by a part of a log's width
    for low, high in areas:
        assert low <= 64.0 / 60.0 * true
        assert true <= high
    widths = [high - low for low, high in areas]
    assert widths[0] > widths[1] > widths[2]
    assert largest[0] < 0.95 * largest[1] < 0.95**2 * largest[2]


def test_the_largest_energies_have_no_area(tmp_path):
    """Their ground grows with every log: from 500 and 8000 logs none is stated, and no number of logs supports one."""
    for count in (500, 8000):
        maps(passages(tmp_path / f"run{count}", count), tmp_path / f"m{count}", least_passage=0.0)
        strong = [each for each in rows_of(tmp_path / f"m{count}", "intensity") if each["cells"]]
        assert strong
        for row in strong:
            assert row["area_m2"] is row["at_least_m2"] is row["n_needed"] is None
        both = [each for each in rows_of(tmp_path / f"m{count}", "matrix") if each["cells"]]
        assert {each["area_m2"] for each in both} == {None}, "a pair is no rarer than its intensity"
    said = map_intensity.TOOL(run=str(tmp_path / "run500"), output=str(tmp_path / "said"), least_passage=0.0).lines
    assert any(each.startswith("intensity, ") and "its area grows with every log" in each for each in said)


def test_only_the_areas_of_frequent_classes_are_stated(tmp_path):
    """Of the classes below 0.1, from 0.1, 1 and 10 % of the logs, 2000 support the last alone: it needs 865."""
    maps(passages(tmp_path / "run", 2000), tmp_path / "m")
    rows = rows_of(tmp_path / "m", "passage")
    assert [row["n_needed"] for row in rows] == [None, 95941, 9508, 865]  # 1.96² (1 - p) / (p 0.2²)
    assert [row["area_m2"] is not None for row in rows] == [False, False, False, True]
    law = NormalDist(30.0, CORRIDOR)
    true = 60.0 * sum(law.cdf(k + 1.2) - law.cdf(k - 0.2) >= 0.1 for k in range(WIDTH))
    assert rows[3]["area_m2"] == pytest.approx(true, rel=0.15)  # a column of cells either side, and 4 rows at the ends


def test_the_area_of_a_class_does_not_depend_on_the_number_of_logs_where_it_is_stated(tmp_path):
    """Where 5 % of the logs pass, with any energy: stated from 1825 logs, and then right; not from 500."""
    law = NormalDist(30.0, CORRIDOR)
    true = 60.0 * sum(law.cdf(k + 1.2) - law.cdf(k - 0.2) >= 0.05 for k in range(WIDTH))
    for count in (500, 2000, 8000):
        maps(passages(tmp_path / f"run{count}", count), tmp_path / f"m{count}", least_passage=5.0)
        row = rows_of(tmp_path / f"m{count}", "intensity")[1]
        assert row["n_needed"] == 1825
        if count < 1825:
            assert row["at_least_m2"] is None
        else:
            assert row["at_least_m2"] == pytest.approx(true, rel=0.15)  # 2 cells of width, and 4 rows at the ends


SCENARIOS = (30.0, 100.0, 300.0)


def lane(folder: Path, *, count: int = 200) -> Path:
    """One lane of logs across the road: most slow, some of 100 kJ, few of 1000 kJ."""
    mass = float(cone_bodies(np.array([0.4]), np.array([4.0]), np.array([300.0]))[0, MASS])
    energies = np.full(count, 10.0)
    energies[: count // 5], energies[: count // 25] = 100.0, 1000.0
    ways = [Track((20.0, 70.0), (20.0, 30.0), speed=float(np.sqrt(2000.0 * each / mass))) for each in energies]
    hits = np.zeros((LENGTH, WIDTH), np.uint32)
    hits[32:68, 20] = count
    return write_run(
        folder, ways, rasters={"hit_count": hits, "energy_max": np.where(hits > 0, 1.0, np.nan).astype("f4")}
    )


def test_the_intensities_of_scenarios_are_those_of_the_lines(tmp_path):
    """Before, the matrix paired what 1 % bring (300 kJ and more) with any passage (every 10 years)."""
    across = write_layer(tmp_path / "l.gpkg", [shapely.LineString([(0.5, 50.0), (59.5, 50.0)])], line_id=["across"])
    found = maps(lane(tmp_path / "run"), tmp_path / "m", events_per_year=0.1, lines=across, least_passage=1.0)
    rows = table(tmp_path / "m").loc["across"]["return_period_years"]
    assert rows.tolist() == pytest.approx([10.0, 50.0, 250.0])  # 0.1 a year times all, a fifth, a 25th
    expected = {scenario: int((rows <= scenario).sum()) for scenario in SCENARIOS}
    assert expected == {30.0: 1, 100.0: 2, 300.0: 3}
    for scenario, strong in expected.items():
        assert found[f"intensity_{scenario:g}_years"][50, 20] == strong
    assert (found["intensity"][50, 20], found["return_class"][50, 20]) == (3, 1)
    assert found["matrix"][50, 20] == 33, "strong in 300 years, not in 30"


@pytest.mark.parametrize("logs_per_event", [1, 3])
def test_scenarios_of_areas_of_unlike_frequency_are_those_of_the_lines(tmp_path, logs_per_event):
    """Two areas in one lane, one with few and heavy events: the map has what the lines have."""
    mass = float(cone_bodies(np.array([0.4]), np.array([4.0]), np.array([300.0]))[0, MASS])
    ways = []
    for name, energies in (("often", [10.0] * 50 + [50.0] * 10), ("rare", [50.0] * 20 + [900.0] * 10)):
        for each in energies:
            ways.append(Track((20.0, 70.0), (20.0, 30.0), speed=float(np.sqrt(2000.0 * each / mass)), release_id=name))
    hits = np.zeros((LENGTH, WIDTH), np.uint32)
    hits[32:68, 20] = len(ways)
    given = {"hit_count": hits, "energy_max": np.where(hits > 0, 1.0, np.nan).astype(np.float32)}
    run = write_run(tmp_path / "run", ways, rasters=given)
    areas = write_layer(
        tmp_path / "a.gpkg",
        points((10.0, 70.0), (40.0, 70.0)),
        release_id=["often", "rare"],
        events_per_year=[0.1, 0.01],
    )
    across = write_layer(tmp_path / "l.gpkg", [shapely.LineString([(0.5, 50.0), (59.5, 50.0)])], line_id=["across"])
    found = maps(run, tmp_path / "m", releases=areas, lines=across, logs_per_event=logs_per_event)
    rows = table(tmp_path / "m").loc["across"]["return_period_years"]
    share = {"often": [1.0, 1 / 6, 0.0], "rare": [1.0, 1.0, 1 / 3]}
    by_hand = [
        1.0
        / sum(
            rate * (1.0 - (1.0 - share[name][k]) ** logs_per_event) for name, rate in (("often", 0.1), ("rare", 0.01))
        )
        for k in range(3)
    ]
    assert rows.tolist() == pytest.approx(by_hand)
    for scenario in SCENARIOS:
        assert found[f"intensity_{scenario:g}_years"][50, 20] == (rows <= scenario).sum()


@pytest.mark.parametrize(("least", "logs"), [(0.0, 1), (10.0, 5)])
def test_the_process_area_is_the_outline_of_the_ground_that_this_number_of_logs_pass(made, tmp_path, least, logs):
    maps(made, tmp_path / "m", least_passage=least)
    (row,) = layer_rows(tmp_path / "m" / "process_area.gpkg")
    here = fields()["hit_count"] >= logs
    assert (row.least_p, row.n_logs) == (pytest.approx(least / 100.0), N)
    assert row.geometry.area == here.sum()
    assert np.isnan(row.area_m2), f"{N} logs do not support an area"
    v, u = np.indices(here.shape)
    inside = shapely.contains_xy(row.geometry, EAST + u.ravel() + 0.5, NORTH + v.ravel() + 0.5)
    assert np.array_equal(inside.reshape(here.shape), here)


def test_a_cell_has_the_energy_that_this_number_of_its_logs_bring(tmp_path):
    """50 tracks in one lane of speeds 1 to 50 m/s; 10 % of the logs are the five fastest."""
    hits = np.zeros((LENGTH, WIDTH), np.uint32)
    hits[25:75, 18:23] = N
    rasters = {"hit_count": hits, "energy_max": np.where(hits > 0, 1.0, np.nan).astype(np.float32)}
    run = write_run(tmp_path / "run", tracks(), rasters=rasters)
    mass = float(cone_bodies(np.array([0.4]), np.array([4.0]), np.array([300.0]))[0, MASS])
    fifth = 0.5 * mass * 46.0**2 / 1000.0
    bounds = (0.999 * fifth, 1.001 * fifth)
    found = maps(run, tmp_path / "m", least_passage=10.0, energy_classes_kj=bounds)["intensity"]
    assert set(np.unique(found)) == {0, 2}
    facts = json.loads((tmp_path / "m" / "classes.json").read_text())["least_passage"]
    low, high = ([wilson_interval(k, N)[end] for k in range(N + 1)] for end in (0, 1))
    assert facts == {
        "share": 0.1,
        "n_logs": N,
        "logs": 5,
        "logs_sure": next(k for k in range(N) if low[k] >= 0.1),
        "logs_possible": next(k for k in range(N) if high[k] >= 0.1),
    }


def test_without_trajectories_it_is_the_largest_energy_and_reported(tmp_path, said):
    case = Case(tmp_path / "case")
    run = case.run(trajectories="none")
    map_intensity.TOOL(feedback=said, run=str(run), least_passage=10.0, output=str(tmp_path / "m"))
    assert any("largest of all logs, which grows with the number of logs" in each for each in said.warnings)
    assert any("24 logs do not show whether 10 % of the logs pass" in each for each in said.warnings)
    hits = raster(run / "hit_count.tif")
    assert ((raster(tmp_path / "m" / "intensity.tif") > 0) == (hits >= 3)).all()  # 10 % of 24 logs


def test_return_periods_of_one_area_are_those_of_the_shares(made, tmp_path):
    found, hits = maps(made, tmp_path / "m", events_per_year=0.2), fields()["hit_count"]
    with rasterio.open(tmp_path / "m" / "return_period.tif") as source:
        years, low, high = (band[::-1] for band in source.read())
        assert source.descriptions == ("return_period", "ci_low", "ci_high")
    assert np.isnan(years[hits == 0]).all()
    for row, column in np.argwhere(hits > 0)[::37]:
        count = int(hits[row, column])
        bottom, top = wilson_interval(count, N)
        assert years[row, column] == pytest.approx(N / (0.2 * count), rel=1e-6)
        assert (low[row, column], high[row, column]) == pytest.approx((1 / (0.2 * top), 1 / (0.2 * bottom)), rel=1e-6)
    with np.errstate(divide="ignore"):
        exact = np.where(hits > 0, N / (0.2 * hits), np.nan)
    expected = np.select([hits == 0, exact <= 30, exact <= 100, exact <= 300], [0, 1, 2, 3], 4)
    assert np.array_equal(found["return_class"], expected)
    stack = np.stack([found[f"intensity_{each:g}_years"] for each in SCENARIOS]).astype(int)
    for row, column in np.ndindex(LENGTH, WIDTH):
        strong = stack[:, row, column]
        first = int(np.flatnonzero(strong == strong.max())[0]) + 1
        assert found["matrix"][row, column] == (10 * strong.max() + first if strong.max() else 0)


def test_the_ground_of_each_class_and_what_an_empty_cell_means(made, tmp_path):
    found = maps(made, tmp_path / "m", events_per_year=0.2)
    facts = json.loads((tmp_path / "m" / "classes.json").read_text())
    for each in facts["classes"]:
        assert each["cells"] == (found[each["map"]] == each["class"]).sum()
        supported = each["n_needed"] is not None and each["n_needed"] <= N
        assert each["area_m2"] == (each["cells"] if supported else None)
        if each["map"] == "intensity":
            assert each["at_least_m2"] is each["at_least_ci_low_m2"] is each["at_least_ci_high_m2"] is None
    top = wilson_interval(0, N)[1]
    assert facts["no_hit"] == {"p_high": top, "return_ci_low_years": pytest.approx(1.0 / (0.2 * top))}
    assert "Swiss federal" in facts["rule"]
    assert "an expert decides" in facts["decides"]


def test_colours_stand_in_the_file_and_beside_it(made, tmp_path):
    maps(made, tmp_path / "m")
    with rasterio.open(tmp_path / "m" / "intensity.tif") as source:
        assert source.nodata == 0
        assert source.colorinterp[0] == rasterio.enums.ColorInterp.palette
        inside = source.colormap(1)
    style = (tmp_path / "m" / "intensity.qml").read_text(encoding="utf-8")
    entries = list(ElementTree.fromstring(style.partition("\n")[2]).iter("paletteEntry"))
    assert [each.get("label") for each in entries] == ["below 30 kJ", "30 to 300 kJ", "300 kJ and more"]
    for each in entries:
        colour = bytes.fromhex(str(each.get("color"))[1:])
        assert inside[int(each.get("value", ""))] == (*colour, 255)


def test_areas_of_unlike_frequency_are_counted_apart(tmp_path):
    """One lane each, and a cell that both pass: one event in 2 years from the rare area, all from the frequent one."""
    ways = [Track((10.0, 70.0), (10.0, 30.0), release_id="a")] * 3 + [
        Track((10.0, 70.0), (10.0, 50.0), release_id="b"),
        Track((40.0, 70.0), (40.0, 30.0), release_id="b"),
    ]
    hits = np.zeros((LENGTH, WIDTH), np.uint32)
    hits[25:75, 5:45] = 1
    given = {"hit_count": hits, "energy_max": np.where(hits > 0, 10.0, np.nan).astype(np.float32)}
    run = write_run(tmp_path / "run", ways, rasters=given)
    areas = write_layer(
        tmp_path / "areas.gpkg", points((10.0, 70.0), (40.0, 70.0)), release_id=["a", "b"], events_per_year=[0.5, 0.02]
    )
    maps(run, tmp_path / "m", releases=areas)
    years = raster(tmp_path / "m" / "return_period.tif")[::-1]
    assert years[60, 10] == pytest.approx(1.0 / (0.5 * 3 / 3 + 0.02 * 1 / 2), rel=1e-6)
    assert years[35, 10] == pytest.approx(1.0 / 0.5, rel=1e-6)
    assert years[40, 40] == pytest.approx(1.0 / (0.02 / 2), rel=1e-6)
    assert np.isnan(years[50, 25])
    maps(run, tmp_path / "e", releases=areas, logs_per_event=2)
    years = raster(tmp_path / "e" / "return_period.tif")[::-1]
    assert years[40, 40] == pytest.approx(1.0 / (0.02 * 0.75), rel=1e-6)


def test_a_column_of_the_runs_own_releases_may_say_it(tmp_path):
    own = write_layer(tmp_path / "r.gpkg", points((20.0, 70.0), (20.0, 71.0)), release_id=[1, 1], rate=[0.2, 0.2])
    run = write_run(tmp_path / "run", tracks(), rasters=fields(), parameters={"releases": own})
    by_column, by_number = (
        maps(run, tmp_path / name, **how)
        for name, how in (("a", {"events_field": "rate"}), ("b", {"events_per_year": 0.2}))
    )
    assert all(np.array_equal(by_column[name], by_number[name], equal_nan=True) for name in by_number)


def test_lines_by_energy_with_their_return_periods(made, tmp_path):
    maps(made, tmp_path / "m", events_per_year=0.2, energy_classes_kj=(10.0, 100.0))
    found = table(tmp_path / "m")
    mass = float(cone_bodies(np.array([0.4]), np.array([4.0]), np.array([300.0]))[0, MASS])
    energy = 0.5 * mass * (1.0 + np.arange(N)) ** 2 / 1000.0
    for bound, count in ((0.0, 20), (10.0, (energy >= 10.0).sum()), (100.0, (energy >= 100.0).sum())):
        row = found.loc[("road", bound)]
        low, high = wilson_interval(int(count), N)
        assert (row["n_reach"], row["n_total"]) == (count, N)
        assert (row["ci_low"], row["ci_high"]) == pytest.approx((low, high))
        assert row["return_period_years"] == pytest.approx(N / (0.2 * count))
        assert (row["return_ci_low_years"], row["return_ci_high_years"]) == pytest.approx(
            (1 / (0.2 * high), 1 / (0.2 * low))
        )
    empty = found.loc[("far", 0.0)]
    assert empty["n_reach"] == 0
    assert np.isnan(empty["return_period_years"])
    assert empty["return_ci_low_years"] == pytest.approx(1.0 / (0.2 * wilson_interval(0, N)[1]))
    assert empty["return_class"] == 0
    assert "no log" in empty["note"]


def test_other_energies_and_other_lines(made, tmp_path):
    from hand_run import write_values

    grid = json.loads((made / "manifest.json").read_text())["grid"]
    write_values(tmp_path / "e95.tif", np.full((LENGTH, WIDTH), 31.0, np.float32), grid)
    across = write_layer(tmp_path / "l.gpkg", [shapely.LineString([(0.5, 40.0), (59.5, 40.0)])], line_id=["mine"])
    found = maps(made, tmp_path / "m", energy_raster=str(tmp_path / "e95.tif"), lines=across)
    assert set(np.unique(found["intensity"])) == {0, 2}
    rows = table(tmp_path / "m")
    assert set(rows.index.get_level_values(0)) == {"mine"}
    assert rows.loc[("mine", 0.0), "n_reach"] == N


def test_on_a_run_of_the_engine(tmp_path, said):
    """Two areas with equal numbers of logs: their rate is that of all logs, with trajectories and without."""
    case = Case(tmp_path / "case")
    run = case.run(lines=case.lines, trajectories="none")
    found = maps(run, tmp_path / "m", events_per_year=0.1)
    hits = raster(run / "hit_count.tif")[::-1]
    years = raster(tmp_path / "m" / "return_period.tif")[::-1]
    assert np.allclose(years[hits > 0], 24 / (0.2 * hits[hits > 0]), rtol=1e-6)
    assert (found["intensity"] > 0).sum() == (hits > 0).sum()
    assert "matrix" not in found, "it says of every cell that no hazard is there"
    rows = table(tmp_path / "m")
    reach = layer(run, "reach").set_index("line_id")["n_reach"]
    assert rows.loc[("road", 0.0), "n_reach"] == reach["road"]
    assert np.isnan(rows.loc[("road", 30.0), "n_reach"])
    assert "--trajectories all" in rows.loc[("road", 30.0), "note"]
    map_intensity.TOOL(feedback=said, run=str(run), events_per_year=0.1, output=str(tmp_path / "w"))
    assert any("24 logs are too few to decide; about " in each for each in said.warnings)


REFUSED = {
    "--energy-classes-kj is '300,30'": {"energy_classes_kj": "300,30"},
    "--probability-classes is 200 %, but must be less than 100 %": {"probability_classes": "1,200"},
    "--return-periods-years is 'x'": {"return_periods_years": "x"},
    "leave out --releases and --events-field": {"events_per_year": 1.0, "events_field": "rate"},
    "the run's releases were moved or deleted; name them with --releases": {"events_field": "rate"},
    "--events-per-year is 0, but must be greater than 0": {"events_per_year": 0.0},
}


@pytest.mark.parametrize("line", REFUSED)
def test_wrong_options_are_refused_in_a_line(made, tmp_path, line):
    with pytest.raises(UserError, match=line):
        map_intensity.TOOL(run=str(made), output=str(tmp_path / "m"), **REFUSED[line])
    assert not (tmp_path / "m").exists()


WRONG = {
    "release area '1' of the run is not there": {"release_id": ["x", "y"], "events_per_year": [1.0, 1.0]},
    "row 2: 2 for release area '1', but 1 in an earlier row": {"release_id": [1, 1], "events_per_year": [1.0, 2.0]},
    "field 'events_per_year', row 2: -1 is not a number at least 0": {
        "release_id": [1, 2],
        "events_per_year": [1.0, -1.0],
    },
    "no release area has any event": {"release_id": [1, 2], "events_per_year": [0.0, 0.0]},
    "the field 'events_per_year' is missing": {"release_id": [1, 2], "rate": [0.0, 0.0]},
}


@pytest.mark.parametrize("line", WRONG)
def test_wrong_frequencies_are_refused_in_a_line(made, tmp_path, line):
    given = write_layer(tmp_path / "r.gpkg", points((20.0, 70.0), (20.0, 71.0)), **WRONG[line])
    with pytest.raises(UserError, match=line):
        map_intensity.TOOL(run=str(made), releases=given, output=str(tmp_path / "m"))


def test_unlike_areas_need_trajectories(tmp_path):
    case = Case(tmp_path / "case")
    run = case.run(trajectories="none")
    areas = write_layer(
        tmp_path / "a.gpkg", points((20.0, 70.0), (40.0, 70.0)), release_id=["a", "b"], events_per_year=[0.5, 0.02]
    )
    with pytest.raises(UserError, match="release area 'a' has no stored trajectory.*--trajectories all"):
        map_intensity.TOOL(run=str(run), releases=areas, output=str(tmp_path / "m"))


def test_a_run_without_its_rasters_or_without_passages_is_refused(tmp_path):
    bare = write_run(tmp_path / "bare", tracks(3))
    with pytest.raises(UserError, match=r"has no hit_count\.tif; run slide-logs again"):
        map_intensity.TOOL(run=str(bare), output=str(tmp_path / "m"))
    nothing = {name: np.zeros_like(each) for name, each in fields().items()}
    empty = write_run(tmp_path / "empty", tracks(3), rasters=nothing)
    with pytest.raises(UserError, match="no log of the run passed any cell"):
        map_intensity.TOOL(run=str(empty), output=str(tmp_path / "m"))
