"""Widgets of the dialogs that QGIS does not have: a list of folders, and a number that a layer may stand in for.

Named in the metadata of a parameter's definition (`definitions`), from where Processing's dialogs make them. In batch
and in the Model Designer, where a cell or a choice of sources stands for the parameter, QGIS's own widget is used.
"""

from __future__ import annotations

import os
from typing import Any

from processing.gui.wrappers import DIALOG_STANDARD, WidgetWrapper, dialogTypes
from qgis.core import QgsSettings
from qgis.gui import QgsGui, QgsProcessingGui
from qgis.PyQt.QtCore import Qt
from qgis.PyQt.QtWidgets import (
    QAbstractItemView,
    QFileDialog,
    QHBoxLayout,
    QListWidget,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from .language import _

LAST_PLACE = "/Processing/LastInputPath"
ROWS_PX = 84


def _of_qgis(definition: Any, dialog: Any) -> Any:
    """QGIS's own widget for a parameter, as Processing makes it where nothing else is asked for."""
    registry = QgsGui.processingGuiRegistry()
    if dialog.__class__.__name__ == "ModelerParametersDialog":
        made = registry.createModelerParameterWidget(dialog.model, dialog.childId, definition, dialog.context)
    else:
        kind = dialogTypes.get(dialog.__class__.__name__, QgsProcessingGui.Standard)
        made = registry.createParameterWidgetWrapper(definition, kind)
    made.setDialog(dialog)
    return made


class NumberOrLayer:
    """QGIS's widget for a number, without its "[optional]": one of the number and the layer below it is required."""

    def __new__(cls, definition: Any, dialog: Any, row: int = 0, col: int = 0, **_facts: Any) -> Any:
        made = _of_qgis(definition, dialog)
        if not hasattr(made, "createWrappedLabel"):
            return made
        with_optional = made.createWrappedLabel

        def without_optional() -> Any:
            label = with_optional()
            if label is not None:
                label.setText(definition.description())
            return label

        made.createWrappedLabel = without_optional
        return made


class FolderList:
    """Folders in an order that the user gives them; the value is the text that the command line takes."""

    def __new__(cls, definition: Any, dialog: Any, row: int = 0, col: int = 0, *, files: bool = False) -> Any:
        if dialogTypes.get(dialog.__class__.__name__, DIALOG_STANDARD) != DIALOG_STANDARD:
            return _of_qgis(definition, dialog)
        return _FolderList(definition, dialog, row, col, files=files)


class _FolderList(WidgetWrapper):
    def createWidget(self, files: bool) -> QWidget:
        self.folders = QListWidget()
        self.folders.setObjectName("deadwoodFolders")
        self.folders.setMaximumHeight(ROWS_PX)
        self.folders.setTextElideMode(Qt.TextElideMode.ElideLeft)
        self.folders.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.folders.setDragDropMode(QAbstractItemView.DragDropMode.InternalMove)
        buttons = QVBoxLayout()
        more = [(_("Add file…"), self._ask_file)] if files else []
        wanted = [(_("Add folder…"), self._ask), *more, (_("Remove"), self._remove), (_("Move up"), self._up)]
        for text, do in wanted:
            button = QPushButton(text)
            button.clicked.connect(lambda _checked=False, do=do: do())
            buttons.addWidget(button)
        buttons.addStretch(1)
        widget = QWidget()
        row = QHBoxLayout(widget)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(self.folders, 1)
        row.addLayout(buttons)
        return widget

    def setValue(self, value: Any) -> None:
        self.folders.clear()
        for each in value if isinstance(value, (list, tuple)) else str(value or "").split(","):
            if str(each).strip():
                self.add(str(each).strip())

    def value(self) -> str:
        return ",".join(self.folders.item(k).text() for k in range(self.folders.count()))

    def add(self, folder: str) -> None:
        if not self.folders.findItems(folder, Qt.MatchFlag.MatchExactly):
            self.folders.addItem(folder)

    def _ask(self) -> None:
        self._take(QFileDialog.getExistingDirectory(self.widget, *self._asked()))

    def _ask_file(self) -> None:
        self._take(QFileDialog.getOpenFileName(self.widget, *self._asked(), "GeoPackage (*.gpkg)")[0])

    def _asked(self) -> tuple[str, str]:
        """Title and first folder of a file dialog."""
        return self.parameterDefinition().description(), str(QgsSettings().value(LAST_PLACE, ""))

    def _take(self, place: str) -> None:
        if place:
            QgsSettings().setValue(LAST_PLACE, os.path.dirname(place))
            self.add(place)

    def _remove(self) -> None:
        for each in self.folders.selectedItems():
            self.folders.takeItem(self.folders.row(each))

    def _up(self) -> None:
        for each in self.folders.selectedItems():
            row = self.folders.row(each)
            if row > 0:
                self.folders.insertItem(row - 1, self.folders.takeItem(row))
                each.setSelected(True)
