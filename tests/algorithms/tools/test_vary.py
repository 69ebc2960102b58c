"""vary through files: its ends are runs of slide-logs, its design is Saltelli's; what cannot be varied is refused."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import shapely
from slope_case import Case, layer, points, summary, write_dem, write_layer

from deadwood_algorithms.evaluate.sensitivity.design import Place
from deadwood_algorithms.evaluate.sensitivity.factor_runs import logs_at
from deadwood_algorithms.params.tool import Cancelled, Quiet, UserError
from deadwood_algorithms.scene import layers as scene_read
from deadwood_algorithms.scene import reach
from deadwood_algorithms.schemas import ORIENTATIONS
from deadwood_algorithms.simulate import windows as scene_window
from deadwood_algorithms.simulate.log_order import hash_order
from deadwood_algorithms.tools import vary
from deadwood_engine import Logs
from deadwood_toolbox import cli

LOGS = 30


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    made = Case(tmp_path_factory.mktemp("case"))
    places = [(20.0 + 20.0 * a, 45.0 + 15.0 * b) for a, b in np.random.default_rng(4).random((LOGS, 2))]
    made.releases = write_layer(made.folder / "many.gpkg", points(*places))
    return made


def varied(case: Case, output: Path, feedback: Any = None, **changes: Any) -> dict[str, Any]:
    values = case.values(**({"output": str(output), "design": "ends"} | changes))
    del values["trajectories"]
    outcome = vary.TOOL(feedback=feedback, **values)
    told = json.loads((output / "summary.json").read_text(encoding="utf-8"))
    assert outcome.lines[-2] == told["sentence"]
    assert outcome.lines[-1].startswith("scenario: ")
    return told


def rows(folder: Path, name: str) -> pd.DataFrame:
    return pd.read_csv(folder / name, encoding="utf-8-sig")


# Halves and doubles of sizes are exact, so they have the bits of the option with that value.
ENDS = (
    "friction=0.15:0.3,rolling_friction=0.02:0.2,restitution=0:0.3,tree_friction=0.1:0.8,tree_restitution=0:0.5,"
    "log_dbh_factor=0.5:2,log_length_factor=0.5:1.5,log_density_factor=0.5:1.5,tree_dbh_factor=0.5:1.5,"
    "fidelity=draft:standard,orientation=random-lying:upright"
)
# What slide-logs is given for each end
AS_OPTIONS = {
    "friction": lambda v: {"friction": str(v)},
    "rolling_friction": lambda v: {"rolling_friction": v},
    "restitution": lambda v: {"restitution": v},
    "tree_friction": lambda v: {"tree_friction": v},
    "tree_restitution": lambda v: {"tree_restitution": v},
    "log_dbh_factor": lambda v: {"dbh_cm": 40.0 * v},
    "log_length_factor": lambda v: {"length_m": 10.0 * v},
    "log_density_factor": lambda v: {"density_kg_m3": 300.0 * v},
    "fidelity": lambda v: {"fidelity": v},
}


@pytest.fixture(scope="module")
def ends(case) -> Path:
    varied(case, case.folder / "ends", vary=ENDS, threads=2, **case.everything())
    return case.folder / "ends"


def test_the_ends_are_runs_of_slide_logs(case, ends, tmp_path):
    """Every log reaches the same lines, and comes as far to the last bit of the mean."""
    runs = rows(ends, "runs.csv")
    assert len(runs) == 1 + 2 * 11
    everything = case.everything()

    def agrees(row: pd.Series, **changes: Any) -> None:
        run = case.run(output=str(tmp_path / str(row["run"])), trajectories="none", **(everything | changes))
        for record in summary(run)["reach"]:
            assert row[f"reach_{record['line_id']}"] == record["p"]
        assert row["runout_mean_m"] == pytest.approx(layer(run, "deposits")["runout_m"].mean(), rel=1e-12)

    agrees(runs.iloc[0])
    for name, options in AS_OPTIONS.items():
        for end in ("low", "high"):
            row = runs[runs["label"] == f"{name} {end}"].iloc[0]
            value = row[f"value_{name}"]
            agrees(row, **options(value if name == "fidelity" else float(value)))
    agrees(runs[runs["label"] == "orientation high"].iloc[0], orientation="upright")
    trees = write_layer(
        tmp_path / "thick.gpkg",
        [shapely.Point(each.x - 2_786_000.0, each.y - 1_196_000.0) for each in _trees(case).geometry],
        tree_id=_trees(case)["tree_id"].to_numpy(),
        dbh_cm=1.5 * _trees(case)["dbh_cm"].to_numpy(),
        height_m=_trees(case)["height_m"].to_numpy(),
    )
    agrees(runs[runs["label"] == "tree_dbh_factor high"].iloc[0], trees=trees)


def test_logs_that_lie_lie_in_every_direction_and_are_the_same_logs():
    """A quarter of 4000 logs is in each quadrant of azimuths, within four standard deviations."""
    ids = np.arange(4000)
    logs = Logs.alike(ids * 1.0, ids * 2.0, length=12.0, tilt=0.4)
    asked = Place("orientation low", {"orientation": "random-lying", "log_length_factor": 2.0})
    found = logs_at(asked, logs, seed=7)
    assert (found.orientation == ORIENTATIONS.index("lying")).all()
    assert (found.length == 24.0).all()
    quarters = np.bincount((found.azimuth // (0.5 * np.pi)).astype(int), minlength=4)
    assert np.abs(quarters - 1000).max() <= 4.0 * np.sqrt(4000 * 0.25 * 0.75)
    one = logs_at(asked, replace(Logs.alike([1.0], [2.0]), log_id=ids[77:78]), seed=7)
    assert one.azimuth[0] == found.azimuth[77]  # independently of other logs
    assert (found.x == logs.x).all()


def _trees(case: Case) -> Any:
    import geopandas as gpd

    return gpd.read_file(case.trees)


def test_density_does_nothing(ends):
    """Weight and friction are both proportional to mass: sliding does not depend on it."""
    bars = rows(ends, "tornado.csv").set_index(["outcome", "factor"])
    mine = bars.xs("log_density_factor", level="factor")
    assert (mine["n_changed"] == 0).all()
    assert (mine["swing"] == 0.0).all()
    assert not mine["beyond_chance"].any()
    assert bars.loc[("runout_mean_m", "friction"), "n_changed"] == LOGS


def test_the_tornado_is_that_of_the_runs(ends):
    runs, bars = rows(ends, "runs.csv").set_index("label"), rows(ends, "tornado.csv")
    for each in bars.itertuples():
        assert each.as_it_is == runs.loc["as it is", each.outcome]
        assert each.at_low == pytest.approx(runs.loc[f"{each.factor} low", each.outcome])
        assert each.at_high == pytest.approx(runs.loc[f"{each.factor} high", each.outcome])
        assert each.swing == pytest.approx(each.at_high - each.at_low, abs=1e-12)
        assert each.ci_low <= each.swing <= each.ci_high
    width, height = struct.unpack(">II", (ends / "tornado.png").read_bytes()[16:24])
    assert width > 1000
    assert height > 600


def test_on_a_plane_the_answer_depends_on_friction(case, tmp_path):
    """35 degrees without obstacles, ends below and above their tangent of 0.70: all logs slide or none does."""
    told = varied(case, tmp_path / "plane", vary="friction=0.5:0.9,tree_friction", lying_logs=_far(tmp_path),
                  lines=case.lines)  # fmt: skip
    assert told["answers"][0]["factors"] == ["friction"]
    assert told["answers"][0]["decided"]
    assert told["sentence"].startswith(
        "The most influential input is friction: 0.5 to 0.9 takes the reach of road from "
    )
    bars = rows(tmp_path / "plane", "tornado.csv").set_index(["outcome", "factor"])
    assert bars.loc[("runout_mean_m", "tree_friction"), "n_changed"] == 0


def _far(folder: Path) -> str:
    """A lying log that no log comes near, so that its friction can be varied."""
    return write_layer(folder / "far.gpkg", [shapely.LineString([(2.0, 96.0), (4.0, 96.0)])], diameter_cm=[30.0])


def test_what_so_few_logs_do_not_decide_is_reported(case, tmp_path):
    told = varied(case, tmp_path / "few", vary="log_density_factor", lines=case.lines)
    assert told["answers"][0]["factors"] == []
    assert told["sentence"].startswith(
        "The number of logs (30) is too small to decide which input influences the reach of road most"
    )


def test_the_design_is_saltellis(case, tmp_path):
    """Every block of A with a column of B, in values; the noise's surface goes with its own column; again the same."""
    asked = {"vary": "friction=0.2:0.6,dem_noise_m=0:0.3,fidelity", "samples": 8, "logs": 4, "seed": 3}
    told = varied(case, tmp_path / "one", design="latin", lines=case.lines, threads=1, **asked)
    runs = rows(tmp_path / "one", "runs.csv")
    assert len(runs) == told["runs"] == 1 + 2 * 3 + 8 * (3 + 2)
    names = ["value_friction", "value_dem_noise_m", "value_fidelity"]
    columns = [*names, "dem_surface"]
    a, b = runs.iloc[7:15], runs.iloc[15:23]
    own = {"value_friction": ["value_friction"], "value_dem_noise_m": ["value_dem_noise_m", "dem_surface"],
           "value_fidelity": ["value_fidelity"]}  # fmt: skip
    for k, name in enumerate(names):
        block = runs.iloc[23 + 8 * k : 31 + 8 * k]
        for column in columns:
            source = b if column in own[name] else a
            assert block[column].tolist() == source[column].tolist(), (name, column)
    assert runs["dem_surface"].iloc[7:23].is_unique
    assert runs["value_friction"].iloc[7:].between(0.2, 0.6).all()
    assert set(a["value_fidelity"]) == {"draft", "standard"}
    indices = rows(tmp_path / "one", "indices.csv")
    assert indices["outcome"].unique().tolist() == ["reach_road", "reach_house", "runout_mean_m"]
    varied(case, tmp_path / "two", design="latin", lines=case.lines, threads=3, **asked)
    for name in ("runs.csv", "tornado.csv", "indices.csv", "summary.json"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_fewer_logs_are_the_first_of_the_hash_order(case, tmp_path):
    import geopandas as gpd

    varied(case, tmp_path / "some", logs=12, seed=3, vary="friction")
    first = gpd.read_file(case.releases).assign(log_id=np.arange(1, LOGS + 1))
    first.iloc[hash_order(np.arange(1, LOGS + 1), 3)[:12]].to_file(tmp_path / "first.gpkg")
    run = case.run(releases=str(tmp_path / "first.gpkg"), output=str(tmp_path / "run"), trajectories="none")
    mine = rows(tmp_path / "some", "runs.csv")["runout_mean_m"].iloc[0]
    assert mine == pytest.approx(layer(run, "deposits")["runout_m"].mean(), rel=1e-12)


class StopIn(Quiet):
    """Interrupts in the run of this number."""

    def __init__(self, run: int) -> None:
        self.run, self.now, self.notes = f"run {run} of", "", []

    def progress(self, done: float, total: float, what: str) -> None:
        self.now = what

    def note(self, message: str, code: str = "", **numbers: Any) -> None:
        self.notes.append(message)

    def cancelled(self) -> bool:
        return self.now.startswith(self.run)


def test_interrupted_and_resumed_it_is_the_same(case, ends, tmp_path):
    asked = {"vary": ENDS, **case.everything()}
    stop = StopIn(6)
    with pytest.raises(Cancelled):
        varied(case, tmp_path / "again", stop, **asked)
    assert not (tmp_path / "again").exists()
    assert any(note.startswith(f"what {5 * LOGS} logs did is kept") for note in stop.notes)
    with pytest.raises(UserError, match="begun with other factors or design"):
        varied(case, tmp_path / "again", resume=True, **(asked | {"vary": "friction"}))
    seen = StopIn(-1)
    begun: list[str] = []
    seen.progress = lambda done, total, what: begun.append(what)
    varied(case, tmp_path / "again", seen, resume=True, **asked)
    assert not any(what.startswith("run 5 of") for what in begun)
    for name in ("runs.csv", "tornado.csv", "summary.json"):
        assert (tmp_path / "again" / name).read_bytes() == (ends / name).read_bytes()
    assert list(tmp_path.glob(".*")) == []


def test_the_manifest_works_as_a_config(case, tmp_path, capsys):
    table = tmp_path / "factors.csv"
    table.write_text("factor,low,high\nfriction,0.2,0.4\nlog-length-factor,,\n", encoding="utf-8")
    told = varied(case, tmp_path / "one", vary=str(table), logs=4)
    assert told["factors"] == [
        {"factor": "friction", "low": 0.2, "high": 0.4},
        {"factor": "log_length_factor", "low": 0.9, "high": 1.1},
    ]
    output = tmp_path / "again"
    flags = ["--config", str(tmp_path / "one" / "manifest.json"), "--output", str(output), "--quiet"]
    assert cli.run(["vary", *flags]) == 0, capsys.readouterr().err
    assert (output / "runs.csv").read_bytes() == (tmp_path / "one" / "runs.csv").read_bytes()


def test_a_layer_of_friction_is_multiplied(case, tmp_path):
    west = shapely.box(0.0, 0.0, 30.0, 100.0)
    east = shapely.box(30.0, 0.0, 60.0, 100.0)
    one = write_layer(tmp_path / "mu.gpkg", [west, east], friction=[0.2, 0.4])
    two = write_layer(tmp_path / "twice.gpkg", [west, east], friction=[0.4, 0.8])
    varied(case, tmp_path / "varied", friction=one, vary="friction_factor=1:2", logs=LOGS)
    run = case.run(friction=two, output=str(tmp_path / "run"), trajectories="none")
    runs = rows(tmp_path / "varied", "runs.csv").set_index("label")
    assert runs.loc["friction_factor low", "runout_mean_m"] == runs.loc["as it is", "runout_mean_m"]
    mine = runs.loc["friction_factor high", "runout_mean_m"]
    assert mine == pytest.approx(layer(run, "deposits")["runout_m"].mean(), rel=1e-12)
    with pytest.raises(UserError, match="is a layer of friction, which has no single value; vary friction_factor"):
        varied(case, tmp_path / "refused", friction=one, vary="friction")


def test_noise_on_the_terrain_is_the_dem_with_it(case, tmp_path):
    """The end of the range is a run on a DEM to which the surface has been added."""
    import rasterio

    from deadwood_algorithms.evaluate.sensitivity.noise import error_surface

    varied(case, tmp_path / "varied", vary="dem_noise_m=0:0.5", seed=5, dem_noise_length_m=8.0)
    rough = write_dem(tmp_path / "rough.tif")
    with rasterio.open(rough, "r+") as dem:
        surface = error_surface(dem.shape, (0, 0), 1.0, 8.0, 5, 0)
        dem.write((dem.read(1) + 0.5 * surface[::-1]).astype("float32"), 1)
    run = case.run(dem=rough, output=str(tmp_path / "run"), trajectories="none")
    runs = rows(tmp_path / "varied", "runs.csv").set_index("label")
    assert runs.loc["dem_noise_m low", "runout_mean_m"] == runs.loc["as it is", "runout_mean_m"]
    mine = runs.loc["dem_noise_m high", "runout_mean_m"]
    assert mine == pytest.approx(layer(run, "deposits")["runout_m"].mean(), rel=1e-12)
    assert mine != runs.loc["as it is", "runout_mean_m"]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"vary": "colour=1:2"}, "no factor is called 'colour'; known are friction, "),
        ({"vary": "friction=0.3"}, "is not a range; write it as NAME=LOW:HIGH"),
        ({"vary": "friction=0.3:0.2"}, "must go from a number to a larger one"),
        ({"vary": "friction=a:b"}, "the range a to b is not two numbers"),
        ({"vary": "restitution=0:2"}, "0 to 2 is outside the permitted range of restitution, 0 to 1"),
        ({"vary": "friction,friction"}, "'friction' is named twice"),
        ({"vary": "friction,friction_factor"}, "the same factor"),
        ({"vary": " , "}, "names no factor"),
        ({"vary": "fidelity=draft:exact"}, "'exact' is none of draft"),
        ({"vary": "fidelity=draft:draft"}, "both ends are draft"),
        ({"vary": "nothing.csv"}, "the file nothing.csv does not exist"),
        ({"vary": "tree_dbh_factor"}, "the scene has no trees; leave it out, or give --trees"),
        ({"vary": "log_dbh_factor=1:99"}, "the DBH of some logs would be outside 0.001 to 15"),
        ({"vary": "dem_noise_m", "dem_noise_length_m": 0.5}, "less than a cell of the terrain model; give at least 1"),
        ({"vary": "friction", "design": "sobol", "samples": 12}, "give 8 or 16"),
    ],
)
def test_what_cannot_be_varied(case, tmp_path, changes, words):
    with pytest.raises(UserError) as refused:
        varied(case, tmp_path / "refused", **changes)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)
    assert not (tmp_path / "refused").exists()


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.csv", "factor,low\nfriction,1\n", "there is no column 'high'"),
        ("a.csv", "factor,low,high\nfriction,1,x\n", "a.csv, row 1: the range 1 to x is not two numbers"),
        ("a.json", "[1]", "must be an object by factor"),
        ("a.json", "{", "not JSON"),
        ("a.json", '{"friction": 3}', "'friction' must be [LOW, HIGH]"),
    ],
)
def test_files_of_factors_that_are_none(case, tmp_path, name, text, words):
    (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(UserError) as refused:
        varied(case, tmp_path / "refused", vary=str(tmp_path / name))
    assert words in str(refused.value)


def test_on_the_window_of_a_large_dem_it_finds_the_same(case, tmp_path, monkeypatch):
    """The first window is too small, so it grows; the noise of the terrain is that of the whole, bit for bit."""
    asked = {"vary": "dem_noise_m=0:0.3,friction=0.1:0.4", "lines": case.lines, "friction": "0.3", "logs": 8}
    asked["dem"] = write_dem(tmp_path / "fine.tif", cell=0.25)
    monkeypatch.setattr(scene_read, "WHOLE_CELLS", 100)
    varied(case, tmp_path / "whole", **asked)
    monkeypatch.setattr(reach, "BLOCK_CELLS", 8)
    monkeypatch.setattr(scene_window, "WHOLE_CELLS", 100)
    monkeypatch.setattr(scene_window, "SLOPE_LEAST", 20.0)
    monkeypatch.setattr(scene_window, "SLOPE_MOST", 20.0)
    seen = StopIn(-1)
    varied(case, tmp_path / "window", seen, **asked)
    assert any("is read wider" in note for note in seen.notes), seen.notes
    assert (tmp_path / "whole" / "runs.csv").read_bytes() == (tmp_path / "window" / "runs.csv").read_bytes()
