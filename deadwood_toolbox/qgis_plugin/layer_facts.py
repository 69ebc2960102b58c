"""What a layer of a result says about itself in QGIS: names of fields with units, map tips, abstract, and its history.

The meanings and units are stored in the files (``gpkg_data_columns``, ``long_name`` of a raster's band); QGIS 3.22
reads neither.
"""

from __future__ import annotations

import html
import json
import os
import re
from typing import Any

from qgis.core import QgsMapLayer, QgsVectorLayer

from .stored_style import rows_in

RUN_ID = re.compile(r'"run_id": ?"([0-9a-f]{16})"')
TAG = "DEADWOOD_MANIFEST"  # of a GeoTIFF (as in files/embedded.py, a test)
TIP_ROWS = 8


def describe(layer: QgsMapLayer, command: str) -> None:
    """Give a layer its names, its map tip, and in its metadata the command that made it and its ``run_id``."""
    path, _bar, inner = layer.source().partition("|layername=")
    known, record = layer.metadata(), ""
    known.setTitle(layer.name())
    if isinstance(layer, QgsVectorLayer):
        _name_fields(layer, path, inner)
        record = "".join(text for (text,) in rows_in(path, "SELECT metadata FROM gpkg_metadata"))
    else:
        meaning, record = _of_raster(path)
        known.setAbstract(known.abstract() or meaning)
    run_id = _run_id_of(path, record)
    for each in (command, f"run_id {run_id}" if run_id else ""):
        if each and each not in known.history():
            known.addHistoryItem(each)
    layer.setMetadata(known)


def _of_raster(path: str) -> tuple[str, str]:
    """The meaning of a raster's first band, and the record of what made the file."""
    from osgeo import gdal  # QGIS's own

    source = gdal.Open(path)
    if source is None:
        return "", ""
    return source.GetRasterBand(1).GetMetadataItem("long_name") or "", source.GetMetadataItem(TAG) or ""


def _name_fields(layer: QgsVectorLayer, path: str, inner: str) -> None:
    query = "SELECT table_name, column_name, title FROM gpkg_data_columns"
    titles = {column: title for table, column, title in rows_in(path, query) if title and inner in ("", table)}
    rows = []
    for number, field in enumerate(layer.fields()):
        name = field.name()
        if name == "fid":
            continue
        alias = titles.get(name) or name.replace("_", " ").capitalize()
        layer.setFieldAlias(number, alias)
        rows.append(f'<tr><td>{html.escape(alias)}</td><td>[% "{name}" %]</td></tr>')
    layer.setMapTipTemplate(f"<b>{html.escape(layer.name())}</b><table>{''.join(rows[:TIP_ROWS])}</table>")


def _run_id_of(path: str, record: str) -> str:
    """The ``run_id`` in the manifest of the folder whose file it is, or in the file's own record."""
    try:
        with open(os.path.join(os.path.dirname(path), "manifest.json"), encoding="utf-8") as file:
            manifest: Any = json.load(file)
        if os.path.basename(path) in manifest.get("files", {}):
            return str(manifest["run_id"])
    except (OSError, ValueError, KeyError, AttributeError):
        pass
    found = RUN_ID.search(record)
    return found[1] if found else ""
