"""Inputs that are not files: pipes, devices, network addresses, and files that point to them; nothing hangs."""

from __future__ import annotations

import http.server
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import geopandas
import pyarrow as pa
import pyarrow.parquet as parquet
import pytest
import shapely
from slope_case import EAST, NORTH, points, write_dem, write_layer

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.inputs import refuse_missing
from deadwood_algorithms.files.network import ALLOWED
from deadwood_algorithms.files.rasters import is_raster
from deadwood_algorithms.files.vectors import read_table
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.scene.layers import read_lines
from deadwood_toolbox import cli
from deadwood_toolbox.environment import stay_offline

posix = pytest.mark.skipif(os.name != "posix", reason="pipes and devices of Unix")


@pytest.fixture(scope="module")
def served(tmp_path_factory) -> Iterator[tuple[str, list[str]]]:
    """A server of this machine with dem.tif and trees.geojson, and the list of the requests to it."""
    folder = tmp_path_factory.mktemp("served")
    write_dem(folder / "dem.tif")
    frame = geopandas.read_file(write_layer(folder / "t.gpkg", points((30, 80)), dbh_cm=[30.0], height_m=[20.0]))
    frame.to_crs(4326).to_file(folder / "trees.geojson")
    asked: list[str] = []

    class Handler(http.server.SimpleHTTPRequestHandler):
        def __init__(self, *arguments: Any, **options: Any) -> None:
            super().__init__(*arguments, directory=str(folder), **options)

        def log_message(self, format: str, *arguments: Any) -> None:
            asked.append(format % arguments)

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}", asked
    server.shutdown()


def raster_vrt(path: Path, source: str, relative: int = 0) -> str:
    path.write_text(
        f'<VRTDataset rasterXSize="60" rasterYSize="100"><SRS>EPSG:2056</SRS>'
        f"<GeoTransform>{EAST},1,0,{NORTH + 100},0,-1</GeoTransform>"
        '<Metadata><MDI key="see">https://example.org</MDI></Metadata><VRTRasterBand dataType="Float32" '
        f'band="1"><SimpleSource><SourceFilename relativeToVRT="{relative}">{source}</SourceFilename><SourceBand>1'
        "</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>"
    )
    return str(path)


def layer_vrt(path: Path, source: str) -> str:
    path.write_text(
        '<OGRVRTDataSource><OGRVRTLayer name="trees"><SrcDataSource relativeToVRT="0">'
        f"{source}</SrcDataSource></OGRVRTLayer></OGRVRTDataSource>"
    )
    return str(path)


def tool(folder: Path, dem: str, trees: str) -> list[str]:
    return ["import-trees", "--dem", dem, "--trees", trees, "--output", str(folder / "out.gpkg")]


@pytest.mark.parametrize("way", ["{}/", "/vsicurl/{}/", "/vsicurl?url={}/"])
def test_files_that_point_to_the_network_are_not_followed(tmp_path, served, capsys, monkeypatch, way):
    monkeypatch.delenv(ALLOWED, raising=False)
    address, asked = served
    asked.clear()
    dem, trees = write_dem(tmp_path / "dem.tif"), write_layer(tmp_path / "t.gpkg", points((3, 8)), dbh_cm=[30.0])
    far, away = way.format(address) + "dem.tif", way.format(address) + "trees.geojson"
    assert cli.run(tool(tmp_path, raster_vrt(tmp_path / "d.vrt", far), trees)) == 2
    assert f"points to the network ({far})" in capsys.readouterr().err
    nested = raster_vrt(tmp_path / "nested.vrt", "d.vrt", relative=1)
    assert cli.run(tool(tmp_path, nested, trees)) == 2
    assert f"nested.vrt: the DEM file points to the network ({far})" in capsys.readouterr().err
    assert cli.run(tool(tmp_path, dem, layer_vrt(tmp_path / "t.vrt", away))) == 2
    assert f"points to the network ({away}), which is not followed" in capsys.readouterr().err
    assert cli.run(tool(tmp_path, far, trees)) == 2
    assert "must be a file on this computer" in capsys.readouterr().err
    assert cli.run(tool(tmp_path, dem, away)) == 2
    assert "download it, and give the file" in capsys.readouterr().err
    with pytest.raises(UserError, match="points to the network"):
        is_raster(tmp_path / "d.vrt")
    assert asked == []


