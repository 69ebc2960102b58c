"""Odd terrain models, made here: each gives the right heights at the right place, or one clear line and status 2."""

from __future__ import annotations

import gzip
import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
import rasterio.shutil
from rasterio.control import GroundControlPoint
from rasterio.crs import CRS
from rasterio.enums import ColorInterp
from rasterio.transform import Affine, from_origin

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.params.tool import UserError
from deadwood_toolbox import cli

# 3 rows, 4 columns as on a map, the north-west corner first; every height is unique. South-west corner E, N.
MAP = np.array([[511.0, 512, 513, 514], [521, 522, 523, 524], [531, 532, 533, 534]])
E, N = 2_783_000.0, 1_190_000.0
NORTH_UP = from_origin(E, N + 6.0, 2.0, 2.0)
HOLE = (0, 0)  # on the map; row 2, column 0 of a Grid
HEADER = f"ncols 4\nnrows 3\nxllcorner {E:.0f}\nyllcorner {N:.0f}\ncellsize 2\nNODATA_value -9999\n"
BODY = "\n".join(" ".join(f"{value:.1f}" for value in row) for row in MAP) + "\n"
ESRI_PRJ = (
    'PROJCS["CH1903+_LV95",GEOGCS["GCS_CH1903+",DATUM["D_CH1903+",SPHEROID["Bessel_1841",6377397.155,299.1528128]],'
    'PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],'
    'PROJECTION["Hotine_Oblique_Mercator_Azimuth_Center"],PARAMETER["False_Easting",2600000.0],'
    'PARAMETER["False_Northing",1200000.0],PARAMETER["Scale_Factor",1.0],PARAMETER["Azimuth",90.0],'
    'PARAMETER["Longitude_Of_Center",7.439583333333333],PARAMETER["Latitude_Of_Center",46.95240555555556],'
    'UNIT["Meter",1.0]]'
)


def tif(path: Path, values: np.ndarray = MAP, *, mask: Any = None, change: Any = None, **profile: Any) -> Path:
    facts = {"driver": "GTiff", "dtype": "float32", "count": 1, "crs": "EPSG:2056", "transform": NORTH_UP}
    facts |= {"height": values.shape[0], "width": values.shape[1]} | profile
    with rasterio.open(path, "w", **facts) as made:
        for band in range(1, made.count + 1):
            made.write(values.astype(facts["dtype"]), band)
        if mask is not None:
            made.write_mask(mask)
        if change is not None:
            change(made)
    return path


def holed(value: float) -> np.ndarray:
    values = MAP.copy()
    values[HOLE] = value
    return values


def asc(path: Path, header: str = HEADER, body: str = BODY, prj: str | None = None, **coding: Any) -> Path:
    path.write_text(header + body, **coding)
    if prj:
        path.with_suffix(".prj").write_text(prj)
    return path


def xyz(path: Path, separator: str = " ", head: str = "", rows: Any = (0, 1, 2), skip: Any = None) -> Path:
    cells = [(r, c) for r in rows for c in range(4) if (r, c) != skip]
    lines = [separator.join(f"{v:.1f}" for v in (E + 1 + 2 * c, N + 5 - 2 * r, MAP[r, c])) for r, c in cells]
    path.write_text(head + "\n".join(lines) + "\n")
    return path


def copied(path: Path, driver: str, **options: Any) -> Path:
    rasterio.shutil.copy(tif(path.with_name("base.tif")), path, driver=driver, **options)
    return path


def internal_mask(path: Path) -> Path:
    mask = np.full(MAP.shape, 255, np.uint8)
    mask[HOLE] = 0
    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True):
        return tif(path, mask=mask)


def scaled(made: Any) -> None:
    made.scales, made.offsets = (0.5,), (255.5,)


def vrt(path: Path, source: str = "base.tif") -> Path:
    tif(path.with_name("base.tif"))
    path.write_text(
        f'<VRTDataset rasterXSize="4" rasterYSize="3"><SRS>EPSG:2056</SRS><GeoTransform>{E},2,0,{N + 6},0,-2'
        '</GeoTransform><VRTRasterBand dataType="Float32" band="1"><SimpleSource><SourceFilename relativeToVRT="1">'
        f"{source}</SourceFilename><SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>"
    )
    return path


def linked(path: Path) -> Path:
    path.symlink_to(tif(path.with_name("base.tif")))
    return path


def deep(folder: Path) -> Path:
    place = folder.joinpath(*["a long name of a folder"] * 40)  # 900 characters; Windows stops at 260
    place.mkdir(parents=True)
    return tif(place / "dem.tif")


