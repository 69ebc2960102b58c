"""How each layer and raster of the toolbox looks, and how that is stored beside the data.

A GeoPackage carries its styles in the table ``layer_styles``, which QGIS applies by itself; a raster has them in a file
``NAME.qml`` beside it. Both are written without QGIS, so results look right wherever they are opened, with or without
the plugin. Colours and scales are those of `schemas/looks.py`.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms import schemas
from deadwood_algorithms.files import qml
from deadwood_algorithms.files.qml import Label, Span, Stop, Symbol, fill, line, marker
from deadwood_algorithms.schemas.looks import (
    BARRIER,
    DBH_CM,
    ENDS,
    ENERGY,
    GREENS,
    HITS,
    LESS_MORE,
    LOOKS,
    PLAIN,
    RELEASE,
    ROAD,
    STONE,
    STUMP,
    TREE,
    WOOD,
    WORTHS,
    Look,
)
from deadwood_algorithms.schemas.obstacles import STUMP_BELOW_M

if TYPE_CHECKING:
    import geopandas

Class = tuple[float, float, Label, Symbol]  # lower and upper end of the values
_SHARES = LOOKS["shares"].stops
SMALL = 1e-9  # below the share of one log in any run
HEIGHT_STEP_M = 5.0
BLOCK_STEP_M = 0.5
CASING_MM = 0.9  # of both sides together, of a line within a wider one
DBH_UNIT = "cm DBH"
NO_SHARE, BRINGS, NO_EFFECT = LABELS = "no line, or failed", "more reach it because of this", "no difference"
STAMP = "2000-01-01T00:00:00.000Z"  # as everywhere in a GeoPackage: same input, same bytes


@dataclass(frozen=True)
class Style:
    """The pieces of a style; ``labelled`` switches its labels on."""

    inner: str
    labelled: bool = False

    def document(self) -> str:
        return qml.document(self.inner, labelled=self.labelled)


# --- vector layers --------------------------------------------------------------------------------------------------


def of_layer(name: str, frame: geopandas.GeoDataFrame) -> Style | None:
    """The style of a layer, by its name or, for an unknown name, by its columns."""
    kind = kind_of(frame)
    if kind is None:
        return None
    if name in _LAYERS:
        return _LAYERS[name](frame, kind)
    if "stop_reason" in frame:
        return Style(_ends(kind))
    speed = next((each for each in ("speed_ms", "speed_max_ms") if each in frame), None)
    if speed:
        return Style(_speeds(speed, kind))
    return Style(qml.single(_plain(kind, PLAIN)))


def kind_of(frame: geopandas.GeoDataFrame) -> str | None:
    """The kind of symbol for the geometries; None for a mixed or empty layer."""
    kinds = {str(each).removeprefix("Multi") for each in frame.geometry.geom_type.dropna().unique()}
    names = {"Point": "marker", "LineString": "line", "LinearRing": "line", "Polygon": "fill"}
    return names.get(kinds.pop()) if len(kinds) == 1 else None


def _plain(kind: str, colour: str, size_mm: float = 2.0) -> Symbol:
    if kind == "marker":
        return marker(colour, size_mm)
    return line(colour, 0.3 * size_mm) if kind == "line" else fill(colour, colour, alpha=60, edge_mm=0.3 * size_mm)


def _ends(kind: str) -> str:
    rows = []
    for reason in schemas.STOP_REASONS:
        label, colour, shape = ENDS[reason]
        symbol = marker(colour, 1.8, shape=shape) if kind == "marker" else _plain(kind, colour)
        rows.append((reason, label, symbol))
    return qml.categorized("stop_reason", rows)


def _classes(field: str, bounds: Sequence[float], unit: str, symbol: Callable[[int], Symbol]) -> str:
    return qml.graduated(field, _class_rows(bounds, unit, symbol))


def _class_rows(bounds: Sequence[float], unit: str, symbol: Callable[[int], Symbol]) -> list[Class]:
    """One class from each bound to the next, and an open one above the last."""
    rows: list[Class] = []
    for k, low in enumerate(bounds):
        last = k == len(bounds) - 1
        high = 1e9 if last else bounds[k + 1]
        rows.append((low, high, Span(unit, low, None if last else high), symbol(k)))
    return rows


def _speeds(field: str, kind: str) -> str:
    look = LOOKS["speed"]
    return _classes(field, look.stops, look.shown, lambda k: _plain(kind, look.colours[k], 1.4))


def _trees(frame: geopandas.GeoDataFrame, kind: str) -> Style:
    """Classes of DBH; stumps are a class of their own."""
    if kind != "marker" or "dbh_cm" not in frame:
        return Style(qml.single(_plain(kind, TREE)))
    stumps = "height_m" in frame and bool((frame["height_m"] < STUMP_BELOW_M).any())
    rows = _class_rows(DBH_CM, DBH_UNIT, lambda k: marker(GREENS[k], 0.8 + 0.4 * k, edge=GREENS[-1], edge_mm=0.1))
    field = "dbh_cm"
    if stumps:
        field = f'if("height_m" < {STUMP_BELOW_M:g}, -1, "dbh_cm")'
        rows = [(-2.0, -0.5, "stump", marker(STUMP, 0.8)), *rows]
    flat = qml.graduated(field, rows)
    return Style(flat + qml.cones_3d(_trunks(frame)) if "height_m" in frame else flat)


def _trunks(frame: geopandas.GeoDataFrame) -> Iterable[tuple[str, float, float, float, str]]:
    """A cone for each class of height, with the mean height and DBH of its trees; the top has half the diameter."""
    height = frame["height_m"].to_numpy(np.float64)
    dbh = frame["dbh_cm"].to_numpy(np.float64)
    step = np.floor(height / HEIGHT_STEP_M)
    for each in np.unique(step[np.isfinite(step) & np.isfinite(dbh)]):
        inside = step == each
        low, radius = each * HEIGHT_STEP_M, float(np.nanmean(dbh[inside])) / 200.0
        condition = f'"height_m" >= {low:g} and "height_m" < {low + HEIGHT_STEP_M:g}'
        low_ones = bool((height[inside] < STUMP_BELOW_M).all())
        shape = (radius, STUMP) if low_ones else (0.5 * radius, TREE)
        yield condition, radius, shape[0], float(np.nanmean(height[inside])), shape[1]


def _trajectories(frame: geopandas.GeoDataFrame, kind: str) -> Style:
    return Style(_speeds("speed_max_ms", kind) + qml.ribbons_3d(ENERGY[3], 1.5))


def _lying_logs(frame: geopandas.GeoDataFrame, kind: str) -> Style:
    """Lines as thick as the logs, in metres of the map."""
    named = next((each for each in ("diameter_cm", "dbh_cm") if each in frame), None)
    width = 0.75 * float(np.nanmean(frame[named])) / 100.0 if named and len(frame) else 0.3  # half as thick at the tip
    return Style(qml.single(line(WOOD, width, unit="RenderMetersInMapUnits") if kind == "line" else _plain(kind, WOOD)))


def _barriers(frame: geopandas.GeoDataFrame, kind: str) -> Style:
    height = float(np.nanmean(frame["height_m"])) if "height_m" in frame and len(frame) else 3.0
    return Style(qml.single(_plain(kind, BARRIER, 4.0)) + qml.walls_3d(BARRIER, 0.3, height))


def _share_classes(kind: str, symbol: Callable[[int], Symbol]) -> list[Class]:
    """Shares of the logs: the first class, of almost none, is drawn inconspicuously."""
    first: Class = (0.0, _SHARES[0], Span("%", None, 100.0 * _SHARES[0]), _plain(kind, PLAIN))
    more = (
        (low, high, Span("%", 100.0 * low, 100.0 * high), symbol(k)) for k, (low, high) in enumerate(pairwise(_SHARES))
    )
    return [first, *more]


def _reach(frame: geopandas.GeoDataFrame, kind: str) -> Style:
    widths = np.linspace(2.0, 6.0, len(_SHARES))
    classes = _share_classes(kind, lambda k: _plain(kind, HITS[k + 1], float(widths[k])))
    rows = [(low, high, label, _cased(symbol)) for low, high, label, symbol in classes]
    text = f"\"line_id\" || ': ' || {_SHARE} || ' %'"
    return Style(qml.graduated("p", rows) + qml.labels(text), labelled=True)


def _cased(symbol: Symbol) -> Symbol:
    """A line within a wider one in the colour of roads, so that it is not taken for a barrier."""
    if symbol.kind != "line":
        return symbol
    width = float(dict(symbol.facts)["line_width"])
    return replace(symbol, beneath=line(ROAD, width + CASING_MM))


def _percent(column: str) -> str:
    """An expression for a share in percent with two digits, as the report has it."""
    return f'format_number(100 * "{column}", if("{column}" < 0.0995, 1, 0))'


# As in `percent_with_interval`: for no log, and for every log, a bound is shown, not a number.
_SHARE = (
    f"CASE WHEN \"n_reach\" = 0 THEN '< ' || {_percent('ci_high')} "
    f'WHEN "n_reach" = "n_total" THEN \'> \' || {_percent("ci_low")} '
    f"ELSE {_percent('p')} END"
)


def _blocks(frame: geopandas.GeoDataFrame, kind: str) -> Style:
    flat = qml.single(_plain(kind, STONE, 3.0))
    if kind != "marker" or "diameter_m" not in frame or "height_m" not in frame:
        return Style(flat)
    return Style(flat + qml.spheres_3d(_spheres(frame)))


def _spheres(frame: geopandas.GeoDataFrame) -> Iterable[tuple[str, float, float, str]]:
    """A sphere for each class of diameter, with the mean size and height of its boulders."""
    diameter, height = (frame[name].to_numpy(np.float64) for name in ("diameter_m", "height_m"))
    step = np.floor(diameter / BLOCK_STEP_M)
    for each in np.unique(step[np.isfinite(step) & np.isfinite(height)]):
        inside = (step == each) & np.isfinite(height)
        low, radius = each * BLOCK_STEP_M, 0.5 * float(diameter[inside].mean())
        condition = f'"diameter_m" >= {low:g} and "diameter_m" < {low + BLOCK_STEP_M:g}'
        yield condition, radius, float(height[inside].mean()) - radius, STONE


def _sites(frame: geopandas.GeoDataFrame, kind: str) -> Style:
    """By the share that reaches the line; a site that failed, or has no line, is drawn too."""
    failed = (-1.0, -0.5, NO_SHARE, _plain(kind, ENDS["failed"][1]))
    rows = [failed, *_share_classes(kind, lambda k: _plain(kind, HITS[k + 1], 3.0))]
    return Style(qml.graduated('coalesce("p", -1)', rows) + qml.labels('"site"'), labelled=True)


def _worth(frame: geopandas.GeoDataFrame, kind: str) -> Style:
    """The more logs an object keeps away, the larger and darker; one without effect is small, one that does harm is
    blue.
    """
    rows: list[Class] = [(-1.0, -SMALL, BRINGS, marker(LESS_MORE[0], 2.6, shape="triangle"))]
    rows.append((-SMALL, SMALL, NO_EFFECT, marker(PLAIN, 1.0)))
    low = SMALL
    for k, high in enumerate(WORTHS):
        rows.append((low, high, Span("%", None, 100.0 * high), marker(HITS[k + 1], 2.0 + 0.8 * k)))
        low = high
    return Style(qml.graduated("gain_p", rows))


def _outlines(frame: geopandas.GeoDataFrame, kind: str) -> Style:
    """Without a 3-D symbol, so that the 3-D view drapes them over the terrain, where it respects the time."""
    return Style(qml.single(fill(WOOD, EDGE_OF_WOOD)) + qml.intervals("t", "t_end"))


def _solids(frame: geopandas.GeoDataFrame, kind: str) -> Style:
    return Style(qml.single(fill(WOOD, WOOD, alpha=60, edge_mm=0.1)) + qml.faces_3d(WOOD))


def _spread(frame: geopandas.GeoDataFrame, kind: str) -> Style:
    text = "format_number(\"spread_deg\", 0) || '°'"
    return Style(qml.single(_plain(kind, RELEASE)) + qml.labels(text), labelled=True)


EDGE_OF_WOOD = "#4a3320"


def _in(colour: str, size_mm: float = 2.0) -> Callable[[Any, str], Style]:
    return lambda frame, kind: Style(qml.single(_plain(kind, colour, size_mm)))


_LAYERS: dict[str, Callable[[Any, str], Style]] = {
    "releases": _in(RELEASE, 1.2),
    "release_area": _in(RELEASE),
    "trees": _trees,
    "barriers": _barriers,
    "lying_logs": _lying_logs,
    "blocks": _blocks,
    "block_hits": _in(STONE, 3.0),
    "lines": _in(ROAD, 3.0),
    "forest": _in(TREE),
    "deposits": lambda frame, kind: Style(_ends(kind)),
    "deposited_logs": lambda frame, kind: Style(_ends(kind)),
    "trajectories": _trajectories,
    "reach": _reach,
    "reached_by": _in(ROAD, 1.4),
    "spread": _spread,
    "values": _worth,
    "planted": _worth,
    "azimuths": _in(RELEASE, 1.2),
    "release_areas": _in(RELEASE),
    "candidates": _in(ROAD, 2.4),
    "others": _in(PLAIN, 1.6),
    "sources": _in(ROAD),
    "affected": _in(RELEASE),
    "earthworks": _in(WOOD, 3.0),
    "flights": _in(RELEASE, 2.0),
    "clearances": _in(BARRIER, 2.4),
    "log_outlines": _outlines,
    "log_solids": _solids,
    "sites": _sites,
}


# --- rasters --------------------------------------------------------------------------------------------------------


def of_raster(kind: str, values: NDArray[Any] | None = None) -> Style:
    """The style of a raster that is of this kind, a name of `RASTERS`; ``values`` set the ends of some colours."""
    return RASTERS[kind](np.empty(0) if values is None else values)


def _scale(look: Look) -> Style:
    """The stops of a look; from a transparent stop, the colour fades in to the next one."""
    stops = [
        Stop(value, colour, look.label(value), alpha=0 if value == look.clear else 255)
        for value, colour in zip(look.stops, look.colours, strict=True)
    ]
    if look.clear is not None and look.clear < look.stops[0]:
        stops.insert(0, Stop(look.clear, look.colours[0], look.label(look.clear), alpha=0))
    return Style(qml.ramp(stops))


def _counts(values: NDArray[Any]) -> Style:
    """Zero transparent, then even steps of the logarithm, because the most and the least visited cells differ a lot."""
    largest = max(_largest(values), 2.0)
    steps = np.unique(np.round(np.geomspace(1.0, largest, len(HITS))))
    colours = [HITS[round(k)] for k in np.linspace(0, len(HITS) - 1, steps.size)]
    stops = [Stop(float(step), colour, f"{step:.0f}") for step, colour in zip(steps, colours, strict=True)]
    return Style(qml.ramp([Stop(0.0, HITS[0], "0", alpha=0), *stops]))


def _largest(values: NDArray[Any]) -> float:
    return float(np.fmax.reduce(values, axis=None)) if values.size and np.isfinite(values).any() else 1.0


def of_classes(rows: Sequence[tuple[int, str, str]]) -> Style:
    """The style of a raster of classes: value, colour and label of each."""
    return Style(qml.paletted(rows))


RASTERS: dict[str, Callable[[NDArray[Any]], Style]] = {
    **{name: lambda values, look=look: _scale(look) for name, look in LOOKS.items()},
    "counts": _counts,
    "terrain": lambda values: Style(qml.relief_shading()),
}


# --- storing --------------------------------------------------------------------------------------------------------


def store_beside(raster: Path, style: Style | None) -> None:
    """Write ``NAME.qml`` beside a raster."""
    if style:
        raster.with_suffix(".qml").write_text(style.document(), encoding="utf-8")


TABLE = "layer_styles"  # QGIS's name for it


def store_in(package: Path, styles: Mapping[str, Style | None]) -> None:
    """Write the table ``layer_styles`` of a GeoPackage, from which QGIS reads the style of each layer.

    It is listed among the layers, as by QGIS itself, so geopandas warns of more than one layer if none is
    named. Leaving it out of the list (GDAL's extension aspatial) was tested: the warning disappears, but so do the
    styles in QGIS 3.22.
    """
    rows = [(name, style) for name, style in styles.items() if style]
    if not rows:
        return
    with closing(sqlite3.connect(package)) as connection, connection:
        connection.execute(_COLUMNS)
        connection.executemany(
            f"INSERT INTO {TABLE} VALUES (?, '', '', ?, 'geom', ?, ?, '', 1, '', '', '', ?)",
            [(k + 1, name, name, style.document(), STAMP) for k, (name, style) in enumerate(rows)],
        )
        connection.execute(
            "INSERT INTO gpkg_contents (table_name, data_type, identifier, description, last_change, srs_id) "
            "VALUES (?, 'attributes', ?, 'Styles of the layers, for QGIS', ?, 0)",
            (TABLE, TABLE, STAMP),
        )


# As created by QGIS itself.
_COLUMNS = """CREATE TABLE layer_styles (
    id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, f_table_catalog TEXT(256), f_table_schema TEXT(256),
    f_table_name TEXT(256), f_geometry_column TEXT(256), styleName TEXT(30), styleQML TEXT, styleSLD TEXT,
    useAsDefault BOOLEAN, description TEXT, owner TEXT(30), ui TEXT(30), update_time DATETIME)"""
