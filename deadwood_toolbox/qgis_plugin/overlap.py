"""Before the tool starts: is the terrain in metres, and does every other layer lie on it?"""

from __future__ import annotations

from qgis.core import (
    QgsCoordinateTransform,
    QgsCsException,
    QgsMapLayer,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingFeedback,
    QgsRasterLayer,
    QgsUnitTypes,
    QgsVectorLayer,
)

from .inputs import Inputs
from .language import _

METRES = QgsUnitTypes.DistanceUnit.DistanceMeters


def check_places(inputs: Inputs, context: QgsProcessingContext, feedback: QgsProcessingFeedback) -> None:
    """Reject a terrain in degrees or feet and a layer completely outside it; report what is reprojected.

    Layers that cannot be opened here are left to the tool: it reads more formats than QGIS, and reports problems
    better.
    """
    layers = [(declared, _layer(source, declared["widget"])) for declared, source in inputs.layers]
    dem = next((layer for declared, layer in layers if declared["name"] == "dem" and layer is not None), None)
    if dem is None or not dem.isValid() or not dem.crs().isValid():
        return
    if dem.crs().isGeographic() or dem.crs().mapUnits() != METRES:
        unit = _("degrees") if dem.crs().isGeographic() else QgsUnitTypes.toString(dem.crs().mapUnits())
        message = _(
            "The terrain model '{dem}' is in {crs}, whose unit is {unit}, but must be in a projected CRS in metres; "
            "reproject it (Raster > Projections > Warp)"
        )
        raise QgsProcessingException(message.format(dem=dem.name(), crs=_name(dem), unit=unit))
    for declared, layer in layers:
        if layer is None or layer is dem or not layer.isValid() or not layer.crs().isValid():
            continue
        extent = layer.extent()
        if extent.isNull() or (isinstance(layer, QgsVectorLayer) and not layer.isSpatial()):
            continue
        move = QgsCoordinateTransform(layer.crs(), dem.crs(), context.transformContext())
        try:
            place = move.transformBoundingBox(extent)
        except QgsCsException:
            place = None
        if place is None or not place.intersects(dem.extent()):
            message = _(
                "{label}: the layer '{layer}' ({crs}) lies entirely outside the terrain model '{dem}' ({crs_of_dem}); "
                "choose another layer, or check its CRS"
            )
            names = {"label": declared["label"], "layer": layer.name(), "dem": dem.name()}
            raise QgsProcessingException(message.format(crs=_name(layer), crs_of_dem=_name(dem), **names))
        if layer.crs() != dem.crs():
            message = _("{layer}: in {crs}, the tool reprojects it to {crs_of_dem}")
            feedback.pushInfo(message.format(layer=layer.name(), crs=_name(layer), crs_of_dem=_name(dem)))


def _layer(source: QgsMapLayer | str, widget: str) -> QgsMapLayer | None:
    """A layer of the map, or what QGIS opens at a path; None if it opens nothing or is empty."""
    if isinstance(source, QgsMapLayer):
        return source
    name = source.partition("|")[0].replace("\\", "/").rpartition("/")[2]
    if widget == "raster":
        return QgsRasterLayer(source, name)
    vector = QgsVectorLayer(source, name, "ogr")
    return vector if vector.isValid() and vector.featureCount() > 0 else None


def _name(layer: QgsMapLayer) -> str:
    return layer.crs().authid() or layer.crs().description() or _("an unnamed CRS")
