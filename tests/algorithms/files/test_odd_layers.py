"""Odd layers and tables of trees, made here, through the command line: the right trees and places, or one line."""

from __future__ import annotations

import datetime
import os
import shutil
import sqlite3
import zipfile
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pyproj
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin

from deadwood_algorithms.files.vectors import read_vector
from deadwood_toolbox import cli

E, N = 2_783_000.0, 1_190_000.0
PLACES = [(E + 10.5, N + 20.25), (E + 30.5, N + 40.25), (E + 50.5, N + 60.25)]
DBH, HEIGHT = [30.0, 40.0, 50.0], [20.0, 21.0, 22.0]


def trees(crs: Any = 2056, geometry: Any = None, **columns: Any) -> gpd.GeoDataFrame:
    values = {"tree_id": [1, 2, 3], "dbh_cm": DBH, "height_m": HEIGHT} | columns
    shapes = [shapely.Point(*place) for place in PLACES] if geometry is None else geometry
    return gpd.GeoDataFrame(values, geometry=shapes, crs=2056).to_crs(crs)


def saved(path: Path, frame: gpd.GeoDataFrame | None = None, **options: Any) -> Path:
    path.parent.mkdir(exist_ok=True)
    (trees() if frame is None else frame).to_file(path, **options)
    return path


def empty_beside_full(folder: Path) -> Path:
    saved(folder / "both.gpkg", trees().iloc[:0], layer="none")
    return saved(folder / "both.gpkg", layer="full", mode="a")


def shapefile(folder: Path, *without: str, name: str = "trees", prj: str | None = None) -> Path:
    path = saved(folder / "shp" / f"{name}.shp")
    for ending in without:
        path.with_suffix(ending).unlink()
    if prj:
        path.with_suffix(".prj").write_text(prj)
    return path


def zipped(folder: Path, *names: str) -> Path:
    with zipfile.ZipFile(folder / "trees.zip", "w") as archive:
        for name in names:
            path = shapefile(folder, name=name)
            for part in path.parent.glob(f"{name}.*"):
                archive.write(part, part.name)
    return folder / "trees.zip"


def two_layers(folder: Path) -> Path:
    path = saved(folder / "trees.gpkg", layer="Bäume Süd")
    trees(dbh_cm=[1.0, 2.0, 3.0]).to_file(path, layer="others")
    return path


def geopackage(folder: Path, statement: str) -> Path:
    path = saved(folder / "trees.gpkg")
    with sqlite3.connect(path) as base:
        base.execute(statement)
    base.close()
    return path


def renamed(path: Path, name: str) -> Path:
    return path.rename(path.with_name(name))


def half(path: Path) -> Path:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    return path


def arrow(path: Path) -> Path:
    frame = trees()
    frame.to_feather(path) if path.suffix == ".feather" else frame.to_parquet(path)
    return path


def linked(folder: Path) -> Path:
    (folder / "link.gpkg").symlink_to(saved(folder / "trees.gpkg"))
    return folder / "link.gpkg"


def text(content: str, encoding: str = "utf-8", name: str = "trees.csv"):
    def write(folder: Path) -> Path:
        path = folder / name
        path.write_bytes(content.encode(encoding))
        return path

    return write


def lines_of(separator: str = ",", number: Any = str, quote: str = "") -> str:
    """A table of the trees: id, x, y, DBH, height."""
    head = separator.join(["tree_id", "x", "y", "dbh_cm", "height_m"])
    rows = [
        separator.join([str(i + 1), *(f"{quote}{number(v)}{quote}" for v in (*PLACES[i], DBH[i], HEIGHT[i]))])
        for i in range(3)
    ]
    return "\n".join([head, *rows]) + "\n"


def german(value: float) -> str:  # 2.783.010,50
    return f"{value:,.2f}".translate(str.maketrans(",.", ".,"))


