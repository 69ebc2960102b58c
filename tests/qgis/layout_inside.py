"""Run by QGIS's own Python: the project of a run opened, its print layout exported, its logs at rest by the time."""

from __future__ import annotations

import json
import os
import sys
from typing import Any

from qgis.core import (
    QgsApplication,
    QgsDateTimeRange,
    QgsFeatureRequest,
    QgsLayoutExporter,
    QgsLayoutItemLabel,
    QgsProject,
    QgsVectorLayerTemporalContext,
)
from qgis.PyQt.QtCore import QDateTime, Qt

PROJECT, WORK = sys.argv[1:3]
application = QgsApplication([], False)
application.initQgis()
project = QgsProject.instance()
assert project.read(PROJECT)
layout = project.layoutManager().layouts()[0]
exporter = QgsLayoutExporter(layout)
image = QgsLayoutExporter.ImageExportSettings()
image.dpi = 100
exporter.exportToImage(f"{WORK}/layout.png", image)
exporter.exportToPdf(f"{WORK}/layout.pdf", QgsLayoutExporter.PdfExportSettings())
main = layout.itemById("map")
legend = next(each for each in layout.items() if type(each).__name__ == "QgsLayoutItemLegend")
labels = [each.currentText() for each in layout.items() if isinstance(each, QgsLayoutItemLabel)]


def shown(name: str, seconds: float) -> int:
    """The features of a layer that a frame of the animation has."""
    layer = project.mapLayersByName(name)[0]
    begin = QDateTime.fromString("2000-01-01T00:00:00", Qt.DateFormat.ISODate)
    begin.setTimeSpec(Qt.TimeSpec.UTC)
    begin = begin.addMSecs(round(1000 * seconds))
    context = QgsVectorLayerTemporalContext()
    context.setLayer(layer)
    frame = QgsDateTimeRange(begin, begin.addMSecs(250))
    condition = layer.temporalProperties().createFilterString(context, frame)
    return sum(1 for _ in layer.getFeatures(QgsFeatureRequest().setFilterExpression(condition)))


told: dict[str, Any] = {
    "name": layout.name(),
    "labels": labels,
    "scale": main.scale(),
    "map_layers": sorted(
        each.name()
        for each in main.layersToRender()
        or project.mapThemeCollection().mapThemeVisibleLayers(main.followVisibilityPresetName())
    ),
    "legend": [each.name() for each in legend.model().rootGroup().findLayers()],
    "durations": sorted(each["duration_s"] for each in project.mapLayersByName("Deposits")[0].getFeatures()),
}
last = told["durations"][-1]
for name in ("Deposits", "Logs at rest"):
    told[name] = [shown(name, seconds) for seconds in (0.0, last / 2.0, last + 1.0)]
print("JSON" + json.dumps(told), flush=True)
os._exit(0)