# What is read: the file, and whether its north-west cell is outside.
READ: dict[str, tuple[Any, bool]] = {
    "ASCII with an ESRI .prj": (lambda f: asc(f / "a.asc", prj=ESRI_PRJ), False),
    "ASCII without CRS": (lambda f: asc(f / "a.asc"), False),
    "ASCII with decimal commas": (lambda f: asc(f / "a.asc", body=BODY.replace(".", ",")), False),
    "ASCII with decimal commas in its header": (
        lambda f: asc(f / "a.asc", HEADER.replace("cellsize 2", "cellsize 2,0"), BODY.replace(".", ",")),
        False,
    ),
    "ASCII with NaN": (lambda f: asc(f / "a.asc", body=BODY.replace("511.0", "nan")), True),
    "ASCII without nodata line": (
        lambda f: asc(f / "a.asc", HEADER.replace("NODATA_value -9999\n", ""), BODY.replace("511.0", "-9999")),
        True,
    ),
    "ASCII with xllcenter": (
        lambda f: asc(
            f / "a.asc", HEADER.replace("corner", "center").replace("2783000", "2783001").replace("1190000", "1190001")
        ),
        False,
    ),
    "ASCII with CR alone": (lambda f: asc(f / "a.asc", newline="\r"), False),
    "ASCII with CR LF": (lambda f: asc(f / "a.asc", newline="\r\n"), False),
    "ASCII with tabs": (lambda f: asc(f / "a.asc", HEADER.replace(" ", "\t"), BODY.replace(" ", "\t")), False),
    "ASCII in capitals": (lambda f: asc(f / "a.asc", HEADER.upper()), False),
    "ASCII with powers of ten": (lambda f: asc(f / "a.asc", body=BODY.replace("511.0", "5.11e2")), False),
    "ASCII of whole numbers": (lambda f: asc(f / "a.asc", body=BODY.replace(".0", "")), False),
    "ASCII called .txt": (lambda f: asc(f / "a.txt"), False),
    "ASCII called .tif": (lambda f: asc(f / "a.tif"), False),
    "a name with blanks and umlauts": (lambda f: tif(f / "Höhen Modell äöü ß.tif"), False),
    "south-up": (lambda f: tif(f / "d.tif", MAP[::-1], transform=Affine(2, 0, E, 0, 2, N)), False),
    "int16 with scale and offset": (lambda f: tif(f / "d.tif", (MAP - 255.5) * 2, dtype="int16", change=scaled), False),
    "float64": (lambda f: tif(f / "d.tif", dtype="float64"), False),
    "float64 with the least number for nodata": (
        lambda f: tif(f / "d.tif", holed(-1.7976931348623157e308), dtype="float64", nodata=-1.7976931348623157e308),
        True,
    ),
    "nodata 0": (lambda f: tif(f / "d.tif", holed(0.0), nodata=0), True),
    "nodata NaN": (lambda f: tif(f / "d.tif", holed(np.nan), nodata=np.nan), True),
    "an infinite height": (lambda f: tif(f / "d.tif", holed(np.inf)), True),
    "uint16 with 65535": (lambda f: tif(f / "d.tif", holed(65535), dtype="uint16"), True),
    "a mask inside": (lambda f: internal_mask(f / "d.tif"), True),
    "two bands": (lambda f: tif(f / "d.tif", count=2), False),
    "a transparent band": (
        lambda f: tif(
            f / "d.tif", count=2, change=lambda m: setattr(m, "colorinterp", (ColorInterp.gray, ColorInterp.undefined))
        ),
        False,
    ),
    "a compound CRS": (lambda f: tif(f / "d.tif", crs="EPSG:2056+5728"), False),
    "BigTIFF in tiles": (lambda f: tif(f / "d.tif", BIGTIFF="YES", tiled=True, blockxsize=16, blockysize=16), False),
    "cloud-optimised": (lambda f: copied(f / "d.tif", "COG"), False),
    "ERDAS Imagine": (lambda f: copied(f / "d.img", "HFA"), False),
    "SAGA": (lambda f: copied(f / "d.sdat", "SAGA"), False),
    "ESRI .bil": (lambda f: copied(f / "d.bil", "EHdr"), False),
    "a raster in a GeoPackage": (lambda f: copied(f / "d.gpkg", "GPKG"), False),
    "VRT": (lambda f: vrt(f / "d.vrt"), False),
    "XYZ": (lambda f: xyz(f / "d.xyz"), False),
    "XYZ with a head, commas, the south first": (lambda f: xyz(f / "d.xyz", ",", "x,y,z\n", (2, 1, 0)), False),
    "XYZ with semicolons": (lambda f: xyz(f / "d.xyz", ";"), False),
    "a symbolic link": (lambda f: linked(f / "link.tif"), False),
    "a very long path": (deep, False),
}


