"""map-origins against counts log by log, cell by cell, and against the run's own reach and hits."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import rasterio
import shapely
from slope_case import EAST, NORTH, Case, layer, points, raster, summary, write_layer

from deadwood_algorithms.evaluate.hazard.origins import ROUND_CELLS, cell_for
from deadwood_algorithms.params.tool import Quiet, UserError
from deadwood_algorithms.stats.statistics import wilson_interval
from deadwood_algorithms.tools import count_hits, map_origins
from deadwood_toolbox import cli

LOGS = 120
CELL = 7.0


class Said(Quiet):
    def __init__(self) -> None:
        self.words: list[str] = []

    def note(self, message: str, code: str = "", **numbers: Any) -> None:
        self.words.append(message)

    warn = note


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    """Two release areas; lines that some logs of either reach, and one that none does."""
    made = Case(tmp_path_factory.mktemp("case"))
    places = [(15.0 + 30.0 * a, 33.0 + 30.0 * b) for a, b in np.random.default_rng(4).random((LOGS, 2))]
    made.releases = write_layer(made.folder / "many.gpkg", points(*places), release_id=["a", "b", "b"] * (LOGS // 3))
    made.lines = write_layer(
        made.folder / "lines.gpkg",
        [
            shapely.LineString([(0.5, 25.0), (59.5, 25.0)]),
            shapely.box(10.0, 5.0, 30.0, 20.0),
            shapely.LineString([(0.5, 98.0), (59.5, 98.0)]),
        ],
        line_id=["road", "house", "none"],
    )
    return made


@pytest.fixture(scope="module")
def run(case) -> Path:
    return case.run(lines=case.lines, trees=case.trees)


@pytest.fixture(scope="module")
def mapped(case, run) -> Path:
    map_origins.TOOL(run=str(run), cell_m=CELL, least=3, output=str(case.folder / "origins"))
    return case.folder / "origins"


def told(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "origins.json").read_text(encoding="utf-8"))


def by_hand(run: Path, cell: float) -> dict[tuple[int, int], list[set[str]]]:
    """For each cell of release, the lines that each of its logs reaches."""
    deposits, reached = layer(run, "deposits"), layer(run, "reached_by")
    cells: dict[tuple[int, int], list[set[str]]] = {}
    for log in deposits.itertuples():
        place = int(np.floor(log.release_x / cell)), int(np.floor(log.release_y / cell))
        cells.setdefault(place, []).append(set(reached.loc[reached["log_id"] == log.log_id, "line_id"]))
    return cells


def test_the_raster_is_counted_by_hand(run, mapped):
    cells = by_hand(run, CELL)
    with rasterio.open(mapped / "origins.tif") as source:
        names = list(source.descriptions)
        band = {name: source.read(k + 1) for k, name in enumerate(names)}
        seen = np.zeros(source.shape, bool)
        for (i, j), logs in cells.items():
            row, column = source.index((i + 0.5) * CELL, (j + 0.5) * CELL)
            seen[row, column] = True
            assert band["logs released"][row, column] == len(logs)
            for line in ("any line", "road", "house", "none"):
                name = line if line == "any line" else f"line {line}"
                hit = sum(bool(lines) if line == "any line" else line in lines for lines in logs)
                assert band[f"{name}: logs that reach"][row, column] == hit
                ends = [band[f"{name}: {end} end"][row, column] for end in ("lower", "upper")]
                if len(logs) < 3:
                    assert np.isnan([band[name][row, column], *ends]).all()
                else:
                    assert band[name][row, column] == pytest.approx(hit / len(logs))
                    assert ends == pytest.approx(list(wilson_interval(hit, len(logs))), rel=1e-6)
        assert all(np.isnan(values[~seen]).all() for values in band.values())
    assert len(names) == 4 * 4 + 1
    assert any(len(logs) < 3 for logs in cells.values())
    assert (mapped / "origins.qml").is_file()
    width, height = struct.unpack(">II", (mapped / "origins.png").read_bytes()[16:24])
    assert width > 1000
    assert height > 500


def test_the_sums_are_the_runs_own(run, mapped):
    told_reach = {each["line_id"]: each for each in told(mapped)["reach"]}
    with rasterio.open(mapped / "origins.tif") as source:
        for each in summary(run)["reach"]:
            assert {name: told_reach[each["line_id"]][name] for name in ("n_total", "n_reach", "p")} == {
                name: each[name] for name in ("n_total", "n_reach", "p")
            }
            band = source.read(source.descriptions.index(f"line {each['line_id']}: logs that reach") + 1)
            assert np.nansum(band) == each["n_reach"]
        assert np.nansum(source.read(source.count)) == LOGS
    assert 0 < told_reach["road"]["n_reach"] < LOGS
    assert told_reach["none"]["n_reach"] == 0


def test_the_sources_are_the_cells_above_the_share(run, mapped):
    sources = gpd.read_file(mapped / "origins.gpkg", layer="sources").set_index(["line_id", "least_p"])
    cells = by_hand(run, CELL)
    assert "none" not in sources.index.get_level_values(0)
    for line in ("any line", "road", "house"):
        for least in (0.01, 0.1, 0.5):
            chosen = {}
            for place, logs in cells.items():
                hit = sum(bool(lines) if line == "any line" else line in lines for lines in logs)
                if len(logs) >= 3 and hit >= least * len(logs):
                    chosen[place] = (hit, len(logs))
            if not chosen:
                assert (line, least) not in sources.index
                continue
            row = sources.loc[(line, least)]
            expected = shapely.union_all(
                [shapely.box(i * CELL, j * CELL, (i + 1) * CELL, (j + 1) * CELL) for i, j in chosen]
            )
            assert row.geometry.symmetric_difference(expected).area < 1e-6
            assert row["area_m2"] == pytest.approx(expected.area)
            assert (row["n_reach"], row["n_total"]) == tuple(map(sum, zip(*chosen.values(), strict=True)))
    assert ("road", 0.5) in sources.index


def test_the_affected_ground_is_that_of_count_hits(run, mapped, tmp_path):
    affected = gpd.read_file(mapped / "origins.gpkg", layer="affected").set_index(["release_id", "least_p"])
    for area, number in (("a", LOGS // 3), ("b", 2 * LOGS // 3)):
        place = tmp_path / f"{area}.tif"
        count_hits.TOOL(run=str(run), release_id=area, output=str(place))
        hits = raster(place)[::-1]
        for least in (0.01, 0.1):
            row = affected.loc[(area, least)]
            j, i = np.nonzero((hits > 0) & (hits >= least * number))
            expected = shapely.union_all(shapely.box(EAST + i, NORTH + j, EAST + i + 1, NORTH + j + 1))
            assert row["n_logs"] == number
            assert row["area_m2"] == pytest.approx(expected.area) == i.size
            assert row.geometry.symmetric_difference(expected).area < 1e-6
            assert row.geometry.geom_type == "MultiPolygon"


def test_one_area_needs_no_trajectories(case, tmp_path):
    releases = write_layer(tmp_path / "one.gpkg", points((25.0, 60.0), (30.0, 55.0), (35.0, 65.0)), release_id=[7] * 3)
    run = case.run(releases=releases, lines=case.lines, trajectories="none", output=str(tmp_path / "run"))
    map_origins.TOOL(run=str(run), least=1, affected_shares="100", output=str(tmp_path / "origins"))
    affected = gpd.read_file(tmp_path / "origins" / "origins.gpkg", layer="affected")
    passed = int((raster(run / "hit_count.tif") == 3).sum())
    assert affected["area_m2"].tolist() == ([passed] if passed else [])


def test_several_areas_without_trajectories_leave_the_ground_out(case, tmp_path):
    run = case.run(lines=case.lines, trajectories="none", output=str(tmp_path / "run"))
    said = Said()
    map_origins.TOOL(run=str(run), feedback=said, output=str(tmp_path / "origins"))
    assert any("has no stored trajectory, so the layer 'affected' is left out" in words for words in said.words)
    assert told(tmp_path / "origins")["affected"] is None
    assert "affected" not in gpd.list_layers(tmp_path / "origins" / "origins.gpkg")["name"].tolist()


def test_other_lines_are_found_from_trajectories(case, run, mapped, tmp_path):
    """The run's own lines, given explicitly, give the same."""
    map_origins.TOOL(run=str(run), lines=case.lines, cell_m=CELL, least=3, output=str(tmp_path / "again"))
    assert told(tmp_path / "again") == told(mapped)
    with rasterio.open(mapped / "origins.tif") as one, rasterio.open(tmp_path / "again" / "origins.tif") as two:
        assert np.array_equal(one.read(), two.read(), equal_nan=True)


