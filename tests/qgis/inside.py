"""Run by QGIS's own Python: layers of the map that are not in any file, passed to the tools through the plugin.

Prints one JSON object: the result of each case, or the message with which it was refused.
"""

from __future__ import annotations

import gettext
import json
import os
import sys
import threading
import time
from typing import Any

from qgis.core import (
    QgsApplication,
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsGeometry,
    QgsPointXY,
    QgsProcessingAlgRunnerTask,
    QgsProcessingContext,
    QgsProcessingFeatureSourceDefinition,
    QgsProcessingFeedback,
    QgsProcessingOutputLayerDefinition,
    QgsProcessingUtils,
    QgsProject,
    QgsRasterLayer,
    QgsRasterRange,
    QgsVectorFileWriter,
    QgsVectorLayer,
)

SAMPLE, WORK, PLUGINS = sys.argv[1:4]
application = QgsApplication([], False)
application.initQgis()
sys.path.insert(0, PLUGINS)
import deadwood  # noqa: E402
from deadwood import child, language, raster_copy, stored_style  # noqa: E402

plugin = deadwood.classFactory(None)
plugin.initProcessing()
project = QgsProject.instance()
registry = QgsApplication.processingRegistry()
EAST, NORTH = 2_786_172.0, 1_196_268.0  # in the release area


class Feedback(QgsProcessingFeedback):
    def __init__(self) -> None:
        super().__init__(False)
        self.said: list[str] = []

    def pushInfo(self, info: str) -> None:
        self.said.append(info)

    def reportError(self, error: str, fatalError: bool = False) -> None:
        self.said.append(error)


def run(name: str, **parameters: Any) -> dict[str, Any]:
    """Run a tool as QGIS does: check, prepare, process; its results and what it said."""
    algorithm = registry.createAlgorithmById(f"deadwood:{name}")
    context, feedback = QgsProcessingContext(), Feedback()
    context.setProject(project)
    results, worked = algorithm.run(parameters, context, feedback)
    waiting = {os.path.basename(uri): each.name for uri, each in context.layersToLoadOnCompletion().items()}
    return {"worked": worked, "results": results, "said": feedback.said, "waiting": waiting}


def memory(name: str, places: list[tuple[float, float]], crs: str = "EPSG:2056") -> QgsVectorLayer:
    layer = QgsVectorLayer(f"Point?crs={crs}&field=release_id:string&field=dbh_cm:double", name, "memory")
    features = []
    for number, place in enumerate(places):
        feature = QgsFeature(layer.fields())
        feature.setGeometry(QgsGeometry.fromPointXY(QgsPointXY(*place)))
        feature.setAttributes([f"area {number}", 40.0 + number])
        features.append(feature)
    layer.dataProvider().addFeatures(features)
    layer.updateExtents()
    project.addMapLayer(layer)
    return layer


def selected(layer: QgsVectorLayer) -> QgsProcessingFeatureSourceDefinition:
    return QgsProcessingFeatureSourceDefinition(layer.id(), True)


def counted(outcome: dict[str, Any]) -> dict[str, Any]:
    """The outcome of sample-releases, with how many logs of which release are in its layer."""
    if outcome["worked"]:
        made = QgsVectorLayer(outcome["results"]["OUTPUT"], "made")
        rows = [(each["release_id"], each["dbh_cm"]) for each in made.getFeatures()]
        outcome["rows"] = {name: sum(each == name for each, _ in rows) for name, _ in rows}
        outcome["dbh_cm"] = sorted({dbh for _, dbh in rows})
        outcome["crs"] = made.crs().authid()
    return outcome


dem = QgsRasterLayer(f"{SAMPLE}/dem.tif", "terrain")
project.addMapLayer(dem)
spots = [(EAST, NORTH), (EAST + 20.0, NORTH), (EAST + 40.0, NORTH)]
outcomes: dict[str, Any] = {}


def sample(case: str, areas: Any, **more: Any) -> None:
    given = {"AREAS": areas, "DEM": dem, "COUNT": 2, "OUTPUT": f"{WORK}/{case}.gpkg", **more}
    outcomes[case] = counted(run("samplereleases", **given))


layer = memory("Spots of the map", spots)
sample("memory", layer)
sample("layer_id", layer.id())
layer.selectByIds([feature.id() for feature in layer.getFeatures() if feature["release_id"] == "area 1"])
sample("selected", selected(layer))
layer.removeSelection()
sample("nothing_selected", selected(layer))

