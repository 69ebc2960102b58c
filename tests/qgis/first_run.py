"""Run by QGIS with its window (``qgis --code``): the first run of a newcomer, with checks and screenshots on the way.

Environment: SAMPLE, WORK (folders), SHOTS (folder of the pictures; without it none is taken), FULL (1: also the slow
3-D view). Leaves WORK/seen.json: what was in the toolbox, the dialog, the log and the map.
"""

from __future__ import annotations

import json
import os
import re
import traceback
from collections.abc import Iterator
from typing import Any

import processing
from qgis.core import QgsApplication, QgsLayoutExporter, QgsProject, QgsRasterLayer, QgsVectorLayer
from qgis.PyQt.QtCore import QTimer
from qgis.PyQt.QtWidgets import (
    QApplication,
    QDockWidget,
    QLabel,
    QLineEdit,
    QListWidget,
    QPushButton,
    QTextEdit,
    QTreeView,
)
from qgis.utils import iface, plugins

SAMPLE, WORK, SHOTS = os.environ["SAMPLE"], os.environ["WORK"], os.environ.get("SHOTS", "")
WAIT_MS = 300_000
seen: dict[str, Any] = {}


def picture(name: str, window: Any) -> None:
    if SHOTS:
        QApplication.processEvents()
        window.grab().save(f"{SHOTS}/{name}.png")


def without_times(dialog: Any) -> None:
    """Remove from the log what depends on the load of the machine that makes the picture, not on the tool."""
    log = next(each for each in dialog.findChildren(QTextEdit) if "Results:" in each.toPlainText())
    html = re.sub(r"Execution completed in [\d.]+ seconds?( \([^)]*\))?", "Execution completed", log.toHtml())
    log.setHtml(re.sub(r"[^<>]*\d/s, [^<>]* left(<br ?/>)?", "", html))
    log.verticalScrollBar().setValue(log.verticalScrollBar().maximum())


def drawn() -> Iterator[int]:
    """Until the map has been drawn."""
    yield 500
    while iface.mapCanvas().isDrawing():
        yield 200


def dock(name: str) -> QDockWidget:
    return next(each for each in iface.mainWindow().findChildren(QDockWidget) if each.objectName() == name)


def tree_of(group: Any) -> list[dict[str, Any]]:
    """The layer tree, with what matters of each layer's look."""
    rows = []
    for node in group.children():
        if not hasattr(node, "layer"):
            rows.append({"group": node.name(), "layers": tree_of(node)})
            continue
        layer = node.layer()
        facts = {"name": node.name(), "shown": node.isVisible(), "valid": layer is not None and layer.isValid()}
        facts["look"] = layer.renderer().type() if layer is not None else None
        if isinstance(layer, QgsVectorLayer):
            facts["field"] = getattr(layer.renderer(), "classAttribute", lambda: None)()
            facts["temporal"] = layer.temporalProperties().isActive()
            facts["solid"] = layer.renderer3D() is not None
        rows.append(facts)
    return rows


