"""compare-scenarios through files: runs written by hand with known differences, real runs, and what is refused."""

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
from hand_run import Track, write_run, write_values
from matplotlib.collections import LineCollection
from scipy.stats import binomtest
from slope_case import EAST, LENGTH, NORTH, WIDTH, Case, layer, summary

from deadwood_algorithms.evaluate.scenarios import maps as scenario_maps
from deadwood_algorithms.evaluate.scenarios.paired_runs import OBSTACLES, baseline_first
from deadwood_algorithms.params.tool import Cancelled, Quiet, UserError
from deadwood_algorithms.stats.statistics import mcnemar_p, paired_interval, wilson_interval
from deadwood_algorithms.tools import compare_scenarios
from deadwood_toolbox import cli

LOGS = 40
ROAD = shapely.LineString([(1, 25), (59, 25)])
HOUSE = shapely.box(10.0, 5.0, 20.0, 15.0)


def grid(west: int = 0, south: int = 0, nx: int = WIDTH, ny: int = LENGTH, cell: float = 1.0) -> dict[str, Any]:
    """A window of the case's grid."""
    place = {"x0": EAST + west + cell / 2, "y0": NORTH + south + cell / 2}
    return {"nx": nx, "ny": ny, "cell": cell, "crs": "EPSG:2056"} | place


