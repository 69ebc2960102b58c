"""Lateral spread through files: azimuths by hand, across north, omitted deposits, each release separately."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hand_run import Track, write_run
from slope_case import EAST, NORTH, Case, summary, write_dem, write_layer

from deadwood_algorithms import schemas
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.tools import lateral_spread


def deposits(path: Path, azimuths: list[float], distances: list[float], **columns) -> str:
    """Deposits around a release point at (0, 0)."""
    shapes = [
        shapely.Point(d * np.sin(np.radians(a)), d * np.cos(np.radians(a)))
        for a, d in zip(azimuths, distances, strict=True)
    ]
    n = len(shapes)
    facts = {"log_id": np.arange(n), "release_id": [1] * n, "length_m": [10.0] * n}
    return write_layer(path, shapes, **(facts | {"release_x": [EAST] * n, "release_y": [NORTH] * n} | columns))


def spread(layer: str, path: Path, **changes) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame]:
    lateral_spread.TOOL(deposits=layer, output=str(path), overwrite=True, **changes)
    return gpd.read_file(path, layer="spread"), gpd.read_file(path, layer="azimuths")


def test_350_to_10_degrees_is_20(tmp_path):
    fan, each = spread(deposits(tmp_path / "d.gpkg", [350.0, 0.0, 10.0], [100.0] * 3), tmp_path / "s.gpkg")
    assert fan["spread_deg"].tolist() == pytest.approx([20.0])
    assert fan["from_deg"].tolist() == pytest.approx([350.0])
    assert each["azimuth_deg"].tolist() == pytest.approx([350.0, 0.0, 10.0])
    assert each["distance_m"].tolist() == pytest.approx([100.0] * 3)


def test_a_table_names_no_crs_so_an_option_does(tmp_path):
    place = tmp_path / "d.csv"
    rows = [f"{EAST + x},{NORTH + y},{EAST},{NORTH},10" for x, y in ((0.0, 50.0), (50.0, 0.0))]
    place.write_text("\n".join(["x,y,release_x,release_y,length_m", *rows]))
    with pytest.raises(UserError, match="has no CRS; name it, for example --crs"):
        spread(str(place), tmp_path / "s.gpkg")
    fan, _ = spread(str(place), tmp_path / "s.gpkg", crs="EPSG:2056")
    assert fan["spread_deg"].tolist() == pytest.approx([90.0])
    assert fan.crs.to_epsg() == 2056


def test_deposits_nearer_than_a_log_length_do_not_count(tmp_path):
    layer = deposits(tmp_path / "d.gpkg", [170.0, 190.0, 45.0, 300.0], [50.0, 50.0, 9.9, 10.1], length_m=[10.0] * 4)
    fan, each = spread(layer, tmp_path / "s.gpkg")
    assert fan["n"].tolist() == [4]
    assert fan["n_left_out"].tolist() == [1]
    assert fan["spread_deg"].tolist() == pytest.approx([130.0])
    assert each["counted"].tolist() == [True, True, False, True]
    fan, _ = spread(layer, tmp_path / "s.gpkg", min_runout_m=20.0)
    assert fan["n_left_out"].tolist() == [2]
    assert fan["spread_deg"].tolist() == pytest.approx([20.0])
    fan, _ = spread(layer, tmp_path / "s.gpkg", min_runout_m=0.0)
    assert fan["n_left_out"].tolist() == [0]


def test_each_release_is_seen_from_its_own_centre(tmp_path):
    shapes = [shapely.Point(0, -50), shapely.Point(50, 0), shapely.Point(500, 50), shapely.Point(500, 60)]
    layer = write_layer(
        tmp_path / "d.gpkg",
        shapes,
        log_id=[1, 2, 3, 4],
        release_id=["west", "west", "east", "east"],
        release_x=[EAST - 5.0, EAST + 5.0, EAST + 499.0, EAST + 501.0],
        release_y=[NORTH] * 4,
    )
    fan, each = spread(layer, tmp_path / "s.gpkg", min_runout_m=5.0)
    assert fan["release_id"].tolist() == ["west", "east"]
    assert fan["spread_deg"].tolist() == pytest.approx([90.0, 0.0])
    assert each["azimuth_deg"].tolist() == pytest.approx([180.0, 90.0, 0.0, 0.0])


def test_the_sector_on_the_map_holds_the_counted_deposits(tmp_path):
    rng = np.random.default_rng(5)
    layer = deposits(tmp_path / "d.gpkg", list(rng.normal(350.0, 20.0, 80) % 360.0), list(20.0 + 80.0 * rng.random(80)))
    fan, each = spread(layer, tmp_path / "s.gpkg")
    shape = fan.geometry.iloc[0].buffer(0.1)
    assert shape.covers(shapely.MultiPoint(list(each.geometry)))
    full = np.pi * fan["runout_max_m"].iloc[0] ** 2
    assert fan.geometry.iloc[0].area == pytest.approx(full * fan["spread_deg"].iloc[0] / 360.0, rel=1e-3)
    assert fan["p05_p95_deg"].iloc[0] < fan["spread_deg"].iloc[0]


def test_one_log_has_a_direction_and_no_spread(tmp_path):
    """Before: 0 degrees, as if all logs of the release went the same way."""
    fan, each = spread(deposits(tmp_path / "d.gpkg", [10.0, 20.0], [50.0, 5.0]), tmp_path / "s.gpkg", min_runout_m=20.0)
    assert fan["n_left_out"].tolist() == [1]
    angles = ["spread_deg", "p05_p95_deg", "p05_p95_ci_low_deg", "p05_p95_ci_high_deg", "spread_half_deg"]
    assert fan[angles].isna().to_numpy().all()
    assert each["azimuth_deg"].tolist() == pytest.approx([10.0, 20.0])


def test_when_no_log_went_far_there_is_no_angle(tmp_path):
    fan, _ = spread(deposits(tmp_path / "d.gpkg", [10.0, 20.0], [5.0, 5.0]), tmp_path / "s.gpkg")
    assert fan["n_left_out"].tolist() == [2]
    assert fan["spread_deg"].isna().all()


def test_a_runs_folder_gives_the_summarys_figures(tmp_path):
    case = Case(tmp_path / "case")
    run = case.run(trees=case.trees)
    told = {each["release_id"]: each for each in summary(run)["spread"]}
    for layer in (str(run), str(run / "run.gpkg"), f"{run / 'run.gpkg'}|layername=deposits"):
        fan, _ = spread(layer, tmp_path / "s.gpkg")
        for row in fan.itertuples():
            assert row.spread_deg == pytest.approx(told[row.release_id]["spread_deg"], abs=1e-6)
            assert row.p05_p95_deg == pytest.approx(
                told[row.release_id]["p05_p95_deg"] or np.nan, abs=1e-6, nan_ok=True
            )
            assert row.n_left_out == told[row.release_id]["n_left_out"]


def test_what_is_missing_is_named(tmp_path):
    without = write_layer(tmp_path / "d.gpkg", [shapely.Point(1, 1)], log_id=[1], release_x=[EAST])
    with pytest.raises(UserError, match="'release_y' is missing"):
        spread(without, tmp_path / "s.gpkg")
    short = write_layer(tmp_path / "e.gpkg", [shapely.Point(1, 1)], release_x=[EAST], release_y=[NORTH])
    with pytest.raises(UserError, match="--min-runout-m"):
        spread(short, tmp_path / "s.gpkg")
    assert not (tmp_path / "s.gpkg").exists()


def test_the_interval_and_the_halves(tmp_path):
    """Normal azimuths: the interval holds 3.29 standard deviations, and the smallest angle shrinks with the logs."""
    rng = np.random.default_rng(3)
    angles = 180.0 + 10.0 * rng.standard_normal(400)
    layer = deposits(tmp_path / "d.gpkg", list(angles), [100.0] * 400)
    row = spread(layer, tmp_path / "s.gpkg")[0].iloc[0]
    low, high = row["p05_p95_ci_low_deg"], row["p05_p95_ci_high_deg"]
    assert low < row["p05_p95_deg"] < high
    assert low < 32.9 < high
    # A quantile's standard error is sqrt(p q / n) / density = 1.06 degrees: four of two uncorrelated ones are 6.0. The
    # some 20 values in a tail scatter the width by 15 % (300 draws); three times that
    assert 6.0 * 0.55 < high - low < 6.0 * 1.45
    halves = [np.ptp(rng.permutation(angles)[:200]) for _ in range(400)]
    assert row["spread_half_deg"] == pytest.approx(np.mean(halves), abs=1.0)
    assert row["spread_half_deg"] < row["spread_deg"] - 1.0
    # draws belong to the logs: rows in another order, or another release in addition, make no difference
    mixed = rng.permutation(400)
    same = {"release_x": [EAST] * 401, "release_y": [NORTH] * 401, "length_m": [10.0] * 401}
    ids = {"log_id": [*mixed, 400], "release_id": [1] * 400 + [2]}
    other = deposits(tmp_path / "e.gpkg", [*angles[mixed], 20.0], [100.0] * 401, **same, **ids)
    again = spread(other, tmp_path / "t.gpkg")[0].iloc[0]
    names = ["spread_half_deg", "p05_p95_ci_low_deg", "p05_p95_ci_high_deg"]
    assert again[names].tolist() == pytest.approx(row[names].tolist(), abs=1e-9)
    seeded = spread(other, tmp_path / "t.gpkg", seed=1)[0].iloc[0]
    assert seeded["spread_half_deg"] != again["spread_half_deg"]
    assert row["p05_p95_n_more"] == 0


def edge_case(tmp_path: Path) -> tuple[Path, str]:
    """Four logs on 60 x 100 m: one ends 3 m from the border, one 8 m, one in the middle, one has left."""
    dem = write_dem(tmp_path / "flat.tif", flat=True)
    ends = ((30.0, 2.5), (30.0, 7.5), (30.0, 40.0), (59.0, 30.0))
    reasons = ("rest", "rest", "tree", "left_dem")
    tracks = [Track((30.0, 80.0), end, stop_reason=why) for end, why in zip(ends, reasons, strict=True)]
    return write_run(tmp_path / "run", tracks, dem=dem), dem


def test_deposits_near_the_edges_are_warned_of(tmp_path, said):
    run, _ = edge_case(tmp_path)
    for edge_m, near in ((2.0, 0), (5.0, 1), (20.0, 2)):
        values = {"deposits": str(run), "output": str(tmp_path / "s.gpkg"), "overwrite": True, "edge_m": edge_m}
        said.warnings.clear()
        row = lateral_spread.TOOL(feedback=said, **values).facts["spread"][0]
        assert (row["n_left_dem"], row["n_near_edge"]) == (1, near)
        assert "1 of 4 logs left the terrain model, and their further movement is not known" in said.warnings[0]
        assert (f"; {near} more ended within {edge_m:g} m" in said.warnings[0]) == (near > 0)
    each = gpd.read_file(tmp_path / "s.gpkg", layer="azimuths")
    assert each["near_edge"].tolist() == [True, True, False, False]


def test_a_separate_layer_takes_the_dem_that_is_named(tmp_path, said):
    run, dem = edge_case(tmp_path)
    gpd.read_file(run / "run.gpkg", layer="deposits").to_file(tmp_path / "mine.gpkg")
    values = {"deposits": str(tmp_path / "mine.gpkg"), "output": str(tmp_path / "s.gpkg"), "overwrite": True}
    alone = lateral_spread.TOOL(**values).facts["spread"][0]
    assert (alone["n_left_dem"], alone["n_near_edge"]) == (1, 0)
    known = lateral_spread.TOOL(feedback=said, dem=dem, **values).facts["spread"][0]
    assert known["n_near_edge"] == 2
    gpd.read_file(tmp_path / "mine.gpkg").to_crs("EPSG:21781").to_file(tmp_path / "old.gpkg")
    with pytest.raises(UserError, match="the DEM is in EPSG:2056, but the deposits are in EPSG:21781"):
        lateral_spread.TOOL(**(values | {"deposits": str(tmp_path / "old.gpkg")}), dem=dem)
    with pytest.raises(UserError, match="nowhere.tif"):
        lateral_spread.TOOL(**values, dem="nowhere.tif")


@pytest.mark.parametrize("name", ["spread", "azimuths"])
def test_the_layers_are_those_of_the_schema(tmp_path, name):
    run, _ = edge_case(tmp_path)
    written = spread(str(run), tmp_path / "s.gpkg")[["spread", "azimuths"].index(name)]
    assert [column for column in written.columns if column != "geometry"] == [
        column.name for column in schemas.LAYERS[name].columns
    ]


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_no_line_says_nan(tmp_path, count):
    """Few deposits, or none that count: each gives a line, without invalid numbers."""
    far = [100.0] * count + [1.0] * (3 - count)
    layer = deposits(tmp_path / "d.gpkg", [170.0, 180.0, 200.0], far)
    outcome = lateral_spread.TOOL(deposits=layer, output=str(tmp_path / "s.gpkg"))
    assert "release 1: " in "\n".join(outcome.lines)
    assert "nan" not in "\n".join(outcome.lines)
