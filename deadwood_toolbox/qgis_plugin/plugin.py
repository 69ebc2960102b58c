"""The plugin object: registers the provider and, where there is a window, the menu entry and the settings page."""

from __future__ import annotations

from typing import Any

from qgis.core import QgsApplication
from qgis.PyQt import QtGui, QtWidgets
from qgis.PyQt.QtWidgets import QMessageBox

from .finding import read_manifest
from .installation import report
from .language import _
from .provider import Provider, icon

# Qt 6 has it among the GUI classes, Qt 5 among the widgets.
QAction: Any = getattr(QtGui, "QAction", None) or QtWidgets.QAction


class Plugin:
    def __init__(self, iface: Any) -> None:
        self.iface = iface
        self.provider: Provider | None = None
        self.action: Any = None
        self.page: Any = None

    def initProcessing(self) -> None:
        """Called by QGIS with a window, and all that ``qgis_process`` calls."""
        self.provider = Provider(read_manifest())
        QgsApplication.processingRegistry().addProvider(self.provider)

    def initGui(self) -> None:
        from .settings import PageFactory

        self.initProcessing()
        action = QAction(icon("deadwood"), _("Check installation of the Deadwood Toolbox"), self.iface.mainWindow())
        action.setObjectName("deadwoodCheckInstallation")
        action.triggered.connect(self.check)
        self.iface.addPluginToMenu("Deadwood Toolbox", action)
        self.action = action
        self.page = PageFactory(icon("deadwood"))
        self.iface.registerOptionsWidgetFactory(self.page)

    def check(self) -> None:
        """Tell in a message box what was found, or how to install what was not."""
        works, text = report()
        show = QMessageBox.information if works else QMessageBox.warning
        show(self.iface.mainWindow(), "Deadwood Toolbox", text)
        if self.provider is not None:
            self.provider.refreshAlgorithms()  # and with them the toolbox's warning

    def unload(self) -> None:
        if self.provider is not None:
            QgsApplication.processingRegistry().removeProvider(self.provider)
            self.provider = None
        if self.action is not None:
            self.iface.removePluginMenu("Deadwood Toolbox", self.action)
            self.iface.unregisterOptionsWidgetFactory(self.page)
            self.action = None
