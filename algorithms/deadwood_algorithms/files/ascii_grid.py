"""Defects of an ESRI ASCII grid that GDAL accepts silently and that would give wrong positions or heights.

Tested with GDAL 3.10: values missing at the end of a file, and words among them, are read as 0 m; a header that mixes
``xllcenter`` with ``yllcorner`` puts the grid at the origin. Also why GDAL does not recognise a grid at all: a byte
order mark, UTF-16, an empty first line.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import UserError

HEADER_BYTES = 2000
CHUNK_BYTES = 2**24
NUMBER_BYTES = np.zeros(256, bool)  # characters of numbers, nan and inf, including decimal commas and Fortran's 1d5
NUMBER_BYTES[list(b" \t\r\n\v\f+-.,0123456789eEdDnNaAiIfF#")] = True
MARKS = {b"\xef\xbb\xbf": "UTF-8 with a byte order mark", b"\xff\xfe": "UTF-16", b"\xfe\xff": "UTF-16"}
KEYS = {"ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize", "dx", "dy", "nodata_value"}


def refuse_broken_ascii(path: str | Path, columns: int, rows: int) -> None:
    """Raise ``UserError`` if the header is mixed, or the number of values is not the one that it announces."""
    keys = header_keys(path)
    if ("xllcenter" in keys) != ("yllcenter" in keys):
        raise UserError(
            f"{path}: the header mixes xll... and yll... of corner and centre; fix: write both as xllcorner and "
            "yllcorner (the centre less half a cellsize)"
        )
    _refuse_words(path, len(keys))
    values = count_words(path) - 2 * len(keys)
    if values != columns * rows:
        raise UserError(
            f"{path}: the file holds {values} values, but {counted(rows, 'row')} of {columns} make {columns * rows}; "
            "it is truncated or damaged; get a new copy"
        )


def why_not_ascii(path: str | Path) -> str | None:
    """Why a file that looks like an ASCII grid is not recognised as one; None if it does not look like one."""
    with Path(path).open("rb") as source:
        head = source.read(HEADER_BYTES)
    if b"ncols" not in head.replace(b"\0", b"").lower():
        return None
    coding = next((name for mark, name in MARKS.items() if head.startswith(mark)), None)
    if coding is None and b"\0" in head:
        coding = "UTF-16"
    if coding:
        return f"the ASCII grid is coded as {coding}; save it as plain text (ANSI, or UTF-8 without mark)"
    if not head.lower().startswith((b"ncols", b"nrows")):
        return "an ASCII grid must begin with 'ncols' in its first line; delete what stands before it"
    lacking = [key for key in ("nrows", "cellsize") if key.encode() not in head.lower()]
    return f"the header of the ASCII grid has no '{lacking[0]}'" if lacking else None


def _refuse_words(path: str | Path, header_lines: int) -> None:
    """Raise ``UserError`` for a word among the numbers, which GDAL would read as 0 m; names its row in the grid."""
    with Path(path).open("rb") as source:
        for _ in range(header_lines):  # if the lines end with CR only, this is the whole file, and nothing is checked
            source.readline()
        row = 0
        while piece := source.read(CHUNK_BYTES):
            letters = np.frombuffer(piece, np.uint8)
            wrong = np.flatnonzero(~NUMBER_BYTES[letters])
            if wrong.size:
                at = int(wrong[0])
                row += piece.count(b"\n", 0, at) + 1
                before, behind = piece[max(0, at - 20) : at].split(), piece[at : at + 20].split()
                word = (before[-1] if before and not piece[at - 1 : at].isspace() else b"") + behind[0]
                raise UserError(
                    f"{path}, row {row} of the grid: '{word.decode('latin-1')}' is not a number; correct it"
                )
            row += piece.count(b"\n")


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
    """Number of words, separated by white space, in a file; it is read in pieces because such grids can be large."""
    count, within = 0, False
    with Path(path).open("rb") as source:
        while piece := source.read(CHUNK_BYTES):
            solid = np.frombuffer(piece, np.uint8) > 32
            count += int(np.count_nonzero(solid[1:] & ~solid[:-1])) + int(solid[0] and not within)
            within = bool(solid[-1])
    return count
