"""Whether a file is one page of a web service: what the file itself says about how many features exist.

Services answer with a page (OGC API: 10 by default, ArcGIS: 1000 or 2000, WFS: ``count``), and say so: in the members
``numberMatched``, ``totalFeatures``, ``exceededTransferLimit``, a link ``next``, or in the attributes of GML.
"""

from __future__ import annotations

import json
import re
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any
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
JSON, XML = (".json", ".geojson", ".pjson", ".jsonfg", ".topojson"), (".gml", ".xml", ".gfs")


def one_page(path: str | Path, rows: int) -> Doubt | None:
    """The doubt about a layer of so many rows, if its file says that there are more."""
    total, more = said_in(Path(path))
    if total is not None and total > rows:
        text, numbers = f"the file holds {rows} of {total} features, as it says itself", {"total": total}
    elif more:
        text, numbers = f"the file holds {counted(rows, 'feature')}, and says itself that there are more", {}
    else:
        return None
    fix = "one page of a web service; download all pages (in QGIS: add the service as a layer, then export it)"
    return Doubt("one-page", f"{text}: {fix}", {"rows": rows, **numbers})


def said_in(path: Path) -> tuple[int | None, bool]:
    """How many features exist, and whether there are more than in the file, as the file says."""
    ending = path.suffix.lower()
    try:
        if ending == ".zip" and path.is_file():
            return _said_in_zip(path)
        if ending in JSON and path.is_file():
            return _said_in_json(path)
        if ending in XML and path.is_file():
            return _said_in_xml(path)
    except (OSError, ValueError, ElementTree.ParseError, zipfile.BadZipFile, RuntimeError, NotImplementedError):
        pass
    return None, False


def _said_in_zip(path: Path) -> tuple[int | None, bool]:
    """What the only file of an archive says."""
    with zipfile.ZipFile(path) as packed, tempfile.TemporaryDirectory() as folder:
        inside = [each for each in packed.infolist() if not each.is_dir()]
        if len(inside) != 1 or inside[0].file_size > LARGEST_BYTES:
            return None, False
        place = Path(folder, "answer").with_suffix(Path(inside[0].filename).suffix)
        place.write_bytes(packed.read(inside[0]))
        return said_in(place) if place.suffix.lower() != ".zip" else (None, False)


def _said_in_json(path: Path) -> tuple[int | None, bool]:
    if path.stat().st_size <= LARGEST_BYTES:
        whole = json.loads(path.read_bytes())
        return _of_members(whole) if isinstance(whole, dict) else (None, False)
    with path.open("rb") as source:
        head = source.read(HEAD_BYTES).partition(b'"features"')[0].decode("utf-8", "ignore")
    found = dict(re.findall(r'"([\w@.]+)"\s*:\s*"?(\d+|true)', head))
    return _of_members(found)


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


def _said_in_xml(path: Path) -> tuple[int | None, bool]:
    """The attributes of the first element, of GML as WFS 2 answers; an answer cut short has an element of that name."""
    with path.open("rb") as source:
        _, root = next(ElementTree.iterparse(source, events=("start",)))
        total, more = _of_members({name.rpartition("}")[2]: value for name, value in root.attrib.items()})
        source.seek(max(0, path.stat().st_size - HEAD_BYTES))
        return total, more or b"truncatedResponse" in source.read()


def _count(value: Any) -> int | None:
    try:
        return int(value)  # "unknown" is what services say that do not count
    except (TypeError, ValueError):
        return None
