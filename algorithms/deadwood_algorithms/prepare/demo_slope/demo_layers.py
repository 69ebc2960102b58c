"""The sample slope as files: DEM, release area, forest, road, barriers. Nothing of it is measured (`slope`)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import geopandas
import shapely

from deadwood_algorithms.files.rasters import write_raster
from deadwood_algorithms.files.vectors import write_vector
from deadwood_algorithms.prepare.demo_slope import slope as sample_slope
from deadwood_algorithms.schemas.files import DEM


def write_sample(folder: Path) -> None:
    """Write the terrain model and every layer of the sample into an existing folder, one file each."""
    grid = sample_slope.terrain()
    write_raster(
        folder / "dem.tif",
        grid.values,
        grid,
        nodata=-9999.0,
        dtype="float32",
        units="m",
        style=DEM.look,
    )
    for name, layer, frame in sample_layers():
        write_vector(folder / f"{name}.gpkg", {layer: frame})


def sample_layers() -> list[tuple[str, str, geopandas.GeoDataFrame]]:
    """File name, layer name and content of each layer of the sample."""
    trees = sample_slope.forest()
    x, y = trees.pop("x"), trees.pop("y")
    barriers = sample_slope.barriers()
    return [
        ("release_area", "release_area", _frame({"release_id": [1]}, [sample_slope.release_circle()])),
        ("trees_mapped", "trees", _frame(trees, shapely.points(x, y))),
        ("forest", "forest", _frame({"name": ["forest"]}, [sample_slope.forest_area()])),
        ("road", "lines", _frame({"line_id": ["road"]}, [sample_slope.road()])),
        (
            "barriers",
            "barriers",
            _frame(
                {"barrier_id": [row[0] for row in barriers], "height_m": [row[1] for row in barriers]},
                [row[2] for row in barriers],
            ),
        ),
    ]


def layers_to_try() -> dict[str, geopandas.GeoDataFrame]:
    """Layers of the sample that the demo does not need, for the other tools."""
    rows = {"dams": sample_slope.dams(), "flights": sample_slope.flights(), "deadwood": sample_slope.deadwood()}
    return {name: geopandas.GeoDataFrame(each, crs=sample_slope.CRS_NAME) for name, each in rows.items()}


def _frame(columns: dict[str, Any], shapes: Any) -> geopandas.GeoDataFrame:
    return geopandas.GeoDataFrame(columns, geometry=shapes, crs=sample_slope.CRS_NAME)
