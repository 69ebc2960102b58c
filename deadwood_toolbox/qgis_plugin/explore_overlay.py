"""Hits and deposits over the map, without a layer: a picture that the canvas draws, whatever the project's CRS.

The cells are in the CRS of the terrain model. If the map has another one, the picture is cut into pieces so small
that each can be placed by an affine transformation, to a quarter of a cell.
"""

from __future__ import annotations

from array import array
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from qgis.core import (
    Qgis,
    QgsColorRampShader,
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsCsException,
    QgsPointXY,
    QgsProject,
    QgsRasterBlock,
    QgsRasterFileWriter,
    QgsRasterLayer,
    QgsRasterShader,
    QgsRectangle,
    QgsSingleBandPseudoColorRenderer,
)
from qgis.gui import QgsMapCanvas, QgsMapCanvasItem
from qgis.PyQt.QtCore import QPointF, QRectF, QSizeF, Qt
from qgis.PyQt.QtGui import QColor, QImage, QPainter, QPen, QPolygonF, QTransform

from .language import _

OPAQUE = 0.72
EXACT_CELLS = 0.25  # largest displacement of a cell
DEEPEST = 6  # largest number of halvings of the picture
DOT = 5.0  # size of a dot [pixels]
HALO = "#ffffff"


@dataclass(frozen=True)
class Hits:
    """Counts of a box of cells and the ends of the logs, in the CRS of the terrain model.

    counts : row by row from the north; west, north : of the box [m]; ends : by stop reason
    """

    counts: Sequence[int]
    columns: int
    rows: int
    west: float
    north: float
    cell: float
    crs: QgsCoordinateReferenceSystem
    ends: dict[str, list[tuple[float, float]]] = field(default_factory=dict)

    def picture(self, ramp: Sequence[Mapping[str, Any]], logs: int) -> QImage:
        """For each cell the share of the logs, in the colour of the nearest share of the ramp; 0 is transparent."""
        alpha = round(255 * OPAQUE) << 24
        known = [alpha | int(each["colour"][1:], 16) for each in ramp]
        bounds = [logs * 0.5 * (one["share"] + other["share"]) for one, other in zip(ramp, ramp[1:])]  # noqa: B905, RUF007
        table = [0, *(known[bisect_right(bounds, value)] for value in range(1, max(self.counts, default=0) + 1))]
        pixels = array("I", map(table.__getitem__, self.counts)).tobytes()
        size = (self.columns, self.rows, 4 * self.columns)
        return QImage(pixels, *size, QImage.Format.Format_ARGB32).copy()

    def place(self, column: float, row: float) -> tuple[float, float]:
        return self.west + column * self.cell, self.north - row * self.cell

    def pieces(self, move: Callable[[float, float], tuple[float, float]]) -> Iterator[tuple[QRectF, QTransform]]:
        """Parts of the picture, each with the transformation from its pixels into the map."""

        def moved(column: float, row: float) -> tuple[float, float]:
            return move(*self.place(column, row))

        def part(c: int, r: int, columns: int, rows: int, depth: int) -> Iterator[tuple[QRectF, QTransform]]:
            x, y = moved(c, r)
            east, south, far, middle = (
                (each[0] - x, each[1] - y)
                for each in (
                    moved(c + columns, r),
                    moved(c, r + rows),
                    moved(c + columns, r + rows),
                    moved(c + 0.5 * columns, r + 0.5 * rows),
                )
            )
            side = max(abs(east[0]), abs(east[1])) / columns  # of a cell, in the map's unit
            off = max(
                max(abs(far[k] - east[k] - south[k]), abs(middle[k] - 0.5 * (east[k] + south[k]))) for k in (0, 1)
            )
            if off > EXACT_CELLS * side and depth < DEEPEST and columns > 1 and rows > 1:
                left, upper = columns // 2, rows // 2
                yield from part(c, r, left, upper, depth + 1)
                yield from part(c + left, r, columns - left, upper, depth + 1)
                yield from part(c, r + upper, left, rows - upper, depth + 1)
                yield from part(c + left, r + upper, columns - left, rows - upper, depth + 1)
                return
            affine = QTransform(
                east[0] / columns, east[1] / columns, south[0] / rows, south[1] / rows, x, y
            )  # of the part's own pixels
            yield QRectF(c, r, columns, rows), affine

        if self.columns and self.rows:
            yield from part(0, 0, self.columns, self.rows, 0)


