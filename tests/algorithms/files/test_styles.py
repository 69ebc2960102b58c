"""Styles stored beside the data: complete for their content, well-formed, and where QGIS looks for them."""

from __future__ import annotations

import itertools
import sqlite3
from pathlib import Path
from xml.etree import ElementTree

import geopandas as gpd
import numpy as np
import pytest
import shapely

from deadwood_algorithms import schemas
from deadwood_algorithms.files import qml, styles
from deadwood_algorithms.files.crs import parse_crs
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.rasters import write_raster
from deadwood_algorithms.files.vectors import write_vector
from deadwood_algorithms.schemas.looks import ROAD


def frame(*shapes, **columns) -> gpd.GeoDataFrame:
    return gpd.GeoDataFrame(columns, geometry=list(shapes), crs="EPSG:2056")


def points(count: int, **columns) -> gpd.GeoDataFrame:
    return frame(*(shapely.Point(k, k) for k in range(count)), **columns)


def parsed(style: styles.Style | None) -> ElementTree.Element:
    assert style is not None
    return ElementTree.fromstring(style.document().partition("\n")[2])


def test_every_way_to_end_has_its_colour_and_label():
    assert set(styles.ENDS) == set(schemas.STOP_REASONS)
    root = parsed(styles.of_layer("deposits", points(2, stop_reason=["rest", "tree"])))
    renderer = root.find("renderer-v2")
    assert renderer is not None
    assert renderer.get("attr") == "stop_reason"
    values = [each.get("value") for each in renderer.iter("category")]
    assert values == list(schemas.STOP_REASONS)  # also those that this run has none of: legends of two runs agree
    symbols = {each.get("name") for each in renderer.iter("symbol")}
    assert {each.get("symbol") for each in renderer.iter("category")} == symbols


def test_classes_join_and_cover_everything():
    for name, data, field in (
        ("trajectories", frame(shapely.LineString([(0, 0), (1, 1)]), speed_max_ms=[8.0]), "speed_max_ms"),
        ("trees", points(1, dbh_cm=[30.0], height_m=[20.0]), "dbh_cm"),
        ("reach", frame(shapely.LineString([(0, 0), (1, 1)]), line_id=["road"], p=[0.2]), "p"),
    ):
        root = parsed(styles.of_layer(name, data))
        ranges = [(float(each.get("lower", "")), float(each.get("upper", ""))) for each in root.iter("range")]
        assert ranges[0][0] == 0.0
        assert all(high == low for (_, high), (low, _) in itertools.pairwise(ranges))
        assert ranges[-1][1] >= (1.0 if field == "p" else 1e9)
        assert root.find("renderer-v2").get("attr") == field  # type: ignore[union-attr]


def test_a_road_keeps_its_colour_around_its_share():
    """Reached by 1 to 3 %, it had the colour of a barrier."""
    root = parsed(styles.of_layer("reach", frame(shapely.LineString([(0, 0), (1, 1)]), line_id=["road"], p=[0.02])))
    for symbol in root.iter("symbol"):
        around, inside = (
            {each.get("name"): each.get("value") for each in layer.iter("Option")} for layer in symbol.iter("layer")
        )
        assert around["line_color"] == qml.rgba(ROAD)
        assert float(around["line_width"] or 0) > float(inside["line_width"] or 0)


def test_labels_have_a_weight():
    """Without one QGIS draws the thinnest letters, which the halo makes grey."""
    root = parsed(styles.of_layer("reach", frame(shapely.LineString([(0, 0), (1, 1)]), line_id=["road"], p=[0.02])))
    (text,) = root.iter("text-style")
    assert int(text.get("fontWeight", "0")) >= 50
    assert text.get("namedStyle")


def test_trees_stand_in_three_dimensions_with_the_mean_size_of_their_class():
    trees = points(3, dbh_cm=[20.0, 40.0, 60.0], height_m=[11.0, 13.0, 31.0])
    rules = list(parsed(styles.of_layer("trees", trees)).iter("rule"))
    assert [each.get("filter") for each in rules] == [
        '"height_m" >= 10 and "height_m" < 15',
        '"height_m" >= 30 and "height_m" < 35',
    ]
    sizes = {each.get("name"): float(each.get("value", "")) for each in rules[0].iter("Option") if each.get("name")}
    assert sizes == {"bottomRadius": pytest.approx(0.15), "topRadius": pytest.approx(0.075), "length": 12.0}
    raised = rules[0].find(".//transform").get("matrix").split()  # type: ignore[union-attr]
    assert float(raised[13]) == 6.0  # half the length: QGIS sets the middle of a shape on the ground


def test_a_stump_has_its_own_symbol_and_stands_as_a_cylinder():
    trees = points(3, dbh_cm=[20.0, 40.0, 60.0], height_m=[0.5, 13.0, 31.0])
    root = parsed(styles.of_layer("trees", trees))
    (drawn,) = [each for each in root.iter("renderer-v2") if each.get("type") == "graduatedSymbol"]
    assert "height_m" in str(drawn.get("attr"))
    low, *others = drawn.iter("range")
    assert float(str(low.get("upper"))) < 0.0 <= float(str(others[0].get("lower")))
    assert low.get("label") == "stump"
    without = parsed(styles.of_layer("trees", points(1, dbh_cm=[20.0], height_m=[13.0])))
    assert next(iter(without.iter("renderer-v2"))).get("attr") == "dbh_cm"