TABLE = lines_of()
POINT_Z = shapely.from_wkt([f"POINT Z ({x} {y} 15)" for x, y in PLACES])
POINT_ZM = shapely.from_wkt([f"POINT ZM ({x} {y} 15 7)" for x, y in PLACES])
MULTI = shapely.from_wkt([f"MULTIPOINT (({x} {y}))" for x, y in PLACES])
READ: dict[str, Any] = {
    "GeoPackage": lambda f: saved(f / "trees.gpkg"),
    "GeoPackage with Z": lambda f: saved(f / "trees.gpkg", trees(geometry=POINT_Z)),
    "GeoPackage of multipoints with one point": lambda f: saved(f / "trees.gpkg", trees(geometry=MULTI)),
    "a named layer": lambda f: f"{two_layers(f)}|layername=Bäume Süd",
    "a numbered layer, as QGIS may write it": lambda f: f"{two_layers(f)}|layerid=0|geometrytype=Point",
    "blanks and umlauts": lambda f: saved(f / "Bäume am Föhnhang.gpkg"),
    "a name in capitals": lambda f: renamed(saved(f / "trees.geojson"), "TREES.GEOJSON"),
    "a symbolic link": linked,
    "a GeoPackage called .shp": lambda f: renamed(saved(f / "trees.gpkg"), "trees.shp"),
    "a GeoPackage without ending": lambda f: renamed(saved(f / "trees.gpkg"), "trees"),
    "dates and truths beside": lambda f: saved(
        f / "trees.gpkg", trees(seen=[datetime.datetime(2020, 5, 1)] * 3, marked=[True, False, True])
    ),
    "ids as floats, DBH as text": lambda f: saved(
        f / "trees.gpkg", trees(tree_id=[1.0, 2.0, 3.0], dbh_cm=["30", " 40.0", "5e1"])
    ),
    "a row of units": text(TABLE.replace("\n1,", "\n-,m,m,cm,m\n1,")),
    "a CRS in degrees": lambda f: saved(f / "trees.gpkg", trees(4326)),
    "a CRS in three dimensions": lambda f: saved(f / "trees.gpkg", trees(4979)),
    "the CRS of the neighbours": lambda f: saved(f / "trees.gpkg", trees(31287)),
    "the older Swiss CRS": lambda f: saved(f / "trees.gpkg", trees(21781)),
    "a compound CRS": lambda f: saved(f / "trees.gpkg", trees().set_crs("EPSG:2056+5728", allow_override=True)),
    "shapefile": lambda f: shapefile(f),
    "shapefile without .cpg": lambda f: shapefile(f, ".cpg"),
    "shapefile without CRS": lambda f: shapefile(f, ".prj"),
    "shapefile with an ESRI .prj": lambda f: shapefile(f, prj=pyproj.CRS(2056).to_wkt("WKT1_ESRI")),
    "a shapefile without .shx": lambda f: shapefile(f, ".shx"),
    "shapefile in a zip": lambda f: zipped(f, "trees"),
    "one shapefile of a zip": lambda f: f"{zipped(f, 'trees', 'others')}|layername=trees",
    "GeoJSON with a CRS": lambda f: saved(f / "trees.geojson"),
    "GeoJSON of the norm": lambda f: saved(f / "trees.geojson", RFC7946="YES", COORDINATE_PRECISION="9"),
    "FlatGeobuf": lambda f: saved(f / "trees.fgb", driver="FlatGeobuf"),
    "GML": lambda f: saved(f / "trees.gml", driver="GML"),
    "MapInfo": lambda f: saved(f / "trees.tab", driver="MapInfo File"),
    "Esri geodatabase": lambda f: saved(f / "trees.gdb", trees(tree_id=[1.0, 2.0, 3.0]), driver="OpenFileGDB"),
    "GeoParquet": lambda f: arrow(f / "trees.parquet"),
    "Feather": lambda f: arrow(f / "trees.feather"),
    "CSV": text(TABLE),
    "CSV in capitals": text(TABLE, name="TREES.CSV"),
    "CSV with semicolons and decimal commas": text(lines_of(";", lambda v: str(v).replace(".", ","))),
    "CSV with commas and decimal commas in quotes": text(lines_of(",", lambda v: str(v).replace(".", ","), '"')),
    "CSV with German thousands": text(lines_of(";", german)),
    "CSV with English thousands": text(lines_of(",", lambda v: f"{v:,.2f}", '"')),
    "CSV with Swiss thousands": text(lines_of(";", lambda v: f"{v:,.2f}".replace(",", "'"))),
    "CSV with thousands apart by narrow blanks": text(lines_of(";", lambda v: f"{v:,.2f}".replace(",", "\u202f"))),
    "CSV with powers of ten": text(lines_of(";", lambda v: f"{v:.9E}")),
    "CSV all in quotes": text(lines_of(",", str, '"')),
    "CSV with a byte order mark": text(TABLE, "utf-8-sig"),
    "CSV as UTF-16": text(TABLE, "utf-16"),
    "CSV as UTF-16 without its mark": text(TABLE, "utf-16-le"),
    "CSV as UTF-32": text(TABLE, "utf-32"),
    "CSV in latin-1": text(TABLE.replace("\n", ",Föhre\n").replace("height_m,Föhre", "height_m,Art"), "latin-1"),
    "CSV with CR alone": text(TABLE.replace("\n", "\r")),
    "CSV with empty lines behind": text(TABLE + "\n  \n,,,,\n\n"),
    "CSV with a separator behind each line": text(TABLE.replace("\n", ",,\n")),
    "CSV with comments above": text("# lidR 4.1\n# 2020-05-01\n" + TABLE),
    "CSV with the spreadsheet's first line": text("sep=;\n" + TABLE.replace(",", ";")),
    "CSV with units in its head": text(TABLE.replace("x,y", "X [m],Y (m)")),
    "CSV with shapes as text": text(
        "WKT,tree_id,dbh_cm,height_m\n"
        + "".join(f'"POINT ({x} {y})",{i + 1},{DBH[i]},{HEIGHT[i]}\n' for i, (x, y) in enumerate(PLACES))
    ),
    "blanks as separator": text(lines_of("   "), name="trees.txt"),
    "tabs": text(lines_of("\t"), name="trees.tsv"),
}
APART_M = {"the CRS of the neighbours": 3.0, "the older Swiss CRS": 0.01, "GeoJSON of the norm": 0.01, "MapInfo": 0.02}


