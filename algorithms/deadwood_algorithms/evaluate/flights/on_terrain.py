"""A mapped flight on the terrain: its parabola, the terrain below it, and the barriers that it passes.

For `fit_flight`. Heights here are those of the DEM; heights in a `Flight` are relative to its take-off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from deadwood_algorithms.evaluate.flights.from_layers import Barrier, MappedFlight
from deadwood_algorithms.evaluate.flights.parabola import Flight, slope_of
from deadwood_algorithms.files.dem_windows import DemWindows
from deadwood_algorithms.params.tool import UserError

Array = NDArray[np.float64]
PATH_STEP_M = 0.5  # between the vertices of the path that is written
BESIDE_M = 20.0  # of terrain shown before the take-off and beyond the landing


@dataclass(frozen=True)
class Crossing:
    """A barrier under a flight; the clearance is that of the log's underside above its top [m]."""

    flight_id: Any
    barrier_id: Any
    place: Any  # of the top, Point Z
    distance: float
    ground: float
    height: float
    clearance: float
    speed: float
    free: bool  # the whole log is in the air while it passes

    def record(self) -> dict[str, Any]:
        return {
            "flight_id": self.flight_id,
            "barrier_id": self.barrier_id,
            "distance_m": self.distance,
            "height_m": self.height,
            "clearance_m": self.clearance,
            "speed_ms": self.speed,
            "free": int(self.free),
        }


@dataclass(frozen=True)
class Followed:
    """A flight and the terrain under it.

    ``s`` and ``ground`` are its profile [m], from before the take-off (s < 0) to beyond the landing; ``start`` is the
    height of the centre of mass at the take-off.
    """

    mapped: MappedFlight
    flight: Flight
    terrain_angle: bool
    start: float
    s: Array
    ground: Array
    cut: float
    crossings: list[Crossing]
    verdict: str

    @property
    def between(self) -> NDArray[np.bool_]:
        return (self.s >= 0.0) & (self.s <= self.flight.distance) & np.isfinite(self.ground)

    def place(self, s: Any) -> tuple[Array, Array]:
        """Plan position of places along the flight [m]."""
        share = np.asarray(s, float) / self.flight.distance
        (x0, y0), (x1, y1) = self.mapped.takeoff, self.mapped.landing
        return x0 + share * (x1 - x0), y0 + share * (y1 - y0)

    def path(self) -> Any:
        """The path of the centre of mass, LineString Z; a straight line if no parabola exists."""
        steps = max(20, int(np.ceil(self.flight.distance / PATH_STEP_M)))
        s = np.linspace(0.0, self.flight.distance, steps + 1)
        rise = self.flight.height(s) if self.flight.bend > 0.0 else self.flight.rise * s / self.flight.distance
        return shapely.linestrings(np.column_stack([*self.place(s), self.start + rise]))

    def record(self) -> dict[str, Any]:
        flight, flies = self.flight, self.flight.bend > 0.0
        above = self.start + flight.height(self.s) - self.ground
        least = min((each.clearance for each in self.crossings), default=np.nan)
        apex = flight.apex if flies else (np.nan, np.nan)

        def known(value: Any) -> float:
            return float(value) if flies else np.nan

        return {
            "flight_id": self.mapped.flight_id,
            "verdict": self.verdict,
            "distance_m": flight.distance,
            "fall_m": -flight.rise,
            "takeoff_deg": float(np.degrees(np.arctan(flight.fall))),
            "angle_from": "terrain" if self.terrain_angle else "given",
            "takeoff_speed_ms": float(flight.speed(0.0)) if flies else np.nan,
            "duration_s": flight.duration if flies else np.nan,
            "apex_distance_m": apex[0],
            "apex_rise_m": apex[1],
            "landing_speed_ms": float(flight.speed(flight.distance)) if flies else np.nan,
            "landing_deg": float(np.degrees(np.arctan(flight.slope(flight.distance)))) if flies else np.nan,
            "height_max_m": known(np.max(above[self.between], initial=0.0)),
            "cut_m": self.cut,
            "clearance_min_m": least,
            "dbh_cm": self.mapped.dbh_cm,
            "length_m": self.mapped.length,
        }

    def lines(self) -> list[str]:
        """The most important results, as lines of text."""
        of = self.record()
        head = f"{of['flight_id']}: {of['verdict']}"
        if self.flight.bend <= 0.0:
            where = f"{of['distance_m']:.1f} m away and {of['fall_m']:.1f} m down"
            return [f"{head}; a log that takes off at {of['takeoff_deg']:.1f}° does not reach any point {where}"]
        lines = [
            f"{head}; take-off at {of['takeoff_speed_ms']:.1f} m/s and {of['takeoff_deg']:.1f}° ({of['angle_from']}), "
            f"{of['duration_s']:.2f} s in the air over {of['distance_m']:.1f} m and {of['fall_m']:.1f} m down, "
            f"up to {of['height_max_m']:.1f} m above the terrain"
        ]
        for each in self.crossings:
            word = "over" if each.clearance > 0.0 else "into"
            lines.append(
                f"  {word} barrier {each.barrier_id} ({each.height:g} m) after {each.distance:.1f} m, "
                f"clearance {each.clearance:.2f} m" + ("" if each.free else ", with one end still on the ground")
            )
        return lines


