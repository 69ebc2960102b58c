"""First entries: "Slope to report" gives the same as its tools one by one; the demo slope is loaded into the map."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import geopandas
import pytest

from deadwood_toolbox import cli

HERE = Path(__file__).parent
SAMPLE = HERE.parents[1] / "sample_data"
SYSTEM_PYTHON = "/usr/bin/python3"
DEM, LAYERS = str(SAMPLE / "dem.tif"), SAMPLE / "sample.gpkg"
COUNT = 24
EXPECTED = {"Reach", "Deposits", "Release area", "Road", "Trees", "Hit count", "Terrain model"}


@pytest.fixture(scope="module")
def made(qgis, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with results of the model (``run``) and of the tools one by one (``alone``)."""
    work = tmp_path_factory.mktemp("model")
    trees, releases = str(work / "trees.gpkg"), str(work / "releases.gpkg")
    assert (
        cli.run(["import-trees", "--trees", str(SAMPLE / "trees.csv"), "--dem", DEM, "--output", trees, "--quiet"]) == 0
    )
    areas, lines = f"{LAYERS}|layername=release_area", f"{LAYERS}|layername=lines"
    draw = ["--areas", areas, "--dem", DEM, "--count", str(COUNT), "--output", releases]
    assert cli.run(["sample-releases", *draw, "--quiet"]) == 0
    slide = ["--dem", DEM, "--releases", releases, "--trees", trees, "--lines", lines, "--friction", "0.25"]
    assert cli.run(["slide-logs", *slide, "--fidelity", "draft", "--output", str(work / "alone"), "--quiet"]) == 0
    given = {"dem": DEM, "areas": areas, "trees": trees, "lines": lines, "count": COUNT, "friction": 0.25}
    outputs = {"run": work / "run", "report": work / "report.html"}
    named = {f"{child}:{name}": path for child, (name, path) in zip(("slide", "report"), outputs.items(), strict=True)}
    ran = qgis.run("deadwood:slopetoreport", given | {"fidelity": "draft"} | outputs | named)  # as 3.22, and later
    assert ran.status == 0, ran.err[-3000:]
    return work


def test_the_model_gives_what_its_tools_give_one_by_one(made):
    one, other = (
        geopandas.read_file(made / folder / "run.gpkg", layer="reach").drop(columns="geometry")
        for folder in ("run", "alone")
    )
    assert len(one) == 1
    assert one["n_total"].tolist() == [COUNT]
    assert one.equals(other)
    assert "<html" in (made / "report.html").read_text(encoding="utf-8")[:1000]
    assert (made / "run" / "project.qgz").exists()


def test_friction_is_required_before_the_first_step(qgis, tmp_path):
    given = {"dem": DEM, "areas": f"{LAYERS}|layername=release_area", "lines": f"{LAYERS}|layername=lines"}
    outputs = {f"{name}:{kind}": tmp_path / kind for name, kind in (("slide", "run"), ("report", "report"))}
    ran = qgis.run("deadwood:slopetoreport", given | outputs)
    assert ran.status == 1
    assert "'Friction coefficient' is missing" in ran.err
    assert "sample-releases" not in ran.err + ran.out


@pytest.fixture(scope="module")
def told(qgis, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    work = tmp_path_factory.mktemp("start")
    words = [SYSTEM_PYTHON, HERE / "start_inside.py", work, qgis.folder / "plugins"]
    ran = subprocess.run(words, env=qgis.environment, capture_output=True, text=True, timeout=240)
    assert "JSON{" in ran.stdout, ran.stderr[-3000:]
    return json.loads(ran.stdout.partition("JSON")[2]) | {"work": work}


def test_every_step_of_the_shipped_model_is_valid_for_the_designer(told):
    """A step is marked there that lacks a setting; tests/qgis/slope_model.py writes the model again."""
    assert told["steps"] == {"sample": [], "slide": [], "report": []}
    assert told["outputs"] == ["Folder of the run", "Report"]  # as the designer shows them


def test_it_asks_in_the_order_of_the_work(told):
    assert told["asked"][:8] == ["dem", "areas", "count", "trees", "barriers", "lines", "friction", "fidelity"]


def test_a_dialog_begins_with_what_is_asked_of_and_ends_with_how_it_is_run(told):
    """An alternative to an input follows it."""
    for asked in told["dialogs"].values():
        assert asked[-6:] == ["PLAN", "RESUME", "RESTART", "OVERWRITE", "OUTPUT", "OPEN_RESULTS"]
    assert told["dialogs"]["sitebarriers"][:3] == ["RUN", "LINES", "CANDIDATES"]
    assert told["dialogs"]["slidelogs"][6:10] == ["LINES", "FRICTION", "FRICTION_LAYER", "FRICTION_PRESET"]


def test_the_demo_slope_is_laid_on_the_map_with_its_report(told):
    assert told["worked"], told["said"]
    assert (told["work"] / "demo" / "report.html").exists()
    assert {*told["waiting"]} == EXPECTED
    assert any("report.html" in line for line in told["said"])
    assert told["valid"]


def test_the_help_page_has_the_tools_parameters_and_its_picture(told):
    page = told["page"]
    assert "<code>FRICTION</code>" in page
    assert "<h1>Slide logs</h1>" in page
    assert "view_3d.webp" in page
    for text in (page, told["panel"]):  # commands and paths of the toolbox are for the command line's help
        assert "sample_data" not in text
        assert "README.md" not in text
