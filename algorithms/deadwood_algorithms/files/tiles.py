"""Several raster files that are tiles of one grid, read as one raster.

Terrain models of regions come in tiles. ``--dem`` takes them as a folder or separated by commas; the code that
reads it sees one dataset, whose windows are assembled from the tiles that they touch. Values of cells are kept
unchanged: tiles must lie on one grid, so nothing is resampled. Places without a tile are outside.
"""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
import pyproj
import rasterio
from numpy.typing import NDArray
from rasterio.coords import BoundingBox
from rasterio.enums import ColorInterp, MaskFlags
from rasterio.errors import RasterioError
from rasterio.transform import Affine
from rasterio.windows import Window

from deadwood_algorithms.files import remedies
from deadwood_algorithms.files.bands import band_of, source_of
from deadwood_algorithms.files.crs import crs_name, same_crs
from deadwood_algorithms.files.input_files import tiles_of
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, Quiet, UserError

DEM = "DEM"  # role in which the tiles are read
OFF_GRID_CELLS = 0.05  # tolerance for rounded headers (`dem_header.SHIFT_ALLOWED_CELLS`)
KEPT_OPEN = 32  # files
# Tiles that cover less than this share of their common extent do not belong to one terrain model.
MOST_SPANNED_CELLS, LEAST_COVERED = 1e8, 1e-3
SAME_HEIGHT_M = 0.005  # where tiles overlap, smaller differences of heights are due to rounding


def open_as_one(path: str | Path) -> Any:
    """Reopen a DEM that was checked before, of any number of tiles; raises the errors of rasterio, or `UserError`."""
    files = tiles_of(path)
    return rasterio.open(source_of(files[0], DEM)) if len(files) == 1 else mosaic_of(path, files)


def open_to_draw(path: str | Path) -> Any:
    """The same, always as a dataset of rasterio, which can read at reduced resolution."""
    files = tiles_of(path)
    return rasterio.open(source_of(files[0], DEM) if len(files) == 1 else mosaic_of(path, files).vrt())


def mosaic_of(path: str | Path, files: Sequence[str]) -> Mosaic:
    """Join tiles that were checked before."""
    tiles = []
    for each in files:
        with rasterio.open(source_of(each, DEM)) as source:
            tiles.append(Tile.of(each, source, source.transform))
    return Mosaic(path, tiles, Quiet())


@dataclass(frozen=True)
class Tile:
    """Header of one file."""

    path: str
    transform: Affine
    shape: tuple[int, int]
    crs: Any
    dtype: str
    nodata: float | None
    scale: float
    offset: float
    unit: str | None

    @staticmethod
    def of(path: str, source: Any, transform: Affine) -> Tile:
        facts = source.crs, source.dtypes[0], source.nodata, source.scales[0], source.offsets[0], source.units[0]
        return Tile(path, transform, source.shape, *facts)


