"""The record of a file's origin, stored inside the file: GeoPackage metadata, a GeoTIFF tag, a script in a page.

It is sealed: ``content`` is a digest of what the file holds (rows, pixels as they are read, the page, bytes of any
other format), ``seal`` one of the record itself, so that an edit of either is noticed (`state_of`).
Files in the folder of a result need none: its manifest names and seals them. A format that cannot store it (a CSV
table, a glTF scene) gets ``NAME.manifest.json`` beside it. What is written here contains no time and no number of
threads, so that two equal runs still make the same bytes. Reading a record needs the standard library, and rasterio
only for a GeoTIFF.
"""

from __future__ import annotations

import hashlib
import json
import mmap
import re
import sqlite3
from collections.abc import Callable, Mapping
from contextlib import closing
from contextvars import ContextVar
from pathlib import Path
from typing import Any
from urllib.parse import quote

from deadwood_algorithms.files.identity import CHANGED, SAME, content_of, content_of_raster, sha256_of

BESIDE = ".manifest.json"
CARRIERS = (".gpkg", ".tif", ".tiff", ".html")  # formats that contain their record
# In the default domain of a GeoTIFF: GDAL's copy to the layout of a COG (`geotiff.lay_out`) drops all other domains,
# or, told to keep them, the statistics of the bands.
TAG = "DEADWOOD_MANIFEST"
STANDARD = "urn:deadwood-toolbox:manifest"  # identifies this kind of metadata in a GeoPackage
WRITTEN_AT = "2000-01-01T00:00:00.000Z"  # as in all our GeoPackages, so that the same content gives the same bytes
SPECIFICATION = "http://www.geopackage.org/spec120/#extension_metadata"
PAGE, SCRIPT_END = '<script type="application/json" id="deadwood-manifest">', "</script>\n"
RECORD_IN_PAGE = re.escape(PAGE) + "(.*?)" + SCRIPT_END
TABLES = """
CREATE TABLE IF NOT EXISTS gpkg_extensions (table_name TEXT, column_name TEXT, extension_name TEXT NOT NULL,
    definition TEXT NOT NULL, scope TEXT NOT NULL,
    CONSTRAINT ge_tce UNIQUE (table_name, column_name, extension_name));
CREATE TABLE IF NOT EXISTS gpkg_metadata (id INTEGER CONSTRAINT m_pk PRIMARY KEY ASC NOT NULL,
    md_scope TEXT NOT NULL DEFAULT 'dataset', md_standard_uri TEXT NOT NULL,
    mime_type TEXT NOT NULL DEFAULT 'text/xml', metadata TEXT NOT NULL DEFAULT '');
CREATE TABLE IF NOT EXISTS gpkg_metadata_reference (reference_scope TEXT NOT NULL, table_name TEXT, column_name TEXT,
    row_id_value INTEGER, timestamp DATETIME NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')),
    md_file_id INTEGER NOT NULL, md_parent_id INTEGER,
    CONSTRAINT crmr_mfi_fk FOREIGN KEY (md_file_id) REFERENCES gpkg_metadata(id),
    CONSTRAINT crmr_mpi_fk FOREIGN KEY (md_parent_id) REFERENCES gpkg_metadata(id));
"""
EXTENSION_TABLES = ("gpkg_metadata", "gpkg_metadata_reference")

TIFFS = (".tif", ".tiff")
UNSEALED = "unsealed"  # the state of a file whose record has no seal
# A GeoTIFF gets its record when it is created, because changing a tag later breaks the layout of a COG. These stand in
# for the two digests, which replace them in place.
STAND_INS = {name: hashlib.sha256(f"deadwood-toolbox {name}".encode()).hexdigest() for name in ("content", "seal")}
# The record of what is being written; a GeoTIFF includes it when it is created.
MAKING: ContextVar[Callable[[], Mapping[str, Any]] | None] = ContextVar("MAKING", default=None)


def as_text(record: Mapping[str, Any]) -> str:
    return json.dumps(record, ensure_ascii=False, sort_keys=True)


def tags_now() -> dict[str, str]:
    """The tag for a GeoTIFF that is created now; empty unless a result is being made."""
    making = MAKING.get()
    return {TAG: as_text({**making(), **STAND_INS})} if making else {}


