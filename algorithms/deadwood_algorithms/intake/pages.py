"""Whether a file is one page of a web service: what the file itself says about how many features exist.

Services answer with a page (OGC API: 10 by default, ArcGIS: 1000 or 2000, WFS: ``count``), and say so: in the members
``numberMatched``, ``totalFeatures``, ``exceededTransferLimit``, a link ``next``, or in the attributes of GML. A
GeoPackage or shapefile of it says nothing, but has exactly as many rows as a page.
"""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import IO, Any
from xml.etree import ElementTree

from deadwood_algorithms.intake.doubts import Doubt
from deadwood_algorithms.params.counts import counted

# Members, without case, underscores and signs.
TOTALS = ("numbermatched", "totalfeatures", "totalcount", "totalitems", "totalresults", "totalrecords", "totalelements")
TOTALS += ("matched", "numfound", "nhits", "odatacount", "numberoffeatures", "total")
LIMITS = ("exceededtransferlimit", "truncated", "resultstruncated", "hasmore", "hasnext", "hasnextpage")
NEXT = ("next", "nextlink", "odatanextlink", "nextpage", "nextpagetoken", "nextcursor", "nexturl")
PAGES = ("totalpages", "pages", "pagecount", "numpages")
BESIDE = ("properties", "context", "meta", "metadata", "pagination", "paging", "page", "pageinfo", "links", "result")
LARGEST_BYTES = 2**27  # of a file that is read completely; of a larger one the beginning
HEAD_BYTES = 2**16
SIZES = (1000, 2000, 5000, 10_000)  # the largest pages of usual services
JSON, XML = (".json", ".geojson", ".pjson", ".jsonfg", ".topojson"), (".gml", ".xml", ".gfs")


def one_page(path: str | Path, rows: int, *, by_size: bool = False) -> Doubt | None:
    """The doubt about a layer of so many rows, if its file says that there are more; ``by_size``: or says nothing."""
    total, more = said_in(Path(path))
    numbers, code, page = {"rows": rows}, "one-page", "one page of a web service;"
    if total is not None and total > rows:
        text, numbers = f"the file holds {rows} of {total} features, as it says itself", numbers | {"total": total}
    elif more:
        text = f"the file holds {counted(rows, 'feature')}, and says itself that there are more"
    elif by_size and total is None and rows in SIZES:
        text, code = f"the file holds exactly {counted(rows, 'feature')}, as many as services give at once", "page-size"
        page = "is it one page of a web service? Then"
    else:
        return None
    fix = "download all pages (in QGIS: add the service as a layer, then export it)"
    return Doubt(code, f"{text}: {page} {fix}", numbers)


def said_in(path: Path) -> tuple[int | None, bool]:
    """How many features exist, and whether there are more than in the file, as the file says."""
    try:
        if not path.is_file():
            return None, False
        if path.suffix.lower() != ".zip":
            with path.open("rb") as source:
                return _said_by(source, path.suffix.lower(), path.stat().st_size)
        with zipfile.ZipFile(path) as packed:
            inside = [each for each in packed.infolist() if not each.is_dir()]
            if len(inside) == 1 and inside[0].file_size <= LARGEST_BYTES:
                answer = BytesIO(packed.read(inside[0]))
                return _said_by(answer, Path(inside[0].filename).suffix.lower(), inside[0].file_size)
    except (OSError, ValueError, ElementTree.ParseError, zipfile.BadZipFile, RuntimeError, NotImplementedError):
        pass
    return None, False


def _said_by(source: IO[bytes], ending: str, size: int) -> tuple[int | None, bool]:
    if ending in XML:
        return _said_in_xml(source, size)
    return _said_in_json(source, size) if ending in JSON else (None, False)


def _said_in_json(source: IO[bytes], size: int) -> tuple[int | None, bool]:
    if size <= LARGEST_BYTES:
        whole = json.load(source)
        return _of_members(whole) if isinstance(whole, dict) else (None, False)
    head = source.read(HEAD_BYTES).partition(b'"features"')[0].decode("utf-8", "ignore")
    return _of_members(dict(re.findall(r'"([\w@.]+)"\s*:\s*"?(\d+|true)', head)))


def _of_members(members: Mapping[str, Any]) -> tuple[int | None, bool]:
    plain = {re.sub(r"[\W_]", "", str(name)).lower(): value for name, value in members.items()}
    totals = [_count(plain[name]) for name in TOTALS if name in plain]
    more = any(plain.get(name) in (True, "true") for name in LIMITS)
    more |= any(bool(plain.get(name)) for name in NEXT)
    more |= any((_count(plain.get(name)) or 0) > 1 for name in PAGES)
    for name in BESIDE:
        inner = plain.get(name)
        if isinstance(inner, list):
            more |= any(isinstance(each, dict) and re.search(r"\bnext$", str(each.get("rel"))) for each in inner)
        elif isinstance(inner, dict):
            of_inner = _of_members(inner)
            totals.append(of_inner[0])
            more |= of_inner[1]
    return next((each for each in totals if each is not None), None), more


def _said_in_xml(source: IO[bytes], size: int) -> tuple[int | None, bool]:
    """The attributes of the first element, of GML as WFS 2 answers; an answer cut short has an element of that name."""
    _, root = next(ElementTree.iterparse(source, events=("start",)))
    total, more = _of_members({name.rpartition("}")[2]: value for name, value in root.attrib.items()})
    source.seek(max(0, size - HEAD_BYTES))
    return total, more or b"truncatedResponse" in source.read()


def _count(value: Any) -> int | None:
    try:
        return int(value)  # "unknown" is what services say that do not count
    except (TypeError, ValueError):
        return None
