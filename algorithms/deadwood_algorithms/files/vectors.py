"""Vector layers in and out: opened, checked, brought into the run's CRS, written as GeoPackage 1.2."""

from __future__ import annotations

import glob
import shutil
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pyproj
import shapely
from pyogrio.errors import CRSError, DataLayerError, DataSourceError, FeatureError
from shapely.errors import GEOSException

from deadwood_algorithms.files import dbf, geopackage_words, styles, ways_out
from deadwood_algorithms.files.columns import where_of
from deadwood_algorithms.files.crs import (
    accuracy_words,
    crs_name,
    horizontal,
    is_ballpark,
    is_local,
    near_its_area,
    parse_crs,
    refuse_local,
    same_crs,
)
from deadwood_algorithms.files.embedded import record_in
from deadwood_algorithms.files.free_memory import GIB, SHARE, free_bytes
from deadwood_algorithms.files.inputs import refuse_missing
from deadwood_algorithms.files.rasters import is_raster
from deadwood_algorithms.files.sqlite_files import JOURNAL, settled, unmerged
from deadwood_algorithms.files.streams import Stream, write_layer
from deadwood_algorithms.files.table_shapes import RINGS_CLOSED, shapes_of_table
from deadwood_algorithms.files.tables import is_text_table, read_text_table, sheet_table
from deadwood_algorithms.files.units import with_schema_names
from deadwood_algorithms.intake.doubts import Doubt, say
from deadwood_algorithms.intake.pages import one_page
from deadwood_algorithms.intake.places import rounded
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Quiet, UserError
from deadwood_algorithms.schemas.written import geometry_named

# GEOS's codes of Point; LineString, LinearRing, MultiLineString; Polygon, MultiPolygon. A MultiPoint of several points
# is not a single place and is therefore rejected.
SHEETS = (".xlsx", ".xls", ".ods")  # spreadsheets: rows of cells
TYPE_CODES = {"point": (0,), "line": (1, 2, 5), "polygon": (3, 6)}
# Memory of a layer while it is read, measured on a million releases with 13 fields (620 a row).
ROW_BYTES, FIELD_BYTES = 150, 60
FARTHEST = 1e9  # a coordinate beyond this is in no CRS on Earth, in whatever unit

# What services give, a page at a time; of releases and results users take 1000 or 2000 themselves
DOWNLOADED = ("trees", "dead_trees", "deadwood", "lines", "barriers", "blocks", "stands", "areas", "lying_logs")


def read_vector(
    path: str | Path,
    *,
    geometry: Sequence[str] = ("point",),
    target_crs: pyproj.CRS | None,
    crs: str | None = None,
    what: str = "releases",
    feedback: Feedback | None = None,
    x_field: str | None = None,
    y_field: str | None = None,
    rows: pd.DataFrame | None = None,
) -> gpd.GeoDataFrame:
    """Read a layer of points, lines or polygons in ``target_crs``; rows 0..n-1, each with a valid geometry.

    Parameters
    ----------
    path : path
        Any vector format, or a text table with x and y columns; ``file.gpkg|layername=trees`` names one of several
        layers, and a file with several is refused without it.
    geometry : sequence of str
        Which of ``point``, ``line`` and ``polygon`` are accepted. Points are returned as Point, lines as LineString
        or, with several parts, MultiLineString, polygons as Polygon or MultiPolygon.
    target_crs : pyproj.CRS or None
        Usually ``grid.crs``. None keeps the layer's own CRS, which must then be known from the layer or from ``crs``.
    crs : str, optional
        CRS of a layer that names none; without it such a layer is taken to be in ``target_crs``.
    what : str
        Role of the layer: a name of `schemas.LAYERS`, or any word for messages. Columns whose names were cut short by
        the shapefile format, have another letter case or another unit, get their name in that schema.
    x_field, y_field : str, optional
        Columns with the coordinates, which are then used instead of a geometry.
    rows : DataFrame, optional
        Result of `read_table` for the path, or a part of it (its index is still the row), so that it is not read again.
    """
    feedback = feedback or Quiet()
    xy_fields = (x_field, y_field) if x_field else None
    rows = read_table(path, what=what, geometry=geometry) if rows is None else rows
    where = where_of(rows)
    said = say_of_rows(rows, feedback)
    if rows.empty:
        full = rows.attrs.get("full_layers")
        fix = f"; the file has features in another: {', '.join(full)}" if full else ""
        raise UserError(f"{where}: the {what} layer is empty (no feature){fix}")
    frame = rows if isinstance(rows, gpd.GeoDataFrame) and not xy_fields else shapes_of_table(rows, what, xy_fields)
    for words in rows.attrs.get("notes", ())[len(said) :]:
        feedback.note(f"{where}: {words}", code="how-read")
    frame.geometry = _welcome(frame.geometry, geometry, what, where, feedback)
    say(_rounded(frame), where, feedback)
    frame = _in_crs(frame, target_crs, crs, what, where, feedback)
    frame = gpd.GeoDataFrame(with_schema_names(frame, what, where, feedback))
    frame.attrs["where"] = where
    return frame


