"""Drop the variables by which another program's GDAL and PROJ would take over ours.

With the PROJ_LIB of a QGIS or conda shell rasterio loses every CRS without a word (it logs one line and goes on with
``crs = None``), so this runs before any GIS library is imported.
"""

from __future__ import annotations

from collections.abc import MutableMapping

from deadwood_algorithms.files.network import ALLOWED

FOREIGN = ("PROJ_LIB", "PROJ_DATA", "GDAL_DATA", "GDAL_DRIVER_PATH")
KEEP = "DEADWOOD_KEEP_GDAL_ENV"  # set to anything but 0 by those who point these variables at files of their own


def drop_foreign_paths(environ: MutableMapping[str, str]) -> dict[str, str]:
    """Remove the variables and return what they were; nothing is removed where ``KEEP`` is set."""
    if environ.get(KEEP, "0") not in ("", "0"):
        return {}
    return {name: environ.pop(name) for name in FOREIGN if name in environ}


def stay_offline(environ: MutableMapping[str, str]) -> None:
    """Forbid GDAL the network, where the user has not allowed it, for what `files.network` cannot find in a file.

    A name that no file ends with leaves nothing that /vsicurl/ and its kin may open; a proxy where nobody listens
    stops the drivers that fetch by themselves.
    """
    if environ.get(ALLOWED, "0") in ("", "0"):
        environ["CPL_VSIL_CURL_ALLOWED_EXTENSIONS"] = "{none}"
        environ["GDAL_HTTP_PROXY"] = "http://127.0.0.1:1"