def follow(
    mapped: MappedFlight, barriers: list[Barrier], dem: DemWindows, *, slope_over_m: float, tolerance_m: float
) -> Followed:
    """The parabola of a mapped flight, with its terrain and barriers.

    The terrain over ``slope_over_m`` [m] before the take-off gives the angle if none is mapped; it may protrude into a
    flight by ``tolerance_m`` [m].
    """
    start, end = np.array(mapped.takeoff), np.array(mapped.landing)
    distance = float(np.hypot(*(end - start)))
    along = (end - start) / distance

    def ground_at(s: Array) -> Array:
        return dem.height(start[0] + s * along[0], start[1] + s * along[1])

    ends = ground_at(np.array([0.0, distance]))
    for name, height in zip(("take-off", "landing"), ends, strict=True):
        if np.isnan(height):
            raise UserError(f"{mapped.at}: the {name} lies off the DEM or on its nodata; check the CRS of both")
    angle = np.tan(np.radians(mapped.angle_deg))
    if np.isnan(angle):
        before = np.linspace(-slope_over_m, 0.0, 1 + max(2, int(np.ceil(4.0 * slope_over_m / dem.cell))))
        heights = ground_at(before)
        if np.isnan(heights).any():
            raise UserError(
                f"{mapped.at}: the terrain is unknown on part of the {slope_over_m:g} m before the take-off "
                "(--slope-over-m); shorten them, or give --takeoff-deg"
            )
        angle = slope_of(before, heights)
    flight = Flight(distance, float(ends[1] - ends[0]), float(angle))

    step = dem.cell / 4.0
    s = np.concatenate(
        [
            np.arange(-BESIDE_M, 0.0, step),
            np.linspace(0.0, distance, 1 + int(np.ceil(distance / step))),
            distance + np.arange(step, BESIDE_M + step, step),
        ]
    )
    ground = ground_at(s)
    lift = 0.5 * mapped.diameter * float(np.hypot(1.0, angle))  # so that the underside leaves from the ground
    start_height = float(ends[0]) + lift
    if flight.bend <= 0.0:
        return Followed(
            mapped, flight, np.isnan(mapped.angle_deg), start_height, s, ground, np.nan, [], "above_launch_line"
        )
    inside = (s >= 0.0) & (s <= distance)
    # Compare with the parabola of a point on the ground, which meets the ground at both ends whatever the log's
    # thickness.
    cut = float(np.nanmax(ground[inside] - ends[0] - flight.height(s[inside]), initial=0.0))
    crossings = _crossings(mapped, flight, start_height, barriers, ground_at)
    if cut > tolerance_m:
        verdict = "cuts_terrain"
    else:
        verdict = "hits_barrier" if any(each.clearance <= 0.0 for each in crossings) else "possible"
    return Followed(mapped, flight, np.isnan(mapped.angle_deg), start_height, s, ground, cut, crossings, verdict)


def _crossings(
    mapped: MappedFlight, flight: Flight, start: float, barriers: list[Barrier], ground_at: Any
) -> list[Crossing]:
    """Every place where the flight crosses a barrier's line in plan, in the order of the flight."""
    track = shapely.LineString([mapped.takeoff, mapped.landing])
    found = []
    for barrier in barriers:
        for x, y in shapely.get_coordinates(shapely.intersection(track, barrier.line)):
            s = float(np.hypot(x - mapped.takeoff[0], y - mapped.takeoff[1]))
            ground = float(ground_at(np.array([s]))[0])
            if np.isnan(ground):
                raise UserError(
                    f"{mapped.at}: barrier {barrier.barrier_id} stands on nodata of the DEM where it is crossed"
                )
            top = ground + barrier.height
            clearance = start + float(flight.underside(s, mapped.diameter / 2.0)) - top
            half = 0.5 * mapped.length / float(np.hypot(1.0, flight.slope(s)))
            free = half <= s <= flight.distance - half
            found.append(
                Crossing(
                    mapped.flight_id,
                    barrier.barrier_id,
                    shapely.Point(x, y, top),
                    s,
                    ground,
                    barrier.height,
                    clearance,
                    float(flight.speed(s)),
                    free,
                )
            )
    return sorted(found, key=lambda each: each.distance)
