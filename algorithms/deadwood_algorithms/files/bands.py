"""Which band of a raster is read in a role, and what of it is valid: by the names of its bands, and its alpha band.

What rasterio opens is the file itself, or a GDAL virtual raster of the one band. So every reader sees a raster of one
band, whose mask is right.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
import rasterio
from rasterio.enums import ColorInterp, MaskFlags
from rasterio.errors import RasterioError

from deadwood_algorithms.intake import names

TAGS = ("NETCDF_VARNAME", "long_name", "standard_name", "GRIB_ELEMENT", "GRIB_COMMENT")
OF_ANGLES = ("degree", "degrees", "deg", "°", "percent", "%", "radian", "radians", "rad")  # units of no height
MOST_INSIDE = 50  # rasters in one file whose names are looked at
GDAL_TYPES = {"float32": "Float32", "float64": "Float64", "uint8": "Byte", "int8": "Int8"}


def name_of_band(source: Any, band: int) -> str:
    """All that a file says about the content of a band."""
    tags = source.tags(band)
    said = (source.descriptions[band - 1] or "", *(tags.get(each, "") for each in TAGS))
    unit = "slope" if (source.units[band - 1] or "").strip().lower() in OF_ANGLES else ""
    return " ".join(dict.fromkeys(each for each in (*said, unit) if each))


def rasters_inside(source: Any) -> dict[str, str]:
    """The rasters within a file (NetCDF, HDF, GeoPackage), and what each is called."""
    found = {}
    for each in source.subdatasets[:MOST_INSIDE]:
        name = each.rsplit(":", 1)[-1]
        try:
            with rasterio.open(each) as inside:
                name = f"{name} {name_of_band(inside, 1)}" if inside.count else name
        except RasterioError:
            continue
        found[each] = name
    return found


def inside(source: Any, what: str) -> str | None:
    """The raster within a file that is, by its name, the one of a role; None if none, or several, are."""
    found = rasters_inside(source)
    at = names.chosen(list(found.values()), what)
    return None if at is None else list(found)[at]


def first_of_role(source: Any, what: str) -> str | None:
    """The first raster within a file that may be the one of a role: a name such as slope comes last."""
    found = rasters_inside(source)
    return min(found, key=lambda each: names.is_derived(found[each], what), default=None)


def band_of(source: Any, what: str) -> int:
    """The band that is read in a role: the one of its name, else the first."""
    at = names.chosen([name_of_band(source, k) for k in source.indexes], what) if source.count > 1 else None
    return 1 if at is None else at + 1


def alpha_of(source: Any) -> int | None:
    """A band of opacity that GDAL does not take as the mask, because it is not of bytes; None if there is none."""
    flags = source.mask_flag_enums[0]
    at = next((k for k, kind in enumerate(source.colorinterp) if k and kind == ColorInterp.alpha), None)
    return None if at is None or MaskFlags.alpha in flags or MaskFlags.per_dataset in flags else at + 1


def source_of(path: str | Path, what: str) -> str:
    """What rasterio opens for a raster in a role: the path, a raster within the file, or a virtual raster of one band.

    Raises the errors of rasterio.
    """
    name = str(path)
    with rasterio.open(name) as source:
        if source.count == 0 and (within := inside(source, what)):
            return source_of(within, what)
        if source.count < 2 or name.lstrip().startswith("<VRTDataset"):
            return name
        band, alpha = band_of(source, what), alpha_of(source)
        return name if band == 1 and alpha is None else _one_band(source, name, band, alpha)


def _one_band(source: Any, name: str, band: int, alpha: int | None) -> str:
    """The XML of a virtual raster of one band, with its nodata, scale, offset and unit, and an alpha band as mask."""
    (ny, nx), kind = source.shape, np.dtype(source.dtypes[band - 1]).name
    place = name if ":" in name and not Path(name).exists() else str(Path(name).absolute())
    place = f'<SourceFilename relativeToVRT="0">{escape(place)}</SourceFilename>'
    span = (
        f'<SrcRect xOff="0" yOff="0" xSize="{nx}" ySize="{ny}"/><DstRect xOff="0" yOff="0" xSize="{nx}" ySize="{ny}"/>'
    )
    nodata, unit = source.nodatavals[band - 1], source.units[band - 1]
    facts = f"<Scale>{source.scales[band - 1]:.17g}</Scale><Offset>{source.offsets[band - 1]:.17g}</Offset>"
    facts += "" if nodata is None else f"<NoDataValue>{nodata:.17g}</NoDataValue>"
    facts += f"<UnitType>{escape(unit)}</UnitType>" if unit else ""
    described = escape(source.descriptions[band - 1] or "")
    flags, mask = source.mask_flag_enums[band - 1], ""
    of_all = f"mask,{band}" if MaskFlags.per_dataset in flags or MaskFlags.alpha in flags else ""
    if alpha or of_all:  # anything but 0 is valid: also an opacity of 1 of 1
        shown = f"{place}<SourceBand>{alpha or of_all}</SourceBand>{span}<ScaleRatio>{255 if alpha else 1}</ScaleRatio>"
        shown = f"<ComplexSource>{shown}</ComplexSource>"
        mask = f'<MaskBand><VRTRasterBand dataType="Byte">{shown}</VRTRasterBand></MaskBand>'
    srs = f"<SRS>{escape(source.crs.to_wkt())}</SRS>" if source.crs else ""
    steps = ", ".join(f"{each:.17g}" for each in source.transform.to_gdal())
    return (
        f'<VRTDataset rasterXSize="{nx}" rasterYSize="{ny}">{srs}<GeoTransform>{steps}</GeoTransform>'
        f'<VRTRasterBand dataType="{GDAL_TYPES.get(kind, kind.title().replace("Uint", "UInt"))}" band="1">'
        f"<Description>{described}</Description>{facts}"
        f"<SimpleSource>{place}<SourceBand>{band}</SourceBand>{span}</SimpleSource></VRTRasterBand>{mask}</VRTDataset>\n"
    )
