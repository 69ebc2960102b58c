"""slide-logs through files: every log has its row, the contract's files and columns, determinism, resume, overwrite."""

from __future__ import annotations

import json
import sqlite3
from dataclasses import replace
from pathlib import Path

import geopandas as gpd
import numpy as np
import pyarrow.parquet as parquet
import pytest
import rasterio
import shapely
from slope_case import (
    NORTH,
    RASTERS,
    Case,
    StopAfter,
    assert_same_run,
    layer,
    points,
    raster,
    summary,
    write_dem,
    write_layer,
)

from deadwood_algorithms import schemas
from deadwood_algorithms.params.tool import Cancelled, UserError
from deadwood_algorithms.simulate import chunks, sliding
from deadwood_algorithms.simulate.log_order import keep_by_hash
from deadwood_algorithms.stats.statistics import bounds_if_lost
from deadwood_engine import slide
from deadwood_toolbox import cli


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def full(case) -> Path:
    """A run with trees, barriers and lines, all trajectories kept."""
    return case.run(output=str(case.folder / "full"), threads=1, **case.everything())


def test_every_released_log_has_its_row_in_order(case, full):
    deposits = layer(full, "deposits")
    releases = gpd.read_file(case.releases)
    assert deposits["log_id"].tolist() == releases["log_id"].tolist()
    assert deposits["release_id"].tolist() == releases["release_id"].tolist()
    assert np.allclose(deposits["release_x"], releases.geometry.x, atol=1e-6)
    assert np.allclose(deposits["release_y"], releases.geometry.y, atol=1e-6)
    counts = summary(full)["logs"]["by_stop_reason"]
    assert sum(counts.values()) == len(deposits) == summary(full)["logs"]["released"]
    assert deposits["stop_reason"].value_counts().to_dict() == {k: n for k, n in counts.items() if n}


ABOVE = {"tree_hits_above", "log_hits_above"}  # only with a capacity


def test_the_layers_hold_the_contracts_columns_and_geometries(full):
    for name, kind in (("deposits", "Point"), ("trajectories", "LineString")):
        frame = layer(full, name)
        assert {column.name for column in schemas.LAYERS[name].columns} - ABOVE <= set(frame.columns)
        assert set(frame.geom_type) == {kind}
        assert frame.geometry.has_z.all()
        assert frame.crs.to_epsg() == 2056
    deposits = layer(full, "deposits")
    for column in schemas.LAYERS["deposits"].columns:
        if column.kind == "number" and column.name not in ABOVE:
            faults = [schemas.value_fault(column, float(value)) for value in deposits[column.name]]
            assert not any(faults), (column.name, faults)
    assert parquet.read_table(full / "poses.parquet").column_names == [c.name for c in schemas.LAYERS["poses"].columns]
    with sqlite3.connect(full / "run.gpkg") as package:
        assert package.execute("PRAGMA user_version").fetchone() == (10200,)


def test_numbers_of_a_deposit_agree_with_each_other(full):
    deposits = layer(full, "deposits")
    dx, dy = deposits.geometry.x - deposits["release_x"], deposits.geometry.y - deposits["release_y"]
    assert np.allclose(deposits["runout_m"], np.hypot(dx, dy))
    assert np.allclose(deposits["fall_m"], deposits["release_z"] - shapely.get_z(deposits.geometry.values))
    assert np.allclose(np.sin(np.radians(deposits["bearing_deg"])) * deposits["runout_m"], dx)
    assert np.allclose(np.cos(np.radians(deposits["bearing_deg"])) * deposits["runout_m"], dy)
    lies = layer(full, "deposited_logs")
    for line, heading, tilt in zip(lies.geometry, deposits["heading_deg"], deposits["tilt_deg"], strict=True):
        (xb, yb, zb), (xt, yt, zt) = line.coords
        assert np.hypot(np.hypot(xt - xb, yt - yb), zt - zb) == pytest.approx(10.0)
        assert np.sin(np.radians(tilt)) * np.sin(np.radians(heading)) == pytest.approx((xt - xb) / 10.0, abs=1e-6)
        assert np.cos(np.radians(tilt)) == pytest.approx((zt - zb) / 10.0, abs=1e-6)
    held = deposits["stop_reason"].isin(["tree", "barrier"])
    assert deposits["stop_id"].notna().equals(held)
    trees = deposits.loc[deposits["stop_reason"] == "tree", "stop_id"]
    assert len(trees)
    assert trees.astype(int).between(900, 959).all()  # the tree_id, not the row


