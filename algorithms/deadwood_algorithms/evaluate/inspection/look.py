"""A file read as the tools read it in a role: what would be used, what is doubted, or why it cannot be used."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import shapely

from deadwood_algorithms.evaluate.inspection import guess
from deadwood_algorithms.files.axes import axes_of
from deadwood_algorithms.files.columns import number_column, schema_column, warn_implausible, where_of
from deadwood_algorithms.files.crs import LOCAL, crs_name, parse_crs, swiss_code
from deadwood_algorithms.files.input_files import tiles_of
from deadwood_algorithms.files.rasters import is_raster, open_raster
from deadwood_algorithms.files.units import with_schema_names
from deadwood_algorithms.files.vectors import read_table, read_vector
from deadwood_algorithms.intake.doubts import say_all
from deadwood_algorithms.intake.values import CANOPY, FRICTION
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.messages import Hearing
from deadwood_algorithms.params.tool import Feedback, ProgressOnly, Quiet, UserError
from deadwood_algorithms.prepare.trees import columns as tree_columns
from deadwood_algorithms.prepare.trees import status as tree_status
from deadwood_algorithms.prepare.trees.kept import trees_kept, warn_of_doubts
from deadwood_algorithms.prepare.trees.sizes_of_table import LawOptions, TableOptions, sizes
from deadwood_algorithms.prepare.trees.sources import ROLES
from deadwood_algorithms.prepare.trees.table import read_source
from deadwood_algorithms.scene.friction import COLUMNS, warn_of_large
from deadwood_algorithms.schemas import LAYERS, columns_of

# Metres for layers in degrees, which the DEM's CRS replaces in a run.
METRIC = "EPSG:3857"
NOT_USED = "not used"


class Seen(Hearing):
    """What is said while a file is read, each column and what becomes of it, and the options that it needs."""

    def __init__(self, feedback: Feedback) -> None:
        super().__init__(ProgressOnly(feedback))
        self.columns: dict[str, str] = {}
        self.options: list[str] = []
        self.counted = ""


def role_of(path: str) -> tuple[str, str]:
    """What a file is taken for, and why."""
    if is_dem_like(path):
        return guess.of_raster(path)
    rows = read_table(path, what="input")
    return guess.of_rows(rows, path)


def is_dem_like(path: str) -> bool:
    return is_raster(path) or (Path(path).is_dir() and Path(path).suffix.lower() != ".gdb")


def look(path: str, role: str, feedback: Feedback) -> Seen:
    """Read a file in a role; raises `UserError` if it cannot be used."""
    seen = Seen(feedback)
    READERS[role](path, seen)
    return seen


def _terrain(path: str, seen: Seen) -> None:
    _heights(path, seen, "DEM")


def _canopy(path: str, seen: Seen) -> None:
    _heights(path, seen, "canopy")


def _heights(path: str, seen: Seen, what: str) -> None:
    from deadwood_algorithms.files.dem_windows import open_windows

    with open_raster(tiles_of(path)[0], what) as source:
        bare = source.crs is None and not source.gcps[0]
        middle = (source.bounds.left + source.bounds.right) / 2, (source.bounds.bottom + source.bounds.top) / 2
    if bare:
        likely = swiss_code(*middle)
        seen.warn("it names no CRS: give the one that its supplier states", code="no-crs")
        seen.options.append(f"--crs {likely or 'EPSG:...'}")
    with open_windows(path, crs=LOCAL if bare else None, feedback=seen, what=what) as dem:
        values = guess.middle_of(dem.source)
        if what == "canopy":
            say_all(CANOPY, values, path, seen)
        ny, nx = dem.shape
        known = values[np.isfinite(values)]
        span = f", {known.min():.1f} to {known.max():.1f} m in its middle" if known.size else ""
        place = "" if bare else f", {crs_name(dem.crs)}"
        seen.counted = f"{nx} x {ny} cells of {dem.cell:g} m{place}{span}"


def _friction(path: str, seen: Seen) -> None:
    if not is_raster(path):
        frame = read_layer(path, seen, ("polygon",), "friction")
        name = next((each for each in frame.columns if str(each).lower() in COLUMNS), None)
        if name is None:
            raise UserError(f"{where_of(frame)}: the polygons have no field friction or mu; --friction-column names it")
        seen.columns[str(name)] = "friction"
        values = number_column(frame, str(name), minimum=0.0)
    else:
        with open_raster(path, "friction") as source:
            values = guess.middle_of(source).ravel()
            seen.counted = f"{source.width} x {source.height} cells"
        values = values[np.isfinite(values)]
        if values.size and values.min() < 0.0:
            raise UserError(f"{path}: the friction coefficient is {values.min():g} somewhere, but must not be negative")
    warn_of_large(float(np.median(values)) if values.size else 0.0, path, seen)
    say_all(FRICTION, values, path, seen)


def read_layer(path: str, seen: Seen, geometry: tuple[str, ...], what: str) -> Any:
    """A layer in metres; one without CRS is in the DEM's, which is not known here."""
    rows = read_table(path, what=what, geometry=geometry)
    own = getattr(rows, "crs", None)
    target = parse_crs(METRIC) if own is not None and own.is_geographic else None
    frame = read_vector(
        path,
        geometry=geometry,
        target_crs=target,
        crs=LOCAL if target is None else None,
        what=what,
        rows=rows,
        feedback=seen,
    )
    seen.counted = counted(len(frame), "row")
    known = {column.name for column in columns_of(what)} if what in LAYERS else set()
    renamed = {str(each): str(each) for each in rows.columns if each in known}
    again = with_schema_names(rows, what, "", Quiet())
    renamed |= {str(a): str(b) for a, b in zip(rows.columns, again.columns, strict=True) if b in known}
    lower = {"name", "line_id", "barrier_id", "release_id"}
    for each in rows.columns:
        if each != "geometry":
            seen.columns[str(each)] = renamed.get(str(each)) or (
                str(each).lower() if str(each).lower() in lower else NOT_USED
            )
    return frame


