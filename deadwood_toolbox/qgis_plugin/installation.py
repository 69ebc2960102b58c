"""Is the toolbox installed, does it start, is it of the plugin's version? As an algorithm, and for a message box."""

from __future__ import annotations

from typing import Any

from qgis.core import (
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingFeedback,
    QgsProcessingOutputString,
)
from qgis.PyQt.QtCore import QProcess
from qgis.PyQt.QtGui import QIcon

from .finding import HERE, INSTALL, SETTING, Missing, environment, find, read_manifest

START_MS = 60_000  # the first start after an installation compiles what Python reads


def report() -> tuple[bool, str]:
    """Whether the toolbox can be used, and the lines that say so or how to fix it."""
    found = find()
    if isinstance(found, Missing):
        return False, f"The Deadwood Toolbox cannot be used yet: {found.why}.\n\n{INSTALL}"
    where = f"Found by {found.how}: {' '.join(found.command)}"
    child = QProcess()
    child.setProcessEnvironment(environment())
    child.start(found.command[0], [*found.command[1:], "--versions"])
    finished = child.waitForStarted(START_MS) and child.waitForFinished(START_MS)
    if not finished:
        why = child.errorString()
        child.kill()
        child.waitForFinished(START_MS)
        return False, f"{where}\nIt does not answer: {why}\n\n{INSTALL}"
    said = bytes(child.readAllStandardOutput()).decode("utf-8", "replace").strip()
    if child.exitCode() != 0 or not said.startswith("deadwood-tool "):
        errors = bytes(child.readAllStandardError()).decode("utf-8", "replace").strip()
        return False, f"{where}\nThis is not the toolbox, or it is damaged: {errors or said}\n\n{INSTALL}"
    version, own = said.splitlines()[0].split()[1], read_manifest()["version"]
    if version != own:
        fix = "deadwood-tool qgis-plugin --output deadwood.zip"
        return False, f"{where}\n{said}\nThe plugin is of version {own}; pack and install it again: {fix}"
    return True, f"{where}\n{said}\nThe plugin is of the same version. All is well."


class CheckInstallation(QgsProcessingAlgorithm):
    """The report in the toolbox and for ``qgis_process``; it fails where the toolbox cannot be used."""

    def createInstance(self) -> QgsProcessingAlgorithm:
        return CheckInstallation()

    def name(self) -> str:
        return "checkinstallation"

    def displayName(self) -> str:
        return "Check installation"

    def shortDescription(self) -> str:
        return "Is the toolbox found, does it start, and is it of the plugin's version?"

    def shortHelpString(self) -> str:
        return (
            "Says where deadwood-tool was found, which Python and which GDAL, PROJ and Numba it works with, and what "
            "to do where it is missing or of another version.<p>It is looked for in the setting "
            f"(Settings &gt; Options &gt; Deadwood Toolbox, {SETTING}), in the variable DEADWOOD_TOOL, on the PATH, "
            "and in the usual folders of pip, pipx and uv.</p>"
        )

    def icon(self) -> QIcon:
        return QIcon(str(HERE / "icons" / "deadwood.svg"))

    def initAlgorithm(self, configuration: dict[str, Any] | None = None) -> None:
        self.addOutput(QgsProcessingOutputString("REPORT", "Report"))

    def processAlgorithm(
        self, parameters: dict[str, Any], context: QgsProcessingContext, feedback: QgsProcessingFeedback
    ) -> dict[str, Any]:
        works, text = report()
        if not works:
            raise QgsProcessingException(text)
        for line in text.splitlines():
            feedback.pushInfo(line)
        return {"REPORT": text}