stored = QgsVectorLayer(f"{SAMPLE}/sample.gpkg|layername=release_area", "Stored areas")
project.addMapLayer(stored)
sample("stored", stored)
options = QgsVectorFileWriter.SaveVectorOptions()
QgsVectorFileWriter.writeAsVectorFormatV3(layer, f"{WORK}/spots.gpkg", project.transformContext(), options)
many = memory("Many spots", [(EAST + 0.01 * k, NORTH) for k in range(20_000)])
many.selectByIds([feature.id() for feature in many.getFeatures() if feature["dbh_cm"] < 19_000.0])
prepared = registry.createAlgorithmById("deadwood:samplereleases")
given = {"AREAS": selected(many), "DEM": dem, "COUNT": 1, "OUTPUT": f"{WORK}/many.gpkg"}
context, began = QgsProcessingContext(), time.monotonic()
context.setProject(project)
prepared.prepare(given, context, Feedback())
outcomes["many"] = {"prepared_s": time.monotonic() - began}
prepared.inputs.write_copies(Feedback())
outcomes["many"] |= {"written_s": time.monotonic() - began - outcomes["many"]["prepared_s"]}
outcomes["many"]["rows"] = QgsVectorLayer(next(iter(prepared.inputs.saved)), "many").featureCount()
filtered = QgsVectorLayer(f"{WORK}/spots.gpkg", "Filtered spots")
filtered.setSubsetString("\"release_id\" = 'area 2'")
project.addMapLayer(filtered)
sample("filtered", filtered)
options.attributes = [1]  # without an id
QgsVectorFileWriter.writeAsVectorFormatV3(layer, f"{WORK}/unnamed.gpkg", project.transformContext(), options)
options.attributes = []
unnamed = QgsVectorLayer(f"{WORK}/unnamed.gpkg", "Spots without a name")
project.addMapLayer(unnamed)
unnamed.selectByIds([2, 3])
sample("unnamed_selected", selected(unnamed))
unnamed.removeSelection()
unnamed.setSubsetString("dbh_cm > 41.5")
sample("unnamed_filtered", unnamed)
edited = QgsVectorLayer(f"{WORK}/spots.gpkg", "Edited spots")
project.addMapLayer(edited)
edited.startEditing()
feature = QgsFeature(edited.fields())
feature.setGeometry(QgsGeometry.fromPointXY(QgsPointXY(EAST, NORTH + 20.0)))
feature["release_id"], feature["dbh_cm"] = "drawn just now", 55.0
edited.addFeature(feature)
sample("edited", edited)
edited.rollBack()
renamed = QgsVectorLayer(f"{WORK}/spots.gpkg", "Spots in another CRS")
renamed.setCrs(QgsCoordinateReferenceSystem("EPSG:21781"))
project.addMapLayer(renamed)
sample("crs_of_the_map", renamed)

degrees = memory("Spots in degrees", [(9.4318, 46.9)], "EPSG:4326")
sample("elsewhere", degrees)
sample("dem_in_degrees", layer, DEM=QgsRasterLayer(f"{WORK}/degrees.tif", "terrain in degrees"))
unnamed = QgsRasterLayer(f"{WORK}/unnamed.tif", "terrain without CRS")
unnamed.setCrs(QgsCoordinateReferenceSystem("EPSG:2056"))
sample("dem_named_in_the_map", layer, DEM=unnamed)


ASSESSED = {"FRICTION": 0.25, "FRICTION_RANGE": "0.25-0.25", "CELL_M": 20.0, "LOGS_PER_CELL": 1, "TIME_LIMIT_S": 5.0}


def assess(case: str, terrain: Any) -> None:
    given = {"DEM": terrain, **ASSESSED, "OUTPUT": f"{WORK}/{case}.tif"}
    outcomes[case] = run("assessmobilisation", **given)


for case in ("heights", "heights_with_holes", "heights_with_pits"):
    assess(f"{case}_in_the_file", f"{WORK}/{case}.tif")
