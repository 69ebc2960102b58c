"""Lateral spread through files: azimuths by hand, across north, what is left out, each release for itself."""

from __future__ import annotations

import sys
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely

from deadwood_algorithms import lateral_spread
from deadwood_algorithms.tool import UserError

sys.path.insert(0, str(Path(__file__).parent))  # importlib mode leaves siblings to us

from slope_case import EAST, NORTH, Case, summary, write_layer


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


def test_deposits_nearer_than_a_log_length_do_not_count(tmp_path):
    layer = deposits(tmp_path / "d.gpkg", [170.0, 190.0, 45.0, 300.0], [50.0, 50.0, 9.9, 10.1], length_m=[10.0] * 4)
    fan, each = spread(layer, tmp_path / "s.gpkg")
    assert fan["n"].tolist() == [4]
    assert fan["n_left_out"].tolist() == [1]
    assert fan["spread_deg"].tolist() == pytest.approx([130.0])
    assert each["counted"].tolist() == [True, True, False, True]
    fan, _ = spread(layer, tmp_path / "s.gpkg", min_runout=20.0)
    assert fan["n_left_out"].tolist() == [2]
    assert fan["spread_deg"].tolist() == pytest.approx([20.0])
    fan, _ = spread(layer, tmp_path / "s.gpkg", min_runout=0.0)
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
    fan, each = spread(layer, tmp_path / "s.gpkg", min_runout=5.0)
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
            assert row.p05_p95_deg == pytest.approx(told[row.release_id]["p05_p95_deg"], abs=1e-6)
            assert row.n_left_out == told[row.release_id]["n_left_out"]


def test_what_is_missing_is_named(tmp_path):
    without = write_layer(tmp_path / "d.gpkg", [shapely.Point(1, 1)], log_id=[1], release_x=[EAST])
    with pytest.raises(UserError, match="'release_y' is missing"):
        spread(without, tmp_path / "s.gpkg")
    short = write_layer(tmp_path / "e.gpkg", [shapely.Point(1, 1)], release_x=[EAST], release_y=[NORTH])
    with pytest.raises(UserError, match="--min-runout"):
        spread(short, tmp_path / "s.gpkg")
    assert not (tmp_path / "s.gpkg").exists()
