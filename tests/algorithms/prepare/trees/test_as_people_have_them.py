"""Tree tables as surveys, cadastres and spreadsheets write them; each was refused or misread before."""

from __future__ import annotations

import shlex

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from shapely import GeometryCollection, LineString, Point, Polygon

from deadwood_algorithms.files.crs import misplacement
from deadwood_algorithms.files.tables import header_row, sheet_table
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.prepare.trees.status import DEAD, GONE, LIVE, code_of, meaning_of
from deadwood_algorithms.schemas import TREES

EAST, NORTH = 2_783_050.0, 1_190_050.0
SIZES = ((41.4, 27.1), (52.8, 32.1), (31.4, 22.3))


def table(head: str, *rows: str) -> str:
    return "\n".join([head, *(f"{EAST + 5 * k};{NORTH};{row}" for k, row in enumerate(rows))])


@pytest.mark.parametrize(
    "field",
    ["Umfang", "circonférence", "Circonferenza (cm)", "omtrek", "omtrek_cm", "circ_m", "ST_UMFANG", "girth [mm]"],
)
def test_a_girth_is_divided_by_pi_and_reported(imported, said, field):
    times = 10 if "mm" in field else 0.01 if field.endswith("_m") else 1
    rows = [f"{np.pi * dbh * times:.6f};{height}" for dbh, height in SIZES]
    trees = imported(table(f"x;y;{field};Baumhöhe", *rows))
    assert trees["dbh_cm"].tolist() == pytest.approx([dbh for dbh, _ in SIZES], abs=1e-3)
    assert "is read as the girth in" in " ".join(said.warnings)


@pytest.mark.parametrize(
    ("fields", "times"),
    [
        (("diametro_cm", "altezza_m"), (1, 1)),
        (("Durchmesser_mm", "hoehe_m"), (10, 1)),
        (("diam_m", "h_ft"), (0.01, 1 / 0.3048)),
    ],
)
def test_a_unit_behind_a_usual_name_is_no_other_name(imported, fields, times):
    rows = [f"{dbh * times[0]:.8f};{height * times[1]:.8f}" for dbh, height in SIZES]
    trees = imported(table(f"x;y;{';'.join(fields)}", *rows))
    assert trees["dbh_cm"].tolist() == pytest.approx([dbh for dbh, _ in SIZES], abs=1e-3)
    assert trees["height_m"].tolist() == pytest.approx([height for _, height in SIZES], abs=1e-3)


def test_a_girth_that_is_called_dbh_is_doubted(imported, said):
    imported(table("x;y;BHD;Baumhöhe", *(f"{np.pi * dbh};{height}" for dbh, height in SIZES)))
    assert "--dbh-unit girth-cm" in " ".join(said.warnings)
    said.warnings.clear()
    imported(table("x;y;BHD;Baumhöhe", *(f"{dbh};{height}" for dbh, height in SIZES)))
    assert not said.warnings
    imported(table("x;y;BHD;Baumhöhe", *(f"{dbh / 2.54};{height}" for dbh, height in SIZES)))
    assert "--dbh-unit in" in " ".join(said.warnings)


@pytest.mark.parametrize("heads", [("Höhe", "Baumhöhe"), ("Baumhöhe", "Höhe"), ("altezza", "Altezza_totale")])
def test_the_tree_s_own_height_before_that_above_the_sea(imported, heads):
    by_head = {"Höhe": 973.9, "altezza": 973.9, "Baumhöhe": 27.1, "Altezza_totale": 27.1}
    trees = imported(
        table(f"x;y;BHD;{';'.join(heads)}", ";".join(str(each) for each in (41.4, *map(by_head.get, heads))))
    )
    assert trees["height_m"].tolist() == [27.1]


def test_a_height_above_the_sea_alone_is_passed_over_and_reported(imported, said):
    trees = imported(table("x;y;BHD;Höhe", "41.4;973.9", "52.8;949.6"))
    assert (trees["height_m"] < 60).all()
    assert "perhaps the elevation of the ground" in " ".join(said.warnings)


def test_classes_of_dbh_count_as_their_middle(imported, said):
    trees = imported(table("x;y;dbh;h", "40-45;27", "41,4 cm;30", "k.A.;20"))
    assert trees["dbh_cm"].tolist()[:2] == [42.5, 41.4]
    assert trees["dbh_source"].tolist() == ["measured", "measured", "modelled"]
    assert "1 cell holds a class such as 40-45" in " ".join(said.warnings)