def test_trajectories_begin_and_end_with_the_log(full):
    deposits, paths = layer(full, "deposits").set_index("log_id"), layer(full, "trajectories").set_index("log_id")
    assert set(paths.index) == set(deposits.index)
    poses = parquet.read_table(full / "poses.parquet").to_pandas()
    for log_id, rows in poses.groupby("log_id"):
        first, last = np.array(paths.geometry[log_id].coords)[[0, -1]]
        assert first == pytest.approx(rows[["x", "y", "z"]].iloc[0].to_numpy(), abs=1e-9)
        assert last == pytest.approx(rows[["x", "y", "z"]].iloc[-1].to_numpy(), abs=1e-9)
        end = deposits.geometry[log_id]
        assert last == pytest.approx([end.x, end.y, end.z], abs=0.05)
        assert rows["t_s"].is_monotonic_increasing
        assert paths.geometry[log_id].length <= deposits["path_m"][log_id] + 1e-6
        vertices = np.array(paths.geometry[log_id].coords)
        assert np.linalg.norm(np.diff(vertices, axis=0), axis=1).max() < 4.0


def test_the_rasters(full):
    maps = {name: raster(full / f"{name}.tif") for name in RASTERS}
    assert maps["hit_count"].dtype == np.uint32
    assert maps["hit_count"].max() <= 24
    assert maps["hit_count"].shape == (100, 60)
    assert maps["reach_probability"] == pytest.approx(maps["hit_count"] / np.float32(24))
    assert (maps["deposit_count"] <= maps["hit_count"]).all()
    assert maps["deposit_count"].sum() > 0
    untouched = maps["hit_count"] == 0
    for name in ("speed_max", "energy_max", "jump_max"):
        assert np.isnan(maps[name][untouched]).all()
        assert np.isfinite(maps[name][~untouched]).all()
    deposits = layer(full, "deposits")
    assert np.nanmax(maps["speed_max"]) == pytest.approx(deposits["speed_max_ms"].max(), rel=1e-3)
    assert np.nanmax(maps["energy_max"]) == pytest.approx(deposits["energy_max_kj"].max(), rel=1e-3)
    assert np.nanmax(maps["jump_max"]) == pytest.approx(deposits["jump_max_m"].max(), rel=1e-6)
    with rasterio.open(full / "jump_max.tif") as source:
        assert source.descriptions == ("jump_max", "height_max")
        assert source.tags(2)["long_name"].startswith("Greatest height above the terrain of the centre of mass")
        assert source.units == ("m", "m")
        height = source.read(2)
        assert np.array_equal(np.isnan(height), untouched)
        assert np.nanmax(height) == pytest.approx(deposits["height_max_m"].max(), rel=1e-6)
        assert (height > maps["jump_max"])[~untouched].mean() > 0.9  # at the log's middle, not at its underside
    with rasterio.open(full / "energy_max.tif") as source:
        assert source.units == ("kJ",)
        assert source.crs.to_epsg() == 2056


