"""Properties of a raster layer that its file does not contain, written to a file for the tool.

Cells that the user has declared to be without data (Properties > Transparency > Additional no data value), a nodata
value of the file that was switched off, and a CRS assigned to the layer in the map.

For single values without data, this is a virtual raster over the file, which takes no time however large the
file is. Ranges of values, scaled rasters and layers without a file are copied, in the algorithm's own thread.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from html import escape

from qgis.core import (
    Qgis,
    QgsCoordinateReferenceSystem,
    QgsProcessingFeedback,
    QgsRasterDataProvider,
    QgsRasterFileWriter,
    QgsRasterIterator,
    QgsRasterLayer,
    QgsRasterRange,
)

from .language import _

NOTHING = -3.4028234663852886e38  # value of a cell without data: the lowest 4-byte float, which is not a height
# types that four bytes can hold
SHORT = (Qgis.DataType.Byte, Qgis.DataType.Int16, Qgis.DataType.UInt16, Qgis.DataType.Float32)


def held_by_the_map(layer: QgsRasterLayer, path: str) -> list[str]:
    """Properties of a raster layer that are not in its file; a file without a CRS is passed unchanged, with that of the
    map.
    """
    provider, why = layer.dataProvider(), []
    bands = range(1, provider.bandCount() + 1)
    if any(provider.userNoDataValues(band) for band in bands):
        why.append(_("the cells without data that its properties name"))
    if any(provider.sourceHasNoDataValue(band) and not provider.useSourceNoDataValue(band) for band in bands):
        why.append(_("the nodata value of the file, which its properties disable"))
    own = QgsRasterLayer(path, "own").crs()
    if own.isValid() and own != layer.crs():
        why.append(_("its CRS, which the map has set"))
    return why


# --- a virtual raster ------------------------------------------------------------------------------------------------


def view(layer: QgsRasterLayer, path: str) -> bool:
    """Write a virtual raster of a layer that is in a file, if possible; returns whether it was."""
    from osgeo import gdal  # QGIS's own

    provider = layer.dataProvider()
    bands = range(1, provider.bandCount() + 1)
    if any(each.min() != each.max() for band in bands for each in provider.userNoDataValues(band)):
        return False
    source = gdal.Open(provider.dataSourceUri())
    if source is None or any(_is_scaled(source.GetRasterBand(band)) for band in bands):
        return False
    nothing = [_nothing(provider, band) for band in bands]
    file = provider.dataSourceUri()
    links = max(1, *(len(each) - 1 for each in nothing))
    for link in range(1, links + 1):  # each replaces one value by the next, the last of which is the nodata value
        target = path if link == links else f"{os.path.splitext(path)[0]}_{link}.vrt"
        _link(source, file, target, [each[link - 1 : link + 1] for each in nothing], layer.crs())
        source, file = gdal.Open(target), target
    return source is not None


def _is_scaled(band: object) -> bool:
    """Whether QGIS shows other numbers than those in the file, or a mask, which a virtual raster would ignore."""
    from osgeo import gdal

    scaled = band.GetScale() not in (None, 1.0) or band.GetOffset() not in (None, 0.0)  # type: ignore[attr-defined]
    return scaled or bool(band.GetMaskFlags() & gdal.GMF_PER_DATASET)  # type: ignore[attr-defined]


def _nothing(provider: QgsRasterDataProvider, band: int) -> list[float]:
    """The values of cells without data."""
    values = [each.min() for each in provider.userNoDataValues(band)]
    if provider.sourceHasNoDataValue(band) and provider.useSourceNoDataValue(band):
        values.append(provider.sourceNoDataValue(band))
    return list(dict.fromkeys(values))


def _link(
    source: object, file: str, target: str, nothing: list[list[float]], crs: QgsCoordinateReferenceSystem
) -> None:
    """A virtual raster in which the first of two values of a band is the second, and the last is its nodata."""
    from osgeo import gdal

    wide, high = source.RasterXSize, source.RasterYSize  # type: ignore[attr-defined]
    made = gdal.GetDriverByName("VRT").Create(target, wide, high, 0)
    made.SetGeoTransform(source.GetGeoTransform())  # type: ignore[attr-defined]
    made.SetProjection(crs.toWkt(QgsCoordinateReferenceSystem.WktVariant.WKT_PREFERRED_GDAL))
    for number, values in enumerate(nothing, 1):
        of_file = source.GetRasterBand(number)  # type: ignore[attr-defined]
        made.AddBand(of_file.DataType)
        band = made.GetRasterBand(number)
        band.SetUnitType(of_file.GetUnitType())
        if values:
            band.SetNoDataValue(values[-1])
        taken = f"<NODATA>{values[0]!r}</NODATA>" if len(values) > 1 else ""
        window = f'xOff="0" yOff="0" xSize="{wide}" ySize="{high}"'
        words = (
            f'<ComplexSource><SourceFilename relativeToVRT="0">{escape(file)}</SourceFilename>'
            f"<SourceBand>{number}</SourceBand><SrcRect {window}/><DstRect {window}/>{taken}</ComplexSource>"
        )
        band.SetMetadataItem("source_0", words, "new_vrt_sources")
    made.FlushCache()


# --- a copy ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Copy:
    """A raster to be written, which no longer needs the layer and may be written in another thread."""

    source: QgsRasterDataProvider
    crs: QgsCoordinateReferenceSystem
    file: str  # whose unit of heights it has; empty if there is none
    path: str

    def write(self, feedback: QgsProcessingFeedback) -> bool:
        """Write the raster with its nodata and its CRS as the map has them; returns whether that worked."""
        source = self.source
        bands = list(range(1, source.bandCount() + 1))
        kinds = {source.dataType(band) for band in bands}
        kind = Qgis.DataType.Float32 if kinds <= set(SHORT) else Qgis.DataType.Float64
        size = source.xSize(), source.ySize()
        target = QgsRasterFileWriter(self.path).createMultiBandRaster(
            kind, *size, source.extent(), self.crs, len(bands)
        )
        if target is None or not target.isValid():
            return False
        for band in bands:
            target.setNoDataValue(band, NOTHING)
        target.setEditable(True)
        worked = all(_band(source, target, band, kind, size, feedback) for band in bands)
        target.setEditable(False)
        del target  # closes the file
        if self.file and worked:
            _units(self.file, self.path)
        return worked


def copy_of(layer: QgsRasterLayer, path: str) -> Copy:
    provider = layer.dataProvider()
    file = provider.dataSourceUri() if layer.providerType() == "gdal" else ""
    return Copy(provider.clone(), layer.crs(), file, path)


def _band(
    source: QgsRasterDataProvider,
    target: QgsRasterDataProvider,
    band: int,
    kind: Qgis.DataType,
    size: tuple[int, int],
    feedback: QgsProcessingFeedback,
) -> bool:
    declared = source.userNoDataValues(band)
    source.setUserNoDataValue(band, [])  # otherwise they are bits beside the block, which are not written
    parts = QgsRasterIterator(source)
    parts.startRasterRead(band, *size, source.extent())
    while not feedback.isCanceled():
        more, _wide, high, block, left, top = parts.readNextRasterPart(band)
        if not more:
            return True
        own = [QgsRasterRange(block.noDataValue(), block.noDataValue())] if block.hasNoDataValue() else []
        if not block.convert(kind):
            return False
        block.setNoDataValue(NOTHING)
        block.applyNoDataValues([*declared, *own])
        if not target.writeBlock(block, band, left, top):
            return False
        feedback.setProgress(100.0 * (top + high) / size[1])
    return False


def _units(source: str, path: str) -> None:
    """The unit of the heights, by which the tool distinguishes feet from metres; QGIS itself neither reads nor writes
    it.
    """
    from osgeo import gdal

    one, other = gdal.Open(source), gdal.Open(path, gdal.GA_Update)
    for band in range(1, one.RasterCount + 1):
        other.GetRasterBand(band).SetUnitType(one.GetRasterBand(band).GetUnitType())