@pytest.fixture
def dem(tmp_path) -> Path:
    profile = {"driver": "GTiff", "dtype": "float32", "count": 1, "height": 50, "width": 50, "crs": "EPSG:2056"}
    with rasterio.open(tmp_path / "dem.tif", "w", transform=from_origin(E, N + 100, 2, 2), **profile) as made:
        made.write(np.full((50, 50), 900.0, np.float32), 1)
    return tmp_path / "dem.tif"


def imported(source: Any, dem: Path, folder: Path) -> int:
    flags = ["--trees", str(source), "--dem", str(dem), "--output", str(folder / "out" / "trees.gpkg")]
    return cli.run(["import-trees", *flags])


@pytest.mark.parametrize("name", READ)
def test_it_is_read_right(tmp_path, dem, name):
    """To within 0.1 m if PROJ goes through another datum and back in the same way: the difference is rounding."""
    assert imported(READ[name](tmp_path), dem, tmp_path) == 0
    found = gpd.read_file(tmp_path / "out" / "trees.gpkg").sort_values("dbh_cm")
    assert found["dbh_cm"].tolist() == DBH
    assert found["height_m"].tolist() == HEIGHT
    assert found["tree_id"].astype(int).tolist() == [1, 2, 3]
    assert np.abs(shapely.get_coordinates(found.geometry) - PLACES).max() < APART_M.get(name, 2e-3)


def emptied(folder: Path, shape: Any) -> Path:
    shapes = [shapely.Point(*PLACES[0]), shape, shapely.Point(*PLACES[2])]
    return saved(folder / "trees.gpkg", trees(geometry=shapes))


def nul(folder: Path) -> Path:
    return text(TABLE.replace("30.0", "30.0\0"))(folder)


def bare_geojson(folder: Path) -> Path:
    path = saved(folder / "trees.geojson")
    kept = [line for line in path.read_text().splitlines() if not line.startswith('"crs"')]
    path.write_text("\n".join(kept))
    return path


def attributes(folder: Path) -> Path:
    pyogrio.write_dataframe(pd.DataFrame({"dbh_cm": DBH}), folder / "trees.gpkg", layer="trees")
    return folder / "trees.gpkg"


