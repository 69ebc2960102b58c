"""What is read from a raster: a digest of its values, mask, transform, CRS, nodata, scale and offset, as GDAL gives
them, whatever of this stands in the file itself or in files beside it (``.aux.xml``, ``.msk``, a world file).

Statistics, overviews, tags and compression are not read, so they change nothing.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from deadwood_algorithms.files.input_files import MANIFEST, tiles_of
from deadwood_algorithms.params.tool import UserError

# Not worth an attempt to open as a raster.
OTHERS = (".gpkg", ".json", ".geojson", ".csv", ".tsv", ".pts", ".shp", ".dbf", ".parquet", ".html", ".xlsx")
CELLS_AT_ONCE = 2**22
DEEPEST = 8  # a VRT of VRTs of ...


def rasters_in(place: Path) -> list[Path]:
    """The rasters that the path of an input stands for; none for the folder of a result, or for any other file."""
    with suppress(UserError, OSError, ValueError):
        if place.is_dir() and not (place / MANIFEST).is_file():
            return [Path(each) for each in tiles_of(place)]
        if place.is_file() and place.suffix.lower() not in OTHERS and raster_files(place):
            return [place]
    return []


def raster_files(place: Path, depth: int = DEEPEST) -> list[Path]:
    """Every file from which GDAL reads a raster, itself first, with the sources of a VRT; none if it cannot be read."""
    from rasterio.errors import RasterioError

    try:
        with _opened(place) as source:
            named = [Path(each) for each in source.files] if source.count else []
    except (RasterioError, OSError, ValueError):
        return []
    others = [each for each in named if each != place and each.is_file()]
    found = [place, *others] if named else []
    if place.suffix.lower() == ".vrt" and depth:
        found += [one for each in others for one in raster_files(each, depth - 1)]
    return list(dict.fromkeys(found))


def digest_of(place: Path, *, alone: bool = False) -> str | None:
    """Digest of all that is read of a raster; None if it cannot be read. ``alone``: without the files beside it."""
    from rasterio.errors import RasterioError

    try:
        with _opened(place, alone=alone) as source:
            return _digest(source)
    except (RasterioError, OSError, ValueError, MemoryError):
        return None


def is_as_stored(place: Path) -> bool:
    """Whether nothing beside a raster changes what is read from it."""
    return raster_files(place) in ([], [place]) or digest_of(place) == digest_of(place, alone=True)


def _digest(source: Any) -> str:
    from rasterio.windows import Window

    crs = source.crs.to_wkt() if source.crs else ""
    header = [source.count, source.shape, source.dtypes, tuple(source.transform)[:6], crs]
    bands = [source.nodatavals, source.scales, source.offsets, source.units, source.descriptions]
    digest = hashlib.sha256(repr([*header, *bands]).encode())
    masked = [number for number, flags in zip(source.indexes, source.mask_flag_enums, strict=True) if _is_mask(flags)]
    block = max(1, source.block_shapes[0][0])
    rows = max(1, CELLS_AT_ONCE // (source.width * source.count) // block) * block
    for start in range(0, source.height, rows):
        window = Window(0, start, source.width, min(rows, source.height - start))  # type: ignore[call-arg]
        digest.update(source.read(window=window).data)
        if masked:
            digest.update(source.read_masks(masked, window=window).data)
    return digest.hexdigest()


def _is_mask(flags: Sequence[Any]) -> bool:
    """Whether cells are masked by more than their value."""
    return not {each.name for each in flags} <= {"all_valid", "nodata"}


@contextmanager
def _opened(place: Path, *, alone: bool = False) -> Iterator[Any]:
    import rasterio

    options: dict[str, Any] = {"GDAL_DISABLE_READDIR_ON_OPEN": "EMPTY_DIR", "GDAL_PAM_ENABLED": "NO"} if alone else {}
    with rasterio.Env(**options), rasterio.open(place) as source:
        yield source
