"""Run by QGIS's own Python: writes models in which each tool uses results of previous ones.

One of three tools in a row; one of a storm, of a run before and a run after it, and of their comparison.
"""

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

PLUGINS, PLACE, STORM = sys.argv[1:4]
application = QgsApplication([], False)
application.initQgis()
sys.path.insert(0, PLUGINS)
import deadwood  # noqa: E402

plugin = deadwood.classFactory(None)
plugin.initProcessing()

Source = QgsProcessingModelChildParameterSource


def begun(title: str, *names: str) -> QgsProcessingModelAlgorithm:
    """A model with a terrain and layers as its inputs."""
    made = QgsProcessingModelAlgorithm(title, "Deadwood")
    for name in ("dem", *names):
        kind = QgsProcessingParameterRasterLayer if name == "dem" else QgsProcessingParameterFeatureSource
        made.addModelParameter(kind(name, name.capitalize()), QgsProcessingModelParameter(name))
    return made


def child(
    model: QgsProcessingModelAlgorithm,
    name: str,
    algorithm: str,
    sources: dict[str, object],
    output: tuple[str, str] | None = None,
) -> None:
    """Add a step; a source may be one, a list of them, or a value; ``output``: of the model, and of the step."""
    made = QgsProcessingModelChildAlgorithm(f"deadwood:{algorithm}")
    made.setChildId(name)
    made.setDescription(name)
    for key, source in sources.items():
        several = source if isinstance(source, list) else [source]
        made.addParameterSources(key, [x if isinstance(x, Source) else Source.fromStaticValue(x) for x in several])
    if output:
        final = QgsProcessingModelOutput(output[0], output[0])
        final.setChildId(name)
        final.setChildOutputName(output[1])
        made.setModelOutputs({output[0]: final})
    model.addChildAlgorithm(made)


def of(name: str, output: str = "OUTPUT") -> QgsProcessingModelChildParameterSource:
    return Source.fromChildOutput(name, output)


dem = Source.fromModelParameter("dem")
slide = {"DEM": dem, "RELEASES": of("sample"), "FRICTION": 0.25, "FIDELITY": "draft", "OPEN_RESULTS": False}
sample = {"DEM": dem, "AREAS": Source.fromModelParameter("areas"), "COUNT": 12}

model = begun("Slide and fan", "areas")
child(model, "sample", "samplereleases", sample)
child(model, "slide", "slidelogs", slide)
child(model, "spread", "lateralspread", {"DEPOSITS": of("slide", "DEPOSITS")}, ("fan", "OUTPUT"))
assert model.toFile(PLACE)

model = begun("Before and after a storm", "areas", "trees")
wind = {"TREES": Source.fromModelParameter("trees"), "DEM": dem, "SHARE": 0.9, "FALL_DEG": 180.0}
child(model, "sample", "samplereleases", sample)
child(model, "wind", "windthrow", {**wind, "OPEN_RESULTS": False})
child(model, "before", "slidelogs", {**slide, "TREES": of("wind", "TREES_BEFORE")})
felled = {"TREES": of("wind", "TREES_AFTER"), "LYING_LOGS": of("wind", "LYING_AFTER")}
child(model, "after", "slidelogs", {**slide, **felled})
compared = {"RUNS": [of("before"), of("after")], "NAMES": "before,after", "OPEN_RESULTS": False}
child(model, "compare", "comparescenarios", compared, ("answer", "OUTPUT"))
assert model.toFile(STORM)
os._exit(0)