def _trees(path: str, seen: Seen) -> None:
    rows = read_table(path, what="single trees")
    own = getattr(rows, "crs", None)
    axes = None if "geometry" in rows else axes_of(rows.columns)
    degrees = own.is_geographic if own is not None else axes is not None and axes.degrees
    metric = own is None or degrees
    ground: Any = SimpleNamespace(crs=parse_crs(METRIC if degrees else LOCAL)) if metric else None
    source = read_source(path, "auto", None, ground, crs=None, feedback=seen)
    frame, layout = source.frame, source.layout
    if axes is not None:
        seen.columns |= {str(axes.x): "easting", str(axes.y): "northing"}
    for role in ROLES:
        if name := tree_columns.find(frame, None, "", getattr(layout, role)):
            seen.columns.setdefault(name, role)
    status = tree_status.status_of(frame, layout, None, None, None, seen)
    crown = tree_columns.crown_column(frame, layout, None, None, source.outlines)
    table, law = TableOptions(trees=path), LawOptions()
    filled = sizes(source, table, law, None, status == tree_status.LIVE, crown, None, seen)
    kept, why = trees_kept(
        source, filled, status, None, min_height_m=table.min_height_m, merge_within_m=0.0, tile_field=None
    )
    warn_of_doubts(source, filled, kept, why, seen)
    for each in rows.columns:
        if each != "geometry":
            seen.columns.setdefault(str(each), NOT_USED)
    dead = int((kept & (status == tree_status.DEAD)).sum())
    if not kept.any():
        raise UserError(f"{where_of(frame)}: no tree is left; {'; '.join(why)}")
    middle = float(np.median(filled.dbh[kept]))
    seen.counted = f"{counted(int(kept.sum()), 'tree')}, of which {dead} dead, median DBH {middle:.2f} cm"
    for each in why:
        seen.note(each, code="left-out")


def _releases(path: str, seen: Seen) -> None:
    frame = read_layer(path, seen, ("point",), "releases")
    for column in LAYERS["releases"].columns:
        if column.name in frame and column.unit:
            warn_implausible(schema_column(frame, column), column, where_of(frame), seen)


def _lines(path: str, seen: Seen) -> None:
    read_layer(path, seen, ("line", "polygon"), "lines")


def _barriers(path: str, seen: Seen) -> None:
    frame = read_layer(path, seen, ("line",), "barriers")
    if "height_m" not in frame:
        raise UserError(f"{where_of(frame)}: no field is understood as the height; --height-field names it")
    column = LAYERS["barriers"].column("height_m")
    warn_implausible(schema_column(frame, column), column, where_of(frame), seen)


def _areas(path: str, seen: Seen) -> None:
    frame = read_layer(path, seen, ("point", "polygon"), "releases")
    area = float(shapely.area(np.asarray(frame.geometry)).sum())
    seen.counted += f", {area / 1e4:.3g} ha" if area else ""


READERS: Mapping[str, Callable[[str, Seen], None]] = {
    "dem": _terrain,
    "chm": _canopy,
    "friction": _friction,
    "trees": _trees,
    "releases": _releases,
    "lines": _lines,
    "areas": _areas,
    "barriers": _barriers,
}
