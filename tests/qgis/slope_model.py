"""Run by QGIS's own Python: writes the model that the plugin ships, terrain to report.

PYTHONPATH=FOLDER_OF_THE_PLUGINS /usr/bin/python3 tests/qgis/slope_model.py FOLDER_OF_THE_PLUGINS FILE.model3
"""

from __future__ import annotations

import os
import sys

from qgis.core import (
    QgsApplication,
    QgsProcessing,
    QgsProcessingModelAlgorithm,
    QgsProcessingModelChildAlgorithm,
    QgsProcessingModelChildParameterSource,
    QgsProcessingModelOutput,
    QgsProcessingModelParameter,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterNumber,
    QgsProcessingParameterRasterLayer,
)
from qgis.PyQt.QtCore import QPointF

PLUGINS, PLACE = sys.argv[1:3]
application = QgsApplication([], False)
application.initQgis()
sys.path.insert(0, PLUGINS)
import deadwood  # noqa: E402

plugin = deadwood.classFactory(None)
plugin.initProcessing()
Source = QgsProcessingModelChildParameterSource
Kind = QgsProcessing.SourceType
Number = QgsProcessingParameterNumber


def layer(
    name: str, label: str, kinds: list[QgsProcessing.SourceType], *, optional: bool = False
) -> QgsProcessingParameterDefinition:
    return QgsProcessingParameterFeatureSource(name, label, types=kinds, optional=optional)


friction = Number("friction", "Friction coefficient", type=Number.Type.Double, optional=True, minValue=0.0)
friction.setMetadata({"widget_wrapper": {"class": "deadwood.widgets.NumberOrLayer", "decimals": 4}})
fidelities = ["draft", "standard", "fine", "reference"]
PARAMETERS = (
    QgsProcessingParameterRasterLayer("dem", "Terrain model"),
    layer("areas", "Release areas, or points", [Kind.TypeVectorPolygon, Kind.TypeVectorPoint]),
    Number("count", "Logs released", type=Number.Type.Integer, defaultValue=500, minValue=1),
    layer("trees", "Trees", [Kind.TypeVectorPoint], optional=True),
    layer("barriers", "Barriers", [Kind.TypeVectorLine], optional=True),
    layer("lines", "Roads, railways, houses", [Kind.TypeVectorLine, Kind.TypeVectorPolygon]),
    friction,
    QgsProcessingParameterEnum(
        "fidelity", "Speed against accuracy", fidelities, defaultValue="standard", usesStaticStrings=True
    ),
)
model = QgsProcessingModelAlgorithm("Slope to report", "Deadwood")
for row, each in enumerate(PARAMETERS):
    component = QgsProcessingModelParameter(each.name())
    component.setPosition(QPointF(140.0 + 240.0 * (row % 4), 60.0 + 90.0 * (row // 4)))
    model.addModelParameter(each, component)
model.setParameterOrder([each.name() for each in PARAMETERS])  # otherwise the dialog sorts them alphabetically


def child(
    name: str, algorithm: str, sources: dict[str, object], place: QPointF, output: tuple[str, str] | None
) -> None:
    made = QgsProcessingModelChildAlgorithm(f"deadwood:{algorithm}")
    made.setChildId(name)
    made.setDescription(made.algorithm().displayName())
    made.setPosition(place)
    settings = (each for each in made.algorithm().parameterDefinitions() if not each.isDestination())
    proposed = {each.name(): each.defaultValue() for each in settings if each.defaultValue() is not None}
    for key, source in (proposed | sources).items():
        made.addParameterSources(key, [source if isinstance(source, Source) else Source.fromStaticValue(source)])
    if output:
        final = QgsProcessingModelOutput(output[0], output[1])
        final.setChildId(name)
        final.setChildOutputName("OUTPUT")
        final.setPosition(QPointF(place.x() + 230.0, place.y() + 60.0))
        made.setModelOutputs({output[0]: final})
    model.addChildAlgorithm(made)


def given(*names: str) -> dict[str, object]:
    return {name.upper(): Source.fromModelParameter(name) for name in names}


child("sample", "samplereleases", given("dem", "areas", "count"), QPointF(180.0, 260.0), None)
slide = given("dem", "trees", "barriers", "lines", "friction", "fidelity")
slide |= {"RELEASES": Source.fromChildOutput("sample", "OUTPUT"), "OPEN_RESULTS": True, "QGIS_PROJECT": True}
child("slide", "slidelogs", slide, QPointF(430.0, 360.0), ("run", "Folder of the run"))
report = {"RUNS": Source.fromChildOutput("slide", "OUTPUT")}
child("report", "makereport", report, QPointF(680.0, 540.0), ("report", "Report"))
assert model.toFile(PLACE)
os._exit(0)
