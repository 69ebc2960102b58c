"""Inputs of formats that are not read in their role: the command in the message gives what is wanted."""

from __future__ import annotations

import shlex
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import rasterio
from rasterio.transform import from_origin
from remedied import carry_out

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.rasters import is_raster
from deadwood_algorithms.files.vectors import read_table, read_vector
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.tools import inspect, sample_releases, slide_logs

EAST, NORTH = 2_700_000.0, 1_200_000.0
HEIGHTS = (1000.0 + 0.7 * np.arange(60.0)[::-1, None] + 0.1 * np.arange(50.0)).astype("float32")


def raster(path: Path, bands: np.ndarray, driver: str = "GTiff", **facts: object) -> str:
    count, ny, nx = bands.shape
    place = from_origin(EAST, NORTH + ny, 1.0, 1.0)
    facts = {"width": nx, "height": ny, "count": count, "dtype": bands.dtype.name, "transform": place} | facts
    with rasterio.open(path, "w", driver=driver, crs="EPSG:2056", **facts) as made:
        made.write(bands)
    return str(path)


@pytest.fixture
def dem(tmp_path) -> str:
    return raster(tmp_path / "dem.tif", HEIGHTS[None])


@pytest.fixture
def cells(tmp_path) -> str:
    """A raster with two areas of weights, of 200 and 50 cells, and cells without data."""
    values = np.zeros((60, 50))
    values[5:15, 10:30], values[30:40, 40:45], values[50:, :5] = 2.5, 1.0, -9999.0
    return raster(tmp_path / "cells.tif", values[None], nodata=-9999.0)


def refused(tool, **values) -> str:
    with pytest.raises(UserError) as error:
        tool.TOOL(**values)
    return str(error.value)


def test_a_raster_of_areas_is_a_raster_of_weights_or_becomes_polygons(tmp_path, dem, cells):
    """The command's polygons have the area of the cells other than 0: 250 m2; logs stand in them and nowhere else."""
    output = str(tmp_path / "releases.gpkg")
    message = refused(sample_releases, areas=cells, dem=dem, output=output)
    assert f"--weights {cells}" in message
    sample_releases.TOOL(weights=cells, dem=dem, count=20, output=output)
    made = carry_out(message.partition("Polygonize): ")[2], tmp_path)
    polygons = read_vector(made, geometry=("polygon",), target_crs=read_dem(dem).crs, what="areas")
    assert sorted(polygons.area) == pytest.approx([50.0, 200.0], abs=0.1)
    assert len(gpd.read_file(output).sjoin(polygons.buffer(0.01).to_frame("geometry"))) == 20
    sample_releases.TOOL(areas=str(made), dem=dem, count=5, output=output, overwrite=True)
    assert len(gpd.read_file(output)) == 10


def test_a_raster_of_lines_becomes_polygons(tmp_path, dem, cells):
    releases = str(tmp_path / "releases.gpkg")
    sample_releases.TOOL(weights=cells, dem=dem, count=2, output=releases)
    values = {"dem": dem, "releases": releases, "friction": "0.3", "output": str(tmp_path / "run")}
    message = refused(slide_logs, **values, lines=cells)
    assert "--weights" not in message
    made = carry_out(message.partition("Polygonize): ")[2], tmp_path)
    assert read_vector(made, geometry=("line", "polygon"), target_crs=read_dem(dem).crs).area.sum() == pytest.approx(
        250.0, abs=0.1
    )
    assert refused(slide_logs, **values, trees=cells).endswith(
        f"find-trees makes trees of a canopy model: --chm {cells}"
    )
    assert refused(slide_logs, **values, barriers=cells).endswith("must be a layer of lines")
    assert "Polygonize" in refused(inspect, path=cells, as_="areas")


@pytest.mark.parametrize("role", ["dem", None])
def test_heights_as_colours(tmp_path, role):
    """Terrain-RGB stores tenths of a metre above -10 000 m in three bytes."""
    code = np.rint((HEIGHTS.astype(float) + 10_000.0) * 10.0).astype(np.int64)
    picture = raster(tmp_path / "rgb.png", np.stack([code >> 16, code >> 8 & 255, code & 255]).astype("uint8"), "PNG")
    made = carry_out(refused(inspect, path=picture, as_=role), tmp_path)
    with rasterio.open(made) as source:
        assert np.abs(source.read(1) - HEIGHTS).max() <= 0.051  # half a step, and float32


def test_a_photograph_is_not_said_to_hold_heights(tmp_path):
    noise = np.random.default_rng(0).integers(0, 256, (3, 60, 50)).astype("uint8")
    assert refused(inspect, path=raster(tmp_path / "a.png", noise, "PNG"), as_="dem").count("picture, not a DEM") == 1
    assert "Terrain-RGB" not in refused(inspect, path=str(tmp_path / "a.png"), as_="dem")


def test_a_zarr_store_is_written_out(tmp_path):
    with rasterio.Env() as environment:
        if "Zarr" not in environment.drivers():
            pytest.skip("this GDAL has no Zarr")
    profile = {"driver": "Zarr", "width": 50, "height": 60, "count": 1, "dtype": "float32", "crs": "EPSG:2056"}
    with rasterio.open(tmp_path / "a.zarr", "w", transform=from_origin(EAST, NORTH + 60, 1.0, 1.0), **profile) as made:
        made.write(HEIGHTS, 1)
    with rasterio.open(carry_out(refused(inspect, path=str(tmp_path / "a.zarr")), tmp_path)) as source:
        assert np.array_equal(source.read(1), HEIGHTS)


def test_parts_of_a_saga_grid(tmp_path):
    values = raster(tmp_path / "a.sdat", HEIGHTS[None], "SAGA")
    header = str(tmp_path / "a.sgrd")
    assert f"give its values, {values}, as the raster" in refused(inspect, path=header)
    assert read_dem(values, crs="EPSG:2056").shape == (60, 50)
    Path(header).unlink()
    assert "part a.sgrd is missing" in refused(inspect, path=values, as_="dem")


@pytest.mark.parametrize("read", [lambda path: read_table(path, what="trees"), read_dem, is_raster])
def test_a_point_cloud(tmp_path, read):
    (tmp_path / "a b.laz").write_bytes(b"LASF")
    with pytest.raises(UserError, match=r"a point cloud, .* pdal translate") as error:
        read(str(tmp_path / "a b.laz"))
    words = shlex.split(str(error.value).partition(": pdal ")[2])
    assert words[:4] == ["translate", str(tmp_path / "a b.laz"), "a b_ground.tif", "filters.range"]
    assert words[4] == "--filters.range.limits=Classification[2:2]"


@pytest.mark.parametrize("source", ["PG:host=far dbname=forest", "postgresql://me@far/forest"])
@pytest.mark.parametrize("read", [lambda path: read_table(path, what="trees"), read_dem])
def test_a_database(source, read):
    with pytest.raises(UserError, match="not a database") as error:
        read(source)
    words = shlex.split(str(error.value).partition(": ogr2ogr ")[2])
    assert (words[0], words[1], words[3], words[4]) == ("-f", "GPKG", source, "TABLE")
    assert words[2].endswith(".gpkg")