def _rounded(frame: gpd.GeoDataFrame) -> Doubt | None:
    """The doubt about points whose coordinates were rounded."""
    points = np.asarray(frame.geometry)
    if not (shapely.get_type_id(points) == 0).all():
        return None
    degrees = frame.crs is not None and frame.crs.is_geographic
    return rounded(shapely.get_x(points), shapely.get_y(points), degrees=degrees)


def say_of_rows(rows: pd.DataFrame, feedback: Feedback) -> tuple[str, ...]:
    """Say what was noted and doubted about a file while its rows were read; returns the notes."""
    for doubt in rows.attrs.get("doubts", ()):
        say(doubt, where_of(rows), feedback)
    said = rows.attrs.get("notes", ())
    for words in said:
        feedback.note(f"{where_of(rows)}: {words}", code="how-read")
    return said


def read_table(path: str | Path, *, what: str, geometry: Sequence[str] = ()) -> pd.DataFrame:
    """Read the rows of a text table or vector layer unchanged: a GeoDataFrame if the file contains geometries.

    From a file with several layers, the only non-empty one is read, or the only one with the wanted geometry.
    """
    name, layer = _name_and_layer(path)
    if is_text_table(name) and not layer:
        frame = read_text_table(name, what)
        frame.attrs["where"] = name
        return frame
    refuse_missing(name, what)
    if Path(name).suffix.lower() in (".parquet", ".geoparquet", ".feather"):
        return _read_arrow(name, what)
    _refuse_torn_shapefile(name, what)
    if Path(name).suffix.lower() == ".shp" and _parts_of_shapefile(Path(name)) == {".shp", ".dbf"}:
        return _read_without_index(name, what, geometry)
    left = unmerged(Path(name))
    try:
        with warnings.catch_warnings(), settled(Path(name)) as place:
            warnings.simplefilter("ignore")  # M values are dropped, curves are straightened
            layer = _layer_of(name, layer, what, geometry, place)
            _refuse_too_many_rows(name, layer, what, place)
            read = partial(_read_features, name, layer, place)
            dbase = Path(name).suffix.lower() in (".shp", ".dbf")
            frame = dbf.read_encoded(read, Path(name), what) if dbase else read(None)
            others = _layers_that_hold_rows(place) if frame.empty else []
            ours = record_in(place) is not None  # of what another program has open, too: not in its place
    except (DataSourceError, DataLayerError, FeatureError, CRSError, UnicodeDecodeError) as error:
        if is_raster(name):
            raise UserError(ways_out.of_raster(name, what, geometry)) from error
        raise UserError(
            f"{name}: the {what} file is not a vector layer that can be read ({_reason(name, error)})"
        ) from error
    if Path(name).suffix.lower() in SHEETS:
        frame = sheet_table(frame)
    _refuse_twins(frame, name)
    if left:
        state = "holds changes that are not merged yet; they are included"
        if left[0].name.endswith(JOURNAL):
            state = "shows that its writer stopped or still is within a change; that change is not included"
        said = f"{left[0].name} beside it {state}"
        frame.attrs["notes"] = (said, *frame.attrs.get("notes", ()))
    single = Path(name).suffix.lower() not in (".gpkg", ".gdb", ".sqlite", ".kml", ".gpx")
    frame = frame.reset_index(drop=True)
    frame.attrs["where"] = name if single else f"{name}, layer '{layer}'"
    by_size = what in DOWNLOADED and not ours
    if (doubt := one_page(name, len(frame), by_size=by_size)) is not None:
        frame.attrs["doubts"] = (doubt,)
    frame.attrs["full_layers"] = [f"'{name}|layername={each}'" for each in others]
    return frame


