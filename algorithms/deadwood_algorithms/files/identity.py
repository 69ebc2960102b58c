"""The identity of files: SHA-256 of all files that determine what is read, a digest of what is read, and whether it has
changed. Heavy libraries are imported only for rasters.

The path of an input may stand for several files (`input_files`, `decoded`). A GeoPackage changes its bytes without
changing its content (QGIS opens it, stores a style in it, or keeps changes in a ``-wal`` beside it), and so does a
raster (statistics, overviews), so ``content`` is a digest of the rows, or of all that is read of the raster: if either
is the same, so is the input.
"""

from __future__ import annotations

import errno
import hashlib
import marshal
import os
import sqlite3
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.parse import quote

from deadwood_algorithms.files.decoded import digest_of, raster_files, rasters_in
from deadwood_algorithms.files.input_files import MANIFEST, files_of, made_from, places_of
from deadwood_algorithms.files.sqlite_files import settled, unmerged
from deadwood_algorithms.params.manifest import moved_paths

BLOCK_BYTES = 2**20
SETTLED_NS = 2 * 10**9  # a file that was written this recently may change again within one tick of its clock
ROWS_AT_ONCE = 2000
OURS = ("layer_styles", "gpkg_metadata")  # tables of styles and metadata in a GeoPackage
CRS_OF_TABLE = (
    "SELECT organization, organization_coordsys_id FROM gpkg_geometry_columns JOIN gpkg_spatial_ref_sys USING (srs_id) "
    "WHERE table_name = ?"
)
DECODED = -1  # ends the key of what was decoded, beside those of bytes
SAME, CHANGED, GONE = "same", "changed", "gone"

# digests by (device, inode, size, times): an unchanged file is hashed once per process
_known: dict[tuple[int, ...], str] = {}


def stamp_of(path: Path) -> tuple[int, ...] | None:
    """A stamp that changes when a file is written to; None if it does not exist."""
    try:
        stat = path.stat()
    except (OSError, ValueError):
        return None
    return stat.st_dev, stat.st_ino, stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns


def sha256_of(path: Path) -> str:
    """SHA-256 of a file's bytes, as ``sha256sum`` gives it."""
    stamp = stamp_of(path)
    if stamp is not None and (found := _known.get(stamp)):
        return found
    if not path.is_file():  # reading a pipe might never end
        raise OSError(errno.EINVAL, "no regular file", str(path))
    digest = hashlib.sha256()
    with path.open("rb", buffering=0) as source:
        block = memoryview(bytearray(BLOCK_BYTES))
        while size := source.readinto(block):
            digest.update(block[:size])
    found = digest.hexdigest()
    if stamp is not None and stamp == stamp_of(path) and max(stamp[3:]) < time.time_ns() - SETTLED_NS:
        _known[stamp] = found
    return found


def of_input(named: str, *, decoded: bool = True) -> dict[str, Any]:
    """Record of an input.

    ``sha256`` and ``bytes`` of one file are its own; of several files ``sha256`` is that of the lines that
    ``sha256sum`` prints of them, and ``files`` has each. ``content``, which is left out unless ``decoded``, is the
    digest of what is read of a GeoPackage or raster. The folder of a result is identified by its ``run_id``; several
    places with one among them are identified by a digest of all (`_identity_of_several`).
    """
    layer = str(named).partition("|")[2].removeprefix("layername=")
    places = places_of(named)
    parts = [{"name": _name(each), "sha256": sha256_of(each), "bytes": each.stat().st_size} for each in _files(places)]
    facts: dict[str, Any] = {"layer": layer or None, **_together(parts)}
    if len(parts) > 1:
        facts["files"] = parts
    if decoded and all(rasters := [rasters_in(place) for place in places]):
        facts["content"] = _content_of_rasters([tile for tiles in rasters for tile in tiles])
    elif decoded and len(places) == 1 and places[0].suffix.lower() == ".gpkg" and places[0].is_file():
        facts["content"] = content_of(places[0], layer)
    if len(places) == 1 and (run_id := _run_id_of(places[0])):
        facts["run_id"] = run_id
    elif any(_run_id_of(each) for each in places):
        facts["run_id"] = _identity_of_several(places)
    return facts


