"""Widgets that QGIS does not have: a list of folders (`folder_lists`), a number that a layer may replace, and a layer
that is only proposed if it is named like what is asked for (`proposals`).

Named in the metadata of a parameter's definition (`definitions`), from which Processing's dialogs make them.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from processing.gui.wrappers import DIALOG_BATCH, DIALOG_MODELER, DIALOG_STANDARD, dialogTypes
from qgis.core import QgsProject
from qgis.gui import QgsGui
from qgis.PyQt.QtCore import Qt
from qgis.PyQt.QtWidgets import QComboBox

from . import folder_lists, proposals, run_list
from .finding import read_manifest
from .language import translated

LAYER_ID = Qt.ItemDataRole.UserRole + 1  # QgsMapLayerModel's role of a layer's id


def _of_qgis(definition: Any, dialog: Any) -> Any:
    """QGIS's own widget for a parameter, as Processing makes it by default."""
    registry = QgsGui.processingGuiRegistry()
    if dialog.__class__.__name__ == "ModelerParametersDialog":
        made = registry.createModelerParameterWidget(dialog.model, dialog.childId, definition, dialog.context)
    else:
        kind = dialogTypes.get(dialog.__class__.__name__, DIALOG_STANDARD)
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


class LikelyLayer:
    """QGIS's widget for a layer, which begins with the layer that is probably meant, or empty."""

    def __new__(cls, definition: Any, dialog: Any, row: int = 0, col: int = 0, *, kind: str) -> Any:
        made = _of_qgis(definition, dialog)
        is_standard = dialogTypes.get(dialog.__class__.__name__, DIALOG_STANDARD) == DIALOG_STANDARD
        if not is_standard or not hasattr(made, "createWrappedWidget"):
            return made
        with_first = made.createWrappedWidget

        def with_likely(context: Any) -> Any:
            widget = with_first(context)
            choose_likely(made, widget, kind, context)
            return widget

        made.createWrappedWidget = with_likely
        return made


def choose_likely(wrapper: Any, widget: Any, kind: str, context: Any) -> None:
    """Choose the layer that is probably meant, or none, in the widget that QGIS made for a layer."""
    # Python knows this part of the widget by no closer class than QComboBox.
    boxes = [each for each in widget.findChildren(QComboBox) if each.metaObject().className() == "QgsMapLayerComboBox"]
    for box in boxes:
        project = QgsProject.instance()
        ids = [box.itemData(row, LAYER_ID) for row in range(box.count())]
        layers = [layer for each in ids if (layer := project.mapLayer(each or "")) is not None]
        number = proposals.proposed(kind, _known_kinds(), [(each.name(), each.source()) for each in layers])
        if number is None:
            box.setCurrentIndex(-1)
        else:
            wrapper.setParameterValue(layers[number].id(), context)


@lru_cache(maxsize=1)
def _known_kinds() -> dict[str, list[str]]:
    return proposals.kinds(translated(each) for each in read_manifest()["tools"] if each["qgis_id"])


class RunFolder:
    """One run, chosen from those of the project and the recent ones; in a model and a batch table QGIS's widget."""

    def __new__(cls, definition: Any, dialog: Any, row: int = 0, col: int = 0, **_facts: Any) -> Any:
        if dialogTypes.get(dialog.__class__.__name__, DIALOG_STANDARD) == DIALOG_STANDARD:
            return run_list.RunInDialog(definition, dialog, row, col)
        return _of_qgis(definition, dialog)


class FolderList:
    """Folders in an order that the user gives them; the value is the text that the command line takes."""

    def __new__(cls, definition: Any, dialog: Any, row: int = 0, col: int = 0, *, files: bool = False) -> Any:
        kinds = {DIALOG_BATCH: folder_lists.InBatch, DIALOG_MODELER: folder_lists.InModel}
        kind = kinds.get(dialogTypes.get(dialog.__class__.__name__, DIALOG_STANDARD), folder_lists.InDialog)
        return kind(definition, dialog, row, col, files=files)
