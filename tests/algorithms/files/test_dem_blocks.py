"""A large DEM that is read block by block answers as the whole does, and so do the tools that read it so."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import pytest
import rasterio
from rasterio.transform import from_origin
from shapely import Polygon

from deadwood_algorithms.files import dem_blocks, squares
from deadwood_algorithms.files.dem_windows import open_windows, read_dem
from deadwood_algorithms.files.grid import Part
from deadwood_algorithms.params.tool import Quiet
from deadwood_algorithms.prepare.releases import weights
from deadwood_algorithms.tools import generate_forest, import_trees, sample_releases, windthrow

EAST, NORTH, ROWS, COLUMNS = 2_700_000.0, 1_180_000.0, 90, 70
CRS = "EPSG:2056"


@pytest.fixture
def dem(tmp_path) -> str:
    """A slope of 0.6 with bumps and a hole of nodata, cells of 1 m."""
    y, x = np.mgrid[0:ROWS, 0:COLUMNS].astype(float)
    z = 900.0 + 0.6 * (ROWS - y) + np.sin(x / 5.0) * np.cos(y / 7.0)
    z[30:34, 40:47] = -9999.0
    path = tmp_path / "dem.tif"
    profile = {"width": COLUMNS, "height": ROWS, "count": 1, "dtype": "float32", "nodata": -9999.0, "crs": CRS}
    with rasterio.open(path, "w", driver="GTiff", transform=from_origin(EAST, NORTH, 1.0, 1.0), **profile) as out:
        out.write(z.astype(np.float32), 1)
    return str(path)


@pytest.fixture
def small_blocks(monkeypatch) -> None:
    monkeypatch.setattr(dem_blocks, "WHOLE_CELLS", 0)
    monkeypatch.setattr(squares, "SIDE", 16)
    monkeypatch.setattr(dem_blocks, "KEPT", 3)
    monkeypatch.setattr(weights, "STRIP_ROWS", 8)
    monkeypatch.setattr(weights, "STRIP_CELLS", 500)


def test_heights_and_what_is_outside_are_those_of_the_whole(dem):
    """Also on the seams between blocks, at cell centres, beside nodata and beyond the DEM."""
    whole, rng = read_dem(dem), np.random.default_rng(5)
    x = EAST + np.concatenate([rng.uniform(-5, COLUMNS + 5, 4000), np.arange(COLUMNS) + 0.5, np.full(99, 16.5)])
    y = NORTH - ROWS + np.concatenate([rng.uniform(-5, ROWS + 5, 4000), np.full(COLUMNS, 16.5), np.arange(99) - 4.5])
    with open_windows(dem, crs=None, feedback=Quiet(), look_through=False) as windows:
        blocks = dem_blocks.DemBlocks(windows, Quiet())
        np.testing.assert_array_equal(blocks.height(x, y), whole.height(x, y))
        np.testing.assert_array_equal(blocks.contains(x, y), whole.contains(x, y))
        assert 0.5 < whole.contains(x, y).mean() < 0.95


@pytest.mark.usefixtures("small_blocks")
def test_small_blocks_too_and_few_are_kept(dem):
    whole, rng = read_dem(dem), np.random.default_rng(6)
    x, y = EAST + rng.uniform(-5, COLUMNS + 5, 4000), NORTH - rng.uniform(-5, ROWS + 5, 4000)
    with dem_blocks.open_ground(dem, crs=None, feedback=Quiet()) as blocks:
        assert isinstance(blocks, dem_blocks.DemBlocks)
        np.testing.assert_array_equal(blocks.height(x, y), whole.height(x, y))
        assert len(blocks._blocks) <= 3


def test_a_part_is_cut_from_the_whole(dem):
    whole = read_dem(dem)
    with open_windows(dem, crs=None, feedback=Quiet(), look_through=False) as windows:
        part = dem_blocks.DemBlocks(windows, Quiet()).read(Part(20, 25, 30, 40))
    assert part.shape == (40, 30)
    np.testing.assert_array_equal(part.values, whole.values[part.part.slices])
    np.testing.assert_array_equal(part.values, whole.read(Part(20, 25, 30, 40)).values)


def drawn(folder: Path, dem: str) -> dict[str, Any]:
    """What the four tools make of the DEM."""
    folder.mkdir()
    corners = [(10, 15), (38, 12), (36, 70), (15, 66)]
    area = Polygon([(EAST + x, NORTH - y) for x, y in corners])
    areas = str(folder / "areas.gpkg")
    geopandas.GeoDataFrame({"release_id": ["a"]}, geometry=[area], crs=CRS).to_file(areas)
    with rasterio.open(dem) as source:
        profile, values = source.profile, source.read(1)
    density = str(folder / "weights.tif")
    with rasterio.open(density, "w", **profile) as out:
        out.write(np.where(values > 0, np.abs(np.sin(values)), -9999.0).astype(np.float32), 1)
    sample_releases.TOOL(areas=areas, dem=dem, count=60, output=str(folder / "plain.gpkg"))
    sample_releases.TOOL(areas=areas, dem=dem, count=60, weights=density, output=str(folder / "weighted.gpkg"))
    sample_releases.TOOL(dem=dem, count=60, weights=density, output=str(folder / "anywhere.gpkg"))
    generate_forest.TOOL(
        dem=dem, stand=areas, stems_per_ha=300.0, dbh_mean_cm=30.0, dbh_sd_cm=8.0, output=str(folder / "forest.gpkg")
    )
    sizes: dict[str, Any] = {"dbh_mean_cm": 30.0, "dbh_sd_cm": 8.0, "dem": dem}
    generate_forest.TOOL(**sizes, stems_per_ha=200.0, output=str(folder / "everywhere.gpkg"))
    generate_forest.TOOL(**sizes, stems_per_ha=200.0, exclude=areas, output=str(folder / "around.gpkg"))
    import_trees.TOOL(trees=str(folder / "forest.gpkg"), dem=dem, output=str(folder / "trees.gpkg"))
    windthrow.TOOL(trees=str(folder / "trees.gpkg"), dem=dem, share=0.5, fall_deg=90.0, output=str(folder / "storm"))
    found = {path.stem: geopandas.read_file(path) for path in sorted(folder.glob("*.gpkg")) if path.stem != "areas"}
    return found | {path.stem: geopandas.read_file(path) for path in sorted((folder / "storm").glob("*.gpkg"))}


def test_tools_draw_the_same_from_blocks(dem, tmp_path, request):
    whole = drawn(tmp_path / "whole", dem)
    request.getfixturevalue("small_blocks")
    blocks = drawn(tmp_path / "blocks", dem)
    assert len(whole) >= 9
    for name, frame in whole.items():
        assert frame.geometry.to_wkb().tolist() == blocks[name].geometry.to_wkb().tolist(), name
        assert frame.drop(columns="geometry").equals(blocks[name].drop(columns="geometry")), name
