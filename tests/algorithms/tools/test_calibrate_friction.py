"""calibrate-friction through files: a plane with a closed form, an event simulated beforehand, lines, and bad input."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin
from slope_case import EAST, NORTH, Case, layer, points, summary, write_layer

from deadwood_algorithms.evaluate.calibration import score
from deadwood_algorithms.evaluate.calibration.answer import runout_quantiles
from deadwood_algorithms.evaluate.calibration.friction_runs import FrictionRun, Observed, outcomes_of_deposits
from deadwood_algorithms.params.tool import Cancelled, Quiet, UserError
from deadwood_algorithms.scene import reach as dem_reach
from deadwood_algorithms.simulate import windows as scene_window
from deadwood_algorithms.tools import calibrate_friction
from deadwood_engine import STOP_REASONS
from deadwood_toolbox import cli

SLOPE = np.radians(20.0)
SPEED = 12.0
RELEASED = 100


def stop_m(friction: float) -> float:
    """Horizontal distance after which a log that slides down the plane stops: v^2 / (2 g (mu cos - sin)) cos."""
    return SPEED**2 / (2.0 * 9.81 * (friction * np.cos(SLOPE) - np.sin(SLOPE))) * np.cos(SLOPE)


class Plane:
    """A plane of 20 degrees that falls to the south, 60 x 100 m of 0.5 m cells, and logs that slide down it."""

    def __init__(self, folder: Path, cell: float = 0.5) -> None:
        self.folder = folder
        v = (np.arange(round(100 / cell))[::-1, None] + 0.5) * cell
        values = np.broadcast_to(1000.0 + np.tan(SLOPE) * v, (round(100 / cell), round(60 / cell))).astype("float32")
        self.dem = str(folder / "plane.tif")
        place = from_origin(EAST, NORTH + 100.0, cell, cell)
        facts = {"height": values.shape[0], "width": values.shape[1], "crs": "EPSG:2056", "transform": place}
        with rasterio.open(self.dem, "w", driver="GTiff", count=1, dtype="float32", **facts) as made:
            made.write(values, 1)
        rng = np.random.default_rng(2)
        turn, far = 2.0 * np.pi * rng.random(RELEASED), 2.0 * np.sqrt(rng.random(RELEASED))
        self.places = np.column_stack([30.0 + far * np.sin(turn), 85.0 + far * np.cos(turn)])
        self.releases = write_layer(folder / "releases.gpkg", points(*self.places), release_id=[7] * RELEASED)

    def values(self, output: Path, **changes: Any) -> dict[str, Any]:
        logs = {"dbh_cm": 40.0, "length_m": 5.0, "orientation": "lying", "azimuth_deg": 180.0, "speed_ms": SPEED}
        values = {
            "dem": self.dem,
            "releases": self.releases,
            "output": str(output),
            "fidelity": "draft",
            "error_m": 1.0,
        }
        sweep = {"friction": "0.45:0.7:0.025", "time_limit_s": 60.0}
        return {name: value for name, value in (values | logs | sweep | changes).items() if value is not None}


@pytest.fixture(scope="module")
def plane(tmp_path_factory) -> Plane:
    return Plane(tmp_path_factory.mktemp("plane"))


def seen(path: Path, *places: tuple[float, float], **columns) -> str:
    return write_layer(path, points(*places), **columns)


def calibrate(values: dict[str, Any], feedback=None) -> tuple[pd.DataFrame, dict[str, Any]]:
    outcome = calibrate_friction.TOOL(feedback=feedback, **values)
    folder = Path(values["output"])
    told = json.loads((folder / "calibration.json").read_text(encoding="utf-8"))
    assert told["range"] == outcome.facts["range"]
    return pd.read_csv(folder / "calibration.csv").set_index("friction"), told


@pytest.mark.parametrize("true", [0.505, 0.62])
def test_on_a_plane_the_true_coefficient_is_found(plane, tmp_path, true):
    """Two logs that stopped where the closed form says, seen from the middle of the releases. In 0.025 of mu the stop
    moves by 2.5 to 7 m; releases and places scatter by 1.4 m: the range is about as narrow."""
    places = [(30.3, 85.0 - stop_m(true)), (29.6, 85.5 - stop_m(true))]
    table, told = calibrate(plane.values(tmp_path / "out", observed=seen(tmp_path / "seen.gpkg", *places)))
    assert told["range"]["low"] < true < told["range"]["high"]
    assert told["range"]["high"] - told["range"]["low"] < 0.06
    assert told["fits"]
    assert abs(told["best"] - true) <= 0.025
    assert (table["p_range"].between(0, 1) & (table["relative_likelihood"].between(0, 1))).all()
    assert table["energy_score_m"].idxmin() == pytest.approx(true, abs=0.026)
    # and the simulation itself stops where the closed form says, to 2 %
    for friction in (0.5, 0.6, 0.7):
        assert table.loc[friction, "runout_median_m"] == pytest.approx(stop_m(friction), rel=0.02)


def test_a_stop_line_on_the_plane(plane, tmp_path):
    """All of eight logs crossed a line at 35 m and none one at 45 m: the result is between their coefficients."""
    v = {name: 85.0 - far for name, far in (("reached", 30.0), ("not_reached", 50.0))}
    lines = {
        name: write_layer(tmp_path / f"{name}.gpkg", [shapely.LineString([(1, at), (59, at)])], line_id=[name])
        for name, at in v.items()
    }
    table, _ = calibrate(plane.values(tmp_path / "out", **lines, event_logs=8, lines=lines["reached"]))
    stops = pd.Series({mu: stop_m(mu) for mu in table.index})
    inside = stops.between(33.5, 45.0)  # a log's end is 2.5 m ahead of its middle, releases are within 2 m
    assert (table.loc[inside, "share"] > 0.99).all()
    assert table.loc[inside, "in_range"].all()
    assert not table.loc[(stops < 24.0) | (stops > 55.0), "in_range"].any()
    assert inside.sum() >= 2
    assert table["reach_reached"].iloc[0] == 1.0
    assert table["reach_reached"].is_monotonic_decreasing
    # of three logs that reached the far line among eight, a coefficient with a share of 3 in 8 is likelier
    low = {"not_reached": None, "reached": lines["not_reached"], "event_logs": 8, "event_reached": 3}
    mixed, _ = calibrate(plane.values(tmp_path / "mixed", **low, friction="0.5,0.55,0.6"))
    expected = (mixed["share"] - 3 / 8).abs().idxmin()
    assert mixed["relative_likelihood"].idxmax() == expected


def test_an_area_in_which_logs_came_to_rest(plane, tmp_path):
    """A road 6 m wide at the place given by the closed form for 0.575, with three logs; elsewhere the share is 0."""
    middle = 85.0 - stop_m(0.575)
    road = shapely.box(20.0, middle - 3.0, 40.0, middle + 3.0)
    path = write_layer(tmp_path / "road.gpkg", [road] * 3)
    table, told = calibrate(plane.values(tmp_path / "out", observed=path))
    assert table["share"].idxmax() == pytest.approx(0.575)
    assert table.loc[0.575, "share"] > 0.8
    assert told["best"] == pytest.approx(0.575)
    assert 0.53 < told["range"]["low"] < 0.575 < told["range"]["high"] < 0.63


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    """Logs on 35 degrees above flat ground, through trees; those of the event are not those of the sweep."""
    made = Case(tmp_path_factory.mktemp("case"))
    rng = np.random.default_rng(40)
    places = [(20.0 + 20.0 * a, 36.0 + 10.0 * b) for a, b in rng.random((150, 2))]
    made.releases = write_layer(made.folder / "many.gpkg", points(*places), release_id=["a", "b"] * 75)
    return made


def of_case(case: Case, **changes) -> dict[str, Any]:
    values = case.values(**({"trees": case.trees, "friction": "0.1,0.2,0.3,0.4,0.5,0.6"} | changes))
    del values["trajectories"]
    return values


def test_an_event_that_was_simulated_is_found_again(case, tmp_path, said):
    """Eight logs of another draw at 0.3, each known to come from its release, seen with 1 m of error."""
    rng = np.random.default_rng(41)
    places = [(20.0 + 20.0 * a, 36.0 + 10.0 * b) for a, b in rng.random((8, 2))]
    event = write_layer(tmp_path / "event.gpkg", points(*places), release_id=["a", "b"] * 4)
    run = case.run(releases=event, trees=case.trees, friction="0.3", output=str(tmp_path / "run"))
    ends = layer(run, "deposits")
    assert set(ends["stop_reason"]) <= {"rest", "tree"}
    ends.geometry = shapely.points(*(np.array([ends.geometry.x, ends.geometry.y]) + rng.normal(0.0, 1.0, (2, 8))))
    ends[["release_id", "geometry"]].to_file(tmp_path / "seen.gpkg")
    values = of_case(case, observed=str(tmp_path / "seen.gpkg"), output=str(tmp_path / "out"), error_m=1.0)
    table, told = calibrate(values, said)
    assert table.loc[0.3, "in_range"]
    assert told["range"]["low"] <= 0.3 <= told["range"]["high"]
    assert not table["in_range"].all()
    assert told["fits"]
    parts = [gpd.read_file(tmp_path / "out" / "calibration.gpkg", layer=name) for name in ("deposits", "no_deposit")]
    assert sum(map(len, parts)) == 6 * 150
    observed = gpd.read_file(tmp_path / "out" / "calibration.gpkg", layer="observed")
    assert observed["name"].tolist()[:2] == ["1 (release a)", "2 (release b)"]
    # the terrain model has cells of 1 m, and 75 logs of each release are few
    assert any("cells are 1 m, not 0.5 m" in each and "0.2 to 0.3" in each for each in said.warnings)
    assert any("compared with only 75 logs" in each for each in said.warnings)


def test_the_run_out_of_logs_that_leave_the_model_is_not_left_out():
    """Of 200 logs the 50 that go farthest leave: three quarters of the run-outs are known, not the 95 % quantile."""
    runout = np.linspace(10.0, 209.0, 200)
    reason = np.where(runout < 160.0, STOP_REASONS.index("rest"), STOP_REASONS.index("left_dem")).astype(np.int8)
    nothing = np.zeros(200)
    slid = FrictionRun(0.3, nothing, nothing, runout[::-1], nothing, reason[::-1], np.zeros((200, 0), bool))
    low, middle, high = runout_quantiles(slid)
    assert (low, middle) == pytest.approx(tuple(np.quantile(runout, [0.05, 0.5])))
    assert np.isnan(high), "that of the logs at rest would be 152 m"


def test_the_logs_are_those_of_slide_logs(case, tmp_path):
    values = of_case(case, reached=case.lines, lines=case.lines, output=str(tmp_path / "out"))
    table, _ = calibrate(values)
    run = case.run(
        friction="0.4", trees=case.trees, lines=case.lines, output=str(tmp_path / "run"), trajectories="none"
    )
    told, deposits = {each["line_id"]: each["p"] for each in summary(run)["reach"]}, layer(run, "deposits")
    rests = deposits["stop_reason"] != "left_dem"
    for line_id, share in told.items():
        assert table.loc[0.4, f"reach_{line_id}"] == share
    assert table.loc[0.4, "runout_median_m"] == pytest.approx(deposits.loc[rests, "runout_m"].median())
    assert table.loc[0.4, "speed_max_ms"] == pytest.approx(deposits["speed_max_ms"].max())
    assert table.loc[0.4, "share"] >= max(told.values())


def test_threads_order_and_the_config_decide_nothing(case, tmp_path):
    path = seen(tmp_path / "seen.gpkg", (30.0, 20.0), (33.0, 40.0))
    one, _ = calibrate(of_case(case, observed=path, output=str(tmp_path / "one"), threads=1, friction="0.2,0.4"))
    frame = gpd.read_file(case.releases)
    frame["log_id"] = np.arange(1, 151)  # as rows are numbered
    frame.sample(frac=1.0, random_state=3).to_file(tmp_path / "shuffled.gpkg")
    changes = {"output": str(tmp_path / "two"), "threads": 3, "releases": str(tmp_path / "shuffled.gpkg")}
    two, _ = calibrate(of_case(case, observed=path, **changes) | {"friction": "0.4,0.2"})
    assert np.allclose(one.to_numpy(float), two.to_numpy(float), rtol=1e-9, equal_nan=True)
    flags = ["--config", str(tmp_path / "one" / "manifest.json"), "--output", str(tmp_path / "config"), "--quiet"]
    assert cli.run(["calibrate-friction", *flags]) == 0
    assert (tmp_path / "config" / "calibration.csv").read_bytes() == (tmp_path / "one" / "calibration.csv").read_bytes()
    width, height = struct.unpack(">II", (tmp_path / "one" / "calibration.png").read_bytes()[16:24])
    assert width > 1200
    assert height > 400


def test_an_impossible_event_is_reported(plane, tmp_path):
    """Logs that came to rest beside the slope's fall line, 12 m off every track."""
    path = seen(tmp_path / "seen.gpkg", (42.0, 50.0))
    outcome = calibrate_friction.TOOL(**plane.values(tmp_path / "out", observed=path, friction="0.5,0.55,0.6"))
    assert not outcome.facts["fits"]
    assert "But even the best reproduces such an event in fewer than 1 of 20 cases" in outcome.lines[-2]


