"""Runs to choose from: those whose layers are in the project, those made recently, and any folder that is one."""

from __future__ import annotations

import json
import os

from qgis.core import QgsProject, QgsProviderRegistry, QgsSettings

from .language import _

RECENT = "deadwood/recent_runs"
KEPT = 10


def made_by(folder: str) -> str:
    """The tool that made the result in a folder; empty if none did."""
    try:
        with open(os.path.join(folder, "manifest.json"), encoding="utf-8") as file:
            manifest = json.load(file)
    except (OSError, ValueError):
        return ""
    return str(manifest.get("tool") or "") if isinstance(manifest, dict) else ""


def of_project(tool: str = "slide-logs") -> list[str]:
    """The folders of this tool whose layers are in the project."""
    found = {}
    for layer in QgsProject.instance().mapLayers().values():
        path = QgsProviderRegistry.instance().decodeUri(layer.providerType(), layer.source()).get("path") or ""
        folder = os.path.dirname(os.path.abspath(path)) if path else ""
        if folder and folder not in found:
            found[folder] = made_by(folder) == tool
    return [folder for folder, is_run in found.items() if is_run]


def recent(tool: str = "slide-logs") -> list[str]:
    """The folders that this tool made last and that are still there, the latest first."""
    return [each for each in _remembered() if made_by(each) == tool]


def _remembered() -> list[str]:
    known = QgsSettings().value(RECENT) or []
    return [known] if isinstance(known, str) else list(known)  # a list of one comes back as its text


def remember(folder: str) -> None:
    """Add a result to the recent ones."""
    if made_by(folder):
        known = [folder, *(each for each in _remembered() if each != folder)]
        QgsSettings().setValue(RECENT, known[:KEPT])


def offered() -> list[str]:
    return list(dict.fromkeys([*of_project(), *recent()]))


def verdict(place: str) -> str:
    """What a folder is, in one line; empty if nothing is wrong with it, or none is named."""
    if not place or made_by(place):
        return ""
    if not os.path.isdir(place):
        return _("There is no folder {place}").format(place=place)
    return _("{place} is no run: it has no manifest.json").format(place=place)
