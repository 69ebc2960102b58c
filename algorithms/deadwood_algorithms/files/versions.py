"""The Python and the libraries with which the toolbox works here; each is loaded, so that a damaged one is found."""

from __future__ import annotations

import platform
import sys


def lines() -> list[str]:
    """One line each for Python, the GIS libraries with the GDAL, PROJ and GEOS that they contain, and the numerical
    ones.
    """
    import geopandas
    import numba
    import numpy
    import pyogrio
    import pyproj
    import rasterio
    import shapely

    other = ".".join(map(str, pyogrio.__gdal_version__))  # each wheel contains its own GDAL
    return [
        f"Python {platform.python_version()} ({sys.executable})",
        f"rasterio {rasterio.__version__} (GDAL {rasterio.__gdal_version__}), "
        f"pyogrio {pyogrio.__version__} (GDAL {other})",
        f"pyproj {pyproj.__version__} (PROJ {pyproj.proj_version_str}), "
        f"shapely {shapely.__version__} (GEOS {shapely.geos_version_string})",
        f"geopandas {geopandas.__version__}, numpy {numpy.__version__}, numba {numba.__version__}",
    ]