def test_a_sweep_that_ends_too_early_reports_it(plane, tmp_path):
    path = seen(tmp_path / "seen.gpkg", (30.0, 85.0 - stop_m(0.55)))
    values = plane.values(tmp_path / "out", observed=path, friction="0.55,0.65")
    assert "perhaps below: the sweep ends there" in calibrate_friction.TOOL(**values).lines[-2]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"observed": None}, "--observed is missing"),
        ({"reached": "x.gpkg"}, "describe the same event twice"),
        ({"observed": None, "reached": "x.gpkg", "event_logs": 2, "event_reached": 3}, "--event-reached is 3"),
        ({"friction": "0.3"}, "must be 2 to 100 numbers"),
        ({"friction": "0.1:0.5"}, "from:to:step"),
        ({"friction": "0.5:0.1:0.05"}, "from:to:step"),
        ({"friction": "0.1:0.5:0.0001"}, "from:to:step"),
        ({"friction": "0.1,-0.2"}, "must be at least 0"),
        ({"friction": "wet"}, "from:to:step"),
        ({"error_m": 0.0}, "--error-m is 0 m, but must be greater than 0 m"),
        ({"logs": 1}, "--logs is 1"),
    ],
)
def test_what_is_unclear_is_refused_before_anything_is_slid(plane, tmp_path, changes, words):
    path = seen(tmp_path / "seen.gpkg", (30.0, 50.0))
    with pytest.raises(UserError) as error:
        calibrate_friction.TOOL(**plane.values(tmp_path / "out", **({"observed": path} | changes)))
    assert words in str(error.value)
    assert "\n" not in str(error.value)
    assert not (tmp_path / "out").exists()


