"""What is doubted about friction, canopies, coordinates, lines with heights, and pages of web services."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import geopandas
import numpy as np
import pytest

from deadwood_algorithms.files.embedded import embed
from deadwood_algorithms.files.vectors import read_table
from deadwood_algorithms.intake import places, terrain, values
from deadwood_algorithms.intake.pages import one_page
from deadwood_algorithms.intake.places import off_the_ground, rounded
from deadwood_algorithms.intake.values import codes, frictionless, groundless, nowhere_low, too_large, too_tall


def canopy() -> np.ndarray:
    """Crowns up to 25 m on half of the ground, and shrubs."""
    return np.concatenate([np.zeros(2000), np.linspace(0.5, 25.0, 2000)])


@pytest.mark.parametrize("shift", [-48.0, -3.0, 2.0, 4.0, 8.0, 55.0])
def test_a_canopy_above_another_zero_is_doubted(shift):
    """Also by some metres: its ground is all at one height that is not 0."""
    assert groundless(canopy()) is None
    assert groundless(canopy() + np.random.default_rng(0).normal(0.0, 0.1, 4000) + shift) is not None
    assert groundless(np.linspace(6.0, 25.0, 4000)) is None  # a closed one


@pytest.mark.parametrize("times", [1 / 0.3048, 10.0, 100.0])
def test_a_canopy_in_another_unit_is_doubted(times):
    assert too_tall(canopy()) is None
    assert too_tall(canopy() * times) is not None
    assert too_tall(canopy() + 700.0) is None  # a surface, which is said to be one


def test_undeclared_zeros_of_friction_are_doubted():
    some = frictionless(np.repeat([0.3, 0.0], [95, 5]))
    assert some is not None
    assert some.numbers["share"] == pytest.approx(0.05)
    for fine in (np.full(9, 0.3), np.zeros(9), np.array([0.0, 1.0, 2.0]), np.array([np.nan, 0.4])):
        assert frictionless(fine) is None


def test_friction_of_1_and_more_everywhere_is_doubted():
    """A mask, or codes between whole numbers; one number, and few cells that are rough, are not."""
    for weights in (np.full(9, 1.0), np.array([1.0, 1.5, np.nan]), np.array([1.2, 1.4])):
        some = nowhere_low(weights)
        assert some is not None
        assert some.numbers["lowest"] == np.nanmin(weights)
    for fine in (np.array([0.9, 1.5]), np.array([1.0, 3.0]), np.array([30.0, 45.5]), np.array([np.nan])):
        assert nowhere_low(fine) is None  # whole numbers and percent are doubted as such


def test_friction_of_codes_or_of_several_units_is_doubted():
    assert codes(np.array([1.0, 3.0, 3.0, np.nan])) is not None
    assert codes(np.array([0.3, 0.4, 1.0])) is None
    assert codes(np.full(9, 1.0)) is None
    some = too_large(np.repeat([0.3, 30.0], [90, 10]))
    assert some is not None
    assert some.numbers["share"] == pytest.approx(0.1)
    assert too_large(np.repeat([0.3, 1.2], [90, 10])) is None


def test_a_canopy_comes_down_to_the_ground():
    heights = np.clip(np.random.default_rng(2).normal(8.0, 9.0, 10_000), 0.0, None)
    assert groundless(heights) is None
    doubt = groundless(heights + 52.0)
    assert doubt is not None
    assert doubt.numbers["lowest_m"] == pytest.approx(52.0)
    assert groundless(np.where(heights < 5.0, np.nan, heights)) is None  # cut off by its maker


def test_coordinates_cut_by_a_spreadsheet_are_doubted():
    draw = np.random.default_rng(3)
    x, y = 2_700_000 + draw.uniform(0, 160, 40), 1_200_000 + draw.uniform(0, 200, 40)
    assert rounded(x, y) is None
    assert rounded(np.round(x), np.round(y)) is None
    cut = [np.array([float(f"{each:.5E}") for each in axis]) for axis in (x, y)]
    doubt = rounded(*cut)
    assert doubt is not None
    assert doubt.numbers["step_m"] == 10.0
    assert rounded(cut[0], y) is not None
    assert rounded(np.round(8.75 + x / 1e9, 4) + np.arange(40) * 1e-4, 46.9 + y / 1e9, degrees=True) is not None


def test_a_tunnel_is_doubted_by_its_z():
    item = np.array([0, 0, 1, 1])
    doubt = off_the_ground(["road", "tunnel"], item, np.array([0.3, -0.5, -42.0, -42.0]), np.full(4, 5.0))
    assert doubt is not None
    assert doubt.numbers == {"metres": -42.0, "length_m": 10.0, "lines": 1}
    assert off_the_ground(["road"], np.zeros(2, int), np.array([0.3, np.nan]), np.full(2, 5.0)) is None


ROW = {
    "type": "Feature",
    "properties": {"numberMatched": 99},
    "geometry": {"type": "Point", "coordinates": [8.0, 46.0]},
}


@pytest.mark.parametrize(
    ("members", "total"),
    [
        ({"numberMatched": 40, "numberReturned": 10}, 40),
        ({"totalFeatures": 40}, 40),
        ({"totalFeatures": "unknown", "numberMatched": 40}, 40),
        ({"links": [{"rel": "self", "href": "a"}, {"rel": "next", "href": "b"}]}, None),
        ({"properties": {"exceededTransferLimit": True}}, None),
        ({"exceededTransferLimit": True}, None),
        ({"context": {"matched": 40, "returned": 10}}, 40),
        ({"next": "https://example.org/?page=2"}, None),
        ({"pagination": {"total_items": 40, "per_page": 10}}, 40),
        ({"page": 1, "pages": 4}, None),
        ({"meta": {"total_pages": 4, "current_page": 1}}, None),
        ({"result": {"total": 40}}, 40),
        ({"_links": {"next": {"href": "b"}}}, None),
        ({"links": [{"rel": "http://www.opengis.net/def/rel/next"}]}, None),
        ({"nextPageToken": "abc"}, None),
        ({"pageInfo": {"hasNextPage": True}}, None),
        ({"nhits": 40}, 40),
    ],
)
def test_a_page_of_a_service_says_so_itself(tmp_path, members, total):
    path = tmp_path / "a.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [ROW] * 10} | members))
    doubt = one_page(path, 10)
    assert doubt is not None
    assert doubt.numbers == {"rows": 10} | ({"total": total} if total else {})


WHOLE = ({}, {"numberMatched": 10}, {"next": None}, {"exceededTransferLimit": False}, {"page": 1, "pages": 1})
WHOLE += ({"links": [{"rel": "self"}, {"rel": "prev"}]}, {"pagination": {"total": 10, "next": ""}}, {"total": "many"})


def test_a_page_in_an_archive(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as packed:
        packed.writestr("in/trees.geojson", json.dumps({"features": [ROW] * 10, "numberMatched": 40}))
    doubt = one_page(tmp_path / "a.zip", 10)
    assert doubt is not None
    assert doubt.numbers["total"] == 40


@pytest.mark.parametrize("rows", [1000, 2000, 5000, 10_000])
def test_as_many_rows_as_a_page_are_doubted_where_the_file_says_nothing(tmp_path, rows):
    """A GeoPackage or a shapefile that a service's answer was saved as."""
    doubt = one_page(tmp_path / "a.gpkg", rows, by_size=True)
    assert doubt is not None
    assert (doubt.code, doubt.numbers) == ("page-size", {"rows": rows})
    assert one_page(tmp_path / "a.gpkg", rows) is None
    assert one_page(tmp_path / "a.gpkg", rows + 1, by_size=True) is None
    (tmp_path / "a.geojson").write_text(json.dumps({"features": [], "numberMatched": rows}))
    assert one_page(tmp_path / "a.geojson", rows, by_size=True) is None