@pytest.mark.parametrize("name", READ)
def test_it_is_read_right(tmp_path, name):
    make, hole = READ[name]
    grid = read_dem(make(tmp_path), crs="EPSG:2056")
    expected = MAP[::-1].copy()
    if hole:
        expected[2, 0] = np.nan
    assert np.array_equal(grid.values, expected, equal_nan=True), grid.values
    assert (grid.x0, grid.y0, grid.cell) == (E + 1.0, N + 1.0, 2.0)
    assert grid.plan_crs.to_epsg() == 2056


def gcps(path: Path) -> Path:
    places = [
        GroundControlPoint(0, 0, E, N),
        GroundControlPoint(3, 4, E + 8, N - 6),
        GroundControlPoint(0, 4, E + 8, N),
    ]
    return tif(path, transform=Affine.identity(), change=lambda m: setattr(m, "gcps", (places, CRS.from_epsg(2056))))


def palette(path: Path) -> Path:
    return tif(path, MAP - 500, dtype="uint8", change=lambda m: m.write_colormap(1, {11: (1, 2, 3)}))


def zipped(path: Path) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        archive.write(tif(path.with_name("base.tif")), "base.tif")
    return path


def packed(path: Path) -> Path:
    path.write_bytes(gzip.compress(tif(path.with_name("base.tif")).read_bytes()))
    return path


def cut_off(path: Path) -> Path:
    noise = np.random.default_rng(1).random((64, 64)).astype(np.float32)
    whole = tif(path, noise, compress="deflate").read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    return path


def dangling(path: Path) -> Path:
    path.symlink_to("nowhere.tif")
    return path


def folder(path: Path) -> Path:
    path.mkdir()
    return path