def test_the_summary_agrees_with_the_layers(full):
    told, deposits = summary(full), layer(full, "deposits")
    reach = {each["line_id"]: each for each in told["reach"]}
    assert set(reach) == {"road", "house"}
    by = layer(full, "reached_by")
    for line_id, each in reach.items():
        assert each["n_total"] == 24
        assert each["n_reach"] == (by["line_id"] == line_id).sum()
        assert each["ci_low"] <= each["p"] <= each["ci_high"]
    assert layer(full, "reach").set_index("line_id")["n_reach"].to_dict() == {k: v["n_reach"] for k, v in reach.items()}
    assert reach["road"]["n_reach"] > 0
    assert [each["release_id"] for each in told["spread"]] == ["a", "b"]
    assert all(each["n"] == 12 for each in told["spread"])
    barriers = {each["barrier_id"]: each for each in told["barriers"]}
    for each in barriers.values():
        assert each["n_reached"] == each["n_stopped"] + each["n_overjumped"] + each["n_passed_beside"]
    stopped = deposits.loc[deposits["stop_reason"] == "barrier", "stop_id"].value_counts()
    assert {k: v["n_stopped"] for k, v in barriers.items() if v["n_stopped"]} == stopped.to_dict()
    assert told["speed"]["max_ms"] == deposits["speed_max_ms"].max()
    assert told["speed"]["mean_ms"] == pytest.approx(deposits["speed_mean_ms"].mean())
    assert told["accuracy"]["penetration_max_m"] == deposits["penetration_max_m"].max()
    assert told["accuracy"]["fidelity"] == "draft"
    assert set(told["cost"]) == {"cpu_s", "wall_s", "steps", "logs_per_s", "own_slope_cpu_s"}
    assert "59 rigid truncated cones; 0 off the DEM left out; 1 left out where" in told["modelled"]["trees"]


def test_what_a_scene_lacks_is_reported(case, tmp_path):
    told = summary(case.run(output=str(tmp_path / "bare"), trajectories="none"))
    for name in ("trees", "barriers", "lines"):
        assert told["modelled"][name].startswith("not modelled")
    assert told["reach"] == told["barriers"] == []
    assert told["trees"] is None


def test_an_undisturbed_log_slides_straight_down(case, tmp_path):
    """A plane that falls to the south: bearing 180 from the release, and no sideways step."""
    one = write_layer(tmp_path / "one.gpkg", points((30.25, 80.0)), orientation=["lying"], azimuth_deg=[180.0])
    deposit = layer(case.run(releases=one, output=str(tmp_path / "run")), "deposits").iloc[0]
    assert deposit["bearing_deg"] == pytest.approx(180.0, abs=0.01)
    assert deposit["heading_deg"] == pytest.approx(180.0, abs=0.1)
    assert deposit["log_id"] == 1
    assert deposit["stop_reason"] in ("rest", "left_dem")


@pytest.mark.parametrize(("azimuth", "heading"), [(90.0, 90.0), (-90.0, 270.0), (360.0, 0.0)])
def test_a_log_on_the_flat_keeps_its_azimuth(case, tmp_path, azimuth, heading):
    flat = write_dem(tmp_path / "flat.tif", flat=True)
    one = write_layer(tmp_path / "one.gpkg", points((30.0, 50.0)))
    run = case.run(
        dem=flat, releases=one, output=str(tmp_path / "run"), orientation="lying", azimuth_deg=azimuth, time_limit_s=5.0
    )
    deposit = layer(run, "deposits").iloc[0]
    turn = (deposit["heading_deg"] - heading + 180.0) % 360.0 - 180.0
    assert abs(turn) < 0.5
    assert deposit["tilt_deg"] == pytest.approx(90.0, abs=1.5)  # it lies on its tapered side


def test_columns_of_the_releases_go_before_the_options(case, tmp_path):
    two = write_layer(tmp_path / "two.gpkg", points((20.0, 80.0), (40.0, 80.0)), dbh_cm=[30.0, 60.0])
    deposits = layer(
        case.run(releases=two, output=str(tmp_path / "run"), length_m=12.0, density_kg_m3=400.0), "deposits"
    )
    assert deposits["dbh_cm"].tolist() == [30.0, 60.0]
    assert deposits["length_m"].tolist() == [12.0, 12.0]
    assert deposits["density_kg_m3"].tolist() == [400.0, 400.0]
    assert deposits["release_id"].tolist() == [1, 1]