def test_observed_deposits_that_are_none(plane, tmp_path):
    off = seen(tmp_path / "off.gpkg", (30.0, 50.0), (-500.0, 50.0))
    with pytest.raises(UserError, match="row 2: the observed deposit does not lie on the DEM"):
        calibrate_friction.TOOL(**plane.values(tmp_path / "out", observed=off))
    foreign = seen(tmp_path / "foreign.gpkg", (30.0, 50.0), release_id=["north"])
    with pytest.raises(UserError, match="row 1: no released log has 'north'; they have 7"):
        calibrate_friction.TOOL(**plane.values(tmp_path / "out", observed=foreign))
    line = write_layer(tmp_path / "line.gpkg", [shapely.LineString([(1, 2), (3, 4)])])
    with pytest.raises(UserError, match="must be point or polygons"):
        calibrate_friction.TOOL(**plane.values(tmp_path / "out", observed=line))


def test_on_the_window_of_a_large_dem_it_finds_the_same(plane, tmp_path, said, monkeypatch):
    """The first window is too small, so it grows; lines of all three kinds are watched."""
    v = {"reached": 70.0, "not_reached": 40.0, "lines": 60.0}
    lines = {
        name: write_layer(tmp_path / f"{name}.gpkg", [shapely.LineString([(1, at), (59, at)])], line_id=[name])
        for name, at in v.items()
    }
    values = plane.values(tmp_path / "whole", **lines, friction="0.45,0.55", event_logs=3)
    whole, _ = calibrate(values)
    monkeypatch.setattr(dem_reach, "BLOCK_CELLS", 8)
    monkeypatch.setattr(scene_window, "WHOLE_CELLS", 100)
    monkeypatch.setattr(scene_window, "SLOPE_LEAST", 20.0)
    monkeypatch.setattr(scene_window, "SLOPE_MOST", 20.0)
    window, _ = calibrate(values | {"output": str(tmp_path / "window")}, said)
    assert any("is read wider" in note for note in said.notes)
    assert np.allclose(whole.to_numpy(float), window.to_numpy(float), rtol=1e-9, equal_nan=True)
    assert 0.0 < window["reach_lines"].iloc[-1] <= 1.0