def test_nothing_is_written_that_slide_logs_would_refuse(imported, outcome):
    rows = ["0.05;0.4", "0;20", "30;0.9", "30;1.3", "40;0", "0.005;2.0", "35;160", "30;25"]
    trees = imported(table("x;y;dbh;h", *rows))
    for name in ("dbh_cm", "height_m"):
        column = TREES.column(name)
        assert (trees[name] >= column.least).all()
        assert (trees[name] <= column.maximum).all()
    assert (trees["height_m"] >= 1.3).all()
    lines = " ".join(outcome["last"].lines)
    assert "2 trees dropped: height_m below 1.3 m" in lines
    assert "1 tree dropped: height_m above 150 m" in lines
    assert "1 tree dropped: dbh_cm below" in lines
    assert outcome["last"].facts["dropped"] + len(trees) == len(rows)


def test_the_least_height_is_an_option(imported):
    rows = ("30;0.9", "30;1.3", "30;25")
    assert len(imported(table("x;y;dbh;h", *rows), min_height_m=0.5)) == 3
    assert len(imported(table("x;y;dbh;h", *rows), min_height_m=2.0)) == 1


def test_trees_in_one_place_are_reported(imported, said):
    rows = [f"{EAST};{NORTH};40;27", f"{EAST};{NORTH};41;27", f"{EAST + 5};{NORTH};41;27"]
    assert len(imported("\n".join(["x;y;dbh;h", *rows]))) == 3
    assert "1 tree has exactly the position of another one" in " ".join(said.warnings)
    assert len(imported("\n".join(["x;y;dbh;h", *rows]), merge_within_m=0.1)) == 2


@pytest.mark.parametrize("axes", ["Est;Nord", "Ost;Nord", "Rechtswert;Hochwert", "E_LV95;N_LV95"])
def test_coordinates_by_their_names(imported, axes):
    assert len(imported(table(f"{axes};dbh;h", "40;27"))) == 1


@pytest.mark.parametrize(
    ("x", "y", "words"),
    [
        ("y", "x", "x and y are exchanged"),
        ("lv03 x", "lv03 y", "EPSG:21781"),
        ("lv03 y", "lv03 x", "x and y are exchanged"),
        ("0", "0", "check the CRS of both"),
    ],
)
def test_exchanged_axes_and_lv03_are_recognised(imported, slope, x, y, words):
    at = {"x": EAST, "y": NORTH, "lv03 x": EAST - 2e6, "lv03 y": NORTH - 1e6, "0": 0.0}
    with pytest.raises(UserError, match=words):
        imported(f"x;y;dbh;h\n{at[x]};{at[y]};40;27", dem=slope())


def test_the_way_out_that_is_printed_leads_to_the_trees(imported, slope):
    dem = slope()
    trees = imported(f"Y;X;dbh;h\n{EAST};{NORTH};40;27", dem=dem, x_field="Y", y_field="X")
    assert trees.geometry[0] == Point(EAST, NORTH)
    trees = imported(f"x;y;dbh;h\n{EAST - 2e6};{NORTH - 1e6};40;27", dem=dem, crs="EPSG:21781")
    assert trees.geometry[0].distance(Point(EAST, NORTH)) < 2.0


def test_places_in_a_third_system_are_not_called_exchanged():
    assert misplacement(np.array([7.0]), np.array([46.0]), (2.7e6, 1.2e6, 2.8e6, 1.3e6)) == ""


@pytest.mark.parametrize(
    ("word", "kind"),
    [
        ("Dürrständer", DEAD), ("abgestorben", DEAD), ("stehend tot", DEAD), ("Baum tot", DEAD),
        ("mort sur pied", DEAD), ("arbre sec", DEAD), ("morto in piedi", DEAD), ("secco", DEAD),
        ("Dead standing", DEAD), ("liegend tot", GONE), ("Totholz, liegend", GONE), ("Windwurf", GONE),
        ("gefällt", GONE), ("Stock", GONE), ("chablis", GONE), ("souche", GONE), ("mort couché", GONE),
        ("abattu", GONE), ("schiantato", GONE), ("schianto", GONE), ("ceppaia", GONE),
        ("morto a terra", GONE), ("lying dead", GONE),
        ("stump", GONE), ("uprooted", GONE), ("lebend", LIVE), ("vivant", LIVE), ("vivo", LIVE), ("sano", LIVE),
        ("Live, insect damaged", LIVE), ("nicht tot", None), ("XB7", None), ("Stockausschlag", None),
        ("mortadella", None),
    ],
)  # fmt: skip
def test_what_a_status_means_in_four_languages(word, kind):
    assert meaning_of(code_of(word), None, None) == kind