class Mosaic:
    """Tiles as one dataset, with the part of rasterio's interface that `dem_windows` and similar modules need.

    Where tiles overlap, the first tile with a height counts; differences to others are reported once.
    """

    descriptions = (None,)
    count, driver, gcps, colorinterp = 1, "tiles", ((), None), (ColorInterp.undefined,)
    mask_flag_enums = ([MaskFlags.nodata],)

    def __init__(self, path: str | Path, tiles: Sequence[Tile], feedback: Feedback) -> None:
        first = tiles[0]
        self.name, self.tiles, self.feedback = str(path), list(tiles), feedback
        for each in tiles[1:]:
            _refuse_foreign(each, first)
        cell, step = first.transform.a, first.transform.e  # step < 0: the first row is the northernmost
        left = np.array([_off(each.transform.c, first.transform.c, cell) for each in tiles])
        top = np.array([_off(each.transform.f, first.transform.f, step) for each in tiles])
        self._left, self._top = np.rint(left).astype(int), np.rint(top).astype(int)
        self._left, self._top = self._left - self._left.min(), self._top - self._top.min()
        for off, each in zip(np.maximum(np.abs(left - np.rint(left)), np.abs(top - np.rint(top))), tiles, strict=True):
            if off > OFF_GRID_CELLS:
                raise UserError(
                    f"{each.path}: the tile's cells lie between those of {first.path} (by {off:.2g} of a cell), but "
                    "all tiles must lie on one grid; fix: warp it onto the cells of the others, or take the tiles of "
                    "one delivery"
                )
        sizes = np.array([each.shape for each in tiles])
        self._right, self._bottom = self._left + sizes[:, 1], self._top + sizes[:, 0]
        self.height, self.width = int(self._bottom.max()), int(self._right.max())
        self._refuse_scattered(sizes)
        at = int(np.argmin(self._left)), int(np.argmin(self._top))
        corner = tiles[at[0]].transform.c, tiles[at[1]].transform.f
        self.transform = Affine(cell, 0.0, corner[0], 0.0, step, corner[1])
        self.crs, self.units = first.crs, (first.unit,)
        self.scales, self.offsets = (first.scale,), (first.offset,)
        self.dtypes = (str(np.result_type(*{each.dtype for each in tiles})),)
        self.nodata = _nodata_of(tiles, np.dtype(self.dtypes[0]))
        self.block_shapes = [(256, 256)]
        self._open: OrderedDict[str, Any] = OrderedDict()
        self._told = False

    def _refuse_scattered(self, sizes: NDArray[np.int64]) -> None:
        """Reject tiles so far apart that almost nothing of their extent has a height."""
        spanned, covered = float(self.height) * self.width, float((sizes[:, 0] * sizes[:, 1]).sum())
        if spanned < MOST_SPANNED_CELLS or covered > LEAST_COVERED * spanned:
            return
        middle = np.median(self._left), np.median(self._top)
        k = int(np.argmax(np.hypot(self._left - middle[0], self._top - middle[1])))
        x, y = self.tiles[k].transform.c, self.tiles[k].transform.f
        raise UserError(
            f"{self.name}: the {len(self.tiles)} tiles are {covered / spanned:.1g} of the ground that they span, "
            f"{self.width} x {self.height} cells; {self.tiles[k].path} (its corner at {x:.0f}, {y:.0f}) lies farthest "
            "from the others: correct its georeference, or leave it out"
        )

    def tags(self, band: int) -> dict[str, str]:
        return {}

    @property
    def shape(self) -> tuple[int, int]:
        return self.height, self.width

    @property
    def bounds(self) -> BoundingBox:
        far = self.transform.c + self.width * self.transform.a, self.transform.f + self.height * self.transform.e
        return BoundingBox(self.transform.c, far[1], far[0], self.transform.f)

    def read(self, band: int = 1, *, window: Window | None = None, masked: bool = False) -> NDArray[Any]:
        """The numbers of a window within the grid, as stored in the files; masked or nodata where there is no tile."""
        window = window or Window(0, 0, self.width, self.height)  # type: ignore[call-arg]
        rows = int(window.row_off), int(window.row_off + window.height)
        columns = int(window.col_off), int(window.col_off + window.width)
        out = np.full((rows[1] - rows[0], columns[1] - columns[0]), self.nodata, self.dtypes[0])
        empty = np.ones(out.shape, bool)
        touched = (self._left < columns[1]) & (self._right > columns[0])
        touched &= (self._top < rows[1]) & (self._bottom > rows[0])
        for k in np.flatnonzero(touched):
            left, right = max(columns[0], self._left[k]), min(columns[1], self._right[k])
            top, bottom = max(rows[0], self._top[k]), min(rows[1], self._bottom[k])
            part = Window(left - self._left[k], top - self._top[k], right - left, bottom - top)  # type: ignore[call-arg]
            found = self._read(self.tiles[k], part)
            known = ~np.ma.getmaskarray(found) & np.isfinite(found.data)
            place = slice(top - rows[0], bottom - rows[0]), slice(left - columns[0], right - columns[0])
            self._compare(out[place], found.data, known & ~empty[place], self.tiles[k])
            fresh = known & empty[place]
            out[place][fresh] = found.data[fresh]
            empty[place][fresh] = False
        return np.ma.MaskedArray(out, empty) if masked else out

    def _read(self, tile: Tile, part: Window) -> Any:
        try:
            if tile.path not in self._open:
                self._open[tile.path] = rasterio.open(source_of(tile.path, DEM))
                if len(self._open) > KEPT_OPEN:
                    self._open.popitem(last=False)[1].close()
            self._open.move_to_end(tile.path)
            return self._open[tile.path].read(1, window=part, masked=True)
        except RasterioError as error:
            raise UserError(
                f"{tile.path}: the tile is damaged ({str(error.__cause__ or error).splitlines()[0].rstrip('.')}); "
                "get a new copy"
            ) from error

    def _compare(self, have: NDArray[Any], found: NDArray[Any], both: NDArray[np.bool_], tile: Tile) -> None:
        """Warn, once, if a tile has other heights where it overlaps earlier ones."""
        if self._told or not both.any():
            return
        apart = np.abs(have[both].astype(np.float64) - found[both].astype(np.float64)) * abs(self.scales[0])
        if apart.max() > SAME_HEIGHT_M:
            self._told = True
            self.feedback.warn(
                f"{tile.path}: where it overlaps tiles before it, "
                f"{counted(int((apart > SAME_HEIGHT_M).sum()), 'cell differs', 'cells differ')} "
                f"from theirs, by up to {apart.max():.2f} m; the first tile's heights are taken",
                code="tiles-differ",
                largest_m=float(apart.max()),
            )

    def vrt(self, beside: Path | None = None) -> str:
        """The XML of a GDAL virtual raster of these tiles, for programs that read one; paths are relative to
        ``beside``.

        Its sources are in reverse order: in a virtual raster the last one counts.
        """
        kind = {"float32": "Float32", "float64": "Float64", "uint8": "Byte"}.get(self.dtypes[0], self.dtypes[0].title())
        kind = kind.replace("Uint", "UInt")
        nodata = f"{self.nodata:.17g}"
        sources = []
        for k in reversed(range(len(self.tiles))):
            tile, relative, place = self.tiles[k], 0, os.path.abspath(self.tiles[k].path)
            if beside is not None:
                with suppress(ValueError):  # another drive
                    place, relative = Path(os.path.relpath(place, beside.absolute())).as_posix(), 1
            with rasterio.open(tile.path) as whole:
                band = band_of(whole, DEM)
            (rows, columns), empty = tile.shape, f"<NODATA>{tile.nodata}</NODATA>" if tile.nodata is not None else ""
            sources.append(
                f'<ComplexSource><SourceFilename relativeToVRT="{relative}">{escape(place)}</SourceFilename>'
                f'<SourceBand>{band}</SourceBand><SrcRect xOff="0" yOff="0" xSize="{columns}" ySize="{rows}"/>'
                f'<DstRect xOff="{self._left[k]}" yOff="{self._top[k]}" xSize="{columns}" ySize="{rows}"/>'
                f"{empty}</ComplexSource>"
            )
        srs = escape(self.crs.to_wkt()) if self.crs else ""
        return (
            f'<VRTDataset rasterXSize="{self.width}" rasterYSize="{self.height}"><SRS>{srs}</SRS>'
            f"<GeoTransform>{', '.join(f'{each:.17g}' for each in self.transform.to_gdal())}</GeoTransform>"
            f'<VRTRasterBand dataType="{kind}" band="1"><NoDataValue>{nodata}</NoDataValue>'
            f"<Scale>{self.scales[0]:.17g}</Scale><Offset>{self.offsets[0]:.17g}</Offset>"
            f"{''.join(sources)}</VRTRasterBand></VRTDataset>\n"
        )

    def close(self) -> None:
        while self._open:
            self._open.popitem()[1].close()

    def __enter__(self) -> Mosaic:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _off(here: float, there: float, step: float) -> float:
    return (here - there) / step


