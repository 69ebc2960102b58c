"""No input is taken from the network unless the user allows it: results must depend on files that still exist tomorrow.

A path that names the network is always rejected. A file that points to it (a GDAL virtual raster or layer, the
description of a map service) is rejected unless the variable `ALLOWED` is set: otherwise the author of such a file
could make this computer request any address. What cannot be detected in the file is forbidden to GDAL by the command
(`deadwood_toolbox.environment`).
"""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path
from xml.etree import ElementTree

from deadwood_algorithms.params.commands import quoted
from deadwood_algorithms.params.tool import UserError

ALLOWED = "DEADWOOD_NETWORK"
# How GDAL and OGR name sources that are not local files: databases, addresses, cloud file systems, servers.
DATABASE = r"^\s*((PG|MySQL|MSSQL|OCI):|postgres(ql)?://)"
ELSEWHERE = re.compile(
    r"\b(https?|ftps?|s3|gs|az|abfss?)://|/vsi(curl|s3|gs|az|adls|oss|swift|hdfs|webhdfs)(_streaming)?[/?]"
    rf"|{DATABASE}|^\s*(PGeo|MongoDBv3|ES|Carto|WFS3?|OAPIF|OGCAPI|WMS|WMTS|WCS|TMS|NGW|EEDAI?|PLScenes|DAAS):",
    re.IGNORECASE,
)
VIRTUAL = ("vrtdataset", "ogrvrtdatasource")
SERVICES = ("gdal_wms", "gdal_wmts", "wcs_gdal", "wmt_ms_capabilities", "wms_capabilities", "tms", "tilemap")
SERVICES += ("ogrwfsdatasource", "wfs_capabilities", "capabilities", "tilemapservice")
FREE_TEXT = ("metadata", "srs", "layersrs", "description", "gcplist", "categorynames", "colortable")
HEAD_BYTES = 4096


def refuse_elsewhere(path: str | Path, what: str) -> None:
    """Raise ``UserError`` for a path that is an address of the network, or a database."""
    if not ELSEWHERE.search(str(path)) or Path(path).exists():
        return
    said = f"{path}: the {what} must be a file on this computer, not"
    if re.match(DATABASE, str(path), re.IGNORECASE):
        copy = quoted(f"{what.replace(' ', '_')}.gpkg")
        raise UserError(f"{said} a database; write the table to one: ogr2ogr -f GPKG {copy} {quoted(path)} TABLE")
    raise UserError(f"{said} a network address; download it, and give the file")


def refuse_pointers(path: str | Path, what: str) -> None:
    """Raise ``UserError`` for a file that points to the network, to a pipe or to a device."""
    _look_into(Path(path), str(path), what, set(), os.environ.get(ALLOWED, "0") not in ("", "0"))


def is_special(path: Path) -> bool:
    """Whether reading it may wait or continue for ever: a pipe, a socket or a device."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def _look_into(file: Path, named: str, what: str, seen: set[Path], allowed: bool) -> None:
    root = _root_of(file, named, what)
    if root is None or file in seen:
        return
    seen.add(file)
    kind = root.tag.rpartition("}")[2].lower()
    if kind in SERVICES and not allowed:
        raise UserError(_refusal(named, what, "a service of the network"))
    if kind not in VIRTUAL:
        return
    for element, inside in _elements(root):
        text = (element.text or "").strip()
        if ELSEWHERE.search(text) or element.tag.lower() in SERVICES:
            if not allowed:
                raise UserError(_refusal(named, what, text[:100] or "a service of the network"))
            continue
        if not text or len(text) > HEAD_BYTES or "\n" in text or inside == "sql":
            continue
        relative = element.get("relativeToVRT") == "1" or element.get("relativetoVRT") == "1"
        source = file.parent / text if relative else Path(text)
        if is_special(source):
            raise UserError(f"{named}: the {what} file points to {text}, which is a pipe or a device, not a file")
        if source.is_file():
            _look_into(source, named, what, seen, allowed)


def _elements(root: ElementTree.Element) -> list[tuple[ElementTree.Element, str]]:
    """All elements except those of free text, such as metadata, which may legitimately contain an address."""
    found, todo = [], [root]
    while todo:
        element = todo.pop()
        kind = element.tag.rpartition("}")[2].lower()
        if kind in FREE_TEXT:
            continue
        found.append((element, "sql" if kind in ("srcsql", "expression") else kind))
        todo += list(element)
    return found


def _root_of(file: Path, named: str, what: str) -> ElementTree.Element | None:
    """The XML of a virtual raster or layer, or of a service; None for any other file.

    GDAL reads some that are not valid XML (blanks or a comment before the head); these cannot be inspected.
    """
    head = b""
    try:
        with file.open("rb") as source:
            head = source.read(HEAD_BYTES)
            if not any(f"<{kind}".encode() in head.lower() for kind in (*VIRTUAL, *SERVICES)):
                return None
            return ElementTree.fromstring((head + source.read()).lstrip())
    except OSError:
        return None  # reported when it is opened
    except (ElementTree.ParseError, ValueError) as error:
        if not any(f"<{kind}".encode() in head.lower() for kind in VIRTUAL):
            return None
        raise UserError(
            f"{named}: the {what} file, or one that it points to, is a virtual raster that cannot be inspected "
            f"({error})"
            "; write it again (gdalbuildvrt), or give the files themselves"
        ) from error


def _refusal(named: str, what: str, address: str) -> str:
    return (
        f"{named}: the {what} file points to the network ({address}), which is not followed; download what it "
        f"points to, or set {ALLOWED}=1 to allow it"
    )
