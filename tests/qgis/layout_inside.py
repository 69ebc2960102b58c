"""Run by QGIS's own Python: the project of a run opened, its print layout exported, its logs at rest by the time."""

from __future__ import annotations

import json
import math
import os
import sys
from typing import Any

from qgis.core import (
    QgsApplication,
    QgsDateTimeRange,
    QgsFeatureRequest,
    QgsLayoutExporter,
    QgsLayoutItemLabel,
    QgsPrintLayout,
    QgsProject,
    QgsVectorLayerTemporalContext,
)
from qgis.PyQt.QtCore import QDateTime, Qt

PROJECT, WORK, *REST = sys.argv[1:]  # the last are the layers of logs at rest, by their names
application = QgsApplication([], False)
application.initQgis()
project = QgsProject.instance()
assert project.read(PROJECT)
image = QgsLayoutExporter.ImageExportSettings()
image.dpi = 100


def exported(layout: QgsPrintLayout) -> dict[str, Any]:
    """What is on a sheet; its pictures beside it."""
    exporter, place = QgsLayoutExporter(layout), f"{WORK}/{layout.name().rpartition(' ')[2]}"
    exporter.exportToImage(f"{place}.png", image)
    exporter.exportToPdf(f"{place}.pdf", QgsLayoutExporter.PdfExportSettings())
    main = layout.itemById("map")
    legend = next(each for each in layout.items() if type(each).__name__ == "QgsLayoutItemLegend")
    low = legend.positionWithUnits().y() + legend.sizeWithUnits().height()
    return {
        "place": place,
        "labels": [each.currentText() for each in layout.items() if isinstance(each, QgsLayoutItemLabel)],
        "cut": [
            each.currentText()
            for each in layout.items()
            if isinstance(each, QgsLayoutItemLabel) and needed(each) > each.rect().height() + 0.5
        ],
        "scale": main.scale(),
        "map_layers": sorted(
            each.name()
            for each in main.layersToRender()
            or project.mapThemeCollection().mapThemeVisibleLayers(main.followVisibilityPresetName())
        ),
        "legend": [each.name() for each in legend.model().rootGroup().findLayers()],
        "legend_ends_mm": low,
        "legend_right_mm": legend.positionWithUnits().x() + legend.sizeWithUnits().width(),
    }


def needed(label: QgsLayoutItemLabel) -> float:
    """The height [mm] that a label's text takes, broken at the label's width."""
    line = label.sizeForText()
    return math.ceil(line.width() / label.rect().width()) * line.height()


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


settled = project.mapLayersByName(REST[0])[0]
told: dict[str, Any] = {
    "sheets": {each.name(): exported(each) for each in project.layoutManager().layouts()},
    "durations": sorted(each["duration_s"] for each in settled.getFeatures()),
}
last = told["durations"][-1]
for name in REST:
    told[name] = [shown(name, seconds) for seconds in (0.0, last / 2.0, last + 1.0)]
print("JSON" + json.dumps(told), flush=True)
os._exit(0)
