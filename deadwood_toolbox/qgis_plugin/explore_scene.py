"""The panel's record of the scene loaded by the engine: its corner, the names of its lines, its trees by place."""

from __future__ import annotations

import math
from collections import defaultdict

from qgis.core import QgsCoordinateReferenceSystem, QgsCoordinateTransform, QgsPointXY, QgsProject, QgsVectorLayer

from .explore_child import Frame
from .explore_overlay import Hits

CORNERS = 48  # of a circle
NEAR_M = 0.5  # largest difference of a tree's place between two versions of PROJ


class Scene:
    """What the engine reported of its scene, in the CRS of the terrain model."""

    def __init__(self, frame: Frame, crs: QgsCoordinateReferenceSystem) -> None:
        self.crs, self.facts = crs, frame.facts
        self.west, self.south = frame.facts["origin"]
        self.height = frame.facts["extent"][3]
        self.trees = frame.arrays["trees_x"], frame.arrays["trees_y"]
        self.names = {each["line_id"]: str(each["name"] or each["line_id"]) for each in frame.facts["lines"]}
        self._squares: dict[tuple[int, int], list[int]] | None = None

    def local(self, point: QgsPointXY, crs: QgsCoordinateReferenceSystem) -> tuple[float, float]:
        """A place of the map in the engine's coordinates [m]."""
        place = QgsCoordinateTransform(crs, self.crs, QgsProject.instance()).transform(point)
        return place.x() - self.west, place.y() - self.south

    def circle(self, x: float, y: float, radius: float) -> list[tuple[float, float]]:
        """Where logs are released, as a closed line in the CRS of the terrain model."""
        angles = [2.0 * math.pi * k / CORNERS for k in range(CORNERS + 1)]
        x, y = self.west + x, self.south + y
        return [(x + radius * math.cos(each), y + radius * math.sin(each)) for each in angles]

    def trees_of(self, layer: QgsVectorLayer) -> tuple[list[int], int]:
        """The scene's numbers of the selected trees, and how many of these are not in it."""
        places = [
            self.local(feature.geometry().asPoint(), layer.crs())
            if not feature.geometry().isMultipart()
            else self.local(feature.geometry().asMultiPoint()[0], layer.crs())
            for feature in layer.selectedFeatures()
            if not feature.geometry().isEmpty()
        ]
        found = [self._nearest(x, y) for x, y in places]
        known = sorted({each for each in found if each is not None})
        return known, layer.selectedFeatureCount() - sum(each is not None for each in found)

    def _nearest(self, x: float, y: float) -> int | None:
        if self._squares is None:
            self._squares = defaultdict(list)
            east, north = self.trees
            for number, a in enumerate(east):
                self._squares[math.floor(a), math.floor(north[number])].append(number)
        column, row = math.floor(x), math.floor(y)
        around = (
            number
            for c in (column - 1, column, column + 1)
            for r in (row - 1, row, row + 1)
            for number in self._squares.get((c, r), ())
        )
        away, nearest = min(((self._away(number, x, y), number) for number in around), default=(math.inf, -1))
        return nearest if away <= NEAR_M else None

    def _away(self, number: int, x: float, y: float) -> float:
        return math.hypot(self.trees[0][number] - x, self.trees[1][number] - y)

    def hits(self, answer: Frame, name: str) -> Hits:
        """The picture of an answer; ``name`` is that of its counts."""
        rows, columns = answer.shapes[name]
        cell = self.facts["cell"]
        column, row = answer.facts["at"]
        ends: dict[str, list[tuple[float, float]]] = defaultdict(list)
        xs, ys = answer.arrays["deposits_x"], answer.arrays["deposits_y"]
        for log, reason in enumerate(answer.arrays["deposits_reason"]):
            ends[self.facts["reasons"][int(reason)]].append((self.west + xs[log], self.south + ys[log]))
        west, north = self.west + column * cell, self.south + self.height - row * cell
        return Hits(answer.arrays[name], columns, rows, west, north, cell, self.crs, dict(ends))
