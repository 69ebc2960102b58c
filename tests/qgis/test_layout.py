"""The project of a run in a real QGIS: a print layout that can be handed over, and logs at rest only once they rest."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from deadwood_toolbox import cli

HERE = Path(__file__).parent
SAMPLE = HERE.parents[1] / "sample_data"
SYSTEM_PYTHON = "/usr/bin/python3"


@pytest.fixture(scope="module")
def told(qgis, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    work = tmp_path_factory.mktemp("layout")
    dem, layers = str(SAMPLE / "dem.tif"), SAMPLE / "sample.gpkg"
    areas = f"{layers}|layername=release_area"
    made = ["--dem", dem, "--areas", areas, "--count", "30", "--output", str(work / "releases.gpkg"), "--quiet"]
    assert cli.run(["sample-releases", *made]) == 0
    slide = ["--dem", dem, "--releases", str(work / "releases.gpkg"), "--lines", f"{layers}|layername=lines"]
    slide += ["--barriers", f"{layers}|layername=barriers", "--friction", "0.25", "--fidelity", "draft"]
    assert cli.run(["slide-logs", *slide, "--qgis-project", "--output", str(work / "case"), "--quiet"]) == 0
    words = [SYSTEM_PYTHON, HERE / "layout_inside.py", work / "case" / "project.qgz", work]
    ran = subprocess.run(words, env=qgis.environment, capture_output=True, text=True, timeout=200)
    assert "JSON{" in ran.stdout, ran.stderr[-3000:]
    return json.loads(ran.stdout.partition("JSON")[2]) | {"work": work}


def test_the_sheet_says_what_it_shows(told):
    text = " ".join(told["labels"])
    summary = json.loads((told["work"] / "case" / "summary.json").read_text(encoding="utf-8"))
    assert told["name"] == "Map of the run"
    assert "Sliding logs: case" in text
    assert "road: reached by" in text
    assert f"scenario: {summary['scenario']['logs']['n']} logs" in text
    assert f"Scale 1:{told['scale']:,.0f} " in text
    assert "CRS: CH1903+ / LV95 (EPSG:2056)" in text
    assert "[%" not in text


def test_the_maps_scale_is_round_and_it_shows_what_the_legend_names(told):
    digits = f"{told['scale']:.0f}".rstrip("0")
    assert digits in ("1", "2", "25", "5")
    assert told["map_layers"] == sorted([*told["legend"], "Terrain"])
    assert "Logs in motion" not in told["map_layers"]


def test_the_sheet_is_printed_in_colour_within_its_edges(told):
    with Image.open(told["work"] / "layout.png") as picture:
        pixels = np.asarray(picture.convert("RGB")).astype(int)
    assert np.abs(np.array(pixels.shape[:2]) - (827, 1169)).max() <= 1  # A4 at 100 dots an inch
    edge = round(4.0 / 25.4 * 100)
    for part in (pixels[:edge], pixels[-edge:], pixels[:, :edge], pixels[:, -edge:]):
        assert (part == 255).all()
    colour = (pixels.max(axis=2) - pixels.min(axis=2)) > 60
    assert colour[130:750, 40:840].sum() > 2000  # hits, logs and lines on the map
    assert colour[130:700, 860:1130].sum() > 200  # and their colours in the legend
    assert (pixels[770:800, 40:600] < 100).any()  # the foot
    assert (told["work"] / "layout.pdf").stat().st_size > 20_000


@pytest.mark.parametrize("name", ["Deposits", "Logs at rest"])
def test_logs_at_rest_appear_when_they_have_come_to_rest(told, name):
    durations = told["durations"]
    half = sum(each <= durations[-1] / 2.0 + 0.25 for each in durations)
    assert durations[0] > 0.25
    assert told[name] == [0, half, len(durations)]
    assert 0 < half < len(durations)