def test_a_status_that_is_not_known_is_reported_where_it_decides(imported, said):
    trees = imported(table("x;y;dbh;h;Zustand", "40;27;lebend", "50;30;XB7", "45;28;liegend tot"))
    assert trees["dbh_cm"].tolist() == [40, 50]
    assert "living trees (xb7: 1)" in " ".join(said.warnings)


def test_a_field_of_status_words_under_another_name_is_reported(imported, said):
    head, rows = "x;y;dbh;h;Bemerkung", ("40;27;vivo", "50;30;morto in piedi", "45;28;ceppaia")
    assert len(imported(table(head, *rows))) == 3
    assert "--status-field Bemerkung reads it" in " ".join(said.warnings)
    assert imported(table(head, *rows), status_field="Bemerkung")["dbh_cm"].tolist() == [40]


def test_a_title_above_and_a_sum_below_are_no_rows(imported, said):
    rows = [f"{k};{EAST + k};{NORTH};40;27" for k in range(4)]
    text = ["Kluppliste Schutzwald;;;;", ";;;;", "Nr;x;y;BHD;Baumhöhe", *rows, "Summe;;;160;"]
    assert imported("\n".join(text))["tree_id"].tolist() == [0, 1, 2, 3]
    assert "1 row below the table" in " ".join(said.notes)


def test_a_sheet_is_named_by_its_header_below_a_title():
    cells = [
        ["Kluppliste", None, None],
        [None, None, None],
        ["Nr", "BHD", "Art"],
        *([str(k), "40", "Fi"] for k in range(3)),
        ["Summe", "40", None],
    ]
    sheet = sheet_table(pd.DataFrame(cells, columns=["Field1", "Field2", "Field3"]))
    # one value of three is beside the word: the row is not blank, so it stays
    assert sheet.columns.tolist() == ["Nr", "BHD", "Art"]
    cells[-1] = ["Summe", None, None]
    sheet = sheet_table(pd.DataFrame(cells, columns=["Field1", "Field2", "Field3"]))
    assert sheet["BHD"].tolist() == [40, 40, 40]


def test_a_table_without_a_title_keeps_its_first_row_as_header():
    assert header_row([["x", "y", "dbh"], ["1", "2", "3"]]) == 0
    assert header_row([["1", "2", "3"], ["4", "5", "6"]]) == 0
    assert header_row([["Title", "", ""], ["x", "x", "dbh"], ["1", "2", "3"]]) == 0  # a name twice is refused later


def test_of_collections_the_polygons_are_the_crowns(imported, said):
    crown = Polygon([(EAST, NORTH), (EAST + 4, NORTH), (EAST + 4, NORTH + 2), (EAST, NORTH + 2)])
    mixed = GeometryCollection([crown, LineString([(EAST, NORTH), (EAST - 1, NORTH)])])
    layer = gpd.GeoDataFrame({"height_m": [20.0, 25.0]}, geometry=[crown, mixed], crs=2056)
    trees = imported(layer, "crowns.gpkg")
    assert trees.geometry.tolist() == [Point(EAST + 2, NORTH + 1)] * 2
    assert trees["crown_diameter_m"].nunique() == 1
    assert "1 geometry collection, of which points and polygons are used" in " ".join(said.notes)


@pytest.mark.parametrize(
    "cell", ["[40,45)", "(40;45]", "[40 - 45[", "40 bis unter 45", "de 40 à 45", "ca. 42,5", "[40.0, 45.0)"]
)
def test_a_class_counts_as_its_middle_in_any_brackets_and_words(imported, cell):
    assert imported(f'x;y;dbh;h\n{EAST};{NORTH};"{cell}";27')["dbh_cm"].tolist() == [42.5]