REFUSED: dict[str, tuple[Any, tuple[str, ...]]] = {
    "a null geometry": (lambda f: emptied(f, None), ("layer 'trees', row 2: the geometry is empty",)),
    "an empty geometry": (lambda f: emptied(f, shapely.Point()), ("row 2: the geometry is empty",)),
    "an infinite coordinate": (
        lambda f: emptied(f, shapely.Point(np.inf, 0)),
        ("row 2: a coordinate is not a finite",),
    ),
    "mixed types": (lambda f: emptied(f, shapely.LineString([(E, N), (E, N + 1)])), ("row 2: a LineString",)),
    "multipoints": (lambda f: emptied(f, shapely.MultiPoint(PLACES)), ("row 2: a MultiPoint", "Multipart to singlep")),
    "no row": (lambda f: saved(f / "trees.gpkg", trees().iloc[:0]), ("is empty (no feature)",)),
    "no row, of several layers": (
        lambda f: f"{empty_beside_full(f)}|layername=none",
        ("layer 'none': the single trees layer is empty", "features in another: '", "|layername=full'"),
    ),
    "two layers": (two_layers, ("several layers (Bäume Süd, others)", "|layername=Bäume Süd")),
    "a layer that is not there": (lambda f: f"{two_layers(f)}|layername=Föhren", ("there is no layer 'Föhren'",)),
    "a filter": (
        lambda f: f"{two_layers(f)}|layername=others|subset=dbh_cm > 2",
        ("'|subset=dbh_cm > 2' is not under",),
    ),
    "no geometry table": (
        lambda f: geopackage(f, "DROP TABLE gpkg_geometry_columns"),
        ("not a vector layer that can be",),
    ),
    # GDAL 3.9 gives the geometries of such a table as text.
    "no contents": (
        lambda f: geopackage(f, "DELETE FROM gpkg_contents"),
        ("no columns x and y" if pyogrio.__gdal_version__ > (3, 10) else "'geom', row 1: 'GP' is not a geometry",),
    ),
    "attributes alone": (attributes, ("no columns x and y with the coordinates; it has the fields dbh_cm",)),
    "half a GeoPackage": (
        lambda f: half(saved(f / "trees.gpkg", trees().sample(3000, replace=True))),
        ("can be read (",),
    ),
    "half a GeoJSON": (lambda f: half(saved(f / "trees.geojson")), ("not a vector layer that can be read",)),
    "an empty geodatabase": (lambda f: (f / "t.gdb").mkdir() or f / "t.gdb", ("not a vector layer that can be read",)),
    "a shapefile without .dbf": (lambda f: shapefile(f, ".dbf"), ("trees.dbf is missing", "copy all its parts")),
    "two shapefiles in a zip": (lambda f: zipped(f, "a", "b"), ("several layers (a, b)", "trees.zip|layername=a")),
    "a shapefile called .gpkg": (lambda f: renamed(shapefile(f), "t.gpkg"), ("not a vector layer that can be read",)),
    "a GeoPackage called .csv": (lambda f: renamed(saved(f / "t.gpkg"), "t.csv"), ("not a text file (it holds NUL",)),
    "GeoJSON in metres without a CRS": (bare_geojson, ("names the CRS EPSG:4326 (degrees), or none", "true CRS")),
    "Parquet without geometries": (
        lambda f: trees().drop(columns="geometry").to_parquet(f / "t.parquet") or f / "t.parquet",
        ("not a layer of geometries", "geo metadata"),
    ),
    "a spreadsheet": (text("PK\3\4", name="trees.xlsx"), ("save a spreadsheet as CSV",)),
    "a table without ending": (text(TABLE, name="trees"), ("has no extension", ".csv")),
    "a page of the web": (text("<html><body>403 Forbidden</body></html>\n"), ("holds a header but no row",)),
    "a row too short": (text(TABLE.replace(",50.0,22.0", "")), ("row 3 has 3 cells, the first line has 5",)),
    "a row too long": (text(TABLE.replace("22.0", "22.0,7")), ("row 3 has 6 cells, the first line has 5",)),
    "a quote never closed": (text(TABLE.replace(",40.0", ',"40.0')), ("row 2 cannot be split into cells", "stray")),
    "decimal commas and commas": (text(lines_of(",", lambda v: str(v).replace(".", ","))), ("row 1 has 9 cells",)),
    "two columns of one name": (text(TABLE.replace("height_m", "dbh_cm")), ("two columns", "'dbh_cm'; rename one")),
    "points and commas in one column": (
        text(lines_of(";").replace("30.0", "1.234").replace("40.0", "35,5")),
        ("field 'dbh_cm', row", "35,5", "--read-as"),
    ),
    "a gap in a coordinate": (text(TABLE.replace(f"{PLACES[1][1]}", "")), ("field 'y', row 2: the value is empty",)),
    "a number beyond all": (text(TABLE.replace("40.0", "1e400")), ("field 'dbh_cm', row 2: ", "is not a number")),
    "a NUL byte": (nul, ("not a text file (it holds NUL bytes)",)),
    "half a character of UTF-16": (
        lambda f: (f / "t.csv").write_bytes(TABLE.encode("utf-16")[:-1]) and f / "t.csv",
        ("not readable text; save it as UTF-8",),
    ),
    "a head alone": (text(TABLE.splitlines()[0]), ("holds a header but no row",)),
    "shapes as text, one broken": (
        text("id;geometry\n1;POINT (1 2)\n2;POINT (1\n"),
        ("field 'geometry', row 2: 'POINT (1' is not a geometry as text",),
    ),
    "degrees, minutes, seconds": (text("lat,lon\n46°54',9°30'\n"), ("field 'lon', row 1: '9°30''",)),
    "a folder": (lambda f: f, ("this is a folder, but the single trees must be a file",)),
    "a loop of links": (lambda f: os.symlink(f / "t.gpkg", f / "t.gpkg") or f / "t.gpkg", ("does not exist",)),
    "a name too long": (lambda f: f / ("x" * 300 + ".gpkg"), ("File name too long",)),
}