def _read_features(name: str, layer: str, place: Path, encoding: str | None) -> pd.DataFrame:
    """The features of a layer; unclosed rings are closed, which is recorded in ``attrs`` for a message."""
    try:
        return pyogrio.read_dataframe(place, layer=layer, encoding=encoding)
    except GEOSException:
        frame = pyogrio.read_dataframe(place, layer=layer, encoding=encoding, on_invalid="fix")
        lost = np.asarray(frame.geometry.isna())
        if lost.any():
            raise UserError(
                f"{name}, row {int(np.argmax(lost)) + 1}: the geometry is broken and cannot be repaired; draw it again"
            ) from None
        frame.attrs["notes"] = (RINGS_CLOSED,)
        return frame


def _read_without_index(name: str, what: str, geometry: Sequence[str]) -> pd.DataFrame:
    """Read a shapefile whose index of rows (.shx) is missing: it is rebuilt beside a copy of the file."""
    place = Path(name)
    with tempfile.TemporaryDirectory() as folder:
        for part in place.parent.glob(f"{glob.escape(place.stem)}.*"):
            shutil.copy(part, folder)
        pyogrio.set_gdal_config_options({"SHAPE_RESTORE_SHX": "YES"})
        try:
            pyogrio.list_layers(Path(folder) / place.name)  # opening it writes the index
        except DataSourceError as error:
            raise UserError(f"{name}: the {what} file is not a vector layer that can be read ({error})") from error
        finally:
            pyogrio.set_gdal_config_options({"SHAPE_RESTORE_SHX": None})
        frame = read_table(Path(folder) / place.name, what=what, geometry=geometry)
    made = f"the part {place.stem}.shx is missing and was made again; copy all parts of a shapefile together"
    frame.attrs.update(where=name, notes=(made, *frame.attrs.get("notes", ())))
    return frame


def _refuse_too_many_rows(name: str, layer: str, what: str, place: Path) -> None:
    facts, free = pyogrio.read_info(place, layer=layer), free_bytes()
    needed = facts["features"] * (ROW_BYTES + FIELD_BYTES * len(facts["fields"]))
    if free is not None and needed > SHARE * free:
        raise UserError(
            f"{name}: the {facts['features']} rows of the {what} layer need {needed / GIB:.1f} GB of memory, "
            f"{free / GIB:.1f} GB are free; take a part of it"
        )


def _name_and_layer(path: str | Path) -> tuple[str, str]:
    """File and layer of ``file.gpkg|layername=trees``; QGIS may add a number in place of the name, or a filter."""
    name, *facts = str(path).split("|")
    layer = ""
    for fact in facts:
        key, equals, value = (word.strip() for word in fact.partition("="))
        if key.lower() == "layername" and equals:
            layer = value
        elif key.lower() == "layerid" and value.isdigit():
            layer = f"#{value}"
        elif key.lower() not in ("geometrytype", "uniquegeometrytype", "option:encoding"):
            raise UserError(
                f"{name}: '|{fact}' is not understood (only '|layername=NAME' is); export the wanted features to a file"
            )
    return name.strip() if facts else name, layer


def _refuse_twins(frame: pd.DataFrame, name: str) -> None:
    twins = frame.columns[frame.columns.duplicated()]
    if len(twins):
        raise UserError(f"{name}: two fields are called '{twins[0]}'; rename one")


def _reason(name: str, error: Exception) -> str:
    """Why GDAL could not read it, in short, or a more helpful reason."""
    suffix = Path(name).suffix.lower()
    if suffix in SHEETS:
        return "save a spreadsheet as CSV and use that"
    if suffix == "" and not Path(name).is_dir():
        return "its name has no extension; give a text table the extension .csv"
    return str(error).split(";")[0].splitlines()[0].rstrip(".")[:200]


