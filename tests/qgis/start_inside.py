"""Run by QGIS's own Python: the first entries of the toolbox, and the page behind a dialog's Help button."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

from qgis.core import QgsApplication, QgsProcessingContext, QgsProcessingFeedback, QgsProject, QgsVectorLayer
from qgis.PyQt.QtCore import QUrl

WORK, PLUGINS = sys.argv[1:3]
application = QgsApplication([], False)
application.initQgis()
sys.path.insert(0, PLUGINS)
import deadwood  # noqa: E402

plugin = deadwood.classFactory(None)
plugin.initProcessing()
from deadwood.slope_model import read  # noqa: E402

registry = QgsApplication.processingRegistry()
model = read()
steps = {name: model.validateChildAlgorithm(name)[1] for name in model.childAlgorithms()}


class Feedback(QgsProcessingFeedback):
    said: list[str] = []  # noqa: RUF012 (one object)

    def pushInfo(self, info: str) -> None:
        self.said.append(info)

    def reportError(self, error: str, fatalError: bool = False) -> None:
        self.said.append(error)


context, feedback = QgsProcessingContext(), Feedback(False)
context.setProject(QgsProject.instance())
demo = registry.createAlgorithmById("deadwood:starthere")
_results, worked = demo.run({"LOGS": 20, "OUTPUT": f"{WORK}/demo"}, context, feedback)
waiting = context.layersToLoadOnCompletion()
sources = [each for each in waiting if ".gpkg" in each]
slide = registry.algorithmById("deadwood:slidelogs")
told: dict[str, Any] = {
    "steps": steps,
    "outputs": sorted(name for each in model.childAlgorithms().values() for name in each.modelOutputs()),
    "dialogs": {
        name: [each.name() for each in registry.algorithmById(f"deadwood:{name}").parameterDefinitions()]
        for name in ("sitebarriers", "slidelogs")
    },
    "asked": [each.name() for each in registry.algorithmById("deadwood:slopetoreport").parameterDefinitions()],
    "worked": worked,
    "said": feedback.said,
    "waiting": [each.name for each in waiting.values()],
    "valid": all(QgsVectorLayer(each, "layer", "ogr").isValid() for each in sources),
    "page": Path(QUrl(slide.helpUrl()).toLocalFile()).read_text(encoding="utf-8"),
    "panel": slide.shortHelpString(),
}
print("JSON" + json.dumps(told), flush=True)
os._exit(0)
