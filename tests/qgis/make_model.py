"""Run by QGIS's own Python: writes a model of three tools, each using the result of the previous one."""

from __future__ import annotations

import os
import sys

from qgis.core import (
    QgsApplication,
    QgsProcessingModelAlgorithm,
    QgsProcessingModelChildAlgorithm,
    QgsProcessingModelChildParameterSource,
    QgsProcessingModelOutput,
    QgsProcessingModelParameter,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterRasterLayer,
)

PLUGINS, PLACE = sys.argv[1:3]
application = QgsApplication([], False)
application.initQgis()
sys.path.insert(0, PLUGINS)
import deadwood  # noqa: E402

plugin = deadwood.classFactory(None)
plugin.initProcessing()

model = QgsProcessingModelAlgorithm("Slide and fan", "Deadwood")
for parameter in (
    QgsProcessingParameterRasterLayer("dem", "Terrain"),
    QgsProcessingParameterFeatureSource("areas", "Areas"),
):
    model.addModelParameter(parameter, QgsProcessingModelParameter(parameter.name()))

Source = QgsProcessingModelChildParameterSource


def child(name: str, algorithm: str, sources: dict[str, object], output: str | None = None) -> None:
    made = QgsProcessingModelChildAlgorithm(f"deadwood:{algorithm}")
    made.setChildId(name)
    made.setDescription(name)
    for key, source in sources.items():
        made.addParameterSources(key, [source if isinstance(source, Source) else Source.fromStaticValue(source)])
    if output:
        final = QgsProcessingModelOutput(output, output)
        final.setChildId(name)
        final.setChildOutputName("OUTPUT")
        made.setModelOutputs({output: final})
    model.addChildAlgorithm(made)


dem = Source.fromModelParameter("dem")
child("sample", "samplereleases", {"DEM": dem, "AREAS": Source.fromModelParameter("areas"), "COUNT": 12})
slide = {"DEM": dem, "RELEASES": Source.fromChildOutput("sample", "OUTPUT"), "FRICTION": 0.25, "FIDELITY": "draft"}
child("slide", "slidelogs", {**slide, "OPEN_RESULTS": False})
child("spread", "lateralspread", {"DEPOSITS": Source.fromChildOutput("slide", "DEPOSITS")}, output="fan")
assert model.toFile(PLACE)
os._exit(0)