def _refuse_torn_shapefile(name: str, what: str) -> None:
    """Reject a shapefile without its .dbf, which would be read without fields, so that defaults would replace all of
    them.
    """
    place = Path(name)
    if place.suffix.lower() != ".shp" or place.read_bytes()[:4] != b"\x00\x00\x27\x0a":
        return
    if ".dbf" not in _parts_of_shapefile(place):
        raise UserError(
            f"{name} ({what}): its part {place.stem}.dbf is missing; "
            "copy all its parts (.shp, .shx, .dbf, .prj) together"
        )


def _parts_of_shapefile(place: Path) -> set[str]:
    """Which of .shp, .shx and .dbf lie beside one another under this name."""
    beside = {each.name.lower() for each in place.parent.iterdir()}
    return {ending for ending in (".shp", ".shx", ".dbf") if place.stem.lower() + ending in beside}


def _read_arrow(name: str, what: str) -> pd.DataFrame:
    import pyarrow

    try:
        frame = gpd.read_feather(name) if name.lower().endswith(".feather") else gpd.read_parquet(name)
    except (ValueError, KeyError, TypeError, NotImplementedError, pyarrow.ArrowException, OSError) as error:
        reason = (str(error) or type(error).__name__).splitlines()[0].rstrip(".")
        raise UserError(f"{name}: the {what} file is not a layer of geometries that can be read ({reason})") from error
    frame = frame.reset_index(drop=True)
    _refuse_twins(frame, name)
    if frame.geometry.name != "geometry":
        frame = frame.rename_geometry("geometry")
    frame.attrs["where"] = name
    return frame


def write_vector(path: str | Path, layers: Mapping[str, gpd.GeoDataFrame | Stream]) -> None:
    """Write a GeoPackage 1.2 with these layers and their styles; same input, same bytes (time stamps: a fixed day)."""
    options: dict[str, Any] = {
        "dataset_options": {"VERSION": "1.2"},
        "layer_options": {"GEOMETRY_NAME": "geom", "FID": "fid"},
    }
    if Path(path).suffix.lower() != ".gpkg":
        raise UserError(f"{path}: the output must be a .gpkg file; name it {Path(path).with_suffix('.gpkg')}")
    pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": "2000-01-01T00:00:00.000Z"})
    try:
        for name, frame in layers.items():
            if isinstance(frame, Stream):
                write_layer(Path(path), name, frame, **options)
                continue
            kinds = set(frame.geometry.geom_type.dropna())
            kind = "Unknown" if kinds else geometry_named(name)
            if len(kinds) == 1:
                kind = kinds.pop() + (" Z" if bool(frame.geometry.has_z.any()) else "")
            pyogrio.write_dataframe(frame, path, layer=name, driver="GPKG", geometry_type=kind, **options)
    finally:
        pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": None})
    firsts = {name: each.first if isinstance(each, Stream) else each for name, each in layers.items()}
    styles.store_in(Path(path), {name: styles.of_layer(name, frame) for name, frame in firsts.items()})
    geopackage_words.store_in(Path(path), {name: _columns_of(frame) for name, frame in firsts.items()})


def _columns_of(frame: gpd.GeoDataFrame) -> list[str]:
    return [str(each) for each in frame.columns if each != frame.geometry.name]


def _layer_of(name: str, layer: str, what: str, geometry: Sequence[str], place: Path) -> str:
    """The layer to read: the one named, otherwise the only one with geometry, otherwise the only one."""
    found = [each for each in pyogrio.list_layers(place) if each[0] != styles.TABLE]
    names = [str(each) for each, _ in found]
    if layer.startswith("#") and layer not in names and int(layer[1:]) < len(names):
        return names[int(layer[1:])]
    if layer:
        if layer not in names:
            raise UserError(f"{name}: there is no layer '{layer}'; it has {', '.join(names)}")
        return layer
    spatial = [str(each) for each, kind in found if kind is not None]
    candidates = spatial or names
    if len(candidates) > 1:
        candidates = [each for each in candidates if _holds_rows(place, each)] or candidates
        drawn = {str(each): str(kind).lower() for each, kind in found}
        wanted = [each for each in candidates if any(kind in drawn[each] for kind in geometry)]
        candidates = wanted or candidates
    if not candidates and is_raster(name):
        raise UserError(ways_out.of_raster(name, what, geometry))
    if not candidates:
        raise UserError(f"{name}: the {what} file holds no layer")
    if len(candidates) > 1:
        raise UserError(
            f"{name}: the {what} file holds several layers ({', '.join(candidates)}); "
            f"name one: '{name}|layername={candidates[0]}'"
        )
    return candidates[0]


