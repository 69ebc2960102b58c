"""The files that SQLite keeps beside a GeoPackage, and whether another program has one open. Standard library only.

Changes that are not merged yet are in a ``-wal`` beside the file, content replaced by an unfinished change in a
``-journal``. Both belong to the file's name, not to its content: beside another file of that name SQLite replays them
into it. A program that crashed leaves them behind.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

WAL, SHARED_MEMORY, JOURNAL = "-wal", "-shm", "-journal"
ENDING = ".gpkg"
# The bytes of a database that SQLite locks, https://sqlite.org/fileformat2.html#lockbyte: pending, reserved and shared.
LOCK_BYTE, LOCK_BYTES = 0x40000000, 512


def beside(place: Path) -> list[Path]:
    """SQLite's files beside a GeoPackage, or beside a former one."""
    if place.suffix.lower() != ENDING:
        return []
    named = (place.with_name(place.name + ending) for ending in (WAL, SHARED_MEMORY, JOURNAL))
    return [each for each in named if _size(each) is not None]


def unmerged(place: Path) -> list[Path]:
    """Those of these files that affect what is read."""
    return [each for each in beside(place) if not each.name.endswith(SHARED_MEMORY) and _size(each)]


def is_held(place: Path) -> bool:
    """Whether another program reads or writes a GeoPackage now, or keeps it open with a ``-wal``."""
    if place.suffix.lower() != ENDING or not place.is_file():
        return False
    try:
        if os.name == "nt":
            os.replace(place, place)  # fails while SQLite has it open
            return False
        import fcntl

        with place.open("rb+") as handle:
            try:
                fcntl.lockf(handle, fcntl.LOCK_EX | fcntl.LOCK_NB, LOCK_BYTES, LOCK_BYTE)
            except (BlockingIOError, PermissionError):
                return True
    except PermissionError:
        return os.name == "nt"
    except OSError:  # a file system without locks
        return False
    return False


@contextmanager
def settled(place: Path) -> Iterator[Path]:
    """A GeoPackage to be read as SQLite would see it: the file itself, or a copy in which what its writer left
    beside it is merged or rolled back. The file itself is not changed; one that is open elsewhere is read in place."""
    left = unmerged(place)
    if not left or is_held(place):
        yield place
        return
    with tempfile.TemporaryDirectory(prefix="deadwood-") as folder:
        for each in (place, *left):
            shutil.copyfile(each, Path(folder) / each.name)
        copy = Path(folder) / place.name
        _settle(copy)
        yield copy


def _settle(copy: Path) -> None:
    import sqlite3
    from contextlib import closing, suppress

    with suppress(sqlite3.Error), closing(sqlite3.connect(copy)) as db:  # the reader reports what cannot be read
        db.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()
        db.execute("PRAGMA journal_mode = DELETE").fetchone()


def _size(place: Path) -> int | None:
    try:
        return place.stat().st_size
    except (OSError, ValueError):
        return None