pitted = QgsRasterLayer(f"{WORK}/heights_with_pits.tif", "Heights with pits that are none")
pitted.dataProvider().setUserNoDataValue(1, [QgsRasterRange(-500.0, -500.0)])
assess("pits_named_in_the_map", pitted)
several = QgsRasterLayer(f"{WORK}/heights_with_kinds_of_pits.tif", "Heights with three kinds of pits")
several.dataProvider().setUserNoDataValue(1, [QgsRasterRange(each, each) for each in (-500.0, -600.0)])
assess("kinds_of_pits_named_in_the_map", several)
holed = QgsRasterLayer(f"{WORK}/heights.tif", "Heights with holes of the map")
holed.dataProvider().setUserNoDataValue(1, [QgsRasterRange(1150.0, 1180.0), QgsRasterRange(1300.0, 1301.0)])
assess("heights_with_holes_in_the_map", holed)
whole = QgsRasterLayer(f"{WORK}/heights_with_holes.tif", "Heights without holes")
whole.dataProvider().setUseSourceNoDataValue(1, False)
assess("nodata_switched_off", whole)
feet = QgsRasterLayer(f"{WORK}/heights_in_feet.tif", "Heights in feet")
feet.dataProvider().setUserNoDataValue(1, [QgsRasterRange(1150.0, 1180.0)])
assess("feet_of_a_copy", feet)
moved = QgsRasterLayer(f"{WORK}/heights.tif", "Heights in another CRS")
moved.setCrs(QgsCoordinateReferenceSystem("EPSG:3034"))
assess("crs_of_the_map_for_a_raster", moved)

outcomes["temporary"] = run("makelog", OUTPUT="TEMPORARY_OUTPUT", OPEN_RESULTS=False)
outcomes["temporary"]["folder"] = QgsProcessingUtils.tempFolder()
viewed = QgsRasterLayer(f"{WORK}/heights.tif", "Heights without a value that none has")
viewed.dataProvider().setUserNoDataValue(1, [QgsRasterRange(-77.0, -77.0)])
released = QgsVectorLayer(f"{WORK}/memory.gpkg", "Spots released")
project.addMapLayer(released)
released.selectByIds([2, 3, 5])
outcomes["folder"] = run(
    "slidelogs",
    DEM=viewed,
    RELEASES=selected(released),
    LINES=f"{SAMPLE}/sample.gpkg|layername=lines",
    BARRIERS=f"{SAMPLE}/sample.gpkg|layername=barriers",
    FRICTION=0.25,
    FIDELITY="draft",
    TIME_LIMIT=3.0,
    OUTPUT=f"{WORK}/run",
    OPEN_RESULTS=True,
)


def run_as_a_dialog_does(name: str, **parameters: Any) -> dict[str, Any]:
    """Prepared in this thread and processed in another one, with the outputs to be opened in the project."""
    algorithm = registry.createAlgorithmById(f"deadwood:{name}")
    context, feedback, done = QgsProcessingContext(), Feedback(), []
    context.setProject(project)
    task = QgsProcessingAlgRunnerTask(algorithm, parameters, context, feedback)
    task.executed.connect(lambda worked, results: done.append(worked))
    QgsApplication.taskManager().addTask(task)
    while not done:
        application.processEvents()
        time.sleep(0.01)
    return {"worked": done[0], "said": feedback.said, "waiting": {
        os.path.basename(uri): each.name for uri, each in context.layersToLoadOnCompletion().items()
    }, "looks": looks_on_arrival(context)}  # fmt: skip


about: dict[str, Any] = {}  # of each layer that has arrived


def looks_on_arrival(context: QgsProcessingContext) -> dict[str, str]:
    """The renderer of each waiting layer, once what Processing calls on its arrival has been called."""
    found = {}
    for uri, each in context.layersToLoadOnCompletion().items():
        name = os.path.basename(uri)
        # Processing loads them without their default style
        raster, vector = (kind.LayerOptions(loadDefaultStyle=False) for kind in (QgsRasterLayer, QgsVectorLayer))
        is_raster = uri.endswith(".tif")
        layer = QgsRasterLayer(uri, name, "gdal", raster) if is_raster else QgsVectorLayer(uri, name, "ogr", vector)
        if each.postProcessor() is not None:
            each.postProcessor().postProcessLayer(layer, context, QgsProcessingFeedback())
        found[name] = layer.renderer().type()
        about[name] = {
            "name": layer.name(),
            "history": list(layer.metadata().history()),
            "abstract": layer.metadata().abstract(),
            "aliases": {} if is_raster else {each.name(): each.alias() for each in layer.fields()},
            "tip": "" if is_raster else layer.mapTipTemplate(),
        }
    return found


in_window: list[bool] = []
write = raster_copy.Copy.write


def watched(self: raster_copy.Copy, feedback: QgsProcessingFeedback) -> bool:
    in_window.append(threading.current_thread() is threading.main_thread())
    return write(self, feedback)


