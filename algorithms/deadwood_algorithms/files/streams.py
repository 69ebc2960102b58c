"""Layers written piece by piece, so that memory does not grow with their rows: into a GeoPackage, or as GeoParquet.

The result is the same as that of `vectors.write_vector` for all pieces joined.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as parquet
import pyogrio
import shapely

GEOMETRY, BBOX = "geometry", "bbox"
CORNERS = ("xmin", "ymin", "xmax", "ymax")  # of a geometry's bounding box, with which readers skip other areas
GEOPARQUET = "1.1.0"  # the version of its specification


@dataclass(frozen=True)
class Stream:
    """A layer in pieces of at least one row, over which one can iterate more than once; all have the same columns.

    geometry : the kind of its geometries, as GDAL calls it (``Point Z``); several with commas
    """

    geometry: str
    pieces: Callable[[], Iterator[gpd.GeoDataFrame]]

    @staticmethod
    def of(frame: gpd.GeoDataFrame) -> Stream:
        """A complete layer as one piece, with all its kinds of geometry."""
        kinds = sorted(set(frame.geometry.geom_type.dropna()))
        deep = " Z" if bool(frame.geometry.has_z.any()) else ""
        return Stream(",".join(kind + deep for kind in kinds), lambda: iter([frame]))

    @property
    def first(self) -> gpd.GeoDataFrame:
        return next(self.pieces())


def write_layer(path: Path, name: str, stream: Stream, **options: Any) -> None:
    """Add a layer to a GeoPackage."""
    first = stream.first
    schema = _schema(first)
    batches = pa.RecordBatchReader.from_batches(schema, (_batch(piece, schema) for piece in stream.pieces()))
    crs = None if first.crs is None else first.crs.to_wkt()
    if first.crs is not None and (authority := first.crs.to_authority()):
        crs = ":".join(authority)
    pyogrio.write_arrow(
        batches,
        path,
        layer=name,
        driver="GPKG",
        geometry_name=GEOMETRY,
        geometry_type=stream.geometry,
        crs=crs,
        **options,
    )


def write_geoparquet(path: Path, stream: Stream) -> None:
    """A file with the metadata required by GeoParquet (version 1.1), one row group per piece, and the bounding box of
    each geometry, which geopandas does not show but uses: ``read_parquet(path, bbox=...)``.
    """
    first = stream.first
    bounds = np.full(6, np.nan)
    plain = _schema(first)
    boxed = plain.append(pa.field(BBOX, pa.struct([(corner, pa.float64()) for corner in CORNERS])))
    with parquet.ParquetWriter(path, boxed, compression="zstd") as writer:
        for piece in stream.pieces():
            shapes = np.asarray(piece.geometry)
            xyz = shapely.get_coordinates(shapes, include_z=True)
            bounds[:3], bounds[3:] = np.fmin(bounds[:3], xyz.min(axis=0)), np.fmax(bounds[3:], xyz.max(axis=0))
            boxes = [pa.array(each) for each in shapely.bounds(shapes).T]
            columns = [*_batch(piece, plain).columns, pa.StructArray.from_arrays(boxes, CORNERS)]
            batch = pa.RecordBatch.from_arrays(columns, schema=boxed)
            writer.write_table(pa.Table.from_batches([batch]), row_group_size=batch.num_rows)
        writer.add_key_value_metadata({"geo": json.dumps(_geo(stream, first.crs, bounds))})


def _geo(stream: Stream, crs: Any, bounds: np.ndarray) -> dict[str, Any]:
    """The metadata of the geometries in a GeoParquet file."""
    kinds = stream.geometry.split(",")
    flat = not kinds[0].endswith(" Z")
    facts = {
        "encoding": "WKB",
        "geometry_types": kinds,
        "crs": json.loads(crs.to_json()) if crs is not None else None,
        "bbox": [float(each) for each in (bounds[[0, 1, 3, 4]] if flat else bounds)],
        "covering": {"bbox": {corner: [BBOX, corner] for corner in CORNERS}},
    }
    return {"version": GEOPARQUET, "primary_column": GEOMETRY, "columns": {GEOMETRY: facts}}


def _schema(frame: gpd.GeoDataFrame) -> pa.Schema:
    """The types of the columns, which a single piece cannot determine: a column without any text would have none."""
    columns = [(str(name), _kind(frame[name])) for name in frame.columns if name != frame.geometry.name]
    return pa.schema([*columns, (GEOMETRY, pa.binary())])


def _kind(column: Any) -> pa.DataType:
    return (
        pa.from_numpy_dtype(column.dtype)
        if isinstance(column.dtype, np.dtype) and column.dtype != object
        else pa.string()
    )


def _batch(frame: gpd.GeoDataFrame, schema: pa.Schema) -> pa.RecordBatch:
    arrays = [_array(frame[each.name], each.type) for each in schema if each.name != GEOMETRY]
    # ISO WKB, as GDAL and GeoParquet use it for heights.
    shapes = shapely.to_wkb(np.asarray(frame.geometry), flavor="iso")
    return pa.RecordBatch.from_arrays([*arrays, pa.array(shapes, pa.binary())], schema=schema)


def _array(column: Any, kind: pa.DataType) -> pa.Array:
    if kind != pa.string():
        return pa.array(column.to_numpy(), kind)
    return pa.array([None if pd.isna(each) else str(each) for each in column], kind)
