"""Vector layers through files: which layer, which geometry, which CRS, which columns; and out again."""

from __future__ import annotations

import sqlite3
from typing import Any

import geopandas as gpd
import numpy as np
import pyogrio
import pyproj
import pytest
import shapely
from shapely import LineString, MultiLineString, MultiPoint, MultiPolygon, Point, Polygon

from deadwood_algorithms import schemas
from deadwood_algorithms.files.columns import id_column, number_column, warn_implausible, where_of
from deadwood_algorithms.files.vectors import read_vector, write_vector
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.schemas.results import REACH, REACH_OF_RUN
from deadwood_algorithms.schemas.written import layer_with

LV95 = pyproj.CRS(2056)
EAST, NORTH = 2_783_000.0, 1_190_000.0


def layer(shapes, crs: Any = LV95, **columns):
    return gpd.GeoDataFrame(columns, geometry=list(shapes), crs=crs)


def points(n=3, crs: Any = LV95, **columns):
    return layer([Point(EAST + i, NORTH) for i in range(n)], crs, **columns)


def refused(path, **options) -> str:
    options = {"target_crs": LV95, "what": "trees"} | options
    with pytest.raises(UserError) as raised:
        read_vector(path, **options)
    assert "\n" not in str(raised.value)
    return str(raised.value)


@pytest.mark.parametrize("name", ["trees.gpkg", "trees.shp", "trees.geojson", "mit Umläuten äöü.gpkg"])
def test_every_format_gives_the_same_frame(tmp_path, name):
    crs = "EPSG:2056" if name != "trees.geojson" else LV95
    points(dbh=[30.0, 40.0, 50.0], crs=crs).to_file(tmp_path / name)
    frame = read_vector(tmp_path / name, target_crs=LV95, what="things")
    assert frame["dbh"].tolist() == [30, 40, 50]
    assert shapely.get_x(frame.geometry).tolist() == [EAST, EAST + 1, EAST + 2]
    assert frame.crs == LV95
    assert str(tmp_path / name) in where_of(frame)


def test_a_csv_with_coordinates_is_a_layer(tmp_path):
    path = tmp_path / "trees.csv"
    path.write_text(f"Easting;Northing;dbh_cm\n{EAST:.0f},5;{NORTH};30\n")
    frame = read_vector(path, target_crs=LV95, what="trees")
    assert frame.geometry[0] == Point(EAST + 0.5, NORTH)
    assert list(frame) == ["dbh_cm", "geometry"]


def test_degrees_in_a_csv_are_understood_by_their_column_names(tmp_path):
    lon, lat = pyproj.Transformer.from_crs(2056, 4326, always_xy=True).transform(EAST, NORTH)
    path = tmp_path / "trees.csv"
    path.write_text(f"longitude,latitude\n{lon!r},{lat!r}\n")
    frame = read_vector(path, target_crs=LV95)
    assert frame.geometry[0].distance(Point(EAST, NORTH)) < 0.01


def test_another_crs_is_reprojected_and_reported(tmp_path, said):
    points(crs=LV95).to_crs(4326).to_file(tmp_path / "trees.gpkg")
    frame = read_vector(tmp_path / "trees.gpkg", target_crs=LV95, feedback=said)
    assert np.allclose(shapely.get_coordinates(frame.geometry)[0], (EAST, NORTH), atol=0.01)
    assert "reprojected from EPSG:4326 to EPSG:2056" in said.notes[0]


def test_the_crs_of_a_compound_dem_is_its_horizontal_part(tmp_path, said):
    points().to_file(tmp_path / "trees.gpkg")
    frame = read_vector(tmp_path / "trees.gpkg", target_crs=pyproj.CRS("EPSG:2056+5728"), feedback=said)
    assert frame.crs == LV95
    assert said.notes == []
    assert frame.geometry[0] == Point(EAST, NORTH)