@pytest.mark.parametrize("name", REFUSED)
def test_it_is_refused_in_one_line(tmp_path, dem, name, capsys):
    make, words = REFUSED[name]
    source = make(tmp_path)
    assert imported(source, dem, tmp_path) == 2
    said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("deadwood-tool:")]
    assert len(said) == 1, said
    assert len(said[0]) < 700
    for word in words:
        assert word in said[0], said
    assert not (tmp_path / "out").exists()


def test_curves_and_holes_keep_their_area(tmp_path):
    """A half circle of radius 2 as a curve: pi r^2 / 2, to within the chords of 4 degrees (0.08 %)."""
    ring = f"CIRCULARSTRING ({E} {N}, {E + 2} {N + 2}, {E + 4} {N})"
    curve = f"CURVEPOLYGON (COMPOUNDCURVE ({ring}, ({E + 4} {N}, {E} {N})))"
    holed = shapely.box(E, N, E + 9, N + 9) - shapely.box(E + 3, N + 3, E + 5, N + 5)
    both = shapely.MultiPolygon([holed, shapely.box(E + 20, N, E + 22, N + 2)])
    (tmp_path / "areas.csv").write_text(f'WKT\n"{curve}"\n')
    (tmp_path / "areas.csvt").write_text("WKT\n")
    gpd.GeoSeries([both], crs=2056).to_frame("geometry").to_file(tmp_path / "holes.gpkg")
    options = {"geometry": ("polygon",), "target_crs": pyproj.CRS(2056), "what": "areas"}
    assert read_vector(tmp_path / "holes.gpkg", **options).area.tolist() == [81 - 4 + 4]
    path = tmp_path / "curve.vrt"  # the CSV through GDAL, which knows curves; shapely's own reader does not
    path.write_text(
        '<OGRVRTDataSource><OGRVRTLayer name="areas"><SrcDataSource relativeToVRT="1">areas.csv</SrcDataSource>'
        '<LayerSRS>EPSG:2056</LayerSRS><GeometryField encoding="WKT" field="WKT"/></OGRVRTLayer></OGRVRTDataSource>'
    )
    assert read_vector(path, **options).area.tolist() == pytest.approx([2 * np.pi], rel=1e-3)


def test_a_reprojection_says_how_accurate_it_is(tmp_path, said):
    for crs in (4326, 31287, 2225):
        read_vector(
            saved(tmp_path / f"{crs}.gpkg", trees(crs)), target_crs=pyproj.CRS(2056), what="trees", feedback=said
        )
    assert "EPSG:4326 to EPSG:2056 (accurate to about 1 m)" in said.notes[0]
    assert "accurate to about" in said.notes[1]
    # California to Switzerland: PROJ has no transformation
    assert "the error may be 100 m and more" in said.warnings[0]


def test_ids_keep_their_zeros_and_their_digits(tmp_path, dem):
    table = TABLE.replace("\n1,", "\n007,").replace("\n2,", "\n012,")
    assert imported(text(table)(tmp_path), dem, tmp_path) == 0
    assert gpd.read_file(tmp_path / "out" / "trees.gpkg")["tree_id"].tolist() == ["007", "012", "3"]
    huge = TABLE.replace("\n1,", "\n12345678901234567890,")
    shutil.rmtree(tmp_path / "out")
    assert imported(text(huge)(tmp_path), dem, tmp_path) == 0
    assert gpd.read_file(tmp_path / "out" / "trees.gpkg")["tree_id"].tolist() == ["12345678901234567890", "2", "3"]


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may read and write everything")
def test_files_and_folders_without_permission(tmp_path, dem, capsys):
    source = saved(tmp_path / "trees.gpkg")
    source.chmod(0)
    assert imported(source, dem, tmp_path) == 2
    assert "may not be read (Permission denied)" in capsys.readouterr().err
    source.chmod(0o600)
    (tmp_path / "out").mkdir(mode=0o500)
    assert imported(source, dem, tmp_path) == 2
    assert "cannot be written to (Permission denied)" in capsys.readouterr().err
