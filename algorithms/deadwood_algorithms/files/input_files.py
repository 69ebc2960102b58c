"""Which files a path stands for: tiles of a terrain model count as one input."""

from __future__ import annotations

import os
from pathlib import Path

from deadwood_algorithms.params.tool import UserError

ENDINGS = (".tif", ".tiff", ".asc", ".img", ".bil", ".flt", ".xyz")  # of the files in a folder that are its tiles


def tiles_of(path: str | Path) -> list[str]:
    """The files that a path stands for: itself, the rasters in a folder, or what stands between its commas."""
    named = str(path)
    try:
        if os.path.isfile(named):
            return [named]
        if os.path.isdir(named):
            inside = sorted(each.name for each in Path(named).iterdir() if each.suffix.lower() in ENDINGS)
            if not inside:
                raise UserError(
                    f"{named}: this is a folder that holds no tile of a DEM ({', '.join(ENDINGS)}); name the file"
                )
            return [os.path.join(named, each) for each in inside]
    except (OSError, ValueError):  # a name too long, a NUL in it, no permission: said when it is opened
        return [named]
    parts = [each.strip() for each in named.split(",")]
    return [each for each in parts if each] if "," in named else [named]
