"""A layer written piece by piece equals the layer written at once."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyarrow.parquet as parquet
import pyogrio
import pytest
import shapely
from slope_case import Case, layer

from deadwood_algorithms.files.streams import Stream, write_geoparquet
from deadwood_algorithms.files.vectors import read_vector, write_vector
from deadwood_algorithms.results import trajectories, writing
from deadwood_algorithms.results.run_folder import layers_in


def frame(lines: bool, flat: bool) -> gpd.GeoDataFrame:
    rng = np.random.default_rng(1)
    n = 25
    ends = rng.random((n, 2, 2 if flat else 3)) * 100.0 + 2_700_000.0
    columns = {
        "log_id": np.arange(n) * 2**33,
        "name": np.array([None if k < 12 else f"Tännli {k}" for k in range(n)], object),  # whole pieces without any
        "share": np.where(np.arange(n) % 3, rng.random(n), np.nan),
        "count": np.arange(n, dtype=np.int32),
        "single": rng.random(n).astype(np.float32),
        "kept": np.arange(n) % 2 == 0,
    }
    return gpd.GeoDataFrame(
        columns, geometry=shapely.linestrings(ends) if lines else shapely.points(ends[:, 0]), crs=2056
    )


def in_pieces(whole: gpd.GeoDataFrame, rows: int) -> Stream:
    kind = whole.geometry.geom_type.iloc[0] + (" Z" if whole.has_z.any() else "")
    return Stream(kind, lambda: (whole.iloc[k : k + rows] for k in range(0, len(whole), rows)))


@pytest.mark.parametrize("lines", [False, True])
@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("rows", [7, 100])
def test_pieces_make_the_same_layer(tmp_path, lines, flat, rows):
    """In a GeoPackage the same types, rows and styles, with one piece the same bytes; the same rows in a GeoParquet."""
    whole = frame(lines, flat)
    other = in_pieces(whole, rows)
    write_vector(tmp_path / "a.gpkg", {"deposits": whole, "more": whole})
    write_vector(tmp_path / "b.gpkg", {"deposits": other, "more": other})
    if rows > len(whole):
        assert (tmp_path / "a.gpkg").read_bytes() == (tmp_path / "b.gpkg").read_bytes()
    for name in ("deposits", "more", "layer_styles"):
        one, two = (pyogrio.read_dataframe(tmp_path / f"{each}.gpkg", layer=name) for each in "ab")
        pd.testing.assert_frame_equal(pd.DataFrame(one), pd.DataFrame(two), check_exact=True)
        told = [pyogrio.read_info(tmp_path / f"{each}.gpkg", layer=name) for each in "ab"]
        for fact in ("dtypes", "geometry_type", "crs"):
            assert str(told[0][fact]) == str(told[1][fact])
    write_geoparquet(tmp_path / "b.parquet", other)
    found = gpd.read_parquet(tmp_path / "b.parquet")
    assert found.crs == whole.crs
    assert found.geometry.to_wkb().equals(whole.geometry.to_wkb())
    pd.testing.assert_frame_equal(
        pd.DataFrame(found.drop(columns="geometry")), pd.DataFrame(whole.drop(columns="geometry")), check_exact=True
    )
    facts = json.loads(parquet.read_metadata(tmp_path / "b.parquet").metadata[b"geo"])
    of_shapes = facts["columns"][facts["primary_column"]]
    assert of_shapes["geometry_types"] == [other.geometry]
    whole_bounds = shapely.get_coordinates(whole.geometry.to_numpy(), include_z=not flat)
    assert of_shapes["bbox"] == [*whole_bounds.min(axis=0), *whole_bounds.max(axis=0)]
    assert parquet.ParquetFile(tmp_path / "b.parquet").num_row_groups == -(-len(whole) // rows)
    boxes = parquet.read_table(tmp_path / "b.parquet", columns=["bbox"]).to_pandas()["bbox"]
    corners = list(of_shapes["covering"]["bbox"])
    assert [[each[corner] for corner in corners] for each in boxes] == whole.bounds.to_numpy().tolist()
    west, south, east, north = whole.geometry.iloc[3].bounds
    inside = gpd.read_parquet(tmp_path / "b.parquet", bbox=(west, south, east, north))
    near = whole[whole.intersects(shapely.box(west, south, east, north).envelope)]
    assert set(near["log_id"]) <= set(inside["log_id"])
    assert 0 < len(inside) < len(whole)


@pytest.mark.parametrize("changes", [{}, {"until_ci": 0.4}, {"trajectories": "5"}])
def test_a_run_has_its_layers_as_geoparquet(tmp_path, monkeypatch, changes):
    """In small pieces, in the order of the releases although slid in another order; also read by our own tools."""
    case = Case(tmp_path)
    whole = case.run(**case.everything(), **changes, output=str(tmp_path / "whole"))
    assert not list(whole.glob("deposits.parquet"))
    monkeypatch.setattr(writing, "PIECE", 7)
    monkeypatch.setattr(trajectories, "PATHS_PIECE", 3)
    run = case.run(**case.everything(), **changes, geoparquet=True)
    for name in layers_in(whole) - {"layer_styles"}:
        one, two = layer(whole, name), layer(run, name)
        pd.testing.assert_frame_equal(pd.DataFrame(one), pd.DataFrame(two), check_exact=True)
        found = gpd.read_parquet(run / f"{name}.parquet")
        assert list(found.columns) == list(one.columns)
        assert found.geometry.to_wkb().equals(one.geometry.to_wkb())
        for column in found.columns.drop("geometry"):
            values = [[None if pd.isna(each) else each for each in of[column]] for of in (found, one)]
            assert values[0] == values[1]
    assert read_vector(run / "deposits.parquet", target_crs=None, what="deposits").crs.to_epsg() == 2056


def test_the_validator_of_geoparquet_finds_nothing(tmp_path):
    """Core, the boxes as a covering, and distribution; where it is installed (extra ``test``)."""
    validator = shutil.which(
        "geoparquet-validator", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    )
    if validator is None:
        pytest.skip("there is no geoparquet-validator")
    case = Case(tmp_path)
    run = case.run(**case.everything(), geoparquet=True)
    files = [run / f"{name}.parquet" for name in layers_in(run) - {"layer_styles"}]
    assert len(files) >= 6
    for each in files:
        told = subprocess.run([validator, "check", str(each)], capture_output=True, text=True)
        assert told.returncode == 0, told.stdout
        assert "covering: 6 pass, 0 fail" in told.stdout
        assert "core: " in told.stdout
