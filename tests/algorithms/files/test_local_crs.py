"""Local metres of a local site: with `--crs local`, from releases to the evaluation of a run, and never by mistake."""

from __future__ import annotations

import geopandas
import numpy as np
import pytest
import rasterio
from rasterio.transform import from_origin
from shapely import Point

from deadwood_algorithms.files.crs import LOCAL_CRS, is_local, parse_crs, same_crs
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.tools import count_hits, import_trees, sample_releases, slide_logs

SITE = 'LOCAL_CS["site grid",UNIT["metre",1],AXIS["Easting",EAST],AXIS["Northing",NORTH]]'


def dem(path, crs) -> str:
    heights = (200.0 - 0.3 * np.arange(60)[:, None] * np.ones((1, 60))).astype(np.float32)
    profile = {"width": 60, "height": 60, "count": 1, "dtype": "float32", "crs": crs, "nodata": -9999}
    with rasterio.open(path, "w", driver="GTiff", transform=from_origin(100.0, 200.0, 1.0, 1.0), **profile) as out:
        out.write(heights, 1)
    return str(path)


def areas(path, crs=None) -> str:
    geopandas.GeoDataFrame({"release_id": ["a"]}, geometry=[Point(130.0, 170.0)], crs=crs).to_file(path)
    return str(path)


@pytest.mark.parametrize("crs", [None, SITE], ids=["none", "its own"])
def test_a_run_in_local_metres_and_what_follows_it(tmp_path, crs):
    terrain = dem(tmp_path / "dem.tif", crs)
    releases, run = str(tmp_path / "releases.gpkg"), tmp_path / "run"
    common = {"dem": terrain, "crs": "local"}
    sample_releases.TOOL(areas=areas(tmp_path / "a.gpkg"), count=5, radius_m=3.0, output=releases, **common)
    slide_logs.TOOL(releases=releases, friction=0.5, fidelity="draft", trajectories="all", output=str(run), **common)
    deposits = geopandas.read_file(run / "run.gpkg", layer="deposits")
    assert is_local(deposits.crs)
    assert deposits.geometry.x.between(100, 160).all()
    count_hits.TOOL(run=str(run), cell_m=2.0, output=str(tmp_path / "hits.tif"))
    with rasterio.open(tmp_path / "hits.tif") as hits:
        assert same_crs(parse_crs(hits.crs.to_wkt()), LOCAL_CRS)
        assert hits.read(1).max() >= 1


def test_a_local_terrain_without_the_word_is_refused_with_it(tmp_path):
    with pytest.raises(UserError, match="or --crs local, which takes its coordinates as metres"):
        sample_releases.TOOL(
            areas=areas(tmp_path / "a.gpkg"),
            dem=dem(tmp_path / "d.tif", SITE),
            count=5,
            output=str(tmp_path / "r.gpkg"),
        )


def test_nothing_is_converted_between_a_site_and_the_globe(tmp_path):
    terrain = dem(tmp_path / "dem.tif", None)
    for crs in ("EPSG:2056", "EPSG:4326"):
        with pytest.raises(UserError, match="local"):
            sample_releases.TOOL(
                areas=areas(tmp_path / f"{crs[5:]}.gpkg", crs),
                dem=terrain,
                crs="local",
                count=5,
                output=str(tmp_path / "r.gpkg"),
            )


def test_a_table_of_local_places_is_imported(tmp_path):
    table = tmp_path / "trees.csv"
    table.write_text("x,y,dbh_cm,height_m\n120,180,30,20\n140,170,40,25\n")
    import_trees.TOOL(trees=str(table), dem=dem(tmp_path / "d.tif", None), crs="local", output=str(tmp_path / "t.gpkg"))
    trees = geopandas.read_file(tmp_path / "t.gpkg")
    assert trees.geometry.x.tolist() == [120.0, 140.0]
    assert is_local(trees.crs)
