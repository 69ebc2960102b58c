"""Runs as a list of folders where there is no dialog of one tool: in the batch table, and in a step of a model."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from deadwood_toolbox import cli

HERE = Path(__file__).parent
SAMPLE = HERE.parents[1] / "sample_data"
SYSTEM_PYTHON = "/usr/bin/python3"


@pytest.fixture(scope="module")
def told(qgis, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    work = tmp_path_factory.mktemp("lists")
    dem, layers = str(SAMPLE / "dem.tif"), SAMPLE / "sample.gpkg"
    draw = ["--dem", dem, "--areas", f"{layers}|layername=release_area", "--count", "12"]
    assert cli.run(["sample-releases", *draw, "--output", str(work / "releases.gpkg"), "--quiet"]) == 0
    slide = ["--dem", dem, "--releases", str(work / "releases.gpkg"), "--lines", f"{layers}|layername=lines"]
    slide += ["--friction", "0.25", "--fidelity", "draft", "--quiet"]
    barriers = ["--barriers", f"{layers}|layername=barriers"]
    assert cli.run(["slide-logs", *slide, "--output", str(work / "one")]) == 0
    assert cli.run(["slide-logs", *slide, *barriers, "--output", str(work / "other")]) == 0
    shutil.copytree(work / "one", work / "a, b")
    words = [SYSTEM_PYTHON, HERE / "lists_inside.py", qgis.folder / "plugins", work]
    ran = subprocess.run(words, env=qgis.environment, capture_output=True, text=True, timeout=300)
    assert "JSON{" in ran.stdout, ran.stderr[-3000:]
    return json.loads(ran.stdout.partition("JSON")[2]) | {"work": work}


def test_a_row_of_the_batch_table_is_filled_by_a_list(told):
    assert told["begins_with"] == ["/runs/one"]
    assert told["batch"] == ["/runs/two,/runs/one", None]  # None: Autofill continues there
    assert told["filled_down"] == "/runs/two,/runs/one"


def test_a_step_of_a_model_takes_runs_of_other_steps_of_inputs_and_of_the_disk(told):
    of_slide = "'Folder of the run' from algorithm 'Slide logs'"
    assert told["offered"] == ["The other run", "Where to", of_slide]
    assert told["step"] == ["The other run", of_slide, "/runs/a third"]
    assert told["sources"] == ["input other", "slide.OUTPUT", "/runs/a third"]
    assert told["again"] == told["sources"]


def test_a_model_with_such_a_step_runs(told):
    assert told["ran"], told["said"]
    compared = json.loads((told["work"] / "compared" / "comparison.json").read_text(encoding="utf-8"))
    assert {row["scenario"] for row in compared["rows"]} == {"one", "other"}


def test_runs_of_the_project_and_recent_ones_are_offered_and_other_folders_judged(told):
    work = told["work"]
    assert told["runs"] == [f"{work}/one", f"{work}/other"]
    assert told["proposed"] == f"{work}/one"  # the only one in the project
    assert told["judged"] == [
        [f"{work}/one", ""],
        [f"{work}", f"{work} is no run: it has no manifest.json"],
        [f"{work}/nowhere", f"There is no folder {work}/nowhere"],
    ]
    assert told["offered_runs"] == told["runs"]


def test_a_folder_with_a_comma_in_its_name_is_one_run(told):
    places = [f"{told['work']}/{name}" for name in ("one", "other", "a, b")]
    assert told["commas"] == [",".join(places), places, ""]
    assert told["ran_with_comma"], told["said"]
    compared = json.loads((told["work"] / "c" / "comparison.json").read_text(encoding="utf-8"))
    assert {row["scenario"] for row in compared["rows"]} == {"one", "other", "a, b"}
