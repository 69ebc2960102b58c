"""design-values compared with calculations by hand, from tracks with known numbers and from the run's layers."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as parquet
import pytest
import shapely
from hand_run import Track, write_run
from slope_case import Case, layer, points, summary, write_dem, write_layer

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.stats.order_statistics import percentile_ranks
from deadwood_algorithms.tools import design_values
from deadwood_engine.log_body import MASS, cone_bodies

KEYS = ["kind", "place_id", "quantity", "percentile"]


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def full(case) -> Path:
    return case.run(output=str(case.folder / "full"), **case.everything())


def table(run: Path, path: Path, **values) -> Any:
    design_values.TOOL(run=str(run), output=str(path), overwrite=True, **values)
    return pd.read_csv(path, encoding="utf-8-sig", dtype={"place_id": str}).set_index(KEYS).sort_index()


def flat_run(folder: Path, tracks: list[Track], **values) -> Path:
    """A synthetic run on flat ground at 1000 m, with a road across at v = 50 and no barriers."""
    folder.mkdir(exist_ok=True)
    dem = write_dem(folder / "dem.tif", flat=True)
    road = shapely.LineString([(0.5, 50.0), (59.5, 50.0)])
    made = write_run(folder / "run", tracks, dem=dem, lines={"road": (road, list(range(len(tracks))))}, **values)
    (made / "summary.json").write_text(json.dumps({"barriers": []}))
    return made


def test_speeds_and_energies_are_those_of_the_tracks(tmp_path):
    speeds = np.arange(1.0, 101.0)
    tracks = [Track((20.0, 70.0), (20.0, 30.0), speed=speed) for speed in speeds]
    found = table(flat_run(tmp_path, tracks), tmp_path / "d.csv")
    mass = float(cone_bodies(np.array([0.4]), np.array([4.0]), np.array([300.0]))[0, MASS])
    row = found.loc[("line", "road", "speed", 90.0)]
    low, high = percentile_ranks(100, 0.9)
    assert row["n"] == 100
    assert row["value"] == pytest.approx(np.quantile(speeds, 0.9))
    assert (row["ci_low"], row["ci_high"]) == (speeds[low - 1], speeds[high - 1])
    energy = 0.5 * mass * speeds**2 / 1000.0
    for quantity in ("energy", "translation"):
        assert found.loc[("line", "road", quantity, 50.0), "value"] == pytest.approx(np.quantile(energy, 0.5), rel=1e-6)
    assert found.loc[("line", "road", "rotation", 95.0), "value"] == 0.0
    assert found.loc[("line", "road", "energy", 99.0), "n_more"] == 268
    assert found.loc[("line", "road", "energy", 99.0), ["value", "ci_low", "ci_high"]].isna().all()
    assert found.loc[("line", "road", "energy", 99.0), "note"] == "needs 268 more arrivals"
    assert "nothing is hit" in found.loc[("line", "road", "impulse", 50.0), "note"]
    assert found.loc[("line", "road", "impulse", 50.0), "n_more"] == 0


def test_a_spinning_log_has_its_energy_of_rotation_apart(tmp_path):
    found = table(flat_run(tmp_path, [Track((20.0, 70.0), (20.0, 30.0), spin=5.0)] * 6), tmp_path / "d.csv")
    body = cone_bodies(np.array([0.4]), np.array([4.0]), np.array([300.0]))[0]
    moving, turning, both = (
        found.loc[("line", "road", name, 50.0), "value"] for name in ("translation", "rotation", "energy")
    )
    from deadwood_engine.log_body import AXIAL

    assert turning == pytest.approx(0.5 * body[MASS] * body[AXIAL] * 25.0 / 1000.0, rel=1e-6)
    assert both == pytest.approx(moving + turning)


def test_the_height_is_that_of_the_upper_edge_over_the_line(tmp_path):
    """Horizontal logs, with their axis 0.5 m above the ground: across the path, with a radius of
    0.2 m at the base and 0.1 m at the tip; end first, the tip reaches the line.
    """
    broadside = flat_run(tmp_path / "a", [Track((20.0, 70.0), (20.0, 30.0), broadside_deg=90.0)] * 6)
    head = flat_run(tmp_path / "b", [Track((20.0, 70.0), (20.0, 30.0))] * 6)
    assert table(broadside, tmp_path / "a.csv").loc[("line", "road", "height_needed", 50.0), "value"] == pytest.approx(
        0.7, abs=0.01
    )
    over = table(head, tmp_path / "b.csv").loc[("line", "road", "height_needed", 50.0), "value"]
    assert over == pytest.approx(0.6, abs=0.02)  # the thicker part comes later


def test_hits_at_barriers_are_those_of_the_run_one_value_a_log(case, tmp_path):
    full = case.run(output=str(tmp_path / "bare"), barriers=case.barriers, friction="0.1")
    found = table(full, tmp_path / "d.csv", percentiles="50,80")
    hits: Any = layer(full, "barrier_hits")
    columns = {
        "energy_hit": "energy_kj", "speed_hit": "speed_ms", "height_hit": "height_hit_m", "impulse": "impulse_kns",
    }  # fmt: skip
    assert found.loc[("barrier", "east", "energy_hit", 50.0), "n"] == (hits["barrier_id"] == "east").sum() == 0
    mine = hits[hits["barrier_id"] == "west"]
    for quantity, column in columns.items():
        largest = mine.groupby("log_id")[column].max()
        row = found.loc[("barrier", "west", quantity, 80.0)]
        assert row["n"] == largest.size > 0
        expected = np.quantile(largest, 0.8) if 0.8**largest.size <= 0.025 else np.nan
        assert row["value"] == pytest.approx(expected, abs=1e-9, nan_ok=True), quantity


@pytest.fixture(scope="module")
def thrown(case) -> dict[str, Path]:
    """Logs thrown level at 15 m/s from 0.3 to 12 m above the ground, across a place: without anything there, and with
    barriers of 1 and 3 m, none of whose trajectories are stored.
    """
    folder = case.folder / "thrown"
    folder.mkdir()
    n = 40
    places = points(*((12.0 + 36.0 * k / n, 75.0) for k in range(n)))
    drops = np.linspace(0.3, 12.0, n)
    releases = write_layer(
        folder / "r.gpkg", places, orientation=["lying"] * n, azimuth_deg=[180.0] * n, speed_ms=[15.0] * n, drop_m=drops
    )
    place = shapely.LineString([(8.0, 60.0), (52.0, 61.0)])
    line = write_layer(folder / "line.gpkg", [place], line_id=["place"])
    made = {"line": case.run(output=str(folder / "line"), releases=releases, lines=line, trajectories="all")}
    for height in (1.0, 3.0):
        wall = write_layer(folder / f"{height}.gpkg", [place], barrier_id=["place"], height_m=[height])
        output = str(folder / f"wall{height:g}")
        made[f"{height:g}"] = case.run(output=output, releases=releases, barriers=wall, trajectories="none")
    return made


def test_the_height_that_a_place_needs_is_not_cut_off_at_the_barriers_own(thrown, tmp_path):
    """Before, the percentiles were those of the hits: at most the height of the barrier."""
    line = table(thrown["line"], tmp_path / "l.csv", percentiles="50,90").loc["line"]
    for height in (1.0, 3.0):
        run = thrown[f"{height:g}"]
        found = table(run, tmp_path / "w.csv", percentiles="50,90").loc["barrier"]
        over = summary(run)["barriers"][0]["n_overjumped"]
        assert over > 5, "no log jumps over the barrier: nothing is cut off"
        assert found.loc[("place", "height_hit", 90.0), "value"] < height + 0.5
        for percentile in (50.0, 90.0):
            needed, told = (each.loc[("place", "height_needed", percentile)] for each in (found, line))
            assert needed["n"] == told["n"] == 40
            assert needed["value"] > {50.0: 1.5, 90.0: 3.5}[percentile]
            assert needed["value"] == pytest.approx(told["value"], abs=0.1)
            for quantity in ("energy", "speed"):
                there, bare = (each.loc[("place", quantity, percentile), "value"] for each in (found, line))
                assert there == pytest.approx(bare, rel=0.05), quantity  # from poses 0.1 s apart; of hits the run's own


def test_arrivals_are_every_log_and_those_that_hit_are_marked(thrown):
    run = thrown["3"]
    arrivals: Any = layer(run, "barrier_arrivals").set_index("log_id")
    hits = layer(run, "barrier_hits")
    deposits: Any = layer(run, "deposits").set_index("log_id")
    (record,) = summary(run)["barriers"]
    assert len(arrivals) == record["n_reached"] == 40
    assert set(arrivals.index[arrivals["hit"] == 1]) == set(hits["log_id"])
    assert set(arrivals.index[arrivals["stopped"] == 1]) == set(deposits.index[deposits["stop_reason"] == "barrier"])
    assert record["height_needed_max_m"] == pytest.approx(arrivals["height_needed_m"].max())
    assert record["height_needed_p95_m"] is None, "40 arrivals do not show it: 72 do"
    assert record["height_hit_max_m"] == hits["height_hit_m"].max() < record["height_needed_max_m"]
    # Thrown level, in free flight, with a slender tip that reaches the plane first: it is hit where its tip is, whose
    # upper edge is at most its thickness higher (a parabola's exact place: test_hits.test_a_shot_at_a_plate).
    tips: Any = hits.groupby("log_id").first()["height_hit_m"]
    flying = tips[(tips > 1.0) & (tips < 2.9)].index
    above = arrivals.loc[flying, "height_needed_m"] - tips[flying]
    assert len(flying) >= 5
    assert above.between(-1e-9, 0.2).all(), above


def test_a_run_of_before_is_not_read_as_if_it_knew_who_jumps_over(thrown, tmp_path):
    import shutil
    import sqlite3

    old = shutil.copytree(thrown["3"], tmp_path / "old")
    with sqlite3.connect(old / "run.gpkg") as package:
        package.execute("DROP TABLE barrier_arrivals")
        for name in ("gpkg_contents", "gpkg_geometry_columns"):
            package.execute(f"DELETE FROM {name} WHERE table_name = 'barrier_arrivals'")
    from deadwood_algorithms.params.tool import Quiet
    from deadwood_algorithms.results.passages import barrier_passages
    from deadwood_algorithms.results.run_folder import read_run

    source = replace(read_run(str(thrown["3"]), feedback=Quiet()), path=old)
    with pytest.raises(UserError, match="run slide-logs again"):
        list(barrier_passages(source))


def test_a_line_of_the_run_has_as_many_logs_as_reach_it(full, tmp_path):
    found = table(full, tmp_path / "d.csv")
    reach: Any = layer(full, "reach").set_index("line_id")["n_reach"]
    for line, count in reach.items():
        assert found.loc[("line", line, "speed", 50.0), "n"] == count
        assert found.loc[("line", line, "height_needed", 50.0), "n"] == count
    assert not found.loc[("line", "road", "height_needed", 90.0), "value"] >= 12.0  # or too few to tell
    assert found.loc[("line", "road", "height_needed", 50.0), "value"] > 0.1


def test_a_profile_line_takes_the_place_of_the_runs_lines(full, tmp_path):
    across = shapely.LineString([(0.5, 60.0), (59.5, 60.0)])
    found = table(full, tmp_path / "d.csv", lines=write_layer(tmp_path / "p.gpkg", [across], line_id=["profile"]))
    assert set(found.xs("line").index.get_level_values("place_id")) == {"profile"}
    assert set(found.xs("barrier").index.get_level_values("place_id")) == {"west", "east"}
    poses = parquet.read_table(full / "poses.parquet").to_pandas()
    assert found.loc[("line", "profile", "speed", 50.0), "value"] <= poses["speed_ms"].max()


def test_without_trajectories_lines_say_why_and_barriers_stay(case, tmp_path, said):
    run = case.run(output=str(tmp_path / "run"), trajectories="none", **case.everything())
    design_values.TOOL(feedback=said, run=str(run), output=str(tmp_path / "d.csv"))
    found: Any = pd.read_csv(tmp_path / "d.csv", encoding="utf-8-sig").set_index(KEYS).sort_index()
    assert found.loc[("barrier", "west", "energy", 50.0), "n"] > 0
    assert "--trajectories all" in found.loc[("line", "road", "energy", 50.0), "note"]
    assert found.loc[("line", "road", "energy", 50.0), "n_more"] == 0
    untold, lost = said.warnings
    assert "there are no energies at lines" in untold
    assert "percentiles of barrier" in lost  # logs left the terrain model before they came to it
    assert "percentiles of line" not in lost  # unknown which logs came to the lines


def test_an_unhit_barrier_has_its_rows(case, tmp_path):
    far = write_layer(
        tmp_path / "far.gpkg", [shapely.LineString([(2.0, 3.0), (4.0, 3.0)])], barrier_id=["far"], height_m=[2.0]
    )
    found = table(case.run(output=str(tmp_path / "run"), barriers=far), tmp_path / "d.csv")
    assert found.loc[("barrier", "far", "energy", 95.0), "note"] == "needs 72 more arrivals"
    assert found["n"].sum() == 0


@pytest.mark.parametrize("text", ["0,50", "100", "many", "50,50", ","])
def test_percentiles_that_are_none_are_refused(full, tmp_path, text):
    with pytest.raises(UserError, match="--percentiles is "):
        design_values.TOOL(run=str(full), percentiles=text, output=str(tmp_path / "d.csv"))
    assert not (tmp_path / "d.csv").exists()


def test_a_run_without_barriers_and_lines_is_refused(case, tmp_path):
    run = case.run(output=str(tmp_path / "run"))
    with pytest.raises(UserError, match="neither barriers nor lines; give lines with --lines"):
        design_values.TOOL(run=str(run), output=str(tmp_path / "d.csv"))


def test_other_lines_need_trajectories(case, tmp_path):
    run = case.run(output=str(tmp_path / "run"), trajectories="none")
    with pytest.raises(UserError, match="no trajectory was stored; run slide-logs with --trajectories all"):
        design_values.TOOL(run=str(run), lines=case.lines, output=str(tmp_path / "d.csv"))


def test_a_damaged_summary_is_named(full, tmp_path):
    import shutil

    copy = shutil.copytree(full, tmp_path / "copy")
    (copy / "summary.json").write_text("{")
    with pytest.raises(UserError, match=r"summary\.json: the file is damaged, or of another run"):
        design_values.TOOL(run=str(copy), output=str(tmp_path / "d.csv"))
