"""The layer that a dialog of QGIS proposes for a required input: one that is named like it, or none."""

from __future__ import annotations

import pytest

from deadwood_toolbox import parameters
from deadwood_toolbox.qgis_plugin import proposals
from deadwood_toolbox.shelf import TOOLS

IN = "/data/sample.gpkg|layername="
BARRIERS, ROAD, DAMS = ("Barriers", f"{IN}barriers"), ("Road", f"{IN}lines"), ("Dams", f"{IN}dams")
DEPOSITS, RELEASES = ("Deposits", "/run/run.gpkg|layername=deposits"), ("Released logs", f"{IN}releases")
TREES, DANGER, HITS = ("Trees", f"{IN}trees"), ("Danger", "/run/danger.tif"), ("Hit count", "/run/hit_count.tif")
TERRAIN, SURVEY = ("Terrain", "/data/swissalti3d.tif"), ("Survey 2024", "/data/survey.tif")


@pytest.fixture(scope="module")
def known() -> dict[str, list[str]]:
    return proposals.kinds(parameters.describe(each) for each in TOOLS if each.in_qgis)


@pytest.mark.parametrize(
    ("name", "layers", "proposed"),
    [
        ("lines", [BARRIERS, ROAD], ROAD),  # before: the first in the alphabet
        ("lines", [BARRIERS], None),
        ("lines", [BARRIERS, ("Cantonal road", "/data/k.shp")], ("Cantonal road", "/data/k.shp")),
        ("lines", [BARRIERS, ("A13", "/data/a13.shp")], ("A13", "/data/a13.shp")),  # nothing else is left
        ("lines", [("A13", "/data/a13.shp"), ("A28", "/data/a28.shp")], None),
        ("structures", [BARRIERS, ROAD], None),
        ("structures", [BARRIERS, ROAD, DAMS], DAMS),
        ("releases", [DEPOSITS, RELEASES, TREES], RELEASES),
        ("deposits", [RELEASES, DEPOSITS], DEPOSITS),
        ("trees", [DEPOSITS, RELEASES, TREES], TREES),
        ("dem", [DANGER, HITS, TERRAIN], TERRAIN),
        ("dem", [DANGER, HITS, SURVEY], SURVEY),
        ("dem", [DANGER, HITS], None),
        ("dem", [], None),
    ],
)
def test_the_layer_that_is_named_like_the_input(known, name, layers, proposed):
    number = proposals.proposed(name, known, layers)
    assert (None if number is None else layers[number]) == proposed


def test_in_another_language_the_labels_are_its_own():
    known = {"lines": ["Strassen, Bahnlinien, Häuser"], "barriers": ["Barrieren"]}
    layers = [("Barrieren", "/a/b.shp"), ("Strasse", "/a/s.shp")]
    assert proposals.proposed("lines", known, layers) == 1
