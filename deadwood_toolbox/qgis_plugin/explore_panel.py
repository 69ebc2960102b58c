"""The panel "Explore": click on the map, and logs slide from there; select trees, and see what felling them changes.

A process of the toolbox stays behind the panel and answers within a second. A request replaces one that is still being
answered; nothing here waits for the process.
"""

from __future__ import annotations

import os
import shutil
from typing import Any

from qgis.core import (
    QgsCsException,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingUtils,
    QgsProject,
    QgsVectorLayer,
)
from qgis.gui import QgsMapTool
from qgis.PyQt.QtCore import Qt, QTimer
from qgis.PyQt.QtWidgets import QDockWidget, QFileDialog

from .algorithm import ToolAlgorithm
from .explore_child import Engine, Frame, Heard
from .explore_form import Form
from .explore_overlay import Hits, Overlay, saved_layer
from .explore_scene import Scene
from .explore_words import Words
from .inputs import Inputs
from .language import _, signs, translated
from .overlap import check_places

RESTART_MS = 400  # after a change of layers, so that several changes are one restart
MOST_DEATHS = 3  # after so many deaths without an answer in between, the process is not started again


class Panel(QDockWidget):
    def __init__(self, iface: Any, manifest: dict[str, Any]) -> None:
        super().__init__(_("Explore: sliding logs"))
        self.setObjectName("DeadwoodExplore")
        self.iface, self.canvas = iface, iface.mapCanvas()
        self.declaration = translated(next(each for each in manifest["tools"] if each["name"] == "explore"))
        self.words = Words(manifest["explore"])
        self.overlay = Overlay(self.canvas, manifest["explore"])
        self.engine: Engine | None = None
        self.scene: Scene | None = None
        # numbers of the last message, the last release and the last edit
        self.number, self.asked, self.edited = 0, 0, 0
        self.deaths = 0
        self.question: dict[str, Any] = {}  # the latest request, and the one whose answer is on the map
        self.answered: dict[str, Any] = {}
        self.place: Any = None  # where logs start, in the CRS of the map that was clicked, and that CRS
        self.fell: list[int] = []
        self.base: Frame | None = None  # the answers that are shown
        self.changed: Frame | None = None
        self.watched: list[QgsVectorLayer] = []
        self.loaded: dict[str, str] = {}  # names of the scene's layers by their ids
        self.run_folder = ""  # where the run that is being saved shall be
        self.folder = ""
        self.dialogs: list[Any] = []
        declared = {each["name"]: each for each in self.declaration["parameters"]}
        self.form = form = Form(declared, self.words, manifest["explore"]["friction"])
        self.setWidget(form)
        self.tool = ReleaseTool(self)
        self.tool.deactivated.connect(lambda: form.release.setChecked(False))
        form.layers_changed.connect(self._layers_change)
        form.question_changed.connect(self.ask)
        form.release.toggled.connect(self._use_tool)
        form.felled.toggled.connect(self._fell_changes)
        form.after.toggled.connect(self._draw)
        form.keep_hits.clicked.connect(self._keep_hits)
        form.keep_run.clicked.connect(self._keep_run)
        form.clear.clicked.connect(self.forget)
        self.again = QTimer(self)
        self.again.setSingleShot(True)
        self.again.timeout.connect(self._start)
        project = QgsProject.instance()
        project.layersWillBeRemoved.connect(self._layers_go)
        project.cleared.connect(self._project_closes)

    # --- the process -------------------------------------------------------------------------------------------------

    def _start(self) -> None:
        """Start the engine on the layers that are chosen; a wrong one is reported."""
        self._end()
        if self.form.layer("dem") is None:
            self.tell(_("Choose a terrain model."))
            return
        try:
            arguments = self._arguments()
            self.engine = Engine()
            self.engine.answered.connect(self._take)
            self.engine.loading.connect(self._loads)
            self.engine.died.connect(self._died)
            self.tell(_("Loading the scene …"))
            self.engine.start(arguments)
        except QgsProcessingException as error:
            self.engine = None
            self.tell(str(error))

    def _arguments(self) -> list[str]:
        """The words of the command, made as in the dialogs: data that are not in a file are saved for the tool."""
        algorithm = ToolAlgorithm(self.declaration)
        algorithm.initAlgorithm()
        context, heard = QgsProcessingContext(), Heard(self.tell)
        context.setProject(QgsProject.instance())
        self.folder = QgsProcessingUtils.generateTempFilename("explored")
        chosen = {name.upper(): layer for name, layer in self.form.chosen().items()}
        inputs = Inputs(algorithm, {**chosen, "OUTPUT": self.folder}, context, heard)
        inputs.collect(self.declaration["parameters"])
        check_places(inputs, context, heard)
        inputs.write_copies(heard)
        self._watch()
        self.loaded = {layer.id(): layer.name() for layer in chosen.values()}
        return inputs.arguments

    def _loads(self, what: str) -> None:
        if self.scene is None:
            self.tell(_("Loading the scene: {what} …").format(what=what))

    def _watch(self) -> None:
        """Watch the chosen layers: saved edits or a new filter change the scene."""
        self._unwatch()
        for name, layer in self.form.chosen().items():
            if isinstance(layer, QgsVectorLayer):
                layer.afterCommitChanges.connect(self._layers_change)
                layer.subsetStringChanged.connect(self._layers_change)
                if name == "trees":
                    layer.selectionChanged.connect(self._selection_changes)
                self.watched.append(layer)

    def _unwatch(self) -> None:
        for layer in self.watched:
            try:
                layer.afterCommitChanges.disconnect(self._layers_change)
                layer.subsetStringChanged.disconnect(self._layers_change)
                layer.selectionChanged.disconnect(self._selection_changes)
            except (RuntimeError, TypeError):  # the layer is gone, or its selection was not watched
                pass
        self.watched = []

    def _end(self) -> None:
        engine, self.engine, self.scene = self.engine, None, None
        if engine is not None:
            engine.end()

    def _died(self, why: str) -> None:
        loaded = self.scene is not None
        self._end()
        self.deaths += 1
        if not loaded or self.deaths > MOST_DEATHS:
            self.tell(why or _("The calculation stopped unexpectedly. Click on the map to start it again."))
            return
        self.warn(self.words.say("restarted"))
        self._start()

    def stop(self) -> None:
        """End the process and take everything off the map."""
        self.again.stop()
        self._end()
        self._unwatch()
        self.loaded = {}
        self.forget()
        if self.canvas.mapTool() is self.tool:
            self.canvas.unsetMapTool(self.tool)

    def closeEvent(self, event: Any) -> None:
        self.stop()
        self.tell("")
        super().closeEvent(event)

    def remove(self) -> None:
        """Called before the plugin is unloaded."""
        self.stop()
        project = QgsProject.instance()
        project.layersWillBeRemoved.disconnect(self._layers_go)
        project.cleared.disconnect(self._project_closes)
        self.canvas.scene().removeItem(self.overlay)

    # --- what happens in QGIS ----------------------------------------------------------------------------------------

    def _use_tool(self, on: bool) -> None:
        if on:
            self.canvas.setMapTool(self.tool)
            if self.engine is None:
                self._start()
        elif self.canvas.mapTool() is self.tool:
            self.canvas.unsetMapTool(self.tool)

    def _layers_change(self, *_signal: Any) -> None:
        """The scene has changed: the displayed results do not belong to it."""
        self._refresh()
        if self.engine is not None:
            self._end()
            self._show_nothing()
            self.again.start(RESTART_MS)
        elif self.form.release.isChecked():
            self.again.start(RESTART_MS)

    def _layers_go(self, ids: list[str]) -> None:
        """Layers of the scene are removed: it is loaded without them, and cannot be without a terrain model."""
        gone = [name for layer, name in self.loaded.items() if layer in ids]
        if not gone:
            return
        self.loaded = {layer: name for layer, name in self.loaded.items() if layer not in ids}
        dem = self.form.layer("dem")
        if dem is None or dem.id() in ids:
            self.stop()
            self.tell(_("The terrain model was removed."))
        else:
            message = _("No longer in the scene, because it was removed: {layers}.")
            self.warn(message.format(layers=", ".join(gone)))
            self._layers_change()

    def _project_closes(self) -> None:
        self.stop()
        self.tell("")

    def _selection_changes(self, *_signal: Any) -> None:
        self._refresh()
        if self.form.felled.isChecked():
            self._fell_changes()

    def _fell_changes(self, *_signal: Any) -> None:
        """The selected trees are felled, or stand again."""
        self._refresh()
        trees = self.form.layer("trees")
        if self.scene is None or self.engine is None or not isinstance(trees, QgsVectorLayer):
            return
        unknown = 0
        before, self.fell = self.fell, []
        if self.form.felled.isChecked():
            self.fell, unknown = self.scene.trees_of(trees)
        if unknown:
            message = _("{n} of the selected trees are not in the scene: they stand off the terrain model.")
            self.warn(message.format(n=unknown))
        if self.fell == before:
            return
        self.changed = None
        self._send_edit()
        self._draw()

    # --- questions ---------------------------------------------------------------------------------------------------

    def clicked(self, point: Any, *, moving: bool = False) -> None:
        """Release logs at this place of the map."""
        self.place = point, self.canvas.mapSettings().destinationCrs()
        self.ask(moving=moving)

    def ask(self, *_signal: Any, moving: bool = False) -> None:
        """Send a request with the present values; few logs while the mouse moves."""
        if self.place is None:
            return
        if self.engine is None:
            self.again.stop()
            self._start()
        if self.scene is None or self.engine is None:
            return  # requested once the scene is loaded
        radius = self.form.radius.value()
        try:
            x, y = self.scene.local(*self.place)
        except QgsCsException:
            self.tell(self.words.say("outside"))
            return
        self.overlay.circle(self.scene.circle(x, y, radius), self.scene.crs)
        self.number += 1
        self.asked = self.number
        self.question = self.form.question()
        shape = {"circle": [x, y, radius]}
        self.engine.ask({"op": "release", "id": self.number, "shape": shape, "preview": moving, **self.question})

    def _send_edit(self) -> None:
        if self.engine is not None:
            self.number += 1
            self.edited = self.number
            self.engine.ask({"op": "edit", "id": self.number, "fell": self.fell})

    # --- answers -----------------------------------------------------------------------------------------------------

    def _take(self, frame: Frame) -> None:
        what, number = frame.facts["op"], frame.facts.get("id")
        if what == "ready" and self.engine is not None:
            self.engine.ask({"op": "open"})
        elif what == "scene":
            self._opened(frame)
        elif what == "hits" and number == self.asked:
            self.base, self.answered = frame, self.question
            if not self.fell:
                self.changed = None
            self._answered(frame)
        elif what == "difference" and number == max(self.asked, self.edited) and self.fell:
            self.changed = frame
            self._answered(frame)
        elif what == "kept":
            self._kept(frame.facts)
        elif what == "refused":
            self.tell(frame.facts["text"])

    def _opened(self, frame: Frame) -> None:
        dem = self.form.layer("dem")
        if dem is None:
            return
        self.scene = Scene(frame, dem.crs())
        self.form.bound(frame.facts["limits"])
        for each in self.engine.heard.warnings if self.engine is not None else []:
            self.warn(each)
        self.tell(self.words.say("ask_first"))
        self.fell = []
        self._fell_changes()
        self.ask()

    def _answered(self, frame: Frame) -> None:
        self.deaths = 0
        facts = frame.facts
        if facts["final"]:
            seconds = signs(f"{facts['ms'] / 1000.0:.2f}")
            self.tell(self.words.say("counted", done=facts["done"], fidelity=facts["fidelity"], ms=seconds))
        else:
            more = {"done": facts["done"], "of": facts["n"], "fidelity": facts["fidelity"]}
            self.tell(self.words.say("counting", **more))
        self._draw()

    def _draw(self, *_signal: Any) -> None:
        """Show the available results on the map and in the panel."""
        self._refresh()
        if self.base is None or self.scene is None:
            return
        self.form.answer.setText(
            self.words.reach(self.base.facts, self.scene.names)
            + self.words.fidelity(self.scene.facts["fidelities"], self.base.facts["fidelity"])
        )
        said = self.words.difference(self.changed.facts, self.scene.names) if self.changed is not None else ""
        self.form.difference.setText(said)
        self.form.difference.setVisible(bool(said))
        self.overlay.put(*self.shown_hits())
        shown = self.changed if self.changed is not None and self.shows_felled() else self.base
        self.form.legend.setText(self.words.legend(shown.facts))

    def shown_hits(self) -> tuple[Hits, int]:
        """The hits on the map, and the number of logs."""
        if self.base is None or self.scene is None:
            raise RuntimeError("nothing has been answered yet")
        if self.changed is not None and self.shows_felled():
            return self.scene.hits(self.changed, "hits_after"), self.changed.facts["done"]
        return self.scene.hits(self.base, "hits"), self.base.facts["done"]

    def shows_felled(self) -> bool:
        return self.changed is not None and self.form.after.isChecked()

    def _show_nothing(self) -> None:
        self.base = self.changed = None
        self.overlay.put(None)
        self.form.clear_answers()
        self._refresh()

    def forget(self, *_signal: Any) -> None:
        """Forget the place, the answer and the felled trees."""
        self.place = None
        self.form.felled.setChecked(False)
        self.asked = self.edited = self.number = self.number + 1  # ignore answers that still arrive
        self._show_nothing()

    def _refresh(self) -> None:
        answered = self.base is not None and self.scene is not None
        self.form.refresh(answered=answered, compared=self.changed is not None)

    def tell(self, text: str) -> None:
        self.form.state.setText(text)

    def warn(self, text: str) -> None:
        """Show a message that the next answer must not overwrite."""
        self.iface.messageBar().pushWarning(_("Explore: sliding logs"), text)

    # --- keep --------------------------------------------------------------------------------------------------------

    def _keep_hits(self) -> None:
        if self.base is None or self.scene is None:
            return
        (hits, logs), facts = self.shown_hits(), self.base.facts
        start = os.path.join(QgsProject.instance().homePath(), "explored_hits.tif")
        path = QFileDialog.getSaveFileName(self, _("Keep hits as a layer"), start, "GeoTIFF (*.tif)")[0]
        if not path:
            return
        path += "" if path.lower().endswith((".tif", ".tiff")) else ".tif"
        felled = f", {self.words.say('felled', n=len(self.fell))}" if self.shows_felled() else ""
        name = _("Hits of {n} logs, {fidelity}").format(n=facts["done"], fidelity=facts["fidelity"]) + felled
        try:
            layer = saved_layer(hits, path, name, self.words.ramp, logs)
        except OSError as error:
            self.tell(str(error))
            return
        QgsProject.instance().addMapLayer(layer)

    def _keep_run(self) -> None:
        """Let the engine write the layers; the dialog of Slide logs opens once they exist."""
        if self.engine is None or self.base is None:
            return
        start = os.path.join(QgsProject.instance().homePath(), "explored")
        title = _("Folder of the run")
        path = QFileDialog.getSaveFileName(self, title, start, f"{title} (*)")[0]
        if not path:
            return
        taken = [each for each in (path, f"{path}_layers.gpkg") if os.path.exists(each)]
        if taken:
            self.tell(_("{path} already exists; choose another name.").format(path=taken[0]))
            return
        self.run_folder = os.path.abspath(path)
        self.number += 1
        self.engine.ask({"op": "keep", "id": self.number, "name": "run", "run": False})

    def _kept(self, facts: dict[str, Any]) -> None:
        """Slide logs with the same values, in its own dialog."""
        import processing

        beside = f"{self.run_folder}_layers.gpkg"
        try:
            shutil.move(os.path.join(self.folder, facts["files"][0]), beside)
        except OSError as error:
            self.tell(_("The layers of the run could not be written: {why}").format(why=error))
            return
        layers: dict[str, Any] = {name.upper(): layer.id() for name, layer in self.form.chosen().items()}
        layers.update({name.upper(): f"{beside}|layername={name}" for name in facts["layers"]})
        values = {name.upper(): self.answered[name] for name in ("friction", "fidelity")}
        dialog = processing.createAlgorithmDialog("deadwood:slidelogs", {**layers, **values, "OUTPUT": self.run_folder})
        dialog.setObjectName("deadwoodExploreRun")
        self.dialogs.append(dialog)  # QGIS only keeps its window; without this reference Run would do nothing
        dialog.show()
        message = _("The releases and changed layers are in {file}; run the dialog to slide them.")
        self.tell(message.format(file=beside))


class ReleaseTool(QgsMapTool):
    """Logs start where the user clicks; while the mouse is dragged, few of them, and all when it is released."""

    def __init__(self, panel: Panel) -> None:
        super().__init__(panel.canvas)
        self.panel, self.dragged = panel, False
        self.setCursor(Qt.CursorShape.CrossCursor)

    def canvasPressEvent(self, event: Any) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self.dragged = False
            self.panel.clicked(self.toMapCoordinates(event.pos()))

    def canvasMoveEvent(self, event: Any) -> None:
        if event.buttons() & Qt.MouseButton.LeftButton:
            self.dragged = True
            self.panel.clicked(self.toMapCoordinates(event.pos()), moving=True)

    def canvasReleaseEvent(self, event: Any) -> None:
        if event.button() == Qt.MouseButton.LeftButton and self.dragged:
            self.panel.clicked(self.toMapCoordinates(event.pos()))
