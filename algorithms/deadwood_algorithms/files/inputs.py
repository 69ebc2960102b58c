"""Inputs that do not exist or are not files: rejected with one line before a library tries to open them."""

from __future__ import annotations

from pathlib import Path

from deadwood_algorithms.files.network import is_special, refuse_elsewhere, refuse_pointers
from deadwood_algorithms.files.ways_out import refuse_foreign
from deadwood_algorithms.params.tool import UserError

LONGEST_SHOWN = 300  # characters of a path in a message


def refuse_missing(path: str | Path, what: str) -> None:
    """Raise ``UserError`` for an input that is missing, empty, a folder, a pipe, elsewhere, or may not be read."""
    place = Path(path)
    if not str(path).strip():
        raise UserError(f"the {what} file has no name; give its path")
    if "\0" in str(path):
        raise UserError(f"the path of the {what} file holds a NUL character; write it again")
    try:
        refuse_foreign(path, what)
        refuse_elsewhere(path, what)
        if place.is_dir() and place.suffix.lower() != ".gdb":
            raise UserError(f"{path}: this is a folder, but the {what} must be a file")
        if not place.exists():
            parts = str(path).split(",")
            if len(parts) > 1 and all(Path(part.strip()).exists() for part in parts):
                raise UserError(
                    f"{path}: the {what} input is one file, and these are {len(parts)}; join them first (in QGIS: "
                    "Vector, Data Management Tools, Merge Vector Layers)"
                )
            raise UserError(f"{path}: the {what} file does not exist (looked in {place.absolute().parent})")
        if is_special(place):
            raise UserError(
                f"{path}: this is a pipe or a device, but the {what} must be a file; write it to a file first"
            )
        if place.is_file() and place.stat().st_size == 0:
            raise UserError(f"{path}: the {what} file is empty (0 bytes)")
        if place.is_file():
            with place.open("rb"):
                pass
            refuse_pointers(place, what)
    except OSError as error:
        shown = str(path) if len(str(path)) <= LONGEST_SHOWN else f"{str(path)[:40]} ... {str(path)[-40:]}"
        raise UserError(f"{shown}: the {what} file may not be read ({error.strerror})") from error
