"""The style that is stored with a layer, with the labels of its classes in QGIS's language."""

from __future__ import annotations

import re
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr, unescape

from qgis.core import QgsMapLayer
from qgis.PyQt.QtXml import QDomDocument

from .language import _, is_english, signs

# A label; of a range of values also its unit and its ends, as the toolbox stores them (`files/qml.py`).
LABEL = re.compile(r' label="([^"]*)"((?: label_\w+="[^"]*")*)')
DBH_UNIT = "cm DBH"


def apply(layer: QgsMapLayer) -> None:
    """Give a layer its stored style."""
    layer.loadDefaultStyle()
    style = None if is_english() else stored(layer.source())
    if style is not None:
        document = QDomDocument()
        document.setContent(translated(style))
        layer.importNamedStyle(document)
    layer.triggerRepaint()


def stored(source: str) -> str | None:
    """The stored style of the layer at a place: the file NAME.qml beside a raster, or in the table of a GeoPackage."""
    path, _named, layer = source.partition("|layername=")
    beside = Path(path).with_suffix(".qml")
    if beside.is_file():
        return beside.read_text(encoding="utf-8")
    if not path.endswith(".gpkg"):
        return None
    rows = dict(rows_in(path, "SELECT f_table_name, styleQML FROM layer_styles WHERE useAsDefault"))
    return rows.get(layer.partition("|")[0]) if layer else next(iter(rows.values()), None)


def rows_in(package: str, query: str) -> list[Any]:
    """The rows of a GeoPackage's tables; none if it cannot be read."""
    try:
        with closing(sqlite3.connect(f"{Path(package).absolute().as_uri()}?mode=ro", uri=True)) as database:
            return database.execute(query).fetchall()
    except sqlite3.Error:
        return []


def translated(style: str) -> str:
    """A style with its labels in QGIS's language."""
    return LABEL.sub(lambda found: f" label={quoteattr(_label(unescape(found[1]), found[2]))}{found[2]}", style)


def _label(english: str, facts: str) -> str:
    given = {name: unescape(value) for name, value in re.findall(r'label_(\w+)="([^"]*)"', facts)}
    if not given:
        return _(english)
    unit = f"cm {_('DBH')}" if given["unit"] == DBH_UNIT else given["unit"]
    low, high = (signs(given[name]) if name in given else None for name in ("low", "high"))
    if high is None:
        return _("over {low}").format(low=f"{low} {unit}")
    if low is None:
        return _("up to {high}").format(high=f"{high} {unit}")
    return _("{low} to {high}").format(low=low, high=f"{high} {unit}")