@pytest.mark.parametrize("cell", [">60", "< 20", "60+", "≥ 60", "Starkholz", "über 60", "10.05.2026"])
def test_an_open_class_is_refused_with_the_option_that_explains_it(imported, said, cell):
    """The command in the message, with a number inserted, gives that number; without one, a gap."""
    rows = (f"{cell};27", "30;20", f"{cell};31")
    with pytest.raises(UserError, match=r"field 'dbh', row 1 and 1 more: .* --read-as") as refused:
        imported(table("x;y;dbh;h", *rows))
    words = shlex.split(str(refused.value).split("--read-as ")[1])[0]
    assert words == f"{cell}=NUMBER"
    trees = imported(table("x;y;dbh;h", *rows), read_as=words.replace("NUMBER", "65"))
    assert trees["dbh_cm"].tolist() == [65.0, 30.0, 65.0]
    trees = imported(table("x;y;dbh;h", *rows), read_as=words.replace("NUMBER", ""))
    assert trees["dbh_source"].tolist() == ["modelled", "measured", "modelled"]


@pytest.mark.parametrize("words", ["Starkholz", "=60", "Starkholz=6,5", "Starkholz=dick"])
def test_words_that_explain_nothing_are_refused(imported, words):
    with pytest.raises(UserError, match="is not a word, = and a number"):
        imported(table("x;y;dbh;h", "Starkholz;27"), read_as=words)
    with pytest.raises(UserError, match="gives 'starkholz' more than once"):
        imported(table("x;y;dbh;h", "Starkholz;27"), read_as="Starkholz=60; starkholz=65")


GAPS = ["ss.dd.", "n.e.", "nicht gemessen", "non rilevato", "*", ".", "<NA>", "(leer)", "kein Wert", "pas mesuré", "Ø"]


@pytest.mark.parametrize("gap", GAPS)
def test_any_word_for_a_gap_is_one(imported, gap):
    trees = imported(table("x;y;dbh;h", f"{gap};27", "30;20"))
    assert trees["dbh_source"].tolist() == ["modelled", "measured"]


HEADS = [
    "E-Koordinate;N-Koordinate", "X-Koordinate;Y-Koordinate", "Coord. E;Coord. N", "X_L93;Y_L93", "Koord_E;Koord_N",
    "E [m];N [m]", "POINT_X;POINT_Y", "x_utm32;y_utm32", "Ost;Nord", "Coordonnée X;Coordonnée Y",
]  # fmt: skip


@pytest.mark.parametrize("axes", HEADS)
def test_coordinates_by_more_names(imported, axes):
    assert imported(table(f"{axes};N.;dbh;h", "1;40;27")).geometry[0] == Point(EAST, NORTH)


@pytest.mark.parametrize("axes", ["Längengrad;Breitengrad", "longitudine;latitudine", "long;lat"])
def test_degrees_by_their_names(imported, slope, axes):
    place = gpd.GeoSeries([Point(EAST, NORTH)], crs=2056).to_crs(4326)[0]
    trees = imported(f"{axes};dbh;h\n{place.x:.9f};{place.y:.9f};40;27", dem=slope())
    assert trees.geometry[0].distance(Point(EAST, NORTH)) < 0.1


def test_kilometres_and_degrees_are_recognised_and_their_way_out_leads_to_the_trees(imported, slope):
    dem, place = slope(), gpd.GeoSeries([Point(EAST, NORTH)], crs=2056).to_crs(4326)[0]
    rows = f"{EAST / 1000:.4f};{NORTH / 1000:.4f};40;27"
    with pytest.raises(UserError, match=r"these are kilometres: .* write \[km\] behind"):
        imported(f"E;N;dbh;h\n{rows}", dem=dem)
    assert imported(f"E [km];N [km];dbh;h\n{rows}", dem=dem).geometry[0].distance(Point(EAST, NORTH)) < 0.1
    degrees = f"x;y;dbh;h\n{place.x:.9f};{place.y:.9f};40;27"
    with pytest.raises(UserError, match="--crs EPSG:4326"):
        imported(degrees, dem=dem)
    assert imported(degrees, dem=dem, crs="EPSG:4326").geometry[0].distance(Point(EAST, NORTH)) < 0.1