def test_a_log_that_fails_leaves_its_state_and_the_others_continue(case, tmp_path, monkeypatch):
    """A speed beyond any fall on Earth counts as a defect: 3000 m/s (which no layer may give), among logs at rest."""

    def shot(scene, logs, *rest, **options):
        return slide(scene, replace(logs, speed=100.0 * logs.speed), *rest, **options)

    monkeypatch.setattr(sliding, "slide", shot)
    three = write_layer(
        tmp_path / "three.gpkg", points((20.0, 80.0), (30.0, 80.0), (40.0, 80.0)), log_id=[4, 7, 9],
        speed_ms=[0.0, 30.0, 0.0], azimuth_deg=[180.0] * 3,
    )  # fmt: skip
    run = case.run(releases=three, output=str(tmp_path / "run"))
    deposits = layer(run, "deposits").set_index("log_id")
    assert deposits["stop_reason"].eq("failed").tolist() == [False, True, False]
    (state,) = json.loads((run / "failed.json").read_text())["logs"]
    assert state["log_id"] == 7
    assert state["position_m"] == pytest.approx([*deposits.geometry[7].coords[0]])
    assert np.hypot(*state["velocity_ms"][:2]) > 2000.0
    assert np.linalg.norm(state["quaternion_wxyz"]) == pytest.approx(1.0)
    alone = case.run(releases=three, output=str(tmp_path / "alone"), threads=1)
    assert_same_run(run, alone)


def test_threads_do_not_change_a_bit(case, full, tmp_path):
    assert_same_run(full, case.run(output=str(tmp_path / "four"), threads=4, **case.everything()))


def test_the_order_of_the_releases_does_not_matter_to_a_log(case, full, tmp_path):
    frame = gpd.read_file(case.releases).sample(frac=1.0, random_state=3)
    frame.to_file(tmp_path / "shuffled.gpkg")
    run = case.run(releases=str(tmp_path / "shuffled.gpkg"), output=str(tmp_path / "run"), **case.everything())
    ours, theirs = (layer(each, "deposits").set_index("log_id").sort_index() for each in (run, full))
    assert ours.drop(columns="geometry").equals(theirs.drop(columns="geometry"))
    assert np.array_equal(raster(run / "hit_count.tif"), raster(full / "hit_count.tif"))