def test_the_user_may_allow_it(tmp_path, served, monkeypatch):
    """In a separate program: in this one GDAL has been set offline, which cannot be undone."""
    address, asked = served
    asked.clear()
    path = raster_vrt(tmp_path / "d.vrt", f"/vsicurl/{address}/dem.tif")
    trees = write_layer(tmp_path / "t.gpkg", points((30, 80)), dbh_cm=[30.0])
    clean = {k: v for k, v in os.environ.items() if k not in ("CPL_VSIL_CURL_ALLOWED_EXTENSIONS", "GDAL_HTTP_PROXY")}
    command = [sys.executable, "-c", "from deadwood_toolbox.cli import main; main()", *tool(tmp_path, path, trees)]
    done = subprocess.run(command, env=clean | {ALLOWED: "1"}, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert asked


def test_gdal_itself_is_kept_offline(served):
    """For references that cannot be found by reading a file."""
    address, asked = served
    asked.clear()
    code = "import rasterio, sys; rasterio.open(sys.argv[1]).read(1)"
    far = f"/vsicurl/{address}/dem.tif"
    environ = {k: v for k, v in os.environ.items() if k != ALLOWED}
    stay_offline(environ)
    done = subprocess.run([sys.executable, "-c", code, far], env=environ, capture_output=True, timeout=120)
    assert done.returncode != 0
    assert asked == []


def test_an_address_in_metadata_is_no_pointer(tmp_path):
    write_dem(tmp_path / "dem.tif")
    refuse_missing(raster_vrt(tmp_path / "d.vrt", "dem.tif", relative=1), "DEM")


@pytest.mark.parametrize(
    "content",
    [
        '<GDAL_WMS><Service name="TMS"><ServerUrl>x</ServerUrl></Service></GDAL_WMS>',
        "<WCS_GDAL><ServiceURL>y</ServiceURL></WCS_GDAL>",
        '<VRTDataset rasterXSize="1" rasterYSize="1"><VRTRasterBand><SimpleSource><SourceFilename>'
        "&lt;GDAL_WMS&gt;http://a/b&lt;/GDAL_WMS&gt;</SourceFilename></SimpleSource></VRTRasterBand></VRTDataset>",
        "<OGRVRTDataSource><OGRVRTLayer><SrcDataSource>PG:host=far</SrcDataSource></OGRVRTLayer></OGRVRTDataSource>",
    ],
)
def test_services_are_not_asked(tmp_path, content):
    (tmp_path / "d.xml").write_text(content)
    with pytest.raises(UserError, match="points to the network"):
        refuse_missing(tmp_path / "d.xml", "DEM")


SPECIAL = {"dem": "DEM", "trees": "single trees", "dbh-zones": "DBH zones", "dbh-sample": "sample of trees"}


@posix
@pytest.mark.parametrize("kind", ["pipe", "/dev/zero", "pipe.csv"])
@pytest.mark.parametrize("flag", SPECIAL)
def test_a_pipe_or_device_is_refused_at_once(tmp_path, flag, kind, capsys):
    given = {"dem": write_dem(tmp_path / "dem.tif")}
    given["trees"] = write_layer(tmp_path / "t.gpkg", points((30, 80)), dbh_cm=[30.0], height_m=[20.0])
    if kind.startswith("/"):
        given[flag] = kind
    else:
        os.mkfifo(tmp_path / kind)
        given[flag] = str(tmp_path / kind)
    flags = [word for name, path in given.items() for word in (f"--{name}", path)]
    assert cli.run(["import-trees", *flags, "--output", str(tmp_path / "out.gpkg")]) == 2
    assert f"this is a pipe or a device, but the {SPECIAL[flag]} must be a file" in capsys.readouterr().err


@posix
def test_pipes_behind_files_and_in_the_place_of_numbers(tmp_path, capsys):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(UserError, match="points to /dev/zero, which is a pipe or a device"):
        refuse_missing(raster_vrt(tmp_path / "d.vrt", "/dev/zero"), "DEM")
    run = ["slide-logs", "--dem", write_dem(tmp_path / "dem.tif"), "--output", str(tmp_path / "run")]
    run += ["--releases", write_layer(tmp_path / "r.gpkg", points((30, 80)))]
    for flag, value in (("--friction", "pipe"), ("--shape", "pipe"), ("--config", "pipe"), ("--config", "/dev/zero")):
        path = value if value.startswith("/") else str(tmp_path / value)
        friction = [] if flag == "--friction" else ["--friction", "0.3"]
        assert cli.run([*run, *friction, flag, path]) == 2, flag
        assert "a pipe or a device" in capsys.readouterr().err


def test_a_config_of_many_brackets(tmp_path, capsys):
    (tmp_path / "c.json").write_text("[" * 100_000 + "]" * 100_000)
    assert cli.run(["make-log", "--config", str(tmp_path / "c.json")]) == 2
    assert "nested too deep" in capsys.readouterr().err


def shapes_table(folder: Path, text: str) -> str:
    (folder / "lines.csv").write_text(f'line_id;wkt\n1;"{text}"\n')
    return str(folder / "lines.csv")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("CIRCULARSTRING (0 0, 1 1, 2 0)", "row 1: 'CIRCULARSTRING (0 0, 1 1, 2 0)' is a curve"),
        ("COMPOUNDCURVE (CIRCULARSTRING (0 0, 1 1, 2 0), (2 0, 3 0))", "is a curve"),
        ("MULTISURFACE (CURVEPOLYGON (CIRCULARSTRING (0 0, 4 0, 4 4, 0 4, 0 0)))", "is a curve"),
        ("GEOMETRYCOLLECTION (CIRCULARSTRING (0 0, 1 1, 2 0))", "is a curve"),
        ("TIN (((0 0, 1 0, 0 1, 0 0)))", "is not a geometry as text"),
        ("LINESTRING (1e300 0, 1 1)", "row 1: the position 1e+300, 0 is not on Earth"),
        ("LINESTRING (1e400 0, 1 1)", "coordinate is not a finite"),
    ],
)
def test_shapes_that_are_none(tmp_path, text, words, capsys):
    run = ["slide-logs", "--dem", write_dem(tmp_path / "dem.tif"), "--output", str(tmp_path / "run")]
    run += ["--releases", write_layer(tmp_path / "r.gpkg", points((30, 80))), "--friction", "0.3"]
    assert cli.run([*run, "--lines", shapes_table(tmp_path, text)]) == 2
    assert words in capsys.readouterr().err.splitlines()[-1]


