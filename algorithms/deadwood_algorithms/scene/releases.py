"""From a releases layer to the engine's `Logs`: columns or their defaults, units, and checks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.files.columns import id_column, number_column, schema_column, warn_implausible, where_of
from deadwood_algorithms.files.dem_windows import open_windows
from deadwood_algorithms.files.grid import Grid
from deadwood_algorithms.files.units import say_defaults
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.counts import rows_named
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.scene.default_log import DefaultLog
from deadwood_algorithms.scene.items import Items, digest_of, extent_words, plan_of
from deadwood_algorithms.schemas import ORIENTATIONS, RELEASES
from deadwood_engine import Logs
from deadwood_engine.limits import DENSITY, DIAMETER, LENGTH

if TYPE_CHECKING:
    import geopandas

Array = NDArray[np.float64]
MOST_TURNED_DEG = 3600.0


@dataclass(frozen=True)
class Releases:
    """The logs, and the columns of the releases that results repeat."""

    logs: Logs
    release_id: NDArray[Any]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    dbh_cm: NDArray[np.float64]
    digest: str

    def __len__(self) -> int:
        return self.x.size

    def take(self, rows: NDArray[np.int64] | slice) -> Releases:
        """The logs of these rows; the digest remains that of the layer."""
        return Releases(
            self.logs.take(rows), self.release_id[rows], self.x[rows], self.y[rows], self.dbh_cm[rows], self.digest
        )


@dataclass(frozen=True)
class Group:
    """The logs of one release, for the spread of their deposits."""

    release_id: Any
    rows: NDArray[np.int64]
    centre: tuple[float, float]
    min_runout: Array


def read_releases(path: str, grid: Grid, defaults: Mapping[str, Any], *, feedback: Feedback) -> Releases:
    """Read the released logs; ``defaults`` has the value of each column that the layer may lack."""
    frame = read_vector(path, geometry=("point",), target_crs=grid.crs, what="releases", feedback=feedback)
    return releases_of(frame, grid, defaults, feedback=feedback)


def read_numbered(dem: str, releases: str, crs: str | None, feedback: Feedback) -> geopandas.GeoDataFrame:
    """The layer of releases in the DEM's CRS, each row with its log_id in the whole layer: for parts of a layer."""
    with open_windows(dem, crs=crs, feedback=feedback, look_through=False) as windows:
        frame = read_vector(releases, geometry=("point",), target_crs=windows.crs, what="releases", feedback=feedback)
    frame["log_id"] = read_log_ids(frame)
    return frame


def releases_of(
    frame: geopandas.GeoDataFrame, grid: Grid, defaults: Mapping[str, Any], *, feedback: Feedback
) -> Releases:
    """The released logs of a layer already read."""
    x, y = plan_of(frame)
    log_id = read_log_ids(frame)
    _refuse_off_dem(x, y, log_id, grid, where_of(frame))

    def column(name: str) -> NDArray[np.float64]:
        return schema_column(frame, RELEASES.column(name), defaults[name])

    def size(name: str, limits: tuple[float, float], unit: float = 1.0) -> NDArray[np.float64]:
        """A column within the engine's limits, also if its value is that of the option."""
        least, most = (round(unit * limit, 9) for limit in limits)
        if name not in frame and not least <= defaults[name] <= most:
            flag = "--" + name.replace("_", "-")
            raise UserError(f"{flag}: {defaults[name]:g} is not {least:g} to {most:g}; check the unit")
        return column(name)

    dbh_cm = size("dbh_cm", DIAMETER, 100.0)
    length = size("length_m", LENGTH)
    for name, values in (("dbh_cm", dbh_cm), ("length_m", length)):
        warn_implausible(values, RELEASES.column(name), where_of(frame), feedback)
    _say_overridden(frame, defaults, feedback)
    sizes = {name: defaults[name] for name in ("dbh_cm", "length_m", "density_kg_m3")}
    say_defaults(frame, "releases", sizes, where_of(frame), feedback)
    most = MOST_TURNED_DEG  # of a number of many turns nothing is left but rounding
    turned = number_column(frame, "azimuth_deg", default=defaults["azimuth_deg"], minimum=-most, maximum=most)
    logs = Logs(
        log_id=log_id,
        x=x,
        y=y,
        diameter=dbh_cm / 100.0,
        length=length,
        density=size("density_kg_m3", DENSITY),
        orientation=_orientations(frame, defaults["orientation"]),
        tilt=np.radians(column("tilt_deg")),
        azimuth=np.radians(turned % 360.0),
        speed=column("speed_ms"),
        drop=column("drop_m"),
    )
    release_id = id_column(frame, "release_id") if "release_id" in frame else np.ones(len(frame), np.int64)
    return Releases(logs, release_id, x, y, dbh_cm, digest_of(logs, release_id))