GEOGRAPHIC = {"crs": "EPSG:4979", "transform": from_origin(9.0, 47.0, 1e-5, 1e-5)}
TURNED = Affine.translation(E, N) @ Affine.rotation(20.0) @ Affine.scale(2.0, -2.0)
# Refused inputs: the file, and words of the one line.
REFUSED: dict[str, tuple[Any, tuple[str, ...]]] = {
    "no CRS": (lambda f: asc(f / "a.asc"), ("has no CRS", "--crs EPSG:2056")),
    "a .prj of nonsense": (lambda f: asc(f / "a.asc", prj="nonsense"), ("has no CRS",)),
    "geographic in three dimensions": (
        lambda f: tif(f / "d.tif", **GEOGRAPHIC),
        ("degrees", "rio warp", "--dst-crs EPSG:"),
    ),
    "feet": (lambda f: tif(f / "d.tif", crs="EPSG:2225"), ("US survey foot", "rio warp", "--dst-crs EPSG:")),
    "heights in feet": (
        lambda f: tif(f / "d.tif", crs="EPSG:32611+6360"),
        ("heights are in US survey foot", "rio calc"),
    ),
    "Web Mercator": (
        lambda f: tif(f / "d.tif", crs="EPSG:3857", transform=from_origin(1.1e6, 5.9e6, 2.0, 2.0)),
        ("maps of the whole world", "its metres are 0.69 m", "--dst-crs EPSG:2056", "--res 1.37"),
    ),
    "no CRS on Earth": (lambda f: tif(f / "d.tif", crs='LOCAL_CS["quarry",UNIT["metre",1]]'), ("not a projected one",)),
    "rotated": (lambda f: tif(f / "d.tif", transform=TURNED), ("rotated", "rio warp", "--res 2")),
    "rows and columns exchanged": (lambda f: tif(f / "d.tif", transform=Affine(0, 2, E, 2, 0, N)), ("rotated",)),
    "mirrored": (lambda f: tif(f / "d.tif", transform=Affine(-2, 0, E, 0, -2, N)), ("mirrored",)),
    "oblong cells": (
        lambda f: asc(f / "a.asc", HEADER.replace("cellsize 2", "dx 2\ndy 3"), prj=ESRI_PRJ),
        ("2 m x 3 m",),
    ),
    "cells without size": (
        lambda f: asc(f / "a.asc", HEADER.replace("size 2", "size 0"), prj=ESRI_PRJ),
        ("0 x -0 m large",),
    ),
    "no georeference": (lambda f: tif(f / "d.tif", transform=Affine.identity()), ("no georeference", "edit-info")),
    "control points": (lambda f: gcps(f / "d.tif"), ("3 ground control points", "rio warp")),
    "a picture": (lambda f: tif(f / "d.tif", MAP - 500, dtype="uint8", count=3), ("3 bands of uint8", "picture")),
    "a picture with a palette": (lambda f: palette(f / "d.tif"), ("palette", "picture")),
    "complex numbers": (lambda f: tif(f / "d.tif", dtype="complex64"), ("complex numbers",)),
    "one row": (lambda f: tif(f / "d.tif", MAP[:1]), ("4 x 1 cells",)),
    "nothing but nodata": (lambda f: tif(f / "d.tif", MAP * 0 - 9999, nodata=-9999), ("no height at all",)),
    "a byte order mark": (
        lambda f: asc(f / "a.asc", encoding="utf-8-sig"),
        ("byte order mark", "save it as plain text"),
    ),
    "UTF-16": (lambda f: asc(f / "a.asc", encoding="utf-16"), ("coded as UTF-16",)),
    "an empty first line": (lambda f: asc(f / "a.asc", "\n" + HEADER), ("must begin with 'ncols'",)),
    "no cell size": (lambda f: asc(f / "a.asc", HEADER.replace("cellsize 2\n", "")), ("has no 'cellsize'",)),
    "a word among the heights": (
        lambda f: asc(f / "a.asc", body=BODY.replace("522.0", "5x22.0"), prj=ESRI_PRJ),
        ("row 2 of the grid: '5x22.0' is not a number",),
    ),
    "a value too few": (lambda f: asc(f / "a.asc", body=BODY[:-6], prj=ESRI_PRJ), ("holds 11 values", "truncated")),
    "an XYZ that is no grid": (
        lambda f: xyz(f / "d.xyz", rows=(0, 2, 1, 0)),
        ("not a raster that can be read", "Ungridded"),
    ),
    "cut off": (lambda f: cut_off(f / "d.tif"), ("damaged",)),
    "a VRT without its source": (lambda f: vrt(f / "d.vrt", "gone.tif"), ("damaged", "gone.tif")),
    "a zip": (lambda f: zipped(f / "d.zip"), ("packed; unpack it",)),
    "a gz": (lambda f: packed(f / "d.tif.gz"), ("packed; unpack it",)),
    "a folder": (lambda f: folder(f / "d.tif"), ("this is a folder that holds no tile of a DEM",)),
    "a link to nowhere": (lambda f: dangling(f / "d.tif"), ("does not exist",)),
    "a name too long": (lambda f: f / ("x" * 300 + ".tif"), ("... x", "File name too long")),
    "no name": (lambda f: " ", ("--dem is empty",)),
}
WITHOUT_CRS = {"an XYZ that is no grid"}


@pytest.mark.parametrize("name", REFUSED)
def test_it_is_refused_in_one_line(tmp_path, name, capsys):
    make, words = REFUSED[name]
    trees = tmp_path / "trees.csv"
    trees.write_text(f"tree_id,x,y,dbh_cm,height_m\n1,{E + 3},{N + 3},40,20\n")
    flags = ["--trees", str(trees), "--dem", str(make(tmp_path)), "--output", str(tmp_path / "out" / "t.gpkg")]
    assert cli.run(["import-trees", *flags, *(["--crs", "EPSG:2056"] if name in WITHOUT_CRS else [])]) == 2
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1, said
    assert len(said) < 700
    for word in words:
        assert word in said, said
    assert not (tmp_path / "out").exists()


def test_a_crs_of_degrees_on_the_command_line_is_refused_like_one_in_the_file(tmp_path, capsys):
    flags = ["--trees", str(tmp_path / "t.csv"), "--dem", str(asc(tmp_path / "a.asc")), "--crs", "EPSG:4326"]
    assert cli.run(["import-trees", *flags, "--output", str(tmp_path / "t.gpkg")]) == 2
    assert "geographic (degrees)" in capsys.readouterr().err.splitlines()[-1]


def test_a_hillshade_is_suspected(tmp_path, said):
    read_dem(tif(tmp_path / "shade.tif", MAP - 500, dtype="uint8"), feedback=said)
    assert len(said.warnings) == 1
    assert "is it a hillshade" in said.warnings[0]


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read(tmp_path, capsys):
    path = tif(tmp_path / "d.tif")
    path.chmod(0)
    assert cli.run(["import-trees", "--trees", "t.csv", "--dem", str(path), "--output", str(tmp_path / "o.gpkg")]) == 2
    assert "may not be read (Permission denied)" in capsys.readouterr().err