FORMS = {
    "units": ["Nr;E;N;BHD;Höhe", ";m;m;mm;m", *(f"{k};{EAST + k};{NORTH};414;27" for k in range(4))],
    "merged": ["Baum;Koordinaten;;Masse;", "Nr;E;N;BHD;Höhe", *(f"{k};{EAST + k};{NORTH};41.4;27" for k in range(4))],
    "pages": ["Nr;E;N;BHD;Höhe", *(f"{k};{EAST + k};{NORTH};41.4;27" for k in range(4))] * 2,
    "means": ["Nr;E;N;BHD;Höhe", *(f"{k};{EAST + k};{NORTH};41.4;27" for k in range(4)), "Mittel;;;41.4;27"],
    "remark": ["Nr;E;N;BHD;Höhe", *(f"{k};{EAST + k};{NORTH};41.4;27" for k in range(4)), "* geschätzt;;;;"],
    "margin": [";Nr;E;N;BHD;Höhe", *(f";{k};{EAST + k};{NORTH};41.4;27" for k in range(4))],
    "year": ["Nr;E;N;BHD_2026;Hoehe_2026", *(f"{k};{EAST + k};{NORTH};41.4;27" for k in range(4))],
    "feet": ["Nr;E;N;dbh_in;height_ft", *(f"{k};{EAST + k};{NORTH};16.2992;88.5827" for k in range(4))],
    "point and comma": ["Nr;E;N;BHD;Höhe", f"1;{EAST};{NORTH};41,4;27", f"2;{EAST + 1};{NORTH};41.4;27"],
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_tables_in_the_forms_that_people_give_them(imported, form):
    trees = imported("\n".join(FORMS[form]))
    assert len(trees) == {"pages": 8, "point and comma": 2}.get(form, 4)
    assert trees["dbh_cm"].tolist() == pytest.approx([41.4] * len(trees), abs=1e-3)
    assert trees["height_m"].tolist() == pytest.approx([27.0] * len(trees), abs=1e-3)


def test_of_the_years_of_two_surveys_none_is_chosen_in_silence(imported, said):
    imported(table("x;y;BHD_2016;BHD_2026;h", "30;41;27"))
    assert "if it is one of BHD_2016, BHD_2026, name it with --dbh-field" in " ".join(said.warnings)


@pytest.mark.parametrize("field", ["condizione", "État sanitaire", "Vitalität", "tree_condition", "Lebend/tot"])
def test_the_status_by_more_names(imported, field):
    head, rows = f"x;y;dbh;h;{field}", ("40;27;vivo", "50;30;morto in piedi", "45;28;ceppaia")
    assert imported(table(head, *rows))["dbh_cm"].tolist() == [40]


@pytest.mark.parametrize(
    ("field", "values"),
    [
        ("dead", ("0", "1")),
        ("tot", ("nein", "ja")),
        ("morto", ("no", "sì")),
        ("alive", ("TRUE", "FALSE")),
        ("snag", ("", "x")),
    ],
)
def test_a_field_that_asks_whether_a_tree_is_dead_is_read_and_said(imported, said, field, values):
    assert imported(table(f"x;y;dbh;h;{field}", f"40;27;{values[0]}", f"50;30;{values[1]}"))["dbh_cm"].tolist() == [40]
    assert f"field '{field}': 1 tree is dead, standing" in " ".join(said.notes)


def test_a_dbh_in_millimetres_is_doubted_as_such(imported, said):
    imported(table("x;y;BHD;Baumhöhe", *(f"{10 * dbh};{height}" for dbh, height in SIZES)))
    assert "millimetres: --dbh-unit mm" in " ".join(said.warnings)
    trees = imported(table("x;y;BHD;Baumhöhe", *(f"{10 * dbh};{height}" for dbh, height in SIZES)), dbh_unit="mm")
    assert trees["dbh_cm"].tolist() == pytest.approx([dbh for dbh, _ in SIZES])


def test_a_ring_as_text_that_does_not_close_is_closed_and_said(imported, said):
    ring = f"{EAST} {NORTH}, {EAST + 4} {NORTH}, {EAST + 4} {NORTH + 2}, {EAST} {NORTH + 2}"
    trees = imported(f'id;WKT;h\n1;"POLYGON (({ring}))";20')
    assert trees.geometry[0] == Point(EAST + 2, NORTH + 1)
    assert "rings that do not close were closed" in " ".join(said.notes)
