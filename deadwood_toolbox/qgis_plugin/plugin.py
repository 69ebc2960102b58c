"""The plugin object: registers the provider and, if there is a window, the menu, the panel and the settings page."""

from __future__ import annotations

from typing import Any

from qgis.core import QgsApplication, QgsTask
from qgis.PyQt import QtGui, QtWidgets
from qgis.PyQt.QtCore import Qt, QTimer
from qgis.PyQt.QtWidgets import QMessageBox

from .child import drift
from .finding import Missing, find, read_manifest
from .installation import report
from .language import _
from .provider import Provider, icon

# Qt 6 has it among the GUI classes, Qt 5 among the widgets.
QAction: Any = getattr(QtGui, "QAction", None) or QtWidgets.QAction


class Plugin:
    def __init__(self, iface: Any) -> None:
        self.iface = iface
        self.provider: Provider | None = None
        self.actions: list[Any] = []
        self.page: Any = None
        self.panel: Any = None
        self.dialog: Any = None
        self.designers: list[Any] = []
        self.comparing: Any = None

    def initProcessing(self) -> None:
        """Called by QGIS with a window; the only method that ``qgis_process`` calls."""
        self.provider = Provider(read_manifest())
        QgsApplication.processingRegistry().addProvider(self.provider)
        self.provider.refreshAlgorithms()  # now with the model of its own tools

    def initGui(self) -> None:
        from .settings import PageFactory

        self.initProcessing()
        explore = self._action("deadwood", _("Explore: sliding logs"), "deadwoodExploreOpen", self.explore)
        self.iface.addToolBarIcon(explore)
        self._action("deadwood", _("Set up…"), "deadwoodSetupOpen", self.set_up)
        check = _("Check installation of the Deadwood Toolbox")
        self._action("deadwood", check, "deadwoodCheckInstallation", self.check)
        design = _("Open 'Slope to report' in the Model Designer")
        self._action("deadwood", design, "deadwoodOpenModel", self.design)
        self.page = PageFactory(icon("deadwood"))
        self.iface.registerOptionsWidgetFactory(self.page)
        self._compare()

    def _compare(self) -> None:
        """Compare the versions of plugin and toolbox, beside the window; the toolbox is asked only if it is another."""
        found = find()
        if isinstance(found, Missing):
            return

        def done(error: object, different: str = "") -> None:
            self.comparing = None
            if self.provider is not None:
                self.provider.compared = True
                if different:
                    self.refresh()
                    self.iface.messageBar().pushWarning("Deadwood Toolbox", different)

        title = _("Deadwood Toolbox")
        self.comparing = QgsTask.fromFunction(title, lambda task: drift(found.command), on_finished=done)
        QgsApplication.taskManager().addTask(self.comparing)

    def _action(self, picture: str, text: str, name: str, do: Any) -> Any:
        """An entry in the plugin's menu."""
        action = QAction(icon(picture), text, self.iface.mainWindow())
        action.setObjectName(name)
        action.triggered.connect(lambda: do())
        self.iface.addPluginToMenu("Deadwood Toolbox", action)
        self.actions.append(action)
        return action

    def explore(self) -> None:
        """Open the panel on the right, or bring it to the front."""
        if self.panel is None:
            from .explore_panel import Panel

            self.panel = Panel(self.iface, read_manifest())
            self.iface.addDockWidget(Qt.DockWidgetArea.RightDockWidgetArea, self.panel)
        self.panel.show()
        self.panel.raise_()

    def check(self) -> None:
        """Show in a message box what was found, or how to install it."""
        works, text = report()
        icon = QMessageBox.Icon.Information if works else QMessageBox.Icon.Warning
        box = QMessageBox(icon, "Deadwood Toolbox", text, QMessageBox.StandardButton.Ok, self.iface.mainWindow())
        help_it = None if works else box.addButton(_("Set up…"), QMessageBox.ButtonRole.AcceptRole)
        box.exec()
        if help_it is not None and box.clickedButton() is help_it:
            self.set_up()
        self.refresh()

    def refresh(self) -> None:
        """Refresh the algorithms, and with them the toolbox's warning."""
        if self.provider is not None:
            self.provider.refreshAlgorithms()

    def set_up(self) -> None:
        """Show the window that installs, repairs and removes the toolbox's own environment."""
        if self.dialog is None:
            from .setup_dialog import SetupDialog

            self.dialog = SetupDialog(self.iface, self.refresh, self.iface.mainWindow())
        self.dialog.refresh()
        self.dialog.show()
        self.dialog.raise_()

    def design(self) -> None:
        from processing.modeler.ModelerDialog import ModelerDialog

        from .slope_model import read

        designer = ModelerDialog.create(read())
        self.designers.append(designer)  # QGIS keeps no reference
        designer.show()
        designer.activate()
        view = designer.findChild(QtWidgets.QGraphicsView)
        whole = view.scene().itemsBoundingRect
        QTimer.singleShot(0, lambda: view.fitInView(whole(), Qt.AspectRatioMode.KeepAspectRatio))

    def unload(self) -> None:
        if self.provider is not None:
            QgsApplication.processingRegistry().removeProvider(self.provider)
            self.provider = None
        if self.panel is not None:
            self.panel.remove()
            self.iface.removeDockWidget(self.panel)
            self.panel.deleteLater()
            self.panel = None
        if self.dialog is not None:
            self.dialog.setup.cancel()
            self.dialog.deleteLater()
            self.dialog = None
        if self.actions:
            self.iface.removeToolBarIcon(self.actions[0])
            for each in self.actions:
                self.iface.removePluginMenu("Deadwood Toolbox", each)
            self.iface.unregisterOptionsWidgetFactory(self.page)
            self.actions = []