def test_the_manifest_works_as_a_config(case, full, tmp_path, capsys):
    manifest = json.loads((full / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["tool"] == "slide-logs"
    status = cli.run(
        ["slide-logs", "--config", str(full / "manifest.json"), "--output", str(tmp_path / "again"), "--quiet"]
    )
    assert status == 0, capsys.readouterr().err
    assert_same_run(full, tmp_path / "again")


@pytest.mark.parametrize("every_s", [0.0, 1e9])
def test_a_resumed_run_is_the_uninterrupted_run(case, full, tmp_path, monkeypatch, said, every_s):
    monkeypatch.setattr(chunks, "CHUNK", 5)
    monkeypatch.setattr(chunks, "CHECKPOINT_S", every_s)
    monkeypatch.setattr(chunks, "CHECKPOINT_SHARE", 1e-12)
    output = tmp_path / "run"
    with pytest.raises(Cancelled):
        case.run(StopAfter(11), output=str(output), **case.everything())
    assert not output.exists()
    assert (tmp_path / ".run.part").is_dir()
    before = len(list((tmp_path / ".run.part").glob("rasters_*.npz")))
    assert before == (2 if every_s == 0.0 else 0)  # the last one, and the one before it, should the last be damaged

    with pytest.raises(UserError, match="begun with other .*DEM, friction") as error:
        case.run(output=str(output), resume=True, **(case.everything() | {"friction": "0.3"}))
    assert "\n" not in str(error.value)

    case.run(said, output=str(output), resume=True, threads=2, **case.everything())
    assert_same_run(full, output)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["run"]


def test_unfinished_work_is_continued_or_given_up_never_forgotten(case, tmp_path, monkeypatch):
    monkeypatch.setattr(chunks, "CHUNK", 5)
    monkeypatch.setattr(chunks, "CHECKPOINT_S", 0.0)
    output, part = str(tmp_path / "run"), tmp_path / ".run.part"
    with pytest.raises(Cancelled):
        case.run(StopAfter(11), output=output)
    kept = {each.name: each.read_bytes() for each in part.iterdir()}
    for changes in ({}, {"friction": "0.3"}, {"resume": True, "restart": True}):
        with pytest.raises(UserError, match="--resume .*--restart"):
            case.run(output=output, **changes)
        assert {each.name: each.read_bytes() for each in part.iterdir()} == kept
    anew = case.run(output=output, restart=True, friction="0.3")
    assert json.loads((anew / "manifest.json").read_text())["parameters"]["friction"] == 0.3
    assert not part.exists()


def test_an_existing_run_is_kept_unless_overwrite(case, tmp_path):
    run = case.run(output=str(tmp_path / "run"), trajectories="none")
    before = (run / "summary.json").read_bytes()
    with pytest.raises(UserError, match="--overwrite"):
        case.run(output=str(run), friction="0.5")
    assert (run / "summary.json").read_bytes() == before
    case.run(output=str(run), overwrite=True, friction="0.5", trajectories="none")
    assert (run / "summary.json").read_bytes() != before


def test_how_many_trajectories_are_kept(case, tmp_path):
    none = case.run(output=str(tmp_path / "none"), trajectories="none")
    assert parquet.read_table(none / "poses.parquet").num_rows == 0
    assert "trajectories" not in set(gpd.list_layers(none / "run.gpkg")["name"])
    seven = case.run(output=str(tmp_path / "seven"), trajectories="7")
    kept = layer(seven, "trajectories")["log_id"]
    assert kept.nunique() == len(kept) == 7
    assert np.array_equal(raster(none / "hit_count.tif"), raster(seven / "hit_count.tif"))
    with pytest.raises(UserError, match="--trajectories is 'some'"):
        case.run(output=str(tmp_path / "some"), trajectories="some")


def test_the_choice_of_trajectories_depends_on_seed_and_id_alone():
    ids = np.random.default_rng(0).permutation(10_000)
    kept = set(ids[keep_by_hash(ids, 1000, 0)])
    again = np.sort(ids)
    assert kept == set(again[keep_by_hash(again, 1000, 0)])
    assert len(kept) == 1000
    other = set(again[keep_by_hash(again, 1000, 1)])
    assert 50 < len(kept & other) < 150  # another seed, another tenth
    assert set(again[keep_by_hash(again, 100, 0)]) < kept
    assert 400 < sum(each < 5000 for each in kept) < 600


def test_layers_in_another_crs_are_reprojected(case, tmp_path, said):
    releases = gpd.read_file(case.releases).to_crs("EPSG:21781")
    releases.to_file(tmp_path / "releases.gpkg")
    lines = gpd.read_file(case.lines).to_crs("EPSG:4326")
    lines.to_file(tmp_path / "lines.gpkg")
    run = case.run(
        said, releases=str(tmp_path / "releases.gpkg"), lines=str(tmp_path / "lines.gpkg"), output=str(tmp_path / "run")
    )
    plain = case.run(lines=case.lines, output=str(tmp_path / "plain"))
    ours, theirs = layer(run, "deposits"), layer(plain, "deposits")
    assert np.allclose(ours["release_x"], theirs["release_x"], atol=0.01)
    assert np.allclose(ours["release_y"], theirs["release_y"], atol=0.01)
    assert ours.crs.to_epsg() == 2056
    assert summary(run)["reach"][0]["n_reach"] == summary(plain)["reach"][0]["n_reach"]
    assert sum("reprojected" in note for note in said.notes) == 2


def test_a_log_released_inside_a_house_has_reached_it(case, tmp_path):
    house = write_layer(tmp_path / "house.gpkg", [shapely.box(5.0, 60.0, 55.0, 95.0)], name=["hut"])
    told = summary(case.run(lines=house, output=str(tmp_path / "run"), trajectories="none"))
    assert told["reach"][0] == {"line_id": "hut", "n_total": 24, "n_reach": 24, "p": 1.0} | {
        name: told["reach"][0][name] for name in ("ci_low", "ci_high")
    } | bounds_if_lost(24, 24, 0)


def test_an_overjumped_barrier_is_counted_so(case, tmp_path):
    """A log in free flight high above a barrier crosses its line, and is neither stopped nor beside it."""
    wall = write_layer(
        tmp_path / "wall.gpkg", [shapely.LineString([(20, 50), (40, 50)])], barrier_id=[7], height_m=[1.0]
    )
    one = write_layer(
        tmp_path / "one.gpkg",
        points((30.0, 60.0)),
        orientation=["lying"],
        azimuth_deg=[180.0],
        speed_ms=[15.0],
        drop_m=[8.0],
    )
    told = summary(case.run(releases=one, barriers=wall, output=str(tmp_path / "run"), time_limit_s=20.0))
    counts = {"barrier_id": 7, "n_reached": 1, "n_stopped": 0, "n_overjumped": 1, "n_passed_beside": 0, "n_hits": 0}
    (record,) = told["barriers"]
    assert record.items() >= {**counts, "energy_hit_max_kj": None, "height_hit_max_m": None}.items()
    # level at 15 m/s from 10 m before: in free flight for what is left after half its length
    (arrival,) = layer(tmp_path / "run", "barrier_arrivals").to_dict("records")
    assert (arrival["hit"], arrival["stopped"]) == (0, 0)
    assert record["height_needed_max_m"] == arrival["height_needed_m"] > 5.0
    assert record["energy_needed_max_kj"] == arrival["energy_kj"]


def test_logs_released_through_a_barrier_are_counted(case, tmp_path):
    """A log that starts overlapping a barrier starts in contact with it, is never shot away, and is counted."""
    places = points((22.0, 44.0), (28.0, 47.0), (22.0, 80.0))  # the barrier runs along v = 45; the third is far above
    releases = write_layer(tmp_path / "r.gpkg", places, log_id=[1, 2, 3])
    logs = {"releases": releases, "barriers": case.barriers, "orientation": "lying", "azimuth_deg": 0.0}
    run = case.run(output=str(tmp_path / "run"), time_limit_s=3.0, **logs)
    assert summary(run)["logs"]["started_in_contact"] == 2
    deposits = layer(run, "deposits")[:2]
    assert (deposits["speed_max_ms"] ** 2 <= 2 * 9.81 * np.maximum(deposits["fall_m"], 0.0) + 1.0).all()
    assert deposits["penetration_max_m"].max() < 0.05


def test_a_high_barrier_stops_a_log(case, tmp_path):
    wall = write_layer(
        tmp_path / "wall.gpkg", [shapely.LineString([(1, 50), (59, 50)])], barrier_id=["w"], height_m=[30.0]
    )
    one = write_layer(tmp_path / "one.gpkg", points((30.0, 70.0)), orientation=["lying"], azimuth_deg=[180.0])
    run = case.run(releases=one, barriers=wall, output=str(tmp_path / "run"))
    deposit = layer(run, "deposits").iloc[0]
    assert deposit.geometry.y - NORTH > 50.0
    assert summary(run)["barriers"][0]["n_overjumped"] == 0
    assert summary(run)["barriers"][0]["n_reached"] == 1


def test_logs_that_ran_out_of_time_are_warned_of(case, tmp_path, said):
    case.run(said, output=str(tmp_path / "short"), time_limit_s=1.0, trajectories="none")
    assert any("24 of 24 logs still moved" in warning for warning in said.warnings)
    said.warnings.clear()
    case.run(said, output=str(tmp_path / "long"), trees=case.trees, trajectories="none", time_limit_s=300.0)
    assert not any("still moved" in warning for warning in said.warnings)  # the warning is about those that left
