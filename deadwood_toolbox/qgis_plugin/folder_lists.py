"""A list of folders as a parameter: in a dialog, in a row of the batch table, and in a step of the Model Designer.

The parameter is a text, written with commas in scripts, batch files and models; users of the dialog need not know that.
In the Model Designer a row is a folder, or a source of the model: an input folder, or one made by an earlier step.
"""

from __future__ import annotations

import os
from typing import Any

from processing.gui.wrappers import WidgetWrapper
from qgis.core import (
    QgsProcessingModelChildParameterSource,
    QgsProcessingOutputFolder,
    QgsProcessingOutputVectorLayer,
    QgsProcessingParameterFile,
    QgsProcessingParameterMultipleLayers,
    QgsProcessingParameterString,
    QgsSettings,
)
from qgis.PyQt.QtCore import Qt, pyqtSignal
from qgis.PyQt.QtWidgets import (
    QAbstractItemView,
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QMenu,
    QPushButton,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from . import run_list, runs
from .inputs import each_place
from .language import _
from .run_list import LAST_PLACE

ROWS_PX = 84
DIALOG_PX = (620, 260)
Source = QgsProcessingModelChildParameterSource


class Rows(QWidget):
    """The list with its buttons; a row holds the text of a place, or a source of a model."""

    changed = pyqtSignal()

    def __init__(self, title: str, *, files: bool) -> None:
        super().__init__()
        self.title = title
        self.places = QListWidget()
        self.places.setObjectName("deadwoodFolders")
        self.places.setTextElideMode(Qt.TextElideMode.ElideLeft)
        self.places.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.places.setDragDropMode(QAbstractItemView.DragDropMode.InternalMove)
        self.buttons = QVBoxLayout()
        more = [(_("Add file…"), self._ask_file)] if files else []
        self.said = QLabel()
        self.said.setObjectName("deadwoodRunSaid")
        self.said.setWordWrap(True)
        self.buttons.addWidget(self._runs())
        for text, do in [(_("Add folder…"), self._ask), *more, (_("Remove"), self._remove), (_("Move up"), self._up)]:
            button = QPushButton(text)
            button.clicked.connect(lambda _checked=False, do=do: do())
            self.buttons.addWidget(button)
        self.buttons.addStretch(1)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        column = QVBoxLayout()
        column.addWidget(self.places)
        column.addWidget(self.said)
        row.addLayout(column, 1)
        row.addLayout(self.buttons)
        self.changed.connect(self._judge)
        self._judge()

    def _runs(self) -> QPushButton:
        """A button with the runs of the project and the recent ones."""
        button, menu = QPushButton(_("Add run")), QMenu(self)
        button.setObjectName("deadwoodRuns")
        for place in runs.offered():
            menu.addAction(place, lambda place=place: self.add(place))
        button.setMenu(menu)
        button.setEnabled(not menu.isEmpty())
        return button

    def _judge(self) -> None:
        """Say which of the folders is no run; other files and sources of a model are for the tool to check."""
        folders = (each for each in self.values() if isinstance(each, str) and not os.path.isfile(each))
        self.said.setText("\n".join(filter(None, map(runs.verdict, folders))))
        self.said.setVisible(bool(self.said.text()))

    def values(self) -> list[Any]:
        return [self.places.item(k).data(Qt.ItemDataRole.UserRole) for k in range(self.places.count())]

    def set_places(self, value: Any) -> None:
        self.places.clear()
        for each in each_place(value):
            self.add(each)

    def add(self, place: str) -> None:
        self.add_row(place, place)

    def add_row(self, text: str, value: Any) -> None:
        if not self.places.findItems(text, Qt.MatchFlag.MatchExactly):
            item = QListWidgetItem(text)
            item.setData(Qt.ItemDataRole.UserRole, value)
            self.places.addItem(item)
            self.changed.emit()

    def _ask(self) -> None:
        if place := run_list.ask_folder(self, self.title):
            self.add(place)

    def _ask_file(self) -> None:
        start = str(QgsSettings().value(LAST_PLACE, ""))
        place = QFileDialog.getOpenFileName(self, self.title, start, "GeoPackage (*.gpkg)")[0]
        if place:
            QgsSettings().setValue(LAST_PLACE, os.path.dirname(place))
            self.add(place)

    def _remove(self) -> None:
        for each in self.places.selectedItems():
            self.places.takeItem(self.places.row(each))
        self.changed.emit()

    def _up(self) -> None:
        for each in self.places.selectedItems():
            row = self.places.row(each)
            if row > 0:
                self.places.insertItem(row - 1, self.places.takeItem(row))
                each.setSelected(True)
        self.changed.emit()


class InDialog(WidgetWrapper):
    def createWidget(self, files: bool) -> QWidget:
        self.rows = Rows(self.parameterDefinition().description(), files=files)
        self.rows.places.setMaximumHeight(ROWS_PX)
        self.rows.changed.connect(lambda: self.widgetValueHasChanged.emit(self))
        return self.rows

    def setValue(self, value: Any) -> None:
        self.rows.set_places(value)

    def value(self) -> str:
        return ",".join(self.rows.values())


class InBatch(WidgetWrapper):
    """A cell of the table: the text, and a button that shows it as a list."""

    def createWidget(self, files: bool) -> QWidget:
        self.files = files
        self.text = QLineEdit()
        self.text.setObjectName("deadwoodFoldersText")
        self.text.textChanged.connect(lambda: self.widgetValueHasChanged.emit(self))
        button = QToolButton()
        button.setText("…")
        button.setObjectName("deadwoodFoldersButton")
        button.setToolTip(_("Choose folders from a list"))
        button.clicked.connect(self._ask)
        cell = QWidget()
        row = QHBoxLayout(cell)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(self.text, 1)
        row.addWidget(button)
        return cell

    def setValue(self, value: Any) -> None:
        self.text.setText(",".join(each_place(value)))

    def value(self) -> str | None:
        return self.text.text() or None

    def _ask(self) -> None:
        asked = QDialog(self.widget.window())
        asked.setWindowTitle(self.parameterDefinition().description())
        asked.resize(*DIALOG_PX)
        rows = Rows(asked.windowTitle(), files=self.files)
        rows.set_places(self.text.text())
        kinds = QDialogButtonBox.StandardButton
        buttons = QDialogButtonBox(kinds.Ok | kinds.Cancel)
        buttons.accepted.connect(asked.accept)
        buttons.rejected.connect(asked.reject)
        column = QVBoxLayout(asked)
        column.addWidget(rows)
        column.addWidget(buttons)
        if asked.exec():
            self.setValue(rows.values())


class InModel(WidgetWrapper):
    """A step of a model: its value is a list of sources, which QGIS turns into a list of places when the model runs."""

    def createWidget(self, files: bool) -> QWidget:
        self.rows = Rows(self.parameterDefinition().description(), files=files)
        self.rows.places.setMaximumHeight(ROWS_PX)
        of_model = QPushButton(_("Add from the model"))
        of_model.setObjectName("deadwoodFromModel")
        menu = QMenu(of_model)
        outputs = [QgsProcessingOutputFolder, *([QgsProcessingOutputVectorLayer] if files else [])]
        inputs = (QgsProcessingParameterFile, QgsProcessingParameterMultipleLayers, QgsProcessingParameterString)
        for source in self.dialog.getAvailableValuesOfType(inputs, outputs):
            menu.addAction(self._shown(source), lambda source=source: self._add(source))
        of_model.setMenu(menu)
        of_model.setEnabled(not menu.isEmpty())
        self.rows.buttons.insertWidget(0, of_model)
        return self.rows

    def setValue(self, value: Any) -> None:
        self.rows.places.clear()
        for each in value if isinstance(value, (list, tuple)) else [value]:
            self._add(each)

    def value(self) -> list[Any]:
        return [each if isinstance(each, Source) else Source.fromStaticValue(each) for each in self.rows.values()]

    def _add(self, source: Any) -> None:
        if isinstance(source, Source) and source.source() != Source.Source.StaticValue:
            self.rows.add_row(self._shown(source), source)
            return
        for place in each_place(source.staticValue() if isinstance(source, Source) else source):
            self.rows.add(place)

    def _shown(self, source: Any) -> str:
        if source.source() == Source.Source.Expression:
            return source.expression()
        return self.dialog.resolveValueDescription(source)