def steps() -> Iterator[int]:
    """The run, step by step; each gives the milliseconds until the next."""
    project = QgsProject.instance()
    for name in ("Browser", "MessageLog"):
        for each in iface.mainWindow().findChildren(QDockWidget):
            if each.objectName() == name:
                each.hide()
    project.addMapLayer(QgsRasterLayer(f"{SAMPLE}/dem.tif", "Terrain"))
    for layer, title in (("lines", "Road"), ("release_area", "Release area"), ("barriers", "Barriers")):
        made = QgsVectorLayer(f"{SAMPLE}/sample.gpkg|layername={layer}", title)
        made.loadDefaultStyle()
        project.addMapLayer(made)
    iface.mainWindow().resize(1160, 780)
    iface.mainWindow().move(0, 20)
    iface.zoomFull()
    yield 2500

    toolbox = dock("ProcessingToolbox")
    toolbox.show()
    toolbox.raise_()
    yield 500
    toolbox.findChild(QLineEdit).setText("deadwood")
    yield 1000
    view = toolbox.findChild(QTreeView)
    view.expandAll()
    model = view.model()
    seen["toolbox"] = {}
    for row in range(model.rowCount()):
        provider = model.index(row, 0)
        if provider.data() == "Deadwood Toolbox":
            for k in range(model.rowCount(provider)):
                child = model.index(k, 0, provider)
                names = [model.index(i, 0, child).data() for i in range(model.rowCount(child))]
                seen["toolbox"][child.data()] = names
    picture("toolbox", iface.mainWindow())
    yield 200

    ran = processing.run(
        "deadwood:samplereleases",
        {
            "AREAS": next(each for each in project.mapLayers().values() if each.name() == "Release area"),
            "DEM": f"{SAMPLE}/dem.tif",
            "COUNT": 60,
            "OUTPUT": f"{WORK}/releases.gpkg",
        },
    )
    releases = QgsVectorLayer(ran["OUTPUT"], "Released logs")
    releases.loadDefaultStyle()
    project.addMapLayer(releases)
    trees = processing.run(
        "deadwood:importtrees",
        {"TREES": f"{SAMPLE}/trees.csv", "DEM": f"{SAMPLE}/dem.tif", "OUTPUT": f"{WORK}/trees.gpkg"},
    )
    standing = QgsVectorLayer(trees["OUTPUT"], "Trees")
    standing.loadDefaultStyle()
    project.addMapLayer(standing)
    by_name = {each.name(): each for each in project.mapLayers().values()}
    dialog = processing.createAlgorithmDialog(
        "deadwood:slidelogs",
        {
            "DEM": by_name["Terrain"],
            "RELEASES": releases,
            "TREES": standing,
            "BARRIERS": by_name["Barriers"],
            "LINES": by_name["Road"],
            "FRICTION": 0.25,
            "FIDELITY": "draft",
            "TRAJECTORIES": "all",
            "QGIS_PROJECT": True,
            "OUTPUT": f"{WORK}/first_run",
        },
    )
    dialog.resize(980, 720)
    dialog.move(80, 60)
    dialog.show()
    yield 1500
    seen["dialog"] = dialog.windowTitle()
    seen["labels"] = [each.text() for each in dialog.findChildren(QLabel)]
    picture("dialog", dialog)
    report = processing.createAlgorithmDialog("deadwood:makereport", {"RUNS": f"{WORK}/one,{WORK}/other"})
    report.resize(980, 560)
    report.show()
    yield 1000
    listed = report.findChild(QListWidget, "deadwoodFolders")
    seen["runs"] = [listed.item(k).text() for k in range(listed.count())]
    seen["runs_value"] = report.createProcessingParameters()["RUNS"]
    picture("runs", report)
    report.close()
    plugins["deadwood"].set_up()
    yield 800
    setup = plugins["deadwood"].dialog
    seen["setup"] = [each.text() for each in setup.findChildren(QPushButton) if each.isVisible()]
    picture("setup", setup)
    setup.hide()
    plugins["deadwood"].design()
    yield 1500
    designer = plugins["deadwood"].designers[0]
    seen["steps"] = sorted(each for each in designer.model().childAlgorithms())
    picture("model", designer)
    designer.hide()
    yield 300
    finished: list[bool] = []
    dialog.algorithmFinished.connect(lambda worked, results: finished.append(worked))
    dialog.runAlgorithm()
    for _ in range(WAIT_MS // 200):
        if finished:
            break
        yield 200
    yield 2000
    seen["worked"] = bool(finished) and bool(finished[0])
    without_times(dialog)
    picture("log", dialog)
    dialog.close()
    yield 500

    toolbox.hide()
    seen["tree"] = tree_of(project.layerTreeRoot())
    iface.mapCanvas().setExtent(by_name["Terrain"].extent())
    iface.mapCanvas().zoomByFactor(0.75)
    yield 3000
    yield from drawn()
    picture("results", iface.mainWindow())
    yield 500
    iface.addProject(f"{WORK}/first_run/project.qgz")
    yield 4000
    seen["project"] = tree_of(QgsProject.instance().layerTreeRoot())
    seen["complaints"] = [f"{each.title()}: {each.text()}" for each in iface.messageBar().items()]
    if SHOTS:
        settings = QgsLayoutExporter.ImageExportSettings()
        settings.dpi = 100
        sheets = QgsProject.instance().layoutManager().layouts()
        sheet = next(each for each in sheets if each.name().endswith("landscape"))
        QgsLayoutExporter(sheet).exportToImage(f"{SHOTS}/layout.png", settings)
    controller = iface.mapCanvas().temporalController()
    seen["frames"] = controller.totalFrameCount()
    views = [each for each in iface.mainWindow().findChildren(QDockWidget) if each.windowTitle() == "Logs in 3D"]
    seen["views"] = len(views)
    layers = dock("Layers")
    seen["covered"] = [each.isFloating() or not layers.isVisible() for each in views]
    if SHOTS:
        yield 6000
        yield from drawn()
        whole = QApplication.primaryScreen().grabWindow(0)
        whole.copy(iface.mainWindow().frameGeometry()).save(f"{SHOTS}/opened.png")
    for each in views:
        each.hide()
    if SHOTS:
        dock("Temporal Controller").show()
        iface.messageBar().clearWidgets()
        controller.setCurrentFrameNumber(24)
        yield 4000
        yield from drawn()
        picture("animation", iface.mainWindow())
        for each in views if os.environ.get("FULL") else []:
            each.setFloating(True)  # otherwise it is no wider than when docked
            each.show()
            each.resize(1160, 780)
            each.move(20, 40)
            yield 30_000
            # What OpenGL draws is only on the screen, not in the widget.
            shot = QApplication.primaryScreen().grabWindow(0)
            shot.copy(each.frameGeometry()).save(f"{SHOTS}/view_3d.png")


def go(run: Iterator[int]) -> None:
    try:
        QTimer.singleShot(next(run), lambda: go(run))
        return
    except StopIteration:
        pass
    except Exception:
        seen["error"] = traceback.format_exc()
    with open(f"{WORK}/seen.json", "w", encoding="utf-8") as target:
        json.dump(seen, target, default=str, indent=1)
    os._exit(0)


seen["qgis"] = QgsApplication.applicationName()
QTimer.singleShot(2500, lambda: go(steps()))
