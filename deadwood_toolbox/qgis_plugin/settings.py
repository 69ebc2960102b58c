"""The page in Settings > Options: the path of the tool, if it is not found automatically."""

from __future__ import annotations

from qgis.core import QgsSettings
from qgis.gui import QgsFileWidget, QgsOptionsPageWidget, QgsOptionsWidgetFactory
from qgis.PyQt.QtGui import QIcon
from qgis.PyQt.QtWidgets import QLabel, QPushButton, QVBoxLayout, QWidget

from .finding import SETTING, Missing, find
from .installation import report
from .language import _


class PageFactory(QgsOptionsWidgetFactory):
    def __init__(self, icon: QIcon) -> None:
        super().__init__()
        self.setTitle("Deadwood Toolbox")
        self.picture = icon

    def icon(self) -> QIcon:
        return self.picture

    def createWidget(self, parent: QWidget) -> Page:
        return Page(parent)


class Page(QgsOptionsPageWidget):
    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setObjectName("deadwoodOptions")
        self.path = QgsFileWidget()
        self.path.setDialogTitle(_("deadwood-tool, or the folder of its environment"))
        self.path.setFilePath(str(QgsSettings().value(SETTING, "")))
        self.state = QLabel()
        self.state.setWordWrap(True)
        check = QPushButton(_("Check installation"))
        check.clicked.connect(self.check)
        explained = QLabel(
            _(
                "Where deadwood-tool is (bin/deadwood-tool of its environment, Scripts\\deadwood-tool.exe on Windows). "
                "If this is empty, the PATH and the usual folders are searched."
            )
        )
        explained.setWordWrap(True)
        layout = QVBoxLayout(self)
        for each in (explained, self.path, check, self.state):
            layout.addWidget(each)
        layout.addStretch(1)
        found = find()
        in_use = _("In use: {command}")
        self.state.setText(found.why if isinstance(found, Missing) else in_use.format(command=" ".join(found.command)))

    def check(self) -> None:
        """Check with the path on the page, which is thereby saved."""
        self.apply()
        self.state.setText(report()[1])

    def apply(self) -> None:
        QgsSettings().setValue(SETTING, self.path.filePath().strip())