raster_copy.Copy.write = watched
shown = QgsProcessingOutputLayerDefinition(f"{WORK}/copied_in_a_thread.tif", project)
given = {**ASSESSED, "OUTPUT": shown}
outcomes["copied_in_a_thread"] = run_as_a_dialog_does("assessmobilisation", DEM=holed, **given)
outcomes["copied_in_a_thread"]["in_window"] = in_window
opened = QgsProcessingOutputLayerDefinition(f"{WORK}/in_a_thread.gpkg", project)
opened.destinationName = "Releases"
outcomes["in_a_thread"] = run_as_a_dialog_does(
    "samplereleases", AREAS=f"{SAMPLE}/sample.gpkg|layername=release_area", DEM=dem, COUNT=2, OUTPUT=opened
)
opened = QgsProcessingOutputLayerDefinition(f"{WORK}/spread_in_a_thread.gpkg", project)
deposits = f"{WORK}/run/run.gpkg|layername=deposits"
outcomes["layers_in_a_thread"] = run_as_a_dialog_does("lateralspread", DEPOSITS=deposits, OUTPUT=opened)


def cells_of(layer: QgsRasterLayer) -> list[list[float | None]]:
    """East, north and value (none outside) of places below the release area, as the provider of a layer has them."""
    found = []
    for k in range(2000):
        east, north = EAST - 20.0 + 100.0 * (0.618034 * k % 1.0), NORTH - 80.0 + 0.05 * k
        value, inside = layer.dataProvider().sample(QgsPointXY(east, north), 1)
        found.append([east, north, value if inside and value == value else None])
    return found


# The same folder twice: the second time from other positions, without lines, on a terrain of another extent.
again = {"RELEASES": f"{WORK}/memory.gpkg", "FRICTION": 0.25, "FIDELITY": "draft", "TIME_LIMIT_S": 4.0, "SEED": 3}
again |= {"OUTPUT": f"{WORK}/again", "OVERWRITE": True}
run("slidelogs", DEM=dem, LINES=f"{SAMPLE}/sample.gpkg|layername=lines", **again)
shown: dict[str, Any] = {name: f"{WORK}/again/{name}.tif" for name in ("hit_count", "jump_max", "danger")}
shown |= {name: f"{WORK}/again/run.gpkg|layername={name}" for name in ("deposits", "reach")}
for name, uri in shown.items():
    added = QgsRasterLayer(uri, name) if uri.endswith(".tif") else QgsVectorLayer(uri, name, "ogr")
    shown[name] = project.addMapLayer(added)
first = {name: cells_of(shown[name]) for name in ("hit_count", "jump_max")}
outcomes["again"] = run_as_a_dialog_does("slidelogs", DEM=f"{WORK}/window.tif", **again | {"FRICTION": 0.4})
outcomes["again"] |= {
    "first": first,
    "second": {name: cells_of(shown[name]) for name in first},
    "extent": [shown["hit_count"].extent().xMinimum(), shown["hit_count"].extent().yMaximum()],
    "deposits": [each["runout_m"] for each in shown["deposits"].getFeatures()],
    "left": sorted(
        layer.name() for layer in project.mapLayers().values() if layer.source().startswith(f"{WORK}/again/")
    ),
}


def legend_of(source: str) -> list[str]:
    """What the legend of a layer shows, with the style that is stored for it."""
    raster = source.endswith(".tif")
    layer = QgsRasterLayer(source, "a") if raster else QgsVectorLayer(source, "a", "ogr")
    stored_style.apply(layer)
    if raster:
        return [label for label, _ in layer.renderer().legendSymbologyItems()]
    return [each.label() for each in layer.renderer().legendSymbolItems()]


places = [f"{WORK}/run/run.gpkg|layername={name}" for name in ("reach", "deposits")]
places += [f"{WORK}/run/jump_max.tif", f"{SAMPLE}/sample.gpkg|layername=release_area"]
outcomes["legends"] = {"en": [legend_of(each) for each in places]}
language.catalogue = lambda: gettext.translation("plugin", language.LOCALE, ["it"])
outcomes["legends"]["it"] = [legend_of(each) for each in places]
heard = child.Ears(QgsProcessingFeedback(False))
texts: list[str] = []
heard.feedback.setProgressText = texts.append
for event in ({"done": 1}, {"done": 2, "rate_per_s": 0.0762, "left_s": 13.0}):
    heard.spoke = 0.0
    known = {
        "event": "progress",
        "what": "road: counting hits",
        "total": 3,
        "rate_per_s": None,
        "left_s": None,
        **event,
    }
    heard.hear(json.dumps(known).encode() + b"\n", b"")
outcomes["progress"] = texts
outcomes["tags"] = registry.algorithmById("deadwood:slidelogs").tags()
outcomes["titles"] = [language.title_of(each) for each in ("run.gpkg|layername=tree_hits", "jump_max.tif")]
outcomes["about"] = about
print("JSON" + json.dumps(outcomes, default=str), flush=True)
os._exit(0)  # QGIS's own cleanup at exit is not tested
