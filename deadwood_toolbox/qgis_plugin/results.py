"""Results into the map: every layer with its stored style, readable names, one group per run."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from qgis.core import (
    QgsLayerTreeGroup,
    QgsMapLayer,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingLayerPostProcessorInterface,
    QgsProject,
)
from qgis.utils import iface

from . import layer_facts, stored_style
from .language import title_of
from .refreshing import is_there

# From the top of the group down; other layers come between these layers and the rasters.
ORDER = (
    "reach",
    "reached_by",
    "arrivals",
    "deposits",
    "deposited_logs",
    "trajectories",
    "spread",
    "azimuths",
    "releases",
    "barriers",
    "trees",
)
LAST = ("hit_count", "reach_probability", "danger", "deposit_count", "speed_max", "energy_max", "jump_max", "dem")
# Layers of a run that are visible at first; the others are unticked in the group.
SHOWN = ("reach", "deposits", "hit_count")
RANK = "deadwood/rank"
PLACE = "deadwood/place"  # of a group: the folder or file whose layers it holds; two runs may have one title
Group = tuple[str, str]  # title and place


class Results:
    """The results of a tool: the requested outputs, and the files it names in them."""

    def __init__(self, tool: dict[str, Any], asked: dict[str, str], left: dict[str, str], command: str) -> None:
        self.tool, self.asked, self.left, self.command = tool, asked, left, command

    def parts(self) -> Iterator[tuple[str, str]]:
        """The declared parts of the outputs that exist, and their places."""
        for declared in self.tool["parameters"]:
            base = self.asked.get(declared["name"])
            for part in declared["parts"]:
                if base is None:
                    continue
                inside, _, layer = part.partition("|layername=")
                path = os.path.join(base, inside) if inside else base
                if is_there(path, layer):
                    yield part, f"{path}|layername={layer}" if layer else path

    def load(self, context: QgsProcessingContext, opens: bool) -> None:
        """Have QGIS load what the user wants to see: the ticked files, and a folder's layers if requested."""
        for declared in self.tool["parameters"]:
            path = self.asked.get(declared["name"])
            if path is None:
                continue
            waiting = context.layersToLoadOnCompletion()
            asked = next((uri for uri in waiting if os.path.abspath(uri) == path), None)
            if declared["widget"] == "output_folder":
                if opens and declared["required"] and context.project() is not None:
                    title = f"{self.tool['label']}: {Path(path).name}"
                    found = sources_of_folder(path, self.left)
                    announce(found, (title, path), context, context.project(), command=self.command)
            elif asked is not None:
                sources = sources_of_file(path)
                if len(sources) > 1:
                    project = waiting.pop(asked).project
                    context.setLayersToLoadOnCompletion(waiting)
                    title = f"{self.tool['label']}: {Path(path).stem}"
                    announce(sources, (title, path), context, project, command=self.command)
                else:  # of `waiting`, which is a copy, QGIS would not see it
                    details = context.layerToLoadOnCompletionDetails(asked)
                    title = _title(declared["label"], details.name, sources)
                    details.setPostProcessor(Arrival.kept(title, None, 0, True, self.command))


def _title(label: str, given: str, sources: Sequence[tuple[str, str]]) -> str:
    """The name of the only layer of a file: in words, where QGIS would show the label of the output with its ending;
    empty to keep the name that the user has given.
    """
    if given not in ("", label) or not sources:
        return ""
    ((name, source),) = sources
    return title_of(name) if "|layername=" in source else re.sub(r"\s*\(\.\w+\)$", "", label)


def layers_of(package: str) -> list[str]:
    """The layers with geometry in a GeoPackage."""
    query = "SELECT table_name FROM gpkg_contents WHERE data_type = 'features'"
    return [name for (name,) in stored_style.rows_in(package, query)]


def sources_of_file(path: str) -> list[tuple[str, str]]:
    """Name and source of each layer in a file."""
    if path.endswith(".gpkg"):
        return [(name, f"{path}|layername={name}") for name in layers_of(path)]
    return [(Path(path).stem, path)] if path.endswith(".tif") else []


def sources_of_folder(folder: str, left: dict[str, str]) -> list[tuple[str, str]]:
    """The files that the tool names in its folder, in their order in the map."""
    sources: list[tuple[str, str]] = []
    for path in dict.fromkeys(left.values()):
        if Path(folder) in Path(path).absolute().parents:
            sources += sources_of_file(path)
    return sorted(sources, key=lambda each: rank(each[0]))


def rank(name: str) -> int:
    if name in ORDER:
        return ORDER.index(name)
    return 100 + LAST.index(name) if name in LAST else 50


def announce(
    sources: list[tuple[str, str]],
    group: Group,
    context: QgsProcessingContext,
    project: QgsProject,
    shown: Collection[str] = SHOWN,
    titles: Mapping[str, str] | None = None,
    command: str = "",
) -> None:
    """Have QGIS load layers into a group, ticked if they are among those to be shown, or if none is."""
    for name, source in sources:
        title = (titles or {}).get(name) or title_of(name)
        details = QgsProcessingContext.LayerDetails(title, project, title)
        ticked = name in shown or not any(each in shown for each, _ in sources)
        details.setPostProcessor(Arrival.kept(title, group, rank(name), ticked, command))
        context.addLayerToLoadOnCompletion(source, details)


class Arrival(QgsProcessingLayerPostProcessorInterface):
    """Called once a layer is in the map: its own style, its name, its place."""

    alive: ClassVar[list[Arrival]] = []  # QGIS keeps no reference

    def __init__(self, title: str, group: Group | None, rank: int, shown: bool, command: str) -> None:
        super().__init__()
        self.command = command
        self.title, self.group, self.rank, self.shown = title, group, rank, shown

    @classmethod
    def kept(cls, title: str, group: Group | None, rank: int, shown: bool, command: str) -> Arrival:
        made = cls(title, group, rank, shown, command)
        cls.alive.append(made)
        return made

    def postProcessLayer(
        self, layer: QgsMapLayer, context: QgsProcessingContext, feedback: QgsProcessingFeedback
    ) -> None:
        stored_style.apply(layer)
        if self.title:
            layer.setName(self.title)
        layer_facts.describe(layer, self.command)
        if self.group:
            self._move(layer, context.project(), self.group)
        if iface is not None:
            iface.layerTreeView().refreshLayerSymbology(layer.id())
        if self in self.alive:
            self.alive.remove(self)

    def _move(self, layer: QgsMapLayer, project: QgsProject, known: Group) -> None:
        """Move it into the group of the run, at the position of its rank."""
        root = project.layerTreeRoot()
        node = root.findLayer(layer.id())
        if node is None:
            return
        title, place = known
        same = (each for each in root.findGroups(True) if each.customProperty(PLACE) == place)
        group = next(same, None) or root.insertGroup(0, title)
        group.setCustomProperty(PLACE, place)
        ranks = [each.customProperty(RANK, 0) for each in _children(group)]
        copy = node.clone()
        copy.setCustomProperty(RANK, self.rank)
        copy.setItemVisibilityChecked(self.shown)
        copy.setExpanded(self.shown and self.rank < 100)
        group.insertChildNode(sum(int(each) <= self.rank for each in ranks), copy)
        node.parent().removeChildNode(node)


def _children(group: QgsLayerTreeGroup) -> list[Any]:
    return list(group.children())
