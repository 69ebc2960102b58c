"""The first entry of the toolbox: a complete example slope, run and added to the map, and how to go on with one's
own.
"""

from __future__ import annotations

import os
from typing import Any

from qgis.core import (
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingFeedback,
    QgsProcessingOutputHtml,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterFolderDestination,
    QgsProcessingParameterNumber,
)
from qgis.PyQt.QtGui import QIcon

from . import child
from .definitions import OPEN
from .finding import HERE
from .language import START, _, group_label
from .refreshing import refresher
from .results import announce, layers_of

LOGS, OUTPUT, REPORT = "LOGS", "OUTPUT", "REPORT"
# Parts of the demo that are added to the map, from the top down: file, and its most important layers first.
LAYERS = (
    ("run_mapped/run.gpkg", ("reach", "deposits")),
    ("release_area.gpkg", ("release_area",)),
    ("road.gpkg", ("lines",)),
    ("trees_mapped.gpkg", ("trees_mapped", "trees")),
    ("run_mapped/hit_count.tif", ()),
    ("dem.tif", ()),
)


class StartHere(QgsProcessingAlgorithm):
    def __init__(self) -> None:
        super().__init__()
        self.folder = ""

    def createInstance(self) -> QgsProcessingAlgorithm:
        return StartHere()

    def name(self) -> str:
        return "starthere"

    def displayName(self) -> str:
        return _("Begin: the demo slope")

    def group(self) -> str:
        return group_label(START)

    def groupId(self) -> str:
        return "start"

    def shortDescription(self) -> str:
        return _("Makes a complete case without any input, and adds it to the map")

    def shortHelpString(self) -> str:
        what = _(
            "Makes a small synthetic slope with a road at its foot, releases logs, slides them through a mapped "
            "forest, a random one and none, and writes a report. The terrain, the road, the trees and the results "
            "are added to the map. No data are needed; with the proposed number of logs it takes about a minute, "
            "longer the first time."
        )
        steps = (
            _("Terrain: a raster of heights in metres, in a projected CRS; a cell of 0.5 to 2 m."),
            _("Start positions: 'Sample releases' draws them in polygons or at points."),
            _("Trees: 'Import trees' makes the layer from a table, 'Find trees' from a canopy model."),
            _("'Slide logs' slides them; 'Make report' writes the report. 'Slope to report' does all of it at once."),
        )
        afterwards = _("Your own slope afterwards:")
        listed = "".join(f"<li>{each}</li>" for each in steps)
        return f"<p>{what}</p><p>{afterwards}</p><ol>{listed}</ol>"

    def icon(self) -> QIcon:
        return QIcon(self.svgIconPath())

    def svgIconPath(self) -> str:
        return str(HERE / "icons" / "deadwood.svg")

    def tags(self) -> list[str]:
        return ["demo", "example", "tutorial", "deadwood", "first"]

    def initAlgorithm(self, configuration: dict[str, Any] | None = None) -> None:
        kind = QgsProcessingParameterNumber.Type.Integer
        logs = _("Logs released in each forest")
        self.addParameter(
            QgsProcessingParameterNumber(LOGS, logs, type=kind, defaultValue=200, minValue=20, maxValue=100_000)
        )
        self.addParameter(QgsProcessingParameterBoolean(OPEN, _("Open the results in the map"), defaultValue=True))
        self.addParameter(QgsProcessingParameterFolderDestination(OUTPUT, _("Folder of the demo")))
        self.addOutput(QgsProcessingOutputHtml(REPORT, _("Report")))

    def processAlgorithm(
        self, parameters: dict[str, Any], context: QgsProcessingContext, feedback: QgsProcessingFeedback
    ) -> dict[str, Any]:
        folder = os.path.abspath(self.parameterAsFileOutput(parameters, OUTPUT, context))
        if os.path.isdir(folder) and not os.listdir(folder):
            os.rmdir(folder)  # QGIS may have made a temporary one
        logs = self.parameterAsInt(parameters, LOGS, context)
        try:
            said = child.run(["demo", f"--logs={logs}", "--fidelity=draft", f"--output={folder}"], feedback)
        except QgsProcessingException:
            if feedback.isCanceled():
                raise QgsProcessingException(_("Canceled; nothing was left behind")) from None
            raise
        if self.parameterAsBoolean(parameters, OPEN, context) and context.project() is not None:
            found = sources(folder)
            titles = {"dem": _("Terrain model"), "lines": _("Road"), "trees": _("Trees")}
            names = [name for name, _source in found]
            announce(found, (_("Demo slope"), folder), context, context.project(), names, titles, said.command)
        report = os.path.join(folder, "report.html")
        feedback.pushInfo(_("The report of the three forests: {report}").format(report=report))
        self.folder = folder
        return {OUTPUT: folder, REPORT: report}

    def postProcessAlgorithm(self, context: QgsProcessingContext, feedback: QgsProcessingFeedback) -> dict[str, Any]:
        if context.project() is not None:
            refresher.asked.emit(context.project(), [self.folder])
        return {}


def sources(folder: str) -> list[tuple[str, str]]:
    """Name and source of the layers added to the map."""
    found = []
    for file, layers in LAYERS:
        path = os.path.join(folder, *file.split("/"))
        if not layers:
            found.append((os.path.splitext(os.path.basename(path))[0], path))
        known = layers_of(path) if layers else []
        found += [(name, f"{path}|layername={name}") for name in layers if name in known]
    return found