def test_another_shape_slides_in_the_logs_place(plane, tmp_path):
    """A flat block of rock, with the same closed form: mass and shape cancel in sliding."""
    corners = np.array([(x, y, z) for x in (0.0, 1.0) for y in (0.0, 0.3) for z in (0.0, 2.0)])
    np.savetxt(tmp_path / "block.pts", corners)
    path = seen(tmp_path / "seen.gpkg", (30.0, 85.0 - stop_m(0.55)))
    values = plane.values(tmp_path / "out", observed=path, friction="0.5,0.55,0.6", shape=str(tmp_path / "block.pts"))
    table, told = calibrate(values)
    assert told["best"] == 0.55
    assert table.loc[0.55, "runout_median_m"] == pytest.approx(stop_m(0.55), rel=0.03)


class StopAt(Quiet):
    """Asks to stop as soon as the second coefficient is at work."""

    def __init__(self, word: str) -> None:
        self.word, self.stop = word, False

    def progress(self, done: float, total: float, what: str) -> None:
        self.stop = self.stop or self.word in what

    def cancelled(self) -> bool:
        return self.stop


@pytest.mark.parametrize("word", ["sliding at friction 0.475", "scoring"])
def test_an_interrupted_calibration_leaves_what_it_continues_with(plane, tmp_path, word):
    path = seen(tmp_path / "seen.gpkg", (30.0, 50.0))
    with pytest.raises(Cancelled):
        calibrate_friction.TOOL(feedback=StopAt(word), **plane.values(tmp_path / "out", observed=path))
    assert sorted(each.name for each in tmp_path.iterdir()) == [".out.part", "seen.gpkg"]


