"""Single-tree tables as programs and people write them become one trees layer."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
from shapely import Point, Polygon

from deadwood_algorithms.files.embedded import record_in
from deadwood_algorithms.files.identity import content_of
from deadwood_algorithms.params.tool import UserError

EAST, NORTH = 2_783_050.0, 1_190_050.0


def points(*heights: float, crs="EPSG:2056", **columns) -> gpd.GeoDataFrame:
    n = len(heights) or len(next(iter(columns.values())))
    z = heights or [None] * n
    shapes = [Point(EAST + i, NORTH) if h is None else Point(EAST + i, NORTH, h) for i, h in enumerate(z)]
    return gpd.GeoDataFrame(columns, geometry=shapes, crs=crs)


def test_a_plain_table_is_taken_as_it_is(imported, outcome):
    frame = imported(
        f"tree_id,x,y,dbh_cm,height_m,species\n7,{EAST},{NORTH},30.5,20,spruce\n9,{EAST + 1},{NORTH},60,35,fir\n"
    )
    assert frame["tree_id"].tolist() == [7, 9]
    assert frame["dbh_cm"].tolist() == [30.5, 60]
    assert frame["height_m"].tolist() == [20, 35]
    assert frame["species"].tolist() == ["spruce", "fir"]
    assert frame["dbh_source"].tolist() == ["measured", "measured"]
    assert frame.geometry.tolist() == [Point(EAST, NORTH), Point(EAST + 1, NORTH)]
    assert frame.crs.to_epsg() == 2056
    assert outcome["last"].facts == {"trees": 2, "dead": 0, "dropped": 0, "dbh_from_height": 0, "height_from_dbh": 0}


@pytest.mark.parametrize(
    ("header", "row", "dbh", "height"),
    [
        ("x;y;hoehe;bhd", "{x};{y};20,5;33,5", 33.5, 20.5),  # FINT-CH
        ("treeID,X,Y,Z", "1,{x},{y},20", None, 20),  # lidR as a table
        ("X,Y,TH,DN", "{x},{y},20,4", None, 20),  # pycrown
        ("treeID\ttree_x\ttree_y\ttree_height_m\tdbh_m\tdbh_cm", "a\t{x}\t{y}\t20\t0.4\t40", 40, 20),  # cloud2trees
        ("x,y,dbh_m,height", "{x},{y},0.4,20", 40, 20),
        ("Tree_ID;Species;DBH_cm;North_m;East_m;Tree_height_m", "1;SF;40;{y};{x};20", 40, 20),  # north before east
        ("x\ty\ts\td\th", "{x}\t{y}\tABAL\t40\t20", 40, 20),  # lidaRtRee
        ("X_TREE Y_TREE SPP DBH", "{x} {y} spruce 40", 40, None),
        ("stem_diameter_cm,height_m,crown_radius_m,x,y", "40,20,2.5,{x},{y}", 40, 20),
    ],
)
def test_the_columns_of_the_usual_sources_are_found(imported, header, row, dbh, height):
    frame = imported(f"{header}\n{row.format(x=int(EAST), y=int(NORTH))}\n")
    assert frame.geometry[0] == Point(EAST, NORTH)
    assert frame["dbh_cm"][0] == pytest.approx(2.52 * 20**0.84 if dbh is None else dbh)
    assert frame["height_m"][0] == pytest.approx((40 / 2.52) ** (1 / 0.84) if height is None else height)


def test_columns_and_units_can_be_named(imported):
    frame = imported(
        f"Nr;R;H;Umf;Hoehe;Art;Krone\nA1;{EAST};{NORTH};450;205;Fi;4,5\n",
        x_field="R",
        y_field="H",
        id_field="nr",
        dbh_field="Umf",
        dbh_unit="mm",
        height_field="Hoehe",
        height_unit="dm",
        species_field="Art",
        crown_field="Krone",
    )
    row = frame.iloc[0]
    assert (row["tree_id"], row["dbh_cm"], row["height_m"], row["species"]) == ("A1", 45, 20.5, "Fi")
    assert row["crown_diameter_m"] == 4.5
    assert row.geometry == Point(EAST, NORTH)


def test_a_table_without_header_is_mapped_by_column_numbers(imported):
    frame = imported(
        f"{EAST}; {NORTH}; 20.5; 19.9; 31.9; nan\n{EAST + 1}; {NORTH}; 8; 8; 14; 1\n",
        "Ind_trees.csv",
        x_field="column_1",
        y_field="column_2",
        height_field="column_3",
        dbh_field="column_5",
    )
    assert frame["dbh_cm"].tolist() == [31.9, 14]
    assert frame["height_m"].tolist() == [20.5, 8]


@pytest.mark.parametrize("encoding", ["utf-8-sig", "latin-1", "utf-16"])
def test_decimal_commas_and_encodings(imported, encoding):
    frame = imported(f"X;Y;BHD;Höhe;Baumart\n{EAST:.0f},5;{NORTH:.0f};33,5;20,5;Föhre\n", encoding=encoding)
    assert frame.geometry[0] == Point(EAST + 0.5, NORTH)
    assert (frame["dbh_cm"][0], frame["height_m"][0], frame["species"][0]) == (33.5, 20.5, "Föhre")


def test_the_height_may_be_the_z_of_the_points(imported, said):
    frame = imported(points(20.0, 30.0, treeID=[1, 2]), "ttops.gpkg")
    assert frame["height_m"].tolist() == [20, 30]
    assert frame["dbh_cm"].tolist() == pytest.approx([2.52 * 20**0.84, 2.52 * 30**0.84])
    assert frame["dbh_source"].tolist() == ["modelled", "modelled"]
    assert not frame.has_z.any()
    assert any("the height is taken from the Z of the points" in note for note in said.notes)


def test_a_z_above_the_sea_is_not_the_height_of_a_tree(imported, said):
    frame = imported(points(1400.0, 1410.0, dbh_cm=[40.0, 50.0]), "trees.gpkg")
    assert frame["height_m"].tolist() == pytest.approx([(d / 2.52) ** (1 / 0.84) for d in (40, 50)])
    assert "median 1405 m) is not a tree height" in said.warnings[0]
    with pytest.raises(UserError, match="neither a DBH nor a height is found"):
        imported(points(1400.0, 1410.0, treeID=[1, 2]), "trees.gpkg")


def test_shapefiles_and_crown_polygons(imported, said):
    assert imported(points(dbh_cm=[40.0], tree_heigh=[20.0]), "trees.shp")["height_m"].tolist() == [20]
    crown = Polygon([(EAST, NORTH), (EAST + 4, NORTH), (EAST + 4, NORTH + 2), (EAST, NORTH + 2)])
    frame = imported(gpd.GeoDataFrame({"TTH": [20.0]}, geometry=[crown], crs=2056), "crowns.gpkg")
    assert frame.geometry[0] == Point(EAST + 2, NORTH + 1)
    assert any("1 crown polygon;" in note for note in said.notes)


def test_what_is_missing_is_filled_by_the_law_or_dropped_and_counted(imported, outcome):
    table = f"x;y;dbh;h\n{EAST};{NORTH};;20\n{EAST};{NORTH};40;NA\n{EAST};{NORTH};;\n{EAST};{NORTH};30;25\n"
    frame = imported(table, dbh_a=2.0, dbh_b=1.0)
    assert frame["dbh_cm"].tolist() == pytest.approx([40, 40, 30])
    assert frame["height_m"].tolist() == pytest.approx([20, 20, 25])
    assert frame["dbh_source"].tolist() == ["modelled", "measured", "measured"]
    assert outcome["last"].facts == {"trees": 3, "dead": 0, "dropped": 1, "dbh_from_height": 1, "height_from_dbh": 1}
    said = " / ".join(outcome["last"].lines)
    assert "4 trees read" in said
    assert "1 DBH missing, computed from the height: DBH[cm] = 2 * H[m]^1" in said
    assert "1 tree dropped: neither" in said


def test_a_number_may_stand_for_a_missing_value(imported, outcome):
    table = f"x;y;bhd;hoehe\n{EAST};{NORTH};-1;20\n{EAST};{NORTH};40;-1\n"
    frame = imported(table, missing_value=-1.0)
    assert frame["dbh_source"].tolist() == ["modelled", "measured"]
    with pytest.raises(UserError, match=r"field 'bhd', row 1: -1 is not .*--missing-value"):
        imported(table)


def test_ids_used_twice_make_all_trees_numbered_again(imported, said):
    frame = imported(points(20.0, 21.0, 22.0, treeID=[1.0, 2.0, 1.0]), "tiles.gpkg")
    assert frame["tree_id"].tolist() == [1, 2, 3]
    assert frame["source_id"].tolist() == [1, 2, 1]
    assert "field 'treeID': 1 tree has an id that another one has" in said.warnings[0]
    assert imported(points(20.0, 21.0, treeID=["a", None]), "gap.gpkg")["tree_id"].tolist() == [1, 2]


def test_trees_without_ids_are_numbered_and_64_bit_ids_kept_whole(imported):
    assert imported(points(20.0, 21.0, note=["", ""]), "a.gpkg")["tree_id"].tolist() == [1, 2]
    frame = imported(points(20.0, 21.0, treeID=[27830500119005.0, 27830510119005.0]), "b.gpkg")
    assert frame["tree_id"].tolist() == [27830500119005, 27830510119005]


def test_a_dem_gives_the_crs_and_drops_what_stands_off_it(imported, slope, outcome):
    trees = points(h=[20.0, 21.0, np.nan, 22.0])  # the third has no size at all
    trees.loc[3, "geometry"] = Point(EAST + 1000, NORTH)
    frame = imported(trees.to_crs(32632), "utm.gpkg", dem=slope(), crs=None)
    assert outcome["last"].facts["dropped"] == 2
    assert frame.crs.to_epsg() == 2056
    assert frame.geometry[0].distance(Point(EAST, NORTH)) < 0.01
    assert frame["height_m"].tolist() == pytest.approx([20, 21])
    assert "1 tree dropped: off the DEM or on its nodata" in " ".join(outcome["last"].lines)


@pytest.mark.parametrize(
    ("places", "words"),
    [
        ("y,x", "x and y are exchanged (in Swiss and Austrian surveys Y is the easting): name the fields, --x-field"),
        ("x,y", ""),
        ("lv03", "these are coordinates of EPSG:21781: --crs EPSG:21781"),
        ("elsewhere", "name the CRS that its supplier states"),
    ],
)
def test_places_that_are_none_of_the_crs_are_reported_without_a_dem(imported, said, places, words):
    east, north = {"lv03": (EAST - 2e6, NORTH - 1e6), "elsewhere": (EAST + 3e6, NORTH + 2e6)}.get(places, (EAST, NORTH))
    header = places if places == "y,x" else "x,y"
    imported(f"{header},dbh,height\n{east},{north},30,20\n{east + 5},{north},30,21\n")
    told = [words in each for each in said.warnings if "is far outside the area of use of EPSG:2056" in each]
    assert told == [True] * bool(words)


@pytest.mark.parametrize(
    ("dbh", "height", "words"),
    [
        (0.35, 20, "the median dbh_cm is 0.35 cm, which is too small; --dbh-unit"),
        (420, 20, "the median dbh_cm is 420 cm, which is too large; --dbh-unit"),
        (40, 900, "the field 'h' (median 900 m) is not the height of trees"),
    ],
)
def test_implausible_sizes_are_warned_of_with_the_option_that_fixes_them(imported, said, dbh, height, words):
    imported(f"x;y;dbh;h\n{EAST};{NORTH};{dbh};{height}\n")
    assert words in said.warnings[0]


def test_a_height_that_was_requested_is_never_taken_for_that_of_the_ground(imported, said):
    imported(f"x;y;dbh;h\n{EAST};{NORTH};40;140\n", height_field="h")
    assert "the median height_m is 140 m, which is too large; --height-unit" in said.warnings[0]
    with pytest.raises(UserError, match="1 tree dropped: height_m above 150 m"):
        imported(f"x;y;dbh;h\n{EAST};{NORTH};40;900\n", height_field="h", overwrite=True)


def test_a_single_giant_is_counted(imported, said):
    rows = "".join(f"{EAST + i};{NORTH};40;{95 if i == 3 else 20}\n" for i in range(5))
    imported(f"x;y;dbh;h\n{rows}")
    assert "height_m exceeds 80 m in row 4, up to 95" in said.warnings[0]


def test_what_was_written_is_the_same_every_time_and_imports_again_unchanged(imported, tmp_path):
    first = imported(points(20.0, 30.0, treeID=[1, 2]), "ttops.gpkg")
    rows, record = content_of(tmp_path / "out.gpkg"), record_in(tmp_path / "out.gpkg")
    imported(
        points(20.0, 30.0, treeID=[1, 2]), "ttops.gpkg"
    )  # written again, so that its bytes have another time in them
    assert content_of(tmp_path / "out.gpkg") == rows is not None
    assert record is not None
    assert (record_in(tmp_path / "out.gpkg") or {})["run_id"] == record["run_id"]
    again = imported(first, "again.gpkg")
    assert again.drop(columns="dbh_source").equals(first.drop(columns="dbh_source"))