def tracks(fan_deg: float, reason: str = "rest", length: float = 30.0, speed: float = 10.0) -> list[Track]:
    """Logs from one place, to the south and evenly fanned out; those of even rows in release a, of odd in b."""
    out = []
    for k in range(LOGS):
        angle = np.radians(180.0 + fan_deg * (k // 2 / (LOGS // 2 - 1) - 0.5))
        end = (30.0 + length * np.sin(angle), 60.0 + length * np.cos(angle))
        out.append(Track((30.0, 60.0), end, release_id="ab"[k % 2], stop_reason=reason, speed=speed))
    return out


def counts(cells: dict[tuple[int, int], int], at: dict[str, Any]) -> np.ndarray:
    out = np.zeros((at["ny"], at["nx"]), np.uint32)
    for place, value in cells.items():
        out[place] = value
    return out


@pytest.fixture
def runs(tmp_path) -> dict[str, Path]:
    """none: 30 of 40 reach the road; forest: 12 do, of which 2 do not without it; barriers, in a window: none does."""
    reached = {"none": list(range(30)), "forest": [*range(10), 30, 31], "barriers": []}
    made = {}
    for name, fan, reason in (("none", 20.0, "rest"), ("forest", 60.0, "tree"), ("barriers", 10.0, "barrier")):
        at = grid(20, 30, 20, 40) if name == "barriers" else grid()
        cells = {"none": {(40, 30): 40, (41, 30): 10}, "forest": {(40, 30): 20, (50, 5): 4}, "barriers": {(10, 10): 30}}
        made[name] = write_run(
            tmp_path / f"run_{name}",
            tracks(fan, reason, length=20.0 if name == "barriers" else 30.0, speed=20.0 if name == "none" else 15.0),
            lines={"road": (ROAD, reached[name]), "house": (HOUSE, [0])},
            digest="the same",
            parameters={"trees": f"{name}.gpkg" if name == "forest" else None, "output": name},
            rasters={"hit_count": counts(cells[name], at)},
            grid=at,
        )
    return made


def compare(runs: list[Path], output: Path, feedback=None, **changes) -> tuple[pd.DataFrame, Any]:
    names = ",".join(str(each) for each in runs)
    outcome = compare_scenarios.TOOL(feedback=feedback, runs=names, output=str(output), **changes)
    table = pd.read_csv(output / "comparison.csv", dtype={"item": str}, keep_default_na=False, na_values=[""])
    return table.set_index(["scenario", "quantity", "item"]).sort_index(), outcome


def test_reach_and_its_paired_difference(runs, tmp_path):
    table, outcome = compare(
        [runs["none"], runs["forest"], runs["barriers"]], tmp_path / "out", names="none, forest, barriers"
    )
    none, forest = table.loc[("none", "reach", "road")], table.loc[("forest", "reach", "road")]
    assert (none["value"], forest["value"]) == (0.75, 0.3)
    assert (none["ci_low"], none["ci_high"]) == pytest.approx(wilson_interval(30, 40))
    assert forest["difference"] == pytest.approx(-0.45)
    assert (forest["n_only_reference"], forest["n_only_scenario"]) == (20, 2)
    assert (forest["diff_ci_low"], forest["diff_ci_high"]) == pytest.approx(paired_interval(20, 2, 40))
    assert forest["p_mcnemar"] == pytest.approx(binomtest(2, 22).pvalue)
    assert table.loc[("barriers", "reach", "road"), "value"] == 0.0
    same = table.loc[("forest", "reach", "house")]
    assert (same["difference"], same["p_mcnemar"]) == (0.0, 1.0)
    assert same["diff_ci_low"] < 0.0 < same["diff_ci_high"]
    assert table.loc[("forest", "ended", "tree"), "difference"] == 1.0
    assert "none      75 % (60 to 86 %)  -" in outcome.lines[2]
    assert "forest    30 % (18 to 45 %)  -45 (-62 to -25)" in outcome.lines[3]
    assert outcome.lines[-1] == "--trees differs: none: none, forest: forest.gpkg, barriers: none"


def test_spread_speed_and_deposits(runs, tmp_path):
    """Azimuths evenly over a fan; 20 logs are 52 too few for its 5 to 95 % range and any other 95 %."""
    table, _ = compare([runs["none"], runs["forest"]], tmp_path / "out")
    for release in "ab":
        row = table.loc[("run_forest", "spread", release)]
        assert (row["value"], row["difference"]) == pytest.approx((60.0, 40.0))
        middle = table.loc[("run_forest", "spread_p05_p95", release)]
        assert middle["n_more"] == 52
        assert middle[["value", "ci_low", "difference", "diff_ci_low"]].isna().all()
    speed = table.loc[("run_forest", "speed_max", "mean")]
    assert (speed["value"], speed["difference"], speed["diff_ci_low"], speed["diff_ci_high"]) == (
        15.0,
        -5.0,
        -5.0,
        -5.0,
    )
    assert np.isnan(table.loc[("run_forest", "runout", "p95"), "difference"])
    # the k-th of 20 turns by 20 degrees times its place in the fan, on a circle of 30 m
    turns = np.radians(40.0 * np.abs(np.arange(20) / 19 - 0.5))
    expected = np.median(2.0 * 30.0 * np.sin(turns / 2.0))
    assert table.loc[("run_forest", "deposit_moved", "median"), "value"] == pytest.approx(expected)
    long = pd.read_csv(tmp_path / "out" / "table.csv").set_index(["quantity", "of", "scenario"]).sort_index()
    forest = long.loc[("reach", "road", "run_forest")]
    assert (forest["value"], forest["from"], forest["to"], forest["unit"]) == (30.0, 18.0, 45.0, "%")
    assert (forest["difference"], forest["difference_from"], forest["difference_to"]) == (-45.0, -62.0, -25.0)
    assert long.loc[("spread", "a", "run_forest"), "value"] == pytest.approx(60.0)
    assert long.loc[("speed_max", "largest", "run_none"), "value"] == 20.0


def test_the_table_is_one_for_a_spreadsheet(tmp_path):
    """Before: a row for each scenario, 102 columns for 14 lines and releases, 17 digits, and Straße as StraÃŸe."""
    runs = [
        write_run(tmp_path / name, tracks(20.0), digest="same", lines={"Straße": (ROAD, hits)})
        for name, hits in (("ohne", list(range(11))), ("mit", [1, 2, 3]))
    ]
    compare(runs, tmp_path / "out")
    raw = (tmp_path / "out" / "table.csv").read_bytes()
    assert raw.startswith(b"\xef\xbb\xbf")
    assert (tmp_path / "out" / "comparison.csv").read_bytes().startswith(b"\xef\xbb\xbf")
    lines = raw.decode("utf-8-sig").splitlines()
    assert len(lines[0].split(",")) == 17
    assert lines[1].startswith("reach,Straße,ohne,%,40,28.0,16.0,43.0,")
    assert lines[2].startswith("reach,Straße,mit,%,40,7.5,2.6,19.9,-20.0,-35.0,-9.0,")
    digits = [
        cell.strip("-").replace(".", "").lstrip("0") for line in lines[1:] for cell in line.split(",")[4:] if cell
    ]
    assert max(map(len, digits)) <= 6


def lost_runs(tmp_path: Path) -> list[Path]:
    """Without: 10 of 40 reach the road and 20 leave before. With: 5 reach it and none leaves."""
    made = []
    for name, hits, gone in (("without", range(10), range(10, 30)), ("with", range(5), ())):
        ways = tracks(20.0)
        for row in (*gone, *(range(5) if gone else ())):  # five left after they had reached it
            ways[row].stop_reason = "left_dem"
        made.append(write_run(tmp_path / name, ways, digest="same", lines={"road": (ROAD, list(hits))}))
    return made


def test_logs_that_left_before_a_line_bound_its_reach_and_the_difference(tmp_path, said):
    """Before: 25 % (14 to 40) and -12.5 (-24.9 to -1.9), without mentioning the 20 logs with an unknown
    outcome.
    """
    table, outcome = compare(lost_runs(tmp_path), tmp_path / "out", said)
    before, now = table.loc[("without", "reach", "road")], table.loc[("with", "reach", "road")]
    assert (before["n_lost"], now["n_lost"]) == (20, 20)
    assert (before["value_low_if_lost"], before["value_high_if_lost"]) == (0.25, 0.75)
    assert (now["value_low_if_lost"], now["value_high_if_lost"]) == (0.125, 0.125)
    assert (now["difference_low_if_lost"], now["difference_high_if_lost"]) == (-0.625, -0.125)
    assert now["diff_ci_low_if_lost"] == paired_interval(25, 0, 40)[0]
    assert now["diff_ci_high_if_lost"] == paired_interval(5, 0, 40)[1]
    assert "25 % (14 to 40 %) [14 to 86 %]" in outcome.lines[2]
    assert "] " not in outcome.lines[3].split("with")[0]
    assert outcome.lines[3].count("[") == 1
    assert any(line.startswith("[]: range of possible values") for line in outcome.lines)
    warned = [each for each in said.warnings if "left the terrain model (25 in without, 0 in with)" in each]
    assert len(warned) == 1
    assert "reach of road in without; reach of road in with; spread, mean run-outs and deposits" in warned[0]
    assert table.loc[("with", "spread", "a"), "n_lost"] > 0


def test_where_no_log_left_the_bounds_are_the_values(runs, tmp_path, said):
    table, outcome = compare([runs["none"], runs["forest"]], tmp_path / "out", said)
    row = table.loc[("run_forest", "reach", "road")]
    assert row["n_lost"] == 0
    assert row["difference_low_if_lost"] == row["difference_high_if_lost"] == row["difference"]
    assert (row["diff_ci_low_if_lost"], row["diff_ci_high_if_lost"]) == (row["diff_ci_low"], row["diff_ci_high"])
    assert not any("left the terrain model" in each for each in said.warnings)
    assert not any("[" in each for each in outcome.lines[2:])


def test_the_mean_speed_leaves_out_logs_that_still_moved_in_either_run(tmp_path):
    """Without forest half of the logs rolled on at 1 m/s to the limit: 8 m/s on average, not 15; with forest 9."""
    ways = [tracks(20.0, speed=speed) for speed in (15.0, 9.0)]
    for row in range(0, LOGS, 2):
        ways[0][row].speed, ways[0][row].stop_reason = 1.0, "time_limit"
    runs = [write_run(tmp_path / name, each, digest="same") for name, each in zip(("none", "wood"), ways, strict=True)]
    table, _ = compare(runs, tmp_path / "out")
    none, wood = table.loc[("none", "speed_mean", "mean")], table.loc[("wood", "speed_mean", "mean")]
    assert (none["value"], none["n"]) == (15.0, LOGS // 2)
    assert (wood["value"], wood["difference"], wood["n"]) == (9.0, -6.0, LOGS // 2)


def test_maps_lie_on_the_grid_that_holds_both(runs, tmp_path, monkeypatch):
    monkeypatch.setattr(scenario_maps, "ROWS_AT_ONCE", 16)
    compare([runs["none"], runs["forest"], runs["barriers"]], tmp_path / "out")
    compare([runs["barriers"], runs["none"]], tmp_path / "turned")
    with rasterio.open(tmp_path / "out" / "difference_run_forest.tif") as made:
        share, error = made.read()[:, ::-1]
        assert (made.bounds.left, made.bounds.bottom) == (EAST, NORTH)
    assert np.isfinite(share).sum() == 3
    assert [share[40, 30], share[41, 30], share[50, 5]] == pytest.approx([-0.5, -0.25, 0.1])
    assert error[40, 30] == pytest.approx(-0.5 / np.sqrt(0.25 / 40))
    # the window of the run with barriers begins at row 30, column 20: its cell (10, 10) is (40, 30)
    for name, sign in (("out/difference_run_barriers", -1.0), ("turned/difference_run_none", 1.0)):
        with rasterio.open(tmp_path / f"{name}.tif") as made:
            share = made.read(1)[::-1]
            assert (made.width, made.height, made.bounds.left) == (WIDTH, LENGTH, EAST)
        assert [share[40, 30], share[41, 30]] == pytest.approx([sign * 0.25, sign * 0.25])
        assert np.isfinite(share).sum() == 2
    assert (tmp_path / "out" / "difference_run_forest.qml").is_file()


def test_the_picture_is_drawn_with_and_without_maps(runs, tmp_path):
    compare([runs["none"], runs["forest"], runs["barriers"]], tmp_path / "maps")
    (runs["forest"] / "hit_count.tif").unlink()
    compare([runs["none"], runs["forest"]], tmp_path / "bare")
    sizes = []
    for name in ("maps", "bare"):
        head = (tmp_path / name / "comparison.png").read_bytes()[16:24]
        sizes.append(struct.unpack(">II", head))
    assert sizes[0][0] == sizes[1][0] > 800  # as wide, and the maps below
    assert sizes[0][1] > 1.5 * sizes[1][1]


def test_the_maps_have_one_size_frame_scale_and_legend(runs, tmp_path, monkeypatch):
    from deadwood_algorithms.evaluate.scenarios import difference_figure

    kept = []
    monkeypatch.setattr(difference_figure.plt, "close", kept.append)
    compare([runs["none"], runs["forest"], runs["barriers"]], tmp_path / "out")
    maps = [axes for axes in kept[0].axes if " minus " in axes.get_title(loc="left")]
    assert len(maps) == 2
    assert len({tuple(np.round(axes.get_position().size, 6)) for axes in maps}) == 1
    assert maps[0].get_xlim() == maps[1].get_xlim()
    assert maps[0].get_ylim() == maps[1].get_ylim()
    assert any(text.get_text().endswith(" m") for text in maps[0].texts)  # the scale
    roads = [[each for each in axes.collections if isinstance(each, LineCollection)] for axes in maps]
    assert all(roads)  # the road that was compared
    shown = {text.get_text() for text in kept[0].legends[0].get_texts()}
    assert {"releases", "roads, railways, houses", "fewer"} < shown


def test_the_changes_as_layers(runs, tmp_path):
    compare([runs["none"], runs["forest"]], tmp_path / "out")
    changed = gpd.read_file(tmp_path / "out" / "changes.gpkg", layer="changed")
    assert set(changed.loc[changed["reached_in"] == "reference only", "log_id"]) == set(range(10, 30))
    assert set(changed.loc[changed["reached_in"] == "scenario only", "log_id"]) == {30, 31}
    assert set(changed["line_id"]) == {"road"}
    assert {(point.x - EAST, point.y - NORTH) for point in changed.geometry} == {(30.0, 60.0)}
    moved = gpd.read_file(tmp_path / "out" / "changes.gpkg", layer="moved")
    assert len(moved) == LOGS
    assert moved.geometry.length.to_numpy() == pytest.approx(moved["moved_m"].to_numpy())
    assert set(moved["stop_reason_reference"]) == {"rest"}
    assert set(moved["stop_reason"]) == {"tree"}


def test_real_runs(tmp_path):
    """Trees on the slope: the values are those of the summaries, and --lines gives the results of the runs."""
    case = Case(tmp_path / "case")
    bare = case.run(output=str(tmp_path / "bare"), lines=case.lines)
    wood = case.run(output=str(tmp_path / "wood"), lines=case.lines, trees=case.trees)
    table, outcome = compare([bare, wood], tmp_path / "own")
    for run in (bare, wood):
        told = summary(run)
        for record in told["reach"]:
            row = table.loc[(run.name, "reach", record["line_id"])]
            assert (row["value"], row["ci_low"], row["ci_high"]) == (record["p"], record["ci_low"], record["ci_high"])
        for record in told["spread"]:
            assert table.loc[(run.name, "spread", record["release_id"]), "value"] == pytest.approx(record["spread_deg"])
        assert table.loc[(run.name, "speed_max", "largest"), "value"] == told["speed"]["max_ms"]
        held = told["logs"]["by_stop_reason"]["tree"] / 24
        assert table.loc[(run.name, "ended", "tree"), "value"] == held
    assert table.loc[("wood", "reach", "road"), "difference"] < 0.0
    assert outcome.facts["parameters_that_differ"] == {"trees": {"bare": None, "wood": case.trees}}
    again, _ = compare([bare, wood], tmp_path / "again", lines=case.lines)
    assert again.equals(table)
    flags = ["--config", str(tmp_path / "own" / "manifest.json"), "--output", str(tmp_path / "config"), "--quiet"]
    assert cli.run(["compare-scenarios", *flags]) == 0
    assert (tmp_path / "config" / "comparison.csv").read_bytes() == (tmp_path / "own" / "comparison.csv").read_bytes()


def test_runs_that_slid_a_part_of_the_same_logs(tmp_path, said):
    """With --until-ci a run ends when it has enough logs: those that both have are compared."""
    whole = tracks(20.0)
    one = write_run(tmp_path / "one", whole, digest="same", lines={"road": (ROAD, [3])})
    other = write_run(tmp_path / "other", whole[:24], digest="same", lines={"road": (ROAD, [3])})
    table, outcome = compare([one, other], tmp_path / "out", said)
    assert outcome.facts["logs"] == 24
    assert "24 of up to 40 logs were slid in all runs" in said.notes[0]
    assert table.loc[("other", "reach", "road"), "value"] == pytest.approx(1 / 24)


def test_without_lines_all_else_is_compared(tmp_path, said):
    one = write_run(tmp_path / "one", tracks(20.0), digest="same")
    other = write_run(tmp_path / "other", tracks(20.0), digest="same", lines={"road": (ROAD, [3])})
    table, outcome = compare([one, other], tmp_path / "out", said)
    assert "reach" not in table.index.get_level_values("quantity")
    assert any("run without --lines" in each for each in said.notes)
    assert "do not differ in any parameter" in outcome.lines[-1]


def changed_run(tmp_path: Path, **columns) -> list[Path]:
    """Two runs whose deposits differ in a column of one log; their releases have other digests."""
    one = write_run(tmp_path / "one", tracks(20.0), digest="one", lines={"road": (ROAD, [3])})
    two = write_run(tmp_path / "two", tracks(20.0), digest="two", lines={"road": (ROAD, [3])})
    frame = layer(two, "deposits")
    for name, value in columns.items():
        frame.loc[7, name] = value
    frame.to_file(two / "run.gpkg", layer="deposits", driver="GPKG")
    return [one, two]


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        ("dbh_cm", 41.0, "dbh_cm of log_id 7 is 41.0, but 40.0 in"),
        ("release_x", EAST + 33.0, "release_x of log_id 7 is"),
        ("release_id", "c", "release_id of log_id 7 is c, but b in"),
        ("length_m", 9.0, "length_m of log_id 7 is 9.0"),
        ("density_kg_m3", 400.0, "density_kg_m3 of log_id 7 is 400.0"),
        ("log_id", 99, "log_id 7 of"),
    ],
)
def test_other_releases_are_refused_by_log_and_column(tmp_path, capsys, column, value, words):
    runs = changed_run(tmp_path, **{column: value})
    flags = ["--runs", f"{runs[0]},{runs[1]}", "--output", str(tmp_path / "out")]
    assert cli.run(["compare-scenarios", *flags, "--quiet"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert words in said
    assert "slide the same releases layer" in said
    assert not (tmp_path / "out").exists()


def test_options_of_the_releases_that_differ_are_named(tmp_path):
    one = write_run(tmp_path / "one", tracks(20.0), digest="one", parameters={"orientation": "upright"})
    two = write_run(tmp_path / "two", tracks(20.0), digest="two", parameters={"orientation": "lying"})
    with pytest.raises(UserError, match="it was run with --orientation lying for upright"):
        compare([one, two], tmp_path / "out")
    three = write_run(tmp_path / "three", tracks(20.0), digest="three", parameters={"orientation": "upright"})
    with pytest.raises(UserError, match="orientation, tilt, azimuth, speed or drop of a log is another"):
        compare([one, three], tmp_path / "out")


def test_lines_that_lie_elsewhere_are_refused(tmp_path):
    moved = shapely.LineString([(1, 27), (59, 27)])
    one = write_run(tmp_path / "one", tracks(20.0), digest="same", lines={"road": (ROAD, [3])})
    two = write_run(tmp_path / "two", tracks(20.0), digest="same", lines={"road": (moved, [3])})
    three = write_run(tmp_path / "three", tracks(20.0), digest="same", lines={"rail": (ROAD, [3])})
    with pytest.raises(UserError, match="line 'road' lies 2.00 m from where it lies in"):
        compare([one, two], tmp_path / "out")
    with pytest.raises(UserError, match="no line of .* was watched in this run"):
        compare([one, three], tmp_path / "out")


@pytest.mark.parametrize(
    ("runs", "names", "words"),
    [
        ("one", None, "at least two folders"),
        ("one,two", "a", "1 names for 2 runs"),
        ("one,two", "a,a", "'a' does not distinguish the runs"),
        ("one,two", "a,b/c", "cannot be part of a file's name"),
        ("one,nowhere", None, "nowhere: the run's folder does not exist"),
    ],
)
def test_what_cannot_be_compared(tmp_path, monkeypatch, runs, names, words):
    monkeypatch.chdir(tmp_path)
    for name in ("one", "two"):
        write_run(Path(name), tracks(20.0), digest="same")
    with pytest.raises(UserError) as error:
        compare_scenarios.TOOL(runs=runs, names=names, output="out")
    assert words in str(error.value)
    assert "\n" not in str(error.value)
    assert not Path("out").exists()


def test_grids_that_do_not_fit_cost_the_map_alone(runs, tmp_path, said):
    for name, at, words in (
        ("fine", grid(cell=0.5, nx=120, ny=200), "cells of 0.5 m are not those"),
        ("beside", {**grid(), "x0": EAST + 0.75}, "not aligned with those"),
    ):
        run = write_run(tmp_path / name, tracks(20.0), digest="the same", grid=at)
        write_values(run / "hit_count.tif", np.ones((at["ny"], at["nx"]), np.uint32), at)
        said.warnings.clear()
        table, outcome = compare([runs["none"], run], tmp_path / f"out_{name}", said)
        assert words in said.warnings[0]
        assert len(table) > 20
        assert not any(key.startswith("difference") for key in outcome.outputs)
        assert not list((tmp_path / f"out_{name}").glob("*.tif"))


def test_folders_of_one_name_are_distinguished(tmp_path):
    runs = [write_run(tmp_path / parent / "run", tracks(20.0), digest="same") for parent in ("dry", "wet")]
    table, _ = compare(runs, tmp_path / "out")
    assert set(table.index.get_level_values("scenario")) == {"dry_run", "wet_run"}


def test_an_interrupted_comparison_leaves_nothing(runs, tmp_path):
    class Stop(Quiet):
        def cancelled(self) -> bool:
            return True

    with pytest.raises(Cancelled):
        compare([runs["none"], runs["forest"]], tmp_path / "out", Stop())
    assert not (tmp_path / "out").exists()


def test_mcnemar_is_the_sign_test():
    for lost, gained in ((0, 0), (3, 0), (5, 5), (20, 2), (700, 800), (12_000, 11_000)):
        n = lost + gained
        expected = binomtest(lost, n).pvalue if n else 1.0
        assert mcnemar_p(lost, gained) == pytest.approx(expected, rel=1e-9)


def test_an_interval_and_its_test_agree(tmp_path):
    """The facts are JSON, and the paired interval excludes 0 where McNemar's test does (score compared with exact: for
    these counts both or neither)."""
    one = write_run(tmp_path / "one", tracks(20.0), digest="same", lines={"road": (ROAD, list(range(20)))})
    for gained, differs in ((3, False), (14, True)):
        name = f"two_{gained}"
        two = write_run(tmp_path / name, tracks(20.0), digest="same", lines={"road": (ROAD, list(range(20 + gained)))})
        table, _ = compare([one, two], tmp_path / f"out_{gained}")
        row = table.loc[(name, "reach", "road")]
        assert (row["diff_ci_low"] > 0.0) == (row["p_mcnemar"] < 0.05) == differs
        told = json.loads((tmp_path / f"out_{gained}" / "comparison.json").read_text())
        assert told["logs"] == LOGS
        assert told["rows"][0]["difference"] is None


def test_the_baseline_is_the_run_with_the_fewest_obstacles_unless_it_is_named(said):
    """In any order of the runs: the index of protection refers to what the others have in addition."""
    summaries = [
        {"scenario": {name: {"n": count if name == "trees" else 0} for name in OBSTACLES}} for count in (50, 0, 70)
    ]
    names = ["forest", "bare", "dense"]
    assert baseline_first(summaries, names, None, said) == [1, 0, 2]
    assert "the baseline is bare, which has the fewest obstacles (0; forest has 50)" in said.notes[-1]
    assert baseline_first(summaries, names, "forest", said) == [0, 1, 2]
    assert "forest has more obstacles (50) than bare (0)" in said.warnings[-1]
    assert baseline_first([*summaries[:2], {}], names, None, said) == [0, 1, 2]  # one is of an older version
    with pytest.raises(UserError, match="--baseline is 'wood', but the runs are called forest, bare, dense"):
        baseline_first(summaries, names, "wood", said)


def lying_and_upright(tmp_path: Path, columns: dict[str, str]) -> list[Path]:
    """Runs with --orientation lying and with upright, of releases with these columns."""
    case = Case(tmp_path / "case")
    gpd.read_file(case.releases).assign(**columns).to_file(case.releases, layer="releases", driver="GPKG")
    return [
        case.run(output=str(tmp_path / name), lines=case.lines, orientation=name, friction="0.4", fidelity="draft")
        for name in ("lying", "upright")
    ]


def test_an_option_that_a_column_overrides_makes_no_difference_of_two_runs(tmp_path):
    """The layer makes every log upright: both runs are the same scenario, whatever --orientation was."""
    outcome = compare(lying_and_upright(tmp_path, {"orientation": "upright"}), tmp_path / "out")[1]
    facts = json.loads((tmp_path / "out" / compare_scenarios.FACTS).read_text(encoding="utf-8"))
    scenarios = [line.partition(", ")[2].partition(",")[0] for line in outcome.lines if line.startswith("scenario of")]
    assert [line for line in outcome.lines if "differs" in line] == []
    assert facts["parameters_that_differ"] == {}
    assert scenarios == ["upright", "upright"]


def test_two_runs_whose_logs_start_in_another_posture_are_not_of_the_same_logs(tmp_path):
    """The counterpart: without such a column, the option decides."""
    with pytest.raises(UserError, match="it was run with --orientation upright for lying"):
        compare(lying_and_upright(tmp_path, {}), tmp_path / "out")
