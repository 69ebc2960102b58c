"""The encoding of the text in a dBASE table, of a shapefile or alone: by its bytes, because its .cpg is often lost."""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from deadwood_algorithms.params.commands import quoted
from deadwood_algorithms.params.tool import UserError

HEAD, NAME_BYTES = 32, 11  # bytes of the header and of each field's entry, and of its name
FIELDS_END = 0x0D  # after the last entry
BYTES = "ISO-8859-1"  # every byte is one character, so that nothing is lost on the way to `as_utf8`
UTF8 = ("utf-8", "utf8", "65001", "cp65001")


def is_utf8(place: Path, what: str) -> bool:
    """Whether the text of a table is UTF-8 (and not ASCII alone); rejects another text whose .cpg says UTF-8."""
    table = _beside(place, ".dbf")
    if table is None:
        return False
    texts = list(_texts_of(table))
    wrong = next((text for text, whole in texts if not _decodes(text, whole)), None)
    cpg = _beside(place, ".cpg")
    if wrong is not None and cpg and cpg.read_text("ascii", "ignore").strip().lower() in UTF8:
        shown = wrong.decode("cp1252", "replace").strip()
        raise UserError(
            f"{place} ({what}): its part {cpg.name} says that its text is UTF-8, but '{shown}' is not (read here as "
            f"Western European); write the true encoding there: echo CP1252> {quoted(cpg)}"
        )
    return bool(texts) and wrong is None


def as_utf8(frame: Any) -> Any:
    """The frame that was read as ``BYTES``; a character that the width of its field cut in two is dropped."""
    names = {name: _again(name) for name in frame.columns}
    texts = {name: frame[name].map(_again) for name in frame.select_dtypes(include=["object", "string"]).columns}
    return frame.assign(**texts).rename(columns=names)


def _again(text: Any) -> Any:
    return text.encode(BYTES).decode("utf-8", "ignore") if isinstance(text, str) else text


def _beside(place: Path, ending: str) -> Path | None:
    return next(
        (each for each in (place.with_suffix(ending), place.with_suffix(ending.upper())) if each.is_file()), None
    )


def _decodes(text: bytes, whole: bool) -> bool:
    try:
        codecs.getincrementaldecoder("utf-8")().decode(text, final=whole)
    except UnicodeDecodeError:
        return False
    return True


def _texts_of(table: Path) -> Iterator[tuple[bytes, bool]]:
    """The names and cells beyond ASCII, and whether each is whole: one that fills its field may have been cut."""
    raw = np.memmap(table, np.uint8, "r")
    if raw.size <= HEAD:
        return
    rows, start, width = (int.from_bytes(raw[a:b].tobytes(), "little") for a, b in ((4, 8), (8, 10), (10, 12)))
    rows = min(rows, (raw.size - start) // width) if width and raw.size > start else 0
    records = raw[start : start + rows * width].reshape(rows, width) if rows else np.empty((0, 1), np.uint8)
    at = 1  # the first byte of a record says whether it is deleted
    for entry in range(HEAD, start - 1, HEAD):
        if raw[entry] == FIELDS_END:
            return
        name, size = raw[entry : entry + NAME_BYTES], int(raw[entry + 16])
        cells = records[:, at : at + size] if raw[entry + NAME_BYTES] == ord("C") else records[:0]
        at += size
        yield from _beyond_ascii(name[None])
        yield from _beyond_ascii(cells)


def _beyond_ascii(cells: np.ndarray) -> Iterator[tuple[bytes, bool]]:
    for row in np.flatnonzero((cells > 127).any(axis=1)):
        text = cells[row].tobytes()
        bare = text.partition(b"\0")[0].rstrip(b" ")
        yield bare, len(bare) < len(text) - (len(text) == NAME_BYTES)
