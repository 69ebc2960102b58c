"""The model "Slope to report": terrain, areas, trees and road in, a run and its report out, by three tools in a row.

It is a file that the Model Designer opens (``models/slope_to_report.model3``, made by ``tests/qgis/slope_model.py``);
here it gets names in QGIS's language and its place in the toolbox.
"""

from __future__ import annotations

from typing import Any

from qgis.core import (
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingModelAlgorithm,
    QgsProcessingModelChildParameterSource,
)
from qgis.PyQt.QtGui import QIcon

from .definitions import likely
from .finding import HERE
from .language import START, _, group_label

FILE = HERE / "models" / "slope_to_report.model3"
FRICTION = "friction"
LAYERS = ("dem", "areas", "lines")  # that it requires


def labels() -> dict[str, str]:
    """Labels of the model's parameters, which a file can have in one language only."""
    return {
        "dem": _("Terrain model"),
        "areas": _("Release areas, or points"),
        "count": _("Logs released"),
        "trees": _("Trees"),
        "barriers": _("Barriers"),
        "lines": _("Roads, railways, houses"),
        FRICTION: _("Friction coefficient"),
        "fidelity": _("Speed against accuracy"),
        "run": _("Folder of the run"),
        "report": _("Report"),
    }


def read() -> QgsProcessingModelAlgorithm:
    """The model for the Model Designer, in QGIS's language."""
    model = QgsProcessingModelAlgorithm()
    model.fromFile(str(FILE))
    model.setName(_("Slope to report"))
    name_all(model)
    for child in model.childAlgorithms().values():
        child.setDescription(child.algorithm().displayName())
        named = {}
        for output, each in child.modelOutputs().items():
            each.setDescription(labels()[output])
            each.setName(labels()[output])  # which the designer shows
            named[each.name()] = each
        child.setModelOutputs(named)
        model.setChildAlgorithm(child)
    return model


def name_all(model: QgsProcessingModelAlgorithm) -> None:
    """What it asks for; an output's name has its step before it."""
    known = labels()
    for each in model.parameterDefinitions():
        each.setDescription(known.get(each.name().rpartition(":")[2], each.description()))


class SlopeToReport(QgsProcessingModelAlgorithm):
    def __init__(self) -> None:
        super().__init__()
        self.fromFile(str(FILE))
        for step in ("slide", "report"):  # whose pages come in QGIS's language, as from their own dialogs
            child = self.childAlgorithm(step)
            language = child.algorithm().parameterDefinition("LANGUAGE").defaultValue()
            child.addParameterSources("LANGUAGE", [QgsProcessingModelChildParameterSource.fromStaticValue(language)])
            self.setChildAlgorithm(child)

    def createInstance(self) -> QgsProcessingAlgorithm:
        return SlopeToReport()

    def initAlgorithm(self, configuration: dict[str, Any] | None = None) -> None:
        super().initAlgorithm(configuration or {})
        name_all(self)
        for name in LAYERS:
            self.parameterDefinition(name).setMetadata({"widget_wrapper": likely(name)})

    def name(self) -> str:
        return "slopetoreport"

    def displayName(self) -> str:
        return _("Slope to report")

    def group(self) -> str:
        return group_label(START)

    def groupId(self) -> str:
        return "start"

    def icon(self) -> QIcon:
        return QIcon(self.svgIconPath())

    def svgIconPath(self) -> str:
        return str(HERE / "icons" / "deadwood.svg")

    def shortDescription(self) -> str:
        return _("Terrain, areas, trees and road in, a run and its report out")

    def shortHelpString(self) -> str:
        what = _(
            "Draws start positions in the areas, slides the logs through the trees and barriers, and writes the report "
            "of the run: 'Sample releases', 'Slide logs' and 'Make report' one after the other, with their default "
            "values."
        )
        change = _(
            "It is a model: the menu Plugins > Deadwood Toolbox opens it in the Model Designer, where steps and values "
            "can be changed and saved as a model of your own."
        )
        return f"<p>{what}</p><p>{change}</p>"

    def checkParameterValues(self, parameters: dict[str, Any], context: QgsProcessingContext) -> tuple[bool, str]:
        if parameters.get(FRICTION) in (None, ""):
            return False, _("'{label}' is missing").format(label=labels()[FRICTION])
        return super().checkParameterValues(parameters, context)
