"""Which law fills a missing DBH: given, published, by zone, with the crown, or fitted; and the notes on it."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
from shapely import Point, box

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.prepare.trees.allometry import NAMED_LAWS, CrownLaw, PowerLaw
from deadwood_algorithms.prepare.trees.dbh_filling import fill_sizes

EAST, NORTH = 2_783_050.0, 1_190_050.0


def trees(*heights: float, **columns) -> gpd.GeoDataFrame:
    shapes = [Point(EAST + 10 * k, NORTH) for k in range(len(heights))]
    return gpd.GeoDataFrame({"height_m": list(heights), **columns}, geometry=shapes, crs=2056)


def zones(tmp_path, *spans, name="zones.gpkg", **columns) -> str:
    shapes = [box(EAST + west, NORTH - 5, EAST + east, NORTH + 5) for west, east in spans]
    gpd.GeoDataFrame(columns, geometry=shapes, crs=2056).to_file(tmp_path / name)
    return str(tmp_path / name)


def test_the_law_and_its_inverse():
    done = fill_sizes(np.array([np.nan, 31.2, np.nan]), np.array([20.0, np.nan, np.nan]), PowerLaw(2.52, 0.84))
    assert done.dbh[0] == pytest.approx(2.52 * np.exp(0.84 * np.log(20)))
    assert 2.52 * done.height[1] ** 0.84 == pytest.approx(31.2)
    assert (done.from_height.tolist(), done.from_dbh.tolist()) == ([True, False, False], [False, True, False])
    assert np.isnan(done.dbh[2])
    assert done.said == ()


def test_a_law_with_the_crown_leaves_trees_without_one_to_the_other():
    height, crown = np.array([20.0, 20.0, 25.0]), np.array([5.0, np.nan, np.nan])
    done = fill_sizes(np.array([np.nan, np.nan, 40.0]), height, CrownLaw(1.0, 0.7), crown, otherwise=PowerLaw(2.0, 1.0))
    assert done.dbh.tolist() == pytest.approx([100**0.7, 40, 40])
    assert done.said == ("1 of these have no crown diameter; for them DBH[cm] = 2 * H[m]^1 is used",)


def test_a_published_law_by_name(imported, outcome):
    frame = imported(trees(20.0, 30.0), "t.gpkg", dbh_law="chablais-spruce")
    assert frame["dbh_cm"].tolist() == pytest.approx([1.357 * 20**1.071, 1.357 * 30**1.071])
    said = outcome["last"].lines
    assert "2 DBH missing, computed from the height: DBH[cm] = 1.357 * H[m]^1.071 (chablais-spruce)" in said


def test_the_law_with_the_crown_by_name(imported, outcome):
    frame = imported(
        trees(20.0, 30.0, crown_diameter_m=[5.0, np.nan]), "t.gpkg", dbh_law="jucker-mixed-forest-angiosperm"
    )
    assert frame["dbh_cm"].tolist() == pytest.approx([0.694 * 100**0.730, 2.52 * 30**0.84])
    said = " / ".join(outcome["last"].lines)
    assert "2 DBH missing, computed from the height: DBH[cm] = 0.694 * (H[m] * crown diameter[m])^0.73 (jucker-" in said
    assert "1 of these have no crown diameter" in said


def test_a_and_b_serve_the_trees_without_a_crown(imported):
    given = trees(20.0, 30.0, crown_diameter_m=[5.0, np.nan])
    frame = imported(given, "t.gpkg", dbh_law="jucker-boreal-gymnosperm", dbh_a=2.0, dbh_b=1.0)
    assert frame["dbh_cm"].tolist() == pytest.approx([1.43 * 100**0.649, 60])


def test_the_crown_of_a_polygon_serves_the_law(imported):
    crown = gpd.GeoDataFrame({"height_m": [20.0]}, geometry=[box(EAST, NORTH, EAST + 4, NORTH + 5)], crs=2056)
    frame = imported(crown, "c.gpkg", dbh_law="jucker-global")
    diameter = 2 * np.sqrt(20 / np.pi)
    assert frame["crown_diameter_m"][0] == pytest.approx(diameter)
    assert frame["dbh_cm"][0] == pytest.approx(
        NAMED_LAWS["jucker-global"].dbh(np.array([20.0]), np.array([diameter]))[0]
    )


@pytest.mark.parametrize(
    ("measure", "diameter"), [(None, 8.0), ("diameter", 8.0), ("radius", 16.0), ("area", 2 * np.sqrt(8 / np.pi))]
)
def test_what_the_crown_field_holds_can_be_reported(imported, measure, diameter):
    frame = imported(trees(20.0, Krone=[8.0]), "t.gpkg", crown_field="Krone", crown_measure=measure)
    assert frame["crown_diameter_m"][0] == pytest.approx(diameter)


def test_swiss_laws_in_new_zealand_are_reported(imported, said):
    there = gpd.GeoDataFrame({"height_m": [20.0]}, geometry=[Point(1_749_000.0, 5_428_000.0)], crs=2193)
    imported(there, "nz.gpkg", crs=None)
    assert any("fint-ch was made of trees of Switzerland, and these stand at 41.3" in each for each in said.warnings)
    before = len(said.warnings)
    imported(trees(20.0), "t.gpkg")
    assert not any("Switzerland" in each for each in said.warnings[before:])


def test_zones_have_laws_of_their_own(imported, tmp_path, outcome):
    layer = zones(tmp_path, (-5, 15), (5, 15), dbh_a=[1.0, 3.0], dbh_b=[1.25, 1.0])
    frame = imported(trees(20.0, 20.0, 20.0), "t.gpkg", dbh_zones=layer, dbh_a=2.0, dbh_b=1.0)
    # In the first zone; in both, where the later row counts; in none.
    assert frame["dbh_cm"].tolist() == pytest.approx([20**1.25, 60, 40])
    assert "3 DBH missing, computed from the height: DBH by the laws of 2 zones; 1 tree stands in none, there DBH" in (
        " / ".join(outcome["last"].lines)
    )


def test_zones_may_name_published_laws_in_another_crs(imported, tmp_path):
    layer = zones(tmp_path, (-5, 15), dbh_law=["Jucker-Global"])
    gpd.read_file(layer).to_crs(4326).to_file(tmp_path / "wgs.gpkg")
    frame = imported(trees(20.0, crown_diameter_m=[5.0]), "t.gpkg", dbh_zones=str(tmp_path / "wgs.gpkg"))
    assert frame["dbh_cm"][0] == pytest.approx(0.557 * 100**0.809 * np.exp(0.056**2 / 2))


def test_forty_zones_are_not_too_many(imported, tmp_path):
    layer = zones(tmp_path, *[(10 * k - 1, 10 * k + 1) for k in range(40)], dbh_a=np.arange(1.0, 41), dbh_b=np.ones(40))
    frame = imported(trees(*[10.0] * 40), "t.gpkg", dbh_zones=layer)
    assert frame["dbh_cm"].tolist() == pytest.approx((10 * np.arange(1.0, 41)).tolist())


def test_faulty_zones(imported, tmp_path):
    for columns, words in (
        ({"dbh_a": [1.0]}, "zones need the fields dbh_a and dbh_b, or dbh_law; it has the fields dbh_a"),
        ({"dbh_a": [0.0], "dbh_b": [1.0]}, "field 'dbh_a', row 1: 0 is not a number greater than 0"),
        ({"dbh_law": ["oak"]}, "field 'dbh_law', row 1: 'oak' is none of fint-ch"),
    ):
        with pytest.raises(UserError, match=words):
            imported(trees(20.0), "t.gpkg", dbh_zones=zones(tmp_path, (-5, 5), **columns))
    with pytest.raises(UserError, match="no tree stands in a zone; check the CRS of both"):
        imported(trees(20.0), "t.gpkg", dbh_zones=zones(tmp_path, (500, 600), dbh_a=[1.0], dbh_b=[1.0]))


def sample_table(n: int = 30) -> str:
    height = np.linspace(8.0, 35.0, n)
    rows = "".join(f"{h:.6f};{1.2 * h**1.1:.6f};alive\n" for h in height)
    return "h;bhd;status\n" + rows + "12;90;dead\n;40;\n"  # a snag, and a tree without height: neither counts


def test_a_law_fitted_to_a_sample_of_measured_trees(imported, tmp_path, outcome):
    (tmp_path / "sample.csv").write_text(sample_table())
    frame = imported(trees(20.0, np.nan, dbh_cm=[np.nan, 40.0]), "t.gpkg", dbh_sample=str(tmp_path / "sample.csv"))
    assert frame["dbh_cm"][0] == pytest.approx(1.2 * 20**1.1, rel=1e-4)
    assert frame["height_m"][1] == pytest.approx((40 / 1.2) ** (1 / 1.1), rel=1e-4)
    said = " / ".join(outcome["last"].lines)
    assert "DBH[cm] = 1.2 * H[m]^1.1 (fitted to 30 trees, s " in said


def test_the_table_itself_may_be_the_sample(imported, tmp_path, outcome):
    height = np.arange(10.0, 40.0)
    dbh = 1.2 * height**1.1
    dbh[[3, 7]] = np.nan
    frame = imported(trees(*height, dbh_cm=dbh), "t.gpkg", dbh_sample=str(tmp_path / "t.gpkg"))
    assert frame["dbh_cm"].tolist() == pytest.approx((1.2 * height**1.1).tolist(), rel=1e-9)
    assert outcome["last"].facts["dbh_from_height"] == 2


def test_samples_that_bear_no_law(imported, tmp_path, said):
    for rows, words in (
        ("20;30\n25;40\n", "of the sample's 2 trees, 2 have both a DBH and a height; a fit needs at least 3"),
        ("20;30\n20;40\n20;50\n", "all trees of the sample have the same height or DBH"),
        ("20;50\n25;40\n30;30\n", "in the sample the DBH decreases with the height"),
    ):
        (tmp_path / "sample.csv").write_text("h;dbh\n" + rows)
        with pytest.raises(UserError, match=words):
            imported(trees(20.0), "t.gpkg", dbh_sample=str(tmp_path / "sample.csv"))
    (tmp_path / "sample.csv").write_text("h;dbh\n20;30\n25;40\n30;45\n")
    imported(trees(20.0), "t.gpkg", dbh_sample=str(tmp_path / "sample.csv"))
    assert "a law fitted to 3 trees only is uncertain" in said.warnings[0]


def test_two_laws_are_one_too_many(imported, tmp_path):
    with pytest.raises(UserError, match="--dbh-law fint and --dbh-a 2, --dbh-b 1 are two laws; give one of them"):
        imported(trees(20.0), "t.gpkg", dbh_law="fint", dbh_a=2.0, dbh_b=1.0)
    (tmp_path / "sample.csv").write_text(sample_table())
    with pytest.raises(UserError, match="--dbh-sample fits the law that --dbh-law"):
        imported(trees(20.0), "t.gpkg", dbh_law="fint", dbh_sample=str(tmp_path / "sample.csv"))


def test_a_dbh_of_the_table_can_be_replaced(imported, outcome):
    frame = imported(trees(20.0, np.nan, dbh_cm=[99.0, 50.0]), "t.gpkg", replace_dbh=True, dbh_law="fint")
    assert frame["dbh_cm"].tolist() == pytest.approx([20**1.25, 50])
    assert frame["dbh_source"].tolist() == ["modelled", "measured"]
    assert "1 DBH of the table set aside (--replace-dbh)" in outcome["last"].lines


def test_a_law_that_has_nothing_to_do_is_reported(imported, said):
    known = trees(20.0, dbh_cm=[33.0])
    imported(known, "t.gpkg")
    assert said.warnings == []
    for values in ({"dbh_law": "fint"}, {"dbh_a": 2.0}):
        imported(known, "t.gpkg", **values)
        assert "so the law is not used; --replace-dbh uses it" in said.warnings.pop()
        imported(known, "t.gpkg", **values, replace_dbh=True)
        assert said.warnings == []


def test_a_law_that_gives_no_trees_is_suspected(imported, said):
    imported(trees(20.0), "t.gpkg", dbh_a=0.05, dbh_b=1.0)
    assert "computed DBH: the median dbh_cm is 1 cm, which is too small; check the law (--dbh-law" in said.warnings[0]


@pytest.mark.parametrize(("unit", "dbh"), [("in", 25.4), ("girth-cm", 10 / np.pi), ("mm", 1.0)])
def test_units_of_the_dbh(imported, unit, dbh):
    assert imported(trees(20.0, D=[10.0]), "t.gpkg", dbh_unit=unit)["dbh_cm"][0] == pytest.approx(dbh)
