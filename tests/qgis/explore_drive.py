"""Run by QGIS with its window (``qgis --code``): the panel Explore, with a real mouse, and all that can go wrong.

Environment: SAMPLE, WORK (folders), SHOTS (folder of pictures; without it none is taken). WORK holds trees.gpkg.
Leaves WORK/seen.json.
"""

from __future__ import annotations

import json
import os
import re
import signal
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import qgis.utils
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsMarkerSymbol,
    QgsPointXY,
    QgsProject,
    QgsRasterLayer,
    QgsRectangle,
    QgsSingleSymbolRenderer,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QPoint, Qt, QTimer
from qgis.PyQt.QtGui import QColor
from qgis.PyQt.QtTest import QTest
from qgis.PyQt.QtWidgets import QAction, QApplication, QDockWidget, QFileDialog
from qgis.utils import iface

SAMPLE, WORK, SHOTS = os.environ["SAMPLE"], os.environ["WORK"], os.environ.get("SHOTS", "")
WAIT_MS = 120_000
PLACE = QgsPointXY(2_786_172.0, 1_196_320.0)  # in the forest, above the road
LOGS = 150
seen: dict[str, Any] = {}
canvas, project = iface.mapCanvas(), QgsProject.instance()
dialogs: list[str] = []  # what the next file dialogs return


def answered_dialog(*_: Any) -> tuple[str, str]:
    return dialogs.pop(0), ""


QFileDialog.getSaveFileName = answered_dialog


def picture(name: str) -> None:
    if SHOTS:
        QApplication.processEvents()
        iface.mainWindow().grab().save(f"{SHOTS}/{name}.png")


def until(holds: Callable[[], Any], what: str) -> Iterator[int]:
    end = time.monotonic() + WAIT_MS / 1000.0
    while not holds():
        if time.monotonic() > end:
            raise TimeoutError(f"{what}; the panel says: {panel().form.state.text() if panels() else 'no panel'}")
        yield 10


def panels() -> list[Any]:
    return [each for each in iface.mainWindow().findChildren(QDockWidget) if each.objectName() == "DeadwoodExplore"]


def panel() -> Any:
    return panels()[-1]