def test_a_layer_without_crs_is_taken_to_be_in_the_dems_or_in_the_one_named(tmp_path, said):
    points(crs=None).to_file(tmp_path / "trees.gpkg")
    assert read_vector(tmp_path / "trees.gpkg", target_crs=LV95, feedback=said).geometry[0] == Point(EAST, NORTH)
    assert "no CRS, EPSG:2056 is taken from the DEM" in said.notes[0]
    layer([Point(783_000, 190_000)], crs=None).to_file(tmp_path / "old.gpkg")
    moved = read_vector(tmp_path / "old.gpkg", target_crs=LV95, crs="EPSG:21781")
    assert moved.geometry[0].distance(Point(EAST, NORTH)) < 3  # LV03 and LV95 differ by up to 2 m there
    assert "--crs EPSG:2056" in refused(tmp_path / "trees.gpkg", target_crs=None)


def test_a_position_beyond_the_projection_names_its_row(tmp_path):
    layer([Point(9.8, 46.9), Point(9.8, 4690.0)], crs="EPSG:4326").to_file(tmp_path / "trees.gpkg")
    assert "row 2: the position cannot be transformed" in refused(tmp_path / "trees.gpkg", target_crs=pyproj.CRS(3035))


def test_a_file_with_several_layers_wants_a_name(tmp_path):
    path = tmp_path / "all.gpkg"
    write_vector(path, {"trees": points(a=[1, 2, 3]), "releases": points(b=[4, 5, 6])})
    message = refused(path)
    assert "trees, releases" in message
    assert f"'{path}|layername=trees'" in message
    assert read_vector(f"{path}|layername=releases", target_crs=LV95)["b"].tolist() == [4, 5, 6]
    assert "no layer 'forest'; it has trees, releases" in refused(f"{path}|layername=forest")


def test_a_table_without_geometry_beside_the_layer_makes_nothing_ambiguous(tmp_path):
    path = tmp_path / "trees.gpkg"
    write_vector(path, {"trees": points()})
    with sqlite3.connect(path) as database:
        database.execute("create table notes (id integer primary key, name text)")
        database.execute(
            "insert into gpkg_contents (table_name, data_type, identifier) values ('notes', 'attributes', 's')"
        )
    assert len(read_vector(path, target_crs=LV95)) == 3


def test_a_file_of_attributes_alone_needs_coordinates(tmp_path):
    path = tmp_path / "table.gpkg"
    pyogrio.write_dataframe(points(x_m=[1.0, 2, 3], height=[1, 2, 3]).drop(columns="geometry"), path, layer="table")
    assert "no columns x and y" in refused(path)
    frame = read_vector(path, target_crs=LV95, x_field="x_m", y_field="Height")
    assert frame.geometry[1] == Point(2, 2)


def test_coordinates_in_named_fields_go_before_the_geometry(tmp_path):
    points(col_x=[1.0, 2, 3], col_y=[4.0, 5, 6]).to_file(tmp_path / "trees.gpkg")
    frame = read_vector(tmp_path / "trees.gpkg", target_crs=LV95, x_field="col_x", y_field="col_y")
    assert frame.geometry[2] == Point(3, 6)


def test_single_parts_are_unwrapped_and_several_kept(tmp_path):
    one, two = LineString([(0, 0), (1, 1)]), LineString([(5, 5), (6, 6)])
    layer([MultiLineString([one]), MultiLineString([one, two])]).to_file(tmp_path / "lines.gpkg")
    frame = read_vector(tmp_path / "lines.gpkg", geometry=("line",), target_crs=LV95)
    assert frame.geometry.geom_type.tolist() == ["LineString", "MultiLineString"]
    layer([MultiPoint([(1, 2)])]).to_file(tmp_path / "points.gpkg")
    assert read_vector(tmp_path / "points.gpkg", target_crs=LV95).geometry[0] == Point(1, 2)
    layer([Point(1, 2), MultiPoint([(1, 2), (3, 4)])]).to_file(tmp_path / "many.gpkg")
    assert "row 2: a MultiPoint, but the trees must be points; split it" in refused(tmp_path / "many.gpkg")


