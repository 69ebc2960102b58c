"""The form of the panel: layers of the scene, the request, the results, and the buttons.

Labels, units, bounds and choices are those of the tool's declaration and of the page.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from qgis.core import QgsMapLayerProxyModel
from qgis.gui import QgsMapLayerComboBox
from qgis.PyQt.QtCore import Qt, pyqtSignal
from qgis.PyQt.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QScrollArea,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from .explore_words import Words
from .language import _

LAYERS = ("dem", "trees", "barriers", "lying_logs", "blocks", "lines")
NUMBERS = ("dbh_cm", "length_m", "friction")
KINDS = {
    "point": QgsMapLayerProxyModel.Filter.PointLayer,
    "line": QgsMapLayerProxyModel.Filter.LineLayer,
    "polygon": QgsMapLayerProxyModel.Filter.PolygonLayer,
}
RADIUS_M, LOGS = 10.0, 300


class Form(QScrollArea):
    layers_changed = pyqtSignal()
    question_changed = pyqtSignal()

    def __init__(self, declared: Mapping[str, Mapping[str, Any]], words: Words, friction: float) -> None:
        super().__init__()
        self.declared, self.words = declared, words
        self.layers = {name: self._layer_box(name) for name in LAYERS}
        self.n = QSpinBox()
        self.n.setRange(1, 100_000)
        self.n.setValue(LOGS)
        self.radius = _spin(0.0, 10_000.0, RADIUS_M, 1, " m")
        self.numbers = {name: self._number(name, friction) for name in NUMBERS}
        self.posture = self._choice("posture", declared["orientation"]["default"])
        self.fidelity = self._choice("fidelity", declared["fidelity"]["default"] or "draft")
        for each in (self.n, self.radius, *self.numbers.values()):
            each.setKeyboardTracking(False)
            each.valueChanged.connect(lambda value: self.question_changed.emit())
        self.release = QPushButton(_("Release logs by clicking on the map"))
        self.release.setCheckable(True)
        self.state, self.answer, self.difference, self.legend = (QLabel() for each in range(4))
        self.felled = QCheckBox()
        self.felled.setToolTip(_("Select trees in their layer: the same logs slide with and without them."))
        self.after = QCheckBox(_("Show the map with them felled"))
        self.after.setChecked(True)
        self.keep_hits, self.keep_run, self.clear = map(QPushButton, (_("Keep hits…"), _("Save as run…"), _("Clear")))
        self._lay_out()

    def layer(self, name: str) -> Any:
        """The layer that is chosen, or None."""
        return self.layers[name].currentLayer()

    def chosen(self) -> dict[str, Any]:
        """The layers that are chosen, by the name of their parameter."""
        return {name: layer for name in LAYERS if (layer := self.layer(name)) is not None}

    def question(self) -> dict[str, Any]:
        """The parameters of a request, without its place, in the form of a message."""
        values = {name: spin.value() for name, spin in self.numbers.items()}
        return {
            "n": self.n.value(),
            "fidelity": self.fidelity.currentData(),
            "friction": values["friction"],
            "logs": {
                "dbh_cm": [values["dbh_cm"]] * 2,
                "length_m": [values["length_m"]] * 2,
                "orientation": self.posture.currentData(),
            },
        }

    def bound(self, limits: Mapping[str, float]) -> None:
        """Apply the engine's upper bounds."""
        self.n.setMaximum(int(limits["n_max"]))
        self.radius.setMaximum(limits["radius_max"])
        self.numbers["friction"].setMaximum(limits["friction_max"])

    def clear_answers(self) -> None:
        for each in (self.answer, self.difference, self.legend):
            each.clear()

    def refresh(self, *, answered: bool, compared: bool) -> None:
        """Update the buttons and the number of selected trees."""
        trees = self.layer("trees")
        selected = trees.selectedFeatureCount() if trees is not None else 0
        if selected == 1:
            self.felled.setText(_("What if the selected tree is felled?"))
        elif selected:
            self.felled.setText(_("What if these {n} trees are felled?").format(n=selected))
        else:
            self.felled.setText(_("What if the selected trees are felled?"))
        self.felled.setEnabled(bool(selected) or self.felled.isChecked())
        self.after.setVisible(compared)
        for each in (self.keep_hits, self.keep_run):
            each.setEnabled(answered)

    def _layer_box(self, name: str) -> QgsMapLayerComboBox:
        box = QgsMapLayerComboBox()
        kinds = QgsMapLayerProxyModel.Filter.RasterLayer
        if name != "dem":
            first, *others = self.declared[name]["geometry"]
            kinds = KINDS[first]
            for each in others:
                kinds = kinds | KINDS[each]
        box.setFilters(kinds)
        box.setAllowEmptyLayer(True)
        box.setLayer(None)
        box.layerChanged.connect(lambda value: self.layers_changed.emit())
        _narrow(box)
        return box

    def _number(self, name: str, friction: float) -> QDoubleSpinBox:
        declared = self.declared[name]
        unit = f" {declared['unit']}" if declared["unit"] else ""
        start = friction if declared["default"] is None else declared["default"]
        return _spin(
            declared["minimum"] or 0.0, declared["maximum"] or 100.0, start, 2 if name == "friction" else 1, unit
        )

    def _choice(self, group: str, start: str) -> QComboBox:
        box = QComboBox()
        for value, text in self.words.choices(group).items():
            box.addItem(text, value)
        box.setCurrentIndex(box.findData(start))
        box.currentIndexChanged.connect(lambda value: self.question_changed.emit())
        _narrow(box)
        return box

    def _lay_out(self) -> None:
        rows = QFormLayout()
        rows.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        for name, box in self.layers.items():
            label = QLabel(self.declared[name]["label"])
            label.setWordWrap(True)
            rows.addRow(label, box)
        rows.addRow(self.words.say("q_n"), self.n)
        rows.addRow(self.words.say("radius"), self.radius)
        for name, spin in self.numbers.items():
            rows.addRow(self.words.say(f"q_{name}"), spin)
        rows.addRow(self.words.say("q_orientation"), self.posture)
        rows.addRow(self.words.say("q_fidelity"), self.fidelity)
        buttons = QHBoxLayout()
        for each in (self.keep_hits, self.keep_run, self.clear):
            buttons.addWidget(each)
        inside = QWidget()
        column = QVBoxLayout(inside)
        column.addLayout(rows)
        for each in (self.release, self.state, self.answer, self.felled, self.difference, self.after, self.legend):
            if isinstance(each, QLabel):
                each.setWordWrap(True)
            column.addWidget(each)
        column.addLayout(buttons)
        column.addStretch(1)
        self.refresh(answered=False, compared=False)
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setWidget(inside)
        self.setMinimumWidth(inside.minimumSizeHint().width() + self.verticalScrollBar().sizeHint().width() + 4)


def _spin(low: float, high: float, value: float, digits: int, unit: str) -> QDoubleSpinBox:
    made = QDoubleSpinBox()
    made.setDecimals(digits)
    made.setRange(low, high)
    made.setSingleStep(10.0**-digits if digits > 1 else 1.0)
    made.setValue(value)
    made.setSuffix(unit)
    return made


def _narrow(box: QComboBox) -> None:
    """Prevent a long name from widening the panel."""
    box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
    box.setMinimumContentsLength(12)