def _layers_that_hold_rows(place: Path) -> list[str]:
    names = [str(each) for each, _ in pyogrio.list_layers(place) if each != styles.TABLE]
    return [each for each in names if _holds_rows(place, each)]


def _holds_rows(place: Path, layer: str) -> bool:
    """Whether a layer has any feature: a GPX file always has five layers, of which most are empty."""
    count = pyogrio.read_info(place, layer=layer)["features"]
    return count != 0 if count >= 0 else len(pyogrio.read_dataframe(place, layer=layer, max_features=1)) > 0


def _welcome(shapes: gpd.GeoSeries, kinds: Sequence[str], what: str, where: str, feedback: Feedback) -> gpd.GeoSeries:
    """The geometries in the accepted form; rejects the first row of another kind."""
    array = np.asarray(shapes.array)
    bad = shapely.is_missing(array) | shapely.is_empty(array)
    if bad.any():
        raise UserError(f"{where}, row {int(np.argmax(bad)) + 1}: the geometry is empty; delete the row or draw it")
    single = (shapely.get_type_id(array) >= 4) & (shapely.get_num_geometries(array) == 1)
    array = np.where(single, shapely.get_geometry(array, 0), array)
    collections = shapely.get_type_id(array) == 7
    if collections.any():  # as written by tools that cut crowns: a crown and slivers of lines
        array = array.copy()
        array[collections] = [_parts_of(each, kinds) for each in array[collections]]
        parts = " and ".join(f"{kind}s" for kind in kinds)
        feedback.note(
            f"{where}: {counted(int(collections.sum()), 'geometry collection')}, of which {parts} are used",
            code="collections-split",
            collections=int(collections.sum()),
        )
    kinds_of = shapely.get_type_id(array)
    foreign = ~np.isin(kinds_of, [code for kind in kinds for code in TYPE_CODES[kind]])
    if foreign.any():
        row = int(np.argmax(foreign))
        name = array[row].geom_type
        fix = "; split it: 'Multipart to singleparts'" if name.startswith("Multi") and "point" in kinds else ""
        raise UserError(f"{where}, row {row + 1}: a {name}, but the {what} must be {' or '.join(kinds)}s{fix}")
    if not np.isfinite(shapely.get_coordinates(array)).all():
        owners = shapely.get_coordinates(array, return_index=True)
        row = int(owners[1][~np.isfinite(owners[0]).all(axis=1)][0])
        raise UserError(f"{where}, row {row + 1}: a coordinate is not a finite number")
    _refuse_far(array, where)
    crossed = ~shapely.is_valid(array) & (shapely.get_dimensions(array) == 2)
    if crossed.any():
        array[crossed] = [_polygons_of(shapely.make_valid(each)) for each in array[crossed]]
        feedback.note(
            f"{where}: {int(crossed.sum())} self-intersecting polygons were repaired",
            code="polygons-repaired",
            polygons=int(crossed.sum()),
        )
        if shapely.is_empty(array).any():
            raise UserError(f"{where}, row {int(np.argmax(shapely.is_empty(array))) + 1}: the polygon has no area")
    return gpd.GeoSeries(array, index=shapes.index, crs=shapes.crs)


def _parts_of(collection: Any, kinds: Sequence[str]) -> Any:
    """The parts of a collection that are of the first accepted kind in it: areas before lines and points."""
    parts = shapely.get_parts(collection)
    for kind in ("polygon", "line", "point"):
        chosen = parts[np.isin(shapely.get_type_id(parts), TYPE_CODES[kind])]
        if kind in kinds and len(chosen):
            return shapely.union_all(chosen) if kind != "point" else (chosen[0] if len(chosen) == 1 else collection)
    return collection


