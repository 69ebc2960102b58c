"""Is the toolbox installed, does it start, is it of the plugin's version? As an algorithm, and for a message box."""

from __future__ import annotations

import html
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

from .child import START_MS, versions_of
from .finding import HERE, SETTING, VARIABLE, Missing, environment, find, how_to_install, read_manifest
from .language import START, _, group_label


def report() -> tuple[bool, str]:
    """Whether the toolbox can be used, and the lines that say so or explain how to fix it."""
    found = find()
    if isinstance(found, Missing):
        not_yet = _("The Deadwood Toolbox cannot be used yet: {why}.").format(why=found.why)
        return False, f"{not_yet}\n\n{how_to_install()}"
    where = _("Found by {source}: {command}").format(source=found.how, command=" ".join(found.command))
    child = QProcess()
    child.setProcessEnvironment(environment())
    child.start(found.command[0], [*found.command[1:], "--versions"])
    finished = child.waitForStarted(START_MS) and child.waitForFinished(START_MS)
    if not finished:
        why = child.errorString()
        child.kill()
        child.waitForFinished(START_MS)
        silent = _("It does not answer: {why}").format(why=why)
        return False, f"{where}\n{silent}\n\n{how_to_install()}"
    said = bytes(child.readAllStandardOutput()).decode("utf-8", "replace").strip()
    if child.exitCode() != 0 or not said.startswith("deadwood-tool "):
        errors = bytes(child.readAllStandardError()).decode("utf-8", "replace").strip()
        damaged = _("This is not the toolbox, or it is damaged: {said}").format(said=errors or said)
        return False, f"{where}\n{damaged}\n\n{how_to_install()}"
    version, own = said.splitlines()[0].split()[1], read_manifest()["version"]
    if version != own:
        fix = "deadwood-tool qgis-plugin --output deadwood.zip"
        other = _("Or pack and install the plugin again: {command}")
        return False, f"{where}\n{said}\n{versions_of(own, version)}\n{other.format(command=fix)}"
    return True, f"{where}\n{said}\n{_('The plugin is of the same version. All is well.')}"


class CheckInstallation(QgsProcessingAlgorithm):
    """The report in the toolbox and for ``qgis_process``; it fails where the toolbox cannot be used."""

    def createInstance(self) -> QgsProcessingAlgorithm:
        return CheckInstallation()

    def name(self) -> str:
        return "checkinstallation"

    def displayName(self) -> str:
        return _("Check installation")

    def group(self) -> str:
        return group_label(START)

    def groupId(self) -> str:
        return "start"

    def shortDescription(self) -> str:
        return _("Is the toolbox found, does it start, and is it of the plugin's version?")

    def shortHelpString(self) -> str:
        says = _(
            "Reports where deadwood-tool was found, which Python, GDAL, PROJ and Numba it uses, and what to do if it "
            "is missing or of another version."
        )
        looks = _(
            "The tool is looked for in the setting (Settings > Options > Deadwood Toolbox, {setting}), in the variable "
            "{variable}, on the PATH, and in the usual folders of pip, pipx and uv."
        )
        return f"{says}<p>{html.escape(looks.format(setting=SETTING, variable=VARIABLE))}</p>"

    def icon(self) -> QIcon:
        return QIcon(str(HERE / "icons" / "deadwood.svg"))

    def initAlgorithm(self, configuration: dict[str, Any] | None = None) -> None:
        self.addOutput(QgsProcessingOutputString("REPORT", _("Report")))

    def processAlgorithm(
        self, parameters: dict[str, Any], context: QgsProcessingContext, feedback: QgsProcessingFeedback
    ) -> dict[str, Any]:
        works, text = report()
        if not works:
            raise QgsProcessingException(text)
        for line in text.splitlines():
            feedback.pushInfo(line)
        return {"REPORT": text}