def test_a_layer_without_a_name_in_the_table_goes_by_its_columns_and_a_mixed_one_stays_as_it_is():
    assert parsed(styles.of_layer("barrier_hits", points(1, speed_ms=[3.0]))).find(".//range") is not None
    assert parsed(styles.of_layer("held", points(1, stop_reason=["tree"]))).find(".//category") is not None
    assert parsed(styles.of_layer("anything", points(1))).find("renderer-v2") is not None
    assert styles.of_layer("mixed", frame(shapely.Point(0, 0), shapely.box(0, 0, 1, 1))) is None


def stops(style: styles.Style | None) -> list[tuple[float, int]]:
    return [(float(each.get("value", "")), int(each.get("alpha", ""))) for each in parsed(style).iter("item")]


def test_counts_are_transparent_at_zero_and_even_on_the_logarithm():
    found = stops(styles.of_raster("counts", np.array([[0, 1], [7, 10_000]], np.uint32)))
    assert found[0] == (0.0, 0)
    assert found[1] == (1.0, 255)
    assert found[-1] == (10_000.0, 255)
    even = np.geomspace(1.0, 10_000.0, len(styles.HITS))
    assert np.abs(np.array([value for value, _ in found[1:]]) - even).max() <= 0.5  # rounded to whole logs
    assert stops(styles.of_raster("counts", np.zeros((2, 2), np.uint32)))[0] == (0.0, 0)


def test_differences_are_symmetric_on_one_scale_with_nothing_at_no_difference():
    small, large = (styles.of_raster("difference of shares", np.array([[np.nan, -far]])) for far in (0.004, 0.4))
    found = stops(small)
    assert found == stops(large)  # two maps of differences can be laid side by side
    assert [value for value, _ in found] == pytest.approx([-value for value, _ in found[::-1]])
    assert [alpha for _, alpha in found].index(0) == len(found) // 2


@pytest.mark.parametrize("kind", sorted(styles.RASTERS))
def test_rasters_of_every_kind_have_a_style_with_rising_stops(kind):
    values = np.array([[0.5, np.nan], [3.0, 160.0]], np.float32)
    root = parsed(styles.of_raster(kind, values))
    found = [float(each.get("value", "")) for each in root.iter("item")]
    assert found == sorted(set(found))
    if kind == "energy":
        assert found[-1] >= 160.0
    assert root.find(".//rasterrenderer").get("band") == "1"  # type: ignore[union-attr]


def test_styles_stand_where_qgis_looks_for_them(tmp_path: Path):
    package = tmp_path / "a.gpkg"
    write_vector(package, {"deposits": points(1, stop_reason=["rest"]), "releases": points(2)})
    with sqlite3.connect(package) as database:
        rows = database.execute("SELECT f_table_name, f_geometry_column, useAsDefault, styleQML FROM layer_styles")
        stored = {name: (column, default, text) for name, column, default, text in rows}
    assert set(stored) == {"deposits", "releases"}
    for column, default, text in stored.values():
        assert (column, default) == ("geom", 1)
        ElementTree.fromstring(text.partition("\n")[2])
    crs = parse_crs("EPSG:2056")
    grid = Grid(np.ones((3, 4), np.float32), 1.0, 0.0, 0.0, crs, "test")
    write_raster(tmp_path / "hits.tif", np.ones((3, 4)), grid, dtype="uint32", units="logs", style="counts")
    assert "singlebandpseudocolor" in (tmp_path / "hits.qml").read_text(encoding="utf-8")
    write_raster(tmp_path / "other.tif", np.ones((3, 4)), grid, dtype="float32", units="km")
    assert not (tmp_path / "other.qml").exists()


def test_boulders_are_spheres_of_their_size_at_their_height():
    """One rule for each class of diameter: mean radius, and the middle a radius below the tops."""
    root = parsed(styles.of_layer("blocks", points(3, diameter_m=[2.0, 2.4, 5.0], height_m=[1.0, 1.2, 5.0])))
    rules = list(root.iter("rule"))
    sizes = [float(each.find(".//shape-properties//Option[@name='radius']").get("value")) for each in rules]  # type: ignore[union-attr]
    up = [float(each.find(".//transform").get("matrix").split()[13]) for each in rules]  # type: ignore[union-attr]
    assert [each.find("symbol").get("shape") for each in rules] == ["sphere", "sphere"]  # type: ignore[union-attr]
    assert sizes == pytest.approx([1.1, 2.5])
    assert up == pytest.approx([1.1 - 1.1, 5.0 - 2.5])
    assert rules[0].get("filter") == '"diameter_m" >= 2 and "diameter_m" < 2.5'


def test_labels_of_classes_are_made_again_from_their_ends_and_names_from_their_words():
    symbol = qml.marker("#000000", 1.0)
    rows = [
        (0.0, 0.1, qml.Span("<% & kg>", None, 0.1), symbol),
        (0.1, 20.5, qml.Span("m", 0.1, 20.5), symbol),
        (20.5, 1e9, qml.Span("m", 20.5), symbol),
        (-1.0, 0.0, "20 to 40 m", symbol),  # a name, though it reads like a class
    ]
    style = qml.graduated("x", rows)
    shown = [each.get("label") for each in ElementTree.fromstring(style).iter("range")]
    assert shown == ["up to 0.1 <% & kg>", "0.1 to 20.5 m", "over 20.5 m", "20 to 40 m"]
    heard = []
    again = qml.relabelled(style, lambda label: heard.append(label) or f"{len(heard)}")
    assert heard == [label for _, _, label, _ in rows]
    assert [each.get("label") for each in ElementTree.fromstring(again).iter("range")] == ["1", "2", "3", "4"]
    assert qml.relabelled(style, lambda label: label) == style