def _refuse_far(array: np.ndarray, where: str) -> None:
    coordinates, owner = shapely.get_coordinates(array, return_index=True)
    far = np.abs(coordinates).max(axis=1, initial=0.0) > FARTHEST
    if far.any():
        at = int(np.argmax(far))
        x, y = coordinates[at]
        raise UserError(f"{where}, row {int(owner[at]) + 1}: the position {x:g}, {y:g} is not on Earth; correct it")


def _polygons_of(shape: Any) -> Any:
    parts = [part for part in shapely.get_parts(shape) if part.geom_type in ("Polygon", "MultiPolygon")]
    return shapely.union_all(parts)


def _in_crs(
    frame: gpd.GeoDataFrame, target: pyproj.CRS | None, given: str | None, what: str, where: str, feedback: Feedback
) -> gpd.GeoDataFrame:
    named = parse_crs(given) if given else None
    own = frame.crs
    if own is None:
        if named is None and target is None:
            raise UserError(f"{where}: the {what} layer has no CRS; name it, for example --crs EPSG:2056")
        own = named or target
        assert own is not None  # for the type checker; refused above
        source = "--crs" if named else "the DEM"
        feedback.note(
            f"{where}: the {what} layer has no CRS, {crs_name(own)} is taken from {source}", code="crs-assumed"
        )
        own = horizontal(own)
        frame = frame.set_crs(own)
    if target is None:
        return frame.set_crs(horizontal(own), allow_override=True)
    if same_crs(own, target):
        return frame.set_crs(horizontal(target), allow_override=True)
    beyond_degrees = np.median(np.abs(shapely.get_coordinates(np.asarray(frame.geometry)))) > 360.0
    if own.is_geographic and beyond_degrees and is_local(target):  # GeoJSON and KML cannot be without a CRS
        return frame.set_crs(horizontal(target), allow_override=True)
    if own.is_geographic and beyond_degrees:
        raise UserError(
            f"{where}: the {what} layer names the CRS {crs_name(own)} (degrees), or none, which means the same in this "
            f"format, but its coordinates run to {np.abs(frame.total_bounds).max():.0f}; give it its true CRS in a GIS"
        )
    refuse_local(own, target, f"{where}: the {what} layer")
    accuracy = accuracy_words(own, target, frame.total_bounds.tolist())
    tell = feedback.warn if is_ballpark(accuracy) else feedback.note
    tell(
        f"{where}: the {what} layer is reprojected from {crs_name(own)} to {crs_name(horizontal(target))} ({accuracy})",
        code="reprojected",
    )
    _refuse_exchanged(frame, own, target, where, what)
    moved = frame.to_crs(horizontal(target))
    coordinates, owner = shapely.get_coordinates(np.asarray(moved.geometry.array), return_index=True)
    if not np.isfinite(coordinates).all():
        row = int(owner[~np.isfinite(coordinates).all(axis=1)][0])
        raise UserError(
            f"{where}, row {row + 1}: the position cannot be transformed from {crs_name(own)} to {crs_name(target)}; "
            "check the layer's CRS"
        )
    return moved


def _refuse_exchanged(frame: gpd.GeoDataFrame, own: pyproj.CRS, target: pyproj.CRS, where: str, what: str) -> None:
    """Reject latitudes in place of longitudes: only exchanged do they lie where the target's CRS is used."""
    if not own.is_geographic:
        return
    x, y = np.median(shapely.get_coordinates(np.asarray(frame.geometry)), axis=0)
    moved = pyproj.Transformer.from_crs(horizontal(own), horizontal(target), always_xy=True)
    if near_its_area(horizontal(target), *moved.transform(x, y)):
        return
    if near_its_area(horizontal(target), *moved.transform(y, x)):
        raise UserError(
            f"{where}: latitude and longitude of the {what} layer are exchanged (it lies at {x:.5g} east, {y:.5g} "
            f"north); exchange them: in QGIS 'Swap X and Y coordinates', of a table --x-field for the longitude "
            "and --y-field for the latitude"
        )