@pytest.mark.parametrize(
    ("what", "record", "said"),
    [("lines", False, 1), ("trees", False, 1), ("releases", False, 0), ("deposits", False, 0), ("lines", True, 0)],
)
def test_positions_that_users_draw_and_layers_of_ours_may_have_any_number_of_rows(tmp_path, what, record, said):
    path = tmp_path / "a.gpkg"
    rows = geopandas.GeoDataFrame({"n": range(1000)}, geometry=geopandas.points_from_xy(range(1000), [7.0] * 1000))
    rows.to_file(path)
    if record:
        embed(path, {"tool": "slide-logs"})
    assert len(read_table(path, what=what).attrs.get("doubts", ())) == said


@pytest.mark.parametrize("members", WHOLE)
def test_a_whole_answer_is_not_doubted(tmp_path, members):
    path = tmp_path / "a.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [ROW] * 10} | members))
    assert one_page(path, 10) is None


def test_a_page_of_gml_says_so_in_its_attributes(tmp_path):
    path = tmp_path / "a.gml"
    path.write_text(
        '<wfs:FeatureCollection xmlns:wfs="w" numberMatched="40" numberReturned="10"></wfs:FeatureCollection>'
    )
    doubt = one_page(path, 10)
    assert doubt is not None
    assert doubt.numbers["total"] == 40
    path.write_text('<w:C xmlns:w="w" numberMatched="unknown"><w:truncatedResponse/></w:C>')
    assert one_page(path, 10) is not None


def test_the_page_lists_every_check():
    page = (Path(__file__).parents[3] / "docs" / "how-to" / "inspect.md").read_text(encoding="utf-8")
    for check in (terrain.NO_HEIGHTS, *terrain.CHECKS, *values.FRICTION, *values.CANOPY, *places.CHECKS):
        assert f"| `{check.code}` | {check.doubts} |" in page


@pytest.mark.parametrize("step", [10.0, 20.0, 25.0, 50.0, 500.0])
def test_rounded_coordinates_name_their_step(step):
    """Also if a few points were not rounded."""
    draw = np.random.default_rng(2)
    x, y = 2_700_000.0 + draw.uniform(0.0, 9000.0, 40), 1_200_000.0 + draw.uniform(0.0, 9000.0, 40)
    assert rounded(x, y) is None
    coarse = np.rint(x / step) * step
    coarse[5] = x[5]
    doubt = rounded(coarse, y)
    assert doubt is not None
    assert doubt.numbers["step_m"] == step
    assert doubt.text.startswith("98 % of the eastings")
    whole = np.rint(x), np.rint(y)
    assert rounded(*whole) is None