def seal_of_record(record: Mapping[str, Any]) -> str:
    """SHA-256 of a record, or of a manifest, except for this entry."""
    text = json.dumps({key: value for key, value in record.items() if key != "seal"}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def is_sealed(record: Mapping[str, Any]) -> bool:
    """Whether a record, or a manifest, is as it was written, or from before there were seals."""
    return not record.keys() & {"seal", "content", "files"} or record.get("seal") == seal_of_record(record)


def embed(path: Path, made_by: Mapping[str, Any]) -> None:
    """Add a sealed record to a finished file, if its format allows it, or beside it."""
    ending = path.suffix.lower()
    record: dict[str, Any] = (record_in(path) if ending in TIFFS else None) or json.loads(as_text(made_by))
    record["content"] = _content_of(path)
    if record["content"] is None:
        raise OSError(f"{path}: the written file cannot be read back")
    record["seal"] = seal_of_record(record)
    if ending in TIFFS:
        _replace_stand_ins(path, record)
    elif ending == ".gpkg":
        _into_geopackage(path, as_text(record))
    elif ending == ".html":
        page = path.read_text(encoding="utf-8")
        script = PAGE + as_text(record).replace("<", "\\u003c") + SCRIPT_END
        at = page.rfind("</body>")
        path.write_text(page[:at] + script + page[at:] if at >= 0 else page + script, encoding="utf-8")
    else:
        text = json.dumps(record, ensure_ascii=False, indent=2) + "\n"
        path.with_name(path.name + BESIDE).write_text(text, encoding="utf-8")


def _content_of(path: Path) -> str | None:
    """Digest of what a file holds, apart from its record; None if it cannot be read."""
    ending = path.suffix.lower()
    if ending == ".gpkg":
        return content_of(path)
    if ending in TIFFS:
        return content_of_raster(path)
    if ending == ".html":
        page = re.sub(RECORD_IN_PAGE, "", path.read_text(encoding="utf-8"), count=1, flags=re.DOTALL)
        return hashlib.sha256(page.encode()).hexdigest()
    return sha256_of(path)


def state_of(path: Path, record: Mapping[str, Any]) -> str:
    """Whether a file and its record are as they were written: `SAME`, `CHANGED`, or `UNSEALED` if that is unknown."""
    if "seal" not in record and "content" not in record:
        return UNSEALED
    try:
        same = is_sealed(record) and record.get("content") == (_content_of(path) or "")
    except (OSError, ValueError):
        return CHANGED
    return SAME if same else CHANGED


def _replace_stand_ins(path: Path, record: Mapping[str, Any]) -> None:
    with path.open("rb+") as file, mmap.mmap(file.fileno(), 0) as content:
        for name, stand_in in STAND_INS.items():
            at = content.find(stand_in.encode())
            while at >= 0:
                content[at : at + len(stand_in)] = str(record[name]).encode()
                at = content.find(stand_in.encode(), at)


def _into_geopackage(path: Path, text: str) -> None:
    with closing(sqlite3.connect(path)) as db, db:
        db.executescript(TABLES)
        for table in EXTENSION_TABLES:
            db.execute(
                "INSERT INTO gpkg_extensions SELECT ?, NULL, 'gpkg_metadata', ?, 'read-write' WHERE NOT EXISTS "
                "(SELECT 1 FROM gpkg_extensions WHERE table_name = ? AND extension_name = 'gpkg_metadata')",
                (table, SPECIFICATION, table),
            )
        (last,) = db.execute("SELECT COALESCE(MAX(id), 0) FROM gpkg_metadata").fetchone()
        db.execute(
            "INSERT INTO gpkg_metadata VALUES (?, 'dataset', ?, 'application/json', ?)", (last + 1, STANDARD, text)
        )
        db.execute(
            "INSERT INTO gpkg_metadata_reference VALUES ('geopackage', NULL, NULL, NULL, ?, ?, NULL)",
            (WRITTEN_AT, last + 1),
        )


def record_in(path: Path) -> dict[str, Any] | None:
    """The record in a file or beside it; None if there is none."""
    readers = {".gpkg": _of_geopackage, ".html": _of_page}
    readers |= dict.fromkeys(TIFFS, _of_geotiff)
    try:
        if path.is_fifo() or path.is_char_device():
            return None  # reading it might never end
        record = readers.get(path.suffix.lower(), _of_beside)(path)
        found = json.loads(record) if record else None
    except (OSError, ValueError, sqlite3.Error):
        return None
    return found if isinstance(found, dict) and isinstance(found.get("tool"), str) else None


def _of_geopackage(path: Path) -> str | None:
    with closing(sqlite3.connect(f"file:{quote(str(path))}?mode=ro", uri=True)) as db:
        row = db.execute(
            "SELECT metadata FROM gpkg_metadata WHERE md_standard_uri = ? ORDER BY id DESC LIMIT 1", (STANDARD,)
        ).fetchone()
    return str(row[0]) if row else None


def _of_geotiff(path: Path) -> str | None:
    import rasterio
    from rasterio.errors import RasterioError

    try:
        with rasterio.open(path) as source:
            return source.tags().get(TAG)
    except RasterioError:
        return None


def _of_page(path: Path) -> str | None:
    found = re.search(RECORD_IN_PAGE, path.read_text(encoding="utf-8"), re.DOTALL)
    return found.group(1) if found else None


def _of_beside(path: Path) -> str | None:
    beside = path.with_name(path.name + BESIDE)
    return beside.read_text(encoding="utf-8") if beside.is_file() else None
