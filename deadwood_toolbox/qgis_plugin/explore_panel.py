"""The panel "Explore": click on the map, and logs slide from there; select trees, and see what felling them changes.

A process of the toolbox stays behind the panel and answers within a second. What is asked while an answer is on its way
replaces it; nothing here waits for the process.
"""

from __future__ import annotations

import os
import shutil
from typing import Any

from qgis.core import (
    QgsMapLayerProxyModel,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingUtils,
    QgsProject,
    QgsVectorLayer,
)
from qgis.gui import QgsMapLayerComboBox, QgsMapTool
from qgis.PyQt.QtCore import Qt, QTimer
from qgis.PyQt.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDockWidget,
    QDoubleSpinBox,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QScrollArea,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from .algorithm import ToolAlgorithm
from .explore_child import Engine, Frame, Heard
from .explore_overlay import Hits, Overlay, saved_layer
from .explore_scene import Scene
from .explore_words import Words
from .inputs import Inputs
from .language import _, translated
from .overlap import check_places

LAYERS = ("dem", "trees", "barriers", "lying_logs", "blocks", "lines")
NUMBERS = ("dbh_cm", "length_m", "friction")
KINDS = {
    "point": QgsMapLayerProxyModel.Filter.PointLayer,
    "line": QgsMapLayerProxyModel.Filter.LineLayer,
    "polygon": QgsMapLayerProxyModel.Filter.PolygonLayer,
}
RADIUS_M, LOGS = 10.0, 300
RESTART_MS = 400  # after a change of layers, so that several changes are one restart
MOST_DEATHS = 3  # of a process without an answer in between; then it is not started again


