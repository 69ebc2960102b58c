"""Inputs that come through the shell (``/dev/stdin``, ``<(...)``) as files, for libraries read an input more than once.

The files end with the command; results in folders keep what they were made from (`files.kept_inputs`).
"""

from __future__ import annotations

import dataclasses
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from deadwood_algorithms.params.tool import Tool, UserError

STREAM = re.compile(r"/dev/(stdin|fd/\d+)|/proc/self/fd/\d+")
HEAD_BYTES = 16
# A stream has no name whose ending says what it is: its first bytes do. What is none of these is a table.
BEGINNINGS = {
    ".gpkg": (b"SQLite format 3",),
    ".tif": (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"),
    ".geojson": (b"{", b"["),
    ".fgb": (b"fgb",),
    ".parquet": (b"PAR1",),
    ".asc": (b"ncols", b"NCOLS"),
}
TABLE = ".csv"


@contextmanager
def read_streams(tool: Tool, ask: Any) -> Iterator[Any]:
    """The ``Ask`` with files in place of streams; a message about such a file names the stream."""
    streams = {
        each.name: match
        for each in tool.parameters()
        if each.is_input and (match := re.fullmatch(rf"({STREAM.pattern})(\|.*)?", str(getattr(ask, each.name))))
    }
    if not streams:
        yield ask
        return
    from deadwood_algorithms.files.kept_inputs import lasting_no_longer_than_this

    with tempfile.TemporaryDirectory(prefix="deadwood-") as folder, lasting_no_longer_than_this(folder):
        files = {name: _read(match[1], name, Path(folder)) for name, match in streams.items()}
        try:
            yield dataclasses.replace(
                ask, **{name: f"{file}{streams[name].groups()[-1] or ''}" for name, file in files.items()}
            )
        except UserError as error:
            message = str(error)
            for name, file in files.items():
                message = message.replace(str(file), streams[name][1])
            raise UserError(message) from error


def _read(stream: str, name: str, folder: Path) -> Path:
    """The file that a stream was read into."""
    if stream == "/dev/stdin" and sys.stdin.isatty():
        raise UserError(f"{stream}: nothing comes through a pipe; give the path of a file")
    raw = folder / name
    try:
        with open(stream, "rb") as source, raw.open("wb") as target:
            shutil.copyfileobj(source, target)
    except OSError as error:
        raise UserError(f"{stream}: nothing can be read from it ({error.strerror}); give the path of a file") from error
    with raw.open("rb") as source:
        head = source.read(HEAD_BYTES).lstrip()
    return raw.rename(
        raw.with_suffix(next((ending for ending, known in BEGINNINGS.items() if head.startswith(known)), TABLE))
    )
