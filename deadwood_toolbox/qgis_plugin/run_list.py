"""The widget of a run: a list to choose from (`runs`), which takes any path, and a folder dialog."""

from __future__ import annotations

import os
from typing import Any

from processing.gui.wrappers import WidgetWrapper
from qgis.core import QgsSettings
from qgis.PyQt.QtWidgets import QComboBox, QFileDialog, QHBoxLayout, QLabel, QToolButton, QVBoxLayout, QWidget

from . import runs

LAST_PLACE = "/Processing/LastInputPath"


def ask_folder(parent: QWidget, title: str) -> str:
    """A folder that the user chooses; empty if none was chosen."""
    place = QFileDialog.getExistingDirectory(parent, title, str(QgsSettings().value(LAST_PLACE, "")))
    if place:
        QgsSettings().setValue(LAST_PLACE, os.path.dirname(place))
    return place


class RunInDialog(WidgetWrapper):
    """Says below what is wrong with the choice."""

    def createWidget(self) -> QWidget:
        self.box, self.said = QComboBox(), QLabel()
        self.box.setObjectName("deadwoodRun")
        self.box.setEditable(True)
        self.box.addItems(runs.offered())
        self.box.setCurrentIndex(0 if len(runs.of_project()) == 1 else -1)
        self.said.setObjectName("deadwoodRunSaid")
        self.said.setWordWrap(True)
        button = QToolButton()
        button.setText("…")
        button.clicked.connect(self._ask)
        row = QHBoxLayout()
        row.addWidget(self.box, 1)
        row.addWidget(button)
        widget = QWidget()
        column = QVBoxLayout(widget)
        column.setContentsMargins(0, 0, 0, 0)
        column.addLayout(row)
        column.addWidget(self.said)
        self.box.editTextChanged.connect(self._changed)
        self._changed()
        return widget

    def setValue(self, value: Any) -> None:
        self.box.setEditText("" if value is None else str(value))

    def value(self) -> str:
        return self.box.currentText().strip()

    def _ask(self) -> None:
        place = ask_folder(self.widget, self.parameterDefinition().description())
        if place:
            self.setValue(place)

    def _changed(self, _text: str = "") -> None:
        self.said.setText(runs.verdict(self.value()))
        self.said.setVisible(bool(self.said.text()))
        self.widgetValueHasChanged.emit(self)
