"""How a GeoTIFF of the toolbox is finished: statistics, overviews, colour table, in the cloud-optimized layout.

A file is first written plainly beside its place. When its values are all there, it is copied by GDAL's COG driver,
which orders it (overviews first, then tiles), so that a viewer finds at once what it shows, also over a network. The
same values give the same bytes.

Of a window of a large grid only the window's tiles are stored. GDAL's drivers would walk over all the empty rest, tile
by tile (32 s a raster of 30 000 x 30 000 cells), so such a raster of more than `WALKED_CELLS` stays as it was written,
with statistics and without overviews: zoomed out, its few tiles are quick to read as they are.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
import rasterio.shutil
from numpy.typing import NDArray

from deadwood_algorithms.files import styles

WALKED_CELLS = 100_000_000
ROWS_AT_ONCE = 64  # of which statistics are made: what a processor's cache holds


class BandStatistics:
    """Statistics of the bands of a raster, gathered from the windows as they are written."""

    def __init__(self, bands: int, nodata: float | None) -> None:
        self.nodata = nodata
        self.count = np.zeros(bands, np.int64)
        self.low, self.high = np.full(bands, np.inf), np.full(bands, -np.inf)
        self.total, self.square = np.zeros(bands), np.zeros(bands)

    def add(self, band: int, values: NDArray[Any]) -> None:
        """Values of a band, from 0; NaN and nodata are none."""
        for start in range(0, len(values), ROWS_AT_ONCE):
            self._add(band, values[start : start + ROWS_AT_ONCE])

    def _add(self, band: int, values: NDArray[Any]) -> None:
        known = np.isfinite(values) if values.dtype.kind == "f" else np.ones(values.shape, bool)
        if self.nodata is not None and np.isfinite(self.nodata):
            known &= values != self.nodata
        some = (values if known.all() else values[known]).astype(np.float64)
        if some.size:
            self.count[band] += some.size
            self.low[band] = min(self.low[band], some.min())
            self.high[band] = max(self.high[band], some.max())
            self.total[band] += some.sum()
            self.square[band] += (some**2).sum()

    def add_zeros(self, cells: int) -> None:
        """So many cells in each band that were not written, and read as 0."""
        if cells > 0:
            self.count += cells
            self.low, self.high = np.minimum(self.low, 0.0), np.maximum(self.high, 0.0)

    def tags(self, band: int, cells: int) -> dict[str, str]:
        """As GDAL stores them, for a raster of so many cells; none where there is no value."""
        n = int(self.count[band])
        if not n:
            return {}
        mean = self.total[band] / n
        spread = float(np.sqrt(max(self.square[band] / n - mean**2, 0.0)))
        numbers = {"MINIMUM": self.low[band], "MAXIMUM": self.high[band], "MEAN": mean, "STDDEV": spread}
        told = {f"STATISTICS_{name}": f"{value:.9g}" for name, value in numbers.items()}
        return told | {"STATISTICS_VALID_PERCENT": f"{100.0 * n / cells:.4g}"}


class GeoTiff:
    """A GeoTIFF in the making: ``target`` is open for writing; `finish` puts it in its place.

    Parameters
    ----------
    profile : as for ``rasterio.open``; with ``sparse_ok`` what is not written is not stored
    kind : of the raster (`styles.RASTERS`), which decides on its colour table and how overviews are made
    """

    def __init__(self, path: Path, profile: dict[str, Any], kind: str | None = None) -> None:
        self.path, self.kind = path, kind
        self.sparse = bool(profile.get("sparse_ok") or profile.get("SPARSE_OK"))
        self.cells = profile["height"] * profile["width"]
        self.plain = self.sparse and self.cells > WALKED_CELLS
        self.profile = profile
        self.staged = path if self.plain else path.with_name(f".{path.name[:80]}.staged")
        self.statistics = BandStatistics(profile["count"], profile.get("nodata"))
        # It is packed anew when it is copied; until then a file of moderate size need not be at all.
        packing: dict[str, Any] = {"zlevel": 1} if self.cells > WALKED_CELLS else {"compress": "none", "predictor": 1}
        facts: dict[str, Any] = profile if self.plain else profile | packing
        self.target: Any = rasterio.open(self.staged, "w", **facts)
        if colours := styles.colour_table(kind):
            self.target.write_colormap(1, colours)

    def finish(self) -> None:
        """Close the file and bring it into its layout."""
        for band in range(self.profile["count"]):
            tags = self.statistics.tags(band, self.cells)
            if tags:
                self.target.update_tags(band + 1, **tags)
        self.target.close()
        if self.plain:
            return
        options = {
            "compress": "DEFLATE",
            "predictor": "YES",
            "blocksize": str(self.profile["blockxsize"]),
            "bigtiff": "IF_SAFER",
            "overview_resampling": styles.overview_resampling(self.kind),
            "sparse_ok": "TRUE" if self.sparse else "FALSE",
        }
        try:
            rasterio.shutil.copy(self.staged, self.path, driver="COG", **options)
        finally:
            self.discard()

    def discard(self) -> None:
        """Drop what stands beside the file's place."""
        self.target.close()
        if not self.plain:
            for each in (self.staged, self.staged.with_name(self.staged.name + ".aux.xml")):
                if os.path.lexists(each):
                    each.unlink()
