"""Layers of the map whose files a tool has just replaced: opened again, or removed if they are gone.

QGIS keeps the old file of a raster open, and ``reloadData`` keeps the extent, type and nodata value that it had; a
layer whose source is set again has none of that left.
"""

from __future__ import annotations

import os

from qgis.core import QgsDataProvider, QgsMapLayer, QgsProject, QgsProviderRegistry
from qgis.PyQt.QtCore import QObject, pyqtSignal

from . import stored_style


class Refresher(QObject):
    """Works in the thread in which it was made, QGIS's own, whoever asks: the steps of a model end in another one."""

    asked = pyqtSignal(object, list)  # the project, and the files and folders that were written

    def __init__(self) -> None:
        super().__init__()
        self.asked.connect(self.refresh)

    def refresh(self, project: QgsProject, places: list[str]) -> None:
        """Refresh all layers of these files, and of files in these folders."""
        roots = [os.path.realpath(each) for each in places]
        for layer in list(project.mapLayers().values()):
            path, inner = _file_of(layer)
            if not any(path == root or path.startswith(root + os.sep) for root in roots):
                continue
            if not is_there(path, inner):
                project.removeMapLayer(layer.id())
                continue
            options = QgsDataProvider.ProviderOptions()
            options.transformContext = project.transformContext()
            layer.setDataSource(layer.source(), layer.name(), layer.providerType(), options)
            layer.triggerRepaint()


refresher = Refresher()


def _file_of(layer: QgsMapLayer) -> tuple[str, str]:
    """The file of a layer, and its name in it; empty if it has none."""
    decoded = QgsProviderRegistry.instance().decodeUri(layer.providerType(), layer.source())
    path = decoded.get("path") or ""
    return os.path.realpath(path) if path else "", decoded.get("layerName") or ""


def is_there(path: str, inner: str) -> bool:
    """Whether a file exists, and the layer or table in it."""
    if not inner or not path.endswith(".gpkg"):
        return os.path.exists(path)
    return (inner,) in stored_style.rows_in(path, "SELECT table_name FROM gpkg_contents")
