"""Results into the map: every layer with its stored style, readable names, one group per run."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping
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

from . import stored_style
from .language import title_of

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


class Results:
    """The results of a tool: the requested outputs, and the files it names in them."""

    def __init__(self, tool: dict[str, Any], asked: dict[str, str], left: dict[str, str]) -> None:
        self.tool, self.asked, self.left = tool, asked, left

    def parts(self) -> Iterator[tuple[str, str]]:
        """The declared parts of the outputs that exist, and their places."""
        for declared in self.tool["parameters"]:
            base = self.asked.get(declared["name"])
            for part in declared["parts"]:
                if base is None:
                    continue
                inside, _, layer = part.partition("|layername=")
                path = os.path.join(base, inside) if inside else base
                if os.path.exists(path) and (not layer or layer in layers_of(path)):
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
                    announce(sources_of_folder(path, self.left), title, context, context.project())
            elif asked is not None:
                sources = sources_of_file(path)
                if len(sources) > 1:
                    project = waiting.pop(asked).project
                    context.setLayersToLoadOnCompletion(waiting)
                    announce(sources, f"{self.tool['label']}: {Path(path).stem}", context, project)
                else:  # of `waiting`, which is a copy, QGIS would not see it
                    context.layerToLoadOnCompletionDetails(asked).setPostProcessor(Arrival.kept("", "", 0, True))


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
    group: str,
    context: QgsProcessingContext,
    project: QgsProject,
    shown: Collection[str] = SHOWN,
    titles: Mapping[str, str] | None = None,
) -> None:
    """Have QGIS load layers into a group, ticked if they are among those to be shown, or if none is."""
    for name, source in sources:
        title = (titles or {}).get(name) or title_of(name)
        details = QgsProcessingContext.LayerDetails(title, project, title)
        ticked = name in shown or not any(each in shown for each, _ in sources)
        details.setPostProcessor(Arrival.kept(title, group, rank(name), ticked))
        context.addLayerToLoadOnCompletion(source, details)


class Arrival(QgsProcessingLayerPostProcessorInterface):
    """Called once a layer is in the map: its own style, its name, its place."""

    alive: ClassVar[list[Arrival]] = []  # QGIS keeps no reference

    def __init__(self, title: str, group: str, rank: int, shown: bool) -> None:
        super().__init__()
        self.title, self.group, self.rank, self.shown = title, group, rank, shown

    @classmethod
    def kept(cls, title: str, group: str, rank: int, shown: bool) -> Arrival:
        made = cls(title, group, rank, shown)
        cls.alive.append(made)
        return made

    def postProcessLayer(
        self, layer: QgsMapLayer, context: QgsProcessingContext, feedback: QgsProcessingFeedback
    ) -> None:
        stored_style.apply(layer)
        if self.title:
            layer.setName(self.title)
        if self.group:
            self._move(layer, context.project())
        if iface is not None:
            iface.layerTreeView().refreshLayerSymbology(layer.id())
        if self in self.alive:
            self.alive.remove(self)

    def _move(self, layer: QgsMapLayer, project: QgsProject) -> None:
        """Move it into the group of the run, at the position of its rank."""
        root = project.layerTreeRoot()
        node = root.findLayer(layer.id())
        if node is None:
            return
        group = root.findGroup(self.group) or root.insertGroup(0, self.group)
        ranks = [each.customProperty(RANK, 0) for each in _children(group)]
        copy = node.clone()
        copy.setCustomProperty(RANK, self.rank)
        copy.setItemVisibilityChecked(self.shown)
        copy.setExpanded(self.shown and self.rank < 100)
        group.insertChildNode(sum(int(each) <= self.rank for each in ranks), copy)
        node.parent().removeChildNode(node)


def _children(group: QgsLayerTreeGroup) -> list[Any]:
    return list(group.children())
