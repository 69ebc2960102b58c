"""The provider: one algorithm for each declaration in the manifest, and the check of the installation."""

from __future__ import annotations

from typing import Any

from qgis.core import QgsApplication, QgsProcessingProvider
from qgis.PyQt.QtGui import QIcon

from .algorithm import ToolAlgorithm
from .child import drift
from .finding import HERE, Missing, find
from .installation import CheckInstallation
from .language import _, translated
from .slope_model import SlopeToReport
from .start_here import StartHere


def icon(name: str) -> QIcon:
    return QIcon(str(HERE / "icons" / f"{name}.svg"))


class Provider(QgsProcessingProvider):
    def __init__(self, manifest: dict[str, Any]) -> None:
        super().__init__()
        self.manifest = manifest
        self.compared = False  # the versions of plugin and toolbox, so that asking again starts no process

    def id(self) -> str:
        return "deadwood"

    def name(self) -> str:
        return "Deadwood Toolbox"

    def longName(self) -> str:
        return f"Deadwood Toolbox {self.manifest['version']}"

    def versionInfo(self) -> str:
        return self.manifest["version"]

    def icon(self) -> QIcon:
        return icon("deadwood")

    def svgIconPath(self) -> str:
        return str(HERE / "icons" / "deadwood.svg")

    def warningMessage(self) -> str:
        """Shown above the tools in the toolbox; empty if all is well."""
        found = find()
        if isinstance(found, Missing):
            return f"{found.why}. " + _("Plugins > Deadwood Toolbox > Set up… installs it.")
        return drift(found.command) if self.compared else ""

    def supportsNonFileBasedOutput(self) -> bool:
        return False

    def supportedOutputRasterLayerExtensions(self) -> list[str]:
        return ["tif"]

    def supportedOutputVectorLayerExtensions(self) -> list[str]:
        return ["gpkg"]

    def defaultVectorFileExtension(self, hasGeometry: bool = True) -> str:
        return "gpkg"

    def defaultRasterFileExtension(self) -> str:
        return "tif"

    def loadAlgorithms(self) -> None:
        for tool in self.manifest["tools"]:
            if tool["qgis_id"]:
                self.addAlgorithm(ToolAlgorithm(translated(tool, self.manifest["tools"])))
        self.addAlgorithm(StartHere())
        self.addAlgorithm(CheckInstallation())
        if QgsApplication.processingRegistry().providerById(self.id()) is not None:
            self.addAlgorithm(SlopeToReport())  # whose steps are only found once the provider is registered