def _files(places: Sequence[Path]) -> list[Path]:
    """Every file that determines what is read from these places."""
    found = [[file for tile in rasters_in(place) for file in raster_files(tile)] or files_of(place) for place in places]
    return list(dict.fromkeys(file for files in found for file in files))


def _content_of_rasters(rasters: Sequence[Path]) -> str | None:
    """The digest of one raster, or of those of all, in order; None if one cannot be read."""
    found = [content_of_raster(each) for each in rasters]
    if len(found) == 1 or None in found:
        return found[0] if len(found) == 1 else None
    return hashlib.sha256("".join(map(str, found)).encode()).hexdigest()


def content_of_raster(place: Path) -> str | None:
    """Digest of all that is read of a raster (`decoded`); one that has not changed is read once per process."""
    stamps = [stamp_of(each) for each in raster_files(place)]
    key = tuple(one for each in stamps for one in each or ())
    if known := _known.get((*key, DECODED)):
        return known
    found = digest_of(place)
    settled_since = time.time_ns() - SETTLED_NS
    unchanged = stamps == [stamp_of(each) for each in raster_files(place)]
    if found and unchanged and all(each and max(each[3:]) < settled_since for each in stamps):
        _known[(*key, DECODED)] = found
    return found


def _run_id_of(place: Path) -> str | None:
    """The run_id of the result whose folder this is."""
    return made_from(place).get("run_id") if files_of(place) == [place / MANIFEST] else None


def _identity_of_several(places: Sequence[Path]) -> str:
    """Digest of their content, in order, without the time in a manifest; and of their names, because results that are
    distinguished by them repeat them.
    """
    digest = hashlib.sha256()
    for each in places:
        known = _run_id_of(each) or (each.suffix.lower() == ".gpkg" and content_of(each))
        known = known or "".join(sha256_of(one) for one in files_of(each))
        digest.update(f"{known}  {each.name}\n".encode())
    return digest.hexdigest()[:16]


def _name(file: Path) -> str:
    """The name that distinguishes a file of an input; manifests of several runs have that of their folder."""
    return f"{file.parent.name}/{file.name}" if file.name == MANIFEST else file.name


