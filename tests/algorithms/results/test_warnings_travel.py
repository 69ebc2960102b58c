"""A warning of an input is in the run that uses it, and in what is made from the run: manifest, summary, tables."""

from __future__ import annotations

import io
import json
import sqlite3
import sys
import zipfile
from contextlib import closing
from pathlib import Path
from typing import Any, cast

import pytest
from slope_case import Case, points, summary, write_dem, write_layer

from deadwood_algorithms.explore import stdio
from deadwood_algorithms.explore.frames import Frame
from deadwood_algorithms.files.embedded import record_in
from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.report.words import Words
from deadwood_algorithms.tools import compare_scenarios, explore, import_trees, lateral_spread, make_report

CELL_M = 5.0


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    """On cells of 5 m, with two trees at one place that import-trees has warned of."""
    found = Case(tmp_path_factory.mktemp("warned"))
    found.dem = write_dem(found.folder / "coarse.tif", cell=CELL_M)
    twice = write_layer(
        found.folder / "twice.gpkg",
        points((5.0, 40.0), (5.0, 40.0), (50.0, 60.0)),
        tree_id=[1, 2, 3],
        dbh_cm=[40.0, 41.0, 42.0],
        height_m=[20.0, 21.0, 22.0],
    )
    found.trees = str(found.folder / "stand.gpkg")
    import_trees.TOOL(trees=twice, output=found.trees)
    return found


@pytest.fixture(scope="module")
def run(case: Case) -> Path:
    return case.run(trees=case.trees, lines=case.lines, time_limit_s=20.0)


def warned(record: dict) -> dict[str, dict]:
    return {each["code"]: each["numbers"] for each in record["warnings"] if each["level"] == "warning"}


def test_a_run_on_coarse_cells_says_so_in_manifest_and_summary(run):
    manifest = json.loads((run / "manifest.json").read_text(encoding="utf-8"))
    for record in (manifest, summary(run)):
        assert warned(record)["coarse-cells"]["cell_m"] == CELL_M


def test_the_warning_of_an_input_reaches_the_run(case, run):
    with closing(sqlite3.connect(case.trees)) as db:
        x, y, n = db.execute("SELECT min(tree_id), max(tree_id), count(*) FROM trees").fetchone()
    assert (x, y, n) == (1, 3, 3)
    record = record_in(Path(case.trees))
    assert record is not None
    assert warned(record)["same-position"] == {"trees": 1}
    assert warned(summary(run))["same-position"] == {"trees": 1}


def test_what_is_made_from_the_run_repeats_it(case, run, said):
    place = case.folder / "spread.gpkg"
    lateral_spread.TOOL(feedback=said, deposits=str(run), output=str(place))
    record = record_in(place)
    assert record is not None
    assert warned(record)["coarse-cells"]["cell_m"] == CELL_M
    assert sum("coarse" in each for each in said.warnings) == 1


def test_the_report_shows_them_under_its_conclusion(case, run):
    place = case.folder / "page.html"
    make_report.TOOL(runs=str(run), output=str(place), language="de")
    page = place.read_text(encoding="utf-8")
    between = page[page.index('id="conclusion"') : page.index('id="numbers"')]
    box = between[between.index('class="warning"') :]
    assert Words("de").say("warned_coarse_cells", cell_m=5, largest_m=2) in box
    assert "exactly the position of another one" in box
    assert str(case.folder) not in box  # names of files, without their folders


def test_the_runs_project_shows_them(case):
    run = case.run(output=str(case.folder / "drawn"), qgis_project=True, time_limit_s=20.0, trajectories="none")
    with zipfile.ZipFile(run / "project.qgz") as packed:
        (name,) = [each for each in packed.namelist() if each.endswith(".qgs")]
        project = packed.read(name).decode("utf-8")
    assert project.count("Cells of 5 m do not resolve") == 2  # on both sheets


def test_a_comparison_repeats_those_of_its_runs(case, run, said):
    other = case.run(output=str(case.folder / "bare"), lines=case.lines, time_limit_s=20.0)
    place = case.folder / "compared"
    compare_scenarios.TOOL(feedback=said, runs=f"{other},{run}", output=str(place))
    manifest = json.loads((place / "manifest.json").read_text(encoding="utf-8"))
    names = [each["text"].partition(":")[0] for each in manifest["warnings"] if each["code"] == "coarse-cells"]
    assert sorted(names) == sorted([other.name, run.name])


def test_exploring_shows_those_of_the_terrain_and_the_layers(case, tmp_path):
    class Out:
        def __init__(self) -> None:
            self.frames: list[Frame] = []

        def send(self, frame: Frame) -> None:
            self.frames.append(frame)

    out, ask = Out(), explore.TOOL.ask_from({"dem": case.dem, "trees": case.trees, "output": str(tmp_path / "kept")})
    stdin, sys.stdin = sys.stdin, io.TextIOWrapper(io.BytesIO(b'{"op": "open"}\n'))
    try:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(stdio.threading, "Timer", lambda *_: Timer())
            explore.answer(ask, cast("Any", out), Quiet())
    finally:
        sys.stdin = stdin
    (scene,) = [each.facts for each in out.frames if each.facts["op"] == "scene"]
    assert {each["code"] for each in scene["warnings"]} == {"coarse-cells", "same-position"}


class Timer:
    """Ends no process."""

    def start(self) -> None: ...


def test_without_cause_nothing_is_warned_of(tmp_path):
    fine = Case(tmp_path)
    assert warned(summary(fine.run(friction="0.6", trajectories="none"))) == {}
