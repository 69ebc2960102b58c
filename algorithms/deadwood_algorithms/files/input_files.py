"""Which files the path of an input stands for: itself, its companions, the tiles of a folder, the sources of a VRT.

Standard library only: the command line uses it before any library is loaded.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from deadwood_algorithms.files.sqlite_files import unmerged
from deadwood_algorithms.params.tool import UserError

MANIFEST = "manifest.json"
ENDINGS = (".tif", ".tiff", ".asc", ".img", ".bil", ".flt", ".xyz")  # of the files in a folder that are its tiles
# Companion files with the same name that change the meaning of a file; a style or statistics change nothing.
COMPANIONS = {
    ".shp": (".shx", ".dbf", ".prj", ".cpg"),
    ".asc": (".prj",),
    ".bil": (".hdr", ".prj", ".blw"),
    ".flt": (".hdr", ".prj"),
    ".tif": (".tfw",),
    ".tiff": (".tfw",),
    ".tab": (".dat", ".map", ".id"),
    ".mif": (".mid",),
}
DEEPEST_VRT = 8  # a VRT of VRTs of ...


def tiles_of(path: str | Path) -> list[str]:
    """The files that a path stands for: itself, the rasters in a folder, or the parts between commas."""
    named = str(path)
    try:
        if os.path.isfile(named) or named.endswith(".zarr"):  # a folder, but no tiles
            return [named]
        if os.path.isdir(named):
            if tool := made_from(Path(named)).get("tool"):
                raise UserError(
                    f"{named}: this is the folder of a result of {tool}, not a terrain model; name the file"
                )
            inside = sorted(
                each.name
                for each in Path(named).iterdir()
                if each.suffix.lower() in ENDINGS and not each.name.startswith(".")
            )
            if not inside:
                raise UserError(
                    f"{named}: this is a folder that holds no tile of a DEM ({', '.join(ENDINGS)}); name the file"
                )
            return [os.path.join(named, each) for each in inside]
    except (OSError, ValueError):  # a name too long, a NUL in it, no permission: reported when it is opened
        return [named]
    parts = [each.strip() for each in named.split(",")]
    return [each for each in parts if each] if "," in named else [named]


def places_of(named: str | Path) -> list[Path]:
    """The file or folder that an input's path names, without its layer; if it names several with commas, each of them.

    A part between commas that is not a path is joined to the next, because a name may contain a comma.
    """
    whole = Path(str(named).partition("|")[0])
    if _exists(whole) or "," not in str(named):
        return [whole]
    found, name = [], ""
    for part in str(named).split(","):
        name = f"{name},{part}" if name else part
        place = Path(name.strip().partition("|")[0])
        if name.strip() and _exists(place):
            found.append(place)
            name = ""
    return [*found, Path(name.strip())] if name.strip() else found


def files_of(place: Path) -> list[Path]:
    """Every file that determines what is read from a place; for the folder of a result its manifest, which seals it."""
    if not (_exists(place) and place.is_dir()):
        return list(_with_companions(place))
    if (place / MANIFEST).is_file():
        return [place / MANIFEST]
    try:
        return [each for tile in tiles_of(place) for each in _with_companions(Path(tile))]
    except UserError:
        return sorted(each for each in place.rglob("*") if each.is_file() and not each.name.startswith("."))


def _with_companions(place: Path, depth: int = 0) -> Iterator[Path]:
    yield place
    ending = place.suffix.lower()
    for each in COMPANIONS.get(ending, ()):
        yield from (other for other in (place.with_suffix(each), place.with_suffix(each.upper())) if _exists(other))
    yield from unmerged(place)
    if ending == ".vrt" and depth < DEEPEST_VRT:
        for source in sources_of_vrt(place):
            yield from _with_companions(source, depth + 1)


def sources_of_vrt(place: Path) -> list[Path]:
    """The source files of a VRT of rasters or vectors, each once; none if the file is not a VRT."""
    try:
        root = ElementTree.parse(place).getroot()
    except (OSError, ElementTree.ParseError):
        return []
    return list(dict.fromkeys(source for _element, source in source_elements(root, place.parent)))


def source_elements(root: ElementTree.Element, folder: Path) -> Iterator[tuple[ElementTree.Element, Path]]:
    """The elements of a VRT in ``folder`` that name a source, and the path that each of them means."""
    for each in root.iter():
        if each.tag in ("SourceFilename", "SourceDataset", "SrcDataSource") and (each.text or "").strip():
            relative = (each.get("relativeToVRT") or each.get("relativetoVRT")) == "1"
            source = Path(str(each.text).strip())
            yield each, folder / source if relative else source


def made_from(place: Path) -> dict[str, Any]:
    """The manifest in a folder of a result, or of the result to which a file belongs; empty if there is none."""
    folder = place if _exists(place) and place.is_dir() else place.parent
    try:
        manifest = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return manifest if isinstance(manifest, dict) else {}


def _exists(place: Path) -> bool:
    try:
        return place.exists()
    except (OSError, ValueError):  # a name too long, a NUL in it: reported when it is opened
        return False
