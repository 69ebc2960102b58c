"""What GDAL passes over in an ESRI ASCII grid without a word, and what would put a slope or its heights wrong.

Tried with GDAL 3.10: values missing at the end of a file are read as 0 m; a header that mixes ``xllcenter`` with
``yllcorner`` puts the grid at the origin.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from deadwood_algorithms.tool import UserError

HEADER_BYTES = 2000
CHUNK_BYTES = 2**24
KEYS = {"ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize", "dx", "dy", "nodata_value"}


def refuse_broken_ascii(path: str | Path, columns: int, rows: int) -> None:
    """Raise ``UserError`` where the header is mixed, or the number of values is not the one it promises."""
    keys = header_keys(path)
    if ("xllcenter" in keys) != ("yllcenter" in keys):
        raise UserError(
            f"{path}: the header mixes xll... and yll... of corner and centre; mend: write both as xllcorner and "
            "yllcorner (the centre less half a cellsize)"
        )
    values = count_words(path) - 2 * len(keys)
    if values != columns * rows:
        raise UserError(
            f"{path}: the file holds {values} values, but {rows} rows of {columns} make {columns * rows}; "
            "it is cut off or damaged, get it again"
        )


def header_keys(path: str | Path) -> list[str]:
    """The words of the header, in lower case; each is followed by its value."""
    with Path(path).open("rb") as source:
        words = source.read(HEADER_BYTES).decode("latin-1").lower().split()
    keys: list[str] = []
    while len(words) > 1 and words[0] in KEYS:
        keys.append(words[0])
        words = words[2:]
    return keys


def count_words(path: str | Path) -> int:
    """How many words, apart by white space, a file holds; in pieces, for such grids can be large."""
    count, within = 0, False
    with Path(path).open("rb") as source:
        while piece := source.read(CHUNK_BYTES):
            solid = np.frombuffer(piece, np.uint8) > 32
            count += int(np.count_nonzero(solid[1:] & ~solid[:-1])) + int(solid[0] and not within)
            within = bool(solid[-1])
    return count
