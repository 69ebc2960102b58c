"""Inputs that are not there: one line that says so, before a library tries to open them."""

from __future__ import annotations

from pathlib import Path

from deadwood_algorithms.tool import UserError


def refuse_missing(path: str | Path, what: str) -> None:
    """Raise ``UserError`` for an input that is missing, empty, a folder, or may not be read."""
    place = Path(path)
    try:
        if place.is_dir() and place.suffix.lower() != ".gdb":
            raise UserError(f"{path}: the {what} is a folder, but must be a file")
        if not place.exists():
            raise UserError(f"{path}: the {what} file does not exist (looked in {place.absolute().parent})")
        if place.is_file() and place.stat().st_size == 0:
            raise UserError(f"{path}: the {what} file is empty (0 bytes)")
        if place.is_file():
            with place.open("rb"):
                pass
    except OSError as error:
        raise UserError(f"{path}: the {what} file may not be read ({error.strerror})") from error