def _together(parts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    if len(parts) == 1:
        return {"sha256": parts[0]["sha256"], "bytes": parts[0]["bytes"]}
    lines = "".join(f"{each['sha256']}  {each['name']}\n" for each in parts)
    return {"sha256": hashlib.sha256(lines.encode()).hexdigest(), "bytes": sum(each["bytes"] for each in parts)}


def content_of(path: Path, layer: str = "") -> str | None:
    """Digest of the columns and rows of a GeoPackage's layer, or of all its layers, a ``-wal`` included; None if it
    cannot be read."""
    digest = hashlib.sha256()
    try:
        with _opened(path) as db:
            known = [str(row[0]) for row in db.execute("SELECT table_name FROM gpkg_contents ORDER BY table_name")]
            for table in [layer] if layer in known else [each for each in known if each not in OURS]:
                quoted = '"' + table.replace('"', '""') + '"'
                columns = [row[1:3] for row in db.execute(f"PRAGMA table_info({quoted})")]
                digest.update(marshal.dumps([table, columns, db.execute(CRS_OF_TABLE, (table,)).fetchall()], 2))
                rows = db.execute(f"SELECT * FROM {quoted} ORDER BY rowid")
                while some := rows.fetchmany(ROWS_AT_ONCE):
                    digest.update(marshal.dumps(some, 2))
    except (sqlite3.Error, OSError, UnicodeError):  # damaged names, also in SQLite's own message about them
        return None
    return digest.hexdigest()


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    """Open a GeoPackage for reading without changing anything in it."""
    with settled(path) as place:
        # not immutable while another program has it open with changes that are not merged yet
        mode = "mode=ro" if unmerged(place) else "mode=ro&immutable=1"
        with closing(sqlite3.connect(f"file:{quote(str(place.absolute()))}?{mode}", uri=True)) as db:
            db.text_factory = lambda raw: raw.decode("utf-8", "surrogateescape")  # accept any bytes
            yield db


def compared(record: Mapping[str, Any], named: str | None = None) -> tuple[str, str]:
    """Whether an input is unchanged: `SAME`, `CHANGED` or `GONE`, and the path of the deciding file.

    Parameters
    ----------
    record : mapping
        Record of the input, as in a manifest.
    named : str, optional
        Where to look for it, otherwise the place in the record.
    """
    named = str(record.get("path")) if named is None else named
    places = places_of(named)
    missing = [each for each in places if not each.exists()]
    if missing or not places:
        return GONE, str((missing or [named])[0])
    whole = f"{places[0]}|layername={record['layer']}" if record.get("layer") else named
    try:
        now = of_input(whole, decoded=False)
        if not _agree(now, record) and record.get("content"):
            now = of_input(whole)
    except OSError as error:
        return GONE, str(error.filename or named)
    if _agree(now, record):
        return SAME, named
    before = {each["name"]: each["sha256"] for each in record.get("files", ())}
    for each in now.get("files", ()):
        if before and before.get(each["name"]) != each["sha256"]:
            at = next((str(one) for one in _files(places) if _name(one) == each["name"]), named)
            return CHANGED, at
    return CHANGED, str(places[0])


def _agree(now: Mapping[str, Any], then: Mapping[str, Any]) -> bool:
    return any(now.get(key) is not None and now[key] == then.get(key) for key in ("run_id", "sha256", "content"))


def where_now(record: Mapping[str, Any], now: Path, then: str | None) -> tuple[str, str, str]:
    """Where an input of a manifest is: its path, its state, and the deciding file.

    The original place is tried first, then the place where it would be if everything was moved together; an unchanged
    one is preferred.
    ``now`` and ``then`` are the manifest's folder, and the one that it names.
    """
    named = str(record.get("path"))
    paths = [named]
    if then and not os.path.samefile(now, then) if _both(now, then) else bool(then):
        paths.append(_moved(named, now, str(then)))
    best = (named, GONE, named)
    for each in paths:
        stands, file = compared(record, each)
        if stands == SAME:
            return each, stands, file
        if best[1] == GONE and stands == CHANGED:
            best = (each, stands, file)
    return best


def _both(now: Path, then: str | None) -> bool:
    return bool(then) and now.exists() and os.path.exists(str(then))


def _moved(named: str, now: Path, then: str) -> str:
    moved = []
    for part in named.split(",") if not os.path.exists(named.partition("|")[0]) else [named]:
        file, bar, layer = part.partition("|")
        other = next(iter(moved_paths(file, now, then)), Path(file))
        moved.append(f"{other}{bar}{layer}")
    return ",".join(moved)


def described(named: str) -> dict[str, Any]:
    """Rows and CRS of an input that is a layer, CRS of a raster; unknown values are None."""
    facts: dict[str, Any] = {"rows": None, "crs": None}
    place, layer = places_of(named)[0], str(named).partition("|")[2].removeprefix("layername=")
    with suppress(Exception):  # the tool itself reports what it cannot read
        if (place / MANIFEST).is_file():
            return facts
        if rasters := rasters_in(place):
            import rasterio

            with rasterio.open(rasters[0]) as source:
                facts["crs"] = source.crs.to_string() if source.crs else None
        elif place.suffix.lower() in (".csv", ".txt", ".tsv", ".tab", ".dat"):
            with place.open("rb") as source:
                facts["rows"] = max(0, sum(1 for line in source if line.strip()) - 1)
        elif place.suffix.lower() not in (".pts", ".json"):
            import pyogrio

            with settled(place) as one:
                info = pyogrio.read_info(one, layer=layer or pyogrio.list_layers(one)[0, 0])
            facts |= {"rows": int(info["features"]), "crs": info["crs"]}
    return facts
