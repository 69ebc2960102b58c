"""A site of the paper as a folder: a twin, or a user's data of the real site, in one layout; read and prepared.

The docstring of `reproduce_paper` describes the layout.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from deadwood_algorithms.files.dem_windows import read_dem
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.rasters import write_raster
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.paper import klosters, rothenbrunnen
from deadwood_algorithms.paper.twin import write_site
from deadwood_algorithms.params.tool import UserError

TWINS = {klosters.NAME: klosters.klosters, rothenbrunnen.NAME: rothenbrunnen.rothenbrunnen}
ANY_SHAPE = ("point", "line", "polygon")
NEEDED, OPTIONAL = ("forest", "releases", "lines", "barriers"), ("dams", "flight")
PAPER_FACTS = {
    klosters.NAME: {name: klosters.K[name] for name in klosters.FACTS} | {"road": "road", "beyond": "beyond"},
    rothenbrunnen.NAME: {name: rothenbrunnen.K[name] for name in rothenbrunnen.FACTS}
    | {"road": "road", "jumped_barrier": "south", "takeoff_line": "terrace"},
}


@dataclass(frozen=True)
class Site:
    """Paths of a site's inputs, by name, None for those that it lacks, and its facts (``site.json``)."""

    name: str
    facts: Mapping[str, Any]
    dem: str
    trees: str
    layers: Mapping[str, str | None]


def write_twin(name: str, folder: Path, version: int = 2, **changes: Any) -> None:
    write_site(TWINS[name](version, **changes), folder)


def read_site(name: str, folder: Path, prepared: Path) -> Site:
    """The inputs of a site; tiles of its terrain model are joined into ``prepared``."""
    if not folder.is_dir():
        raise UserError(f"{folder}: the folder of the site {name} does not exist; --help describes the layout")
    layers: dict[str, str | None] = {}
    for part in (*NEEDED, *OPTIONAL):
        place = folder / f"{part}.gpkg"
        if part in NEEDED and not place.is_file():
            raise UserError(f"{place}: this layer of the site is missing; --help describes the layout")
        layers[part] = str(place) if place.is_file() else None
    trees = next((folder / f"trees{end}" for end in (".gpkg", ".csv") if (folder / f"trees{end}").is_file()), None)
    if trees is None:
        raise UserError(f"{folder}: neither trees.gpkg nor trees.csv is there; --help describes the layout")
    facts = dict(PAPER_FACTS[name]) | facts_of(folder / "site.json", set(PAPER_FACTS[name]))
    ids = read_vector(str(folder / "lines.gpkg"), geometry=ANY_SHAPE, target_crs=None, what="lines")
    known = set(ids["line_id"].astype(str)) if "line_id" in ids else set()
    if facts["road"] not in known:
        raise UserError(f"{folder / 'lines.gpkg'}: no line has line_id '{facts['road']}'; name the road so")
    for optional in ("beyond", "takeoff_line"):
        if facts.get(optional) not in known:
            facts[optional] = None
    return Site(name, facts, str(terrain_of(folder, prepared)), str(trees), layers)


def facts_of(path: Path, known: set[str]) -> dict[str, Any]:
    """Values in ``site.json`` that replace the paper's; empty if there is no such file."""
    if not path.is_file():
        return {}
    try:
        facts = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise UserError(f"{path}: not JSON ({error})") from error
    if not isinstance(facts, dict):
        raise UserError(f"{path}: must hold one object of names and values")
    for name, value in facts.items():
        numeric = name.endswith(("_cm", "_m", "_m3", "friction"))
        if numeric and (isinstance(value, bool) or not isinstance(value, (int, float)) or not value > 0):
            raise UserError(f"{path}: '{name}' is {value!r}, but must be a number above 0")
        if name not in known | {"title"}:
            raise UserError(f"{path}: '{name}' is unknown; known are {', '.join(sorted(known))}")
    return facts


def terrain_of(folder: Path, prepared: Path) -> Path:
    """``dem.tif``, or the tiles in ``dem/`` joined."""
    if (folder / "dem.tif").is_file():
        return folder / "dem.tif"
    tiles = sorted((folder / "dem").glob("*.tif"))
    if not tiles:
        raise UserError(
            f"{folder}: neither dem.tif nor a folder dem with tiles (.tif) is there; --help describes the layout"
        )
    joined = prepared / "dem.tif"
    if not joined.is_file():
        import rasterio
        from rasterio.errors import RasterioError
        from rasterio.merge import merge

        prepared.mkdir(parents=True, exist_ok=True)
        partial = prepared / "joining.tif"
        try:
            merge(tiles, dst_path=partial)
            with rasterio.open(partial):
                pass
        except (RasterioError, ValueError) as error:
            raise UserError(f"{folder / 'dem'}: the tiles cannot be joined ({error})") from error
        partial.rename(joined)
    return joined


def write_coarser(dem: str, times: int, path: Path) -> None:
    """The terrain model with cells larger by a factor, each the mean of those it covers."""
    fine = read_dem(dem)
    rows, columns = (size // times for size in fine.shape)
    values = fine.values[: rows * times, : columns * times].astype(np.float64)
    coarse = values.reshape(rows, times, columns, times).mean(axis=(1, 3)).astype(np.float32)
    shift = 0.5 * (times - 1) * fine.cell
    grid = Grid(coarse, fine.cell * times, fine.x0 + shift, fine.y0 + shift, fine.crs, str(path))
    write_raster(path, grid.values, grid, nodata=-9999.0, dtype="float32", units="m")
