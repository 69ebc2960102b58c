"""The window in which the toolbox's own environment is installed, repaired and removed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from qgis.gui import QgsCollapsibleGroupBox, QgsFileWidget
from qgis.PyQt.QtWidgets import (
    QDialog,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QMessageBox,
    QPlainTextEdit,
    QProgressBar,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from .environment_setup import Setup
from .installation import report
from .language import _
from .own_python import what_to_install

WIDTH, HEIGHT = 620, 300


class SetupDialog(QDialog):
    """Closing it hides it; the work continues, and its end is reported in QGIS's message bar."""

    def __init__(self, iface: Any, changed: Callable[[], None], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("deadwoodSetup")
        self.setWindowTitle(_("Set up the Deadwood Toolbox"))
        self.resize(WIDTH, HEIGHT)
        self.iface, self.changed = iface, changed
        self.setup = Setup()
        self.setup.moved.connect(self._moved)
        self.setup.ended.connect(self._ended)
        self.state, self.doing = QLabel(), QLabel()
        self.bar = QProgressBar()
        self.python, self.source = QgsFileWidget(), QgsFileWidget()
        self.python.setDialogTitle(_("Python 3.11 or newer"))
        self.source.setDialogTitle(_("Wheel of the toolbox"))
        self.details = QPlainTextEdit()
        self.details.setReadOnly(True)
        self.details.setMaximumBlockCount(2000)
        self.setup.said.connect(self.details.appendPlainText)
        self.install, self.remove = QPushButton(), QPushButton(_("Remove"))
        self.stop, self.hide_it = QPushButton(_("Cancel")), QPushButton(_("Close"))
        self.install.setDefault(True)
        self.install.clicked.connect(self._install)
        self.remove.clicked.connect(self._remove)
        self.stop.clicked.connect(self.setup.cancel)
        self.hide_it.clicked.connect(self.hide)
        self._lay_out()
        self.refresh()

    def _lay_out(self) -> None:
        what = QLabel(
            _(
                "The tools need libraries that QGIS does not have (about 1 GB). They are installed into an "
                "environment of their own, in the folder of your QGIS profile; QGIS's own Python is not changed."
            )
        )
        for each in (what, self.state, self.doing):
            each.setWordWrap(True)
        advanced = QgsCollapsibleGroupBox(_("Advanced"))
        form = QFormLayout(advanced)
        form.addRow(_("Python (empty: the first suitable one)"), self.python)
        brought = what_to_install()[0].replace("\\", "/").rpartition("/")[2]
        form.addRow(_("Wheel or folder of the toolbox (empty: {name})").format(name=brought), self.source)
        advanced.setCollapsed(True)
        details = QgsCollapsibleGroupBox(_("Details"))
        QVBoxLayout(details).addWidget(self.details)
        details.setCollapsed(True)
        buttons = QHBoxLayout()
        buttons.addWidget(self.install)
        buttons.addWidget(self.remove)
        buttons.addStretch(1)
        buttons.addWidget(self.stop)
        buttons.addWidget(self.hide_it)
        layout = QVBoxLayout(self)
        for part in (what, self.state, self.doing, self.bar, advanced, details):
            layout.addWidget(part)
        layout.addStretch(1)
        layout.addLayout(buttons)

    def refresh(self) -> None:
        """Buttons and state according to what exists and what is in progress."""
        busy, there = self.setup.busy(), self.setup.installed()
        self.install.setText(_("Repair") if there else _("Install"))
        for each in (self.install, self.python, self.source):
            each.setEnabled(not busy)
        self.remove.setEnabled(there and not busy)
        self.stop.setVisible(busy)
        self.bar.setVisible(busy)
        if busy:
            return
        if there:
            self.state.setText(_("Installed in {folder}.").format(folder=self.setup.place))
        else:
            self.state.setText(_("The plugin has no environment of its own yet."))

    def _install(self) -> None:
        self.details.clear()
        self.setup.make(self.python.filePath().strip(), self.source.filePath().strip())
        self.refresh()

    def _remove(self) -> None:
        question = _("Remove {folder}?").format(folder=self.setup.place)
        if QMessageBox.question(self, self.windowTitle(), question) == QMessageBox.StandardButton.Yes:
            self.setup.remove()
            self.refresh()

    def _moved(self, percent: int, what: str) -> None:
        self.bar.setValue(percent)
        self.doing.setText(what)

    def _ended(self, worked: bool, message: str) -> None:
        self.refresh()
        if worked and self.setup.installed():
            message = f"{message}\n{report()[1]}"
        self.doing.setText(message)
        self.changed()
        if not self.isVisible():
            push = self.iface.messageBar().pushSuccess if worked else self.iface.messageBar().pushWarning
            push(self.windowTitle(), message.splitlines()[0])