class Panel(QDockWidget):
    def __init__(self, iface: Any, manifest: dict[str, Any]) -> None:
        super().__init__(_("Explore: sliding logs"))
        self.setObjectName("DeadwoodExplore")
        self.iface, self.canvas = iface, iface.mapCanvas()
        self.told = translated(next(each for each in manifest["tools"] if each["name"] == "explore"))
        self.declared = {each["name"]: each for each in self.told["parameters"]}
        self.words = Words(manifest["explore"])
        self.overlay = Overlay(self.canvas, manifest["explore"])
        self.engine: Engine | None = None
        self.scene: Scene | None = None
        self.number, self.asked, self.edited = 0, 0, 0  # of messages: the last one, the last release, the last edit
        self.deaths = 0
        self.place: Any = None  # where logs start, in the CRS of the map that was clicked, and that CRS
        self.fell: list[int] = []
        self.base: Frame | None = None  # the answers that are shown
        self.changed: Frame | None = None
        self.watched: list[QgsVectorLayer] = []
        self.loaded: dict[str, str] = {}  # names of the scene's layers by their ids
        self.run_folder = ""  # where the run that is being saved shall be
        self.folder = ""
        self.dialogs: list[Any] = []
        self._build(manifest["explore"]["friction"])
        self.tool = ReleaseTool(self)
        self.tool.deactivated.connect(lambda: self.release.setChecked(False))
        self.again = QTimer(self)
        self.again.setSingleShot(True)
        self.again.timeout.connect(self._start)
        project = QgsProject.instance()
        project.layersWillBeRemoved.connect(self._layers_go)
        project.cleared.connect(self._project_closes)

    # --- the form ----------------------------------------------------------------------------------------------------

    def _build(self, friction: float) -> None:
        form = QFormLayout()
        form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        self.layers: dict[str, QgsMapLayerComboBox] = {}
        for name in LAYERS:
            self.layers[name] = box = QgsMapLayerComboBox()
            self._name(box, name)
            kinds = QgsMapLayerProxyModel.Filter.RasterLayer
            if name != "dem":
                first, *others = self.declared[name]["geometry"]
                kinds = KINDS[first]
                for each in others:
                    kinds = kinds | KINDS[each]
            box.setFilters(kinds)
            box.setAllowEmptyLayer(True)
            box.setLayer(None)
            box.layerChanged.connect(self._layers_change)
            _narrow(box)
            label = QLabel(self.declared[name]["label"])
            label.setWordWrap(True)
            form.addRow(label, box)
        self.n = QSpinBox()
        self.n.setRange(1, 100_000)
        self.n.setValue(LOGS)
        self.radius = self._spin("radius", 0.0, 10_000.0, RADIUS_M, 1, " m")
        form.addRow(self.words.say("q_n"), self.n)
        form.addRow(self.words.say("radius"), self.radius)
        self.numbers: dict[str, QDoubleSpinBox] = {}
        for name in NUMBERS:
            told = self.declared[name]
            unit = f" {told['unit']}" if told["unit"] else ""
            low, high = told["minimum"] or 0.0, told["maximum"] or 100.0
            start = friction if told["default"] is None else told["default"]
            self.numbers[name] = self._spin(name, low, high, start, 2 if name == "friction" else 1, unit)
            form.addRow(self.words.say(f"q_{name}"), self.numbers[name])
        self.posture, self.fidelity = QComboBox(), QComboBox()
        for box, group, start in (
            (self.posture, "posture", self.declared["orientation"]["default"]),
            (self.fidelity, "fidelity", self.declared["fidelity"]["default"] or "draft"),
        ):
            for value, text in self.words.choices(group).items():
                box.addItem(text, value)
            box.setCurrentIndex(box.findData(start))
            _narrow(box)
            box.currentIndexChanged.connect(self.ask)
            self._name(box, group)
        form.addRow(self.words.say("q_orientation"), self.posture)
        form.addRow(self.words.say("q_fidelity"), self.fidelity)
        for each in (self.n, self.radius, *self.numbers.values()):
            each.setKeyboardTracking(False)
            each.valueChanged.connect(self.ask)
        self._name(self.n, "n")

        self.release = QPushButton(_("Release logs by clicking on the map"))
        self.release.setCheckable(True)
        self.release.toggled.connect(self._use_tool)
        self.state, self.answer, self.difference = QLabel(), QLabel(), QLabel()
        self.legend = QLabel()
        self.felled = QCheckBox()
        self.felled.setToolTip(_("Select trees in their layer: the same logs slide with and without them."))
        self.felled.toggled.connect(self._fell_changes)
        self.after = QCheckBox(_("Show them felled on the map"))
        self.after.setChecked(True)
        self.after.toggled.connect(self._draw)
        self.keep_hits, self.keep_run, self.clear = (
            QPushButton(_("Keep hits…")),
            QPushButton(_("Save as run…")),
            QPushButton(_("Clear")),
        )
        self.keep_hits.clicked.connect(self._keep_hits)
        self.keep_run.clicked.connect(self._keep_run)
        self.clear.clicked.connect(self.forget)
        for each, name in (
            (self.release, "release"),
            (self.felled, "felled"),
            (self.after, "after"),
            (self.keep_hits, "keepHits"),
            (self.keep_run, "keepRun"),
            (self.clear, "clear"),
        ):
            self._name(each, name)
        buttons = QHBoxLayout()
        for each in (self.keep_hits, self.keep_run, self.clear):
            buttons.addWidget(each)
        inside = QWidget()
        column = QVBoxLayout(inside)
        column.addLayout(form)
        for each in (self.release, self.state, self.answer, self.felled, self.difference, self.after, self.legend):
            if isinstance(each, QLabel):
                each.setWordWrap(True)
            column.addWidget(each)
        column.addLayout(buttons)
        column.addStretch(1)
        scroll = QScrollArea()
        scroll.setWidgetResizable(True)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setWidget(inside)
        self.setWidget(scroll)
        scroll.setMinimumWidth(inside.minimumSizeHint().width() + scroll.verticalScrollBar().sizeHint().width() + 4)
        self._refresh()

    def _spin(self, name: str, low: float, high: float, value: float, digits: int, unit: str) -> QDoubleSpinBox:
        made = QDoubleSpinBox()
        made.setDecimals(digits)
        made.setRange(low, high)
        made.setSingleStep(10.0**-digits if digits > 1 else 1.0)
        made.setValue(value)
        made.setSuffix(unit)
        self._name(made, name)
        return made

    def _name(self, widget: QWidget, name: str) -> None:
        widget.setObjectName(f"deadwoodExplore_{name}")

    def layer(self, name: str) -> Any:
        """The layer that is chosen, or None."""
        return self.layers[name].currentLayer()

    # --- the process -------------------------------------------------------------------------------------------------

    def _start(self) -> None:
        """Start the engine on the layers that are chosen; a wrong one is said."""
        self._end()
        if self.layer("dem") is None:
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
        """The command's words, as a dialog of the toolbox makes them: what no file holds is saved for the tool."""
        algorithm = ToolAlgorithm(self.told)
        algorithm.initAlgorithm()
        context, heard = QgsProcessingContext(), Heard(self.tell)
        context.setProject(QgsProject.instance())
        self.folder = QgsProcessingUtils.generateTempFilename("explored")
        chosen = {name.upper(): self.layer(name) for name in LAYERS if self.layer(name) is not None}
        inputs = Inputs(algorithm, {**chosen, "OUTPUT": self.folder}, context, heard)
        inputs.collect(self.told["parameters"])
        check_places(inputs, context, heard)
        self._watch()
        self.loaded = {layer.id(): layer.name() for name in LAYERS if (layer := self.layer(name)) is not None}
        return inputs.arguments

    def _loads(self, what: str) -> None:
        if self.scene is None:
            self.tell(_("Loading the scene: {what} …").format(what=what))

    def _watch(self) -> None:
        """What is saved in a chosen layer later on, or filtered, makes the scene a new one."""
        self._unwatch()
        for name in LAYERS:
            layer = self.layer(name)
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
        """Before the plugin goes."""
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
        """Another scene: what is shown is not of it."""
        self._refresh()
        if self.engine is not None:
            self._end()
            self._show_nothing()
            self.again.start(RESTART_MS)
        elif self.release.isChecked():
            self.again.start(RESTART_MS)

    def _layers_go(self, ids: list[str]) -> None:
        """Layers of the scene are removed: it is loaded without them, and cannot be without a terrain model."""
        gone = [name for layer, name in self.loaded.items() if layer in ids]
        if not gone:
            return
        self.loaded = {layer: name for layer, name in self.loaded.items() if layer not in ids}
        dem = self.layer("dem")
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
        if self.felled.isChecked():
            self._fell_changes()

    def _fell_changes(self, *_signal: Any) -> None:
        """The selected trees are felled, or stand again."""
        self._refresh()
        trees = self.layer("trees")
        if self.scene is None or self.engine is None or not isinstance(trees, QgsVectorLayer):
            return
        unknown = 0
        before, self.fell = self.fell, []
        if self.felled.isChecked():
            self.fell, unknown = self.scene.trees_of(trees)
        if unknown:
            message = _("{n} of the selected trees are not in the scene: they stand off the terrain model.")
            self.tell(message.format(n=unknown))
        if self.fell == before:
            return
        self.changed = None
        self._send_edit()
        self._draw()

    # --- questions ---------------------------------------------------------------------------------------------------

    def clicked(self, point: Any, *, moving: bool = False) -> None:
        """Logs from this place of the map."""
        self.place = point, self.canvas.mapSettings().destinationCrs()
        self.ask(moving=moving)

    def ask(self, *_signal: Any, moving: bool = False) -> None:
        """Ask with the values as they stand; few logs while the mouse moves."""
        if self.place is None:
            return
        if self.engine is None:
            self.again.stop()
            self._start()
        if self.scene is None or self.engine is None:
            return  # asked once the scene is there
        x, y = self.scene.local(*self.place)
        self.overlay.circle(self.scene.circle(x, y, self.radius.value()), self.scene.crs)
        self.number += 1
        self.asked = self.number
        values = {name: spin.value() for name, spin in self.numbers.items()}
        self.engine.ask(
            {
                "op": "release",
                "id": self.number,
                "shape": {"circle": [x, y, self.radius.value()]},
                "n": self.n.value(),
                "fidelity": self.fidelity.currentData(),
                "friction": values["friction"],
                "logs": {
                    "dbh_cm": [values["dbh_cm"]] * 2,
                    "length_m": [values["length_m"]] * 2,
                    "orientation": self.posture.currentData(),
                },
                "preview": moving,
            }
        )

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
            self.base = frame
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
        dem = self.layer("dem")
        if dem is None:
            return
        self.scene = Scene(frame, dem.crs())
        limits = frame.facts["limits"]
        for spin, name in (
            (self.n, "n_max"),
            (self.radius, "radius_max"),
            (self.numbers["friction"], "friction_max"),
        ):
            spin.setMaximum(limits[name])
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
            seconds = f"{facts['ms'] / 1000.0:.2f}"
            self.tell(self.words.say("counted", done=facts["done"], fidelity=facts["fidelity"], ms=seconds))
        else:
            more = {"done": facts["done"], "of": facts["n"], "fidelity": facts["fidelity"]}
            self.tell(self.words.say("counting", **more))
        self._draw()

    def _draw(self, *_signal: Any) -> None:
        """Put on the map and into the panel what is known."""
        self._refresh()
        if self.base is None or self.scene is None:
            return
        self.answer.setText(
            self.words.reach(self.base.facts, self.scene.names)
            + self.words.fidelity(self.scene.facts["fidelities"], self.base.facts["fidelity"])
        )
        said = self.words.difference(self.changed.facts, self.scene.names) if self.changed is not None else ""
        self.difference.setText(said)
        self.difference.setVisible(bool(said))
        hits, top = self.shown_hits()
        self.overlay.put(hits, top)
        shown = self.changed if self.changed is not None and self.shows_felled() else self.base
        self.legend.setText(self.words.legend(shown.facts, top))

    def shown_hits(self) -> tuple[Hits, int]:
        """The hits on the map, and the top of their colours: before and after have the same scale."""
        assert self.base is not None
        assert self.scene is not None
        base = self.scene.hits(self.base, "hits")
        top = base.top()
        if self.changed is not None and self.shows_felled():
            return self.scene.hits(self.changed, "hits_after"), top
        return base, top

    def shows_felled(self) -> bool:
        return self.changed is not None and self.after.isChecked()

    def _show_nothing(self) -> None:
        self.base = self.changed = None
        self.overlay.put(None)
        for each in (self.answer, self.difference, self.legend):
            each.clear()
        self._refresh()

    def forget(self, *_signal: Any) -> None:
        """Forget the place, the answer and the felled trees."""
        self.place = None
        self.felled.setChecked(False)
        self.asked = self.edited = self.number = self.number + 1  # what still comes is of no interest
        self._show_nothing()

    def _refresh(self) -> None:
        """What can be pressed, and how many trees are selected."""
        trees = self.layer("trees")
        selected = trees.selectedFeatureCount() if isinstance(trees, QgsVectorLayer) else 0
        if selected == 1:
            self.felled.setText(_("What if the selected tree is felled?"))
        elif selected:
            self.felled.setText(_("What if these {n} trees are felled?").format(n=selected))
        else:
            self.felled.setText(_("What if the selected trees are felled?"))
        self.felled.setEnabled(bool(selected) or self.felled.isChecked())
        self.after.setVisible(self.changed is not None)
        answered = self.base is not None and self.scene is not None
        for each in (self.keep_hits, self.keep_run):
            each.setEnabled(answered)

    def tell(self, text: str) -> None:
        self.state.setText(text)

    def warn(self, text: str) -> None:
        """Say what shall not be overwritten by the next answer."""
        self.iface.messageBar().pushWarning(_("Explore: sliding logs"), text)

    # --- keep --------------------------------------------------------------------------------------------------------

    def _keep_hits(self) -> None:
        if self.base is None or self.scene is None:
            return
        (hits, top), facts = self.shown_hits(), self.base.facts
        start = os.path.join(QgsProject.instance().homePath(), "explored_hits.tif")
        path = QFileDialog.getSaveFileName(self, _("Keep hits as a layer"), start, "GeoTIFF (*.tif)")[0]
        if not path:
            return
        path += "" if path.lower().endswith((".tif", ".tiff")) else ".tif"
        felled = f", {self.words.say('felled', n=len(self.fell))}" if self.shows_felled() else ""
        name = _("Hits of {n} logs, {fidelity}").format(n=facts["done"], fidelity=facts["fidelity"]) + felled
        try:
            layer = saved_layer(hits, path, name, self.words.ramp, top)
        except OSError as error:
            self.tell(str(error))
            return
        QgsProject.instance().addMapLayer(layer)

    def _keep_run(self) -> None:
        """Have the engine write the layers; the dialog of Slide logs opens once they are there."""
        if self.engine is None or self.base is None:
            return
        start = os.path.join(QgsProject.instance().homePath(), "explored")
        title = _("Folder of the run")
        path = QFileDialog.getSaveFileName(self, title, start, f"{title} (*)")[0]
        if not path:
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
        layers: dict[str, Any] = {
            name.upper(): layer.id() for name in LAYERS if (layer := self.layer(name)) is not None
        }
        layers.update({name.upper(): f"{beside}|layername={name}" for name in facts["layers"]})
        values = {"FRICTION": self.numbers["friction"].value(), "FIDELITY": self.fidelity.currentData()}
        dialog = processing.createAlgorithmDialog("deadwood:slidelogs", {**layers, **values, "OUTPUT": self.run_folder})
        dialog.setObjectName("deadwoodExploreRun")
        self.dialogs.append(dialog)  # QGIS keeps its window only, and Run would do nothing
        dialog.show()
        message = _("The releases and changed layers are in {file}; run the dialog to slide them.")
        self.tell(message.format(file=beside))


def _narrow(box: QComboBox) -> None:
    """A long name in it shall not make the panel wide."""
    box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
    box.setMinimumContentsLength(12)


class ReleaseTool(QgsMapTool):
    """Logs start where one clicks; while the mouse is dragged, few of them, and all when it is let go."""

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