def _refuse_foreign(tile: Tile, first: Tile) -> None:
    """Reject a tile whose grid, or whose reference of heights, differs from that of the first."""
    a, b = tile.transform, first.transform
    fix = "give tiles of one delivery only"
    if abs(a.a - b.a) * max(*tile.shape, *first.shape) > OFF_GRID_CELLS * b.a:
        raise UserError(
            f"{tile.path}: the tile's cells are {a.a:.9g} m large, those of {first.path} {b.a:.9g} m, but all tiles "
            f"must have the same; {fix}, or warp it to the others' cells"
        )
    if (a.e < 0) != (b.e < 0):
        raise UserError(
            f"{tile.path}: the tile's rows run in the opposite direction to those of {first.path} (north-up, "
            f"south-up), but all must have the same direction; {fix}"
        )
    one, other = (pyproj.CRS.from_wkt(each.crs.to_wkt()) if each.crs else None for each in (tile, first))
    if (one is None) != (other is None) or (one is not None and other is not None and not same_crs(one, other)):
        names = [crs_name(each) if each else "no CRS" for each in (one, other)]
        raise UserError(
            f"{tile.path}: the tile is in {names[0]}, but {first.path} in {names[1]}; reproject all tiles to one CRS"
        )
    if (tile.scale, tile.offset) != (first.scale, first.offset):
        raise UserError(
            f"{tile.path}: the tile's heights have the scale {tile.scale:g} and offset {tile.offset:g}, those of "
            f"{first.path} {first.scale:g} and {first.offset:g}; fix, for each: "
            f"{remedies.unscaled(tile.path)}"
        )


def _nodata_of(tiles: Sequence[Tile], dtype: np.dtype) -> float:
    """A number for cells without a height that fits the type of every tile: the tiles' own if they agree."""
    own = {each.nodata for each in tiles if each.nodata is not None}
    if len(own) == 1:
        return own.pop()
    return float("nan") if dtype.kind == "f" else float(np.iinfo(dtype).min)