def written_by_others(tmp_path, *shapes: str):
    """Geometries that shapely cannot write, through GDAL's virtual format."""
    (tmp_path / "shapes.csv").write_text("WKT;a\n" + "".join(f'"{shape}";1\n' for shape in shapes))
    path = tmp_path / "shapes.vrt"
    path.write_text(
        f"<OGRVRTDataSource><OGRVRTLayer name='shapes'><SrcDataSource>{tmp_path / 'shapes.csv'}</SrcDataSource>"
        "<GeometryField encoding='WKT' field='WKT'/></OGRVRTLayer></OGRVRTDataSource>"
    )
    return path


def test_z_is_kept_and_m_dropped(tmp_path):
    path = written_by_others(tmp_path, "POINT ZM (1 2 3 4)", "POINT ZM (5 6 7 8)")
    frame = read_vector(path, target_crs=LV95)
    assert shapely.get_coordinates(frame.geometry, include_z=True).tolist() == [[1, 2, 3], [5, 6, 7]]


def test_curves_become_polygons(tmp_path):
    path = written_by_others(tmp_path, "CURVEPOLYGON (CIRCULARSTRING (0 0, 2 0, 0 0))")
    frame = read_vector(path, geometry=("polygon",), target_crs=LV95)
    assert frame.geometry[0].area == pytest.approx(np.pi, rel=0.01)


def test_a_polygon_that_crosses_itself_is_fixed_to_the_same_area(tmp_path, said):
    bow_tie = Polygon([(0, 0), (2, 2), (2, 0), (0, 2)])
    layer([bow_tie]).to_file(tmp_path / "stand.gpkg")
    frame = read_vector(tmp_path / "stand.gpkg", geometry=("polygon",), target_crs=LV95, feedback=said)
    assert isinstance(frame.geometry[0], MultiPolygon)
    assert frame.geometry[0].area == pytest.approx(2.0)
    assert "1 self-intersecting polygons" in said.notes[0]


def test_wrong_geometries_and_gaps_name_their_row(tmp_path):
    layer([Point(1, 2), LineString([(0, 0), (1, 1)])]).to_file(tmp_path / "mixed.gpkg")
    assert "layer 'mixed', row 2: a LineString, but the trees must be points" in refused(tmp_path / "mixed.gpkg")
    layer([Point(1, 2), None]).to_file(tmp_path / "gap.gpkg")
    assert "row 2: the geometry is empty" in refused(tmp_path / "gap.gpkg")
    layer([Point(1, 2), Point(np.nan, 2)]).to_file(tmp_path / "nan.gpkg")
    assert "row 2: a coordinate is not a finite number" in refused(tmp_path / "nan.gpkg")
    layer([Point(1, 2), Point(np.inf, 2)]).to_file(tmp_path / "inf.gpkg")
    assert "row 2: a coordinate is not a finite number" in refused(tmp_path / "inf.gpkg")
    points().iloc[:0].to_file(tmp_path / "empty.gpkg")
    assert "the trees layer is empty" in refused(tmp_path / "empty.gpkg")


@pytest.mark.parametrize("name", ["trees.gpkg", "trees.shp", "trees.geojson"])
@pytest.mark.parametrize("content", [None, b"", b"this is no layer"])
def test_files_that_are_none_are_refused(tmp_path, name, content):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    assert refused(tmp_path / name).startswith(f"{tmp_path / name}: ")


def test_columns_cut_short_by_a_shapefile_get_their_names_back(tmp_path, said):
    columns = {"density_kg": [400.0] * 3, "azimuth_de": [90.0] * 3, "ORIENTATIO": ["lying"] * 3, "Dbh_Cm": [50.0] * 3}
    points(**columns).to_file(tmp_path / "releases.shp")
    frame = read_vector(tmp_path / "releases.shp", target_crs=LV95, what="releases", feedback=said)
    assert list(frame)[:4] == ["density_kg_m3", "azimuth_deg", "orientation", "dbh_cm"]
    assert len(said.notes) == 4


def test_a_column_that_looks_like_one_of_ours_is_not_passed_over_silently(tmp_path, said):
    points(dbh=[0.5] * 3, length=[20.0] * 3).to_file(tmp_path / "releases.gpkg")
    read_vector(tmp_path / "releases.gpkg", target_crs=LV95, what="releases", feedback=said)
    assert ["'dbh' is not used; rename it to dbh_cm" in said.warnings[0], "'length'" in said.warnings[1]] == [
        True,
        True,
    ]


