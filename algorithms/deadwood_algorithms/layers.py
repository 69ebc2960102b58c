"""Layers in and out: the one name under which tools open files.

Rasters, text tables and the all-or-nothing outputs have a file of their own each (`rasters`, `tables`, `outputs`); they
are imported from here, so that a tool knows this name alone. This file reads and writes vector layers.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pyproj
import shapely
from deadwood_algorithms import schemas
from deadwood_algorithms.outputs import output_folder, output_path
from deadwood_algorithms.rasters import (
    Grid,
    crs_name,
    horizontal,
    parse_crs,
    read_dem,
    read_raster_on,
    refuse_missing,
    same_crs,
    write_raster,
)
from deadwood_algorithms.tables import is_text_table, read_text_table
from deadwood_algorithms.tool import Feedback, Quiet, UserError

__all__ = [
    "Grid",
    "number_column",
    "output_folder",
    "output_path",
    "read_dem",
    "read_raster_on",
    "read_table",
    "read_vector",
    "where_of",
    "write_raster",
    "write_vector",
]

KINDS = {
    "Point": "point",
    "MultiPoint": "point",
    "LineString": "line",
    "LinearRing": "line",
    "MultiLineString": "line",
    "Polygon": "polygon",
    "MultiPolygon": "polygon",
}
X_NAMES = (
    "x",
    "easting",
    "east",
    "e",
    "x_coord",
    "xcoord",
    "coord_x",
    "rechtswert",
    "tree_x",
    "x_tree",
    "lon",
    "longitude",
)
Y_NAMES = (
    "y",
    "northing",
    "north",
    "n",
    "y_coord",
    "ycoord",
    "coord_y",
    "hochwert",
    "tree_y",
    "y_tree",
    "lat",
    "latitude",
)
DEGREE_NAMES = ("lon", "longitude", "lat", "latitude")


def read_vector(
    path: str | Path,
    *,
    geometry: Sequence[str] = ("point",),
    target_crs: pyproj.CRS | None,
    crs: str | None = None,
    what: str = "releases",
    feedback: Feedback | None = None,
) -> gpd.GeoDataFrame:
    """Read a layer of points, lines or polygons in ``target_crs``; rows 0..n-1, each with a valid geometry.

    Parameters
    ----------
    path : path
        Any vector format, or a text table with x and y columns; ``file.gpkg|layername=trees`` names one
        of several layers.
    geometry : sequence of str
        Which of ``point``, ``line`` and ``polygon`` are welcome. Points come as Point, lines as LineString (a layer
        whose feature has several parts: MultiLineString), polygons as Polygon or MultiPolygon.
    target_crs : pyproj.CRS or None
        Mostly ``grid.crs``. None keeps the layer's own CRS, which it must then have, or ``crs`` must name.
    crs : str, optional
        CRS of a layer that names none; without it such a layer is taken to be in ``target_crs``.
    what : str
        What the layer is to the tool: a name of `schemas.LAYERS` or any word for messages. Columns cut short by the
        shapefile format, or in another letter case, get the name of that schema back.
    """
    feedback = feedback or Quiet()
    frame = read_table(path, what=what)
    where = where_of(frame)
    if not isinstance(frame, gpd.GeoDataFrame):
        frame = _points_of_table(frame, what)
    if frame.empty:
        raise UserError(f"{where}: the {what} layer is empty (no feature)")
    frame.geometry = _welcome(frame.geometry, geometry, what, where, feedback)
    frame = _in_crs(frame, target_crs, crs, what, where, feedback)
    frame = _schema_names(frame, what, where, feedback)
    frame.attrs["where"] = where
    return frame


def read_table(path: str | Path, *, what: str) -> pd.DataFrame:
    """Read the rows of a text table or vector layer as they are: a GeoDataFrame where the file holds geometries."""
    name, _, layer = str(path).partition("|layername=")
    if is_text_table(name) and not layer:
        frame: pd.DataFrame = read_text_table(name, what)
        frame.attrs["where"] = name
        return frame
    refuse_missing(name, what)
    try:
        layer = _layer_of(name, layer, what)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of M values and curves, which are dropped and straightened
            frame = pyogrio.read_dataframe(name, layer=layer)
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, pyogrio.errors.FeatureError) as error:
        reason = str(error).split(";")[0].splitlines()[0]
        raise UserError(f"{name}: the {what} file is no vector layer that can be read ({reason})") from error
    if "geometry" in frame and not isinstance(frame, gpd.GeoDataFrame):
        frame = gpd.GeoDataFrame(frame, geometry="geometry")
    single = Path(name).suffix.lower() not in (".gpkg", ".gdb", ".sqlite", ".kml", ".gpx")
    frame = frame.reset_index(drop=True)
    frame.attrs["where"] = name if single else f"{name}, layer '{layer}'"
    return frame


def where_of(frame: pd.DataFrame) -> str:
    """How messages name the file and layer of a frame that was read here."""
    return str(frame.attrs.get("where", "layer"))


def number_column(
    frame: pd.DataFrame,
    name: str,
    *,
    where: str | None = None,
    default: float | None = None,
    minimum: float | None = None,
    exclusive: bool = False,
    maximum: float | None = None,
) -> np.ndarray:
    """A column as float64, every value finite and within bounds; a missing column takes ``default`` when there is one.

    An empty cell in a column that exists is refused: a gap in somebody's data is not a wish for the default.
    """
    where = where or where_of(frame)
    if name not in frame:
        if default is not None:
            return np.full(len(frame), float(default))
        raise UserError(f"{where}: the field '{name}' is missing; it has {_field_names(frame)}")
    column = frame[name]
    numbers = pd.to_numeric(column, errors="coerce").to_numpy(np.float64, na_value=np.nan)
    bad = ~np.isfinite(numbers)
    if minimum is not None:
        bad |= (numbers <= minimum) if exclusive else (numbers < minimum)
    if maximum is not None:
        bad |= numbers > maximum
    if bad.any():
        row = int(np.argmax(bad))
        raise UserError(
            f"{where}, field '{name}', row {row + 1}: {_complaint(column.iloc[row], minimum, exclusive, maximum)}"
        )
    return numbers


def write_vector(path: str | Path, layers: Mapping[str, gpd.GeoDataFrame]) -> None:
    """Write a GeoPackage 1.2 with these layers; same input, same bytes (its time stamps are a fixed day)."""
    if Path(path).suffix.lower() != ".gpkg":
        raise UserError(f"{path}: the output must be a .gpkg file; name it {Path(path).with_suffix('.gpkg')}")
    pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": "2000-01-01T00:00:00.000Z"})
    try:
        for name, frame in layers.items():
            kinds = set(frame.geometry.geom_type.dropna())
            kind = kinds.pop() if len(kinds) == 1 else "Unknown"
            kind += " Z" if kind != "Unknown" and bool(frame.geometry.has_z.any()) else ""
            pyogrio.write_dataframe(
                frame,
                path,
                layer=name,
                driver="GPKG",
                geometry_type=kind,
                dataset_options={"VERSION": "1.2"},
                layer_options={"GEOMETRY_NAME": "geom", "FID": "fid"},
            )
    finally:
        pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": None})


def _layer_of(name: str, layer: str, what: str) -> str:
    """The layer that is meant: the one named, else the only one with geometry, else the only one."""
    found = pyogrio.list_layers(name)
    names = [str(each) for each in found[:, 0]]
    if layer:
        if layer not in names:
            raise UserError(f"{name}: there is no layer '{layer}'; it has {', '.join(names)}")
        return layer
    spatial = [str(each) for each, kind in found if kind is not None]
    candidates = spatial or names
    if not candidates:
        raise UserError(f"{name}: the {what} file holds no layer")
    if len(candidates) > 1:
        raise UserError(
            f"{name}: the {what} file holds several layers ({', '.join(candidates)}); "
            f"name one: '{name}|layername={candidates[0]}'"
        )
    return candidates[0]


def _points_of_table(frame: pd.DataFrame, what: str) -> gpd.GeoDataFrame:
    where = where_of(frame)
    names = {str(column).strip().lower(): column for column in frame.columns}
    x = next((names[each] for each in X_NAMES if each in names), None)
    y = next((names[each] for each in Y_NAMES if each in names), None)
    if x is None or y is None:
        raise UserError(
            f"{where}: the {what} table has no geometry and no columns x and y; it has {_field_names(frame)}; "
            "rename the columns with the coordinates"
        )
    degrees = str(x).strip().lower() in DEGREE_NAMES and str(y).strip().lower() in DEGREE_NAMES
    points = gpd.points_from_xy(number_column(frame, x), number_column(frame, y))
    return gpd.GeoDataFrame(frame.drop(columns=[x, y]), geometry=points, crs="EPSG:4326" if degrees else None)


def _welcome(shapes: gpd.GeoSeries, kinds: Sequence[str], what: str, where: str, feedback: Feedback) -> gpd.GeoSeries:
    """The geometries as the tool wants them, or the first row that is not of that kind."""
    array = np.asarray(shapes.array)
    bad = shapely.is_missing(array) | shapely.is_empty(array)
    if bad.any():
        raise UserError(f"{where}, row {int(np.argmax(bad)) + 1}: the geometry is empty; delete the row or draw it")
    single = (shapely.get_type_id(array) >= 4) & (shapely.get_num_geometries(array) == 1)
    array = np.where(single, shapely.get_geometry(array, 0), array)
    for row, shape in enumerate(array):
        kind = KINDS.get(shape.geom_type)
        if kind not in kinds or shape.geom_type == "MultiPoint":
            mend = "; split it: 'Multipart to singleparts'" if shape.geom_type.startswith("Multi") else ""
            raise UserError(
                f"{where}, row {row + 1}: a {shape.geom_type}, but the {what} must be {' or '.join(kinds)}s{mend}"
            )
    if not np.isfinite(shapely.get_coordinates(array)).all():
        owners = shapely.get_coordinates(array, return_index=True)
        row = int(owners[1][~np.isfinite(owners[0]).all(axis=1)][0])
        raise UserError(f"{where}, row {row + 1}: a coordinate is not a finite number")
    crossed = ~shapely.is_valid(array) & (shapely.get_dimensions(array) == 2)
    if crossed.any():
        array[crossed] = [_polygons_of(shapely.make_valid(each)) for each in array[crossed]]
        feedback.note(f"{where}: {int(crossed.sum())} polygons cross themselves and were mended")
        if shapely.is_empty(array).any():
            raise UserError(f"{where}, row {int(np.argmax(shapely.is_empty(array))) + 1}: the polygon has no area")
    return gpd.GeoSeries(array, index=shapes.index, crs=shapes.crs)


def _polygons_of(shape: Any) -> Any:
    parts = [part for part in shapely.get_parts(shape) if part.geom_type in ("Polygon", "MultiPolygon")]
    return shapely.union_all(parts)


def _in_crs(
    frame: gpd.GeoDataFrame, target: pyproj.CRS | None, given: str | None, what: str, where: str, feedback: Feedback
) -> gpd.GeoDataFrame:
    named = parse_crs(given) if given else None
    if frame.crs is None:
        if named is None and target is None:
            raise UserError(f"{where}: the {what} layer has no CRS; name it, for example --crs EPSG:2056")
        own = named or target
        assert own is not None
        source = "taken from --crs" if named else "the DEM's, is taken"
        feedback.note(f"{where}: the {what} layer has no CRS; {crs_name(own)}, {source}")
        frame = frame.set_crs(horizontal(own))
    if target is None:
        return frame
    if same_crs(frame.crs, target):
        return frame.set_crs(horizontal(target), allow_override=True)
    feedback.note(
        f"{where}: the {what} layer is reprojected from {crs_name(frame.crs)} to {crs_name(horizontal(target))}"
    )
    moved = frame.to_crs(horizontal(target))
    coordinates, owner = shapely.get_coordinates(np.asarray(moved.geometry.array), return_index=True)
    if not np.isfinite(coordinates).all():
        row = int(owner[~np.isfinite(coordinates).all(axis=1)][0])
        raise UserError(
            f"{where}, row {row + 1}: the position cannot be brought from {crs_name(frame.crs)} to {crs_name(target)}; "
            "check the layer's CRS"
        )
    return moved


def _schema_names(frame: gpd.GeoDataFrame, what: str, where: str, feedback: Feedback) -> gpd.GeoDataFrame:
    """Give columns of the schema their names back, and warn of those that only look like one of them."""
    renamed: dict[Any, str] = {}
    for column in schemas.columns_of(what):
        if column.name in frame:
            continue
        short = column.name[:10]
        for name in frame.columns:
            if str(name).lower() == column.name or (len(column.name) > 10 and str(name).lower() == short):
                renamed[name] = column.name
                break
        else:
            stem = column.name.removesuffix("_" + column.unit_in_name) if column.unit_in_name else ""
            alike = [name for name in frame.columns if stem and str(name).lower() == stem]
            if alike:
                feedback.warn(f"{where}: the field '{alike[0]}' is not used; rename it to {column.name} if it is meant")
    for old, new in renamed.items():
        feedback.note(f"{where}: the field '{old}' is read as {new}")
    return frame.rename(columns=renamed)


def _complaint(value: Any, minimum: float | None, exclusive: bool, maximum: float | None) -> str:
    bounds = [f"greater than {minimum:g}" if exclusive else f"at least {minimum:g}"] if minimum is not None else []
    bounds += [f"at most {maximum:g}"] if maximum is not None else []
    wanted = "a number " + " and ".join(bounds) if bounds else "a number"
    if value is None or value is pd.NA or (isinstance(value, float) and np.isnan(value)):
        return f"the value is empty; fill in {wanted}"
    shown = f"{value:g}" if isinstance(value, (int, float)) else f"'{value}'"
    return f"{shown} is not {wanted}; correct the value or delete the row"


def _field_names(frame: pd.DataFrame) -> str:
    names = [str(name) for name in frame.columns if name != "geometry"]
    return "the fields " + ", ".join(names) if names else "no field"
