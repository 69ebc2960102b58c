"""The shapes of a table's rows: points from two columns of coordinates, or a column of geometries as text."""

from __future__ import annotations

import re
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely

from deadwood_algorithms.files.axes import Axes, axes_of
from deadwood_algorithms.files.columns import field_names, number_column, where_of
from deadwood_algorithms.files.crs import parse_crs
from deadwood_algorithms.params.tool import UserError

CURVES = re.compile(
    r"\s*(CIRCULARSTRING|COMPOUNDCURVE|CURVEPOLYGON|MULTICURVE|MULTISURFACE|CURVE|SURFACE)\b|.*\b"
    r"(CIRCULARSTRING|COMPOUNDCURVE|CURVEPOLYGON)\b",
    re.IGNORECASE | re.DOTALL,
)
# What databases write for a geometry: hexadecimal WKB, and text behind the code of its CRS
HEX, SRID = re.compile(r"\s*(?:\\x)?(?=0[01][0-9a-fA-F]{8})", re.ASCII), re.compile(r"\s*SRID=(\d+);", re.IGNORECASE)
WKT_NAMES = ("wkt", "wkt_geom", "geometry", "geom", "the_geom")  # columns that may hold shapes as text
RINGS_CLOSED = "rings that do not close were closed; check these polygons"


def shapes_of_table(frame: pd.DataFrame, what: str, fields: tuple[str | None, str | None] | None) -> gpd.GeoDataFrame:
    """Points from two columns of coordinates, otherwise the shapes in a column of well-known text."""
    where = where_of(frame)
    names = {str(column).strip().lower(): column for column in frame.columns}
    axes = axes_of(frame.columns)
    if fields:
        x, y = (names.get(str(each).lower()) for each in fields)
        asked = None if x is None or y is None else axes_of([x, y])
        axes = asked if asked and asked.x == x else Axes(x, y, (1.0, 1.0), False)
    text = next((names[name] for name in WKT_NAMES if name in names), None)
    if axes is None and text is not None and frame[text].dtype == object:
        return _shapes_of_text(frame, text, where)
    if axes is None or axes.x is None or axes.y is None:
        wanted = " and ".join(str(each) for each in fields) if fields else "x and y"
        fix = "" if fields else "; name them so, or name the columns with --x-field and --y-field of import-trees"
        raise UserError(
            f"{where}: the {what} table has no columns {wanted} with the coordinates; it has {field_names(frame)}{fix}"
        )
    x, y, factors, degrees = axes
    places = [number_column(frame, str(name)) * times for name, times in zip((x, y), factors, strict=True)]
    points = gpd.points_from_xy(places[0], places[1])
    kept = pd.DataFrame(frame.drop(columns=[x, y, "geometry"], errors="ignore"))
    own_crs = frame.crs if isinstance(frame, gpd.GeoDataFrame) else None
    return gpd.GeoDataFrame(kept, geometry=points, crs="EPSG:4326" if degrees else own_crs)


def _shapes_of_text(frame: pd.DataFrame, column: Any, where: str) -> gpd.GeoDataFrame:
    texts = [str(each) for each in frame[column]]
    curved = next((row for row, each in enumerate(texts) if CURVES.match(each)), None)
    if curved is not None:
        raise UserError(
            f"{where}, field '{column}', row {curved + 1}: '{texts[curved][:40]}' is a curve, which a table cannot "
            "give; give straight lines (in QGIS: Segmentize), or the layer as a GeoPackage"
        )
    if any(map(HEX.match, texts)):
        shapes = shapely.from_wkb([HEX.sub("", each) for each in texts], on_invalid="ignore")
        codes = {int(each) for each in shapely.get_srid(shapes[~shapely.is_missing(shapes)])}
    else:
        codes = {int((SRID.match(each) or [0, 0])[1]) for each in texts}
        texts = [SRID.sub("", each) for each in texts]
        shapes = shapely.from_wkt(texts, on_invalid="ignore")
        if (open_rings := shapely.is_missing(shapes)).any():
            shapes[open_rings] = shapely.from_wkt(np.array(texts, object)[open_rings], on_invalid="fix")
            if not shapely.is_missing(shapes[open_rings]).all():
                frame.attrs["notes"] = (*frame.attrs.get("notes", ()), RINGS_CLOSED)
    if shapely.is_missing(shapes).any():
        row = int(np.argmax(shapely.is_missing(shapes)))
        raise UserError(
            f"{where}, field '{column}', row {row + 1}: '{str(frame[column].iloc[row])[:40]}' is not a geometry as "
            "text (such as POINT (2600000 1200000)); in a database, ST_AsText(geom) writes it"
        )
    if len(codes) > 1:
        raise UserError(
            f"{where}, field '{column}': geometries of several CRS (SRID {sorted(codes)}); give one file each"
        )
    code = codes.pop()
    own_crs = parse_crs(f"EPSG:{code}", f"{where}, field '{column}': the SRID") if code else None
    return gpd.GeoDataFrame(pd.DataFrame(frame.drop(columns=[column])), geometry=shapes, crs=own_crs)