def test_logs_out_of_sight_are_no_deposits(plane, tmp_path, said):
    """The plane ends 5 m below the stop at 0.5: with less friction most logs leave it. Six logs stopped at 0.6."""
    cut = tmp_path / "cut.tif"
    with rasterio.open(plane.dem) as dem:
        heights, profile = dem.read(1), dem.profile
    end = 85.0 - stop_m(0.5) - 5.0
    heights[round((100.0 - end) / 0.5) :] = -9999.0
    with rasterio.open(cut, "w", **(profile | {"nodata": -9999.0})) as made:
        made.write(heights, 1)
    rng = np.random.default_rng(3)
    places = [(30.0 + rng.normal(0.0, 1.0), 85.0 - stop_m(0.6) + rng.normal(0.0, 1.0)) for _ in range(6)]
    values = plane.values(tmp_path / "out", observed=seen(tmp_path / "seen.gpkg", *places), dem=str(cut))
    values |= {"friction": "0.4,0.45,0.5,0.55,0.6,0.65", "error_m": 8.0}
    outcome = calibrate_friction.TOOL(feedback=said, **values)
    table = pd.read_csv(tmp_path / "out" / "calibration.csv").set_index("friction")
    assert table.loc[0.4, "without_deposit"] == table.loc[0.45, "without_deposit"] == RELEASED
    assert not table.loc[[0.4, 0.45], "in_range"].any()  # p was 1: every made event had no likelihood at all
    assert table.loc[0.6, "in_range"]
    assert any("of 100 logs, 100 at friction 0.4, 100 at friction 0.45" in each for each in said.warnings)
    assert "no deposit" in outcome.lines[1]
    assert "100 %" in outcome.lines[2]
    layers = {
        name: gpd.read_file(tmp_path / "out" / "calibration.gpkg", layer=name) for name in ("deposits", "no_deposit")
    }
    assert set(layers["no_deposit"]["stop_reason"]) == {"left_dem"}
    assert "left_dem" not in set(layers["deposits"]["stop_reason"])
    assert sum(map(len, layers.values())) == 6 * RELEASED