class Overlay(QgsMapCanvasItem):
    """Draws the latest hits; the map below is not rendered again."""

    def __init__(self, canvas: QgsMapCanvas, looks: dict[str, Any]) -> None:
        super().__init__(canvas)
        self.canvas, self.ramp = canvas, looks["ramp"]
        self.released = looks["colours"]["release"]
        self.ring: list[tuple[float, float]] = []
        self.ring_crs = QgsCoordinateReferenceSystem()
        self.stops = {each["reason"]: each for each in looks["stops"]}
        self.hits: Hits | None = None
        self.picture = QImage()
        self.drawn = QImage()  # the whole view, as last drawn
        self.view: Any = None
        self.shown: Callable[[], None] | None = None  # called when something new is on the screen
        self.setZValue(50)  # under rubber bands and the selection's marks

    def put(self, hits: Hits | None, logs: int = 1) -> None:
        self.hits, self.view = hits, None
        if hits is not None:
            self.picture = hits.picture(self.ramp, logs)
        else:
            self.ring = []
        self.updatePosition()

    def circle(self, ring: list[tuple[float, float]], crs: QgsCoordinateReferenceSystem) -> None:
        """Show at once where logs are released; their hits follow."""
        self.ring, self.ring_crs, self.view = ring, crs, None
        self.update()

    def boundingRect(self) -> QRectF:
        return QRectF(0.0, 0.0, self.canvas.width(), self.canvas.height())

    def updatePosition(self) -> None:
        self.prepareGeometryChange()
        self.setPos(QPointF(0.0, 0.0))
        self.update()

    def paint(self, painter: QPainter | None, option: Any = None, widget: Any = None) -> None:
        if painter is None or (self.hits is None and not self.ring):
            return
        settings = self.canvas.mapSettings()
        matrix, ratio = self.canvas.getCoordinateTransform().transform(), self.canvas.devicePixelRatioF()
        view = (matrix, self.canvas.size(), ratio, settings.destinationCrs())
        if self.view is None or self.view != view:
            self.drawn = self._draw(*view)
            self.view = view
        painter.drawImage(QPointF(0.0, 0.0), self.drawn)
        if self.shown is not None and self.hits is not None:
            self.shown()

    def _draw(self, matrix: QTransform, size: Any, ratio: float, crs: QgsCoordinateReferenceSystem) -> QImage:
        """The view as a picture: the hits, the logs' ends, the circle of the release."""
        drawn = QImage(size * ratio, QImage.Format.Format_ARGB32_Premultiplied)
        drawn.setDevicePixelRatio(ratio)
        drawn.fill(Qt.GlobalColor.transparent)
        painter = QPainter(drawn)
        try:
            if self.hits is not None:
                moved = mover(self.hits.crs, crs)
                self._draw_cells(painter, list(self.hits.pieces(moved)), matrix)
                painter.setRenderHint(QPainter.RenderHint.Antialiasing)
                for stop, ends in self.hits.ends.items():
                    self._draw_ends(painter, matrix.map(polygon(ends, moved)), self.stops[stop])
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            ring = matrix.map(polygon(self.ring, mover(self.ring_crs, crs)))
            for colour, width in ((HALO, 4.0), (self.released, 2.0)):
                painter.setPen(QPen(QColor(colour), width))
                painter.drawPolyline(ring)
        except QgsCsException:
            drawn.fill(Qt.GlobalColor.transparent)  # outside the area of the map's CRS
        finally:
            painter.end()
        return drawn

    def _draw_cells(self, painter: QPainter, pieces: list[tuple[QRectF, QTransform]], matrix: QTransform) -> None:
        """Neighbouring pieces overlap by half a cell, so that no gap shows between them."""
        more = QSizeF(0.5, 0.5) if len(pieces) > 1 else QSizeF(0.0, 0.0)
        painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_Source)
        for part, affine in pieces:
            painter.setTransform(affine * matrix)
            size = part.size() + more
            painter.drawImage(QRectF(QPointF(0.0, 0.0), size), self.picture, QRectF(part.topLeft(), size))
        painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_SourceOver)
        painter.resetTransform()

    def _draw_ends(self, painter: QPainter, dots: QPolygonF, look: dict[str, str]) -> None:
        is_round = look["shape"] == "circle"
        for colour, width in ((HALO, DOT + 2.0), (look["colour"], DOT)):
            pen = QPen(QColor(colour), width)
            pen.setCapStyle(Qt.PenCapStyle.RoundCap if is_round else Qt.PenCapStyle.SquareCap)
            painter.setPen(pen)
            painter.drawPoints(dots)


def mover(
    source: QgsCoordinateReferenceSystem, target: QgsCoordinateReferenceSystem
) -> Callable[[float, float], tuple[float, float]]:
    """Moves a place from one CRS to another."""
    move = QgsCoordinateTransform(source, target, QgsProject.instance())

    def moved(x: float, y: float) -> tuple[float, float]:
        place = move.transform(QgsPointXY(x, y))
        return place.x(), place.y()

    return moved


def polygon(places: Sequence[tuple[float, float]], moved: Callable[[float, float], tuple[float, float]]) -> QPolygonF:
    return QPolygonF([QPointF(*moved(*each)) for each in places])


def saved_layer(hits: Hits, path: str, name: str, colours: Sequence[Mapping[str, Any]], logs: int) -> QgsRasterLayer:
    """The counts as a GeoTIFF and a layer of it; 0 is nodata, so that the map shows through."""
    east, south = hits.place(hits.columns, hits.rows)
    box = QgsRectangle(hits.west, south, east, hits.north)
    kind = Qgis.DataType.UInt16
    made = QgsRasterFileWriter(path).createOneBandRaster(kind, hits.columns, hits.rows, box, hits.crs)
    if made is None:
        raise OSError(_("{path} could not be written").format(path=path))
    made.setNoDataValue(1, 0.0)
    block = QgsRasterBlock(kind, hits.columns, hits.rows)
    block.setData(bytes(array("H", hits.counts)))
    written = made.writeBlock(block, 1, 0, 0)
    made.setEditable(False)
    del made  # closes the file
    layer = QgsRasterLayer(path, name)
    if not written or not layer.isValid():
        raise OSError(_("{path} could not be written").format(path=path))
    ramp = QgsColorRampShader(logs * colours[0]["share"], logs * colours[-1]["share"])
    ramp.setColorRampItemList(
        [
            QgsColorRampShader.ColorRampItem(logs * share, QColor(each["colour"]), f"{100.0 * share:.3g} %")
            for each, share in ((each, each["share"]) for each in colours)
        ]
    )
    shader = QgsRasterShader()
    shader.setRasterShaderFunction(ramp)
    layer.setRenderer(QgsSingleBandPseudoColorRenderer(layer.dataProvider(), 1, shader))
    layer.setOpacity(OPAQUE)
    return layer