# --- columns


def test_a_missing_column_takes_the_default_and_without_one_is_refused():
    frame = points(height=[1, 2, 3])
    assert number_column(frame, "dbh_cm", default=75).tolist() == [75.0] * 3
    with pytest.raises(UserError, match="the field 'dbh_cm' is missing; it has the fields height"):
        number_column(frame, "dbh_cm")


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (-3.0, "row 2: -3 is not a number greater than 0"),
        (0.0, "row 2: 0 is not"),
        (None, "row 2: the value is empty"),
        (np.nan, "row 2: the value is empty"),
        (np.inf, "row 2: inf is not"),
        ("thick", "row 2: 'thick' is not"),
        (400.0, "row 2: 400 is not a number greater than 0 and at most 300"),
    ],
)
def test_a_bad_number_names_file_layer_field_and_row(tmp_path, value, words):
    values = ["30", value, "50"] if isinstance(value, str) else [30.0, value, 50.0]
    points(dbh_cm=values).to_file(tmp_path / "trees.gpkg")
    frame = read_vector(tmp_path / "trees.gpkg", target_crs=LV95)
    with pytest.raises(UserError, match=words) as raised:
        number_column(frame, "dbh_cm", minimum=0, exclusive=True, maximum=300)
    assert f"{tmp_path / 'trees.gpkg'}, layer 'trees', field 'dbh_cm', row 2" in str(raised.value)


def test_numbers_stored_as_text_are_numbers_and_gaps_may_be_welcome():
    frame = points(a=["30", "40.5", "-1"])
    assert number_column(frame, "a").tolist() == [30, 40.5, -1]
    gaps = number_column(points(a=[30.0, None, -1.0]), "a", minimum=0, gaps=True, missing_value=-1)
    assert np.array_equal(gaps, [30, np.nan, np.nan], equal_nan=True)
    with pytest.raises(UserError, match="'x' is not"):
        number_column(points(a=["30", "x", None]), "a", gaps=True)


def test_ids_are_whole_numbers_where_they_can_be(said):
    assert id_column(points(i=[1.0, 2.0, 3e15]), "i").tolist() == [1, 2, 3_000_000_000_000_000]
    assert id_column(points(i=["a", "b", "7"]), "i").tolist() == ["a", "b", "7"]
    with pytest.raises(UserError, match="row 3: the id is empty"):
        id_column(points(i=["a", "b", None]), "i")


@pytest.mark.parametrize(("dbh", "words"), [(0.75, "metres"), (750.0, "millimetres"), (75.0, None)])
def test_a_mistaken_unit_is_suspected_from_the_median(dbh, words, said):
    warn_implausible(np.array([dbh, dbh, 50.0]), schemas.TREES.column("dbh_cm"), "trees.gpkg", said)
    assert (words in said.warnings[0]) if words else said.warnings == []


# --- written


def test_a_geopackage_is_version_1_2_holds_its_layers_and_is_the_same_every_time(tmp_path):
    layers = {"deposits": layer([Point(1, 2, 3)], stop_id=["é"]), "lines": layer([LineString([(0, 0), (1, 1)])])}
    for name in ("a.gpkg", "b.gpkg"):
        write_vector(tmp_path / name, layers)
    assert (tmp_path / "a.gpkg").read_bytes() == (tmp_path / "b.gpkg").read_bytes()
    with sqlite3.connect(tmp_path / "a.gpkg") as database:
        assert database.execute("pragma user_version").fetchone() == (10200,)
        assert database.execute("pragma integrity_check").fetchone() == ("ok",)
    assert pyogrio.list_layers(tmp_path / "a.gpkg").tolist() == [
        ["deposits", "Point Z"],
        ["lines", "LineString"],
        ["layer_styles", None],
    ]
    frame = read_vector(f"{tmp_path / 'a.gpkg'}|layername=deposits", target_crs=LV95)
    with pytest.raises(UserError, match="it has deposits, lines$"):
        read_vector(f"{tmp_path / 'a.gpkg'}|layername=styles", target_crs=LV95)
    assert frame["stop_id"].tolist() == ["é"]
    assert frame.geometry[0].z == 3