def test_a_share_has_bounds_where_logs_left_before_the_line(plane, tmp_path, said):
    """The line is beyond the end of the terrain model for most logs: whether they cross it is unknown."""
    cut = tmp_path / "cut.tif"
    with rasterio.open(plane.dem) as dem:
        heights, profile = dem.read(1), dem.profile
    heights[80:] = -9999.0  # up to 60 m from the south, but for a strip in the west
    with rasterio.open(plane.dem) as dem:
        heights[80:, :20] = dem.read(1)[80:, :20]
    with rasterio.open(cut, "w", **(profile | {"nodata": -9999.0})) as made:
        made.write(heights, 1)
    line = write_layer(tmp_path / "line.gpkg", [shapely.LineString([(1, 50), (59, 50)])], line_id=["road"])
    values = plane.values(tmp_path / "out", not_reached=line, dem=str(cut), friction="0.45,0.7", event_logs=3)
    outcome = calibrate_friction.TOOL(feedback=said, **values)
    table = pd.read_csv(tmp_path / "out" / "calibration.csv").set_index("friction")
    assert table.loc[0.45, "n_lost"] == 100
    assert (table.loc[0.45, "share_low_if_lost"], table.loc[0.45, "share_high_if_lost"]) == (0.0, 1.0)
    assert any("before it was known whether they reach the lines" in each for each in said.warnings)
    assert "if lost ones do" in outcome.lines[1]


SWEEP = (0.2, 0.3, 0.4, 0.5)
EVENTS, DEPOSITS, ERROR = 40, 12, 3.0


def slid_with(case: Case, name: str, number: int, seed: int, **changes: Any) -> list[FrictionRun]:
    """This number of logs from one small area, slid with each coefficient in separate runs."""
    rng = np.random.default_rng(seed)
    spots = [(22.0 + 16.0 * a, 68.0 + 8.0 * b) for a, b in rng.random((number, 2))]
    releases = write_layer(case.folder / f"{name}.gpkg", points(*spots), log_id=np.arange(number))
    found = []
    for mu in SWEEP:
        more = {"releases": releases, "trees": case.trees, "friction": f"{mu}", "trajectories": "none"} | changes
        table = layer(case.run(output=str(case.folder / f"{name}-{mu}"), **more), "deposits").set_index("log_id")
        reasons = np.array([STOP_REASONS.index(each) for each in table.sort_index()["stop_reason"]], np.int8)
        x, y = (getattr(table.sort_index().geometry, axis).to_numpy() for axis in "xy")
        nothing = np.zeros(number)
        found.append(FrictionRun(mu, x, y, nothing, nothing, reasons, np.zeros((number, 0), bool)))
    return found


