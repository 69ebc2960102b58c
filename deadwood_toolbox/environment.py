"""Drop the variables by which another program's GDAL and PROJ would take over ours.

With the PROJ_LIB of a QGIS or conda shell rasterio loses every CRS without a word (it logs one line and goes on with
``crs = None``), so this runs before any GIS library is imported.
"""

from __future__ import annotations

from collections.abc import MutableMapping

FOREIGN = ("PROJ_LIB", "PROJ_DATA", "GDAL_DATA", "GDAL_DRIVER_PATH")
KEEP = "DEADWOOD_KEEP_GDAL_ENV"  # set to anything but 0 by those who point these variables at files of their own


def drop_foreign_paths(environ: MutableMapping[str, str]) -> dict[str, str]:
    """Remove the variables and return what they were; nothing is removed where ``KEEP`` is set."""
    if environ.get(KEEP, "0") not in ("", "0"):
        return {}
    return {name: environ.pop(name) for name in FOREIGN if name in environ}