def test_lines_with_heights_and_measures(tmp_path, said):
    grid = read_dem(write_dem(tmp_path / "dem.tif"))
    for kind in ("ZM", "M", "Z"):
        more = " 1 2" if kind == "ZM" else " 1"
        text = f"LINESTRING {kind} ({EAST + 5} {NORTH + 5}{more}, {EAST + 50} {NORTH + 5}{more})"
        marks, _ = read_lines(shapes_table(tmp_path, text), grid, said)
        assert marks.vertices.tolist() == [[EAST + 5, NORTH + 5], [EAST + 50, NORTH + 5]]
        frame = geopandas.GeoDataFrame(geometry=[shapely.from_wkt(text)], crs=2056)
        frame.to_parquet(tmp_path / "l.parquet")
        marks, _ = read_lines(str(tmp_path / "l.parquet"), grid, said)
        assert marks.vertices.shape == (2, 2)


def test_a_layer_larger_than_the_memory_is_refused_before_it_is_read(tmp_path, monkeypatch):
    path = write_layer(tmp_path / "r.gpkg", points((30, 80), (31, 80)))
    (tmp_path / "t.csv").write_text("x,y\n1,2\n")
    monkeypatch.setattr("deadwood_algorithms.files.vectors.free_bytes", lambda: 300)
    with pytest.raises(UserError, match="the 2 rows of the releases layer need .* of memory"):
        read_table(path, what="releases")
    monkeypatch.setattr("deadwood_algorithms.files.tables.free_bytes", lambda: 100)
    with pytest.raises(UserError, match="to read the releases table takes .* of memory"):
        read_table(tmp_path / "t.csv", what="releases")


def test_two_fields_of_one_name(tmp_path):
    wkb = shapely.to_wkb(shapely.Point(EAST, NORTH))
    meta = (
        b'{"version":"1.0.0","primary_column":"geometry","columns":{"geometry":{"encoding":"WKB","geometry_types":[]}}}'
    )
    made = pa.Table.from_arrays([pa.array([wkb]), pa.array([1.0]), pa.array([2.0])], names=["geometry", "a", "a"])
    parquet.write_table(made.replace_schema_metadata({b"geo": meta}), tmp_path / "t.parquet")
    with pytest.raises(UserError):
        read_table(tmp_path / "t.parquet", what="trees")
