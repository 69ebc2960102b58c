"""The project of a run in a real QGIS: a print layout ready for use, and logs shown at rest only once they are."""

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


# Each language: the folder, names of the layers of logs at rest, and what stands on the sheet.
LANGUAGES = {
    "en": (
        ["Deposits", "Logs at rest"],
        ["Sliding logs: en", "road: reached by", "friction 0.25", "Scale 1:"],
        "Terrain",
    ),
    "de": (
        ["Ablagerungen", "Stämme in Ruhe"],
        ["Rutschende Stämme: de", "road: erreicht von", "Reibung 0,25", "Massstab 1:"],
        "Gelände",
    ),
}
SHEETS = {
    "en": ["Map of the run, A4 landscape", "Map of the run, A4 portrait"],
    "de": ["Karte des Laufs, A4 hoch", "Karte des Laufs, A4 quer"],
}
PIXELS = {"landscape": (827, 1169), "quer": (827, 1169), "portrait": (1169, 827), "hoch": (1169, 827)}  # A4, 100 dpi


@pytest.fixture(scope="module", params=LANGUAGES)
def told(qgis, tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> dict[str, Any]:
    language = request.param
    work = tmp_path_factory.mktemp("layout")
    dem, layers = str(SAMPLE / "dem.tif"), SAMPLE / "sample.gpkg"
    areas = f"{layers}|layername=release_area"
    made = ["--dem", dem, "--areas", areas, "--count", "30", "--output", str(work / "releases.gpkg"), "--quiet"]
    assert cli.run(["sample-releases", *made]) == 0
    slide = ["--dem", dem, "--releases", str(work / "releases.gpkg"), "--lines", f"{layers}|layername=lines"]
    slide += ["--barriers", f"{layers}|layername=barriers", "--friction", "0.25", "--fidelity", "draft"]
    slide += ["--trees", str(SAMPLE / "trees.csv"), "--language", language]
    assert cli.run(["slide-logs", *slide, "--qgis-project", "--output", str(work / language), "--quiet"]) == 0
    words = [SYSTEM_PYTHON, HERE / "layout_inside.py", work / language / "project.qgz", work, *LANGUAGES[language][0]]
    ran = subprocess.run(words, env=qgis.environment, capture_output=True, text=True, timeout=300)
    assert "JSON{" in ran.stdout, ran.stderr[-3000:]
    return json.loads(ran.stdout.partition("JSON")[2]) | {"work": work, "language": language}


def test_the_sheets_say_what_they_show(told):
    assert sorted(told["sheets"]) == SHEETS[told["language"]]
    for sheet in told["sheets"].values():
        text = " ".join(sheet["labels"])
        for words in LANGUAGES[told["language"]][1]:
            assert words in text
        assert f"1:{sheet['scale']:,.0f} " in text
        assert "CH1903+ / LV95 (EPSG:2056)" in text
        assert "[%" not in text
        assert sheet["cut"] == []


def test_the_maps_scale_is_round_and_it_shows_what_the_legend_names(told):
    terrain = LANGUAGES[told["language"]][2]
    for sheet in told["sheets"].values():
        assert f"{sheet['scale']:.0f}".rstrip("0") in ("1", "2", "25", "5")
        assert sheet["map_layers"] == sorted([*sheet["legend"], terrain])


def test_the_sheets_are_printed_in_colour_within_their_edges(told):
    for name, sheet in told["sheets"].items():
        high, wide = PIXELS[name.rpartition(" ")[2]]
        with Image.open(f"{sheet['place']}.png") as picture:
            pixels = np.asarray(picture.convert("RGB")).astype(int)
        assert np.abs(np.array(pixels.shape[:2]) - (high, wide)).max() <= 1
        edge = round(4.0 / 25.4 * 100)
        for part in (pixels[:edge], pixels[-edge:], pixels[:, :edge], pixels[:, -edge:]):
            assert (part == 255).all()
        colour = (pixels.max(axis=2) - pixels.min(axis=2)) > 60
        on_map, in_legend = (
            (colour[130:750, 40:840], colour[130:700, 860:1130]) if wide > high else (colour[160:870], colour[885:1105])
        )
        assert on_map.sum() > 2000  # hits, logs and lines
        assert in_legend.sum() > 200  # their colours
        assert (pixels[high - 60 : high - 20, 40:600] < 100).any()  # the foot
        assert sheet["legend_ends_mm"] < high / 100.0 * 25.4 - 14.0
        assert sheet["legend_right_mm"] < wide / 100.0 * 25.4 - 5.0
        assert Path(f"{sheet['place']}.pdf").stat().st_size > 20_000


@pytest.mark.parametrize("number", [0, 1])
def test_logs_at_rest_appear_when_they_have_come_to_rest(told, number):
    durations, name = told["durations"], LANGUAGES[told["language"]][0][number]
    half = sum(each <= durations[-1] / 2.0 + 0.25 for each in durations)
    assert durations[0] > 0.25
    assert told[name] == [0, half, len(durations)]
    assert 0 < half < len(durations)
