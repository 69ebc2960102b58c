"""What the layer's properties say of a raster and its file does not, written to a file for the tool.

Cells that the user has declared to be without data (Properties > Transparency > Additional no data value), a nodata of
the file that he has switched off, and a CRS that he has given to the layer in the map.
"""

from __future__ import annotations

from qgis.core import (
    Qgis,
    QgsRasterDataProvider,
    QgsRasterFileWriter,
    QgsRasterIterator,
    QgsRasterLayer,
    QgsRasterRange,
)

from .language import _

NOTHING = -3.4028234663852886e38  # in a cell without data: the lowest number of four bytes, which no height is
SHORT = (Qgis.DataType.Byte, Qgis.DataType.Int16, Qgis.DataType.UInt16, Qgis.DataType.Float32)  # four bytes hold these


def held_by_the_map(layer: QgsRasterLayer, path: str) -> list[str]:
    """What of a raster layer is not in its file; a file without a CRS is handed over as it is, with that of the map."""
    provider, why = layer.dataProvider(), []
    bands = range(1, provider.bandCount() + 1)
    if any(provider.userNoDataValues(band) for band in bands):
        why.append(_("the cells without data that its properties name"))
    if any(provider.sourceHasNoDataValue(band) and not provider.useSourceNoDataValue(band) for band in bands):
        why.append(_("the nodata of the file, which its properties switch off"))
    own = QgsRasterLayer(path, "own").crs()
    if own.isValid() and own != layer.crs():
        why.append(_("its CRS, which the map has set"))
    return why


def write(layer: QgsRasterLayer, path: str) -> bool:
    """Write the raster with its nodata and its CRS as the map has them; whether that worked."""
    source = layer.dataProvider().clone()
    bands = list(range(1, source.bandCount() + 1))
    kinds = {source.dataType(band) for band in bands}
    kind = Qgis.DataType.Float32 if kinds <= set(SHORT) else Qgis.DataType.Float64
    size = source.xSize(), source.ySize()
    writer = QgsRasterFileWriter(path)
    target = writer.createMultiBandRaster(kind, *size, source.extent(), layer.crs(), len(bands))
    if target is None or not target.isValid():
        return False
    for band in bands:
        target.setNoDataValue(band, NOTHING)
    target.setEditable(True)
    worked = all(_band(source, target, band, kind, size) for band in bands)
    target.setEditable(False)
    del target  # closes the file
    if layer.providerType() == "gdal":
        _units(layer.dataProvider().dataSourceUri(), path)
    return worked


def _band(
    source: QgsRasterDataProvider, target: QgsRasterDataProvider, band: int, kind: Qgis.DataType, size: tuple[int, int]
) -> bool:
    declared = source.userNoDataValues(band)
    source.setUserNoDataValue(band, [])  # or they are bits beside the block, which are not written
    parts = QgsRasterIterator(source)
    parts.startRasterRead(band, *size, source.extent())
    while True:
        more, _width, _height, block, left, top = parts.readNextRasterPart(band)
        if not more:
            return True
        own = [QgsRasterRange(block.noDataValue(), block.noDataValue())] if block.hasNoDataValue() else []
        if not block.convert(kind):
            return False
        block.setNoDataValue(NOTHING)
        block.applyNoDataValues([*declared, *own])
        if not target.writeBlock(block, band, left, top):
            return False


def _units(source: str, path: str) -> None:
    """The unit of the heights, by which the tool tells feet from metres; QGIS itself neither reads nor writes it."""
    from osgeo import gdal  # QGIS's own

    one, other = gdal.Open(source), gdal.Open(path, gdal.GA_Update)
    for band in range(1, one.RasterCount + 1):
        other.GetRasterBand(band).SetUnitType(one.GetRasterBand(band).GetUnitType())
