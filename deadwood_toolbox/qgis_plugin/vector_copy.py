"""A vector layer, or a part of it, saved for the tool, in the algorithm's own thread: 200 000 points take seconds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransformContext,
    QgsExpressionContext,
    QgsExpressionContextUtils,
    QgsFeature,
    QgsFeatureRequest,
    QgsFields,
    QgsProcessingFeedback,
    QgsVectorFileWriter,
    QgsVectorLayer,
    QgsVectorLayerFeatureSource,
    QgsWkbTypes,
)

ROW = "row_in_source"  # as in files/columns.py (a test)


@dataclass(frozen=True)
class Copy:
    """Features to be written, which no longer need the layer.

    ``part``: whether they may be a part of the layer; then each has the row that it has in the whole (``file``, if the
    layer is filtered), by which the tool calls one without an id.
    """

    source: QgsVectorLayerFeatureSource
    request: QgsFeatureRequest
    fields: QgsFields
    geometry: QgsWkbTypes.Type
    crs: QgsCoordinateReferenceSystem
    transforms: QgsCoordinateTransformContext
    part: bool
    file: str
    count: int
    name: str
    path: str

    def write(self, feedback: QgsProcessingFeedback) -> str:
        """Write the features; returns why that failed, empty if it did not."""
        rows = self._rows() if self.part else {}
        kept = [k for k in range(self.fields.count()) if self.fields.at(k).name().lower() != "fid"]
        fields = QgsFields()
        for k in kept:
            fields.append(self.fields.at(k))
        if rows:
            fields.append(QgsVectorLayer(f"None?field={ROW}:int", ROW, "memory").fields().at(0))
        options = QgsVectorFileWriter.SaveVectorOptions()
        options.driverName, options.layerName = "GPKG", self.name
        writer = QgsVectorFileWriter.create(self.path, fields, self.geometry, self.crs, self.transforms, options)
        if writer.hasError() != QgsVectorFileWriter.WriterError.NoError:
            return writer.errorMessage()
        for number, each in enumerate(self.source.getFeatures(self.request)):
            made = QgsFeature(fields)
            made.setGeometry(each.geometry())
            values = each.attributes()
            made.setAttributes([*(values[k] for k in kept), *([rows[each.id()]] if rows else [])])
            if feedback.isCanceled() or not writer.addFeature(made):
                return writer.errorMessage() or "-"
            if number % 1000 == 0 and self.count > 0:
                feedback.setProgress(100.0 * number / self.count)
        del writer  # closes the file
        return ""

    def _rows(self) -> dict[int, int]:
        """The row in the whole layer of each feature taken; empty if all are."""
        plain = QgsFeatureRequest().setFlags(QgsFeatureRequest.Flag.NoGeometry).setNoAttributes()
        whole = QgsVectorLayer(self.file, "whole", "ogr") if self.file else self.source
        rows = {feature.id(): row for row, feature in enumerate(whole.getFeatures(plain), 1)}
        taken = [feature.id() for feature in self._taken()]
        return {} if len(taken) == len(rows) or not set(taken) <= set(rows) else {each: rows[each] for each in taken}

    def _taken(self) -> Iterator[QgsFeature]:
        return self.source.getFeatures(QgsFeatureRequest(self.request))


def copy_of(
    layer: QgsVectorLayer,
    request: QgsFeatureRequest,
    transforms: QgsCoordinateTransformContext,
    *,
    part: bool,
    file: str,
    name: str,
    path: str,
) -> Copy:
    """What must be written of a layer, taken in the thread that owns it."""
    scopes = QgsExpressionContextUtils.globalProjectLayerScopes(layer)
    request.setExpressionContext(QgsExpressionContext(scopes))
    source = QgsVectorLayerFeatureSource(layer)
    count, kind = layer.featureCount(), layer.wkbType()
    return Copy(source, request, layer.fields(), kind, layer.crs(), transforms, part, file, count, name, path)