def test_the_cells_leave_nine_of_ten_logs_told(run, tmp_path):
    rng = np.random.default_rng(1)
    x, y = rng.random(2000) * 200.0, rng.random(2000) * 200.0  # 5 logs on 100 m2
    assert cell_for(x, y, 10) == 20.0  # 20 a cell: 10 or more in 99 %; of 15 m 11 a cell: too few in a third
    assert cell_for(x, y, 1) == 1.0  # each log counts by itself
    assert cell_for(x[:3], y[:3], 10) == ROUND_CELLS[-1]
    said = Said()
    map_origins.TOOL(run=str(run), cell_m=1.0, feedback=said, output=str(tmp_path / "fine"))
    assert any("fewer than 10, whose share is not shown; use a larger --cell-m" in words for words in said.words)


def test_the_manifest_works_as_a_config(mapped, tmp_path, capsys):
    flags = ["--config", str(mapped / "manifest.json"), "--output", str(tmp_path / "again"), "--quiet"]
    assert cli.run(["map-origins", *flags]) == 0, capsys.readouterr().err
    assert told(tmp_path / "again") == told(mapped)


def test_a_run_without_lines_is_refused(case, tmp_path):
    run = case.run(output=str(tmp_path / "run"), trajectories="none")
    with pytest.raises(UserError, match="the run has no roads, railways or houses; name them with --lines LAYER"):
        map_origins.TOOL(run=str(run), output=str(tmp_path / "origins"))
    with pytest.raises(UserError, match="no trajectory was stored; run slide-logs with --trajectories all"):
        map_origins.TOOL(run=str(run), lines=case.lines, output=str(tmp_path / "origins"))
    assert not (tmp_path / "origins").exists()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"source_shares": "0,10"}, "--source-shares is 0 %, but must be greater than 0 %"),
        ({"affected_shares": "ten"}, "--affected-shares is 'ten', but must be numbers"),
        ({"source_shares": "150"}, "--source-shares is 150 %, but must be at most 100 %"),
        ({"cell_m": 0.0005}, "cells; use a larger cell"),
    ],
)
def test_shares_and_cells_that_are_none(run, tmp_path, changes, words):
    with pytest.raises(UserError) as refused:
        map_origins.TOOL(run=str(run), output=str(tmp_path / "origins"), **changes)
    assert words in str(refused.value)