def test_outputs_are_geopackages(tmp_path):
    with pytest.raises(UserError, match=r"name it .*trees\.gpkg"):
        write_vector(tmp_path / "trees.shp", {"trees": points()})


def test_a_geopackage_says_what_its_layers_and_columns_are(tmp_path):
    """In the words of the schemas, in the extension that GDAL reads; nothing for columns without a schema."""
    frame = points(2, log_id=[1, 2], dbh_cm=[40.0, 50.0], runout_m=[1.0, 2.0], mine=["a", "b"])
    write_vector(tmp_path / "a.gpkg", {"deposits": frame, "of_the_user": frame})
    with sqlite3.connect(tmp_path / "a.gpkg") as db:
        described = dict(db.execute("SELECT table_name, description FROM gpkg_contents"))
        told = db.execute("SELECT table_name, column_name, name, description FROM gpkg_data_columns").fetchall()
        extensions = db.execute(
            "SELECT table_name FROM gpkg_extensions WHERE extension_name = 'gpkg_schema'"
        ).fetchall()
    columns = {each.name: each for each in schemas.DEPOSITS.columns}
    assert described["deposits"] == schemas.DEPOSITS.meaning
    assert not described["of_the_user"]
    titles = {"log_id": None, "dbh_cm": "DBH [cm]", "runout_m": "Runout [m]"}
    assert told == [("deposits", name, title, columns[name].meaning) for name, title in titles.items()]
    assert sorted(extensions) == [("gpkg_data_column_constraints",), ("gpkg_data_columns",)]
    assert list(gpd.read_file(tmp_path / "a.gpkg", layer="deposits").columns) == list(frame.columns)


def test_of_layers_of_one_name_the_one_with_these_columns_is_meant():
    """A run's reach is that of all its logs, that of reach-lines of the logs whose trajectories are kept."""
    for layer in (REACH, REACH_OF_RUN):
        assert layer_with("reach", [each.name for each in layer.columns]) is layer
    assert layer_with("unknown", ["a"]) is None


@pytest.mark.parametrize(
    ("written", "code"),
    [
        (lambda shape: shapely.to_wkb(shape, hex=True), None),
        (lambda shape: shapely.to_wkb(shapely.set_srid(shape, 2056), hex=True, include_srid=True), 2056),
        (lambda shape: "\\x" + shapely.to_wkb(shapely.set_srid(shape, 2056), include_srid=True).hex(), 2056),
        (lambda shape: f"SRID=2056;{shape.wkt}", 2056),
    ],
)
def test_geometries_as_a_database_writes_them(tmp_path, written, code):
    """The very coordinates, and the CRS that the text names."""
    shapes = [shapely.Point(2_700_000.123, 1_200_000.456), shapely.Point(2_700_001.0, 1_200_002.0)]
    (tmp_path / "a.csv").write_text("geom,a\n" + "".join(f"{written(each)},1\n" for each in shapes))
    crs = None if code else "EPSG:2056"
    frame = read_vector(tmp_path / "a.csv", target_crs=None, crs=crs)
    assert [(each.x, each.y) for each in frame.geometry] == [(each.x, each.y) for each in shapes]
    assert frame.crs.to_epsg() == 2056


def test_a_broken_geometry_of_a_database_names_st_astext(tmp_path):
    whole = shapely.to_wkb(shapely.Point(1, 2), hex=True)
    for rows, words in (
        ([whole, whole[:-4]], r"row 2: .* ST_AsText\(geom\) writes it"),
        (["SRID=2056;POINT (1 2)", "SRID=21781;POINT (1 2)"], r"several CRS \(SRID \[2056, 21781\]\)"),
        (["SRID=999999;POINT (1 2)"] * 2, r"the SRID is 'EPSG:999999', which is not a known CRS"),
    ):
        (tmp_path / "a.csv").write_text("geom,a\n" + "".join(f"{each},1\n" for each in rows))
        with pytest.raises(UserError, match=words):
            read_vector(tmp_path / "a.csv", target_crs=None, crs="EPSG:2056")