AT = {  # a place as its CRS and others have it: code, easting and northing of the south-west corner
    "Bern": ("EPSG:2056", 2_600_000.0, 1_200_000.0),
    "Bern, LV03": ("EPSG:21781", 600_000.0, 200_000.0),
    "Innsbruck": ("EPSG:31254", 79_000.0, 235_000.0),
    "Innsbruck, Lambert": ("EPSG:31287", 250_000.0, 375_000.0),
    "Dresden, zone 33": ("EPSG:25833", 410_000.0, 5_655_000.0),
    "Dresden, zone 32": ("EPSG:25832", 832_000.0, 5_665_000.0),
    "Bregenz, LV95": ("EPSG:2056", 2_775_000.0, 1_265_000.0),
    "Gisborne": ("EPSG:2193", 2_036_000.0, 5_710_000.0),
    "Fiji": ("EPSG:3460", 2_000_000.0, 3_900_000.0),
}


@pytest.mark.parametrize("place", AT)
def test_of_a_dem_in_its_own_crs_nothing_is_reported(tmp_path, said, place):
    code, east, north = AT[place]
    read_dem(tif(tmp_path / "d.tif", crs=code, transform=from_origin(east, north, 2, 2)), feedback=said)
    assert said.warnings == []


@pytest.mark.parametrize(
    ("place", "code", "words"),
    [
        ("Innsbruck", "EPSG:2056", "far outside the area of use of EPSG:2056"),
        ("Innsbruck, Lambert", "EPSG:2056", "name the one that its supplier states"),
        ("Bern, LV03", "EPSG:2056", "its coordinates look like those of EPSG:21781"),
        ("Bern", "EPSG:21781", "its coordinates look like those of EPSG:2056"),
        ("Dresden, zone 33", "EPSG:2056", "far outside the area of use"),
        ("Bern", "EPSG:25832", "its coordinates look like those of EPSG:2056"),
    ],
)
@pytest.mark.parametrize("named", ["in the file", "by the option"])
def test_a_crs_that_is_not_that_of_the_place_is_reported(tmp_path, said, place, code, words, named):
    _, east, north = AT[place]
    inside = named == "in the file"
    path = tif(tmp_path / "d.tif", crs=code if inside else None, transform=from_origin(east, north, 2, 2))
    read_dem(path, crs=None if inside else code, feedback=said)
    assert len(said.warnings) == 1
    assert words in said.warnings[0]


def test_exchanged_axes_are_recognised(tmp_path, said):
    read_dem(tif(tmp_path / "d.tif", transform=from_origin(1_200_000.0, 2_600_000.0, 2, 2)), feedback=said)
    assert "its x and y are exchanged" in said.warnings[0]


@pytest.mark.parametrize(("place", "suggested"), [("Bern", "EPSG:2056"), ("Bern, LV03", "EPSG:21781")])
def test_the_crs_that_is_suggested_is_that_of_the_numbers(tmp_path, place, suggested):
    _, east, north = AT[place]
    path = tif(tmp_path / "d.tif", crs=None, transform=from_origin(east, north, 2, 2))
    with pytest.raises(UserError, match=f"has no CRS; name it, for example --crs {suggested}$"):
        read_dem(path)
    assert read_dem(path, crs=suggested).crs.to_epsg() == int(suggested[5:])


def test_no_swiss_crs_is_suggested_for_an_austrian_dem(tmp_path):
    path = tif(tmp_path / "d.tif", crs=None, transform=from_origin(79_000.0, 235_000.0, 2, 2))
    with pytest.raises(UserError, match="--crs EPSG:25832, with the code that its supplier states"):
        read_dem(path)


@pytest.mark.parametrize("cell", [1e-30, 5e-4, 5e4])
def test_cells_that_no_terrain_model_has_are_refused(tmp_path, cell):
    """Before: a forest of 1e-61 ha, and windows of 2e31 cells."""
    path = tmp_path / "dem.tif"
    profile = {"width": 9, "height": 9, "count": 1, "dtype": "float32", "crs": "EPSG:2056"}
    transform = from_origin(2_700_000.0, 1_190_000.0, cell, cell)
    with rasterio.open(path, "w", driver="GTiff", transform=transform, **profile) as out:
        out.write(np.linspace(900.0, 950.0, 81, dtype=np.float32).reshape(9, 9), 1)
    with pytest.raises(UserError, match="correct the cell size in its header"):
        read_dem(path)
