"""Take-off and landing points, and barriers, read from a user's layers.

For `fit_flight`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import geopandas
import numpy as np
import shapely

from deadwood_algorithms.files.accounts import OFF_DEM, account, count_of
from deadwood_algorithms.files.columns import filled_column, schema_column, where_of
from deadwood_algorithms.files.dem_windows import DemWindows
from deadwood_algorithms.files.vectors import read_vector
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.scene.items import ids_of, say_left_out
from deadwood_algorithms.schemas import BARRIERS, RELEASES

ROLES = ("takeoff", "landing")


@dataclass(frozen=True)
class MappedFlight:
    """One flight as it was mapped: its two points in plan [m], and the log."""

    flight_id: Any
    at: str  # how messages name it
    takeoff: tuple[float, float]
    landing: tuple[float, float]
    dbh_cm: float
    length: float  # [m]
    angle_deg: float  # NaN: use that of the terrain

    @property
    def diameter(self) -> float:
        """Diameter of the log [m]."""
        return self.dbh_cm / 100.0


@dataclass(frozen=True)
class Barrier:
    barrier_id: Any
    line: Any  # LineString or MultiLineString
    height: float  # [m]


@dataclass(frozen=True, kw_only=True)
class FlightDefaults:
    """Defaults for flights without the corresponding columns; without a take-off angle that of the terrain is used."""

    dbh_cm: float
    length_m: float
    takeoff_deg: float | None


def read_flights(
    path: str, crs: str | None, defaults: FlightDefaults, dem: DemWindows, feedback: Feedback
) -> list[MappedFlight]:
    """The flights of a layer of lines, or of one of points; ``crs`` is that of a layer that names none."""
    frame = read_vector(
        path, geometry=("line", "point"), target_crs=dem.crs, crs=crs, what="flights", feedback=feedback
    )
    numbers = {
        name: filled_column(frame, name, getattr(defaults, name), minimum=0.0, exclusive=True)
        for name in ("dbh_cm", "length_m")
    }
    numbers["takeoff_deg"] = filled_column(frame, "takeoff_deg", defaults.takeoff_deg, minimum=-85.0, maximum=85.0)
    for name in ("dbh_cm", "length_m"):
        usual = RELEASES.column(name).usual
        assert usual is not None
        if name in frame and not (np.median(numbers[name]) <= usual[1]):
            feedback.warn(
                f"{where_of(frame)}: the median {name} is {np.median(numbers[name]):g}; check the unit",
                code="implausible-size",
                median=float(np.median(numbers[name])),
            )
    kinds = set(shapely.get_dimensions(np.asarray(frame.geometry)))
    if len(kinds) > 1:
        raise UserError(f"{where_of(frame)}: lines and points are mixed; give only lines or only points")
    pairs = _of_lines(frame, feedback) if kinds == {1} else _of_points(frame)
    flights = []
    for flight_id, row, takeoff, landing in pairs:
        at = f"{where_of(frame)}, row {row + 1}"
        if takeoff == landing:
            raise UserError(f"{at}: take-off and landing are the same place")
        of = {name: float(values[row]) for name, values in numbers.items()}
        flights.append(MappedFlight(flight_id, at, takeoff, landing, of["dbh_cm"], of["length_m"], of["takeoff_deg"]))
    account("flights", count_of(len(frame), len(flights) * (1 if kinds == {1} else 2), {}))
    return flights


def read_flight_barriers(path: str | None, crs: str | None, dem: DemWindows, feedback: Feedback) -> list[Barrier]:
    """Read the barriers with their ids and heights; empty if no layer is given."""
    if path is None:
        return []
    frame = read_vector(path, geometry=("line",), target_crs=dem.crs, crs=crs, what="barriers", feedback=feedback)
    heights = schema_column(frame, BARRIERS.column("height_m"))
    ids = ids_of(frame, "barrier_id", "name").tolist()
    shapes = shapely.force_2d(np.asarray(frame.geometry))
    on = shapely.intersects(shapes, shapely.box(*dem.bounds))
    say_left_out(frame, ~on, "barriers", feedback.warn)
    found = [
        Barrier(*each) for each, here in zip(zip(ids, shapes, heights.tolist(), strict=True), on, strict=True) if here
    ]
    account("barriers", count_of(len(frame), len(found), {OFF_DEM: (~on).sum()}))
    return found


Pair = tuple[Any, int, tuple[float, float], tuple[float, float]]


def _of_lines(frame: geopandas.GeoDataFrame, feedback: Feedback) -> list[Pair]:
    pairs = []
    for row, (flight_id, line) in enumerate(
        zip(ids_of(frame, "flight_id", "name").tolist(), frame.geometry, strict=True)
    ):
        if line.geom_type == "MultiLineString":
            raise UserError(f"{where_of(frame)}, row {row + 1}: a line in several parts; split it")
        x, y = shapely.get_coordinates(line).T
        if x.size > 2:
            feedback.note(
                f"{where_of(frame)}, row {row + 1}: of {x.size} vertices only the first and the last count",
                code="vertices-unused",
            )
        pairs.append((flight_id, row, (float(x[0]), float(y[0])), (float(x[-1]), float(y[-1]))))
    return pairs


def _of_points(frame: geopandas.GeoDataFrame) -> list[Pair]:
    """Points that share an id, one of each role; two points alone are take-off and landing in this order."""
    where = where_of(frame)
    places = [(float(point.x), float(point.y)) for point in frame.geometry]
    if len(frame) == 2 and "role" not in frame:
        return [(ids_of(frame, "flight_id").tolist()[0], 0, places[0], places[1])]
    if "role" not in frame:
        lacking = counted(len(frame), "point needs", "points need")
        raise UserError(f"{where}: {lacking} a field 'role', takeoff or landing, and 'flight_id'")
    roles = [str(word).strip().lower().replace("-", "") for word in frame["role"]]
    for row, role in enumerate(roles):
        if role not in ROLES:
            raise UserError(
                f"{where}, field 'role', row {row + 1}: '{frame['role'][row]}' is neither takeoff nor landing"
            )
    ids = ids_of(frame, "flight_id").tolist() if "flight_id" in frame else [1] * len(frame)
    pairs = []
    for flight_id in dict.fromkeys(ids):
        rows = {role: [k for k, each in enumerate(ids) if each == flight_id and roles[k] == role] for role in ROLES}
        for role, found in rows.items():
            if len(found) != 1:
                raise UserError(
                    f"{where}: flight '{flight_id}' has {counted(len(found), 'point')} of the role {role}, not one"
                )
        takeoff, landing = rows["takeoff"][0], rows["landing"][0]
        pairs.append((flight_id, takeoff, places[takeoff], places[landing]))
    return pairs
