"""The flight of a log between two points: the unique parabola for a take-off angle, and the log's envelope along it.

For `fit_flight`. All quantities are in the vertical plane of the flight: s [m] is the horizontal distance from the
take-off, z [m] the height above it. Only gravity acts, and the log's axis is parallel to its velocity (paper, section
5.2). The path is therefore z = s tan(angle) - bend s^2, and the log a cylinder of its DBH along the tangent of the
path. A tangent of this path is above it, so no part of the log is ever below the path's parallel curve at half a DBH.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
GRAVITY_MS2 = 9.81  # as the engine has it
TURNS = 100  # of the iteration for the parallel curve; it contracts by DBH over twice the path's radius


@dataclass(frozen=True)
class Flight:
    """A parabola from (0, 0) to (``distance``, ``rise``).

    Attributes
    ----------
    distance : horizontal distance [m], > 0
    rise : height of the landing above the take-off [m], usually negative
    fall : tangent of the take-off angle, positive upward
    """

    distance: float
    rise: float
    fall: float

    @property
    def bend(self) -> float:
        """Half the curvature of the path z(s) [1/m]; not positive where no parabola reaches the landing point."""
        return (self.distance * self.fall - self.rise) / self.distance**2

    @property
    def speed_along(self) -> float:
        """Horizontal speed, which is constant [m/s]."""
        return float(np.sqrt(GRAVITY_MS2 / (2.0 * self.bend)))

    @property
    def duration(self) -> float:
        """Duration of the flight [s]."""
        return self.distance / self.speed_along

    def height(self, s: ArrayLike) -> Array:
        """Height of the centre of mass above the take-off [m]."""
        s = np.asarray(s, float)
        return s * self.fall - self.bend * s**2

    def slope(self, s: ArrayLike) -> Array:
        """Tangent of the path's angle, positive upward."""
        return self.fall - 2.0 * self.bend * np.asarray(s, float)

    def speed(self, s: ArrayLike) -> Array:
        """Speed of the centre of mass [m/s]."""
        return self.speed_along * np.sqrt(1.0 + self.slope(s) ** 2)

    @property
    def apex(self) -> tuple[float, float]:
        """Distance and height of the highest point of the flight [m]: the take-off itself where it only descends."""
        s = float(np.clip(self.fall / (2.0 * self.bend), 0.0, self.distance))
        return s, float(self.height(s))

    def underside(self, s: ArrayLike, radius: float) -> Array:
        """Lowest height of a log of this radius over the places ``s``, at any time of the flight [m].

        The parallel curve: over ``s`` lies the foot of the normal at s - u, where u = radius sin(angle there).
        """
        s = np.asarray(s, float)
        u = np.zeros_like(s)
        for _ in range(TURNS):
            slope = self.slope(s - u)
            u = radius * slope / np.sqrt(1.0 + slope**2)
        slope = self.slope(s - u)
        return self.height(s - u) - radius / np.sqrt(1.0 + slope**2)


def slope_of(s: Array, z: Array) -> float:
    """Slope of the straight line that fits heights along a profile best (least squares)."""
    centred = s - s.mean()
    return float((centred * z).sum() / (centred**2).sum())


def outline(flight: Flight, s: float, length: float, radius: float) -> Array:
    """Corners of a log whose centre is over ``s``, in the plane of the flight [m], shape (5, 2), closed."""
    slope = float(flight.slope(s))
    along = np.array([1.0, slope]) / np.hypot(1.0, slope)
    up = np.array([-along[1], along[0]])
    centre = np.array([s, float(flight.height(s))])
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))
    return np.array([centre + 0.5 * length * a * along + radius * b * up for a, b in corners])