def press(widget: Any) -> None:
    """A real click; a check box reacts on its box."""
    panel().form.ensureWidgetVisible(widget)
    QApplication.processEvents()
    QTest.mouseClick(widget, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, QPoint(8, widget.height() // 2))


def pixel_of(point: QgsPointXY) -> QPoint:
    move = QgsCoordinateTransform(QgsCoordinateReferenceSystem("EPSG:2056"), project.crs(), project)
    place = canvas.getCoordinateTransform().transform(move.transform(point))
    return QPoint(round(place.x()), round(place.y()))


def click(point: QgsPointXY = PLACE) -> None:
    where = pixel_of(point)
    QTest.mouseClick(canvas.viewport(), Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, where)


def final() -> bool:
    base = panel().base
    return base is not None and base.facts["final"] and base.facts["id"] == panel().asked


def children() -> list[int]:
    """The processes of the toolbox that this QGIS has started, and theirs."""

    def below(parent: int) -> list[int]:
        found = []
        for place in Path("/proc").iterdir():
            try:
                fields = (place / "stat").read_text().rpartition(")")[2].split() if place.name.isdigit() else ["Z", "0"]
            except OSError:
                continue
            if int(fields[1]) == parent and fields[0] != "Z":
                found += [int(place.name), *below(int(place.name))]
        return found

    def is_ours(pid: int) -> bool:
        try:
            return b"--stdio" in Path(f"/proc/{pid}/cmdline").read_bytes()
        except OSError:
            return False

    return [pid for pid in below(os.getpid()) if is_ours(pid)]


def misplaced(hits: Any) -> dict[str, Any]:
    """Cells in the view whose middle is drawn although nothing hit them, or vice versa."""
    overlay = panel().overlay
    overlay.put(replace(hits, ends={}), max(hits.counts))
    overlay.circle([], hits.crs)
    canvas.viewport().repaint()
    move = QgsCoordinateTransform(hits.crs, project.crs(), project)
    drawn, wrong, looked, hit = overlay.drawn, 0, 0, 0
    for row in range(0, hits.rows, 3):
        for column in range(0, hits.columns, 3):
            place = move.transform(QgsPointXY(*hits.place(column + 0.5, row + 0.5)))
            spot = canvas.getCoordinateTransform().transform(place)
            x, y = int(spot.x()), int(spot.y())
            if 0 <= x < drawn.width() and 0 <= y < drawn.height():
                looked += 1
                is_hit = hits.counts[row * hits.columns + column] > 0
                hit += is_hit
                wrong += is_hit != (QColor(drawn.pixelColor(x, y)).alpha() > 0)
    return {"looked": looked, "hit": hit, "wrong": wrong, "pixels_a_cell": pixels_a_cell(hits, move)}


def pixels_a_cell(hits: Any, move: Any) -> float:
    a, b = (canvas.getCoordinateTransform().transform(move.transform(QgsPointXY(*hits.place(c, 0)))) for c in (0, 10))
    return a.distance(b) / 10.0


def open_panel(trees: Any) -> None:
    next(
        each for each in iface.mainWindow().findChildren(QAction) if each.objectName() == "deadwoodExploreOpen"
    ).trigger()
    by_name = {each.name(): each for each in project.mapLayers().values()}
    shown = panel()
    shown.form.layers["dem"].setLayer(by_name["Terrain"])
    shown.form.layers["lines"].setLayer(by_name["Road"])
    if trees is not None:
        shown.form.layers["trees"].setLayer(trees)
    shown.form.n.setValue(LOGS)


def fill_project() -> Any:
    project.addMapLayer(QgsRasterLayer(f"{SAMPLE}/dem.tif", "Terrain"))
    project.addMapLayer(QgsVectorLayer(f"{SAMPLE}/sample.gpkg|layername=lines", "Road"))
    trees = QgsVectorLayer(f"{WORK}/trees.gpkg|layername=trees", "Trees")
    looks = {"color": "#5b7f4f", "size": "1.4", "outline_style": "no"}
    trees.setRenderer(QgsSingleSymbolRenderer(QgsMarkerSymbol.createSimple(looks)))
    project.addMapLayer(trees)
    project.setCrs(QgsCoordinateReferenceSystem("EPSG:2056"))
    return trees


def zoom() -> None:
    move = QgsCoordinateTransform(QgsCoordinateReferenceSystem("EPSG:2056"), project.crs(), project)
    canvas.setExtent(move.transformBoundingBox(QgsRectangle(2_786_040, 1_195_995, 2_786_300, 1_196_420)))
    canvas.refresh()


def steps() -> Iterator[int]:
    for each in iface.mainWindow().findChildren(QDockWidget):
        if each.objectName() in ("Browser", "MessageLog"):
            each.hide()
    iface.mainWindow().resize(1380, 860)
    iface.mainWindow().move(0, 20)
    trees = fill_project()
    open_panel(trees)
    zoom()
    yield 1500
    press(panel().form.release)
    yield from until(lambda: panel().scene is not None, "the scene was not loaded")
    seen["children_at_work"] = len(children())

    # A click gives a picture and a reach.
    drawn: list[float] = []
    panel().overlay.shown = lambda: drawn.append(time.monotonic())
    click()
    yield from until(final, "the click was not answered")
    for name in ("first", "again"):
        panel().overlay.shown = None
        yield 300
        drawn.clear()
        began = time.monotonic()
        panel().overlay.shown = lambda: drawn.append(time.monotonic())
        click()
        yield from until(lambda: final() and drawn, "the click was not answered")
        seen[f"seconds_{name}"] = [drawn[0] - began, time.monotonic() - began]
    panel().overlay.shown = None
    yield 300
    hits, _ = panel().shown_hits()
    seen["click"] = {
        "answer": panel().form.answer.text(),
        "legend": panel().form.legend.text(),
        "state": panel().form.state.text(),
        "reach": panel().base.facts["reach"],
        "sum": sum(hits.counts),
    }

    # Only the latest of many clicks is answered.
    for k in range(12):
        click(QgsPointXY(PLACE.x() + 3.0 * k, PLACE.y()))
    yield from until(final, "the last click was not answered")
    seen["latest"] = {"id": panel().base.facts["id"], "asked": panel().asked, "messages": panel().number}

    # Felling the selected trees.
    click()
    yield from until(final, "the click was not answered")
    yield 300
    state = panel().form.state  # the time taken depends on the machine
    state.setText(re.sub(r", [\d.]+ s$", "", state.text()))
    picture("explore")
    x, y = PLACE.x(), PLACE.y()
    trees.selectByRect(QgsRectangle(x - 25.0, y - 120.0, x + 25.0, y - 15.0))
    yield 100
    seen["felled_text"] = panel().form.felled.text()
    press(panel().form.felled)
    yield from until(lambda: panel().changed and panel().changed.facts["final"], "felling was not answered")
    east, north = panel().scene.trees
    chosen = sorted((each.geometry().asPoint().x(), each.geometry().asPoint().y()) for each in trees.selectedFeatures())
    found = sorted((panel().scene.west + east[k], panel().scene.south + north[k]) for k in panel().fell)
    seen["felled"] = {
        "selected": chosen,
        "found": found,
        "text": panel().form.difference.text(),
        "lines": panel().changed.facts["lines"],
        "after": [panel().form.after.isVisible(), panel().form.after.isChecked()],
        "done": panel().changed.facts["done"],
    }
    yield 300
    picture("felled")

    # Keep the hits, and save as run.
    dialogs.append(f"{WORK}/kept")
    press(panel().form.keep_hits)
    yield 200
    kept = next(each for each in project.mapLayers().values() if each.name().startswith("Hits of"))
    seen["kept"] = {"name": kept.name(), "valid": kept.isValid(), "look": kept.renderer().type()}
    press(panel().form.after)
    yield 200
    dialogs.append(f"{WORK}/kept_before.tif")
    press(panel().form.keep_hits)
    press(panel().form.after)
    dialogs.append(f"{WORK}/run")
    press(panel().form.keep_run)

    def run_dialogs() -> list[Any]:
        return [each for each in QApplication.topLevelWidgets() if each.objectName() == "deadwoodExploreRun"]

    yield from until(run_dialogs, "the dialog did not open")
    dialog = run_dialogs()[0]
    yield 500
    picture("run_dialog")
    finished: list[bool] = []
    dialog.algorithmFinished.connect(lambda worked, results: finished.append(worked))
    dialog.runAlgorithm()
    yield from until(lambda: finished, "the run did not finish")
    seen["run"] = {"title": dialog.windowTitle(), "worked": bool(finished[0])}
    dialog.close()
    yield 1000
    for each in list(project.mapLayers().values()):
        if each.name() not in ("Terrain", "Road", "Trees"):
            project.removeMapLayer(each.id())

    # The engine is killed while it answers.
    press(panel().form.felled)
    yield from until(lambda: not panel().fell, "the trees do not stand again")
    press(panel().form.felled)
    yield from until(lambda: panel().changed and panel().changed.facts["final"], "felling was not answered")
    panel().form.n.setValue(3000)
    old = children()
    yield from until(lambda: panel().base.facts["id"] == panel().asked, "no first picture")
    seen["killed_at"] = panel().base.facts["done"]
    for pid in old:
        os.kill(pid, signal.SIGKILL)
    yield from until(lambda: panel().scene is None, "its end was not noticed")
    yield from until(lambda: panel().scene is not None, "it was not started again")
    panel().form.n.setValue(LOGS)
    yield from until(lambda: final() and panel().changed and panel().changed.facts["final"], "not asked again")
    seen["restarted"] = {
        "said": iface.messageBar().currentItem().text(),
        "others": not set(old) & set(children()),
        "felled": len(panel().fell),
        "lines": panel().changed.facts["lines"],
    }
    press(panel().form.felled)
    yield 300

    # The project in other CRSs.
    for crs, angle in (("EPSG:2056", 0.0), ("EPSG:4326", 0.0), ("EPSG:3035", 25.0)):
        project.setCrs(QgsCoordinateReferenceSystem(crs))
        zoom()
        canvas.setRotation(angle)
        yield 1000
        click()
        yield from until(final, f"not answered in {crs}")
        yield 800
        picture(crs.replace(":", "_"))
        hits, _ = panel().shown_hits()
        center = QgsCoordinateTransform(hits.crs, project.crs(), project).transform(
            QgsPointXY(*hits.place(hits.columns / 2, hits.rows / 2))
        )
        canvas.setCenter(center)
        canvas.zoomScale(canvas.scale() / 6.0)
        yield 800
        seen[crs] = misplaced(hits)
        canvas.setRotation(0.0)
    project.setCrs(QgsCoordinateReferenceSystem("EPSG:2056"))
    zoom()
    yield 800

    # A layer is removed, then the terrain model.
    old = children()
    project.removeMapLayer(trees.id())
    yield from until(lambda: not set(old) & set(children()), "the engine went on with the layer")
    yield from until(final, "no answer without the layer")
    seen["layer_gone"] = {
        "said": iface.messageBar().currentItem().text(),
        "chosen": panel().form.layer("trees") is not None,
        "reach": panel().base.facts["reach"],
    }
    road = next(each for each in project.mapLayers().values() if each.name() == "Road")
    project.removeMapLayer(next(each.id() for each in project.mapLayers().values() if each.name() == "Terrain"))
    yield from until(lambda: not children(), "the engine went on without a terrain model")
    seen["terrain_gone"] = {"said": panel().form.state.text(), "shown": panel().overlay.hits is not None}
    project.addMapLayer(QgsRasterLayer(f"{SAMPLE}/dem.tif", "Terrain"))
    panel().form.layers["lines"].setLayer(road)
    panel().form.layers["dem"].setLayer(next(each for each in project.mapLayers().values() if each.name() == "Terrain"))
    press(panel().form.release)
    yield from until(lambda: panel().scene is not None, "not loaded again")
    click()
    yield from until(final, "no answer with another terrain model")

    # Closing the panel.
    panel().close()
    yield from until(lambda: not children(), "the engine lives on without the panel")
    seen["closed"] = {"shown": panel().overlay.hits is not None, "tool": canvas.mapTool() is panel().tool}

    # A place outside the terrain, and a terrain that the tool refuses.
    open_panel(None)
    press(panel().form.release)
    yield from until(lambda: panel().scene is not None, "not loaded again")
    click(QgsPointXY(2_786_000.0 - 200.0, 1_196_200.0))
    yield from until(lambda: "terrain model" in panel().form.state.text(), "the place was not refused")
    seen["off_the_terrain"] = panel().form.state.text()

    # Another project.
    click()
    yield from until(final, "no answer before the project closes")
    iface.newProject(False)
    yield from until(lambda: not children(), "the engine lives on without the project")
    seen["project_closed"] = {"shown": panel().overlay.hits is not None, "base": panel().base is not None}

    # The plugin is unloaded while the engine is at work, and loaded again.
    trees = fill_project()
    open_panel(trees)
    zoom()
    yield 1000
    press(panel().form.release)
    yield from until(lambda: panel().scene is not None, "not loaded again")
    qgis.utils.unloadPlugin("deadwood")
    yield from until(lambda: not children(), "the engine lives on without the plugin")
    yield 300
    seen["unloaded"] = len(panels())
    qgis.utils.loadPlugin("deadwood")
    qgis.utils.startPlugin("deadwood")
    open_panel(trees)
    press(panel().form.release)
    yield from until(lambda: panel().scene is not None, "not loaded again")
    seen["left_behind"] = children()  # QGIS is killed now, and they must end, too


def go(run: Iterator[int]) -> None:
    try:
        QTimer.singleShot(next(run), lambda: go(run))
        return
    except StopIteration:
        pass
    except Exception:
        seen["error"] = traceback.format_exc()
        picture("error")
    with open(f"{WORK}/seen.json", "w", encoding="utf-8") as target:
        json.dump(seen, target, default=str, indent=1)
    os._exit(0)


QTimer.singleShot(2500, lambda: go(steps()))