def read_log_ids(frame: geopandas.GeoDataFrame) -> NDArray[np.int64]:
    """Ids: whole, not negative, unique; the row number if the layer has none."""
    if "log_id" not in frame:
        return np.arange(1, len(frame) + 1, dtype=np.int64)
    values = number_column(frame, "log_id", minimum=0.0)
    broken = np.flatnonzero((values != np.floor(values)) | (values >= 2.0**53))
    if broken.size:
        raise UserError(f"{where_of(frame)}, field 'log_id', {rows_named(broken)}: not a whole number below 2^53")
    log_id = values.astype(np.int64)
    _, first, count = np.unique(log_id, return_index=True, return_counts=True)
    if (count > 1).any():
        twice = log_id[first[count > 1][0]]
        rows = np.flatnonzero(log_id == twice)
        raise UserError(
            f"{where_of(frame)}, field 'log_id': {twice} occurs in {rows_named(rows)}; every log needs its own "
            "(without the column the row numbers are used)"
        )
    return log_id


def _say_overridden(frame: geopandas.GeoDataFrame, defaults: Mapping[str, Any], feedback: Feedback) -> None:
    """Warn of options that were set but have no effect, because the layer has their column."""
    idle = []
    for each in fields(DefaultLog):
        given = defaults[each.name]
        if each.name in frame and given != each.default and (frame[each.name] != given).any():
            flag = "--" + each.name.replace("_", "-")
            idle.append(f"{flag} {given:g}" if isinstance(given, float) else f"{flag} {given}")
    if idle:
        feedback.warn(
            f"{where_of(frame)}: {', '.join(idle)}: without effect, because the layer has a column of that name, "
            "which overrides it; change or drop the column",
            code="options-without-effect",
        )


def _orientations(frame: geopandas.GeoDataFrame, default: str) -> NDArray[np.int8]:
    if "orientation" not in frame:
        return np.full(len(frame), ORIENTATIONS.index(default), np.int8)
    names = [str(name).strip().lower() for name in frame["orientation"]]
    for row, name in enumerate(names):
        if name not in ORIENTATIONS:
            raise UserError(
                f"{where_of(frame)}, field 'orientation', row {row + 1}: "
                f"'{name}' is not one of {', '.join(ORIENTATIONS)}"
            )
    return np.array([ORIENTATIONS.index(name) for name in names], np.int8)


def _refuse_off_dem(
    x: NDArray[np.float64], y: NDArray[np.float64], log_id: NDArray[np.int64], grid: Grid, path: str
) -> None:
    off = np.flatnonzero(~grid.contains(x, y))
    if off.size == x.size:
        raise UserError(f"{path}: no release lies on the DEM{extent_words(x, y, grid)}")
    if off.size:
        raise UserError(
            f"{path}, {rows_named(off)}: {off.size} of {x.size} releases lie off the DEM or on its nodata "
            f"(log_id {log_id[off[0]]} at {x[off[0]]:.1f}, {y[off[0]]:.1f}); remove them, or use a larger DEM"
        )


def reached(lines: Items, by_log: Mapping[str, NDArray], releases: Releases) -> NDArray[np.bool_]:
    """Which log reached which line, shape (n, n_lines): it touched the line, or started inside the polygon."""
    return lines.any_row(by_log["reach"]) | starts_inside(lines, releases)


def starts_inside(lines: Items, releases: Releases) -> NDArray[np.bool_]:
    """Which log starts inside which polygon, shape (n, n_lines); none starts inside a line."""
    inside = np.zeros((len(releases), len(lines.ids)), bool)
    for column, shape in enumerate(lines.geometry):
        if shapely.get_dimensions(shape) == 2:
            inside[:, column] = shapely.contains_xy(shape, releases.x, releases.y)
    return inside
