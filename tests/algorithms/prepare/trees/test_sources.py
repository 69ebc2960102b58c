"""Each source of single trees, with a small file in its true layout: recognised, and read the same if named."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
from shapely import Point, Polygon

from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.prepare.trees.sources import LAYOUTS, SOURCES, sources_described

EAST, NORTH = 2_783_050.0, 1_190_050.0
CROWN = Polygon([(EAST, NORTH), (EAST + 4, NORTH), (EAST + 4, NORTH + 2), (EAST, NORTH + 2)])
LAW = 2.52, 0.84


def by_law(height: float) -> float:
    return LAW[0] * height ** LAW[1]


def by_inverse(dbh: float) -> float:
    return (dbh / LAW[0]) ** (1 / LAW[1])


def frame(geometry, **columns) -> gpd.GeoDataFrame:
    return gpd.GeoDataFrame(columns, geometry=geometry, crs=2056)


def two(**columns) -> gpd.GeoDataFrame:
    return frame([Point(EAST, NORTH), Point(EAST + 1, NORTH)], **columns)


def circle(area: float) -> float:
    return 2 * np.sqrt(area / np.pi)


@pytest.fixture(params=["auto", "named"])
def read(imported, request):
    """Imports the file with the source recognised, and with the source named: both must give the same."""

    def run(source, content, name, **values) -> gpd.GeoDataFrame:
        return imported(content, name, source=source if request.param == "named" else "auto", **values)

    return run


def test_lidr(read, said):
    tops = frame([Point(EAST, NORTH, 20.0), Point(EAST + 1, NORTH, 31.5)], treeID=[1, 2], Z=[20.0, 31.5])
    trees = read("lidr", tops, "ttops.gpkg")
    assert trees["height_m"].tolist() == [20, 31.5]
    assert trees["dbh_cm"].tolist() == pytest.approx([by_law(20), by_law(31.5)])
    assert trees["tree_id"].tolist() == [1, 2]
    assert not trees.has_z.any()


def test_lidr_with_the_height_in_z_only_and_ids_of_gpstime(imported):
    tops = frame([Point(EAST, NORTH, 20.0), Point(EAST + 1, NORTH, 30.0)], treeID=[150_234.125, 150_234.25])
    trees = imported(tops, "ttops.gpkg", source="lidr")
    assert trees["height_m"].tolist() == [20, 30]
    assert trees["tree_id"].tolist() == ["150234.125", "150234.25"]


def test_lidr_crown_metrics(read):
    trees = read("lidr", frame([CROWN], treeID=[7], Z=[20.0], npoints=[311], convhull_area=[8.0]), "crowns.gpkg")
    assert trees.geometry[0] == Point(EAST + 2, NORTH + 1)
    assert trees["crown_diameter_m"][0] == pytest.approx(circle(8.0))


def test_lidr_tiles_with_repeating_ids_and_the_seam_merged(imported, outcome):
    # Tree 2 of the west tile is tree 1 of the east tile, found 30 cm away and 10 cm lower.
    x = [EAST, EAST + 10, EAST + 10.3, EAST + 20]
    tops = frame([Point(e, NORTH, 20.0) for e in x], treeID=[1, 2, 1, 2], Z=[18.0, 25.0, 24.9, 30.0])
    trees = imported(tops, "tiles.gpkg", merge_within_m=1.0)
    assert trees["height_m"].tolist() == [18, 25, 30]
    assert trees["tree_id"].tolist() == [1, 2, 3]
    assert trees["source_id"].tolist() == [1, 2, 2]
    assert "1 tree dropped: a taller one stands within 1 m" in outcome["last"].lines


def test_foresttools(read):
    trees = read("foresttools", two(treeID=[1, 2], height=[20.0, 30.0], winRadius=[1.2, 1.5]), "ttops.shp")
    assert trees["height_m"].tolist() == [20, 30]
    crowns = frame([CROWN], treeID=[1], height=[20.0], winRadius=[1.2], crownArea=[7.5])
    assert read("foresttools", crowns, "crowns.gpkg")["crown_diameter_m"][0] == pytest.approx(circle(7.5))


def test_itcsegment_stands_at_x_and_y_not_at_the_centroid(read):
    crowns = frame([CROWN], X=[EAST + 0.5], Y=[NORTH + 0.5], Height_m=[20.0], CA_m2=[8.0])
    trees = read("itcsegment", crowns, "itc.shp")
    assert trees.geometry[0] == Point(EAST + 0.5, NORTH + 0.5)
    assert trees["height_m"][0] == 20
    assert trees["crown_diameter_m"][0] == pytest.approx(circle(8.0))


def test_lidartree_detected_where_s_is_the_surface_and_no_species(read):
    rows = two(
        id=[5, 6], x=[EAST, EAST + 1], y=[NORTH] * 2, h=[20.0, 30.0], dom_radius=[2.1, 3.0], s=[8.0, 9.0], v=[9.0] * 2
    )
    trees = read("lidartree", rows, "apices.gpkg")
    assert trees["height_m"].tolist() == [20, 30]
    assert trees["tree_id"].tolist() == [5, 6]
    assert "species" not in trees
    assert trees["crown_diameter_m"][0] == pytest.approx(circle(8.0))


def test_lidartree_inventory_with_its_codes_of_appearance(read, tmp_path, outcome):
    codes = {0: "gone", 1: "live", 2: "live", 3: "dead", 4: "dead"}
    rows = "".join(f"{EAST + k},{NORTH},{30 + k},{20 + k},{100 + k},ABAL,{k},NA\n" for k in codes)
    trees = read("lidartree", "x,y,d,h,n,s,e,t\n" + rows, "inventory.csv", releases=str(tmp_path / "snags.gpkg"))
    assert trees["tree_id"].tolist() == [101, 102]
    assert trees["dbh_cm"].tolist() == [31, 32]
    assert trees["species"].tolist() == ["ABAL", "ABAL"]
    snags = gpd.read_file(tmp_path / "snags.gpkg")
    assert snags["release_id"].tolist() == [103, 104]
    assert snags["length_m"].tolist() == [23, 24]
    assert "1 tree dropped: no longer standing" in outcome["last"].lines


def test_pycrown_whose_z_is_the_ground(read):
    tops = frame([Point(EAST, NORTH, 1400.0), Point(EAST + 1, NORTH, 60.0)], DN=[0, 1], TH=[20.0, 30.0], COR=[0, 1])
    trees = read("pycrown", tops, "tree_top_cor.shp")
    assert trees["height_m"].tolist() == [20, 30]
    assert trees["tree_id"].tolist() == [0, 1]
    crowns = frame([CROWN], DN=[0], TTH=[20.0], TCH=[19.5])
    assert read("pycrown", crowns, "tree_crown_poly_smooth.shp")["height_m"].tolist() == [20]


def test_fint_ind_trees_of_six_columns(read):
    text = f"{EAST:.2f}; {NORTH:.2f}; 20.5; 19.9; 31.9; 3\n{EAST + 1:.2f}; {NORTH:.2f}; 8.0; nan; nan; 1\n"
    trees = read("fint", text, "Ind_trees_42.csv")
    assert trees["height_m"].tolist() == [20.5, 8]
    assert trees["dbh_cm"].tolist() == pytest.approx([31.9, by_law(8)])
    assert trees["dbh_source"].tolist() == ["modelled", "modelled"]


def test_fint_ind_trees_of_five_columns(read):
    trees = read(
        "fint", f"{EAST:.2f}; {NORTH:.2f}; 20.5; 31.9; 3\n{EAST + 1:.2f}; {NORTH:.2f}; 8.0; 14.0; 1\n", "Ind_trees.csv"
    )
    assert trees["height_m"].tolist() == [20.5, 8]
    assert trees["dbh_cm"].tolist() == [31.9, 14]


@pytest.mark.parametrize("columns", [3, 4])
def test_fint_treefile_in_fixed_width_has_heights_only(imported, tmp_path, columns):
    rows = np.array([[EAST, NORTH, 20.5, 19.9], [EAST + 1, NORTH, 8.0, np.nan]])[:, :columns]
    np.savetxt(tmp_path / "treefile.txt", rows, fmt="%15.2f", delimiter=" ")
    text = (tmp_path / "treefile.txt").read_text()
    trees = imported(text, "treefile.txt", source="fint")
    assert trees["height_m"].tolist() == [20.5, 8]
    assert trees["dbh_cm"].tolist() == pytest.approx([by_law(20.5), by_law(8)])
    # Rockyfor3D's tree file has the same shape and holds DBH: it is not guessed.
    with pytest.raises(
        UserError,
        match=r"treefile.txt: the table has no header and . columns; name the program that wrote it \(--source fint",
    ):
        imported(text, "treefile.txt")


def test_fint_ch_whose_missing_value_is_minus_one(read):
    rows = two(
        hoehe=[20.0, 30.0], bhd=[-1.0, 44.0], dominanz=[3, 4], hoehe_modified=[-1.0, -1.0], parameterset_id=[1, 1]
    )
    trees = read("fint-ch", rows, "processed_trees.gpkg")
    assert trees["height_m"].tolist() == [20, 30]
    assert trees["dbh_cm"].tolist() == pytest.approx([by_law(20), 44])
    assert trees["dbh_source"].tolist() == ["modelled", "modelled"]


def test_cloud2trees_crowns_and_tops(read):
    facts = {"treeID": ["1_458_1"], "tree_height_m": [20.0], "crown_area_m2": [8.0], "dbh_cm": [33.0], "dbh_m": [0.33]}
    facts |= {"tree_cbh_m": [4.0]}
    for name, rows in (
        ("final_detected_crowns.gpkg", frame([CROWN], **facts, tree_x=[EAST + 1], tree_y=[NORTH + 1])),
        ("final_detected_tree_tops.gpkg", frame([Point(EAST + 1, NORTH + 1)], **facts)),
    ):
        trees = read("cloud2trees", rows, name)
        assert trees.geometry[0] == Point(EAST + 1, NORTH + 1)
        assert (trees["tree_id"][0], trees["dbh_cm"][0], trees["height_m"][0]) == ("1_458_1", 33, 20)
        assert trees["dbh_source"][0] == "modelled"
        assert trees["crown_diameter_m"][0] == pytest.approx(circle(8.0))


@pytest.mark.parametrize("separator", [" ", ";", "\t"])
def test_rockyfor3d_tree_file(imported, separator):
    text = "\n".join(separator.join(map(str, row)) for row in [(EAST, NORTH, 35.5), (EAST + 1, NORTH, 60)])
    trees = imported(text, "treefile.txt", source="rockyfor3d")
    assert trees["dbh_cm"].tolist() == [35.5, 60]
    assert trees["height_m"].tolist() == pytest.approx([by_inverse(35.5), by_inverse(60)])
    four = imported(f"{EAST} {NORTH} 35.5 22\n", "treefile.txt", source="rockyfor3d")
    assert (four["dbh_cm"][0], four["height_m"][0]) == (35.5, 22)


def test_platrock_xyd(read):
    trees = read("platrock", f"{EAST},{NORTH},35.5\n{EAST + 1},{NORTH},60\n", "forest.xyd")
    assert trees.geometry.tolist() == [Point(EAST, NORTH), Point(EAST + 1, NORTH)]
    assert trees["dbh_cm"].tolist() == [35.5, 60]
    assert trees["dbh_source"].tolist() == ["measured", "measured"]


NEON = "individualID,date,growthForm,plantStatus,stemDiameter,height,maxCrownDiameter,taxonID,adjEasting,adjNorthing\n"


def test_neon_joined_to_its_positions(read, tmp_path, outcome):
    e, n = 322_200.5, 4_305_600.25
    rows = [
        f"P.1,2017-08-01,single bole tree,Live,20.0,12,4,QURU,{e},{n}",
        f"P.1,2021-08-01,single bole tree,Live,23.5,14,4.4,QURU,{e},{n}",
        f'P.2,2021-08-01,single bole tree,"Dead, broken bole",37.1,9,,QUFA,{e + 5},{n}',
        f"P.3,2021-08-01,small tree,Standing dead,11.0,,,QUFA,{e + 6},{n}",
        f"P.4,2021-08-01,single bole tree,Downed,,,,QUFA,{e + 7},{n}",
        f'P.5,2021-08-01,single bole tree,"Live, broken bole",30.0,8,2,QUFA,{e + 8},{n}',
        "P.6,2021-08-01,single bole tree,Live,30.0,8,2,QUFA,NA,NA",
        f"P.7,2021-08-01,small shrub,Live,NA,1.5,2,VACO,{e + 9},{n}",
    ]
    text = NEON + "\n".join(rows)
    trees = read("neon", text, "vst.csv", crs="EPSG:32618", releases=str(tmp_path / "snags.gpkg"))
    assert trees["tree_id"].tolist() == ["P.1", "P.5"]
    assert trees["dbh_cm"].tolist() == [23.5, 30]
    assert trees["height_m"].tolist() == [14, 8]
    assert trees["crown_diameter_m"].tolist() == [4.4, 2]
    assert trees.crs.to_epsg() == 32618
    snags = gpd.read_file(tmp_path / "snags.gpkg")
    assert snags["release_id"].tolist() == ["P.2", "P.3"]
    assert snags["length_m"].tolist() == pytest.approx([9, by_inverse(11)])
    said = " / ".join(outcome["last"].lines)
    assert said.startswith("8 trees read from ")
    for words in ("1 row left out, shrubs", "1 row left out: no position (adjEasting, adjNorthing)"):
        assert words in said
    assert "1 row left out, earlier visits of the same trees" in said


def test_a_fault_in_a_row_after_those_left_out_is_named_by_its_own_number(imported):
    rows = "P.1,2021,tree,Live,30,8,2,QUFA,NA,NA\nP.2,2021,tree,Live,-5,8,2,QUFA,322200,4305600\n"
    with pytest.raises(UserError, match="field 'stemDiameter', row 2: -5 is not"):
        imported(NEON + rows, "vst.csv", crs="EPSG:32618")


def test_sortie_tree_map(read, tmp_path):
    rows = f"{EAST}\t{NORTH}\tBeech\tAdult\t30\t20\n{EAST + 1}\t{NORTH}\tBeech\tSnag\t40\t15\n"
    trees = read(
        "sortie", "X\tY\tSpecies\tType\tDiam\tHeight\n" + rows, "map.txt", releases=str(tmp_path / "snags.gpkg")
    )
    assert trees["dbh_cm"].tolist() == [30]
    assert gpd.read_file(tmp_path / "snags.gpkg")["dbh_cm"].tolist() == [40]


def test_an_inventory_with_semicolons_decimal_commas_north_before_east_and_dead_trees(imported, tmp_path):
    # The columns of spBayes' WEF inventory.
    head = "Tree_ID;Species;DBH_cm;Live_dead;Stump;North_m;East_m;ELEV_m;Tree_height_m;Crown_depth_m;Mean_crown_radius"
    rows = f"1;SF;40,5;L;0;{NORTH:.0f},5;{EAST:.0f},5;900,1;20,5;9;2,5\n"
    rows += f"2;WH;55,0;D;0;{NORTH:.0f},0;{EAST:.0f},0;900;NA;NA;NA\n"
    trees = imported(f"{head}\n{rows}", "wef.csv", releases=str(tmp_path / "snags.gpkg"))
    assert trees.geometry.tolist() == [Point(EAST + 0.5, NORTH + 0.5)]
    assert (trees["dbh_cm"][0], trees["height_m"][0], trees["crown_diameter_m"][0]) == (40.5, 20.5, 5)
    assert gpd.read_file(tmp_path / "snags.gpkg")["dbh_cm"].tolist() == [55]


def test_every_source_is_tested_here_and_described():
    tests = " ".join(name for name in globals() if name.startswith("test_"))
    for name in SOURCES[2:]:
        assert name.replace("-", "_") in tests
        assert f"``{name}``" in sources_described()
    assert SOURCES[:2] == ("auto", "table")
    assert len({each.what for each in LAYOUTS}) == len(LAYOUTS)


def test_a_file_that_is_not_of_the_source_named(imported):
    with pytest.raises(UserError, match=r"this is not FINT.* \(--source fint\); the file has the columns x, y, dbh"):
        imported(f"x,y,dbh\n{EAST},{NORTH},30\n", source="fint")
    with pytest.raises(UserError, match=r"this is not PlatRock's .* the file has 5 columns without header"):
        imported(f"{EAST} {NORTH} 1 2 3\n", source="platrock")
    with pytest.raises(UserError, match="no columns adjeasting and adjnorthing with the coordinates"):
        imported("individualID,plantStatus,stemDiameter\na,Live,30\n", crs="EPSG:32618")


def test_the_users_columns_go_before_those_of_the_source(imported):
    trees = imported(
        f"{EAST}; {NORTH}; 20.5; 19.9; 31.9; 3\n",
        "Ind_trees.csv",
        source="fint",
        height_field="column_4",
        dbh_field="column_5",
    )
    assert trees["height_m"].tolist() == [19.9]
    assert trees["dbh_source"].tolist() == ["measured"]


def test_columns_that_the_source_does_not_write_are_found_by_their_usual_names(read):
    rows = two(treeID=[1, 2], Z=[20.0, 30.0], dbh_cm=[33.0, np.nan], Baumart=["Fi", "Ta"], status=["alive", "dead"])
    trees = read("lidr", rows, "ttops.gpkg")
    assert trees["dbh_cm"].tolist() == [33]
    assert trees["dbh_source"].tolist() == ["measured"]
    assert trees["species"].tolist() == ["Fi"]


def test_plain_names_only_when_requested(imported):
    rows = two(id=[5, 6], h=[20.0, 30.0], dom_radius=[2.1, 3.0], s=["spruce", "fir"])
    assert imported(rows, "apices.gpkg", source="table")["species"].tolist() == ["spruce", "fir"]