@pytest.mark.statistics
@pytest.mark.parametrize("lossy", [False, True])
def test_the_range_holds_the_true_coefficient_of_synthetic_events(tmp_path, monkeypatch, lossy):
    """40 events of 12 deposits that other logs of the same area left in a forest, found with an error of 3 m: on a
    terrain model that holds them all, and on one that ends on the flat below the slope, which the fastest leave. The
    range holds the true coefficient in 95 % of them: 34 of 40 are 3 standard errors less. Trees hold some logs of every
    coefficient (9 are 3 standard errors above none); on the smaller one of 0.3 nearly all. Before, the coefficients
    with which logs leave were excluded there."""
    monkeypatch.setattr(score, "EVENTS", 150)
    monkeypatch.setattr(score, "sampling_interval", lambda *_: (np.zeros(len(SWEEP)), np.zeros(len(SWEEP))))
    case = Case(tmp_path / "case")
    with rasterio.open(case.dem) as source:
        heights, profile = source.read(1), source.profile
    heights = heights[:-15] if lossy else np.vstack([heights, np.repeat(heights[-1:], 60, axis=0)])
    with rasterio.open(tmp_path / "dem.tif", "w", **(profile | {"height": len(heights)})) as made:
        made.write(heights, 1)
    case.dem = str(tmp_path / "dem.tif")
    known, fresh = slid_with(case, "known", 250, 1), slid_with(case, "fresh", 250, 2)
    rests = np.array([each.resting.mean() for each in known])
    held_by_trees = [each.stop_reason[each.resting] == STOP_REASONS.index("tree") for each in fresh]
    assert min(each.sum() for each in held_by_trees) >= 9
    assert max(each.mean() for each in held_by_trees) > (0.8 if lossy else 0.1)
    assert rests[1] < 0.2 if lossy else rests.min() > 0.98
    assert rests[-1] > 0.9
    rng = np.random.default_rng(5)
    possible = [k for k, each in enumerate(fresh) if each.resting.sum() > 1.5 * DEPOSITS]
    held, before, partly = 0, 0, 0
    for _ in range(EVENTS):
        k = int(rng.choice(possible))
        rows = rng.choice(np.flatnonzero(fresh[k].resting), DEPOSITS, replace=False)
        at = np.column_stack([fresh[k].x[rows], fresh[k].y[rows]]) + ERROR * rng.standard_normal((DEPOSITS, 2))
        observed = Observed(shapely.points(at), [np.arange(250)] * DEPOSITS, [""] * DEPOSITS)

        def within(k: int = k, observed: Observed = observed, *, search_complete: bool = False) -> bool:
            outcomes = outcomes_of_deposits(observed, known, ERROR, search_complete=search_complete)
            return bool(score.score(outcomes, np.arange(250), ERROR, 0, lambda _: None).within[k])

        held += within()
        if rests[k] < 0.7 and partly < 8:
            partly += 1
            before += within(search_complete=True)
    assert held >= 34
    assert partly >= 5 or not lossy
    assert before <= 0.5 * partly


def test_a_complete_search_is_reported_with_its_conditions(plane, tmp_path, said):
    """Logs of friction 0.45 leave the plane at its foot: without the option this is no evidence."""
    far = seen(tmp_path / "seen.gpkg", (30.0, 85.0 - stop_m(0.5)), (29.5, 84.5 - stop_m(0.5)))
    values = plane.values(tmp_path / "out", observed=far, friction="0.4:0.6:0.05")
    table, told = calibrate(values, said)
    assert told["event"] == {"deposits": 2, "search_complete": False}
    assert table.loc[0.4, "without_deposit"] > 50
    (warned,) = [each for each in said.warnings if "left the terrain model" in each]
    assert f"of {RELEASED} logs, {table.loc[0.4, 'without_deposit']} at friction 0.4" in warned
    assert "use --search-complete" in warned
    said.warnings.clear()
    _, told = calibrate(values | {"search_complete": True, "output": str(tmp_path / "all")}, said)
    assert told["event"]["search_complete"]
    assert any("reduces the likelihood of these coefficients" in each for each in said.warnings)
    line = write_layer(tmp_path / "line.gpkg", [shapely.LineString([(1, 50), (59, 50)])], line_id=["a"])
    with pytest.raises(UserError, match="--search-complete is about observed deposits"):
        calibrate_friction.TOOL(**plane.values(tmp_path / "no", reached=line, search_complete=True))
