"""assess-mobilisation against the engine called directly, counts by hand, and the same ground in windows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import rasterio
import shapely
from scipy.stats import binomtest
from slope_case import EAST, LENGTH, NORTH, WIDTH, Case, points, write_layer

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.prepare.mobilisation import cells as cells_module
from deadwood_algorithms.prepare.mobilisation import slides as slides_module
from deadwood_algorithms.scene import reach
from deadwood_algorithms.simulate import windows
from deadwood_algorithms.stats.draws import LOG_PLACE, uniforms
from deadwood_algorithms.tools import assess_mobilisation, sample_releases
from deadwood_engine import FIDELITIES, Lines, Logs, Scene, Trees, slide

LOG = {"dbh_cm": 40.0, "length_m": 10.0, "time_limit_s": 60.0}
CELL_M, NX = 10.0, 6  # of the result, on 60 x 100 m


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


class Assessed:
    """What a run of the tool made; bands with row 0 south."""

    def __init__(self, folder: Path, feedback: Any = None, **values: Any) -> None:
        folder.mkdir(exist_ok=True)
        self.folder = folder
        places = {"output": "m.tif", "release_areas": "areas.gpkg"}
        places |= {"assessed": "deadwood.gpkg"} if values.get("deadwood") else {}
        given = {name: str(folder / place) for name, place in places.items()} | {"friction": "0.25"} | LOG | values
        self.outcome = assess_mobilisation.TOOL(feedback=feedback, **given)
        with rasterio.open(given["output"]) as source:
            self.bands = {str(name): source.read(k + 1)[::-1] for k, name in enumerate(source.descriptions)}
            self.bounds = source.bounds

    def __getitem__(self, band: str) -> np.ndarray:
        return self.bands[band]

    @property
    def areas(self) -> gpd.GeoDataFrame:
        return gpd.read_file(self.folder / "areas.gpkg", layer="release_areas")

    def logs(self, layer: str) -> gpd.GeoDataFrame:
        return gpd.read_file(self.folder / "deadwood.gpkg", layer=layer)


def places_of(cell: int, per_cell: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ids of a cell's logs, and their places, by the rule that the tool states."""
    log_id = cell * per_cell + np.arange(per_cell)
    u, v = uniforms(seed, log_id, LOG_PLACE)
    return log_id, EAST + (cell % NX + u) * CELL_M, NORTH + (cell // NX + v) * CELL_M


def test_a_cell_has_the_shares_of_the_engine_called_directly(case, tmp_path):
    """Heights, trees and the road put together here; lying logs that point 70 degrees off north, three frictions."""
    values = {"orientation": "lying", "azimuth_deg": 70.0, "logs_per_cell": 7, "seed": 3}
    found = Assessed(
        tmp_path, dem=case.dem, trees=case.trees, lines=f"{case.lines}", friction="0.3", friction_range="0.2-0.65",
        start_m=4.0, **values,
    )  # fmt: skip
    with rasterio.open(case.dem) as source:
        heights = source.read(1)[::-1].astype(float)
    stems = gpd.read_file(case.trees)
    trees = Trees(
        stems.geometry.x.to_numpy(), stems.geometry.y.to_numpy(),
        stems["dbh_cm"].to_numpy() / 100.0, stems["height_m"].to_numpy(),
    )  # fmt: skip
    roads = gpd.read_file(case.lines).geometry
    parts = [shapely.get_coordinates(each) for each in roads]
    lines = Lines(np.concatenate(parts), np.concatenate([[0], np.cumsum([len(each) for each in parts])]))
    seen = set()
    for cell in (2 * NX + 3, 4 * NX + 1, 6 * NX + 4, 8 * NX + 2):
        log_id, x, y = places_of(cell, 7, 3)
        n = log_id.size
        logs = Logs(
            log_id=log_id + 1, x=x, y=y, diameter=np.full(n, 0.4), length=np.full(n, 10.0), density=np.full(n, 300.0),
            orientation=np.ones(n, np.int8), tilt=np.zeros(n), azimuth=np.full(n, np.radians(70.0)),
            speed=np.zeros(n), drop=np.zeros(n),
        )  # fmt: skip
        starts, far, reaches = [], [], []
        for mu in (0.2, 0.3, 0.65):
            scene = Scene.prepare(heights, 1.0, EAST + 0.5, NORTH + 0.5, friction=mu, trees=trees, lines=lines)
            did = slide(scene, logs, FIDELITIES["draft"], time_limit=60.0, rolling_friction=0.1, rest_speed=0.1)
            runout = np.hypot(*(did.end_position - did.release_position)[:, :2].T)
            starts.append(runout > 4.0)
            far.append(runout > 10.0)
            reaches.append(did.reach.any(axis=1))
        here = cell // NX, cell % NX
        for name, times in (("starts", starts), ("goes_far", far), ("reaches", reaches)):
            assert found[name][here] == pytest.approx(np.mean(times), abs=1e-6), (cell, name)
        assert found["n_logs"][here] == 7
        seen |= {round(float(np.mean(each)), 3) for each in (starts, far, reaches)}
    assert len(seen) > 4, "the cells differ, and the outcomes"


def test_intervals_are_wilsons_for_the_number_of_logs(case, tmp_path):
    """With one friction, of every cell and every outcome; of an area all logs of its cells together."""
    found = Assessed(
        tmp_path, dem=case.dem, trees=case.trees, lines=case.lines, friction_range="0.25-0.25", logs_per_cell=6,
        threshold=0.5,
    )  # fmt: skip
    for name in ("starts", "goes_far", "reaches"):
        for share, low, high, n in zip(
            *(found[each].ravel() for each in (name, f"{name}_ci_low", f"{name}_ci_high", "n_logs")), strict=True
        ):
            told = binomtest(round(float(share * n)), int(n)).proportion_ci(method="wilson")
            assert (low, high) == pytest.approx((told.low, told.high), abs=1e-5)
    x, y = (np.arange(size) * CELL_M + CELL_M / 2 for size in (NX, 10))
    for row in found.areas.itertuples():
        local = shapely.transform(row.geometry, lambda p: p - (EAST, NORTH))
        inside = shapely.contains_xy(local, *np.meshgrid(x, y))
        assert (found["goes_far"][inside] >= 0.5).all()
        n = int(found["n_logs"][inside].sum())
        for name in ("starts", "goes_far", "reaches"):
            count = round(float((found[name] * found["n_logs"])[inside].sum()))
            told = binomtest(count, n).proportion_ci(method="wilson")
            record = [getattr(row, each) for each in ("n_logs", name, f"{name}_ci_low", f"{name}_ci_high")]
            assert record == pytest.approx([n, count / n, told.low, told.high], abs=1e-6)
        assert row.slope_mean_deg == pytest.approx(found["slope_deg"][inside].mean(), abs=1e-4)
    with rasterio.open(case.dem) as dem:
        known = shapely.box(*dem.bounds).buffer(-0.5 * dem.res[0], join_style="mitre")  # to the outermost heights
    centres = np.argwhere(found["goes_far"] >= 0.5)[:, ::-1] * CELL_M + CELL_M / 2 + (EAST, NORTH)
    cells = shapely.box(*(centres - CELL_M / 2).T, *(centres + CELL_M / 2).T)
    assert found.areas["area_m2"].sum() == pytest.approx(shapely.area(shapely.intersection(cells, known)).sum())


def test_the_summary_has_the_counts_of_each_friction(case, tmp_path):
    found = Assessed(tmp_path, dem=case.dem, lines=case.lines, trees=case.trees, logs_per_cell=2)
    band = found.outcome.facts["friction_band"]
    of_all = [each for each in band if each["line_id"] is None]
    assert [each["friction"] for each in of_all] == [0.2, 0.25, 0.3] * 3
    for name in ("starts", "goes_far", "reaches"):
        mine = [each["n_reach"] for each in of_all if each["outcome"] == name]
        assert mine == sorted(mine, reverse=True), "less friction, more logs"
        assert sum(mine) / 3.0 == pytest.approx((found[name] * found["n_logs"]).sum(), abs=1e-3)
    by_line = {each["line_id"] for each in band} - {None}
    assert by_line == {"road", "house"}


def test_a_log_that_only_falls_over_has_not_started(case, tmp_path):
    """On the flat, farther than a log from its sides, an upright log falls, and its centre moves by almost 5 m."""
    on_flat = np.s_[1:2, 2:4]
    for orientation in ("upright", "lying"):
        found = Assessed(tmp_path / orientation, dem=case.dem, orientation=orientation, start_m=1.0)
        assert not found["starts"][on_flat].any()
        assert found["starts"][6:, 1:5].min() > 0.9, "35 degrees, and friction of 0.3 at most"
    assert found["slope_deg"][6:9, 1:5] == pytest.approx(35.0, abs=0.01)
    assert found["slope_deg"][:2] == pytest.approx(0.0, abs=1e-3)


def test_a_layer_of_friction_varies_like_its_number(case, tmp_path):
    polygons = write_layer(tmp_path / "mu.gpkg", [shapely.box(-1.0, -1.0, 61.0, 101.0)], friction=[0.25])
    number = Assessed(tmp_path / "number", dem=case.dem, logs_per_cell=2)
    layer = Assessed(tmp_path / "layer", dem=case.dem, logs_per_cell=2, friction=polygons)
    assert_same(number, layer)


def assert_same(one: Assessed, other: Assessed) -> None:
    assert list(one.bands) == list(other.bands)
    for name, values in one.bands.items():
        assert np.array_equal(values, other[name], equal_nan=True), name
    assert one.areas.drop(columns="geometry").equals(other.areas.drop(columns="geometry"))
    assert one.areas.geometry.geom_equals(other.areas.geometry).all()


def test_windows_and_threads_change_no_bit(case, tmp_path, monkeypatch):
    """The same with blocks of 2 x 2 cells, each on its own window, which must grow for some of them."""
    values = {"dem": case.dem, "trees": case.trees, "lines": case.lines, "logs_per_cell": 2, "orientation": "random"}
    whole = Assessed(tmp_path / "whole", threads=1, **values)
    assert_same(whole, Assessed(tmp_path / "threads", threads=3, **values))
    for module in (cells_module, slides_module, windows):
        monkeypatch.setattr(module, "WHOLE_CELLS", 100, raising=False)
    monkeypatch.setattr(cells_module, "BLOCK", 2)
    monkeypatch.setattr(reach, "BLOCK_CELLS", 8)
    read: list[tuple[int, int]] = []
    scene_on = slides_module.scene_on

    def seen(simulation, part, feedback):
        read.append((part.columns, part.rows))
        return scene_on(simulation, part, feedback)

    monkeypatch.setattr(slides_module, "scene_on", seen)
    assert_same(whole, Assessed(tmp_path / "parts", **values))
    assert len(read) == 3 * 5
    assert min(columns * rows for columns, rows in read) < WIDTH * LENGTH


def test_fewer_logs_are_some_of_all_and_leave_cells_empty(case, tmp_path):
    values = {"dem": case.dem, "logs_per_cell": 2, "seed": 5}
    every, some = Assessed(tmp_path / "all", **values), Assessed(tmp_path / "some", logs=25, **values)
    assert some["n_logs"].sum() == 25
    assert np.isnan(some["starts"][some["n_logs"] == 0]).all()
    full = some["n_logs"] == 2
    assert full.any()
    assert np.array_equal(some["starts"][full], every["starts"][full])


def test_logs_start_within_the_ground_that_is_named(case, tmp_path):
    within = write_layer(tmp_path / "within.gpkg", [shapely.box(20.0, 50.0, 40.0, 95.0)])
    found = Assessed(tmp_path / "part", dem=case.dem, within=within, logs_per_cell=3)
    here = np.zeros((10, NX), bool)
    here[5:10, 2:4] = True
    assert (found["n_logs"] > 0).sum() <= here.sum()
    assert not found["n_logs"][~here].any()
    assert (found["n_logs"][5:9, 2:4] == 3).all()


def placed(per_cell: int) -> int:
    """Number of logs on the whole slope: the surface begins and ends half a cell of 1 m inside its sides."""
    _, x, y = (np.concatenate(each) for each in zip(*(places_of(k, per_cell, 0) for k in range(60)), strict=True))
    return int(((np.abs(x - EAST - 30.0) <= 29.5) & (np.abs(y - NORTH - 50.0) <= 49.5)).sum())


def test_a_plan_writes_nothing_beside_it_either(case, tmp_path):
    outcome = assess_mobilisation.TOOL(
        dem=case.dem, output=str(tmp_path / "m.tif"), release_areas=str(tmp_path / "a.gpkg"), plan=True, **LOG
    )
    assert outcome.facts["logs"] == 3 * placed(5)
    assert not list(tmp_path.iterdir())


def test_the_cost_is_said_before(case, tmp_path, said):
    Assessed(tmp_path, said, dem=case.dem, logs_per_cell=2)
    assert any(f"60 cells of 10 m with {placed(2)} logs" in each for each in said.notes)
    assert any(f"{3 * placed(2)} to slide" in each for each in said.notes)


def test_areas_and_shares_feed_sample_releases(case, tmp_path):
    """The shares may be on coarser cells than the terrain model, and are weights inside the areas or alone."""
    found = Assessed(tmp_path, dem=case.dem, logs_per_cell=2, threshold=0.5)
    releases, weights = str(tmp_path / "releases.gpkg"), str(tmp_path / "m.tif")
    sample_releases.TOOL(areas=str(tmp_path / "areas.gpkg"), weights=weights, dem=case.dem, count=50, output=releases)
    logs = gpd.read_file(releases, layer="releases")
    assert logs.geometry.within(found.areas.union_all().buffer(1e-6)).all()
    sample_releases.TOOL(weights=weights, dem=case.dem, count=200, output=releases, overwrite=True)
    logs = gpd.read_file(releases, layer="releases")
    row, column = (
        ((at - low) // CELL_M).astype(int) for at, low in ((logs.geometry.y, NORTH), (logs.geometry.x, EAST))
    )
    assert (found["starts"][row, column] > 0.0).all()
    assert len(found.outcome.then.split("--areas")) == 2
    assert "--dbh-cm 40" in found.outcome.then


def test_deadwood_is_split_by_the_ground_and_its_decay_stands_beside(case, tmp_path, said):
    """Three on the steep slope, whatever their decay, one on the flat, one off the DEM."""
    logs = write_layer(
        tmp_path / "logs.gpkg", points((30.0, 75.0), (30.0, 85.0), (25.0, 75.0), (30.0, 15.0), (90.0, 75.0)),
        tree_id=list("abcde"), decay_stage=["late II", "V", None, "late II", "2"],
    )  # fmt: skip
    found = Assessed(tmp_path / "out", said, dem=case.dem, deadwood=logs, logs_per_cell=3, threshold=0.5)
    good, others = found.logs("candidates"), found.logs("others")
    assert dict(zip(good["tree_id"], good["decay"], strict=True)) == {"a": "critical", "b": "outside", "c": "unknown"}
    assert dict(zip(others["tree_id"], others["reason"], strict=True)) == {"d": "ground", "e": "off_dem"}
    assert good["starts"].tolist() == pytest.approx([float(found["starts"][r, c]) for r, c in ((7, 3), (8, 3), (7, 2))])
    assert found.areas["n_candidates"].sum() == 3
    assert any("the decay of 1 of 5 points is unknown" in note for note in said.notes)


def test_what_is_not_known_of_a_species_is_reported(case, tmp_path, said):
    """The decay of beech snags is unknown; unknown species and those without rate are reported."""
    logs = write_layer(
        tmp_path / "logs.gpkg", points(*[(30.0, 75.0)] * 5), years_dead=[9.0] * 5,
        species=["Buche", "Buche", "Buche", "sapin", "Mammutbaum"], standing=[1, 0, None, 1, 1],
    )  # fmt: skip
    found = Assessed(tmp_path / "out", said, dem=case.dem, deadwood=logs, logs_per_cell=1)
    assert found.logs("candidates")["decay"].tolist() == ["unknown", *["outside"] * 4]
    told = " ".join(said.notes)
    assert "sapin" in told
    assert "Mammutbaum" in told


def test_fields_of_other_names_and_numbers_as_stages(case, tmp_path):
    columns = {"class_": [3.0, 2.75, 1.0], "dead": [9.0, 2.5, 3.0], "art": ["Buche"] * 3}
    logs = write_layer(tmp_path / "logs.gpkg", points(*[(30.0, 75.0)] * 3), **columns)
    values = {"dem": case.dem, "deadwood": logs, "logs_per_cell": 1}
    found = Assessed(tmp_path / "stage", stage_field="class_", **values)
    assert found.logs("candidates")["decay"].tolist() == ["possible", "critical", "outside"]
    found = Assessed(
        tmp_path / "years", years_field="dead", species_field="art", years_from=4.0, years_to=5.0, **values
    )
    # beech: 2.4 to 3.1 years
    assert found.logs("candidates")["decay"].tolist() == ["outside", "critical", "critical"]


# --- errors


def one(folder: Path, **columns) -> str:
    return write_layer(folder / "logs.gpkg", points((30.0, 75.0)), **columns)


BAD = {
    "a range": (
        lambda _: {"friction_range": "0.2 to 0.3"},
        "--friction-range is '0.2 to 0.3', but must be two numbers",
    ),
    "a range elsewhere": (lambda _: {"friction_range": "0.3-0.4"}, "with --friction 0.25 between them"),
    "a range of a layer": (
        lambda f: {"friction_range": "0.2-0.3", "friction": write_layer(f / "mu.gpkg", [], mu=[])},
        "--friction-range is of a number, but --friction is",
    ),
    "no lines": (lambda _: {"areas_by": "reaches"}, "--areas-by reaches needs --lines"),
    "a size": (lambda _: {"length_m": 0.001}, "--length-m: 0.001 is not"),
    "ground elsewhere": (
        lambda f: {"within": write_layer(f / "w.gpkg", [shapely.box(900.0, 0.0, 950.0, 9.0)])},
        "w.gpkg: no log can be released there",
    ),
    "years": (lambda _: {"years_to": 1.0}, "--years-from 2 is above --years-to 1"),
    "nothing to judge": (lambda f: {"assessed": str(f / "x.gpkg")}, "--assessed needs --deadwood"),
    "no judgement": (lambda f: {"deadwood": one(f)}, "--deadwood needs --assessed"),
    "a stage": (
        lambda f: {"deadwood": one(f, decay_stage=["rotten"]), "assessed": str(f / "x.gpkg")},
        "logs.gpkg, layer 'logs', field 'decay_stage', row 1: 'rotten' is not a stage of decay",
    ),
    "years of text": (
        lambda f: {"deadwood": one(f, years_dead=[-1.0]), "assessed": str(f / "x.gpkg")},
        "field 'years_dead', row 1: -1 is not a number at least 0",
    ),
    "a field": (
        lambda f: {"deadwood": one(f, a=[1]), "assessed": str(f / "x.gpkg"), "stage_field": "b"},
        "there is no field 'b' (--stage-field); it has the fields a",
    ),
    "another country": (
        lambda f: {"deadwood": write_layer(f / "l.gpkg", points((9e5, 0.0))), "assessed": str(f / "x.gpkg")},
        "no point lies on the DEM",
    ),
    "a threshold": (lambda _: {"threshold": 0.0}, "--threshold is 0, but must be greater than 0"),
    "a name": (lambda f: {"release_areas": str(f / "areas.shp")}, "the output must be a .gpkg file"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_reported_in_one_line_and_leaves_nothing(case, tmp_path, name):
    make, said_of_it = BAD[name]
    values = {"dem": case.dem, "output": str(tmp_path / "m.tif")} | make(tmp_path)
    before = sorted(tmp_path.iterdir())
    with pytest.raises(UserError) as raised:
        assess_mobilisation.TOOL(**values)
    assert said_of_it in str(raised.value)
    assert "\n" not in str(raised.value)
    assert sorted(tmp_path.iterdir()) == before
